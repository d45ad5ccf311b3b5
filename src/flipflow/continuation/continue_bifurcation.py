"""Follow a special point in the plane of two parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import cast

import numpy as np
from numpy.typing import NDArray

from flipflow import __version__
from flipflow.compiled import status
from flipflow.compiled.arrays import Complex, Real
from flipflow.continuation.bifurcation_curve import BifurcationCurve, CurvePoint
from flipflow.continuation.branch import SpecialPoint
from flipflow.continuation.branch_status import BranchStatus
from flipflow.continuation.conditions import FLIP, GRAZING, PAIR, SADDLE_NODE
from flipflow.continuation.continue_field import SPECIAL_SHARE, checked_bounds, course_over
from flipflow.continuation.correction import QUICK, SHARP, Course
from flipflow.continuation.curve_points import GRAZES, TURNING, curve_points, pair_sum
from flipflow.continuation.field_branch import FieldBranch, FieldSpecialPoint
from flipflow.continuation.field_solver import FieldPoint, FieldSolver, Sought
from flipflow.continuation.refinement import FOLD as OF_FOLD
from flipflow.continuation.special_points import (
    CONTACT_BEGIN,
    CONTACT_END,
    CUSP,
    DOUBLING,
    FOLD,
    NEIMARK_SACKER,
    SYMMETRY,
)
from flipflow.continuation.switching import follow_both_ways
from flipflow.errors import IncompleteError, InputError
from flipflow.model.arguments import checked_monitor, members_of
from flipflow.model.monitor import Monitor
from flipflow.model.parameters import Parameter, parameter_of, with_values
from flipflow.model.system import Machine, MechanicalSystem
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.near_grazing import near_grazing
from flipflow.periodic.orbit import Orbit
from flipflow.periodic.solver import Point, Traced
from flipflow.periodic.stability import UNDETERMINED

OMEGA = "omega"
TESTS = {
    FOLD: SADDLE_NODE, SYMMETRY: FLIP, DOUBLING: FLIP, NEIMARK_SACKER: PAIR,
    CONTACT_BEGIN: GRAZING, CONTACT_END: GRAZING,
}  # fmt: skip
CREEPING = 1e-6  # share of the bounds below which a step leads hardly on
CRITICAL = 1e-3  # distance of multipliers from critical ones beyond which a map has none
SETTLED = 1e-6  # the same of a special point of the map that was found to rounding
BESIDE = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4)  # shares of the speed within which one is looked for
FINE = 20.0  # steps in each of these intervals
NEAR = 1e-6  # share of the bounds within which a motion with that multiplier is looked for
GRAZED = 1e-6  # depth beyond a gap that a motion grazes, as a share of the motion
BEFORE_GRAZING = 1e-4  # the same, from which a curve that stalls is held to end at it
AT_CORNER = (
    "The fold lies where a contact begins and the branch has a corner: the curve is that of the "
    "grazing, and a fold as long as the branch turns back there."
)

AT_LOWER_CORNER = (
    "The fold lies where the branch has a corner, because a stop that is touched already in the "
    "turn begins to be touched once more: it is no fold of the return map, and its curve cannot be "
    "followed."
)

AT_JUMP = (
    "The multipliers jump past their critical value where a contact begins: the curve is that of "
    "the grazing, and a {kind} as long as they jump past it there."
)

AT_LOWER_JUMP = (
    "The multipliers jump past their critical value where a stop that is touched already in the "
    "turn begins to be touched once more: no motion has that value, and there is no curve."
)
NO_CURVE = (AT_LOWER_CORNER, AT_LOWER_JUMP)


def continue_bifurcation(
    point: SpecialPoint,
    parameters: tuple[str, str],
    bounds: tuple[tuple[float, float], tuple[float, float]],
    *,
    monitor: Monitor | None = None,
) -> BifurcationCurve:
    """Follow a special point over two parameters: the curve on which it lies in their plane.

    Unknowns are the motion and both parameters; the equations are those of the motion and g = 0,
    with P its return map, over half a turn with sign where the motion is its own mirror image:

    - fold: g = det(P - I); period doubling and symmetry breaking: g = det(P + I);
    - Neimark-Sacker: g = det(C - I), C the second compound matrix of P, whose eigenvalues are the
      products of two multipliers;
    - contact begin and contact end: g is the greatest distance beyond the gap, of the motion
      without that contact.

    The curve is followed both ways by pseudo-arclength until either parameter meets a bound.
    All derivatives are exact, those of g, which hold the second ones of the flow, too.

    Parameters
    ----------
    point
        A fold, contact begin, contact end, symmetry breaking, period doubling or Neimark-Sacker
        point of a branch over frequency or over a field.
    parameters
        Names of two parameters: fields of the machine as of :func:`~flipflow.continue_orbit`, or
        "omega" for one of them; else the speed stays that of the point.
    bounds
        (low, high) of each, in rad/s or in the field's SI unit; they hold the point.
    monitor
        Called before each way with a sentence and the share done; raise from it to cancel.

    Returns
    -------
    BifurcationCurve
        Its special points are cusps, turning points, resonances, and points where the curve meets
        another. A Neimark-Sacker curve ends where its pair becomes real.

    Raises
    ------
    InputError
        For a point of another kind, parameters that are not known, are the same or have no finite
        value, and bounds that are empty or do not hold the point.
    """
    if not isinstance(point, SpecialPoint) or point.kind not in TESTS:
        kinds = ", ".join(TESTS)
        raise InputError("point", point, f"give a special point of a branch: {kinds}")
    say = checked_monitor(monitor)
    names = _checked_names(parameters)
    plane = _plane(point.orbit, names, bounds)
    jumps = _jumps(point, plane)
    followed = _followed(point, plane, say, grazing=jumps)
    if followed.status is BranchStatus.NO_START and not plane.over_omega:
        # Where the first parameter stands still at the start, only the other one can be held there.
        plane = plane.turned
        followed = _followed(point, plane, say, grazing=jumps)
    turned = names != plane.names
    kind = GRAZES if point.kind in (CONTACT_BEGIN, CONTACT_END) else point.kind
    return BifurcationCurve(
        machine=point.orbit.machine,
        kind=kind,
        parameters=names,
        orbits=followed.orbits,
        values=followed.values[:, ::-1].copy() if turned else followed.values,
        special_points=tuple(
            replace(one, values=one.values[::-1]) if turned else one
            for one in followed.special_points
        ),
        status=followed.status,
        notes=followed.notes,
        version=__version__,
    )


def continue_fold(
    fold: SpecialPoint,
    field: str,
    interval: tuple[float, float],
    *,
    monitor: Monitor | None = None,
) -> FieldBranch:
    """Follow a fold over a field of the machine: the jump speed as the machine is changed.

    It is :func:`~flipflow.continue_bifurcation` over the field and omega, whatever omega becomes.
    Where two folds are born in a cusp the curve passes from the one to the other.

    Parameters
    ----------
    fold
        A fold of a branch over frequency.
    field
        A field of the screen, such as "clearance", or of any frozen dataclass with ``.system()``;
        of a plain system "forcing", a factor on the excitation, or a path such as
        "springs[0].clearance".
    interval
        (low, high) in the field's SI unit; it holds the machine's own value.
    monitor
        Called before each way with a sentence and the share done; raise from it to cancel.

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
    machine = fold.orbit.machine
    parameter = parameter_of(machine, field)
    interval = checked_bounds("interval", parameter, interval)
    plane = Plane(machine, (parameter.name, OMEGA), (parameter.value, fold.omega),
                  (interval, (0.0, np.inf)))  # fmt: skip
    followed = _followed(fold, plane, say)
    # A turn in omega alone is none in the field.
    turns = [one for one in followed.special_points if one.kind == CUSP or one.side == 0]
    return FieldBranch(
        machine=machine,
        field=parameter.name,
        orbits=tuple(map(_over_field, followed.orbits, followed.values[:, 0])),
        values=followed.values[:, 0].copy(),
        special_points=tuple(
            FieldSpecialPoint(
                CUSP if one.kind == CUSP else FOLD,
                _over_field(one.orbit, one.values[0]),
                one.position,
                value=one.values[0],
            )
            for one in turns
            if one.kind in (CUSP, TURNING)
        ),
        status=followed.status,
        notes=followed.notes,
        version=__version__,
    )


