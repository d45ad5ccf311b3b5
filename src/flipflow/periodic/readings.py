"""Extremes, harmonics and return maps of periodic motions, point by point along a branch."""

from __future__ import annotations

import math

from flipflow.compiled import status
from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.compile import kernel
from flipflow.compiled.dense import lu_factor, lu_solve
from flipflow.dynamics.contact_search import (
    GapMotion,
    exponential,
    extremes,
    first_harmonic,
    prepare_search,
)
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import Flow, run_flow, segment_motion, segment_state
from flipflow.periodic.balance import (
    contact_forces,
    contact_free_harmonic,
    prepare_receptance,
)
from flipflow.periodic.sampled import Sampled, SampledWork, sampled_forces
from flipflow.periodic.series import (
    Balance,
    BalanceWork,
    contact_integrals,
    record_contacts,
    set_series,
)
from flipflow.periodic.shooting import Shooting, ShootingWork, shoot

ROUNDING = 1e-9  # a Newton step below this share of the motion is rounding of the flow


@kernel(entry=True)
def observe_flow(
    problem: Shooting,
    work: ShootingWork,
    states: Real,
    omega: Real,
    waiting: int,
    coordinate: Real,
    motion: GapMotion,
    low: Real,
    high: Real,
    first: Complex,
    code: Int,
) -> None:
    """Extremes and first harmonic of coordinates (G, N) over the turn from each state (P, 2 N).

    ``waiting`` turns pass first; the state after them replaces the one given. ``motion`` is
    scratch for G coordinates; low, high, first are (P, G), code (P,). The record of the last
    turn stays in the problem's flow.
    """
    flow = work.flow
    for p in range(omega.shape[0]):
        turn = problem.fraction * 2.0 * math.pi / omega[p]
        code[p] = _turn_after(problem, work, states[p], omega[p], turn, waiting)
        if code[p] != status.OK:
            continue
        observe_record(
            problem.machine, flow, omega[p], turn, coordinate, motion, low[p], high[p], first[p]
        )


@kernel
def observe_record(
    machine: MachineArrays,
    flow: Flow,
    omega: float,
    turn: float,
    coordinate: Real,
    motion: GapMotion,
    low: Real,
    high: Real,
    first: Complex,
) -> None:
    """Extremes and first harmonic, (G,) each, of coordinates (G, N) over a recorded turn."""
    for g in range(coordinate.shape[0]):
        low[g], high[g], first[g] = math.inf, -math.inf, 0.0
    for e in range(flow.segments[0]):
        count = segment_motion(machine, flow, e, omega, coordinate, motion)
        prepare_search(motion, count)
        for g in range(coordinate.shape[0]):
            smallest, largest, _, _ = extremes(motion, count, g, flow.length[e])
            low[g], high[g] = min(low[g], smallest), max(high[g], largest)
            share = first_harmonic(motion, count, g, flow.start[e], flow.length[e], omega)
            first[g] += 2.0 * share / turn


@kernel(inline=True)
def _turn_after(
    problem: Shooting, work: ShootingWork, z: Real, omega: float, turn: float, waiting: int
) -> int:
    """Record a turn after ``waiting`` turns from z, which becomes the state at its start."""
    flow = work.flow
    for k in range(flow.z.shape[0]):
        flow.z[k] = z[k]
    for _ in range(waiting):
        code = run_flow(problem.machine, flow, omega, 0.0, turn, work.rate)
        if code != status.OK:
            return code
    for k in range(flow.z.shape[0]):
        z[k] = flow.z[k]
    return run_flow(problem.machine, flow, omega, 0.0, turn, work.rate)


@kernel(entry=True)
def observe_series(
    motion: GapMotion, offset: Real, amplitude: Complex, low: Real, high: Real
) -> None:
    """Extremes over a turn of series with means (P, G) and amplitudes (P, G, n_h)."""
    count = motion.rate.shape[0]
    for p in range(offset.shape[0]):
        for g in range(offset.shape[1]):
            motion.offset[0] = offset[p, g]
            for i in range(count):
                motion.amplitude[0, i] = amplitude[p, g, i]
            prepare_search(motion, count)
            low[p, g], high[p, g], _, _ = extremes(motion, count, 0, 2.0 * math.pi)


@kernel(entry=True)
def describe_balance(
    problem: Balance, work: BalanceWork, u: Real, omega: Real, series: Complex, code: Int
) -> None:
    """Displacement harmonics (P, n_h, N) of points; the last one's contacts stay recorded."""
    for p in range(omega.shape[0]):
        set_series(problem, work, u[p])
        code[p] = prepare_receptance(problem, work, omega[p])
        if code[p] == status.OK:
            code[p] = record_contacts(problem, work, omega[p])
        if code[p] != status.OK:
            continue
        contact_integrals(problem, work, omega[p])
        contact_forces(problem, work, omega[p])
        _displacements(problem, work, omega[p], series[p])


@kernel(entry=True)
def describe_sampled(
    problem: Sampled, work: SampledWork, u: Real, omega: Real, series: Complex
) -> None:
    """Displacement harmonics (P, n_h, N) of points under the sampled force."""
    for p in range(omega.shape[0]):
        set_series(problem.balance, work.balance, u[p])
        prepare_receptance(problem.balance, work.balance, omega[p])
        sampled_forces(problem, work, omega[p])
        _displacements(problem.balance, work.balance, omega[p], series[p])


