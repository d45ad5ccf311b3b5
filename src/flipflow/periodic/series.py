"""A truncated series at the gaps: its contacts within a turn, and the integrals over them.

The limits of contact are found by the certified search, as for a flow, and the integrals over the
contacts are closed forms.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flipflow.compiled import status
from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.dynamics.contact_search import (
    GapMotion,
    exponential,
    exponentials,
    extremes,
    gap_state,
    new_gap_motion,
    next_change,
    prepare_search,
)
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import Flow, contact_number, new_flow
from flipflow.dynamics.law import (
    Stops,
    damping_share,
    kind,
    regime_at,
    signed_gap,
    tangent_kick,
)

NO_SPRING = -1  # no change of contact began the segment


class Balance(NamedTuple):
    """The problem: n_h harmonics at m gaps; unknowns as :func:`place` orders them."""

    machine: MachineArrays
    harmonics: Int  # (n_h,) 0 first when there is a mean, equally spaced otherwise
    walk: float  # angle over which contacts are sought: pi where the second half mirrors the first
    length: float  # length in m below which amplitudes count as small


@by_reference
class BalanceWork(NamedTuple):
    """Scratch of the problem, and what the series last set left."""

    flow: Flow  # record of the contacts in a turn, and the open machine's modes and drive
    stops: Stops  # those of the machine, with damping c omega: the series runs over theta
    motion: GapMotion  # the series itself
    receptance: Complex  # (n_h, m, m) G_h
    receptance_slope: Complex  # (n_h, m, m) dG_h / d omega
    linear: Complex  # (n_h, m) A_linear, of the motion without contact
    linear_slope: Complex  # (n_h, m)
    integral: Complex  # (m, 2 H + 1) int exp(i k theta) over the contacts, k = 0 ... 2 H
    integral_gap: Complex  # (m, 2 H + 1) the same times the signed gap
    edge: Complex  # (m, 4 H + 1) sum +-exp(i k theta) at clipped limits, k = -2 H ... 2 H
    edge_depth: Complex  # (m, 2 H + 1) sum +-p exp(-i k theta) there, k = 0 ... 2 H
    force: Complex  # (n_h, m) Lambda_h
    force_slope: Complex  # (n_h, m) its derivative in omega at fixed A


def new_balance(
    machine: MachineArrays, harmonics: int, *, half_turn: bool, length: float
) -> Balance:
    """The harmonic-balance problem; a mirror-symmetric motion has odd harmonics only."""
    kept = np.arange(1, harmonics + 1, 2) if half_turn else np.arange(harmonics + 1)
    return Balance(machine, kept.astype(np.int64), np.pi if half_turn else 2.0 * np.pi, length)


def new_balance_work(problem: Balance) -> BalanceWork:
    """Scratch for a harmonic-balance problem."""
    kept, stops = problem.harmonics, problem.machine.stops
    m, most = problem.machine.direction.shape[0], 2 * int(kept[-1]) + 1
    rates = 1j * kept[kept > 0].astype(np.complex128)
    spacing = 2 if kept[0] == 1 else 1
    return BalanceWork(
        flow=new_flow(problem.machine)._replace(motion=new_gap_motion(m, rates, spacing)),
        stops=stops._replace(damping=np.zeros(m)),
        motion=new_gap_motion(m, rates, spacing),
        receptance=np.zeros((kept.size, m, m), np.complex128),
        receptance_slope=np.zeros((kept.size, m, m), np.complex128),
        linear=np.zeros((kept.size, m), np.complex128),
        linear_slope=np.zeros((kept.size, m), np.complex128),
        integral=np.zeros((m, most), np.complex128),
        integral_gap=np.zeros((m, most), np.complex128),
        edge=np.zeros((m, 2 * most - 1), np.complex128),
        edge_depth=np.zeros((m, most), np.complex128),
        force=np.zeros((kept.size, m), np.complex128),
        force_slope=np.zeros((kept.size, m), np.complex128),
    )


@kernel(inline=True)
def place(problem: Balance, a: int, j: int) -> int:
    """Where the real part of harmonic a at gap j stands; the imaginary part follows it."""
    m = problem.machine.direction.shape[0]
    if problem.harmonics[0] != 0:
        return 2 * (a * m + j)
    return j if a == 0 else m + 2 * ((a - 1) * m + j)


@kernel(inline=True)
def set_series(problem: Balance, work: BalanceWork, u: Real) -> None:
    """The unknowns as offsets and amplitudes at the gaps."""
    m = work.linear.shape[1]
    mean = 1 if problem.harmonics[0] == 0 else 0
    for j in range(m):
        work.motion.offset[j] = u[j] if mean == 1 else 0.0
        for a in range(mean, problem.harmonics.shape[0]):
            k = place(problem, a, j)
            work.motion.amplitude[j, a - mean] = complex(u[k], u[k + 1])


@kernel(inline=True)
def amplitude_of(problem: Balance, work: BalanceWork, a: int, j: int) -> complex:
    """A_hj of the series last set."""
    if problem.harmonics[0] != 0:
        return work.motion.amplitude[j, a]
    return work.motion.offset[j] + 0j if a == 0 else work.motion.amplitude[j, a - 1]


@kernel(inline=True)
def set_series_regimes(work: BalanceWork) -> None:
    """Regime of each spring at theta = 0."""
    count = work.motion.rate.shape[0]
    exponentials(work.motion, count, 0.0)
    for j in range(work.linear.shape[1]):
        y, v = gap_state(work.motion, count, j)
        work.flow.regime[j] = regime_at(work.stops, j, y, v)


@kernel(inline=True)
def record_contacts(problem: Balance, work: BalanceWork, omega: float) -> int:
    """Walk along the series and record who touches when, as a flow does (times in s)."""
    flow = work.flow
    for j in range(work.linear.shape[1]):
        work.stops.damping[j] = problem.machine.stops.damping[j] * omega
    set_series_regimes(work)
    rest = problem.walk
    theta = 0.0
    fired = NO_SPRING
    for e in range(flow.start.shape[0]):
        flow.segments[0] = e + 1
        flow.start[e] = theta / omega
        for j in range(flow.regime.shape[0]):
            flow.regimes[e, j] = flow.regime[j]
        length, spring, new = next_change_from(work, theta, rest, fired)
        if math.isnan(length):
            return status.SEARCH_NOT_ENDED
        flow.length[e] = length / omega
        flow.spring[e] = spring
        flow.kick[e] = 0.0
        if spring < 0:
            return status.OK
        flow.kick[e] = tangent_kick(work.stops, spring, flow.regime[spring], new)
        flow.regime[spring] = new
        fired = spring
        theta += length
        rest -= length
    return status.TOO_MANY_EVENTS


@kernel(inline=True)
def next_change_from(
    work: BalanceWork, theta: float, horizon: float, fired: int
) -> tuple[float, int, int]:
    """The next change of contact after theta: the series is turned to start there."""
    motion = work.motion
    turned = work.flow.motion
    count = motion.rate.shape[0]
    exponentials(motion, count, theta)
    for j in range(motion.offset.shape[0]):
        turned.offset[j] = motion.offset[j]
        for i in range(count):
            turned.amplitude[j, i] = motion.amplitude[j, i] * motion.factor[i]
    return next_change(turned, work.stops, work.flow.regime, count, horizon, fired)


@kernel(inline=True)
def contact_integrals(problem: Balance, work: BalanceWork, omega: float) -> None:
    """int exp(i k theta) over the contacts, and the boundary terms of clipped limits.

    Half a turn of a mirror-symmetric series is enough. The mirrored contact half a turn later has
    the same integral times (-1)^k, and the gap and depth of opposite sign. Odd harmonics use the
    integrals of even k, and those of odd k only times a gap or depth: each of them doubles.
    """
    flow = work.flow
    m, most = work.integral.shape
    for j in range(m):
        for k in range(most):
            work.integral[j, k] = 0.0
            work.integral_gap[j, k] = 0.0
            work.edge_depth[j, k] = 0.0
        for k in range(2 * most - 1):
            work.edge[j, k] = 0.0
    for e in range(flow.segments[0]):
        first = flow.start[e] * omega
        last = first + flow.length[e] * omega
        for j in range(m):
            if kind(work.stops, j, flow.regimes[e, j]) != 0:
                gap = signed_gap(work.stops, j, flow.regimes[e, j])
                _add_interval(problem, work, j, first, last, gap)
        if flow.spring[e] >= 0 and flow.kick[e] == 0.0:
            _add_clipped_limit(problem, work, e, last)


@kernel(inline=True)
def _add_clipped_limit(problem: Balance, work: BalanceWork, e: int, theta: float) -> None:
    """The end of piece e, where a clipped spring lets go or takes hold beyond its gap."""
    flow = work.flow
    spring = flow.spring[e]
    before, after = flow.regimes[e, spring], flow.regimes[e + 1, spring]
    if before * after == 0:
        return
    share = damping_share(work.stops, spring, before) - damping_share(work.stops, spring, after)
    if share != 0.0:
        _add_edge(problem, work, spring, theta, share, before)


@kernel(inline=True)
def _add_interval(
    problem: Balance, work: BalanceWork, j: int, first: float, last: float, gap: float
) -> None:
    turns = 2.0 * math.pi / problem.walk
    start, start_turn = turns + 0j, exponential(1j * first)
    end, end_turn = turns + 0j, exponential(1j * last)
    work.integral[j, 0] += turns * (last - first)
    work.integral_gap[j, 0] += turns * gap * (last - first)
    for k in range(1, work.integral.shape[1]):
        start *= start_turn
        end *= end_turn
        value = (end - start) * (-1j / k)
        work.integral[j, k] += value
        work.integral_gap[j, k] += gap * value


@kernel(inline=True)
def _add_edge(
    problem: Balance, work: BalanceWork, j: int, theta: float, sign: float, regime: int
) -> None:
    """A limit of contact beyond the gap: +1 where a clipped spring lets go, -1 where it holds."""
    most = work.integral.shape[1]
    count = work.motion.rate.shape[0]
    exponentials(work.motion, count, theta)
    y, _ = gap_state(work.motion, count, j)
    depth = y - signed_gap(work.stops, j, regime)
    sign *= 2.0 * math.pi / problem.walk
    for k in range(-(most - 1), most):
        turn = sign * exponential(1j * (k * theta))
        work.edge[j, k + most - 1] += turn
        if k <= 0:
            work.edge_depth[j, -k] += depth * turn


@kernel(inline=True)
def whole_integral(work: BalanceWork, j: int, k: int) -> complex:
    """int exp(i k theta) over the contacts of gap j, any sign of k."""
    return work.integral[j, k] if k >= 0 else work.integral[j, -k].conjugate()


@kernel(inline=True)
def contact_count(problem: Balance, work: BalanceWork) -> int:
    """A number that changes when the contacts met in a turn change."""
    return contact_number(work.flow, problem.walk > math.pi)


@kernel(inline=True)
def series_depths(problem: Balance, work: BalanceWork, omega: float, depth: Real) -> None:  # noqa: ARG001
    """Greatest depth in m of the series last set beyond each gap, (m, 2): plus and minus side."""
    motion = work.motion
    count = motion.rate.shape[0]
    prepare_search(motion, count)
    for j in range(depth.shape[0]):
        low, high, _, _ = extremes(motion, count, j, 2.0 * math.pi)
        depth[j, 0] = high - problem.machine.stops.gap[j, 0]
        depth[j, 1] = -low - problem.machine.stops.gap[j, 1]
