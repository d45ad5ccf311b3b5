"""A screen with its shaft by SciPy's DOP853: frames, normal direction, motor, friction, gravity.

Written from the equations alone, solved for the accelerations of (x1, xf, y, phi) by hand; the
paper's stop law, whose changes end a stretch of integration.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import flipflow as ff

GRAVITY = 9.80665
CREEP = 0.1  # rad/s, below which the constant friction fades
STEP, ROWS = 1e-3, 8  # s, longest step; rows of each, so that no peak falls between two
Real = NDArray[np.float64]


@dataclass
class Start:
    """Rows in time: t (n,), states (x1, xf, y, phi and their rates) (n, 8), stop force (n,)."""

    t: Real
    s: Real
    H: Real

    def time_at(self, speed: float) -> float:
        """When the shaft first has a speed."""
        k = int(np.argmax(self.s[:, 7] >= speed))
        return float(np.interp(speed, self.s[k - 1 : k + 1, 7], self.t[k - 1 : k + 1]))


def run(
    screen: ff.FlipFlowScreen,
    drive: ff.Drive,
    torque: Callable[[float, float], float],
    begin: Real,
    until: float,
    *,
    stop_below: float | None = None,
    switch: float | None = None,
) -> Start:
    """Integrate from ``begin``, (8,); ``torque(t, speed)`` is the motor's at the shaft.

    The run ends at ``until``, or where the speed falls below ``stop_below``; at ``switch`` in s
    the torque changes at once.
    """
    m1, m2, m0r = screen.main_mass, screen.floating_mass, screen.eccentric_moment
    k1, c1 = screen.isolation_stiffness, screen.isolation_damping
    k2, c2 = screen.shear_stiffness, screen.shear_damping
    kn, cn = screen.normal_stiffness, screen.normal_damping
    k3, c3, gap = screen.stop_stiffness, screen.stop_damping, screen.clearance
    alpha = screen.deck_angle

    def stop_force(side: int, s: Real) -> Real | int:
        return side and k3 * (s[0] - s[1] - side * gap) + c3 * (s[4] - s[5])

    def rate(t: float, s: Real, side: int) -> list[float]:
        x1, xf, y, phi, v1, vf, vy, w = s.tolist()
        cos, sin = math.cos(phi), math.sin(phi)
        stop = side and k3 * (x1 - xf - side * gap) + c3 * (v1 - vf)
        shear = k2 * (x1 - xf) + c2 * (v1 - vf) + stop
        friction = drive.friction * math.tanh(w / CREEP) + drive.viscous_friction * w
        f1 = m0r * w * w * cos - k1 * x1 - c1 * v1 - shear
        fy = m0r * w * w * sin - kn * y - cn * vy
        turn = torque(t, w) - friction - m0r * GRAVITY * math.cos(phi + alpha)
        # The rows m1 x1'' - m0r sin phi'' = f1 and (m1 + m2) y'' + m0r cos phi'' = fy put into
        # J phi'' - m0r sin x1'' + m0r cos y'' = turn.
        inertia = drive.inertia - (m0r * sin) ** 2 / m1 - (m0r * cos) ** 2 / (m1 + m2)
        dw = (turn + m0r * sin * f1 / m1 - m0r * cos * fy / (m1 + m2)) / inertia
        dv1, dvy = (f1 + m0r * sin * dw) / m1, (fy - m0r * cos * dw) / (m1 + m2)
        return [v1, vf, vy, w, dv1, shear / m2, dvy, dw]

    def crossing(_t: float, s: Real, side: int) -> float:
        x2 = s[0] - s[1]
        return gap - abs(x2) if side == 0 else side * x2 - gap

    def slow(_t: float, s: Real, _side: int) -> float:
        return s[7] - stop_below if stop_below is not None else 1.0

    crossing.terminal = slow.terminal = True
    crossing.direction = slow.direction = -1
    t, s = 0.0, np.array(begin, float)
    side = int(np.sign(s[0] - s[1])) if abs(s[0] - s[1]) > gap else 0
    parts: list[tuple[Real, Real, Real]] = []
    ends = [end for end in (switch, until) if end is not None]
    for end in ends:
        while t < end:
            found = solve_ivp(
                rate, (t, end), s, "DOP853", args=(side,), rtol=1e-10, atol=1e-12,
                events=(crossing, slow), max_step=STEP, dense_output=True,
            )  # fmt: skip
            steps = np.arange(found.t.size)
            times = np.interp(np.linspace(0.0, steps[-1], ROWS * steps[-1] + 1), steps, found.t)
            rows = found.sol(times).T
            parts.append((times, rows, np.broadcast_to(stop_force(side, rows.T), times.shape)))
            t, s = float(found.t[-1]), found.y[:, -1]
            if found.t_events[1].size:
                return Start(*(np.concatenate(each) for each in zip(*parts, strict=True)))
            if found.t_events[0].size:
                side = 0 if side else int(np.sign(s[0] - s[1]))
    return Start(*(np.concatenate(each) for each in zip(*parts, strict=True)))