@kernel(inline=True)
def _displacements(problem: Balance, work: BalanceWork, omega: float, series: Complex) -> None:
    """X_h = X_h without contact - (K - h^2 omega^2 M + i h omega C)^-1 D^T Lambda_h by modes."""
    modes = work.flow.modes
    n = series.shape[1]
    for a in range(problem.harmonics.shape[0]):
        h = problem.harmonics[a]
        for k in range(n):
            series[a, k] = contact_free_harmonic(problem, work, h, k)
        for i in range(modes.mode_count[0]):
            push = 0j
            push_conj = 0j
            for j in range(work.linear.shape[1]):
                push += modes.gap_pick[0, i, j] * work.force[a, j]
                push_conj += modes.gap_pick[0, i, j].conjugate() * work.force[a, j]
            push /= 1j * h * omega - modes.rate[0, i]
            push_conj /= 1j * h * omega - modes.rate[0, i].conjugate()
            for k in range(n):
                series[a, k] -= modes.right[0, k, i] * push
                if modes.weight[0, i] == 2.0:
                    series[a, k] -= modes.right[0, k, i].conjugate() * push_conj


@kernel(entry=True)
def corrected(
    problem: Shooting,
    work: ShootingWork,
    states: Real,
    omega: Real,
    harmonics: Int,
    series: Complex,
    A: Real,
    pivot: Int,
    delta: Real,
    maps: Real,
    error: Real,
    code: Int,
) -> None:
    """Return maps of motions, and their distances in m from the exact ones, by a Newton step.

    delta = (I - M)^-1 (flow(z) - z) corrects the state (P, 2 N) in place. The map (P, 2 N, 2 N),
    with the problem's sign, is the one at the corrected state. The distance is the largest
    difference of any displacement between the corrected flow and the series (P, n_h, N); without
    harmonics it is that of the states. Where a second step does not shrink, as next to a fold,
    the distance is infinite and the map the one at the state given; NaN where the flow fails.
    """
    for p in range(omega.shape[0]):
        code[p], first, last = _correct_state(
            problem, work, states[p], omega[p], A, pivot, delta, maps[p]
        )
        error[p] = first + last
        if harmonics.shape[0] > 0 and math.isfinite(error[p]):
            error[p] = _distance(problem, work, omega[p], harmonics, series[p], last)


@kernel(inline=True)
def _correct_state(
    problem: Shooting, work: ShootingWork, z: Real, omega: float, A: Real, pivot: Int, delta: Real,
    out: Real,
) -> tuple[int, float, float]:  # fmt: skip
    """Correct z by a Newton step longer than rounding: status, its length, the next step's."""
    size = delta.shape[0]
    n = size // 2
    for k in range(size):
        for c in range(size):
            out[k, c] = math.nan
    code, first = _newton_step(problem, work, z, omega, A, pivot, delta)
    if code != status.OK:
        return code, math.inf, math.inf
    _store_map(problem, work, out)
    # Steps within the rounding of the flow do not shrink; relative to the motion they are nothing.
    size_of_motion = 0.0
    for k in range(n):
        size_of_motion = max(size_of_motion, abs(z[k]), abs(z[n + k]) / omega)
    rounding = ROUNDING * size_of_motion
    if first <= rounding:
        return code, 0.0, first
    if not math.isfinite(first):
        return code, math.inf, math.inf
    for k in range(size):
        z[k] += delta[k]
    code, last = _newton_step(problem, work, z, omega, A, pivot, delta)
    if code != status.OK:
        return code, first, math.inf
    if not last <= max(0.5 * first, rounding):
        return code, first, math.inf
    _store_map(problem, work, out)
    return code, first, last


@kernel(inline=True)
def _store_map(problem: Shooting, work: ShootingWork, out: Real) -> None:
    """The return map that was carried last."""
    for k in range(out.shape[0]):
        for c in range(out.shape[0]):
            out[k, c] = problem.sign * work.map[k, c]


@kernel(inline=True)
def _newton_step(
    problem: Shooting, work: ShootingWork, z: Real, omega: float, A: Real, pivot: Int, delta: Real
) -> tuple[int, float]:
    """delta = (I - M)^-1 (flow(z) - z); its largest displacement, infinite when I - M is singular.

    The map M stays in work.map, without the problem's sign.
    """
    size = A.shape[0]
    n = size // 2
    code = shoot(problem, work, z, omega, work.map)
    if code != status.OK:
        return code, math.inf
    for i in range(size):
        delta[i] = problem.sign * work.flow.z[i] - z[i]
        for j in range(size):
            A[i, j] = -problem.sign * work.map[i, j]
        A[i, i] += 1.0
    if not lu_factor(A, pivot):
        return code, math.inf
    lu_solve(A, pivot, delta)
    length = 0.0
    for k in range(n):
        length = max(length, abs(delta[k]), abs(delta[n + k]) / omega)
    return code, length


@kernel(inline=True)
def _distance(
    problem: Shooting,
    work: ShootingWork,
    omega: float,
    harmonics: Int,
    series: Complex,
    rest: float,
) -> float:
    """Largest |x_flow - x_series| over samples of the recorded flow, plus the last correction."""
    flow = work.flow
    n = flow.z.shape[0] // 2
    turn = problem.fraction * 2.0 * math.pi / omega
    largest = 0.0
    for e in range(flow.segments[0]):
        samples = 2 + int(128.0 * flow.length[e] / turn)
        for s in range(samples):
            elapsed = flow.length[e] * s / samples
            segment_state(problem.machine, flow, e, omega, elapsed, flow.z, work.rate)
            for k in range(n):
                value = flow.z[k]
                for a in range(harmonics.shape[0]):
                    angle = 1j * (harmonics[a] * omega * (flow.start[e] + elapsed))
                    value -= (series[a, k] * exponential(angle)).real
                largest = max(largest, abs(value))
    return largest + rest
