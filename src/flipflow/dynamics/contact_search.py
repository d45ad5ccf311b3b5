"""Motion at the gaps as a sum of exponentials, and the certified search for the next contact.

Both a free flight of the exact flow and a truncated Fourier series are, at gap j,

    y_j(t) = offset_j + drift_j t + Re sum_i amplitude_ji exp(rate_i t),

so one search serves both. Let a switching function have the value h > 0 and the slope h', and let
|h''| <= B hold over the step. The function then cannot vanish before the positive root of
h + h' s - B s^2 / 2. Steps to that root, repeated, converge to the first zero and never jump over
a zero, nor over two that are close together. With a bound B3 on the third derivative, the curvature
over the next S seconds stays above h'' - B3 S. Close to a zero that allows a far smaller B, and the
search converges with third order.

The derivatives are bounded by the sizes of their terms. A term that decays is largest now; one that
grows is largest at the end of the step, which is therefore kept so short that none grows by more
than the factor e.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.dynamics.law import Stops, entered, exit_of, signed_gap
from flipflow.model.contact_law import MOST_EXITS, NO_EXIT, OPEN

NOTHING = -9  # no regime: nothing has changed yet
MAX_SEARCH = 20_000  # steps of one search
USUAL = 60  # steps that most searches stay below
AT_GAP = 4e-16  # a switching function this small, relative to its terms, is zero but for rounding
SHORT = 1e-3  # exponent whose sixth power is nothing beside 1
CLOSE = 3e-5  # share of the distance of two samples from which the parabola's summit is exact
HARDLY = 1e-4  # share of the longest step below which a longer one is sought
MOST_FOURFOLD = 20  # times that it is made four times as long
MOST_DERIVATIVES = 24  # that may vanish
SMALLEST_STEP = 1e-11  # share of the horizon: least step, which bounds their number at grazing


@by_reference
class GapMotion(NamedTuple):
    """Sum of exponentials at m gaps; the scratch in which a segment or series is written."""

    offset: Real  # (m,)
    drift: Real  # (m,) of what nothing holds, under a constant force
    time: Real  # (1,) t of the last ``exponentials``
    amplitude: Complex  # (m, r)
    rate: Complex  # (r,)
    factor: Complex  # (r,) exp(rate t), filled by ``exponentials``
    decay: Real  # (r,) its size
    curve: Complex  # (m, r) amplitude rate^2, filled by ``prepare_search``
    bound: Real  # (m, r) its size
    size: Real  # (r,) |rate|
    noise: Real  # (m, 2) rounding of y and y', filled by ``prepare_search``
    growth: Real  # (r,) greatest exp(Re rate s) within a step, filled by ``longest_step``
    turn: Complex  # (r,) terms of one gap, carried from sample to sample by ``extremes``
    ratio: Complex  # (r,) factors from one sample to the next
    spacing: Int  # (1,) 0: any rates; s > 0: rates are i (r_0, r_0 + s, r_0 + 2 s, ...)


@kernel(inline=True)
def exponential(x: complex) -> complex:
    """exp(x) without the special cases of infinite arguments."""
    size = math.exp(x.real)
    return complex(size * math.cos(x.imag), size * math.sin(x.imag))


@kernel(inline=True)
def modulus(x: complex) -> float:
    """|x| without the care for overflow that makes abs() slow."""
    return math.sqrt(x.real * x.real + x.imag * x.imag)


@kernel(inline=True)
def reciprocal(x: complex) -> complex:
    """1 / x without the care for overflow that makes complex division slow."""
    square = x.real * x.real + x.imag * x.imag
    return complex(x.real / square, -x.imag / square)


@kernel(inline=True)
def prepare_search(motion: GapMotion, count: int) -> None:
    """Fill what the search needs beside the amplitudes."""
    for i in range(count):
        motion.size[i] = modulus(motion.rate[i])
    for j in range(motion.offset.shape[0]):
        place, speed = abs(motion.offset[j]), abs(motion.drift[j])
        for i in range(count):
            motion.curve[j, i] = motion.amplitude[j, i] * motion.rate[i] * motion.rate[i]
            size = modulus(motion.amplitude[j, i])
            place += size
            speed += size * motion.size[i]
            motion.bound[j, i] = size * motion.size[i] * motion.size[i]
        motion.noise[j, 0], motion.noise[j, 1] = AT_GAP * place, AT_GAP * speed


@kernel(inline=True)
def longest_step(motion: GapMotion, count: int, horizon: float) -> float:
    """Longest step of the search; what grows over it is counted into the bounds."""
    fastest = 0.0
    for i in range(count):
        motion.growth[i] = 1.0
        fastest = max(fastest, motion.rate[i].real)
    if fastest * horizon <= 0.0:
        return horizon
    longest = min(horizon, 1.0 / fastest)
    for i in range(count):
        if motion.rate[i].real > 0.0:
            motion.growth[i] = math.exp(motion.rate[i].real * longest)
            for j in range(motion.offset.shape[0]):
                motion.bound[j, i] *= motion.growth[i]
    return longest


@kernel(inline=True)
def exponentials(motion: GapMotion, count: int, t: float) -> None:
    """factor_i = exp(rate_i t) and its size, by powers where the rates are equally spaced."""
    motion.time[0] = t
    if t == 0.0:
        for i in range(count):
            motion.factor[i], motion.decay[i] = 1.0, 1.0
    elif motion.spacing[0] > 0:
        motion.factor[0] = exponential(motion.rate[0] * t)
        motion.decay[0] = 1.0
        ratio = exponential(1j * (motion.spacing[0] * t))
        for i in range(1, count):
            motion.factor[i] = motion.factor[i - 1] * ratio
            motion.decay[i] = 1.0
    else:
        for i in range(count):
            size = math.exp(motion.rate[i].real * t) if motion.rate[i].real != 0.0 else 1.0
            angle = motion.rate[i].imag * t
            motion.factor[i] = complex(size * math.cos(angle), size * math.sin(angle))
            motion.decay[i] = size


@kernel(inline=True)
def gap_state(motion: GapMotion, count: int, j: int) -> tuple[float, float]:
    """y and y' at the time of the last ``exponentials``."""
    v = motion.drift[j]
    y = motion.offset[j] + v * motion.time[0]
    for i in range(count):
        term = motion.amplitude[j, i] * motion.factor[i]
        y += term.real
        v += term.real * motion.rate[i].real - term.imag * motion.rate[i].imag
    return y, v


