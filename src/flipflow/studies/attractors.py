"""The motions that attract at one frequency, and which of them many states go to."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flipflow.batch.lanes import Capture, Lanes, Run
from flipflow.batch.side_by_side import Tell, within
from flipflow.compiled import status
from flipflow.compiled.arrays import Real
from flipflow.model.arguments import checked_generator
from flipflow.model.system import Machine, system_of
from flipflow.periodic.orbit import Orbit
from flipflow.periodic.solver import Point
from flipflow.periodic.turn_by_turn import NOT_SETTLED
from flipflow.studies.attraction import capture_of
from flipflow.studies.periodic_orbits import MOST_PERIODS, attracting_orbits
from flipflow.transient.settling import Settling, is_stable

TRIED_STATES = 16  # unsettled lanes, or twice as many, from which a motion is solved for
NEAREST = 0.5  # share of the way to another stable motion that a neighbourhood reaches
FIRST_SHARE = 64  # lanes, or twice as many, that go first


class Attractors:
    """Stable motions with a neighbourhood each; further ones are found as states run to them.

    Parameters
    ----------
    machine
        A screen, a system, or any machine with ``.system()``.
    omega
        Forcing frequency in rad/s.
    rng
        Seed or generator of the search and of the trial of the neighbourhoods.
    threads
        See :class:`~flipflow.batch.lanes.Lanes`.
    """

    def __init__(
        self,
        machine: Machine,
        omega: float,
        rng: int | np.random.Generator = 0,
        threads: int | None = None,
    ) -> None:
        self.machine = machine
        self.system = system_of(machine)
        self._rng = checked_generator(rng)
        found = attracting_orbits(machine, omega, self._rng)
        self.lanes = Lanes(self.system, omega, threads)
        self.capture = Capture.nothing(2 * self.system.size)
        self.orbits: list[Orbit] = []
        self._bare: list[Real] = []  # states of stable motions without a neighbourhood
        self._settling = Settling(self.system, MOST_PERIODS)
        for orbit in found:
            self.add(orbit.point)

    def add(self, point: Point) -> int | None:
        """Label of a stable motion, known or not; None where no neighbourhood of it is found."""
        known = self.label_of(point.u)
        if known is not None:
            return known
        label = len(self.orbits)
        phases = self._settling.phases(point)
        self.capture = self.capture.apart_from(phases, NEAREST)
        capture = capture_of(self.lanes, point, phases, label, self._rng)
        if capture is None:
            self._bare.append(phases)
            return None
        for others in (*(self._settling.phases(one.point) for one in self.orbits), *self._bare):
            capture = capture.apart_from(others, NEAREST)
        self.capture = self.capture.joined(capture)
        self.orbits.append(Orbit(self.machine, point))
        return label

    def label_of(self, z: Real) -> int | None:
        """Label of the motion that passes through the state z at the start of a turn."""
        for label, orbit in enumerate(self.orbits):
            phases = self._settling.phases(orbit.point)
            if self._settling.same(z, phases, orbit.omega).any():
                return label
        return None

    def run(
        self,
        states: Real,
        most: int,
        begin: Real | None = None,
        tick: Tell | None = None,
    ) -> Run:
        """Run states until they settle; those that do not are searched for further motions.

        A few states go first, so that a motion unknown so far costs few lanes all their turns.
        """
        count = states.shape[0]
        starts = np.zeros(count) if begin is None else begin
        whole = Run(
            states.copy(), np.full(count, NOT_SETTLED), np.full(count, -1),
            np.zeros(count, np.int64), cancelled=False,
        )  # fmt: skip
        first = np.arange(0, count, max(count // FIRST_SHARE, 1))
        rest = np.setdiff1d(np.arange(count), first)
        told, done = tick or (lambda _: None), 0
        for wave in (first, rest):
            say = within(told, done / count, (done + wave.size) / count)
            run = self.lanes.settle(states[wave], starts[wave], self.capture, most, say)
            while not run.cancelled and self._found_further(run):
                run = self._again(run, states[wave], starts[wave], most, say)
            _write(whole, wave, run)
            if run.cancelled:
                return replace(whole, cancelled=True)
            done += wave.size
        while not whole.cancelled and self._let_go(whole).any():
            whole = self._again(whole, states, starts, most, say)
            if not whole.cancelled:
                self._found_further(whole)
        return whole

    def _let_go(self, run: Run) -> NDArray[np.bool_]:
        """Lanes that a neighbourhood caught which is smaller by now, and no longer holds them."""
        return np.asarray((run.label != NOT_SETTLED) & ~self.capture.holds(run.states, run.label))

    def _again(self, run: Run, states: Real, starts: Real, most: int, say: Tell) -> Run:
        """Lanes that nothing caught or holds, run anew: a motion found since may catch them."""
        open_ = np.flatnonzero(_unsettled(run) | self._let_go(run))
        more = self.lanes.settle(
            states[open_], starts[open_], self.capture, most, lambda _: say(1.0)
        )
        _write(run, open_, more)
        return replace(run, cancelled=more.cancelled)

    def _found_further(self, run: Run) -> bool:
        """Solve for motions from the ends of lanes that did not settle; whether one is new."""
        ends = run.states[_unsettled(run)]
        before = len(self.orbits)
        for z in ends[:: max(ends.shape[0] // TRIED_STATES, 1)]:
            # Newton over one turn may reach a motion far from z that is known: all are tried.
            for point in self._stable_near(z):
                self.add(point)
        return len(self.orbits) > before

    def _stable_near(self, z: Real) -> Iterator[Point]:
        """Stable motions of one and more forcing periods that Newton reaches from z."""
        for periods in range(1, MOST_PERIODS + 1):
            point = self._settling.solver_of(periods).solve(z, self.lanes.omega)
            if point is not None and is_stable(point):
                yield self._settling.shortest(point)


def _unsettled(run: Run) -> NDArray[np.bool_]:
    return np.asarray((run.label == NOT_SETTLED) & (run.code == status.OK) & (run.turns >= 0))


def _write(whole: Run, lanes: NDArray[np.int64], part: Run) -> None:
    whole.states[lanes], whole.label[lanes] = part.states, part.label
    whole.turns[lanes], whole.code[lanes] = part.turns, part.code
