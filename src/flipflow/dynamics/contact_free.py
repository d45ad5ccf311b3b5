"""The contact-free motion in closed form."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flipflow.model.system import MechanicalSystem

Real = NDArray[np.float64]


def complex_amplitudes(system: MechanicalSystem, omega: Real) -> NDArray[np.complex128]:
    """X in x = Re(X exp(i omega t)) without contact, (n, N)."""
    w = omega[:, None, None]
    Z = system.K - w**2 * system.M + 1j * w * system.C
    F = system.excitation.vector * omega[:, None] ** system.excitation.power
    return np.asarray(np.linalg.solve(Z, F[:, :, None])[:, :, 0])
