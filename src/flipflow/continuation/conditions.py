r"""Exact derivatives of what is zero along a curve in two parameters.

With one multiplier at +1 it is det(M - I), M the return map, with one at -1 det(M + I), with two of
product 1 det(C - I), C the second compound matrix of M, whose eigenvalues these products are; and
of a grazing the depth beyond the gap. A determinant of A(M) changes by tr(adj(A) dA): weights on
the entries of dM, whose derivatives in the state are the second ones of the flow. The state's
components count as parameters that move where the flow begins.

Y. A. Kuznetsov, Elements of Applied Bifurcation Theory, chapter 10.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flipflow.compiled import status
from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.compiled.dense import lu_factor, lu_solve
from flipflow.dynamics.contact_search import extremes, prepare_search
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import MOST_SEGMENTS, segment_motion, segment_state
from flipflow.dynamics.machine_series import MachineSeries, new_columns
from flipflow.dynamics.multiplier_slopes import (
    MultiplierWork,
    new_multiplier_work,
    weighted_slopes,
)
from flipflow.dynamics.parameter_tangent import (
    Columns,
    ColumnWork,
    add_begin,
    advance_columns,
    carry_columns,
    carry_starts,
    gap_slope,
    new_column_work,
)
from flipflow.dynamics.parameter_variation import set_limits
from flipflow.periodic.shooting import Shooting, ShootingWork

# What is followed: motions, or those with a multiplier +1, with one -1, with two of product 1, and
# those that graze a gap.
MOTION, SADDLE_NODE, FLIP, PAIR, GRAZING = range(5)
SINGULAR = 1e-15  # share of a matrix by which one that is singular to the last digit is moved


@by_reference
class ConditionWork(NamedTuple):
    """Scratch for F fields and, along a curve, 2 N components of the state: P of both together."""

    columns: Columns
    column: ColumnWork
    fields: Real  # (2 N, P) columns that begin with 0: the first F, of fields, are not 0
    begin: Real  # (2 N, P + 1) where the flow begins
    ended: Real  # (2 N, P + 1)
    starts: Real  # (E + 1, 2 N, P + 1) at the starts of its segments, and at its end
    tangents: Real  # (E + 1, 2 N, 2 N) tangent maps up to there
    shift: Real  # (E + 1, P + 1) of their times
    multiplier: MultiplierWork
    value: Complex  # (2 N,) scratch
    square: Real  # (2 N, 2 N), or of as many rows as there are pairs of multipliers
    pivot: Int  # one for each of its rows
    adjugate: Real  # of the same
    solved: Real  # one of its columns
    row: Real  # (P + 1,) derivatives of the test function


def new_condition_work(series: MachineSeries, machine: MachineArrays, test: int) -> ConditionWork:
    """Scratch for a machine's series, and what is followed."""
    n, curve = 2 * machine.stiffness.shape[0], test != MOTION
    columns = new_columns(series, machine, n if curve else 0)
    P, segments = columns.touches.shape[0], MOST_SEGMENTS if curve else 0
    rows = n * (n - 1) // 2 if test == PAIR else n
    return ConditionWork(
        columns=columns,
        column=new_column_work(machine, P),
        fields=np.zeros((n, P)),
        begin=np.zeros((n, P + 1)),
        ended=np.zeros((n, P + 1)),
        starts=np.zeros((segments + 1, n, P + 1)),
        tangents=np.zeros((segments + 1, n, n)),
        shift=np.zeros((segments + 1, P + 1)),
        multiplier=new_multiplier_work(n, P),
        value=np.zeros(n, np.complex128),
        square=np.zeros((rows, rows)),
        pivot=np.zeros(rows, np.int64),
        adjugate=np.zeros((rows, rows)),
        solved=np.zeros(rows),
        row=np.zeros(P + 1),
    )


