"""What lanes are to read for quantities of machines, and the quantities of what they read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from flipflow.batch.lane_columns import LaneColumns
from flipflow.batch.lane_readings import Asked, Readings
from flipflow.batch.slope_readings import SlopesAsked
from flipflow.batch.solutions import nothing_asked
from flipflow.batch.variants import Batch
from flipflow.compiled.arrays import Complex, Real
from flipflow.dynamics.motion import phase_of
from flipflow.dynamics.normal import normal_amplitude
from flipflow.model.contact_law import NUMBER
from flipflow.model.quantities import Quantity, leading_coordinate
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.system import Machine, MechanicalSystem
from flipflow.periodic.derivatives import SMOOTH_LAWS
from flipflow.studies.quantity_values import MOTION_VALUES, Vector, vector_terms

# Peaks of vectors by name, and the quantities that are read off them.
VECTORS: Mapping[Vector, tuple[str, ...]] = {
    "main": ("main_frame_acceleration",),
    "floating": ("floating_frame_acceleration",),
    "foundation": ("foundation_force", "support_force"),
    "shear": ("shear_piece_force",),
    "bearing": ("bearing_load", "bearing_life"),
}
OF_STOPS = ("stop_force", "stop_piece_force")
SQUARED = ("shear_piece_power", "shear_temperature_rise")


@dataclass(frozen=True, eq=False)
class LanePlan:
    """What lanes are to read at K frequencies."""

    machine: Machine
    batch: Batch
    fields: Mapping[str, Real]
    omega: Real
    quantities: tuple[Quantity, ...]

    @property
    def system(self) -> MechanicalSystem:
        """One of the machines."""
        return self.batch.system

    @cached_property
    def bonded(self) -> Real:
        """k d and c d of springs without gap whose forces are read, (L, B, 2, N)."""
        asked = {one.name for one in self.quantities} & set(OF_STOPS)
        return self.batch.bonded if asked else self.batch.bonded[:, :0]

    @property
    def bonded_share(self) -> float:
        """Share of the turn in which springs without gap act: all of it, where there are any."""
        return 1.0 if self.batch.bonded.shape[1] > 0 else 0.0

    @property
    def leading(self) -> Any:
        """The coordinate by which motions are compared."""
        return leading_coordinate(self.system)

    @cached_property
    def coordinates(self) -> list[tuple[float, ...]]:
        """Vectors of the coordinates that are read, each once; the leading one first."""
        names = {one.name for one in self.quantities}
        wanted: list[Any] = [self.leading]
        wanted += [one.coordinate for one in self.quantities if one.coordinate is not None]
        wanted += ["main"] if names & {"main_amplitude", "dissipated_power"} else []
        wanted += ["floating"] if "floating_amplitude" in names else []
        vectors = [tuple(self.system.coordinate(one).tolist()) for one in wanted]
        return list(dict.fromkeys(vectors))

    def place(self, which: Any) -> int:
        """Where a coordinate stands among those that are read."""
        return self.coordinates.index(tuple(self.system.coordinate(which).tolist()))

    @cached_property
    def vectors(self) -> list[Vector]:
        """The vectors whose peaks are read."""
        names = {one.name for one in self.quantities}
        return [vector for vector, needed in VECTORS.items() if names & set(needed)]

    @cached_property
    def asked(self) -> Asked:
        """What the lanes are to read."""
        squared = {one.name for one in self.quantities} & set(SQUARED)
        asked = nothing_asked(self.system.size, self.omega.size)._replace(
            coordinate=np.array(self.coordinates),
            squared=np.array([[1.0, -1.0]] if squared else []).reshape(-1, self.system.size),
        )
        lanes, bonded = self.bonded.shape[:2]
        peaks = len(self.vectors) + bonded
        if peaks == 0:
            return asked
        linear = np.zeros((lanes, peaks, 3, self.system.size))
        along, across = np.zeros((2, lanes, self.omega.size, peaks), np.complex128)
        for q, vector in enumerate(self.vectors):
            self._set_terms(
                vector, self.fields, self.normal, linear[:, q], along[:, :, q], across[:, :, q]
            )
        linear[:, len(self.vectors) :, :2] = self.bonded
        return asked._replace(linear=linear, along=along, across=across)

    def _set_terms(
        self, vector: Vector, fields: Mapping[str, Real], normal: Complex, linear: Real,
        along: Complex, across: Complex,
    ) -> None:  # fmt: skip
        """Coefficients (L, 3, 2) of x, x', x'' and harmonics (L, K) of one vector of a screen.

        Y is the amplitude ``normal`` to the surface.
        """
        field = fields.__getitem__
        terms, along[:], across[:] = vector_terms(vector, field, self.omega, normal, self.sense)
        for (derivative, degree), value in terms.items():
            linear[:, derivative, degree] = np.ravel(value)

    def slopes_wanted(self, names: Sequence[str], changes: LaneColumns) -> SlopesAsked:
        """What lanes are to differentiate with respect to P parameters."""
        asked = self.asked
        quantities = {one.name for one in self.quantities}
        phases = {one.name for one in self.quantities if one.unit == "rad" or one.part == "phase"}
        linear = np.zeros((*asked.linear.shape, len(names)))
        along, across = np.zeros((2, *asked.along.shape, len(names)), np.complex128)
        for p, name in enumerate(names):
            for q, vector in enumerate(self.vectors):
                self._set_changes(vector, name, linear[:, q, ..., p], along[:, :, q, p],
                                  across[:, :, q, p])  # fmt: skip
        if self.bonded.shape[1] > 0:
            linear[:, len(self.vectors) :, :2] = changes.bonded
        laws = np.isin(self.batch.arrays.stops.law, [NUMBER[law] for law in SMOOTH_LAWS])
        return SlopesAsked(
            linear=linear,
            along=along,
            across=across,
            means=bool(phases or quantities & {*SQUARED, "dissipated_power"}),
            contacts=bool(quantities & {"contact_share", "stop_approach_speed"}),
            multipliers="largest_multiplier" in quantities,
            even=changes.keeps_mirror,
            corner=np.where(laws, 0, 1),
        )

    def _set_changes(
        self, vector: Vector, name: str, linear: Real, along: Complex, across: Complex
    ) -> None:
        """How a vector's terms change with a field: they are at most quadratic in it and in Y."""
        if name not in self.fields:
            return
        own = self.fields[name]
        width = np.where(own != 0.0, 0.5 * np.abs(own), 1.0)
        for side in (1.0, -1.0):
            fields = dict(self.fields) | {name: own + side * width}
            normal = self.normal + side * width * self.normal_slope(name)
            ends = np.zeros(linear.shape), np.zeros_like(along), np.zeros_like(across)
            self._set_terms(vector, fields, normal, *ends)
            linear += side * ends[0] / (2.0 * width.reshape(-1, 1, 1))
            along += side * ends[1] / (2.0 * width)
            across += side * ends[2] / (2.0 * width)

    def normal_slope(self, name: str) -> Complex:
        """dY/dp with respect to a field: Y = -i s m0r w^2 / D, D = k - w^2 m + i w c."""
        f, w = self.fields, self.omega
        own = {one: float(one == name) for one in f}
        mass, mass_slope = (
            one["main_mass"] + one["floating_mass"] for one in (f, own)
        )  # fmt: skip
        D = f["normal_stiffness"] - w**2 * mass + 1j * w * f["normal_damping"]
        slope = own["normal_stiffness"] - w**2 * mass_slope + 1j * w * own["normal_damping"]
        change = own["eccentric_moment"] - f["eccentric_moment"] * slope / D
        return np.asarray(-1j * self.sense * w**2 * change / D)

    @property
    def sense(self) -> float:
        """+1 or -1, as the unbalance turns."""
        return self.machine.normal_sense if isinstance(self.machine, FlipFlowScreen) else 1.0

    @cached_property
    def normal(self) -> Complex:
        """Y in m, both frames as one mass normal to the surface."""
        f = self.fields
        mass = f["main_mass"] + f["floating_mass"]
        Y = normal_amplitude(
            mass, f["normal_damping"], f["normal_stiffness"], f["eccentric_moment"], self.omega
        )
        return np.asarray(self.sense * Y)


