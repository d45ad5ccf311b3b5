"""Motions over a field, and curves in two: their Jacobians, Newton, the machine as a series."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import flipflow as ff
from flipflow.compiled import status
from flipflow.compiled.arrays import Real
from flipflow.continuation.conditions import FLIP, GRAZING, MOTION, PAIR, SADDLE_NODE
from flipflow.continuation.field_solver import MOTIONS, FieldSolver, Sought
from flipflow.dynamics.assembly import machine_arrays
from flipflow.dynamics.machine_series import machine_series
from judge import close
from kernel_calls import residual_of, series_machine, varied, varied_to

pytestmark = pytest.mark.numerical
BOUNDS = (2e-3, 9e-3)


STIFFNESS = (5e6, 11e6)
CURVES = [
    Sought(test, 0, *more)
    for test in (SADDLE_NODE, FLIP, PAIR, GRAZING)
    for more in ((), (STIFFNESS, 8.1e6))
]


def solver(screen, sought):
    """Over the clearance; beside it nothing, the speed, or the stiffness of the stop."""

    def system(e: float, k: float):
        return screen.replace(clearance=e, **({"stop_stiffness": k} if k else {})).system()

    speed = 203.0 if sought.test == MOTION or sought.own else 0.0
    return FieldSolver(system, BOUNDS, 6e-3, speed, half_turn=True, turns=1, sought=sought)


def is_derivative_of_residual(evaluate, w, size) -> bool:
    """Whether the Jacobian at w = (u, value) is that of differences: 1e-7 of each row's size."""
    _, J = evaluate(w[:-1], w[-1])
    columns = []
    for move in np.diag(1e-5 * size):
        ahead, behind = (evaluate((w + s * move)[:-1], (w + s * move)[-1])[0] for s in (1, -1))
        columns.append((ahead - behind) / (2.0 * move.sum()))
    row = np.abs(J * size).max(axis=1, keepdims=True) / size
    return bool(np.all(np.abs(J - np.array(columns).T) <= 1e-7 * row))


@pytest.mark.parametrize("sought", [MOTIONS, *CURVES], ids=str)
def test_jacobians_are_those_of_differences(screen, exact, sought) -> None:
    """At points off the solution, of half a turn with sign."""
    orbit = exact.orbits_at(203.0)[0]
    ours = solver(screen, sought)
    beside = [] if sought.test == MOTION else [sought.own or 203.0]
    w = np.concatenate([1.01 * orbit.state, beside, [6e-3]])
    evaluate = residual_of(varied, ours.problem, ours.scratch, ours.unknowns)
    assert is_derivative_of_residual(evaluate, w, np.abs(w))


def lopsided(path: str, value: float) -> ff.MechanicalSystem:
    """Two masses, a stop with play and one with another law, two excitations, a constant force."""
    stops = (
        ff.ClearanceSpring([1.0, -0.4], 30.0, 1.5, 0.35, 0.8),
        ff.ClearanceSpring([0.2, 1.0], 12.0, 0.7, 0.25, math.inf, law="compression-only"),
    )
    drives = [ff.HarmonicForce([0.3 + 0.4j, 0.1]), ff.Unbalance([0.05j, 0.2], order=2)]
    C = [[0.1, -0.02], [-0.02, 0.08]]
    M, K = np.array([[1.0, 0.1], [0.1, 2.0]]), np.array([[2.0, -1.0], [-1.0, 1.5]])
    if path == "masses":
        M = M + (value - 1.0) * np.array([[1.0, 0.0], [0.0, 0.3]])
    if path == "directions":
        stops = (ff.ClearanceSpring([1.0, -0.4 * value], 30.0, 1.5, 0.35, 0.8), stops[1])
    if path == "stops":
        stops = (
            ff.ClearanceSpring([1.0, -0.4], 30.0 * value, 1.5 * value**2, 0.35 / value, 0.8),
            stops[1],
        )
    if path == "forces":
        drives = [ff.HarmonicForce([0.3 + 0.4j * value, 0.1]), drives[1]]
    static = [0.02 * (value if path == "forces" else 1.0), -0.01]
    C = np.array(C) * (value if path == "dampings" else 1.0)
    return ff.MechanicalSystem(M, C, K, stops, drives, static_force=static)


