"""How the tangent map of a recorded flow moves with the machine's parameters, and its contacts.

The map is a product of exponentials over the segments and of saltations between them. Its
derivative is theirs, one by one, the lengths of the segments among what changes: a change of
contact, where a switching function h falls to zero, moves by dt = -(h_z z_p + h_p) / h'.
"""

from __future__ import annotations

from flipflow.compiled.arrays import Int, Real
from flipflow.compiled.compile import kernel
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import Flow, saltation, segment_state
from flipflow.dynamics.law import exit_between, signed_gap
from flipflow.dynamics.parameter_tangent import (
    Columns,
    ColumnWork,
    advance_columns,
    carry_freely,
    kick_columns,
    mode_gains,
    moved_against_gap,
    side_of_change,
    spread_free,
)

APART = 1e-7  # distance of two multipliers, as a share of the largest, below which they are one


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


@kernel
def _vary_map(
    machine: MachineArrays,
    flow: Flow,
    e: int,
    omega: float,
    columns: Columns,
    longer: Real,
    before: Real,
    T: Real,
    slopes: Real,
    work: ColumnWork,
) -> None:
    """Carry T and its derivatives over segment e, whose ``divided_differences`` are known.

    ``longer`` and ``before`` tell how its end and its start move.
    """
    size = T.shape[0]
    for p in range(slopes.shape[0]):
        carry_freely(slopes[p], work)
    for c in range(size):
        _vary_column(machine, flow, e, omega, columns, c, T, slopes, work)
    for p in range(slopes.shape[0]):
        more = longer[p] - before[p]
        for k in range(size):
            for c in range(size):
                slopes[p, k, c] += more * work.slope[k, c]
    carry_freely(T, work)


@kernel
def _vary_column(
    machine: MachineArrays,
    flow: Flow,
    e: int,
    omega: float,
    columns: Columns,
    c: int,
    T: Real,
    slopes: Real,
    work: ColumnWork,
) -> None:
    """What the parameters bring into column c of the map, and its rate at the segment's end."""
    modes, slot, size = flow.modes, flow.slot[e], T.shape[0]
    count = modes.mode_count[slot]
    for i in range(count):
        work.amplitude[i] = 0j
        for k in range(size):
            work.amplitude[i] += modes.left[slot, i, k] * T[k, c]
    spread_free(flow, slot, work.amplitude, work)
    mode_gains(machine, flow, e, omega, columns, 0.0, work)
    for k in range(size):
        work.slope[k, c] = 0.0
    for i in range(count):
        weight = modes.weight[slot, i]
        after = weight * modes.rate[slot, i] * work.factor[i] * work.amplitude[i]
        for k in range(size):
            work.slope[k, c] += (modes.right[slot, k, i] * after).real
        for p in range(columns.static.shape[0]):
            gain = weight * work.gain[i, p]
            for k in range(size):
                slopes[p, k, c] += (modes.right[slot, k, i] * gain).real


@kernel
def _kick_map(
    machine: MachineArrays, flow: Flow, e: int, columns: Columns, T: Real, slopes: Real
) -> None:
    """Saltation S of the map at the end of segment e: S T_p + S_p T, and S T."""
    j, sign, size = flow.spring[e], flow.kick[e], T.shape[0]
    n, c = size // 2, machine.stops.damping[j]
    for p in range(slopes.shape[0]):
        saltation(machine, j, sign, slopes[p], size)
    for p in range(columns.static.shape[0]):
        if columns.touches[p, 5] == 0 and columns.touches[p, 0] == 0:
            continue
        for column in range(size):
            gap, turned = 0.0, 0.0
            for k in range(n):
                gap += machine.direction[j, k] * T[k, column]
                turned += columns.direction[p, j, k] * T[k, column]
            for k in range(n):
                reach = columns.reach[p, j, k]
                for s in range(n):
                    reach -= columns.inertia[p, k, s] * machine.reach[j, s]
                slope = columns.stop_damping[p, j] * machine.reach[j, k] + c * reach
                slopes[p, n + k, column] += sign * (slope * gap + c * machine.reach[j, k] * turned)
    saltation(machine, j, sign, T, size)


@kernel(entry=True)
def carry_variation(
    machine: MachineArrays,
    flow: Flow,
    omega: float,
    columns: Columns,
    U: Real,
    starts: Real,
    shift: Real,
    T: Real,
    slopes: Real,
    work: ColumnWork,
) -> None:
    """Carry columns, the tangent map and the map's derivatives over the recorded flow.

    U (2 N, P + 1) holds the derivatives of the state at its start, omega last, at fixed time;
    ``starts`` (E, 2 N, P + 1) keeps them at the start of each segment, and ``shift`` (E + 1, P + 1)
    how the segments' limits move in time. T (2 N, 2 N) is the map, I at first, and ``slopes``
    (P + 1, 2 N, 2 N) its derivatives, 0 at first; with P + 1 = 0 of them T stays as it is.
    """
    parameters = columns.static.shape[0]
    for p in range(parameters):
        shift[0, p] = 0.0
    shift[0, parameters] = -flow.start[0] / omega
    for e in range(flow.segments[0]):
        length = flow.length[e]
        for k in range(U.shape[0]):
            for p in range(U.shape[1]):
                starts[e, k, p] = U[k, p]
        advance_columns(machine, flow, e, omega, columns, length, U, work)
        segment_state(machine, flow, e, omega, length, work.z, work.rate)
        set_shifts(machine, flow, e, omega, columns, U, shift[e + 1], work)
        if slopes.shape[0] > 0:
            _vary_map(machine, flow, e, omega, columns, shift[e + 1], shift[e], T, slopes, work)
        if flow.kick[e] != 0.0:
            kick_columns(machine, flow, e, columns, 1.0, U, work)
            if slopes.shape[0] > 0:
                _kick_map(machine, flow, e, columns, T, slopes)


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
