"""Many machines at many frequencies, one lane after the other, without Python between them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flipflow.batch.lane_path import (
    FAR,
    MARGIN,
    PUSH,
    SAME,
    TURNS_BETWEEN,
    TURNS_MOST,
    LaneWork,
    begin_lane,
    contact_free_state,
    follow,
    forget_path,
    is_even,
    largest_multiplier,
    newton,
    restart,
    settle,
)
from flipflow.batch.lane_readings import Asked, Readings, ReadingWork, read_lane
from flipflow.batch.reasons import FOUND, NO_MOTION, UNSTABLE
from flipflow.compiled import status
from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.dynamics.contact_free_range import contact_free_up_to, is_contact_free_below
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.periodic.shooting import Shooting
from flipflow.periodic.two_event import only_motion

BEHIND = 1e-3  # share of a frequency at which a motion ends, behind which the next one is sought
LEAPS = 8  # from motion to motion on the way to one frequency
DRIFT = 0.02  # share by which a frequency goes on while the motion repeats after no single turn
LOOKS, BELOW = 4, 0.93  # for a frequency at which there is one motion, each a share of the last
OCTAVES_BELOW = 4  # below a frequency at which a machine that rests on a stop is let settle first
OCTAVES = 3  # away from a frequency at which a machine is let settle where it does not there


@by_reference
class Found(NamedTuple):
    """The motions of L lanes at F frequencies; NaN until they are found."""

    state: Real  # (L, F, 2 N) at phase 0
    multiplier: Complex  # (L, F, 2 N) of a whole turn
    error: Real  # (L, F) m
    leaning: Int  # (L, F) 1 where an even machine moves without symmetry
    jumps: Int  # (L, F) of the path up to here
    reason: Int  # (L, F) one of FOUND, UNSTABLE, ...


def new_found(lanes: int, speeds: int, degrees: int, reason: int) -> Found:
    """Room for what is found."""
    shape = lanes, speeds
    states = lanes, speeds, 2 * degrees
    return Found(
        state=np.full(states, np.nan),
        multiplier=np.full(states, complex(np.nan, np.nan)),
        error=np.full(shape, np.nan),
        leaning=np.zeros(shape, np.int64),
        jumps=np.zeros(shape, np.int64),
        reason=np.full(shape, reason, np.int64),
    )


@kernel
def problem_of(machine: MachineArrays, half: bool, length: float) -> Shooting:
    """Shooting over half a turn, with sign, or over a whole one."""
    # Lanes do not ask from where displacements count: any array of that shape will do.
    return Shooting(machine, 0.5 if half else 1.0, -1.0 if half else 1.0, length, machine.static)


@kernel(entry=True)
def run_lanes(
    batch: MachineArrays, first: int, last: int, omega: Real, length: float, work: LaneWork,
    reading: ReadingWork, asked: Asked, found: Found, readings: Readings,
) -> None:  # fmt: skip
    """Lanes ``first`` to ``last`` - 1 at frequencies (F,), one or more, rising or falling.

    Rising frequencies are reached from below, falling ones from above.
    """
    for lane in range(first, last):
        begin_lane(batch, lane, work)
        run_lane(work.machine, lane, omega, length, work, reading, asked, found, readings)


@kernel
def run_lane(
    machine: MachineArrays, lane: int, omega: Real, length: float, work: LaneWork,
    reading: ReadingWork, asked: Asked, found: Found, readings: Readings,
) -> None:  # fmt: skip
    """One lane: its motion is followed from speed to speed, and flown where it jumps."""
    even = is_even(machine)
    half, lost, jumps = even, False, 0
    rising = omega[-1] >= omega[0]
    for f in range(omega.shape[0]):
        begun = not math.isnan(work.omega[0])
        if not begun:
            begun, half = set_off(machine, work, f == 0, omega[f], length, even, rising)
            lost = False
        reached = begun and not lost and follow(problem_of(machine, half, length), work, omega[f])
        if lost:
            reached, half = resumed(machine, work, omega[f - 1], omega[f], length, even)
        elif begun and not reached:
            jumps += 1
            reached, half = leapt(machine, work, omega[f], length, even, half)
        elif not begun:
            reached, half = settled(machine, work, omega[f], length, even)
            if f == 0 and not reached:
                reached, half = led(machine, work, omega[f], length, even, rising)
        lost = not reached
        found.jumps[lane, f] = jumps
        if reached:
            half, stable = stability(machine, work, omega[f], length, even, half)
            note(work, lane, f, even and not half, half, found)
            found.reason[lane, f] = FOUND if stable else UNSTABLE
            turn = (1.0 if half else 2.0) * math.pi / omega[f]
            flow = work.shooting.flow
            read_lane(machine, flow, reading, asked, omega[f], turn, half, readings, lane, f)
        else:
            found.reason[lane, f] = NO_MOTION


@kernel
def set_off(
    machine: MachineArrays, work: LaneWork, first: bool, omega: float, length: float, even: bool,
    rising: bool,
) -> tuple[bool, bool]:  # fmt: skip
    """Begin the path of a lane for a frequency: whether it is begun, and whether even."""
    free = rising and is_contact_free_below(machine, work.shooting.flow.modes, omega)
    problem = problem_of(machine, even, length)
    if rising and even and not free and start_from_only_motion(problem, work, omega):
        return True, True
    if start_without_contact(problem, work, omega, rising and not free):
        return True, even
    if rising and first:
        return start_far_below(machine, work, omega, length, even)
    return False, even


@kernel
def start_from_only_motion(problem: Shooting, work: LaneWork, omega: float) -> bool:
    """Begin the path with the only motion that there is at omega, or a little below."""
    machine, touch = problem.machine, work.touch
    for _ in range(LOOKS):
        share = only_motion(machine, work.shooting.flow, touch, omega)
        if share > 0.0:
            for k in range(work.guess.shape[0]):
                work.guess[k] = touch.z[k]
        known = share > 0.0 or (share == 0.0 and contact_free_state(machine, work, omega))
        if known and begun(problem, work, omega, SAME):
            return True
        omega *= BELOW
    return False


@kernel
def start_without_contact(problem: Shooting, work: LaneWork, omega: float, below: bool) -> bool:
    """Begin the path with a motion without contact, at omega or below the first contact."""
    machine, modes = problem.machine, work.shooting.flow.modes
    at = contact_free_up_to(machine, modes, omega) if below else omega
    if not at > 0.0 or not contact_free_state(machine, work, at):
        return False
    return begun(problem, work, at, FAR)


@kernel
def start_far_below(
    machine: MachineArrays, work: LaneWork, omega: float, length: float, even: bool
) -> tuple[bool, bool]:
    """Begin the path far below omega with what a machine settles into that rests on a stop.

    From rest at omega it may settle into a motion that it is not brought to from below.
    """
    for k in range(OCTAVES_BELOW, 0, -1):
        reached, half = settled(machine, work, omega * 2.0 ** (-k), length, even)
        if reached:
            return True, half
        forget_path(work, 0)
    return False, even


@kernel
def begun(problem: Shooting, work: LaneWork, omega: float, far: float) -> bool:
    """Begin the path with what Newton reaches from work.guess, if it is stable and not far."""
    if newton(problem, work, omega, far) != status.OK:
        return False
    stable = largest_multiplier(work, omega) < 1.0
    if stable:
        restart(work, omega)
    return stable


@kernel
def settled(
    machine: MachineArrays, work: LaneWork, omega: float, length: float, even: bool
) -> tuple[bool, bool]:
    """Fly to a motion from the last one of the path, or from rest: whether found, whether even."""
    if even:
        set_out(work, 0.0)
        if settle(problem_of(machine, True, length), work, omega):
            return True, True
    set_out(work, PUSH if even else 0.0)
    return settle(problem_of(machine, False, length), work, omega), False


@kernel
def leapt(
    machine: MachineArrays, work: LaneWork, omega: float, length: float, even: bool, half: bool
) -> tuple[bool, bool]:
    """Go on to omega from what the machine settles into right behind the end of its motion.

    Let go at once at a frequency far ahead it may settle into a motion that no jump leads to.
    """
    for _ in range(LEAPS):
        end = work.omega[0]
        if abs(omega - end) <= BEHIND * end:
            break
        beyond = end * (1.0 + math.copysign(BEHIND, omega - end))
        reached, half_there = settled(machine, work, beyond, length, even)
        if not reached:
            reached, half_there = drifted(machine, work, beyond, omega, length), False
        if not reached:
            return False, False
        half = half_there
        if follow(problem_of(machine, half, length), work, omega):
            return True, half
    return settled(machine, work, omega, length, even)


@kernel
def drifted(
    machine: MachineArrays, work: LaneWork, begin: float, omega: float, length: float
) -> bool:
    """Let the speed go on slowly from where the flow of work.z repeats after no single turn.

    False where it settles on no motion of one turn up to omega; work.z is where it has come to.
    """
    problem, at = problem_of(machine, False, length), begin
    while at != omega:
        ahead = at * (1.0 + math.copysign(DRIFT, omega - at))
        at = ahead if (omega - ahead) * (omega - at) > 0.0 else omega
        if settle(problem, work, at, TURNS_MOST if at == omega else TURNS_BETWEEN):
            return True
    return False


@kernel
def resumed(
    machine: MachineArrays, work: LaneWork, begin: float, omega: float, length: float, even: bool
) -> tuple[bool, bool]:
    """Go on to omega from a flow that repeated after no single turn at ``begin``."""
    if not drifted(machine, work, begin, omega, length):
        return False, False
    if follow(problem_of(machine, False, length), work, omega):
        return True, False
    return leapt(machine, work, omega, length, even, False)


@kernel
def led(
    machine: MachineArrays, work: LaneWork, omega: float, length: float, even: bool, rising: bool
) -> tuple[bool, bool]:
    """Begin with what the machine settles into farther off, followed to omega, as ``settled``.

    From rest at omega it may settle into a motion of several turns beside one of a single turn.
    """
    for k in range(1, OCTAVES + 1):
        reached, half = settled(machine, work, omega * 2.0 ** (-k if rising else k), length, even)
        if reached and follow(problem_of(machine, half, length), work, omega):
            return True, half
        forget_path(work, 0)
    return False, even


@kernel
def set_out(work: LaneWork, push: float) -> None:
    """work.z is the last motion of the path, pushed by a share of itself; rest without a path."""
    for k in range(work.z.shape[0]):
        work.z[k] = 0.0 if math.isnan(work.omega[0]) else work.path[0, k] * (1.0 + push)


@kernel
def stability(
    machine: MachineArrays, work: LaneWork, omega: float, length: float, even: bool, half: bool
) -> tuple[bool, bool]:
    """Whether the motion of the path is even, and whether it is stable.

    One that lost its symmetry gives way to one that leans, and one that has it again is even.
    """
    if even and not half:
        take_again(work)
        half = newton(problem_of(machine, True, length), work, omega, SAME) == status.OK
        if not half:
            take_again(work)
            newton(problem_of(machine, False, length), work, omega, math.inf)
    largest = largest_multiplier(work, omega)
    if half and largest > 1.0 - MARGIN:
        set_out(work, PUSH)
        if settle(problem_of(machine, False, length), work, omega):
            return False, True
        take_again(work)
        newton(problem_of(machine, True, length), work, omega, math.inf)
        largest_multiplier(work, omega)
    return half, largest < 1.0 - MARGIN


@kernel
def take_again(work: LaneWork) -> None:
    """The last motion of the path as guess."""
    for k in range(work.guess.shape[0]):
        work.guess[k] = work.path[0, k]


@kernel
def note(work: LaneWork, lane: int, f: int, leaning: bool, half: bool, found: Found) -> None:
    """Write down the motion of the path, with the multipliers of a whole turn."""
    for k in range(work.z.shape[0]):
        found.state[lane, f, k] = work.path[0, k]
        mu = work.mu[k]
        found.multiplier[lane, f, k] = mu * mu if half else mu
    found.error[lane, f] = work.step[1]
    found.leaning[lane, f] = 1 if leaning else 0
