"""How near a motion is to other contacts: where what a stop watches stands still hardly off zero.

At a grazing a summit of a gap touches a stop, or a valley within a contact leaves it for a moment,
or a force that a law watches hardly reaches zero. None of these need be the greatest depth of a
turn.
"""

from __future__ import annotations

import math

from flipflow.compiled.compile import kernel
from flipflow.dynamics.contact_search import (
    GapMotion,
    exponential,
    exponentials,
    gap_state,
    modulus,
    prepare_search,
    switching_state,
)
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import Flow, segment_motion
from flipflow.dynamics.law import exit_between, exit_of, signed_gap
from flipflow.model.contact_law import MOST_EXITS, NO_EXIT, OPEN
from flipflow.periodic.shooting import Shooting, ShootingWork

PER_RADIAN = 3.0  # samples of a motion in a radian of its fastest oscillation
MOST_SAMPLES = 4000
MOST_NEWTON = 60  # steps to one place where a function stands still
STILL = 1e-8  # last of these steps, as a share of the time between two samples
GRAZES = 1e-9  # depth of a touch, as a share of the motion, that is grazing
ROUNDING = 1e-15  # of h, as a share of the terms of its sum, with the gap


@kernel(entry=True)
def near_grazing(problem: Shooting, work: ShootingWork, omega: float) -> tuple[float, float]:
    """Room and depth in m of the recorded flow.

    The room is what the motion that is nearest to one more contact, or to one more opening, has
    left before it, the depth that of the shallowest contact or opening; infinite where there is
    none.
    """
    room, depth = math.inf, math.inf
    for j in range(problem.machine.direction.shape[0]):
        left, deep = near_grazing_of(problem, work, omega, j)
        room, depth = min(room, left), min(depth, deep)
    return room, depth


@kernel
def near_grazing_of(
    problem: Shooting, work: ShootingWork, omega: float, j: int
) -> tuple[float, float]:
    """The same of one spring."""
    machine, flow, motion = problem.machine, work.flow, work.flow.motion
    room, depth = math.inf, math.inf
    for e in range(flow.segments[0]):
        count = segment_motion(machine, flow, e, omega, machine.direction, motion)
        prepare_search(motion, count)
        left, deep = _of_spring(
            machine, motion, count, j, flow.regimes[e, j], omega, flow.length[e]
        )
        room, depth = min(room, left), min(depth, deep)
        left, deep = _turned_back(machine, flow, e, j, count)
        room, depth = min(room, left), min(depth, deep)
    return room, depth


@kernel
def _turned_back(
    machine: MachineArrays, flow: Flow, e: int, j: int, count: int
) -> tuple[float, float]:
    """Room and depth of spring j where segment e ends because p' is zero: a valley or a summit."""
    if flow.spring[e] != j or e + 1 == flow.segments[0]:
        return math.inf, math.inf
    before, after = flow.regimes[e, j], flow.regimes[e + 1, j]
    alpha, beta, _, _ = exit_between(machine.stops, j, before, after)
    if before * after == 0 or alpha != 0.0:
        return math.inf, math.inf
    exponentials(flow.motion, count, flow.length[e])
    y, _ = gap_state(flow.motion, count, j)
    depth = abs(y - signed_gap(machine.stops, j, before))
    return (math.inf, depth) if beta > 0.0 else (depth, math.inf)


@kernel
def _of_spring(
    machine: MachineArrays, motion: GapMotion, count: int, j: int, regime: int, omega: float,
    duration: float,
) -> tuple[float, float]:  # fmt: skip
    """Room and depth of spring j within one segment."""
    stops, depth = machine.stops, math.inf
    if regime == OPEN:
        room = math.inf
        for at in range(2):
            sign, gap = 1.0 - 2.0 * at, stops.gap[j, at]
            if gap < math.inf:
                # A summit turns the room gap - sign y round at its least, a valley at its most.
                least, most = _stands_still(motion, count, j, sign * gap, -sign, 0.0, duration)
                room, depth = min(room, least), min(depth, most)
        return room, depth
    side, gap = (1.0 if regime > OPEN else -1.0), signed_gap(stops, j, regime)
    room, depth = _stands_still(motion, count, j, gap, side, 0.0, duration)
    for e in range(MOST_EXITS):
        alpha, beta, target = exit_of(stops, j, regime, e)
        if target == NO_EXIT or beta == 0.0:
            continue
        # A rate is as far as the rate over omega, as where the section is chosen.
        size = alpha if alpha != 0.0 else beta * omega
        least, _ = _stands_still(
            motion, count, j, gap, side * alpha / size, side * beta / size, duration
        )
        room = min(room, least)
    return room, depth


