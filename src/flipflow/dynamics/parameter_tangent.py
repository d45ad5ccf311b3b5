r"""How a recorded flow moves with the machine's parameters: exact derivatives.

With M x'' + C x' + K x + sum_j d_j H_j = f, the derivative x_p at fixed time follows the equation
of the machine itself under the force

    f_p - M_p x'' - C_p x' - K_p x - sum_j (d_p H_j + d_j H_jp),

H_jp at a fixed state. Within a segment x is a sum of exponentials u_k exp(rate_k t), those of the
drive and of the rest among them. Mode i answers to each of them with the divided difference

    phi_ik = (exp(rate_i t) - exp(rate_k t)) / (rate_i - rate_k),

so that W_i = sum_k phi_ik u_k is worked out once for all parameters. Where a stop's force jumps the
velocity is kicked by c M^-1 d times d x_p + d_p x - e_p, the shift of the state against the gap.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.compiled.dense import multiply
from flipflow.dynamics.contact_search import exponential, reciprocal
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import (
    Flow,
    add_driven_slope,
    saltation,
    segment_state,
)
from flipflow.dynamics.law import damping_share, signed_gap, stiffness_share

# What ``Columns.touches`` tells apart, by the names that a machine's parts have.
CHANGED_TOGETHER = (
    ("inertia",), ("damping",), ("stiffness",), ("static",), ("force",),
    ("stop", "gap", "direction"), ("direction",),
)  # fmt: skip
CLOSE = 0.3  # half the difference of two exponents below which their quotient is a series


@by_reference
class Columns(NamedTuple):
    """Derivatives of a machine's arrays with respect to P parameters; P = 0 is the same type."""

    inertia: Real  # (P, N, N) M^-1 M_p
    damping: Real  # (P, N, N) M^-1 C_p
    stiffness: Real  # (P, N, N) M^-1 K_p
    direction: Real  # (P, m, N) d_p
    reach: Real  # (P, m, N) M^-1 d_p
    static: Real  # (P, N) M^-1 f_0p
    push: Complex  # (P, E, N) M^-1 f_p
    stop_stiffness: Real  # (P, m)
    stop_damping: Real  # (P, m)
    gap: Real  # (P, m, 2)
    touches: Int  # (P, 7) 1 where M, C, K, f_0, an excitation, a stop, a direction changes, else 0


def touched(parts: Mapping[str, NDArray[Any]]) -> Int:
    """``touches`` of P parameters by what each changes of a machine's parts, (P, ...) each."""
    changes = [
        np.any([parts[name].any(axis=tuple(range(1, parts[name].ndim))) for name in names], axis=0)
        for names in CHANGED_TOGETHER
    ]
    return np.stack(changes, axis=1).astype(np.int64)


@by_reference
class ColumnWork(NamedTuple):
    """Scratch for R modes, W multiples of omega, P parameters and omega."""

    factor: Complex  # (R,) exp(rate_i t)
    equal: Complex  # (R, R) phi of rates i and j
    conjugate: Complex  # (R, R) phi of rate i and the conjugate of rate j
    still: Complex  # (R,) phi of rate i and 0
    ahead: Complex  # (R, W) half of phi of rate i and i n omega, turned to the segment's start
    behind: Complex  # (R, W) the same for -i n omega
    place: Complex  # (R, N) W of the displacements
    speed: Complex  # (R, N) W of the velocities
    acceleration: Complex  # (R, N) W of the accelerations
    amplitude: Complex  # (R,) modal amplitudes of a tangent
    outer: Complex  # (N, N) a left vector times what it takes
    gain: Complex  # (R, P) what the modes gain over a segment
    free: Real  # (2 N, 2 N) exp(A t)
    moved: Real  # (2 N, 2 N + P + 1) columns on their way
    z: Real  # (2 N,)
    rate: Real  # (2 N,)


