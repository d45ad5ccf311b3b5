"""Machines with so many stops that a motion meets few of their contact states."""

import numpy as np
import pytest

import flipflow as ff
from flipflow.periodic.balance_solver import BalanceSolver

pytestmark = pytest.mark.numerical
OMEGA = 0.9


@pytest.fixture(scope="module")
def system():
    """Five masses with a stop each, excited at different moments of the turn."""
    draw = np.random.default_rng(1)
    K = np.diag(draw.uniform(0.5, 3.0, 5))
    stops = [
        ff.ClearanceSpring(np.eye(5)[k], 3.0, 0.05, float(draw.uniform(0.3, 1.0))) for k in range(5)
    ]
    force = ff.HarmonicForce(np.exp(1j * draw.uniform(0.0, 6.0, 5)))
    return ff.MechanicalSystem(np.eye(5), 0.05 * np.eye(5), K, stops, force)


def test_series_of_half_a_turn_knows_the_contacts_of_the_other_half(system):
    """The equations walk half a turn; the mirrored configurations are met by the motion alone."""
    solver = BalanceSolver(system, 3, half_turn=True)
    point = solver.solve(np.full(solver.unknowns, 0.01), OMEGA)
    assert point is not None
    motion = solver.motion(point.u, OMEGA)
    t = np.linspace(0.0, motion.period / 2.0, 9)
    there, back = motion.derivative(t, 0), motion.derivative(t + motion.period / 2.0, 0)
    assert np.abs(there).max() > 0.5
    assert back == pytest.approx(-there, abs=1e-9)
    sides = [(one.spring, one.side) for one in motion.contact_intervals()]
    assert sorted(sides) == sorted((spring, -side) for spring, side in sides)
