"""What is read off a lane's motion: extremes, harmonics, forces, peaks of vectors, mean squares.

A peak is the greatest length of a vector of :mod:`flipflow.dynamics.pieces`, without b.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flipflow.compiled.arrays import Complex, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.dynamics.contact_search import (
    GapMotion,
    exponential,
    exponentials,
    gap_state,
    integral_of_exponential,
    new_gap_motion,
)
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import Flow, force_peak, segment_motion
from flipflow.dynamics.law import kind
from flipflow.dynamics.pieces import longest
from flipflow.periodic.readings import observe_record


@by_reference
class Asked(NamedTuple):
    """What is read off every lane, besides what every motion has; L is 1 where all lanes agree."""

    coordinate: Real  # (G, N) whose extremes and first harmonics are read
    squared: Real  # (S, N) whose mean square rates are read
    linear: Real  # (L, Q, 3, N) c_0, c_1, c_2 of vectors whose peaks are read
    along: Complex  # (L, F, Q) A
    across: Complex  # (L, F, Q) B


@by_reference
class Readings(NamedTuple):
    """What was read, lanes and frequencies first."""

    low: Real  # (L, F, G) m
    high: Real  # (L, F, G) m
    first: Complex  # (L, F, G) m
    force: Real  # (L, F, m) greatest force of each stop in N
    share: Real  # (L, F, m) share of the turn in which it has a force
    approach: Real  # (L, F) greatest speed at a gap with which a contact begins, m/s
    square: Real  # (L, F, S) mean square of the rates, m^2/s^2
    peak: Real  # (L, F, Q)


@by_reference
class ReadingWork(NamedTuple):
    """Scratch: sums of exponentials."""

    coordinate: GapMotion  # G of them
    stop: GapMotion  # m
    squared: GapMotion  # S
    vector: GapMotion  # its two parts


def new_reading_work(flow: Flow, machine: MachineArrays, asked: Asked) -> ReadingWork:
    """Scratch for what is asked of machines like a given one."""
    rates = np.zeros(flow.modes.rate.shape[1] + machine.order.shape[0] + 1, np.complex128)
    sizes = asked.coordinate.shape[0], machine.direction.shape[0], asked.squared.shape[0], 2
    return ReadingWork(*(new_gap_motion(size, rates) for size in sizes))


def new_readings(lanes: int, speeds: int, machine: MachineArrays, asked: Asked) -> Readings:
    """Room for what is asked, NaN until it is read."""
    shape = lanes, speeds
    coordinates, stops = (*shape, asked.coordinate.shape[0]), (*shape, machine.direction.shape[0])
    return Readings(
        low=np.full(coordinates, np.nan),
        high=np.full(coordinates, np.nan),
        first=np.full(coordinates, np.nan, np.complex128),
        force=np.full(stops, np.nan),
        share=np.full(stops, np.nan),
        approach=np.full(shape, np.nan),
        square=np.full((*shape, asked.squared.shape[0]), np.nan),
        peak=np.full((*shape, asked.linear.shape[1]), np.nan),
    )


@kernel
def read_lane(
    machine: MachineArrays, flow: Flow, work: ReadingWork, asked: Asked, omega: float, turn: float,
    half: bool, out: Readings, lane: int, f: int,
) -> None:  # fmt: skip
    """All readings of the motion recorded over ``turn`` seconds, half a turn of an even one."""
    low, high, first = out.low[lane, f], out.high[lane, f], out.first[lane, f]
    observe_record(machine, flow, omega, turn, asked.coordinate, work.coordinate, low, high, first)
    for g in range(low.shape[0] if half else 0):
        high[g] = max(high[g], -low[g])
        low[g] = -high[g]
    read_stops(machine, flow, work.stop, omega, turn, out, lane, f)
    if asked.squared.shape[0] > 0:
        read_squares(machine, flow, work.squared, asked.squared, omega, turn, out, lane, f)
    which = lane if asked.linear.shape[0] > 1 else 0
    for q in range(asked.linear.shape[1]):
        largest = 0.0
        for e in range(flow.segments[0]):
            along, across = asked.along[which, f, q], asked.across[which, f, q]
            linear = asked.linear[which, q]
            count = set_vector(machine, flow, work.vector, e, omega, linear, along, across)
            here, _ = longest(work.vector, count, flow.length[e])
            largest = max(largest, here)
        out.peak[lane, f, q] = largest


@kernel
def read_stops(
    machine: MachineArrays, flow: Flow, motion: GapMotion, omega: float, turn: float,
    out: Readings, lane: int, f: int,
) -> None:  # fmt: skip
    """Greatest force and time of contact of each stop, and the speed at which one is met."""
    for j in range(machine.direction.shape[0]):
        out.force[lane, f, j], out.share[lane, f, j] = 0.0, 0.0
    out.approach[lane, f] = 0.0
    for e in range(flow.segments[0]):
        spring = flow.spring[e]
        if spring >= 0 and flow.regimes[e, spring] == 0:
            count = segment_motion(machine, flow, e, omega, machine.direction, motion)
            exponentials(motion, count, flow.length[e])
            _, v = gap_state(motion, count, spring)
            out.approach[lane, f] = max(out.approach[lane, f], abs(v))
        count = 0
        for j in range(machine.direction.shape[0]):
            if kind(machine.stops, j, flow.regimes[e, j]) != 0:
                if count == 0:
                    count = segment_motion(machine, flow, e, omega, machine.direction, motion)
                out.share[lane, f, j] += flow.length[e] / turn
                peak, _ = force_peak(machine, flow, motion, count, e, j)
                out.force[lane, f, j] = max(out.force[lane, f, j], peak)


@kernel
def read_squares(
    machine: MachineArrays, flow: Flow, motion: GapMotion, coordinate: Real, omega: float,
    turn: float, out: Readings, lane: int, f: int,
) -> None:  # fmt: skip
    """Mean squares of rates, as integrals of products of exponentials."""
    for g in range(coordinate.shape[0]):
        out.square[lane, f, g] = 0.0
    for e in range(flow.segments[0]):
        count = segment_motion(machine, flow, e, omega, coordinate, motion)
        length = flow.length[e]
        for g in range(coordinate.shape[0]):
            drift = motion.drift[g]
            total = drift * drift * length
            for i in range(count):
                a, p = motion.amplitude[g, i] * motion.rate[i], motion.rate[i]
                total += 2.0 * drift * (a * integral_of_exponential(p, length)).real
                for j in range(count):
                    b, q = motion.amplitude[g, j] * motion.rate[j], motion.rate[j]
                    total += 0.5 * (a * b * integral_of_exponential(p + q, length)).real
                    b, q = b.conjugate(), q.conjugate()
                    total += 0.5 * (a * b * integral_of_exponential(p + q, length)).real
            out.square[lane, f, g] += total / turn


@kernel
def set_vector(
    machine: MachineArrays, flow: Flow, motion: GapMotion, e: int, omega: float, linear: Real,
    along: complex, across: complex,
) -> int:  # fmt: skip
    """Both parts of a vector during segment e as sums of exponentials; the number of terms."""
    modes, slot, n = flow.modes, flow.slot[e], machine.direction.shape[1]
    motion.offset[0], motion.drift[0], motion.offset[1], motion.drift[1] = 0.0, 0.0, 0.0, 0.0
    for k in range(n):
        rest, drift = flow.rest[e, k], modes.drift[slot, k]
        motion.offset[0] += linear[0, k] * rest + linear[1, k] * drift
        motion.drift[0] += linear[0, k] * drift
    count = modes.mode_count[slot]
    for i in range(count):
        rate, total = modes.rate[slot, i], 0j
        for k in range(n):
            total += (linear[0, k] + rate * (linear[1, k] + rate * linear[2, k])) * modes.right[
                slot, k, i
            ]
        motion.rate[i], motion.amplitude[1, i] = rate, 0.0
        motion.amplitude[0, i] = modes.weight[slot, i] * flow.q[e, i] * total
    for w in range(machine.order.shape[0]):
        rate, total = 1j * (machine.order[w] * omega), 0j
        for k in range(n):
            factor = linear[0, k] + rate * (linear[1, k] + rate * linear[2, k])
            total += factor * flow.drive[slot, w, k]
        motion.rate[count], motion.amplitude[1, count] = rate, 0.0
        motion.amplitude[0, count] = total * exponential(rate * flow.start[e])
        count += 1
    turn = exponential(1j * (omega * flow.start[e]))
    motion.rate[count] = 1j * omega
    motion.amplitude[0, count], motion.amplitude[1, count] = along * turn, across * turn
    return int(count) + 1
