"""The least blow that throws the machine from one motion onto another."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flipflow as ff
from flipflow.errors import InputError
from flipflow.periodic.exact_solver import ExactSolver
from settling import settled_on

pytestmark = pytest.mark.numerical
OMEGA = 203.0


@pytest.fixture(scope="module")
def risk(screen):
    return ff.jump_risk(screen, OMEGA)


def after_blow(screen, throw, orbit, factor):
    """Brute force: where the machine settles after ``factor`` times a blow."""
    system = screen.system()
    mass = {"main": screen.main_mass, "floating": screen.floating_mass}[throw.frame]
    k = {"main": 0, "floating": 1}[throw.frame]
    t = throw.phase / orbit.omega
    x = np.array([orbit.displacement(i, t) for i in (0, 1)], float)
    v = np.array([orbit.velocity(i, t) for i in (0, 1)], float)
    if throw.lump is None:
        v[k] += factor * throw.impulse / mass
    else:
        v[k] *= mass / (mass + factor * throw.lump)
    return rk_to_end_of_turn(system, np.concatenate([x, v]), t, orbit.omega)


def rk_to_end_of_turn(system, z, t, omega):
    """The state at the end of the turn, by the reference integrator of the tests."""
    (spring,) = system.springs
    M, C, K = system.M, system.C, system.K
    edges = np.array([spring.gaps[0], -spring.gaps[1]])

    def rate(time, state, side):
        x, v = state[:2], state[2:]
        y, w = spring.direction @ x, spring.direction @ v
        H = spring.stiffness * (y - edges[side]) + spring.damping * w if side is not None else 0.0
        F = system.excitation.vector * omega**2 * np.exp(1j * omega * time)
        return np.concatenate(
            [v, np.linalg.solve(M, F.real - C @ v - K @ x - spring.direction * H)]
        )

    def gap(sign):
        def event(_time, state, _side):
            return sign * (spring.direction @ state[:2]) - spring.gaps[0]

        event.terminal = True
        return event

    end = 2.0 * np.pi / omega
    while t < end:
        y, w = spring.direction @ z[:2], spring.direction @ z[2:]
        side = next(
            (
                s
                for s, sign in enumerate((1, -1))
                if sign * y > spring.gaps[0] - 1e-12
                and (sign * y > spring.gaps[0] + 1e-12 or sign * w > 0)
            ),
            None,
        )
        events = [gap(1), gap(-1)]
        for event, sign in zip(events, (1, -1), strict=True):
            event.direction = -1.0 if side is not None and (1, -1)[side] == sign else 1.0
        done = solve_ivp(
            rate, (t, end), z, "DOP853", rtol=1e-11, atol=1e-13, events=events, args=(side,)
        )
        t, z = done.t[-1], done.y[:, -1]
    return z


@pytest.mark.parametrize("kind", ["impulse", "lump"])
def test_least_blow_is_least_within_one_per_cent(screen, risk, kind):
    """1 % more throws the motion out, 1 % less does not; by another integrator and long runs."""
    omega = 206.0 if kind == "lump" else OMEGA
    risk = risk if omega == OMEGA else ff.jump_risk(screen, omega)
    throw = risk.worst_impulse if kind == "impulse" else risk.worst_lump
    assert throw.sharp
    orbits = (risk.orbit, *risk.others)
    solver = ExactSolver(screen.system(), half_turn=False)
    ends = [
        settled_on(solver, after_blow(screen, throw, risk.orbit, factor), omega, orbits, 1200)
        for factor in (0.99, 1.01)
    ]
    assert ends == [0, 1]
    assert throw.lands.amplitude("relative") == pytest.approx(
        orbits[1].amplitude("relative"), rel=1e-9
    )


def test_least_impulse_is_least_over_frames_and_moments(screen, risk):
    """No smaller one among 400 random blows throws the motion out."""
    assert risk.impulse == min(throw.size for throw in risk.impulses)
    assert risk.impulse <= min(values.min() for values in risk.thresholds.values())
    rng = np.random.default_rng(2)
    solver = ExactSolver(screen.system(), half_turn=False)
    orbit, orbits = risk.orbit, (risk.orbit, *risk.others)
    masses = np.array([screen.main_mass, screen.floating_mass])
    for k, share in zip(rng.integers(0, 2, 400), rng.uniform(-0.97, 0.97, 400), strict=True):
        # At phase 0, where the stroboscopic solver starts; the moments have their own tests.
        z = orbit.state.copy()
        z[2 + k] += share * risk.impulse / masses[k]
        assert settled_on(solver, z, OMEGA, orbits) == 0


def test_worst_moment_repeats_mirrored_after_half_a_turn(risk):
    """The machine is its own mirror image: +J at theta does what -J does at theta + 180 deg."""
    half = risk.phases.size // 2
    for plus, minus in risk.thresholds.values():
        both = np.isfinite(plus)
        rolled = np.roll(minus, -half)
        np.testing.assert_array_equal(both, np.isfinite(rolled))
        np.testing.assert_allclose(plus[both], rolled[both], rtol=1e-2)


def test_without_another_motion_nothing_jumps(screen):
    risk = ff.jump_risk(screen, 120.0)
    assert risk.worst_impulse is None
    assert risk.impulse == np.inf
    assert risk.lump == np.inf
    assert risk.others == ()
    assert risk.notes == ("No other motion found: it cannot jump.",)


def test_jump_risk_of_a_given_orbit(screen, risk):
    """The small motion may be thrown up to the large one."""
    (small,) = risk.others
    upward = ff.jump_risk(screen, small)
    assert upward.orbit.amplitude("relative") == pytest.approx(6.89e-3, abs=0.01e-3)
    assert 0.0 < upward.impulse < np.inf
    assert upward.worst_impulse.lands.amplitude("relative") > 39e-3


def test_jump_risk_refuses_what_is_absurd(screen):
    for impulse in (-1.0, 0.0, np.nan, np.inf, 1e30, "much", True):
        with pytest.raises(InputError, match="impulse"):
            ff.jump_risk(screen, OMEGA, largest_impulse=impulse)
    unstable = next(o for o in ff.periodic_orbits(screen, OMEGA) if not o.stable)
    with pytest.raises(InputError, match="stable"):
        ff.jump_risk(screen, unstable)
    for omega in (-1.0, np.nan, "fast"):
        with pytest.raises(InputError, match="omega"):
            ff.jump_risk(screen, omega)
