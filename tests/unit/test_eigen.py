"""Eigenvalues and modes by our own kernels against LAPACK and the matrix exponential."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

import flipflow as ff
from flipflow.compiled.eigen import eigenvalues
from flipflow.dynamics.assembly import machine_arrays
from flipflow.periodic.exact_solver import ExactSolver
from reference import integrate

pytestmark = pytest.mark.numerical

EPS = np.finfo(float).eps


def largest_gap(one: np.ndarray, other: np.ndarray) -> float:
    """The greatest distance from a number of one set to the nearest of the other."""
    apart = np.abs(one[:, None] - other[None, :])
    return float(max(apart.min(axis=0).max(), apart.min(axis=1).max()))


def matrices():
    """Random ones, and such as are hard for an iteration: cycles, zero diagonals, clusters."""
    rng = np.random.default_rng(7)
    for n in (1, 2, 3, 4, 7, 12, 20):
        yield f"random {n}", rng.standard_normal((n, n))
        yield f"graded {n}", rng.standard_normal((n, n)) * 10.0 ** rng.uniform(-6, 6, (n, 1))
        half = rng.standard_normal((n, n))
        yield f"symmetric {n}", half + half.T
        yield f"cycle {n}", np.roll(np.eye(n), 1, axis=0)
        yield f"orthogonal {n}", np.linalg.qr(rng.standard_normal((n, n)))[0]
        beside = rng.standard_normal(max(n - 1, 0))
        yield f"zero diagonal {n}", np.diag(beside, 1) - np.diag(beside, -1)
        yield f"zeros and ones {n}", (rng.random((n, n)) < 0.3).astype(float)
    yield "tiny", 1e-150 * rng.standard_normal((4, 4))
    yield "huge", 1e150 * rng.standard_normal((4, 4))
    yield "zero", np.zeros((5, 5))


MATRICES = dict(matrices())


@pytest.mark.parametrize("name", MATRICES)
def test_eigenvalues_are_those_of_lapack(name):
    """To the rounding that the matrix's own condition allows: of multiple ones the mean tells."""
    A = MATRICES[name]
    found, known = eigenvalues(A), np.linalg.eigvals(A)
    size = np.abs(A).max() or 1.0
    assert np.isfinite(found).all()
    assert found.sum() == pytest.approx(np.trace(A), abs=200 * EPS * size * len(A))
    scaled = found / size
    back = np.prod(scaled), np.prod(known / size)
    assert back[0] == pytest.approx(back[1], abs=1e-9 * max(1.0, abs(back[1])))
    if name.split()[0] in ("random", "symmetric", "cycle", "orthogonal", "graded", "tiny", "huge"):
        assert largest_gap(found, known) < 1e-10 * size
    pairs = found[found.imag > 0.0]
    assert all(np.any(found == value.conjugate()) for value in pairs), "pairs are exact"


def test_a_double_eigenvalue_splits_by_the_root_of_rounding():
    """One eigenvector: 1e-8 apart, the mean right to rounding."""
    found = eigenvalues(np.array([[0.5, 1.0], [0.0, 0.5]]) + 1e-17)
    assert np.abs(found - 0.5).max() < 3e-8
    assert found.mean() == pytest.approx(0.5, abs=1e-15)


def test_what_is_not_finite_has_no_eigenvalues():
    stack = np.stack([np.full((3, 3), np.nan), np.eye(3)])
    found = eigenvalues(stack)
    assert np.isnan(found[0]).all()
    assert found[1] == pytest.approx(np.ones(3))


def frames(count: int) -> ff.MechanicalSystem:
    """A main frame and some floating frames, all alike: their modes coincide."""
    n = count + 1
    K, C = np.zeros((n, n)), np.zeros((n, n))
    for k in range(1, n):
        d = np.eye(n)[0] - np.eye(n)[k]
        K, C = K + 2.0 * np.outer(d, d), C + 0.02 * np.outer(d, d)
    K[0, 0], C[0, 0] = K[0, 0] + 1.0, C[0, 0] + 0.05
    stop = ff.ClearanceSpring(np.eye(n)[0] - np.eye(n)[1], 5.0, 0.05, 0.4)
    return ff.MechanicalSystem(
        np.diag([2.0, *[1.0] * count]), C, K, (stop,), ff.HarmonicForce([0.5, *[0.0] * count])
    )


def ring(count: int) -> ff.MechanicalSystem:
    """Masses in a ring, each to its neighbours and to the ground: conjugate pairs twice each."""
    K = 3.0 * np.eye(count) - np.roll(np.eye(count), 1, axis=0) - np.roll(np.eye(count), -1, axis=0)
    stop = ff.ClearanceSpring(np.eye(count)[0], 5.0, 0.05, 0.4)
    force = ff.HarmonicForce([0.5, *[0.0] * (count - 1)])
    return ff.MechanicalSystem(np.eye(count), 0.05 * K, K, (stop,), force)


def damped_alike(count: int, ratio: float) -> ff.MechanicalSystem:
    """Uncoupled equal masses at a share of critical damping."""
    stop = ff.ClearanceSpring(np.eye(count)[0], 5.0, 0.05, 0.4)
    force = ff.HarmonicForce([4.0, *[0.1] * (count - 1)])
    return ff.MechanicalSystem(
        np.eye(count), 2.0 * ratio * np.eye(count), np.eye(count), (stop,), force
    )


ALIKE = {
    **{f"{k} frames": frames(k) for k in (2, 3, 4, 6)},
    **{f"ring of {k}": ring(k) for k in (3, 4, 5, 6)},
    **{f"{k} masses alike": damped_alike(k, 0.1) for k in (2, 3)},
    **{f"{k} overdamped": damped_alike(k, 1.5) for k in (2, 3)},
    "one critical": damped_alike(1, 1.0),
}


@pytest.mark.parametrize("name", ALIKE)
def test_modes_that_coincide_carry_the_state_as_the_exponential_does(name):
    """exp(A t) z without force, while the stop stays open: 1e-9, of critical damping 1e-7."""
    system = ALIKE[name]
    n = system.size
    quiet = ff.MechanicalSystem(
        system.M, system.C, system.K, system.springs, ff.HarmonicForce(np.full(n, 1e-300))
    )
    solver = ExactSolver(quiet, half_turn=False)
    arrays = machine_arrays(quiet)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-arrays.stiffness, -arrays.damping]])
    z = 0.05 * np.random.default_rng(1).standard_normal(2 * n)
    carried = solver.settled(z, 2.0 * math.pi, 1)
    tolerance = 1e-7 if name == "one critical" else 1e-9
    assert carried == pytest.approx(expm(A) @ z, abs=tolerance * np.abs(z).max())


@pytest.mark.parametrize("name", [name for name in ALIKE if name != "one critical"])
def test_motions_of_machines_with_equal_parts(name):
    """With contact, against event-located DOP853 over a turn: equal parts once gave wrong modes."""
    system = ALIKE[name]
    branch = ff.frequency_response(system, (0.3, 1.5), ff.PiecewiseExact(60))
    assert branch.complete
    touching = [i for i in range(branch.omega.size) if branch.traced.signature[i] != 0]
    orbit = branch.orbit(touching[len(touching) // 2])
    machine = integrate.Machine.of(system)
    path = integrate.flow(machine, orbit.state, orbit.omega, 0.0, orbit.period)
    assert path.final == pytest.approx(orbit.state, abs=1e-8 * np.abs(orbit.state).max())
