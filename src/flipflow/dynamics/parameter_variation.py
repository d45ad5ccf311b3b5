"""How the contacts of a recorded flow move with the machine's parameters.

A change of contact, where a switching function h falls to zero, moves in time by
dt = -(h_z z_p + h_p) / h'.
"""

from __future__ import annotations

from flipflow.compiled.arrays import Int, Real
from flipflow.compiled.compile import kernel
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import Flow, end_segment
from flipflow.dynamics.law import exit_between, signed_gap
from flipflow.dynamics.parameter_tangent import (
    Columns,
    ColumnWork,
    add_begin,
    advance_columns,
    carry_starts,
    kick_columns,
    moved_against_gap,
    side_of_change,
)


@kernel
def set_shifts(
    machine: MachineArrays,
    flow: Flow,
    e: int,
    omega: float,
    columns: Columns,
    U: Real,
    shift: Real,
    work: ColumnWork,
) -> None:
    """How the end of segment e moves in time, (P + 1,); the state there is in work.z.

    The flow's own end stands at a phase of the force and moves with omega alone.
    """
    j, n, parameters = flow.spring[e], U.shape[0] // 2, columns.static.shape[0]
    if j < 0:
        for p in range(parameters):
            shift[p] = 0.0
        shift[parameters] = -(flow.start[e] + flow.length[e]) / omega
        return
    side, stops = side_of_change(flow, e), machine.stops
    before, after = flow.regimes[e, j], flow.regimes[e + 1, j]
    alpha, beta, alpha_k, beta_c = exit_between(stops, j, before, after)
    depth, rate, bend = -signed_gap(stops, j, side), 0.0, 0.0
    for k in range(n):
        depth += machine.direction[j, k] * work.z[k]
        rate += machine.direction[j, k] * work.rate[k]
        bend += machine.direction[j, k] * work.rate[n + k]
    for p in range(parameters + 1):
        moved, moved_rate = moved_against_gap(machine, columns, j, side, U, p, work)
        change = alpha * moved + beta * moved_rate
        if p < parameters:
            change += alpha_k * columns.stop_stiffness[p, j] * depth
            change += beta_c * columns.stop_damping[p, j] * rate
        shift[p] = -change / (alpha * rate + beta * bend)


@kernel(inline=True)
def set_ended(
    machine: MachineArrays, flow: Flow, e: int, omega: float, columns: Columns, starts: Real,
    ended: Real, work: ColumnWork,
) -> None:  # fmt: skip
    """Columns at the end of segment e, before a change of contact there; the state into work.z."""
    for k in range(ended.shape[0]):
        for p in range(ended.shape[1]):
            ended[k, p] = starts[e + 1, k, p]
    end_segment(machine, flow, e, omega, work.z, work.rate)
    if flow.kick[e] != 0.0:
        kick_columns(machine, flow, e, columns, -1.0, ended, work)


@kernel
def set_limits(
    machine: MachineArrays, flow: Flow, omega: float, columns: Columns, starts: Real, ended: Real,
    shift: Real, work: ColumnWork,
) -> None:  # fmt: skip
    """How the limits of all segments move in time, (E + 1, P + 1)."""
    parameters = columns.static.shape[0]
    for p in range(parameters):
        shift[0, p] = 0.0
    shift[0, parameters] = -flow.start[0] / omega
    for e in range(flow.segments[0]):
        set_ended(machine, flow, e, omega, columns, starts, ended, work)
        set_shifts(machine, flow, e, omega, columns, ended, shift[e + 1], work)


@kernel(entry=True)
def slopes_along(
    machine: MachineArrays, flow: Flow, omega: float, columns: Columns, state: Real, starts: Real,
    tangents: Real, ended: Real, shift: Real, work: ColumnWork,
) -> None:  # fmt: skip
    """Columns and tangent maps of a recorded flow, and how its limits move.

    It begins with columns ``state`` (2 N, P + 1), omega last, all at fixed time. ``starts``
    (E + 1, 2 N, P + 1) and ``tangents`` (E + 1, 2 N, 2 N) are those at the starts of its segments
    and at its end, ``shift`` (E + 1, P + 1) are the shifts of these in time; ``ended`` is scratch.
    """
    carry_starts(machine, flow, omega, columns, starts, tangents, work)
    add_begin(flow.segments[0], state, tangents, starts)
    set_limits(machine, flow, omega, columns, starts, ended, shift, work)


@kernel(entry=True)
def columns_at(
    machine: MachineArrays,
    flow: Flow,
    omega: float,
    columns: Columns,
    starts: Real,
    t: Real,
    piece: Int,
    out: Real,
    work: ColumnWork,
) -> None:
    """Derivatives of the state (K, 2 N, P + 1) at times t (K,) in given segments (K,)."""
    for s in range(t.shape[0]):
        e = piece[s]
        for k in range(out.shape[1]):
            for p in range(out.shape[2]):
                out[s, k, p] = starts[e, k, p]
        elapsed = t[s] - flow.start[e]
        advance_columns(machine, flow, e, omega, columns, elapsed, out[s], work)
