"""Periodic motions, and folds, over a field of the machine: the equations that are followed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.optimize import root_scalar

from flipflow.compiled.arrays import Real
from flipflow.continuation.field_loop import Equations, Path, Solved
from flipflow.continuation.switching import distance_to, image, parent_of
from flipflow.errors import IncompleteError
from flipflow.model.system import MechanicalSystem
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.solver import STEP_SHARE, Point
from flipflow.periodic.stability import determinant_plus

POINTS = 200  # the longest step in the field is the interval divided by this
# Step of a difference quotient, as a share of the unknown's own size: the same share of a wide
# interval would swamp the value.
DIFFERENCE = 1e-6
OMEGA_SHARE = 0.02  # longest step in the frequency, as a share of it
VALUE_SHARE = 0.05  # longest step in the field, as a share of its size
SOLVERS_KEPT = 8  # values of the field whose machines are kept flattened
SystemAt = Callable[[float], MechanicalSystem]


@dataclass(frozen=True, eq=False)
class FieldPoint(Point):
    """A motion at a value of the field; ``omega_tangent`` is the tangent's share in the value."""

    value: float = np.nan


class FieldEquations(Equations):
    """Shooting at a fixed frequency: w = (z, value), sign flow(z; value) - z = 0.

    Parameters
    ----------
    system_at
        The machine's system for a value of the field.
    bounds
        (lower, upper) values.
    own
        The machine's own value, which sets the scale of the field.
    omega
        Frequency in rad/s.
    half_turn, turns
        As of :class:`~flipflow.periodic.exact_solver.ExactSolver`.
    """

    def __init__(
        self, system_at: SystemAt, bounds: tuple[float, float], own: float, omega: float, *,
        half_turn: bool, turns: int,
    ) -> None:  # fmt: skip
        self.lower, self.upper = bounds
        self.omega, self.half_turn, self.turns = omega, half_turn, turns
        self.system_at, self.own = system_at, own
        self._contacts = 0

        @lru_cache(maxsize=SOLVERS_KEPT)
        def solver_at(value: float) -> ExactSolver:
            return ExactSolver(system_at(value), half_turn=half_turn, turns=turns)

        @lru_cache(maxsize=SOLVERS_KEPT)
        def parent_at(value: float) -> ExactSolver | None:
            return parent_of(solver_at(value))

        self.solver_at, self.parent_at = solver_at, parent_at

    def shooting(self, z: Real, omega: float, value: float) -> tuple[Real, Real] | None:
        """r and [dr/dz, dr/d omega] of the machine at a value; None outside the bounds."""
        if not (self.lower <= value <= self.upper and omega > 0.0):
            return None
        solver = self.solver_at(value)
        found = solver.residual(z, omega)
        self._contacts = solver.contacts
        return found

    def size(self, value: float) -> float:
        """Size of the field: the value's or the machine's own, and the interval at most."""
        width = self.upper - self.lower
        return min(width, max(abs(value), abs(self.own)) if self.own else width)

    def value_step(self, value: float) -> float:
        """Length of one step in the field."""
        return min((self.upper - self.lower) / POINTS, VALUE_SHARE * self.size(value))

    def slope(self, z: Real, omega: float, value: float) -> Real | None:
        """dr/d value by a central difference, one-sided at a bound."""
        step = DIFFERENCE * self.size(value)
        ends = min(value + step, self.upper), max(value - step, self.lower)
        ahead, behind = (self.shooting(z, omega, end) for end in ends)
        if ahead is None or behind is None:
            return None
        return np.asarray((ahead[0] - behind[0]) / (ends[0] - ends[1]))

    def residual(self, w: Real) -> tuple[Real, Real] | None:
        z, value = w[:-1], float(w[-1])
        slope = self.slope(z, self.omega, value) if self.lower <= value <= self.upper else None
        found = self.shooting(z, self.omega, value)
        if found is None or slope is None:
            return None
        return found[0], np.column_stack([found[1][:, :-1], slope])

    def scale(self, w: Real) -> Real:
        sizes = self.sizes(w[:-1], self.omega, float(w[-1]))
        return np.append(STEP_SHARE * sizes, self.value_step(float(w[-1])))

    def sizes(self, z: Real, omega: float, value: float) -> Real:
        """Size of each unknown of the state: the amplitude (m), that times omega."""
        n = z.size // 2
        reach = np.hypot(z[:n], z[n:] / omega).max()
        amplitude = max(reach, self.solver_at(value).length)
        return np.asarray(amplitude * np.repeat([1.0, omega], n))

    def signature(self) -> int:
        return self._contacts

    def apart(self, w: Real) -> float:
        parent = self.parent_at(float(w[-1]))
        if parent is None:
            return np.inf
        return distance_to(w[:-1], image(parent, w[:-1], self.omega), self.omega)

    def point(self, solved: Solved) -> FieldPoint:
        """The motion at a corrected point."""
        return self._point(solved, self.omega)

    def _point(self, solved: Solved, omega: float) -> FieldPoint:
        value = float(solved.w[-1])
        solver = self.solver_at(value)
        n = solver.unknowns
        jacobian = solved.J[:n, :n]
        return FieldPoint(
            solver.formulation, solved.w[:n], omega, float(solved.tangent[-1]),
            known_map=jacobian + np.eye(n), value=value,
        )  # fmt: skip