def new_column_work(machine: MachineArrays, parameters: int) -> ColumnWork:
    """Scratch for one lane."""
    n, waves = machine.direction.shape[1], machine.order.shape[0]
    R = 2 * n
    return ColumnWork(
        factor=np.zeros(R, np.complex128),
        equal=np.zeros((R, R), np.complex128),
        conjugate=np.zeros((R, R), np.complex128),
        still=np.zeros(R, np.complex128),
        ahead=np.zeros((R, waves), np.complex128),
        behind=np.zeros((R, waves), np.complex128),
        place=np.zeros((R, n), np.complex128),
        speed=np.zeros((R, n), np.complex128),
        acceleration=np.zeros((R, n), np.complex128),
        amplitude=np.zeros(R, np.complex128),
        outer=np.zeros((n, n), np.complex128),
        gain=np.zeros((R, parameters), np.complex128),
        free=np.zeros((R, R)),
        moved=np.zeros((R, R + parameters + 1)),
        z=np.zeros(R),
        rate=np.zeros(R),
    )


@kernel(inline=True)
def divided_difference(a: complex, b: complex, e_a: complex, e_b: complex, t: float) -> complex:
    """(exp(a t) - exp(b t)) / (a - b), given both exponentials; t exp(a t) where a = b."""
    if a == b:
        return t * e_a
    x = 0.5 * t * (a - b)
    square = x * x
    if x.real * x.real + x.imag * x.imag > CLOSE * CLOSE:
        return (e_a - e_b) * reciprocal(a - b)
    series = 1.0 + square / 110.0
    series = 1.0 + square / 72.0 * series
    series = 1.0 + square / 42.0 * series
    series = 1.0 + square / 20.0 * series
    series = 1.0 + square / 6.0 * series
    return t * exponential(0.5 * t * (a + b)) * series


@kernel(inline=True)
def drift_integral(a: complex, e_a: complex, t: float) -> complex:
    """int_0^t exp(a (t - s)) s ds = (exp(a t) - 1 - a t) / a^2."""
    x = a * t
    if x.real * x.real + x.imag * x.imag > CLOSE * CLOSE:
        gap = reciprocal(a)
        return (e_a - 1.0 - x) * gap * gap
    series = 1.0 + 0j
    for k in range(12, 2, -1):
        series = 1.0 + x / k * series
    return 0.5 * t * t * series


@kernel
def divided_differences(
    machine: MachineArrays, flow: Flow, e: int, omega: float, t: float, work: ColumnWork
) -> None:
    """Divided differences of all rates after ``t`` in segment e."""
    modes, slot = flow.modes, flow.slot[e]
    count = modes.mode_count[slot]
    for i in range(count):
        work.factor[i] = exponential(modes.rate[slot, i] * t)
    for i in range(count):
        a, e_a = modes.rate[slot, i], work.factor[i]
        work.still[i] = divided_difference(a, 0j, e_a, 1.0 + 0j, t)
        for j in range(count):
            b, e_b = modes.rate[slot, j], work.factor[j]
            work.equal[i, j] = divided_difference(a, b, e_a, e_b, t)
            work.conjugate[i, j] = divided_difference(a, b.conjugate(), e_a, e_b.conjugate(), t)
    for w in range(machine.order.shape[0]):
        turning = 1j * (machine.order[w] * omega)
        turn, after = 0.5 * exponential(turning * flow.start[e]), exponential(turning * t)
        for i in range(count):
            a, e_a = modes.rate[slot, i], work.factor[i]
            work.ahead[i, w] = turn * divided_difference(a, turning, e_a, after, t)
            back = divided_difference(a, -turning, e_a, after.conjugate(), t)
            work.behind[i, w] = turn.conjugate() * back
    _prepare_free(flow, slot, work)


@kernel(inline=True)
def _prepare_free(flow: Flow, slot: int, work: ColumnWork) -> None:
    """exp(A t) from the modes and their factors."""
    modes, size = flow.modes, work.free.shape[0]
    for k in range(size):
        for s in range(size):
            work.free[k, s] = 0.0
    for i in range(modes.mode_count[slot]):
        factor = modes.weight[slot, i] * work.factor[i]
        for k in range(size):
            one = factor * modes.right[slot, k, i]
            for s in range(size):
                left = modes.left[slot, i, s]
                work.free[k, s] += one.real * left.real - one.imag * left.imag


@kernel
def carry_freely(U: Real, work: ColumnWork) -> None:
    """U = exp(A t) U."""
    multiply(work.free, U, work.moved)
    for k in range(U.shape[0]):
        for c in range(U.shape[1]):
            U[k, c] = work.moved[k, c]


