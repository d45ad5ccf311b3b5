"""The last moment of a run, and a speed that comes twice."""

import math

import numpy as np
import pytest

import flipflow as ff
from flipflow.errors import InputError

OMEGA = 50.0


@pytest.fixture(scope="module")
def screen():
    return ff.load("ffs0827")


def test_last_sample_is_reached_whatever_the_number_of_turns(screen):
    """At 50 rad/s 192 turns are one rounding longer than six stretches of 32 turns."""
    longer = ff.simulate(screen, OMEGA, 193)
    run = ff.simulate(screen, OMEGA, 192)
    assert run.x[-1] == pytest.approx(longer.x[192 * 128], rel=1e-9)
    assert run.a[-1] == pytest.approx(longer.a[192 * 128], rel=1e-9)


def test_times_that_end_a_rounding_late_are_taken(screen):
    """10 turns of 2 pi / omega and 10 * 2 * pi / omega are not the same number at every speed."""
    omega = 86.7
    late = 10 * 2 * math.pi / omega
    run = ff.simulate(screen, omega, 10, t=np.linspace(0.0, math.nextafter(late, 1.0), 5))
    assert run.t[-1] == pytest.approx(late, rel=1e-15)
    with pytest.raises(InputError, match="rising times"):
        ff.simulate(screen, omega, 10, t=[0.0, late * (1.0 + 1e-9)])


def test_last_sample_after_a_blow_just_before_the_end(screen):
    end = 3 * 2.0 * math.pi / OMEGA
    blow = ff.Impulse(math.nextafter(end, 0.0), "main", 100.0)
    calm = ff.simulate(screen, OMEGA, 3)
    struck = ff.simulate(screen, OMEGA, 3, disturbances=(blow,))
    assert struck.x[-1] == pytest.approx(calm.x[-1], rel=1e-9)
    assert struck.v[-1, 0] - calm.v[-1, 0] == pytest.approx(100.0 / screen.main_mass, rel=1e-9)


def test_a_speed_that_comes_twice_is_no_jump(screen):
    swept = ff.sweep(screen, np.array([100.0, 100.0, 100.0]))
    assert swept.jumps == ()
    assert swept.settled.all()


def test_an_orbit_of_another_machine_is_no_start(screen):
    one_mass = ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], (), ff.Unbalance([0.1]))
    (orbit,) = ff.periodic_orbits(one_mass, 0.5)
    with pytest.raises(InputError, match="an orbit of this machine"):
        ff.simulate(screen, OMEGA, 2, initial=orbit)
    with pytest.raises(InputError, match="an orbit of this machine"):
        ff.sweep(screen, [OMEGA], initial=orbit)


@pytest.fixture
def ringing(screen):
    """Without gap and almost undamped: a turn at 0.2 rad/s has 786 contacts, 600 are recorded."""
    return screen.replace(
        clearance=0.0, clearance_minus=math.inf,
        isolation_damping=200.0, shear_damping=20.0, stop_damping=20.0,
    )  # fmt: skip


def test_a_turn_of_many_contacts_is_simulated_in_parts(ringing):
    run = ff.simulate(ringing, 0.2, 1)
    assert len(run.events) > 600
    energy = run.energy
    assert energy["input"] == pytest.approx(energy["dissipated"] + energy["stored"], rel=1e-9)
    assert run.settled is False
    assert run.distance is None


def test_a_speed_that_cannot_be_carried_over_a_turn_is_one_row_that_did_not_settle(ringing):
    swept = ff.sweep(ringing, [0.2, 100.0])
    assert swept.settled.tolist() == [False, True]
    assert swept.turns[0] == 0
    assert swept.amplitude("relative")[1] > 1e-3


def test_a_machine_without_unbalance_stands_and_has_settled(screen):
    run = ff.simulate(screen.replace(eccentric_moment=0.0), OMEGA, 5)
    assert run.settled is True
    assert run.distance == 0.0
