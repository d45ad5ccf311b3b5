r"""A motion in closed form, piece by piece: its states, and the greatest length of a vector.

The vector has two parts, each a sum of exponentials: of a motion x

.. math:: (c_0 x + c_1 \dot x + c_2 \ddot x + b + \mathrm{Re}\, A e^{i \omega t},\;
    \mathrm{Re}\, B e^{i \omega t}),

the second part of which stands for a direction in which the machine is linear.
"""

from __future__ import annotations

import math

from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.compile import kernel
from flipflow.dynamics.contact_search import (
    GapMotion,
    exponential,
    exponentials,
    gap_state,
    mean_frequency,
)

PER_RADIAN = 4.0  # samples of a vector's length per radian of its mean frequency
REFINEMENTS = 40  # steps towards a summit; six are usual
NEAR = 0.9  # share of the greatest half square below which a sample has no higher summit beside it
CLOSE = 1e-6  # share of the distance of two samples; the length itself is then right to its square


@kernel(entry=True)
def evaluate_pieces(
    start: Real, offset: Real, drift: Real, amplitude: Complex, rate: Complex, harmonic: Complex,
    order: Real, omega: float, t: Real, piece: Int, states: Real,
) -> None:  # fmt: skip
    """x, x' and x'' into states (3, K, N) at times t (K,) taken from pieces (K,)."""
    for k in range(t.shape[0]):
        e = piece[k]
        since = t[k] - start[e]
        for n in range(offset.shape[1]):
            states[0, k, n] = offset[e, n] + drift[e, n] * since
            states[1, k, n] = drift[e, n]
            states[2, k, n] = 0.0
        for h in range(order.shape[0]):
            turning = 1j * (order[h] * omega)
            factor = exponential(turning * t[k])
            for n in range(offset.shape[1]):
                add_term(states, k, n, harmonic[e, n, h] * factor, turning)
        for r in range(rate.shape[1]):
            factor = exponential(rate[e, r] * since)
            for n in range(offset.shape[1]):
                add_term(states, k, n, amplitude[e, n, r] * factor, rate[e, r])


@kernel(inline=True)
def add_term(states: Real, k: int, n: int, term: complex, rate: complex) -> None:
    """Add the real part of a term and of its two derivatives."""
    velocity = term * rate
    states[0, k, n] += term.real
    states[1, k, n] += velocity.real
    states[2, k, n] += (velocity * rate).real


@kernel
def longest(motion: GapMotion, count: int, duration: float) -> tuple[float, float]:
    """Greatest length of the vector over [0, duration], and when.

    All samples count, and the summits beside the highest.
    """
    samples = 4 + int(PER_RADIAN * mean_frequency(motion, count, 0, 2, 0.0) * duration)
    best, at, before, rate_before = 0.0, 0.0, 0.0, 0.0
    for k in range(samples + 1):
        t = duration * k / samples
        value, rate = length_at(motion, count, t)
        if rate_before > 0.0 and rate < 0.0 and max(value, before) > NEAR * best:
            top, when = summit(motion, count, t - duration / samples, t, rate_before, rate)
            best, at = (top, when) if top > best else (best, at)
        best, at = (value, t) if value > best else (best, at)
        before, rate_before = value, rate
    return math.sqrt(2.0 * best), at


@kernel
def length_at(motion: GapMotion, count: int, t: float) -> tuple[float, float]:
    """Half the square of the vector's length at a time, and its rate."""
    exponentials(motion, count, t)
    along, along_rate = gap_state(motion, count, 0)
    across, across_rate = gap_state(motion, count, 1)
    half_square = 0.5 * (along * along + across * across)
    return half_square, along * along_rate + across * across_rate


@kernel
def summit(
    motion: GapMotion, count: int, a: float, b: float, rate_a: float, rate_b: float
) -> tuple[float, float]:
    """The half square where its rate is zero between two times, by false position (Illinois).

    The time comes after it, by a last step of the same.
    """
    value, begin, end, width = 0.0, a, b, b - a
    for _ in range(REFINEMENTS):
        t = (a * rate_b - b * rate_a) / (rate_b - rate_a)
        value, rate = length_at(motion, count, t)
        if rate == 0.0 or abs(b - a) < CLOSE * width:
            break
        if rate * rate_b < 0.0:
            a, rate_a = b, rate_b
        else:
            rate_a *= 0.5
        if abs(t - b) < CLOSE * width:
            break
        b, rate_b = t, rate
    closer = (t * rate_b - b * rate) / (rate_b - rate) if rate != rate_b else t
    return value, min(max(closer, begin), end)


@kernel(entry=True)
def longest_in_pieces(
    start: Real, length: Real, offset: Real, drift: Real, amplitude: Complex, rate: Complex,
    harmonic: Complex, order: Real, omega: float, linear: Real, constant: Real, along: complex,
    across: complex, motion: GapMotion,
) -> float:  # fmt: skip
    """Greatest length over all pieces; linear (E, 3, N) are c_0, c_1, c_2, constant (E,) is b."""
    modes, harmonics, degrees = rate.shape[1], order.shape[0], offset.shape[1]
    largest = 0.0
    for e in range(start.shape[0]):
        motion.offset[0], motion.drift[0] = constant[e], 0.0
        motion.offset[1], motion.drift[1] = 0.0, 0.0
        for n in range(degrees):
            motion.offset[0] += linear[e, 0, n] * offset[e, n] + linear[e, 1, n] * drift[e, n]
            motion.drift[0] += linear[e, 0, n] * drift[e, n]
        for i in range(modes):
            total = weighted(linear[e], amplitude[e], i, rate[e, i])
            set_term(motion, i, rate[e, i], total, 0j)
        for h in range(harmonics):
            turning = 1j * (order[h] * omega)
            total = weighted(linear[e], harmonic[e], h, turning)
            set_term(motion, modes + h, turning, total * exponential(turning * start[e]), 0j)
        turn = exponential(1j * (omega * start[e]))
        set_term(motion, modes + harmonics, 1j * omega, along * turn, across * turn)
        length_here, _ = longest(motion, modes + harmonics + 1, length[e])
        largest = max(largest, length_here)
    return largest


@kernel
def weighted(linear: Real, shape: Complex, i: int, rate: complex) -> complex:
    """c_0 + rate c_1 + rate^2 c_2, times column i of shapes (N, R)."""
    total = 0j
    for n in range(shape.shape[0]):
        total += (linear[0, n] + rate * (linear[1, n] + rate * linear[2, n])) * shape[n, i]
    return total


@kernel(inline=True)
def set_term(motion: GapMotion, i: int, rate: complex, along: complex, across: complex) -> None:
    """One exponential of both parts."""
    motion.rate[i] = rate
    motion.amplitude[0, i], motion.amplitude[1, i] = along, across
