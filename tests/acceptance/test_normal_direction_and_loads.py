"""The motion normal to the surface, whichever way it turns, and what a load changes least."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import flipflow as ff
from flipflow.dynamics.normal import normal_motion
from judge import close

pytestmark = pytest.mark.numerical


@pytest.mark.parametrize("rotation", ["with-flow", "counter-flow"])
def test_the_normal_motion_goes_on_as_it_is(rotation):
    """Turning the other way, a settled motion began with the wrong sign, and rang eightfold."""
    screen, omega = ff.load("ffs0827").replace(rotation=rotation), 120.0
    steady = normal_motion(screen, omega)
    orbit = ff.frequency_response(screen, (5.0, 250.0)).orbits_at(omega)[0]
    run = ff.simulate(screen, omega, 20, orbit)
    assert np.abs(run.normal[:, 0] - steady.displacement(run.t)).max() < 1e-9 * steady.amplitude
    glide = ff.ramp(screen, (120.0, 120.5), 5.0).history
    close("glide", np.abs(glide.normal[:, 0]).max(), steady.amplitude, rel=3e-3)
    settled = ff.start_up(screen, ff.SpeedProfile((0.0, 8.0), (omega, omega))).history
    turned = steady.complex_amplitude * np.exp(1j * settled.angle[-1])
    close("start", settled.normal[-1, 0], turned.real, abs=1e-6 * steady.amplitude)


def test_the_least_change_by_a_load_is_none_where_it_changes_its_sign():
    screen = ff.load("ffs0827")
    load = ff.Load(floating_mass=20.0, stiffness_factor=0.9)
    region = ff.loading(screen, load).with_stop.region
    branches = [ff.frequency_response(one, (5.0, 250.0)) for one in (screen, screen.loaded(load))]

    def change(omega):
        before, after = (one.orbit_from_below(omega).amplitude("relative") for one in branches)
        return after - before

    zero = brentq(change, 195.8, 196.6, xtol=1e-9)
    close("speed", region.least.omega, zero, abs=1e-6)
    assert abs(region.least.change) < 1e-9
