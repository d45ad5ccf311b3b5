r"""Neighbourhoods of stable motions: as far as was tried, all states within go to the motion.

For a stable motion with monodromy M over its period the discrete Lyapunov equation

.. math:: M^T P M - P + I = 0

gives a form V(z) = (z - c)^T P (z - c) that falls over every period close to the motion. Where a
slow multiplier leaves V hardly any room to fall, M is that of up to sixteen periods: what is back
in the ellipsoid after them goes to the motion, wherever it was in between. More periods are watched
as well where V falls from no size on: a motion that rests at a gap has another map on each side,
and only one of them is M. How far that holds is found by trying: the ellipsoid grows, or shrinks,
until V falls along the exact flow from every one of a few hundred states on it and within it, and
from those climbed to where it falls least, there at the latest after sixteen times as many periods.
Near an unstable motion within it, or in a small basin of another one, V does not fall, and few of
many states lie there. Displacements are scaled by the motion's size, velocities by that times
omega.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.linalg import LinAlgError, solve_discrete_lyapunov

from flipflow.batch.lanes import Capture, Lanes
from flipflow.compiled.arrays import Real
from flipflow.periodic.solver import Point

SAMPLES = 384  # states from which V must fall: half on the boundary, half within
GROWTH = 1.25  # factor on the radius as long as V still falls
MOST_GROWTH = 14  # times that the radius grows, to about twice the motion's size
MOST_HALVINGS = 30  # times that the radius is halved until V falls
FIRST_RADIUS = 0.1  # first radius tried: sqrt V, with states in units of the motion
MOST_SHRINKS = 40  # times that it shrinks again where the climb finds a state from which V rises
CLIMB = (0.5, 0.4, 0.3, 0.2, 0.15, 0.1, 0.07, 0.05)  # steps, as shares of the radius
CLIMBERS, TRIES = 32, 8  # states climbed from at once, and steps tried from each
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

    def share_left(radius: float, within: Real, periods: int = passes) -> Real:
        ends = lanes.carry(centre.u + radius * within @ out.T, periods * centre.formulation.turns)
        V = np.linalg.norm((ends - centre.u) @ back.T, axis=1)
        left: Real = np.nan_to_num(V / (radius * np.linalg.norm(within, axis=1)), nan=np.inf)
        return left

    def least_left(radius: float, within: Real) -> Real:
        """The same, after more periods for states from which V rises at first."""
        left = share_left(radius, within)
        rises = left >= 1.0
        if rises.any():
            left[rises] = share_left(radius, within[rises], PATIENCE[-1] * passes)
        return left

    def falls(radius: float) -> bool:
        return bool((share_left(radius, ball) < 1.0).all())

    radius = next((r for r in FIRST_RADIUS * 0.5 ** np.arange(MOST_HALVINGS) if falls(r)), math.nan)
    if math.isnan(radius):
        return None
    for _ in range(MOST_GROWTH):
        if not falls(GROWTH * radius):
            break
        radius *= GROWTH
    for _ in range(MOST_SHRINKS):
        if _most_left(partial(least_left, radius), ball, rng) < 1.0:
            return float(radius)
        radius /= GROWTH
    return None


def _most_left(share_left: Callable[[Real], Real], ball: Real, rng: np.random.Generator) -> float:
    """The largest share of V that is left, climbed to from where most is; 1 ends the climb."""
    left = share_left(ball)
    for step in CLIMB:
        if not left.max() < 1.0:
            break
        best = np.argsort(-left)[:CLIMBERS]
        tried = np.repeat(ball[best], TRIES, axis=0)
        tried += step / math.sqrt(ball.shape[1]) * rng.standard_normal(tried.shape)
        tried /= np.maximum(np.linalg.norm(tried, axis=1), 1.0)[:, None]
        ball = np.concatenate([ball[best], tried])
        left = np.concatenate([left[best], share_left(tried)])
    return float(left.max())
