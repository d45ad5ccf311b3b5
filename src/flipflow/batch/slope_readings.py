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
from flipflow.batch.lane_readings import Asked, ReadingWork, new_reading_work
from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.dynamics.contact_search import (
    begin_later,
    extremes,
    prepare_search,
)
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import (
    Flow,
    end_segment,
    force_peak,
    segment_motion,
    segment_state,
    stop_force,
)
from flipflow.dynamics.law import damping_share, kind, signed_gap, stiffness_share
from flipflow.dynamics.multiplier_slopes import MultiplierWork, new_multiplier_work
from flipflow.dynamics.parameter_tangent import (
    Columns,
    ColumnWork,
    advance_columns,
    gap_slope,
    new_column_work,
)
from flipflow.dynamics.parameter_variation import set_ended
from flipflow.periodic.shooting import Shooting

GAUSS_POINTS = 12  # in each part of a segment in which a mean is taken
TIED = 1e-9  # share of the highest summit within which another one is as high
AGREE = 1e-6  # share of a derivative to which those of two summits must agree
AT_END = 1e-12  # share of a segment from its end within which its last sample stands


@by_reference
class SlopesAsked(NamedTuple):
    """What is differentiated besides states, extremes and forces; L is 1 where no vector is."""

    linear: Real  # (L, Q, 3, N, P) of the c_0, c_1, c_2 of vectors
    along: Complex  # (L, F, Q, P) of A
    across: Complex  # (L, F, Q, P) of B
    means: bool  # first harmonics and mean squares, too
    contacts: bool  # shares of contact and the speed of approach, too
    multipliers: bool
    even: bool  # whether an even machine stays so with every parameter
    corner: Int  # (m,) 1 where the law kicks the tangent of what grazes the stop


@by_reference
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


@by_reference
class Place(NamedTuple):
    """A place of the motion that is read."""

    U: Real  # (2 N, P) derivatives of the state
    acceleration: Real  # (N, P) and of the accelerations
    z: Real  # (2 N,) state
    rate: Real  # (2 N,) and its rate


@by_reference
class Summits(NamedTuple):
    """The greatest value in each part of a turn."""

    height: Real  # (2 E,)
    when: Real  # (2 E,) since the start of the segment
    at_end: Int  # (2 E,) 1 where it stands at an end of the part
    side: Real  # (2 E,) +1 or -1 times the coordinate


@by_reference
class SlopeWork(NamedTuple):
    """Scratch of one thread for flows of up to E segments."""

    lane: LaneWork
    machine_columns: Columns  # of the lane's machine
    reading: ReadingWork
    columns: ColumnWork
    multiplier: MultiplierWork
    place: Place
    summits: Summits
    state: Real  # (2 N, P + 1) on its way over the turn, the last column that of omega
    ended: Real  # (2 N, P + 1) at the end of a segment, before a change of contact there
    starts: Real  # (E + 1, 2 N, P + 1) at the starts of the segments, and at the end of the flow
    tangents: Real  # (E + 1, 2 N, 2 N) tangent map up to there
    shift: Real  # (E + 1, P + 1) of their limits
    row: Real  # (P,)
    node: Real  # (K,) of Gauss' rule on (0, 1)
    weight: Real  # (K,)


