"""A motion at constant speed as a table over time, with the energies that pass on the way."""

from __future__ import annotations

import math
from typing import NamedTuple

from flipflow.compiled import status
from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.dynamics.contact_search import GapMotion, begin_later, extremes, prepare_search
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import (
    Flow,
    press,
    run_flow,
    segment_motion,
    segment_state,
    set_force,
    stop_force,
)
from flipflow.dynamics.law import kind
from flipflow.periodic.shooting import Shooting, ShootingWork

PANEL = 2.0  # radians of the fastest mode in a Gauss panel
SLIVER = 1e-12  # share of a turn below which a remainder is no turn of its own


@by_reference
class Table(NamedTuple):
    """Samples at K given times, in order."""

    t: Real  # (K,)
    x: Real  # (K, N)
    v: Real  # (K, N)
    a: Real  # (K, N)
    force: Real  # (K, all springs)
    peak: Real  # (K, all springs) greatest size of the force since the sample before


@by_reference
class Springs(NamedTuple):
    """Where the flow's m springs stand among all, and the b that always act, in its matrices."""

    place: Int  # (m,)
    always: Int  # (b,) places of those that always act
    direction: Real  # (b, N) of them
    stiffness: Real  # (b,)
    damping: Real  # (b,)
    motion: GapMotion  # scratch along them


@by_reference
class Changes(NamedTuple):
    """Changes of contact, as many as ``used`` tells."""

    t: Real  # (E,)
    spring: Int  # (E,)
    state: Int  # (E,) the contact state that begins
    used: Int  # (1,)


@by_reference
class Budget(NamedTuple):
    """What the energies are summed from and into."""

    damping: Real  # (N, N) C of the open machine
    circulation: Real  # (N, N) the part of its K that is not symmetric: it has no energy
    vector: Complex  # (E, N) the exciting forces are Re(vector exp(i n omega t)) omega^power
    static: Real  # (N,) constant force
    node: Real  # (Q,) Gauss-Legendre on [-1, 1]
    weight: Real  # (Q,)
    work: Real  # (3,) J: done by the exciter, taken by dampers, taken by stops


@kernel(entry=True)
def sample_motion(
    problem: Shooting,
    work: ShootingWork,
    omega: float,
    t: float,
    end: float,
    first: int,
    springs: Springs,
    table: Table,
    changes: Changes,
    budget: Budget,
) -> tuple[int, int]:
    """Carry flow.z from time t to ``end``, filling the table from row ``first`` on.

    Returns the status and the first row that lies beyond. Samples at a change of contact show the
    motion just before it.
    """
    flow = work.flow
    turn = 2.0 * math.pi / omega
    row = first
    while t < end:
        # No sliver is left over by rounding: the last turn takes it.
        duration = turn if end - t > (1.0 + SLIVER) * turn else end - t
        code = run_flow(problem.machine, flow, omega, t, duration, work.rate)
        if code != status.OK:
            return code, row
        for e in range(flow.segments[0]):
            last = flow.start[e] + flow.length[e]
            if e == flow.segments[0] - 1:
                last = t + duration if t + duration < end else math.inf
            before = row
            while row < table.t.shape[0] and table.t[row] <= last and table.t[row] <= end:
                sample(problem, work, e, omega, row, springs, table)
                row += 1
            add_peaks(problem.machine, flow, e, omega, before, row, springs, table)
            add_work(problem, work, e, omega, budget)
            if e > 0:
                note_change(flow, e, changes)
        e = flow.segments[0] - 1
        segment_state(problem.machine, flow, e, omega, flow.length[e], flow.z, work.rate)
        t += duration
    return status.OK, row


@kernel(inline=True)
def note_change(flow: Flow, e: int, changes: Changes) -> None:
    """The change of contact with which segment e begins."""
    k = changes.used[0]
    spring = flow.spring[e - 1]
    changes.t[k] = flow.start[e]
    changes.spring[k] = spring
    changes.state[k] = flow.regimes[e, spring]
    changes.used[0] = k + 1


