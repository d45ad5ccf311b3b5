"""What moves, in words: whether a motion repeats, winds on a torus or is chaotic.

The growth of small disturbances is followed over many forcing periods. Its mean rates are the
Lyapunov exponents; means over batches of periods tell their standard errors. The largest exponent
of a chaotic motion lies above 0, that of one that ends in a periodic motion below 0. Of a
quasi-periodic motion it is 0, and more: its growth stays within bounds, while growth that is 0 in
the mean alone wanders off as a random walk does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from flipflow.compiled import status
from flipflow.compiled.arrays import Real
from flipflow.compiled.interruptible import interruptible
from flipflow.errors import IncompleteError
from flipflow.model.monitor import Monitor
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.solver import Point
from flipflow.transient.settling import (
    CHAOTIC,
    PERIODIC,
    QUASI_PERIODIC,
    RECENT,
    UNDECIDED,
    Settled,
    Settling,
    Word,
)
from flipflow.transient.tangent_growth import grow

BATCHES = 32  # whose means tell the standard error
CERTAIN = 4.0  # standard errors beyond which an exponent is not 0
STRETCHES = 16  # of the growth, whose ranges tell whether it stays within bounds
# A random walk's range over all of it is that over a sixteenth times 4, one within bounds times 1.
WITHIN_BOUNDS = 2.0
PERIODS = 2048  # forcing periods followed for a word, after
ALIGNING = 256  # those in which the frame turns into the directions that grow most
DRIFT = 10.0  # times as much as the motion's own steps may disturbances of a drift grow
MOST_GROWTH = 500.0  # logarithm of a growth that no drift shows
MOST_PARTS = 4096  # times a period that the frame may have to be made orthonormal


@dataclass(frozen=True, eq=False)
class Growth:
    """How disturbances of one motion grow.

    Parameters
    ----------
    growth
        Logarithm of the growth in each forcing period, (P, 2 N), the leading direction first.
    contact_share
        Share of the time for which each spring carried a force, (m,).
    first, recent
        State at the beginning, (2 N,), and those after the last periods, (up to 64, 2 N).
    omega
        Frequency in rad/s.
    """

    growth: Real
    contact_share: Real
    first: Real
    recent: Real
    omega: float

    @property
    def batches(self) -> Real:
        """Mean rates of growth in 1/s over each batch of periods, (32, 2 N)."""
        turn = 2.0 * np.pi / self.omega
        return np.array([part.mean(axis=0) / turn for part in np.array_split(self.growth, BATCHES)])

    @property
    def exponents(self) -> Real:
        """Mean rates of growth in 1/s, (2 N,)."""
        return np.asarray(self.growth.mean(axis=0) * self.omega / (2.0 * np.pi))

    @property
    def standard_error(self) -> Real:
        """Standard errors of the exponents in 1/s, by batch means, (2 N,)."""
        return np.asarray(self.batches.std(axis=0, ddof=1) / np.sqrt(BATCHES))

    def word(self, settling: Settling) -> Word:
        """What the motion is."""
        if settling.repeats_after(self.recent, self.omega) is not None:
            return PERIODIC
        largest, error = self.exponents[0], CERTAIN * self.standard_error[0]
        bounded = self._within_bounds()
        if largest > error and not bounded:
            return UNDECIDED if self._drifts(settling) else CHAOTIC
        near = settling.approached(self.recent, self.omega)
        # Growth seems to stay within bounds, too, where a periodic motion is come to slowly.
        if bounded and near is None:
            return QUASI_PERIODIC
        if largest < -error or (near is not None and self._comes_closer(settling, near)):
            return PERIODIC
        return UNDECIDED

    def _comes_closer(self, settling: Settling, near: Point) -> bool:
        """Whether the way to a periodic motion has at least halved."""
        first, last = (settling.distance_from(near, z) for z in (self.first, self.recent[-1]))
        return last < 0.5 * first

    def _drifts(self, settling: Settling) -> bool:
        """Whether disturbances grow no more than the motion's own steps over some turns do.

        They do as these where an unstable periodic motion is left, where one has just ceased to
        exist at a fold, and where a motion grows beyond all bounds. What comes of it is not seen.
        """
        first, last = (settling.steps_from(z, self.omega) for z in (self.first, self.recent[-1]))
        if not first.size == last.size > 0:
            return False
        growth = min(float(self.growth[:, 0].sum()), MOST_GROWTH)
        return bool((last >= first * (math.exp(growth) / DRIFT)).any())

    def _within_bounds(self) -> bool:
        """Whether the leading growth keeps within the bounds that a short stretch of it shows."""
        total = np.cumsum(self.growth[:, 0])
        ranges = [np.ptp(part) for part in np.array_split(total, STRETCHES)]
        return bool(np.ptp(total) <= WITHIN_BOUNDS * np.mean(ranges))


def grown(
    solver: ExactSolver, z: Real, omega: float, periods: int, skip: int, monitor: Monitor
) -> Growth:
    """Follow disturbances of the motion from z over forcing periods, after ``skip`` of them.

    Raises
    ------
    IncompleteError
        When the flow over a turn does not end, or disturbances die out too fast to be told apart.
    """
    frame = _Frame(solver, z, omega)
    sizes = [part.size for part in np.array_split(np.arange(periods), BATCHES)]
    if skip:
        for part in np.array_split(np.arange(skip), BATCHES):
            frame.carry(part.size)
            monitor("transient", 0.0)
    first = frame.z.copy()
    frame.touched[:] = 0.0
    batches = []
    for k, size in enumerate(sizes, 1):
        batches.append(frame.carry(size))
        monitor(f"{sum(sizes[:k])} forcing periods of {periods}", k / BATCHES)
    duration = periods * 2.0 * np.pi / omega
    return Growth(np.concatenate(batches), frame.touched / duration, first, frame.recent, omega)


def with_word(settling: Settling, row: Settled, omega: float) -> Settled:
    """A row with the word for its motion; only one that has not settled costs time."""
    if row.settled:
        return replace(row, word=PERIODIC)
    try:
        found = grown(settling.solver, row.state, omega, PERIODS, ALIGNING, lambda *_: None)
    except IncompleteError:
        return row
    return replace(row, word=found.word(settling))


def generic_frame(size: int, omega: float) -> Real:
    """An orthonormal frame of displacements and velocities over omega, (2 N, 2 N), with no zeros.

    Displacements alone excite every mode in one phase, and would not turn out of it.
    """
    generic = np.linalg.qr(np.random.default_rng(0).normal(size=(size, size)))[0]
    return np.asarray(np.repeat([1.0, omega], size // 2)[:, None] * generic)


class _Frame:
    """A state and its frame of disturbances, carried on batch by batch."""

    def __init__(self, solver: ExactSolver, z: Real, omega: float) -> None:
        size = z.size
        self.solver, self.omega, self.parts = solver, omega, 1
        self.z = np.array(z, float)
        self.frame = generic_frame(size, omega)
        self.touched = np.zeros(len(solver.springs))
        self.recent = self.z[None].copy()

    def _grown(self, z: Real, frame: Real, growth: Real, states: Real, touched: Real) -> int:
        """The kernel's status; it carries z and the frame over the periods of ``growth``."""
        work = self.solver.shooting_work
        return interruptible(
            lambda: grow(
                self.solver.machine, work, self.omega, self.parts, z, frame, growth, states,
                touched,
            ),
            work.flow.stop,
            work=self.parts * growth.shape[0] * z.size**2,
        )  # fmt: skip

    def carry(self, periods: int) -> Real:
        """Growth in each of some periods, (P, 2 N)."""
        growth, states = np.empty((2, periods, self.z.size))
        while True:
            z, frame, touched = self.z.copy(), self.frame.copy(), self.touched.copy()
            code = self._grown(z, frame, growth, states, touched)
            if code != status.SINGULAR or self.parts >= MOST_PARTS:
                break
            self.parts *= 2
        if code == status.SINGULAR:
            raise IncompleteError(
                f"disturbances of the motion at {self.omega:.6g} rad/s die out too fast, or too "
                "differently, within a forcing period to be told apart; give less damping"
            )
        if code != status.OK:
            raise IncompleteError(f"the flow over one turn at {self.omega:.6g} rad/s did not end")
        self.z, self.frame, self.touched = z, frame, touched
        self.recent = np.concatenate([self.recent, states])[-RECENT:]
        return growth
