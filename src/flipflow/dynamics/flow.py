"""The exact flow: closed form between contacts, certified events, exact tangent with saltation.

In one contact state the machine's state z = (x, x') follows

    z(t) = rest + drift (t - t_s) + sum_w Re(drive_w exp(i n_w omega t))
           + Re sum_i weight_i v_i q_i exp(rate_i (t - t_s)),

with drive the particular answer to the excitation at its multiples n_w of omega, and drift that of
what nothing holds to a constant force. A flow is recorded segment by segment; the
tangent is then carried over the record.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flipflow.compiled import status
from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.dynamics.contact_search import (
    GapMotion,
    exponential,
    extremes,
    new_gap_motion,
    next_change,
    prepare_search,
    reciprocal,
)
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.law import (
    damping_share,
    force,
    kind,
    regime_at,
    signed_gap,
    stiffness_share,
    tangent_kick,
)
from flipflow.dynamics.modes import Modes, new_modes, state_number

MOST_SEGMENTS = 600  # that a flow can record; a turn has one more than changes of contact


@by_reference
class Flow(NamedTuple):
    """Modes, scratch, and the record of one flow of up to E segments."""

    modes: Modes
    drive: Complex  # (S, W, 2 N) particular answer of each contact state at each multiple of omega
    drive_slope: Complex  # (S, W, 2 N) its derivative with respect to omega
    driven_at: Real  # (S,) omega for which ``drive`` holds, NaN: none
    motion: GapMotion
    regime: Int  # (m,) running regime of each spring
    z: Real  # (2 N,) running state
    segments: Int  # (1,) number recorded
    slot: Int  # (E,) contact state of each segment
    start: Real  # (E,) its starting time
    length: Real  # (E,) its duration
    q: Complex  # (E, R) modal amplitudes at its start
    factor: Complex  # (E + 1, R) exp(rate_i length) at its end; the last row is scratch
    turn: Complex  # (E + 2, W) exp(i n_w omega t) at its start, next row: at its end; last: scratch
    rest: Real  # (E, N) where it would stand still
    spring: Int  # (E,) the spring that changed at its end, -1 at the end of the flow
    kick: Real  # (E,) +1 or -1 times c M^-1 d d^T jumps into the tangent there
    regimes: Int  # (E, m) regimes during the segment
    stop: Int  # (1,) other than 0: nobody waits for the flow any more


def new_flow(machine: MachineArrays) -> Flow:
    """Scratch for one lane of exact flow."""
    modes = new_modes(machine)
    states, rates = modes.rate.shape
    m, n = machine.direction.shape
    e, waves = MOST_SEGMENTS, machine.order.shape[0]
    return Flow(
        modes=modes,
        drive=np.zeros((states, waves, 2 * n), np.complex128),
        drive_slope=np.zeros((states, waves, 2 * n), np.complex128),
        driven_at=np.full(states, np.nan),
        motion=new_gap_motion(m, np.zeros(rates + waves, np.complex128)),
        regime=np.zeros(m, np.int64),
        z=np.zeros(2 * n),
        segments=np.zeros(1, np.int64),
        slot=np.zeros(e, np.int64),
        start=np.zeros(e),
        length=np.zeros(e),
        q=np.zeros((e, rates), np.complex128),
        factor=np.zeros((e + 1, rates), np.complex128),
        turn=np.zeros((e + 2, waves), np.complex128),
        rest=np.zeros((e, n)),
        spring=np.zeros(e, np.int64),
        kick=np.zeros(e),
        regimes=np.zeros((e, m), np.int64),
        stop=np.zeros(1, np.int64),
    )


@kernel(inline=True)
def set_regimes(machine: MachineArrays, flow: Flow) -> None:
    """Regime of each spring at flow.z."""
    n = machine.direction.shape[1]
    for j in range(flow.regime.shape[0]):
        y = 0.0
        v = 0.0
        for i in range(n):
            y += machine.direction[j, i] * flow.z[i]
            v += machine.direction[j, i] * flow.z[n + i]
        flow.regime[j] = regime_at(machine.stops, j, y, v)


@kernel(inline=True)
def prepare_drive(machine: MachineArrays, flow: Flow, slot: int, omega: float) -> None:
    """drive = (i n omega - A)^-1 (0, M^-1 F(omega)) by modes, and its derivative in omega.

    Only displacements are summed; the velocities are i n omega times them.
    """
    if flow.driven_at[slot] == omega:
        return
    n = machine.direction.shape[1]
    for w in range(machine.order.shape[0]):
        for k in range(n):
            flow.drive[slot, w, k] = 0.0
            flow.drive_slope[slot, w, k] = 0.0
    for e in range(machine.power.shape[0]):
        _add_drive(machine, flow, slot, omega, e)
    for w in range(machine.order.shape[0]):
        turning = 1j * machine.order[w]
        for k in range(n):
            x, slope = flow.drive[slot, w, k], flow.drive_slope[slot, w, k]
            flow.drive[slot, w, n + k] = turning * omega * x
            flow.drive_slope[slot, w, n + k] = turning * (x + omega * slope)
    flow.driven_at[slot] = omega


@kernel(inline=True)
def _add_drive(machine: MachineArrays, flow: Flow, slot: int, omega: float, e: int) -> None:
    """Displacements that one excitation gives, added to those of its multiple of omega."""
    modes, w, power = flow.modes, machine.wave[e], machine.power[e]
    turning = 1j * machine.order[w]
    scale = omega**power
    scale_slope = power * omega ** (power - 1) if power > 0 else 0.0
    for i in range(modes.mode_count[slot]):
        if modes.force[slot, e, i] == 0.0 and modes.force_conj[slot, e, i] == 0.0:
            continue  # at rest, even in resonance without damping
        gap = reciprocal(turning * omega - modes.rate[slot, i])
        plain = modes.force[slot, e, i] * gap
        plain_slope = plain * (scale_slope - turning * scale * gap)
        plain *= scale
        gap = reciprocal(turning * omega - modes.rate[slot, i].conjugate())
        conj = modes.force_conj[slot, e, i] * gap
        conj_slope = conj * (scale_slope - turning * scale * gap)
        conj *= scale
        pair = modes.weight[slot, i] == 2.0
        for k in range(machine.direction.shape[1]):
            v = modes.right[slot, k, i]
            flow.drive[slot, w, k] += v * plain
            flow.drive_slope[slot, w, k] += v * plain_slope
            if pair:
                flow.drive[slot, w, k] += v.conjugate() * conj
                flow.drive_slope[slot, w, k] += v.conjugate() * conj_slope


@kernel(inline=True)
def begin_segment(
    machine: MachineArrays, flow: Flow, e: int, slot: int, omega: float, t: float
) -> None:
    """Write the segment that starts at time t from flow.z: its modes and the motion at the gaps.

    flow.turn holds the turns of the drive at that time.
    """
    modes = flow.modes
    size = flow.z.shape[0]
    n = size // 2
    count, waves = modes.mode_count[slot], machine.order.shape[0]
    flow.slot[e] = slot
    flow.start[e] = t
    set_rest(machine, flow, e, slot)
    for i in range(count):
        flow.q[e, i] = 0.0
    for k in range(size):
        free = flow.z[k] - (flow.rest[e, k] if k < n else modes.drift[slot, k - n])
        for w in range(waves):
            drive, turn = flow.drive[slot, w, k], flow.turn[e, w]
            free -= drive.real * turn.real - drive.imag * turn.imag
        for i in range(count):
            flow.q[e, i] += modes.left[slot, i, k] * free
    for i in range(count):
        flow.motion.rate[i] = modes.rate[slot, i]
    for w in range(waves):
        flow.motion.rate[count + w] = 1j * (machine.order[w] * omega)
    for j in range(flow.regime.shape[0]):
        flow.regimes[e, j] = flow.regime[j]
        for i in range(count):
            seen = modes.weight[slot, i] * modes.gap_shape[slot, j, i]
            flow.motion.amplitude[j, i] = seen * flow.q[e, i]
        _set_steady(machine, flow, e, machine.direction, j, flow.motion)


@kernel(inline=True)
def _set_steady(
    machine: MachineArrays, flow: Flow, e: int, coordinate: Real, g: int, motion: GapMotion
) -> None:
    """Offset, drift and drive of segment e in coordinate g."""
    slot, n = flow.slot[e], coordinate.shape[1]
    count = flow.modes.mode_count[slot]
    motion.offset[g], motion.drift[g] = 0.0, 0.0
    for k in range(n):
        motion.offset[g] += coordinate[g, k] * flow.rest[e, k]
        motion.drift[g] += coordinate[g, k] * flow.modes.drift[slot, k]
    for w in range(machine.order.shape[0]):
        driven = 0j
        for k in range(n):
            driven += coordinate[g, k] * flow.drive[slot, w, k]
        motion.amplitude[g, count + w] = driven * flow.turn[e, w]


@kernel(inline=True)
def set_rest(machine: MachineArrays, flow: Flow, e: int, slot: int) -> None:
    """Where segment e would stand still: held by the springs that are engaged, on their sides."""
    for k in range(flow.rest.shape[1]):
        flow.rest[e, k] = flow.modes.static[slot, k]
    for j in range(flow.regime.shape[0]):
        if kind(machine.stops, j, flow.regime[j]) != 0:
            gap = signed_gap(machine.stops, j, flow.regime[j])
            for k in range(flow.rest.shape[1]):
                flow.rest[e, k] += gap * flow.modes.rest[slot, j, k]


@kernel(inline=True)
def segment_state(
    machine: MachineArrays, flow: Flow, e: int, omega: float, elapsed: float, z: Real, rate: Real
) -> None:
    """State z and its time derivative, ``elapsed`` after the start of segment e."""
    scratch = flow.start.shape[0]
    set_turns(machine, flow, scratch + 1, omega, flow.start[e] + elapsed)
    set_factors(flow, e, scratch, elapsed)
    _state_of_terms(machine, flow, e, scratch, scratch + 1, omega, elapsed, z, rate)


@kernel(inline=True)
def end_segment(
    machine: MachineArrays, flow: Flow, e: int, omega: float, z: Real, rate: Real
) -> None:
    """State and rate at the end of segment e, whose exponentials there are recorded."""
    set_turns(machine, flow, e + 1, omega, flow.start[e] + flow.length[e])
    set_factors(flow, e, e, flow.length[e])
    _state_of_terms(machine, flow, e, e, e + 1, omega, flow.length[e], z, rate)


@kernel(inline=True)
def set_turns(machine: MachineArrays, flow: Flow, row: int, omega: float, t: float) -> None:
    """A row of flow.turn for time t."""
    for w in range(machine.order.shape[0]):
        flow.turn[row, w] = exponential(1j * (machine.order[w] * omega * t))


@kernel(inline=True)
def set_factors(flow: Flow, e: int, row: int, elapsed: float) -> None:
    """A row of flow.factor for a time after the start of segment e."""
    slot = flow.slot[e]
    for i in range(flow.modes.mode_count[slot]):
        flow.factor[row, i] = exponential(flow.modes.rate[slot, i] * elapsed)


@kernel(inline=True)
def _state_of_terms(
    machine: MachineArrays, flow: Flow, e: int, row: int, turned: int, omega: float,
    elapsed: float, z: Real, rate: Real,
) -> None:  # fmt: skip
    """State and rate in segment e from a row of flow.factor and one of flow.turn."""
    modes, slot = flow.modes, flow.slot[e]
    n = z.shape[0] // 2
    for k in range(n):
        drift = modes.drift[slot, k]
        z[k], z[n + k] = flow.rest[e, k] + drift * elapsed, drift
        rate[k], rate[n + k] = drift, 0.0
    for w in range(machine.order.shape[0]):
        turning, turn = machine.order[w] * omega, flow.turn[turned, w]
        for k in range(z.shape[0]):
            steady = flow.drive[slot, w, k] * turn
            z[k] += steady.real
            rate[k] -= turning * steady.imag
    for i in range(modes.mode_count[slot]):
        term = modes.weight[slot, i] * flow.q[e, i] * flow.factor[row, i]
        slope = term * modes.rate[slot, i]
        for k in range(z.shape[0]):
            v = modes.right[slot, k, i]
            z[k] += v.real * term.real - v.imag * term.imag
            rate[k] += v.real * slope.real - v.imag * slope.imag


@kernel(inline=True)
def segment_motion(
    machine: MachineArrays, flow: Flow, e: int, omega: float, coordinate: Real, motion: GapMotion
) -> int:
    """Segment e as sums of exponentials in given coordinates (G, N); the number of its terms.

    The drive stands in the last ones.
    """
    modes, slot = flow.modes, flow.slot[e]
    count, waves = modes.mode_count[slot], machine.order.shape[0]
    n = coordinate.shape[1]
    for w in range(waves):
        motion.rate[count + w] = 1j * (machine.order[w] * omega)
    for i in range(count):
        motion.rate[i] = modes.rate[slot, i]
    for g in range(coordinate.shape[0]):
        _set_steady(machine, flow, e, coordinate, g, motion)
        for i in range(count):
            shape = 0j
            for k in range(n):
                shape += coordinate[g, k] * modes.right[slot, k, i]
            motion.amplitude[g, i] = modes.weight[slot, i] * shape * flow.q[e, i]
    return count + waves


@kernel(shared=True)
def run_flow(
    machine: MachineArrays, flow: Flow, omega: float, t: float, duration: float, rate: Real
) -> int:
    """Carry flow.z over ``duration`` from time t, recording segments; ``rate`` is z' at the end."""
    capacity = flow.start.shape[0]
    set_regimes(machine, flow)
    set_turns(machine, flow, 0, omega, t)
    end = t + duration
    fired = -1
    for e in range(capacity):
        slot = state_number(machine, flow.modes, flow.regime)
        flow.segments[0] = e + 1
        # One way out for both: with two, a branch takes a fifth longer.
        if slot < 0 or flow.stop[0] != 0:
            return status.NO_MODES if slot < 0 else status.STOPPED
        prepare_drive(machine, flow, slot, omega)
        begin_segment(machine, flow, e, slot, omega, t)
        count = flow.modes.mode_count[slot] + machine.order.shape[0]
        length, spring, new = next_change(
            flow.motion, machine.stops, flow.regime, count, end - t, fired
        )
        if math.isnan(length):
            return status.SEARCH_NOT_ENDED
        flow.length[e] = length
        flow.spring[e] = spring
        flow.kick[e] = 0.0
        end_segment(machine, flow, e, omega, flow.z, rate)
        if spring < 0:
            return status.OK
        flow.kick[e] = tangent_kick(machine.stops, spring, flow.regime[spring], new)
        flow.regime[spring] = new
        fired = spring
        t += length
    return status.TOO_MANY_EVENTS


