"""Jacobians of both residuals by central differences; saltation; heavy damping."""

from __future__ import annotations

import math
from typing import get_args

import numpy as np
import pytest

import flipflow as ff
from flipflow.dynamics.assembly import machine_arrays
from flipflow.model.contact_law import ContactLaw
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.sampled import new_sampled, new_sampled_work
from flipflow.periodic.series import new_balance, new_balance_work
from flipflow.periodic.shooting import new_shooting, new_shooting_work
from judge import close
from kernel_calls import balance, central_differences, jump, residual_of, shoot
from reference import integrate

pytestmark = pytest.mark.numerical
BALANCED = ("paper", "compression-only")  # what a series holds
CASES = {"symmetric": None, "unequal gaps": 5e-3, "one-sided": math.inf}
LENGTH = 6e-3


def machine(screen, law: str, minus: float | None) -> ff.MechanicalSystem:
    """FFS0827 with a stop damping that makes clipping matter."""
    return screen.replace(stop_law=law, clearance_minus=minus, stop_damping=40e3).system()


def scaled(J: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    return J * columns / rows[:, None]


@pytest.mark.parametrize("law", get_args(ContactLaw))
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize(
    ("omega", "z"),
    [
        (120.0, (8e-3, 1e-3, 0.1, -1.2)),
        (20.0, (1e-3, 2e-3, 0.01, 0.02)),
        (200.0, (-9e-3, 11e-3, 1.0, -2.7)),
    ],
)
def test_jacobian_of_shooting(screen, law: str, case: str, omega: float, z) -> None:
    """dr/dz and dr/d omega over half and whole turns: 1e-6, what central differences give.

    In metres and velocities over omega, so that all entries are of one size.
    """
    arrays = machine_arrays(machine(screen, law, CASES[case]))
    z = np.array(z)
    scale = np.array([1.0, 1.0, omega, omega])
    for half_turn in (True, False) if case == "symmetric" else (False,):
        problem = new_shooting(arrays, half_turn=half_turn, length=LENGTH)
        evaluate = residual_of(shoot, problem, new_shooting_work(arrays), 4)
        _, J = evaluate(z, omega)
        F = central_differences(evaluate, z, omega, np.append(1e-6 * scale, 1e-5 * omega))
        columns = np.append(scale, 1.0)
        size = np.abs(scaled(J, scale, columns)).max(axis=0)
        off = np.abs(scaled(F - J, scale, columns)).max(axis=0) / size
        assert np.all(off < 1e-6), f"relative differences {off}"


@pytest.mark.parametrize("law", BALANCED)
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("order", [1, 5, 12])
def test_jacobian_of_harmonic_balance(screen, law: str, case: str, order: int) -> None:
    """dr/du and dr/d omega with all moving limits of contact in it: 1e-5 of each column.

    The limits move with the root of small changes, hence a digit less than for smooth functions.
    """
    symmetric = CASES[case] is None
    arrays = machine_arrays(machine(screen, law, CASES[case]))
    problem = new_balance(arrays, order, half_turn=symmetric, length=LENGTH)
    unknowns = 2 * np.count_nonzero(problem.harmonics) + np.count_nonzero(problem.harmonics == 0)
    rng = np.random.default_rng(order)
    u = rng.normal(size=unknowns) * 1.0e-3
    u[0 if symmetric else 1] = 9e-3
    work = new_balance_work(problem)
    evaluate = residual_of(balance, problem, work, unknowns)
    _, J = evaluate(u, 120.0)
    assert work.flow.segments[0] > 1, "there is contact in this test"
    F = central_differences(evaluate, u, 120.0, np.append(np.full(unknowns, 1e-9), 1e-4))
    off = np.abs(F - J).max(axis=0) / np.abs(J).max(axis=0)
    assert np.all(off < 1e-5), f"relative differences {off}"


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("order", [1, 5, 12])
@pytest.mark.parametrize("sharpness", [300.0, 3e4])
def test_jacobian_of_sampled_balance(screen, case: str, order: int, sharpness: float) -> None:
    """dr/du and dr/d omega of the smooth law, in and beside its layer: 1e-5 of each column.

    The switch has curvature sharpness^2, so that the differences step by 1e-4 of its layer.
    """
    symmetric = CASES[case] is None
    arrays = machine_arrays(machine(screen, "paper", CASES[case]))
    balanced = new_balance(arrays, order, half_turn=symmetric, length=LENGTH)
    problem = new_sampled(balanced, 256, sharpness)
    kept = balanced.harmonics
    unknowns = 2 * np.count_nonzero(kept) + np.count_nonzero(kept == 0)
    u = np.random.default_rng(order).normal(size=unknowns) * 1.0e-3
    u[0 if symmetric else 1] = 9e-3
    work = new_sampled_work(new_balance_work(balanced))
    evaluate = residual_of(balance, problem, work, unknowns)
    _, J = evaluate(u, 120.0)
    assert work.beyond[0] > 0, "there is contact in this test"
    step = min(1e-7, 1e-4 / sharpness)
    F = central_differences(evaluate, u, 120.0, np.append(np.full(unknowns, step), 1e-3))
    off = np.abs(F - J).max(axis=0) / np.abs(J).max(axis=0)
    assert np.all(off < 1e-5), f"relative differences {off}"


def test_jacobians_with_several_springs() -> None:
    """Three masses, two springs, a mean: places of the unknowns do not mix."""
    shape = 2.0 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1)
    springs = (
        ff.ClearanceSpring([1.0, -1.0, 0.0], 8.0, 0.3, 0.4, 0.5),
        ff.ClearanceSpring([0.0, 0.0, 1.0], 5.0, 0.5, 0.6, math.inf, "compression-only"),
    )
    system = ff.MechanicalSystem(
        np.eye(3), 0.1 * shape, shape, springs, ff.HarmonicForce([1.0, 0.0, 0.3j])
    )
    arrays = machine_arrays(system)
    problem = new_balance(arrays, 4, half_turn=False, length=0.4)
    u = np.random.default_rng(2).normal(size=18) * 0.3
    u[2:6] = [0.7, 0.2, -0.4, 0.9]
    evaluate = residual_of(balance, problem, new_balance_work(problem), 18)
    _, J = evaluate(u, 1.1)
    F = central_differences(evaluate, u, 1.1, np.full(19, 1e-7))
    close("dr/d(u, omega)", F, J, abs=1e-5 * np.abs(J).max())
    whole = new_shooting(arrays, half_turn=False, length=0.4)
    flow = residual_of(shoot, whole, new_shooting_work(arrays), 6)
    z = np.array([0.5, -0.3, 0.4, 0.2, -0.6, 0.8])
    _, J = flow(z, 1.1)
    F = central_differences(flow, z, 1.1, np.full(7, 3e-5))
    close("dr/d(z, omega)", F, J, abs=1e-6 * np.abs(J).max())


