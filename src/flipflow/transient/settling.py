"""A machine is run until it has settled on a periodic motion; its distance from that is known.

Differences between turns say little: just past a fold the machine lingers where no periodic motion
exists, and with a multiplier close to 1 it creeps. The periodic motion that is approached is
therefore solved for. The distance from it is known in metres, and its leading multiplier tells how
many turns are still to go.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Real
from flipflow.continuation import correction
from flipflow.errors import IncompleteError
from flipflow.model.system import MechanicalSystem
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.solver import STEP_SHARE, Point
from flipflow.periodic.stability import NEAR_ONE, STABLE, stability_words

Word = Literal["periodic", "quasi-periodic", "chaotic", "undecided"]
PERIODIC: Word = "periodic"
QUASI_PERIODIC: Word = "quasi-periodic"
CHAOTIC: Word = "chaotic"
UNDECIDED: Word = "undecided"

MAX_PERIODS = 12  # longest period looked for, in forcing periods, unless told otherwise
MOST_TURNS = 4000  # forcing periods waited unless told otherwise
TOLERANCE = 1e-9  # distance from the periodic motion, relative to it, within which it has settled
FIRST_CHUNK = 16  # turns; twice as many are run before anything is looked at
LONGEST_CHUNK = 256  # most turns run at once while no periodic motion is in sight
NEAR = 0.1  # distance, relative to the motion, within which a periodic motion is looked for
SAME_PERIOD = 3.0  # the first period whose step is within this factor of the least one is taken
RECENT = 64  # turns whose states are kept
REPEATS = 1e-9  # distance of states, relative to the motion, within which it repeats
SAME = 1e-6  # distance, relative to the motion, within which two states are one


@dataclass(frozen=True, eq=False)
class Settled:
    """Where a machine is after running on.

    Parameters
    ----------
    state
        State (x, x') at a whole number of forcing periods, (2 N,).
    turns
        Forcing periods run.
    point
        The stable periodic motion that is approached, None where there is none near.
    distance
        Distance from it in m; infinite without one.
    settled
        Whether the distance is below the tolerance.
    recent
        States of the last turns, (up to 64, 2 N).
    word
        What the motion is: "periodic", "quasi-periodic", "chaotic", or "undecided".
    """

    state: Real
    turns: int
    point: Point | None
    distance: float
    settled: bool
    recent: Real
    word: Word = UNDECIDED


class Settling:
    """Runs one machine until it settles.

    Parameters
    ----------
    system
        The machine.
    max_periods
        Longest period looked for, in forcing periods.
    """

    def __init__(self, system: MechanicalSystem, max_periods: int) -> None:
        self.solver = ExactSolver(system, half_turn=False)
        self.max_periods = max_periods
        self._solvers = {1: self.solver}

    def solver_of(self, periods: int) -> ExactSolver:
        """The solver of motions that repeat after ``periods`` forcing periods."""
        if periods not in self._solvers:
            self._solvers[periods] = self.solver.with_turns(periods)
        return self._solvers[periods]

    def settle(self, z: Real, omega: float, most: int) -> Settled:
        """Run from z until the distance falls below TOLERANCE times the motion's size.

        The machine has not settled after ``most`` turns, nor where the flow over a turn does not
        end.
        """
        turns, chunk = 0, FIRST_CHUNK
        recent = np.array(z, float)[None]
        while True:
            point = self.ended_on(recent, omega)
            distance = math.inf if point is None else self.distance(recent[-1], point.u, omega)
            done = distance <= TOLERANCE * (self.size(recent, omega) + self.solver.length)
            if done or turns >= most:
                return Settled(recent[-1].copy(), turns, point, distance, done, recent)
            chunk = min(2 * chunk, LONGEST_CHUNK)
            if point is not None:
                chunk = self._turns_to_go(point, distance, TOLERANCE * self.size(recent, omega))
            run = self._run(recent[-1], omega, min(chunk, most - turns))
            if run is None:
                return Settled(recent[-1].copy(), turns, None, math.inf, False, recent)
            recent = np.concatenate([recent, run])[-RECENT:]
            turns += run.shape[0]

    def _run(self, z: Real, omega: float, turns: int) -> Real | None:
        """States after 1, 2, ... turns, (turns, 2 N); None where a flow does not end."""
        try:
            return self.solver.section(z, omega, turns)
        except IncompleteError:
            return None

    def ended_on(self, recent: Real, omega: float) -> Point | None:
        """The motion approached, or the one that a machine repeats which nothing holds in place.

        Such a machine floats where it has come to, a multiplier of its motion is 1, and Newton's
        equations have no single solution.
        """
        point = self.approached(recent, omega)
        periods = self.repeats_after(recent, omega) if point is None else None
        if periods is None:
            return point
        floating = Point(self.solver_of(periods).formulation, recent[-1].copy(), omega)
        largest = np.abs(floating.eigenvalues).max()
        return floating if largest <= 1.0 + NEAR_ONE else None

    def repeats_after(self, recent: Real, omega: float) -> int | None:
        """Forcing periods after which all recent states (K, 2 N) come again, if they do."""
        same = REPEATS * (self.size(recent, omega) + self.solver.length)
        counts = range(1, min(self.max_periods, recent.shape[0] - 1) + 1)
        return next(
            (n for n in counts if self.distance(recent[n:], recent[:-n], omega) <= same), None
        )

    def approached(self, recent: Real, omega: float) -> Point | None:
        """The stable periodic motion near the last of the recent states (K, 2 N)."""
        last = recent[-1]
        size = self.size(recent, omega)
        steps = [
            self.distance(last, recent[-1 - n], omega)
            for n in range(1, min(self.max_periods, recent.shape[0] - 1) + 1)
        ]
        if not steps or min(steps) > NEAR * size:
            return None
        least = SAME_PERIOD * min(steps) + 1e-12 * size
        periods = 1 + next(k for k, step in enumerate(steps) if step <= least)
        point = self.solver_of(periods).solve(last, omega)
        if point is None or self.distance(last, point.u, omega) > NEAR * size:
            return None
        # A spiral may come closer to itself after some turns than after one.
        point = self.shortest(point)
        return point if is_stable(point) else None

    def phases(self, point: Point) -> Real:
        """States of a motion after 1, 2, ... all of its forcing periods, the last its own."""
        return self.solver.section(point.u, point.omega, point.formulation.turns)

    def same(self, z: Real, others: Real, omega: float) -> NDArray[np.bool_]:
        """Which of the states (K, 2 N) differ from z by less than 1e-6 of their motion's size."""
        apart, sizes = (
            np.abs(self._lengths(one, omega)).max(axis=1) for one in (others - z, others)
        )
        return np.asarray(apart < SAME * (sizes + self.solver.length))

    def shortest(self, point: Point) -> Point:
        """The same motion with the least number of forcing periods after which it repeats."""
        again = np.flatnonzero(self.same(point.u, self.phases(point), point.omega))
        periods = 1 + int(again[0]) if again.size else point.formulation.turns
        if periods == point.formulation.turns:
            return point
        return self.solver_of(periods).solve(point.u, point.omega) or point

    def ahead_of(self, z: Real, omega: float) -> Point | None:
        """The periodic motion ahead of the state z; None where none is near."""
        ahead = self._run(z, omega, 2 * self.max_periods)
        return None if ahead is None else self.ended_on(np.concatenate([z[None], ahead]), omega)

    def steps_from(self, z: Real, omega: float) -> Real:
        """Distances in m between the state z and those 1, 2, ... max_periods turns later."""
        ahead = self._run(z, omega, self.max_periods)
        return np.array([self.distance(one, z, omega) for one in ([] if ahead is None else ahead)])

    def distance_from(self, point: Point, z: Real) -> float:
        """Distance in m of the state z from a periodic motion."""
        return min(self.distance(z, phase, point.omega) for phase in self.phases(point))

    def continued(self, point: Point, omega: float) -> Point | None:
        """The motion followed along its branch to another frequency; None where it turns back."""
        if omega == point.omega:
            return point
        low, high = sorted((point.omega, omega))
        course = correction.Course(
            low, high, high - low, STEP_SHARE, math.copysign(1.0, omega - point.omega),
            correction.QUICK,
        )  # fmt: skip
        solver = self.solver_of(point.formulation.turns)
        reached = solver.end_of_branch(point.u, point.omega, course)
        return None if reached is None else solver.solve(reached, omega)

    def size(self, states: Real, omega: float) -> float:
        """Largest displacement, or velocity over omega, of states (K, 2 N)."""
        return float(np.abs(self._lengths(states, omega)).max())

    def distance(self, z: Real, other: Real, omega: float) -> float:
        """Largest difference of two states in displacement, or velocity over omega, in m."""
        return float(np.abs(self._lengths(z - other, omega)).max())

    def _lengths(self, z: Real, omega: float) -> NDArray[np.float64]:
        n = self.solver.system.size
        scale = np.concatenate([np.ones(n), np.full(n, omega)])
        return np.asarray(z / scale)

    @staticmethod
    def _turns_to_go(point: Point, distance: float, aim: float) -> int:
        """Turns after which the leading multiplier has brought the distance down to ``aim``."""
        rho = float(np.abs(point.eigenvalues).max())
        periods = point.formulation.turns
        if rho == 0.0 or distance <= aim:
            return periods
        return min(periods * (1 + math.ceil(math.log(aim / distance) / math.log(rho))), 4 * RECENT)


def is_stable(point: Point) -> bool:
    """Whether all multipliers of a motion lie within the unit circle."""
    return str(stability_words(point.eigenvalues[None], None)[0]) == STABLE
