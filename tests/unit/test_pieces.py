"""Greatest lengths of vectors over a motion, against dense samples of the motion itself."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flipflow as ff
from flipflow.dynamics.motion import longest_on, states_on
from flipflow.studies.quantity_values import Working

pytestmark = pytest.mark.numerical
LAWS = ("paper", "compression-only", "undamped-rebound", "elasto-gap")
SAMPLES, CLOSE = 20_000, 1e-6  # a summit between two is seen to the square of their distance


def machine(law, seed):
    """Two masses and two stops, far from the bundled screen, under two harmonics and a weight."""
    rng = np.random.default_rng(seed)
    stops = [
        ff.ClearanceSpring(rng.normal(size=2), 20.0, 0.3, 0.1, 0.25, law=law),
        ff.ClearanceSpring(rng.normal(size=2), 5.0, 0.1, 0.2, math.inf, law=law),
    ]
    excitation = (ff.HarmonicForce([1.0, 0.3j]), ff.HarmonicForce([0.2, 0.1], order=2))
    K = np.array([[2.0, -1.0], [-1.0, 1.5]])
    return ff.MechanicalSystem(
        np.diag([1.0, 0.6]), 0.05 * K, K, stops, excitation, static_force=[0.05, -0.1]
    )


def sampled(motion, linear, constant, along, across):
    """The greatest of many samples, both sides of every change of contact among them."""
    t, piece = motion.samples(SAMPLES)
    x = states_on(motion, t, piece)
    turn = np.exp(1j * motion.omega * t)
    first = np.einsum("rn,rkn->k", linear, x) + constant + (along * turn).real
    return float(np.hypot(first, (across * turn).real).max())


@pytest.mark.parametrize("law", LAWS)
def test_the_greatest_length_is_that_of_dense_samples(law):
    rng = np.random.default_rng(5)
    branch = ff.frequency_response(machine(law, 1), (0.6, 1.5))
    motions = [branch.orbit(k).motion for k in range(0, branch.omega.size, 12)]
    assert any(motion.start.size > 2 for motion in motions)
    for motion in motions:
        linear, constant = rng.normal(size=(3, 2)), rng.normal()
        along, across = rng.normal(size=2) @ [1.0, 1j], rng.normal(size=2) @ [1.0, 1j]
        found = longest_on(motion, linear, constant, along, across)
        seen = sampled(motion, linear, constant, along, across)
        # No sample is beyond the summit, and the best is next to it.
        assert seen * (1.0 - 1e-12) <= found <= seen * (1.0 + CLOSE)


@pytest.mark.parametrize("law", LAWS)
def test_the_greatest_stop_force_is_that_of_its_formula(law):
    branch = ff.frequency_response(machine(law, 1), (0.6, 1.5))
    for k in range(0, branch.omega.size, 30):
        orbit = branch.orbit(k)
        t, _ = orbit.motion.samples(SAMPLES)
        # Contacts end at the last digit, where a force of a law with a jump is another one.
        inside = np.concatenate([t[1:-1] - 1e-9, t[1:-1] + 1e-9])
        for spring in range(2):
            most = np.abs(orbit.stop_force(spring, inside)).max()
            assert orbit.stop_force_peak(spring) == pytest.approx(most, rel=1e-6, abs=1e-9)


def test_a_series_has_the_peaks_of_its_samples():
    screen = ff.load("ffs0827")
    branch = ff.frequency_response(screen, (100.0, 130.0), ff.HarmonicBalance(5))
    orbit = branch.orbits_at(120.0)[-1]
    working, (t, _) = Working(screen, orbit), orbit.motion.samples(SAMPLES)
    k, c = screen.isolation_stiffness, screen.isolation_damping
    along = k * orbit.displacement("main", t) + c * orbit.velocity("main", t)
    found = {
        "main_frame_acceleration": (orbit.acceleration("main", t), working.normal.acceleration(t)),
        "foundation_force": (along, working.normal.foundation_force(t)),
        "stop_force": (orbit.stop_force(0, t), 0.0),
    }
    for name, (one, other) in found.items():
        assert working.value(name) == pytest.approx(np.hypot(one, other).max(), rel=CLOSE)


def test_slow_terms_that_are_large_hide_no_summit():
    """A soft mode of metres that cancels in free flight, under a second order of the force."""
    forces = (ff.HarmonicForce([0.9]), ff.HarmonicForce([1.94], order=4))
    stop = ff.ClearanceSpring([1.0], 40.0, 2.0, math.inf, 0.0)
    system = ff.MechanicalSystem(
        [[1.0]], [[0.107]], [[1e-3]], (stop,), forces, static_force=[-0.866]
    )
    linear = np.array([[1.0], [0.0], [0.0]])
    lengths = []
    for orbit in ff.periodic_orbits(system, 1.5, 2):
        found = longest_on(orbit.motion, linear, -0.2)
        seen = sampled(orbit.motion, linear, -0.2, 0.0, 0.0)
        assert seen * (1.0 - 1e-12) <= found <= seen * (1.0 + CLOSE)
        lengths.append(found)
    assert lengths


def test_times_in_any_order_of_memory():
    motion = ff.periodic_orbits(machine("paper", 1), omega=1.3)[0].motion
    t, piece = motion.samples()
    every = motion.piece_derivative(t, piece, 1)
    assert (motion.piece_derivative(t[::2], piece[::2], 1) == every[::2]).all()
    t.flags.writeable = False
    assert (motion.piece_derivative(t, piece, 1) == every).all()
