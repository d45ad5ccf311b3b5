"""Exact derivatives of the greatest lengths of vectors of a lane's motion."""

from __future__ import annotations

import math

from flipflow.batch.lane_readings import set_vector
from flipflow.batch.slope_readings import (
    SlopeWork,
    delay,
    force_slope,
    is_summit,
    keep,
    move_to,
    note_summit,
    shifted,
    stop_force,
)
from flipflow.compiled.arrays import Complex, Real
from flipflow.compiled.compile import kernel
from flipflow.dynamics.contact_search import exponential
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import Flow
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
    flow, motion, longer = work.lane.shooting.flow, work.reading.vector, False
    segments = flow.segments[0]
    parts = 2 if segments == 1 else 1
    for place in range(parts * segments):
        e = place // parts
        begin, duration = (place % parts) * flow.length[e] / parts, flow.length[e] / parts
        count = set_vector(machine, flow, motion, e, omega, linear, along, across)
        delay(motion, count, 0, begin)
        delay(motion, count, 1, begin)
        height, at = longest(motion, count, duration)
        note_summit(work, place, height, at, begin, duration)
        longer = longer or height > 0.0
    first = True
    for p in range(row.shape[0]):
        row[p] = 0.0
    for place in range(parts * segments):
        if not (longer and is_summit(work, place, parts * segments)):
            continue
        e, t = place // parts, work.when[place]
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
