"""Equations of motion at varying shaft speed: masses, stops, and the shaft with its torques.

The state is s = (x, x', phi, phi', speed of a converter's field, work put in, work dissipated, work
of the shaft's friction). Shaft angle and field are part of it, so that the equations do not
depend on time explicitly.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.dynamics.law import (
    Stops,
    entered,
    exit_of,
    force,
    regime_at,
    signed_gap,
    spring_force,
    stored_energy,
)
from flipflow.model.contact_law import NO_EXIT, OPEN

UNBALANCE = 2  # power of omega with which its force grows
SHAFT_STATES = 6  # phi, phi', speed of the field, work put in, work dissipated, work of friction
MAINS, CONVERTER = 0, 1  # what a motor is fed by


@by_reference
class Shaft(NamedTuple):
    """The shaft and what turns it, all at the shaft."""

    free: int  # 1: the torques turn it; 0: its acceleration is given
    inertia: float
    breakdown_torque: float
    breakdown_slip: float
    synchronous_speed: float
    pieces: Real  # (K, 5) begin and cubic of each piece of the torque below Kloss' formula
    pieces_end: float  # speed at which they end
    feed: int  # MAINS or CONVERTER
    slip_torque: float  # of a converter: torque for one unit of slip
    torque_limit: float
    friction: float  # constant torque against the motion
    viscous: float
    creep: float  # speed below which the constant torque fades
    weight: float  # m0r g, the largest torque of gravity on the unbalance
    incline: float  # of the x direction to the horizontal, upwards
    ends: Real  # (2,) speeds at which the run ends, infinite for none
    acceleration: Real  # (1,) given one
    share: Real  # (1,) of the motor's torque on the mains: less in star
    field_rate: Real  # (1,) acceleration of the converter's field


@by_reference
class Equations(NamedTuple):
    """N degrees of freedom, m springs, one shaft."""

    inverse_mass: Real  # (N, N)
    damping: Real  # (N, N)
    stiffness: Real  # (N, N)
    direction: Real  # (m, N)
    stops: Stops
    static: Real  # (N,) constant force
    circulation: Real  # (N, N) the part of the stiffness that is not symmetric: it has no energy
    vector: Complex  # (E, N) the excitation is Re(vector exp(i n phi)) phi'^power
    order: Int  # (E,) n
    power: Int  # (E,) 2 is an unbalance, which reacts on the shaft
    shaft: Shaft
    pull: Real  # (N,) scratch: exciting force at no angular acceleration
    lever: Real  # (N,) scratch: exciting force for one unit of it
    push: Real  # (N,) scratch: force of exciter, springs and dampers
    answer: Real  # (N,) scratch: M^-1 lever


@kernel(inline=True)
def motor_torque(shaft: Shaft, speed: float, field: float) -> float:
    """Torque on the mains by its curve, behind a converter by the slip and within the limit."""
    if shaft.feed == CONVERTER:
        torque = shaft.slip_torque * (field - speed)
        return min(max(torque, -shaft.torque_limit), shaft.torque_limit)
    return shaft.share[0] * _mains_torque(shaft, speed)


@kernel(inline=True)
def _mains_torque(shaft: Shaft, speed: float) -> float:
    """T = 2 T_b s s_b / (s^2 + s_b^2), s = 1 - speed / synchronous speed (Kloss), or the pieces."""
    if speed < shaft.pieces_end:
        row = 0
        while row + 1 < shaft.pieces.shape[0] and shaft.pieces[row + 1, 0] <= speed:
            row += 1
        one = shaft.pieces[row]
        d = max(speed - one[0], 0.0)
        return one[1] + d * (one[2] + d * (one[3] + d * one[4]))
    if shaft.breakdown_torque == 0.0:
        return 0.0
    slip = 1.0 - speed / shaft.synchronous_speed
    s_b = shaft.breakdown_slip
    return 2.0 * shaft.breakdown_torque * slip * s_b / (slip * slip + s_b * s_b)


@kernel(inline=True)
def gravity_torque(shaft: Shaft, angle: float) -> float:
    """Torque of the unbalance's weight: it hangs where angle + incline is a quarter turn down."""
    return -shaft.weight * math.cos(angle + shaft.incline)


@kernel(inline=True)
def friction_torque(shaft: Shaft, speed: float) -> float:
    """Torque against the motion: constant, faded below the creep speed, plus viscous."""
    return shaft.friction * math.tanh(speed / shaft.creep) + shaft.viscous * speed


@kernel(inline=True)
def slopes(eq: Equations, regime: Int, point: Real, rows: Real, row: int) -> None:
    """Write ds/dt at ``point`` to ``rows[row]``, with the springs in their regimes.

    M a + C v + K x + sum d H = f_0 + sum p phi'^power + q phi'' with p = Re(vector exp(i n phi)),
    q = Im(vector exp(i n phi)) / n of an unbalance, and J phi'' - q a = T - T_friction + T_gravity:
    phi'' follows after eliminating a.
    """
    n = eq.static.shape[0]
    speed = point[2 * n + 1]
    _excite(eq, point)
    dissipated = _carry(eq, point) + _press(eq, regime, point)
    against = 0.0
    reach = 0.0
    for i in range(n):
        a = 0.0
        b = 0.0
        for k in range(n):
            a += eq.inverse_mass[i, k] * eq.push[k]
            b += eq.inverse_mass[i, k] * eq.lever[k]
        rows[row, n + i] = a
        eq.answer[i] = b
        against += eq.lever[i] * a
        reach += eq.lever[i] * b
    torque = motor_torque(eq.shaft, speed, point[2 * n + 2])
    friction = friction_torque(eq.shaft, speed)
    alpha = eq.shaft.acceleration[0]
    if eq.shaft.free == 1:
        gravity = gravity_torque(eq.shaft, point[2 * n])
        alpha = (torque - friction + gravity + against) / (eq.shaft.inertia - reach)
    work = torque * speed
    for i in range(n):
        rows[row, i] = point[n + i]
        rows[row, n + i] += eq.answer[i] * alpha
        if eq.shaft.free == 0:
            work += (eq.pull[i] + eq.lever[i] * alpha) * point[n + i]
    rows[row, 2 * n] = speed
    rows[row, 2 * n + 1] = alpha
    rows[row, 2 * n + 2] = eq.shaft.field_rate[0]
    rows[row, 2 * n + 3] = work
    rows[row, 2 * n + 4] = dissipated
    rows[row, 2 * n + 5] = friction * speed


