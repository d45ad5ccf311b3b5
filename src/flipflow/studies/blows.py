"""Blows on the frames of a running machine: which of them throw its motion onto another one.

A blow is a row and a share. Each frame has three rows: impulses along +x, along -x, and lumps of
material that land on it. The share of a row, above 0, is that of the largest impulse tried, or for
a lump the share of its momentum that the frame loses: 1 for an infinitely heavy one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flipflow.batch.side_by_side import Tell, within
from flipflow.compiled.arrays import Int, Real
from flipflow.errors import Cancelled
from flipflow.model.system import Coordinate, MechanicalSystem
from flipflow.periodic.solver import Point
from flipflow.periodic.turn_by_turn import NOT_SETTLED
from flipflow.studies.attractors import Attractors

Kind = Literal["+", "-", "lump"]
KINDS: tuple[Kind, ...] = ("+", "-", "lump")
LINEAR_STEP = 1.0 / 60.0  # of the largest blow, between two rungs from a tenth of it on
# Shares of the largest blow that are tried: a step of a fifth each up to a tenth of it.
LADDER = np.concatenate(
    [np.geomspace(1e-4, 0.1, 38, endpoint=False), np.arange(0.1, 1.0 + LINEAR_STEP, LINEAR_STEP)]
)
FINE_LADDER = np.geomspace(0.6, 1.05, 24)  # shares of a blow known to throw, tried at a near phase
BISECTIONS = 12  # halvings between the last rung that does not throw and the first that does
NEARBY = 9  # phases tried around the best one, each time it is narrowed down
NARROWINGS = 2  # times that this is done
SCANNED = 0.8  # share of the work on least blows that is done when all rungs are tried
MOMENTUM_TIMES = 4.0  # largest blow over what the frame, at its fastest, holds of momentum
MOST_TURNS = 2000  # forcing periods waited for a motion to settle after a blow
SPEED_POINTS = 720  # times in a period at which the fastest velocity of a frame is looked for


@dataclass(frozen=True)
class Row:
    """Blows of one kind on one frame: degree of freedom, and e^T M^-1 e of it in 1/kg."""

    frame: Coordinate
    index: int
    mobility: float
    kind: Kind
    largest: float


class Blows:
    """Blows on one motion.

    Parameters
    ----------
    attractors
        The motions at this frequency.
    point, home
        The motion that is hit, and its label.
    largest
        Largest impulse in kg m/s; None: four times the frame's largest momentum.
    """

    def __init__(
        self, attractors: Attractors, point: Point, home: int, largest: float | None
    ) -> None:
        self.attractors = attractors
        self.home = home
        self.omega = point.omega
        self.turns = point.formulation.turns
        self.motion = point.formulation.solver().motion(point.u, point.omega)
        self.mobility = np.linalg.inv(attractors.system.M)
        self.rows = tuple(self._rows(largest))
        self.tried = 0
        self.undecided = 0

    def _rows(self, largest: float | None) -> list[Row]:
        t = np.linspace(0.0, 2.0 * np.pi * self.turns / self.omega, SPEED_POINTS, endpoint=False)
        fastest = np.abs(self.motion.derivative(t, 1)).max(axis=0)
        rows = []
        for frame, k in frames_of(self.attractors.system):
            mobility = float(self.mobility[k, k])
            most = largest or MOMENTUM_TIMES * float(fastest[k]) / mobility
            rows += [Row(frame, k, mobility, kind, most) for kind in KINDS]
        return rows

    def impulse(self, row: int, share: float, phase: float) -> float:
        """The impulse in kg m/s, positive along +x."""
        one = self.rows[row]
        if one.kind == "lump":
            v = float(self.motion.derivative(np.array([phase / self.omega]), 1)[0, one.index])
            return -share * v / one.mobility
        return (one.largest if one.kind == "+" else -one.largest) * share

    def _pushes(self, row: Int, share: Real, velocity: Real) -> Real:
        """The impulses of many blows on frames that have these velocities, (K,)."""
        lump = np.array([one.kind == "lump" for one in self.rows])[row]
        signs = np.array([1.0 if one.kind == "+" else -1.0 for one in self.rows])[row]
        most = np.array([one.largest for one in self.rows])[row]
        index = np.array([one.index for one in self.rows])[row]
        mobility = np.array([one.mobility for one in self.rows])[row]
        own = velocity[np.arange(row.size), index]
        return np.asarray(np.where(lump, -share * own / mobility, signs * most * share))

    def lump(self, row: int, share: float) -> float:
        """The lump's mass in kg."""
        return math.inf if share >= 1.0 else share / (1.0 - share) / self.rows[row].mobility

    def lump_share(self, row: int, lump: float) -> float:
        """The share that a lump of this mass stands for."""
        heavy = lump * self.rows[row].mobility
        return heavy / (1.0 + heavy)

    def labels(self, row: Int, share: Real, phase: Real, tick: Tell) -> Int:
        """The motion on which the machine settles after each blow, (K,).

        Raises
        ------
        Cancelled
            When ``tick``, which is called with the share done, raised it.
        """
        t = phase / self.omega
        x, v = self.motion.derivative(t, 0), self.motion.derivative(t, 1).copy()
        index = np.array([one.index for one in self.rows])[row]
        v += self.mobility[:, index].T * self._pushes(row, share, v)[:, None]
        begin = np.mod(t, 2.0 * np.pi / self.omega)
        run = self.attractors.run(np.concatenate([x, v], axis=1), MOST_TURNS, begin, tick)
        if run.cancelled:
            raise Cancelled("stopped among the blows")
        self.tried += run.label.size
        self.undecided += int(np.sum(run.label == NOT_SETTLED))
        return run.label

    def thrown(self, labels: Int) -> NDArray[np.bool_]:
        """Whether the machine has settled on another motion."""
        return np.asarray((labels != self.home) & (labels != NOT_SETTLED))

    def least(self, row: Int, phase: Real, tick: Tell, around: Real | None = None) -> Real:
        """The least share that throws, for rows and moments (K,); infinite where none does.

        Steps of the ladder up to 1 are a fifth, at most a sixtieth of the whole; the ladder is a
        fine one around shares (K,) where these are given.
        """
        ladder = LADDER if around is None else FINE_LADDER
        base = np.ones(row.size) if around is None else around
        shares = np.outer(base, ladder)
        every = np.repeat(np.arange(row.size), ladder.size)
        labels = self.labels(row[every], shares.ravel(), phase[every], within(tick, 0.0, SCANNED))
        hit = self.thrown(labels).reshape(shares.shape)
        first = np.where(hit.any(axis=1), hit.argmax(axis=1), -1)
        found = np.flatnonzero(first >= 0)
        least = np.full(row.size, np.inf)
        if found.size == 0:
            return least
        high = shares[found, first[found]]
        low = np.where(first[found] > 0, shares[found, first[found] - 1], 0.0)
        for k in range(BISECTIONS):
            middle = 0.5 * (low + high)
            part = within(within(tick, SCANNED, 1.0), k / BISECTIONS, (k + 1) / BISECTIONS)
            thrown = self.thrown(self.labels(row[found], middle, phase[found], part))
            high, low = np.where(thrown, middle, high), np.where(thrown, low, middle)
        least[found] = high
        return least

    def worst_moment(self, row: int, phases: Real, least: Real, tick: Tell) -> tuple[float, float]:
        """Share and phase of a row's least blow, the moment refined between those scanned."""
        best = int(least.argmin())
        share, phase = float(least[best]), float(phases[best])
        step = float(phases[1] - phases[0])
        for narrowing in range(NARROWINGS):
            part = within(tick, narrowing / NARROWINGS, (narrowing + 1) / NARROWINGS)
            near = phase + step * np.linspace(-1.0, 1.0, NEARBY)
            rows, around = np.full(near.size, row), np.full(near.size, share)
            shares = self.least(rows, np.mod(near, 2.0 * np.pi * self.turns), part, around)
            k = int(shares.argmin())
            if shares[k] < share:
                share, phase = float(shares[k]), float(near[k])
            step *= 2.0 / (NEARBY - 1)
        return share, float(np.mod(phase, 2.0 * np.pi * self.turns))


def frames_of(system: MechanicalSystem) -> list[tuple[Coordinate, int]]:
    """Named coordinates that are one degree of freedom each, or all degrees of freedom."""
    found: list[tuple[Coordinate, int]] = []
    for which in system.coordinates:
        vector = system.coordinate(which)
        if np.count_nonzero(vector) == 1 and vector.max() == 1.0:
            found.append((which, int(vector.argmax())))
    return found or [(k, k) for k in range(system.size)]
