"""Periodic motions by harmonic balance, exact at the contact."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flipflow.compiled import status
from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.interruptible import interruptible
from flipflow.dynamics.contact_search import new_gap_motion
from flipflow.dynamics.flow import Flow
from flipflow.dynamics.motion import Motion, motion_of_series
from flipflow.errors import InputError
from flipflow.model.system import MechanicalSystem
from flipflow.periodic.readings import describe_balance, describe_sampled, observe_series
from flipflow.periodic.sampled import Sampled, SampledWork, new_sampled, new_sampled_work
from flipflow.periodic.series import Balance, BalanceWork, new_balance, new_balance_work
from flipflow.periodic.solver import Solver


class BalanceSolver(Solver):
    """Unknowns: the Fourier coefficients of the motion at the gaps.

    With ``confirmed`` a special point of the series that no exact motion shows becomes a note.
    """

    reads_jacobian = False

    @property
    def uneven(self) -> Real:
        """A series cannot tell whether it is its own mirror image: no branch counts as even."""
        return np.ones(len(self.springs))

    confirmed = True

    def __init__(
        self, system: MechanicalSystem, harmonics: int, *, half_turn: bool, turns: int = 1
    ) -> None:
        super().__init__(system, half_turn=half_turn, turns=turns)
        if harmonics < system.orders[-1]:
            remedy = f"the machine is excited at {system.orders[-1]} omega; give as many harmonics"
            raise InputError("harmonics", harmonics, remedy)
        if np.linalg.matrix_rank(system.K) < system.size:
            remedy = "with a singular K the mean has no series: give PiecewiseExact()"
            raise InputError("method", "harmonic balance", remedy)
        self.order = harmonics
        self.balance = new_balance(self.machine, harmonics, half_turn=half_turn, length=self.length)
        self.balance_work = new_balance_work(self.balance)
        self.problem: Balance | Sampled = self.balance
        self.scratch: BalanceWork | SampledWork = self.balance_work
        self.harmonics = self.balance.harmonics
        kept = int(2 * np.count_nonzero(self.harmonics) + np.count_nonzero(self.harmonics == 0))
        self.unknowns = kept * len(self.springs)
        empty = np.zeros(0)
        self._last = empty, empty, empty.astype(np.complex128)
        self._last_maps = empty, empty, (empty, empty)

    @property
    def options(self) -> tuple[float, ...]:
        return (self.order,)

    @property
    def flow(self) -> Flow:
        return self.balance_work.flow

    def _describe(self, u: Real, omega: Real) -> Complex:
        """Displacement harmonics (P, n_h, N).

        The last answer is kept: amplitudes and multipliers of the same points are asked for
        one after the other.
        """
        kept_u, kept_omega, series = self._last
        if not (np.array_equal(kept_u, u) and np.array_equal(kept_omega, omega)):
            # A read-only array is another type to the compiler, and would be compiled for anew.
            series = self._read_off(np.array(u), np.array(omega))
            self._last = u.copy(), omega.copy(), series
        return series

    def _read_off(self, u: Real, omega: Real, *, whole_turn: bool = False) -> Complex:
        """Displacement harmonics (P, n_h, N); the last point's contacts stay recorded."""
        series = np.empty((omega.size, self.harmonics.size, self.system.size), np.complex128)
        code = np.zeros(omega.size, np.int64)
        walk = 2.0 * np.pi if whole_turn else self.balance.walk
        problem = self.balance._replace(walk=walk)
        interruptible(
            lambda: describe_balance(problem, self.balance_work, u, omega, series, code),
            work=series.size * self.system.size,
        )
        series[code != status.OK] = np.nan
        return series

    def return_maps(self, u: Real, omega: Real, jacobian: Real) -> Real:  # noqa: ARG002
        """Maps of the exact flow beside the series.

        A truncated series blurs the instants of contact. With a stiff stop the multipliers depend
        on these instants far more than the amplitudes do.
        """
        return self.corrected_maps(u, omega)[0]

    def corrected_maps(self, u: Real, omega: Real) -> tuple[Real, Real]:
        """Maps (P, 2 N, 2 N) of the exact flow beside the series, and its distance (P,) in m.

        The distance is infinite where no exact motion is near. The last answer is kept, because
        the multipliers of a branch and the check of its folds need the same maps.
        """
        kept_u, kept_omega, maps = self._last_maps
        if not (np.array_equal(kept_u, u) and np.array_equal(kept_omega, omega)):
            states, size = self.states(u, omega), self.system.size
            nothing = np.zeros(0, np.int64), np.zeros((omega.size, 0, size), np.complex128)
            maps = self.corrected(states, omega, *nothing, half_turn=self.half_turn)
            self._last_maps = u.copy(), omega.copy(), maps
        return maps

    def series(self, u: Real, omega: Real) -> tuple[Int, Complex]:
        return self.harmonics, self._describe(u, omega)

    def states(self, u: Real, omega: Real) -> Real:
        return _states(self.series(u, omega)[1], self.harmonics, omega)

    def extremes(self, u: Real, omega: Real, coordinates: Real) -> tuple[Real, Real, Complex]:
        _, series = self.series(u, omega)
        return self._extremes(np.einsum("gn,phn->pgh", coordinates, series))

    def gap_extremes(self, u: Real, omega: Real) -> tuple[Real, Real]:  # noqa: ARG002
        means = int(self.harmonics[0] == 0) * len(self.springs)
        pairs = u[:, means:].reshape(u.shape[0], -1, len(self.springs), 2)
        moving = (pairs[..., 0] + 1j * pairs[..., 1]).transpose(0, 2, 1)
        seen = np.concatenate([u[:, :means, None], moving], axis=2) if means else moving
        low, high, _ = self._extremes(seen)
        return low, high

    def _extremes(self, seen: Complex) -> tuple[Real, Real, Complex]:
        """Least and greatest value and first harmonic (P, G) of series (P, G, n_h)."""
        moving = self.harmonics > 0
        rate = 1j * self.harmonics[moving].astype(np.complex128)
        scratch = new_gap_motion(1, rate, spacing=int(self.balance_work.motion.spacing[0]))
        offset = np.ascontiguousarray(seen[:, :, ~moving].real.sum(axis=2))
        low, high = np.empty(offset.shape), np.empty(offset.shape)
        amplitudes = np.ascontiguousarray(seen[:, :, moving])
        interruptible(
            lambda: observe_series(scratch, offset, amplitudes, low, high), work=amplitudes.size
        )
        return low, high, seen[:, :, self.harmonics == 1][:, :, 0]

    def motion(self, u: Real, omega: float) -> Motion:
        series = self._read_off(u[None], np.array([omega]), whole_turn=True)
        return motion_of_series(self.system, self.flow, omega, self.harmonics, series[0])

    def unknowns_of(self, orders: Sequence[int], mean: Real, X: Complex) -> Real:
        """Unknowns of a motion of mean (N,) and harmonics (W, N) at multiples of omega."""
        D = self.machine.direction
        m, means = D.shape[0], int(self.harmonics[0] == 0)
        u = np.zeros(self.unknowns)
        u[: means * m] = (D @ mean)[: means * m]
        for order, amplitude in zip(orders, X @ D.T, strict=True):
            place = int(np.flatnonzero(self.harmonics == order)[0])
            begin = means * m + 2 * m * (place - means)
            u[begin : begin + 2 * m] = np.stack([amplitude.real, amplitude.imag], axis=1).ravel()
        return u

    def unknowns_from(self, motion: Motion) -> Real:
        count = 16 * (self.order + 1)
        t = motion.period * np.arange(count) / count
        directions = np.array([spring.direction for spring in self.springs])
        spectrum = np.fft.rfft(motion.derivative(t, 0) @ directions.T, axis=0) / count
        parts = []
        for h in self.harmonics:
            parts += [spectrum[h].real] if h == 0 else []
            if h > 0:
                pairs = 2.0 * np.stack([spectrum[h].real, spectrum[h].imag], axis=1)
                parts += [pairs.ravel()]
        return np.concatenate(parts)