@kernel(inline=True)
def gap_bounds(motion: GapMotion, count: int, j: int) -> tuple[float, float, float]:
    """y'', and bounds on the second and third derivative over the next step."""
    curvature = 0.0
    second = 0.0
    third = 0.0
    for i in range(count):
        term = motion.curve[j, i] * motion.factor[i]
        curvature += term.real
        share = motion.bound[j, i] * motion.decay[i]
        second += share
        third += share * motion.size[i]
    return curvature, second, third


@kernel(inline=True)
def switching_state(
    motion: GapMotion, count: int, j: int, gap: float, alpha: float, beta: float
) -> tuple[float, float, float, float, float]:
    """alpha (y - gap) + beta y': value, rate, curvature, bounds on second and third derivative."""
    drift = motion.drift[j]
    value = alpha * (motion.offset[j] + drift * motion.time[0] - gap) + beta * drift
    slope = alpha * drift
    curvature = 0.0
    second = 0.0
    third = 0.0
    for i in range(count):
        term = motion.amplitude[j, i] * motion.factor[i] * (alpha + beta * motion.rate[i])
        value += term.real
        term *= motion.rate[i]
        slope += term.real
        term *= motion.rate[i]
        curvature += term.real
        size = modulus(term) * motion.growth[i]
        second += size
        third += size * motion.size[i]
    return value, slope, curvature, second, third


