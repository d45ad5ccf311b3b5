"""The exact flow: closed form between contacts, certified events, exact tangent with saltation.

In one configuration the state z = (x, x') follows

    z(t) = rest + Re(drive exp(i omega t)) + Re sum_i weight_i v_i q_i exp(rate_i (t - t_s)),

with drive the particular answer to the excitation. A flow is recorded segment by segment; the
tangent is then carried over the record.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled import status
from flipflow.compiled.compile import kernel
from flipflow.dynamics.contact_search import (
    MINUS,
    OPEN,
    PLUS,
    Contact,
    GapMotion,
    exponential,
    next_change,
    reciprocal,
)
from flipflow.dynamics.plan import Complex, Int, Plan, Real


class Flow(NamedTuple):
    """Scratch and record of one flow of up to E segments."""

    drive: Complex  # (S, 2 N) particular answer of each configuration
    drive_slope: Complex  # (S, 2 N) its derivative with respect to omega
    driven_at: Real  # (S,) omega for which ``drive`` holds, NaN: none
    motion: GapMotion
    contact: Contact
    state: Int  # (m,) contact state of each spring
    z: Real  # (2 N,) running state
    segments: Int  # (1,) number recorded
    slot: Int  # (E,) configuration of each segment
    start: Real  # (E,) its starting time
    length: Real  # (E,) its duration
    modes: Complex  # (E, R) q_i at its start
    spring: Int  # (E,) the spring that changed at its end, -1 at the end of the flow
    kick: Real  # (E,) +1 or -1 times c M^-1 d d^T jumps into the tangent there
    states: Int  # (E, m) contact states during the segment


@kernel(inline=True)
def configuration(state: NDArray[np.int64]) -> int:
    """Code of a contact state: base 3, a released spring counts as open."""
    code = 0
    place = 1
    for j in range(state.shape[0]):
        if state[j] == PLUS:
            code += place
        elif state[j] == MINUS:
            code += 2 * place
        place *= 3
    return code


@kernel(inline=True)
def contact_state(contact: Contact, j: int, y: float, v: float) -> int:
    """Contact state of spring j as its position y (and the push) say; at the gap the rate tells."""
    plus, minus = contact.gap_plus[j], contact.gap_minus[j]
    if y > plus or (y == plus and v > 0.0):
        pushes = contact.stiffness[j] * (y - plus) + contact.damping[j] * v >= 0.0
        return PLUS if contact.clipped[j] == 0 or pushes else 2 * PLUS
    if y < -minus or (y == -minus and v < 0.0):
        pushes = contact.stiffness[j] * (y + minus) + contact.damping[j] * v <= 0.0
        return MINUS if contact.clipped[j] == 0 or pushes else 2 * MINUS
    return OPEN


@kernel(inline=True)
def set_contact_state(plan: Plan, flow: Flow) -> None:
    """Contact state of each spring at flow.z."""
    n = plan.direction.shape[1]
    for j in range(flow.state.shape[0]):
        y = 0.0
        v = 0.0
        for i in range(n):
            y += plan.direction[j, i] * flow.z[i]
            v += plan.direction[j, i] * flow.z[n + i]
        flow.state[j] = contact_state(flow.contact, j, y, v)


@kernel(inline=True)
def prepare_drive(plan: Plan, flow: Flow, slot: int, omega: float) -> None:
    """drive = (i omega - A)^-1 (0, M^-1 F(omega)) by modes, and its derivative in omega.

    Only displacements are summed; the velocities are i omega times them.
    """
    if flow.driven_at[slot] == omega:
        return
    n = plan.direction.shape[1]
    scale = omega**plan.power
    scale_slope = plan.power * omega ** (plan.power - 1) if plan.power > 0 else 0.0
    for k in range(n):
        flow.drive[slot, k] = 0.0
        flow.drive_slope[slot, k] = 0.0
    for i in range(plan.mode_count[slot]):
        gap = reciprocal(1j * omega - plan.rate[slot, i])
        plain = plan.force[slot, i] * gap
        plain_slope = plain * (scale_slope - 1j * scale * gap)
        plain *= scale
        gap = reciprocal(1j * omega - plan.rate[slot, i].conjugate())
        conj = plan.force_conj[slot, i] * gap
        conj_slope = conj * (scale_slope - 1j * scale * gap)
        conj *= scale
        pair = plan.weight[slot, i] == 2.0
        for k in range(n):
            v = plan.right[slot, k, i]
            flow.drive[slot, k] += v * plain
            flow.drive_slope[slot, k] += v * plain_slope
            if pair:
                flow.drive[slot, k] += v.conjugate() * conj
                flow.drive_slope[slot, k] += v.conjugate() * conj_slope
    for k in range(n):
        x, slope = flow.drive[slot, k], flow.drive_slope[slot, k]
        flow.drive[slot, n + k] = 1j * omega * x
        flow.drive_slope[slot, n + k] = 1j * (x + omega * slope)
    flow.driven_at[slot] = omega


@kernel(inline=True)
def begin_segment(plan: Plan, flow: Flow, e: int, slot: int, omega: float, t: float) -> None:
    """Write the segment that starts at time t from flow.z: its modes and the motion at the gaps."""
    size = flow.z.shape[0]
    n = size // 2
    count = plan.mode_count[slot]
    turn = exponential(1j * (omega * t))
    flow.slot[e] = slot
    flow.start[e] = t
    for i in range(count):
        flow.modes[e, i] = 0.0
    for k in range(size):
        drive = flow.drive[slot, k]
        steady = plan.rest[slot, k] + drive.real * turn.real - drive.imag * turn.imag
        free = flow.z[k] - steady
        for i in range(count):
            flow.modes[e, i] += plan.left[slot, i, k] * free
    for i in range(count):
        flow.motion.rate[i] = plan.rate[slot, i]
    flow.motion.rate[count] = 1j * omega
    for j in range(flow.state.shape[0]):
        flow.states[e, j] = flow.state[j]
        for i in range(count):
            seen = plan.weight[slot, i] * plan.gap_shape[slot, j, i]
            flow.motion.amplitude[j, i] = seen * flow.modes[e, i]
        offset = 0.0
        driven = 0j
        for k in range(n):
            offset += plan.direction[j, k] * plan.rest[slot, k]
            driven += plan.direction[j, k] * flow.drive[slot, k]
        flow.motion.offset[j] = offset
        flow.motion.amplitude[j, count] = driven * turn


@kernel(inline=True)
def segment_state(
    plan: Plan, flow: Flow, e: int, omega: float, elapsed: float, z: Real, rate: Real
) -> None:
    """State z and its time derivative, ``elapsed`` after the start of segment e."""
    slot = flow.slot[e]
    turn = exponential(1j * (omega * (flow.start[e] + elapsed)))
    for k in range(z.shape[0]):
        steady = flow.drive[slot, k] * turn
        z[k] = plan.rest[slot, k] + steady.real
        rate[k] = (1j * omega * steady).real
    for i in range(plan.mode_count[slot]):
        term = plan.weight[slot, i] * flow.modes[e, i] * exponential(plan.rate[slot, i] * elapsed)
        slope = term * plan.rate[slot, i]
        for k in range(z.shape[0]):
            v = plan.right[slot, k, i]
            z[k] += v.real * term.real - v.imag * term.imag
            rate[k] += v.real * slope.real - v.imag * slope.imag


@kernel(inline=True)
def segment_motion(
    plan: Plan, flow: Flow, e: int, omega: float, coordinate: Real, motion: GapMotion
) -> None:
    """Segment e as sums of exponentials in given coordinates (G, N), the drive as the last term."""
    slot = flow.slot[e]
    count = plan.mode_count[slot]
    n = coordinate.shape[1]
    turn = exponential(1j * omega * flow.start[e])
    motion.rate[count] = 1j * omega
    for i in range(count):
        motion.rate[i] = plan.rate[slot, i]
    for g in range(coordinate.shape[0]):
        motion.offset[g] = 0.0
        driven = 0j
        for k in range(n):
            motion.offset[g] += coordinate[g, k] * plan.rest[slot, k]
            driven += coordinate[g, k] * flow.drive[slot, k]
        motion.amplitude[g, count] = driven * turn
        for i in range(count):
            shape = 0j
            for k in range(n):
                shape += coordinate[g, k] * plan.right[slot, k, i]
            motion.amplitude[g, i] = plan.weight[slot, i] * shape * flow.modes[e, i]


@kernel(inline=True)
def kick_sign(before: int, after: int) -> float:
    """Sign of c M^-1 d d^T in the saltation of a change of contact.

    Entry at the gap switches c y' on and gives -1, exit at the gap +1. Where a clipped spring
    lets go, or takes hold again beyond the gap, its force is zero and the tangent does not jump.
    """
    if before == OPEN and abs(after) == 1:
        return -1.0
    if abs(before) == 1 and after == OPEN:
        return 1.0
    return 0.0


@kernel
def run_flow(plan: Plan, flow: Flow, omega: float, t: float, duration: float, rate: Real) -> int:
    """Carry flow.z over ``duration`` from time t, recording segments; ``rate`` is z' at the end."""
    capacity = flow.start.shape[0]
    set_contact_state(plan, flow)
    end = t + duration
    fired = -1
    for e in range(capacity):
        slot = plan.slot[configuration(flow.state)]
        flow.segments[0] = e + 1
        if slot < 0:
            return status.MISSING_CONFIGURATION
        prepare_drive(plan, flow, slot, omega)
        begin_segment(plan, flow, e, slot, omega, t)
        length, spring, new = next_change(
            flow.motion, flow.contact, flow.state, plan.mode_count[slot] + 1, end - t, fired
        )
        if math.isnan(length):
            return status.SEARCH_NOT_ENDED
        flow.length[e] = length
        flow.spring[e] = spring
        flow.kick[e] = 0.0
        segment_state(plan, flow, e, omega, length, flow.z, rate)
        if spring < 0:
            return status.OK
        flow.kick[e] = kick_sign(flow.state[spring], new)
        flow.state[spring] = new
        fired = spring
        t += length
    return status.TOO_MANY_EVENTS


