"""A periodic motion as a function of time: in closed form, piece by piece, or as a series."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow.dynamics.flow import Flow
from flipflow.dynamics.plan import Plan
from flipflow.errors import InputError
from flipflow.model.arguments import checked_count, checked_numbers
from flipflow.model.system import MechanicalSystem

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
TIMES = "give finite times in s"
MOST_SAMPLES = 10_000_000


@dataclass(frozen=True)
class ContactInterval:
    """One touch of a stop: spring, side (+1 or -1), start and end in s within the turn.

    ``end`` may exceed the period when the touch lasts through the start of the turn.
    """

    spring: int
    side: int
    start: float
    end: float


@dataclass(frozen=True, eq=False)
class Pieces:
    """The contact record of one turn: E pieces in which no contact changes."""

    slot: NDArray[np.int64]  # (E,) configuration
    start: Real  # (E,) s
    length: Real  # (E,) s
    modes: Complex  # (E, R) modal amplitudes at the start; empty for a series
    states: NDArray[np.int64]  # (E, m) contact state of each spring

    @classmethod
    def recorded(cls, flow: Flow, modes: Complex) -> Self:
        """Copy of what the kernels left in their record."""
        e = int(flow.segments[0])
        return cls(
            flow.slot[:e].copy(),
            flow.start[:e].copy(),
            flow.length[:e].copy(),
            modes[:e].copy(),
            flow.states[:e].copy(),
        )


@dataclass(frozen=True, eq=False)
class Motion(ABC):
    """A motion of period ``period`` under forcing at ``omega``; arrays over time are (..., N)."""

    system: MechanicalSystem
    omega: float
    period: float
    pieces: Pieces

    @abstractmethod
    def derivative(self, t: ArrayLike, order: int) -> Real:
        """x, x' or x'' (order 0, 1, 2) at times t, shape (..., N)."""

    def piece(self, t: ArrayLike) -> NDArray[np.intp]:
        """Index of the piece in which each time lies."""
        inside = np.mod(checked_numbers("t", t, TIMES), self.period)
        after = np.searchsorted(self.pieces.start, inside, side="right")
        return np.asarray(np.maximum(after - 1, 0))

    def samples(self, least: int = 256) -> tuple[Real, NDArray[np.intp]]:
        """Times and pieces of a grid that holds both ends of every piece, (K,) each.

        Where a contact changes, the same time stands twice, once for each piece.
        """
        checked_count("least", least, MOST_SAMPLES)
        times, owner = [], []
        for e, (start, length) in enumerate(
            zip(self.pieces.start, self.pieces.length, strict=True)
        ):
            count = 5 + int(np.ceil(least * length / self.period))
            times.append(start + length * np.linspace(0.0, 1.0, count))
            owner.append(np.full(count, e))
        return np.concatenate(times), np.concatenate(owner)

    @abstractmethod
    def piece_derivative(self, t: Real, piece: NDArray[np.intp], order: int) -> Real:
        """x, x' or x'' at times t taken from the given pieces, (K, N)."""

    def _checked_pieces(self, t: object, piece: object) -> tuple[Real, NDArray[np.intp]]:
        """Times in one row, and as many indices of pieces."""
        remedy = "give the index of a piece for each time"
        times, given = checked_numbers("t", t, TIMES), checked_numbers("piece", piece, remedy)
        known = (given >= 0) & (given < self.pieces.start.size) & (given == np.floor(given))
        if times.ndim != 1 or given.shape != times.shape or not known.all():
            raise InputError("piece", piece, remedy)
        return times, given.astype(np.intp)

    def contact_intervals(self) -> tuple[ContactInterval, ...]:
        """Every touch of every stop within the turn, in the order of their starts."""
        found: list[ContactInterval] = []
        # Where a piece ends the next one starts, to the last digit: touches are joined by it.
        last = self.pieces.start[-1:] + self.pieces.length[-1:]
        ends = np.concatenate([self.pieces.start[1:], last])
        for j in range(self.pieces.states.shape[1]):
            engaged = np.where(np.abs(self.pieces.states[:, j]) == 1, self.pieces.states[:, j], 0)
            found += _joined(j, engaged, self.pieces.start, ends, self.period)
        return tuple(sorted(found, key=lambda interval: interval.start))


@dataclass(frozen=True, eq=False)
class PiecewiseMotion(Motion):
    """Closed form within each piece of the exact flow."""

    plan: Plan
    drive: Complex  # (S, 2 N)

    def derivative(self, t: ArrayLike, order: int) -> Real:
        times = np.mod(checked_numbers("t", t, TIMES), self.period)
        flat = self.piece_derivative(times.ravel(), self.piece(times).ravel(), order)
        return flat.reshape(*times.shape, self.system.size)

    def piece_derivative(self, t: Real, piece: NDArray[np.intp], order: int) -> Real:
        t, piece = self._checked_pieces(t, piece)
        order = checked_count("order", order, 2, least=0)
        n = self.system.size
        slot = self.pieces.slot[piece]
        turn = np.exp(1j * self.omega * t) * (1j * self.omega) ** order
        x = (self.drive[slot, :n] * turn[:, None]).real
        if order == 0:
            x = x + self.plan.rest[slot, :n]
        rate = self.plan.rate[slot]
        elapsed = (t - self.pieces.start[piece])[:, None]
        term = self.plan.weight[slot] * self.pieces.modes[piece] * np.exp(rate * elapsed)
        x += np.einsum("knr,kr->kn", self.plan.right[slot, :n], term * rate**order).real
        return np.asarray(x, dtype=float)


@dataclass(frozen=True, eq=False)
class SeriesMotion(Motion):
    """A truncated Fourier series: Re sum_h X_h exp(i h omega t)."""

    harmonics: NDArray[np.int64]
    series: Complex  # (n_h, N)

    def derivative(self, t: ArrayLike, order: int) -> Real:
        times = checked_numbers("t", t, TIMES)
        order = checked_count("order", order, 2, least=0)
        rate = 1j * self.omega * self.harmonics
        turn = np.exp(rate * times[..., None]) * rate**order
        return np.asarray((turn @ self.series).real, dtype=float)

    def piece_derivative(self, t: Real, piece: NDArray[np.intp], order: int) -> Real:
        return self.derivative(self._checked_pieces(t, piece)[0], order)


def _joined(
    spring: int, engaged: NDArray[np.int64], start: Real, end: Real, period: float
) -> list[ContactInterval]:
    """Neighbouring engaged pieces as one touch, also across the end of the turn."""
    touches: list[ContactInterval] = []
    for side, a, b in zip(engaged, start, end, strict=True):
        if side == 0:
            continue
        last = touches[-1] if touches else None
        if last is not None and last.side == side and last.end == a:
            touches[-1] = ContactInterval(spring, int(side), last.start, b)
        else:
            touches.append(ContactInterval(spring, int(side), a, b))
    if len(touches) > 1 and touches[0].start == 0.0 and touches[0].side == touches[-1].side:
        first, last = touches[0], touches[-1]
        if np.isclose(last.end, period, rtol=1e-12, atol=0.0):
            touches[-1] = ContactInterval(spring, last.side, last.start, period + first.end)
            touches.pop(0)
    return touches
