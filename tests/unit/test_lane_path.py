"""Guesses along a lane: exact for polynomials, and no worse than the tangent behind a kink."""

import numpy as np
import pytest

import kernel_calls
from flipflow.batch.lane_path import KEPT, new_lane_work
from flipflow.dynamics.assembly import machine_arrays

pytestmark = pytest.mark.numerical


@pytest.fixture
def work(screen):
    return new_lane_work(machine_arrays(screen.system()), np.zeros(1, np.int64))


def remember(work, omega, motion, slope, count):
    """Motions at the first frequencies, tangents of the last one and of the one before."""
    work.omega[:] = np.nan
    work.omega[:count] = omega[:count]
    work.path[:count] = [motion(w) for w in omega[:count]]
    work.slope_here[:], work.slope_behind[:] = slope(omega[0]), slope(omega[1])


@pytest.mark.parametrize("count", [1, 2, 5, KEPT])
def test_as_many_motions_as_are_known_determine_a_polynomial(work, count):
    rng = np.random.default_rng(count)
    omega = 100.0 - np.cumsum(rng.uniform(0.5, 1.5, KEPT))
    # Each power of (omega - 95) / 10 less than the one before, so that each motion changes less.
    degree = 3 if count == 2 else count  # two of them are taken with both tangents
    of = np.polynomial.Polynomial(0.3 ** np.arange(degree + 1), domain=[85, 105], window=[-1, 1])
    parts = np.arange(1.0, work.z.size + 1)
    remember(work, omega, lambda w: parts * of(w), lambda w: parts * of.deriv()(w), count)
    kernel_calls.lane_guess(work, 100.0)
    np.testing.assert_allclose(work.guess, parts * of(100.0), rtol=1e-11)


def test_behind_a_kink_motions_before_it_are_left_out(work):
    omega = 100.0 - np.arange(1.0, KEPT + 1)
    ones = np.ones(work.z.size)

    def motion(w):
        return ones * (w - 97.5 if w > 97.5 else 0.0)

    remember(work, omega, motion, lambda _: ones, KEPT)
    kernel_calls.lane_guess(work, 100.0)
    # All ten motions together would miss by hundreds.
    assert np.abs(work.guess - motion(100.0)).max() < 1e-9
