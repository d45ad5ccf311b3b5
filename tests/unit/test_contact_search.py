"""The certified search for the next contact against dense sampling.

The search may not miss a crossing that sampling sees, and may not report one that is none. Times
are as sharp as the search promises, 2e-11 of its horizon.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flipflow.dynamics.contact_search import GapMotion, new_gap_motion
from flipflow.dynamics.law import Stops
from flipflow.model.contact_law import FORCE, LAWS, NUMBER, force_in, regime_at, stored_energy
from judge import close
from kernel_calls import change_after, law_of_spring, range_of

pytestmark = pytest.mark.numerical
OPEN, PLUS, MINUS, RELEASED_PLUS = 0, 1, -1, 2
NOTHING = (-1, 0)
SAMPLES = 200_001
SHARP = 2e-11


def motion(offset: float, amplitude, rate, spacing: int = 0) -> GapMotion:
    """Re sum amplitude exp(rate t) + offset at one gap."""
    m = new_gap_motion(1, np.asarray(rate, np.complex128), spacing)
    m.offset[0], m.amplitude[0] = offset, amplitude
    return m


def contact(
    plus: float, minus: float = math.inf, stiffness: float = 1.0, damping: float = 0.0,
    *, law: str = "paper",
) -> Stops:  # fmt: skip
    number = NUMBER[law]
    one = np.ones(1)
    return Stops(np.array([number]), stiffness * one, damping * one, np.array([[plus, minus]]))


def sampled(m: GapMotion, t: np.ndarray, order: int = 0) -> np.ndarray:
    """y or y' at times t."""
    y = np.full(t.shape, m.offset[0] if order == 0 else 0.0)
    for A, rate in zip(m.amplitude[0], m.rate, strict=True):
        y += (A * rate**order * np.exp(rate * t)).real
    return y


def first_sampled(m: GapMotion, c: Stops, horizon: float) -> tuple[float, int]:
    """First sample beyond a gap, and its side; (inf, 0) without one."""
    t = np.linspace(0.0, horizon, SAMPLES)
    y = sampled(m, t)
    beyond = np.flatnonzero((y > c.gap[0, 0]) | (y < -c.gap[0, 1]))
    if beyond.size == 0:
        return math.inf, 0
    return float(t[beyond[0]]), PLUS if y[beyond[0]] > 0.0 else MINUS


def search(m: GapMotion, c: Stops, state: int, horizon: float, fired: int = -1):
    t, spring, new = change_after(m, c, np.array([state]), horizon, fired)
    assert not math.isnan(t), "the search did not end"
    return t, (spring, new)


@settings(max_examples=200, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    terms=st.integers(1, 5),
    share=st.floats(0.3, 1.1),
    fastest=st.sampled_from([0.0, 3.0]),
)
def test_first_crossing_of_random_sums(seed: int, terms: int, share: float, fastest: float) -> None:
    """Random sums, some growing: the crossing lies within one sample of the first one beyond."""
    rng = np.random.default_rng(seed)
    rate = rng.uniform(-3.0, fastest, terms) + 1j * rng.uniform(0.0, 40.0, terms)
    amplitude = rng.normal(size=terms) + 1j * rng.normal(size=terms)
    m = motion(0.2 * rng.normal(), amplitude, rate)
    horizon = 3.0
    start = abs(float(sampled(m, np.zeros(1))[0]))
    largest = np.abs(sampled(m, np.linspace(0.0, horizon, 2001))).max()
    gap = max(share * largest, start * (1.0 + 1e-6) + 1e-9)
    c = contact(gap, gap)
    when, side = first_sampled(m, c, horizon)
    t, event = search(m, c, OPEN, horizon)
    if when < math.inf:
        assert event == (0, side), f"missed the crossing near {when}: {t}, {event}"
        assert when - horizon / (SAMPLES - 1) * 1.001 <= t <= when + SHARP * horizon, (
            f"{t}, sampled {when}"
        )
    if event != NOTHING:
        y, slope = (float(sampled(m, np.array([t]), order)[0]) for order in (0, 1))
        sharp = abs(slope) * SHARP * horizon + 1e-12 * (1.0 + largest)
        close("gap at the crossing", y, event[1] * gap, abs=sharp)
        assert event[1] * slope > 0.0
    else:
        assert t == horizon


