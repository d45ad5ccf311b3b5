"""A motion at constant speed as a table over time, with the energies that pass on the way."""

from __future__ import annotations

import math
from typing import NamedTuple

from flipflow.compiled import status
from flipflow.compiled.compile import kernel
from flipflow.dynamics.flow import run_flow, segment_state
from flipflow.dynamics.plan import Complex, Int, Real
from flipflow.periodic.shooting import Shooting

PANEL = 2.0  # radians of the fastest mode in a Gauss panel
SLIVER = 1e-12


class Table(NamedTuple):
    """Samples at K given times, in order."""

    t: Real  # (K,)
    x: Real  # (K, N)
    v: Real  # (K, N)
    a: Real  # (K, N)
    force: Real  # (K, m)


class Changes(NamedTuple):
    """Changes of contact, as many as ``used`` tells."""

    t: Real  # (E,)
    spring: Int  # (E,)
    state: Int  # (E,) the contact state that begins
    used: Int  # (1,)


class Budget(NamedTuple):
    """What the energies are summed from and into."""

    damping: Real  # (N, N) C of the open machine
    vector: Complex  # (N,) the exciting force is Re(vector exp(i omega t)) omega^power
    node: Real  # (Q,) Gauss-Legendre on [-1, 1]
    weight: Real  # (Q,)
    work: Real  # (3,) J: done by the exciter, taken by dampers, taken by stops


@kernel(entry=True)
def sample_motion(
    problem: Shooting,
    omega: float,
    t: float,
    end: float,
    first: int,
    table: Table,
    changes: Changes,
    budget: Budget,
) -> tuple[int, int]:
    """Carry flow.z from time t to ``end``, filling the table from row ``first`` on.

    Returns the status and the first row that lies beyond. Samples at a change of contact show the
    motion just before it.
    """
    plan, flow = problem.plan, problem.flow
    turn = 2.0 * math.pi / omega
    row = first
    while t < end:
        # No sliver is left over by rounding: the last turn takes it.
        duration = turn if end - t > (1.0 + SLIVER) * turn else end - t
        code = run_flow(plan, flow, omega, t, duration, problem.rate)
        if code != status.OK:
            return code, row
        for e in range(flow.segments[0]):
            last = flow.start[e] + flow.length[e]
            if e == flow.segments[0] - 1:
                last = t + duration if t + duration < end else math.inf
            while row < table.t.shape[0] and table.t[row] <= last and table.t[row] <= end:
                sample(problem, e, omega, row, table)
                row += 1
            add_work(problem, e, omega, budget)
            if e > 0:
                note_change(problem, e, changes)
        e = flow.segments[0] - 1
        segment_state(plan, flow, e, omega, flow.length[e], flow.z, problem.rate)
        t += duration
    return status.OK, row


@kernel(inline=True)
def note_change(problem: Shooting, e: int, changes: Changes) -> None:
    """The change of contact with which segment e begins."""
    flow = problem.flow
    k = changes.used[0]
    spring = flow.spring[e - 1]
    changes.t[k] = flow.start[e]
    changes.spring[k] = spring
    changes.state[k] = flow.states[e, spring]
    changes.used[0] = k + 1


@kernel(inline=True)
def sample(problem: Shooting, e: int, omega: float, row: int, table: Table) -> None:
    """Row of the table from segment e."""
    flow = problem.flow
    n = table.x.shape[1]
    segment_state(problem.plan, flow, e, omega, table.t[row] - flow.start[e], flow.z, problem.rate)
    for k in range(n):
        table.x[row, k] = flow.z[k]
        table.v[row, k] = flow.z[n + k]
        table.a[row, k] = problem.rate[n + k]
    for j in range(table.force.shape[1]):
        table.force[row, j] = spring_force(problem, e, j)


@kernel(inline=True)
def spring_force(problem: Shooting, e: int, j: int) -> float:
    """Force of spring j in segment e at flow.z."""
    plan, flow = problem.plan, problem.flow
    if abs(flow.states[e, j]) != 1:
        return 0.0
    n = plan.direction.shape[1]
    y, v = 0.0, 0.0
    for k in range(n):
        y += plan.direction[j, k] * flow.z[k]
        v += plan.direction[j, k] * flow.z[n + k]
    gap = plan.gap_plus[j] if flow.states[e, j] > 0 else -plan.gap_minus[j]
    return plan.stiffness[j] * (y - gap) + plan.damping[j] * v


@kernel
def add_work(problem: Shooting, e: int, omega: float, budget: Budget) -> None:
    """Integrals of the powers over segment e, by Gauss panels."""
    plan, flow = problem.plan, problem.flow
    n = plan.direction.shape[1]
    fastest = omega
    slot = flow.slot[e]
    for i in range(plan.mode_count[slot]):
        fastest = max(fastest, abs(plan.rate[slot, i]))
    panels = 1 + int(fastest * flow.length[e] / PANEL)
    half = 0.5 * flow.length[e] / panels
    scale = omega**plan.power
    for p in range(panels):
        for q in range(budget.node.shape[0]):
            elapsed = half * (2 * p + 1 + budget.node[q])
            share = half * budget.weight[q]
            segment_state(plan, flow, e, omega, elapsed, flow.z, problem.rate)
            angle = omega * (flow.start[e] + elapsed)
            for k in range(n):
                v = flow.z[n + k]
                push = budget.vector[k].real * math.cos(angle)
                push -= budget.vector[k].imag * math.sin(angle)
                budget.work[0] += share * scale * push * v
                for c in range(n):
                    budget.work[1] += share * v * budget.damping[k, c] * flow.z[n + c]
            for j in range(flow.state.shape[0]):
                rate = 0.0
                for k in range(n):
                    rate += plan.direction[j, k] * flow.z[n + k]
                budget.work[2] += share * rate * spring_force(problem, e, j)