@kernel(inline=True)
def _excite(eq: Equations, point: Real) -> None:
    """Write the exciting force without angular acceleration, and for one unit of it."""
    n = eq.static.shape[0]
    angle, speed = point[2 * n], point[2 * n + 1]
    for i in range(n):
        eq.pull[i] = eq.static[i]
        eq.lever[i] = 0.0
    for e in range(eq.power.shape[0]):
        order, power = eq.order[e], eq.power[e]
        cos, sin = math.cos(order * angle), math.sin(order * angle)
        scale = speed**power
        for i in range(n):
            part = eq.vector[e, i]
            eq.pull[i] += (part.real * cos - part.imag * sin) * scale
            if power == UNBALANCE:
                eq.lever[i] += (part.real * sin + part.imag * cos) / order


@kernel(inline=True)
def _carry(eq: Equations, point: Real) -> float:
    """Write the force of exciter, springs and dampers to ``eq.push``; the dampers' power."""
    n = eq.static.shape[0]
    power = 0.0
    for i in range(n):
        drag = 0.0
        spring = 0.0
        for k in range(n):
            drag += eq.damping[i, k] * point[n + k]
            spring += eq.stiffness[i, k] * point[k]
            power += eq.circulation[i, k] * point[k] * point[n + i]
        power += drag * point[n + i]
        eq.push[i] = eq.pull[i] - drag - spring
    return power


@kernel(inline=True)
def gap_motion(eq: Equations, point: Real, j: int) -> tuple[float, float]:
    """Position and rate at spring j."""
    n = eq.static.shape[0]
    y = 0.0
    v = 0.0
    for i in range(n):
        y += eq.direction[j, i] * point[i]
        v += eq.direction[j, i] * point[n + i]
    return y, v


@kernel(inline=True)
def set_regimes(eq: Equations, regime: Int, point: Real) -> None:
    """Regime of each spring at a state."""
    for j in range(regime.shape[0]):
        y, v = gap_motion(eq, point, j)
        regime[j] = regime_at(eq.stops, j, y, v)


@kernel(inline=True)
def _press(eq: Equations, regime: Int, point: Real) -> float:
    """Take the engaged stops' forces off ``eq.push``; returns the power of their dampers."""
    power = 0.0
    for j in range(regime.shape[0]):
        if regime[j] == OPEN:
            continue
        y, v = gap_motion(eq, point, j)
        H = force(eq.stops, j, regime[j], y, v)
        power += (H - spring_force(eq.stops, j, regime[j], y)) * v
        for i in range(eq.static.shape[0]):
            eq.push[i] -= eq.direction[j, i] * H
    return power


@kernel(inline=True)
def switching(
    eq: Equations, regime: Int, point: Real, rows: Real, row: int, j: int, which: int
) -> tuple[float, float]:
    """Value and rate of a switching function: something changes where it rises through zero.

    Each spring has as many as its law has exits, or sides to enter; j beyond the springs names
    the shaft, whose speed may end the run.
    """
    n = eq.static.shape[0]
    if j == regime.shape[0]:
        speed, alpha = point[2 * n + 1], rows[row, 2 * n + 1]
        if which == 0:
            return speed - eq.shaft.ends[1], alpha
        return eq.shaft.ends[0] - speed, -alpha
    y, v = gap_motion(eq, point, j)
    if regime[j] == OPEN:
        return (y - eq.stops.gap[j, 0], v) if which == 0 else (-eq.stops.gap[j, 1] - y, -v)
    alpha, beta, target = exit_of(eq.stops, j, regime[j], which)
    if target == NO_EXIT:
        return -math.inf, 0.0
    side = 1.0 if regime[j] > OPEN else -1.0
    gap = signed_gap(eq.stops, j, regime[j])
    a = 0.0
    for i in range(n):
        a += eq.direction[j, i] * rows[row, n + i]
    return -side * (alpha * (y - gap) + beta * v), -side * (alpha * v + beta * a)


@kernel(inline=True)
def switch(eq: Equations, regime: Int, point: Real, j: int, which: int) -> None:
    """Carry out the change of spring j that its switching function has called.

    A stop that lets go while compressed gives up what its spring holds, and gets it back if it
    takes hold again.
    """
    n = eq.static.shape[0]
    before = regime[j]
    if before == OPEN:
        piece = entered(eq.stops, j)
        regime[j] = piece if which == 0 else -piece
        return
    _, _, target = exit_of(eq.stops, j, before, which)
    regime[j] = target if before > OPEN else -target
    if regime[j] != OPEN:
        y, _ = gap_motion(eq, point, j)
        held = stored_energy(eq.stops, j, before, y)
        point[2 * n + 4] += held - stored_energy(eq.stops, j, regime[j], y)
