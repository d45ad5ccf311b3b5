"""How far the smooth stand-in for a stop's switch is from the piecewise law."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Real
from flipflow.errors import InputError
from flipflow.model.elements import ClearanceSpring
from flipflow.model.smooth import SHARPNESS, smooth_force

UNSWITCHED = 1e-3  # share of the force that the smooth law has not switched at its layer's edge
POINTS = 20_001  # positions over the stroke, besides those in the layers


@dataclass(frozen=True, eq=False)
class LawComparison:
    """Both laws along one course of the gap coordinate.

    Parameters
    ----------
    condition
        "stiffness alone", "with damping" or "with a motion".
    displacement, velocity
        Gap coordinate in m and its rate in m/s, (n,).
    piecewise, smooth
        Force by both laws in N, (n,).
    layer_width
        Width in m of the layer around a gap in which the smooth law has switched by more than
        one part in a thousand and less than all but that.
    outside
        Which points lie outside the layers, (n,).
    """

    condition: str
    displacement: Real
    velocity: Real
    piecewise: Real
    smooth: Real
    layer_width: float
    outside: NDArray[np.bool_]

    @property
    def largest(self) -> float:
        """Largest difference in N outside the layers."""
        return float(np.abs(self.smooth - self.piecewise)[self.outside].max())

    @property
    def rms(self) -> float:
        """Root mean square difference in N outside the layers."""
        return float(np.sqrt(np.mean((self.smooth - self.piecewise)[self.outside] ** 2)))

    @property
    def largest_inside(self) -> float:
        """Largest difference in N within the layers; zero where no point falls into one."""
        inside = np.abs(self.smooth - self.piecewise)[~self.outside]
        return float(inside.max(initial=0.0))

    @property
    def largest_force(self) -> float:
        """Largest force by the piecewise law in N, to measure the differences by."""
        return float(np.abs(self.piecewise).max())


def compare_laws(
    spring: ClearanceSpring, amplitude: float, omega: float
) -> tuple[LawComparison, LawComparison, LawComparison]:
    """Lay the smooth law over the piecewise one in three conditions.

    Stiffness alone: the gap coordinate y goes from ``-amplitude`` to ``amplitude`` without a rate.
    With damping: the same at the constant rate ``amplitude * omega``. With a motion:
    y = amplitude sin(omega t) over a period, with its own rate.

    Parameters
    ----------
    spring
        The stop, with at least one finite gap.
    amplitude
        Largest y in m, beyond a gap.
    omega
        Frequency of the motion in rad/s.

    Returns
    -------
    tuple of LawComparison
        In the order above. The points are even in y or t, with more of them in the layers.

    Raises
    ------
    InputError
        When the motion reaches no gap, and as :func:`~flipflow.model.smooth.smooth_force` does.
    """
    if not min(spring.gaps) < amplitude < math.inf:
        remedy = f"give a finite amplitude beyond the gap of {min(spring.gaps):g} m"
        raise InputError("amplitude", amplitude, remedy)
    if not 0.0 < omega < math.inf:
        raise InputError("omega", omega, "give a finite frequency above 0 rad/s")
    width = math.log(1.0 / UNSWITCHED - 1.0) / SHARPNESS
    y = _course(spring, amplitude, width)
    up = np.arcsin(y / amplitude)
    phase = np.concatenate([up, np.pi - up[::-1]])
    conditions = (
        ("stiffness alone", y, np.zeros_like(y)),
        ("with damping", y, np.full_like(y, amplitude * omega)),
        ("with a motion", amplitude * np.sin(phase), amplitude * omega * np.cos(phase)),
    )
    first, second, third = (
        LawComparison(
            condition,
            displacement,
            velocity,
            spring.force(displacement, velocity),
            smooth_force(spring, displacement, velocity),
            width,
            _outside(spring, displacement, width),
        )
        for condition, displacement, velocity in conditions
    )
    return first, second, third


def _course(spring: ClearanceSpring, amplitude: float, width: float) -> Real:
    """Positions from -amplitude to amplitude, even, and dense in the layers."""
    y = np.linspace(-amplitude, amplitude, POINTS)
    layer = np.linspace(-2.0 * width, 2.0 * width, 401)
    plus, minus = spring.gaps
    dense = [e + layer for e in (plus, -minus) if math.isfinite(e)]
    together = np.unique(np.concatenate([y, *dense]))
    return np.asarray(together[np.abs(together) <= amplitude])


def _outside(spring: ClearanceSpring, y: Real, width: float) -> NDArray[np.bool_]:
    plus, minus = spring.gaps
    half = width / 2.0
    return np.asarray((np.abs(y - plus) > half) & (np.abs(y + minus) > half))
