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

MOST_TERMS = 65  # in a parameter; one that needs more is not smooth
# Where a series is held against the machine, in [-1, 1].
BETWEEN = (-1.0, -0.97, -0.88, -0.71, -0.45, -0.17, 0.13, 0.41, 0.68, 0.86, 0.96, 1.0)
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
        solve_column(work, series.stiffness, x, y, j, machine.stiffness)
        solve_column(work, series.damping, x, y, j, machine.damping)
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
def solve_column(work: SeriesWork, terms: Real, x: float, y: float, j: int, out: Real) -> None:
    """Column j of M^-1 A, A given by its terms."""
    n = work.pivot.shape[0]
    for i in range(n):
        work.column[i] = term_sum(terms, x, y, i, j)
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
        for i in range(n):
            work.column[i] = term_sum(series.force, x, y, part, i)
        lu_solve(work.solved, work.pivot, work.column)
        e = part % count
        for i in range(n):
            force, push = work.column[i], machine.push[e, i]
            machine.push[e, i] = complex(force, 0.0) if part < count else complex(push.real, force)
    for i in range(n):
        work.column[i] = term_sum(series.static, x, y, 0, i)
    lu_solve(work.solved, work.pivot, work.column)
    for i in range(n):
        machine.static[i] = work.column[i]


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


def new_series_work(size: int) -> SeriesWork:
    """Scratch for machines of N degrees of freedom."""
    return SeriesWork(np.zeros((size, size)), np.zeros(size, np.int64), np.zeros(size))
