"""The worst that tolerances can do: least and greatest of a quantity within intervals."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow import __version__
from flipflow.compiled.arrays import Int, Real
from flipflow.errors import InputError
from flipflow.model.arguments import checked_index, checked_monitor, checked_word
from flipflow.model.monitor import Monitor
from flipflow.model.parameters import value_of, with_values
from flipflow.model.quantities import BranchWord
from flipflow.model.system import Machine
from flipflow.model.vary import Interval, Vary, variations
from flipflow.results.result import Result
from flipflow.studies.sensitivity_samples import (
    Question,
    checked_threads,
    motion_values,
    nearest_turn,
    nominal_values,
    question_of,
)

Bool = NDArray[np.bool_]
End = Literal["least", "greatest"]
SIGNS: dict[End, float] = {"least": -1.0, "greatest": 1.0}
# Shares of the ranges by which one parameter is moved. The whole range comes first: most extremes
# stand at a corner. What comes after the COARSE ones is for extremes of which more may be missing.
STEPS = tuple(0.5**k for k in range(21))
COARSE = 6
MISSING = 1e-4  # share of a value that may be missing for the search to end
ROUNDS = 32  # with one step
TIED = 1e-9  # share of a value within which two are the same
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
        The quantity of the machine itself, SI, (K,); NaN where its motion is unstable.
    least, greatest
        Its least and greatest value in the box, SI, (K,); NaN where none of the machines looked at
        has one: they are sought from the machine itself.
    least_at, greatest_at
        Parameters of the machines that have them, SI, (K, P).
    span
        Frequencies analysed where the quantity is one of the whole response, rad/s.
    error
        By how much an end may lie farther out between machines that were looked at, SI, (K,), by
        what those beside it show. Where the drop beside it is smooth, far less is missing; infinite
        where no machine beside it has a value.
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
    span: tuple[float, float]
    error: Real
    looked_at: int
    notes: tuple[str, ...]
    version: str

    def __repr__(self) -> str:
        known = np.isfinite(self.least)
        span = "not known"
        if known.any():
            span = f"{self.least[known].min():.6g} to {self.greatest[known].max():.6g}"
        over = self.names[0] if len(self.names) == 1 else f"{len(self.names)} parameters"
        return f"WorstCase({self.quantity} over {over}: {span})"

    def places(self, end: End) -> Real:
        """Where in their intervals the parameters lie at one end, 0 to 1, (K, P)."""
        low, high = self.intervals.T
        return np.asarray((self._at(end) - low) / (high - low))

    def machine_at(self, end: End, at: int = 0) -> Machine:
        """The machine that has the least or the greatest value at the frequency of index ``at``.

        Raises
        ------
        InputError
            For an end that is neither, an index that is none, and where no value is known; and of
            an opened result whose machine was of a class of its user, which no file holds.
        """
        remedy = f"give the index of a frequency, 0 to {self.omega.size - 1}"
        place = checked_index("at", at, self.omega.size, remedy)
        values = self._at(end)[place]
        if np.isnan(values).any():
            raise InputError("at", at, "no machine has a value there; choose another index")
        return with_values(self.machine, dict(zip(self.names, values.tolist(), strict=True)))

    def _at(self, end: End) -> Real:
        checked_word("end", end, tuple(SIGNS))
        return self.least_at if end == "least" else self.greatest_at


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
    parameters point to; its steps are halved until what lies beside an extreme shows that little
    is missing. Machines are solved at all frequencies, as lanes where the quantity is one of a
    motion; one that is found for one frequency counts for all. Where a motion jumps inside the
    box, the search goes over the jump: ``branch`` says which motion is meant. Of ``"omega_lb"``
    and ``"omega_ub"`` it finds how far the folds move. Angles are taken within half a turn of the
    machine's own. A value that lies higher elsewhere, behind a valley, is not excluded.

    Parameters
    ----------
    machine
        The machine whose parameters vary: a screen, any frozen dataclass with ``.system()``, or
        a :class:`~flipflow.MechanicalSystem`.
    vary
        Parameters and their intervals, tuples (low, high) in SI.
    quantity
        What is read off, as of :func:`~flipflow.sensitivity`.
    omega
        Frequencies in rad/s, one or (K,); of a quantity of the whole response the interval
        analysed, or None.
    branch
        ``"from-below"``, ``"upper"`` or ``"lower"``, as of :func:`~flipflow.sensitivity`.
    threads
        As of :func:`~flipflow.sensitivity`.
    monitor
        Called with a sentence and the share done, 0 to 1. What it raises ends the work.

    Returns
    -------
    WorstCase
        Values and the machines that have them.

    Raises
    ------
    InputError
        For an unknown parameter or quantity, for what is no interval, and for a machine without
        any damping.

    References
    ----------
    T. G. Kolda, R. M. Lewis, V. Torczon, Optimization by direct search, SIAM Review 45 (2003) 385.
    """
    question = question_of(machine, quantity, omega, branch)
    for name, given in vary.items() if isinstance(vary, Mapping) else ():
        if not isinstance(given, (tuple, Interval)):
            remedy = "a worst case needs an interval (low, high), a tuple in SI"
            raise InputError(f"vary {name}", given, remedy)
    varied = variations(vary, machine)
    names = tuple(one.name for one in varied)
    intervals = np.array([one.distribution.ends for one in varied], float)
    workers = checked_threads(question, threads)
    search = Search(question, names, intervals, workers, checked_monitor(monitor))
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
        span=question.span,
        error=search.error,
        looked_at=len(search.values),
        notes=tuple(_notes(search)),
        version=__version__,
    )


