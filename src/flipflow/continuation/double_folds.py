"""Folds at which more than one multiplier is 1: identical parts of a machine turn back together."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from flipflow.compiled.arrays import Real
from flipflow.errors import IncompleteError
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.solver import Point, Traced

NEAR_NULL = 1e-5  # singular values below this share of the largest are taken as zero
RANKS = 2  # directions that a fold of one part alone does not have
CORRECTIONS = 20
SHARP = 1e-12  # last correction, as a share of the unknowns


def double_fold(solver: ExactSolver, traced: Traced, p: int) -> tuple[float, Point]:
    """Share and point of step p at which the branch turns and its matrix loses several ranks.

    Newton's method with the least correction keeps to the branch where directions off it are not
    determined; the tangent is the part of the chord in the null space.

    Raises
    ------
    IncompleteError
        Where no such point is found.
    """
    ends = np.concatenate([traced.u[p : p + 2], traced.omega[p : p + 2, None]], axis=1)
    scale = np.abs(ends).max(axis=0)
    size = scale[:-1].size // 2
    scale[:size], scale[size:-1] = scale[:size].max(), scale[size:-1].max()
    if not scale.min() > 0.0:
        raise IncompleteError(f"no fold found near {traced.omega[p]:.6g}")
    chord = (ends[1] - ends[0]) / scale
    chord /= np.linalg.norm(chord)
    known: dict[float, tuple[Real, Real]] = {}

    def slope(share: float) -> float:
        if share in (0.0, 1.0):
            return float(traced.tangent[p + int(share), -1])
        known[share] = _corrected(solver, ends[0] + share * (ends[1] - ends[0]), scale, chord)
        return float((known[share][1].T @ (known[share][1] @ chord))[-1])

    try:
        share = float(brentq(slope, 0.0, 1.0, xtol=1e-12))
    except ValueError:
        raise IncompleteError(f"no fold found near {traced.omega[p]:.6g}") from None
    w, null = known.get(share, (ends[0], np.zeros((0, chord.size))))
    if null.shape[0] < RANKS:
        raise IncompleteError(f"no fold found near {traced.omega[p]:.6g}")
    return share, solver.point_at(w[:-1], float(w[-1]), 0.0, None)


def _corrected(solver: ExactSolver, guess: Real, scale: Real, chord: Real) -> tuple[Real, Real]:
    """The point in the plane through a guess normal to the chord, and the null space there.

    Its rows are directions, scaled, in which the point may move.
    """
    w = guess.copy()
    for _ in range(CORRECTIONS):
        found = solver.residual(w[:-1], float(w[-1]))
        if found is None:
            break
        r, J = found
        rows = J * scale / scale[:-1, None]
        plane = chord @ ((w - guess) / scale)
        A = np.vstack([rows, chord])
        b = np.append(-r / scale[:-1], -plane)
        step = np.linalg.lstsq(A, b, rcond=NEAR_NULL)[0]
        w = w + step * scale
        if np.abs(step).max() < SHARP:
            _, sizes, vectors = np.linalg.svd(rows)
            rank = np.count_nonzero(sizes > NEAR_NULL * sizes[0])
            return w, vectors[rank:]
    raise IncompleteError(f"no point found on the branch near {guess[-1]:.6g}")
