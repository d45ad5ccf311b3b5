"""A periodic motion as a function of time: sums of exponentials and harmonics, piece by piece."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.dynamics.contact_search import new_gap_motion, observe_motion
from flipflow.dynamics.flow import Flow
from flipflow.dynamics.pieces import evaluate_pieces, longest_in_pieces
from flipflow.errors import InputError
from flipflow.model.arguments import checked_count, checked_numbers
from flipflow.model.contact_law import engaged_side
from flipflow.model.system import MechanicalSystem

TIMES = "give finite times in s"
ROUNDING = 1e-10  # share of the amplitude up to which a first harmonic is none
MOST_SAMPLES = 10_000_000  # times in a grid over one period
GAUSS_POINTS = 24  # nodes on each part of a piece
RADIANS = 4.0  # of its fastest term, at most, in a part of a piece


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
class Motion:
    r"""A motion of period ``period`` under forcing at ``omega``, in closed form.

    In piece e, from ``start[e]`` on,

    .. math:: x(t) = o_e + b_e (t - t_e) + \mathrm{Re} \sum_h X_{eh} e^{i n_h \omega t}
              + \mathrm{Re} \sum_i a_{ei} e^{\lambda_{ei} (t - t_e)}.

    A truncated Fourier series has no exponentials, and the same harmonics in every piece.

    Parameters
    ----------
    system
        The machine, N degrees of freedom, m springs that open and close.
    omega, period
        In rad/s and s.
    start, length
        Of the pieces in s, (E,).
    regime
        Regime of each spring during a piece, (E, m): 0 open, else piece and side of its law.
    offset, drift
        o and b, (E, N) each.
    amplitude, rate
        a and lambda, (E, N, R), (E, R).
    harmonic, order
        X and n, (E, N, H), (H,).
    """

    system: MechanicalSystem
    omega: float
    period: float
    start: Real
    length: Real
    regime: Int
    offset: Real
    drift: Real
    amplitude: Complex
    rate: Complex
    harmonic: Complex
    order: Real

    def derivative(self, t: ArrayLike, order: int) -> Real:
        """x, x' or x'' (order 0, 1, 2) at times t, shape (..., N)."""
        times = np.mod(checked_numbers("t", t, TIMES), self.period)
        flat = self.piece_derivative(times.ravel(), self.piece(times).ravel(), order)
        return flat.reshape(*times.shape, self.system.size)

    def piece(self, t: ArrayLike) -> NDArray[np.intp]:
        """Index of the piece in which each time lies."""
        inside = np.mod(checked_numbers("t", t, TIMES), self.period)
        after = np.searchsorted(self.start, inside, side="right")
        return np.asarray(np.maximum(after - 1, 0))

    def piece_derivative(self, t: Real, piece: NDArray[np.intp], order: int) -> Real:
        """x, x' or x'' at times t taken from the given pieces, (K, N)."""
        t, piece = self._checked_pieces(t, piece)
        order = checked_count("order", order, 2, least=0)
        return states_on(self, t, piece)[order]

    def samples(self, least: int = 256) -> tuple[Real, NDArray[np.intp]]:
        """Times and pieces of a grid that holds both ends of every piece, (K,) each.

        Where a contact changes, the same time stands twice, once for each piece.
        """
        checked_count("least", least, MOST_SAMPLES)
        times, owner = [], []
        for e, (start, length) in enumerate(zip(self.start, self.length, strict=True)):
            count = 5 + int(np.ceil(least * length / self.period))
            times.append(start + length * np.linspace(0.0, 1.0, count))
            owner.append(np.full(count, e))
        return np.concatenate(times), np.concatenate(owner)

    def extremes(self, coordinates: Real) -> tuple[Real, Real, Complex]:
        """Least and greatest value and first harmonic, (G,) each, of coordinates (G, N)."""
        remedy = f"give vectors of {self.system.size} finite numbers, one a row"
        seen = np.ascontiguousarray(checked_numbers("coordinates", coordinates, remedy))
        if seen.ndim != 2 or seen.shape[1] != self.system.size:
            raise InputError("coordinates", coordinates, remedy)
        rates = self.rate.shape[1] + self.order.size
        scratch = new_gap_motion(seen.shape[0], np.zeros(rates, np.complex128))
        low, high = np.full(seen.shape[0], np.inf), np.full(seen.shape[0], -np.inf)
        first = np.zeros(seen.shape[0], np.complex128)
        amplitude, harmonic = (
            np.ascontiguousarray(np.einsum("gn,enr->ger", seen, part))
            for part in (self.amplitude, self.harmonic)
        )
        observe_motion(
            self.start, self.length, seen @ self.offset.T, seen @ self.drift.T, amplitude,
            self.rate, harmonic, self.order, self.omega, scratch, low, high, first,
        )  # fmt: skip
        return low, high, first * (2.0 / self.period)

    def _checked_pieces(self, t: object, piece: object) -> tuple[Real, NDArray[np.intp]]:
        """Times in one row, and as many indices of pieces."""
        remedy = "give the index of a piece for each time"
        times, given = checked_numbers("t", t, TIMES), checked_numbers("piece", piece, remedy)
        known = (given >= 0) & (given < self.start.size) & (given == np.floor(given))
        if times.ndim != 1 or given.shape != times.shape or not known.all():
            raise InputError("piece", piece, remedy)
        # A read-only or a strided array is another type to the compiler.
        return np.array(times), given.astype(np.intp)

    def contact_intervals(self) -> tuple[ContactInterval, ...]:
        """Every touch of every stop within the turn, in the order of their starts."""
        found: list[ContactInterval] = []
        # A piece ends where the next one starts, to the last digit: so touches can be joined.
        ends = np.concatenate([self.start[1:], self.start[-1:] + self.length[-1:]])
        for j, spring in enumerate(self.system.springs):
            side = engaged_side(spring.law, self.regime[:, j])
            found += _joined(j, side, self.start, ends, self.period)
        return tuple(sorted(found, key=lambda interval: interval.start))