class Search:
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
        self.low, self.high = intervals.T
        self.own = np.array([value_of(question.machine, name) for name in names], float)
        inside = (self.own >= self.low) & (self.own <= self.high)
        self.start = np.where(inside, self.own, 0.5 * (self.low + self.high))
        self.middle = ((self.start - self.low) / (self.high - self.low)).round(DIGITS)
        self.nominal = nominal_values(question, names)
        self.u = np.zeros((0, len(names)))
        self.values = np.zeros((0, question.omega.size))
        self.error = np.zeros(question.omega.size)
        self.open = np.ones(question.omega.size, bool)  # frequencies that are looked at further
        self._row: dict[bytes, int] = {}
        self._done = 0.0

    def run(self) -> None:
        """Look at the machine itself, at ends of single parameters, at corners, beside the best."""
        self.look(self.middle[None])
        self.look(np.concatenate([self._moved(self.middle[None], side) for side in (-1.0, 1.0)]))
        self.look(np.array(list(self.corners())))
        for k, step in enumerate(STEPS):
            self._done, before = min(k / COARSE, 0.9), self._extremes
            for _ in range(ROUNDS):
                begun, best = self._extremes, self._best
                sides = [self._moved(best, side * step) for side in (-1.0, 1.0)]
                if not self.look(np.concatenate(sides)) or not _grown(begun, self._extremes).any():
                    break
            if k + 1 >= COARSE:
                self._judge(step, _grown(before, self._extremes, MISSING))
                if not self.open.any():
                    break
        self.look(self._summits(step))
        self.monitor(self._told, 1.0)

    def look(self, u: Real) -> bool:
        """Solve the machines that were not looked at before; whether there were any."""
        u = np.unique(np.clip(u, 0.0, 1.0).round(DIGITS) + 0.0, axis=0)  # -0 becomes 0
        new = np.array([row for row in u if row.tobytes() not in self._row])
        if not new.size:
            return False
        columns = dict(zip(self.names, self._parameters(new).T, strict=True))
        found = motion_values(self.question, columns, self.threads, self._tell)
        self._row |= {row.tobytes(): len(self.u) + k for k, row in enumerate(new)}
        self.u = np.concatenate([self.u, new])
        values = nearest_turn(self.question, found, self.nominal)
        self.values = np.concatenate([self.values, values])
        return True

    def extremes(self, sign: float) -> tuple[Real, Real]:
        """Greatest value at each frequency, or the least one, and the parameters that have it."""
        rows = self._rows(sign)
        values, parameters = self.values[rows, self._places], self._parameters(self.u[rows])
        parameters[np.isnan(values)] = np.nan
        return values, parameters

    def _parameters(self, u: Real) -> Real:
        """Values of shares; the ends and the machine's own to the last bit."""
        values = np.where(u == 1.0, self.high, self.low + u * (self.high - self.low))
        return np.asarray(np.where(u == self.middle, self.start, values))

    def _rows(self, sign: float) -> Int:
        """The machine with the greatest value at each frequency, or the least one.

        Of those that are as good but for rounding it is the first that was looked at, so that what
        makes no difference stays.
        """
        height = sign * self.values
        unknown = np.isnan(height)
        top = np.where(unknown, -np.inf, height).max(axis=0)
        near = top - np.where(np.isfinite(top), TIED * np.abs(top), 0.0)
        return np.asarray(np.argmax(~unknown & (height >= near), axis=0))

    @property
    def _places(self) -> Int:
        return np.arange(self.question.omega.size)

    @property
    def _extremes(self) -> Real:
        """Negative least and greatest value at each frequency, (2, K)."""
        return np.array([sign * self.extremes(sign)[0] for sign in SIGNS.values()])

    @property
    def size(self) -> Real:
        """Size of the values at each frequency, (K,); infinite where none is known."""
        size = np.abs(self._extremes).max(axis=0)
        return np.where(np.isnan(size), np.inf, size)

    @property
    def _best(self) -> Real:
        """Machines that have an extreme at some frequency that is open."""
        rows = np.unique([self._rows(sign)[self.open] for sign in SIGNS.values()])
        return np.asarray(self.u[rows])

    @staticmethod
    def _moved(rows: Real, step: float) -> Real:
        """Each row with one parameter after the other moved."""
        moves = step * np.eye(rows.shape[1])
        return np.asarray((rows[:, None] + moves).reshape(-1, rows.shape[1]))

    def corners(self) -> Iterator[Real]:
        """Where the effects of single parameters point to at each frequency."""
        moved = self.u != self.middle
        none = int(np.flatnonzero(~moved.any(axis=1))[0])
        for sign in SIGNS.values():
            corners = np.tile(self.middle, (self._places.size, 1))
            for j in range(self.middle.size):
                # Where no end is better than the machine itself, the parameter stays.
                rows = np.array([none, *np.flatnonzero(moved[:, j])])
                height = sign * self.values[rows]
                best = np.argmax(np.where(np.isnan(height), -np.inf, height), axis=0)
                corners[:, j] = self.u[rows[best], j]
            yield from corners

    def _judge(self, step: float, growing: Bool) -> None:
        """How much may be missing at frequencies that are open; those where it is little are not.

        Of a parabola with its top within half a step a quarter of the drop beside it may be
        missing. Where one side alone drops, and the extreme grows no more, a jump is there, and
        what may be missing is what the step on the other side brought.
        """
        missing, little = np.zeros(self.open.size), MISSING * self.size
        further = np.zeros(self.open.size, bool)
        for e, k, _, top, a, b in self._beside(step):
            smooth, level = 0.25 * (top - min(a, b)), top - max(a, b)
            jump = level <= little[k] and not growing[e, k]
            missing[k] = max(missing[k], min(smooth, level) if jump else smooth)
            further[k] |= not jump and smooth > little[k]
        self.error = np.where(self.open, missing, self.error)
        self.open &= further

    def _summits(self, step: float) -> Real:
        """The tops of parabolas through the best machine and those beside it."""
        rows = np.array([self._rows(sign) for sign in SIGNS.values()])
        tops = self.u[rows]
        for e, k, j, top, a, b in self._beside(step):
            bend = a + b - 2.0 * top
            if -np.inf < bend < 0.0:
                tops[e, k, j] += 0.5 * step * (a - b) / bend
        return np.asarray(tops.reshape(-1, self.u.shape[1]))

    def _beside(self, step: float) -> Iterator[tuple[int, int, int, float, float, float]]:
        """Of each end, frequency and parameter within its interval: the height there and beside.

        A machine beside without a value is infinitely low.
        """
        for e, sign in enumerate(SIGNS.values()):
            for k, best in enumerate(self._rows(sign).tolist()):
                u = self.u[best]
                sides = [self._moved(u[None], side * step).round(DIGITS) for side in (-1.0, 1.0)]
                for j in range(u.size):
                    beside = [self._row.get(one[j].tobytes(), -1) for one in sides]
                    heights = sign * self.values[[best, *beside], k]
                    if min(beside) >= 0 and np.isfinite(heights[0]):
                        yield e, k, j, *np.where(np.isnan(heights), -np.inf, heights).tolist()

    @property
    def _told(self) -> str:
        return f"worst case: {len(self.values)} machines looked at"

    def _tell(self, _: float) -> None:
        # How many machines there will be is not known.
        self.monitor(self._told, self._done)