@kernel(inline=True)
def root_of_bound(h: float, slope: float, bound: float) -> float:
    """Least s > 0 with h + slope s - bound s^2 / 2 = 0, infinite where there is none."""
    inside = slope * slope + 2.0 * bound * h
    if inside < 0.0:
        return math.inf
    root = math.sqrt(inside)
    if slope < 0.0:
        return 2.0 * h / (root - slope)
    return (slope + root) / bound if bound > 0.0 else math.inf


@kernel(inline=True)
def safe_step(h: float, slope: float, curvature: float, second: float, third: float) -> float:
    """Time before which h has no zero; second and third bound its derivatives until then."""
    certain = root_of_bound(h, slope, second)
    reach = root_of_bound(h, slope, -curvature)
    if reach > 8.0 * certain:
        reach = 4.0 * certain
    return max(certain, min(reach, root_of_bound(h, slope, third * reach - curvature)))


@kernel(inline=True)
def next_change(
    motion: GapMotion,
    stops: Stops,
    regime: Int,
    count: int,
    horizon: float,
    fired: int,
) -> tuple[float, int, int]:
    """Time of the next change of contact, the spring, and its new regime.

    ``fired`` names the spring whose change began this segment (-1: none): its switching function
    stands at zero there and its sign is known, so rounding must not fire it again. Returns
    (horizon, -1, 0) when nothing happens before, and a time of NaN when the search does not end.
    """
    t = 0.0
    least = SMALLEST_STEP * horizon
    prepare_search(motion, count)
    longest = longest_step(motion, count, horizon)
    for search in range(MAX_SEARCH):
        exponentials(motion, count, t)
        step = longest
        for j in range(regime.shape[0]):
            low, new = spring_change(motion, stops, regime[j], count, j)
            if new != NOTHING:
                if not (t == 0.0 and j == fired):
                    # The last step may have been the smallest: Newton takes back what it overshot.
                    return max(t + max(min(low, least), -least), 0.0), j, new
                # Newton's step is no safe one where a function and its rate vanish together.
                low = least
            if search > USUAL and low < HARDLY * longest:
                low = quiet_time(motion, stops, regime[j], count, j, max(low, least))
            step = min(step, max(low, least))
        t += step
        if t >= horizon:
            return horizon, -1, 0
    return math.nan, -1, 0


@kernel(inline=True)
def spring_change(
    motion: GapMotion, stops: Stops, regime: int, count: int, j: int
) -> tuple[float, int]:
    """Time before which spring j cannot change, or Newton's last step and its new regime."""
    y, v = gap_state(motion, count, j)
    a, second, third = gap_bounds(motion, count, j)
    noise, slow = motion.noise[j, 0], motion.noise[j, 1]
    if regime == OPEN:
        up = stops.gap[j, 0] - y
        down = y + stops.gap[j, 1]
        piece = entered(stops, j)
        if v > 0.0:
            one = _approach(up, -v, -a, second, third, noise, slow, piece)
            return _unless_later(one, down, v, a, second, third, noise, slow, -piece)
        one = _approach(down, v, a, second, third, noise, slow, -piece)
        return _unless_later(one, up, -v, -a, second, third, noise, slow, piece)
    side = 1 if regime > OPEN else -1
    gap = signed_gap(stops, j, regime)
    found = (math.inf, NOTHING)
    for e in range(MOST_EXITS):
        alpha, beta, target = exit_of(stops, j, regime, e)
        if target == NO_EXIT:
            continue
        new = side * target
        if target == OPEN:
            one = _approach(side * (y - gap), side * v, side * a, second, third, noise, slow, new)
        else:
            h, slope, bend, low2, low3 = switching_state(motion, count, j, gap, alpha, beta)
            # Its rate has no rounding to wait for: a piece that ends too early has the same force.
            unsure = abs(alpha) * noise + abs(beta) * slow
            one = _approach(side * h, side * slope, side * bend, low2, low3, unsure, 0.0, new)
        found = _sooner(found, one)
    return found


