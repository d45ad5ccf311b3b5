r"""Neighbourhoods of stable motions that hold only states which go to that motion.

For a stable motion with monodromy M over its period the discrete Lyapunov equation

.. math:: M^T P M - P + I = 0

gives a form V(z) = (z - c)^T P (z - c) that falls over every period close to the motion. Where a
slow multiplier leaves V hardly any room to fall, M is that of up to sixteen periods: what is back
in the ellipsoid after them goes to the motion, wherever it was in between. More periods are watched
as well where V falls from no size on: a motion that rests at a gap has another map on each side,
and only one of them is M. How far that holds is
found by trying: the ellipsoid grows, or shrinks, until V falls along the exact flow from every one
of a few hundred states on it and within it. Displacements are scaled by the motion's size,
velocities by that times omega.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import LinAlgError, solve_discrete_lyapunov

from flipflow.batch.lanes import Capture, Lanes
from flipflow.compiled.arrays import Real
from flipflow.periodic.solver import Point

SAMPLES = 384  # states from which V must fall: half on the boundary, half within
GROWTH = 1.25  # factor on the radius as long as V still falls
MOST_GROWTH = 40  # times that the radius grows
MOST_HALVINGS = 30  # times that the radius is halved until V falls
FIRST_RADIUS = 0.1  # first radius tried: sqrt V, with states in units of the motion
FALL = 0.9  # factor by which the slowest part must fall over the periods watched
MOST_PASSES = 16  # periods watched
PATIENCE = (1, 4, 16)  # times as many are watched where V falls over none


def capture_of(
    lanes: Lanes, point: Point, phases: Real, label: int, rng: np.random.Generator
) -> Capture | None:
    """One ellipsoid for each turn of a stable motion; None where no size of it holds.

    ``point`` is solved for over whole turns; ``phases`` (turns, 2 N) are its states at their ends.
    """
    solver = point.formulation.solver()
    centres, forms = [], []
    for z in phases:
        centre = solver.solve(z, point.omega)
        form = None if centre is None else _form(lanes, centre, solver.length, rng)
        if centre is None or form is None:
            return None
        centres.append(centre.u)
        forms.append(form)
    return Capture(np.array(centres), np.array(forms), np.full(len(forms), label))


def _form(lanes: Lanes, centre: Point, length: float, rng: np.random.Generator) -> Real | None:
    """Form of the largest ellipsoid around a state that passes the trial."""
    n = centre.u.size // 2
    scaled = centre.u / np.repeat([1.0, centre.omega], n)
    size = float(np.abs(scaled).max()) + length
    scale = size * np.repeat([1.0, centre.omega], n)
    M = centre.return_map * scale / scale[:, None]
    least = _passes(M)
    for passes in (share * least for share in PATIENCE):
        found = _form_over(lanes, centre, passes, M, scale, rng)
        if found is not None:
            return found
    return None


def _form_over(
    lanes: Lanes, centre: Point, passes: int, M: Real, scale: Real, rng: np.random.Generator
) -> Real | None:
    """The same with V watched over a number of periods, each with the monodromy M."""
    n = centre.u.size // 2
    M = np.linalg.matrix_power(M, passes)
    try:
        P = solve_discrete_lyapunov(M.T, np.eye(2 * n))
        L = np.linalg.cholesky((P + P.T) / 2.0)
    except (LinAlgError, ValueError):
        return None
    unit = np.linalg.inv(L).T
    radius = _radius(lanes, centre, passes, scale[:, None] * unit, L.T / scale, rng)
    return (
        None if radius is None else np.ascontiguousarray((P / scale / scale[:, None]) / radius**2)
    )


def _passes(M: Real) -> int:
    """Periods over which V is watched: enough for what is slowest to fall by a tenth."""
    rho = float(np.abs(np.linalg.eigvals(M)).max())
    needed = (n for n in range(1, MOST_PASSES) if rho**n <= FALL)
    return next(needed, MOST_PASSES)


def _radius(
    lanes: Lanes, centre: Point, passes: int, out: Real, back: Real, rng: np.random.Generator
) -> float | None:
    """Halve the radius until V falls from all samples, then grow while it still does."""
    ball = rng.standard_normal((SAMPLES, centre.u.size))
    ball /= np.linalg.norm(ball, axis=1)[:, None]
    ball[SAMPLES // 2 :] *= rng.uniform(0.05, 1.0, (SAMPLES - SAMPLES // 2, 1))

    def falls(radius: float) -> bool:
        ends = lanes.carry(centre.u + radius * ball @ out.T, passes * centre.formulation.turns)
        V = np.linalg.norm((ends - centre.u) @ back.T, axis=1)
        return bool(np.all(radius * np.linalg.norm(ball, axis=1) > V))

    radius = next((r for r in FIRST_RADIUS * 0.5 ** np.arange(MOST_HALVINGS) if falls(r)), math.nan)
    if math.isnan(radius):
        return None
    for _ in range(MOST_GROWTH):
        if not falls(GROWTH * radius):
            break
        radius *= GROWTH
    return float(radius)
