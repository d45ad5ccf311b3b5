"""Motion at the gaps as a sum of exponentials, and the certified search for the next contact.

Both a free flight of the exact flow and a truncated Fourier series are, at gap j,

    y_j(t) = offset_j + Re sum_i amplitude_ji exp(rate_i t),

so one search serves both. With a bound |y''| <= B on all that is still to come, a switching
function of value h > 0 and slope h' cannot vanish before the positive root of
h + h' s - B s^2 / 2. Stepping to that root again and again converges to the first zero and can
never jump over one, nor over two close together.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flipflow.kernels.compile import kernel
from flipflow.kernels.plan import Complex, Int, Real

OPEN, PLUS, MINUS, RELEASED_PLUS, RELEASED_MINUS = 0, 1, -1, 2, -2
NOTHING = -9
MAX_SEARCH = 20_000
AT_GAP = 4e-16
SMALLEST_STEP = 1e-11


class GapMotion(NamedTuple):
    """Sum of exponentials at m gaps; the scratch in which a segment or series is written."""

    offset: Real  # (m,)
    amplitude: Complex  # (m, r)
    rate: Complex  # (r,)
    factor: Complex  # (r,) exp(rate t), filled by ``exponentials``
    spacing: Int  # (1,) 0: any rates; s > 0: rates are i (r_0, r_0 + s, r_0 + 2 s, ...)


class Contact(NamedTuple):
    """The law of each spring, as the search needs it."""

    gap_plus: Real
    gap_minus: Real
    stiffness: Real
    damping: Real
    clipped: Int


@kernel
def exponential(x: complex) -> complex:
    """exp(x) without the special cases of infinite arguments."""
    size = math.exp(x.real)
    return complex(size * math.cos(x.imag), size * math.sin(x.imag))


@kernel
def exponentials(motion: GapMotion, count: int, t: float) -> None:
    """factor_i = exp(rate_i t), by powers where the rates are equally spaced."""
    if motion.spacing[0] > 0:
        motion.factor[0] = exponential(motion.rate[0] * t)
        ratio = exponential(1j * motion.spacing[0] * t)
        for i in range(1, count):
            motion.factor[i] = motion.factor[i - 1] * ratio
    else:
        for i in range(count):
            motion.factor[i] = exponential(motion.rate[i] * t)


@kernel
def gap_state(motion: GapMotion, count: int, j: int) -> tuple[float, float, float]:
    """y, y' and a bound on |y''| from now on, at the time of the last ``exponentials``."""
    y = motion.offset[j]
    rate_of_y = 0.0
    bound = 0.0
    for i in range(count):
        term = motion.amplitude[j, i] * motion.factor[i]
        slope = term * motion.rate[i]
        y += term.real
        rate_of_y += slope.real
        bound += abs(slope) * abs(motion.rate[i])
    return y, rate_of_y, bound


@kernel
def push_state(
    motion: GapMotion, contact: Contact, count: int, j: int, gap: float
) -> tuple[float, float, float]:
    """The unclipped force k (y - gap) + c y', its rate, and a bound on its second derivative."""
    k, c = contact.stiffness[j], contact.damping[j]
    force = k * (motion.offset[j] - gap)
    slope = 0.0
    bound = 0.0
    for i in range(count):
        term = motion.amplitude[j, i] * motion.factor[i] * (k + c * motion.rate[i])
        force += term.real
        term *= motion.rate[i]
        slope += term.real
        bound += abs(term) * abs(motion.rate[i])
    return force, slope, bound


@kernel
def first_root_bound(h: float, slope: float, bound: float) -> float:
    """No zero of h comes before this time: the positive root of h + slope s - bound s^2 / 2."""
    if bound <= 0.0:
        return -h / slope if slope < 0.0 else math.inf
    root = math.sqrt(slope * slope + 2.0 * bound * max(h, 0.0))
    if slope >= 0.0:
        return (slope + root) / bound
    return 2.0 * max(h, 0.0) / (root - slope)