@kernel(inline=True)
def contact_number(flow: Flow, sided: bool) -> int:
    """A number that tells which springs change how often in the record, 0 where none does.

    ``sided``: on which side as well. A motion that is its own mirror image after half a turn
    touches now the one and now the other in the half that is flown.
    """
    total = 0
    for e in range(flow.segments[0] - 1):
        spring = flow.spring[e]
        key = 2 * spring
        if sided and flow.regimes[e, spring] + flow.regimes[e + 1, spring] < 0:
            key += 1
        # Sums of powers tell sets of a few small numbers apart.
        total += 1 + key * (1_000 + key * (1_000_000 + key * 1_000_000_000))
    return total


@kernel(shared=True)
def carry_tangent(machine: MachineArrays, flow: Flow, U: Real, slope: float, work: Complex) -> None:
    """Carry columns of U, (2 N, columns), over the recorded flow, as tangents of the state.

    The last column moves with omega as well, d omega = ``slope``, at fixed time: it follows the
    same linear equation around the derivative of the driven motion,
    slope Re((drive' + i n t drive) exp(i n omega t)). ``work`` is (R, columns).
    """
    size = U.shape[0]
    for e in range(flow.segments[0]):
        slot = flow.slot[e]
        length = flow.length[e]
        if slope != 0.0:
            _add_turned_slope(machine, flow, slot, e, flow.start[e], -slope, U)
        _carry_free(flow, e, U, work)
        if slope != 0.0:
            _add_turned_slope(machine, flow, slot, e + 1, flow.start[e] + length, slope, U)
        if flow.kick[e] != 0.0:
            saltation(machine, flow.spring[e], flow.kick[e], U, size)


