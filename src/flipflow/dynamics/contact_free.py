r"""The motion without contact in closed form: :math:`Z(\omega) X = F`.

It serves one machine over frequencies, many machines at many frequencies, and any number of degrees
of freedom.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from flipflow.compiled.arrays import Complex, Real
from flipflow.model.system import MechanicalSystem


def contact_free(M: Real, C: Real, K: Real, force: Real | Complex, omega: Real) -> Complex:
    r"""Complex amplitudes X of x = Re(X exp(i omega t)) as long as no stop is touched.

    .. math:: (K - \omega^2 M + i \omega C) X = F

    Parameters
    ----------
    M, C, K
        Mass, damping, stiffness in kg, N s/m, N/m, (..., N, N).
    force
        F in N, (..., N); complex for a phase.
    omega
        Frequencies in rad/s, (...).

    Returns
    -------
    ndarray
        X in m, (..., N); the leading axes of all arguments are broadcast.
    """
    size = M.shape[-1]
    if size == 1:
        return np.asarray(force / _impedance(M, C, K, omega, (0, 0))[..., None])
    if size == 2:
        return _of_two(M, C, K, force, omega)
    w = omega[..., None, None]
    Z = K - w**2 * M + 1j * (w * C)
    return np.asarray(np.linalg.solve(Z, force[..., None])[..., 0])


def complex_amplitudes(system: MechanicalSystem, omega: Real, order: int = 1) -> Complex:
    """X of a system without contact, (..., N), at a multiple of frequencies in rad/s, (...)."""
    force = system.force(omega, order)
    return contact_free(system.M, system.C, system.K, force, order * omega)


def state_matrix(M: Real, C: Real, K: Real) -> Real:
    """A of z' = A z, z = (x, x'), for M x'' + C x' + K x = 0, (..., 2 N, 2 N); axes broadcast."""
    shape = np.broadcast_shapes(M.shape, C.shape, K.shape)
    n = shape[-1]
    A = np.zeros((*shape[:-2], 2 * n, 2 * n))
    A[..., :n, n:] = np.eye(n)
    A[..., n:, :n], A[..., n:, n:] = -np.linalg.solve(M, K), -np.linalg.solve(M, C)
    return A


def span(orders: Sequence[int], amplitudes: Complex) -> tuple[float, float]:
    """Least and greatest value of Re sum_n a_n exp(i n theta) over a turn, n of ``orders``."""
    if len(orders) == 1:
        size = float(abs(amplitudes[0]))
        return -size, size
    # With z = exp(i theta) the slope is zero where sum_n i n (a_n z^n - conj(a_n) z^-n) is.
    if not np.isfinite(amplitudes).all():
        return math.nan, math.nan
    # What is rounding beside the rest would lead the polynomial, and spoil its roots.
    known = np.where(np.abs(amplitudes) > 1e-17 * np.abs(amplitudes).max(), amplitudes, 0.0)
    highest = max(orders)
    slope = np.zeros(2 * highest + 1, np.complex128)
    for order, amplitude in zip(orders, known, strict=True):
        slope[highest - order] = order * amplitude
        slope[highest + order] = -order * np.conj(amplitude)
    theta = np.append(np.angle(np.roots(slope)), 0.0)
    values = (np.exp(1j * np.outer(theta, orders)) @ amplitudes).real
    return float(values.min()), float(values.max())


def _of_two(M: Real, C: Real, K: Real, force: Real | Complex, omega: Real) -> Complex:
    """Two degrees of freedom by the adjugate: a sixth of the time that LAPACK's calls take."""
    Z11, Z12, Z21, Z22 = (_impedance(M, C, K, omega, at) for at in ((0, 0), (0, 1), (1, 0), (1, 1)))
    scale = 1.0 / (Z11 * Z22 - Z12 * Z21)
    Z11 *= scale
    Z12 *= scale
    Z21 *= scale
    Z22 *= scale
    F1, F2 = force[..., 0], force[..., 1]
    X = np.empty((2, *np.broadcast_shapes(scale.shape, F1.shape)), np.complex128)
    np.multiply(Z22, F1, out=X[0])
    np.multiply(Z21, -F1, out=X[1])
    if np.any(F2):  # most machines are driven at one degree of freedom
        X[0] -= Z12 * F2
        X[1] += Z11 * F2
    return np.moveaxis(X, 0, -1)


def _impedance(M: Real, C: Real, K: Real, omega: Real, at: tuple[int, int]) -> Complex:
    """One entry of K - omega^2 M + i omega C, (...)."""
    real, imaginary = K[..., *at] - omega**2 * M[..., *at], omega * C[..., *at]
    Z = np.empty(np.broadcast_shapes(real.shape, imaginary.shape), np.complex128)
    Z.real, Z.imag = real, imaginary
    return Z