@kernel(inline=True)
def sample(
    problem: Shooting, work: ShootingWork, e: int, omega: float, row: int, springs: Springs,
    table: Table,
) -> None:  # fmt: skip
    """Row of the table from segment e."""
    flow = work.flow
    n = table.x.shape[1]
    segment_state(problem.machine, flow, e, omega, table.t[row] - flow.start[e], flow.z, work.rate)
    for k in range(n):
        table.x[row, k] = flow.z[k]
        table.v[row, k] = flow.z[n + k]
        table.a[row, k] = work.rate[n + k]
    for j in range(springs.place.shape[0]):
        table.force[row, springs.place[j]] = stop_force(problem.machine, flow, e, j, flow.z)
    for b in range(springs.always.shape[0]):
        H = 0.0
        for k in range(n):
            H += springs.direction[b, k] * springs.stiffness[b] * flow.z[k]
            H += springs.direction[b, k] * springs.damping[b] * flow.z[n + k]
        table.force[row, springs.always[b]] = H
    for j in range(table.force.shape[1]):
        table.peak[row, j] = max(table.peak[row, j], abs(table.force[row, j]))


@kernel
def add_peaks(
    machine: MachineArrays, flow: Flow, e: int, omega: float, first: int, row: int,
    springs: Springs, table: Table,
) -> None:  # fmt: skip
    """Greatest forces over segment e, in which rows from ``first`` to ``row`` - 1 lie."""
    motion, count = flow.motion, 0
    for j in range(springs.place.shape[0]):
        if kind(machine.stops, j, flow.regimes[e, j]) == 0:
            continue
        if count == 0:
            count = segment_motion(machine, flow, e, omega, machine.direction, motion)
        set_force(machine, flow, motion, count, e, j)
        add_peak(flow, e, motion, count, j, first, row, springs.place[j], table)
    motion = springs.motion
    if springs.always.shape[0] > 0:
        count = segment_motion(machine, flow, e, omega, springs.direction, motion)
    for b in range(springs.always.shape[0]):
        press(motion, count, b, 0.0, springs.stiffness[b], springs.damping[b])
        add_peak(flow, e, motion, count, b, first, row, springs.always[b], table)


@kernel(inline=True)
def add_peak(
    flow: Flow, e: int, motion: GapMotion, count: int, j: int, first: int, row: int, place: int,
    table: Table,
) -> None:  # fmt: skip
    """Greatest sizes of the force that row j of the sums is, into a column of the table.

    What comes before the first row of all is nobody's.
    """
    begin = 0.0
    for r in range(first, min(row, table.t.shape[0] - 1) + 1):
        end = flow.length[e]
        if r < row:
            end = min(max(table.t[r] - flow.start[e], 0.0), end)
        if end > begin and r > 0:
            prepare_search(motion, count)
            low, high, _, _ = extremes(motion, count, j, end - begin)
            table.peak[r, place] = max(table.peak[r, place], high, -low)
        begin_later(motion, count, j, end - begin)
        begin = end


@kernel
def add_work(problem: Shooting, work: ShootingWork, e: int, omega: float, budget: Budget) -> None:
    """Integrals of the powers over segment e, by Gauss panels."""
    machine, flow = problem.machine, work.flow
    modes, n = flow.modes, machine.direction.shape[1]
    fastest = omega
    slot = flow.slot[e]
    for i in range(modes.mode_count[slot]):
        fastest = max(fastest, abs(modes.rate[slot, i]))
    panels = 1 + int(fastest * flow.length[e] / PANEL)
    half = 0.5 * flow.length[e] / panels
    for p in range(panels):
        for q in range(budget.node.shape[0]):
            elapsed = half * (2 * p + 1 + budget.node[q])
            share = half * budget.weight[q]
            segment_state(problem.machine, flow, e, omega, elapsed, flow.z, work.rate)
            for f in range(machine.power.shape[0]):
                angle = machine.order[machine.wave[f]] * omega * (flow.start[e] + elapsed)
                scale = share * omega ** machine.power[f]
                for k in range(n):
                    push = budget.vector[f, k].real * math.cos(angle)
                    push -= budget.vector[f, k].imag * math.sin(angle)
                    budget.work[0] += scale * push * flow.z[n + k]
            for k in range(n):
                v = flow.z[n + k]
                budget.work[0] += share * budget.static[k] * v
                for c in range(n):
                    budget.work[1] += share * v * budget.damping[k, c] * flow.z[n + c]
                    budget.work[1] += share * v * budget.circulation[k, c] * flow.z[c]
            for j in range(flow.regime.shape[0]):
                rate = 0.0
                for k in range(n):
                    rate += machine.direction[j, k] * flow.z[n + k]
                budget.work[2] += share * rate * stop_force(machine, flow, e, j, flow.z)
