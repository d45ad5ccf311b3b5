"""The section of shooting: the phase of the force at which a motion's state is the unknown.

A section is as good as the state there is far from every surface at which a stop changes its
regime: from an edge of contact, from the gap that a motion is about to graze, from the release of
a law that lets go before the gap.
"""

from __future__ import annotations

import math

from flipflow.compiled import status
from flipflow.compiled.arrays import Real
from flipflow.compiled.compile import kernel
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import (
    Flow,
    carry_tangent,
    end_segment,
    run_flow,
    segment_state,
    set_factors,
    set_turns,
)
from flipflow.dynamics.law import exit_of, signed_gap
from flipflow.model.contact_law import MOST_EXITS, NO_EXIT, OPEN
from flipflow.periodic.shooting import Shooting, ShootingWork

CANDIDATES = 60  # phases that are tried, in a motion of up to a turn
NEAR = 0.15  # margin below which a better section is looked for, as a share of the motion
WORN = 0.6  # share of the margin at the last choice below which it is looked for again
BETTER = 1.5  # a section this many times better is moved to


@kernel
def margin(machine: MachineArrays, flow: Flow, e: int, z: Real, omega: float) -> float:
    """Least distance of a state from a change of contact, as a share of the motion's size."""
    n = machine.direction.shape[1]
    size = 0.0
    for k in range(n):
        size = max(size, math.hypot(z[k], z[n + k] / omega))
    least = math.inf
    for j in range(machine.direction.shape[0]):
        y, v, reach = 0.0, 0.0, 0.0
        for k in range(n):
            y += machine.direction[j, k] * z[k]
            v += machine.direction[j, k] * z[n + k]
            reach += abs(machine.direction[j, k])
        away = _distance(machine, j, flow.regimes[e, j], y, v, omega)
        least = min(least, away / (reach * size))
    return least


@kernel
def _distance(
    machine: MachineArrays, j: int, regime: int, y: float, v: float, omega: float
) -> float:
    """Distance in m of spring j from its next change, had all of it to be covered by the gap.

    Where a change looks at the rate alone, a rate v is as far as v / omega.
    """
    stops = machine.stops
    if regime == OPEN:
        return min(abs(stops.gap[j, 0] - y), abs(stops.gap[j, 1] + y))
    side = 1.0 if regime > OPEN else -1.0
    depth, rate = side * (y - signed_gap(stops, j, regime)), side * v
    least = abs(depth)
    for e in range(MOST_EXITS):
        alpha, beta, target = exit_of(stops, j, regime, e)
        if target == NO_EXIT:
            continue
        away = depth + beta / alpha * rate if alpha != 0.0 else rate / omega
        least = min(least, abs(away))
    return least


@kernel
def better_section(problem: Shooting, work: ShootingWork, omega: float) -> float:
    """Where the section had better stand for the motion last flown: mostly where it stands."""
    flow, machine, stands = work.flow, problem.machine, float(work.section[0])
    if machine.direction.shape[0] == 0:
        return stands
    segment_state(machine, flow, 0, omega, 0.0, work.start, work.first_rate)
    here = margin(machine, flow, 0, work.start, omega)
    if here > min(NEAR, WORN * work.section[1]):
        return stands
    angle = problem.fraction * 2.0 * math.pi
    count = int(CANDIDATES * max(problem.fraction, 1.0))
    best, chosen, e = here, 0.0, 0
    for i in range(1, count):
        t = flow.start[0] + i * angle / (count * omega)
        while e < flow.segments[0] - 1 and flow.start[e + 1] < t:
            e += 1
        segment_state(machine, flow, e, omega, t - flow.start[e], work.start, work.first_rate)
        there = margin(machine, flow, e, work.start, omega)
        if there > best:
            best, chosen = there, i * angle / count
    work.section[1] = best
    if best < BETTER * here:
        return stands
    moved = stands + chosen
    return moved - angle if moved >= angle else moved


@kernel
def carried(problem: Shooting, work: ShootingWork, w: Real, tangent: Real, end: float) -> int:
    """Carry the unknowns w = (z, omega) of a motion and a tangent dw to another section.

    It lies ahead in the same turn, or in the next, where the motion repeats with the problem's
    sign.
    """
    size, sign, angle = work.rate.shape[0], 1.0, end - work.section[0]
    if angle == 0.0:
        return status.OK
    if angle < 0.0:
        sign, angle = problem.sign, angle + problem.fraction * 2.0 * math.pi
    omega, slope, column, flow = float(w[size]), float(tangent[size]), work.column, work.flow
    begin = work.section[0] / omega
    for k in range(size):
        flow.z[k] = w[k]
    code = run_flow(problem.machine, flow, omega, begin, angle / omega, work.rate)
    if code != status.OK:
        return code
    # The column is carried at fixed times; both ends of the flow move with omega as well.
    segment_state(problem.machine, flow, 0, omega, 0.0, work.start, work.first_rate)
    for k in range(size):
        column[k, 0] = tangent[k] + work.first_rate[k] * slope * begin / omega
    carry_tangent(problem.machine, flow, column, slope, work.columns)
    end = begin + angle / omega
    for k in range(size):
        w[k] = sign * flow.z[k]
        tangent[k] = sign * (column[k, 0] - work.rate[k] * slope * end / omega)
    return status.OK


@kernel
def carried_home(problem: Shooting, work: ShootingWork, w: Real, tangent: Real) -> int:
    """Carry the unknowns w of a motion next to the one last flown, and a tangent, to phase 0.

    Newton's last step, from the motion that the flow holds to w, is carried along it as the tangent
    is. What that neglects is of second order in the step, as is the error of Newton's method.
    """
    size, angle, flow = work.rate.shape[0], -work.section[0], work.flow
    if angle == 0.0:
        return status.OK
    angle += problem.fraction * 2.0 * math.pi
    U, omega, begin = work.ahead, float(work.flown[size]), work.section[0]
    step, slope = w[size] - omega, float(tangent[size])
    segment_state(problem.machine, flow, 0, omega, 0.0, work.start, work.first_rate)
    # Columns are carried at fixed times; both ends of the flow move with omega as well.
    for k in range(size):
        U[k, 0], U[k, 1], U[k, 2] = w[k] - work.flown[k], tangent[k], 0.0
        U[k, 2] = work.first_rate[k] * begin / omega**2
    t, e = (begin + angle) / omega, 0
    while e < flow.segments[0] - 1 and flow.start[e + 1] < t:
        e += 1
    segments, length, kick = flow.segments[0], flow.length[e], flow.kick[e]
    flow.segments[0], flow.length[e], flow.kick[e] = e + 1, t - flow.start[e], 0.0
    end_segment(problem.machine, flow, e, omega, work.start, work.rate)
    carry_tangent(problem.machine, flow, U, 1.0, work.columns)
    # Readings and other tangents find the flow as it was recorded.
    flow.segments[0], flow.length[e], flow.kick[e] = segments, length, kick
    set_turns(problem.machine, flow, e + 1, omega, flow.start[e] + length)
    set_factors(flow, e, e, length)
    for k in range(size):
        in_omega = U[k, 2] - work.rate[k] * t / omega
        w[k] = problem.sign * (work.start[k] + U[k, 0] + step * in_omega)
        tangent[k] = problem.sign * (U[k, 1] + slope * in_omega)
    return status.OK


@kernel
def set_section(problem: Shooting, work: ShootingWork, phase: float, anew: bool) -> None:  # noqa: ARG001
    """Let the unknown be the state at a phase of the force."""
    work.section[0] = phase
    if anew:
        work.section[1] = math.inf