@kernel(inline=True)
def add_driven_slope(
    machine: MachineArrays, flow: Flow, slot: int, omega: float, t: float, share: float, U: Real
) -> None:
    """Add a share of the driven motion's derivative in omega at time t to the last column."""
    scratch = flow.start.shape[0] + 1
    set_turns(machine, flow, scratch, omega, t)
    _add_turned_slope(machine, flow, slot, scratch, t, share, U)


@kernel(inline=True)
def _add_turned_slope(
    machine: MachineArrays, flow: Flow, slot: int, row: int, t: float, share: float, U: Real
) -> None:
    """The same with the turns at time t in a row of flow.turn."""
    last = U.shape[1] - 1
    for w in range(machine.order.shape[0]):
        order, turn = machine.order[w], flow.turn[row, w]
        for k in range(U.shape[0]):
            slope = flow.drive_slope[slot, w, k] + 1j * order * t * flow.drive[slot, w, k]
            U[k, last] += share * (slope * turn).real


@kernel(inline=True)
def _carry_free(flow: Flow, e: int, U: Real, work: Complex) -> None:
    """U = exp(A length) U over segment e, by the modes of its contact state."""
    modes, slot = flow.modes, flow.slot[e]
    size, columns = U.shape
    count = modes.mode_count[slot]
    # Columns are innermost: they lie side by side in memory.
    for i in range(count):
        factor = modes.weight[slot, i] * flow.factor[e, i]
        for c in range(columns):
            work[i, c] = 0.0
        for k in range(size):
            left = factor * modes.left[slot, i, k]
            for c in range(columns):
                work[i, c] += complex(left.real * U[k, c], left.imag * U[k, c])
    for k in range(size):
        for c in range(columns):
            U[k, c] = 0.0
        for i in range(count):
            v = modes.right[slot, k, i]
            for c in range(columns):
                U[k, c] += v.real * work[i, c].real - v.imag * work[i, c].imag


