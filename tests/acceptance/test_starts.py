"""Answers for machines far from the bundled one: growing and undamped motions, odd starts."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flipflow as ff
from flipflow.errors import IncompleteError
from reference import integrate

pytestmark = pytest.mark.numerical
NO_FORCE = ff.HarmonicForce([0.0])


def test_a_growing_motion_meets_its_stop_in_time() -> None:
    """x'' + .2 x' - 25 x = 0 from (.1, 0) reaches .5 at .46389 s, as its closed form says."""
    stop = ff.ClearanceSpring([1.0], 200.0, 1.0, 0.5)
    machine = ff.MechanicalSystem([[1.0]], [[0.2]], [[-25.0]], (stop,), NO_FORCE)
    history = ff.simulate(machine, 5.0, 3, [0.1, 0.0])
    first = history.events[0]
    up, down = -0.1 + math.sqrt(25.01), -0.1 - math.sqrt(25.01)
    share_up, share_down = -down / (up - down), up / (up - down)
    there = 0.1 * (share_up * math.exp(up * first.t) + share_down * math.exp(down * first.t))
    assert first.t == pytest.approx(0.46389493, abs=1e-8)
    assert there == pytest.approx(0.5, abs=1e-12)
    assert np.abs(history.x).max() > 0.5


@pytest.mark.parametrize("law", ["paper", "compression-only"])
@pytest.mark.parametrize("seed", range(4))
def test_growing_machines_as_dop853_carries_them(seed, law) -> None:
    """Indefinite K and C: between stops that hold it the machine leaves its middle."""
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(2, 2)))[0]
    K = turn @ np.diag([-4.0, 9.0]) @ turn.T
    C = turn @ np.diag([0.3, -0.1]) @ turn.T
    springs = [
        ff.ClearanceSpring(direction, 200.0, 2.0, 0.3 + 0.4 * rng.random(), law=law)
        for direction in np.eye(2)
    ]
    machine = ff.MechanicalSystem(
        np.eye(2), 0.5 * (C + C.T), 0.5 * (K + K.T), springs, ff.HarmonicForce([0.3, 0.1])
    )
    z = 0.1 * rng.normal(size=4)
    history = ff.simulate(machine, 2.0, 2, z)
    back = integrate.flow(integrate.Machine.of(machine), z, 2.0, 0.0, 2.0 * math.pi).final
    assert len(history.events) > 4
    assert history.x[-1] == pytest.approx(back[:2], abs=1e-7)
    assert history.v[-1] == pytest.approx(back[2:], abs=1e-6)


def test_an_impact_without_damping() -> None:
    """code_aster SDND101, to 1e-5 of its values: m 100, k 1e4, stop 1e6 without gap, v0 = 1."""
    stop = ff.ClearanceSpring([1.0], 1e6, 0.0, 0.0, math.inf)
    machine = ff.MechanicalSystem([[100.0]], [[0.0]], [[1e4]], (stop,), NO_FORCE)
    for omega in (10.0, 23.0):  # 10 rad/s is the natural frequency: without force it is no matter
        history = ff.simulate(machine, omega, 4, [0.0, 1.0], t=np.linspace(0.0, 0.4, 40_001))
        release, second = history.events[:2]
        assert release.t == pytest.approx(0.031260, rel=1e-5)
        assert second.t == pytest.approx(0.345419, rel=1e-5)
        assert history.force.max() == pytest.approx(9950.37, rel=1e-5)
        assert abs(sum(history.energy[one] for one in ("dissipated", "stored"))) < 1e-9
        assert not history.settled


def test_undamped_motions_beat_and_a_resonance_is_told() -> None:
    """x'' + 4 x = cos(w t) from rest is (cos w t - cos 2 t) / (4 - w^2)."""
    machine = ff.MechanicalSystem([[1.0]], [[0.0]], [[4.0]], (), ff.HarmonicForce([1.0]))
    history = ff.simulate(machine, 2.1, 40)
    beat = (np.cos(2.1 * history.t) - np.cos(2.0 * history.t)) / (4.0 - 2.1**2)
    assert history.x[:, 0] == pytest.approx(beat, abs=1e-11)
    assert history.distance is None
    assert not history.settled
    with pytest.raises(IncompleteError, match="resonance without damping"):
        ff.simulate(machine, 2.0, 40)
    with pytest.raises(ff.InputError, match="damping"):
        ff.periodic_orbits(machine, 2.1)