@kernel(inline=True)
def contact_number(flow: Flow) -> int:
    """A number that changes when the contacts of the record change: how often each spring does."""
    total = 0
    for e in range(flow.segments[0] - 1):
        total += 1 + 1000 * flow.spring[e]
    return total


@kernel
def carry_tangent(plan: Plan, flow: Flow, omega: float, U: Real, work: Complex) -> None:
    """Carry columns of U, (2 N, 2 N) or (2 N, 2 N + 1), over the recorded flow.

    The first 2 N columns are the tangent of the state. One more is dz/d omega at fixed time: it
    follows the same linear equation around the derivative of the driven motion,
    Re((drive' + i t drive) exp(i omega t)). ``work`` is (R, columns).
    """
    size = U.shape[0]
    driven = U.shape[1] > size
    for e in range(flow.segments[0]):
        slot = flow.slot[e]
        length = flow.length[e]
        if driven:
            _add_driven_slope(flow, slot, omega, flow.start[e], -1.0, U)
        _carry_free(plan, slot, length, U, work)
        if driven:
            _add_driven_slope(flow, slot, omega, flow.start[e] + length, 1.0, U)
        if flow.kick[e] != 0.0:
            saltation(plan, flow.spring[e], flow.kick[e], U, size)


@kernel(inline=True)
def _add_driven_slope(flow: Flow, slot: int, omega: float, t: float, sign: float, U: Real) -> None:
    turn = exponential(1j * (omega * t))
    last = U.shape[1] - 1
    for k in range(U.shape[0]):
        slope = (flow.drive_slope[slot, k] + 1j * t * flow.drive[slot, k]) * turn
        U[k, last] += sign * slope.real