@kernel
def field_columns(
    problem: Shooting, flown: ShootingWork, omega: float, slopes: ConditionWork
) -> None:
    """Derivatives in the fields of the state at the end of the recorded flow, begun with 0."""
    U = slopes.fields
    for k in range(U.shape[0]):
        for p in range(U.shape[1]):
            U[k, p] = 0.0
    carry_columns(problem.machine, flown.flow, omega, slopes.columns, U, slopes.column)


@kernel
def curve_columns(
    problem: Shooting, flown: ShootingWork, omega: float, slopes: ConditionWork
) -> None:
    """Columns at the starts of all segments of the recorded flow, and how these move in time.

    They are taken at fixed times; where the flow begins moves with omega.
    """
    machine, flow, columns, begin = problem.machine, flown.flow, slopes.columns, slopes.begin
    size, last = begin.shape[0], begin.shape[1] - 1
    segment_state(machine, flow, 0, omega, 0.0, flown.start, flown.first_rate)
    for k in range(size):
        for p in range(last):
            begin[k, p] = 1.0 if p == last - size + k else 0.0
        begin[k, last] = flown.first_rate[k] * flow.start[0] / omega
    carry_starts(machine, flow, omega, columns, slopes.starts, slopes.tangents, slopes.column)
    add_begin(flow.segments[0], begin, slopes.tangents, slopes.starts)
    set_limits(
        machine, flow, omega, columns, slopes.starts, slopes.ended, slopes.shift, slopes.column
    )


@kernel
def critical_slopes(
    problem: Shooting, flown: ShootingWork, omega: float, test: int, J: Real, slopes: ConditionWork
) -> tuple[int, float]:
    """Status, and the determinant that is zero where multipliers of J + I are critical.

    Its derivatives are left in slopes.row.
    """
    size, multiplier = slopes.begin.shape[0], slopes.multiplier
    total = 0.0
    for i in range(size):
        for k in range(size):
            total += abs(J[i, k])
    if not math.isfinite(total):
        return status.NOT_FINITE, math.nan
    product = set_adjugate(test, J, slopes)
    if math.isnan(product):
        return status.NOT_FINITE, product
    set_weights(test, J, slopes)
    for c in range(size):
        for k in range(size):
            multiplier.left[c, k] *= problem.sign
    weighted_slopes(
        problem.machine, flown.flow, omega, slopes.columns, slopes.shift, slopes.tangents,
        slopes.value, multiplier, slopes.column,
    )  # fmt: skip
    for p in range(slopes.row.shape[0]):
        slopes.row[p] = 0.0
        for c in range(size):
            slopes.row[p] += multiplier.change[p, c, 0]
    return status.OK, product


@kernel
def set_adjugate(test: int, J: Real, slopes: ConditionWork) -> float:
    """Determinant of the matrix that the test asks for, and its adjugate; NaN without one."""
    rows, product, largest = slopes.square.shape[0], 1.0, 0.0
    set_square(test, J, slopes.square)
    if not lu_factor(slopes.square, slopes.pivot):
        set_square(test, J, slopes.square)
        for i in range(rows):
            for k in range(rows):
                largest = max(largest, abs(slopes.square[i, k]))
        for i in range(rows):
            slopes.square[i, i] += SINGULAR * largest
        if not lu_factor(slopes.square, slopes.pivot):
            return math.nan
    for k in range(rows):
        entry = slopes.square[k, k]
        product *= entry if slopes.pivot[k] == k else -entry
    for c in range(rows):
        for i in range(rows):
            slopes.solved[i] = 1.0 if i == c else 0.0
        lu_solve(slopes.square, slopes.pivot, slopes.solved)
        for i in range(rows):
            slopes.adjugate[i, c] = product * slopes.solved[i]
    return product


@kernel
def set_square(test: int, J: Real, square: Real) -> None:
    """M - I, M + I, or C - I, C the second compound matrix of M = J + I: its minors of two rows."""
    size, row = J.shape[0], 0
    if test != PAIR:
        for i in range(size):
            for k in range(size):
                square[i, k] = J[i, k]
            if test == FLIP:
                square[i, i] += 2.0
        return
    for p in range(size):
        for q in range(p + 1, size):
            column = 0
            for s in range(size):
                for t in range(s + 1, size):
                    minor = entry_of(J, p, s) * entry_of(J, q, t)
                    square[row, column] = minor - entry_of(J, p, t) * entry_of(J, q, s)
                    column += 1
            square[row, row] -= 1.0
            row += 1


