"""Motion normal to the screen surface: both frames as one mass on the isolation, closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from flipflow.compiled.arrays import Complex, Real
from flipflow.dynamics.contact_free import contact_free
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.system import Machine


@dataclass(frozen=True)
class NormalDirection:
    """Mass, stiffness and damping of the motion normal to the surface, in SI.

    ``sense`` is that of the unbalance: :attr:`~flipflow.FlipFlowScreen.normal_sense`.
    """

    mass: float
    stiffness: float
    damping: float
    sense: float


def normal_direction(machine: Machine) -> NormalDirection | None:
    """The direction normal to the surface; None where its data are missing."""
    if not isinstance(machine, FlipFlowScreen):
        return None
    k, c = machine.normal_stiffness, machine.normal_damping
    if k is None or c is None:
        return None
    return NormalDirection(machine.main_mass + machine.floating_mass, k, c, machine.normal_sense)


@dataclass(frozen=True)
class NormalMotion:
    r"""Motion y normal to the surface: both frames move alike.

    .. math:: (m_1 + m_2) \ddot y + c_{1n} \dot y + k_{1n} y = s m_0 r \omega^2 \sin \omega t

    s is 1, or -1 where the unbalance turns the other way: see :attr:`FlipFlowScreen.normal_sense`.

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


def normal_motion(machine: Machine, omega: float) -> NormalMotion | None:
    """The steady motion normal to the surface; None where its data are missing."""
    one = normal_direction(machine)
    if one is None or not isinstance(machine, FlipFlowScreen):
        return None
    Y = normal_amplitude(one.mass, one.damping, one.stiffness, machine.eccentric_moment, omega)
    return NormalMotion(omega, complex(one.sense * Y), one.stiffness, one.damping)


def normal_amplitude(
    mass: ArrayLike,
    damping: ArrayLike,
    stiffness: ArrayLike,
    eccentric_moment: ArrayLike,
    omega: ArrayLike,
) -> Complex:
    """Y of y = Re(Y exp(i omega t)) in m; all arguments are broadcast."""
    M, C, K = (np.asarray(one, float)[..., None, None] for one in (mass, damping, stiffness))
    w = np.asarray(omega, float)
    force = -1j * np.asarray(eccentric_moment, float) * w**2
    return np.asarray(contact_free(M, C, K, force[..., None], w)[..., 0])


def peak_of_both(along: Complex, across: Complex) -> Real:
    """Largest length over a turn of (Re(A e), Re(B e)): the half axis of an ellipse."""
    squares = np.abs(along) ** 2 + np.abs(across) ** 2
    return np.asarray(np.sqrt(0.5 * (squares + np.abs(along**2 + across**2))))