class FoldEquations(FieldEquations):
    """Folds over a field: w = (z, omega, value), the shooting and det(dr/dz) = 0."""

    def residual(self, w: Real) -> tuple[Real, Real] | None:
        z, omega, value = w[:-2], float(w[-2]), float(w[-1])
        if not self.lower <= value <= self.upper:
            return None
        slope, gradient = self.slope(z, omega, value), self._gradient(w)
        found = self.shooting(z, omega, value)
        if found is None or slope is None or gradient is None:
            return None
        r, J = found
        full = np.vstack([np.column_stack([J, slope]), gradient])
        return np.append(r, np.linalg.det(J[:, :-1])), full

    def _gradient(self, w: Real) -> Real | None:
        """Derivatives of det(dr/dz) by central differences, one-sided at a bound."""
        sizes = self.sizes(w[:-2], float(w[-2]), float(w[-1]))
        steps = DIFFERENCE * np.append(sizes, [w[-2], self.size(float(w[-1]))])
        gradient = np.empty(w.size)
        for k, step in enumerate(steps):
            ahead, behind = w.copy(), w.copy()
            ahead[k], behind[k] = w[k] + step, w[k] - step
            ahead[-1], behind[-1] = min(ahead[-1], self.upper), max(behind[-1], self.lower)
            ends = [self.shooting(x[:-2], float(x[-2]), float(x[-1])) for x in (ahead, behind)]
            if ends[0] is None or ends[1] is None:
                return None
            first, last = (np.linalg.det(end[1][:, :-1]) for end in ends if end is not None)
            gradient[k] = (first - last) / (ahead[k] - behind[k])
        return gradient

    def scale(self, w: Real) -> Real:
        sizes = self.sizes(w[:-2], float(w[-2]), float(w[-1]))
        steps = [OMEGA_SHARE * w[-2], self.value_step(float(w[-1]))]
        return np.append(STEP_SHARE * sizes, steps)

    def apart(self, w: Real) -> float:  # noqa: ARG002
        return np.inf

    def point(self, solved: Solved) -> FieldPoint:
        return self._point(solved, float(solved.w[-2]))


@dataclass(frozen=True, eq=False)
class FieldFollower:
    """Solves for points between two of a path."""

    equations: FieldEquations

    def between(self, traced: Any, p: int, share: float) -> FieldPoint:
        """The path's motion at ``share`` of the way from point p to point p + 1."""
        path: Path = traced
        solved = path.between(p, share)
        if solved is None:
            value = path.points[p].w[-1]
            raise IncompleteError(f"no point found between two of the branch near {value:.6g}")
        return self.equations.point(solved)

    @staticmethod
    def return_map(point: Point) -> Real:
        """The return map of a motion, which its Jacobian tells."""
        return point.return_map


def meeting_over_field(parent: FieldEquations, z: Real, value: float) -> FieldPoint | None:
    """The parent's motion near (z, value) whose return map has the eigenvalue -1, by secants."""
    last: list[Real | None] = [z]

    def height(x: float) -> float:
        guess = last[-1]
        if guess is None or not parent.lower <= x <= parent.upper:
            return np.nan
        point = parent.solver_at(x).solve(guess, parent.omega)
        last.append(None if point is None else point.u)
        return np.nan if point is None else float(determinant_plus(point.return_map))

    step = DIFFERENCE * parent.size(value)
    away = step if value + step < parent.upper else -step
    answer = root_scalar(
        height, method="secant", x0=value, x1=value + away,
        xtol=1e-12 * (parent.upper - parent.lower), maxiter=30,
    )  # fmt: skip
    guess = last[-1]
    if not answer.converged or guess is None or not parent.lower <= answer.root <= parent.upper:
        return None
    root = float(answer.root)
    point = parent.solver_at(root).solve(guess, parent.omega)
    if point is None:
        return None
    return FieldPoint(
        point.formulation, point.u, point.omega, known_map=point.return_map, value=root
    )
