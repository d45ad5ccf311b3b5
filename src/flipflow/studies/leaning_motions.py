"""Motions that lean to one side of a symmetric machine, between two symmetry-breaking points."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.continuation.branch import Branch
from flipflow.continuation.special_points import SYMMETRY
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.orbit import Orbit

SPEEDS = 41  # at which leaning motions are solved for, denser towards both ends
SETTLING_TURNS = 600  # forcing periods waited for the motion that is pushed aside
PUSH = 1e-2  # displacement by which it is pushed, over the characteristic length
LEAN = 1e-6  # sum of both extremes, over that length, beyond which a motion leans


def leaning_motions(branch: Branch) -> tuple[tuple[Orbit, ...], ...]:
    """The stable motions that lean to one side where the symmetric one is unstable.

    Between two neighbouring symmetry-breaking points of a symmetric branch the symmetric motion
    is left along the eigenvector of the half-turn map whose eigenvalue lies below -1; the machine
    settles, and the motion it settles into is followed to both ends. Each has a mirror image.

    Parameters
    ----------
    branch
        Motions of a symmetric machine over speed.

    Returns
    -------
    tuple of tuple of Orbit
        One tuple for each window of speed, rising in speed, solved for exactly; their
        displacement has a mean other than 0. Windows in which none was found are left out.
    """
    points = branch.points_of(SYMMETRY)
    windows = (_followed(branch, a.omega, b.omega) for a, b in itertools.pairwise(points))
    return tuple(window for window in windows if window)


def _followed(branch: Branch, first: float, last: float) -> tuple[Orbit, ...]:
    solver = ExactSolver(branch.system, half_turn=False)
    low, high = min(first, last), max(first, last)
    # Leaning grows as the square root of the distance from each end.
    share = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, SPEEDS + 1) / (SPEEDS + 1))
    speeds = low + (high - low) * share
    middle = SPEEDS // 2
    start = _settled(branch, solver, float(speeds[middle]))
    if start is None:
        return ()
    below = list(_marched(solver, start, speeds[:middle][::-1]))[::-1]
    above = list(_marched(solver, start, speeds[middle + 1 :]))
    return (*below, start, *above)


def _settled(branch: Branch, solver: ExactSolver, omega: float) -> Orbit | None:
    """The motion into which the machine settles, pushed off the symmetric one."""
    unstable = [orbit for orbit in branch.orbits_at(omega) if not orbit.stable]
    if not unstable:
        return None
    values, vectors = np.linalg.eig(unstable[0].return_map)
    direction = vectors[:, int(np.argmin(values.real))].real
    push = PUSH * solver.length / np.abs(direction[: branch.system.size]).max()
    z = solver.settled(unstable[0].state + push * direction, omega, SETTLING_TURNS)
    point = solver.solve(z, omega)
    if point is None:
        return None
    orbit = Orbit(branch.machine, point)
    return orbit if _leans(orbit, solver) else None


def _marched(solver: ExactSolver, start: Orbit, speeds: Real) -> Iterator[Orbit]:
    """The motion from speed to speed, until it no longer leans."""
    guess = start.unknowns
    for omega in speeds:
        point = solver.solve(guess, float(omega))
        if point is None:
            return
        orbit = Orbit(start.machine, point)
        if not _leans(orbit, solver):
            return
        guess = point.u
        yield orbit


def _leans(orbit: Orbit, solver: ExactSolver) -> bool:
    gap = solver.springs[0].direction
    low, high, _ = solver.extremes(orbit.unknowns[None], np.array([orbit.omega]), gap[None])
    return abs(float(low[0, 0] + high[0, 0])) > LEAN * solver.length
