"""Exact derivatives of the motions of many lanes with respect to parameters of their machines.

The state at phase 0 moves by z_p = (I - M)^-1 phi_p, M the monodromy matrix and phi the flow over
the turn; its derivatives are then carried to wherever something is read. Where a motion grazes a
stop whose law has a corner there, the derivative has two sides and is NaN.
"""

from __future__ import annotations

import math

from flipflow.batch.lane_kernels import Found, problem_of
from flipflow.batch.lane_path import begin_lane, is_even, take
from flipflow.batch.lane_readings import Asked
from flipflow.batch.mean_slopes import mean_slopes
from flipflow.batch.reasons import FOUND
from flipflow.batch.slope_readings import (
    Slopes,
    SlopesAsked,
    SlopeWork,
    contact_slopes,
    coordinate_slopes,
    force_slopes,
)
from flipflow.batch.vector_slopes import vector_slopes
from flipflow.compiled import status
from flipflow.compiled.arrays import Int, Real
from flipflow.compiled.compile import kernel
from flipflow.compiled.dense import lu_factor, lu_solve
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import run_flow
from flipflow.dynamics.multiplier_slopes import multiplier_slopes
from flipflow.dynamics.parameter_tangent import Columns, add_begin, carry_starts
from flipflow.dynamics.parameter_variation import set_limits
from flipflow.periodic.near_grazing import GRAZES, near_grazing_of
from flipflow.periodic.shooting import Shooting

CLEAR, GRAZED, KICKED = 0, 1, 2  # how a motion grazes a stop


@kernel
def take_columns(batch: Columns, lane: int, columns: Columns) -> None:
    """Write those of one machine of many; what they touch is the same for all."""
    take(batch.inertia, lane, columns.inertia)
    take(batch.damping, lane, columns.damping)
    take(batch.stiffness, lane, columns.stiffness)
    take(batch.direction, lane, columns.direction)
    take(batch.reach, lane, columns.reach)
    take(batch.static, lane, columns.static)
    take(batch.push, lane, columns.push)
    take(batch.stop_stiffness, lane, columns.stop_stiffness)
    take(batch.stop_damping, lane, columns.stop_damping)
    take(batch.gap, lane, columns.gap)


@kernel(entry=True)
def slope_lanes(
    batch: MachineArrays, batch_columns: Columns, first: int, last: int, omega: Real, length: float,
    asked: Asked, wanted: SlopesAsked, work: SlopeWork, found: Found, out: Slopes,
) -> None:  # fmt: skip
    """Derivatives of the stable motions that were found of lanes ``first`` to ``last`` - 1."""
    for lane in range(first, last):
        begin_lane(batch, lane, work.lane)
        machine, columns = work.lane.machine, work.machine_columns
        take_columns(batch_columns, lane, columns)
        for f in range(omega.shape[0]):
            if found.reason[lane, f] != FOUND:
                continue
            half = wanted.even and is_even(machine) and found.leaning[lane, f] == 0
            problem = problem_of(machine, half, length)
            z = found.state[lane, f]
            if not state_slopes(problem, columns, omega[f], z, work, out.state[lane, f]):
                continue
            grazed = grazing(problem, work, omega[f], wanted, z)
            if wanted.multipliers and grazed == CLEAR:
                multiplier_slopes(
                    machine, work.lane.shooting.flow, omega[f], columns, problem.sign, half,
                    work.shift, work.tangents, found.multiplier[lane, f], work.lane.schur,
                    work.multiplier, work.columns, out.multiplier[lane, f],
                )  # fmt: skip
            if grazed != KICKED:
                contacts = wanted.contacts and grazed == CLEAR
                read_slopes(problem, columns, omega[f], asked, wanted, contacts, work, out, lane, f)


