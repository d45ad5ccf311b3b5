"""How near a motion is to other contacts, against dense samples of the motion."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

import flipflow as ff
from flipflow.model.contact_law import ContactLaw
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.near_grazing import near_grazing

pytestmark = pytest.mark.numerical
SAMPLES = 20_000


@pytest.mark.parametrize("law", get_args(ContactLaw))
def test_the_shallowest_contact_or_opening(law):
    """Under a law whose damper lets go where the way turns back, its summit ends a segment."""
    stop = ff.ClearanceSpring([0.0, 1.0], 66.8, 1.53, 0.1, 0.28, law=law)
    K = np.array([[3.61, -2.18], [-2.18, 2.18]])
    machine = ff.MechanicalSystem(
        np.diag([2.14, 1.7]), 0.0426 * K, K, (stop,), ff.HarmonicForce([0.64, -0.6]),
        static_force=[0.03, -0.47],
    )  # fmt: skip
    solver = ExactSolver(machine, half_turn=False)
    branch = ff.frequency_response(machine, (0.5, 1.6))
    touching = [k for k in range(0, branch.omega.size, 5) if branch.orbit(k).touches]
    assert len(touching) > 20
    for k in touching:
        orbit = branch.orbit(k)
        assert solver.residual(orbit.state, orbit.omega) is not None
        _, depth = near_grazing(solver.problem, solver.scratch, orbit.omega)
        y = orbit.displacement(1, orbit.period * np.arange(SAMPLES) / SAMPLES)
        turns = np.array([])
        for side, gap in zip((1.0, -1.0), stop.gaps, strict=True):
            deep = side * y - gap
            turns = np.append(turns, deep[_tops(deep) & (deep > 0.0)])
            # An opening is a valley outside both gaps.
            opened = (deep < 0.0) & (-side * y < (stop.gaps[1] if side > 0.0 else stop.gaps[0]))
            turns = np.append(turns, -deep[_tops(-deep) & opened])
        assert depth == pytest.approx(turns.min(), rel=1e-4, abs=1e-6)


def _tops(y):
    return (y >= np.roll(y, 1)) & (y > np.roll(y, -1))