def _parts(length: float, fastest: float, steepest: float) -> list[tuple[float, float]]:
    """Begin and end of the parts of a piece, each counted from its start."""
    count = 1 + int(fastest * length / RADIANS)
    limits = [length * k / count for k in range(1, count + 1)]
    while limits[0] * steepest > 1.0:
        limits.insert(0, 0.5 * limits[0])
    return list(pairwise([0.0, *limits]))


@functools.cache
def _gauss_rule() -> tuple[Real, Real]:
    """Nodes and weights on (0, 1)."""
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    return (nodes + 1.0) / 2.0, weights / 2.0


def states_on(motion: Motion, t: Real, piece: NDArray[np.intp]) -> Real:
    """x, x' and x'' at times t (K,) taken from the given pieces, (3, K, N)."""
    states = np.empty((3, t.size, motion.system.size))
    rate, harmonic, order = _waves(motion)
    evaluate_pieces(
        motion.start, motion.offset, motion.drift, motion.amplitude, rate, harmonic, order,
        motion.omega, t, piece, states,
    )  # fmt: skip
    return states


def nodes_on(motion: Motion) -> tuple[Real, NDArray[np.intp], Real]:
    """Times, pieces and weights (K,) of a mean over the period, by Gauss' rule on parts.

    What decays at once, as behind a heavily damped contact, lies at the very start of a piece:
    its first part is halved towards it.
    """
    nodes, weights = _gauss_rule()
    fastest = np.abs(motion.rate.imag).max(
        axis=1, initial=motion.omega * motion.order.max(initial=1.0)
    )
    steepest = np.abs(motion.rate.real).max(axis=1, initial=0.0)
    limits = [
        _parts(*piece)
        for piece in zip(motion.length.tolist(), fastest.tolist(), steepest.tolist(), strict=True)
    ]
    piece = np.repeat(np.arange(motion.start.size), [len(one) for one in limits])
    begin, end = np.array([part for one in limits for part in one]).T
    times = (motion.start[piece] + begin)[:, None] + (end - begin)[:, None] * nodes
    share = (end - begin)[:, None] * (weights / motion.period)
    return times.ravel(), np.repeat(piece, nodes.size), share.ravel()


def longest_on(
    motion: Motion,
    linear: Real,
    constant: Real | float,
    along: complex = 0j,
    across: complex = 0j,
) -> float:
    """Greatest length over the period of a vector of :mod:`~flipflow.dynamics.pieces`.

    c_0, c_1, c_2 (3, N) or, of every piece, (E, 3, N); b one number or (E,).
    """
    pieces, size = motion.start.size, motion.system.size
    weights, beside = np.empty((pieces, 3, size)), np.empty(pieces)
    weights[:], beside[:] = linear, constant
    rate, harmonic, order = _waves(motion)
    scratch = new_gap_motion(2, np.zeros(rate.shape[1] + order.size + 1, np.complex128))
    return longest_in_pieces(
        motion.start, motion.length, motion.offset, motion.drift, motion.amplitude, rate, harmonic,
        order, motion.omega, weights, beside, along, across, scratch,
    )  # fmt: skip


def _waves(motion: Motion) -> tuple[Complex, Complex, Real]:
    """Rates, harmonics, orders, each in one block."""
    return (
        np.ascontiguousarray(motion.rate),
        np.ascontiguousarray(motion.harmonic),
        np.ascontiguousarray(motion.order),
    )


def motion_of_flow(system: MechanicalSystem, flow: Flow, omega: float, period: float) -> Motion:
    """The motion that the exact flow has recorded."""
    e, n = int(flow.segments[0]), system.size
    slot, modes = flow.slot[:e], flow.modes
    shape = modes.weight[slot][:, None, :] * modes.right[slot, :n]
    return Motion(
        system=system,
        omega=omega,
        period=period,
        start=flow.start[:e].copy(),
        length=flow.length[:e].copy(),
        regime=flow.regimes[:e].copy(),
        offset=flow.rest[:e].copy(),
        drift=modes.drift[slot],
        amplitude=shape * flow.q[:e, None, :],
        rate=modes.rate[slot],
        harmonic=flow.drive[slot, :, :n].swapaxes(1, 2),
        order=np.array(system.orders, float),
    )


def motion_of_series(
    system: MechanicalSystem,
    flow: Flow,
    omega: float,
    order: Int,
    series: Complex,
) -> Motion:
    """A Fourier series (n_h, N) with the contacts that were recorded along it."""
    e, n = int(flow.segments[0]), system.size
    return Motion(
        system=system,
        omega=omega,
        period=2.0 * np.pi / omega,
        start=flow.start[:e].copy(),
        length=flow.length[:e].copy(),
        regime=flow.regimes[:e].copy(),
        offset=np.zeros((e, n)),
        drift=np.zeros((e, n)),
        amplitude=np.zeros((e, n, 0), np.complex128),
        rate=np.zeros((e, 0), np.complex128),
        harmonic=np.repeat(series.T[None], e, axis=0),
        order=order.astype(float),
    )


def _joined(
    spring: int, engaged: Int, start: Real, end: Real, period: float
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


def phase_of(first: Complex, amplitude: Real) -> Real:
    """Phases in rad of first harmonics of motions of given amplitudes; NaN where there is none."""
    return np.where(np.abs(first) > ROUNDING * amplitude, np.angle(first), np.nan)
