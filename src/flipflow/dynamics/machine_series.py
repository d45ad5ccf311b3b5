r"""A machine that depends on one parameter or on two, as Chebyshev series of its arrays.

Masses, dampings, stiffnesses, gaps and forces of a machine over intervals of its parameters are

.. math:: A(v, w) = \sum_{kl} A_{kl} T_k(x) T_l(y), \qquad x = \frac{2 v - low - high}{high - low},

y likewise of the second. Nearly every field of a machine enters its matrices linearly, and two
terms are exact.

L. N. Trefethen, Approximation Theory and Approximation Practice, 2013, chapters 3 and 8.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from flipflow.compiled.arrays import Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.compiled.dense import lu_factor, lu_solve
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.parameter_tangent import Columns, touched

MOST_TERMS = 65  # in a parameter; one that needs more is not smooth
# Where a series is held against the machine, in [-1, 1].
BETWEEN = (-1.0, -0.97, -0.88, -0.71, -0.45, -0.17, 0.13, 0.41, 0.68, 0.86, 0.96, 1.0)
VALUES, IN_VALUE, IN_BESIDE = range(3)  # what is summed: a series, or its derivative in x or y
EXACT = 1e-12  # deviation of a series from the machine, relative to the largest value


@by_reference
class MachineSeries(NamedTuple):
    """Coefficients (T, S, entries) over both intervals; an infinite gap stays as it is."""

    low: float
    high: float
    beside_low: float
    beside_high: float
    inertia: Real  # (T, S, N, N) M
    damping: Real  # (T, S, N, N) C
    stiffness: Real  # (T, S, N, N) K
    direction: Real  # (T, S, m, N)
    force: Real  # (T, S, 2 E, N) real parts, then imaginary ones
    static: Real  # (T, S, 1, N)
    stop: Real  # (T, S, 2, m) stiffness and damping
    gap: Real  # (T, S, m, 2)


@by_reference
class SeriesWork(NamedTuple):
    """Scratch."""

    solved: Real  # (N, N)
    pivot: Int  # (N,)
    column: Real  # (N,)


@kernel
def set_machine(
    series: MachineSeries, work: SeriesWork, value: float, beside: float, machine: MachineArrays
) -> bool:
    """Write the machine at values of both parameters; False where its masses are singular."""
    n, m = work.pivot.shape[0], machine.direction.shape[0]
    x = place(value, series.low, series.high)
    y = place(beside, series.beside_low, series.beside_high)
    for i in range(n):
        for j in range(n):
            work.solved[i, j] = term_sum(series.inertia, x, y, i, j)
    if not lu_factor(work.solved, work.pivot):
        return False
    for j in range(n):
        solve_column(work, series.stiffness, x, y, VALUES, j, machine.stiffness)
        solve_column(work, series.damping, x, y, VALUES, j, machine.damping)
    for j in range(m):
        for i in range(n):
            machine.direction[j, i] = term_sum(series.direction, x, y, j, i)
            work.column[i] = machine.direction[j, i]
        lu_solve(work.solved, work.pivot, work.column)
        for i in range(n):
            machine.reach[j, i] = work.column[i]
        machine.stops.stiffness[j] = term_sum(series.stop, x, y, 0, j)
        machine.stops.damping[j] = term_sum(series.stop, x, y, 1, j)
        for side in range(2):
            machine.stops.gap[j, side] = term_sum(series.gap, x, y, j, side)
    set_push(series, work, x, y, machine)
    return True


@kernel
def place(value: float, low: float, high: float) -> float:
    """Where a value stands in its interval, from -1 to 1; 0 where there is but one value."""
    return (2.0 * value - low - high) / (high - low) if high > low else 0.0


@kernel
def set_columns(
    series: MachineSeries, work: SeriesWork, value: float, beside: float, columns: Columns
) -> None:
    """Derivatives of the machine that ``set_machine`` has just written, in the value alone or both.

    They are the first one or two of the columns; others are left as they are.
    """
    x = place(value, series.low, series.high)
    y = place(beside, series.beside_low, series.beside_high)
    set_column(series, work, x, y, IN_VALUE, 2.0 / (series.high - series.low), 0, columns)
    if series.beside_high > series.beside_low:
        rate = 2.0 / (series.beside_high - series.beside_low)
        set_column(series, work, x, y, IN_BESIDE, rate, 1, columns)


@kernel
def set_column(
    series: MachineSeries, work: SeriesWork, x: float, y: float, along: int, rate: float, p: int,
    columns: Columns,
) -> None:  # fmt: skip
    """Column p: the derivative along one of both parameters, whose place changes at a rate."""
    n, m, count = work.pivot.shape[0], columns.direction.shape[1], columns.push.shape[1]
    for j in range(n):
        solve_column(work, series.inertia, x, y, along, j, columns.inertia[p])
        solve_column(work, series.damping, x, y, along, j, columns.damping[p])
        solve_column(work, series.stiffness, x, y, along, j, columns.stiffness[p])
    for j in range(m):
        solve_row(work, series.direction, x, y, along, j)
        for i in range(n):
            columns.direction[p, j, i] = rate * term_slope(series.direction, x, y, along, j, i)
            columns.reach[p, j, i] = rate * work.column[i]
        columns.stop_stiffness[p, j] = rate * term_slope(series.stop, x, y, along, 0, j)
        columns.stop_damping[p, j] = rate * term_slope(series.stop, x, y, along, 1, j)
        for side in range(2):
            columns.gap[p, j, side] = rate * term_slope(series.gap, x, y, along, j, side)
    for i in range(n):
        for j in range(n):
            columns.inertia[p, i, j] *= rate
            columns.damping[p, i, j] *= rate
            columns.stiffness[p, i, j] *= rate
    for part in range(2 * count):
        solve_row(work, series.force, x, y, along, part)
        e = part % count
        for i in range(n):
            force, push = rate * work.column[i], columns.push[p, e, i]
            columns.push[p, e, i] = (
                complex(force, 0.0) if part < count else complex(push.real, force)
            )
    solve_row(work, series.static, x, y, along, 0)
    for i in range(n):
        columns.static[p, i] = rate * work.column[i]


@kernel
def solve_row(work: SeriesWork, terms: Real, x: float, y: float, along: int, row: int) -> None:
    """M^-1 of a row given by its terms, or of its derivative, into work.column."""
    for i in range(work.pivot.shape[0]):
        work.column[i] = term(terms, x, y, along, row, i)
    lu_solve(work.solved, work.pivot, work.column)


@kernel
def solve_column(
    work: SeriesWork, terms: Real, x: float, y: float, along: int, j: int, out: Real
) -> None:
    """Column j of M^-1 A, A given by its terms, or of its derivative."""
    n = work.pivot.shape[0]
    for i in range(n):
        work.column[i] = term(terms, x, y, along, i, j)
    lu_solve(work.solved, work.pivot, work.column)
    for i in range(n):
        out[i, j] = work.column[i]


@kernel
def set_push(
    series: MachineSeries, work: SeriesWork, x: float, y: float, machine: MachineArrays
) -> None:
    """M^-1 f of each excitation, and M^-1 f_0."""
    count, n = machine.push.shape
    for part in range(2 * count):
        solve_row(work, series.force, x, y, VALUES, part)
        e = part % count
        for i in range(n):
            force, push = work.column[i], machine.push[e, i]
            machine.push[e, i] = complex(force, 0.0) if part < count else complex(push.real, force)
    solve_row(work, series.static, x, y, VALUES, 0)
    for i in range(n):
        machine.static[i] = work.column[i]


@kernel
def term(terms: Real, x: float, y: float, along: int, i: int, j: int) -> float:
    """Entry (i, j) of a series at a place, or of its derivative there."""
    if along == VALUES:
        return float(term_sum(terms, x, y, i, j))
    return float(term_slope(terms, x, y, along, i, j))


@kernel
def term_slope(terms: Real, x: float, y: float, along: int, i: int, j: int) -> float:
    """Derivative of an entry in the place x or y, by the recurrences of T_k and T_k'.

    What stands before T_0 alone is not read: it is infinite of a gap that is.
    """
    total = 0.0
    outer, inner, a, b = terms.shape[0], terms.shape[1], x, y
    if along == IN_BESIDE:
        outer, inner, a, b = inner, outer, y, x
    behind, here, slope_behind, slope = 1.0, a, 0.0, 1.0
    for k in range(1, outer):
        last, now = 1.0, b
        for s in range(inner):
            one = terms[k, s, i, j] if along == IN_VALUE else terms[s, k, i, j]
            total += slope * last * one
            last, now = now, 2.0 * b * now - last
        slope_behind, slope = slope, 2.0 * here + 2.0 * a * slope - slope_behind
        behind, here = here, 2.0 * a * here - behind
    return total


@kernel
def term_sum(terms: Real, x: float, y: float, i: int, j: int) -> float:
    """Entry (i, j) of a series at a place, by Clenshaw's recurrence in y of those in x."""
    after, before, inner = 0.0, 0.0, 0.0
    for s in range(terms.shape[1] - 1, -1, -1):
        ahead, behind = 0.0, 0.0
        for k in range(terms.shape[0] - 1, 0, -1):
            ahead, behind = terms[k, s, i, j] + 2.0 * x * ahead - behind, ahead
        inner = terms[0, s, i, j] + x * ahead - behind
        if s > 0:
            after, before = inner + 2.0 * y * after - before, after
    return float(inner + y * after - before)


