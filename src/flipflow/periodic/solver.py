"""What the solvers of periodic motions share: the branch trace and what is read off points."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from flipflow.compiled import status
from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.eigen import eigenvalues
from flipflow.compiled.interruptible import interruptible
from flipflow.continuation import correction, frequency_loop
from flipflow.continuation.refinement import FOLD, TRACE_ALL, follow
from flipflow.dynamics.assembly import machine_arrays
from flipflow.dynamics.flow import Flow
from flipflow.dynamics.motion import Motion
from flipflow.errors import IncompleteError, InputError
from flipflow.model.static_rest import rounding
from flipflow.model.system import MechanicalSystem
from flipflow.periodic.readings import corrected
from flipflow.periodic.shooting import Shooting, ShootingWork, new_shooting, new_shooting_work
from flipflow.results.result import Frozen

STEP_SHARE = 0.1  # longest step in the unknowns, as a share of their size
POINTS_MOST = 20_000  # that one branch can record; a few hundred are usual


@dataclass(frozen=True, eq=False)
class Traced:
    """Points of a branch as the arc-length loop left them; arrays over the points first.

    ``rejected`` and ``reason`` have one place more, for the step at which the branch ended.
    """

    record: frequency_loop.Record
    rejected: Int
    reason: Int
    code: int
    course: correction.Course

    @classmethod
    def recorded(
        cls, record: frequency_loop.Record, points: int, code: int, course: correction.Course
    ) -> Self:
        """The first ``points`` of a record, and what happened on the way to the next."""
        kept = frequency_loop.first_points(record, points)
        rejected, reason = record.rejected[: points + 1], record.reason[: points + 1]
        return cls(kept, rejected.copy(), reason.copy(), code, course)

    def first(self, points: int) -> Self:
        """The branch up to a point, as followed to an end there."""
        kept = frequency_loop.first_points(self.record, points)
        tried = self.rejected[: points + 1], self.reason[: points + 1]
        return type(self)(kept, *tried, status.FOLLOWED, self.course)

    @property
    def u(self) -> Real:
        """Unknowns, (n, unknowns)."""
        return self.record.u

    @property
    def omega(self) -> Real:
        """Frequency in rad/s, (n,)."""
        return self.record.omega

    @property
    def tangent(self) -> Real:
        """Unit in scaled unknowns, (n, unknowns + 1), the last column in omega."""
        return self.record.tangent

    @property
    def jacobian(self) -> Real:
        """dr/du, or (n, 0, 0) where nothing is read off it."""
        return self.record.jacobian

    @property
    def signature(self) -> Int:
        """A number that changes with the contacts of a turn, 0 without contact, (n,)."""
        return self.record.signature

    @property
    def depth(self) -> Real:
        """Greatest depth in m beyond each gap, (n, m, 2)."""
        return self.record.depth

    def reversed_into(self, ahead: Traced) -> Traced:
        """Read the branch backwards, then ``ahead``, which starts from the same point."""
        back = self.omega.size - 1
        turned = slice(back, 0, -1)
        points = back + ahead.omega.size
        ends = (status.REACHED_UPPER, status.REACHED_LOWER, status.FOLLOWED)
        code = self.code if self.code not in ends else ahead.code
        code = status.FOLLOWED if code in ends else code
        # Counts and reasons of a step stand at its end: read backwards, at its other point.
        none = np.zeros(1, np.int64)
        rejected, reason = (
            np.concatenate([none, mine[turned], its[1:]])
            for mine, its in ((self.rejected, ahead.rejected), (self.reason, ahead.reason))
        )
        joined = {
            name: np.concatenate([getattr(self.record, name)[turned], getattr(ahead.record, name)])
            for name in ("u", "omega", "phase", "jacobian", "signature", "depth", "iterations")
        }
        opposite = {
            name: np.concatenate([-getattr(self.record, name)[turned], getattr(ahead.record, name)])
            for name in ("tangent", "side")
        }
        record = frequency_loop.Record(
            **joined, **opposite, rejected=rejected[:points], reason=reason[:points]
        )
        return Traced(record, rejected, reason, code, ahead.course)


@dataclass(frozen=True, eq=False)
class Formulation(Frozen):
    """What is solved for periodic motions of a machine, without any scratch.

    Parameters
    ----------
    kind
        The solver, made anew whenever something is solved.
    system
        The machine, its springs without gap moved into the matrices.
    half_turn, turns
        As of :class:`Solver`.
    options
        What else the solver takes.
    """

    kind: type[Solver]
    system: MechanicalSystem
    half_turn: bool
    turns: int = 1
    options: tuple[float, ...] = ()

    def solver(self) -> Solver:
        """A new solver, with scratch that no other caller uses."""
        return self.kind(self.system, *self.options, half_turn=self.half_turn, turns=self.turns)

    @contextmanager
    def lent(self) -> Iterator[Solver]:
        """A solver for a moment, new where all others are in use: making one takes longer.

        One that was interrupted may still be at work, and is left alone.
        """
        try:
            solver = self._idle.pop()
        except IndexError:
            solver = self.solver()
        yield solver
        self._idle.append(solver)

    @cached_property
    def _idle(self) -> list[Solver]:
        return []


@dataclass(frozen=True, eq=False)
class Point(Frozen):
    """A solved motion: unknowns, tangent's share in omega, and return map where it is known."""

    formulation: Formulation
    u: Real
    omega: float
    omega_tangent: float = math.nan
    known_map: Real | None = None

    @cached_property
    def return_map(self) -> Real:
        """Return map (2 N, 2 N) of a turn, or of half a turn with sign; worked out when asked.

        NaN where the flow over a turn does not end.
        """
        if self.known_map is not None:
            return self.known_map
        try:
            with self.formulation.lent() as solver:
                return solver.return_map(self)
        except IncompleteError:
            return np.full((2 * self.formulation.system.size,) * 2, np.nan)

    @property
    def eigenvalues(self) -> Complex:
        """Eigenvalues of the return map, (2 N,)."""
        return eigenvalues(self.return_map)


