"""Where branches meet: motions that lose their symmetry or double their period.

A motion of an even number n of periods may come from one of n / 2; a leaning motion of a machine
that is its own mirror image comes from a symmetric one. Where they meet, the return map of the
parent has the eigenvalue -1, over n / 2 periods, or over half of n with sign.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import root_scalar

from flipflow.compiled import status
from flipflow.compiled.arrays import Real
from flipflow.continuation import correction
from flipflow.errors import IncompleteError
from flipflow.model.monitor import Monitor, silent
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.solver import Formulation, Point, Solver, Traced
from flipflow.periodic.stability import determinant_plus

# Distances of a motion from the parent branch, relative to the motion.
NEAR = 1e-2  # a branch that stalls within it has met its parent
CLOSE = 1e-3  # points within it are left out at a meeting
SHARE_CLOSE = 0.1  # the same, as a share of the farthest that the branch went
HARDLY = 1e-5  # a branch that comes as near was followed to its parent; another leapt there
SAME = 1e-7  # a motion within it is one of the parent's
FINER = (1.0, 0.05, 0.01, 0.001)  # factors on the step, tried until no point lands on the parent
# Distances of a child's first motion from its parent, relative to the motion, tried in this order:
# beside a grazing the child's branch may bend away within a small part of the first.
SMALL = (1e-3, 1e-4, 1e-5, 1e-6)
TWICE = 10.0  # multiple of it up to which the motion's image may be away; about twice is expected
SECANT = 1e-6  # relative distance in omega of the first two points of the secant method
SECANT_MOST = 30  # its iterations


@dataclass(frozen=True, eq=False)
class Followed:
    """Traced motions, and the motions of the parent branch that they end in."""

    traced: Traced
    start: Point | None = None
    end: Point | None = None


def parent_of(solver: Solver) -> ExactSolver | None:
    """The solver of the motions from which this solver's may branch off; None where there is none.

    A series has none: it spans one forcing period, with odd harmonics only if the machine is
    symmetric.
    """
    if not isinstance(solver, ExactSolver) or solver.half_turn or not solver.branches_off:
        return None
    if solver.turns % 2 == 0:
        return solver.like(half_turn=False, turns=solver.turns // 2)
    if solver.system.symmetric and solver.system.springs:
        return solver.like(half_turn=True, turns=solver.turns)
    return None


def child_of(parent: Formulation) -> ExactSolver:
    """The solver of the motions that branch off at an eigenvalue -1 of the parent's return map."""
    turns = parent.turns if parent.half_turn else 2 * parent.turns
    return ExactSolver(parent.system, half_turn=False, turns=turns)


def image(parent: ExactSolver, u: Real, omega: float) -> Real:
    """The state half a child's period later, mirrored where the parent's motions are.

    The parent's motions are their own images; a child's image is another motion of its branch.
    NaN where the flow does not end.
    """
    found = parent.residual(u, omega)
    return np.full(u.size, np.nan) if found is None else np.asarray(u + found[0])


def distance_to(state: Real, other: Real, omega: float) -> float:
    """Largest difference of two states, velocities over omega, as a share of the larger motion."""
    size = state.size // 2
    weight = np.concatenate([np.ones(size), np.full(size, 1.0 / omega)])
    reach = max(np.abs(state * weight).max(), np.abs(other * weight).max())
    return float(np.abs((state - other) * weight).max() / reach)


def meeting(parent: Solver, u: Real, omega: float) -> Point | None:
    """The parent's motion near (u, omega) whose return map has the eigenvalue -1, by secants."""
    last = [parent.solve(u, omega)]
    size = abs(omega) or 1.0

    def value(w: float) -> float:
        guess = last[-1]
        point = None if guess is None else parent.solve(guess.u, w)
        last.append(point)
        try:
            return math.nan if point is None else float(determinant_plus(parent.return_map(point)))
        except IncompleteError:  # the flow does not end: the secants end, too
            return math.nan

    answer = root_scalar(
        value, method="secant", x0=omega, x1=omega + SECANT * size, xtol=1e-12 * size,
        maxiter=SECANT_MOST,
    )  # fmt: skip
    guess = last[-1]
    if not (answer.converged and math.isfinite(answer.root)) or guess is None:
        return None
    return parent.solve(guess.u, float(answer.root))


def follow_until_meeting(
    solver: Solver, u: Real, omega: float, course: correction.Course
) -> tuple[Traced, Point | None]:
    """Follow the branch one way until it leaves the interval or meets its parent.

    Returns the branch, and the motion at the meeting or None. A long step may land on the parent,
    which looks like the child where the two meet; the branch is then followed again with finer
    steps.
    """
    parent = parent_of(solver)
    if parent is None:
        return solver.trace(u, omega, course), None
    for finer in FINER:
        traced = solver.trace(u, omega, course._replace(u_step=course.u_step * finer))
        if traced.omega.size == 0:
            return traced, None
        apart = _distances(parent, traced)
        landed = int(np.flatnonzero(apart < SAME)[0]) if np.any(apart < SAME) else None
        if not landed or _came_back(apart[:landed]):
            break
    # The sign of det [J; tangent] changes where two branches cross, and at corners.
    crossed = np.flatnonzero(np.diff(np.sign(traced.record.side)))
    stalled = [apart.size - 1] if traced.code == status.STEP_TOO_SMALL else []
    beyond = [landed - 1] if landed else []
    for p in sorted({*map(int, crossed), *stalled, *beyond}):
        if apart[p] > NEAR and p not in beyond:
            continue
        state, at = traced.u[p], float(traced.omega[p])
        point = meeting(parent, (state + image(parent, state, at)) / 2.0, at)
        if point is not None:
            return _clear_of_parent(traced, apart[: p + 1]), point
    # At a corner the parent has no eigenvalue -1, because its multipliers jump there.
    return (traced.first(landed) if landed else traced), None


