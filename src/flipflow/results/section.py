"""Poincare sections and spectra: what tells periodic motions from others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flipflow.model.system import Coordinate, MechanicalSystem

Real = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Section:
    """States of a motion once a forcing period, when the unbalance points along +x.

    Parameters
    ----------
    system
        The machine.
    omega
        Forcing frequency in rad/s.
    states
        (x, x') in m and m/s, one row a period, (T, 2 N).
    """

    system: MechanicalSystem
    omega: float
    states: Real

    def __repr__(self) -> str:
        return f"Section({self.states.shape[0]} turns at {self.omega:.6g} rad/s)"

    def displacement(self, which: Coordinate) -> Real:
        """Displacement of a coordinate in m, (T,)."""
        return np.asarray(self.states[:, : self.system.size] @ self.system.coordinate(which))

    def velocity(self, which: Coordinate) -> Real:
        """Velocity of a coordinate in m/s, (T,)."""
        return np.asarray(self.states[:, self.system.size :] @ self.system.coordinate(which))


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Amplitudes of the harmonic parts of a motion.

    Parameters
    ----------
    omega
        Forcing frequency in rad/s.
    frequencies
        In rad/s, rising from 0, (n,).
    amplitudes
        In m, (n,): a part a cos(w t + phi) that fits the time counts a; the mean counts once.
    which
        The coordinate.
    """

    omega: float
    frequencies: Real
    amplitudes: Real
    which: Coordinate

    def __repr__(self) -> str:
        highest = f"{self.frequencies[-1]:.6g} rad/s"
        return f"Spectrum({self.which!r}, {self.frequencies.size} lines up to {highest})"
