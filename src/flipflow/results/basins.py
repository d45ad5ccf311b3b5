"""Which motion a machine settles on, over a grid of initial states."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flipflow import __version__
from flipflow.model.system import Coordinate, Machine
from flipflow.results.orbit import Orbit

Real = NDArray[np.float64]
Int = NDArray[np.int64]
NORMAL_95 = 1.959963984540054


@dataclass(frozen=True, eq=False)
class GridAxis:
    """One axis of the grid of initial states.

    Parameters
    ----------
    kind
        "displacement" in m or "velocity" in m/s.
    which
        The coordinate's name, or the index of a degree of freedom.
    values
        Its values along the axis, (n,).
    """

    kind: Literal["displacement", "velocity"]
    which: Coordinate
    values: Real


@dataclass(frozen=True, eq=False)
class Basins:
    """Which motion each state of a grid settles on; the unbalance points along +x at the start.

    Parameters
    ----------
    machine, omega
        The machine, and the forcing frequency in rad/s.
    axes
        Axes of the grid, in the order of the dimensions of ``labels``.
    labels
        Index into ``orbits``; -1 where the state did not settle within ``most_turns`` turns.
    turns
        Whole turns until it was caught, the same shape; -1 where a cell was not run.
    orbits
        The stable motions, in the order of the labels.
    most_turns
        Turns after which a state that nothing caught is given up.
    notes
        What did not settle and why, and whether the run was cancelled.
    version
        Of flipflow.
    """

    machine: Machine
    omega: float
    axes: tuple[GridAxis, ...]
    labels: Int
    turns: Int
    orbits: tuple[Orbit, ...]
    most_turns: int
    notes: tuple[str, ...] = ()
    version: str = field(default=__version__)

    def __repr__(self) -> str:
        shape = " x ".join(map(str, self.labels.shape))
        return f"Basins({self.omega:.6g} rad/s, {shape} cells, {len(self.orbits)} motions)"

    @property
    def complete(self) -> bool:
        """Whether every cell was run; a cancelled run keeps the cells it has finished."""
        return bool(np.all(self.turns >= 0))

    @cached_property
    def counts(self) -> Int:
        """Cells that settle on each motion, (A,)."""
        return np.array([np.sum(self.labels == k) for k in range(len(self.orbits))], np.int64)

    @property
    def shares(self) -> Real:
        """Share of the cells that settles on each motion, (A,); of the cells that were run."""
        return self.counts / max(self._run, 1)

    @property
    def unsettled(self) -> float:
        """Share of the cells that were run and did not settle."""
        return float(np.sum((self.labels < 0) & (self.turns >= 0)) / max(self._run, 1))

    @property
    def share_intervals(self) -> Real:
        """95 % confidence interval of each share (A, 2), by Wilson's score.

        As if the cells were drawn at random from the window. A regular grid knows the shares of
        its window better than that, so the interval is on the safe side.
        """
        n, p, z = max(self._run, 1), self.shares, NORMAL_95
        middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
        half = z / (1 + z**2 / n) * np.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
        return np.clip(np.stack([middle - half, middle + half], axis=1), 0.0, 1.0)

    @property
    def _run(self) -> int:
        return int(np.sum(self.turns >= 0))

    def axis(self, kind: str, which: Coordinate) -> GridAxis | None:
        """The axis of a coordinate, None where it does not vary."""
        return next((a for a in self.axes if (a.kind, a.which) == (kind, which)), None)
