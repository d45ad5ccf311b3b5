"""The continuation loop over a field: n equations in n + 1 unknowns, the field's value the last.

For parameters that change the machine: every evaluation flattens a machine anew, which costs more
than the equations do. Over omega the compiled loop of :mod:`flipflow.continuation.frequency_loop`
serves; steps, constants and refusals are the same.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled import status
from flipflow.continuation.corners import TURN_MOST
from flipflow.continuation.correction import (
    NEWTON_MOST,
    QUICK,
    SHARP,
)
from flipflow.continuation.frequency_loop import (
    AWAY,
    BACK,
    CONTACT_STEP,
    GROW,
    HALVE,
    LONGEST,
    NEWTON_FEW,
    SHORT_STEP,
    SHORTEST,
    SHRINK,
    STRAND_STEP,
)
from flipflow.model.monitor import Monitor, silent

Real = NDArray[np.float64]
FIRST_STEP = 0.1  # length of the first step
# Steps tried one way, refused ones too: a curve of folds through two cusps takes about 200.
TRIES_MOST = 3000
# A step along the tangent strays farther, and Newton takes longer, than one along the cubic.
ASTRAY_MOST = 0.2  # largest distance of the corrected point from the guess, as a share of the step
NEWTON_MANY = 5  # iterations from which the next step shrinks; with more the step is refused
# Distances of a motion from the parent branch, relative to the motion.
NEAR = 1e-2  # a branch that stalls within it has met its parent
CLOSE = 1e-3  # points within it are left out at a meeting
SAME = 1e-7  # a motion within it is one of the parent's


class Equations(ABC):
    """What is followed: residual, Jacobian, and how long a step is in each unknown."""

    lower: float
    upper: float

    @abstractmethod
    def residual(self, w: Real) -> tuple[Real, Real] | None:
        """r (n,) and dr/dw (n, n + 1); None where they cannot be had."""

    @abstractmethod
    def scale(self, w: Real) -> Real:
        """Length of one step in each unknown, (n + 1,)."""

    @abstractmethod
    def signature(self) -> int:
        """A number that changes when the contacts of the last residual's motion change."""

    @abstractmethod
    def apart(self, w: Real) -> float:
        """Distance of a solution from the parent branch, relative; infinite where there is none."""


@dataclass(frozen=True, eq=False)
class Solved:
    """A corrected point: w (n + 1,), Jacobian, scale, unit tangent in scaled unknowns."""

    w: Real
    J: Real
    scale: Real
    tangent: Real
    side: float
    signature: int
    iterations: int

    def rescaled(self, scale: Real) -> Solved:
        """The same point with another length of one step in each unknown."""
        tangent = self.tangent * self.scale / scale
        return replace(self, scale=scale, tangent=tangent / np.linalg.norm(tangent))

    def backwards(self) -> Solved:
        """The same point, the branch read the other way."""
        return replace(self, tangent=-self.tangent, side=-self.side)


@dataclass(frozen=True, eq=False)
class Path:
    """Points of a branch, how it ended, and whether its ends stand on another branch."""

    equations: Equations
    points: tuple[Solved, ...]
    code: int
    crossed_start: bool = False
    crossed_end: bool = False

    def between(self, p: int, share: float) -> Solved | None:
        """The branch's point at ``share`` of the chord from point p to point p + 1."""
        first, last = self.points[p], self.points[p + 1]
        chord = (last.w - first.w) / first.scale
        guess = first.w + share * (last.w - first.w)
        border = chord / np.linalg.norm(chord)
        return corrected(self.equations, guess, border, first.scale, border, SHARP)


class Passed:
    """Tells a monitor how much of the interval of the parameter has been passed."""

    def __init__(self, equations: Equations, monitor: Monitor) -> None:
        self.width = equations.upper - equations.lower
        self.monitor = monitor
        self.least, self.most = math.inf, -math.inf

    def tell(self, value: float) -> None:
        """Tell it before a step is tried from a value; what it raises ends the work."""
        self.least, self.most = min(self.least, value), max(self.most, value)
        self.monitor(f"at {value:.6g}", (self.most - self.least) / self.width)


def follow_both_ways(equations: Equations, w: Real, monitor: Monitor = silent) -> Path:
    """Follow the branch from w until it leaves the bounds, closes, or crosses another branch."""
    value, passed = float(w[-1]), Passed(equations, monitor)
    ahead = follow(equations, w, -1.0 if value == equations.upper else 1.0, passed)
    both = ahead.code in (status.FOLLOWED, status.STEP_TOO_SMALL)
    if not both or value in (equations.lower, equations.upper):
        return ahead
    back = follow(equations, w, -1.0, passed)
    points = (*(point.backwards() for point in back.points[:0:-1]), *ahead.points)
    code = back.code if back.code != status.FOLLOWED else ahead.code
    return Path(equations, points, code, back.crossed_end, ahead.crossed_end)