def machine_series(
    parts_at: Callable[[float, float], dict[str, Real]],
    low: float,
    high: float,
    beside: tuple[float, float] = (0.0, 0.0),
) -> MachineSeries | None:
    """The series of a machine's arrays over one interval or two; None where they are not smooth.

    Parameters
    ----------
    parts_at
        The arrays that :class:`MachineSeries` names, for values of both parameters.
    low, high
        The first parameter's interval.
    beside
        That of the second; of no width where there is none.
    """
    first = parts_at(0.5 * (low + high), 0.5 * sum(beside))
    sizes = [array.size for array in first.values()]

    def flat(x: float, y: float) -> Real:
        value, other = (
            0.5 * (a + b + at * (b - a)) for at, (a, b) in ((x, (low, high)), (y, beside))
        )
        return np.concatenate([array.ravel() for array in parts_at(value, other).values()])

    def over(xs: Real, ys: Real) -> Real:
        return np.array([[flat(x, y) for y in ys] for x in xs])

    two = beside[1] > beside[0]
    places = np.array(BETWEEN), np.array(BETWEEN if two else (0.0,))
    between = over(*places)
    size = np.where(np.isfinite(between), np.abs(between), 0.0).max(axis=(0, 1))
    largest = np.repeat(
        [part.max(initial=0.0) for part in np.split(size, np.cumsum(sizes)[:-1])], sizes
    )
    terms = 2
    while terms <= MOST_TERMS:
        counts = terms, terms if two else 1
        nodes = tuple(chebyshev.chebpts1(count) for count in counts)
        values = over(*nodes)
        fixed = np.isinf(values).any(axis=(0, 1))
        values[:, :, fixed] = 0.0
        inverse = [
            np.linalg.inv(chebyshev.chebvander(at, count - 1))
            for at, count in zip(nodes, counts, strict=True)
        ]
        coefficients = np.einsum("tx,sy,xye->tse", *inverse, values)
        shapes = [
            chebyshev.chebvander(at, count - 1) for at, count in zip(places, counts, strict=True)
        ]
        off = np.abs(np.einsum("xt,ys,tse->xye", *shapes, coefficients) - between)
        coefficients[0, 0, fixed] = np.inf
        if np.all((off <= EXACT * largest) | fixed):
            split = np.split(coefficients, np.cumsum(sizes)[:-1], axis=2)
            arrays = {
                name: np.ascontiguousarray(part.reshape(*counts, *array.shape))
                for (name, array), part in zip(first.items(), split, strict=True)
            }
            return MachineSeries(low, high, beside[0], beside[1], **arrays)
        terms = 2 * terms - 1
    return None