class SampledSolver(BalanceSolver):
    """The same unknowns, with the smooth contact law sampled at fixed times.

    What is read off a motion besides its displacements is exact: the contacts of its series, and
    the return maps of the exact flow beside it. False special points are kept: to show them is
    what this solver is for.
    """

    confirmed = False

    def __init__(
        self,
        system: MechanicalSystem,
        harmonics: int,
        samples: int,
        sharpness: float,
        *,
        half_turn: bool,
        turns: int = 1,
    ) -> None:
        super().__init__(system, harmonics, half_turn=half_turn, turns=turns)
        self.samples, self.sharpness = samples, sharpness
        self.problem = self.sampled = new_sampled(self.balance, samples, sharpness)
        self.scratch = self.sampled_work = new_sampled_work(self.balance_work)

    @property
    def options(self) -> tuple[float, ...]:
        return (self.order, self.samples, self.sharpness)

    def _read_off(self, u: Real, omega: Real, *, whole_turn: bool = False) -> Complex:
        series = super()._read_off(u, omega, whole_turn=whole_turn)
        interruptible(
            lambda: describe_sampled(self.sampled, self.sampled_work, u, omega, series),
            work=series.size * self.system.size,
        )
        return series


def _states(series: Complex, harmonics: Int, omega: Real) -> Real:
    """State (x, x') of series (P, n_h, N) at t = 0, (P, 2 N)."""
    rate = 1j * omega[:, None] * harmonics
    position, velocity = series.sum(axis=1), np.einsum("ph,phn->pn", rate, series)
    return np.concatenate([position.real, velocity.real], axis=1)
