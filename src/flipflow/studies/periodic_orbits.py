"""Every periodic motion found at one frequency, mirror images too."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from itertools import product

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.continuation import correction
from flipflow.continuation.frequency_response import first_unknowns
from flipflow.continuation.starts import SETTLING_TURNS, cloud
from flipflow.errors import IncompleteError
from flipflow.model.arguments import (
    checked_count,
    checked_generator,
    checked_monitor,
    checked_speed,
)
from flipflow.model.monitor import Monitor
from flipflow.model.system import Machine, MechanicalSystem, system_of
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.one_state import one_state_motions
from flipflow.periodic.orbit import Orbit, state_at_rest
from flipflow.periodic.solver import STEP_SHARE, Point
from flipflow.periodic.two_event import TwoEventProblem
from flipflow.studies.independent_parts import IndependentPart, independent_parts, joined_state
from flipflow.transient.settling import Settling

MOST_PERIODS = 12  # longest period that may be looked for, in forcing periods
SWEEP_RATIO = 1.3  # speed at which a stepped start begins, over the one asked for or under it
SWEEP_STEPS = 12  # speeds on the way
BRANCH_RATIOS = (1.15, 2.5)  # ends of the branch from below over the speed asked for, and under it
FAMILY_RATIOS = (1.1, 1.0 / 1.1)  # speeds over the one asked for with families that may reach it
FAMILY_REACH = 1.15  # how far a family of several periods is followed to either side, as a factor
SAME_WAY = 1e-9  # share of the largest way by which ways of mirrors differ, by rounding
BRANCH_STEPS = 60  # longest step on it: the interval divided by this

logger = logging.getLogger("flipflow")


def periodic_orbits(
    machine: Machine,
    omega: float,
    max_periods: int = 1,
    rng: int | np.random.Generator = 0,
    *,
    monitor: Monitor | None = None,
) -> tuple[Orbit, ...]:
    """Periodic motions at ``omega`` that repeat after up to ``max_periods`` forcing periods.

    Motions that never change their contacts are closed form. The others are searched for from
    these starts: the motions of the branch reached from below, between its folds too; for one
    symmetric stop, every zero of the scalar problem of two-touch motions; rest; what is reached by
    stepping the speed up and down to ``omega``; and a low-discrepancy cloud of states as large as
    the linear motion or the gaps. Each is tried as it is (unstable motions are found so) and after
    some turns of settling. Newton on the exact flow over 1, 2, ... turns, so that motions need not
    be symmetric; for a machine that is its own mirror image every motion's mirror image is one too.
    Motions of several periods, found here or a tenth above or below, are followed through their
    folds. Parts of a machine that nothing connects are searched one by one, and each combination of
    their motions is one of the machine. A start whose flow does not end is left out; the monitor
    and the log hear how many were.

    Parameters
    ----------
    machine
        A screen, a :class:`~flipflow.MechanicalSystem`, or any machine with ``.system()``.
    omega
        Forcing frequency in rad/s.
    max_periods
        Most forcing periods after which a motion may repeat, 1 to 12.
    rng
        Seed or generator for the cloud of starts.
    monitor
        Called with a sentence and the share done; raise from it to cancel.

    Returns
    -------
    tuple of Orbit
        Stable and unstable, each once whatever its phase, largest relative motion at the first gap
        first. A search, not a proof: a motion with a small basin and weak instability can be
        missed. Motions of a machine that nothing holds while it touches no stop are as many as
        places where it can float, and are left out.

    Raises
    ------
    InputError
        For a frequency that is not finite or not above 0, periods outside 1 to 12, or no seed.
    IncompleteError
        When no start at all could be followed.
    """
    max_periods = checked_count("max_periods", max_periods, MOST_PERIODS)
    say = checked_monitor(monitor)
    random = checked_generator(rng)
    search = _Search(machine, checked_speed(omega), max_periods)
    parts = independent_parts(search.settling.solver.system)
    if len(parts) > 1:
        motions = []
        for k, part in enumerate(parts):

            def tell(words: str, share: float, k: int = k) -> None:
                say(f"part {k + 1} of {len(parts)}: {words}", (k + share) / len(parts))

            motions.append(periodic_orbits(part.system, omega, max_periods, random, monitor=tell))
        search.combine(motions, parts)
        return search.orbits()
    search.add_one_state_motions()
    starts = search.starts(random)
    if TwoEventProblem.applies(search.settling.solver.system):
        starts += list(TwoEventProblem(search.settling.solver.machine).states(search.omega)[0])
    for k, start in enumerate(starts):
        search.try_from(start)
        say(search.progress(), (k + 1) / len(starts))
    if max_periods > 1:
        search.follow_families(random)
    return search.orbits()


def attracting_orbits(
    machine: Machine, omega: float, rng: int | np.random.Generator = 0
) -> tuple[Orbit, ...]:
    """Stable motions of one forcing period to which a cloud of states settles.

    Cheaper than :func:`periodic_orbits` where unstable motions are of no use; the largest first.
    """
    random = checked_generator(rng)
    search = _Search(machine, checked_speed(omega), 1)
    parts = independent_parts(search.settling.solver.system)
    if len(parts) > 1:
        search.combine([attracting_orbits(part.system, omega, random) for part in parts], parts)
    else:
        search.add_one_state_motions()
        for start in search.starts(random):
            search.try_settled(start)
    return tuple(orbit for orbit in search.orbits() if orbit.stable)


class _Search:
    """The motions found so far at one frequency."""

    def __init__(self, machine: Machine, omega: float, max_periods: int) -> None:
        self.machine = machine
        self.settling = Settling(system_of(machine), max_periods)
        self.omega, self.max_periods = omega, max_periods
        self.found: list[Point] = []
        self.phases: list[Real] = []  # states after each forcing period of those found
        self.mirrored: list[Point] = []  # those whose mirror image has been looked for
        self.flown = self.lost = 0

    def starts(self, rng: np.random.Generator) -> list[Real]:
        """Rest, the branch from below, a cloud of states, and stepped speeds."""
        solver = self.settling.solver
        stepped = (self._stepped(ratio) for ratio in (1.0 / SWEEP_RATIO, SWEEP_RATIO))
        return [
            state_at_rest(solver.system),
            first_unknowns(solver, self.omega),
            *(z for ratio in BRANCH_RATIOS for z in _on_branch(solver.system, self.omega, ratio)),
            *cloud(solver, self.omega, rng),
            *(z for z in stepped if z is not None),
        ]

    def add_one_state_motions(self) -> None:
        """Add the motions that never change their contacts."""
        solver = self.settling.solver
        for z in one_state_motions(solver.system, self.omega):
            point = solver.solve(z, self.omega)
            if point is not None:
                self._keep(point)

    def combine(self, found: Sequence[Sequence[Orbit]], parts: Sequence[IndependentPart]) -> None:
        """Add every combination of motions of independent parts, in every phase to each other."""
        phases = [
            [(orbit.periods, z) for orbit in orbits for z in _phases(part.system, orbit)]
            for part, orbits in zip(parts, found, strict=True)
        ]
        for chosen in product(*phases):
            periods = math.lcm(*(one for one, _ in chosen))
            if periods > self.max_periods:
                continue
            z = joined_state(parts, [one for _, one in chosen])
            point = self.settling.solver_of(periods).solve(z, self.omega)
            if point is not None:
                self._keep(point)

    def try_from(self, start: Real) -> None:
        """Newton from a state and from where it settles to, for every number of periods."""
        settled = self._flown(start, self.omega)
        if settled is not None:
            self._try(start)
            self._try(settled)

    def try_settled(self, start: Real) -> None:
        """Newton from where a state settles to."""
        settled = self._flown(start, self.omega)
        if settled is not None:
            self._try(settled)

    def progress(self) -> str:
        """What was found and what was left out, in words."""
        lost = f", starts left out for too many contacts a turn: {self.lost}" if self.lost else ""
        return f"{len(self.found)} motions found{lost}"

    def orbits(self) -> tuple[Orbit, ...]:
        """What was found, largest motion at the first gap first."""
        if self.lost and not self.flown:
            raise IncompleteError(
                f"No start could be carried over a turn at {self.omega:.6g} rad/s: its contacts "
                "are too many. Give more damping, or a higher speed."
            )
        if self.lost:
            logger.warning("at %.6g rad/s: %s", self.omega, self.progress())
        return _largest_first([Orbit(self.machine, point) for point in self.found])

    def _flown(self, z: Real, omega: float) -> Real | None:
        """Where a state is after some turns; None where a flow does not end, which is counted."""
        try:
            states = self.settling.solver.section(z, omega, SETTLING_TURNS)
        except IncompleteError:
            self.lost += 1
            return None
        self.flown += 1
        return np.asarray(states[-1])

    def _stepped(self, ratio: float) -> Real | None:
        """Where the machine settles from rest while the speed is stepped to the one asked for."""
        z: Real | None = state_at_rest(self.settling.solver.system)
        for speed in np.geomspace(ratio * self.omega, self.omega, SWEEP_STEPS):
            z = None if z is None else self._flown(z, float(speed))
        return z

    def follow_families(self, rng: np.random.Generator) -> None:
        """Follow motions of several periods, found here or at speeds nearby, through their folds.

        Close to the fold with which a family begins no start leads to it.
        """
        for ratio in FAMILY_RATIOS:
            near = _Search(self.machine, ratio * self.omega, self.max_periods)
            for z in cloud(near.settling.solver, near.omega, rng):
                near.try_from(z)
            for point in near.found:
                if point.formulation.turns > 1:
                    self._follow(point, math.copysign(1.0, self.omega - near.omega))
        for point in tuple(self.found):
            if point.formulation.turns > 1:
                self._follow(point, 1.0)
                self._follow(point, -1.0)

    def _follow(self, point: Point, direction: float) -> None:
        """Add the motions in which a family passes the speed asked for."""
        periods = point.formulation.turns
        solver = self.settling.solver_of(periods)
        low, high = self.omega / FAMILY_REACH, self.omega * FAMILY_REACH
        for z in _passes(solver, point.u, point.omega, self.omega, (low, high), direction):
            self._try_over(z, periods)

    def _try(self, z: Real) -> None:
        if self._known(z, 1) is not None:
            return  # over any number of turns Newton would lead back to it
        for periods in range(1, self.max_periods + 1):
            self._try_over(z, periods)

    def _try_over(self, z: Real, periods: int) -> None:
        """Newton for a motion of so many periods and no fewer."""
        point = self.settling.solver_of(periods).solve(z, self.omega)
        if point is None:
            return
        if self._known(point.u, periods) is None and self.settling.shortest(point) is not point:
            return
        kept = self._keep(point)
        if self.settling.solver.system.symmetric and kept not in self.mirrored:
            self.mirrored += [kept, self._keep(self._mirrored(kept))]

    def _known(self, z: Real, periods: int) -> Point | None:
        """The motion found that passes through a state and repeats after so many periods."""
        for point, phases in zip(self.found, self.phases, strict=True):
            again = periods % point.formulation.turns == 0
            if again and self.settling.same(z, phases, self.omega).any():
                return point
        return None

    def _keep(self, point: Point) -> Point:
        """Add a motion unless it is known, in whatever phase; the one that then is known."""
        known = self._known(point.u, point.formulation.turns)
        if known is not None:
            return known
        self.found.append(point)
        self.phases.append(self.settling.phases(point))
        return point

    def _mirrored(self, point: Point) -> Point:
        """The mirror image: minus the state half a turn later."""
        solver = self.settling.solver_of(point.formulation.turns)
        motion = solver.motion(point.u, self.omega)
        t = math.pi / self.omega
        state = -np.concatenate([motion.derivative(t, 0), motion.derivative(t, 1)])
        mirrored = solver.solve(state, self.omega)
        return point if mirrored is None else mirrored


def _on_branch(system: MechanicalSystem, omega: float, ratio: float) -> list[Real]:
    """States at ``omega`` of the branch reached from below, wherever it passes that speed.

    It is followed from ``omega / ratio`` until it has left ``omega * ratio``.
    """
    solver = ExactSolver(system, half_turn=system.symmetric)
    low, high = omega / ratio, omega * ratio
    return _passes(solver, first_unknowns(solver, low), low, omega, (low, high), 1.0)


def _passes(
    solver: ExactSolver,
    u: Real,
    start: float,
    omega: float,
    bounds: tuple[float, float],
    direction: float,
) -> list[Real]:
    """States at ``omega`` of the branch through u at ``start``, wherever it passes that speed."""
    low, high = bounds
    step = (high - low) / BRANCH_STEPS
    course = correction.Course(low, high, step, STEP_SHARE, direction, correction.QUICK)
    traced = solver.trace(u, start, course)
    ahead = traced.omega - omega
    states = []
    for p in np.flatnonzero(ahead[:-1] * ahead[1:] <= 0.0):
        share = ahead[p] / ((ahead[p] - ahead[p + 1]) or 1.0)
        guess = (1.0 - share) * traced.u[p] + share * traced.u[p + 1]
        point = solver.solve(guess, omega)
        states.append(guess if point is None else point.u)
    return states


def _phases(part: MechanicalSystem, orbit: Orbit) -> Real:
    return Settling(part, orbit.periods).phases(orbit.point)


def _largest_first(orbits: list[Orbit]) -> tuple[Orbit, ...]:
    """By their way at the first gap; mirrors, which rounding tells apart, by where they begin."""
    if not orbits:
        return ()
    system = orbits[0].system
    gap = system.springs[0].direction if system.springs else np.eye(system.size)[0]
    ends = np.array([orbit.motion.extremes(gap[None])[:2] for orbit in orbits])[..., 0]
    way = ends[:, 1] - ends[:, 0]
    order = np.argsort(-way, kind="stable")
    rank = np.empty(way.size, np.int64)
    rank[order] = np.append(0, np.cumsum(-np.diff(way[order]) > SAME_WAY * way.max()))
    begin = [orbit.state[: system.size] @ gap for orbit in orbits]
    return tuple(orbits[k] for k in np.lexsort((-np.array(begin), rank)))