def follow(equations: Equations, w: Real, direction: float, passed: Passed | None = None) -> Path:
    """Follow the branch from w one way: predict, correct, accept or halve, record."""
    passed = passed or Passed(equations, silent)
    plane = np.zeros(w.size)
    plane[-1] = 1.0
    first = corrected(equations, w, plane, equations.scale(w), direction * plane, QUICK)
    if first is None:
        return Path(equations, (), status.NO_CONVERGENCE)
    points, length, travelled = [first], FIRST_STEP, 0.0
    for _ in range(TRIES_MOST):
        last = points[-1]
        passed.tell(float(last.w[-1]))
        step = min(length, 0.999 / max(abs(float(last.tangent[-1])), 1e-3))
        guess, border, ends = predicted(equations, last, step)
        new = corrected(equations, guess, border, last.scale, last.tangent, QUICK)
        if new is None or refused(equations, last, new, guess, step):
            length = step * HALVE
            if length < SHORTEST:
                return stalled(equations, points)
            continue
        if new.side != last.side:
            return met(equations, points)
        points.append(new.rescaled(equations.scale(new.w)))
        distance = float(np.linalg.norm((new.w - first.w) / new.scale))
        travelled = max(travelled, distance)
        closed = travelled > AWAY and distance < BACK * step
        if ends or closed:
            return Path(equations, tuple(points), status.FOLLOWED if ends else status.CLOSED)
        length = longer(length, step, new.iterations)
    return Path(equations, tuple(points), status.POINT_LIMIT)


def stalled(equations: Equations, points: list[Solved]) -> Path:
    """A path whose step became too small, as it may where it meets another branch."""
    if equations.apart(points[-1].w) < NEAR:
        return met(equations, points)
    return Path(equations, tuple(points), status.STEP_TOO_SMALL)


def met(equations: Equations, points: list[Solved]) -> Path:
    """A path that ends on its parent branch, without the points that rounding puts there."""
    kept = len(points)
    while kept > 1 and equations.apart(points[kept - 1].w) < CLOSE:
        kept -= 1
    return Path(equations, tuple(points[:kept]), status.FOLLOWED, crossed_end=True)


def predicted(equations: Equations, last: Solved, step: float) -> tuple[Real, Real, bool]:
    """Guess, normal of the plane to correct in, and whether the guess stands on a bound."""
    move = step * last.tangent * last.scale
    end = last.w[-1] + move[-1]
    bound = min(max(end, equations.lower), equations.upper)
    if bound == end:
        return last.w + move, last.tangent, False
    guess = last.w + move * ((bound - last.w[-1]) / move[-1])
    guess[-1] = bound
    plane = np.zeros(guess.size)
    plane[-1] = 1.0
    return guess, plane, True


def corrected(
    equations: Equations, guess: Real, border: Real, scale: Real, before: Real, tolerance: float
) -> Solved | None:
    """Newton in the plane through ``guess`` normal to ``border`` (scaled); None if it fails."""
    w, previous = guess.copy(), math.inf
    for iteration in range(1, NEWTON_MOST + 1):
        found = equations.residual(w)
        if found is None:
            return None
        r, J = found
        A, rows = bordered(J, border, scale)
        b = -np.append(r / rows, border @ ((w - guess) / scale))
        move = solved(A, b)
        if move is None:
            return None
        length = float(np.linalg.norm(move))
        w = w + move * scale
        if not length < 1e3:
            return None
        if length < tolerance or previous <= length < QUICK:
            return with_tangent(equations, w, border, scale, before, iteration)
        previous = length
    return None


def with_tangent(
    equations: Equations, w: Real, border: Real, scale: Real, before: Real, iterations: int
) -> Solved | None:
    """The solution w with its Jacobian, and its tangent in the direction of ``before``."""
    found = equations.residual(w)
    if found is None:
        return None
    A, _ = bordered(found[1], border, scale)
    tangent = solved(A, np.append(np.zeros(w.size - 1), 1.0))
    if tangent is None:
        return None
    side = float(np.linalg.slogdet(A).sign)
    tangent /= np.linalg.norm(tangent)
    if tangent @ before < 0.0:
        tangent, side = -tangent, -side
    return Solved(w, found[1], scale, tangent, side, equations.signature(), iterations)


def bordered(J: Real, border: Real, scale: Real) -> tuple[Real, Real]:
    """[J; border] in scaled unknowns with rows of one size, and the sizes of J's rows."""
    A = J * scale
    rows = np.abs(A).max(axis=1)
    return np.vstack([A / rows[:, None], border]), rows


def solved(A: Real, b: Real) -> Real | None:
    """A^-1 b; None where A is singular."""
    try:
        x = np.linalg.solve(A, b)
    except np.linalg.LinAlgError:
        return None
    return np.asarray(x, float) if np.isfinite(x).all() else None


def refused(equations: Equations, last: Solved, new: Solved, guess: Real, step: float) -> bool:
    """Whether a step is laboured, far or bent, changes its contacts, or lands elsewhere."""
    laboured = new.iterations > NEWTON_MANY and step > SHORT_STEP
    outside = not equations.lower <= new.w[-1] <= equations.upper
    bent = abs(float(new.tangent @ last.tangent)) < TURN_MOST
    astray = float(np.linalg.norm((new.w - guess) / new.scale)) > ASTRAY_MOST * step
    strand = new.side != last.side and step > STRAND_STEP
    contact = new.signature != last.signature and step > CONTACT_STEP
    if laboured or outside or bent or astray or strand or contact:
        return True
    return equations.apart(new.w) < SAME


def longer(length: float, step: float, iterations: int) -> float:
    """Length of the next step: longer after few Newton iterations, shorter after many."""
    if iterations <= NEWTON_FEW:
        return min(step * GROW, LONGEST)
    return step * SHRINK if iterations >= NEWTON_MANY else length