@kernel(inline=True)
def _sooner(one: tuple[float, int], two: tuple[float, int]) -> tuple[float, int]:
    """The one that changes now; if none does, the one that may change sooner."""
    if one[1] != NOTHING or (two[1] == NOTHING and one[0] <= two[0]):
        return one
    return two


@kernel(inline=True)
def _unless_later(
    one: tuple[float, int], h: float, slope: float, curvature: float, second: float, third: float,
    noise: float, slow: float, target: int,
) -> tuple[float, int]:  # fmt: skip
    """The sooner of a change and the zero of h; mostly that is seen to come later without roots."""
    step, new = one
    if new != NOTHING or (h > noise and h + step * (slope - 0.5 * second * step) > 0.0):
        return one
    return _sooner(one, _approach(h, slope, curvature, second, third, noise, slow, target))


@kernel(inline=True)
def _approach(
    h: float, slope: float, curvature: float, second: float, third: float, noise: float,
    slow: float, target: int,
) -> tuple[float, int]:  # fmt: skip
    """Safe step towards the zero of h; Newton's step and ``target`` once it is there.

    Where h and its rate both are rounding, as at rest just beside a stop, it has not begun to move.
    """
    if h == math.inf:
        return math.inf, NOTHING
    if slope < 0.0 and (h < -noise or (h <= noise and slope < -slow)):
        return -h / slope, target
    return safe_step(max(h, noise), slope, curvature, second, third), NOTHING


@kernel(shared=True)
def quiet_time(
    motion: GapMotion, stops: Stops, regime: int, count: int, j: int, step: float
) -> float:
    """A time, ``step`` or longer, before which spring j, all but at rest at a gap, stays as it is.

    There more derivatives than two may vanish, as where only another mass is driven, and safe steps
    would be many.
    """
    if regime == OPEN:
        y, _ = gap_state(motion, count, j)
        to_gap = min(abs(stops.gap[j, 0] - y), abs(stops.gap[j, 1] + y))
        return _time_within(motion, count, j, 1.0, 0.0, to_gap, step)
    quiet, gap = math.inf, signed_gap(stops, j, regime)
    for e in range(MOST_EXITS):
        alpha, beta, target = exit_of(stops, j, regime, e)
        if target != NO_EXIT:
            h = switching_state(motion, count, j, gap, alpha, beta)[0]
            quiet = min(quiet, _time_within(motion, count, j, alpha, beta, abs(h), step))
    return quiet


@kernel(inline=True)
def _time_within(
    motion: GapMotion, count: int, j: int, alpha: float, beta: float, reach: float, step: float
) -> float:
    """A time, ``step`` or longer, in which alpha y + beta y' changes by less than it may."""
    reach = max(reach, abs(alpha) * motion.noise[j, 0] + abs(beta) * motion.noise[j, 1])
    for _ in range(MOST_FOURFOLD):
        if not _changes_less(motion, count, j, alpha, beta, reach, 4.0 * step):
            break
        step *= 4.0
    return step


@kernel(inline=True)
def _changes_less(
    motion: GapMotion, count: int, j: int, alpha: float, beta: float, reach: float, span: float
) -> bool:
    """Whether alpha y + beta y' surely changes by less than ``reach`` over a span.

    By Taylor's series, whose remainder is at most the sum of the sizes of its terms.
    """
    for i in range(count):
        amplitude = motion.amplitude[j, i] * motion.factor[i]
        motion.turn[i] = amplitude * (alpha + beta * motion.rate[i])
    change, power = 0.0, 1.0
    for order in range(1, MOST_DERIVATIVES):
        value, most = alpha * motion.drift[j] if order == 1 else 0.0, 0.0
        for i in range(count):
            motion.turn[i] *= motion.rate[i]
            value += motion.turn[i].real
            most += modulus(motion.turn[i]) * motion.growth[i]
        power *= span / order
        if order > 1 and change + most * power <= reach:
            return True
        change += abs(value) * power
        if change > reach:
            return False
    return False


