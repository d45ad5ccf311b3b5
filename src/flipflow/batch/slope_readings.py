r"""Exact derivatives of what is read off a lane's motion, with respect to parameters.

The greatest value q of a turn moves by what q gains at its place and time: a summit's time adds
nothing, that of a change of contact, where q jumps or has a kink, adds q' dt. Means are integrals
over each segment. Where two summits are as high and move differently, the derivative has two sides
and is NaN.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flipflow.batch.lane_kernels import Found
from flipflow.batch.lane_path import LaneWork, new_lane_work
from flipflow.batch.lane_readings import (
    Asked,
    ReadingWork,
    force_peak,
    new_reading_work,
    set_vector,
)
from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.compile import kernel
from flipflow.dynamics.contact_search import (
    GapMotion,
    exponential,
    extremes,
    modulus,
    prepare_search,
)
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import Flow, end_segment, segment_motion, segment_state
from flipflow.dynamics.law import damping_share, kind, signed_gap, stiffness_share
from flipflow.dynamics.parameter_tangent import (
    Columns,
    ColumnWork,
    advance_columns,
    gap_slope,
    kick_columns,
    new_column_work,
)
from flipflow.dynamics.pieces import length_at, longest
from flipflow.periodic.shooting import Shooting

TIED = 1e-9  # share of the highest summit within which another one is as high
AGREE = 1e-6  # share of a derivative to which those of two summits must agree
GAUSS_POINTS = 12
PER_RADIAN = 0.5  # parts of a segment in which means are taken, per radian of its fastest term
MOST_PARTS = 64
AT_END = 1e-12  # share of a segment from its end within which its last sample stands


class SlopesAsked(NamedTuple):
    """What is differentiated besides states, extremes and forces; L is 1 where all lanes agree."""

    linear: Real  # (L, Q, 3, N, P) of the c_0, c_1, c_2 of vectors
    along: Complex  # (L, F, Q, P) of A
    across: Complex  # (L, F, Q, P) of B
    means: bool  # first harmonics and mean squares, too
    multipliers: bool
    even: bool  # whether an even machine stays so with every parameter
    corner: Int  # (m,) 1 where the law kicks the tangent of what grazes the stop


class Slopes(NamedTuple):
    """Derivatives with respect to P parameters, lanes and frequencies first; NaN: there is none."""

    state: Real  # (L, F, 2 N, P) at phase 0
    low: Real  # (L, F, G, P)
    high: Real  # (L, F, G, P)
    first: Complex  # (L, F, G, P)
    force: Real  # (L, F, m, P)
    share: Real  # (L, F, m, P)
    approach: Real  # (L, F, P)
    square: Real  # (L, F, S, P)
    peak: Real  # (L, F, Q, P)
    multiplier: Complex  # (L, F, 2 N, P) in the order of those found


class SlopeWork(NamedTuple):
    """Scratch of one thread for flows of up to E segments."""

    lane: LaneWork
    reading: ReadingWork
    columns: ColumnWork
    state: Real  # (2 N, P + 1) on its way over the turn, the last column that of omega
    ended: Real  # (2 N, P + 1) at the end of a segment, before a change of contact there
    starts: Real  # (E + 1, 2 N, P + 1) at the starts of the segments, and at the end of the flow
    tangents: Real  # (E + 1, 2 N, 2 N) tangent map up to there
    shift: Real  # (E + 1, P + 1) of their limits
    T: Real  # (2 N, 2 N) tangent map
    maps: Real  # (P + 1, 2 N, 2 N) its derivatives, or (0, ...) where none are asked for
    U: Real  # (2 N, P) at the place that is read
    acceleration: Real  # (N, P) there
    z: Real  # (2 N,) state there
    rate: Real  # (2 N,) and its rate
    height: Real  # (2 E,) summits of the parts of a turn
    when: Real  # (2 E,) since the start of the segment
    row: Real  # (P,)
    node: Real  # (K,) of Gauss' rule on (0, 1)
    weight: Real  # (K,)
    vectors: Real  # (2 N, 2 N) eigenvectors, those of a pair as real and imaginary part
    basis: Real  # (2 N, 2 N) the same, factored
    pivot: Int  # (2 N,)


def new_slope_work(
    machine: MachineArrays, asked: Asked, parameters: int, stop: Int, *, maps: bool
) -> SlopeWork:
    """Scratch for lanes like a given machine."""
    lane = new_lane_work(machine, stop)
    n = machine.direction.shape[1]
    size, segments = 2 * n, lane.shooting.flow.start.shape[0]
    node, weight = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    return SlopeWork(
        lane=lane,
        reading=new_reading_work(lane.shooting.flow, machine, asked),
        columns=new_column_work(machine, parameters),
        state=np.zeros((size, parameters + 1)),
        ended=np.zeros((size, parameters + 1)),
        starts=np.zeros((segments + 1, size, parameters + 1)),
        tangents=np.zeros((segments + 1, size, size)),
        shift=np.zeros((segments + 1, parameters + 1)),
        T=np.zeros((size, size)),
        maps=np.zeros((parameters + 1 if maps else 0, size, size)),
        U=np.zeros((size, parameters)),
        acceleration=np.zeros((n, parameters)),
        z=np.zeros(size),
        rate=np.zeros(size),
        height=np.zeros(2 * segments),
        when=np.zeros(2 * segments),
        row=np.zeros(parameters),
        node=0.5 * (node + 1.0),
        weight=0.5 * weight,
        vectors=np.zeros((size, size)),
        basis=np.zeros((size, size)),
        pivot=np.zeros(size, np.int64),
    )


def new_slopes(found: Found, machine: MachineArrays, asked: Asked, parameters: int) -> Slopes:
    """Room for the derivatives of what was found, NaN until they are."""
    shape = found.reason.shape

    def room(*sizes: int) -> Real:
        return np.full((*shape, *sizes, parameters), np.nan)

    def complex_room(*sizes: int) -> Complex:
        return np.full((*shape, *sizes, parameters), np.nan, np.complex128)

    stops, size = machine.direction.shape[0], found.state.shape[2]
    coordinates = asked.coordinate.shape[0]
    return Slopes(
        state=room(size),
        low=room(coordinates),
        high=room(coordinates),
        first=complex_room(coordinates),
        force=room(stops),
        share=room(stops),
        approach=room(),
        square=room(asked.squared.shape[0]),
        peak=room(asked.linear.shape[1]),
        multiplier=complex_room(size),
    )


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


@kernel
def move_to(
    machine: MachineArrays, columns: Columns, e: int, omega: float, t: float, work: SlopeWork
) -> None:
    """State, rate and derivatives of the state at a time since the start of segment e."""
    flow = work.lane.shooting.flow
    for k in range(work.U.shape[0]):
        for p in range(work.U.shape[1]):
            work.U[k, p] = work.starts[e, k, p]
    advance_columns(machine, flow, e, omega, columns, t, work.U, work.columns)
    segment_state(machine, flow, e, omega, t, work.z, work.rate)


@kernel
def coordinate_slopes(
    problem: Shooting, columns: Columns, omega: float, coordinate: Real, g: int, work: SlopeWork,
    out: Slopes, lane: int, f: int,
) -> None:  # fmt: skip
    """Derivatives of the extremes of one coordinate."""
    machine, flow = problem.machine, work.lane.shooting.flow
    motion, n = work.reading.coordinate, machine.direction.shape[1]
    low, high, low_at, high_at, low_in, high_in = math.inf, -math.inf, 0.0, 0.0, 0, 0
    for e in range(flow.segments[0]):
        count = segment_motion(machine, flow, e, omega, coordinate, motion)
        prepare_search(motion, count)
        least, most, at_least, at_most = extremes(motion, count, g, flow.length[e])
        if least < low:
            low, low_at, low_in = least, at_least, e
        if most > high:
            high, high_at, high_in = most, at_most, e
    mirrored = problem.sign < 0.0
    upper, lower = out.high[lane, f, g], out.low[lane, f, g]
    if not mirrored or high >= -low:
        move_to(machine, columns, high_in, omega, high_at, work)
        set_coordinate(coordinate, g, work, 1.0, n, upper)
    if not mirrored or high < -low:
        move_to(machine, columns, low_in, omega, low_at, work)
        set_coordinate(coordinate, g, work, 1.0, n, lower)
    for p in range(upper.shape[0] if mirrored else 0):
        if high >= -low:
            lower[p] = -upper[p]
        else:
            upper[p] = -lower[p]


@kernel
def set_coordinate(
    coordinate: Real, g: int, work: SlopeWork, sign: float, n: int, row: Real
) -> None:
    """Derivatives of a coordinate at the place that is read."""
    for p in range(row.shape[0]):
        row[p] = 0.0
        for k in range(n):
            row[p] += sign * coordinate[g, k] * work.U[k, p]


@kernel
def keep(row: Real, first: bool, candidate: Real) -> None:
    """Take derivatives of a summit that is as high as others; NaN where they move differently."""
    for p in range(row.shape[0]):
        if first:
            row[p] = candidate[p]
        elif abs(row[p] - candidate[p]) > AGREE * max(abs(row[p]), abs(candidate[p])):
            row[p] = math.nan


@kernel
def force_slopes(
    machine: MachineArrays, columns: Columns, omega: float, j: int, work: SlopeWork, row: Real
) -> None:
    """Derivatives of the greatest force of stop j; 0 without contact."""
    flow, motion, best = work.lane.shooting.flow, work.reading.stop, 0.0
    for e in range(flow.segments[0]):
        work.height[e] = 0.0
        if kind(machine.stops, j, flow.regimes[e, j]) != 0:
            count = segment_motion(machine, flow, e, omega, machine.direction, motion)
            work.height[e], work.when[e] = force_peak(machine, flow, motion, count, e, j)
        best = max(best, work.height[e])
    first = True
    for p in range(row.shape[0]):
        row[p] = 0.0
    for e in range(flow.segments[0]):
        if best > 0.0 and work.height[e] >= best * (1.0 - TIED):
            set_force(machine, columns, e, omega, j, work.when[e], work)
            keep(row, first, work.row)
            first = False


@kernel
def set_force(
    machine: MachineArrays, columns: Columns, e: int, omega: float, j: int, t: float,
    work: SlopeWork,
) -> None:  # fmt: skip
    """Derivatives of the size of the force of stop j at a time of segment e into work.row."""
    flow, stops, n = work.lane.shooting.flow, machine.stops, machine.direction.shape[1]
    move_to(machine, columns, e, omega, t, work)
    force, rate = stop_force(machine, flow, e, j, work.z), 0.0
    regime = flow.regimes[e, j]
    k = stiffness_share(stops, j, regime) * stops.stiffness[j]
    c = damping_share(stops, j, regime) * stops.damping[j]
    for s in range(n):
        rate += machine.direction[j, s] * (k * work.rate[s] + c * work.rate[n + s])
    sign = -1.0 if force < 0.0 else 1.0
    for p in range(work.row.shape[0]):
        slope = force_slope(machine, flow, columns, e, j, p, work)
        for s in range(n):
            slope += machine.direction[j, s] * (k * work.U[s, p] + c * work.U[n + s, p])
        work.row[p] = sign * (slope + rate * shifted(flow, work, e, t, p))


@kernel
def shifted(flow: Flow, work: SlopeWork, e: int, t: float, p: int) -> float:
    """How the time of a summit moves that stands at a limit of segment e; 0 within it."""
    if t <= 0.0:
        return float(work.shift[e, p])
    return float(work.shift[e + 1, p]) if t >= flow.length[e] * (1.0 - AT_END) else 0.0


@kernel
def stop_force(machine: MachineArrays, flow: Flow, e: int, j: int, z: Real) -> float:
    """Force of stop j in segment e at a state."""
    stops, regime, n = machine.stops, flow.regimes[e, j], machine.direction.shape[1]
    depth, rate = -signed_gap(stops, j, regime), 0.0
    for s in range(n):
        depth += machine.direction[j, s] * z[s]
        rate += machine.direction[j, s] * z[n + s]
    spring = stiffness_share(stops, j, regime) * stops.stiffness[j] * depth
    return float(spring + damping_share(stops, j, regime) * stops.damping[j] * rate)


@kernel
def force_slope(
    machine: MachineArrays, flow: Flow, columns: Columns, e: int, j: int, p: int, work: SlopeWork
) -> float:
    """Derivative of the force of stop j in segment e at the fixed state in work.z."""
    stops, regime, n = machine.stops, flow.regimes[e, j], machine.direction.shape[1]
    f_k, f_c = stiffness_share(stops, j, regime), damping_share(stops, j, regime)
    if columns.touches[p, 5] == 0 or (f_k == 0.0 and f_c == 0.0):
        return 0.0
    depth, rate = -signed_gap(stops, j, regime), 0.0
    turned, turned_rate = -gap_slope(columns, j, regime, p), 0.0
    for s in range(n):
        depth += machine.direction[j, s] * work.z[s]
        rate += machine.direction[j, s] * work.z[n + s]
        turned += columns.direction[p, j, s] * work.z[s]
        turned_rate += columns.direction[p, j, s] * work.z[n + s]
    spring = columns.stop_stiffness[p, j] * depth + stops.stiffness[j] * turned
    damper = columns.stop_damping[p, j] * rate + stops.damping[j] * turned_rate
    return float(f_k * spring + f_c * damper)


@kernel
def contact_slopes(
    machine: MachineArrays, columns: Columns, omega: float, turn: float, work: SlopeWork,
    out: Slopes, lane: int, f: int,
) -> None:  # fmt: skip
    """Derivatives of shares of contact, and of the greatest speed at which one begins."""
    flow, share = work.lane.shooting.flow, out.share[lane, f]
    row, fastest, first = out.approach[lane, f], 0.0, True
    for p in range(row.shape[0]):
        row[p] = 0.0
        for j in range(share.shape[0]):
            share[j, p] = 0.0
    for e in range(flow.segments[0]):
        work.height[e] = 0.0
        for j in range(share.shape[0]):
            if kind(machine.stops, j, flow.regimes[e, j]) != 0:
                for p in range(row.shape[0]):
                    share[j, p] += (work.shift[e + 1, p] - work.shift[e, p]) / turn
        spring = flow.spring[e]
        if spring >= 0 and flow.regimes[e, spring] == 0:
            end_segment(machine, flow, e, omega, work.z, work.rate)
            work.height[e] = abs(speed_at(machine, spring, work.z))
        fastest = max(fastest, work.height[e])
    for e in range(flow.segments[0]):
        if fastest > 0.0 and work.height[e] >= fastest * (1.0 - TIED):
            set_approach(machine, columns, e, omega, work)
            keep(row, first, work.row)
            first = False


@kernel
def speed_at(machine: MachineArrays, j: int, z: Real) -> float:
    """Rate of the gap of stop j."""
    n, rate = machine.direction.shape[1], 0.0
    for s in range(n):
        rate += machine.direction[j, s] * z[n + s]
    return rate


@kernel
def set_approach(
    machine: MachineArrays, columns: Columns, e: int, omega: float, work: SlopeWork
) -> None:
    """Derivatives of the speed at the end of segment e, where a contact begins, into work.row."""
    j, n, end = work.lane.shooting.flow.spring[e], machine.direction.shape[1], work.columns
    set_end(machine, columns, e, omega, work)
    sign = -1.0 if speed_at(machine, j, end.z) < 0.0 else 1.0
    for p in range(work.row.shape[0]):
        slope = 0.0
        for s in range(n):
            slope += machine.direction[j, s] * (
                work.ended[n + s, p] + end.rate[n + s] * work.shift[e + 1, p]
            )
            if columns.touches[p, 6] != 0:
                slope += columns.direction[p, j, s] * end.z[n + s]
        work.row[p] = sign * slope


@kernel
def set_end(
    machine: MachineArrays, columns: Columns, e: int, omega: float, work: SlopeWork
) -> None:
    """Derivatives at the end of segment e into work.ended, and the state there into the columns'.

    They are those behind a change of contact, with its saltation undone.
    """
    flow, end = work.lane.shooting.flow, work.columns
    for k in range(work.ended.shape[0]):
        for p in range(work.ended.shape[1]):
            work.ended[k, p] = work.starts[e + 1, k, p]
    end_segment(machine, flow, e, omega, end.z, end.rate)
    if flow.kick[e] != 0.0:
        kick_columns(machine, flow, e, columns, -1.0, work.ended, end)


@kernel
def mean_slopes(
    machine: MachineArrays, flow: Flow, columns: Columns, omega: float, turn: float, asked: Asked,
    work: SlopeWork, out: Slopes, lane: int, f: int,
) -> None:  # fmt: skip
    """Derivatives of first harmonics and of mean squares of rates, by Gauss' rule."""
    first, square = out.first[lane, f], out.square[lane, f]
    for p in range(work.row.shape[0]):
        for g in range(first.shape[0]):
            first[g, p] = 0j
        for g in range(square.shape[0]):
            square[g, p] = 0.0
    modes, driven = flow.modes, 0.0
    for w in range(machine.order.shape[0]):
        driven = max(driven, machine.order[w] * omega)
    for e in range(flow.segments[0]):
        slot, fastest = flow.slot[e], driven
        for i in range(modes.mode_count[slot]):
            fastest = max(fastest, modulus(modes.rate[slot, i]))
        parts = min(1 + int(PER_RADIAN * fastest * flow.length[e]), MOST_PARTS)
        step = flow.length[e] / parts
        for part in range(parts):
            for node in range(work.node.shape[0]):
                t = step * (part + work.node[node])
                move_to(machine, columns, e, omega, t, work)
                weight = step * work.weight[node] / turn
                turned = 2.0 * weight * exponential(-1j * (omega * (flow.start[e] + t)))
                add_means(asked, turned, 2.0 * weight, work, first, square)


