"""Where a machine stands still under constant forces, held by springs and the stops it meets."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, islice, product

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.errors import InputError
from flipflow.model.contact_law import OPEN, WHOLE, shares
from flipflow.model.elements import ClearanceSpring

MOST_STATES = 4096  # contact states that are tried, those with few stops engaged first
NEWTON_STEPS = 100
ROUNDING = 1e-9  # share of the machine's size by which a stop may miss its gap
SOLVED = 1e-13  # share of the sizes of matrix and solution by which any row may be missed


def static_rest(K: Real, springs: Sequence[ClearanceSpring], force: Real) -> Real:
    """Solve K x + sum_j d_j H_j(d_j^T x) = force with the stops at rest: x, (N,).

    Newton's method from one contact state to the next ends where K holds the machine; else all
    contact states are tried.

    Raises
    ------
    InputError
        Where nothing holds the machine.
    """
    seen = []
    sides = sides_at(springs, np.zeros(force.size))
    for _ in range(NEWTON_STEPS):
        x = rest_of(K, springs, sides, force)
        if x is None or sides in seen:
            break
        seen.append(sides)
        reached = sides_at(springs, x)
        if reached == sides:
            return x
        sides = reached
    for sides in islice(engaged_sides(springs), MOST_STATES):
        x = rest_of(K, springs, sides, force)
        if x is not None and _holds(springs, sides, x):
            return x
    remedy = "with this force nothing holds the machine; give every free motion a spring or a stop"
    raise InputError("static_force", force.tolist(), remedy)


def engaged_sides(
    springs: Sequence[ClearanceSpring], pieces: Sequence[Sequence[int]] | None = None
) -> Iterator[tuple[int, ...]]:
    """Regimes (m,) of the springs: all open, then those with more and more of them engaged.

    ``pieces`` are the regimes in which each spring may stand; without them, its sides.
    """
    count = len(springs)
    ways = [_sides(spring) for spring in springs] if pieces is None else pieces
    for engaged in range(count + 1):
        for which in combinations(range(count), engaged):
            for chosen in product(*(ways[j] for j in which)):
                regimes = [OPEN] * count
                for j, regime in zip(which, chosen, strict=True):
                    regimes[j] = regime
                yield tuple(regimes)


def sides_at(springs: Sequence[ClearanceSpring], x: Real) -> tuple[int, ...]:
    """Side on which each spring is engaged at a position, (m,)."""
    places = [float(spring.direction @ x) for spring in springs]
    return tuple(
        WHOLE if y > spring.gaps[0] else -WHOLE if y < -spring.gaps[1] else OPEN
        for spring, y in zip(springs, places, strict=True)
    )


def rest_of(
    K: Real, springs: Sequence[ClearanceSpring], regimes: Sequence[int], force: Real
) -> Real | None:
    """Where the machine would stand with springs in their regimes, (N,); None: nowhere."""
    held, push = K.copy(), force.copy()
    for spring, regime in zip(springs, regimes, strict=True):
        if regime != OPEN:
            d, k = spring.direction, spring.stiffness * float(shares(spring.law, regime)[0])
            held += k * np.outer(d, d)
            push += k * signed_gap_of(spring, regime) * d
    if not push.any():
        return push
    x = np.asarray(np.linalg.lstsq(held, push, rcond=None)[0], np.float64)
    allowed = ROUNDING * np.abs(push) + rounding(held, x)
    return x if np.all(np.abs(held @ x - push) <= allowed) else None


def rounding(rows: Real, x: Real) -> Real:
    """What products of rows (..., N) with a position (N,) may be off by.

    Where a position is zero but for rounding, its own size tells nothing.
    """
    whole = SOLVED * np.linalg.norm(rows) * np.linalg.norm(x)
    return np.asarray(ROUNDING * (np.abs(rows) @ np.abs(x)) + whole)


def signed_gap_of(spring: ClearanceSpring, side: int) -> float:
    """Position of the gap on a side: e+ or -e-."""
    return spring.gaps[0] if side > OPEN else -spring.gaps[1]


def _sides(spring: ClearanceSpring) -> list[int]:
    """The sides on which a spring can push."""
    ways = zip((WHOLE, -WHOLE), spring.gaps, strict=True)
    return [side for side, gap in ways if spring.stiffness > 0.0 and np.isfinite(gap)]


def _holds(springs: Sequence[ClearanceSpring], sides: Sequence[int], x: Real) -> bool:
    """Whether a position lies where its contact state holds, but for rounding."""
    for spring, side in zip(springs, sides, strict=True):
        y = float(spring.direction @ x)
        slack = float(rounding(spring.direction, x))
        if side == OPEN and not -spring.gaps[1] - slack <= y <= spring.gaps[0] + slack:
            return False
        beyond = (y - signed_gap_of(spring, side)) * side if side != OPEN else 0.0
        if beyond < -slack:
            return False
    return True
