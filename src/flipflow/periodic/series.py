"""A truncated series at the gaps: when it is in contact within a turn, and what that leaves.

The limits of contact are found by the certified search, as for a flow, and the integrals over the
contacts are closed forms.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from flipflow.compiled import status
from flipflow.compiled.compile import kernel
from flipflow.dynamics.contact_search import (
    GapMotion,
    exponential,
    exponentials,
    extremes,
    gap_state,
    next_change,
    prepare_search,
)
from flipflow.dynamics.flow import Flow, configuration, contact_number, contact_state, kick_sign
from flipflow.dynamics.plan import Complex, Int, Plan, Real

NO_SPRING = -1


class Balance(NamedTuple):
    """The problem: n_h harmonics at m gaps; unknowns as :func:`place` orders them."""

    plan: Plan
    flow: Flow  # record of the contacts in a turn; its contact damping is c omega
    motion: GapMotion  # the series itself
    harmonics: Int  # (n_h,) 0 first when there is a mean, equally spaced otherwise
    receptance: Complex  # (n_h, m, m) G_h
    receptance_slope: Complex  # (n_h, m, m) dG_h / d omega
    linear: Complex  # (m,) A_linear
    linear_slope: Complex  # (m,)
    integral: Complex  # (m, 2 H + 1) int exp(i k theta) over the contacts, k = 0 ... 2 H
    integral_gap: Complex  # (m, 2 H + 1) the same times the signed gap
    edge: Complex  # (m, 4 H + 1) sum +-exp(i k theta) at clipped limits, k = -2 H ... 2 H
    edge_depth: Complex  # (m, 2 H + 1) sum +-p exp(-i k theta) there, k = 0 ... 2 H
    force: Complex  # (n_h, m) Lambda_h
    force_slope: Complex  # (n_h, m) its derivative in omega at fixed A
    walk: float  # angle over which contacts are sought: pi where the second half mirrors the first
    length: float


@kernel(inline=True)
def place(problem: Balance, a: int, j: int) -> int:
    """Where the real part of harmonic a at gap j stands; the imaginary part follows it."""
    m = problem.linear.shape[0]
    if problem.harmonics[0] != 0:
        return 2 * (a * m + j)
    return j if a == 0 else m + 2 * ((a - 1) * m + j)


@kernel(inline=True)
def set_series(problem: Balance, u: Real) -> None:
    """The unknowns as offsets and amplitudes at the gaps."""
    m = problem.linear.shape[0]
    mean = 1 if problem.harmonics[0] == 0 else 0
    for j in range(m):
        problem.motion.offset[j] = u[j] if mean == 1 else 0.0
        for a in range(mean, problem.harmonics.shape[0]):
            k = place(problem, a, j)
            problem.motion.amplitude[j, a - mean] = complex(u[k], u[k + 1])


@kernel(inline=True)
def amplitude_of(problem: Balance, a: int, j: int) -> complex:
    """A_hj of the series last set."""
    if problem.harmonics[0] != 0:
        return problem.motion.amplitude[j, a]
    return problem.motion.offset[j] + 0j if a == 0 else problem.motion.amplitude[j, a - 1]


@kernel(inline=True)
def series_contact_state(problem: Balance) -> None:
    """Contact state of each spring at theta = 0."""
    count = problem.motion.rate.shape[0]
    exponentials(problem.motion, count, 0.0)
    for j in range(problem.linear.shape[0]):
        y, v = gap_state(problem.motion, count, j)
        problem.flow.state[j] = contact_state(problem.flow.contact, j, y, v)


@kernel(inline=True)
def record_contacts(problem: Balance, omega: float) -> int:
    """Walk along the series and record who touches when, as a flow does (times in s)."""
    flow = problem.flow
    for j in range(problem.linear.shape[0]):
        flow.contact.damping[j] = problem.plan.damping[j] * omega
    series_contact_state(problem)
    rest = problem.walk
    theta = 0.0
    fired = NO_SPRING
    for e in range(flow.start.shape[0]):
        slot = problem.plan.slot[configuration(flow.state)]
        flow.segments[0] = e + 1
        if slot < 0:
            return status.MISSING_CONFIGURATION
        flow.slot[e] = slot
        flow.start[e] = theta / omega
        for j in range(flow.state.shape[0]):
            flow.states[e, j] = flow.state[j]
        length, spring, new = next_change_from(problem, theta, rest, fired)
        if math.isnan(length):
            return status.SEARCH_NOT_ENDED
        flow.length[e] = length / omega
        flow.spring[e] = spring
        flow.kick[e] = 0.0
        if spring < 0:
            return status.OK
        flow.kick[e] = kick_sign(flow.state[spring], new)
        flow.state[spring] = new
        fired = spring
        theta += length
        rest -= length
    return status.TOO_MANY_EVENTS


@kernel(inline=True)
def next_change_from(
    problem: Balance, theta: float, horizon: float, fired: int
) -> tuple[float, int, int]:
    """The next change of contact after theta: the series is turned to start there."""
    motion = problem.motion
    turned = problem.flow.motion
    count = motion.rate.shape[0]
    exponentials(motion, count, theta)
    for j in range(motion.offset.shape[0]):
        turned.offset[j] = motion.offset[j]
        for i in range(count):
            turned.amplitude[j, i] = motion.amplitude[j, i] * motion.factor[i]
    return next_change(turned, problem.flow.contact, problem.flow.state, count, horizon, fired)


@kernel(inline=True)
def contact_integrals(problem: Balance, omega: float) -> None:
    """int exp(i k theta) over the contacts, and what clipped limits leave.

    The mirrored contact half a turn later has the same integral times (-1)^k and the opposite gap.
    Odd harmonics ask for even k, and for odd k where a gap or depth is a factor: all double.
    """
    flow = problem.flow
    m, most = problem.integral.shape
    for j in range(m):
        for k in range(most):
            problem.integral[j, k] = 0.0
            problem.integral_gap[j, k] = 0.0
            problem.edge_depth[j, k] = 0.0
        for k in range(2 * most - 1):
            problem.edge[j, k] = 0.0
    for e in range(flow.segments[0]):
        first = flow.start[e] * omega
        last = first + flow.length[e] * omega
        for j in range(m):
            if abs(flow.states[e, j]) == 1:
                gap = flow.contact.gap_plus[j]
                if flow.states[e, j] < 0:
                    gap = -flow.contact.gap_minus[j]
                _add_interval(problem, j, first, last, gap)
        if flow.spring[e] >= 0 and flow.kick[e] == 0.0:
            _add_clipped_limit(problem, e, last)


@kernel(inline=True)
def _add_clipped_limit(problem: Balance, e: int, theta: float) -> None:
    """The end of piece e, where a clipped spring lets go or takes hold beyond its gap."""
    flow = problem.flow
    spring = flow.spring[e]
    before, after = flow.states[e, spring], flow.states[e + 1, spring]
    if abs(before) == 1 and abs(after) == 2:
        _add_edge(problem, spring, theta, 1.0, before)
    elif abs(before) == 2 and abs(after) == 1:
        _add_edge(problem, spring, theta, -1.0, after)


@kernel(inline=True)
def _add_interval(problem: Balance, j: int, first: float, last: float, gap: float) -> None:
    turns = 2.0 * math.pi / problem.walk
    start, start_turn = turns + 0j, exponential(1j * first)
    end, end_turn = turns + 0j, exponential(1j * last)
    problem.integral[j, 0] += turns * (last - first)
    problem.integral_gap[j, 0] += turns * gap * (last - first)
    for k in range(1, problem.integral.shape[1]):
        start *= start_turn
        end *= end_turn
        value = (end - start) * (-1j / k)
        problem.integral[j, k] += value
        problem.integral_gap[j, k] += gap * value


@kernel(inline=True)
def _add_edge(problem: Balance, j: int, theta: float, sign: float, side: int) -> None:
    """A limit of contact beyond the gap: +1 where a clipped spring lets go, -1 where it holds."""
    most = problem.integral.shape[1]
    count = problem.motion.rate.shape[0]
    exponentials(problem.motion, count, theta)
    y, _ = gap_state(problem.motion, count, j)
    contact = problem.flow.contact
    depth = y - contact.gap_plus[j] if side > 0 else y + contact.gap_minus[j]
    sign *= 2.0 * math.pi / problem.walk
    for k in range(-(most - 1), most):
        turn = sign * exponential(1j * (k * theta))
        problem.edge[j, k + most - 1] += turn
        if k <= 0:
            problem.edge_depth[j, -k] += depth * turn


@kernel(inline=True)
def whole_integral(problem: Balance, j: int, k: int) -> complex:
    """int exp(i k theta) over the contacts of gap j, any sign of k."""
    return problem.integral[j, k] if k >= 0 else problem.integral[j, -k].conjugate()


@kernel(inline=True)
def contact_count(problem: Balance) -> int:
    """A number that changes when the contacts met in a turn change."""
    return contact_number(problem.flow)


@kernel(inline=True)
def series_depths(problem: Balance, omega: float, depth: Real) -> None:  # noqa: ARG001
    """Greatest depth in m of the series last set beyond each gap, (m, 2): plus and minus side."""
    motion = problem.motion
    count = motion.rate.shape[0]
    prepare_search(motion, count)
    for j in range(depth.shape[0]):
        low, high = extremes(motion, count, j, 2.0 * math.pi)
        depth[j, 0] = high - problem.plan.gap_plus[j]
        depth[j, 1] = -low - problem.plan.gap_minus[j]
