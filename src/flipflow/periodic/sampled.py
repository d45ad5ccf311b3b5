r"""Harmonic balance with the contact force sampled at fixed times: alternating frequency-time.

The contact law is the smooth one, with s = sharpness and v = y',

    G = [c v + k (y - e+)] (1 + tanh(s (y - e+))) / 2
      + [c v + k (y + e-)] (1 - tanh(s (y + e-))) / 2,

sampled at theta_n = 2 pi n / N, so that its harmonics are sums,

    Lambda_h = share_h sum_n G_n exp(-i h theta_n),    share_0 = 1 / N, else 2 / N.

This method is kept to reproduce what others do. Where the motion between two samples is longer than
the layer of about 1 / s in which the law switches on, Lambda jumps by 2 c v / N whenever a sample
crosses a gap; the derivative, though exact, does not see that jump.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flipflow.compiled import status
from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.periodic.balance import (
    prepare_receptance,
    series_scale,
    write_block,
    write_residual,
)
from flipflow.periodic.series import Balance, BalanceWork, amplitude_of, series_depths, set_series


class Sampled(NamedTuple):
    """The problem: a balance whose forces come from N samples; unknowns as the balance has them."""

    balance: Balance
    turn: Complex  # (N,) exp(i theta_n)
    sharpness: float  # s in 1/m


@by_reference
class SampledWork(NamedTuple):
    """Scratch of the problem."""

    balance: BalanceWork
    stiffness: Complex  # (m, 2 H + 1) sum dG/dy exp(i q theta_n), q = 0 ... 2 H
    damping: Complex  # (m, 2 H + 1) sum dG/dv exp(i q theta_n)
    beyond: Int  # (m,) how often the samples pass a gap in a turn


def new_sampled(balance: Balance, samples: int, sharpness: float) -> Sampled:
    """The problem of a balance with the smooth law sampled at fixed times."""
    return Sampled(balance, np.exp(2j * np.pi * np.arange(samples) / samples), float(sharpness))


def new_sampled_work(balance: BalanceWork) -> SampledWork:
    """Scratch around that of the balance."""
    m, most = balance.integral.shape
    return SampledWork(
        balance=balance,
        stiffness=np.zeros((m, most), np.complex128),
        damping=np.zeros((m, most), np.complex128),
        beyond=np.zeros(m, np.int64),
    )


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
def sampled_forces(problem: Sampled, work: SampledWork, omega: float) -> None:
    """Lambda_h, its derivative in omega at fixed A, and the sums the Jacobian needs."""
    balance, scratch = problem.balance, work.balance
    kinds = balance.harmonics.shape[0]
    for j in range(scratch.linear.shape[1]):
        for q in range(work.stiffness.shape[1]):
            work.stiffness[j, q] = 0.0
            work.damping[j, q] = 0.0
        for a in range(kinds):
            scratch.force[a, j] = 0.0
            scratch.force_slope[a, j] = 0.0
        work.beyond[j] = 0
        before = 0
        for n in range(problem.turn.shape[0]):
            side = _add_sample(problem, work, omega, j, n)
            if n > 0 and side != before:
                work.beyond[j] += 1
            before = side
        for a in range(kinds):
            share = _share(problem, a)
            scratch.force[a, j] *= share
            scratch.force_slope[a, j] *= share


@kernel(inline=True)
def _share(problem: Sampled, a: int) -> float:
    return (1.0 if problem.balance.harmonics[a] == 0 else 2.0) / problem.turn.shape[0]


@kernel(inline=True)
def _add_sample(problem: Sampled, work: SampledWork, omega: float, j: int, n: int) -> int:
    """Add sample n at gap j to all sums; the side of the stop beyond whose gap it lies, or 0."""
    balance, scratch = problem.balance, work.balance
    stops = balance.machine.stops
    kinds, samples = balance.harmonics.shape[0], problem.turn.shape[0]
    y, slope = 0.0, 0.0
    for a in range(kinds):
        h = balance.harmonics[a]
        term = amplitude_of(balance, scratch, a, j) * problem.turn[(h * n) % samples]
        y += term.real
        slope -= h * term.imag
    v = omega * slope
    k, c, s = stops.stiffness[j], stops.damping[j], problem.sharpness
    plus, plus_y, plus_v = switched(y, v, stops.gap[j, 0], k, c, s)
    minus, minus_y, minus_v = switched(-y, -v, stops.gap[j, 1], k, c, s)
    force, by_y, by_v = plus - minus, plus_y + minus_y, plus_v + minus_v
    for a in range(kinds):
        back = problem.turn[(balance.harmonics[a] * n) % samples].conjugate()
        scratch.force[a, j] += force * back
        scratch.force_slope[a, j] += by_v * slope * back
    for q in range(work.stiffness.shape[1]):
        turn = problem.turn[(q * n) % samples]
        work.stiffness[j, q] += by_y * turn
        work.damping[j, q] += by_v * turn
    if y > stops.gap[j, 0]:
        return 1
    return -1 if -y > stops.gap[j, 1] else 0


@kernel(inline=True)
def _sum(sums: Complex, j: int, q: int) -> complex:
    """The sum for q of either sign."""
    return sums[j, q] if q >= 0 else sums[j, -q].conjugate()


@kernel
def sampled_residual(
    problem: Sampled, work: SampledWork, u: Real, omega: float, r: Real, J: Real
) -> int:
    """r_h = A_h + G_h Lambda_h - A_linear,h and J = [dr/du, dr/d omega], all real."""
    set_series(problem.balance, work.balance, u)
    if not omega > 0.0:
        return status.NO_CONVERGENCE
    code = prepare_receptance(problem.balance, work.balance, omega)
    if code != status.OK:
        return code
    sampled_forces(problem, work, omega)
    _jacobian(problem, work, omega, J)
    return write_residual(problem.balance, work.balance, r, J)


@kernel
def _jacobian(problem: Sampled, work: SampledWork, omega: float, J: Real) -> None:
    """dr = c1 dA + c2 conj(dA), with dy = Re dA exp(i l theta), dv = omega Re i l dA exp(...)."""
    balance, scratch = problem.balance, work.balance
    m = scratch.linear.shape[1]
    for a in range(balance.harmonics.shape[0]):
        h = balance.harmonics[a]
        half = 0.5 * _share(problem, a)
        for b in range(balance.harmonics.shape[0]):
            k = balance.harmonics[b]
            rate = 1j * (k * omega)
            for c in range(m):
                direct = half * (
                    _sum(work.stiffness, c, k - h) + rate * _sum(work.damping, c, k - h)
                )
                mirror = half * (
                    _sum(work.stiffness, c, -k - h) - rate * _sum(work.damping, c, -k - h)
                )
                for j in range(m):
                    G = scratch.receptance[a, j, c]
                    unit = 1.0 if a == b and j == c else 0.0
                    write_block(balance, a, j, b, c, G * direct, G * mirror, unit, J)


@kernel
def passages(problem: Sampled, work: SampledWork) -> int:  # noqa: ARG001
    """A number that changes when the samples begin or cease to pass a gap."""
    total = 0
    for j in range(work.beyond.shape[0]):
        total += work.beyond[j] * (1 + 1_000 * j * (1 + 1_000 * j))
    return total


@kernel
def sampled_depths(problem: Sampled, work: SampledWork, omega: float, depth: Real) -> None:
    """Greatest depth in m beyond each gap, (m, 2), as the series itself has it."""
    series_depths(problem.balance, work.balance, omega, depth)


@kernel
def sampled_scale(problem: Sampled, u: Real, omega: float, scale: Real) -> None:
    """Size of each unknown: the largest amplitude of all."""
    series_scale(problem.balance, u, omega, scale)
