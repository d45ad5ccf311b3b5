"""Exact derivatives of means of a lane's motion: first harmonics, mean squares of rates."""

from __future__ import annotations

from flipflow.batch.lane_readings import Asked
from flipflow.batch.slope_readings import AT_END, Place, SlopeWork, move_to
from flipflow.compiled.arrays import Complex, Real
from flipflow.compiled.compile import kernel
from flipflow.dynamics.contact_search import exponential
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import Flow
from flipflow.dynamics.parameter_tangent import Columns

PER_RADIAN = 0.5  # parts of a segment per radian of its fastest term
MOST_PARTS = 64  # of equal length
MOST_HALVES = 60  # of the first of them, towards the start


@kernel
def mean_slopes(
    machine: MachineArrays, columns: Columns, omega: float, turn: float, asked: Asked,
    work: SlopeWork, first: Complex, square: Real,
) -> None:  # fmt: skip
    """Derivatives of first harmonics and of mean squares of rates, part by part."""
    flow = work.lane.shooting.flow
    for p in range(work.row.shape[0]):
        for g in range(first.shape[0]):
            first[g, p] = 0j
        for g in range(square.shape[0]):
            square[g, p] = 0.0
    for e in range(flow.segments[0]):
        fastest, steepest = rates_of(machine, flow, e, omega)
        parts = min(1 + int(PER_RADIAN * fastest * flow.length[e]), MOST_PARTS)
        step = flow.length[e] / parts
        # What decays at once, as behind a heavily damped contact, lies at the very start.
        begin, end = 0.0, step
        for _ in range(MOST_HALVES):
            if steepest * end < 1.0:
                break
            end *= 0.5
        while begin < flow.length[e] * (1.0 - AT_END):
            add_part(machine, columns, e, omega, begin, end, turn, asked, work, first, square)
            begin, end = end, min(2.0 * end, end + step)


@kernel
def rates_of(machine: MachineArrays, flow: Flow, e: int, omega: float) -> tuple[float, float]:
    """Greatest frequency and greatest decay of segment e, in 1/s."""
    modes, slot = flow.modes, flow.slot[e]
    fastest, steepest = 0.0, 0.0
    for w in range(machine.order.shape[0]):
        fastest = max(fastest, machine.order[w] * omega)
    for i in range(modes.mode_count[slot]):
        fastest = max(fastest, abs(modes.rate[slot, i].imag))
        steepest = max(steepest, abs(modes.rate[slot, i].real))
    return fastest, steepest


@kernel
def add_part(
    machine: MachineArrays, columns: Columns, e: int, omega: float, begin: float, end: float,
    turn: float, asked: Asked, work: SlopeWork, first: Complex, square: Real,
) -> None:  # fmt: skip
    """Add a part of segment e by Gauss' rule."""
    flow = work.lane.shooting.flow
    end = min(end, flow.length[e])
    for node in range(work.node.shape[0]):
        t = begin + (end - begin) * work.node[node]
        move_to(machine, columns, e, omega, t, work)
        weight = (end - begin) * work.weight[node] / turn
        turned = 2.0 * weight * exponential(-1j * (omega * (flow.start[e] + t)))
        add_means(asked, turned, 2.0 * weight, work.place, first, square)


@kernel
def add_means(
    asked: Asked, turned: complex, weight: float, place: Place, first: Complex, square: Real
) -> None:
    """What one node adds to the derivatives of harmonics and mean squares."""
    n, parameters = place.z.shape[0] // 2, place.U.shape[1]
    for g in range(first.shape[0]):
        for p in range(parameters):
            for k in range(n):
                first[g, p] += turned * (asked.coordinate[g, k] * place.U[k, p])
    for g in range(square.shape[0]):
        rate = 0.0
        for k in range(n):
            rate += asked.squared[g, k] * place.z[n + k]
        for p in range(parameters):
            for k in range(n):
                square[g, p] += weight * rate * asked.squared[g, k] * place.U[n + k, p]