@kernel
def add_means(
    asked: Asked, turned: complex, weight: float, work: SlopeWork, first: Complex, square: Real
) -> None:
    """What one node adds to the derivatives of harmonics and mean squares."""
    n, parameters = work.z.shape[0] // 2, work.U.shape[1]
    for g in range(first.shape[0]):
        for p in range(parameters):
            for k in range(n):
                first[g, p] += turned * (asked.coordinate[g, k] * work.U[k, p])
    for g in range(square.shape[0]):
        rate = 0.0
        for k in range(n):
            rate += asked.squared[g, k] * work.z[n + k]
        for p in range(parameters):
            for k in range(n):
                square[g, p] += weight * rate * asked.squared[g, k] * work.U[n + k, p]


@kernel
def vector_slopes(
    machine: MachineArrays, columns: Columns, omega: float, linear: Real, along: complex,
    across: complex, linear_slope: Real, along_slope: Complex, across_slope: Complex,
    work: SlopeWork, row: Real,
) -> None:  # fmt: skip
    """Derivatives of the greatest length of a vector.

    A flow without contact is looked at in halves, in each of which a summit may be as high.
    """
    flow, motion, best = work.lane.shooting.flow, work.reading.vector, 0.0
    segments = flow.segments[0]
    parts = 2 if segments == 1 else 1
    for e in range(segments):
        duration = flow.length[e] / parts
        for part in range(parts):
            count = set_vector(machine, flow, motion, e, omega, linear, along, across)
            delay(motion, count, part * duration)
            height, when = longest(motion, count, duration)
            work.height[parts * e + part], work.when[parts * e + part] = (
                height, part * duration + when,
            )  # fmt: skip
            best = max(best, height)
    first = True
    for p in range(row.shape[0]):
        row[p] = 0.0
    for place in range(parts * segments):
        if not (best > 0.0 and work.height[place] >= best * (1.0 - TIED)):
            continue
        e, t = place // parts, work.when[place]
        set_length(
            machine, columns, e, omega, t, linear, along, across, linear_slope, along_slope,
            across_slope, work,
        )  # fmt: skip
        keep(row, first, work.row)
        first = False


