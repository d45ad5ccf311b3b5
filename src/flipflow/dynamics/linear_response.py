"""The machine without contact, in closed form: amplitudes, phases, natural frequencies, peaks."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow.compiled.arrays import Real
from flipflow.dynamics.contact_free import complex_amplitudes, span
from flipflow.model.arguments import checked_speeds, refuse_pair
from flipflow.model.screen import FlipFlowScreen, unit_in
from flipflow.model.system import Coordinate, Machine, MechanicalSystem, system_of
from flipflow.results.result import Frozen, Result

SCAN_POINTS = 4000  # frequencies up to twice the highest natural one, to find peaks between


@dataclass(frozen=True, eq=False)
class LinearResponse(Frozen, Result):
    """Response of the machine as long as no stop is touched; bonded stops count as springs.

    Parameters
    ----------
    machine
        What was analysed.
    system
        The same as matrices.
    omega
        Frequencies in rad/s, (n,).
    """

    machine: Machine
    system: MechanicalSystem
    omega: Real

    def __repr__(self) -> str:
        unit = unit_in(self.machine, "rad/s")
        ends = f"{self.omega.min():.6g} to {self.omega.max():.6g}{unit}"
        return f"LinearResponse({self.omega.size} frequencies, {ends})"

    @cached_property
    def complex_amplitudes(self) -> NDArray[np.complex128]:
        """X of x = Re(X exp(i omega t)) in m, (n, N): the first harmonic."""
        return complex_amplitudes(self.system, self.omega)

    def amplitude(self, which: Coordinate) -> Real:
        """Half peak-to-peak of a coordinate in m, (n,)."""
        return _amplitude(self.system, self.omega, self.system.coordinate(which))

    def phase(self, which: Coordinate) -> Real:
        """Phase of the first harmonic against the force in rad, (n,); positive: it leads."""
        return np.angle(self.complex_amplitudes @ self.system.coordinate(which))

    @cached_property
    def natural_frequencies(self) -> Real:
        """Undamped natural frequencies in rad/s, rising, (N,): K v = w^2 M v."""
        return natural_frequencies(self.machine)

    @cached_property
    def shapes(self) -> Real:
        """Mode shapes as columns, (N, N), each scaled to a largest entry of 1."""
        shapes = _modes(self.system)[1]
        largest = np.take_along_axis(shapes, np.abs(shapes).argmax(axis=0)[None], axis=0)
        return np.asarray(shapes / largest)

    def peaks(self, which: Coordinate) -> tuple[tuple[float, float], ...]:
        """Resonance peaks of a coordinate as (omega in rad/s, amplitude in m), rising in omega."""
        from scipy.optimize import minimize_scalar  # noqa: PLC0415  slow; files need none of it

        vector = self.system.coordinate(which)
        top = 2.0 * float(self.natural_frequencies[-1])
        grid = np.linspace(top / SCAN_POINTS, top, SCAN_POINTS)

        def amplitude(omega: ArrayLike) -> Real:
            return _amplitude(self.system, np.atleast_1d(np.asarray(omega, float)), vector)

        values = amplitude(grid)
        inner = (values[1:-1] > values[:-2]) & (values[1:-1] >= values[2:])
        found = []
        for k in np.flatnonzero(inner) + 1:
            best = minimize_scalar(
                lambda w: -float(amplitude(w)[0]),
                bounds=(grid[k - 1], grid[k + 1]),
                method="bounded",
                options={"xatol": 1e-9 * grid[k]},
            )
            found.append((float(best.x), float(-best.fun)))
        return tuple(found)

    @property
    def omega_ea(self) -> float | None:
        """w_ea in rad/s, where main and relative amplitude are equal; None for other machines."""
        return equal_amplitude_frequency(self.machine)

    @property
    def omega_ar(self) -> float | None:
        """w_ar in rad/s, the antiresonance of the main frame; None for other machines."""
        return antiresonance_frequency(self.machine)


def linear_response(machine: Machine, omega: ArrayLike) -> LinearResponse:
    """Response without contact over frequencies: (K - w^2 M + i w C) X = F.

    Parameters
    ----------
    machine
        A screen, a :class:`~flipflow.MechanicalSystem`, or any machine with ``.system()``.
    omega
        Frequencies in rad/s, (n,) or one.

    Raises
    ------
    InputError
        For frequencies that are not finite or not above 0, and without any damping.
    """
    refuse_pair("omega", omega)
    frequencies = checked_speeds(omega)
    system = system_of(machine).with_bonded()
    system.require_damping()
    return LinearResponse(machine, system, frequencies)


def equal_amplitude_frequency(machine: Machine) -> float | None:
    """w_ea = k2 / sqrt(2 m2 k2 - c2^2) in rad/s; None where damping rules it out (paper, 2.2).

    A stop without gap adds its stiffness and damping to k2 and c2.
    """
    if not isinstance(machine, FlipFlowScreen):
        return None
    (k2, c2), m2 = _between_frames(machine), machine.floating_mass
    square = 2.0 * m2 * k2 - c2**2
    return k2 / math.sqrt(square) if square > 0.0 else None


def antiresonance_frequency(machine: Machine) -> float | None:
    """w_ar = sqrt(k2 / m2) in rad/s (paper, 2.2); k2 as of :func:`equal_amplitude_frequency`."""
    if not isinstance(machine, FlipFlowScreen):
        return None
    return math.sqrt(_between_frames(machine)[0] / machine.floating_mass)


def _between_frames(screen: FlipFlowScreen) -> tuple[float, float]:
    """Stiffness and damping between the frames as long as no gap closes."""
    k2, c2 = screen.shear_stiffness, screen.shear_damping
    if not screen.stop().bonded:
        return k2, c2
    return k2 + screen.stop_stiffness, c2 + screen.stop_damping


def natural_frequencies(machine: Machine) -> Real:
    """Undamped natural frequencies in rad/s without contact, rising, (N,): K v = w^2 M v."""
    return np.sqrt(np.maximum(_modes(machine.system().with_bonded())[0], 0.0))


def bonded_natural_frequencies(machine: Machine) -> Real:
    """Undamped natural frequencies in rad/s with every stop engaged, rising, (N,)."""
    system = machine.system()
    K = system.K.copy()
    for spring in system.springs:
        if spring.acts:
            K += spring.stiffness * np.outer(spring.direction, spring.direction)
    return np.asarray(np.sqrt(np.maximum(_modes(replace(system, K=K))[0], 0.0)))


def _amplitude(system: MechanicalSystem, omega: Real, vector: Real) -> Real:
    """Half peak-to-peak along a vector, (n,)."""
    harmonics = [complex_amplitudes(system, omega, order) @ vector for order in system.orders]
    if len(harmonics) == 1:
        return np.abs(harmonics[0])
    spans = [span(system.orders, A) for A in np.array(harmonics).T]
    return np.array([(high - low) / 2.0 for low, high in spans])


def _modes(system: MechanicalSystem) -> tuple[Real, Real]:
    """Squares of the natural frequencies, rising, and shapes, of the symmetric part of K.

    With M = L L^T, K v = w^2 M v becomes (L^-1 K L^-T) y = w^2 y, y = L^T v: numpy alone, for
    scipy.linalg takes longer to load than a machine file takes to read.
    """
    L = np.linalg.cholesky(system.M)
    half = np.linalg.solve(L, 0.5 * (system.K + system.K.T))
    reduced = np.linalg.solve(L, half.T)
    squares, y = np.linalg.eigh(0.5 * (reduced + reduced.T))
    return squares, np.linalg.solve(L.T, y)
