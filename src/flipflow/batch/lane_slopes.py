"""Exact derivatives of the motions of many lanes with respect to parameters of their machines.

The state at phase 0 moves by z_p = (I - M)^-1 phi_p, M the monodromy matrix and phi the flow over
the turn; its derivatives are then carried to wherever something is read. Where a motion grazes a
stop whose law has a corner there, the derivative has two sides and is NaN.
"""

from __future__ import annotations

import math

from flipflow.batch.lane_kernels import Found, machine_of, problem_of
from flipflow.batch.lane_path import forget, is_even
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
    set_end,
)
from flipflow.batch.vector_slopes import vector_slopes
from flipflow.compiled import status
from flipflow.compiled.arrays import Real
from flipflow.compiled.compile import kernel
from flipflow.compiled.dense import lu_factor, lu_solve
from flipflow.compiled.eigen import eigenvector, real_schur
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import run_flow
from flipflow.dynamics.parameter_tangent import Columns, carry_starts
from flipflow.dynamics.parameter_variation import APART, carry_variation, set_shifts
from flipflow.periodic.near_grazing import GRAZES, near_grazing_of
from flipflow.periodic.shooting import Shooting


@kernel(inline=True)
def columns_of(batch: Columns, lane: int) -> Columns:
    """Columns of one machine of many."""
    return Columns(
        batch.inertia[lane], batch.damping[lane], batch.stiffness[lane], batch.direction[lane],
        batch.reach[lane], batch.static[lane], batch.push[lane], batch.stop_stiffness[lane],
        batch.stop_damping[lane], batch.gap[lane], batch.touches,
    )  # fmt: skip


@kernel(entry=True)
def slope_lanes(
    batch: MachineArrays, batch_columns: Columns, first: int, last: int, omega: Real, length: float,
    asked: Asked, wanted: SlopesAsked, work: SlopeWork, found: Found, out: Slopes,
) -> None:  # fmt: skip
    """Derivatives of the stable motions that were found of lanes ``first`` to ``last`` - 1."""
    for lane in range(first, last):
        forget(work.lane)
        machine, columns = machine_of(batch, lane), columns_of(batch_columns, lane)
        for f in range(omega.shape[0]):
            if found.reason[lane, f] != FOUND:
                continue
            half = wanted.even and is_even(machine) and found.leaning[lane, f] == 0
            problem = problem_of(machine, half, length)
            if not state_slopes(problem, columns, omega[f], work, found, out, lane, f):
                continue
            z = found.state[lane, f]
            torn = grazes(problem, work, omega[f], wanted, z, True)
            if wanted.multipliers and not grazes(problem, work, omega[f], wanted, z, False):
                multiplier_slopes(problem, columns, omega[f], work, found, out, lane, f)
            if not torn:
                read_slopes(problem, columns, omega[f], asked, wanted, work, out, lane, f)


@kernel
def state_slopes(
    problem: Shooting, columns: Columns, omega: float, work: SlopeWork, found: Found, out: Slopes,
    lane: int, f: int,
) -> bool:  # fmt: skip
    """Derivatives of the state at phase 0 and at the starts of the segments, and of their limits.

    The columns from zero and the tangent map are carried together; what the state itself brings is
    added to the columns when it is known.
    """
    machine, own, flow = problem.machine, work.lane, work.lane.shooting.flow
    size, turn = work.T.shape[0], problem.fraction * 2.0 * math.pi / omega
    for k in range(size):
        flow.z[k] = found.state[lane, f, k]
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
    for p in range(work.state.shape[1]):
        solve_state(problem, work, segments, p, out.state[lane, f])
    for e in range(segments):
        set_end(machine, columns, e, omega, work)
        set_shifts(machine, flow, e, omega, columns, work.ended, work.shift[e + 1], work.columns)
    return True


@kernel
def solve_state(problem: Shooting, work: SlopeWork, segments: int, p: int, state: Real) -> None:
    """z_p = -(M - I)^-1 phi_p of one parameter, omega among them.

    It is added to the columns at the start of each segment.
    """
    own, size, parameters = work.lane, work.T.shape[0], work.row.shape[0]
    for k in range(size):
        own.r[k] = -problem.sign * work.starts[segments, k, p]
    lu_solve(own.A, own.pivot, own.r)
    for k in range(size):
        work.state[k, p] = own.r[k]
        if p < parameters:
            state[k, p] = own.r[k]
    for e in range(segments + 1):
        for k in range(size):
            for s in range(size):
                work.starts[e, k, p] += work.tangents[e, k, s] * own.r[s]


@kernel
def grazes(
    problem: Shooting, work: SlopeWork, omega: float, wanted: SlopesAsked, z: Real, corners: bool
) -> bool:
    """Whether the motion grazes a stop; of ``corners`` one that kicks the tangent there."""
    n, stops = z.shape[0] // 2, problem.machine.stops
    large = problem.length
    for k in range(n):
        large = max(large, abs(z[k]), abs(z[n + k]) / omega)
    for j in range(stops.damping.shape[0]):
        if corners and (wanted.corner[j] == 0 or stops.damping[j] == 0.0):
            continue
        room, depth = near_grazing_of(problem, work.lane.shooting, omega, j)
        if min(room, depth) < GRAZES * large:
            return True
    return False