@pytest.mark.parametrize("peak", [1e-2, 1e-4, 1e-6, 1e-8, 1e-10])
def test_two_crossings_close_together(peak: float) -> None:
    """1 + peak above a gap of 1 for sqrt(2 peak) to either side of the top: both are found.

    y = (1 + peak) cos(t - 1): for |t - 1| < acos(1 / (1 + peak)). The times are as sharp as
    rounding in the height allows, 1e-15 / slope.
    """
    m = motion(0.0, [(1.0 + peak) * np.exp(-1j)], [1j])
    half = math.acos(1.0 / (1.0 + peak))
    sharp = 1e-14 / math.sqrt(peak) + 3.0 * SHARP
    t, event = search(m, contact(1.0), OPEN, 3.0)
    assert event == (0, PLUS)
    close("entry", t, 1.0 - half, abs=sharp)
    later = motion(0.0, m.amplitude[0] * np.exp(1j * t), [1j])
    length, event = search(later, contact(1.0), PLUS, 3.0 - t, fired=0)
    assert event == (0, OPEN)
    close("exit", t + length, 1.0 + half, abs=2.0 * sharp)


@pytest.mark.parametrize("short", [1e-3, 1e-6, 1e-9, 1e-12])
def test_just_below_the_gap_is_no_contact(short: float) -> None:
    """A top that stays below the gap by a part in 1e12 fires nothing, and the search ends."""
    m = motion(0.0, [(1.0 - short) * np.exp(-1j)], [1j])
    assert search(m, contact(1.0, 1.0), OPEN, 20.0) == (20.0, NOTHING)


def test_exact_grazing_ends() -> None:
    """A top at the gap itself: contact or none, at the top, but never an endless search."""
    m = motion(0.0, [np.exp(-1j)], [1j])
    t, event = search(m, contact(1.0), OPEN, 3.0)
    assert event in (NOTHING, (0, PLUS))
    if event != NOTHING:
        close("time of grazing", t, 1.0, abs=1e-6)


def test_the_side_is_told() -> None:
    m = motion(0.0, [1.0], [1j])
    t, event = search(m, contact(2.0, 0.5), OPEN, 10.0)
    assert event == (0, MINUS)
    close("time", t, 2.0 * math.pi / 3.0, abs=10.0 * SHARP)


def test_what_has_just_fired_does_not_fire_again() -> None:
    """At the gap, moving in, just entered: the next event is the exit, not the entry."""
    m = motion(0.0, [np.exp(-1j * math.pi / 3)], [1j])
    t, event = search(m, contact(0.5), PLUS, 10.0, fired=0)
    assert event == (0, OPEN)
    close("time", t, 2.0 * math.pi / 3.0, abs=10.0 * SHARP)


def test_compression_only_lets_go_before_the_gap() -> None:
    """Where k (y - e) + c y' = 0: y = cos t, e = 0.5, c / k = 0.4."""
    c = contact(0.5, stiffness=1.0, damping=0.4, law="compression-only")
    m = motion(0.0, [1.0], [1j])
    t, event = search(m, c, PLUS, 10.0)
    assert event == (0, RELEASED_PLUS)
    size, phase = math.hypot(1.0, 0.4), math.atan2(0.4, 1.0)
    release = math.acos(0.5 / size) - phase
    close("release", t, release, abs=10.0 * SHARP)
    later = motion(0.0, [np.exp(1j * t)], [1j])
    length, event = search(later, c, RELEASED_PLUS, 10.0, fired=0)
    assert event == (0, OPEN)
    close("back at the gap", t + length, math.pi / 3.0, abs=20.0 * SHARP)


def test_a_piece_entered_where_gap_and_rate_vanish_together_is_left() -> None:
    """At the top of a touch one rounding deep: Newton's step from there would be 11 s long."""
    c = contact(np.nextafter(1.0, 0.0), law="undamped-rebound", damping=0.4)
    t, event = search(motion(0.0, [1.0 + 1e-17j], [1j]), c, 2, 3.0, fired=0)
    assert event == (0, OPEN)
    close("time", t, 0.0, abs=1e-7)


