"""Quantities of lanes with their derivatives in the imaginary parts, as of a tilted motion.

Where the greatest of several numbers is asked and two are as great and move differently, the
derivative is NaN.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from flipflow.batch.lane_readings import Readings
from flipflow.batch.slope_readings import AGREE, TIED, Slopes
from flipflow.compiled.arrays import Complex, Real
from flipflow.dynamics.motion import phase_of
from flipflow.model.quantities import Quantity
from flipflow.studies.lane_quantities import LanePlan
from flipflow.studies.quantity_values import MOTION_VALUES, Vector
from flipflow.studies.tilted_motion import TILT, beside_zero, size_of_multiplier


@dataclass(frozen=True, eq=False)
class TiltedLanes:
    """The motions of L lanes at K frequencies; every answer is (L, K, P), its value in each column.

    Parameters
    ----------
    plan
        What was read.
    names
        The P parameters.
    read, multiplier, slopes
        Readings, Floquet multipliers (L, K, 2 N), and the derivatives of both.
    """

    plan: LanePlan
    names: Sequence[str]
    read: Readings
    multiplier: Complex
    slopes: Slopes

    def slope(self, quantity: Quantity) -> Real:
        """Derivatives of one quantity, (L, K, P)."""
        if quantity.part is not None and quantity.coordinate is not None:
            told = getattr(self, quantity.part)(quantity.coordinate)
        else:
            formula = cast("Callable[[Any], Complex]", MOTION_VALUES[quantity.name])
            with np.errstate(divide="ignore", invalid="ignore"):  # of what has no derivative
                told = formula(self)
        shape = *self.read.approach.shape, len(self.names)
        return np.array(np.broadcast_to(np.asarray(told, np.complex128).imag / TILT, shape))

    @property
    def omega(self) -> Real:
        """Frequencies in rad/s, (K, 1)."""
        return self.plan.omega[:, None]

    def field(self, name: str) -> Complex:
        """A field of the screens."""
        own = np.array([one == name for one in self.names], float)
        return np.asarray(self.plan.fields[name][..., None] + 1j * TILT * own)

    def amplitude(self, which: Any) -> Complex:
        low, high = self._extremes(which)
        return np.asarray(0.5 * (high - low))

    def phase(self, which: Any) -> Complex:
        harmonic, slope = self._first(which)
        with np.errstate(invalid="ignore", divide="ignore"):  # what does not move has no phase
            turned = (slope / harmonic).imag
        phase = phase_of(harmonic, self.amplitude(which).real)
        return np.asarray(phase + 1j * TILT * np.where(np.isnan(phase), np.nan, turned))

    def offset(self) -> Complex:
        low, high = self._extremes("relative")
        mean = 0.5 * (high + low)
        offset = np.where(mean.real < 0.0, -mean, mean)
        offset.imag[beside_zero(mean, high, low)] = np.nan
        return offset

    def reach(self) -> Complex:
        low, high = self._extremes("relative")
        return _greatest(np.stack([high, -low]))

    def normal_amplitude(self) -> Complex:
        k, c = self.field("normal_stiffness"), self.field("normal_damping")
        spring = k - self.omega**2 * (self.field("main_mass") + self.field("floating_mass"))
        force = self.field("eccentric_moment") * self.omega**2
        return np.asarray(force / np.sqrt(spring**2 + (self.omega * c) ** 2))

    def peak(self, vector: Vector) -> Complex:
        q = self.plan.vectors.index(vector)
        return _tilted(self.read.peak[..., q], self.slopes.peak[..., q, :])

    def stop_force(self) -> Complex:
        always = slice(len(self.plan.vectors), None)
        values = np.concatenate([self.read.force, self.read.peak[..., always]], axis=2)
        slopes = np.concatenate([self.slopes.force, self.slopes.peak[..., always, :]], axis=2)
        forces = _tilted(values, slopes)
        none = np.zeros((1, *forces.shape[:2], forces.shape[3]), np.complex128)
        return _greatest(np.concatenate([none, np.moveaxis(forces, 2, 0)]))

    def shear_power(self) -> Complex:
        square = _tilted(self.read.square[..., 0], self.slopes.square[..., 0, :])
        return np.asarray(self.field("shear_damping") * square)

    def approach_speed(self) -> Complex:
        return _tilted(self.read.approach, self.slopes.approach)

    def longest_contact(self) -> Complex:
        shares = np.moveaxis(_tilted(self.read.share, self.slopes.share), 2, 0)
        least = np.full((1, *shares.shape[1:]), self.plan.bonded_share, np.complex128)
        return _greatest(np.concatenate([least, shares]))

    def largest_multiplier(self) -> Complex:
        sizes = size_of_multiplier(self.multiplier[..., None], self.slopes.multiplier)
        return _greatest(np.moveaxis(sizes, 2, 0))

    def dissipated_power(self) -> Complex:
        harmonic, slope = self._first("main")
        force = self.field("eccentric_moment") * self.omega**2
        across = self.field("normal_damping") * (self.omega * self.normal_amplitude()) ** 2
        out_of_phase = harmonic.imag + 1j * TILT * slope.imag
        return np.asarray(0.5 * (across - self.omega * force * out_of_phase))

    def jump_margin(self) -> Complex:
        return np.full(self.slopes.approach.shape, np.nan, np.complex128)

    def _extremes(self, which: Any) -> tuple[Complex, Complex]:
        """Least and greatest value of a coordinate."""
        g = self.plan.place(which)
        low = _tilted(self.read.low[..., g], self.slopes.low[..., g, :])
        return low, _tilted(self.read.high[..., g], self.slopes.high[..., g, :])

    def _first(self, which: Any) -> tuple[Complex, Complex]:
        """First harmonic of a coordinate, and its derivatives."""
        g = self.plan.place(which)
        return self.read.first[..., g, None], self.slopes.first[..., g, :]


def _tilted(values: Real, slopes: Real) -> Complex:
    """Numbers (...) with derivatives (..., P): one without a derivative stays a number."""
    found = np.empty(slopes.shape, np.complex128)
    found.real, found.imag = values[..., None], TILT * slopes
    return found


def _greatest(choices: Complex) -> Complex:
    """The greatest of the first axis; its derivative is NaN where one as great has another."""
    best = np.take_along_axis(choices, choices.real.argmax(axis=0)[None], axis=0)[0].copy()
    near = choices.real >= best.real - TIED * np.abs(best.real)
    unknown = np.isnan(choices.imag)
    apart = np.abs(choices.imag - best.imag)
    size = np.maximum(np.abs(choices.imag), np.abs(best.imag))
    torn = (near & (unknown | (apart > AGREE * size))).any(axis=0)
    best.imag[torn] = np.nan
    return np.asarray(best)
