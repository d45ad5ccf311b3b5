"""Solvers of motions, and of folds, over a parameter of the machine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flipflow.compiled.arrays import Complex, Real
from flipflow.compiled.eigen import eigenvalues
from flipflow.continuation.correction import SHARP, Course
from flipflow.continuation.varied import Varied, new_varied_work
from flipflow.dynamics.assembly import machine_parts, with_springs
from flipflow.dynamics.machine_series import machine_series
from flipflow.errors import IncompleteError
from flipflow.model.system import MechanicalSystem
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.solver import STEP_SHARE, Formulation, Point, Traced

SystemAt = Callable[[float], MechanicalSystem]


@dataclass(frozen=True, eq=False)
class FieldPoint(Point):
    """A motion at a value of the field; ``omega_tangent`` is the tangent's share in the value."""

    value: float = np.nan


class FieldSolver(ExactSolver):
    """Motions at a fixed frequency, the value of a field the last unknown.

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

    Raises
    ------
    IncompleteError
        For a machine that does not depend smoothly on the field.
    """

    unit = ""

    def __init__(
        self, system_at: SystemAt, bounds: tuple[float, float], own: float, omega: float, *,
        half_turn: bool, turns: int,
    ) -> None:  # fmt: skip
        low, high = bounds
        inner = system_at(own if low < own < high else 0.5 * (low + high))
        kept = [j for j, spring in enumerate(inner.springs) if spring.acts and not spring.bonded]
        super().__init__(with_springs(inner, kept), half_turn=half_turn, turns=turns)
        self.system_at, self.bounds, self.own, self.omega = system_at, bounds, own, omega
        series = machine_series(
            lambda value: machine_parts(with_springs(system_at(value), kept)), *bounds
        )
        if series is None:
            raise IncompleteError(
                f"the machine does not change smoothly between {low:.6g} and {high:.6g}; "
                "give an interval without a kink"
            )
        self.problem = Varied(self.problem, series, omega, own)
        self.scratch = new_varied_work(self.shooting_work, self.system.size)

    @property
    def uneven(self) -> Real:
        gap = self.problem.series.gap
        with np.errstate(invalid="ignore"):
            return np.where((gap[:, :, 0] == gap[:, :, 1]).all(axis=0), 0.0, 1.0)

    def like(self, *, half_turn: bool, turns: int) -> FieldSolver:
        return FieldSolver(
            self.system_at, self.bounds, self.own, self.omega, half_turn=half_turn, turns=turns
        )

    def frequency(self, at: float) -> float:  # noqa: ARG002
        return self.omega

    def residual(self, z: Real, omega: float) -> tuple[Real, Real] | None:
        return self.solver_at(omega).residual(z, self.omega)

    def solver_at(self, value: float) -> ExactSolver:
        """A solver of the motions at a value of the field."""
        return ExactSolver(self.system_at(value), half_turn=self.half_turn, turns=self.turns)

    def solve(self, u: Real, omega: float) -> Point | None:
        low, high = self.bounds
        course = Course(omega, omega, 1e-3 * (high - low), STEP_SHARE, 1.0, SHARP)
        record = self.new_branch(1)
        _, points, _ = self._follow(record, u, omega, course)
        return None if points == 0 else self._point(record.u[0], omega, np.nan, None)

    def eigenvalues(self, traced: Traced, maps: Real) -> Complex:  # noqa: ARG002
        return eigenvalues(maps)

    def depth(self, point: Point, spring: int, side: int) -> float:
        return point.formulation.solver().depth(point, spring, side)

    def return_map(self, point: Point) -> Real:
        return point.formulation.solver().return_map(point)

    def _point(self, u: Real, omega: float, omega_tangent: float, jacobian: Real | None) -> Point:
        size = 2 * self.system.size
        formulation = Formulation(ExactSolver, self.system_at(omega), self.half_turn, self.turns)
        known = None if jacobian is None else jacobian[:size, :size] + np.eye(size)
        speed = self.omega if self.unknowns == size else float(u[size])
        return FieldPoint(formulation, u[:size], speed, omega_tangent, known, value=omega)

    def points(self, traced: Traced) -> list[Point]:
        """The motions of a branch."""
        record = traced.record
        known = [
            J if phase == 0.0 else None
            for J, phase in zip(record.jacobian, record.phase, strict=True)
        ]
        rows = zip(record.u, record.omega, record.tangent[:, -1], known, strict=True)
        return [self._point(u, float(at), float(slope), J) for u, at, slope, J in rows]


class FoldSolver(FieldSolver):
    """Folds over a field: the frequency is an unknown, too."""

    branches_off = False

    def __init__(
        self, system_at: SystemAt, bounds: tuple[float, float], own: float, *, half_turn: bool,
        turns: int,
    ) -> None:  # fmt: skip
        super().__init__(system_at, bounds, own, 0.0, half_turn=half_turn, turns=turns)
        self.unknowns = 2 * self.system.size + 1
