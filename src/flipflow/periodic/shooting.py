"""Periodic motion by shooting: z = sign * flow(z) over a number of forcing periods.

``fraction`` 1 and ``sign`` +1 is one forcing period, ``fraction`` n is n of them; a motion that is
its own mirror image after n / 2 of them, n odd, has ``fraction`` n / 2 and ``sign`` -1.

The unknown is the state at one phase of the force, the section. Where the force of a stop jumps,
the state at a fixed phase has a kink along a branch when the jump passes that phase. While a branch
is followed the section therefore moves to where the state is farthest from any change of contact;
everywhere else it is phase 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flipflow.compiled import status
from flipflow.compiled.arrays import Complex, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.dynamics.contact_search import extremes, prepare_search
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import (
    Flow,
    carry_tangent,
    contact_number,
    new_flow,
    run_flow,
    segment_motion,
    segment_state,
)


class Shooting(NamedTuple):
    """The problem: a machine, and the part of a turn to shoot over."""

    machine: MachineArrays
    fraction: float
    sign: float
    length: float  # length in m below which displacements count as small
    rest: Real  # (N,) position in m from which they count


@by_reference
class ShootingWork(NamedTuple):
    """Scratch of the problem; the flow holds the record of the last motion."""

    flow: Flow
    tangent: Real  # (2 N, 2 N + 1) with the derivative in omega
    map: Real  # (2 N, 2 N) without it
    columns: Complex  # (R, 2 N + 1)
    rate: Real  # (2 N,) at the end of the flow
    start: Real  # (2 N,) state at its start
    first_rate: Real  # (2 N,) and its rate
    column: Real  # (2 N, 1) one tangent
    flown: Real  # (2 N + 1,) state and omega of the motion that the flow holds since the residual
    ahead: Real  # (2 N, 3) two tangents of it, and the derivative in omega
    section: Real  # (2,) phase in rad at which the unknown stands; its margin when it was chosen


def new_shooting(
    machine: MachineArrays,
    *,
    half_turn: bool,
    length: float,
    turns: int = 1,
    rest: Real | None = None,
) -> Shooting:
    """The shooting problem over ``turns``, or half of them for a mirror-symmetric motion."""
    rest = np.zeros(machine.direction.shape[1]) if rest is None else rest
    fraction = 0.5 * turns if half_turn else float(turns)
    return Shooting(machine, fraction, -1.0 if half_turn else 1.0, length, rest)


def new_shooting_work(machine: MachineArrays) -> ShootingWork:
    """Scratch for shooting at one machine, whatever the turns."""
    size = 2 * machine.direction.shape[1]
    return ShootingWork(
        flow=new_flow(machine),
        tangent=np.zeros((size, size + 1)),
        map=np.zeros((size, size)),
        columns=np.zeros((size, size + 1), np.complex128),
        rate=np.zeros(size),
        start=np.zeros(size),
        first_rate=np.zeros(size),
        column=np.zeros((size, 1)),
        flown=np.full(size + 1, np.nan),
        ahead=np.zeros((size, 3)),
        section=np.array([0.0, math.inf]),
    )


@kernel
def mirrored_shooting(problem: Shooting) -> Shooting:
    """The problem over half the time, for motions that are then their own mirror image."""
    if problem.sign < 0.0:
        return problem
    return Shooting(problem.machine, 0.5 * problem.fraction, -1.0, problem.length, problem.rest)


@kernel(inline=True)
def shoot(problem: Shooting, work: ShootingWork, z: Real, omega: float, U: Real) -> int:
    """Carry z into flow.z and its tangent into U, over the problem's part of a turn.

    U is (2 N, 2 N), or (2 N, 2 N + 1) with the derivative in omega at fixed time.
    """
    flow = work.flow
    for k in range(U.shape[0]):
        flow.z[k] = z[k]
        for c in range(U.shape[1]):
            U[k, c] = 1.0 if k == c else 0.0
    begin, duration = work.section[0] / omega, problem.fraction * 2.0 * math.pi / omega
    code = run_flow(problem.machine, flow, omega, begin, duration, work.rate)
    if code == status.OK:
        slope = 1.0 if U.shape[1] > U.shape[0] else 0.0
        carry_tangent(problem.machine, flow, U, slope, work.columns)
        for k in range(U.shape[0]):
            if not math.isfinite(flow.z[k]):
                return status.NOT_FINITE
    return code


@kernel(inline=True)
def shooting_residual(
    problem: Shooting, work: ShootingWork, z: Real, omega: float, r: Real, J: Real
) -> int:
    """r = sign flow(z) - z and J = [dr/dz, dr/d omega], shapes (2 N,) and (2 N, 2 N + 1)."""
    if not omega > 0.0:
        return status.NO_CONVERGENCE
    size = work.rate.shape[0]
    U = work.tangent
    code = shoot(problem, work, z, omega, U)
    if code != status.OK:
        return code
    for k in range(size):
        work.flown[k] = z[k]
    work.flown[size] = omega
    # The last column is taken at fixed times; both ends of the flow move with omega as well.
    begin = work.section[0] / omega
    end = begin + problem.fraction * 2.0 * math.pi / omega
    if begin != 0.0:
        segment_state(problem.machine, work.flow, 0, omega, 0.0, work.start, work.first_rate)
    for k in range(size):
        slope = U[k, size] - work.rate[k] * end / omega
        if begin != 0.0:
            for c in range(size):
                slope += U[k, c] * work.first_rate[c] * begin / omega
        r[k] = problem.sign * work.flow.z[k] - z[k]
        for c in range(size):
            J[k, c] = problem.sign * U[k, c]
        J[k, k] -= 1.0
        J[k, size] = problem.sign * slope
    return status.OK


@kernel(entry=True)
def shooting_step(
    problem: Shooting, work: ShootingWork, z: Real, omega: float, r: Real, J: Real
) -> tuple[int, int]:
    """``shooting_residual`` for callers outside the kernels, and its motion's contact number."""
    code = shooting_residual(problem, work, z, omega, r, J)
    return code, contact_number(work.flow, problem.sign > 0.0)