def _came_back(apart: Real) -> bool:
    """Whether a branch went away from its parent and was followed until it is hardly apart."""
    return bool(apart[-1] < min(HARDLY, SHARE_CLOSE * apart.max()))


def _clear_of_parent(traced: Traced, apart: Real) -> Traced:
    """The branch without its end close to a meeting: rounding cannot tell the two apart there."""
    close = min(CLOSE, SHARE_CLOSE * float(apart.max()))
    return traced.first(int(np.flatnonzero(apart > close).max(initial=0)) + 1)


def follow_both_ways(
    solver: Solver, u: Real, omega: float, course: correction.Course, monitor: Monitor = silent
) -> Followed:
    """Follow the branch from (u, omega) both ways; it begins at its end of lower omega."""
    unit = solver.unit if isinstance(solver, ExactSolver) else " rad/s"
    monitor(f"from {omega:.6g}{unit}", 0.0)
    up, down = course._replace(direction=1.0), course._replace(direction=-1.0)
    if omega == course.upper:
        return _one_way(*follow_until_meeting(solver, u, omega, down), None)
    ahead, end = follow_until_meeting(solver, u, omega, up)
    if ahead.code == status.CLOSED or ahead.omega.size == 0 or omega == course.lower:
        return _one_way(ahead, end, None)
    monitor(f"back from {omega:.6g}{unit}", 0.4)
    back, start = follow_until_meeting(solver, u, omega, down)
    if ahead.omega[-1] < back.omega[-1]:
        return Followed(ahead.reversed_into(back), end, start)
    return Followed(back.reversed_into(ahead), start, end)


def follow_away(child: Solver, first: Point, course: correction.Course, parent: Point) -> Followed:
    """Follow a child branch from a motion beside its parent, away from it."""
    direction = math.copysign(1.0, first.omega - parent.omega)
    traced, end = follow_until_meeting(
        child, first.u, first.omega, course._replace(direction=direction)
    )
    return _one_way(traced, end, parent)


def _one_way(traced: Traced, end: Point | None, start: Point | None) -> Followed:
    """A trace that began at an end of its branch."""
    ended = traced.code in (status.REACHED_UPPER, status.REACHED_LOWER)
    return Followed(replace(traced, code=status.FOLLOWED if ended else traced.code), start, end)


def _distances(parent: ExactSolver, traced: Traced) -> Real:
    """How far each motion is from being one of the parent's."""
    return np.array(
        [
            distance_to(u, image(parent, u, float(omega)), parent.frequency(float(omega)))
            for u, omega in zip(traced.u, traced.omega, strict=True)
        ]
    )


def beside(child: Solver, parent: Point, course: correction.Course) -> Point:
    """The child's motion a small way along the critical eigenvector of the parent's return map.

    Solved for in the plane of fixed amplitude, omega being unknown.

    Raises
    ------
    IncompleteError
        When no such motion is found.
    """
    values, vectors = np.linalg.eig(parent.return_map)
    critical = vectors[:, np.abs(values + 1.0).argmin()].real
    n = critical.size // 2
    weight = np.concatenate([np.ones(n), np.full(n, 1.0 / parent.omega)])
    motion = float(np.abs(parent.u * weight).max())
    reach = max(motion, child.length)
    away = reach * critical / np.abs(critical * weight).max()
    for small in SMALL:
        point = _in_plane(child, parent, small * away, course)
        if point is None:
            continue
        # As a share of the same length as the way that was gone.
        apart = _from_image(child, parent, point) * motion / reach
        if small < apart < TWICE * small:
            return point
    raise IncompleteError(
        f"no motion was found beside the one at {parent.omega:.6g} rad/s that branches off"
    )


def _in_plane(child: Solver, parent: Point, away: Real, course: correction.Course) -> Point | None:
    """The child's motion in the plane through a guess beside the parent and normal to it."""
    record = child.new_branch(2)
    record.u[:] = parent.u, parent.u + away
    record.omega[:] = parent.omega
    record.tangent[:] = np.append(away, 0.0)
    chord = Traced.recorded(record, 2, status.OK, course)
    try:
        return child.between(chord, 0, 1.0)
    except IncompleteError:
        return None


def _from_image(child: Solver, parent: Point, point: Point) -> float:
    """How far a motion is from its image, or from the parent where the child has no images."""
    own = parent_of(child)
    mirrored = parent.u if own is None else image(own, point.u, point.omega)
    return distance_to(point.u, mirrored, point.omega)
