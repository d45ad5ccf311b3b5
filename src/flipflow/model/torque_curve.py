"""Torque of an induction motor over speed, as pieces that kernels and tables of numbers share.

Below the speed at which the pieces end the torque is a cubic of each piece; above it, Kloss'
formula. Torques are shares of the breakdown torque for Kloss' formula, else of what was given.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flipflow.compiled.arrays import Real

PULL_UP_SPEED = 0.25  # of the speed at breakdown: where the torque is least on the way up


@dataclass(frozen=True, eq=False)
class TorqueCurve:
    """Torque over speed: cubics up to a speed, Kloss' formula beyond it.

    Parameters
    ----------
    pieces
        Begin of each piece and the coefficients of 1, d, d^2, d^3 with d counted from there,
        (K, 5). The first holds below its begin, too, as its value there.
    end
        Speed at which the pieces end; -inf: Kloss' formula throughout, inf: pieces throughout.
    """

    pieces: Real
    end: float

    def torque(self, speed: Real) -> Real:
        """Torque at speeds, of the pieces alone; NaN beyond their end."""
        row = np.maximum(np.searchsorted(self.pieces[:, 0], speed, side="right") - 1, 0)
        one = self.pieces[row]
        d = np.maximum(speed - one[..., 0], 0.0)
        value = one[..., 1] + d * (one[..., 2] + d * (one[..., 3] + d * one[..., 4]))
        return np.where(speed < self.end, value, np.nan)

    def scaled(self, torque: float, speed: float) -> TorqueCurve:
        """The curve with torques times ``torque`` and speeds times ``speed``."""
        powers = torque / speed ** np.arange(4.0)
        begin = self.pieces[:, :1] * speed
        return TorqueCurve(np.hstack([begin, self.pieces[:, 1:] * powers]), self.end * speed)


NO_PIECES = TorqueCurve(np.zeros((1, 5)), -np.inf)


def cage_curve(
    starting: float, pull_up: float | None, breakdown: float, breakdown_speed: float
) -> TorqueCurve:
    """Standstill, pull-up and breakdown torque, level at each, joined by cubics.

    The torque is least at a quarter of the speed at breakdown.
    """
    points = [(0.0, starting), (breakdown_speed, breakdown)]
    if pull_up is not None:
        points.insert(1, (PULL_UP_SPEED * breakdown_speed, pull_up))
    u, t = np.array(points).T
    width, rise = np.diff(u), np.diff(t)
    level = np.zeros_like(rise)
    bend = np.array([3.0 * rise / width**2, -2.0 * rise / width**3])
    return TorqueCurve(np.column_stack([u[:-1], t[:-1], level, *bend]), breakdown_speed)


def table_curve(rows: Real, synchronous_speed: float) -> TorqueCurve:
    """Straight lines between rows (speed, torque), to no torque at synchronous speed and on."""
    if rows[-1, 0] < synchronous_speed:
        rows = np.vstack([rows, [synchronous_speed, 0.0]])
    u, t = rows.T
    slopes = np.diff(t) / np.diff(u)
    nothing = np.zeros_like(slopes)
    return TorqueCurve(np.column_stack([u[:-1], t[:-1], slopes, nothing, nothing]), np.inf)


def rated_point(rows: Real, power: float | None) -> tuple[float, float] | None:
    """Speed and torque of the last point of a table at which it is at its rated values.

    ``power`` in W for torques in N m: speed times torque is the power there. None: the torques
    are shares of the rated one, which is 1 there. None is returned where there is no such point.
    """
    for (u, t), (v, s) in zip(rows[-2::-1], rows[:0:-1], strict=True):
        slope = (s - t) / (v - u)
        if power is None:
            found = [u + (1.0 - t) / slope] if slope < 0.0 else []
        else:
            roots = np.roots([slope, t - slope * u, -power]) if slope < 0.0 else np.zeros(0)
            found = [float(one.real) for one in roots if abs(one.imag) < 1e-9 * abs(one.real)]
        inside = [one for one in found if u <= one <= v]
        if inside:
            speed = max(inside)
            return float(speed), float(t + slope * (speed - u))
    return None
