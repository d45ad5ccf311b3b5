r"""Harmonic balance with the contact force sampled at fixed times: alternating frequency-time.

The contact law is the smooth one, with s = sharpness and v = y',

    G = [c v + k (y - e+)] (1 + tanh(s (y - e+))) / 2
      + [c v + k (y + e-)] (1 - tanh(s (y + e-))) / 2,

sampled at theta_n = 2 pi n / N, so that its harmonics are sums,

    Lambda_h = share_h sum_n G_n exp(-i h theta_n),    share_0 = 1 / N, else 2 / N.

Kept to reproduce what others do. Where a step of the samples is longer than the layer of about
1 / s in which the law switches on, Lambda jumps by 2 c v / N whenever a sample crosses a gap; the
derivative, though exact, does not see that jump.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from flipflow.compiled.compile import kernel
from flipflow.dynamics.plan import Complex, Int, Real
from flipflow.periodic.balance import (
    prepare_receptance,
    series_scale,
    write_block,
    write_residual,
)
from flipflow.periodic.series import Balance, amplitude_of, series_depths, set_series


class Sampled(NamedTuple):
    """The problem: a balance whose forces come from N samples; unknowns as the balance has them."""

    balance: Balance
    turn: Complex  # (N,) exp(i theta_n)
    stiffness: Complex  # (m, 2 H + 1) sum dG/dy exp(i q theta_n), q = 0 ... 2 H
    damping: Complex  # (m, 2 H + 1) sum dG/dv exp(i q theta_n)
    beyond: Int  # (m,) how often the samples pass a gap in a turn
    sharpness: float  # s in 1/m


@kernel(inline=True)
def switched(
    y: float, v: float, gap: float, k: float, c: float, s: float
) -> tuple[float, float, float]:
    """One side of G, with y and v taken towards the stop: force, dG/dy, dG/dv."""
    if math.isinf(gap):
        return 0.0, 0.0, 0.0
    bend = math.tanh(s * (y - gap))
    share = 0.5 * (1.0 + bend)
    pushed = c * v + k * (y - gap)
    return share * pushed, share * k + 0.5 * s * (1.0 - bend * bend) * pushed, share * c


@kernel
def sampled_forces(problem: Sampled, omega: float) -> None:
    """Lambda_h, its derivative in omega at fixed A, and the sums the Jacobian needs."""
    balance = problem.balance
    kinds = balance.harmonics.shape[0]
    for j in range(balance.linear.shape[0]):
        for q in range(problem.stiffness.shape[1]):
            problem.stiffness[j, q] = 0.0
            problem.damping[j, q] = 0.0
        for a in range(kinds):
            balance.force[a, j] = 0.0
            balance.force_slope[a, j] = 0.0
        problem.beyond[j] = 0
        before = 0
        for n in range(problem.turn.shape[0]):
            side = _add_sample(problem, omega, j, n)
            if n > 0 and side != before:
                problem.beyond[j] += 1
            before = side
        for a in range(kinds):
            share = _share(problem, a)
            balance.force[a, j] *= share
            balance.force_slope[a, j] *= share


@kernel(inline=True)
def _share(problem: Sampled, a: int) -> float:
    return (1.0 if problem.balance.harmonics[a] == 0 else 2.0) / problem.turn.shape[0]


@kernel(inline=True)
def _add_sample(problem: Sampled, omega: float, j: int, n: int) -> int:
    """Add sample n at gap j to all sums; the side of the stop beyond whose gap it lies, or 0."""
    balance = problem.balance
    plan = balance.plan
    kinds, samples = balance.harmonics.shape[0], problem.turn.shape[0]
    y, slope = 0.0, 0.0
    for a in range(kinds):
        h = balance.harmonics[a]
        term = amplitude_of(balance, a, j) * problem.turn[(h * n) % samples]
        y += term.real
        slope -= h * term.imag
    v = omega * slope
    k, c, s = plan.stiffness[j], plan.damping[j], problem.sharpness
    plus, plus_y, plus_v = switched(y, v, plan.gap_plus[j], k, c, s)
    minus, minus_y, minus_v = switched(-y, -v, plan.gap_minus[j], k, c, s)
    force, by_y, by_v = plus - minus, plus_y + minus_y, plus_v + minus_v
    for a in range(kinds):
        back = problem.turn[(balance.harmonics[a] * n) % samples].conjugate()
        balance.force[a, j] += force * back
        balance.force_slope[a, j] += by_v * slope * back
    for q in range(problem.stiffness.shape[1]):
        turn = problem.turn[(q * n) % samples]
        problem.stiffness[j, q] += by_y * turn
        problem.damping[j, q] += by_v * turn
    if y > plan.gap_plus[j]:
        return 1
    return -1 if -y > plan.gap_minus[j] else 0


@kernel(inline=True)
def _sum(sums: Complex, j: int, q: int) -> complex:
    """The sum of any sign of q."""
    return sums[j, q] if q >= 0 else sums[j, -q].conjugate()


@kernel
def sampled_residual(problem: Sampled, u: Real, omega: float, r: Real, J: Real) -> int:
    """r_h = A_h + G_h Lambda_h - delta_h1 A_linear and J = [dr/du, dr/d omega], all real."""
    set_series(problem.balance, u)
    prepare_receptance(problem.balance, omega)
    sampled_forces(problem, omega)
    _jacobian(problem, omega, J)
    return write_residual(problem.balance, r, J)


@kernel
def _jacobian(problem: Sampled, omega: float, J: Real) -> None:
    """dr = c1 dA + c2 conj(dA), with dy = Re dA exp(i l theta), dv = omega Re i l dA exp(...)."""
    balance = problem.balance
    m = balance.linear.shape[0]
    for a in range(balance.harmonics.shape[0]):
        h = balance.harmonics[a]
        half = 0.5 * _share(problem, a)
        for b in range(balance.harmonics.shape[0]):
            k = balance.harmonics[b]
            rate = 1j * (k * omega)
            for c in range(m):
                direct = half * (
                    _sum(problem.stiffness, c, k - h) + rate * _sum(problem.damping, c, k - h)
                )
                mirror = half * (
                    _sum(problem.stiffness, c, -k - h) - rate * _sum(problem.damping, c, -k - h)
                )
                for j in range(m):
                    G = balance.receptance[a, j, c]
                    unit = 1.0 if a == b and j == c else 0.0
                    write_block(balance, a, j, b, c, G * direct, G * mirror, unit, J)


@kernel
def passages(problem: Sampled) -> int:
    """A number that changes when the samples begin or cease to pass a gap."""
    total = 0
    for j in range(problem.beyond.shape[0]):
        total += problem.beyond[j] + 1000 * j * problem.beyond[j]
    return total


@kernel
def sampled_depths(problem: Sampled, omega: float, depth: Real) -> None:
    """Greatest depth in m beyond each gap, (m, 2), as the series itself has it."""
    series_depths(problem.balance, omega, depth)


@kernel
def sampled_scale(problem: Sampled, u: Real, omega: float, scale: Real) -> None:
    """Size of each unknown: the largest amplitude of all."""
    series_scale(problem.balance, u, omega, scale)
