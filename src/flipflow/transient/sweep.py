"""Which motion a machine settles to while its speed is changed in steps."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow import __version__
from flipflow.compiled.arrays import Real
from flipflow.errors import Cancelled
from flipflow.model.arguments import checked_count, checked_monitor, checked_speeds, refuse_pair
from flipflow.model.monitor import Monitor
from flipflow.model.screen import unit_in
from flipflow.model.system import Coordinate, Machine, MechanicalSystem, system_of
from flipflow.periodic.orbit import Orbit, initial_state
from flipflow.periodic.solver import Formulation, Point
from flipflow.results.result import Frozen, Result
from flipflow.transient.exponents import with_word
from flipflow.transient.settling import (
    MAX_PERIODS,
    MOST_TURNS,
    Settled,
    Settling,
    Word,
    is_stable,
)


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
class Sweep(Frozen, Result):
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
    formulation
        The equations of motions of one forcing period.
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
    formulation: Formulation
    version: str
    complete: bool = True

    def __repr__(self) -> str:
        unit = unit_in(self.machine, "rad/s")
        ends = f"{self.omega.min():.6g} to {self.omega.max():.6g}{unit}"
        return f"Sweep({self.omega.size} speeds, {ends}, {len(self.jumps)} jumps)"

    @property
    def system(self) -> MechanicalSystem:
        """The machine as it was solved."""
        return self.formulation.system

    @property
    def settled(self) -> NDArray[np.bool_]:
        """Whether the motion is periodic within the tolerance."""
        return np.array([row.settled for row in self.rows])

    @property
    def periods(self) -> NDArray[np.int64]:
        """Forcing periods after which the motion repeats; 0 where it did not settle."""
        return np.array(
            [row.point.formulation.turns if row.point is not None and row.settled else 0
             for row in self.rows]
        )  # fmt: skip

    @property
    def words(self) -> tuple[Word, ...]:
        """What the motion at each step is.

        "periodic", "quasi-periodic", "chaotic", or "undecided" where no time was left to tell. A
        motion that has not settled may be periodic all the same, with more periods than were looked
        for, or later.
        """
        return tuple(row.word for row in self.rows)

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

        Where the motion did not settle, over the last turns recorded (up to 64); NaN where no turn
        from there can be carried to its end.
        """
        low, high = self.extremes(which)
        return np.asarray((high - low) / 2.0)

    def extremes(self, which: Coordinate) -> tuple[Real, Real]:
        """Least and greatest value of a coordinate in m at the end of each step, or NaN."""
        key = tuple(self.system.coordinate(which))
        if key not in self._seen:
            turns = [row.recent.shape[0] for row in self.rows]
            states = np.concatenate([row.recent for row in self.rows])
            solver = self.formulation.solver()
            low, high, _ = solver.extremes(states, np.repeat(self.omega, turns), np.array([key]))
            starts = np.cumsum([0, *turns[:-1]])
            least = np.minimum.reduceat(low[:, 0], starts)
            greatest = np.maximum.reduceat(high[:, 0], starts)
            known = least <= greatest
            self._seen[key] = np.where(known, least, np.nan), np.where(known, greatest, np.nan)
        low, high = self._seen[key]
        return low.copy(), high.copy()

    @cached_property
    def _seen(self) -> dict[tuple[float, ...], tuple[Real, Real]]:
        return {}


JUMP_SHARE = 0.05  # distance, relative to the motion, beyond which it is another one: a jump


