"""Basins of attraction: which motion a machine settles on, by where it starts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from flipflow import __version__
from flipflow.batch.lanes import Run
from flipflow.compiled import status
from flipflow.compiled.arrays import Int, Real
from flipflow.errors import InputError
from flipflow.model.arguments import checked_count, checked_monitor, checked_reals, checked_word
from flipflow.model.monitor import Monitor
from flipflow.model.screen import unit_in
from flipflow.model.system import Coordinate, Machine, MechanicalSystem, system_of
from flipflow.periodic.orbit import Orbit
from flipflow.periodic.turn_by_turn import NOT_SETTLED
from flipflow.results.result import Frozen, Result
from flipflow.studies.attractors import Attractors

NORMAL_95 = 1.959963984540054  # standard deviations of a normal distribution to each side: 95 %


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
class Basins(Frozen, Result):
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

    def __post_init__(self) -> None:
        cells = tuple(axis.values.size for axis in self.axes)
        for name, values in (("labels", self.labels), ("turns", self.turns)):
            if np.shape(values) != cells:
                raise InputError(name, f"shape {np.shape(values)}", f"give one a cell, {cells}")

    def __repr__(self) -> str:
        shape = " x ".join(map(str, self.labels.shape))
        omega = f"{self.omega:.6g}{unit_in(self.machine, 'rad/s')}"
        return f"Basins({omega}, {shape} cells, {len(self.orbits)} motions)"

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
        checked_word("kind", kind, tuple(UNITS))
        system_of(self.machine).coordinate(which)
        return next((a for a in self.axes if (a.kind, a.which) == (kind, which)), None)


Window = Mapping[Coordinate, ArrayLike]
Kind = Literal["displacement", "velocity"]
MOST_CELLS = 4_000_000  # cells of a grid
MOST_TURNS = 1_000_000  # forcing periods that a cell may be asked to run
INDEPENDENT = 1e-9  # singular value above which unit rows count as independent
UNITS = {"displacement": "m", "velocity": "m/s"}


def basins(
    machine: Machine,
    omega: float,
    displacement: Window | None = None,
    velocity: Window | None = None,
    *,
    most_turns: int = 1000,
    rng: int | np.random.Generator = 0,
    threads: int | None = None,
    monitor: Monitor | None = None,
) -> Basins:
    """Which of the coexisting motions each state of a grid settles on.

    Every state is run by the exact flow, turn after turn, until it enters a neighbourhood of a
    stable motion from which, as far as was tried, nothing leaves (see :doc:`/methods/basins`).
    States that settle on none of the motions known beforehand are searched for further ones, of up
    to twelve forcing periods.

    Parameters
    ----------
    machine
        A screen, a :class:`~flipflow.MechanicalSystem`, or any machine with ``.system()``.
    omega
        Forcing frequency in rad/s. The unbalance points along +x at the start.
    displacement, velocity
        For each coordinate that is given, its values (n,) in m or m/s, or one value. The grid is
        their product: displacements first, each in the order given, then velocities. What is not
        given is 0: the machine's coordinates are gone through in their order, and each that does
        not follow from the ones given is held at 0. So ``{"relative": x}`` of a screen is x1 = 0
        and xf = -x, and ``{"floating": a, "relative": b}`` is xf = a and x1 = a + b.
    most_turns
        Turns after which a state is given up: its label is -1.
    rng
        Seed or generator of the search for motions.
    threads
        Threads; None: one for each processor.
    monitor
        Called with a sentence and the share done, 0 to 1. When it raises
        :class:`~flipflow.errors.Cancelled`, the cells that are finished are kept and returned;
        the others have label -1 and turns -1, and ``complete`` is False.

    Returns
    -------
    Basins
        ``labels``, ``orbits`` in their order, ``shares`` with 95 % confidence intervals.

    Raises
    ------
    InputError
        For an unknown coordinate, values that are empty or not finite, coordinates that follow
        from each other, or too many cells.
    """
    system = system_of(machine)
    axes = (*_axes(system, "displacement", displacement), *_axes(system, "velocity", velocity))
    if not axes:
        remedy = 'give values of at least one coordinate, as {"relative": [-0.04, 0.0, 0.04]}'
        raise InputError("displacement", displacement, remedy)
    most_turns = checked_count("most_turns", most_turns, MOST_TURNS)
    say = checked_monitor(monitor)
    shape = tuple(axis.values.size for axis in axes)
    if math.prod(shape) > MOST_CELLS:
        raise InputError("cells", math.prod(shape), f"give a grid of at most {MOST_CELLS:,} cells")
    states = _states(system, axes, shape)
    say("motions", 0.0)
    attractors = Attractors(machine, omega, rng, threads)
    run = attractors.run(states, most_turns, tick=lambda share: say("cells", share))
    return Basins(
        machine, attractors.lanes.omega, axes, run.label.reshape(shape), run.turns.reshape(shape),
        tuple(attractors.orbits), most_turns, _notes(run, most_turns, len(attractors.orbits)),
    )  # fmt: skip


def _axes(system: MechanicalSystem, kind: Kind, window: Window | None) -> list[GridAxis]:
    if window is None:
        return []
    if not isinstance(window, Mapping):
        raise InputError(
            kind, window, f'give coordinates with their values, as {{"{_any(system)}": [...]}}'
        )
    made = []
    for which, given in window.items():
        system.coordinate(which)
        field = f"{kind}[{which!r}]"
        remedy = f"give finite numbers in {UNITS[kind]}"
        # However large: states that grow beyond all bounds are cells that did not settle.
        values = np.atleast_1d(checked_reals(field, given, remedy)).copy()
        if values.ndim != 1 or values.size == 0:
            raise InputError(field, f"shape {values.shape}", "give a row of at least one value")
        if not np.isfinite(values).all():
            raise InputError(field, given, remedy)
        made.append(GridAxis(kind, which, values))
    return made


def _any(system: MechanicalSystem) -> Coordinate:
    return system.named[-1]


def _states(system: MechanicalSystem, axes: tuple[GridAxis, ...], shape: tuple[int, ...]) -> Real:
    """The states of all cells, last axis fastest, (cells, 2 N)."""
    grids = np.meshgrid(*(axis.values for axis in axes), indexing="ij")
    halves = []
    for kind in ("displacement", "velocity"):
        given = [k for k, axis in enumerate(axes) if axis.kind == kind]
        basis = _completed(system, kind, [axes[k].which for k in given])
        values = np.zeros((math.prod(shape), system.size))
        for column, k in enumerate(given):
            values[:, column] = grids[k].ravel()
        halves.append(np.linalg.solve(basis, values.T).T)
    return np.ascontiguousarray(np.concatenate(halves, axis=1))


def _completed(system: MechanicalSystem, kind: str, given: list[Coordinate]) -> Real:
    """Rows of the coordinates given, and of those that are held at 0 besides, (N, N)."""
    rows: list[Real] = []
    for which in given:
        vector = system.coordinate(which)
        if not _independent([*rows, vector]):
            raise InputError(
                f"{kind}[{which!r}]",
                "given",
                "it follows from the other coordinates; leave one out",
            )
        rows.append(vector)
    for which in (*system.named, *range(system.size)):
        vector = system.coordinate(which)
        if len(rows) < system.size and _independent([*rows, vector]):
            rows.append(vector)
    return np.array(rows)


def _independent(rows: list[Real]) -> bool:
    unit = np.array([row / (np.linalg.norm(row) or 1.0) for row in rows])
    return bool(np.linalg.matrix_rank(unit, tol=INDEPENDENT) == len(rows))


def _notes(run: Run, most: int, motions: int) -> tuple[str, ...]:
    notes = []
    ran = run.turns >= 0
    failed = int(np.sum(ran & (run.code != status.OK)))
    slow = int(np.sum(ran & (run.code == status.OK) & (run.label == NOT_SETTLED)))
    if motions == 0:
        notes.append(
            "No stable motion was found: the machine does not settle at this speed, or nothing "
            "holds it where it floats."
        )
    if slow:
        notes.append(f"{slow} cells did not settle within {most} turns.")
    if failed:
        notes.append(
            f"{failed} cells ended early: their motion grew beyond all bounds, or a turn had too "
            "many contacts. Start from smaller displacements and velocities."
        )
    if run.cancelled:
        notes.append(f"Cancelled: {int(ran.sum())} of {ran.size} cells were run, and are kept.")
    return tuple(notes)
