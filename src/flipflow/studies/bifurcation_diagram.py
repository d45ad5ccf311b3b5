"""Bifurcation diagrams by brute force: what a machine settles to, up and down a parameter."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow import __version__
from flipflow.compiled import status
from flipflow.compiled.arrays import Real
from flipflow.continuation.correction import QUICK, Course
from flipflow.continuation.field_solver import FieldSolver
from flipflow.errors import IncompleteError, InputError
from flipflow.model.arguments import (
    OMEGA_LEAST,
    OMEGA_MOST,
    WITHIN,
    checked_count,
    checked_monitor,
    checked_numbers,
    checked_speed,
    checked_text,
    checked_word,
    refuse_pair,
)
from flipflow.model.monitor import Monitor
from flipflow.model.parameters import Parameter, parameter_of
from flipflow.model.system import Coordinate, Machine, MechanicalSystem, system_of
from flipflow.periodic.orbit import Orbit, initial_state
from flipflow.periodic.solver import STEP_SHARE, Point
from flipflow.results.result import Result
from flipflow.transient.settling import (
    MAX_PERIODS,
    MOST_TURNS,
    PERIODIC,
    RECENT,
    SAME,
    UNDECIDED,
    Settled,
    Settling,
    Word,
)
from flipflow.transient.sweep import Step, step_at, step_by_step

Direction = Literal["up", "down"]
OMEGA = "omega"
MOST_POINTS = 100_000  # that may be asked for at one value


@dataclass(frozen=True, eq=False)
class Pass:
    """A parameter passed in one direction.

    Parameters
    ----------
    values
        Values of the parameter in the order in which they were passed, (n,).
    states
        At each value the states (x, x') at the beginning of successive forcing periods, (p, 2 N):
        one period of a motion that repeats, else as many points as were asked for.
    periods
        Forcing periods after which the motion repeats; 0 where it did not settle, (n,).
    words
        What the motion is: "periodic", "quasi-periodic", "chaotic", or "undecided".
    turns
        Forcing periods waited at each value, (n,).
    jumps
        Pairs of successive values between which the motion was lost and another one taken up.
    """

    values: Real
    states: tuple[Real, ...]
    periods: NDArray[np.int64]
    words: tuple[Word, ...]
    turns: NDArray[np.int64]
    jumps: tuple[tuple[float, float], ...]

    def __repr__(self) -> str:
        ends = f"{self.values[0]:.6g} to {self.values[-1]:.6g}, " if self.values.size else ""
        words = ", ".join(f"{count} {word}" for word, count in Counter(self.words).items())
        said = f"{ends}{words}, " if words else ends
        return f"Pass({self.values.size} values, {said}{len(self.jumps)} jumps)"


@dataclass(frozen=True, eq=False)
class BifurcationDiagram(Result):
    """What a machine settles to while a parameter rises in steps, then falls.

    Parameters
    ----------
    machine
        The machine, with its own value of the parameter.
    parameter
        "omega", a field, or a path such as "springs[0].clearance".
    values
        Values asked for, rising, in rad/s or the parameter's SI unit, (n,).
    omega
        Frequency in rad/s; None where it is the parameter.
    up, down
        What was met while the parameter rose, and while it fell.
    version
        Version of flipflow.
    complete
        Whether every value was passed both ways; what was cancelled keeps what it has finished.
    """

    machine: Machine
    parameter: str
    values: Real
    omega: float | None
    up: Pass
    down: Pass
    version: str
    complete: bool = True

    def __repr__(self) -> str:
        ends = f"{self.values[0]:.6g} to {self.values[-1]:.6g}"
        jumps = f"{len(self.up.jumps)} jumps up, {len(self.down.jumps)} down"
        return f"BifurcationDiagram({self.parameter}, {self.values.size} values, {ends}, {jumps})"

    @property
    def system(self) -> MechanicalSystem:
        """The machine as matrices and springs."""
        return self.machine.system()

    def points(self, which: Coordinate, direction: Direction = "up") -> tuple[Real, Real]:
        """Value of the parameter and displacement in m of each stroboscopic point, (P,) each.

        Raises
        ------
        InputError
            For a coordinate that is not known, or a direction other than "up" and "down".
        """
        passed: Pass = getattr(self, checked_word("direction", direction, ("up", "down")))
        vector = np.asarray(self.system.coordinate(which))
        counts = [states.shape[0] for states in passed.states]
        none = np.zeros((0, 2 * vector.size))
        states = np.concatenate([none, *passed.states])
        return np.repeat(passed.values, counts), states[:, : vector.size] @ vector

    @property
    def differ(self) -> NDArray[np.bool_]:
        """Where another motion is met upwards than downwards, (n,).

        Motions that do not repeat differ where their words do. One that is undecided, or whose
        period is not known yet, differs from none. A motion and its mirror image are two.
        """
        found = np.zeros(self.values.size, bool)
        down = {value: k for k, value in enumerate(self.down.values.tolist())}
        for k, value in enumerate(self.up.values.tolist()):
            if value in down:
                found[k] = self._differ(k, down[value])
        return found

    @property
    def hysteresis(self) -> tuple[tuple[float, float], ...]:
        """Intervals of successive values at which the two directions differ."""
        differ = np.concatenate([[False], self.differ, [False]])
        edges = np.flatnonzero(differ[1:] != differ[:-1])
        return tuple(
            (float(self.values[first]), float(self.values[beyond - 1]))
            for first, beyond in zip(edges[::2], edges[1::2], strict=True)
        )

    def _differ(self, k: int, j: int) -> bool:
        """Whether row k upwards and row j downwards are different motions."""
        one, other = (
            (way.words[row], int(way.periods[row])) for way, row in ((self.up, k), (self.down, j))
        )
        if {(UNDECIDED, 0), (PERIODIC, 0)} & {one, other}:
            return False
        if one != other:
            return True
        if self.up.periods[k] == 0:
            return False
        omega = float(self.up.values[k]) if self.omega is None else self.omega
        scale = np.repeat([1.0, 1.0 / omega], self.system.size)
        up, down = self.up.states[k] * scale, self.down.states[j] * scale
        away = np.abs(up[:, None] - down[None]).max(axis=2).min()
        return bool(away > SAME * max(np.abs(up).max(), np.abs(down).max()))


def bifurcation_diagram(
    machine: Machine,
    parameter: str,
    values: ArrayLike,
    *,
    omega: float | None = None,
    initial: str | Orbit | ArrayLike = "rest",
    points: int = RECENT,
    max_periods: int = MAX_PERIODS,
    most_turns: int = MOST_TURNS,
    monitor: Monitor | None = None,
) -> BifurcationDiagram:
    """Settle at rising values of a parameter, each from where the one before ended; then falling.

    At each value the machine settles as in :func:`~flipflow.sweep`, and its states at the beginning
    of successive forcing periods are kept. The way down begins with the state in which the way up
    ended. Motions that are not met on either way, unstable ones among them, are not seen:
    :func:`~flipflow.continue_orbit` follows those.

    Parameters
    ----------
    machine
        A screen, a :class:`~flipflow.MechanicalSystem`, or any frozen dataclass with ``.system()``.
    parameter
        "omega", or a field of the screen or dataclass, such as "clearance"; of a plain system
        "forcing", a factor on the excitation, or a path such as "springs[0].clearance".
    values
        In rad/s, or in the parameter's SI unit, (n,). They are passed rising, then falling.
    omega
        Frequency in rad/s, for a parameter other than "omega".
    initial
        Where the way up begins: "rest", an :class:`~flipflow.periodic.orbit.Orbit`, or a state
        (x, x'), (2 N,).
    points
        Stroboscopic points kept of a motion that does not repeat.
    max_periods
        Longest period looked for, in forcing periods, 1 to 12.
    most_turns
        Most forcing periods waited at a value; what has not settled then is marked so.
    monitor
        Called with a sentence and the share done. When it raises
        :class:`~flipflow.errors.Cancelled`, the values that are finished are kept and returned, and
        ``complete`` is False.

    Returns
    -------
    BifurcationDiagram
        Points, periods, words and jumps of both directions, and where these differ.

    Raises
    ------
    InputError
        For a parameter that is not known, values that it cannot have, a frequency that is missing
        or one too many, a count or state that makes no sense, or a machine without damping.
    """
    passing = _passing(machine, parameter, values, omega, checked_count(
        "max_periods", max_periods, MAX_PERIODS
    ))  # fmt: skip
    points = checked_count("points", points, MOST_POINTS)
    most_turns = checked_count("most_turns", most_turns, 10_000_000)
    say = checked_monitor(monitor)
    count = passing.values.size
    z = initial_state(system_of(machine), initial)

    def tell(before: int, done: int) -> None:
        say(f"{before + done} of {2 * count} values", (before + done) / (2 * count))

    rows, jumps, stopped = step_by_step(
        passing.steps(range(count)), z, most_turns, partial(tell, 0)
    )
    up = passing.passed(range(len(rows)), rows, jumps, points)
    back = range(0) if stopped else range(count - 1, -1, -1)
    rows, jumps, _ = step_by_step(
        passing.steps(back), rows[-1].state, most_turns, partial(tell, count)
    )
    down = passing.passed(back[: len(rows)], rows, jumps, points)
    return BifurcationDiagram(
        machine, passing.name, passing.values, passing.omega, up, down, __version__,
        complete=len(rows) == count,
    )  # fmt: skip


class _Passing(ABC):
    """A machine with the values of one parameter; ``omega`` is None where that is the frequency."""

    def __init__(self, name: str, values: Real, omega: float | None) -> None:
        self.name, self.values, self.omega = name, values, omega

    @abstractmethod
    def step(self, k: int) -> Step:
        """Where the machine settles at value k."""

    def steps(self, rows: range) -> Iterator[Step]:
        """Steps at these values in this order."""
        return map(self.step, rows)

    def passed(
        self, rows: range, settled: Sequence[Settled], jumps: Sequence[int], points: int
    ) -> Pass:
        """What was met at these values."""
        at = self.values[list(rows)]
        periods = [row.point.formulation.turns if row.point and row.settled else 0
                   for row in settled]  # fmt: skip
        return Pass(
            values=at,
            states=tuple(
                row.recent if count else _points(self.step(k), row, points)
                for k, row, count in zip(rows, settled, periods, strict=True)
            ),
            periods=np.array(periods, np.int64),
            words=tuple(row.word for row in settled),
            turns=np.array([row.turns for row in settled], np.int64),
            jumps=tuple((float(at[k - 1]), float(at[k])) for k in jumps),
        )


class _OverOmega(_Passing):
    """A machine at one frequency after the other."""

    def __init__(self, machine: Machine, values: Real, max_periods: int) -> None:
        super().__init__(OMEGA, values, None)
        if values[0] < OMEGA_LEAST or values[-1] > OMEGA_MOST:
            raise InputError("values", values, WITHIN)
        self.settling = Settling(system_of(machine), max_periods)

    def step(self, k: int) -> Step:
        """Where the machine settles at value k."""
        return step_at(self.settling, float(self.values[k]))


class _OverField(_Passing):
    """A machine at one frequency with one value of a parameter after the other."""

    def __init__(self, parameter: Parameter, values: Real, omega: float, max_periods: int) -> None:
        super().__init__(parameter.name, values, omega)
        self.parameter, self.speed, self.max_periods = parameter, omega, max_periods
        for value in values.tolist():  # what it cannot have is told before anything is run
            system_of(parameter.at(value)).with_bonded().require_damping()
        self._solvers: dict[int, FieldSolver | None] = {}

    def step(self, k: int) -> Step:
        """Where the machine settles at value k."""
        settling = Settling(system_of(self.parameter.at(float(self.values[k]))), self.max_periods)
        end = float(self.values[k])
        return Step(settling, self.speed, end, partial(self._continued, settling, end))

    def _continued(
        self, settling: Settling, end: float, point: Point, start: float
    ) -> Point | None:
        """The motion followed from one value to another; None where its branch turns back."""
        if start == end:
            return point
        periods = point.formulation.turns
        solver, u = self._solver(periods), point.u
        if solver is not None:
            low, high = sorted((start, end))
            course = Course(low, high, high - low, STEP_SHARE, np.sign(end - start), QUICK)
            traced = solver.trace(u, start, course)
            reached = traced.code in (status.REACHED_UPPER, status.REACHED_LOWER)
            if not reached or traced.omega[-1] != end:
                return None
            u = traced.u[-1]
        return settling.solver_of(periods).solve(u, self.speed)

    def _solver(self, periods: int) -> FieldSolver | None:
        """The solver that follows motions over the parameter; None where it has a kink."""
        if periods not in self._solvers:
            self._solvers[periods] = self._made(periods)
        return self._solvers[periods]

    def _made(self, periods: int) -> FieldSolver | None:
        ends = float(self.values[0]), float(self.values[-1])
        try:
            return FieldSolver(
                lambda value, _: system_of(self.parameter.at(value)), ends, self.parameter.value,
                self.speed, half_turn=False, turns=periods,
            )  # fmt: skip
        except IncompleteError:
            return None


def _passing(
    machine: Machine, parameter: str, values: ArrayLike, omega: float | None, max_periods: int
) -> _Passing:
    """The machine with the parameter's values, checked."""
    refuse_pair("values", values)
    remedy = "give finite values in one row, at least one"
    row = np.atleast_1d(checked_numbers("values", values, remedy))
    if row.ndim != 1 or row.size == 0:
        raise InputError("values", values, remedy)
    row = np.unique(row)
    checked_text("parameter", parameter)
    if parameter == OMEGA:
        if omega is not None:
            raise InputError("omega", omega, "leave it out where it is the parameter")
        return _OverOmega(machine, row, max_periods)
    if omega is None:
        raise InputError("omega", omega, f"give the frequency in rad/s at which {parameter} varies")
    system_of(machine)
    return _OverField(parameter_of(machine, parameter), row, checked_speed(omega), max_periods)


def _points(step: Step, row: Settled, points: int) -> Real:
    """Stroboscopic points after a row's end; the row's own where a turn cannot be carried."""
    try:
        return step.settling.solver.section(row.state, step.omega, points)
    except IncompleteError:
        return row.recent.copy()