def new_slope_work(machine: MachineArrays, asked: Asked, batch: Columns, stop: Int) -> SlopeWork:
    """Scratch for lanes like a given machine, with P parameters.

    Each lane's machine is written into the arrays of the given one.
    """
    parameters = batch.touches.shape[0]
    first = {name: getattr(batch, name)[0].copy() for name in batch._fields if name != "touches"}
    lane = new_lane_work(machine, stop)
    n = machine.direction.shape[1]
    size, segments = 2 * n, lane.shooting.flow.start.shape[0]
    node, weight = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    return SlopeWork(
        lane=lane,
        machine_columns=Columns(**first, touches=batch.touches),
        reading=new_reading_work(lane.shooting.flow, machine, asked),
        columns=new_column_work(machine, parameters),
        multiplier=new_multiplier_work(size, parameters),
        place=Place(
            U=np.zeros((size, parameters)),
            acceleration=np.zeros((n, parameters)),
            z=np.zeros(size),
            rate=np.zeros(size),
        ),
        summits=Summits(
            height=np.zeros(2 * segments),
            when=np.zeros(2 * segments),
            at_end=np.zeros(2 * segments, np.int64),
            side=np.zeros(2 * segments),
        ),
        state=np.zeros((size, parameters + 1)),
        ended=np.zeros((size, parameters + 1)),
        starts=np.zeros((segments + 1, size, parameters + 1)),
        tangents=np.zeros((segments + 1, size, size)),
        shift=np.zeros((segments + 1, parameters + 1)),
        row=np.zeros(parameters),
        node=0.5 * (node + 1.0),
        weight=0.5 * weight,
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
def move_to(
    machine: MachineArrays, columns: Columns, e: int, omega: float, t: float, work: SlopeWork
) -> None:
    """State, rate and derivatives of the state at a time since the start of segment e."""
    flow, place = work.lane.shooting.flow, work.place
    for k in range(place.U.shape[0]):
        for p in range(place.U.shape[1]):
            place.U[k, p] = work.starts[e, k, p]
    advance_columns(machine, flow, e, omega, columns, t, place.U, work.columns)
    segment_state(machine, flow, e, omega, t, place.z, place.rate)


@kernel
def coordinate_slopes(
    problem: Shooting, columns: Columns, omega: float, coordinate: Real, g: int, work: SlopeWork,
    upper: Real, lower: Real,
) -> None:  # fmt: skip
    """Derivatives of the extremes of one coordinate; its mirror image is as high and as low."""
    machine, mirrored = problem.machine, problem.sign < 0.0
    set_extremes(machine, columns, omega, coordinate, g, True, mirrored, work, upper)
    if not mirrored:
        set_extremes(machine, columns, omega, coordinate, g, False, True, work, lower)
    for p in range(upper.shape[0]):
        lower[p] = -upper[p] if mirrored else -lower[p]


@kernel
def set_extremes(
    machine: MachineArrays, columns: Columns, omega: float, coordinate: Real, g: int, upper: bool,
    lower: bool, work: SlopeWork, row: Real,
) -> None:  # fmt: skip
    """Derivatives of the greatest value of a coordinate, of minus its least, or of the greater.

    A flow of one segment is looked at in halves, in each of which a summit may be as high.
    """
    flow, motion, summits = work.lane.shooting.flow, work.reading.coordinate, work.summits
    parts = 2 if flow.segments[0] == 1 else 1
    places = parts * flow.segments[0]
    for part in range(places):
        e = part // parts
        begin, duration = (part % parts) * flow.length[e] / parts, flow.length[e] / parts
        count = segment_motion(machine, flow, e, omega, coordinate, motion)
        begin_later(motion, count, g, begin)
        prepare_search(motion, count)
        least, most, at_least, at_most = extremes(motion, count, g, duration)
        low = lower and (not upper or -least > most)
        summits.side[part] = -1.0 if low else 1.0
        at = at_least if low else at_most
        note_summit(summits, part, -least if low else most, at, begin, duration)
    first = True
    for part in range(places):
        if not is_summit(summits, part, places):
            continue
        move_to(machine, columns, part // parts, omega, summits.when[part], work)
        for p in range(row.shape[0]):
            work.row[p] = 0.0
            for k in range(machine.direction.shape[1]):
                work.row[p] += summits.side[part] * coordinate[g, k] * work.place.U[k, p]
        keep(row, first, work.row)
        first = False


@kernel
def note_summit(
    summits: Summits, part: int, height: float, at: float, begin: float, duration: float
) -> None:
    """Write down the highest value in a part of the flow, and whether it stands at an end of it."""
    summits.height[part], summits.when[part] = height, begin + at
    at_end = at <= 0.0 or at >= duration * (1.0 - AT_END)
    summits.at_end[part] = 1 if at_end else 0


@kernel
def is_summit(summits: Summits, part: int, parts: int) -> bool:
    """Whether a part's highest value is that of the flow, or as high.

    An end of a part that hardly reaches it belongs to the summit beside, unless that is an end,
    too.
    """
    best = 0
    for other in range(parts):
        if summits.height[other] > summits.height[best]:
            best = other
    top = summits.height[best]
    if summits.height[part] < top - TIED * abs(top):
        return False
    return part == best or summits.at_end[part] == 0 or summits.at_end[best] != 0


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
    flow, motion, summits = work.lane.shooting.flow, work.reading.stop, work.summits
    touched = False
    for e in range(flow.segments[0]):
        note_summit(summits, e, 0.0, 0.5 * flow.length[e], 0.0, flow.length[e])
        if kind(machine.stops, j, flow.regimes[e, j]) != 0:
            count = segment_motion(machine, flow, e, omega, machine.direction, motion)
            height, at = force_peak(machine, flow, motion, count, e, j)
            note_summit(summits, e, height, at, 0.0, flow.length[e])
            touched = touched or height > 0.0
    first = True
    for p in range(row.shape[0]):
        row[p] = 0.0
    for e in range(flow.segments[0]):
        if touched and is_summit(summits, e, flow.segments[0]):
            set_force(machine, columns, e, omega, j, summits.when[e], work)
            keep(row, first, work.row)
            first = False


@kernel
def set_force(
    machine: MachineArrays, columns: Columns, e: int, omega: float, j: int, t: float,
    work: SlopeWork,
) -> None:  # fmt: skip
    """Derivatives of the size of the force of stop j at a time of segment e into work.row."""
    flow, stops, n = work.lane.shooting.flow, machine.stops, machine.direction.shape[1]
    place = work.place
    move_to(machine, columns, e, omega, t, work)
    force, rate = stop_force(machine, flow, e, j, place.z), 0.0
    regime = flow.regimes[e, j]
    k = stiffness_share(stops, j, regime) * stops.stiffness[j]
    c = damping_share(stops, j, regime) * stops.damping[j]
    for s in range(n):
        rate += machine.direction[j, s] * (k * place.rate[s] + c * place.rate[n + s])
    sign = -1.0 if force < 0.0 else 1.0
    for p in range(work.row.shape[0]):
        slope = force_slope(machine, flow, columns, e, j, p, place.z)
        for s in range(n):
            slope += machine.direction[j, s] * (k * place.U[s, p] + c * place.U[n + s, p])
        work.row[p] = sign * (slope + rate * shifted(flow, work.shift, e, t, p))


@kernel
def shifted(flow: Flow, shift: Real, e: int, t: float, p: int) -> float:
    """How the time of a summit moves that stands at a limit of segment e; 0 within it."""
    if t <= 0.0:
        return float(shift[e, p])
    return float(shift[e + 1, p]) if t >= flow.length[e] * (1.0 - AT_END) else 0.0


@kernel
def force_slope(
    machine: MachineArrays, flow: Flow, columns: Columns, e: int, j: int, p: int, z: Real
) -> float:
    """Derivative of the force of stop j in segment e at a fixed state."""
    stops, regime, n = machine.stops, flow.regimes[e, j], machine.direction.shape[1]
    f_k, f_c = stiffness_share(stops, j, regime), damping_share(stops, j, regime)
    if columns.touches[p, 5] == 0 or (f_k == 0.0 and f_c == 0.0):
        return 0.0
    depth, rate = -signed_gap(stops, j, regime), 0.0
    turned, turned_rate = -gap_slope(columns, j, regime, p), 0.0
    for s in range(n):
        depth += machine.direction[j, s] * z[s]
        rate += machine.direction[j, s] * z[n + s]
        turned += columns.direction[p, j, s] * z[s]
        turned_rate += columns.direction[p, j, s] * z[n + s]
    spring = columns.stop_stiffness[p, j] * depth + stops.stiffness[j] * turned
    damper = columns.stop_damping[p, j] * rate + stops.damping[j] * turned_rate
    return float(f_k * spring + f_c * damper)


@kernel
def contact_slopes(
    machine: MachineArrays, columns: Columns, omega: float, turn: float, work: SlopeWork,
    share: Real, row: Real,
) -> None:  # fmt: skip
    """Derivatives of shares of contact (m, P), and of the greatest speed at which one begins."""
    flow, place, height = work.lane.shooting.flow, work.place, work.summits.height
    fastest, first = 0.0, True
    for p in range(row.shape[0]):
        row[p] = 0.0
        for j in range(share.shape[0]):
            share[j, p] = 0.0
    for e in range(flow.segments[0]):
        height[e] = 0.0
        for j in range(share.shape[0]):
            if kind(machine.stops, j, flow.regimes[e, j]) != 0:
                for p in range(row.shape[0]):
                    share[j, p] += (work.shift[e + 1, p] - work.shift[e, p]) / turn
        spring = flow.spring[e]
        if spring >= 0 and flow.regimes[e, spring] == 0:
            end_segment(machine, flow, e, omega, place.z, place.rate)
            height[e] = abs(speed_at(machine, spring, place.z))
        fastest = max(fastest, height[e])
    for e in range(flow.segments[0]):
        if fastest > 0.0 and height[e] >= fastest * (1.0 - TIED):
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
    flow, n, end = work.lane.shooting.flow, machine.direction.shape[1], work.columns
    j = flow.spring[e]
    set_ended(machine, flow, e, omega, columns, work.starts, work.ended, end)
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
