"""Answers for machines far from the bundled one: growing and undamped motions, odd starts."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import get_args

import numpy as np
import pytest

import flipflow as ff
from flipflow.continuation.double_folds import double_fold
from flipflow.errors import IncompleteError
from flipflow.model.contact_law import ContactLaw
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.stability import determinant_plus, neimark_sacker
from judge import close
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
    close("first contact", first.t, 0.46389493, abs=1e-8)
    close("position there", there, 0.5, abs=1e-12)
    assert np.abs(history.x).max() > 0.5


@pytest.mark.parametrize("law", get_args(ContactLaw))
@pytest.mark.parametrize("seed", range(3))
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


def a_machine_of_three_stops() -> ff.MechanicalSystem:
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    rows = (((1.9, 0.5), 0.71), ((-1.6, 1.7), 0.96), ((0.3, -0.9), 0.28))
    springs = [ff.ClearanceSpring(direction, 20.0, 0.0, gap) for direction, gap in rows]
    return ff.MechanicalSystem(np.eye(2), 0.03 * K, K, springs, ff.HarmonicForce([0.2, -0.4]))


def free_of_contact(system: ff.MechanicalSystem, omega: float) -> tuple[np.ndarray, bool]:
    """State at t = 0 of the motion of the open machine, and whether it stays within all gaps."""
    Z = system.K - omega**2 * system.M + 1j * omega * system.C
    X = np.linalg.solve(Z, system.excitation.vector * omega**system.excitation.power)
    clear = all(abs(one.direction @ X) < min(one.gaps) for one in system.springs)
    return np.concatenate([X.real, (1j * omega * X).real]), clear


def test_a_motion_without_contact_is_found_among_others() -> None:
    """Its basin is small; no start of a cloud settles on it."""
    machine = a_machine_of_three_stops()
    state, clear = free_of_contact(machine, 1.37)
    found = ff.periodic_orbits(machine, 1.37)
    assert clear
    (quiet,) = (orbit for orbit in found if not orbit.touches)
    assert quiet.stable
    assert quiet.state == pytest.approx(state, abs=1e-12)
    assert len(found) > 1


@pytest.mark.parametrize("seed", range(12))
def test_a_motion_without_contact_is_always_found(seed) -> None:
    rng = np.random.default_rng(seed)
    clear, machine, omega = False, a_machine_of_three_stops(), 0.0
    while not clear:
        omega = float(rng.uniform(0.8, 2.2))
        springs = [
            ff.ClearanceSpring(rng.normal(size=2), 20.0, 0.0, rng.uniform(0.2, 0.6))
            for _ in range(3)
        ]
        force = ff.HarmonicForce(0.3 * rng.normal(size=2))
        machine = ff.MechanicalSystem(machine.M, machine.C, machine.K, springs, force)
        state, clear = free_of_contact(machine, omega)
    quiet = [orbit for orbit in ff.periodic_orbits(machine, omega) if not orbit.touches]
    assert len(quiet) == 1
    assert quiet[0].state == pytest.approx(state, abs=1e-10)


@pytest.mark.parametrize("law", ["paper", "compression-only", "elasto-gap"])
def test_motions_held_by_a_stop_all_the_time(law) -> None:
    """K = -25 pushes the mass onto either stop of 200: it rests at 200 * .5 / 175 and shakes."""
    stop = ff.ClearanceSpring([1.0], 200.0, 1.0, 0.5, law=law)
    machine = ff.MechanicalSystem([[1.0]], [[0.2]], [[-25.0]], (stop,), ff.HarmonicForce([1.0]))
    found = ff.periodic_orbits(machine, 3.0)
    held = [orbit for orbit in found if orbit.contact_share() == 1.0]
    assert sorted(orbit.mean(0) for orbit in held) == pytest.approx([-4 / 7, 4 / 7], abs=1e-12)
    for orbit in held:
        assert orbit.stable
        assert orbit.amplitude(0) == pytest.approx(1.0 / abs(175.0 - 9.0 + 3.6j), rel=1e-9)
    (middle,) = (orbit for orbit in found if not orbit.touches)
    assert not middle.stable


@pytest.mark.parametrize("low", [0.2, 0.25, 0.29, 0.3, 0.31, 0.35, 0.5])
@pytest.mark.parametrize(
    "method", [ff.PiecewiseExact(), ff.HarmonicBalance(15)], ids=["exact", "H"]
)
def test_a_dead_zone_starts_at_any_speed(low, method) -> None:
    """Nothing is settled from rest here, yet there are motions; the branch begins with one."""
    stop = ff.ClearanceSpring([1.0], 1.0, 0.0, 1.0)
    machine = ff.MechanicalSystem([[1.0]], [[0.1]], [[1e-6]], (stop,), ff.HarmonicForce([0.5]))
    branch = ff.frequency_response(machine, (low, 2.0), method)
    assert branch.complete
    assert branch.omega[0] == low
    first = branch.orbit(0)
    exact = isinstance(method, ff.PiecewiseExact)
    if exact:
        turn = 2.0 * math.pi / low
        back = integrate.flow(integrate.Machine.of(machine), first.state, low, 0.0, turn).final
        assert back == pytest.approx(first.state, abs=1e-7)
    sizes = [orbit.amplitude(0) for orbit in ff.periodic_orbits(machine, low)]
    assert min(abs(first.amplitude(0) - size) for size in sizes) < (1e-8 if exact else 2e-3)


def test_identical_axes_have_every_pair_of_motions() -> None:
    """A square clearance: three motions on each axis make nine, each pair with its twin."""
    springs = [ff.ClearanceSpring(axis, 20.0, 0.1, 0.5) for axis in np.eye(2)]
    square = ff.MechanicalSystem(
        np.eye(2), 0.05 * np.eye(2), np.eye(2), springs, ff.HarmonicForce([0.3, 0.3])
    )
    axis = ff.MechanicalSystem(
        [[1.0]], [[0.05]], [[1.0]], [ff.ClearanceSpring([1.0], 20.0, 0.1, 0.5)],
        ff.HarmonicForce([0.3]),
    )  # fmt: skip
    alone = [orbit.amplitude(0) for orbit in ff.periodic_orbits(axis, 1.5)]
    found = ff.periodic_orbits(square, 1.5)
    pairs = sorted((round(o.amplitude(0), 8), round(o.amplitude(1), 8)) for o in found)
    assert len(alone) == 3
    assert pairs == sorted((round(a, 8), round(b, 8)) for a in alone for b in alone)
    for orbit in found:
        quiet = abs(orbit.amplitude(0) - alone[1]) > 1e-6 < abs(orbit.amplitude(1) - alone[1])
        assert orbit.stable == quiet
    stable = ff.basins(square, 1.5, {0: [0.0, 0.6], 1: [0.0, 0.6]}).orbits
    assert len(stable) == 4


@pytest.mark.parametrize("gaps", [(0.0, math.inf), (0.0, 0.3), (0.3, 0.3)])
@pytest.mark.parametrize("law", get_args(ContactLaw))
def test_without_force_everything_comes_to_rest(law, gaps) -> None:
    """At the gap, too, where the machine is another on either side."""
    stop = ff.ClearanceSpring([1.0], 5.0, 0.1, *gaps, law=law)
    machine = ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], (stop,), NO_FORCE)
    basins = ff.basins(machine, 2.0, {0: np.linspace(-1.0, 1.0, 5)}, {0: [0.0, 1.0]})
    assert [orbit.amplitude(0) for orbit in basins.orbits] == [0.0]
    assert not basins.labels.any()


@pytest.mark.parametrize("omega", [350.04, 350.1, 350.3, 352.0, 356.0, 360.0])
def test_both_motions_of_a_family_just_above_its_fold(omega) -> None:
    """FFS0827's motions of three periods begin at 350.033 rad/s; as DOP853 says."""
    screen = ff.load("ffs0827")
    machine = integrate.Machine.of(screen.system())
    several = [orbit for orbit in ff.periodic_orbits(screen, omega, 3) if orbit.periods == 3]
    assert sorted(orbit.stability for orbit in several) == ["stable", "unstable"]
    for orbit in several:
        back = integrate.flow(machine, orbit.state, omega, 0.0, 6.0 * np.pi / omega).final
        assert np.abs(back[:2] - orbit.state[:2]).max() < 1e-9
    assert all(orbit.periods == 1 for orbit in ff.periodic_orbits(screen, 350.02, 3))


