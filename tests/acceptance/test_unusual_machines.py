"""Machines unlike FFS0827, each by several routes that know nothing of one another.

Shooting on the closed-form flow, harmonic balance of order 25, the search for coexisting motions,
a sweep from rest and a simulation must agree, and DOP853 of ``tests/reference`` with them.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import flipflow as ff
from judge import close
from reference import integrate

pytestmark = pytest.mark.numerical
MAIN, RELATIVE = (1.0, 0.0), (1.0, -1.0)


def stop(direction, stiffness=8.1e6, damping=2605.0, *gaps, law="paper"):
    return ff.ClearanceSpring(direction, stiffness, damping, *gaps, law=law)


def frames(*springs, excitation=None):
    """The two frames of FFS0827 with other stops, under another force."""
    system = ff.load("ffs0827").system()
    return ff.MechanicalSystem(
        system.M, system.C, system.K, springs, excitation or system.excitation
    )


def screen(**changes):
    return ff.load("ffs0827").replace(**changes)


def one_mass():
    spring = stop([1.0], 6e6, 2000.0, 5e-3)
    return ff.MechanicalSystem([[1e3]], [[4e3]], [[2e6]], (spring,), ff.Unbalance([4.0]))


def five_masses():
    n = 5
    K, C = np.zeros((n, n)), np.zeros((n, n))
    K[0, 0], C[0, 0] = 6e5, 9e3
    links = np.eye(n)[:-1] - np.eye(n)[1:]
    for k, link in zip(np.linspace(2e6, 3.5e6, n - 1), links, strict=True):
        K, C = K + k * np.outer(link, link), C + 2500.0 * np.outer(link, link)
    springs = (stop(links[0], 9e6, 2500.0, 5e-3), stop(links[3], 5e6, 1e3, 4e-3, 6e-3))
    force = ff.Unbalance([4.0, 0.0, 0.0, 0.0, 0.0])
    return ff.MechanicalSystem(np.diag(np.linspace(300.0, 900.0, n)), C, K, springs, force)


HALF = stop(RELATIVE, 4.05e6, 1302.5, 6e-3)
MACHINES = {
    "one-sided": (screen(clearance_minus=math.inf), (86.803, 127.081, 215.423)),
    "on-the-main-frame": (frames(stop(MAIN, 8.1e6, 2605.0, 4e-3, math.inf)), (41.56, 111.586)),
    "no-gap-on-one-side": (screen(clearance=0.0, clearance_minus=6e-3), (110.849, 198.678)),
    "no-gap-clipped": (screen(clearance=0.0, stop_law="compression-only"), (64.933, 98.055)),
    "three-stops": (
        frames(
            stop(RELATIVE, 4e6, 1500.0, 6e-3, 4e-3), stop(MAIN, 2e6, 1e3, 5e-3, math.inf),
            stop((0.0, 1.0), 1e6, 500.0, math.inf, 7e-3),
        ),
        (80.567, 186.285),
    ),
    "one-mass": (one_mass(), (50.538, 84.5)),
    "five-masses": (five_masses(), (57.368, 134.0)),
    "hard": (screen(stop_stiffness=8.1e9, stop_damping=2e5), (87.775, 202.143)),
    "clipped": (screen(stop_law="compression-only", stop_damping=3e4), (104.417, 154.679)),
    "constant-force": (
        frames(stop(RELATIVE, 8.1e6, 2605.0, 6e-3), excitation=ff.HarmonicForce([4e4, 0.0])),
        (63.624, 150.267),
    ),
    "lightly-damped": (
        screen(isolation_damping=3e3, shear_damping=600.0, stop_damping=600.0), (113.005, 205.0),
    ),
    "coincident": (frames(HALF, HALF), (119.991, 203.0)),
}  # fmt: skip
CASES = [(name, omega) for name, (_, speeds) in MACHINES.items() for omega in speeds]


@pytest.fixture(scope="module")
def branches():
    """Branches by shooting and by harmonic balance of order 25, each followed once."""
    methods = (ff.PiecewiseExact(), ff.HarmonicBalance(25))
    return {
        name: tuple(ff.frequency_response(machine, (20.0, 220.0), one) for one in methods)
        for name, (machine, _) in MACHINES.items()
    }


@pytest.fixture
def dop853(monkeypatch, name):
    """The reference integrator, in steps between which no contact of a hard stop fits."""
    if name == "hard":
        monkeypatch.setattr(integrate, "STEPS_PER_TURN", 1000)
    return integrate.flow


def lengths(system, omega):
    return np.repeat([1.0, 1.0 / omega], system.size)


@pytest.mark.parametrize(("name", "omega"), CASES)
def test_motions_of_the_branch_are_those_of_dop853(branches, dop853, name, omega) -> None:
    """A turn of DOP853 ends where it began, up to what the motion's own multiplier makes of it."""
    exact, _ = branches[name]
    system = exact.system
    turn, machine = 2.0 * np.pi / omega, integrate.Machine.of(system)
    orbits = exact.orbits_at(omega)
    assert orbits
    for orbit in orbits:
        path = dop853(machine, orbit.state, omega, 0.0, turn)
        growth = max(1.0, abs(orbit.multipliers[0]))
        scaled = lengths(system, omega)
        size = np.abs(orbit.state * scaled).max()
        close("state", path.final * scaled, orbit.state * scaled, abs=1e-9 * growth * size)
        for vector in np.eye(system.size):
            which = int(vector.argmax())
            amplitude = integrate.amplitude(path, vector, 0.0, turn)
            close(f"amplitude of {which}", orbit.amplitude(which), amplitude, rel=1e-7 * growth)