@kernel(inline=True)
def begin_later(motion: GapMotion, count: int, j: int, elapsed: float) -> None:
    """Count the time of row j of sums of exponentials from a later moment."""
    motion.offset[j] += motion.drift[j] * elapsed
    for i in range(count if elapsed != 0.0 else 0):
        motion.amplitude[j, i] *= exponential(motion.rate[i] * elapsed)


@kernel(shared=True)
def extremes(
    motion: GapMotion, count: int, j: int, duration: float
) -> tuple[float, float, float, float]:
    """Smallest and largest y_j over [0, duration], of both ends and of every zero of y' found.

    The times at which they stand come after them.

    A zero of y' is sought where y' changes sign between two samples, which stand a third of a
    radian apart at the mean frequency of the motion. A pair of zeros between two samples could hide
    only a ripple smaller than what the samples resolve.
    """
    frequency = mean_frequency(motion, count, j, 1, 0.0)
    for i in range(count):
        if motion.rate[i].real > 0.0:
            # What grows may be nothing at first and all of the motion at last.
            frequency = max(frequency, mean_frequency(motion, count, j, 1, duration))
            break
    samples = min(1 + int(3.0 * frequency * duration), 4000)
    step = duration / samples
    for i in range(count):
        motion.turn[i] = motion.amplitude[j, i]
        motion.ratio[i] = exponential(motion.rate[i] * step)
    low, high = math.inf, -math.inf
    at_low, at_high, v_before = 0.0, 0.0, 0.0
    for k in range(samples + 1):
        v = motion.drift[j]
        y = motion.offset[j] + v * k * step
        for i in range(count):
            term = motion.turn[i]
            y += term.real
            v += term.real * motion.rate[i].real - term.imag * motion.rate[i].imag
            motion.turn[i] = term * motion.ratio[i]
        t = k * step
        low, at_low = (y, t) if y < low else (low, at_low)
        high, at_high = (y, t) if y > high else (high, at_high)
        if k > 0 and v * v_before < 0.0:
            y, t = _stationary_value(motion, count, j, t - step, t, v_before, v)
            low, at_low = (y, t) if y < low else (low, at_low)
            high, at_high = (y, t) if y > high else (high, at_high)
        v_before = v
    return low, high, at_low, at_high


@kernel(inline=True)
def mean_frequency(motion: GapMotion, count: int, first: int, rows: int, t: float) -> float:
    """Root mean square of |rate|, each weighted with the size of its terms at time t in some rows.

    Slow terms may be large and cancel, or hold the mean: not less than that of what vibrates, each
    weighted with the square of its acceleration. Other terms add a zero of y' each at most.
    """
    weight, second, bends, squared = 0.0, 0.0, 0.0, 0.0
    exponentials(motion, count, t)
    for i in range(count):
        size = 0.0
        for j in range(first, first + rows):
            size += modulus(motion.amplitude[j, i])
        size *= motion.decay[i]
        turning = motion.rate[i].imag * motion.rate[i].imag
        weight += size
        second += size * (motion.rate[i].real * motion.rate[i].real + turning)
        bend = size * turning
        bends += bend * bend
        squared += bend * bend * turning
    mean = second / weight if weight > 0.0 else 0.0
    known = bends > 0.0 and squared < math.inf
    return math.sqrt(max(mean, squared / bends) if known else mean)


@kernel(inline=True)
def _stationary_value(
    motion: GapMotion, count: int, j: int, a: float, b: float, v_a: float, v_b: float
) -> tuple[float, float]:
    """y where y' = 0 in [a, b], and when: Newton from the chord's zero, kept inside the bracket."""
    width = b - a
    t = a + width * v_a / (v_a - v_b)
    y = 0.0
    for _ in range(60):
        exponentials(motion, count, t)
        y, v = gap_state(motion, count, j)
        curvature, _, _ = gap_bounds(motion, count, j)
        if v * v_a > 0.0:
            a = t
        else:
            b = t
        new = t - v / curvature if curvature != 0.0 else 0.5 * (a + b)
        if abs(new - t) < CLOSE * width:
            return y + 0.5 * v * (new - t), new
        if not a < new < b:
            new = 0.5 * (a + b)
        t = new
    return y, t