OFF = np.array([-0.8, -0.9, -0.5, -0.7])  # a state from which both stops are touched


def without_symmetry(sought, path: str) -> FieldSolver:
    """Over a field of :func:`lopsided`, at a speed or with it or a second field beside."""
    if sought.test == GRAZING:
        sought = replace(sought, gap=1)  # the far side of the first stop, which is not met
    if sought.own:
        sought = replace(sought, bounds=(0.9, 1.2), own=1.0)

    def system(value: float, beside: float) -> ff.MechanicalSystem:
        one = lopsided(path, value)
        return replace(one, C=one.C * beside) if sought.own else one

    speed = 1.1 if sought.test == MOTION or sought.own else 0.0
    return FieldSolver(
        system, (0.8, 1.3), 1.0, speed, half_turn=False, turns=1, sought=sought
    )  # fmt: skip


def unknowns_off(ours: FieldSolver) -> Real:
    """Those of the solver and the value, off any solution."""
    beside = [] if ours.sought.test == MOTION else [1.1]
    return np.array([*OFF, *beside, 1.05])


@pytest.mark.parametrize("phase", [0.0, 1.3])
@pytest.mark.parametrize("path", ["masses", "dampings", "directions", "stops", "forces"])
@pytest.mark.parametrize("sought", [MOTIONS, *CURVES], ids=str)
def test_jacobians_of_a_machine_without_symmetry(sought, path: str, phase: float) -> None:
    """Of a whole turn, at any section, contacts that kick on entry among those met."""
    ours = without_symmetry(sought, path)
    ours.scratch.shooting.section[0] = phase
    evaluate = residual_of(varied, ours.problem, ours.scratch, ours.unknowns)
    w = unknowns_off(ours)
    assert is_derivative_of_residual(evaluate, w, np.ones(w.size))
    flow = ours.flow
    met = flow.regimes[: flow.segments[0]].any(axis=0)
    assert met.all(), "both stops are touched on the way"


@pytest.mark.parametrize(("begin", "end"), [(0.0, 1.3), (1.3, 0.0)])
@pytest.mark.parametrize("half_turn", [False, True])
@pytest.mark.parametrize("sought", [MOTIONS, *CURVES[:2]], ids=str)
def test_tangents_are_carried_to_another_section(screen, exact, sought, half_turn, begin, end):
    """Ahead, and to the next turn, that of a motion mirrored in its second half with its sign."""
    if half_turn:
        ours = solver(screen, sought)
        beside = [] if sought.test == MOTION else [sought.own or 203.0]
        w = np.concatenate([1.01 * exact.orbits_at(203.0)[0].state, beside, [6e-3]])
    else:
        ours = without_symmetry(sought, "stops")
        w = unknowns_off(ours)
    tangent = 0.01 * w * np.random.default_rng(3).uniform(0.5, 1.0, w.size)

    def carried(step: float) -> tuple[Real, Real]:
        ours.scratch.shooting.section[0] = begin
        there, ahead = w + step * tangent, tangent.copy()
        assert varied_to(ours.problem, ours.scratch, there, ahead, end) == status.OK
        return there, ahead

    _, ahead = carried(0.0)
    h = 1e-4
    wide, narrow = ((carried(s)[0] - carried(-s)[0]) / (2.0 * s) for s in (h, 0.5 * h))
    expected, n = (4.0 * narrow - wide) / 3.0, OFF.size
    close("states", ahead[:n], expected[:n], abs=1e-7 * np.abs(ahead[:n]).max())
    close("parameters", ahead[n:], tangent[n:])


def test_newton_on_a_curve_is_of_second_order(screen, exact) -> None:
    """Each step's length is about the square of the last one's, down to rounding.

    From 1e-3 beside the fold, lengths as shares of the unknowns.
    """
    ours = solver(screen, Sought(SADDLE_NODE))
    evaluate = residual_of(varied, ours.problem, ours.scratch, ours.unknowns)
    fold = exact.folds[0]
    w = np.append(fold.orbit.state, fold.omega) * (1.0 + 1e-3)
    size, lengths = np.abs(w), []
    for _ in range(7):
        r, J = evaluate(w, 6e-3)
        step = np.linalg.solve(J[:, :-1], -r)
        lengths.append(float(np.abs(step / size).max()))
        w = w + step
    assert lengths[-1] < 1e-10
    for before, after in pairwise(lengths[1:]):
        assert after < max(100.0 * before * before, 1e-10), lengths
    close("the fold", w[-1], fold.omega, rel=1e-9)


