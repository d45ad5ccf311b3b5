"""Special points of a finished branch: found from the signs of test functions, then refined.

Every test function is a smooth number along the branch: the tangent's share in omega (fold),
det(I + map) (loss of symmetry or period doubling), prod (1 - lambda_i lambda_j) (Neimark-Sacker),
and the depth of each contact. A zero is refined on corrected points of the branch, never
interpolated. Two zeros within one step leave a dip without a change of sign: every dip is followed
to its bottom. Folds and contacts are refined by :mod:`flipflow.continuation.refinement`. Where
another branch crosses, Newton's method fails; the loop's own points stand close enough there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

from flipflow.compiled.arrays import Real
from flipflow.compiled.eigen import eigenvalues as eigenvalues_of
from flipflow.continuation.double_folds import double_fold
from flipflow.continuation.exact_check import ExactBeside, unconfirmed_note
from flipflow.continuation.refinement import FOLD as OF_FOLD
from flipflow.continuation.refinement import JUMP, SHARE_TOLERANCE
from flipflow.errors import IncompleteError
from flipflow.periodic.balance_solver import BalanceSolver
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.solver import Point, Solver, Traced
from flipflow.periodic.stability import (
    LARGEST_LOG,
    determinant_minus,
    determinant_plus,
    has_unit_pair,
    neimark_sacker,
    saddle_side,
)

# A dip of |test| is followed to its bottom where any of these three holds.
DIP = 0.5  # the parabola through it falls below this share of its lowest point
SHARP_DIP = 0.3  # that point lies below this share of both its neighbours
LOW = 1e-3  # that point lies below this share of the largest value along the branch
BOTTOM_STEPS = 15  # evaluations in the search for the bottom of a dip
ROUNDING = 1e-12  # of det (P + I), as a share of the largest that it could be
QUARTERS = (0.0, 0.25, 0.5, 0.75, 1.0)  # shares of a step at which a suspected dip is looked for

FOLD, BRANCH_POINT = "fold", "branch point"
CONTACT_BEGIN, CONTACT_END = "contact begin", "contact end"
SYMMETRY, DOUBLING, NEIMARK_SACKER = "symmetry breaking", "period doubling", "Neimark-Sacker"
KINDS = (FOLD, CONTACT_BEGIN, CONTACT_END, SYMMETRY, DOUBLING, NEIMARK_SACKER, BRANCH_POINT)
CUSP = "cusp"  # of a curve of folds
STABILITY_CHANGES = (FOLD, BRANCH_POINT, SYMMETRY, DOUBLING, NEIMARK_SACKER)


@dataclass(frozen=True, eq=False)
class Found:
    """A refined special point: after branch point ``index``, at ``share`` of the step."""

    kind: str
    index: int
    share: float
    point: Point
    spring: int = -1
    side: int = 0


@dataclass(frozen=True, eq=False)
class Test:
    """One test function: its values at the branch points and anywhere between.

    ``suspects`` are steps without a change of sign that may hide two zeros all the same;
    ``zero`` finds one between two shares of a step where kernels know the test.
    """

    kind: str
    values: Real
    evaluate: Callable[[Point], float]
    spring: int = -1
    side: int = 0
    suspects: tuple[int, ...] = ()
    zero: Callable[[int, float, float], tuple[float, Point]] | None = None


def find_special_points(
    solver: Solver, traced: Traced, maps: Real, eigenvalues: NDArray[np.complex128]
) -> tuple[list[Found], list[str]]:
    """All special points in branch order, and a sentence for each that could not be refined."""
    tests = [*_map_tests(solver, traced, maps, eigenvalues), *_contact_tests(solver, traced)]
    found, notes = zeros_of(tests, solver, traced)
    if isinstance(solver, BalanceSolver) and solver.confirmed:
        side = saddle_side(traced.tangent[:, -1], eigenvalues)
        return _confirmed(ExactBeside(solver, traced), found, notes, side)
    if isinstance(solver, ExactSolver):
        # The multipliers of a series cross +1 a little beside its folds.
        found += _branch_points(solver, traced, maps, eigenvalues)
        found.sort(key=lambda one: (one.index, one.share))
    return found, notes


def zeros_of(tests: list[Test], solver: Solver, traced: Traced) -> tuple[list[Found], list[str]]:
    """Zeros of test functions in branch order, and a sentence for each that was not refined."""
    found: list[Found] = []
    notes: list[str] = []
    missed: list[tuple[int, str]] = []
    for test in tests:
        for p, low, high in _brackets(solver, traced, test, notes):
            try:
                found.append(_refine(solver, traced, test, p, low, high))
            except IncompleteError as error:
                missed.append((p, f"{test.kind}: {error}"))
    # Where several multipliers pass 1 at once, tests of pairs of them vanish there as well.
    known = {one.index for one in found if one.kind == FOLD}
    notes += [sentence for p, sentence in missed if p not in known]
    kept = sorted(
        (one for one in found if _is_real(solver, one)), key=lambda one: (one.index, one.share)
    )
    return kept, notes


def _confirmed(
    beside: ExactBeside, found: list[Found], notes: list[str], side: NDArray[np.bool_]
) -> tuple[list[Found], list[str]]:
    """Special points of a series that the exact motions beside it show; notes of the others."""
    positions = np.array([one.index + one.share for one in found])
    shown = np.ones(len(found), dtype=bool)
    for kind in STABILITY_CHANGES:
        ours = np.flatnonzero([one.kind == kind for one in found])
        if not ours.size:
            continue
        ends = np.array([-1.0, *positions[ours], beside.traced.omega.size])
        rooms = list(pairwise(np.diff(ends).tolist()))
        shown[ours] = (
            beside.folds_shown(positions[ours], side)
            if kind == FOLD
            else [
                beside.crosses(position, min(room), MAP_TESTS[kind])
                for position, room in zip(positions[ours], rooms, strict=True)
            ]
        )
        if kind in _ALONG:
            for i, room in zip(ours, rooms, strict=True):
                shown[i] = shown[i] or beside.passes(positions[i], room, _ALONG[kind])
        omegas = [found[i].point.omega for i in ours if not shown[i]]
        notes += [unconfirmed_note(kind, omegas)] if omegas else []
    return [one for one, kept in zip(found, shown, strict=True) if kept], notes


def _minus_one(return_map: Real) -> float:
    return float(determinant_plus(return_map))


def _unit_pair(return_map: Real) -> float:
    return float(neimark_sacker(eigenvalues_of(return_map)))


def _fold_along(traced: Traced, maps: Real) -> Real:  # noqa: ARG001
    return traced.tangent[:, -1]


def _neimark_sacker_along(traced: Traced, maps: Real) -> Real:  # noqa: ARG001
    return neimark_sacker(eigenvalues_of(maps))


# These may stand where a branch turns back, so that no exact motion has the speed of the series.
_ALONG: dict[str, Callable[[Traced, Real], Real]] = {
    FOLD: _fold_along,
    NEIMARK_SACKER: _neimark_sacker_along,
}
MAP_TESTS: dict[str, Callable[[Real], float]] = {
    SYMMETRY: _minus_one,
    DOUBLING: _minus_one,
    NEIMARK_SACKER: _unit_pair,
}


def _map_tests(
    solver: Solver, traced: Traced, maps: Real, eigenvalues: NDArray[np.complex128]
) -> list[Test]:
    fold = traced.tangent[:, -1] / traced.course.omega_step
    flips = determinant_plus(maps)
    # Where nothing holds a drift an eigenvalue is -1 all along, and the determinant is rounding.
    largest = np.log1p(np.abs(eigenvalues)).sum(axis=1)
    flips[np.abs(flips) < ROUNDING * np.exp(np.minimum(largest, LARGEST_LOG))] = 0.0
    hidden = partial(_plunges, arc=_arc(traced), signature=traced.signature)
    kind = SYMMETRY if solver.half_turn else DOUBLING
    return [
        Test(
            FOLD,
            fold,
            lambda point: point.omega_tangent,
            suspects=hidden(fold),
            zero=partial(solver.zero_between, traced, OF_FOLD),
        ),
        Test(kind, flips, partial(_of_map, solver, kind), suspects=hidden(flips)),
        Test(NEIMARK_SACKER, neimark_sacker(eigenvalues), partial(_of_map, solver, NEIMARK_SACKER)),
    ]


def _of_map(solver: Solver, kind: str, point: Point) -> float:
    """A test of the return map, worked out by the solver at hand."""
    return MAP_TESTS[kind](solver.return_map(point))


def _contact_tests(solver: Solver, traced: Traced) -> list[Test]:
    """Greatest depth beyond each gap over the turn; one side serves for a symmetric motion."""
    springs = solver.springs
    if not springs:
        return []
    tests = []
    for j, spring in enumerate(springs):
        for at, side in enumerate((1, -1)):
            gap = spring.gaps[at]
            if np.isinf(gap) or (side < 0 and solver.half_turn):
                continue

            evaluate = partial(solver.depth, spring=j, side=at)
            depth = traced.depth[:, j, at]
            zero = partial(solver.zero_between, traced, 2 * j + at)
            tests.append(Test(CONTACT_BEGIN, depth, evaluate, j, side, zero=zero))
    return tests


def _brackets(
    solver: Solver, traced: Traced, test: Test, notes: list[str]
) -> list[tuple[int, float, float]]:
    """Steps (p, low share, high share) within which the test changes sign."""
    values = test.values
    sign = np.sign(values)
    brackets = [(int(p), 0.0, 1.0) for p in np.flatnonzero(sign[1:] * sign[:-1] < 0.0)]
    suspects = [*((p - 1, p) for p in _dips(values)), *((p,) for p in test.suspects)]
    settled: set[int] = set()
    for steps in suspects:
        for start in steps:
            if start in settled:
                break
            try:
                bottom = _bottom(solver, traced, test, start, plunges=len(steps) == 1)
            except IncompleteError as error:
                notes.append(f"{test.kind}: {error}")
                continue
            if bottom is not None:
                brackets += [(start, 0.0, bottom), (start, bottom, 1.0)]
                settled.add(start)
                break
    return brackets


def _plunges(values: Real, arc: Real, signature: NDArray[np.int64]) -> tuple[int, ...]:
    """Steps without a change of sign in which the slope at an end would take the test through zero.

    Only steps with contact: without it the eigenvalues are those of the linear machine, all within
    the unit circle.
    """
    slope = np.diff(values) / np.diff(arc)
    step = np.diff(arc)[1:-1]
    first, last = values[1:-2], values[2:-1]
    ahead, behind = first + slope[:-2] * step, last - slope[2:] * step
    over = (first * last > 0.0) & ((ahead * first < 0.0) | (behind * last < 0.0))
    touches = (signature[1:-2] != 0) | (signature[2:-1] != 0)
    return tuple(int(p) + 1 for p in np.flatnonzero(over & touches))


def _branch_points(
    solver: Solver, traced: Traced, maps: Real, eigenvalues: NDArray[np.complex128]
) -> list[Found]:
    """Where an eigenvalue passes +1 and the branch does not turn: another branch crosses.

    So it does where a machine is like itself in more ways than by its mirror image. The loop passes
    such a point by a short step.
    """
    rises = traced.tangent[:, -1] / traced.course.omega_step
    real = eigenvalues.imag == 0.0
    side = np.prod(np.sign(eigenvalues.real - 1.0), axis=1, where=real) * np.sign(rises)
    turns = (rises[1:] * rises[:-1] < 0.0) | (np.abs(rises[1:]) < JUMP)
    # At a corner the map jumps.
    smooth = traced.signature[1:] == traced.signature[:-1]
    steps = map(int, np.flatnonzero((side[1:] * side[:-1] < 0.0) & ~turns & smooth))
    return [_crossing(solver, traced, p, determinant_minus(maps[p : p + 2])) for p in steps]


def _crossing(solver: Solver, traced: Traced, p: int, ends: Real) -> Found:
    """Where det(I - P), (2,) at the ends of step p, is zero: there the branch's matrix is singular.

    So near to it that no motion can be solved for, the nearest one found stands for it.
    """
    nearer = int(abs(ends[1]) < abs(ends[0]))
    u, omega = traced.u[p + nearer].copy(), float(traced.omega[p + nearer])
    rise = float(traced.tangent[p + nearer, -1] / traced.course.omega_step)
    known = {float(nearer): solver.point_at(u, omega, rise, None)}

    def value(share: float) -> float:
        if share in (0.0, 1.0):
            return float(ends[int(share)])
        try:
            known[share] = solver.between(traced, p, share)
        except IncompleteError:
            return 0.0
        return float(determinant_minus(solver.return_map(known[share])))

    share = brentq(value, 0.0, 1.0, xtol=SHARE_TOLERANCE) if ends[0] * ends[1] < 0.0 else nearer
    share = min(known, key=lambda one: abs(one - share))
    return Found(BRANCH_POINT, p, share, known[share])


def _arc(traced: Traced) -> Real:
    """Length along the branch at its points, in steps."""
    size = np.abs(traced.u).max(axis=0, initial=0.0) * traced.course.u_step
    shape = traced.u / np.where(size > 0.0, size, 1.0)
    scaled = np.column_stack([shape, traced.omega / traced.course.omega_step])
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(scaled, axis=0), axis=1))])


def _dips(values: Real) -> list[int]:
    """Interior points where |test| is least and, judged by its neighbours, may fall to zero."""
    size, sign = np.abs(values), np.sign(values)
    before, inner, after = size[:-2], size[1:-1], size[2:]
    same = sign[1:] == sign[:-1]
    least = same[:-1] & same[1:] & (inner <= before) & (inner < after)
    if not least.any():
        return []
    curvature = before - 2.0 * inner + after
    with np.errstate(divide="ignore", invalid="ignore"):
        bottom = inner - (after - before) ** 2 / (8.0 * curvature)
    low = LOW * float(size.max(initial=0.0))
    sharp = inner < SHARP_DIP * np.minimum(before, after)
    deep = (bottom < DIP * inner) | (inner < low) | sharp
    return [int(p) + 1 for p in np.flatnonzero(least & deep)]


def _bottom(solver: Solver, traced: Traced, test: Test, p: int, *, plunges: bool) -> float | None:
    """Share in step p where the test has the other sign, None when it never has.

    With ``plunges`` three points within the step are tried first: where none is lower than both
    ends, there is no dip.
    """
    sign = float(np.sign(test.values[p]))
    low, high = 0.0, 1.0

    def height(share: float) -> float:
        return sign * test.evaluate(solver.between(traced, p, share))

    if plunges:
        first, last = np.abs(test.values[p : p + 2])
        heights = [first, *(height(share) for share in QUARTERS[1:-1]), last]
        lowest = int(np.argmin(heights))
        if lowest in (0, len(QUARTERS) - 1):
            return None
        low, high = QUARTERS[lowest - 1], QUARTERS[lowest + 1]
    best = minimize_scalar(
        height, bounds=(low, high), method="bounded", options={"maxiter": BOTTOM_STEPS}
    )
    return float(best.x) if best.fun < 0.0 else None


def _refine(solver: Solver, traced: Traced, test: Test, p: int, low: float, high: float) -> Found:
    """Root of the test on corrected points between two shares of step p."""
    if test.zero is not None:
        share, point = _known_zero(solver, traced, test.kind, partial(test.zero, p, low, high), p)
    else:
        share, point = _zero_between(solver, traced, test, p, low, high)
    kind = test.kind
    if kind == CONTACT_BEGIN:
        deeper = bool(test.values[p + 1] > 0.0 if high == 1.0 else test.values[p] < 0.0)
        kind = CONTACT_BEGIN if deeper == _rises(traced, p, point, deeper) else CONTACT_END
    return Found(kind, p, share, point, test.spring, test.side)


def _rises(traced: Traced, p: int, point: Point, deeper: bool) -> bool:
    """Whether omega rises along the branch where a contact comes or goes within step p.

    Where the branch turns back at a corner the tangent there may be that of either side: the motion
    without the contact says whether one begins as the speed rises.
    """
    sides = traced.tangent[p : p + 2, -1]
    if sides[0] * sides[1] < 0.0:
        return bool(sides[0 if deeper else 1] > 0.0)
    return point.omega_tangent > 0.0


def _known_zero(
    solver: Solver, traced: Traced, kind: str, zero: Callable[[], tuple[float, Point]], p: int
) -> tuple[float, Point]:
    """Root by the kernels; of a fold of several ranks, which they cannot pass, by least steps."""
    try:
        return zero()
    except IncompleteError:
        if kind != FOLD or type(solver) is not ExactSolver:
            raise
        return double_fold(solver, traced, p)


def _zero_between(
    solver: Solver, traced: Traced, test: Test, p: int, low: float, high: float
) -> tuple[float, Point]:
    """Share and point of the root, by a test that only Python can evaluate."""
    last: dict[float, Point] = {}

    def value(share: float) -> float:
        if share in (0.0, 1.0):
            return float(test.values[p + int(share)])
        last[share] = solver.between(traced, p, share)
        return test.evaluate(last[share])

    share = float(brentq(value, low, high, xtol=SHARE_TOLERANCE, rtol=1e-12))
    return share, last[share] if share in last else solver.between(traced, p, share)


def _is_real(solver: Solver, found: Found) -> bool:
    """False where two real eigenvalues of product 1, not a complex pair, make the test zero."""
    if found.kind != NEIMARK_SACKER:
        return True
    return has_unit_pair(eigenvalues_of(solver.return_map(found.point)))