class Solver(ABC):
    """Finds periodic motions of one machine; holds the scratch, for one caller at a time.

    Parameters
    ----------
    system
        The machine; springs that always act are moved into C and K first.
    half_turn
        Look for motions that are their own mirror image after half a turn. Every solution then
        has the return map of half a turn, with sign: its eigenvalue +1 is a fold, -1 the loss of
        symmetry, and the multipliers of the full turn are its eigenvalues squared.
    turns
        Forcing periods that pass before the motion repeats.

    Raises
    ------
    InputError
        For a machine that has no steady state: see
        :func:`~flipflow.dynamics.assembly.machine_arrays`.
    """

    unknowns: int
    problem: Any
    scratch: Any
    reads_jacobian: bool

    def __init__(self, system: MechanicalSystem, *, half_turn: bool, turns: int = 1) -> None:
        self.system = system.with_bonded()
        self.springs = self.system.springs
        self.half_turn, self.turns = half_turn, turns
        self.machine = machine_arrays(self.system)
        self.rest = resting_position(self.system)
        length = characteristic_length(self.system)
        self.length = min([length, *pressed_depths(self.system, self.rest)])

    @property
    def options(self) -> tuple[float, ...]:
        """What the solver takes besides machine, symmetry and turns."""
        return ()

    @cached_property
    def formulation(self) -> Formulation:
        """What this solver solves."""
        return Formulation(type(self), self.system, self.half_turn, self.turns, self.options)

    @abstractmethod
    def return_maps(self, u: Real, omega: Real, jacobian: Real) -> Real:
        """Return maps (P, 2 N, 2 N) over half a turn (with sign) or a whole one."""

    @abstractmethod
    def extremes(self, u: Real, omega: Real, coordinates: Real) -> tuple[Real, Real, Complex]:
        """Least and greatest value and first harmonic (P, G) of coordinates (G, N)."""

    def gap_extremes(self, u: Real, omega: Real) -> tuple[Real, Real]:
        """Least and greatest position at each gap, (P, m)."""
        low, high, _ = self.extremes(u, omega, self.machine.direction)
        return low, high

    def depth(self, point: Point, spring: int, side: int) -> float:
        """Greatest depth in m of a motion beyond a gap: side 0 plus, 1 minus."""
        least, most = self.gap_extremes(point.u[None], np.array([point.omega]))
        reach = most[0, spring] if side == 0 else -least[0, spring]
        return float(reach - self.springs[spring].gaps[side])

    @abstractmethod
    def states(self, u: Real, omega: Real) -> Real:
        """State (x, x') at t = 0, shape (P, 2 N)."""

    @abstractmethod
    def motion(self, u: Real, omega: float) -> Motion:
        """The motion over one period."""

    @abstractmethod
    def series(self, u: Real, omega: Real) -> tuple[Int, Complex]:
        """Harmonics (n_h,) and displacement amplitudes (P, n_h, N); empty for an exact motion."""

    @abstractmethod
    def unknowns_from(self, motion: Motion) -> Real:
        """Unknowns of a known motion, as a guess."""

    @property
    @abstractmethod
    def flow(self) -> Flow:
        """The flow's scratch, with the modes met so far."""

    def return_map(self, point: Point) -> Real:
        """The return map of a point that this solver, or one like it, has found.

        Raises
        ------
        IncompleteError
            When the flow over a turn does not end.
        """
        if point.known_map is not None:
            return point.known_map
        none = np.zeros((1, 0, 0))
        found = np.asarray(self.return_maps(point.u[None], np.array([point.omega]), none)[0])
        if not np.isfinite(found).all():
            raise IncompleteError(f"the flow over one turn at {point.omega:.6g} rad/s did not end")
        return found

    def trace(self, u: Real, omega: float, course: correction.Course) -> Traced:
        """Follow the branch through (u, omega) until it leaves the bounds of ``course``."""
        record = self.new_branch(POINTS_MOST, to_follow=True)
        code, points, _ = self._follow(record, u, omega, course)
        return Traced.recorded(record, points, code, course)

    def end_of_branch(
        self, u: Real, omega: float, course: correction.Course, points: int = POINTS_MOST
    ) -> Real | None:
        """Unknowns where the branch through (u, omega) meets the bound of ``course`` ahead.

        That is the upper one where its direction is up. None where the branch does not meet it
        within that many points.
        """
        record = frequency_loop.new_branch(
            self.unknowns, len(self.springs), points, with_jacobian=False, to_follow=True
        )
        code, count, _ = self._follow(record, u, omega, course)
        ahead = status.REACHED_UPPER if course.direction > 0.0 else status.REACHED_LOWER
        return record.u[count - 1].copy() if code == ahead else None

    def new_branch(self, points: int, *, to_follow: bool = False) -> frequency_loop.Record:
        """An empty record for up to ``points`` points."""
        return frequency_loop.new_branch(
            self.unknowns,
            len(self.springs),
            points,
            with_jacobian=self.reads_jacobian,
            to_follow=to_follow,
        )

    @property
    def uneven(self) -> Real:
        """1 for each spring whose gaps differ, (m,): 0 where the branch may be even.

        Under a constant force, or one of an even order, no motion is.
        """
        gaps = self.machine.stops.gap
        pulled = np.any(self.machine.order % 2 == 0) or np.any(self.machine.static)
        return np.where((gaps[:, 0] == gaps[:, 1]) & ~pulled, 0.0, 1.0)

    @cached_property
    def corrector(self) -> correction.Corrector:
        """Scratch of the bordered Newton solves; the last point corrected stands in it."""
        return correction.new_corrector(self.unknowns, self.uneven)

    def _follow(
        self,
        record: frequency_loop.Record,
        u: Real,
        omega: float,
        course: correction.Course,
        p: int = TRACE_ALL,
        shares: tuple[float, float] = (0.0, 0.0),
        test: int = 0,
    ) -> tuple[int, int, float]:
        """The compiled loop: status, points, share."""

        def run() -> tuple[int, int, float]:
            return follow(
                self.problem, self.scratch, self.corrector, record, u, omega, course, p, *shares,
                test,
            )  # fmt: skip

        if record.omega.size == 1 or p != TRACE_ALL:
            return run()
        work = record.omega.size * self.system.size**2
        return interruptible(run, self.corrector.stop, self.flow.stop, work=work)

    def between(self, traced: Traced, p: int, share: float) -> Point:
        """The branch's point at ``share`` of the way from point p to point p + 1."""
        return self.zero_between(traced, FOLD, p, share, share)[1]

    def zero_between(
        self, traced: Traced, test: int, p: int, low: float, high: float
    ) -> tuple[float, Point]:
        """Share and point between two shares of step p where a test of the kernels is zero.

        Raises
        ------
        IncompleteError
            When the branch cannot be corrected there.
        """
        course = traced.course
        code, _, share = self._follow(traced.record, traced.u[p], 0.0, course, p, (low, high), test)
        if code != status.OK:
            omega = traced.omega[p]
            raise IncompleteError(f"no point found between two of the branch near {omega:.6g}")
        w, tangent = self.corrector.home, float(self.corrector.tangent[-1])
        at_home = self.corrector.phase[0] == 0.0
        J = self.corrector.J[:, :-1] if at_home else None
        return share, self.point_at(w[:-1].copy(), float(w[-1]), tangent, J)

    def point_at(self, u: Real, omega: float, omega_tangent: float, jacobian: Real | None) -> Point:
        """A corrected point; where a Jacobian tells the return map, with it."""
        known = None
        if self.reads_jacobian and jacobian is not None:
            known = self.return_maps(u[None], np.array([omega]), jacobian[None])[0]
        return Point(self.formulation, u, omega, omega_tangent, known)

    def eigenvalues(self, traced: Traced, maps: Real) -> Complex:
        """Eigenvalues (P, 2 N) of return maps; without contact those of the open machine."""
        free = np.all(traced.depth < 0.0, axis=(1, 2))
        found = np.empty(maps.shape[:-1], np.complex128)
        found[~free] = eigenvalues(maps[~free])
        if free.any():
            rate = self._open_rates()
            problem = self.shooting(half_turn=self.half_turn)
            duration = problem.fraction * 2.0 * np.pi / traced.omega[free]
            found[free] = problem.sign * np.exp(duration[:, None] * rate)
        return found

    def _open_rates(self) -> Complex:
        """Eigenvalues of the machine with all springs open in 1/s, (2 N,)."""
        n = self.system.size
        motion = np.concatenate([np.zeros((n, n)), np.eye(n)], axis=1)
        forces = np.concatenate([-self.machine.stiffness, -self.machine.damping], axis=1)
        return eigenvalues(np.concatenate([motion, forces]))

    def solve(self, u: Real, omega: float) -> Point | None:
        """Newton at fixed omega from the guess u; None where it does not converge."""
        record = self.new_branch(1)
        if not self._corrected(record, u, omega, correction.SHARP):
            return None
        J = record.jacobian[0] if record.phase[0] == 0.0 else None
        point = self.point_at(record.u[0], omega, float(record.tangent[0, -1]), J)
        if J is None and self.reads_jacobian:
            # Nearly every caller asks for the map; found later, it needs a solver of its own.
            return replace(point, known_map=self._map_of(point))
        return point

    def _map_of(self, point: Point) -> Real | None:
        """The return map of a point; None where the flow over a turn does not end."""
        try:
            return self.return_map(point)
        except IncompleteError:
            return None

    def starts(self, u: Real, omega: float) -> bool:
        """Whether a branch can start from the guess u: Newton may end less sharp than that."""
        return self._corrected(self.new_branch(1), u, omega, correction.QUICK)

    def _corrected(
        self, record: frequency_loop.Record, u: Real, omega: float, tolerance: float
    ) -> bool:
        """Whether Newton at fixed omega leads from the guess u to the only point of a record."""
        course = correction.Course(omega, omega, 1e-3 * omega, STEP_SHARE, 1.0, tolerance)
        _, points, _ = self._follow(record, u, omega, course)
        return points > 0

    def errors(self, u: Real, omega: Real) -> Real:
        """Distance in m of each motion from the exact one; infinite where it is not bounded.

        One Newton step of the exact flow corrects the state by delta = (I - M)^-1 (flow(z) - z);
        the largest difference of any displacement over the turn between the corrected flow and
        the motion is the estimate. Where a second step does not shrink, as close to a fold,
        there is no estimate.
        """
        harmonics, series = self.series(u, omega)
        states = self.states(u, omega)
        return self.corrected(states, omega, harmonics, series, half_turn=False)[1]

    def corrected(
        self,
        states: Real,
        omega: Real,
        harmonics: Int,
        series: Complex,
        *,
        half_turn: bool,
    ) -> tuple[Real, Real]:
        """Return maps (P, 2 N, 2 N) and distances (P,) after one Newton step of the exact flow."""
        points, size = states.shape
        maps, error = np.empty((points, size, size)), np.empty(points)
        code = np.zeros(points, np.int64)
        square, pivot = np.empty((size, size)), np.zeros(size, np.int64)
        problem = self.shooting(half_turn=half_turn)
        interruptible(
            lambda: corrected(
                problem, self.shooting_work, states.copy(), omega, harmonics, series, square,
                pivot, np.empty(size), maps, error, code,
            ),
            self.shooting_work.flow.stop,
            work=points * size**2,
        )  # fmt: skip
        return maps, error

    def shooting(self, *, half_turn: bool) -> Shooting:
        """The shooting problem over the motion's period, or half of it."""
        return new_shooting(
            self.machine, half_turn=half_turn, length=self.length, turns=self.turns, rest=self.rest
        )

    @cached_property
    def shooting_work(self) -> ShootingWork:
        """Scratch of the exact flow."""
        return new_shooting_work(self.machine)