def _grown(before: Real, after: Real, share: float = TIED) -> Bool:
    """Which extremes have grown by more than a share, or are known and were not."""
    known = np.isnan(before) & ~np.isnan(after)
    far = np.where(np.isfinite(before), share * np.abs(before), 0.0)
    return np.asarray(known | (after > before + far))


def _notes(search: Search) -> Iterator[str]:
    ends = zip(search.names, search.low, search.own, search.high, strict=True)
    outside = [name for name, low, own, high in ends if not low <= own <= high]
    if outside:
        yield f"the machine itself lies outside the interval of {' and '.join(outside)}"
    missing = np.isnan(search.values)
    count = f"{int(missing.any(axis=1).sum())} of {len(search.values)} machines looked at have none"
    if missing.all():
        yield f"no machine that was looked at has a value of {search.question.quantity.name}"
    elif missing.any() and search.question.quantity.of == "response":
        yield f"not every machine in the box has such a value: {count}, and they do not count"
    elif missing.any():
        omega = search.question.omega[missing.any(axis=0)]
        span = f"{omega.min():.6g} to {omega.max():.6g} rad/s"
        yield f"not every machine has a value at every speed of {span}: {count}, and do not count"
    rough = int((search.error > MISSING * search.size).sum())
    if rough:
        yield (
            f"at {rough} of {search.error.size} frequencies the search ended before it stood "
            "still, see error; narrow the intervals there"
        )
