"""Small dense linear algebra, in place, for matrices of a few to a few hundred rows."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.compile import kernel

INVERSE_STEPS = 3  # of inverse iteration, each a solve: right to a factor of 2 where it is small


@kernel
def multiply(A: NDArray[np.float64], B: NDArray[np.float64], C: NDArray[np.float64]) -> None:
    """The first columns of C become A B."""
    for i in range(A.shape[0]):
        for c in range(B.shape[1]):
            C[i, c] = 0.0
        for k in range(A.shape[1]):
            entry = A[i, k]
            for c in range(B.shape[1]):
                C[i, c] += entry * B[k, c]


@kernel
def lu_factor(A: NDArray[np.float64], pivot: NDArray[np.int64]) -> bool:
    """Replace A by its LU factors with row pivoting; False when a pivot vanishes."""
    n = A.shape[0]
    for k in range(n):
        p = k
        for i in range(k + 1, n):
            if abs(A[i, k]) > abs(A[p, k]):
                p = i
        pivot[k] = p
        if A[p, k] == 0.0 or not np.isfinite(A[p, k]):
            return False
        if p != k:
            for j in range(n):
                A[k, j], A[p, j] = A[p, j], A[k, j]
        for i in range(k + 1, n):
            factor = A[i, k] / A[k, k]
            A[i, k] = factor
            if factor != 0.0:
                for j in range(k + 1, n):
                    A[i, j] -= factor * A[k, j]
    return True


@kernel
def lu_solve(A: NDArray[np.float64], pivot: NDArray[np.int64], b: NDArray[np.float64]) -> None:
    """Replace b by the solution of the factored system."""
    n = A.shape[0]
    for k in range(n):
        p = pivot[k]
        if p != k:
            b[k], b[p] = b[p], b[k]
    for k in range(n):
        for i in range(k + 1, n):
            b[i] -= A[i, k] * b[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] -= A[k, j] * b[j]
        b[k] /= A[k, k]


@kernel
def lu_sign(A: NDArray[np.float64], pivot: NDArray[np.int64]) -> float:
    """Sign of the determinant of the factored matrix."""
    sign = 1.0
    for k in range(A.shape[0]):
        if pivot[k] != k:
            sign = -sign
        if A[k, k] < 0.0:
            sign = -sign
    return sign


@kernel
def lu_determinant(A: NDArray[np.float64], pivot: NDArray[np.int64]) -> float:
    """Determinant of the factored matrix."""
    determinant = lu_sign(A, pivot)
    for k in range(A.shape[0]):
        determinant *= abs(A[k, k])
    return determinant


@kernel
def lu_spread(A: NDArray[np.float64], pivot: NDArray[np.int64], b: NDArray[np.float64]) -> float:
    """Size of the factored matrix's smallest eigenvalue, as a share of its largest pivot.

    By inverse iteration, in scratch b: no pivot of a matrix that is nearly singular need be small.
    """
    n, most, size = A.shape[0], 0.0, 1.0
    for k in range(n):
        most = max(most, abs(A[k, k]))
        b[k] = 1.0 / (1.0 + k)
    for _ in range(INVERSE_STEPS):
        lu_solve(A, pivot, b)
        square = 0.0
        for k in range(n):
            square += b[k] ** 2
        size = math.sqrt(square)
        for k in range(n):
            b[k] /= size
    return 1.0 / (size * most)
