"""The peer of all benchmarks in time: scipy's solve_ivp, DOP853, every contact a terminal event."""

import numpy as np
from scipy.integrate import solve_ivp


def carried(system, z, omega, turns, rtol, atol):
    """State (x, x') after a number of turns of a machine with one stop of equal gaps."""
    (stop,) = system.springs
    d, gap = stop.direction, stop.clearance
    y = d @ z[:2]
    side = float(np.sign(y)) if abs(y) > gap else 0.0
    slope = _slope(system, omega)
    t, end = 0.0, turns * 2.0 * np.pi / omega
    while t < end:
        watched = [_crossing(d, side * gap, -side)] if side else _outward(d, gap)
        piece = solve_ivp(
            slope, (t, end), z, "DOP853", events=watched, args=(side,), rtol=rtol, atol=atol
        )
        t, z = piece.t[-1], piece.y[:, -1]
        if piece.status == 1:
            fired = [bool(times.size) for times in piece.t_events]
            side = 0.0 if side else (1.0 if fired[0] else -1.0)
    return z


def _slope(system, omega):
    (stop,) = system.springs
    inverse, d = np.linalg.inv(system.M), stop.direction
    force = system.excitation.vector.real * omega**system.excitation.power

    def slope(t, z, side):
        x, v = z[:2], z[2:]
        f = force * np.cos(omega * t) - system.C @ v - system.K @ x
        if side:
            depth = d @ x - side * stop.clearance
            f = f - d * (stop.stiffness * depth + stop.damping * (d @ v))
        return np.concatenate([v, inverse @ f])

    return slope


def _outward(d, gap):
    return [_crossing(d, gap, 1.0), _crossing(d, -gap, 1.0, sign=-1.0)]


def _crossing(d, level, direction, sign=1.0):
    def gap(_t, z, _side):
        return sign * (d @ z[:2] - level)

    gap.terminal, gap.direction = True, direction
    return gap
