"""A branch of periodic motions over frequency."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import pairwise
from typing import cast

import numpy as np
from numpy.linalg import norm
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

from flipflow.compiled.arrays import Real
from flipflow.continuation.branch_status import STEP_REASON, BranchStatus
from flipflow.continuation.orbit_row import FollowedMotions
from flipflow.continuation.refinement import SHARE_TOLERANCE
from flipflow.continuation.special_points import FOLD, KINDS
from flipflow.dynamics.motion import phase_of
from flipflow.errors import IncompleteError, InputError
from flipflow.model.arguments import (
    checked_index,
    checked_kind,
    checked_number,
    checked_speed,
    checked_word,
)
from flipflow.model.screen import unit_in
from flipflow.model.system import Coordinate, Machine, MechanicalSystem
from flipflow.periodic.options import Method
from flipflow.periodic.orbit import Orbit
from flipflow.periodic.solver import Formulation, Point, Solver, Traced
from flipflow.periodic.stability import stability_words
from flipflow.results.result import above

AT_TURN = 1e-7  # share of a step within which a peak is found
Node = tuple[float, float]  # position along the branch, and omega there


@dataclass(frozen=True, eq=False)
class SpecialPoint:
    """A point where the character of the motion changes.

    Parameters
    ----------
    kind
        "fold" (a saddle-node: the amplitude jumps here where the motion is stable on one side),
        "contact begin", "contact end", "symmetry breaking", "period doubling", "Neimark-Sacker" or
        "branch point" (another branch crosses, as where a rotor loses the symmetry of its stops).
    orbit
        The motion at the point.
    position
        Where it stands along the branch: point index plus share of the step; half a step beyond
        an end where the branch meets the one from which it comes.
    spring, side
        The stop and its side (+1, -1) for contact; -1 and 0 otherwise.
    """

    kind: str
    orbit: Orbit
    position: float
    spring: int = -1
    side: int = 0

    def __repr__(self) -> str:
        return f"SpecialPoint({self.kind}, {self.omega:.9g}{unit_in(self.orbit.machine, 'rad/s')})"

    @property
    def omega(self) -> float:
        """Frequency in rad/s."""
        return self.orbit.omega

    def amplitude(self, which: Coordinate) -> float:
        """Half peak-to-peak of a coordinate in m."""
        return self.orbit.amplitude(which)

    def sensitivity(self, names: Sequence[str]) -> Real:
        r"""Exact derivatives of the point's frequency with respect to parameters of the machine.

        Of a fold, with l the left vector of the eigenvalue 1 and r the residual of the motion,

        .. math:: \frac{d \omega}{d p} = -\frac{l\, r_p}{l\, r_\omega} ;

        of the others by what is zero there: the depth at a gap, the eigenvalue + 1, the size of
        the pair - 1.

        Parameters
        ----------
        names
            P parameters, as of :meth:`Orbit.sensitivity`, without "omega".

        Returns
        -------
        ndarray
            In rad/s per SI unit of each parameter, (P,).

        Raises
        ------
        InputError
            For an unknown name, and for a kind of point that no such condition defines.
        IncompleteError
            Where the point is a corner, and where a parameter takes it away.
        """
        return cast("Real", above("studies.derivatives", "point_sensitivity")(self, names))


@dataclass(frozen=True)
class ShortenedStep:
    """A step that was refused: omega in rad/s where it began, how often halved, why at last."""

    omega: float
    times: int
    reason: str


@dataclass(frozen=True, eq=False)
class Branch(FollowedMotions):
    """Periodic motions followed over frequency, in their order along the branch.

    Folds turn the branch back, so that ``omega`` is not monotone. Arrays are (n,) over its
    points; it is what :func:`flipflow.frequency_response` returns, and
    :func:`flipflow.continue_orbit` and :func:`flipflow.switch_branch` over frequency.

    Parameters
    ----------
    machine
        What was analysed.
    method
        Options of the method used.
    formulation, traced
        What was solved, and the points.
    return_maps
        Linearised return maps over a turn, or over half a turn with sign, (n, 2 N, 2 N), each from
        the phase of the force at which the point was solved for.
    saddle_side_at_start
        Whether an odd number of real multipliers lies beyond +1 where the branch rises.
    multipliers
        Floquet multipliers of the full turn, (n, 2 N), largest modulus first.
    stability
        Words, (n,): "stable", "unstable" or "undetermined".
    special_points
        In branch order, each refined to rounding.
    status
        How the branch ended; ``status.complete`` is False when it could not be finished.
    notes
        A sentence for each thing that could not be settled.
    version
        Version of flipflow.
    """

    machine: Machine
    method: Method
    formulation: Formulation
    traced: Traced
    return_maps: Real
    saddle_side_at_start: bool
    multipliers: NDArray[np.complex128]
    stability: NDArray[np.str_]
    special_points: tuple[SpecialPoint, ...]
    status: BranchStatus
    notes: tuple[str, ...]
    version: str

    def __post_init__(self) -> None:
        for array in (self.multipliers, self.stability):
            array.setflags(write=False)

    def __repr__(self) -> str:
        span = f"{self.omega.min():.6g} to {self.omega.max():.6g}" if self.omega.size else ""
        ends = f"{span}{unit_in(self.machine, 'rad/s')}, " if span else ""
        return f"Branch({self.omega.size} points, {ends}{self._counted()}, {self.status.name})"

    @property
    def system(self) -> MechanicalSystem:
        """The machine as it was solved."""
        return self.formulation.system

    @property
    def periods(self) -> int:
        """Number of forcing periods after which the motions repeat."""
        return self.formulation.turns

    @property
    def omega(self) -> Real:
        """Frequency in rad/s along the branch, (n,); both ends exactly as asked for."""
        omega = self.traced.omega.view()
        omega.setflags(write=False)
        return omega

    @property
    def folds(self) -> tuple[SpecialPoint, ...]:
        """The saddle-nodes, in branch order."""
        return self.points_of(FOLD)

    @cached_property
    def error(self) -> Real:
        """Estimated distance of each motion from the exact one in m, (n,); infinite: unknown."""
        with self.formulation.lent() as solver:
            return solver.errors(self.traced.u, self.traced.omega)

    @property
    def shortened_steps(self) -> tuple[ShortenedStep, ...]:
        """Steps that were refused and halved on the way, the one at which the branch ended too."""
        rejected, reason = self.traced.rejected, self.traced.reason
        return tuple(
            ShortenedStep(float(self.omega[p - 1]), int(rejected[p]), STEP_REASON[int(reason[p])])
            for p in np.flatnonzero(rejected)
            if p > 0
        )

    def points_of(self, kind: str) -> tuple[SpecialPoint, ...]:
        """Special points of one kind, in branch order.

        Raises
        ------
        InputError
            For a word that is no kind.
        """
        checked_word("kind", kind, KINDS)
        return tuple(point for point in self.special_points if point.kind == kind)

    def amplitude(self, which: Coordinate) -> Real:
        """Half peak-to-peak of a coordinate at every point in m, (n,)."""
        low, high, _ = self._extremes(which)
        return np.asarray((high - low) / 2.0)

    def phase(self, which: Coordinate) -> Real:
        """Phase of the first harmonic against the force in rad, (n,); positive: it leads.

        NaN where there is none, as in a motion that nothing excites once a turn.
        """
        low, high, first = self._extremes(which)
        return phase_of(first, 0.5 * (high - low))

    def orbit(self, i: int) -> Orbit:
        """The motion at point i of the branch."""
        n = self.omega.size
        i = checked_index("i", i, n, f"the branch has points 0 to {n - 1}", least=-n)
        u, omega = self.traced.u[i].copy(), float(self.omega[i])
        at_home = self.traced.record.phase[i] == 0.0
        known = self.return_maps[i] if at_home else None
        point = Point(self.formulation, u, omega, known_map=known)
        return Orbit(self.machine, point, str(self.stability[i]))

    def orbits_at(self, omega: float) -> tuple[Orbit, ...]:
        """The motions of this branch at exactly ``omega``, in branch order, each solved for.

        Raises
        ------
        InputError
            For a frequency outside the branch.
        IncompleteError
            When the branch has no points.
        """
        if self.omega.size == 0:
            raise IncompleteError(f"The branch has no points. {self.status.value}")
        ends = [*self.omega.tolist(), *(fold.omega for fold in self.folds)]
        remedy = f"give a number in rad/s, the branch runs from {min(ends):.6g} to {max(ends):.6g}"
        if not min(ends) <= checked_number("omega", omega, remedy) <= max(ends):
            raise InputError("omega", omega, remedy)
        omega = float(omega)
        if self.omega.size == 1:
            return (self.orbit(0),)
        found: list[Orbit] = []
        for begin, end in self._passages(omega):
            orbit = self._between_nodes(begin, end, omega)
            if orbit is None:
                continue
            one = orbit.unknowns
            if not any(np.allclose(one, each.unknowns, rtol=1e-7, atol=1e-12) for each in found):
                found.append(orbit)
        return tuple(found)

    @cached_property
    def _nodes(self) -> list[Node]:
        """Points and the folds between them, in the branch's order."""
        inner = [fold for fold in self.folds if 0.0 < fold.position < self.omega.size - 1]
        turns = {fold.position: fold.omega for fold in inner}
        return sorted((dict(enumerate(self.omega.tolist())) | turns).items())

    def _passages(self, omega: float) -> list[tuple[Node, Node]]:
        """Pairs of neighbours, points and folds, between which ``omega`` is passed."""
        return [
            pair
            for pair in pairwise(self._nodes)
            if pair[0][1] <= omega <= pair[1][1] or pair[1][1] <= omega <= pair[0][1]
        ]

    def _between_nodes(self, begin: Node, end: Node, omega: float) -> Orbit | None:
        """The motion at ``omega`` between two neighbours; None where it is not found."""
        for fold in self.folds:
            if fold.omega == omega and fold.position in (begin[0], end[0]):
                return fold.orbit
        with self.formulation.lent() as solver:
            point = self._along_chord(solver, begin, end, omega)
            if point is None:
                point = self._along_branch(solver, begin, end, omega)
        return None if point is None else self._solved(point, rises=end[1] > begin[1])

    def _along_chord(self, solver: Solver, begin: Node, end: Node, omega: float) -> Point | None:
        """The motion at ``omega`` that Newton reaches from the chord of two neighbours.

        None where it does not lie between them: beside a fold Newton may end on its other side.
        """
        size = np.abs(self.traced.u).max(axis=0)
        size[size == 0.0] = 1.0
        first, last = self._unknowns_at(begin[0]), self._unknowns_at(end[0])
        chord = (last - first) / size
        span = end[1] - begin[1]
        guess = first + ((omega - begin[1]) / span if span else 0.0) * (last - first)
        point = solver.solve(guess, omega)
        if point is None or norm((point.u - guess) / size) > norm(chord):
            return None
        along = float((point.u - first) / size @ chord)
        return point if 0.0 <= along <= chord @ chord else None

    def _unknowns_at(self, position: float) -> Real:
        """Unknowns at a node: a fold, or a point of the branch."""
        for fold in self.folds:
            if fold.position == position:
                return fold.orbit.unknowns
        return self.traced.u[int(position)]

    def _along_branch(self, solver: Solver, begin: Node, end: Node, omega: float) -> Point | None:
        """The motion at ``omega``, sought along the branch itself."""
        p = min(int(begin[0]), self.omega.size - 2)
        known = {node[0] - p: node[1] - omega for node in (begin, end)}

        def off(share: float) -> float:
            if share in known:
                return known[share]
            return solver.between(self.traced, p, share).omega - omega

        low, high = known
        try:
            share = float(brentq(off, low, high, xtol=SHARE_TOLERANCE))
            guess = solver.between(self.traced, p, share).u
        except IncompleteError:  # the branch has a corner there
            share = low + (high - low) * known[low] / (known[low] - known[high])
            guess = (1.0 - share) * self.traced.u[p] + share * self.traced.u[p + 1]
        return solver.solve(guess, omega)

    @cached_property
    def rising_path(self) -> tuple[slice, ...]:
        """Runs of points that a machine passes when its speed is raised slowly from below.

        Each run rises in omega. At a fold the machine jumps to the next stable part of the branch
        that leads on to higher speed.
        """
        runs: list[slice] = []
        begin, size = 0, self.omega.size
        while begin < size:
            falls = np.flatnonzero(np.diff(self.omega[begin:]) <= 0.0)
            end = begin + int(falls[0]) + 1 if falls.size else size
            runs.append(slice(begin, end))
            ahead = np.arange(end, size)
            beyond = ahead[(self.omega[end:] > self.omega[end - 1]) & self.stable[end:]]
            begin = int(beyond[0]) if falls.size and beyond.size else size
        return tuple(runs)

    def orbit_from_below(self, omega: float) -> Orbit | None:
        """The motion of this branch met at ``omega`` when the speed is raised slowly from below.

        Where it is unstable the machine has left it for one that is not on this branch, such as a
        leaning one behind a symmetry breaking: :func:`~flipflow.sweep` flies there.
        """
        omega = checked_speed(omega)
        for k, run in enumerate(self.rising_path):
            low = self.omega[run.start] if k == 0 else self._end_of(self.rising_path[k - 1])
            if low <= omega <= self._end_of(run):
                return self.solve_in(run, omega)
        return None

    def _end_of(self, run: slice) -> float:
        """Highest omega of a run: the refined fold behind its last point, or that point."""
        fold = fold_at_end(self, run)
        last = float(self.omega[run.stop - 1])
        return last if fold is None else max(last, fold.omega)

    def solve_in(self, run: slice, omega: float) -> Orbit | None:
        """The motion at exactly ``omega`` on the stretch of rising speed that contains a run.

        None where that stretch does not pass ``omega``, and where no motion is found.
        """
        omega, n = checked_speed(omega), self.omega.size
        remedy = "give one of the branch's rising_path"
        checked_kind("run", run, slice, remedy)
        checked_index("run", run.start, n, remedy)
        checked_index("run", run.stop, n + 1, remedy)
        fold = fold_at_end(self, run)
        end = run.stop - 1.0 if fold is None else fold.position
        # The stretch may begin before the run, at a fold.
        falls = np.flatnonzero(np.diff(self.omega[: run.start + 1]) <= 0.0)
        begin = float(falls[-1]) if falls.size else 0.0
        turns = [one.position for one in self.folds if begin < one.position <= run.start]
        begin = max([begin, *turns])
        for low, high in self._passages(omega):
            if low[1] < high[1] and low[0] >= begin and high[0] <= end:
                return self._between_nodes(low, high, omega)
        return None

    def _solved(self, point: Point, *, rises: bool) -> Orbit:
        """A motion solved for on a part of the branch that rises or falls in omega.

        The multipliers of an exact motion tell its stability; those of a series do so with the side
        of the fold on which it stands.
        """
        if self.formulation.kind.reads_jacobian:
            return Orbit(self.machine, point)
        side = np.array([self.saddle_side_at_start ^ (not rises)])
        word = stability_words(point.eigenvalues[None], side)[0]
        return Orbit(self.machine, point, str(word))

    def peak(self, which: Coordinate) -> SpecialPoint:
        """The motion of largest amplitude on the branch, refined between its points."""
        size = self.amplitude(which)
        if not np.isfinite(size).any():
            raise IncompleteError(f"The branch has no points. {self.status.value}")
        return self._refined(which, int(np.nanargmax(size)), "peak")

    def peaks(self, which: Coordinate) -> tuple[SpecialPoint, ...]:
        """Every resonance peak: local maxima of the amplitude in branch order, refined."""
        tops = _inner_maxima(self.amplitude(which))
        return tuple(self._refined(which, int(top), "peak") for top in tops)

    def troughs(self, which: Coordinate) -> tuple[SpecialPoint, ...]:
        """Every local minimum of the amplitude in branch order, refined: antiresonances."""
        feet = _inner_maxima(-self.amplitude(which))
        return tuple(self._refined(which, int(foot), "trough") for foot in feet)

    def _refined(self, which: Coordinate, top: int, kind: str) -> SpecialPoint:
        """The peak or trough near point ``top``, sought once and kept."""
        key = (*self.system.coordinate(which).tolist(), top, kind)
        if key not in self._turned:
            self._turned[key] = self._turn_near(which, top, kind)
        return self._turned[key]

    def _turn_near(self, which: Coordinate, top: int, kind: str) -> SpecialPoint:
        """The peak or trough near point ``top``, searched in the steps on both sides of it."""
        sign = -1.0 if kind == "peak" else 1.0
        vector = self.system.coordinate(which)[None]
        solver = self.formulation.solver()
        best = SpecialPoint(kind, self.orbit(top), float(top))
        at_top = sign * best.amplitude(which)
        worst = at_top + abs(at_top)
        if self.omega.size == 1:
            return best

        def place(t: float) -> tuple[int, float]:
            """Step and share of it; t is 2 at the point, since tolerances are shares of |t|."""
            return (top - 1, t - 1.0) if t < 2.0 else (top, t - 2.0)

        @cache  # the search asks again for the values that it begins with, and we for its last
        def rise(t: float) -> float:
            try:
                point = solver.between(self.traced, *place(t))
            except IncompleteError:
                return worst  # Newton may fail between two sharp bends
            low, high, _ = solver.extremes(point.u[None], np.array([point.omega]), vector)
            size = sign * 0.5 * float(high[0, 0] - low[0, 0])
            return size if math.isfinite(size) else worst

        t = _least(rise, 1.0 if top > 0 else 2.0, 3.0 if top + 1 < self.omega.size else 2.0)
        if not rise(t) < at_top:
            return best
        p, share = place(t)
        point = solver.between(self.traced, p, share)
        orbit = self._solved(point, rises=bool(self.omega[p + 1] > self.omega[p]))
        return SpecialPoint(kind, orbit, p + share)

    def _extremes(self, which: Coordinate) -> tuple[Real, Real, NDArray[np.complex128]]:
        key = tuple(self.system.coordinate(which))
        if key not in self._seen:
            with self.formulation.lent() as solver:
                low, high, first = solver.extremes(
                    self.traced.u, self.traced.omega, np.array([key])
                )
            self._seen[key] = (low[:, 0], high[:, 0], first[:, 0])
        return self._seen[key]

    @cached_property
    def _turned(self) -> dict[tuple[object, ...], SpecialPoint]:
        return {}

    @cached_property
    def _seen(self) -> dict[tuple[float, ...], tuple[Real, Real, NDArray[np.complex128]]]:
        return {}


def fold_at_end(branch: Branch, run: slice) -> SpecialPoint | None:
    """The fold at which a run of rising points ends; None at the end of the branch."""
    near = (fold for fold in branch.folds if run.stop - 2 <= fold.position <= run.stop)
    return max(near, key=lambda fold: fold.omega, default=None)


def _least(function: Callable[[float], float], low: float, high: float) -> float:
    """Where a function is least between two ends, 1 or 2 and 2 or 3, within AT_TURN."""
    if low < 2.0 < high and function(2.0) < min(function(low), function(high)):
        # Steps of parabolas, which three points with the least amid begin.
        found = minimize_scalar(function, bracket=(low, 2.0, high), tol=0.5 * AT_TURN)
    else:
        found = minimize_scalar(function, bounds=(low, high), options={"xatol": AT_TURN})
    return float(found.x)


def _inner_maxima(values: Real) -> NDArray[np.intp]:
    """Indices of local maxima, ends left out."""
    inner = (values[1:-1] > values[:-2]) & (values[1:-1] >= values[2:])
    return np.flatnonzero(inner) + 1