@kernel
def delay(motion: GapMotion, count: int, t: float) -> None:
    """Both parts of a vector counted from a later time."""
    for part in range(2):
        motion.offset[part] += motion.drift[part] * t
        for i in range(count):
            motion.amplitude[part, i] *= exponential(motion.rate[i] * t)


@kernel
def set_length(
    machine: MachineArrays, columns: Columns, e: int, omega: float, t: float, linear: Real,
    along: complex, across: complex, linear_slope: Real, along_slope: Complex,
    across_slope: Complex, work: SlopeWork,
) -> None:  # fmt: skip
    """Derivatives of a vector's length at a time of segment e into work.row."""
    flow, n = work.lane.shooting.flow, machine.direction.shape[1]
    motion = work.reading.vector
    count = set_vector(machine, flow, motion, e, omega, linear, along, across)
    half_square, rate = length_at(motion, count, t)
    length = math.sqrt(2.0 * half_square)
    one, two = motion.offset[0] + motion.drift[0] * t, motion.offset[1] + motion.drift[1] * t
    for i in range(count):
        grown = exponential(motion.rate[i] * t)
        one += (motion.amplitude[0, i] * grown).real
        two += (motion.amplitude[1, i] * grown).real
    move_to(machine, columns, e, omega, t, work)
    set_accelerations(machine, columns, e, omega, flow.start[e] + t, work)
    turned = exponential(1j * (omega * (flow.start[e] + t)))
    for p in range(work.row.shape[0]):
        slope = one * (along_slope[p] * turned).real + two * (across_slope[p] * turned).real
        for k in range(n):
            part = linear[0, k] * work.U[k, p] + linear[1, k] * work.U[n + k, p]
            part += linear[2, k] * work.acceleration[k, p]
            part += linear_slope[0, k, p] * work.z[k] + linear_slope[1, k, p] * work.z[n + k]
            part += linear_slope[2, k, p] * work.rate[n + k]
            slope += one * part
        work.row[p] = (slope + rate * shifted(flow, work, e, t, p)) / length