def walked(m: GapMotion, c: Stops, state: int, horizon: float) -> list[tuple[float, int]]:
    """Times of all changes of contact over the horizon, and the regimes that they begin."""
    found, t, fired = [], 0.0, -1
    while True:
        here = motion(m.offset[0], m.amplitude[0] * np.exp(m.rate * t), m.rate)
        length, (spring, new) = search(here, c, state, horizon - t, fired)
        if spring < 0:
            return found
        t, state, fired = t + length, new, spring
        found.append((t, state))
        assert len(found) < 1000, "the stop chatters"


def test_pieces_of_elasto_gap_follow_each_other() -> None:
    """y = cos t, e = 0.5, c / k = 0.4: 2 k p, k p + c y', nothing; and the mirror image."""
    c = contact(0.5, 0.5, stiffness=1.0, damping=0.4, law="elasto-gap")
    size, phase = math.hypot(1.0, 0.4), math.atan2(0.4, 1.0)
    turn, half = math.acos(0.5 / size), math.pi
    rising = [(-math.pi / 3.0, 2), (phase - turn, 1), (turn - phase, 3), (math.pi / 3.0, OPEN)]
    found = walked(motion(0.0, [np.exp(-0.5j * half)], [1j]), c, OPEN, 2.0 * half)
    expected = [(0.5 * half + t, q) for t, q in rising] + [(1.5 * half + t, -q) for t, q in rising]
    assert [q for _, q in found] == [q for _, q in expected]
    close("times", [t for t, _ in found], [t for t, _ in expected], abs=1e2 * SHARP)


def test_pieces_of_undamped_rebound_follow_each_other() -> None:
    """y = cos t - 0.4 cos 2 t dips between two tops, all of it beyond the gap of 0.4.

    y' = sin t (1.6 cos t - 1) is zero at t = 0 and where cos t = 0.625.
    """
    c = contact(0.4, stiffness=1.0, damping=0.4, law="undamped-rebound")
    start = np.exp(1j * np.array([1.0, 2.0]) * -math.pi)
    found = walked(motion(0.0, [start[0], -0.4 * start[1]], [1j, 2j]), c, OPEN, 2.0 * math.pi)
    edge, top = math.pi / 2.0, math.acos(0.625)
    times = math.pi + np.array([-edge, -top, 0.0, top, edge])
    assert [q for _, q in found] == [1, 2, 1, 2, OPEN]
    close("times", [t for t, _ in found], times, abs=1e2 * SHARP)


@pytest.mark.parametrize("law", ["compression-only", "undamped-rebound", "elasto-gap"])
@pytest.mark.parametrize("damping", [0.01, 0.1, 1.0])
def test_every_piece_is_the_one_that_the_force_is_in(law: str, damping: float) -> None:
    """Random sums: between two changes the piece's force is that of the law's formula."""
    formula = {
        "compression-only": lambda kp, cv: max(0.0, kp + cv),
        "undamped-rebound": lambda kp, cv: kp + max(0.0, cv),
        "elasto-gap": lambda kp, cv: kp + min(max(cv, -kp), kp),
    }[law]
    c, met = contact(0.3, 0.5, damping=damping, law=law), set()
    for seed in range(60):
        rng = np.random.default_rng(seed)
        rate = np.append(-rng.uniform(0.0, 0.3, 3), 0.0) + 1j * rng.uniform(0.0, 10.0, 4)
        amplitude = rng.normal(size=4) + 1j * rng.normal(size=4)
        # The walk begins within the gap.
        m = motion(-amplitude.real.sum(), amplitude, rate)
        changes = [(0.0, OPEN), *walked(m, c, OPEN, 10.0), (10.0, OPEN)]
        for (begin, regime), (end, _) in itertools.pairwise(changes):
            met.add(regime)
            times = np.linspace(begin, end, 9)[1:-1]
            for t, y, v in zip(times, *(sampled(m, times, order) for order in (0, 1)), strict=True):
                side = 1 if y > 0.3 else -1 if y < -0.5 else 0
                p = y - 0.3 if side > 0 else -0.5 - y
                expected = formula(p, damping * side * v) if side else 0.0
                f_k, f_c = FORCE[NUMBER[law], abs(regime)]
                assert regime == 0 or np.sign(regime) == side
                close(f"force at {t}", f_k * p + f_c * damping * side * v, expected, abs=1e-7)
    assert met == {side * q for q in range(4 if law == "elasto-gap" else 3) for side in (1, -1)}


