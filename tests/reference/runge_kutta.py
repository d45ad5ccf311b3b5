"""Classical Runge-Kutta of order 4 whose steps end at the contact (paper's law only)."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from reference.integrate import ENGAGED, OPEN, Machine, right_side

LAST_SHARE = 1e-12


def rk4_step(rate, t: float, z: np.ndarray, h: float) -> np.ndarray:
    """z(t + h) = z + h (k1 + 2 k2 + 2 k3 + k4) / 6."""
    k1 = rate(t, z)
    k2 = rate(t + h / 2.0, z + h / 2.0 * k1)
    k3 = rate(t + h / 2.0, z + h / 2.0 * k2)
    k4 = rate(t + h, z + h * k3)
    return z + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


def rk4_turn(machine: Machine, z: np.ndarray, omega: float, steps: int) -> np.ndarray:
    """State after one turn in ``steps`` steps, each cut where a stop opens or closes.

    The length of a cut step is the root of the gap as a function of it, so that the contact is
    found with the accuracy of the method itself.
    """
    n = machine.M.shape[0]
    z = np.array(z, float)
    states = [stop.state_at(z[:n], z[n:]) for stop in machine.stops]
    t, whole = 0.0, 2.0 * np.pi / omega / steps
    for k in range(steps):
        end = (k + 1) * whole
        while end - t > LAST_SHARE * whole:
            rate = right_side(machine, states, omega)
            h, changed = _step_to_contact(machine, states, rate, t, z, end - t)
            z, t = rk4_step(rate, t, z, h), t + h
            if changed is not None:
                states[changed] = OPEN if states[changed] == ENGAGED else ENGAGED
    return z


def _step_to_contact(
    machine: Machine, states: list[str], rate, t: float, z: np.ndarray, h: float
) -> tuple[float, int | None]:
    """The step h, or the shorter one that ends where the first stop changes, and that stop."""
    n = machine.M.shape[0]
    best, changed = h, None
    for j, (stop, state) in enumerate(zip(machine.stops, states, strict=True)):
        sign = 1.0 if state == ENGAGED else -1.0

        def inside(length: float, stop=stop, sign=sign) -> float:
            return sign * stop.depth(rk4_step(rate, t, z, length)[:n])

        # A stop that has just changed stands at its gap: ask a little later, not at once.
        soon = 1e-6 * h
        if inside(h) < 0.0 < inside(soon):
            length = float(brentq(inside, soon, h, xtol=1e-16, rtol=1e-14))
            if length < best:
                best, changed = length, j
    return best, changed
