"""Special points of a curve in two parameters: cusps, turning points, and where curves meet.

On a curve one condition holds all along: a multiplier +1 or -1, a pair of product 1, or a grazing.
A second one is met where a test function of the multipliers that are left, or the depth beyond
another gap, passes zero. Zeros are refined on corrected points, as those of a branch are.

Y. A. Kuznetsov, Elements of Applied Bifurcation Theory, chapter 9.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import cast

import numpy as np

from flipflow.compiled.arrays import Complex, Real
from flipflow.compiled.eigen import eigenvalues
from flipflow.continuation.conditions import FLIP, GRAZING, PAIR, SADDLE_NODE
from flipflow.continuation.field_solver import FieldPoint, FieldSolver
from flipflow.continuation.refinement import FOLD as OF_FOLD
from flipflow.continuation.special_points import (
    CUSP,
    DOUBLING,
    FOLD,
    NEIMARK_SACKER,
    SYMMETRY,
    Found,
    Test,
    zeros_of,
)
from flipflow.periodic.solver import Point, Traced
from flipflow.periodic.stability import has_unit_pair, neimark_sacker

TURNING, GRAZES = "turning point", "grazing"
# What a second condition of the same kind is called.
TWICE = {
    SADDLE_NODE: "1:1 resonance",
    FLIP: "1:2 resonance",
    PAIR: "two Neimark-Sacker points",
    GRAZING: "two grazings",
}
# The sum of a pair on the unit circle, 2 cos of its angle, where it is a fraction of a turn.
RESONANCES = {"1:1 resonance": 2.0, "1:2 resonance": -2.0, "1:3 resonance": -1.0,
              "1:4 resonance": 0.0}  # fmt: skip
JUMP = 1e-3  # a test above this share of its values at the ends has jumped there
NOISE = 1e-8  # share of a parameter by which it changes in a step, below which it stands still
SAME = 1e-12  # share of a parameter within which two of its values are one
EVEN = 1e-9  # depth, as a share of the motion, below which another gap is grazed, too
PARALLEL = 1e-3  # share of the largest tangent in a parameter below which the curve stands still

Of = Callable[[Complex], float]


def curve_points(solver: FieldSolver, traced: Traced) -> tuple[list[Found], list[str]]:
    """All special points in the curve's order, and a sentence for each that was not refined."""
    values = solver.own_multipliers(traced)
    tests = [
        *_turning_tests(solver, traced),
        *_map_tests(solver.sought.test, values, half_turn=solver.half_turn),
        *_depth_tests(solver, traced),
    ]
    found, notes = zeros_of(tests, solver, traced)
    by_kind = {(test.kind, test.spring, test.side): test for test in tests}
    kept = [
        one
        for one in found
        if not _jumps(by_kind[one.kind, one.spring, one.side], one)
        and (one.kind != TURNING or _turns_back(traced, one))
    ]
    return _with_cusps(solver, traced, kept), notes


def pair_sum(values: Complex) -> float:
    """Sum of the pair of multipliers whose product is nearest 1: 2 cos of its angle."""
    return float(np.sum(values[list(_critical(PAIR, values))]).real)


def _critical(test: int, values: Complex) -> tuple[int, ...]:
    """Places of the multipliers that a curve holds critical."""
    if test == SADDLE_NODE:
        return (int(np.abs(values - 1.0).argmin()),)
    if test == FLIP:
        return (int(np.abs(values + 1.0).argmin()),)
    if test == PAIR:
        i, j = np.triu_indices(values.size, k=1)
        nearest = int(np.abs(values[i] * values[j] - 1.0).argmin())
        return int(i[nearest]), int(j[nearest])
    return ()


def _left(test: int, values: Complex) -> Complex:
    return np.delete(values, _critical(test, values))


def _to_plus_one(test: int, values: Complex) -> float:
    return float(np.prod(1.0 - _left(test, values)).real)


def _to_minus_one(test: int, values: Complex) -> float:
    return float(np.prod(1.0 + _left(test, values)).real)


def _to_unit_pair(test: int, values: Complex) -> float:
    return float(neimark_sacker(_left(test, values)))


def _to_resonance(total: float, values: Complex) -> float:
    return pair_sum(values) - total


def _map_tests(test: int, values: Complex, *, half_turn: bool) -> list[Test]:
    """Tests of the multipliers along a curve, (n, 2 N)."""
    parts: list[tuple[str, Of]] = [
        (_both(test, other, half_turn=half_turn), partial(of, test))
        for other, of in (
            (SADDLE_NODE, _to_plus_one), (FLIP, _to_minus_one), (PAIR, _to_unit_pair),
        )
    ]  # fmt: skip
    if test == PAIR:
        parts += [(kind, partial(_to_resonance, at)) for kind, at in RESONANCES.items()]
    return [
        Test(kind, np.array([of(row) for row in values]), partial(_at_point, of))
        for kind, of in parts
    ]


