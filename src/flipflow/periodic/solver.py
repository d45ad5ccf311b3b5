"""What the two solvers of periodic motions share: the branch trace and what is read off points."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled import status
from flipflow.continuation import arclength
from flipflow.continuation.follow import FOLD, TRACE_ALL, follow
from flipflow.dynamics.assembly import PlanBuilder
from flipflow.dynamics.flow import Flow
from flipflow.dynamics.motion import Motion
from flipflow.errors import IncompleteError
from flipflow.model.system import MechanicalSystem
from flipflow.periodic.observe import corrected
from flipflow.periodic.scratch import new_branch, new_corrector, new_shooting
from flipflow.periodic.shooting import Shooting

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
STEP_SHARE = 0.1
POINTS_MOST = 20_000


@dataclass(frozen=True, eq=False)
class Traced:
    """Points of a branch as the arc-length loop left them; arrays over the points first."""

    u: Real
    omega: Real
    tangent: Real
    jacobian: Real
    signature: NDArray[np.int64]
    depth: Real
    iterations: NDArray[np.int64]
    rejected: NDArray[np.int64]
    reason: NDArray[np.int64]
    code: int
    course: arclength.Course
    record: arclength.Branch

    @classmethod
    def recorded(
        cls, record: arclength.Branch, points: int, code: int, course: arclength.Course
    ) -> Self:
        """The first ``points`` of a record, and what happened on the way to the next."""
        return cls(
            record.u[:points],
            record.omega[:points],
            record.tangent[:points],
            record.jacobian[:points],
            record.signature[:points],
            record.depth[:points],
            record.iterations[:points],
            record.rejected[: points + 1],
            record.reason[: points + 1],
            code,
            course,
            record,
        )

    def reversed_into(self, ahead: Traced) -> Traced:
        """Read the branch backwards, then ``ahead``, which starts from the same point."""
        back = self.omega.size - 1
        turned = slice(back, 0, -1)
        points = back + ahead.omega.size
        ends = (status.REACHED_UPPER, status.REACHED_LOWER, status.FOLLOWED)
        code = self.code if self.code not in ends else ahead.code
        # What is told of a step stands at its end, which is its other point when read backwards.
        none = np.zeros(1, np.int64)
        rejected, reason = (
            np.concatenate([none, mine[turned], its[1:]])
            for mine, its in ((self.rejected, ahead.rejected), (self.reason, ahead.reason))
        )
        record = arclength.Branch(
            u=np.concatenate([self.u[turned], ahead.u]),
            omega=np.concatenate([self.omega[turned], ahead.omega]),
            tangent=np.concatenate([-self.tangent[turned], ahead.tangent]),
            jacobian=np.concatenate([self.jacobian[turned], ahead.jacobian]),
            side=np.concatenate([-self.record.side[turned], ahead.record.side[: ahead.omega.size]]),
            signature=np.concatenate([self.signature[turned], ahead.signature]),
            depth=np.concatenate([self.depth[turned], ahead.depth]),
            iterations=np.concatenate([self.iterations[turned], ahead.iterations]),
            rejected=rejected,
            reason=reason,
        )
        code = status.FOLLOWED if code in ends else code
        return Traced.recorded(record, points, code, ahead.course)


@dataclass(frozen=True, eq=False)
class Point:
    """A solved motion: unknowns, tangent's share in omega, and return map or Jacobian."""

    solver: Solver
    u: Real
    omega: float
    omega_tangent: float = math.nan
    jacobian: Real | None = None
    known_map: Real | None = None

    @cached_property
    def return_map(self) -> Real:
        """Return map (2 N, 2 N) of a turn, or of half a turn with sign; worked out when asked."""
        if self.known_map is not None:
            return self.known_map
        jacobian = np.zeros((0, 0)) if self.jacobian is None else self.jacobian
        u, omega = self.u[None], np.array([self.omega])
        return np.asarray(self.solver.return_maps(u, omega, jacobian[None])[0])

    @property
    def eigenvalues(self) -> Complex:
        """Eigenvalues of the return map, (2 N,)."""
        return eigenvalues_of(self.return_map)


