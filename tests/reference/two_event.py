r"""The symmetric motion with one touch a side, as a scalar problem.

Count time from the entry at the plus side. The force is a cos(w t) + b sin(w t), and the stop
is engaged during the share s of the turn: for s T / 2 after the entry; then the machine flies
until, after T / 2, it enters the other side in the mirrored state. State at entry (4) and a, b are
six unknowns of six linear equations,

    y(0) = e,   y(s T / 2) = e,   z(T / 2) = -z(0),

so the unbalance that the motion needs is closed form: m0r = e G(s, w), w^2 m0r = sqrt(a^2 + b^2).
A motion of the machine is a zero of f = e G - m0r, a fold f_s = 0, a cusp f_s = f_ss = 0.
All is analytic in s, so that f_s is had by the complex step.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
from scipy.optimize import brentq, fsolve

from flipflow.model.screen import FlipFlowScreen

Number = float | complex
STEP = 1e-30
SECOND_STEP = 1e-4
# Shares of the unknowns: both solvers still end with noise of 1e-13 put upon f and f_s. Asked for
# less than rounding they warn that they make no progress, on one processor and not on another.
FOLD_SHARP = 1e-10
CUSP_SHARP = 1e-7


def required_moment_squared(screen: FlipFlowScreen, s: Number, omega: float) -> Number:
    """(m0r)^2 in (kg m)^2 that makes a motion with contact share s at omega."""
    free, engaged = _matrix(screen, 0.0), _matrix(screen, 1.0)
    half = np.pi / omega
    touch, flight = s * half, (1.0 - s) * half
    push = np.array([0.0, 0.0, 1.0 / screen.main_mass, 0.0])
    e = screen.clearance
    lift = screen.stop_stiffness * e
    preload = np.array([0.0, 0.0, lift / screen.main_mass, -lift / screen.floating_mass])
    rest = -np.linalg.solve(engaged, preload)
    gap = np.array([1.0, -1.0, 0.0, 0.0])
    # z = rest + E (z0 - rest - p(0)) + p(t): each a linear map of u = (z0, a, b) plus a constant.
    in_touch = scipy.linalg.expm(engaged * touch)
    at_exit = np.hstack([in_touch, _driven(engaged, push, omega, touch, in_touch, 0.0)])
    at_exit_constant = rest - in_touch @ rest
    in_flight = scipy.linalg.expm(free * flight)
    driven = _driven(free, push, omega, half, in_flight, touch)
    at_end = in_flight @ at_exit + np.hstack([np.zeros((4, 4)), driven])
    at_end_constant = in_flight @ at_exit_constant
    at_end[:, :4] += np.eye(4)
    equations = np.vstack([np.append(gap, [0.0, 0.0]), gap @ at_exit, at_end])
    right = np.concatenate([[e, e - gap @ at_exit_constant], -at_end_constant])
    a, b = np.linalg.solve(equations, right)[4:]
    return (a * a + b * b) / omega**4


def mismatch(screen: FlipFlowScreen, s: Number, omega: float) -> Number:
    """(required moment / the machine's)^2 - 1: zero where the motion exists."""
    return required_moment_squared(screen, s, omega) / screen.eccentric_moment**2 - 1.0


def slope(screen: FlipFlowScreen, s: float, omega: float) -> float:
    """Its derivative in s: zero at a fold."""
    return float(np.imag(mismatch(screen, s + 1j * STEP, omega)) / STEP)


def curvature(screen: FlipFlowScreen, s: float, omega: float) -> float:
    """Its second derivative in s: zero, too, at a cusp."""
    h = SECOND_STEP
    return (slope(screen, s + h, omega) - slope(screen, s - h, omega)) / (2.0 * h)


def contact_share(screen: FlipFlowScreen, omega: float, low: float, high: float) -> float:
    """The share s between two bounds that makes a motion at omega."""
    return float(brentq(lambda s: float(mismatch(screen, s, omega)), low, high, xtol=1e-15))


def fold(screen: FlipFlowScreen, s: float, omega: float) -> tuple[float, float]:
    """(s, omega) of the fold near a guess."""

    def both(u: np.ndarray) -> list[float]:
        share, w = u[0], u[1] * omega
        return [float(mismatch(screen, share, w)), slope(screen, share, w)]

    share, scaled = fsolve(both, [s, 1.0], xtol=FOLD_SHARP)
    return float(share), float(scaled * omega)


def cusp(
    screen: FlipFlowScreen, field: str, value: float, s: float, omega: float
) -> tuple[float, float]:
    """(value of the field, omega) where two folds are born, near a guess."""

    def three(u: np.ndarray) -> list[float]:
        machine, w = screen.replace(**{field: u[0] * value}), u[2] * omega
        return [
            float(mismatch(machine, u[1], w)),
            slope(machine, u[1], w),
            curvature(machine, u[1], w),
        ]

    scaled, _, frequency = fsolve(three, [1.0, s, 1.0], xtol=CUSP_SHARP)
    return float(scaled * value), float(frequency * omega)


def _matrix(screen: FlipFlowScreen, engaged: float) -> np.ndarray:
    """z' = A z for z = (x1, xf, x1', xf')."""
    k = screen.shear_stiffness + engaged * screen.stop_stiffness
    c = screen.shear_damping + engaged * screen.stop_damping
    k1, c1 = screen.isolation_stiffness, screen.isolation_damping
    m1, m2 = screen.main_mass, screen.floating_mass
    K = np.array([[(k1 + k) / m1, -k / m1], [-k / m2, k / m2]])
    C = np.array([[(c1 + c) / m1, -c / m1], [-c / m2, c / m2]])
    return np.block([[np.zeros((2, 2)), np.eye(2)], [-K, -C]])


def _driven(
    A: np.ndarray, push: np.ndarray, omega: float, end: Number, flow: np.ndarray, start: Number
) -> np.ndarray:
    """What unit cos and sin forces add to the state at ``end``, from rest at ``start``, (4, 2).

    p(t) solves p' = A p + push cos(w t): p = C cos(w t) + S sin(w t); the sine is a quarter later.
    """
    inverse = np.linalg.inv(A @ A + omega**2 * np.eye(4))
    cos_part, sin_part = -inverse @ A @ push, omega * inverse @ push

    def particular(t: Number) -> np.ndarray:
        c, s = np.cos(omega * t), np.sin(omega * t)
        return np.stack([cos_part * c + sin_part * s, cos_part * s - sin_part * c], axis=1)

    return particular(end) - flow @ particular(start)