def sweep(
    machine: Machine,
    omega: ArrayLike,
    *,
    initial: str | Orbit | ArrayLike = "rest",
    max_periods: int = MAX_PERIODS,
    most_turns: int = MOST_TURNS,
    monitor: Monitor | None = None,
) -> Sweep:
    """Settle at one frequency after the other, each from where the one before ended.

    The speed changes when the unbalance points along +x. At each frequency the exact flow runs
    until the periodic motion it approaches is closer than 1e-9 of the motion's size. That motion
    is solved for, so that lingering just past a fold is not taken for settling; its leading
    multiplier says how many turns are still to go. Where none is approached, Lyapunov exponents
    over 2048 further periods tell what the motion is, as in
    :func:`~flipflow.lyapunov_exponents`.

    Parameters
    ----------
    machine
        A screen, a :class:`~flipflow.MechanicalSystem`, or any machine with ``.system()``.
    omega
        Frequencies in rad/s in the order to pass, (n,).
    initial
        "rest", an :class:`~flipflow.periodic.orbit.Orbit`, or a state (x, x'), (2 N,).
    max_periods
        Longest period looked for, in forcing periods, 1 to 12.
    most_turns
        Most forcing periods waited at a step; what has not settled then is marked so.
    monitor
        Called with a sentence and the share done. When it raises
        :class:`~flipflow.errors.Cancelled`, the frequencies that are finished are kept and
        returned, and ``complete`` is False.

    Returns
    -------
    Sweep
        Settled amplitudes, periods, words, jumps.

    Raises
    ------
    InputError
        For frequencies that are not finite and above 0, a count below 1, a state of wrong shape,
        or a machine without damping, which never settles.
    """
    refuse_pair("omega", omega)
    speeds = checked_speeds(omega)
    max_periods = checked_count("max_periods", max_periods, MAX_PERIODS)
    most_turns = checked_count("most_turns", most_turns, 10_000_000)
    say = checked_monitor(monitor)
    settling = Settling(system_of(machine), max_periods)
    z = initial_state(settling.solver.system, initial)
    steps = (step_at(settling, speed) for speed in speeds.tolist())

    def tell(done: int) -> None:
        say(f"settled at {speeds[done - 1]:.4g} rad/s", done / speeds.size)

    rows, jumped, _ = step_by_step(steps, z, most_turns, tell)
    jumps = tuple(Jump(k, float(speeds[k - 1]), float(speeds[k])) for k in jumped)
    done = len(rows)
    return Sweep(
        machine, speeds[:done], tuple(rows), jumps, max_periods, most_turns,
        settling.solver.formulation, __version__, complete=done == speeds.size,
    )  # fmt: skip


@dataclass(frozen=True)
class Step:
    """Where a machine settles next.

    Parameters
    ----------
    settling
        Runs the machine as it is at this step.
    omega
        Frequency in rad/s.
    value
        What the steps differ in: the frequency, or a parameter.
    continued
        A motion at a value followed along its branch to this step; None where it ends.
    """

    settling: Settling
    omega: float
    value: float
    continued: Callable[[Point, float], Point | None]


def step_at(settling: Settling, omega: float) -> Step:
    """A step that differs from others in the frequency."""
    return Step(settling, omega, omega, lambda point, _: settling.continued(point, omega))


def step_by_step(
    steps: Iterable[Step], z: Real, most_turns: int, tell: Callable[[int], None]
) -> tuple[list[Settled], list[int], bool]:
    """Settle at one step after the other, each from where the one before ended.

    Returns the rows, the indices of those in which another motion is met, and whether ``tell``,
    which is called with the number of rows that are finished, raised Cancelled.
    """
    rows: list[Settled] = []
    jumps: list[int] = []
    last: Step | None = None
    for step in steps:
        row = with_word(step.settling, step.settling.settle(z, step.omega, most_turns), step.omega)
        if last is not None and _jumped(last, rows[-1], step, row):
            jumps.append(len(rows))
        rows.append(_kept(row))
        last = step
        z = row.state
        try:
            tell(len(rows))
        except Cancelled:
            return rows, jumps, True
    return rows, jumps, False


def _kept(row: Settled) -> Settled:
    """A row with the states of one period only where the motion repeats."""
    if row.point is None or not row.settled:
        return row
    return replace(row, recent=row.recent[-row.point.formulation.turns :])


def _jumped(last: Step, before: Settled, step: Step, after: Settled) -> bool:
    """Whether neither the motion before can be followed to the motion after, nor that one back.

    Where a motion of two periods ends in one of a single period only the latter leads on.
    """
    if before.point is None or after.point is None:
        return (before.point is None) != (after.point is None)
    one, other = is_stable(before.point), is_stable(after.point)
    if not (one and other):
        return one != other  # what floats in place is on no branch
    ahead = _leads(step, before.point, last.value, after)
    return not (ahead or _leads(last, after.point, step.value, before))


def _leads(step: Step, point: Point, value: float, to: Settled) -> bool:
    """Whether a motion at a value, followed to a step, is what the machine settled into there."""
    followed, settling, omega = step.continued(point, value), step.settling, step.omega
    if followed is None:
        return False
    share = JUMP_SHARE * settling.size(to.recent, omega)
    # Of all their phases, for in which of them a run was caught is chance.
    pairs = product(settling.phases(followed), settling.phases(cast("Point", to.point)))
    return any(settling.distance(*pair, omega) <= share for pair in pairs)
