"""Speeds at which the motion returns end at the refined points, not at points of the branch."""

from __future__ import annotations

import pytest

import flipflow as ff
from flipflow.continuation.branch import Branch
from flipflow.studies.feasible import STABILITY, case_window

pytestmark = pytest.mark.numerical
SPAN = (40.0, 75.0)


@pytest.mark.parametrize("points", [40, 400])
def test_stable_speeds_end_where_symmetry_is_lost(screen, points):
    """e = 2 mm, the symmetric motion is unstable between 56.9837 and 58.4409 rad/s.

    With 40 points the whole window lies within two steps of the branch.
    """
    narrow = screen.replace(clearance=2e-3)
    branch = ff.frequency_response(narrow, SPAN, ff.PiecewiseExact(points=points))
    window = case_window(narrow, ff.Load(name="empty"), branch, ff.Limits(), SPAN)
    broken = [p.omega for p in branch.points_of("symmetry breaking")]
    assert window.intervals[STABILITY] == ((SPAN[0], broken[0]), (broken[1], SPAN[1]))
    assert broken == pytest.approx([56.9837, 58.4409], abs=1e-3)


@pytest.mark.parametrize("points", [40, 300])
def test_stable_speeds_end_at_the_fold_itself(screen, points):
    """Not at the last point before it, and no motion from behind it counts."""
    branch = ff.frequency_response(screen, (100.0, 250.0), ff.PiecewiseExact(points=points))
    window = window_of(screen, branch, (100.0, 206.5), relative_amplitude=(0.02, 0.05))
    ((_, end),) = window.intervals["relative_amplitude"]
    assert end == branch.folds[0].omega
    assert window.intervals[STABILITY] == ((100.0, 206.5),)
    assert window.notes == ()


def test_an_end_that_cannot_be_solved_for_narrows_the_window(screen, monkeypatch):
    """20 mm are reached at 167.1 rad/s; where that motion is not found the interval ends before."""
    branch = ff.frequency_response(screen, (100.0, 190.0))
    exact = window_of(screen, branch, (100.0, 190.0), relative_amplitude=(0.0, 0.02))
    own = Branch.solve_in

    def lost(self, run, omega):
        return own(self, run, omega) if omega in (100.0, 190.0) else None

    monkeypatch.setattr(Branch, "solve_in", lost)
    window = window_of(screen, branch, (100.0, 190.0), relative_amplitude=(0.0, 0.02))
    ((_, end),) = exact.intervals["relative_amplitude"]
    ((_, narrower),) = window.intervals["relative_amplitude"]
    assert end - 1.0 < narrower < end
    (note,) = window.notes
    assert "relative amplitude" in note
    assert "counts as broken" in note


def test_speeds_without_a_motion_that_lasts_are_said(screen):
    """Past its fold at 394.9 rad/s this machine has unstable motions only, and says so."""
    restless = screen.replace(
        main_mass=1273.7243, floating_mass=224.77805, isolation_damping=2926.2439,
        shear_damping=2719.1742, stop_stiffness=29106997.0, stop_damping=1085.9144,
        clearance=0.0, clearance_minus=8.930106862626047e-3,
    )  # fmt: skip
    region = ff.operating_region(restless, omega=(250.0, 450.0))
    ends = region.cases[0].intervals[STABILITY]
    assert ends == ((250.0, region.branch.folds[0].omega),)
    assert any("no stable motion at 3771.2 to 4297.2 rpm" in note for note in region.notes)


def window_of(screen, branch, span, **limits):
    return case_window(screen, ff.Load(name="empty"), branch, ff.Limits(**limits), span)