@kernel
def multiplier_slopes(
    problem: Shooting, columns: Columns, omega: float, work: SlopeWork, found: Found, out: Slopes,
    lane: int, f: int,
) -> None:  # fmt: skip
    """Derivatives of the multipliers of a whole turn: d mu = l dM r of left and right vectors."""
    schur, size, mirrored = work.lane.schur, work.T.shape[0], problem.sign < 0.0
    vary_map(problem.machine, columns, omega, work)
    for i in range(size):
        for j in range(size):
            schur.T[i, j] = problem.sign * work.T[i, j]
    if not real_schur(schur, True):
        return
    set_basis(work)
    if not lu_factor(work.basis, work.pivot):
        return
    k = 0
    while k < size:
        pair = schur.value[k].imag != 0.0
        for p in range(work.row.shape[0]):
            slope = problem.sign * eigenvalue_slope(work, k, pair, p)
            if mirrored:
                slope *= 2.0 * schur.value[k]
            set_multiplier(work, mirrored, k, slope, found, out, lane, f, p)
            if pair:
                slope = slope.conjugate()
                set_multiplier(work, mirrored, k + 1, slope, found, out, lane, f, p)
        k += 2 if pair else 1


@kernel
def vary_map(machine: MachineArrays, columns: Columns, omega: float, work: SlopeWork) -> None:
    """The tangent map over the turn into work.T, its derivatives into work.maps."""
    for i in range(work.T.shape[0]):
        for j in range(work.T.shape[0]):
            work.T[i, j] = 1.0 if i == j else 0.0
            for p in range(work.maps.shape[0]):
                work.maps[p, i, j] = 0.0
    carry_variation(
        machine, work.lane.shooting.flow, omega, columns, work.state, work.starts, work.shift,
        work.T, work.maps, work.columns,
    )  # fmt: skip


@kernel
def set_basis(work: SlopeWork) -> None:
    """Eigenvectors of the map as columns, and once more to be factored."""
    schur, size = work.lane.schur, work.T.shape[0]
    k = 0
    while k < size:
        eigenvector(schur, k)
        pair = schur.value[k].imag != 0.0
        for i in range(size):
            work.vectors[i, k] = schur.scale[i] * schur.vector[i].real
            if pair:
                work.vectors[i, k + 1] = schur.scale[i] * schur.vector[i].imag
        k += 2 if pair else 1
    for i in range(size):
        for j in range(size):
            work.basis[i, j] = work.vectors[i, j]


@kernel
def eigenvalue_slope(work: SlopeWork, k: int, pair: bool, p: int) -> complex:
    """l dT r of eigenvalue k and parameter p, with the rows of the inverse basis as l."""
    own, size, basis = work.lane, work.T.shape[0], work.basis
    entries = (0.0, 0.0, 0.0, 0.0)
    for c in range(2 if pair else 1):
        for i in range(size):
            own.r[i] = 0.0
            for j in range(size):
                own.r[i] += work.maps[p, i, j] * work.vectors[j, k + c]
        lu_solve(basis, work.pivot, own.r)
        if c == 0:
            entries = (own.r[k], own.r[k + 1] if pair else 0.0, 0.0, 0.0)
        else:
            entries = (entries[0], entries[1], own.r[k], own.r[k + 1])
    if not pair:
        return complex(entries[0], 0.0)
    return complex(0.5 * (entries[0] + entries[3]), 0.5 * (entries[2] - entries[1]))


@kernel
def set_multiplier(
    work: SlopeWork, squared: bool, k: int, slope: complex, found: Found, out: Slopes, lane: int,
    f: int, p: int,
) -> None:  # fmt: skip
    """Write the derivative of eigenvalue k where that multiplier stands; none of a double one."""
    value, size = work.lane.schur.value, work.T.shape[0]
    largest, nearest = 0.0, math.inf
    for i in range(size):
        largest = max(largest, abs(value[i]))
        if i != k:
            nearest = min(nearest, abs(value[i] - value[k]))
    if nearest < APART * largest:
        return
    mu = value[k] * value[k] if squared else value[k]
    place, off = 0, math.inf
    for i in range(size):
        away = abs(found.multiplier[lane, f, i] - mu)
        if away < off:
            place, off = i, away
    out.multiplier[lane, f, place, p] = slope


@kernel
def read_slopes(
    problem: Shooting, columns: Columns, omega: float, asked: Asked, wanted: SlopesAsked,
    work: SlopeWork, out: Slopes, lane: int, f: int,
) -> None:  # fmt: skip
    """Derivatives of all readings of the motion whose flow is recorded."""
    machine, flow = problem.machine, work.lane.shooting.flow
    turn = problem.fraction * 2.0 * math.pi / omega
    for g in range(asked.coordinate.shape[0]):
        coordinate_slopes(problem, columns, omega, asked.coordinate, g, work, out, lane, f)
    for j in range(machine.direction.shape[0]):
        force_slopes(machine, columns, omega, j, work, out.force[lane, f, j])
    contact_slopes(machine, columns, omega, turn, work, out, lane, f)
    if wanted.means:
        mean_slopes(machine, flow, columns, omega, turn, asked, work, out, lane, f)
    which = lane if asked.linear.shape[0] > 1 else 0
    for q in range(asked.linear.shape[1]):
        vector_slopes(
            machine, columns, omega, asked.linear[which, q], asked.along[which, f, q],
            asked.across[which, f, q], wanted.linear[which, q], wanted.along[which, f, q],
            wanted.across[which, f, q], work, out.peak[lane, f, q],
        )  # fmt: skip
