"""Loads that arrive while the machine runs: it ends as the loaded machine does."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flipflow as ff
from flipflow.model.constants import GRAVITY
from judge import close

pytestmark = pytest.mark.numerical
SCREEN = ff.load("ffs0827").replace(clearance=4.5e-3)
SPEED, TURNS, LAST = 95.0, 600, 129
DRAWN = SCREEN.replace(clearance_measured="drawn")
STEPS = {
    "softer": (DRAWN, ff.Load(stiffness_factor=0.8)),
    "heavier": (SCREEN, ff.Load(floating_mass=120.0)),
    "heavier, as drawn": (DRAWN, ff.Load(main_mass=30.0, floating_mass=120.0)),
    "heavier and stiffer": (SCREEN, ff.Load(floating_mass=80.0, stiffness_factor=1.2)),
}


@pytest.mark.parametrize("name", STEPS)
def test_a_step_of_load_ends_in_the_motion_of_the_loaded_machine(name):
    """What is carried hangs on the springs: the stops of both sides were touched alike before."""
    screen, load = STEPS[name]
    run = ff.simulate(screen, SPEED, TURNS, disturbances=[ff.LoadStep(1.0, load)])
    orbit = ff.frequency_response(screen.loaded(load), (20.0, 110.0)).orbit_from_below(SPEED)
    force = run.force[-LAST:, 0]
    t = np.linspace(0.0, orbit.period, 20_000)
    steady = orbit.stop_force(0, t)
    for sign in (1.0, -1.0):
        close("force", (sign * force).max(), (sign * steady).max(), rel=2e-3)
    close("amplitude", np.ptp(run.displacement("relative")[-LAST:]) / 2.0,
          orbit.amplitude("relative"), rel=1e-3)  # fmt: skip


def test_a_lump_sinks_to_where_it_hangs():
    """Two lumps, one after the other, without excitation: the machine rests where K x = weight."""
    still = SCREEN.replace(eccentric_moment=1e-9)
    lumps = [ff.Lump(0.5, "floating", 50.0), ff.Lump(1.0, "main", 20.0)]
    run = ff.simulate(still, 95.0, 1500, disturbances=lumps, t=[0.0, 99.0])
    fall = GRAVITY * math.sin(still.deck_angle)
    rest = np.linalg.solve(still.system().K, -fall * np.array([20.0, 50.0]))
    assert np.abs(run.x[-1] - rest).max() < 1e-6 * np.abs(rest).max()
    softer = ff.simulate(
        still, 95.0, 1500, t=[0.0, 99.0],
        disturbances=[*lumps, ff.LoadStep(2.0, ff.Load(stiffness_factor=0.7))],
    )  # fmt: skip
    # Factors are dynamic ones: what hung there before stays where it was.
    assert np.abs(softer.x[-1] - rest).max() < 1e-6 * np.abs(rest).max()


def test_energies_balance_across_a_load():
    for screen, load in STEPS.values():
        run = ff.simulate(screen, SPEED, 200, disturbances=[ff.LoadStep(1.0, load)])
        energy = run.energy
        given = energy["input"] + energy["impulses"] + energy["loads"]
        close("balance", given, energy["dissipated"] + energy["stored"], rel=1e-9)


def test_the_strain_of_a_start_counts_from_rest():
    """One side alone pushes the middle of the motion off: half the swing is less than the reach."""
    screen = ff.load("ffs0827").replace(
        clearance=0.0, clearance_minus=math.inf, stop_stiffness=40e6, deck_angle=None
    )
    run = ff.start_up(screen, speed=90.0)
    reach = np.abs(run.history.displacement("relative")).max()
    close("strain", run.peaks["shear_strain"].value, reach / screen.shear_height, rel=2e-3)
    assert run.peaks["shear_strain"].value * screen.shear_height > 1.2 * (
        run.peaks["relative_amplitude"].value
    )