@kernel
def spread_free(flow: Flow, slot: int, q: Complex, work: ColumnWork) -> None:
    """W of a free motion with modal amplitudes q (R,)."""
    modes = flow.modes
    n, count = work.place.shape[1], modes.mode_count[slot]
    for i in range(count):
        for k in range(n):
            work.place[i, k], work.speed[i, k], work.acceleration[i, k] = 0j, 0j, 0j
        for j in range(count):
            rate = modes.rate[slot, j]
            one, two = work.equal[i, j], work.conjugate[i, j]
            pair = modes.weight[slot, j] == 2.0
            for k in range(n):
                x, v = modes.right[slot, k, j] * q[j], modes.right[slot, n + k, j] * q[j]
                a = rate * v
                work.place[i, k] += one * x
                work.speed[i, k] += one * v
                work.acceleration[i, k] += one * a
                if pair:
                    work.place[i, k] += two * x.conjugate()
                    work.speed[i, k] += two * v.conjugate()
                    work.acceleration[i, k] += two * a.conjugate()


@kernel
def _spread_steady(
    machine: MachineArrays, flow: Flow, e: int, omega: float, elapsed: float, work: ColumnWork
) -> None:
    """Add W of the drive and of the rest of segment e after a time."""
    modes, slot = flow.modes, flow.slot[e]
    n = work.place.shape[1]
    for i in range(modes.mode_count[slot]):
        for k in range(n):
            work.place[i, k] += flow.rest[e, k] * work.still[i]
            drift = modes.drift[slot, k]
            if drift != 0.0:
                by = drift_integral(modes.rate[slot, i], work.factor[i], elapsed)
                work.place[i, k] += drift * by
                work.speed[i, k] += drift * work.still[i]
        for w in range(machine.order.shape[0]):
            turning = 1j * (machine.order[w] * omega)
            ahead, behind = work.ahead[i, w], work.behind[i, w]
            for k in range(n):
                x, v = flow.drive[slot, w, k], flow.drive[slot, w, n + k]
                a = turning * v
                work.place[i, k] += ahead * x + behind * x.conjugate()
                work.speed[i, k] += ahead * v + behind * v.conjugate()
                work.acceleration[i, k] += ahead * a + behind * a.conjugate()


@kernel
def mode_gains(
    machine: MachineArrays, flow: Flow, e: int, omega: float, columns: Columns, driven: float,
    work: ColumnWork,
) -> None:  # fmt: skip
    """What the modes gain by each parameter: of the motion itself (driven 1), of a tangent (0)."""
    slot = flow.slot[e]
    for i in range(flow.modes.mode_count[slot]):
        for p in range(work.gain.shape[1]):
            work.gain[i, p] = 0j
        _add_pressed(flow, slot, i, columns.inertia, columns.touches, 0, work.acceleration, work)
        _add_pressed(flow, slot, i, columns.damping, columns.touches, 1, work.speed, work)
        _add_pressed(flow, slot, i, columns.stiffness, columns.touches, 2, work.place, work)
        for j in range(machine.direction.shape[0]):
            _add_stop_gains(machine, flow, e, i, columns, j, driven, work)
        if driven != 0.0:
            _add_driven_gains(machine, flow, e, i, omega, columns, work)


@kernel(inline=True)
def _add_pressed(
    flow: Flow, slot: int, i: int, change: Real, touches: Int, which: int, spread: Complex,
    work: ColumnWork,
) -> None:  # fmt: skip
    """The share -l_i (0, A_p W_i) of a matrix that changes by A_p in ``mode_gains``."""
    n = spread.shape[1]
    for r in range(n):
        left = flow.modes.left[slot, i, n + r]
        for s in range(n):
            work.outer[r, s] = left * spread[i, s]
    for p in range(work.gain.shape[1]):
        if touches[p, which] == 0:
            continue
        along, across = 0.0, 0.0
        for r in range(n):
            for s in range(n):
                along += change[p, r, s] * work.outer[r, s].real
                across += change[p, r, s] * work.outer[r, s].imag
        work.gain[i, p] -= complex(along, across)