@kernel
def entry_of(J: Real, i: int, k: int) -> float:
    """An entry of J + I."""
    return float(J[i, k]) + (1.0 if i == k else 0.0)


@kernel
def set_weights(test: int, J: Real, slopes: ConditionWork) -> None:
    """Weights of dM in the determinant's derivative, transposed, into the left vectors."""
    size, left, adjugate, row = J.shape[0], slopes.multiplier.left, slopes.adjugate, 0
    for i in range(size):
        for k in range(size):
            left[i, k] = adjugate[i, k] if test != PAIR else 0.0
    if test != PAIR:
        return
    for p in range(size):
        for q in range(p + 1, size):
            column = 0
            for s in range(size):
                for t in range(s + 1, size):
                    weight = adjugate[column, row]
                    left[s, p] += weight * entry_of(J, q, t)
                    left[t, q] += weight * entry_of(J, p, s)
                    left[t, p] -= weight * entry_of(J, q, s)
                    left[s, q] -= weight * entry_of(J, p, t)
                    column += 1
            row += 1


@kernel
def highest_summit(
    problem: Shooting, flown: ShootingWork, omega: float, j: int, side: float
) -> tuple[float, float, int, float]:
    """Greatest side * y_j in the recorded flow, or in its mirror image where it is half a turn.

    Then the sign of y_j there, the segment and the time since its start.
    """
    flow, motion = flown.flow, flown.flow.motion
    highest, turned, summit, at = -math.inf, side, 0, 0.0
    for e in range(flow.segments[0]):
        count = segment_motion(problem.machine, flow, e, omega, problem.machine.direction, motion)
        prepare_search(motion, count)
        low, high, at_low, at_high = extremes(motion, count, j, flow.length[e])
        above, below = side > 0.0 or problem.sign < 0.0, side < 0.0 or problem.sign < 0.0
        if above and high > highest:
            highest, turned, summit, at = high, 1.0, e, at_high
        if below and -low > highest:
            highest, turned, summit, at = -low, -1.0, e, at_low
    return highest, turned, summit, at


@kernel
def depth_slopes(
    problem: Shooting, flown: ShootingWork, omega: float, gap: int, slopes: ConditionWork
) -> float:
    """Greatest depth beyond a gap in the recorded flow; its derivatives are left in slopes.row.

    Where it is greatest the motion stands still: when that is does not count, but at an end of the
    flow, which moves with omega.
    """
    machine, flow = problem.machine, flown.flow
    j, side = gap // 2, 1.0 if gap % 2 == 0 else -1.0
    highest, turned, summit, at = highest_summit(problem, flown, omega, j, side)
    U, columns, last = slopes.ended, slopes.columns, slopes.row.shape[0] - 1
    for k in range(U.shape[0]):
        for p in range(last + 1):
            U[k, p] = slopes.starts[summit, k, p]
    advance_columns(machine, flow, summit, omega, columns, at, U, slopes.column)
    segment_state(machine, flow, summit, omega, at, flown.start, flown.first_rate)
    rate = 0.0
    for k in range(machine.direction.shape[1]):
        rate += turned * machine.direction[j, k] * flown.first_rate[k]
    for p in range(last + 1):
        slopes.row[p] = 0.0
        for k in range(machine.direction.shape[1]):
            slopes.row[p] += turned * machine.direction[j, k] * U[k, p]
            if p < last:
                slopes.row[p] += turned * columns.direction[p, j, k] * flown.start[k]
        if p < last:
            slopes.row[p] -= side * gap_slope(columns, j, 1 if side > 0.0 else -1, p)
    slopes.row[last] -= rate * (flow.start[summit] + at) / omega
    return highest - machine.stops.gap[j, gap % 2]