@dataclass(frozen=True, eq=False)
class LaneMotions:
    """The motions of L lanes at K frequencies; every answer is (L, K)."""

    plan: LanePlan
    read: Readings
    multiplier: Complex  # (L, K, 2 N)

    @property
    def omega(self) -> Real:
        """Frequencies in rad/s, (K,)."""
        return self.plan.omega

    def value(self, quantity: Quantity) -> Real:
        """One quantity."""
        if quantity.part is not None and quantity.coordinate is not None:
            return np.asarray(getattr(self, quantity.part)(quantity.coordinate))
        told = MOTION_VALUES[quantity.name](self)
        return np.array(np.broadcast_to(told, self.read.approach.shape))

    def field(self, name: str) -> Real:
        return self.plan.fields[name]

    def amplitude(self, which: Any) -> Real:
        g = self.plan.place(which)
        return np.asarray(0.5 * (self.read.high[..., g] - self.read.low[..., g]))

    def phase(self, which: Any) -> Real:
        first = self.read.first[..., self.plan.place(which)]
        return phase_of(first, self.amplitude(which))

    def offset(self) -> Real:
        g = self.plan.place("relative")
        return np.abs(0.5 * (self.read.high[..., g] + self.read.low[..., g]))

    def reach(self) -> Real:
        g = self.plan.place("relative")
        return np.maximum(self.read.high[..., g], -self.read.low[..., g])

    def normal_amplitude(self) -> Real:
        return np.abs(self.plan.normal)

    def peak(self, vector: Vector) -> Real:
        return self.read.peak[..., self.plan.vectors.index(vector)]

    def stop_force(self) -> Real:
        always = self.read.peak[..., len(self.plan.vectors) :]
        forces = np.concatenate([self.read.force, always], axis=2)
        return np.asarray(forces.max(axis=2, initial=0.0))

    def shear_power(self) -> Real:
        return np.asarray(self.field("shear_damping") * self.read.square[..., 0])

    def approach_speed(self) -> Real:
        return self.read.approach

    def longest_contact(self) -> Real:
        shares = self.read.share.max(axis=2, initial=self.plan.bonded_share)
        no_motion = np.isnan(self.read.approach)
        return np.where(no_motion, np.nan, shares)

    def largest_multiplier(self) -> Real:
        return np.asarray(np.abs(self.multiplier).max(axis=2))

    def dissipated_power(self) -> Real:
        X = self.read.first[..., self.plan.place("main")]
        force = self.field("eccentric_moment") * self.omega**2
        across = self.field("normal_damping") * (self.omega * np.abs(self.plan.normal)) ** 2
        return np.asarray(0.5 * (across - self.omega * force * X.imag))

    def jump_margin(self) -> Real:
        return np.full(self.read.approach.shape, np.nan)