@kernel
def state_slopes(
    problem: Shooting, columns: Columns, omega: float, z: Real, work: SlopeWork, slopes: Real
) -> bool:
    """Derivatives of the state at phase 0 and at the starts of the segments, and of their limits.

    The columns from zero and the tangent map are carried together; what the state itself brings is
    added to the columns when it is known.
    """
    machine, own, flow = problem.machine, work.lane, work.lane.shooting.flow
    size, turn = own.r.shape[0], problem.fraction * 2.0 * math.pi / omega
    for k in range(size):
        flow.z[k] = z[k]
    if run_flow(machine, flow, omega, 0.0, turn, own.shooting.rate) != status.OK:
        return False
    segments = flow.segments[0]
    carry_starts(machine, flow, omega, columns, work.starts, work.tangents, work.columns)
    for i in range(size):
        for j in range(size):
            own.A[i, j] = problem.sign * work.tangents[segments, i, j] - (1.0 if i == j else 0.0)
        # The end of the turn moves with omega as well.
        work.starts[segments, i, work.row.shape[0]] -= own.shooting.rate[i] * turn / omega
    if not lu_factor(own.A, own.pivot):
        return False
    solve_states(
        problem.sign, own.A, own.pivot, own.r, segments, work.starts, work.tangents, work.state
    )
    for k in range(size):
        for p in range(slopes.shape[1]):
            slopes[k, p] = work.state[k, p]
    set_limits(machine, flow, omega, columns, work.starts, work.ended, work.shift, work.columns)
    return True


@kernel
def solve_states(
    sign: float, A: Real, pivot: Int, r: Real, segments: int, starts: Real, tangents: Real,
    state: Real,
) -> None:  # fmt: skip
    """z_p = -(M - I)^-1 phi_p of all parameters, omega among them, with M - I factored in A.

    They are added to the columns at the start of each segment.
    """
    size, count = state.shape
    for p in range(count):
        for k in range(size):
            r[k] = -sign * starts[segments, k, p]
        lu_solve(A, pivot, r)
        for k in range(size):
            state[k, p] = r[k]
    add_begin(segments, state, tangents, starts)


@kernel
def grazing(problem: Shooting, work: SlopeWork, omega: float, wanted: SlopesAsked, z: Real) -> int:
    """How the motion grazes a stop: KICKED where its tangent jumps, else GRAZED, or CLEAR.

    Of what moves as a square root beside a grazing nothing need be asked.
    """
    n, stops, worst = z.shape[0] // 2, problem.machine.stops, CLEAR
    large = problem.length
    for k in range(n):
        large = max(large, abs(z[k]), abs(z[n + k]) / omega)
    for j in range(stops.damping.shape[0]):
        kicks = wanted.corner[j] != 0 and stops.damping[j] != 0.0
        if kicks or wanted.multipliers or wanted.contacts:
            room, depth = near_grazing_of(problem, work.lane.shooting, omega, j)
            if min(room, depth) < GRAZES * large:
                worst = max(worst, KICKED if kicks else GRAZED)
    return worst


@kernel
def read_slopes(
    problem: Shooting, columns: Columns, omega: float, asked: Asked, wanted: SlopesAsked,
    contacts: bool, work: SlopeWork, out: Slopes, lane: int, f: int,
) -> None:  # fmt: skip
    """Derivatives of all readings of the motion whose flow is recorded; of contacts if wanted."""
    machine = problem.machine
    turn = problem.fraction * 2.0 * math.pi / omega
    for g in range(asked.coordinate.shape[0]):
        upper, lower = out.high[lane, f, g], out.low[lane, f, g]
        coordinate_slopes(problem, columns, omega, asked.coordinate, g, work, upper, lower)
    for j in range(machine.direction.shape[0]):
        force_slopes(machine, columns, omega, j, work, out.force[lane, f, j])
    if contacts:
        share, approach = out.share[lane, f], out.approach[lane, f]
        contact_slopes(machine, columns, omega, turn, work, share, approach)
    if wanted.means:
        first, square = out.first[lane, f], out.square[lane, f]
        mean_slopes(machine, columns, omega, turn, asked, work, first, square)
    which = lane if asked.linear.shape[0] > 1 else 0
    for q in range(asked.linear.shape[1]):
        vector_slopes(
            machine, columns, omega, asked.linear[which, q], asked.along[which, f, q],
            asked.across[which, f, q], wanted.linear[which, q], wanted.along[which, f, q],
            wanted.across[which, f, q], work, out.peak[lane, f, q],
        )  # fmt: skip
