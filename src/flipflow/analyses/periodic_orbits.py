"""Every periodic motion found at one frequency, mirror images too."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flipflow.analyses.arguments import checked_count, checked_generator, checked_speed
from flipflow.analyses.frequency_response import first_unknowns
from flipflow.analyses.monitor import Monitor
from flipflow.errors import IncompleteError
from flipflow.methods.settle import Settling
from flipflow.methods.solver import Point, Real
from flipflow.methods.two_event import TwoEventProblem
from flipflow.model.system import Machine, MechanicalSystem, system_of
from flipflow.results.orbit import Orbit

STARTS = 64
SETTLING_TURNS = 60
MOST_PERIODS = 6
SWEEP_RATIO, SWEEP_STEPS = 1.3, 12


def periodic_orbits(
    machine: Machine,
    omega: float,
    max_periods: int = 1,
    rng: int | np.random.Generator = 0,
    monitor: Monitor | None = None,
) -> tuple[Orbit, ...]:
    """Periodic motions at ``omega`` that repeat after up to ``max_periods`` forcing periods.

    Starts: the motion reached from below; for one symmetric stop, every zero of the scalar problem
    of two-touch motions; rest; what is reached by stepping the speed up and down to ``omega``; and
    a low-discrepancy cloud of states as large as the linear motion or the gaps. Each is tried as it
    is (unstable motions are found so) and after some turns of settling. Newton on the exact flow
    over 1, 2, ... turns, so that motions need not be symmetric; for a machine that is its own
    mirror image every motion's mirror image is one too.

    Parameters
    ----------
    machine
        A screen or a :class:`~flipflow.MechanicalSystem`.
    omega
        Forcing frequency in rad/s.
    max_periods
        Most forcing periods after which a motion may repeat, 1 to 6.
    rng
        Seed or generator for the cloud of starts.
    monitor
        Called with a sentence and the share done; raise from it to cancel.

    Returns
    -------
    tuple of Orbit
        Stable and unstable, each once whatever its phase, largest relative motion at the first gap
        first. A search, not a proof: a motion with a small basin and weak instability can be
        missed.

    Raises
    ------
    InputError
        For a frequency that is not finite or not above 0, or periods outside 1 to 6.
    """
    checked_count("max_periods", max_periods, MOST_PERIODS)
    search = _Search(machine, checked_speed(omega), max_periods)
    starts = _starts(search.settling, search.omega, checked_generator(rng))
    if TwoEventProblem.applies(search.settling.solver.builder):
        starts += list(TwoEventProblem(search.settling.solver.builder).states(search.omega)[0])
    for k, start in enumerate(starts):
        search.try_from(start)
        if monitor is not None:
            monitor(f"{len(search.found)} motions found", (k + 1) / len(starts))
    return search.orbits()


def attracting_orbits(
    machine: Machine, omega: float, rng: int | np.random.Generator = 0
) -> tuple[Orbit, ...]:
    """Stable motions of one forcing period to which a cloud of states settles.

    Cheaper than :func:`periodic_orbits` where unstable motions are of no use; the largest first.
    """
    search = _Search(machine, checked_speed(omega), 1)
    for start in _starts(search.settling, search.omega, checked_generator(rng)):
        search.try_settled(start)
    return tuple(orbit for orbit in search.orbits() if orbit.stable)


class _Search:
    """The motions found so far at one frequency."""

    def __init__(self, machine: Machine, omega: float, max_periods: int) -> None:
        self.machine = machine
        self.settling = Settling(system_of(machine), max_periods)
        self.omega, self.max_periods = omega, max_periods
        self.found: list[Point] = []

    def try_from(self, start: Real) -> None:
        """Newton from a state and from where it settles to, for every number of periods."""
        try:
            settled = self.settling.solver.section(start, self.omega, SETTLING_TURNS)[-1]
        except IncompleteError:
            return
        self._try(start)
        self._try(settled)

    def try_settled(self, start: Real) -> None:
        """Newton from where a state settles to."""
        try:
            self._try(self.settling.solver.section(start, self.omega, SETTLING_TURNS)[-1])
        except IncompleteError:
            return

    def orbits(self) -> tuple[Orbit, ...]:
        """What was found, largest motion at the first gap first."""
        which = _first_gap(self.settling.solver.system)
        found = [Orbit(self.machine, point) for point in self.found]
        return tuple(sorted(found, key=lambda o: (-_reach(o, which), -o.state @ which)))

    def _try(self, z: Real) -> None:
        for periods in range(1, self.max_periods + 1):
            point = self.settling.solver_of(periods).solve(z, self.omega)
            if point is not None and self.settling.shortest(point) is point:
                self._keep(point)
                if self.settling.solver.system.symmetric:
                    self._keep(self._mirrored(point))

    def _keep(self, point: Point) -> None:
        """Add a motion unless it is known, in whatever phase."""
        for known in self.found:
            if known.solver.turns == point.solver.turns and any(
                self.settling.same(point.u, phase, self.omega)
                for phase in self.settling.phases(known)
            ):
                return
        self.found.append(point)

    def _mirrored(self, point: Point) -> Point:
        """The mirror image: minus the state half a turn later."""
        solver = self.settling.solver_of(point.solver.turns)
        motion = solver.motion(point.u, self.omega)
        t = math.pi / self.omega
        state = -np.concatenate([motion.derivative(t, 0), motion.derivative(t, 1)])
        mirrored = solver.solve(state, self.omega)
        return point if mirrored is None else mirrored


def _starts(settling: Settling, omega: float, rng: np.random.Generator) -> list[Real]:
    """Rest, the motion from below, stepped speeds, and a cloud of states."""
    solver = settling.solver
    n = solver.system.size
    X = np.abs(solver.builder.contact_free(np.array([omega]))[0])
    gaps = [g for s in solver.builder.springs for g in s.gaps if math.isfinite(g)]
    size = np.maximum(2.0 * X, 3.0 * max(gaps, default=0.0))
    box = np.concatenate([size, omega * size])
    cloud = _spread(STARTS if solver.builder.springs else 0, 2 * n, rng)
    starts = [np.zeros(2 * n), first_unknowns(solver, omega), *((2.0 * cloud - 1.0) * box)]
    for ratio in (1.0 / SWEEP_RATIO, SWEEP_RATIO):
        z = np.zeros(2 * n)
        for speed in np.geomspace(ratio * omega, omega, SWEEP_STEPS):
            z = solver.section(z, float(speed), SETTLING_TURNS)[-1]
        starts.append(z)
    return starts


def _spread(count: int, size: int, rng: np.random.Generator) -> Real:
    """A Kronecker sequence from a random point on: (count, size) in [0, 1), evenly spread.

    Its steps are powers of 1 / g with g^(size + 1) = g + 1, after Roberts.
    """
    # Kept apart from scipy.stats, whose import takes half a second of every report.
    g = float(max(np.roots([1.0, *[0.0] * (size - 1), -1.0, -1.0]).real))
    step = g ** -np.arange(1.0, size + 1.0)
    return np.mod(rng.random(size) + np.outer(np.arange(count), step), 1.0)


def _first_gap(system: MechanicalSystem) -> NDArray[np.float64]:
    n = system.size
    direction = system.springs[0].direction if system.springs else np.eye(n)[0]
    return np.concatenate([direction, np.zeros(n)])


def _reach(orbit: Orbit, which: Real) -> float:
    """Half peak-to-peak at the first gap, in m, in steps that hide rounding between mirrors."""
    vector = which[: orbit.system.size]
    low, high, _ = orbit.point.solver.extremes(
        orbit.unknowns[None], np.array([orbit.omega]), vector[None]
    )
    return round(float(high[0, 0] - low[0, 0]) / 2.0, 9)
