"""The steps along a branch: order of the predictor, and what is recorded on the way."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import flipflow as ff
from flipflow.compiled.eigen import eigenvalues as eigenvalues_of
from flipflow.continuation import correction
from flipflow.continuation.correction import new_corrector
from flipflow.continuation.frequency_loop import NOTHING
from flipflow.dynamics.assembly import machine_arrays
from flipflow.dynamics.flow import new_flow
from flipflow.periodic.stability import determinant_minus, determinant_plus
from kernel_calls import number_of, predicted

pytestmark = pytest.mark.numerical
ANYWHERE = correction.Course(1.0, 100.0, 1.0, 1.0, 1.0, correction.QUICK)
TURN = 1.0 / math.sqrt(2.0)


def helix(s: float) -> np.ndarray:
    """A curve of unit speed in (u, omega)."""
    return np.array([math.cos(s * TURN), math.sin(s * TURN), 10.0 + s * TURN])


def helix_tangent(s: float) -> np.ndarray:
    return TURN * np.array([-math.sin(s * TURN), math.cos(s * TURN), 1.0])


def distance_from_helix(step: float, bends: bool) -> float:
    """How far the guess lies from the curve, a step beyond two points a step apart."""
    work = new_corrector(2, np.zeros(0))
    work.behind[:], work.behind_tangent[:] = helix(-step), helix_tangent(-step)
    work.here[:], work.before[:] = helix(0.0), helix_tangent(0.0)
    assert predicted(work, step, ANYWHERE, bends) == NOTHING
    near = minimize_scalar(
        lambda s: float(np.linalg.norm(helix(s) - work.guess)),
        bounds=(0.5 * step, 1.5 * step), method="bounded", options={"xatol": 1e-12},
    )  # fmt: skip
    return float(near.fun)


@pytest.mark.parametrize(("bends", "order"), [(True, 4.0), (False, 2.0)])
def test_order_of_the_predictor(bends: bool, order: float) -> None:
    """Four along the cubic; two along the tangent, where the contacts have changed."""
    steps = np.array([0.4, 0.2, 0.1])
    off = [distance_from_helix(float(step), bends) for step in steps]
    slopes = np.diff(np.log(off)) / np.diff(np.log(steps))
    assert slopes == pytest.approx([order, order], abs=0.1)


def test_points_solved_for_elsewhere_stand_at_phase_zero() -> None:
    """What is carried there along the last flown motion solves the equations there.

    Newton's last step, 1e-6 of a step along the branch at most, leaves an error of its square; the
    tangent is that of the iterate, an error of the step itself.
    """
    branch = ff.frequency_response(ff.load("ffs0827"), (150.0, 230.0))
    solver, traced = branch.formulation.solver(), branch.traced
    elsewhere = np.flatnonzero(traced.record.phase != 0.0)
    assert elsewhere.size > 100
    for p in elsewhere:
        u, omega = traced.u[p], float(traced.omega[p])
        amplitude = np.hypot(u[:2], u[2:] / omega).max()
        size = amplitude * np.array([1.0, 1.0, omega, omega])
        r, J = solver.residual(u, omega)
        assert np.abs(r / size).max() < 1e-11
        turn = J * traced.tangent[p] / size[:, None]
        assert np.abs(turn.sum(axis=1)).max() < 1e-4 * np.abs(turn).max()


@pytest.mark.parametrize("method", [ff.PiecewiseExact(), ff.HarmonicBalance(3)], ids=repr)
def test_two_newton_steps_are_enough_at_most_points(method) -> None:
    """Along the tangent alone it is two points in three or fewer."""
    branch = ff.frequency_response(ff.load("ffs0827"), (5.0, 250.0), method)
    assert np.mean(branch.traced.record.iterations <= 2) > 0.9


@pytest.mark.parametrize("method", [ff.PiecewiseExact(), ff.HarmonicBalance(9)], ids=repr)
@pytest.mark.parametrize("clearance_minus", [None, 9e-3], ids=["even gaps", "uneven gaps"])
def test_recorded_depths_are_those_of_the_motion(method, clearance_minus) -> None:
    """Read off while the branch is followed, against the extremes of each point by itself."""
    screen = ff.load("ffs0827")
    if clearance_minus is not None:
        screen = screen.replace(clearance_minus=clearance_minus)
    branch = ff.frequency_response(screen, (60.0, 130.0), method)
    solver = branch.formulation.solver()
    low, high = solver.gap_extremes(branch.traced.u, branch.omega)
    plus, minus = solver.springs[0].gaps
    depth = np.stack([high - plus, -low - minus], axis=2)
    assert (depth > 0.0).any()
    assert (depth < 0.0).any()
    assert branch.traced.depth == pytest.approx(depth, abs=1e-9)


@pytest.mark.parametrize("symmetric", [True, False])
def test_multipliers_without_contact_are_those_of_the_return_map(symmetric: bool) -> None:
    screen = ff.load("ffs0827")
    if not symmetric:
        screen = screen.replace(clearance_minus=9e-3)
    branch = ff.frequency_response(screen, (20.0, 100.0))
    free = (branch.traced.depth < 0.0).all(axis=(1, 2))
    assert 0 < free.sum() < free.size
    solver = branch.formulation.solver()
    closed = solver.eigenvalues(branch.traced, branch.return_maps)
    for ours, expected in zip(closed, eigenvalues_of(branch.return_maps), strict=True):
        gaps = np.abs(ours[:, None] - expected[None, :])
        assert gaps.min(axis=0).max() < 1e-7
        assert gaps.min(axis=1).max() < 1e-7


def test_determinants_of_maps_that_are_not_known() -> None:
    """Where the flow failed there is no map; that is no reason for a warning."""
    maps = np.stack([np.full((4, 4), np.nan), 0.5 * np.eye(4)])
    assert determinant_plus(maps) == pytest.approx([np.nan, 1.5**4], nan_ok=True)
    assert determinant_minus(maps) == pytest.approx([np.nan, 0.5**4], nan_ok=True)


def record_of(*touches: tuple[int, int]):
    """The record of a flow in which springs are touched and left one after the other."""
    springs = [ff.ClearanceSpring(np.eye(3)[k], 1.0, 0.1, 1.0) for k in range(3)]
    system = ff.MechanicalSystem(np.eye(3), np.eye(3), np.eye(3), springs, ff.Unbalance(np.ones(3)))
    flow = new_flow(machine_arrays(system))
    flow.segments[0] = 2 * len(touches) + 1
    for k, (spring, side) in enumerate(touches):
        flow.spring[2 * k : 2 * k + 2] = spring
        flow.regimes[2 * k + 1, spring] = side
    return flow


def test_the_number_of_a_record_tells_springs_and_sides():
    """Springs 0 and 2 are not twice spring 1, and a side is told where the whole turn is flown."""
    both, twice = record_of((0, 1), (2, 1)), record_of((1, 1), (1, 1))
    assert number_of(both, True) != number_of(twice, True)
    assert number_of(both, True) == number_of(record_of((2, 1), (0, 1)), True)
    plus, minus = record_of((1, 1)), record_of((1, -1))
    assert number_of(plus, True) != number_of(minus, True)
    assert number_of(plus, False) == number_of(minus, False) != 0
    assert number_of(record_of(), True) == 0
