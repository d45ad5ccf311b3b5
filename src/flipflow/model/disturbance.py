"""What may befall a running machine: a blow, a step of load, a lump of material."""

from __future__ import annotations

from dataclasses import dataclass

from flipflow.errors import InputError
from flipflow.model.arguments import (
    checked_at_least_zero,
    checked_kind,
    checked_number,
    checked_positive,
    checked_word,
)
from flipflow.model.screen import Load, refuse_air
from flipflow.model.system import Coordinate, checked_coordinate

MOST_IMPULSE = 1e6


@dataclass(frozen=True)
class Impulse:
    """A blow: the momentum of a coordinate's degrees of freedom changes at once.

    Velocities change by M^-1 d J, d being the coordinate's vector: a blow of J kg m/s on "main"
    changes the main frame's velocity by J / m1.

    Parameters
    ----------
    t
        When, in s.
    which
        The coordinate: "main", "floating", "relative" or an index.
    impulse
        J in kg m/s, positive along the coordinate.
    """

    t: float
    which: Coordinate
    impulse: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", _time(self.t))
        checked_coordinate(self.which)
        remedy = f"give a finite impulse of at most {MOST_IMPULSE:g} kg m/s"
        impulse = checked_number("impulse", self.impulse, remedy)
        if abs(impulse) > MOST_IMPULSE:
            raise InputError("impulse", self.impulse, remedy)
        object.__setattr__(self, "impulse", impulse)


@dataclass(frozen=True)
class LoadStep:
    """A step of load: springs and masses change at once, displacements and velocities do not.

    Carried mass joins at the speed its frame has then. Where the deck angle is known its weight
    hangs on the springs from then on: displacements still count from where the machine hung before,
    and its work is part of what is put in.

    Parameters
    ----------
    t
        When, in s.
    load
        What is added to the load carried so far.
    """

    t: float
    load: Load

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", _time(self.t))
        checked_kind("load", self.load, Load, "give an ff.Load, as ff.Load(main_mass=50)")
        refuse_air(self.load)


@dataclass(frozen=True)
class Lump:
    """A lump of material that lands on a frame and stays there.

    Momentum along the surface is kept: the frame's velocity v becomes (m v + mass u) / (m + mass).
    Its weight hangs on the springs as that of a :class:`LoadStep`.

    Parameters
    ----------
    t
        When, in s.
    frame
        "main" or "floating".
    mass
        In kg.
    velocity
        u, the lump's velocity along the surface in m/s before it lands.
    """

    t: float
    frame: str
    mass: float
    velocity: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", _time(self.t))
        checked_word("frame", self.frame, ("main", "floating"))
        object.__setattr__(self, "mass", checked_positive("mass", self.mass, "kg"))
        velocity = checked_number("velocity", self.velocity, "give a finite velocity in m/s")
        object.__setattr__(self, "velocity", velocity)


Disturbance = Impulse | LoadStep | Lump


def _time(t: object) -> float:
    return checked_at_least_zero("t", t, "s")