@kernel(inline=True)
def _carry_free(plan: Plan, slot: int, length: float, U: Real, work: Complex) -> None:
    """U = exp(A length) U by the modes of the configuration."""
    size, columns = U.shape
    count = plan.mode_count[slot]
    for i in range(count):
        factor = plan.weight[slot, i] * exponential(plan.rate[slot, i] * length)
        for c in range(columns):
            q = 0j
            for k in range(size):
                q += plan.left[slot, i, k] * U[k, c]
            work[i, c] = factor * q
    for k in range(size):
        for c in range(columns):
            total = 0.0
            for i in range(count):
                v = plan.right[slot, k, i]
                total += v.real * work[i, c].real - v.imag * work[i, c].imag
            U[k, c] = total


@kernel(inline=True)
def saltation(plan: Plan, spring: int, sign: float, U: Real, size: int) -> None:
    """U = S U with S = I + sign (0, M^-1 d c) (d, 0)^T.

    In general S = I + (f+ - f-) n^T / (n^T f-), n normal to the gap surface. Here f+ - f- is
    proportional to the gap velocity n^T f-, which therefore cancels: S is constant, and exact at
    grazing too.
    """
    n = size // 2
    for c in range(U.shape[1]):
        gap = 0.0
        for k in range(n):
            gap += plan.direction[spring, k] * U[k, c]
        for k in range(n):
            U[n + k, c] += sign * plan.kick[spring, k] * gap