# Stiff stops without gap on one side: a turn at 5 rad/s has more contacts than are recorded.
CHATTERING = {
    "main_mass": 2795.3,
    "floating_mass": 8904.2,
    "eccentric_moment": 0.18590,
    "isolation_stiffness": 4.6669e6,
    "isolation_damping": 5956.7,
    "shear_stiffness": 1.20742e8,
    "shear_damping": 1.61782e5,
    "stop_stiffness": 5.36297e11,
    "stop_damping": 703.0,
    "clearance": 0.24016,
    "clearance_minus": 0.0,
}
RELEASING = {
    "main_mass": 1539.8,
    "floating_mass": 21826.0,
    "eccentric_moment": 0.78493,
    "isolation_stiffness": 5.8283e7,
    "isolation_damping": 695.4,
    "shear_stiffness": 3.33675e7,
    "shear_damping": 572.4,
    "stop_stiffness": 1.16598e11,
    "stop_damping": 36.16,
    "clearance": 1.0648e-3,
    "clearance_minus": 0.0,
    "stop_law": "compression-only",
}


def test_a_start_is_found_by_way_of_higher_speeds() -> None:
    """From rest at 5 rad/s a turn has more contacts than are recorded, at 40 rad/s it has not."""
    branch = ff.frequency_response(ff.load("ffs0827").replace(**CHATTERING), (5.0, 250.0))
    assert branch.omega[0] == 5.0
    assert branch.error[0] < 1e-9