def _over_field(orbit: Orbit, value: float) -> Orbit:
    """The motion as one of a branch over a field."""
    at = orbit.point
    point = FieldPoint(
        at.formulation, at.u, at.omega, at.omega_tangent, at.known_map, value=float(value)
    )
    return replace(orbit, point=point)


@dataclass(frozen=True)
class Plane:
    """Two parameters of a machine, their values at the start, and where they are followed.

    The second is omega where it is one of them.
    """

    machine: Machine
    names: tuple[str, str]
    own: tuple[float, float]
    bounds: tuple[tuple[float, float], tuple[float, float]]

    @property
    def over_omega(self) -> bool:
        """Whether the speed varies."""
        return self.names[1] == OMEGA

    @property
    def turned(self) -> Plane:
        """The plane with its parameters the other way round."""
        return Plane(self.machine, self.names[::-1], self.own[::-1], self.bounds[::-1])

    def machine_at(self, first: float, second: float) -> Machine:
        """The machine at values of both."""
        values = {self.names[0]: first}
        if not self.over_omega:
            values[self.names[1]] = second
        return with_values(self.machine, values)

    def system_at(self, first: float, second: float) -> MechanicalSystem:
        """Its system."""
        return self.machine_at(first, second).system()

    @property
    def stays_symmetric(self) -> bool:
        """Whether the machine is its own mirror image all over."""
        return all(self.system_at(*corner).symmetric for corner in product(*self.bounds))


