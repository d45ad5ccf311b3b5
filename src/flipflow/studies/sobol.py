"""Sobol indices: the sample that needs no second order, and the estimators on its values.

Nothing here knows of machines: :func:`saltelli_sample` gives points of the unit cube, any function
of them gives values, :func:`sobol_indices` makes indices of those. Sample and estimators are
SALib's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Real
from flipflow.errors import required

RESAMPLES = 100  # of the bootstrap that gives the confidence intervals
NORMAL_95 = 1.959963984540054  # standard deviations of a normal distribution to each side: 95 %
# Spread below this share of the largest value is rounding, not variance.
CONSTANT = 1e-12
LEAST_GROUPS = 2  # groups of samples without which no variance can be estimated


@dataclass(frozen=True, eq=False)
class SobolIndices:
    """Indices of K outputs on D inputs.

    Parameters
    ----------
    first_order, total
        S_i and S_Ti, (K, D); 0 where an output is constant, NaN where too few groups are left.
    first_order_confidence, total_confidence
        Half widths of the 95 % confidence intervals, (K, D).
    mean, variance
        Of the outputs over the independent samples, (K,).
    groups
        Groups of D + 2 values without a failed one, (K,).
    constant
        Outputs that do not vary, (K,).
    """

    first_order: Real
    total: Real
    first_order_confidence: Real
    total_confidence: Real
    mean: Real
    variance: Real
    groups: NDArray[np.int64]
    constant: NDArray[np.bool_]


def saltelli_sample(inputs: int, n: int, seed: int | np.random.Generator) -> Real:
    """Points of the unit cube, (n, inputs + 2, inputs): A, then A with column i of B, then B.

    Raises
    ------
    MissingExtra
        When SALib is not installed.
    """
    sobol = _salib("SALib.sample.sobol")
    problem = {
        "num_vars": inputs,
        "names": [f"x{k}" for k in range(inputs)],
        "bounds": [[0.0, 1.0]] * inputs,
    }
    # The first n of a power of two, without the warning that any other number comes with: that is
    # allowed, and the result says so in its notes.
    whole = 1 << (n - 1).bit_length()
    points = sobol.sample(problem, whole, calc_second_order=False, seed=seed)
    return np.asarray(points).reshape(whole, inputs + 2, inputs)[:n]


def sobol_indices(values: Real, rng: np.random.Generator) -> SobolIndices:
    r"""First-order and total indices of values at the points of :func:`saltelli_sample`.

    With A, B and A_B^(i) the values of a group,

    .. math:: S_i = \frac{\overline{B (A_B^{(i)} - A)}}{V}, \qquad
              S_{Ti} = \frac{\overline{(A - A_B^{(i)})^2}}{2 V},

    V the variance over A and B together (Saltelli and others, 2010, rows b and f of table 2). The
    intervals are 1.96 standard deviations over 100 bootstrap resamples of the groups. A group with
    a value that is not finite is left out as a whole: what remains are still pairs that differ in
    one input alone.

    Parameters
    ----------
    values
        Shape (n, D + 2, K).
    rng
        Draws the resamples.
    """
    n, rows, outputs = values.shape
    whole = np.isfinite(values).all(axis=1)
    first, total, first_width, total_width = np.full((4, outputs, rows - 2), np.nan)
    mean, variance = np.full((2, outputs), np.nan)
    still = np.zeros(outputs, dtype=bool)
    groups = whole.sum(axis=0)
    found = SobolIndices(first, total, first_width, total_width, mean, variance, groups, still)
    drawn = rng.integers(n, size=(n, RESAMPLES))
    counts = np.stack([np.bincount(column, minlength=n) for column in drawn.T])
    if whole.all():
        _fill(found, np.arange(outputs), values, counts.astype(float))
        return found
    masks, owner = np.unique(whole, axis=1, return_inverse=True)
    for k, mask in enumerate(masks.T):
        if mask.sum() >= LEAST_GROUPS:
            columns = np.flatnonzero(owner.ravel() == k)
            _fill(found, columns, values[mask][:, :, columns], counts[:, mask].astype(float))
    return found


def _fill(found: SobolIndices, columns: NDArray[np.int64], values: Real, counts: Real) -> None:
    """Indices of outputs of which the same groups are whole."""
    ends = values[:, [0, -1]].reshape(-1, columns.size)
    found.mean[columns], found.variance[columns] = ends.mean(axis=0), ends.var(axis=0)
    spread, size = np.ptp(values, axis=(0, 1)), np.abs(values).max(axis=(0, 1))
    still = spread <= CONSTANT * size
    found.constant[columns] = still
    for table in (found.first_order, found.total, *_widths(found)):
        table[columns[still]] = 0.0
    moving = columns[~still]
    if moving.size == 0:
        return
    if still.any():
        values = values[:, :, ~still]
    values = (values - values.mean(axis=(0, 1))) / values.std(axis=(0, 1))
    estimators = _salib("SALib.analyze.sobol")
    A, B = values[:, 0], values[:, -1]
    drawn = counts.sum(axis=1, keepdims=True)
    weights = np.divide(counts, drawn, out=np.full_like(counts, np.nan), where=drawn > 0.0)
    variance = _resampled_variance(A, B, weights)
    for i in range(values.shape[1] - 2):
        AB = values[:, i + 1]
        found.first_order[moving, i] = estimators.first_order(A, AB, B)
        found.total[moving, i] = estimators.total_order(A, AB, B)
        # A resample is a weighted mean: all of them are one matrix product.
        first = _shares(weights @ (B * (AB - A)), variance)
        total = _shares(0.5 * weights @ (A - AB) ** 2, variance)
        found.first_order_confidence[moving, i] = NORMAL_95 * first.std(axis=0, ddof=1)
        found.total_confidence[moving, i] = NORMAL_95 * total.std(axis=0, ddof=1)


def _shares(parts: Real, variance: Real) -> Real:
    """Shares of the variance; none of a resample in which nothing varies."""
    nothing = np.full_like(parts, np.nan)
    return np.divide(parts, variance, out=nothing, where=variance > 0.0)


def _widths(found: SobolIndices) -> tuple[Real, Real]:
    return found.first_order_confidence, found.total_confidence


def _resampled_variance(A: Real, B: Real, weights: Real) -> Real:
    """Variance over A and B of each resample, (resamples, K)."""
    half = 0.5 * weights
    mean = half @ (A + B)
    return np.asarray(half @ (A**2 + B**2) - mean**2)


def _salib(module: str) -> Any:
    return required(module, "Sobol indices need SALib", "study")
