"""Settled motions over frequency, each reached from the one before."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flipflow.methods.exact import ExactSolver
from flipflow.methods.settle import Settled
from flipflow.model.system import Coordinate, Machine, MechanicalSystem
from flipflow.results.orbit import Orbit

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Jump:
    """A place in a sweep where the motion was lost and another one taken up.

    Parameters
    ----------
    index
        Row of the sweep in which the other motion is met.
    omega_before, omega_after
        The last frequency in rad/s with the old motion and the first with the other.
    """

    index: int
    omega_before: float
    omega_after: float


@dataclass(frozen=True, eq=False)
class Sweep:
    """What a machine settles to while its speed is changed in steps; arrays are (n,).

    Parameters
    ----------
    machine
        What was swept.
    omega
        Frequencies in rad/s, in the order in which they were passed.
    rows
        Where the machine was at the end of each step; ``recent`` holds one period of a motion that
        repeats, else the last turns recorded (up to 64).
    jumps
        Where the motion jumped.
    max_periods, most_turns
        Longest period looked for, and most forcing periods waited at a step.
    solver
        The solver of motions of one forcing period.
    version
        Version of flipflow.
    complete
        Whether every frequency was passed; a cancelled sweep keeps those it has finished.
    """

    machine: Machine
    omega: Real
    rows: tuple[Settled, ...]
    jumps: tuple[Jump, ...]
    max_periods: int
    most_turns: int
    solver: ExactSolver
    version: str
    complete: bool = True

    def __repr__(self) -> str:
        ends = f"{self.omega[0]:.6g} to {self.omega[-1]:.6g} rad/s"
        return f"Sweep({self.omega.size} speeds, {ends}, {len(self.jumps)} jumps)"

    @property
    def system(self) -> MechanicalSystem:
        """The machine as it was solved."""
        return self.solver.system

    @property
    def settled(self) -> NDArray[np.bool_]:
        """Whether the motion is periodic within the tolerance."""
        return np.array([row.settled for row in self.rows])

    @property
    def periods(self) -> NDArray[np.int64]:
        """Forcing periods after which the motion repeats; 0 where it did not settle."""
        return np.array(
            [row.point.solver.turns if row.point is not None and row.settled else 0
             for row in self.rows]
        )  # fmt: skip

    @property
    def turns(self) -> NDArray[np.int64]:
        """Forcing periods waited at each step."""
        return np.array([row.turns for row in self.rows])

    @property
    def distance(self) -> Real:
        """Distance from the periodic motion approached, in m; infinite where there is none."""
        return np.array([row.distance for row in self.rows])

    @property
    def orbits(self) -> tuple[Orbit | None, ...]:
        """The periodic motion approached at each step, None where there is none."""
        return tuple(
            None if row.point is None else Orbit(self.machine, row.point) for row in self.rows
        )

    def amplitude(self, which: Coordinate) -> Real:
        """Half peak-to-peak of a coordinate in m, as it moves at the end of each step.

        Where the motion did not settle, over the last turns recorded (up to 64).
        """
        low, high = self.extremes(which)
        return np.asarray((high - low) / 2.0)

    def extremes(self, which: Coordinate) -> tuple[Real, Real]:
        """Least and greatest value of a coordinate in m at the end of each step."""
        key = tuple(self.system.coordinate(which))
        if key not in self._seen:
            turns = [row.recent.shape[0] for row in self.rows]
            states = np.concatenate([row.recent for row in self.rows])
            low, high, _ = self.solver.extremes(
                states, np.repeat(self.omega, turns), np.array([key])
            )
            starts = np.cumsum([0, *turns[:-1]])
            self._seen[key] = (
                np.minimum.reduceat(low[:, 0], starts), np.maximum.reduceat(high[:, 0], starts),
            )  # fmt: skip
        return self._seen[key]

    @cached_property
    def _seen(self) -> dict[tuple[float, ...], tuple[Real, Real]]:
        return {}