def _at_point(of: Of, point: Point) -> float:
    own = cast("FieldPoint", point).own_map
    return of(eigenvalues(cast("Real", own)))


def _both(test: int, other: int, *, half_turn: bool) -> str:
    """What the point is called at which both conditions hold."""
    if test == other:
        return TWICE[test]
    words = {
        SADDLE_NODE: FOLD,
        FLIP: SYMMETRY if half_turn else DOUBLING,
        PAIR: NEIMARK_SACKER,
        GRAZING: GRAZES,
    }
    return " and ".join(words[one] for one in sorted((test, other)))


def _turning_tests(solver: FieldSolver, traced: Traced) -> list[Test]:
    """The tangent's share in either parameter: 0 in the second, 1 in the one beside the state."""
    zero = partial(solver.zero_between, traced, OF_FOLD)
    of_value = Test(
        TURNING, traced.tangent[:, -1] / traced.course.omega_step,
        lambda point: point.omega_tangent, side=0, zero=zero,
    )  # fmt: skip
    of_beside = Test(
        TURNING, traced.tangent[:, -2],
        lambda point: cast("FieldPoint", point).beside_tangent, side=1,
    )  # fmt: skip
    return [of_value, of_beside]


def _depth_tests(solver: FieldSolver, traced: Traced) -> list[Test]:
    """Depths beyond the gaps that are not held at the grazing."""
    sought, tests = solver.sought, []
    least = EVEN * np.abs(traced.u[:, : solver.system.size]).max(initial=0.0)
    kind = _both(sought.test, GRAZING, half_turn=solver.half_turn)
    for gap in range(2 * len(solver.springs)):
        j, side = divmod(gap, 2)
        depth = traced.depth[:, j, side]
        own = sought.test == GRAZING and gap == sought.gap
        if own or (side == 1 and solver.half_turn) or not np.isfinite(depth).all():
            continue
        if sought.test == GRAZING and np.abs(depth).max(initial=0.0) < least:
            continue  # both sides of a stop graze all along
        evaluate = partial(solver.depth, spring=j, side=side)
        zero = partial(solver.zero_between, traced, gap)
        tests.append(Test(kind, depth, evaluate, j, 1 - 2 * side, zero=zero))
    return tests


def _jumps(test: Test, found: Found) -> bool:
    """Whether a test changes its sign without a zero: at a corner, or where it is rounding."""
    ends = np.abs(test.values[found.index : found.index + 2])
    if test.kind == TURNING and test.side == 1:
        return bool(ends.max() < NOISE * abs(cast("FieldPoint", found.point).beside))
    if test.spring >= 0 or test.kind == TURNING:
        return False
    if "Neimark-Sacker" in test.kind and not _has_pair(found.point):
        return True
    return abs(test.evaluate(found.point)) > JUMP * ends.max()


def _turns_back(traced: Traced, found: Found) -> bool:
    """Whether the parameter in which a curve turns lies on one side of its value there.

    Where it stands still, or nearly so, its share in the tangent changes sign by rounding alone. A
    point that is no further from the turn than rounding tells no side, and the one beyond it does.
    """
    point = cast("FieldPoint", found.point)
    at, values = (point.beside, traced.u[:, -1]) if found.side == 1 else (point.value, traced.omega)
    away = values - at
    away[np.abs(away) <= SAME * abs(at)] = 0.0
    before, after = away[: found.index + 1][-2:][::-1], away[found.index + 1 :][:2]
    sides = [np.sign(part[part != 0.0][:1]).sum() for part in (before, after)]
    return bool(sides[0] * sides[1] > 0.0)


def _has_pair(point: Point) -> bool:
    return has_unit_pair(eigenvalues(cast("Real", cast("FieldPoint", point).own_map)))


def _with_cusps(solver: FieldSolver, traced: Traced, found: list[Found]) -> list[Found]:
    """The points, with one cusp in place of the turn in both parameters that it makes."""
    if solver.sought.test != SADDLE_NODE:
        return found
    largest = np.abs(traced.tangent[:, -2]).max()
    cusps = {
        one.index
        for one in found
        if one.kind == TURNING
        and one.side == 0
        and abs(cast("FieldPoint", one.point).beside_tangent) < PARALLEL * largest
    }
    kept = []
    for one in found:
        if one.kind == TURNING and one.index in cusps:
            if one.side == 0:
                kept.append(replace(one, kind=CUSP))
        else:
            kept.append(one)
    return kept
