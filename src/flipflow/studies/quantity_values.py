"""Quantities of motions, evaluated: one formula each, for one motion or for arrays of them.

What each quantity is and needs stands in :mod:`flipflow.model.quantities`. Acceleration and
foundation force are judged on both directions together.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Complex, Real
from flipflow.dynamics.contact_free import contact_free, state_matrix
from flipflow.dynamics.motion import longest_on
from flipflow.dynamics.normal import NormalMotion, normal_amplitude, normal_motion, peak_of_both
from flipflow.model.constants import GRAVITY
from flipflow.model.fields import FIELD
from flipflow.model.parameters import value_of
from flipflow.model.quantities import QUANTITIES, Quantity
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.system import Machine
from flipflow.periodic.orbit import Orbit
from flipflow.results.result import Frozen

Values = float | Real
Harmonics = complex | NDArray[Any]
# What has a greatest length: accelerations of the frames, forces of springs and on the bearings.
Vector = Literal["main", "floating", "foundation", "shear", "bearing"]
EVEN = 1e-9  # offset over amplitude below which a motion is about the middle but for rounding
Coordinate = Literal["main", "floating", "relative"]
FRAMES: tuple[Coordinate, ...] = "main", "floating"  # in the order of the degrees of freedom


class Motions(Protocol):
    """What a quantity is read off: one motion of a machine, or many of many screens.

    Every answer is a number for one motion and an array over motions for many; NaN where the
    screen lacks data, or the machine is none.
    """

    @property
    def omega(self) -> Values:
        """Frequency in rad/s."""
        ...

    def field(self, name: str) -> Values:
        """A field of the screen, SI."""
        ...

    def amplitude(self, which: Coordinate) -> Values:
        """Half peak-to-peak of a coordinate in m."""
        ...

    def phase(self, which: Coordinate) -> Values:
        """Phase of the first harmonic against the exciting force in rad; positive: it leads."""
        ...

    def offset(self) -> Values:
        """How far the middle of the relative motion lies beside zero, in m."""
        ...

    def reach(self) -> Values:
        """Greatest size of the relative displacement in m."""
        ...

    def normal_amplitude(self) -> Values:
        """Amplitude normal to the surface in m."""
        ...

    def peak(self, vector: Vector) -> Values:
        """Greatest length of a vector in SI, both directions together.

        Of the acceleration of a frame, or of the force of the isolation springs, of all shear
        springs, or on all exciter bearings.
        """
        ...

    def stop_force(self) -> Values:
        """Greatest force of the stop springs of one side in N."""
        ...

    def shear_power(self) -> Values:
        """Mean power of all shear springs in W."""
        ...

    def approach_speed(self) -> Values:
        """Greatest relative speed in m/s at which a contact begins; 0 without contact."""
        ...

    def longest_contact(self) -> Values:
        """Greatest share of the turn during which a stop has a force, 0 to 1."""
        ...

    def largest_multiplier(self) -> Values:
        """Size of the largest Floquet multiplier of the period."""
        ...

    def dissipated_power(self) -> Values:
        """Mean power that all dampers take, both directions together, in W."""
        ...

    def jump_margin(self) -> Values:
        """Distance from the nearest fold as a share of its frequency.

        0 between the two folds of a jump, infinite without folds.
        """
        ...


MOTION_VALUES: Mapping[str, Callable[[Motions], Values]] = {
    "relative_amplitude": lambda m: m.amplitude("relative"),
    "stroke": lambda m: 2.0 * m.amplitude("relative"),
    "main_amplitude": lambda m: m.amplitude("main"),
    "floating_amplitude": lambda m: m.amplitude("floating"),
    "relative_offset": lambda m: beyond_rounding(m.offset(), m.amplitude("relative")),
    "relative_phase": lambda m: m.phase("relative"),
    "main_frame_acceleration": lambda m: m.peak("main"),
    "floating_frame_acceleration": lambda m: m.peak("floating"),
    "shear_strain": lambda m: m.reach() / m.field("shear_height"),
    "stop_force": lambda m: m.stop_force(),
    "shear_piece_force": lambda m: m.peak("shear") / m.field("shear_pieces"),
    "shear_piece_power": lambda m: m.shear_power() / m.field("shear_pieces"),
    "shear_temperature_rise": lambda m: (
        m.shear_power() / (m.field("shear_pieces") * m.field("shear_conductance"))
    ),
    "stop_piece_force": lambda m: m.stop_force() / m.field("stop_pieces"),
    "stop_approach_speed": lambda m: m.approach_speed(),
    "contact_share": lambda m: m.longest_contact(),
    "foundation_force": lambda m: m.peak("foundation"),
    "support_force": lambda m: m.peak("foundation") / m.field("supports"),
    "exciter_force": lambda m: m.field("eccentric_moment") * m.omega**2,
    "bearing_force": lambda m: m.field("eccentric_moment") * m.omega**2 / m.field("bearings"),
    "bearing_load": lambda m: m.peak("bearing") / m.field("bearings"),
    "bearing_life": lambda m: rated_life(
        m.field("bearing_rating"),
        m.field("bearing_load_factor") * m.peak("bearing") / m.field("bearings"),
        m.field("bearing_life_exponent"),
        m.omega,
    ),
    "dissipated_power": lambda m: m.dissipated_power(),
    "jump_margin": lambda m: m.jump_margin(),
    "largest_multiplier": lambda m: m.largest_multiplier(),
    "throw_number": lambda m: (
        m.omega**2 * m.normal_amplitude() / (GRAVITY * np.cos(m.field("deck_angle")))
    ),
}


def beyond_rounding(offset: Values, amplitude: Values) -> Values:
    """An offset; 0 where it is what rounding leaves of a motion about the middle.

    Such a rest would be another on every processor.
    """
    return np.where(np.less_equal(offset, EVEN * np.asarray(amplitude)), 0.0, offset)


def rated_life(rating: Values, load: Values, exponent: Values, omega: Values) -> Values:
    r"""Basic rated life in s of a rolling bearing, ISO 281: 1e6 turns (C / P)^p.

    With the speed n in rpm this is :math:`L_{10h} = 10^6 / (60 n) (C / P)^p` hours.

    Parameters
    ----------
    rating, load
        C and the equivalent load P in N.
    exponent
        p.
    omega
        Speed of the shaft in rad/s.
    """
    with np.errstate(divide="ignore"):
        share = np.divide(rating, load)
    return np.asarray(1e6 * (2.0 * math.pi / omega) * share**exponent)


@dataclass(frozen=True, eq=False)
class Working(Frozen):
    """A machine in one periodic motion, solved for.

    Parameters
    ----------
    machine
        The machine; a screen as loaded.
    orbit
        Its motion; of a screen, along the surface.
    jumps
        Frequencies in rad/s of the folds of its branch.
    """

    machine: Machine
    orbit: Orbit
    jumps: tuple[float, ...] = ()

    def value(self, name: str) -> float | None:
        """A quantity of a screen by name, SI; None where the screen lacks data that it needs."""
        return self.value_of(QUANTITIES[name])

    def value_of(self, quantity: Quantity) -> float | None:
        """A quantity that the machine has, SI; None where a screen lacks data that it needs."""
        if quantity.part is not None and quantity.coordinate is not None:
            return float(getattr(self.orbit, quantity.part)(quantity.coordinate))
        if quantity.missing(self.machine):
            return None
        return float(MOTION_VALUES[quantity.name](self))

    @property
    def screen(self) -> FlipFlowScreen | None:
        """The machine where it is a screen, of which more is known than the motion tells."""
        return self.machine if isinstance(self.machine, FlipFlowScreen) else None

    @cached_property
    def stops(self) -> tuple[int, ...]:
        """Indices of the stops that can ever act."""
        springs = self.machine.system().springs
        return tuple(j for j, spring in enumerate(springs) if spring.acts)

    @property
    def omega(self) -> float:
        """Frequency in rad/s."""
        return self.orbit.omega

    @cached_property
    def normal(self) -> NormalMotion | None:
        """Motion normal to the surface, None where its data are missing."""
        return normal_motion(self.machine, self.omega)

    def field(self, name: str) -> float:
        return number_or_nan(None if self.screen is None else getattr(self.screen, name))

    def amplitude(self, which: Coordinate) -> float:
        return self.orbit.amplitude(which)

    def phase(self, which: Coordinate) -> float:
        return self.orbit.phase(which)

    def offset(self) -> float:
        return abs(self.orbit.mean("relative"))

    def reach(self) -> float:
        return self.orbit.amplitude("relative") + self.offset()

    def normal_amplitude(self) -> float:
        return math.nan if self.normal is None else self.normal.amplitude

    def stop_force(self) -> float:
        return max((self.orbit.stop_force_peak(j) for j in self.stops), default=0.0)

    def shear_power(self) -> float:
        return self.field("shear_damping") * self.orbit.mean_square_velocity("relative")

    def approach_speed(self) -> float:
        begins = [touch.start for touch in self.orbit.contact_intervals]
        speeds = np.abs(self.orbit.velocity("relative", begins)) if begins else np.zeros(1)
        return float(speeds.max())

    def longest_contact(self) -> float:
        return max((self.orbit.contact_share(j) for j in self.stops), default=0.0)

    def largest_multiplier(self) -> float:
        return float(np.abs(self.orbit.multipliers[0]))

    def dissipated_power(self) -> float:
        if self.screen is None:
            return self.orbit.input_power()
        return math.nan if self.normal is None else self.orbit.input_power() + self.normal.power

    def jump_margin(self) -> float:
        zones = zip(self.jumps[::2], self.jumps[1::2], strict=False)
        if any(min(zone) <= self.omega <= max(zone) for zone in zones):
            return 0.0
        return min((abs(self.omega - jump) / jump for jump in self.jumps), default=math.inf)

    def peak(self, vector: Vector) -> float:
        Y = math.nan if self.normal is None else self.normal.complex_amplitude
        sense = 1.0 if self.screen is None else self.screen.normal_sense
        terms, along, across = vector_terms(vector, self.field, self.omega, Y, sense)
        linear = np.zeros((3, self.orbit.system.size))
        for place, value in terms.items():
            linear[place] = value
        if not np.isfinite([*linear.ravel(), along, across]).all():
            return math.nan
        return longest_on(self.orbit.motion, linear, 0.0, complex(along), complex(across))


def vector_terms(
    vector: Vector, field: Callable[[str], Values], omega: Values, normal: Harmonics, sense: float
) -> tuple[dict[tuple[int, int], Values], Harmonics, Harmonics]:
    """A vector of a screen along its surface and normal to it, by the name of what it is.

    Coefficients of derivatives of degrees of freedom, by (derivative, degree), and the harmonics A
    and B of :mod:`flipflow.dynamics.pieces`; ``normal`` is Y.
    """
    if vector in FRAMES:
        return {(2, FRAMES.index(vector)): 1.0}, 0.0, -(omega**2) * normal
    if vector == "foundation":
        k, c = field("isolation_stiffness"), field("isolation_damping")
        across = field("normal_stiffness") + 1j * omega * field("normal_damping")
        return {(0, 0): k, (1, 0): c}, 0.0, across * normal
    if vector == "shear":
        k, c = field("shear_stiffness"), field("shear_damping")
        return {(0, 0): k, (0, 1): -k, (1, 0): c, (1, 1): -c}, 0.0, 0.0
    # The frame's acceleration of the rotating mass comes through the bearings, too.
    force, mass = field("eccentric_moment") * omega**2, field("rotating_mass")
    return {(2, 0): -mass}, force, -1j * sense * force + mass * omega**2 * normal


def fields_of_rows(machine: Machine, columns: Mapping[str, NDArray[Any]]) -> dict[str, Real]:
    """Fields of variants of a screen: numbers, but for columns, (S, 1); NaN where there is none."""
    own = {name: column.astype(float)[:, None] for name, column in columns.items() if name in FIELD}
    return {name: own.get(name, np.asarray(value_of(machine, name), float)) for name in FIELD}


@dataclass(frozen=True, eq=False)
class ContactFree(Frozen):
    """S screens that touch no stop, at K frequencies, in closed form; every answer is (S, K).

    Parameters
    ----------
    fields
        Fields of the screens in SI, each (S, 1) or one number; NaN where there is none.
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
    def receptance(self) -> Complex:
        """X1 and X2 = X1 - Xf over the force on the main frame in m/N, (S, K, 2).

        These are what isolation and shear springs see; each stiffness stands in one entry of the
        matrix, so that stiff springs cost no digits.
        """
        return contact_free(*self._matrices, np.array([1.0, 0.0]), self.omega)

    @cached_property
    def _matrices(self) -> tuple[Real, Real, Real]:
        """M, C, K of x1 and x2 = x1 - xf, (..., 2, 2)."""
        f = self.fields
        m1, m2 = f["main_mass"], f["floating_mass"]
        M = _symmetric(m1 + m2, -m2, m2)
        C = _symmetric(f["isolation_damping"], 0.0, f["shear_damping"])
        K = _symmetric(f["isolation_stiffness"], 0.0, f["shear_stiffness"])
        return M, C, K

    @cached_property
    def main(self) -> Complex:
        """X1 in m."""
        return np.asarray(self.receptance[..., 0] * self.force)

    @cached_property
    def relative(self) -> Complex:
        """X2 = X1 - Xf in m."""
        return np.asarray(self.receptance[..., 1] * self.force)

    @cached_property
    def normal(self) -> Complex:
        """Y in m, both frames as one mass normal to the surface."""
        f = self.fields
        mass, moment = f["main_mass"] + f["floating_mass"], f["eccentric_moment"]
        return normal_amplitude(
            mass, f["normal_damping"], f["normal_stiffness"], moment, self.omega
        )

    def field(self, name: str) -> Real:
        return self.fields[name]

    def coordinate(self, which: Coordinate) -> Complex:
        """Complex amplitude of a coordinate in m."""
        if which == "floating":
            return np.asarray(self.main - self.relative)
        return self.main if which == "main" else self.relative

    def amplitude(self, which: Coordinate) -> Real:
        return np.abs(self.coordinate(which))

    def phase(self, which: Coordinate) -> Real:
        return np.angle(self.coordinate(which))

    def offset(self) -> Real:
        return np.zeros(self.force.shape)

    def reach(self) -> Real:
        return self.amplitude("relative")

    def normal_amplitude(self) -> Real:
        return np.abs(self.normal)

    def peak(self, vector: Vector) -> Real:
        if vector == "shear":  # through X2, in which stiff springs cost no digits
            f = self.fields
            stiffness = f["shear_stiffness"] + 1j * self.omega * f["shear_damping"]
            return np.abs(stiffness * self.relative)
        terms, along, across = vector_terms(vector, self.field, self.omega, self.normal, 1.0)
        for (derivative, degree), value in terms.items():
            X = self.coordinate(FRAMES[degree])
            along = along + value * (1j * self.omega) ** derivative * X
        return peak_of_both(np.asarray(along), np.asarray(across))

    def stop_force(self) -> Real:
        return np.zeros(self.force.shape)

    def shear_power(self) -> Real:
        speed = self.omega * np.abs(self.relative)
        return np.asarray(0.5 * self.fields["shear_damping"] * speed**2)

    def approach_speed(self) -> Real:
        return np.zeros(self.force.shape)

    def longest_contact(self) -> Real:
        return np.zeros(self.force.shape)

    def largest_multiplier(self) -> Real:
        slowest = np.linalg.eigvals(state_matrix(*self._matrices)).real.max(axis=-1)
        return np.asarray(np.exp(2.0 * math.pi / self.omega * slowest))

    def dissipated_power(self) -> Real:
        parts = (
            ("isolation_damping", self.main),
            ("shear_damping", self.relative),
            ("normal_damping", self.normal),
        )
        taken = sum(self.fields[name] * np.abs(X) ** 2 for name, X in parts)
        return np.asarray(0.5 * self.omega**2 * taken)

    def jump_margin(self) -> Real:
        return np.full(self.force.shape, math.inf)


def number_or_nan(value: float | None) -> float:
    """A value, or NaN in place of none."""
    return math.nan if value is None else float(value)


def _symmetric(first: Real, off: Real | float, last: Real) -> Real:
    """Matrices of two degrees of freedom, (..., 2, 2)."""
    a, b, d = np.broadcast_arrays(first, off, last)
    return np.stack([np.stack([a, b], axis=-1), np.stack([b, d], axis=-1)], axis=-2)
