"""Solver of motions over a parameter of the machine, and of curves in two parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from flipflow.compiled import status
from flipflow.compiled.arrays import Complex, Real
from flipflow.compiled.eigen import eigenvalues
from flipflow.continuation.conditions import GRAZING, MOTION
from flipflow.continuation.correction import SHARP, Course
from flipflow.continuation.switching import distance_to
from flipflow.continuation.varied import Varied, new_varied_work
from flipflow.dynamics.assembly import machine_parts, with_springs
from flipflow.dynamics.machine_series import machine_series
from flipflow.errors import IncompleteError
from flipflow.model.system import MechanicalSystem
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.solver import STEP_SHARE, Formulation, Point, Traced

SystemAt = Callable[[float, float], MechanicalSystem]


@dataclass(frozen=True)
class Sought:
    """What is followed: motions, or a curve of those where a test function is zero.

    Parameters
    ----------
    test
        MOTION, SADDLE_NODE, FLIP, PAIR or GRAZING.
    gap
        2 * spring + side of the gap that is grazed, side 0 plus, 1 minus.
    bounds, own
        Of a curve in two fields, (lower, upper) of the second, and its size.
    at_once
        Other gaps that are grazed with it all along, in the same count: those of a stop on both
        sides by a motion that is its own mirror image, and of equal stops.
    """

    test: int = MOTION
    gap: int = 0
    bounds: tuple[float, float] = (0.0, 0.0)
    own: float = 0.0
    at_once: tuple[int, ...] = ()


MOTIONS = Sought()
SAME_CURVE = 0.1  # share of motion or parameter by which the first point may lie off the start


@dataclass(frozen=True, eq=False)
class FieldPoint(Point):
    """A motion at a value of the field; ``omega_tangent`` is the tangent's share in the value.

    ``beside`` is the second parameter on a curve, with the tangent's share in it, and ``own_map``
    the return map from the phase at which the point was solved for.
    """

    value: float = np.nan
    beside: float = np.nan
    beside_tangent: float = np.nan
    own_map: Real | None = None


class FieldSolver(ExactSolver):
    """Motions at a fixed frequency over a field, the last unknown, and curves in two parameters.

    The unknown beside the state is on a curve the frequency, or a second field.

    Parameters
    ----------
    system_at
        The machine's system for a value of the field and one of the second field.
    bounds
        (lower, upper) values.
    own
        The machine's own value, which sets the scale of the field.
    omega
        Frequency in rad/s; 0 where it is the second parameter.
    half_turn, turns
        As of :class:`~flipflow.periodic.exact_solver.ExactSolver`.
    sought
        What is followed.

    Raises
    ------
    IncompleteError
        For a machine that does not depend smoothly on the field.
    """

    unit = ""

    def __init__(
        self, system_at: SystemAt, bounds: tuple[float, float], own: float, omega: float, *,
        half_turn: bool, turns: int, sought: Sought = MOTIONS,
    ) -> None:  # fmt: skip
        low, high = bounds
        middle = 0.5 * sum(sought.bounds)
        inner = system_at(own if low < own < high else 0.5 * (low + high), middle)
        kept = inner.opening
        super().__init__(with_springs(inner, kept), half_turn=half_turn, turns=turns)
        self.system_at, self.bounds, self.own, self.omega = system_at, bounds, own, omega
        self.sought = sought
        series = machine_series(
            lambda *at: machine_parts(with_springs(system_at(*at), kept)), low, high, sought.bounds
        )
        if series is None:
            raise IncompleteError(
                f"the machine does not change smoothly between {low:.6g} and {high:.6g}; "
                "give an interval without a kink"
            )
        curve = sought.test != MOTION
        self.branches_off = not curve
        self.unknowns += int(curve)
        opened = np.zeros((len(self.springs), 2), np.int64)
        if sought.test == GRAZING:
            opened.flat[[sought.gap, *sought.at_once]] = 1
        self.problem = Varied(
            self.problem, series, omega, own, sought.own, sought.test, sought.gap, opened
        )
        self.scratch = new_varied_work(self.problem, self.shooting_work)

    @property
    def uneven(self) -> Real:
        gap, static = self.problem.series.gap, self.problem.series.static
        pulled = np.any(self.machine.order % 2 == 0) or np.any(static)
        with np.errstate(invalid="ignore"):
            even = (gap[..., 0] == gap[..., 1]).all(axis=(0, 1))
        return np.where(even & ~pulled, 0.0, 1.0)

    def like(self, *, half_turn: bool, turns: int) -> FieldSolver:
        return FieldSolver(
            self.system_at, self.bounds, self.own, self.omega, half_turn=half_turn, turns=turns,
            sought=self.sought,
        )  # fmt: skip

    def frequency(self, at: float) -> float:  # noqa: ARG002
        return self.omega

    def residual(self, z: Real, omega: float) -> tuple[Real, Real] | None:
        return self.solver_at(omega).residual(z, self.omega)

    def solver_at(self, value: float) -> ExactSolver:
        """A solver of the motions at a value of the field."""
        system = self.system_at(value, self.sought.own)
        return ExactSolver(system, half_turn=self.half_turn, turns=self.turns)

    def trace(self, u: Real, omega: float, course: Course) -> Traced:
        traced = super().trace(u, omega, course)
        if self.branches_off or traced.omega.size == 0:
            return traced
        first, size = traced.u[0], 2 * self.system.size
        off = distance_to(first[:size], u[:size], self.omega or float(u[-1]))
        low, high = self.sought.bounds
        if max(off, abs(first[-1] - u[-1]) / (abs(u[-1]) or high - low)) < SAME_CURVE:
            return traced
        # Newton has found a point of another curve.
        return Traced.recorded(traced.record, 0, status.NO_CONVERGENCE, course)

    def solve(self, u: Real, omega: float) -> Point | None:
        low, high = self.bounds
        course = Course(omega, omega, 1e-3 * (high - low), STEP_SHARE, 1.0, SHARP)
        record = self.new_branch(1)
        _, points, _ = self._follow(record, u, omega, course)
        return None if points == 0 else self.point_at(record.u[0], omega, np.nan, None)

    def eigenvalues(self, traced: Traced, maps: Real) -> Complex:  # noqa: ARG002
        return eigenvalues(maps)

    def depth(self, point: Point, spring: int, side: int) -> float:
        return point.formulation.solver().depth(point, spring, side)

    def return_map(self, point: Point) -> Real:
        return point.formulation.solver().return_map(point)

    def zero_between(
        self, traced: Traced, test: int, p: int, low: float, high: float
    ) -> tuple[float, FieldPoint]:
        share, found = super().zero_between(traced, test, p, low, high)
        point, work = cast("FieldPoint", found), self.corrector
        # The corrector holds the point just solved for.
        tangent = float(work.tangent[-2] * work.scale[-2])
        return share, replace(point, beside_tangent=tangent, own_map=self._map(work.J[:, :-1]))

    def own_multipliers(self, traced: Traced) -> Complex:
        """Eigenvalues of the return maps along a curve, (n, 2 N)."""
        return eigenvalues(self._map(traced.jacobian))

    def _map(self, jacobian: Real) -> Real:
        """The return map in a Jacobian, or in each of several."""
        size = 2 * self.system.size
        return np.asarray(jacobian[..., :size, :size] + np.eye(size))

    def point_at(
        self, u: Real, omega: float, omega_tangent: float, jacobian: Real | None
    ) -> FieldPoint:
        size = 2 * self.system.size
        # On a curve a second parameter stands beside the state.
        beside = float(u[size]) if u.size > size else np.nan
        speed, other = (self.omega, beside) if self.omega > 0.0 else (beside, 0.0)
        formulation = Formulation(
            ExactSolver, self.system_at(omega, other), self.half_turn, self.turns
        )
        known = None if jacobian is None else self._map(jacobian)
        point = FieldPoint(
            formulation, u[:size], speed, omega_tangent, known, value=omega, beside=beside
        )
        if self.sought.test == GRAZING and known is None:
            return replace(point, known_map=self._before_contact(point))
        return point

    def _before_contact(self, point: FieldPoint) -> Real:
        """The return map of a motion that grazes, of the side without the contact."""
        system = point.formulation.system.with_bonded()
        gaps = np.array([spring.gaps for spring in system.springs])
        gaps[self.problem.opened != 0] = np.inf
        springs = tuple(
            replace(spring, clearance=plus, clearance_minus=minus)
            for spring, (plus, minus) in zip(system.springs, gaps.tolist(), strict=True)
        )
        solver = ExactSolver(
            replace(system, springs=springs), half_turn=self.half_turn, turns=self.turns
        )
        return solver.return_map(replace(point, known_map=None))

    def points(self, traced: Traced) -> list[FieldPoint]:
        """The motions of a branch."""
        record = traced.record
        known = [
            J if phase == 0.0 else None
            for J, phase in zip(record.jacobian, record.phase, strict=True)
        ]
        rows = zip(record.u, record.omega, record.tangent[:, -1], known, strict=True)
        return [self.point_at(u, float(at), float(slope), J) for u, at, slope, J in rows]
