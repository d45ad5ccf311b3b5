"""Cases in which a reader once found a wrong answer."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flipflow as ff
from flipflow.analyses.assessment import assess_case, energy_balance, verdict
from flipflow.analyses.quantities import Working
from flipflow.errors import InputError


@pytest.fixture(scope="module")
def screen():
    return ff.load("ffs0827")


def test_bonded_stop_carries_its_force(screen):
    """With no gap the stop is a spring that always acts: H = k3 x2 + c3 x2'."""
    orbit = ff.periodic_orbits(screen.replace(clearance=0.0), omega=120.0)[0]
    size = abs(screen.stop_stiffness + 120j * screen.stop_damping)
    assert orbit.stop_force_peak() == pytest.approx(size * orbit.amplitude("relative"), rel=1e-6)
    assert orbit.touches


def test_stop_force_repeats_with_the_period(screen):
    orbit = ff.periodic_orbits(screen, omega=120.0)[0]
    t = np.linspace(0.0, orbit.period, 50)
    np.testing.assert_allclose(
        orbit.stop_force(0, t + orbit.period), orbit.stop_force(0, t), rtol=1e-6, atol=1e-3
    )


def test_springs_are_counted_as_given():
    """A spring without gap before one with a gap keeps its number."""
    springs = [ff.ClearanceSpring([1.0], 0.5, 0.0, 0.0), ff.ClearanceSpring([1.0], 3.0, 0.0, 0.5)]
    system = ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], springs, ff.HarmonicForce([1.0]))
    orbit = ff.frequency_response(system, (0.1, 1.0)).orbits_at(0.5)[0]
    x = orbit.displacement(0)
    np.testing.assert_allclose(orbit.stop_force(0), 0.5 * x, atol=1e-12)
    beyond = np.where(np.abs(x) > 0.5, x - np.sign(x) * 0.5, 0.0)
    np.testing.assert_allclose(orbit.stop_force(1), 3.0 * beyond, atol=1e-9)
    with pytest.raises(InputError, match="2 springs"):
        orbit.stop_force(2)


def test_branch_that_starts_between_the_folds_comes_from_below(screen):
    """e = 8 mm at 180 rad/s: the linear motion fits the gap, but is not the one reached."""
    wide = screen.replace(clearance=8e-3)
    part = ff.frequency_response(wide, (180.0, 250.0))
    whole = ff.frequency_response(wide, (5.0, 250.0))
    reached = whole.orbit_from_below(180.0)
    assert part.amplitude("relative")[0] == pytest.approx(reached.amplitude("relative"), rel=1e-9)


def test_upper_motion_is_followed_up_to_the_fold_itself(screen):
    branch = ff.frequency_response(screen, (5.0, 250.0))
    fold = branch.folds[0].omega
    assert branch.orbit_from_below(fold - 1e-3).amplitude("relative") > 0.02
    assert branch.orbit_from_below(fold + 1e-3).amplitude("relative") < 0.01


def test_region_that_starts_in_contact_says_so(screen):
    region = ff.operating_region(screen, omega=(100.0, 180.0))
    assert region.lower == 100.0
    assert any("below the speeds analysed" in note for note in region.notes)


@pytest.mark.parametrize("minus", [6e-3, math.inf])
def test_region_ends_at_the_main_resonance_not_at_a_small_one(screen, minus):
    """Without gap on one side two folds stand at 50.5 and 50.7 rad/s, far below the main peak."""
    region = ff.operating_region(screen.replace(clearance=0.0, clearance_minus=minus))
    assert [fold.omega for fold in region.branch.folds] == pytest.approx([50.707295, 50.533177])
    assert (region.omega_lb, region.omega_ub) == (None, None)
    assert region.upper == region.branch.peak("relative").omega
    assert region.lower < region.upper


def test_stop_that_is_met_at_the_first_resonance_alone(screen):
    """Isolation almost undamped, shear springs heavily: the stop is not part of the region."""
    quiet = screen.replace(isolation_damping=100.0, shear_damping=25e3, clearance=8e-3)
    region = ff.operating_region(quiet)
    assert region.branch.points_of("contact begin")
    assert region.omega_cs is None
    assert (region.lower, region.upper) == (region.omega_ea, region.omega_ar)
    assert any("not reached at the main resonance" in note for note in region.notes)


def test_speed_without_a_stable_motion_is_not_called_out_of_range(screen):
    """Past a fold onto unstable motions only, the speed lies well within those analysed."""
    restless = screen.replace(
        main_mass=1273.7243, floating_mass=224.77805, isolation_damping=2926.2439,
        shear_damping=2719.1742, stop_stiffness=29106997.0, stop_damping=1085.9144,
        clearance=0.0, clearance_minus=8.930106862626047e-3,
    )  # fmt: skip
    region = ff.operating_region(restless)
    for omega, why in ((420.0, "meets no stable motion in empty"), (900.0, "do not hold it")):
        case = assess_case(restless, ff.Load(), region.branch, omega)
        assert why in verdict(omega, (), (case,), region)


@pytest.mark.parametrize("minus", [6e-3, 3e-3, math.inf])
def test_a_clipped_stop_takes_what_it_still_holds_when_it_lets_go(screen, minus):
    """Input = isolation + shear springs + stop, for the compression-only law, too."""
    clipped = screen.replace(
        stop_law="compression-only", stop_damping=2e4, clearance_minus=minus
    )  # fmt: skip
    orbit = ff.periodic_orbits(clipped, 140.568)[0]
    powers = energy_balance(Working(clipped, orbit))
    taken = powers["isolation"] + powers["shear"] + powers["stop"]
    assert taken == pytest.approx(powers["input"], rel=1e-9)


def test_five_stops_prepare_configurations_as_they_are_met():
    """3^5 configurations are not prepared at once; the branch still completes."""
    n = 5
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    stops = [ff.ClearanceSpring(np.eye(n)[i], 3.0, 0.05, 0.4 + 0.1 * i) for i in range(n)]
    system = ff.MechanicalSystem(
        np.eye(n), 0.4 * K, K, stops, ff.HarmonicForce([1.0] + [0.0] * (n - 1))
    )
    branch = ff.frequency_response(system, (0.2, 1.2), ff.PiecewiseExact(60))
    assert branch.complete
    assert {touch.spring for touch in branch.orbit(40).contact_intervals} >= {0, 1}


def test_frequency_outside_the_branch_is_refused(screen):
    branch = ff.frequency_response(screen, (100.0, 120.0))
    with pytest.raises(InputError, match="the branch runs from 100 to 120"):
        branch.orbits_at(130.0)


def test_what_is_no_machine_is_refused_with_a_sentence(screen):
    with pytest.raises(InputError, match=r"of a project, its \.screen"):
        ff.frequency_response(ff.load_project("ffs0827"), (5.0, 250.0))
    with pytest.raises(InputError, match="PiecewiseExact"):
        ff.frequency_response(screen, (5.0, 250.0), "HB")


def test_high_orders_of_unequal_gaps_fit_the_memory(screen):
    lean = screen.replace(clearance=6e-3, clearance_minus=math.inf)
    branch = ff.frequency_response(lean, (100.0, 101.0), ff.HarmonicBalance(120, points=3))
    assert branch.complete
