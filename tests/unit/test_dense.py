"""The kernels' linear algebra against numpy."""

from __future__ import annotations

import numpy as np
import pytest

from judge import close
from kernel_calls import solve, spread

pytestmark = pytest.mark.numerical


@pytest.mark.parametrize("n", [1, 2, 5, 30])
@pytest.mark.parametrize("seed", range(5))
def test_solution_and_sign(n: int, seed: int) -> None:
    """Against numpy.linalg: backward stable, so 1e-10 relative for these sizes."""
    rng = np.random.default_rng(seed)
    A, b = rng.normal(size=(n, n)), rng.normal(size=n)
    x = b.copy()
    sign = solve(A.copy(), np.zeros(n, np.int64), x)
    expected = np.linalg.solve(A, b)
    close("solution", x, expected, abs=1e-10 * np.abs(expected).max() * np.linalg.cond(A) ** 0.5)
    assert sign == np.sign(np.linalg.det(A))


def test_pivoting() -> None:
    """A zero on the diagonal is no obstacle."""
    A, b = np.array([[0.0, 2.0], [3.0, 0.0]]), np.array([4.0, 9.0])
    assert solve(A, np.zeros(2, np.int64), b) == -1.0
    close("solution", b, [3.0, 2.0], abs=1e-15)


def test_singular_is_said() -> None:
    A = np.array([[1.0, 2.0], [2.0, 4.0]])
    assert solve(A, np.zeros(2, np.int64), np.ones(2)) == 0.0


def test_not_finite_is_said() -> None:
    A = np.array([[np.nan, 1.0], [1.0, 1.0]])
    assert solve(A, np.zeros(2, np.int64), np.ones(2)) == 0.0


@pytest.mark.parametrize("least", [1e-2, 1e-4, 1e-8])
@pytest.mark.parametrize("seed", range(5))
def test_nearness_to_a_singular_matrix(least: float, seed: int) -> None:
    """By the smallest eigenvalue, a hundredth of the others here, over the largest pivot."""
    rng = np.random.default_rng(seed)
    V = np.linalg.qr(rng.normal(size=(8, 8)))[0] @ np.diag(rng.uniform(0.5, 2.0, 8))
    A = V @ np.diag([*rng.uniform(1.0, 2.0, 7), least]) @ np.linalg.inv(V)
    factors = A.copy()
    told = spread(factors, np.zeros(8, np.int64), np.zeros(8))
    close("size", told, least / np.abs(np.diag(factors)).max(), rel=0.05)
