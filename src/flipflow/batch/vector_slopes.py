"""Exact derivatives of the greatest lengths of vectors of a lane's motion."""

from __future__ import annotations

import math

from flipflow.batch.lane_readings import set_vector
from flipflow.batch.slope_readings import (
    Place,
    SlopeWork,
    force_slope,
    is_summit,
    keep,
    move_to,
    note_summit,
    shifted,
)
from flipflow.compiled.arrays import Complex, Real
from flipflow.compiled.compile import kernel
from flipflow.dynamics.contact_search import begin_later, exponential
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import Flow, stop_force
from flipflow.dynamics.law import damping_share, kind, stiffness_share
from flipflow.dynamics.parameter_tangent import Columns
from flipflow.dynamics.pieces import length_at, longest


@kernel
def vector_slopes(
    machine: MachineArrays, columns: Columns, omega: float, linear: Real, along: complex,
    across: complex, linear_slope: Real, along_slope: Complex, across_slope: Complex,
    work: SlopeWork, row: Real,
) -> None:  # fmt: skip
    """Derivatives of the greatest length of a vector; a flow of one segment in halves."""
    flow, motion, summits = work.lane.shooting.flow, work.reading.vector, work.summits
    parts, longer = 2 if flow.segments[0] == 1 else 1, False
    places = parts * flow.segments[0]
    for part in range(places):
        e = part // parts
        begin, duration = (part % parts) * flow.length[e] / parts, flow.length[e] / parts
        count = set_vector(machine, flow, motion, e, omega, linear, along, across)
        begin_later(motion, count, 0, begin)
        begin_later(motion, count, 1, begin)
        height, at = longest(motion, count, duration)
        note_summit(summits, part, height, at, begin, duration)
        longer = longer or height > 0.0
    first = True
    for p in range(row.shape[0]):
        row[p] = 0.0
    for part in range(places):
        if not (longer and is_summit(summits, part, places)):
            continue
        e, t = part // parts, summits.when[part]
        set_length(
            machine, columns, e, omega, t, linear, along, across, linear_slope, along_slope,
            across_slope, work,
        )  # fmt: skip
        keep(row, first, work.row)
        first = False


@kernel
def set_length(
    machine: MachineArrays, columns: Columns, e: int, omega: float, t: float, linear: Real,
    along: complex, across: complex, linear_slope: Real, along_slope: Complex,
    across_slope: Complex, work: SlopeWork,
) -> None:  # fmt: skip
    """Derivatives of a vector's length at a time of segment e into work.row."""
    flow, n = work.lane.shooting.flow, machine.direction.shape[1]
    motion, place = work.reading.vector, work.place
    count = set_vector(machine, flow, motion, e, omega, linear, along, across)
    half_square, rate = length_at(motion, count, t)
    length = math.sqrt(2.0 * half_square)
    one, two = motion.offset[0] + motion.drift[0] * t, motion.offset[1] + motion.drift[1] * t
    for i in range(count):
        grown = exponential(motion.rate[i] * t)
        one += (motion.amplitude[0, i] * grown).real
        two += (motion.amplitude[1, i] * grown).real
    move_to(machine, columns, e, omega, t, work)
    set_accelerations(machine, flow, columns, e, omega, flow.start[e] + t, place)
    turned = exponential(1j * (omega * (flow.start[e] + t)))
    for p in range(work.row.shape[0]):
        slope = one * (along_slope[p] * turned).real + two * (across_slope[p] * turned).real
        for k in range(n):
            part = linear[0, k] * place.U[k, p] + linear[1, k] * place.U[n + k, p]
            part += linear[2, k] * place.acceleration[k, p]
            part += linear_slope[0, k, p] * place.z[k] + linear_slope[1, k, p] * place.z[n + k]
            part += linear_slope[2, k, p] * place.rate[n + k]
            slope += one * part
        work.row[p] = (slope + rate * shifted(flow, work.shift, e, t, p)) / length


@kernel
def set_accelerations(
    machine: MachineArrays, flow: Flow, columns: Columns, e: int, omega: float, t: float,
    place: Place,
) -> None:  # fmt: skip
    """Derivatives of the accelerations, by the equation of motion, at the place that is read."""
    n, U = machine.direction.shape[1], place.U
    for p in range(U.shape[1]):
        for k in range(n):
            total = columns.static[p, k]
            for s in range(n):
                total -= machine.stiffness[k, s] * U[s, p] + machine.damping[k, s] * U[n + s, p]
                total -= columns.stiffness[p, k, s] * place.z[s]
                total -= columns.damping[p, k, s] * place.z[n + s]
                total -= columns.inertia[p, k, s] * place.rate[n + s]
            for x in range(machine.power.shape[0]):
                turning = 1j * (machine.order[machine.wave[x]] * omega * t)
                push = omega ** machine.power[x] * columns.push[p, x, k]
                total += (push * exponential(turning)).real
            place.acceleration[k, p] = total
        for j in range(machine.direction.shape[0]):
            add_stop(machine, flow, columns, e, j, p, place)


@kernel
def add_stop(
    machine: MachineArrays, flow: Flow, columns: Columns, e: int, j: int, p: int, place: Place
) -> None:
    """What stop j adds to the derivatives of the accelerations."""
    stops, regime, n = machine.stops, flow.regimes[e, j], machine.direction.shape[1]
    if kind(stops, j, regime) == 0:
        return
    k = stiffness_share(stops, j, regime) * stops.stiffness[j]
    c = damping_share(stops, j, regime) * stops.damping[j]
    slope = force_slope(machine, flow, columns, e, j, p, place.z)
    for s in range(n):
        slope += machine.direction[j, s] * (k * place.U[s, p] + c * place.U[n + s, p])
    force = stop_force(machine, flow, e, j, place.z)
    for s in range(n):
        place.acceleration[s, p] -= machine.reach[j, s] * slope + columns.reach[p, j, s] * force