@kernel
def next_change(
    motion: GapMotion,
    contact: Contact,
    state: NDArray[np.int64],
    count: int,
    horizon: float,
    fired: int,
) -> tuple[float, int, int]:
    """Time of the next change of contact, the spring, and its new state.

    ``fired`` names the spring whose change began this segment (-1: none): its switching function
    stands at zero there and its sign is known, so rounding must not fire it again. Returns
    (horizon, -1, 0) when nothing happens before, and a time of NaN when the search does not end.
    """
    t = 0.0
    m = state.shape[0]
    for _ in range(MAX_SEARCH):
        exponentials(motion, count, t)
        step = math.inf
        for j in range(m):
            y, v, bound = gap_state(motion, count, j)
            scale = abs(y) + abs(motion.offset[j])
            low, new = math.inf, NOTHING
            if state[j] == OPEN:
                if contact.gap_plus[j] < math.inf:
                    low, new = _approach(contact.gap_plus[j] - y, -v, bound, scale, PLUS)
                if contact.gap_minus[j] < math.inf:
                    other, side = _approach(y + contact.gap_minus[j], v, bound, scale, MINUS)
                    if side != NOTHING or (new == NOTHING and other < low):
                        low, new = other, side
            else:
                side = 1.0 if state[j] > 0 else -1.0
                gap = contact.gap_plus[j] if side > 0 else -contact.gap_minus[j]
                if abs(state[j]) == 2 or contact.clipped[j] == 0:
                    low, new = _approach(side * (y - gap), side * v, bound, scale, OPEN)
                if contact.clipped[j] == 1:
                    force, slope, push_bound = push_state(motion, contact, count, j, gap)
                    sign = side if abs(state[j]) == 1 else -side
                    target = 2 * state[j] if abs(state[j]) == 1 else state[j] // 2
                    push_scale = contact.stiffness[j] * scale + contact.damping[j] * abs(v)
                    other, change = _approach(
                        sign * force, sign * slope, push_bound, push_scale, target
                    )
                    if change != NOTHING or (new == NOTHING and other < low):
                        low, new = other, change
            if new != NOTHING and not (t == 0.0 and j == fired):
                return t, j, new
            step = min(step, max(low, SMALLEST_STEP * horizon))
        t += step
        if t >= horizon:
            return horizon, -1, 0
    return math.nan, -1, 0


@kernel
def _approach(h: float, slope: float, bound: float, scale: float, target: int) -> tuple[float, int]:
    """Safe step towards the zero of h, and ``target`` once it is there and h still falls."""
    if h <= AT_GAP * scale and slope < 0.0:
        return 0.0, target
    return first_root_bound(h, slope, bound), NOTHING


@kernel
def extremes(motion: GapMotion, count: int, j: int, duration: float) -> tuple[float, float]:
    """Smallest and largest y_j over [0, duration]: its ends and every zero of y' between samples.

    The samples stand half a radian of the fastest mode apart; between two of them a pair of zeros
    could hide only an extreme that differs from a sample by less than the search resolves.
    """
    fastest = 0.0
    for i in range(count):
        fastest = max(fastest, abs(motion.rate[i]))
    samples = min(4 + int(2.0 * fastest * duration), 4000)
    low, high = math.inf, -math.inf
    t_before, v_before = 0.0, 0.0
    for k in range(samples + 1):
        t = duration * k / samples
        exponentials(motion, count, t)
        y, v, _ = gap_state(motion, count, j)
        low, high = min(low, y), max(high, y)
        if k > 0 and v * v_before < 0.0:
            y = _stationary_value(motion, count, j, t_before, t, v_before)
            low, high = min(low, y), max(high, y)
        t_before, v_before = t, v
    return low, high


@kernel
def _stationary_value(
    motion: GapMotion, count: int, j: int, a: float, b: float, v_a: float
) -> float:
    """y where y' = 0 in [a, b]: Newton, kept inside the bracket."""
    t = 0.5 * (a + b)
    y = 0.0
    for _ in range(60):
        exponentials(motion, count, t)
        y, v, _ = gap_state(motion, count, j)
        curvature = 0.0
        for i in range(count):
            term = motion.amplitude[j, i] * motion.factor[i]
            curvature += (term * motion.rate[i] * motion.rate[i]).real
        if v * v_a > 0.0:
            a = t
        else:
            b = t
        new = t - v / curvature if curvature != 0.0 else 0.5 * (a + b)
        if not a < new < b:
            new = 0.5 * (a + b)
        if abs(new - t) < 1e-9 * (abs(t) + b - a):
            break
        t = new
    return y
