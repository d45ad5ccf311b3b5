"""Motion normal to the screen surface: both frames as one mass on the isolation, closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow.model.screen import FlipFlowScreen

Real = NDArray[np.float64]


@dataclass(frozen=True)
class NormalMotion:
    r"""Motion y normal to the surface: both frames move alike.

    .. math:: (m_1 + m_2) \ddot y + c_{1n} \dot y + k_{1n} y = m_0 r \omega^2 \sin \omega t

    Parameters
    ----------
    omega
        Frequency in rad/s.
    complex_amplitude
        Y of y = Re(Y exp(i omega t)) in m.
    stiffness, damping
        k1n in N/m and c1n in N s/m.
    """

    omega: float
    complex_amplitude: complex
    stiffness: float
    damping: float

    @property
    def amplitude(self) -> float:
        """Amplitude in m."""
        return abs(self.complex_amplitude)

    @property
    def phase(self) -> float:
        """Phase in rad against the component of the force along the surface."""
        return float(np.angle(self.complex_amplitude))

    @property
    def power(self) -> float:
        """Mean power that the isolation takes in this direction, W."""
        return 0.5 * self.damping * (self.omega * self.amplitude) ** 2

    def displacement(self, t: ArrayLike) -> Real:
        """y in m at times t."""
        return self._derivative(t, 0)

    def velocity(self, t: ArrayLike) -> Real:
        """y' in m/s at times t."""
        return self._derivative(t, 1)

    def acceleration(self, t: ArrayLike) -> Real:
        """y'' in m/s^2 at times t."""
        return self._derivative(t, 2)

    def foundation_force(self, t: ArrayLike) -> Real:
        """k1n y + c1n y' in N at times t."""
        return self.stiffness * self.displacement(t) + self.damping * self.velocity(t)

    def _derivative(self, t: ArrayLike, order: int) -> Real:
        rate = 1j * self.omega
        turn = np.exp(rate * np.asarray(t, float)) * rate**order
        return np.asarray((self.complex_amplitude * turn).real)


def normal_motion(screen: FlipFlowScreen, omega: float) -> NormalMotion | None:
    """The motion normal to the surface, None where the file leaves its stiffness or damping out."""
    k, c = screen.normal_stiffness, screen.normal_damping
    if k is None or c is None:
        return None
    mass = screen.main_mass + screen.floating_mass
    force = -1j * screen.eccentric_moment * omega**2
    Y = force / (k - mass * omega**2 + 1j * c * omega)
    return NormalMotion(omega, Y, k, c)