@dataclass(frozen=True)
class Followed:
    """What was followed, parameters in the order of the plane's."""

    orbits: tuple[Orbit, ...]
    values: NDArray[np.float64]
    special_points: tuple[CurvePoint, ...]
    status: BranchStatus
    notes: tuple[str, ...]


def _checked_names(parameters: object) -> tuple[str, str]:
    names = members_of(parameters)
    remedy = 'give two different names, such as ("clearance", "omega")'
    if names is None or len(names) != 2 or not all(isinstance(name, str) for name in names):
        raise InputError("parameters", parameters, remedy)
    if names[0] == names[1]:
        raise InputError("parameters", parameters, remedy)
    return cast("tuple[str, str]", tuple(names))


def _plane(orbit: Orbit, names: tuple[str, str], bounds: object) -> Plane:
    """The plane of two parameters, omega last, checked."""
    given = members_of(bounds)
    if given is None or len(given) != 2:
        raise InputError("bounds", bounds, "give (low, high) of each of both parameters")

    def at_speed(value: float) -> Machine:
        if not value > 0.0:
            raise InputError("bounds", bounds, "give speeds above 0 rad/s")
        return orbit.machine

    parts: list[tuple[str, float, tuple[float, float]]] = []
    for k in sorted(range(2), key=lambda k: names[k] == OMEGA):
        if names[k] == OMEGA:
            parameter = Parameter(OMEGA, orbit.omega, at_speed)
        else:
            parameter = parameter_of(orbit.machine, names[k])
        limits = checked_bounds(f"bounds[{k}]", parameter, given[k])
        parts.append((parameter.name, parameter.value, limits))
    (first, own, within), (second, at, beside) = parts
    return Plane(orbit.machine, (first, second), (own, at), (within, beside))


def _jumps(point: SpecialPoint, plane: Plane) -> bool:
    """Whether multipliers jump past their critical value at a grazing: no motion has it itself."""
    test = TESTS[point.kind]
    if test not in (FLIP, PAIR) or _is_critical(point.orbit.point, test, within=SETTLED):
        return False
    if _grazed(*_exact_start(point)) is None:
        return False
    # Before a hard stop a motion that has it may lie hardly beyond grazing.
    close = [
        (max(low, own - NEAR * (high - low)), min(high, own + NEAR * (high - low)))
        for own, (low, high) in zip(plane.own, plane.bounds, strict=True)
    ]
    found = _followed(
        point, replace(plane, bounds=(close[0], close[1])), lambda _words, _share: None
    )
    return not any(_is_critical(one.point, test) for one in found.orbits)


def _followed(
    point: SpecialPoint, plane: Plane, say: Monitor, *, grazing: bool = False
) -> Followed:
    """The curve through a special point, or of its grazing, and the special points on it."""
    orbit, over_omega = point.orbit, plane.over_omega
    own = orbit.point.formulation
    half_turn = own.half_turn and plane.stays_symmetric
    if point.kind == SYMMETRY and not half_turn:
        raise InputError("parameters", plane.names, "the machine must stay its own mirror image")
    test, gap, start, notes = _grazing(point) if grazing else _sought(point)
    sought = Sought(test, gap) if over_omega else Sought(test, gap, plane.bounds[1], plane.own[1])
    u = np.append(start.u, start.omega if over_omega else plane.own[1])
    at_once = _grazed_at_once(start, gap) if test == GRAZING else ()
    solver, traced = _traced(plane, orbit, u, replace(sought, at_once=at_once), half_turn, say)
    if _touches(solver, traced, at_once):
        # They are grazed at once for these parameters alone.
        sought = replace(sought, at_once=(gap ^ 1,) if half_turn else ())
        solver, traced = _traced(plane, orbit, u, sought, half_turn, say)
    say("special points", SPECIAL_SHARE)
    found, unsettled = curve_points(solver, traced) if traced.omega.size else ([], [])
    points = solver.points(traced)
    kept = _where_it_holds(solver, traced, points, plane)

    def motion(at: Point) -> Orbit:
        one = cast("FieldPoint", at)
        known = Point(one.formulation, one.u, one.omega, one.omega_tangent, one.known_map)
        return Orbit(plane.machine_at(one.value, one.beside), known, UNDETERMINED)

    orbits = tuple(map(motion, points[kept]))
    return Followed(
        orbits=orbits,
        values=np.column_stack([traced.omega, traced.u[:, -1]])[kept],
        special_points=tuple(
            CurvePoint(
                one.kind, motion(one.point), one.index + one.share - kept.start, one.spring,
                one.side, _values(one.point),
            )
            for one in found
            if kept.start - 1 <= one.index < kept.stop
        ),
        status=_ended(solver, traced, kept, orbits, plane),
        notes=(*(one for one in notes if not (orbits and one in NO_CURVE)), *unsettled),
    )  # fmt: skip


