"""Follow a periodic motion, or a fold, over a field of the machine."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import cast

import numpy as np

from flipflow import __version__
from flipflow.continuation.branch import SpecialPoint
from flipflow.continuation.branch_status import BranchStatus
from flipflow.continuation.field_branch import FieldBranch, FieldSpecialPoint
from flipflow.continuation.field_loop import Path, follow_both_ways
from flipflow.continuation.field_path import (
    FieldEquations,
    FieldFollower,
    FieldPoint,
    FoldEquations,
    SystemAt,
    meeting_over_field,
)
from flipflow.continuation.special_points import (
    CONTACT_BEGIN,
    DOUBLING,
    FOLD,
    NEIMARK_SACKER,
    STABILITY_CHANGES,
    SYMMETRY,
    Test,
    zeros_of,
)
from flipflow.continuation.switching import image
from flipflow.errors import InputError
from flipflow.model.arguments import checked_monitor, checked_pair, checked_word
from flipflow.model.fields import MOTION_FIELDS
from flipflow.model.monitor import Monitor
from flipflow.model.screen import FlipFlowScreen
from flipflow.periodic.orbit import Orbit
from flipflow.periodic.solver import Formulation, Point
from flipflow.periodic.stability import UNDETERMINED, determinant_plus, neimark_sacker

CUSP = "cusp"


def continue_fold(
    fold: SpecialPoint,
    field: str,
    interval: tuple[float, float],
    *,
    monitor: Monitor | None = None,
) -> FieldBranch:
    """Follow a fold over a field of the machine: the jump speed as the machine is changed.

    Unknowns are the motion, omega and the field; the equations those of the motion and
    det(I - P) = 0 with P its return map. Where two folds are born in a cusp the curve passes
    from the one to the other.

    Parameters
    ----------
    fold
        A fold of a branch over frequency of a :class:`~flipflow.FlipFlowScreen`.
    field
        A field of the screen, such as "clearance".
    interval
        (low, high) in the field's SI unit; it holds the machine's own value.
    monitor
        Called before each step with a sentence and the share of the interval that has been passed;
        raise from it to cancel.

    Returns
    -------
    FieldBranch
        Its ``omega`` varies along the curve; special points are "cusp", and "fold" where the
        curve itself turns back in the field elsewhere.

    Raises
    ------
    InputError
        For a point that is not a fold, a field that is not known or has no finite value, and an
        interval that is empty or does not hold it.
    """
    if not isinstance(fold, SpecialPoint) or fold.kind != FOLD:
        raise InputError("fold", fold, "give a fold of a branch, such as branch.folds[0]")
    say = checked_monitor(monitor)
    orbit = fold.orbit
    screen, value = _screen_and_value(orbit, field)
    bounds = _check_bounds(screen, field, value, interval)
    own = orbit.point.formulation
    equations = FoldEquations(
        _system_of(screen, field), bounds, value, orbit.omega,
        half_turn=own.half_turn and _stays_symmetric(screen, field, bounds), turns=own.turns,
    )  # fmt: skip
    path = follow_both_ways(equations, np.concatenate([orbit.state, [orbit.omega, value]]), say)
    tangents = np.array([point.tangent[-1] for point in path.points])
    tests = [Test(CUSP, tangents, lambda point: point.omega_tangent)]
    found, notes = zeros_of(tests, FieldFollower(equations), path)
    special = [
        _special(screen, field, _kind_on_fold(path, one.index), one.point, one.index + one.share)
        for one in found
    ]
    return _finished(screen, field, equations, path, special, notes, UNDETERMINED)


def field_branch(
    orbit: Orbit, field: str, interval: tuple[float, float], sought: Formulation, monitor: Monitor
) -> FieldBranch:
    """The branch of a motion over a field, sought as a formulation has it."""
    screen, value = _screen_and_value(orbit, field)
    bounds = _check_bounds(screen, field, value, interval)
    half_turn = sought.half_turn and _stays_symmetric(screen, field, bounds)
    equations = FieldEquations(
        _system_of(screen, field), bounds, value, orbit.omega,
        half_turn=half_turn, turns=sought.turns,
    )  # fmt: skip
    path = follow_both_ways(equations, np.append(orbit.state, value), monitor)
    found, notes = zeros_of(_tests(equations, path), FieldFollower(equations), path)
    special = [
        _special(screen, field, one.kind, one.point, one.index + one.share, one.spring, one.side)
        for one in found
    ]
    ends = ((path.crossed_start, 0, -0.5), (path.crossed_end, -1, len(path.points) - 0.5))
    for crossed, p, at in ends:
        if crossed:
            special += _meeting(screen, field, equations, path, p, at)
    special.sort(key=lambda point: point.position)
    return _finished(screen, field, equations, path, special, notes, None)


def _screen_and_value(orbit: Orbit, field: str) -> tuple[FlipFlowScreen, float]:
    """The orbit's screen and its value of the field."""
    machine = orbit.machine
    if not isinstance(machine, FlipFlowScreen):
        remedy = "only a FlipFlowScreen has fields; a MechanicalSystem is followed over 'omega'"
        raise InputError("field", field, remedy)
    checked_word("field", field, ("omega", *MOTION_FIELDS))
    value = getattr(machine, field)
    if value is None or math.isinf(value):
        raise InputError(field, value, "give the machine a finite value of it first")
    return machine, float(value)


