"""Extremes beside terms that hardly move but are large: soft modes under a force, and means."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flipflow as ff
from judge import close
from reference.integrate import Machine, amplitude, flow

pytestmark = pytest.mark.numerical


def soft(force, second, order, stiffness, damping, push, stop):
    """One mass on a soft spring that a constant force presses against a stop."""
    forces = [ff.HarmonicForce([force]), ff.HarmonicForce([second], order=order)]
    spring = ff.ClearanceSpring([1.0], *stop, math.inf, 0.0)
    return ff.MechanicalSystem(
        [[1.0]], [[damping]], [[stiffness]], (spring,), forces, static_force=[-push]
    )


def test_a_soft_mode_hides_no_summit():
    """In free flight it is of metres and cancels; 0.281 was told of an amplitude of 0.309."""
    system = soft(0.9, 1.94, 4, 1e-3, 0.107, 0.866, (40.0, 2.0))
    stable = [one for one in ff.periodic_orbits(system, 1.5, 2) if one.stable]
    for orbit in stable:
        run = flow(Machine.of(system), orbit.state, 1.5, 0.0, orbit.period)
        expected = amplitude(run, np.ones(1), 0.0, orbit.period)
        close("dop853", orbit.amplitude(0), expected, rel=1e-6)
    assert any(math.isclose(one.amplitude(0), 0.3090024, rel_tol=1e-6) for one in stable)


@pytest.mark.parametrize("seed", range(6))
def test_machines_that_nobody_chose(seed):
    rng = np.random.default_rng(seed)
    found = 0
    for _ in range(4):
        system = soft(
            rng.uniform(0.3, 3.0), rng.uniform(0.3, 6.0), int(rng.integers(2, 6)),
            10.0 ** rng.uniform(-4.0, -1.0), 10.0 ** rng.uniform(-2.0, -0.5),
            rng.uniform(0.3, 1.5), (10.0 ** rng.uniform(0.5, 3.0), rng.uniform(0.1, 3.0)),
        )  # fmt: skip
        for orbit in ff.periodic_orbits(system, rng.uniform(1.0, 3.0)):
            t = np.linspace(0.0, orbit.period, 20_001)
            y = orbit.displacement(0, t)
            close("amplitude", orbit.amplitude(0), np.ptp(y) / 2.0, rel=1e-5)
            close("mean", orbit.mean(0), (y.max() + y.min()) / 2.0, abs=1e-5 * np.ptp(y))
            found += 1
    assert found > 4


def test_a_mean_hides_no_vibration_of_a_series():
    """Order 0 holds it: where it was 355 times the amplitude, that was told as 0."""
    K = np.array([[2.0, -1.0], [-1.0, 1.0]])
    stop = ff.ClearanceSpring([1.0, 0.0], 5.0, 0.1, 50.0)
    system = ff.MechanicalSystem(
        np.eye(2), 0.1 * K, K, (stop,), ff.HarmonicForce([0.0, 1.0]), static_force=[1.0, 0.0]
    )
    branch = ff.frequency_response(system, (0.5, 6.0), ff.HarmonicBalance(harmonics=3))
    (orbit,) = branch.orbits_at(5.0)
    x = np.linalg.solve(K - 25.0 * np.eye(2) + 0.5j * K, [0.0, 1.0])
    close("amplitude", orbit.amplitude(0), abs(x[0]), rel=1e-9)
    close("mean", orbit.mean(0), 1.0, rel=1e-9)
