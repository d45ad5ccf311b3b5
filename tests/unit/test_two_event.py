"""The scalar two-touch problem against general shooting, over whole branches."""

from __future__ import annotations

import numpy as np
import pytest

import flipflow as ff
import kernel_calls
from flipflow.dynamics.assembly import machine_arrays
from flipflow.periodic.two_event import TwoEventProblem

pytestmark = pytest.mark.numerical


@pytest.mark.parametrize(
    "changes",
    [{}, {"clearance": 8e-3}, {"shear_stiffness": 3510e3}, {"stop_damping": 0.0}],
    ids=["nominal", "wide gap", "stiff", "no stop damping"],
)
def test_every_contact_point_of_the_branch_is_a_zero(response, changes):
    """f(s, omega) = |F| - 1 vanishes at the shares of all shooting points, stable or not."""
    branch = response(**changes)
    problem = TwoEventProblem(machine_arrays(branch.system))
    orbits = [branch.orbit(i) for i in range(0, branch.omega.size, 7)]
    touching = [orbit for orbit in orbits if len(orbit.contact_intervals) == 2]
    assert len(touching) > 20
    omega = np.array([orbit.omega for orbit in touching])
    share = np.array([orbit.contact_share() for orbit in touching])
    excess = [
        kernel_calls.excess(problem._machine, problem._flow, problem._work, w, s)
        for w, s in zip(omega, share, strict=True)
        if s > 0.02
    ]
    np.testing.assert_allclose(excess, 0.0, atol=1e-8)


@pytest.mark.parametrize("omega", [85.0, 120.0, 190.0, 199.0, 203.0, 215.0])
def test_all_touching_motions_are_found_without_a_guess(screen, exact, omega):
    states, shares = TwoEventProblem(machine_arrays(screen.system())).states(omega)
    known = [orbit for orbit in exact.orbits_at(omega) if orbit.contact_intervals]
    assert len(shares) == len(known)
    for orbit in known:
        nearest = np.abs(shares - orbit.contact_share()).argmin()
        assert shares[nearest] == pytest.approx(orbit.contact_share(), abs=1e-9)
        np.testing.assert_allclose(states[nearest], orbit.state, rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("omega", [85.0, 120.0, 190.0])
def test_the_only_motion_is_found_with_its_state(screen, exact, omega):
    """Phase 0 lies within the touch or outside of it, before or behind the middle of the turn."""
    orbit = exact.orbit_from_below(omega)
    share, state = TwoEventProblem(machine_arrays(screen.system())).only(omega)
    assert share == pytest.approx(orbit.contact_share(), abs=1e-9)
    np.testing.assert_allclose(state, orbit.state, rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize(("omega", "alone"), [(203.0, np.nan), (230.0, 0.0)])
def test_no_share_where_no_stop_is_touched_and_none_is_told_between_folds(screen, omega, alone):
    found, _ = TwoEventProblem(machine_arrays(screen.system())).only(omega)
    np.testing.assert_equal(found, alone)


@pytest.mark.parametrize("omega", [191.56, 178.15, 165.68, 154.08])
def test_two_motions_that_lie_close_are_seen_between_samples(omega):
    """|F| falls to 1 and rises within a sixteenth of the turn: it is no parabola there."""
    light = ff.FlipFlowScreen(
        main_mass=1843.494, floating_mass=446.5357, eccentric_moment=2.671156,
        isolation_stiffness=248356.9, isolation_damping=1590.1, shear_stiffness=3020566.0,
        shear_damping=425.71, stop_stiffness=54414500.0, stop_damping=7089.23, clearance=0.0146515,
    )  # fmt: skip
    problem = TwoEventProblem(machine_arrays(light.system()))
    assert len(problem.states(omega)[0]) == 2
    assert np.isnan(problem.only(omega)[0])


def test_shooting_has_the_last_word_where_motion_leans():
    """e = 2 mm at 57.7 rad/s: of the scalar problem's candidates one is a motion.

    The others would touch more often than they assume. Shooting finds that one, which is
    unstable, and the two stable motions that lean to either side.
    """
    screen = ff.load("ffs0827").replace(clearance=2e-3)
    states, _ = TwoEventProblem(machine_arrays(screen.system())).states(57.7)
    motions = ff.periodic_orbits(screen, omega=57.7)
    assert sorted(motion.stability for motion in motions) == ["stable", "stable", "unstable"]
    true = [
        motion
        for motion in motions
        if any(np.allclose(state, motion.state, rtol=1e-7, atol=1e-9) for state in states)
    ]
    assert [motion.stability for motion in true] == ["unstable"]
    assert len(states) > len(true)
