"""Periodic motions by harmonic balance, exact at the contact."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled import status
from flipflow.dynamics.flow import Flow
from flipflow.dynamics.motion import Motion, Pieces, SeriesMotion
from flipflow.model.system import MechanicalSystem
from flipflow.periodic.observe import describe_balance, describe_sampled, observe_series
from flipflow.periodic.sampled import Sampled
from flipflow.periodic.scratch import new_balance, new_gap_motion, new_sampled
from flipflow.periodic.series import Balance
from flipflow.periodic.solver import Complex, Real, Solver


class BalanceSolver(Solver):
    """Unknowns: the Fourier coefficients of the motion at the gaps.

    ``confirmed``: special points that no exact motion shows are notes, not special points.
    """

    reads_jacobian = False
    confirmed = True

    def __init__(self, system: MechanicalSystem, harmonics: int, *, half_turn: bool) -> None:
        self.order = harmonics
        super().__init__(system, half_turn=half_turn)

    def _prepare(self) -> None:
        self.balance = new_balance(
            self.builder.plan, self.order, half_turn=self.half_turn, length=self.length
        )
        self.problem = self._formulated()
        self.harmonics = self.balance.harmonics
        kept = int(2 * np.count_nonzero(self.harmonics) + np.count_nonzero(self.harmonics == 0))
        self.unknowns = kept * len(self.builder.springs)
        self._new_work()
        empty = np.zeros(0)
        self._last = empty, empty, empty.astype(np.complex128)
        self._last_maps = empty, empty, (empty, empty)

    def _formulated(self) -> Balance | Sampled:
        """The equations that are solved, over the present balance."""
        return self.balance

    @property
    def flow(self) -> Flow:
        return self.balance.flow

    def _describe(self, u: Real, omega: Real) -> Complex:
        """Displacement harmonics (P, n_h, N).

        The last answer is kept: amplitudes and multipliers of the same points are asked for
        one after the other.
        """
        kept_u, kept_omega, series = self._last
        if not (np.array_equal(kept_u, u) and np.array_equal(kept_omega, omega)):
            series = self._read_off(np.ascontiguousarray(u), omega)
            self._last = u.copy(), omega.copy(), series
        return series

    def _read_off(self, u: Real, omega: Real, *, whole_turn: bool = False) -> Complex:
        """Displacement harmonics (P, n_h, N); the last point's contacts stay recorded."""
        series = np.empty((omega.size, self.harmonics.size, self.system.size), np.complex128)
        code = np.zeros(omega.size, np.int64)
        while True:
            walk = 2.0 * np.pi if whole_turn else self.balance.walk
            describe_balance(self.balance._replace(walk=walk), u, omega, series, code)
            if not np.any(code == status.MISSING_CONFIGURATION):
                break
            self.add_missing_configuration()
        series[code != status.OK] = np.nan
        return series

    def return_maps(self, u: Real, omega: Real, jacobian: Real) -> Real:  # noqa: ARG002
        """Maps of the exact flow beside the series.

        A truncated series blurs the instants of contact, to which the multipliers of a stiff
        stop are far more sensitive than its amplitudes are.
        """
        return self.corrected_maps(u, omega)[0]

    def corrected_maps(self, u: Real, omega: Real) -> tuple[Real, Real]:
        """Maps (P, 2 N, 2 N) of the exact flow beside the series, and its distance (P,) in m.

        The distance is infinite where no exact motion is near. The last answer is kept: those
        that make up the multipliers of a branch also tell which of its folds are the machine's.
        """
        kept_u, kept_omega, maps = self._last_maps
        if not (np.array_equal(kept_u, u) and np.array_equal(kept_omega, omega)):
            states, size = self.states(u, omega), self.system.size
            nothing = np.zeros(0, np.int64), np.zeros((omega.size, 0, size), np.complex128)
            maps = self.corrected(states, omega, *nothing, half_turn=self.half_turn)
            self._last_maps = u.copy(), omega.copy(), maps
        return maps

    def series(self, u: Real, omega: Real) -> tuple[NDArray[np.int64], Complex]:
        return self.harmonics, self._describe(u, omega)

    def states(self, u: Real, omega: Real) -> Real:
        return _states(self.series(u, omega)[1], self.harmonics, omega)

    def extremes(self, u: Real, omega: Real, coordinates: Real) -> tuple[Real, Real, Complex]:
        _, series = self.series(u, omega)
        return self._extremes(np.einsum("gn,phn->pgh", coordinates, series))

    def gap_extremes(self, u: Real, omega: Real) -> tuple[Real, Real]:  # noqa: ARG002
        means = int(self.harmonics[0] == 0) * len(self.builder.springs)
        pairs = u[:, means:].reshape(u.shape[0], -1, len(self.builder.springs), 2)
        moving = (pairs[..., 0] + 1j * pairs[..., 1]).transpose(0, 2, 1)
        seen = np.concatenate([u[:, :means, None], moving], axis=2) if means else moving
        low, high, _ = self._extremes(seen)
        return low, high

    def _extremes(self, seen: Complex) -> tuple[Real, Real, Complex]:
        """Least and greatest value and first harmonic (P, G) of series (P, G, n_h)."""
        moving = self.harmonics > 0
        rate = 1j * self.harmonics[moving].astype(np.complex128)
        scratch = new_gap_motion(1, rate, spacing=int(self.balance.motion.spacing[0]))
        offset = np.ascontiguousarray(seen[:, :, ~moving].real.sum(axis=2))
        low, high = np.empty(offset.shape), np.empty(offset.shape)
        observe_series(scratch, offset, np.ascontiguousarray(seen[:, :, moving]), low, high)
        return low, high, seen[:, :, self.harmonics == 1][:, :, 0]

    def motion(self, u: Real, omega: float) -> Motion:
        series = self._read_off(u[None], np.array([omega]), whole_turn=True)
        flow = self.flow
        pieces = Pieces.recorded(flow, np.zeros((flow.start.size, 0), np.complex128))
        return SeriesMotion(
            self.system, omega, 2.0 * np.pi / omega, pieces, self.harmonics, series[0]
        )

    def unknowns_from(self, motion: Motion) -> Real:
        count = 16 * (self.order + 1)
        t = motion.period * np.arange(count) / count
        directions = np.array([spring.direction for spring in self.builder.springs])
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
    the return maps of the exact flow beside it. Its false special points stay: to show them is
    what it is kept for.
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
    ) -> None:
        self.samples, self.sharpness = samples, sharpness
        super().__init__(system, harmonics, half_turn=half_turn)

    def _formulated(self) -> Sampled:
        return new_sampled(self.balance, self.samples, self.sharpness)

    def _read_off(self, u: Real, omega: Real, *, whole_turn: bool = False) -> Complex:
        series = super()._read_off(u, omega, whole_turn=whole_turn)
        describe_sampled(self.problem, u, omega, series)
        return series


def _states(series: Complex, harmonics: NDArray[np.int64], omega: Real) -> Real:
    """State (x, x') of series (P, n_h, N) at t = 0, (P, 2 N)."""
    rate = 1j * omega[:, None] * harmonics
    position, velocity = series.sum(axis=1), np.einsum("ph,phn->pn", rate, series)
    return np.concatenate([position.real, velocity.real], axis=1)