def _traced(
    plane: Plane, orbit: Orbit, u: Real, sought: Sought, half_turn: bool, say: Monitor
) -> tuple[FieldSolver, Traced]:
    """The curve through the motion u, both ways."""
    solver = FieldSolver(
        plane.system_at, plane.bounds[0], plane.own[0], 0.0 if plane.over_omega else orbit.omega,
        half_turn=half_turn, turns=orbit.point.formulation.turns, sought=sought,
    )  # fmt: skip
    low, high = plane.bounds[1]
    course = course_over(plane.bounds[0], SHARP)._replace(beside_lower=low, beside_upper=high)
    return solver, follow_both_ways(solver, u, plane.own[0], course, say).traced


def _touches(solver: FieldSolver, traced: Traced, gaps: Sequence[int]) -> bool:
    """Whether a motion of the curve goes beyond gaps that it should graze."""
    motion = np.abs(traced.u[:, : solver.system.size]).max(initial=0.0)
    depth = traced.depth.reshape(-1, 2 * len(solver.springs))[:, list(gaps)]
    return bool((depth > GRAZED * motion).any())


def _ended(
    solver: FieldSolver, traced: Traced, kept: slice, orbits: Sequence[Orbit], plane: Plane
) -> BranchStatus:
    """How the curve ended; where it stalled, whether another contact begins at each end within."""
    if traced.omega.size and not orbits:
        return BranchStatus.NO_START
    stalled = traced.code == status.STEP_TOO_SMALL and solver.sought.test != GRAZING
    grazing = stalled and bool(orbits)
    for k, end in ((kept.start, 0), (kept.stop - 1, -1)) if grazing else ():
        place = traced.omega[k], traced.u[k, -1]
        within = all(low < x < high for x, (low, high) in zip(place, plane.bounds, strict=True))
        if within and not _grazes(orbits[end], solver.length):
            grazing = False
    return BranchStatus.MEETS_GRAZING if grazing else BranchStatus.from_code(traced.code)


def _grazes(orbit: Orbit, length: float) -> bool:
    """Whether what a stop watches stands still hardly off zero: a summit, a valley, a force."""
    own = orbit.point.formulation
    solver = ExactSolver(own.system, half_turn=own.half_turn, turns=own.turns)
    if solver.residual(orbit.state, orbit.omega) is None:
        return False
    nearest = min(near_grazing(solver.problem, solver.scratch, orbit.omega))
    return nearest < BEFORE_GRAZING * length


def _grazed_at_once(point: Point, gap: int) -> tuple[int, ...]:
    """Other gaps that a motion grazes with one."""
    solver = point.formulation.solver()
    least, most = solver.gap_extremes(point.u[None], np.array([point.omega]))
    reach = np.stack([most[0], -least[0]], axis=1)
    depth = (reach - [spring.gaps for spring in solver.springs]).ravel()
    near = np.abs(depth - depth[gap]) < GRAZED * np.abs(point.u[: solver.system.size]).max()
    return tuple(other for other in np.flatnonzero(near).tolist() if other != gap)


def _values(point: Point) -> tuple[float, float]:
    one = cast("FieldPoint", point)
    return one.value, one.beside