class Solver(ABC):
    """Finds periodic motions of one system at its forcing period.

    Parameters
    ----------
    system
        The machine.
    half_turn
        Look for motions that are their own mirror image after half a turn. Every solution then
        has the return map of half a turn, with sign: its eigenvalue +1 is a fold, -1 the loss of
        symmetry, and the multipliers of the full turn are its eigenvalues squared.
    """

    unknowns: int
    problem: Any
    reads_jacobian: bool
    turns: int = 1

    def __init__(self, system: MechanicalSystem, *, half_turn: bool) -> None:
        self.builder = PlanBuilder(system)
        self.system = self.builder.system
        self.half_turn = half_turn
        self.length = characteristic_length(self.builder)
        self._prepare()

    @abstractmethod
    def _prepare(self) -> None:
        """Build the problem and its scratch for the present plan."""

    @abstractmethod
    def return_maps(self, u: Real, omega: Real, jacobian: Real) -> Real:
        """Return maps (P, 2 N, 2 N) over half a turn (with sign) or a whole one."""

    @abstractmethod
    def extremes(self, u: Real, omega: Real, coordinates: Real) -> tuple[Real, Real, Complex]:
        """Least and greatest value and first harmonic (P, G) of coordinates (G, N)."""

    def gap_extremes(self, u: Real, omega: Real) -> tuple[Real, Real]:
        """Least and greatest position at each gap, (P, m)."""
        low, high, _ = self.extremes(u, omega, self.builder.plan.direction)
        return low, high

    @abstractmethod
    def states(self, u: Real, omega: Real) -> Real:
        """State (x, x') at t = 0, shape (P, 2 N)."""

    @abstractmethod
    def motion(self, u: Real, omega: float) -> Motion:
        """The motion over one turn."""

    @abstractmethod
    def series(self, u: Real, omega: Real) -> tuple[NDArray[np.int64], Complex]:
        """Harmonics (n_h,) and displacement amplitudes (P, n_h, N); empty for an exact motion."""

    @abstractmethod
    def unknowns_from(self, motion: Motion) -> Real:
        """Unknowns of a known motion, as a guess."""

    @property
    def flow(self) -> Flow:
        """Scratch whose contact state tells which configuration a kernel found missing."""
        return self.problem.flow

    def add_missing_configuration(self) -> None:
        """Prepare the configuration a kernel stopped at, and the problem anew."""
        self.add_configuration(self.flow)

    def add_configuration(self, flow: Flow) -> None:
        """Prepare the configuration at which a flow stopped, and the problem anew."""
        self.builder.add_contact_state(flow.state)
        self._prepare()

    def trace(self, u: Real, omega: float, course: arclength.Course) -> Traced:
        """Follow the branch through (u, omega) until it leaves the bounds of ``course``."""
        record = self.new_branch(POINTS_MOST)
        code, points, _ = self._follow(record, u, omega, course)
        return Traced.recorded(record, points, code, course)

    def new_branch(self, points: int) -> arclength.Branch:
        """An empty record for up to ``points`` points."""
        gaps = len(self.builder.springs)
        return new_branch(self.unknowns, gaps, points, with_jacobian=self.reads_jacobian)

    def _follow(
        self,
        record: arclength.Branch,
        u: Real,
        omega: float,
        course: arclength.Course,
        p: int = TRACE_ALL,
        shares: tuple[float, float] = (0.0, 0.0),
        test: int = 0,
    ) -> tuple[int, int, float]:
        """The compiled loop, begun anew whenever it finds a configuration missing."""
        while True:
            code, points, share = follow(
                self.problem, self.work, record, u, omega, course, p, *shares, test
            )
            if code != status.MISSING_CONFIGURATION:
                return code, points, share
            self.add_missing_configuration()
            if p == TRACE_ALL:
                record.rejected[:] = 0
                record.reason[:] = arclength.REASON_NONE

    def trace_through(self, u: Real, omega: float, course: arclength.Course) -> Traced:
        """Follow the branch from (u, omega) both ways, in rising omega at the start."""
        ahead = self.trace(u, omega, course._replace(direction=1.0))
        if ahead.code == status.CLOSED or ahead.omega.size == 0:
            return ahead
        return self.trace(u, omega, course._replace(direction=-1.0)).reversed_into(ahead)

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
            raise IncompleteError(
                f"no point found between two of the branch near {omega:.6g} rad/s"
            )
        u, omega = self.work.w[:-1].copy(), float(self.work.w[-1])
        jacobian = self.work.J[:, :-1].copy()
        return share, Point(self, u, omega, float(self.work.tangent[-1]), jacobian)

    def eigenvalues(self, traced: Traced, maps: Real) -> Complex:
        """Eigenvalues (P, 2 N) of return maps; without contact those of the open machine."""
        plan, shooting = self.builder.plan, self.shooting(half_turn=self.half_turn)
        rate = plan.rate[0, : plan.mode_count[0]]
        rate = np.concatenate([rate, rate[rate.imag > 0.0].conj()])
        free = np.all(traced.depth < 0.0, axis=(1, 2))
        duration = shooting.fraction * 2.0 * np.pi / traced.omega[free]
        found = np.empty(maps.shape[:-1], np.complex128)
        found[free] = shooting.sign * np.exp(duration[:, None] * rate)
        found[~free] = eigenvalues_of(maps[~free])
        return found

    def solve(self, u: Real, omega: float) -> Point | None:
        """Newton at fixed omega from the guess u; None where it does not converge."""
        course = arclength.Course(omega, omega, 1e-3 * omega, STEP_SHARE, 1.0, arclength.SHARP)
        record = self.new_branch(1)
        _, points, _ = self._follow(record, u, omega, course)
        if points == 0:
            return None
        return Point(self, record.u[0], omega, float(record.tangent[0, -1]), record.jacobian[0])

    def errors(self, u: Real, omega: Real) -> Real:
        """Distance in m of each motion from the exact one; infinite where it is not bounded.

        One Newton step of the exact flow corrects the state by delta = (I - M)^-1 (flow(z) - z);
        the largest difference of any displacement over the turn between the corrected flow and
        the motion is the estimate. Where a second step does not shrink, as close to a fold,
        nothing is promised.
        """
        harmonics, series = self.series(u, omega)
        states = self.states(u, omega)
        return self.corrected(states, omega, harmonics, series, half_turn=False)[1]

    def corrected(
        self,
        states: Real,
        omega: Real,
        harmonics: NDArray[np.int64],
        series: Complex,
        *,
        half_turn: bool,
    ) -> tuple[Real, Real]:
        """Return maps (P, 2 N, 2 N) and distances (P,) after one Newton step of the exact flow."""
        points, size = states.shape
        maps, error = np.empty((points, size, size)), np.empty(points)
        code = np.zeros(points, np.int64)
        while True:
            problem = self.shooting(half_turn=half_turn)
            square, pivot = np.empty((size, size)), np.zeros(size, np.int64)
            corrected(
                problem, states.copy(), omega, harmonics, series, square, pivot, np.empty(size),
                maps, error, code,
            )  # fmt: skip
            if not np.any(code == status.MISSING_CONFIGURATION):
                return maps, error
            self.add_configuration(problem.flow)

    def shooting(self, *, half_turn: bool) -> Shooting:
        """The shooting problem of the present plan, made once."""
        if half_turn not in self._shooting:
            self._shooting[half_turn] = new_shooting(
                self.builder.plan, half_turn=half_turn, length=self.length, turns=self.turns
            )
        return self._shooting[half_turn]

    def _new_work(self) -> None:
        self.work = new_corrector(self.unknowns, len(self.builder.springs))
        self._shooting: dict[bool, Shooting] = {}


def eigenvalues_of(maps: Real) -> Complex:
    """Eigenvalues (..., 2 N) of return maps; NaN where the flow failed and there is none."""
    known = np.isfinite(maps).all(axis=(-2, -1))
    if known.all():
        return np.linalg.eigvals(maps).astype(np.complex128)
    found = np.full(maps.shape[:-1], np.nan, np.complex128)
    found[known] = np.linalg.eigvals(maps[known])
    return found


def characteristic_length(builder: PlanBuilder) -> float:
    """The smallest gap in m that is not zero, else the stroke that the force alone would give."""
    gaps = [gap for spring in builder.springs for gap in spring.gaps if 0.0 < gap < np.inf]
    if gaps:
        return float(min(gaps))
    system = builder.system
    push = np.abs(np.linalg.solve(system.M, system.excitation.vector)).max()
    if system.excitation.power == 0:
        push = np.abs(np.linalg.solve(system.K, system.excitation.vector)).max()
    return float(push) or 1.0