@pytest.mark.parametrize(
    ("field", "bounds"),
    [
        ("clearance", BOUNDS), ("main_mass", (500.0, 2000.0)), ("stop_damping", (0.0, 9e3)),
        ("eccentric_moment", (1.0, 9.0)), ("shear_stiffness", (1e6, 5e6)),
    ],
)  # fmt: skip
def test_the_series_is_the_machine(screen, field: str, bounds) -> None:
    """Two terms: every field enters the matrices linearly, the masses' inverse is solved for."""

    def system(value: float):
        return screen.replace(**{field: value}).system()

    ours = FieldSolver(
        lambda value, _: system(value), bounds, getattr(screen, field), 203.0,
        half_turn=False, turns=1,
    )  # fmt: skip
    assert ours.problem.series.inertia.shape[0] == 2
    for value in np.linspace(*bounds, 7):
        assert series_machine(ours.problem.series, ours.scratch.series, value, 0.0, ours.machine)
        expected = machine_arrays(system(value))
        for name in ("stiffness", "damping", "direction", "reach", "push"):
            got, want = getattr(ours.machine, name), getattr(expected, name)
            close(name, got, want, rel=1e-12, abs=1e-12 * np.abs(want).max(initial=0.0))
        for name in ("stiffness", "damping", "gap"):
            close(name, getattr(ours.machine.stops, name), getattr(expected.stops, name), rel=1e-12)


def test_a_series_takes_the_terms_it_needs() -> None:
    """Smooth: enough of them; with a kink: none are enough."""

    def parts(shape):
        return lambda v, _: {
            "inertia": np.eye(1), "damping": np.eye(1), "stiffness": np.array([[shape(v)]]),
            "direction": np.eye(1), "force": np.ones((2, 1)), "static": np.zeros((1, 1)),
            "stop": np.ones((2, 1)), "gap": np.array([[v, math.inf]]),
        }  # fmt: skip

    smooth = machine_series(parts(math.exp), 0.0, 2.0)
    assert smooth is not None
    assert 9 <= smooth.stiffness.shape[0] <= 33
    assert np.isinf(smooth.gap[0, 0, 0, 1])
    for kink in (1.0, 1.75, 1.95):
        assert machine_series(parts(lambda v, kink=kink: max(v, kink)), 0.0, 2.0) is None


def test_a_series_in_two_fields_is_the_machine(screen) -> None:
    """A product of both takes two terms in each."""
    ours = solver(screen, Sought(SADDLE_NODE, 0, STIFFNESS, 8.1e6))
    assert ours.problem.series.stop.shape[:2] == (2, 2)
    for e in np.linspace(*BOUNDS, 4):
        for k in np.linspace(*STIFFNESS, 4):
            assert series_machine(ours.problem.series, ours.scratch.series, e, k, ours.machine)
            want = machine_arrays(screen.replace(clearance=e, stop_stiffness=k).system())
            for name in ("stiffness", "damping", "gap"):
                got = getattr(ours.machine.stops, name)
                close(name, got, getattr(want.stops, name), rel=1e-12)


def test_folds_in_slivers_are_folds() -> None:
    """Curves of folds of the three-period family, where a very short contact appears.

    Nearly half of the points had a multiplier up to 1e-2 away from 1.
    """
    screen = ff.load("ffs0827")
    orbit = next(o for o in ff.periodic_orbits(screen, 446.0, max_periods=3) if o.periods == 3)
    branch = ff.continue_orbit(orbit, "omega", (300.0, 600.0))
    curve = ff.continue_fold(branch.folds[0], "clearance", (1e-3, 20e-3))
    off = np.abs(curve.multipliers - 1.0).min(axis=1)
    assert off.max() < 1e-6