@kernel
def _stands_still(
    motion: GapMotion, count: int, j: int, gap: float, alpha: float, beta: float, duration: float
) -> tuple[float, float]:
    """Least minimum and least maximum, none below 0, of h = alpha (y_j - gap) + beta y_j'.

    They are sought within [0, duration] where the rate of h changes its sign between two samples,
    or comes near zero and leaves it again; infinite where there is none.
    """
    fastest = 0.0
    for i in range(count):
        fastest = max(fastest, abs(motion.rate[i].imag))
    samples = min(4 + int(PER_RADIAN * fastest * duration), MOST_SAMPLES)
    step = duration / samples
    for i in range(count):
        motion.turn[i] = motion.amplitude[j, i] * (alpha + beta * motion.rate[i]) * motion.rate[i]
        motion.ratio[i] = exponential(motion.rate[i] * step)
    zero = -ROUNDING * abs(alpha * gap)  # below which h is no rounding of 0
    for i in range(count):
        size = ROUNDING * modulus(motion.amplitude[j, i])
        zero -= size * (abs(alpha) + abs(beta) * modulus(motion.rate[i]))
    least, shallowest, before, bent = math.inf, math.inf, 0.0, 0.0
    for k in range(samples + 1):
        slope, bend = alpha * motion.drift[j], 0.0
        for i in range(count):
            term = motion.turn[i]
            slope += term.real
            bend += term.real * motion.rate[i].real - term.imag * motion.rate[i].imag
            motion.turn[i] = term * motion.ratio[i]
        begin, part = (k - 1) * step, 0.0  # and the time to where the slope has the other sign
        if k > 0 and slope * before < 0.0:
            part = step
        elif k > 0 and bent * before < 0.0 and bend * slope > 0.0:
            part = _to_other_sign(motion, count, j, alpha, beta, begin, step, before)
        if part > 0.0:
            h = _still_value(motion, count, j, gap, alpha, beta, begin, part, before)
            least, shallowest = _counted(least, shallowest, h, zero, before)
        if 0.0 < part < step:
            h = _still_value(motion, count, j, gap, alpha, beta, begin + part, step - part, -before)
            least, shallowest = _counted(least, shallowest, h, zero, -before)
        before, bent = slope, bend
    return least, shallowest


@kernel
def _counted(
    least: float, shallowest: float, h: float, zero: float, before: float
) -> tuple[float, float]:
    """Least minimum and maximum, with h, to which it falls or rises with the slope ``before``."""
    if h <= zero:
        return least, shallowest
    if before < 0.0:
        return min(least, max(h, 0.0)), shallowest
    return least, min(shallowest, max(h, 0.0))


@kernel
def _to_other_sign(
    motion: GapMotion, count: int, j: int, alpha: float, beta: float, begin: float, step: float,
    before: float,
) -> float:  # fmt: skip
    """Time within a step to where the rate of h, which turns round there, has the other sign.

    0 where it never has.
    """
    low, high = 0.0, step
    for _ in range(MOST_NEWTON):
        part = 0.5 * (low + high)
        exponentials(motion, count, begin + part)
        _, slope, bend, _, _ = switching_state(motion, count, j, 0.0, alpha, beta)
        if slope * before < 0.0:
            return part
        if bend * before < 0.0:
            low = part
        else:
            high = part
        if abs(slope) > abs(bend) * (high - low):
            break  # too far from zero for what is left of the way
    return 0.0


@kernel
def _still_value(
    motion: GapMotion, count: int, j: int, gap: float, alpha: float, beta: float, begin: float,
    step: float, before: float,
) -> float:  # fmt: skip
    """h where its rate is zero within a step, by Newton's method kept in between."""
    a, b = begin, begin + step
    t, h = begin + 0.5 * step, 0.0
    for _ in range(MOST_NEWTON):
        exponentials(motion, count, t)
        h, slope, bend, _, _ = switching_state(motion, count, j, gap, alpha, beta)
        if slope * before > 0.0:
            a = t
        else:
            b = t
        new = t - slope / bend if bend != 0.0 else 0.5 * (a + b)
        if not a < new < b:
            new = 0.5 * (a + b)
        if abs(new - t) < STILL * step:
            break
        t = new
    return h