@kernel(inline=True)
def _add_driven_gains(
    machine: MachineArrays, flow: Flow, e: int, i: int, omega: float, columns: Columns,
    work: ColumnWork,
) -> None:  # fmt: skip
    """The share of constant force and excitations in ``mode_gains``."""
    n, slot = work.place.shape[1], flow.slot[e]
    for p in range(work.gain.shape[1]):
        if columns.touches[p, 3] != 0:
            for r in range(n):
                left = flow.modes.left[slot, i, n + r]
                work.gain[i, p] += left * columns.static[p, r] * work.still[i]
        if columns.touches[p, 4] == 0:
            continue
        for x in range(machine.power.shape[0]):
            w, total = machine.wave[x], 0j
            for r in range(n):
                one = columns.push[p, x, r]
                push = one * work.ahead[i, w] + one.conjugate() * work.behind[i, w]
                total += flow.modes.left[slot, i, n + r] * push
            work.gain[i, p] += total * omega ** machine.power[x]


@kernel(inline=True)
def _add_stop_gains(
    machine: MachineArrays, flow: Flow, e: int, i: int, columns: Columns, j: int, driven: float,
    work: ColumnWork,
) -> None:  # fmt: skip
    """The share of stop j in ``mode_gains``."""
    regime, stops, n = flow.regimes[e, j], machine.stops, work.place.shape[1]
    f_k, f_c = stiffness_share(stops, j, regime), damping_share(stops, j, regime)
    if f_k == 0.0 and f_c == 0.0:
        return
    slot, still = flow.slot[e], driven * work.still[i]
    k, c = stops.stiffness[j], stops.damping[j]
    depth, rate = -signed_gap(stops, j, regime) * still, 0j
    for s in range(n):
        depth += machine.direction[j, s] * work.place[i, s]
        rate += machine.direction[j, s] * work.speed[i, s]
    force = f_k * k * depth + f_c * c * rate
    for p in range(work.gain.shape[1]):
        if columns.touches[p, 5] == 0:
            continue
        turned, turned_rate = -gap_slope(columns, j, regime, p) * still, 0j
        for s in range(n):
            turned += columns.direction[p, j, s] * work.place[i, s]
            turned_rate += columns.direction[p, j, s] * work.speed[i, s]
        slope = f_k * (columns.stop_stiffness[p, j] * depth + k * turned)
        slope += f_c * (columns.stop_damping[p, j] * rate + c * turned_rate)
        total = flow.modes.gap_pick[slot, i, j] * slope
        for r in range(n):
            total += flow.modes.left[slot, i, n + r] * columns.reach[p, j, r] * force
        work.gain[i, p] -= total


@kernel(inline=True)
def gap_slope(columns: Columns, j: int, regime: int, p: int) -> float:
    """Derivative of the position of the gap on a regime's side."""
    return columns.gap[p, j, 0] if regime > 0 else -columns.gap[p, j, 1]


@kernel(inline=True)
def _add_gains(flow: Flow, slot: int, U: Real, work: ColumnWork) -> None:
    """Add what the modes have gained to the first columns of U."""
    modes = flow.modes
    for i in range(modes.mode_count[slot]):
        for p in range(work.gain.shape[1]):
            gain = modes.weight[slot, i] * work.gain[i, p]
            for k in range(U.shape[0]):
                v = modes.right[slot, k, i]
                U[k, p] += v.real * gain.real - v.imag * gain.imag


@kernel(shared=True)
def advance_columns(
    machine: MachineArrays,
    flow: Flow,
    e: int,
    omega: float,
    columns: Columns,
    elapsed: float,
    U: Real,
    work: ColumnWork,
) -> None:
    """Carry columns from the start of segment e on by ``elapsed``.

    U is (2 N, P), or (2 N, P + 1) with the derivative in omega at fixed time as the last column.
    """
    slot, parameters = flow.slot[e], columns.static.shape[0]
    in_omega = U.shape[1] > parameters
    divided_differences(machine, flow, e, omega, elapsed, work)
    if parameters > 0:
        spread_free(flow, slot, flow.q[e], work)
        _spread_steady(machine, flow, e, omega, elapsed, work)
        mode_gains(machine, flow, e, omega, columns, 1.0, work)
    if in_omega:
        add_driven_slope(machine, flow, slot, omega, flow.start[e], -1.0, U)
    carry_freely(U, work)
    _add_gains(flow, slot, U, work)
    if in_omega:
        add_driven_slope(machine, flow, slot, omega, flow.start[e] + elapsed, 1.0, U)


@kernel(inline=True)
def side_of_change(flow: Flow, e: int) -> int:
    """The regime that tells the side of the stop that changed at the end of segment e."""
    j = flow.spring[e]
    before = flow.regimes[e, j]
    return before if before != 0 else flow.regimes[e + 1, j]


