"""States from which a motion is looked for where none is known."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.errors import IncompleteError
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.one_state import contact_free_motion, one_state_motions
from flipflow.periodic.two_event import TwoEventProblem

STARTS = 64  # states of a cloud
SAME = 1e-6  # difference of two states, as a share of their size, within which they are one
SETTLING_TURNS = 60  # forcing periods that each is run before a motion is solved for


def cloud(solver: ExactSolver, omega: float, rng: np.random.Generator) -> Real:
    """A low-discrepancy cloud of states as large as the linear motion or the gaps, (K, 2 N)."""
    n = solver.system.size
    rest, X = contact_free_motion(solver.system, omega)
    gaps = [abs(g) for spring in solver.springs for g in spring.gaps if math.isfinite(g)]
    linear = np.nan_to_num(2.0 * np.abs(X).sum(axis=0) + np.abs(rest))
    size = np.maximum(linear, 3.0 * max(gaps, default=0.0))
    box = np.concatenate([size, omega * size])
    spread = _spread(STARTS if solver.springs else 0, 2 * n, rng)
    return np.asarray((2.0 * spread - 1.0) * box)


def found_motions(solver: ExactSolver, omega: float) -> Iterator[Real]:
    """States of the motions that Newton reaches from states of all kinds, each once.

    They are the motions that never change their contacts, those of two touches, and what a cloud of
    states and the states that these settle to lead to.
    """
    found: list[Real] = []
    for z in _states(solver, omega):
        point = solver.solve(z, omega)
        if point is None:
            continue
        size = SAME * (np.abs(point.u).max() + solver.length * min(1.0, omega))
        if all(np.abs(point.u - one).max() > size for one in found):
            found.append(point.u)
            yield point.u


def _states(solver: ExactSolver, omega: float) -> Iterator[Real]:
    yield from one_state_motions(solver.system, omega)
    if TwoEventProblem.applies(solver.system):
        yield from TwoEventProblem(solver.machine).states(omega)[0]
    whole = ExactSolver(solver.system, half_turn=False)
    for z in cloud(whole, omega, np.random.default_rng(0)):
        yield z
        try:
            yield whole.section(z, omega, SETTLING_TURNS)[-1]
        except IncompleteError:
            continue


def _spread(count: int, size: int, rng: np.random.Generator) -> Real:
    """A Kronecker sequence from a random point on: (count, size) in [0, 1), evenly spread.

    Its steps are powers of 1 / g with g^(size + 1) = g + 1, after Roberts.
    """
    # Kept apart from scipy.stats, whose import takes half a second of every report.
    g = float(max(np.roots([1.0, *[0.0] * (size - 1), -1.0, -1.0]).real))
    step = g ** -np.arange(1.0, size + 1.0)
    return np.mod(rng.random(size) + np.outer(np.arange(count), step), 1.0)
