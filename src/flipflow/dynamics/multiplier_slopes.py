r"""Exact derivatives of a motion's multipliers: d mu = l dM r of its left and right eigenvectors.

The map M over the turn is a product of exponentials over segments and of saltations between them.
The right vectors are carried forward to each factor, the left ones back, and of dM only what stands
between a multiplier's own vectors is worked out. Those of a pair are real and imaginary part.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.compiled.dense import lu_factor, lu_solve, multiply
from flipflow.compiled.eigen import Schur, eigenvector, real_schur
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import Flow
from flipflow.dynamics.parameter_tangent import (
    Columns,
    ColumnWork,
    divided_differences,
    mode_gains,
    spread_free,
)

APART = 1e-7  # distance of two multipliers, as a share of the largest, below which they are one


@by_reference
class MultiplierWork(NamedTuple):
    """Scratch for R = 2 N multipliers and P parameters."""

    right: Real  # (R, R) right vectors at phase 0, as columns
    there: Real  # (R, R) the same at a later place
    left: Real  # (R, R) left vectors, as rows, carried back from the end of the turn
    column: Real  # (R,) of their matrix
    product: Real  # (R, R)
    pivot: Int  # (R,)
    change: Real  # (P + 1, R, 2) l dM r of a right vector and the left ones of its pair


def new_multiplier_work(size: int, parameters: int) -> MultiplierWork:
    """Scratch for motions of ``size`` multipliers."""
    squares = {name: np.zeros((size, size)) for name in ("right", "there", "left", "product")}
    return MultiplierWork(
        **squares,
        column=np.zeros(size),
        pivot=np.zeros(size, np.int64),
        change=np.zeros((parameters + 1, size, 2)),
    )


@kernel(entry=True)
def multiplier_slopes(
    machine: MachineArrays, flow: Flow, omega: float, columns: Columns, sign: float, squared: bool,
    shift: Real, tangents: Real, known: Complex, schur: Schur, work: MultiplierWork,
    column: ColumnWork, slopes: Complex,
) -> None:  # fmt: skip
    """Derivatives of multipliers ``known`` into ``slopes`` (R, P), or (R, P + 1) with omega.

    The recorded flow is the turn, or with ``sign`` -1 the half of it after which the motion is its
    own mirror image; ``squared`` where the multipliers are those of the whole all the same.
    ``tangents`` (E + 1, R, R) are the maps up to the starts of its segments, ``shift``
    (E + 1, P + 1) tells how those move in time. Of a double multiplier there is none.
    """
    size, segments = work.pivot.shape[0], flow.segments[0]
    for i in range(size):
        for j in range(size):
            schur.T[i, j] = sign * tangents[segments, i, j]
    if not real_schur(schur, True) or not _set_vectors(schur, sign, work):
        return
    for p in range(work.change.shape[0]):
        for c in range(size):
            work.change[p, c, 0], work.change[p, c, 1] = 0.0, 0.0
    for e in range(segments - 1, -1, -1):
        divided_differences(machine, flow, e, omega, flow.length[e], column)
        _over_segment(machine, flow, e, omega, columns, shift, tangents, schur.value, work, column)
    for k in range(size):
        if schur.value[k].imag >= 0.0 and _is_single(schur.value, k):
            _write(schur.value[k], squared, k, known, work, slopes)


@kernel
def weighted_slopes(
    machine: MachineArrays, flow: Flow, omega: float, columns: Columns, shift: Real, tangents: Real,
    value: Complex, work: MultiplierWork, column: ColumnWork,
) -> None:  # fmt: skip
    """Derivatives of sum_ij W_ij M_ji of the recorded flow's map, weights W in work.left.

    They are left in work.change, a share for each column of the map. ``value`` (R,) is scratch.
    """
    size = work.pivot.shape[0]
    for c in range(size):
        value[c] = 0j  # no column and weight but those of one place belong together
        for k in range(size):
            work.right[k, c] = 1.0 if k == c else 0.0
        for p in range(work.change.shape[0]):
            work.change[p, c, 0] = 0.0
    for e in range(flow.segments[0] - 1, -1, -1):
        divided_differences(machine, flow, e, omega, flow.length[e], column)
        _over_segment(machine, flow, e, omega, columns, shift, tangents, value, work, column)


@kernel(inline=True)
def _write(
    value: complex, squared: bool, k: int, known: Complex, work: MultiplierWork, slopes: Complex
) -> None:
    """The derivatives of eigenvalue k and of its conjugate where their multipliers stand."""
    place = _place_of(value * value if squared else value, known)
    twin = _place_of(known[place].conjugate(), known)
    for p in range(slopes.shape[1]):
        slope = _slope(work.change, p, k, value.imag != 0.0)
        if squared:
            slope *= 2.0 * value
        slopes[twin, p] = slope.conjugate()
        slopes[place, p] = slope


@kernel(inline=True)
def _set_vectors(schur: Schur, sign: float, work: MultiplierWork) -> bool:
    """Right vectors at phase 0, left ones at the end of the turn; False without a basis."""
    size = work.pivot.shape[0]
    k = 0
    while k < size:
        eigenvector(schur, k)
        pair = schur.value[k].imag != 0.0
        for i in range(size):
            work.right[i, k] = schur.scale[i] * schur.vector[i].real
            if pair:
                work.right[i, k + 1] = schur.scale[i] * schur.vector[i].imag
        k += 2 if pair else 1
    for i in range(size):
        for j in range(size):
            work.product[i, j] = work.right[i, j]
    if not lu_factor(work.product, work.pivot):
        return False
    for c in range(size):
        for i in range(size):
            work.column[i] = sign if i == c else 0.0
        lu_solve(work.product, work.pivot, work.column)
        for r in range(size):
            work.left[r, c] = work.column[r]
    return True


@kernel(inline=True)
def _over_segment(
    machine: MachineArrays, flow: Flow, e: int, omega: float, columns: Columns, shift: Real,
    tangents: Real, value: Complex, work: MultiplierWork, column: ColumnWork,
) -> None:  # fmt: skip
    """What segment e and the saltation behind it add, and the left vectors back to its start."""
    size = work.pivot.shape[0]
    multiply(tangents[e], work.right, work.there)
    if flow.kick[e] != 0.0:
        multiply(column.free, work.there, work.product)
        _add_saltation(machine, flow, e, columns, value, work)
        _carry_left_over(machine, flow.spring[e], flow.kick[e], work.left)
    for c in range(size):
        _add_exponential(machine, flow, e, omega, columns, shift, c, value, work, column)
    multiply(work.left, column.free, work.product)
    for r in range(size):
        for c in range(size):
            work.left[r, c] = work.product[r, c]


@kernel(inline=True)
def _add_exponential(
    machine: MachineArrays, flow: Flow, e: int, omega: float, columns: Columns, shift: Real, c: int,
    value: Complex, work: MultiplierWork, column: ColumnWork,
) -> None:  # fmt: skip
    """What the exponential of segment e adds to right vector c, its length among what changes."""
    modes, slot, size = flow.modes, flow.slot[e], work.pivot.shape[0]
    count, parameters = modes.mode_count[slot], columns.static.shape[0]
    for i in range(count):
        column.amplitude[i] = 0j
        for k in range(size):
            column.amplitude[i] += modes.left[slot, i, k] * work.there[k, c]
    spread_free(flow, slot, column.amplitude, column)
    mode_gains(machine, flow, e, omega, columns, 0.0, column)
    first, last = _pair_of(value, c)
    for r in range(first, last):
        rate = 0.0
        for i in range(count):
            taken = 0j
            for k in range(size):
                taken += work.left[r, k] * modes.right[slot, k, i]
            taken *= modes.weight[slot, i]
            after = modes.rate[slot, i] * column.factor[i] * column.amplitude[i]
            rate += (taken * after).real
            for p in range(parameters):
                gain = column.gain[i, p]
                change = taken.real * gain.real - taken.imag * gain.imag
                work.change[p, c, r - first] += change
        for p in range(parameters + 1):
            work.change[p, c, r - first] += (shift[e + 1, p] - shift[e, p]) * rate


@kernel(inline=True)
def _add_saltation(
    machine: MachineArrays, flow: Flow, e: int, columns: Columns, value: Complex,
    work: MultiplierWork,
) -> None:  # fmt: skip
    """What the changing saltation behind segment e adds, right vectors before it in ``product``."""
    j, size = flow.spring[e], work.pivot.shape[0]
    n, sign, damping = size // 2, flow.kick[e], machine.stops.damping[j]
    for p in range(columns.static.shape[0]):
        if columns.touches[p, 5] == 0 and columns.touches[p, 0] == 0:
            continue
        for c in range(size):
            gap, turned = 0.0, 0.0
            for k in range(n):
                gap += machine.direction[j, k] * work.product[k, c]
                turned += columns.direction[p, j, k] * work.product[k, c]
            first, last = _pair_of(value, c)
            for k in range(n):
                reach = columns.reach[p, j, k]
                for s in range(n):
                    reach -= columns.inertia[p, k, s] * machine.reach[j, s]
                slope = columns.stop_damping[p, j] * machine.reach[j, k] + damping * reach
                change = sign * (slope * gap + damping * machine.reach[j, k] * turned)
                for r in range(first, last):
                    work.change[p, c, r - first] += work.left[r, n + k] * change


@kernel(inline=True)
def _carry_left_over(machine: MachineArrays, j: int, sign: float, left: Real) -> None:
    """Left vectors back over a saltation."""
    n = machine.direction.shape[1]
    for r in range(left.shape[0]):
        kicked = 0.0
        for k in range(n):
            kicked += sign * machine.stops.damping[j] * left[r, n + k] * machine.reach[j, k]
        for k in range(n):
            left[r, k] += kicked * machine.direction[j, k]


@kernel(inline=True)
def _pair_of(value: Complex, c: int) -> tuple[int, int]:
    """The places of an eigenvalue and its conjugate: the first, and the one behind the last."""
    if value[c].imag > 0.0:
        return c, c + 2
    return (c - 1, c + 1) if value[c].imag < 0.0 else (c, c + 1)


@kernel(inline=True)
def _slope(change: Real, p: int, k: int, pair: bool) -> complex:
    """Derivative of eigenvalue k from what its vectors, or those of its pair, take of dM."""
    if not pair:
        return complex(change[p, k, 0], 0.0)
    ahead = change[p, k, 0] + change[p, k + 1, 1]
    turned = change[p, k + 1, 0] - change[p, k, 1]
    return complex(0.5 * ahead, 0.5 * turned)


@kernel(inline=True)
def _is_single(value: Complex, k: int) -> bool:
    """Whether no other eigenvalue is the same."""
    largest, nearest = 0.0, math.inf
    for i in range(value.shape[0]):
        largest = max(largest, abs(value[i]))
        if i != k:
            nearest = min(nearest, abs(value[i] - value[k]))
    return nearest >= APART * largest


@kernel(inline=True)
def _place_of(mu: complex, known: Complex) -> int:
    """Where a multiplier stands among those found."""
    place, off = 0, math.inf
    for i in range(known.shape[0]):
        away = abs(known[i] - mu)
        if away < off:
            place, off = i, away
    return place
