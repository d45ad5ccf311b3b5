"""Contact-free motions of many screens at many frequencies, in closed form and one array call."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class LinearMotions:
    r"""Complex amplitudes of S screens at K frequencies, (S, K) each.

    With :math:`Z_{11} = k_1 + k_2 - \omega^2 m_1 + i \omega (c_1 + c_2)`,
    :math:`Z_{12} = -(k_2 + i \omega c_2)`, :math:`Z_{22} = k_2 - \omega^2 m_2 + i \omega c_2` and
    :math:`\Delta = Z_{11} Z_{22} - Z_{12}^2`,

    .. math:: X_1 = \frac{m_0 r \omega^2 Z_{22}}{\Delta}, \quad
              X_f = -\frac{m_0 r \omega^2 Z_{12}}{\Delta}, \quad
              X_2 = X_1 - X_f = -\frac{m_0 r \omega^4 m_2}{\Delta}.

    Parameters
    ----------
    fields
        Fields of the screens in SI, each (S, 1) or one number.
    omega
        Frequencies in rad/s, (K,).
    """

    fields: Mapping[str, Real]
    omega: Real

    @cached_property
    def force(self) -> Real:
        """m0r w^2 in N."""
        return np.asarray(self.fields["eccentric_moment"] * self.omega**2)

    @cached_property
    def main(self) -> Complex:
        """X1 in m."""
        f, w = self.fields, self.omega
        inertia = f["shear_stiffness"] - w**2 * f["floating_mass"]
        return self._scaled(inertia + 1j * w * f["shear_damping"])

    @cached_property
    def floating(self) -> Complex:
        """Xf in m."""
        f, w = self.fields, self.omega
        return self._scaled(f["shear_stiffness"] + 1j * w * f["shear_damping"])

    @cached_property
    def relative(self) -> Complex:
        """X2 = X1 - Xf in m."""
        return self._scaled(-(self.omega**2) * self.fields["floating_mass"])

    @cached_property
    def normal(self) -> Complex:
        """Y in m, both frames as one mass normal to the surface."""
        f, w = self.fields, self.omega
        mass = f["main_mass"] + f["floating_mass"]
        impedance = f["normal_stiffness"] - mass * w**2 + 1j * w * f["normal_damping"]
        return np.asarray(-1j * self.force / impedance)

    def _scaled(self, numerator: Real | Complex) -> Complex:
        return np.asarray(numerator * self.force / self._determinant)

    @cached_property
    def _determinant(self) -> Complex:
        f, w = self.fields, self.omega
        k1, c1, k2, c2 = (
            f[name]
            for name in (
                "isolation_stiffness", "isolation_damping", "shear_stiffness", "shear_damping",
            )
        )  # fmt: skip
        shear = k2 + 1j * w * c2
        main = k1 - w**2 * f["main_mass"] + 1j * w * c1
        # Z11 Z22 - Z12^2, free of the difference of two nearly equal products.
        square = w**2 * f["floating_mass"]
        return np.asarray(shear * (main - square) - main * square)


def peak_of_both(along: Complex, across: Complex) -> Real:
    """Largest length over a turn of (Re(A e), Re(B e)): the half axis of an ellipse."""
    squares = np.abs(along) ** 2 + np.abs(across) ** 2
    return np.asarray(np.sqrt(0.5 * (squares + np.abs(along**2 + across**2))))


def _acceleration(motions: LinearMotions, along: Complex) -> Real:
    return motions.omega**2 * peak_of_both(along, motions.normal)


def _foundation_force(m: LinearMotions) -> Real:
    f = m.fields
    along = f["isolation_stiffness"] + 1j * m.omega * f["isolation_damping"]
    across = f["normal_stiffness"] + 1j * m.omega * f["normal_damping"]
    return peak_of_both(along * m.main, across * m.normal)


LINEAR: Mapping[str, Callable[[LinearMotions], Real]] = {
    "relative_amplitude": lambda m: np.abs(m.relative),
    "stroke": lambda m: 2.0 * np.abs(m.relative),
    "main_amplitude": lambda m: np.abs(m.main),
    "floating_amplitude": lambda m: np.abs(m.floating),
    "relative_phase": lambda m: np.angle(m.relative),
    "main_frame_acceleration": lambda m: _acceleration(m, m.main),
    "floating_frame_acceleration": lambda m: _acceleration(m, m.floating),
    "foundation_force": _foundation_force,
    "shear_strain": lambda m: np.abs(m.relative) / m.fields["shear_height"],
}