def resting_position(system: MechanicalSystem) -> Real:
    """Where the machine rests under its constant force in m, (N,); zero where nothing holds it."""
    preloaded = any(min(spring.gaps) < 0.0 for spring in system.springs)
    if not preloaded and not np.any(system.constant_force):
        return np.zeros(system.size)
    try:
        return np.ascontiguousarray(system.static_position())
    except InputError:
        return np.zeros(system.size)


def pressed_depths(system: MechanicalSystem, rest: Real) -> Iterator[float]:
    """How deep in m the machine lies in each of the stops on which it rests."""
    for spring in system.springs if rest.any() else ():
        y = float(spring.direction @ rest)
        depth = max(y - spring.gaps[0], -y - spring.gaps[1])
        if spring.acts and depth > rounding(spring.direction, rest):
            yield depth


def characteristic_length(system: MechanicalSystem) -> float:
    """The smallest gap in m that is not zero, else the stroke that the force alone would give."""
    gaps = [abs(gap) for spring in system.springs for gap in spring.gaps]
    known = [gap for gap in gaps if 0.0 < gap < math.inf]
    if known:
        return min(known)
    terms = [term for one in system.excitations for term in one.terms]
    unbalances = [vector for power, vector in terms if power == 2]
    if unbalances:
        return float(np.abs(np.linalg.solve(system.M, np.transpose(unbalances))).max()) or 1.0
    forces = [np.abs(one.vector) for one in system.excitations]
    held = np.linalg.lstsq(system.K, np.sum([*forces, np.abs(system.constant_force)], axis=0))[0]
    return float(np.abs(held).max()) or 1.0