@kernel(inline=True)
def kick_columns(
    machine: MachineArrays, flow: Flow, e: int, columns: Columns, sign: float, U: Real,
    work: ColumnWork,
) -> None:  # fmt: skip
    """Saltation of the columns at the end of segment e, at the state in work.z; undone by -1."""
    j, side, n = flow.spring[e], side_of_change(flow, e), U.shape[0] // 2
    kick = sign * flow.kick[e] * machine.stops.damping[j]
    for p in range(U.shape[1]):
        moved, _ = moved_against_gap(machine, columns, j, side, U, p, work)
        for k in range(n):
            U[n + k, p] += kick * machine.reach[j, k] * moved


@kernel(inline=True)
def moved_against_gap(
    machine: MachineArrays, columns: Columns, j: int, side: int, U: Real, p: int, work: ColumnWork
) -> tuple[float, float]:
    """d x_p + d_p x - e_p and its rate at the state in work.z; p = P stands for omega."""
    n = U.shape[0] // 2
    place, rate = 0.0, 0.0
    for k in range(n):
        place += machine.direction[j, k] * U[k, p]
        rate += machine.direction[j, k] * U[n + k, p]
    if p == columns.static.shape[0]:
        return place, rate
    if columns.touches[p, 5] != 0:
        place -= gap_slope(columns, j, side, p)
    if columns.touches[p, 6] != 0:
        for k in range(n):
            place += columns.direction[p, j, k] * work.z[k]
            rate += columns.direction[p, j, k] * work.z[n + k]
    return place, rate


@kernel(shared=True)
def carry_columns(
    machine: MachineArrays, flow: Flow, omega: float, columns: Columns, U: Real, work: ColumnWork
) -> None:
    """Carry columns of U, (2 N, P) or (2 N, P + 1), over the recorded flow, at fixed times."""
    for e in range(flow.segments[0]):
        length = flow.length[e]
        advance_columns(machine, flow, e, omega, columns, length, U, work)
        if flow.kick[e] != 0.0:
            if _turned(columns):
                segment_state(machine, flow, e, omega, length, work.z, work.rate)
            kick_columns(machine, flow, e, columns, 1.0, U, work)


@kernel(inline=True)
def _turned(columns: Columns) -> bool:
    """Whether a parameter turns the direction of a stop."""
    turns = 0
    for p in range(columns.touches.shape[0]):
        turns += columns.touches[p, 6]
    return turns != 0


@kernel
def carry_starts(
    machine: MachineArrays, flow: Flow, omega: float, columns: Columns, starts: Real,
    tangents: Real, work: ColumnWork,
) -> None:  # fmt: skip
    """Columns and tangent map at the start of each segment of the recorded flow and at its end.

    ``starts`` (E + 1, 2 N, P + 1) begin with 0, omega last and all at fixed times, and ``tangents``
    (E + 1, 2 N, 2 N) with I.
    """
    size, count = starts.shape[1], starts.shape[2]
    for k in range(size):
        for p in range(count):
            starts[0, k, p] = 0.0
        for s in range(size):
            tangents[0, k, s] = 1.0 if k == s else 0.0
    for e in range(flow.segments[0]):
        U, T = starts[e + 1], tangents[e + 1]
        for k in range(size):
            for p in range(count):
                U[k, p] = starts[e, k, p]
            for s in range(size):
                T[k, s] = tangents[e, k, s]
        advance_columns(machine, flow, e, omega, columns, flow.length[e], U, work)
        carry_freely(T, work)
        if flow.kick[e] != 0.0:
            if _turned(columns):
                segment_state(machine, flow, e, omega, flow.length[e], work.z, work.rate)
            kick_columns(machine, flow, e, columns, 1.0, U, work)
            saltation(machine, flow.spring[e], flow.kick[e], T, size)


@kernel
def add_begin(segments: int, begin: Real, tangents: Real, starts: Real) -> None:
    """Add to columns that began with 0 what ``begin`` (2 N, P + 1) brings to each segment."""
    size, count = begin.shape
    for e in range(segments + 1):
        for k in range(size):
            for s in range(size):
                entry = tangents[e, k, s]
                for p in range(count):
                    starts[e, k, p] += entry * begin[s, p]
