"""A motion in time, from rest or any other state: what the machine and its shaft did."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from flipflow import __version__
from flipflow.compiled.arrays import Int, Real
from flipflow.errors import IncompleteError, InputError
from flipflow.model.arguments import LARGEST, checked_index, checked_reals
from flipflow.model.contact_law import WHOLE, force_in
from flipflow.model.system import Coordinate, MechanicalSystem
from flipflow.results.result import Result

FINITE = f"give finite numbers up to {LARGEST:g}, and nan where one is not known"


@dataclass(frozen=True)
class ContactChange:
    """A stop touched or left: time in s, spring, and its side then (+1, -1, 0 without force)."""

    t: float
    spring: int
    side: int


@dataclass(frozen=True, eq=False)
class History(Result):
    """A motion over time in SI units; n rows, N degrees of freedom, m springs.

    Where a contact changes the same time may stand twice: once before, once after.

    Parameters
    ----------
    system
        The machine.
    t
        Times in s, rising, (n,).
    x, v, a
        Displacement in m, velocity in m/s, acceleration in m/s^2 of each degree of freedom, (n, N).
    force
        Force H of each stop in N, positive against +d, (n, m).
    omega, angle
        Shaft speed in rad/s and shaft angle in rad, (n,).
    torque
        Torque of the motor at the shaft in N m, (n,); None where the speed is prescribed.
    normal
        Displacement, velocity, acceleration normal to the surface, (n, 3); None where not known.
    energy
        Over the whole time in J: ``"input"`` + ``"impulses"`` + ``"loads"`` = ``"dissipated"`` +
        ``"stored"`` (the change of what springs and masses hold).
    settled
        Whether the motion is periodic at the end; None where that was not looked at.
    distance
        How far it then is from the settled motion, in m.
    events
        Every change of contact.
    status
        How the calculation ended, a sentence.
    notes
        What was assumed or left out.
    method
        How the motion was calculated.
    counters
        Work done: ``"steps"``, ``"events"``, ``"rejected"``.
    version
        Version of flipflow.
    works
        Running totals in J of what stands in ``energy``, (n,) each, where they were kept.
    peak
        Greatest size of each stop's force since the row before in N, (n, m), where it was sought;
        in the first row that of its own force.
    repeats_after
        Turns after which the periodic motion ahead repeats; None where none is near, or none was
        looked for.
    """

    system: MechanicalSystem
    t: Real
    x: Real
    v: Real
    a: Real
    force: Real
    omega: Real
    angle: Real
    torque: Real | None = None
    normal: Real | None = None
    energy: Mapping[str, float] = field(default_factory=dict)
    settled: bool | None = None
    distance: float | None = None
    events: tuple[ContactChange, ...] = ()
    status: str = ""
    notes: tuple[str, ...] = ()
    method: str = ""
    counters: Mapping[str, int] = field(default_factory=dict)
    version: str = __version__
    works: Mapping[str, Real] = field(default_factory=dict)
    peak: Real | None = None
    repeats_after: int | None = None

    def __post_init__(self) -> None:
        for name in ("t", "x", "v", "a", "force", "omega", "angle", "torque", "normal", "peak"):
            values = getattr(self, name)
            if values is not None:
                # A view, so that the owner of the data keeps an array it can write to.
                kept = checked_reals(name, values, FINITE).view()
                if (np.abs(kept) > LARGEST).any():
                    raise InputError(name, values, FINITE)
                kept.setflags(write=False)
                object.__setattr__(self, name, kept)
        object.__setattr__(self, "energy", MappingProxyType(dict(self.energy)))
        object.__setattr__(self, "counters", MappingProxyType(dict(self.counters)))
        object.__setattr__(self, "works", MappingProxyType(dict(self.works)))

    def __getstate__(self) -> dict[str, object]:
        """Read-only mappings cannot be sent to another process: they go as dictionaries."""
        state = self.__dict__.items()
        return {key: dict(v) if isinstance(v, MappingProxyType) else v for key, v in state}

    def __setstate__(self, state: dict[str, object]) -> None:
        for key, value in state.items():
            frozen = MappingProxyType(value) if isinstance(value, dict) else value
            object.__setattr__(self, key, frozen)

    def __repr__(self) -> str:
        return f"History({self.t.size} times, {self.t[0]:.6g} to {self.t[-1]:.6g} s)"

    def displacement(self, which: Coordinate) -> Real:
        """Displacement of a coordinate in m, (n,)."""
        return np.asarray(self.x @ self.system.coordinate(which))

    def velocity(self, which: Coordinate) -> Real:
        """Velocity of a coordinate in m/s, (n,)."""
        return np.asarray(self.v @ self.system.coordinate(which))

    def acceleration(self, which: Coordinate) -> Real:
        """Acceleration of a coordinate in m/s^2, (n,)."""
        return np.asarray(self.a @ self.system.coordinate(which))

    def stop_force(self, spring: int = 0) -> Real:
        """Force H of a stop in N, positive against +d, (n,)."""
        count = self.force.shape[1]
        remedy = f"the machine has {count} springs, from 0 on"
        return self.force[:, checked_index("spring", spring, count, remedy)]

    @property
    def normal_displacement(self) -> Real:
        """Displacement y normal to the surface in m, (n,); with x1 it is the orbit."""
        if self.normal is None:
            raise IncompleteError(
                "The motion normal to the surface is not known: give the machine's "
                "normal_stiffness and normal_damping."
            )
        return np.asarray(self.normal[:, 0])

    @property
    def motor_power(self) -> Real:
        """Power that the motor gives to the shaft in W, (n,)."""
        if self.torque is None:
            raise IncompleteError("The speed is prescribed here: there is no motor and no power.")
        return np.asarray(self.torque * self.omega)


def thinned(history: History, most: int) -> History:
    """The history with about ``most`` rows at most, the last one kept; a note says so.

    Every k-th row stands, k odd: an even share of a turn would show the same phases every time.
    """
    rows = history.t.size
    if rows <= most:
        return history
    step = math.ceil(rows / most) | 1
    kept = np.append(np.arange(0, rows - 1, step), rows - 1)
    names = ("t", "x", "v", "a", "force", "omega", "angle", "torque", "normal")
    given = {name: getattr(history, name) for name in names}
    thin: dict[str, Any] = {
        name: None if values is None else values[kept] for name, values in given.items()
    }
    return replace(
        history,
        **thin,
        works={name: values[kept] for name, values in history.works.items()},
        peak=None
        if history.peak is None
        else np.maximum.reduceat(history.peak, np.concatenate([[0], kept[:-1] + 1])),
        notes=(*history.notes, f"Of {rows} calculated times one in {step} is kept."),
    )


def stop_forces(system: MechanicalSystem, x: Real, v: Real, regimes: Int) -> Real:
    """Force of each spring of the machine as given, (n, m), from x and x', (n, N).

    ``regimes`` has a column for each spring with a gap that can act.
    """
    force = np.zeros((x.shape[0], len(system.springs)))
    columns = iter(regimes.T)
    for j, spring in enumerate(system.springs):
        if not spring.acts:
            continue
        regime = np.full(x.shape[0], WHOLE) if spring.bonded else next(columns)
        y, rate = x @ spring.direction, v @ spring.direction
        of = spring.law, spring.stiffness, spring.damping, spring.gaps
        force[:, j] = force_in(*of, regime, y, rate)
    return force