@pytest.mark.parametrize(("name", "omega"), CASES)
def test_harmonic_balance_meets_them_within_its_stated_error(branches, name, omega) -> None:
    exact, balance = branches[name]
    ours, theirs = exact.orbits_at(omega), balance.orbits_at(omega)
    assert len(ours) == len(theirs)
    for orbit, series in zip(ours, theirs, strict=True):
        # An error is an estimate, meant to be good within a factor of three.
        for which in range(exact.system.size):
            off = abs(orbit.amplitude(which) - series.amplitude(which))
            assert off <= 3.0 * series.error + 1e-12, (which, off, series.error)


@pytest.mark.parametrize(("name", "omega"), CASES)
def test_the_search_finds_them_and_what_a_sweep_settles_on(branches, name, omega) -> None:
    machine, exact = MACHINES[name][0], branches[name][0]
    scaled = lengths(exact.system, omega)
    found = ff.periodic_orbits(machine, omega, 3)
    for orbit in exact.orbits_at(omega):
        size = np.abs(orbit.state * scaled).max()
        away = [np.abs((one.state - orbit.state) * scaled).max() for one in found]
        assert min(away) < 1e-6 * size, f"missed: {orbit}, {orbit.amplitude(0)}"
    swept = ff.sweep(machine, [omega])
    assert swept.settled.all()
    sizes = np.array([one.amplitude(0) for one in found if one.stable])
    assert np.abs(sizes / swept.amplitude(0) - 1.0).min() < 1e-6


@pytest.mark.parametrize(("name", "omega"), CASES)
def test_simulation_is_that_of_dop853_and_keeps_its_energy(dop853, name, omega) -> None:
    """Three turns from a state with every coordinate beyond its gap."""
    machine = MACHINES[name][0]
    system = machine.system()
    rng = np.random.default_rng(3)
    z = 8e-3 * rng.standard_normal(2 * system.size) / lengths(system, omega)
    turn = 2.0 * np.pi / omega
    run = ff.simulate(machine, omega, 3, z, t=[3.0 * turn])
    path = dop853(integrate.Machine.of(system), z, omega, 0.0, 3.0 * turn)
    close("displacements", run.x[-1], path.final[: system.size], abs=1e-9)
    energy = run.energy
    given = energy["input"] + energy["impulses"] + energy["loads"]
    size = max(abs(value) for value in energy.values())
    close("energy", given, energy["dissipated"] + energy["stored"], abs=1e-9 * size)


def test_a_drift_that_nothing_holds_is_no_loss_of_symmetry() -> None:
    """A free pair between stops far apart: over half a turn an eigenvalue is -1 all along."""
    K = np.array([[1.0, -1.0], [-1.0, 1.0]])
    stop = ff.ClearanceSpring([1.0, 0.0], 5.0, 0.1, 40.0)
    C = 0.05 * K + 0.02 * np.eye(2)
    machine = ff.MechanicalSystem(np.eye(2), C, K, [stop], ff.HarmonicForce([1.0, 0.0]))
    branch = ff.frequency_response(machine, (0.8, 1.2))
    assert branch.complete
    assert branch.special_points == ()