def new_columns(series: MachineSeries, machine: MachineArrays, others: int) -> Columns:
    """Room for derivatives of a machine in one parameter or both, and as many of 0 behind them."""
    n, (m, _), e = machine.stiffness.shape[0], machine.direction.shape, machine.push.shape[0]
    own = 2 if series.beside_high > series.beside_low else 1
    P = own + others
    # What has no other term than the first does not change along that axis.
    parts = {
        name: np.array([np.any(np.moveaxis(getattr(series, name), p, 0)[1:]) for p in range(own)])
        for name in MachineSeries._fields[4:]
    }
    return Columns(
        inertia=np.zeros((P, n, n)),
        damping=np.zeros((P, n, n)),
        stiffness=np.zeros((P, n, n)),
        direction=np.zeros((P, m, n)),
        reach=np.zeros((P, m, n)),
        static=np.zeros((P, n)),
        push=np.zeros((P, e, n), np.complex128),
        stop_stiffness=np.zeros((P, m)),
        stop_damping=np.zeros((P, m)),
        gap=np.zeros((P, m, 2)),
        touches=np.pad(touched(parts), ((0, others), (0, 0))),
    )


def new_series_work(size: int) -> SeriesWork:
    """Scratch for machines of N degrees of freedom."""
    return SeriesWork(np.zeros((size, size)), np.zeros(size, np.int64), np.zeros(size))