def test_equally_spaced_rates_are_the_same_search() -> None:
    """A Fourier series by powers of one exponential, as harmonic balance has it."""
    rng = np.random.default_rng(3)
    amplitude = rng.normal(size=6) + 1j * rng.normal(size=6)
    rate = 1j * np.arange(1, 12, 2)
    c = contact(1.5, 1.5)
    start = 0.0 if abs(amplitude.real.sum()) > 1.5 else 1.0
    amplitude = amplitude * (0.1 if start == 0.0 else 1.0)
    slow = search(motion(0.0, amplitude, rate), c, OPEN, 2.0 * math.pi)
    fast = search(motion(0.0, amplitude, rate, spacing=2), c, OPEN, 2.0 * math.pi)
    assert slow[1] == fast[1]
    close("time", fast[0], slow[0], abs=2.0 * math.pi * SHARP)


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 10**6), terms=st.integers(1, 5))
def test_extremes_of_random_sums(seed: int, terms: int) -> None:
    """Never inside the sampled range, and outside it by no more than a sample can hide."""
    rng = np.random.default_rng(seed)
    rate = -rng.uniform(0.0, 3.0, terms) + 1j * rng.uniform(0.0, 40.0, terms)
    m = motion(rng.normal(), rng.normal(size=terms) + 1j * rng.normal(size=terms), rate)
    y = sampled(m, np.linspace(0.0, 2.0, SAMPLES))
    size = np.abs(y).max() + abs(m.offset[0])
    low, high, at_low, at_high = range_of(m, 2.0)
    close("least", low, y.min(), abs=1e-6 * size)
    close("most", high, y.max(), abs=1e-6 * size)
    for value, at in ((low, at_low), (high, at_high)):
        assert 0.0 <= at <= 2.0 * (1.0 + 1e-15)
        close("value at its time", sampled(m, np.array([at]))[0], value, abs=1e-9 * size)
    assert low <= y.min() + 1e-12 * size
    assert high >= y.max() - 1e-12 * size


def test_extremes_of_a_ripple_that_grows() -> None:
    """At first it is nothing beside the slow motion, at last it is all of it."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        rate = np.array([-0.1 + 1.0j, rng.uniform(4.0, 6.0) + 1j * rng.uniform(40.0, 80.0)])
        m = motion(0.1, [1.0, 1e-4 * np.exp(1j * rng.uniform(0.0, 6.0))], rate)
        y = sampled(m, np.linspace(0.0, 2.0, SAMPLES))
        low, high, _, _ = range_of(m, 2.0)
        close("least", low, y.min(), abs=1e-6)
        close("most", high, y.max(), abs=1e-6)


@pytest.mark.parametrize("damping", [0.0, 0.7])
@pytest.mark.parametrize("law", LAWS)
def test_arrays_and_kernels_have_one_law(law, damping):
    """Force and energy in every regime, and the regime of a state, at the gaps themselves, too."""
    rng = np.random.default_rng(NUMBER[law])
    k, gaps = 3.0, (0.2, 0.5)
    stops = contact(*gaps, stiffness=k, damping=damping, law=law)
    y, v = rng.uniform(-2.0, 2.0, 400), rng.uniform(-4.0, 4.0, 400)
    y[:100:2], y[1:100:2] = gaps[0], -gaps[1]
    pieces = len(LAWS[law])
    anything = rng.integers(-pieces, pieces + 1, 400)
    found = np.empty((400, 3))
    law_of_spring(stops, anything, y, v, found)
    close("force", found[:, 0], force_in(law, k, damping, gaps, anything, y, v), abs=1e-14)
    close("energy", found[:, 1], stored_energy(law, k, gaps, anything, y), abs=1e-14)
    regime = regime_at(law, k, damping, gaps, y, v)
    np.testing.assert_array_equal(found[:, 2], regime)
    depth = np.maximum(y - gaps[0], 0.0) - np.maximum(-y - gaps[1], 0.0)
    inwards = np.where(regime != 0, v * np.sign(regime), 0.0)
    spring, damper = k * np.abs(depth), damping * inwards
    size = {
        "paper": spring + damper,
        "compression-only": np.maximum(spring + damper, 0.0),
        "undamped-rebound": spring + np.maximum(damper, 0.0),
        "elasto-gap": spring + np.clip(damper, -spring, spring),
    }[law]
    found = force_in(law, k, damping, gaps, regime, y, v)
    close("law", found, np.sign(regime) * size, abs=1e-14)