def test_a_branch_without_points_says_so_and_nothing_else_breaks() -> None:
    """Warnings are errors here. Whoever asks for its highest motion gets the sentence."""
    screen = ff.load("ffs0827").replace(**RELEASING)
    branch = ff.frequency_response(screen, (5.0, 250.0))
    assert branch.omega.size == 0
    assert not branch.complete
    for ask in (ff.figure, lambda b: ff.figure([b, b]), lambda b: b.peak("relative")):
        with pytest.raises(IncompleteError, match="no points.*" + branch.status.value[:20]):
            ask(branch)
    assert branch.peaks("relative") == branch.troughs("relative") == ()
    assert branch.error.size == branch.amplitude("relative").size == 0


@pytest.mark.parametrize("changes", [CHATTERING, RELEASING], ids=["chattering", "releasing"])
def test_a_series_of_a_machine_far_away_is_followed_without_a_warning(changes) -> None:
    """Its special points, peaks and picture too, though the exact flow beside it has no end."""
    screen = ff.load("ffs0827").replace(**changes)
    branch = ff.frequency_response(screen, (5.0, 250.0), ff.HarmonicBalance(3))
    assert len(branch.status.value) > 20
    if branch.omega.size:
        top = branch.peak("relative").amplitude("relative")
        sizes = [one.amplitude("relative") for one in branch.peaks("relative")]
        assert top >= max(sizes, default=0.0)
        assert ff.figure(branch).panels


@pytest.mark.parametrize("method", [ff.PiecewiseExact(), ff.HarmonicBalance(3)], ids=["exact", "H"])
def test_screens_within_a_factor_of_a_hundred(method) -> None:
    """Every branch ends with a status and a sentence, whatever the machine."""
    bundled, rng = ff.load("ffs0827"), np.random.default_rng(11)
    fields = [name for name in CHATTERING if name != "clearance_minus"]
    for _ in range(8):
        changes = {name: getattr(bundled, name) * 10.0 ** rng.uniform(-2, 2) for name in fields}
        changes["stop_stiffness"] = changes["shear_stiffness"] * 10.0 ** rng.uniform(-2, 4)
        minus = rng.choice([1.0, 3.0, 0.0, math.inf]) * changes["clearance"]
        law = rng.choice(["paper", "compression-only"])
        screen = bundled.replace(**changes, clearance_minus=minus, stop_law=str(law))
        branch = ff.frequency_response(screen, (5.0, 250.0), method)
        assert branch.complete or len(branch.status.value) > 20
        assert branch.error.shape == branch.omega.shape
        assert all(point.amplitude("relative") >= 0.0 for point in branch.special_points)


def test_test_functions_of_maps_that_no_number_holds() -> None:
    """A pair of modulus one is still told where other multipliers overflow their product."""
    far = np.array([1e200, 1e200, 0.9, 0.9], complex)
    assert neimark_sacker(far) < 0.0 < neimark_sacker(far * [1.0, 1.0, 1.2, 1.2])
    # 70 coordinates have 9,730 pairs, whose product no number holds though no multiplier is large.
    pairs = 0.999 * np.exp(1j * np.linspace(1.8, 2.6, 69))
    for size in (0.9, 1.1):
        one = np.array([size * np.exp(0.5j)])
        many = np.concatenate([pairs, pairs.conj(), one, one.conj()])
        told = neimark_sacker(many)
        assert np.isfinite(told)
        assert np.sign(told) == np.sign(1.0 - size**2)
    assert np.isfinite(determinant_plus(np.eye(4) * 1e100))
    assert determinant_plus(-2.0 * np.eye(3)) == pytest.approx(-1.0)


def test_double_folds_of_identical_axes() -> None:
    """Two equal axes turn back together, where the matrix of the branch loses two ranks.

    The steps are those of one axis, written twice: whether a path gets through such a point is
    for rounding to decide.
    """
    one = ff.MechanicalSystem(
        [[1.0]], [[0.06]], [[1.0]], [ff.ClearanceSpring([1.0], 30.0, 1.0, 0.4)],
        ff.HarmonicForce([0.5]),
    )  # fmt: skip
    axes = np.eye(2)
    both = ff.MechanicalSystem(
        axes, 0.06 * axes, axes, [ff.ClearanceSpring(d, 30.0, 1.0, 0.4) for d in axes],
        ff.HarmonicForce([0.5, 0.5]),
    )  # fmt: skip
    branch = ff.frequency_response(one, (0.3, 5.0))
    solver, traced = ExactSolver(both, half_turn=True), branch.traced
    assert len(branch.folds) == 6
    for fold in branch.folds:
        p = int(fold.position)
        step = SimpleNamespace(
            u=np.repeat(traced.u[p : p + 2], 2, axis=1),
            omega=traced.omega[p : p + 2],
            tangent=traced.tangent[p : p + 2],
        )
        _, point = double_fold(solver, step, 0)
        assert point.omega == pytest.approx(fold.omega, rel=1e-9)