def test_saltation_kernel(screen) -> None:
    """In (x1, x2) the entries are -c3/m1, -c3 (1/m1 + 1/m2); at the exit with +."""
    arrays = machine_arrays(screen.system())
    c3, m1, m2 = screen.stop_damping, screen.main_mass, screen.floating_mass
    to_relative = np.kron(np.eye(2), [[1.0, 0.0], [1.0, -1.0]])
    for sign in (-1.0, 1.0):
        U = np.eye(4)
        jump(arrays, 0, sign, U)
        S = to_relative @ U @ np.linalg.inv(to_relative)
        expected = np.eye(4)
        expected[2:, 1] = sign * c3 * np.array([1.0 / m1, 1.0 / m1 + 1.0 / m2])
        close("saltation", S, expected, abs=1e-9)


def damped(ratio: float) -> ff.MechanicalSystem:
    """Two masses, modes of 1 and sqrt(3) rad/s; the slow one at ``ratio`` of critical damping."""
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    stop = ff.ClearanceSpring([1.0, -1.0], 20.0, 0.4, 0.3)
    return ff.MechanicalSystem(
        np.eye(2), 2.0 * ratio * np.eye(2), K, (stop,), ff.HarmonicForce([3.0, -1.0])
    )


@pytest.mark.parametrize("ratio", [1.0, math.sqrt(3.0), 1.5, 4.0])
def test_overdamped_and_critically_damped_flow(ratio: float) -> None:
    """One turn against DOP853 to 1e-8: real eigenvalues, and a defective pair at critical damping.

    At critical damping the basis is nudged by 1e-10, which costs up to half the digits.
    """
    system, omega = damped(ratio), 0.9
    z = np.array([0.5, -0.4, 0.3, -0.6])
    solver = ExactSolver(system, half_turn=False)
    end = 2.0 * np.pi / omega
    expected = integrate.flow(integrate.Machine.of(system), z, omega, 0.0, end).final
    close("state after a turn", solver.settled(z, omega, 1), expected, abs=1e-8)


@pytest.mark.parametrize("method", [None, ff.HarmonicBalance(15)], ids=["exact", "H15"])
@pytest.mark.parametrize("ratio", [1.0, math.sqrt(3.0), 1.5, 4.0])
def test_overdamped_and_critically_damped_branch(ratio: float, method) -> None:
    """The branch completes, has contact, all of it is stable, and its motions are motions."""
    system = damped(ratio)
    branch = ff.frequency_response(system, (0.2, 2.0), method)
    assert branch.status.complete
    assert set(branch.stability) == {"stable"}
    orbit = branch.orbits_at(0.9)[0]
    path = integrate.flow(integrate.Machine.of(system), orbit.state, 0.9, 0.0, orbit.period)
    size = orbit.amplitude(0)
    tolerance = 1e-8 * size if method is None else 6.0 * orbit.error
    close("back after the turn", path.final[:2], orbit.state[:2], abs=tolerance)
    assert len(orbit.motion.contact_intervals()) == 2


@pytest.mark.parametrize("ratio", [0.3, 1.2])
def test_determinant_when_overdamped(ratio: float) -> None:
    """det M = exp(-T trace(M^-1 C) - t_c c d^T M^-1 d), also with real eigenvalues; 1e-9.

    Over half a turn, whose determinant is the root: the whole turn forgets 15 digits.
    """
    branch = ff.frequency_response(damped(ratio), (0.2, 2.0))
    orbit = branch.orbits_at(0.9)[0]
    expected = math.exp(-orbit.period / 2.0 * (4.0 * ratio + orbit.contact_share() * 0.4 * 2.0))
    close("determinant", np.linalg.det(orbit.return_map), expected, rel=1e-9)
