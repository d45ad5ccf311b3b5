"""Every coexisting motion of FFS0827: at 203 rad/s three, elsewhere nothing that is not there."""

from __future__ import annotations

import logging
import math

import numpy as np
import pytest

import flipflow as ff
from flipflow.errors import IncompleteError
from reference import integrate

pytestmark = pytest.mark.numerical


@pytest.fixture(scope="module")
def screen() -> ff.FlipFlowScreen:
    return ff.load("ffs0827")


@pytest.mark.parametrize("max_periods", [1, 12])
def test_203_has_three_motions_one_unstable(screen, max_periods) -> None:
    """Between the folds, at 203 rad/s, there are three motions; the middle one is unstable."""
    orbits = ff.periodic_orbits(screen, 203.0, max_periods)
    assert [orbit.stability for orbit in orbits] == ["stable", "unstable", "stable"]
    assert {orbit.periods for orbit in orbits} == {1}


@pytest.mark.parametrize("omega", [20.0, 70.0, 110.0, 150.0, 190.0, 198.0, 207.0, 220.0])
def test_nothing_that_is_not_there(screen, omega) -> None:
    """One motion outside the folds, no subharmonic, none that leans."""
    orbits = ff.periodic_orbits(screen, omega, 6)
    assert len(orbits) == 1
    assert orbits[0].periods == 1
    assert orbits[0].stable


def test_leaning_motions_come_with_their_mirrors(screen) -> None:
    """e = 2 mm at 57.7 rad/s, where the symmetric motion is unstable."""
    leaning = screen.replace(clearance=2e-3)
    stable = [o for o in ff.periodic_orbits(leaning, 57.7, 2) if o.stable]
    ends = sorted(
        (float(o.displacement("relative").max()), float(o.displacement("relative").min()))
        for o in stable
    )
    assert len(ends) == 2
    assert ends[0][0] == pytest.approx(2.024274e-3, abs=1e-6)
    assert ends[1] == pytest.approx((-ends[0][1], -ends[0][0]), abs=1e-9)


def test_motions_of_several_periods_far_above_the_resonance(screen) -> None:
    """From 350 to 541 rad/s there are motions of three periods; as DOP853 says."""
    machine = integrate.Machine.of(screen.system())
    orbits = ff.periodic_orbits(screen, 450.0, 3)
    several = [orbit for orbit in orbits if orbit.periods == 3]
    assert {orbit.stability for orbit in several} == {"stable", "unstable"}
    for orbit in several:
        duration = 3 * 2.0 * np.pi / 450.0
        back = integrate.flow(machine, orbit.state, 450.0, 0.0, duration).final
        assert np.abs(back[:2] - orbit.state[:2]).max() < 1e-9


def test_unstable_motion_of_a_screen_with_hard_stops(screen) -> None:
    """Where symmetry is lost just above contact the symmetric motion goes on, and is one too."""
    hard = screen.replace(stop_stiffness=8.1e9, stop_damping=2e5)
    (symmetric,) = ff.frequency_response(hard, (20.0, 230.0)).orbits_at(87.775)
    found = ff.periodic_orbits(hard, 87.775)
    assert sorted(orbit.stability for orbit in found) == ["stable", "stable", "unstable"]
    (unstable,) = (orbit for orbit in found if not orbit.stable)
    assert unstable.state == pytest.approx(symmetric.state, rel=1e-6)


def test_every_motion_of_the_branch_is_found(screen) -> None:
    """The unstable one between two folds close together is no chance find of the cloud."""
    light = screen.replace(isolation_damping=500.0, shear_damping=150.0, stop_damping=150.0)
    omega = 22.3700842
    branch = ff.frequency_response(light, (20.0, 30.0)).orbits_at(omega)
    found = ff.periodic_orbits(light, omega)
    assert len(branch) == 3
    for orbit in branch:
        assert any(np.allclose(one.state, orbit.state, rtol=1e-6) for one in found), orbit


@pytest.fixture
def ringing(screen) -> ff.FlipFlowScreen:
    """Without gap and almost undamped: slow turns have more contacts than are recorded."""
    return screen.replace(
        clearance=0.0, clearance_minus=math.inf,
        isolation_damping=200.0, shear_damping=20.0, stop_damping=20.0,
    )  # fmt: skip


def test_starts_that_cannot_be_flown_are_left_out_and_said(ringing, caplog) -> None:
    told: list[str] = []
    with caplog.at_level(logging.WARNING, "flipflow"):
        found = ff.periodic_orbits(ringing, 0.4, monitor=lambda words, _share: told.append(words))
    assert [orbit.stability for orbit in found] == ["stable"]
    assert "starts left out" in told[-1]
    assert "starts left out" in caplog.text


def test_no_start_that_can_be_flown_is_an_error(ringing) -> None:
    with pytest.raises(IncompleteError, match="No start could be carried over a turn"):
        ff.periodic_orbits(ringing, 0.2)


@pytest.mark.parametrize("periods", [0, 13, 1.5, True])
def test_periods_outside_the_search_are_refused(screen, periods) -> None:
    with pytest.raises(ff.InputError, match="max_periods"):
        ff.periodic_orbits(screen, 203.0, periods)
