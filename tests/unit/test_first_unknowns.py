"""Where contact begins below a speed, and the motion that is reached from there."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flipflow as ff
from flipflow.continuation.branch_status import BranchStatus
from flipflow.continuation.frequency_response import first_unknowns
from flipflow.dynamics.contact_free import complex_amplitudes
from flipflow.dynamics.contact_free_range import FINEST, contact_free_up_to
from flipflow.periodic.exact_solver import ExactSolver

pytestmark = pytest.mark.numerical
SCAN = 8001

# Just above the first contact its symmetric motion loses its stability to two that lean.
LEANING = {
    "main_mass": 625.9,
    "floating_mass": 813.2,
    "eccentric_moment": 5.044,
    "isolation_stiffness": 1.777e6,
    "isolation_damping": 1802.0,
    "shear_stiffness": 9.601e5,
    "shear_damping": 1287.0,
    "stop_stiffness": 1.055e7,
    "stop_damping": 1455.0,
    "clearance": 0.9063e-3,
}
# Its stop has a corner in the branch where contact begins, which only short steps turn.
CORNERED = {
    "main_mass": 1877.0,
    "floating_mass": 177.8,
    "eccentric_moment": 1.615,
    "isolation_stiffness": 1.753e6,
    "isolation_damping": 11480.0,
    "shear_stiffness": 1.241e6,
    "shear_damping": 850.0,
    "stop_stiffness": 6.587e6,
    "stop_damping": 4122.0,
    "clearance": 8.763e-3,
    "stop_law": "compression-only",
}


def screen(changes):
    return ff.load("ffs0827").replace(**changes)


def solver_of(machine, *, half_turn=False):
    return ExactSolver(machine.system(), half_turn=half_turn)


def free_up_to(machine, omega):
    solver = solver_of(machine)
    return contact_free_up_to(solver.machine, solver.flow.modes, omega)


def some_chain(rng):
    """A row of masses with stops between them and to the ground, some on one side only."""
    n = int(rng.integers(1, 6))
    links = np.eye(n) - np.eye(n, k=1)
    K = links.T @ np.diag(rng.uniform(1e6, 5e6, n)) @ links
    stops = [
        ff.ClearanceSpring(
            links[rng.integers(n)], 5e6, 2e3, rng.uniform(1e-3, 8e-3),
            rng.choice([5e-3, math.inf]),
        )
        for _ in range(rng.integers(1, 4))
    ]  # fmt: skip
    force = rng.choice([ff.Unbalance, ff.HarmonicForce])(np.eye(n)[0] * rng.uniform(1.0, 9.0))
    return ff.MechanicalSystem(
        np.diag(rng.uniform(200.0, 900.0, n)), rng.uniform(5e-4, 5e-3) * K, K, stops, force
    )


@pytest.mark.parametrize("seed", range(20))
def test_no_motion_below_meets_a_gap_and_one_just_above_does(seed):
    rng = np.random.default_rng(seed)
    machine = some_chain(rng)
    omega = rng.uniform(20.0, 250.0)
    free = free_up_to(machine, omega)

    def meets(speeds):
        X = complex_amplitudes(machine.system(), speeds)
        return np.any(
            [np.abs(X @ s.direction) >= min(s.gaps) for s in machine.springs], axis=0
        )  # fmt: skip

    assert not meets(np.linspace(free / SCAN, free, SCAN)).any()
    if free < omega:
        assert meets(np.linspace(free, free + FINEST * omega, SCAN)).any()


def test_contact_is_met_at_the_last_frequency_or_not_at_all():
    machine = ff.load("ffs0827")
    begins = free_up_to(machine, 120.0)
    assert begins == pytest.approx(81.07, abs=120.0 * FINEST)
    assert free_up_to(machine, 81.0) == 81.0
    assert free_up_to(machine.replace(clearance=1.0), 250.0) == 250.0


def test_nothing_is_free_of_contact_without_a_gap_or_under_a_large_constant_force():
    touching = screen({"clearance": 0.0, "clearance_minus": 6e-3})
    assert free_up_to(touching, 100.0) == 0.0
    system = ff.load("ffs0827").system()
    pressed = ff.MechanicalSystem(
        system.M, system.C, system.K, system.springs, ff.HarmonicForce([0.0, 1e6])
    )
    assert free_up_to(pressed, 100.0) == 0.0


@pytest.mark.parametrize("omega", [72.0, 73.165])
def test_a_symmetric_machine_does_not_lean_whatever_the_solver(omega):
    machine = screen(LEANING)
    half, whole = solver_of(machine, half_turn=True), solver_of(machine)
    symmetric = half.solve(first_unknowns(half, omega), omega)
    reached = whole.solve(first_unknowns(whole, omega), omega)
    size = np.abs(symmetric.u)
    assert np.all(np.abs(reached.u - symmetric.u) <= 1e-9 * size.max())
    assert np.abs(half.residual(reached.u, omega)[0]).max() < 1e-9 * size.max()


def test_long_steps_go_round_corners():
    machine, omega = screen(CORNERED), 210.0
    solver = solver_of(machine, half_turn=True)
    first = solver.solve(first_unknowns(solver, omega), omega)
    # A machine whose speed is raised in small steps keeps to the same motion: it does not jump.
    state = np.zeros(4)
    for speed in np.linspace(60.0, omega, 151):
        state = solver.settled(state, speed, 400)
    assert np.allclose(first.u, state, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("size", [2, 3])
def test_at_the_resonance_of_an_undamped_mode_there_is_no_motion(size):
    first = np.eye(size)[0]
    K = np.diag([1.0, 4.0, 9.0][:size])
    machine = ff.MechanicalSystem(np.eye(size), np.diag(0.1 * first), K, (), ff.Unbalance(first))
    branch = ff.frequency_response(machine, (2.0, 3.0))
    assert branch.omega.size == 0
    assert branch.status in (BranchStatus.NOT_FINITE, BranchStatus.NO_MODES)


@pytest.mark.parametrize("omega", np.linspace(70.0, 245.0, 8).tolist())
def test_the_only_motion_is_the_one_to_which_every_way_up_leads(omega):
    """FFS0827 has one motion at most of these speeds, and three between its folds."""
    solver = solver_of(screen({}), half_turn=True)
    branch = ff.frequency_response(screen({}), omega=(5.0, 250.0))
    reached = solver.solve(first_unknowns(solver, omega), omega)
    assert reached.u == pytest.approx(branch.orbit_from_below(omega).unknowns, rel=1e-9)