@kernel(inline=True)
def saltation(machine: MachineArrays, spring: int, sign: float, U: Real, size: int) -> None:
    """U = S U with S = I + sign (0, M^-1 d c) (d, 0)^T.

    In general S = I + (f+ - f-) n^T / (n^T f-), n normal to the gap surface. Here f+ - f- is
    proportional to the gap velocity n^T f-, which therefore cancels: S is constant, and exact at
    grazing too.
    """
    n = size // 2
    kick = sign * machine.stops.damping[spring]
    for c in range(U.shape[1]):
        gap = 0.0
        for k in range(n):
            gap += machine.direction[spring, k] * U[k, c]
        for k in range(n):
            U[n + k, c] += kick * machine.reach[spring, k] * gap


@kernel(inline=True)
def stop_force(machine: MachineArrays, flow: Flow, e: int, j: int, z: Real) -> float:
    """Force of spring j in segment e at a state."""
    n = machine.direction.shape[1]
    y, v = 0.0, 0.0
    for k in range(n):
        y += machine.direction[j, k] * z[k]
        v += machine.direction[j, k] * z[n + k]
    return force(machine.stops, j, flow.regimes[e, j], y, v)


@kernel
def force_peak(
    machine: MachineArrays, flow: Flow, motion: GapMotion, count: int, e: int, j: int
) -> tuple[float, float]:
    """Greatest force of stop j during segment e, and when; its row becomes the force."""
    set_force(machine, flow, motion, count, e, j)
    prepare_search(motion, count)
    low, high, at_low, at_high = extremes(motion, count, j, flow.length[e])
    return (high, at_high) if high > -low else (-low, at_low)


@kernel
def set_force(
    machine: MachineArrays, flow: Flow, motion: GapMotion, count: int, e: int, j: int
) -> None:
    """Make row j of a segment's motions along the stops the force of stop j."""
    stops, regime = machine.stops, flow.regimes[e, j]
    k = stiffness_share(stops, j, regime) * stops.stiffness[j]
    c = damping_share(stops, j, regime) * stops.damping[j]
    press(motion, count, j, signed_gap(stops, j, regime), k, c)


@kernel(inline=True)
def press(motion: GapMotion, count: int, j: int, gap: float, k: float, c: float) -> None:
    """Make row j of sums of exponentials k (y - gap) + c y'."""
    motion.offset[j] = k * (motion.offset[j] - gap) + c * motion.drift[j]
    motion.drift[j] *= k
    for i in range(count):
        motion.amplitude[j, i] *= k + c * motion.rate[i]
