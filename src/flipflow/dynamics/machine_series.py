r"""A machine that depends on one parameter, as Chebyshev series of its arrays.

Masses, dampings, stiffnesses, gaps and forces of a machine over an interval of a parameter are

.. math:: A(v) = \sum_k A_k T_k(x), \qquad x = \frac{2 v - low - high}{high - low}.

Nearly every field of a machine enters its matrices linearly, and two terms are exact.

L. N. Trefethen, Approximation Theory and Approximation Practice, 2013, chapters 3 and 8.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from flipflow.compiled.arrays import Int, Real
from flipflow.compiled.compile import kernel
from flipflow.compiled.dense import lu_factor, lu_solve
from flipflow.dynamics.equation_of_motion import MachineArrays

MOST_TERMS = 65  # of a series; a parameter that needs more is not smooth
# Where a series is held against the machine, in [-1, 1].
BETWEEN = (-1.0, -0.97, -0.88, -0.71, -0.45, -0.17, 0.13, 0.41, 0.68, 0.86, 0.96, 1.0)
EXACT = 1e-12  # deviation of a series from the machine, relative to the largest value


class MachineSeries(NamedTuple):
    """Coefficients (T, entries) over [low, high]; an infinite gap stays as it is."""

    low: float
    high: float
    inertia: Real  # (T, N, N) M
    damping: Real  # (T, N, N) C
    stiffness: Real  # (T, N, N) K
    direction: Real  # (T, m, N)
    force: Real  # (T, 2 E, N) real parts, then imaginary ones
    static: Real  # (T, 1, N)
    stop: Real  # (T, 2, m) stiffness and damping
    gap: Real  # (T, m, 2)


class SeriesWork(NamedTuple):
    """Scratch."""

    solved: Real  # (N, N)
    pivot: Int  # (N,)
    column: Real  # (N,)


@kernel
def set_machine(
    series: MachineSeries, work: SeriesWork, value: float, machine: MachineArrays
) -> bool:
    """Write the machine at a value of the parameter; False where its masses are singular."""
    n, m = work.pivot.shape[0], machine.direction.shape[0]
    for i in range(n):
        for j in range(n):
            work.solved[i, j] = term_sum(series, series.inertia, value, i, j)
    if not lu_factor(work.solved, work.pivot):
        return False
    for j in range(n):
        solve_column(series, work, series.stiffness, value, j, machine.stiffness)
        solve_column(series, work, series.damping, value, j, machine.damping)
    for j in range(m):
        for i in range(n):
            machine.direction[j, i] = term_sum(series, series.direction, value, j, i)
            work.column[i] = machine.direction[j, i]
        lu_solve(work.solved, work.pivot, work.column)
        for i in range(n):
            machine.reach[j, i] = work.column[i]
        machine.stops.stiffness[j] = term_sum(series, series.stop, value, 0, j)
        machine.stops.damping[j] = term_sum(series, series.stop, value, 1, j)
        for side in range(2):
            machine.stops.gap[j, side] = term_sum(series, series.gap, value, j, side)
    set_push(series, work, value, machine)
    return True


@kernel
def solve_column(
    series: MachineSeries, work: SeriesWork, terms: Real, value: float, j: int, out: Real
) -> None:
    """Column j of M^-1 A, A given by its terms."""
    n = work.pivot.shape[0]
    for i in range(n):
        work.column[i] = term_sum(series, terms, value, i, j)
    lu_solve(work.solved, work.pivot, work.column)
    for i in range(n):
        out[i, j] = work.column[i]


@kernel
def set_push(series: MachineSeries, work: SeriesWork, value: float, machine: MachineArrays) -> None:
    """M^-1 f of each excitation, and M^-1 f_0."""
    count, n = machine.push.shape
    for part in range(2 * count):
        for i in range(n):
            work.column[i] = term_sum(series, series.force, value, part, i)
        lu_solve(work.solved, work.pivot, work.column)
        e = part % count
        for i in range(n):
            x, push = work.column[i], machine.push[e, i]
            machine.push[e, i] = complex(x, 0.0) if part < count else complex(push.real, x)
    for i in range(n):
        work.column[i] = term_sum(series, series.static, value, 0, i)
    lu_solve(work.solved, work.pivot, work.column)
    for i in range(n):
        machine.static[i] = work.column[i]


@kernel
def term_sum(series: MachineSeries, terms: Real, value: float, i: int, j: int) -> float:
    """Entry (i, j) of a series at a value, by Clenshaw's recurrence."""
    x = (2.0 * value - series.low - series.high) / (series.high - series.low)
    after, before = 0.0, 0.0
    for k in range(terms.shape[0] - 1, 0, -1):
        after, before = terms[k, i, j] + 2.0 * x * after - before, after
    return float(terms[0, i, j] + x * after - before)


def machine_series(
    parts_at: Callable[[float], dict[str, Real]], low: float, high: float
) -> MachineSeries | None:
    """The series of a machine's arrays over an interval; None where they are not smooth.

    Parameters
    ----------
    parts_at
        The arrays that :class:`MachineSeries` names, for a value of the parameter.
    low, high
        The interval.
    """
    first = parts_at(0.5 * (low + high))
    sizes = [array.size for array in first.values()]

    def flat(x: float) -> Real:
        value = 0.5 * (low + high + x * (high - low))
        return np.concatenate([array.ravel() for array in parts_at(value).values()])

    between = np.array([flat(x) for x in BETWEEN])
    size = np.where(np.isfinite(between), np.abs(between), 0.0).max(axis=0)
    largest = np.repeat(
        [part.max(initial=0.0) for part in np.split(size, np.cumsum(sizes)[:-1])], sizes
    )
    terms = 2
    while terms <= MOST_TERMS:
        nodes = chebyshev.chebpts1(terms)
        values = np.array([flat(x) for x in nodes])
        fixed = np.isinf(values).any(axis=0)
        values[:, fixed] = 0.0
        coefficients = np.linalg.solve(chebyshev.chebvander(nodes, terms - 1), values)
        off = np.abs(chebyshev.chebval(np.array(BETWEEN), coefficients).T - between)
        coefficients[0, fixed] = np.inf
        if np.all((off <= EXACT * largest) | fixed):
            split = np.split(coefficients, np.cumsum(sizes)[:-1], axis=1)
            arrays = {
                name: np.ascontiguousarray(part.reshape(terms, *array.shape))
                for (name, array), part in zip(first.items(), split, strict=True)
            }
            return MachineSeries(low, high, **arrays)
        terms = 2 * terms - 1
    return None


def new_series_work(size: int) -> SeriesWork:
    """Scratch for machines of N degrees of freedom."""
    return SeriesWork(np.zeros((size, size)), np.zeros(size, np.int64), np.zeros(size))