@kernel
def set_accelerations(
    machine: MachineArrays, columns: Columns, e: int, omega: float, t: float, work: SlopeWork
) -> None:
    """Derivatives of the accelerations, by the equation of motion, at the place that is read."""
    flow, n, U = work.lane.shooting.flow, machine.direction.shape[1], work.U
    for p in range(U.shape[1]):
        for k in range(n):
            total = columns.static[p, k]
            for s in range(n):
                total -= machine.stiffness[k, s] * U[s, p] + machine.damping[k, s] * U[n + s, p]
                total -= columns.stiffness[p, k, s] * work.z[s]
                total -= columns.damping[p, k, s] * work.z[n + s]
                total -= columns.inertia[p, k, s] * work.rate[n + s]
            for x in range(machine.power.shape[0]):
                turning = 1j * (machine.order[machine.wave[x]] * omega * t)
                push = omega ** machine.power[x] * columns.push[p, x, k]
                total += (push * exponential(turning)).real
            work.acceleration[k, p] = total
        for j in range(machine.direction.shape[0]):
            add_stop(machine, flow, columns, e, j, p, work)


@kernel
def add_stop(
    machine: MachineArrays, flow: Flow, columns: Columns, e: int, j: int, p: int, work: SlopeWork
) -> None:
    """What stop j adds to the derivatives of the accelerations."""
    stops, regime, n = machine.stops, flow.regimes[e, j], machine.direction.shape[1]
    if kind(stops, j, regime) == 0:
        return
    k = stiffness_share(stops, j, regime) * stops.stiffness[j]
    c = damping_share(stops, j, regime) * stops.damping[j]
    slope = force_slope(machine, flow, columns, e, j, p, work)
    for s in range(n):
        slope += machine.direction[j, s] * (k * work.U[s, p] + c * work.U[n + s, p])
    force = stop_force(machine, flow, e, j, work.z)
    for s in range(n):
        work.acceleration[s, p] -= machine.reach[j, s] * slope + columns.reach[p, j, s] * force
