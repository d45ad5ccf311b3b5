"""Speeds at which the motion returns end at the refined points, not at points of the branch."""

from __future__ import annotations

import pytest

import flipflow as ff
from flipflow.analyses.feasible import STABILITY, case_window

SPAN = (40.0, 75.0)


@pytest.mark.parametrize("points", [40, 400])
def test_stable_speeds_end_where_symmetry_is_lost(screen, points):
    """Row 25: e = 2 mm, the symmetric motion is unstable between 56.9837 and 58.4409 rad/s.

    With 40 points the whole window lies within two steps of the branch.
    """
    narrow = screen.replace(clearance=2e-3)
    branch = ff.frequency_response(narrow, SPAN, ff.PiecewiseExact(points=points))
    window = case_window(narrow, ff.Load(name="empty"), branch, ff.Limits(), SPAN)
    broken = [p.omega for p in branch.points_of("symmetry breaking")]
    assert window.intervals[STABILITY] == ((SPAN[0], broken[0]), (broken[1], SPAN[1]))
    assert broken == pytest.approx([56.9837, 58.4409], abs=1e-3)