def _where_it_holds(
    solver: FieldSolver, traced: Traced, points: Sequence[Point], plane: Plane
) -> slice:
    """The points of the curve around its start that have the multipliers that it asks for.

    A pair may become real. Where a contact begins multipliers may jump past their value: where the
    curve creeps towards it or ends, a motion that is carried to phase 0 may lie beyond.
    """
    test, size = solver.sought.test, traced.omega.size
    if test == GRAZING or size == 0:
        return slice(0, size)
    values = np.column_stack([traced.omega, traced.u[:, -1]])
    off = (values - plane.own) / np.ptp(plane.bounds, axis=1)
    creeps = np.abs(np.diff(off, axis=0)).max(axis=1, initial=0.0) < CREEPING
    doubtful = np.append(creeps, True) | np.insert(creeps, 0, True)
    lost = np.array(
        [
            not _holds(test, row) or bool(doubtful[k] and not _is_critical(points[k], test))
            for k, row in enumerate(solver.own_multipliers(traced))
        ]
    )
    start = int(np.abs(off).sum(axis=1).argmin())
    before, after = np.flatnonzero(lost[:start]), np.flatnonzero(lost[start:])
    first = int(before[-1]) + 1 if before.size else 0
    return slice(first, start + int(after[0]) if after.size else size)


def _holds(test: int, values: Complex) -> bool:
    """Whether multipliers along a curve are those that it asks for."""
    return _are_critical(test, values) and (test != PAIR or abs(pair_sum(values)) <= 2.0)


def _sought(point: SpecialPoint) -> tuple[int, int, Point, list[str]]:
    """Test and gap of a special point, the motion to start from, and what must be said."""
    orbit, test = point.orbit, TESTS[point.kind]
    own = orbit.point.formulation
    start, exact = _exact_start(point)
    if test == GRAZING:
        return test, 2 * point.spring + (0 if point.side > 0 else 1), start, []
    if _is_critical(orbit.point, test, within=SETTLED):
        return test, 0, start, []
    # At a corner multipliers may be close to critical by chance.
    gap = _grazed(start, exact)
    if gap is None:
        # That of a truncated series is none of the exact motion that stands for it.
        at_corner = own.kind is ExactSolver and not _is_critical(orbit.point, test)
        words = AT_LOWER_CORNER if test == SADDLE_NODE else AT_LOWER_JUMP
        return test, 0, start, [words] if at_corner else []
    if test != SADDLE_NODE:
        return test, 0, start, []
    beside = _fold_beside(start, exact)
    return (GRAZING, gap, start, [AT_CORNER]) if beside is None else (test, 0, beside, [])


def _exact_start(point: SpecialPoint) -> tuple[Point, ExactSolver]:
    """The exact motion of a point, whatever the method that found it, and its solver."""
    orbit = point.orbit
    own = orbit.point.formulation
    exact = ExactSolver(own.system, half_turn=own.half_turn, turns=own.turns)
    return Point(exact.formulation, orbit.state, orbit.omega), exact


def _grazing(point: SpecialPoint) -> tuple[int, int, Point, list[str]]:
    """As :func:`_sought`, of the grazing at which multipliers jump."""
    start, exact = _exact_start(point)
    return GRAZING, _grazed(start, exact) or 0, start, [AT_JUMP.format(kind=point.kind)]


def _is_critical(point: Point, test: int = SADDLE_NODE, within: float = CRITICAL) -> bool:
    """Whether eigenvalues of the map are those that a test looks for."""
    return _are_critical(test, point.eigenvalues, within)


def _are_critical(test: int, values: Complex, within: float = CRITICAL) -> bool:
    if test == PAIR:
        i, j = np.triu_indices(values.size, 1)
        off = values[i] * values[j] - 1.0
    else:
        off = values - 1.0 if test == SADDLE_NODE else values + 1.0
    return bool(np.abs(off).min() < within)


def _fold_beside(point: Point, solver: ExactSolver) -> Point | None:
    """The fold of the map nearest to a motion that grazes.

    Before a hard stop a branch turns back hardly beyond grazing, where both look like one point.
    """
    for share in BESIDE:
        width = share * point.omega
        course = Course(
            point.omega - width, point.omega + width, width / FINE, FINE * share, 1.0, QUICK
        )
        traced = follow_both_ways(solver, point.u, point.omega, course).traced
        turns = np.flatnonzero(np.diff(np.sign(traced.tangent[:, -1])))
        for p in map(int, turns):
            found = _fold_within(solver, traced, p)
            if found is not None:
                return found
    return None


def _fold_within(solver: ExactSolver, traced: Traced, p: int) -> Point | None:
    """The fold of the map within step p; None where the tangent jumps."""
    try:
        _, found = solver.zero_between(traced, OF_FOLD, p, 0.0, 1.0)
    except IncompleteError:
        return None
    return found if _is_critical(found) else None


def _grazed(point: Point, solver: ExactSolver) -> int | None:
    """The gap that a motion grazes."""
    size = GRAZED * np.abs(point.u[: point.u.size // 2]).max()
    depths = [
        abs(solver.depth(point, j, side)) for j in range(len(solver.springs)) for side in range(2)
    ]
    return int(np.argmin(depths)) if depths and min(depths) < size else None