def _check_bounds(
    screen: FlipFlowScreen, field: str, value: float, interval: object
) -> tuple[float, float]:
    """The interval (low, high) of the field, or a sentence that says what is wrong with it."""
    low, high = checked_pair("interval", interval, f"give (low, high) of {field} in SI")
    if low >= high:
        raise InputError("interval", interval, "give two finite values, the lower one first")
    for end in (low, high):
        screen.replace(**{field: end})
    if not low <= value <= high:
        remedy = f"the machine's {field} is {value:.9g}; give an interval that holds it"
        raise InputError("interval", interval, remedy)
    return low, high


def _stays_symmetric(screen: FlipFlowScreen, field: str, bounds: tuple[float, float]) -> bool:
    return all(screen.replace(**{field: end}).system().symmetric for end in bounds)


def _system_of(screen: FlipFlowScreen, field: str) -> SystemAt:
    return lambda value: screen.replace(**{field: value}).system()


def _tests(equations: FieldEquations, path: Path) -> list[Test]:
    """Fold, loss of symmetry or period doubling, Neimark-Sacker, and the depth of each contact."""
    points = [equations.point(solved) for solved in path.points]
    evaluations: list[tuple[str, int, Callable[[Point], float]]] = [
        (FOLD, 0, lambda point: point.omega_tangent),
        (
            SYMMETRY if equations.half_turn else DOUBLING,
            0,
            lambda point: float(determinant_plus(point.return_map)),
        ),
        (NEIMARK_SACKER, 0, lambda point: float(neimark_sacker(point.eigenvalues))),
        (CONTACT_BEGIN, 1, lambda point: _depth(point, 1)),
    ]
    if not equations.half_turn:
        evaluations.append((CONTACT_BEGIN, -1, lambda point: _depth(point, -1)))
    return [
        Test(kind, np.array([height(point) for point in points]), height, 0 if side else -1, side)
        for kind, side, height in evaluations
    ]


def _depth(point: Point, side: int) -> float:
    """Greatest depth in m beyond the gap on a side; NaN for a value without a gap there."""
    solver = point.formulation.solver()
    springs = solver.springs
    gap = springs[0].gaps[0 if side > 0 else 1] if springs else math.inf
    if math.isinf(gap):
        return math.nan
    least, most = solver.gap_extremes(point.u[None], np.array([point.omega]))
    return float((most[0, 0] if side > 0 else -least[0, 0]) - gap)


def _kind_on_fold(path: Path, p: int) -> str:
    """A cusp where omega turns back together with the field, else a turn of the fold curve."""
    before, after = path.points[p].tangent[-2], path.points[p + 1].tangent[-2]
    return CUSP if before * after < 0.0 else FOLD


def _meeting(
    screen: FlipFlowScreen, field: str, equations: FieldEquations, path: Path, p: int, at: float
) -> list[FieldSpecialPoint]:
    """The motion at which an end of the branch meets the one from which it comes."""
    even = equations.turns % 2 == 0
    parent = FieldEquations(
        equations.system_at, (equations.lower, equations.upper), equations.own, equations.omega,
        half_turn=not even, turns=equations.turns // 2 if even else equations.turns,
    )  # fmt: skip
    w = path.points[p].w
    value = float(w[-1])
    z = (w[:-1] + image(parent.solver_at(value), w[:-1], equations.omega)) / 2.0
    point = meeting_over_field(parent, z, value)
    if point is None:
        return []
    return [_special(screen, field, DOUBLING if even else SYMMETRY, point, at)]


def _special(
    screen: FlipFlowScreen, field: str, kind: str, point: Point, position: float,
    spring: int = -1, side: int = 0,
) -> FieldSpecialPoint:  # fmt: skip
    value = cast("FieldPoint", point).value
    word = UNDETERMINED if kind in (*STABILITY_CHANGES, CUSP) else None
    orbit = Orbit(screen.replace(**{field: value}), point, word)
    return FieldSpecialPoint(kind, orbit, position, spring, side, value)


def _finished(
    screen: FlipFlowScreen, field: str, equations: FieldEquations, path: Path,
    special: list[FieldSpecialPoint], notes: list[str], word: str | None,
) -> FieldBranch:  # fmt: skip
    points = [equations.point(solved) for solved in path.points]
    return FieldBranch(
        machine=screen,
        field=field,
        orbits=tuple(Orbit(screen.replace(**{field: p.value}), p, word) for p in points),
        values=np.array([point.value for point in points]),
        special_points=tuple(special),
        status=BranchStatus.from_code(path.code),
        notes=tuple(notes),
        version=__version__,
    )