@kernel
def crossings(problem: Shooting, work: ShootingWork) -> int:
    """A number that changes when the contacts met in a turn change: crossings, spring by spring."""
    return contact_number(work.flow, problem.sign > 0.0)


@kernel
def flow_depths(problem: Shooting, work: ShootingWork, omega: float, depth: Real) -> None:
    """Greatest depth in m beyond each gap in the recorded flow, (m, 2): plus and minus side.

    Half a turn tells both of a motion that is its own mirror image after it.
    """
    machine, flow, motion = problem.machine, work.flow, work.flow.motion
    for j in range(depth.shape[0]):
        depth[j, 0], depth[j, 1] = -math.inf, -math.inf
    for e in range(flow.segments[0]):
        count = segment_motion(machine, flow, e, omega, machine.direction, motion)
        prepare_search(motion, count)
        for j in range(depth.shape[0]):
            low, high, _, _ = extremes(motion, count, j, flow.length[e])
            depth[j, 0], depth[j, 1] = max(depth[j, 0], high), max(depth[j, 1], -low)
    for j in range(depth.shape[0]):
        if problem.sign < 0.0:
            depth[j, 0] = max(depth[j, 0], depth[j, 1])
            depth[j, 1] = depth[j, 0]
        depth[j, 0] -= machine.stops.gap[j, 0]
        depth[j, 1] -= machine.stops.gap[j, 1]


@kernel
def state_scale(problem: Shooting, z: Real, omega: float, scale: Real) -> None:
    """Size of each unknown: the motion's amplitude (m), that times omega for velocities.

    It counts from where the machine rests: on a stop it may hardly move.
    """
    n = problem.machine.direction.shape[1]
    amplitude = problem.length
    for k in range(n):
        amplitude = max(amplitude, math.hypot(z[k] - problem.rest[k], z[n + k] / omega))
    for k in range(n):
        scale[k] = amplitude
        scale[n + k] = amplitude * omega