@kernel(entry=True)
def observe_motion(
    start: Real,
    length: Real,
    offset: Real,
    drift: Real,
    amplitude: Complex,
    rate: Complex,
    harmonic: Complex,
    order: Real,
    omega: float,
    motion: GapMotion,
    low: Real,
    high: Real,
    first: Complex,
) -> None:
    """Extremes of G coordinates over all pieces, and int y exp(-i omega t) dt.

    Offsets and drifts are (G, E), amplitudes (G, E, R), harmonics (G, E, H), as the coordinates see
    them.
    """
    modes, count = rate.shape[1], rate.shape[1] + order.shape[0]
    for e in range(start.shape[0]):
        for i in range(modes):
            motion.rate[i] = rate[e, i]
        for h in range(order.shape[0]):
            motion.rate[modes + h] = 1j * (order[h] * omega)
        for g in range(low.shape[0]):
            motion.offset[g], motion.drift[g] = offset[g, e], drift[g, e]
            for i in range(modes):
                motion.amplitude[g, i] = amplitude[g, e, i]
            for h in range(order.shape[0]):
                turn = exponential(1j * (order[h] * omega * start[e]))
                motion.amplitude[g, modes + h] = harmonic[g, e, h] * turn
        prepare_search(motion, count)
        for g in range(low.shape[0]):
            least, most, _, _ = extremes(motion, count, g, length[e])
            low[g], high[g] = min(low[g], least), max(high[g], most)
            first[g] += first_harmonic(motion, count, g, start[e], length[e], omega)


@kernel(inline=True)
def first_harmonic(
    motion: GapMotion, count: int, g: int, start: float, length: float, omega: float
) -> complex:
    """int y exp(-i omega t) dt over one piece, in closed form."""
    turning = -1j * omega
    turned = exponential(turning * length)
    still = integral_to(turning, length, turned)
    total = motion.offset[g] * still
    if motion.drift[g] != 0.0:
        # By parts: int t exp(-i omega t) dt.
        total += motion.drift[g] * (still - length * turned) / (1j * omega)
    for i in range(count):
        amplitude, rate = motion.amplitude[g, i], motion.rate[i]
        grown = exponential(rate * length)
        total += 0.5 * amplitude * integral_to(rate + turning, length, grown * turned)
        amplitude, rate, grown = amplitude.conjugate(), rate.conjugate(), grown.conjugate()
        total += 0.5 * amplitude * integral_to(rate + turning, length, grown * turned)
    return total * exponential(turning * start)


@kernel
def integral_of_exponential(rate: complex, length: float) -> complex:
    """int_0^length exp(rate t) dt."""
    return integral_to(rate, length, exponential(rate * length))


@kernel
def integral_to(rate: complex, length: float, end: complex) -> complex:
    """The same with exp(rate length) given; by its series where the closed form loses digits."""
    x = rate * length
    if modulus(x) < SHORT:
        return length * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0 + x / 120.0))))
    return (end - 1.0) * reciprocal(rate)


def new_gap_motion(gaps: int, rates: Complex, spacing: int = 0) -> GapMotion:
    """Scratch for a sum of exponentials at some gaps or coordinates."""
    shape = (gaps, rates.size)
    return GapMotion(
        offset=np.zeros(gaps),
        drift=np.zeros(gaps),
        time=np.zeros(1),
        amplitude=np.zeros(shape, np.complex128),
        rate=rates.copy(),
        factor=np.zeros(rates.size, np.complex128),
        decay=np.zeros(rates.size),
        curve=np.zeros(shape, np.complex128),
        bound=np.zeros(shape),
        size=np.zeros(rates.size),
        noise=np.zeros((gaps, 2)),
        growth=np.ones(rates.size),
        turn=np.zeros(rates.size, np.complex128),
        ratio=np.zeros(rates.size, np.complex128),
        spacing=np.array([spacing], np.int64),
    )
