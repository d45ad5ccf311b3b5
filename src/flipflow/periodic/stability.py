"""Multipliers, stability words, and the test functions whose zeros are special points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Complex, Real

STABLE, UNSTABLE, UNDETERMINED = "stable", "unstable", "undetermined"
RETURNS = {
    STABLE: "returns", UNSTABLE: "does not return", UNDETERMINED: "is not sure to return",
}  # fmt: skip
NEAR_ONE = 1e-6  # distance of the largest modulus from 1 within which stability is undetermined
LARGEST_LOG = 690.0  # logarithm above which a determinant is cut off, near the largest number
SADDLE_NODE_BAND = 0.2  # distance from +1 within which the Jacobian overrules a real multiplier


def full_turn(eigenvalues: Complex, *, half_turn: bool) -> Complex:
    """Multipliers of the whole turn, largest modulus first, shape (P, 2 N)."""
    mu = eigenvalues**2 if half_turn else eigenvalues
    order = np.argsort(-np.abs(mu), axis=-1, kind="stable")
    return np.take_along_axis(mu, order, axis=-1)


def stability_words(
    eigenvalues: Complex, saddle_side: NDArray[np.bool_] | None
) -> NDArray[np.str_]:
    """Stability of motions with return-map eigenvalues (P, 2 N), a word each.

    ``saddle_side`` tells where the Jacobian of the equations has an odd number of positive
    real eigenvalues beyond +1. Near a fold this decides, because the multipliers of a truncated
    series cross +1 a little beside the fold of its own branch. With None the multipliers decide.
    """
    size = np.abs(eigenvalues)
    words = np.full(eigenvalues.shape[0], UNDETERMINED, dtype="<U12")
    if saddle_side is None:
        largest = size.max(axis=1)
    else:
        real = np.abs(eigenvalues.imag) <= 1e-9 * np.maximum(size, 1e-300)
        distance = np.where(real, np.abs(eigenvalues.real - 1.0), np.inf)
        nearest = distance.argmin(axis=1)
        rows = np.arange(nearest.size)
        beyond = ((eigenvalues.real > 1.0) & real).sum(axis=1) % 2 == 1
        differs = (beyond != saddle_side) & (distance[rows, nearest] < SADDLE_NODE_BAND)
        clear = size.copy()
        clear[rows[differs], nearest[differs]] = np.where(saddle_side[differs], 2.0, 0.0)
        largest = clear.max(axis=1)
        contradiction = (beyond != saddle_side) & ~differs
        largest[contradiction] = 1.0
    words[largest < 1.0 - NEAR_ONE] = STABLE
    words[largest > 1.0 + NEAR_ONE] = UNSTABLE
    return words


def saddle_side(omega_tangent: Real, eigenvalues: Complex) -> NDArray[np.bool_]:
    """Where an odd number of real eigenvalues lies beyond +1, told by the sign of d omega / ds."""
    return np.asarray((omega_tangent < 0.0) ^ beyond_where_rising(omega_tangent, eigenvalues))


def beyond_where_rising(omega_tangent: Real, eigenvalues: Complex) -> bool:
    """Whether an odd number of real eigenvalues lies beyond +1 where the branch rises in omega.

    Read off the first motion: the number changes by one where d omega / ds changes sign.
    """
    if eigenvalues.shape[0] == 0:
        return False
    first = eigenvalues[0]
    beyond = int(np.sum((np.abs(first.imag) < 1e-9) & (first.real > 1.0))) % 2 == 1
    return beyond ^ bool(omega_tangent[0] < 0.0)


def determinant_plus(maps: Real) -> Real:
    """det(I + map): zero at an eigenvalue -1, NaN where the flow failed."""
    return _determinant(np.eye(maps.shape[-1]) + maps)


def determinant_minus(maps: Real) -> Real:
    """det(I - map): zero at an eigenvalue +1, NaN where the flow failed."""
    return _determinant(np.eye(maps.shape[-1]) - maps)


def _determinant(matrices: Real) -> Real:
    known = np.isfinite(matrices).all(axis=(-2, -1))
    found = np.full(matrices.shape[:-2], np.nan)
    # The map of a wild motion has entries whose products no number holds.
    sign, size = np.linalg.slogdet(matrices[known])
    found[known] = sign * np.exp(np.minimum(size, LARGEST_LOG))
    return found


def neimark_sacker(eigenvalues: Complex) -> Real:
    """prod over pairs i < j of (1 - lambda_i lambda_j): zero where a pair has modulus one."""
    i, j = np.triu_indices(eigenvalues.shape[-1], k=1)
    first, second = eigenvalues[..., i], eigenvalues[..., j]
    with np.errstate(over="ignore", invalid="ignore"):
        found = np.asarray(np.prod(1.0 - first * second, axis=-1).real)
    # Where no number holds the product, each factor is taken as a share of its size, and the sizes
    # are added up as logarithms.
    beyond = (~np.isfinite(found) | (found == 0.0)) & np.isfinite(eigenvalues).all(axis=-1)
    if beyond.any():
        first, second = first[beyond], second[beyond]
        of_first, of_second = (np.maximum(np.abs(one), 1.0) for one in (first, second))
        factors = 1.0 / of_first / of_second - (first / of_first) * (second / of_second)
        some = (factors != 0.0).all(axis=-1)
        size = np.log(np.abs(factors), out=np.zeros(factors.shape), where=factors != 0.0)
        most = np.clip(size.sum(axis=-1), -LARGEST_LOG, LARGEST_LOG)
        found[beyond] = some * np.cos(np.angle(factors).sum(axis=-1)) * np.exp(most)
    return found


def has_unit_pair(eigenvalues: Complex) -> bool:
    """Whether a truly complex pair stands on the unit circle."""
    complex_ones = np.abs(eigenvalues.imag) > 1e-6
    return bool(np.any(complex_ones & (np.abs(np.abs(eigenvalues) - 1.0) < 1e-5)))
