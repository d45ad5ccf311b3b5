"""The worst that tolerances can do: least and greatest of a quantity within intervals."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow import __version__
from flipflow.errors import InputError
from flipflow.model.arguments import checked_count, checked_index, checked_monitor, checked_word
from flipflow.model.monitor import Monitor
from flipflow.model.parameters import value_of, with_values
from flipflow.model.quantities import BranchWord
from flipflow.model.system import Machine
from flipflow.model.vary import Interval, Vary, variations
from flipflow.results.result import Result
from flipflow.studies.sensitivity_samples import (
    Question,
    motion_values,
    nearest_turn,
    nominal_values,
    question_of,
)

Real = NDArray[np.float64]
Int = NDArray[np.int64]
End = Literal["least", "greatest"]
SIGNS: dict[End, float] = {"least": -1.0, "greatest": 1.0}
# Shares of the ranges by which one parameter is moved. The whole range comes first: most extremes
# stand at a corner.
STEPS = (1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125)
ROUNDS = 32  # with one step
MORE = 1e-12  # share of a value by which another one must exceed it to be better
DIGITS = 12  # of shares of the ranges, to tell machines that were looked at


@dataclass(frozen=True, eq=False)
class WorstCase(Result):
    """Least and greatest of a quantity at K frequencies; returned by :func:`flipflow.worst_case`.

    Parameters
    ----------
    machine
        The machine whose P parameters vary.
    quantity
        What is read off.
    names, intervals
        The parameters, (P,), and their intervals, SI, (P, 2).
    omega
        Frequencies in rad/s, (K,); NaN for a quantity of the whole response.
    branch
        Which motion is meant where several exist.
    nominal
        The quantity of the machine itself, SI, (K,).
    least, greatest
        Its least and greatest value in the box, SI, (K,); NaN where no machine has one.
    least_at, greatest_at
        Parameters of the machines that have them, SI, (K, P).
    looked_at
        Number of machines that were solved.
    notes
        A sentence for each thing to keep in mind.
    version
        Version of flipflow.
    """

    machine: Machine
    quantity: str
    names: tuple[str, ...]
    intervals: Real
    omega: Real
    branch: BranchWord
    nominal: Real
    least: Real
    greatest: Real
    least_at: Real
    greatest_at: Real
    looked_at: int
    notes: tuple[str, ...]
    version: str

    def __repr__(self) -> str:
        known = np.isfinite(self.least)
        span = "not known"
        if known.any():
            span = f"{self.least[known].min():.6g} to {self.greatest[known].max():.6g}"
        return f"WorstCase({self.quantity} over {len(self.names)} parameters: {span})"

    def machine_at(self, end: End, at: int = 0) -> Machine:
        """The machine that has the least or the greatest value at the frequency of index ``at``.

        Raises
        ------
        InputError
            For an end that is neither, an index that is none, and where no value is known.
        """
        checked_word("end", end, tuple(SIGNS))
        remedy = "give the index of a frequency"
        place = checked_index("at", at, self.omega.size, remedy)
        values = (self.least_at if end == "least" else self.greatest_at)[place]
        if np.isnan(values).any():
            raise InputError("at", at, "no machine has a value there; choose another index")
        return with_values(self.machine, dict(zip(self.names, values.tolist(), strict=True)))


def worst_case(
    machine: Machine,
    vary: Vary,
    quantity: str,
    omega: ArrayLike | None = None,
    *,
    branch: BranchWord = "from-below",
    threads: int | None = None,
    monitor: Monitor | None = None,
) -> WorstCase:
    r"""Least and greatest of a quantity when parameters may lie anywhere in their intervals.

    At every frequency

    .. math:: \min_p q(p, \omega), \quad \max_p q(p, \omega), \quad p_j \in [a_j, b_j],

    by a compass search over the box, which begins at the corner that the effects of single
    parameters point to. Machines are solved as lanes, each at all frequencies; one that is found
    for one frequency counts for all. Where a motion jumps inside the box, the search goes over the
    jump: ``branch`` says which motion is meant. Of ``"omega_lb"`` and ``"omega_ub"`` it finds how
    far the folds move. A value that lies higher elsewhere, behind a valley, is not excluded.

    Parameters
    ----------
    machine
        The machine whose parameters vary: a screen, any frozen dataclass with ``.system()``, or
        a :class:`~flipflow.MechanicalSystem`.
    vary
        Parameters and their intervals (low, high), SI.
    quantity
        What is read off, as of :func:`~flipflow.sensitivity`.
    omega
        Frequencies in rad/s, one or (K,); of a quantity of the whole response the interval
        analysed, or None.
    branch
        ``"from-below"``, ``"upper"`` or ``"lower"``, as of :func:`~flipflow.sensitivity`.
    threads
        Threads over chunks of machines; None: one.
    monitor
        Called with a sentence and the share done, 0 to 1. What it raises ends the work.

    Returns
    -------
    WorstCase
        Values and the machines that have them.

    Raises
    ------
    InputError
        For an unknown parameter or quantity, and for what is no interval.

    References
    ----------
    T. G. Kolda, R. M. Lewis, V. Torczon, Optimization by direct search, SIAM Review 45 (2003) 385.
    """
    question = question_of(machine, quantity, omega, branch)
    varied = variations(vary, machine)
    for one in varied:
        if not isinstance(one.distribution, Interval):
            field = f"vary {one.name}"
            raise InputError(field, one.distribution, "a worst case needs an interval (low, high)")
    names = tuple(one.name for one in varied)
    intervals = np.array([one.distribution.ends for one in varied], float)
    workers = checked_count("threads", 1 if threads is None else threads, 256)
    search = _Search(question, names, intervals, workers, checked_monitor(monitor))
    search.run()
    found = {end: search.extremes(sign) for end, sign in SIGNS.items()}
    return WorstCase(
        machine=machine,
        quantity=quantity,
        names=names,
        intervals=intervals,
        omega=question.omega,
        branch=branch,
        nominal=search.nominal[0],
        least=found["least"][0],
        greatest=found["greatest"][0],
        least_at=found["least"][1],
        greatest_at=found["greatest"][1],
        looked_at=len(search.values),
        notes=tuple(_notes(search)),
        version=__version__,
    )


class _Search:
    """Machines that were looked at, by their shares (P,) of the intervals, 0 to 1."""

    def __init__(
        self,
        question: Question,
        names: tuple[str, ...],
        intervals: Real,
        threads: int,
        monitor: Monitor,
    ) -> None:
        self.question, self.names, self.threads, self.monitor = question, names, threads, monitor
        self.low, self.width = intervals[:, 0], np.diff(intervals, axis=1)[:, 0]
        self.nominal = nominal_values(question)
        self.u = np.zeros((0, len(names)))
        self.values = np.zeros((0, question.omega.size))
        self._seen: set[bytes] = set()
        self._done = 0.0

    def run(self) -> None:
        """Look at the machine itself, at ends of single parameters, at corners, beside the best."""
        middle = self._middle
        self.look(np.concatenate([middle, *(self._moved(middle, side) for side in (-1, 1))]))
        self.look(np.array(list(self._corners())))
        for k, step in enumerate(STEPS):
            self._done = k / len(STEPS)
            for _ in range(ROUNDS):
                before = [self.extremes(sign)[0] for sign in SIGNS.values()]
                best = self._best
                sides = [self._moved(best, side * step) for side in (-1, 1)]
                if not self.look(np.concatenate(sides)) or not self._better(before):
                    break
        self.look(np.array(list(self._summits())).reshape(-1, len(self.names)))

    def look(self, u: Real) -> bool:
        """Solve the machines that were not looked at before; whether there were any."""
        u = np.unique(np.clip(u, 0.0, 1.0).round(DIGITS), axis=0)
        new = np.array([row for row in u if _key(row) not in self._seen])
        if not new.size:
            return False
        columns = dict(zip(self.names, (self.low + new * self.width).T, strict=True))
        found = motion_values(self.question, columns, self.threads, self._tell)
        self._seen |= {_key(row) for row in new}
        self.u = np.concatenate([self.u, new])
        values = nearest_turn(self.question, found, self.nominal)
        self.values = np.concatenate([self.values, values])
        return True

    def extremes(self, sign: float) -> tuple[Real, Real]:
        """Greatest value at each frequency, or the least one, and the parameters that have it."""
        rows = self._rows(sign)
        values = self.values[rows, np.arange(rows.size)]
        parameters = self.low + self.u[rows] * self.width
        parameters[np.isnan(values)] = np.nan
        return values, parameters

    def _rows(self, sign: float) -> Int:
        """The machine with the greatest value at each frequency, or the least one."""
        height = np.where(np.isnan(self.values), -np.inf, sign * self.values)
        return np.asarray(np.argmax(height, axis=0))

    @property
    def _best(self) -> Real:
        """Machines that have an extreme at some frequency."""
        rows = np.unique([self._rows(sign) for sign in SIGNS.values()])
        return np.asarray(self.u[rows])

    @property
    def _middle(self) -> Real:
        """The machine itself, (1, P); the middle of an interval that it does not lie in."""
        own = np.array([value_of(self.question.machine, name) for name in self.names], float)
        share = (own - self.low) / self.width
        return np.where((share >= 0.0) & (share <= 1.0), share, 0.5)[None]

    @staticmethod
    def _moved(rows: Real, step: float) -> Real:
        """Each row with one parameter after the other moved."""
        moves = step * np.eye(rows.shape[1])
        return np.asarray((rows[:, None] + moves).reshape(-1, rows.shape[1]))

    def _corners(self) -> Iterator[Real]:
        """Where the effects of single parameters point to at each frequency."""
        (middle,) = self._middle
        moved = self.u != middle
        for sign in SIGNS.values():
            for k in range(self.question.omega.size):
                corner = middle.copy()
                for j in range(middle.size):
                    rows = np.flatnonzero(moved[:, j] | ~moved.any(axis=1))
                    values = sign * self.values[rows, k]
                    known = rows[values == np.nanmax(values, initial=-np.inf)]
                    # Where it makes no difference the parameter stays.
                    corner[j] = self.u[known[0], j] if known.size == 1 else middle[j]
                yield corner

    def _summits(self) -> Iterator[Real]:
        """The tops of parabolas through the best machine and those beside it, at each frequency."""
        step = STEPS[-1]
        rows = {_key(row): k for k, row in enumerate(self.u)}
        for sign in SIGNS.values():
            for k, best in enumerate(self._rows(sign)):
                top = self.u[best].copy()
                sides = [
                    self._moved(top[None], side * step).round(DIGITS) + 0.0 for side in (-1, 1)
                ]
                for j, pair in enumerate(zip(*sides, strict=True)):
                    if not all(one.tobytes() in rows for one in pair):
                        continue
                    a, b = (sign * self.values[rows[one.tobytes()], k] for one in pair)
                    bend = a + b - 2.0 * sign * self.values[best, k]
                    if bend < 0.0:
                        top[j] += 0.5 * step * (a - b) / bend
                yield top

    def _better(self, before: list[Real]) -> bool:
        """Whether any extreme has grown, or one is known that was not."""
        for sign, old in zip(SIGNS.values(), before, strict=True):
            new = self.extremes(sign)[0]
            if (np.isnan(old) & ~np.isnan(new)).any():
                return True
            if (sign * (new - old) > MORE * np.abs(old)).any():
                return True
        return False

    def _tell(self, _share: float) -> None:
        self.monitor(f"worst case: {len(self.values)} machines looked at", self._done)


def _key(row: Real) -> bytes:
    return (row.round(DIGITS) + 0.0).tobytes()  # -0 becomes 0


def _notes(search: _Search) -> Iterator[str]:
    unknown = int(np.isnan(search.values).any(axis=1).sum())
    if unknown:
        yield (
            f"{unknown} of {len(search.values)} machines that were looked at have no value at some "
            "frequency; what they would have there is not counted"
        )
