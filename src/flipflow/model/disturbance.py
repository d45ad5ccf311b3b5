"""What may befall a running machine: a blow, a step of load, a lump of material."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flipflow.errors import InputError
from flipflow.model.screen import Load
from flipflow.model.system import Coordinate

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
        _check_time(self.t)
        if not (math.isfinite(self.impulse) and abs(self.impulse) <= MOST_IMPULSE):
            raise InputError(
                "impulse", self.impulse, f"give a finite impulse of at most {MOST_IMPULSE:g} kg m/s"
            )


@dataclass(frozen=True)
class LoadStep:
    """A step of load: springs and masses change at once, displacements and velocities do not.

    Carried mass joins at the speed its frame has then.

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
        _check_time(self.t)


@dataclass(frozen=True)
class Lump:
    """A lump of material that lands on a frame and stays there.

    Momentum along the surface is kept: the frame's velocity v becomes (m v + mass u) / (m + mass).

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
        _check_time(self.t)
        if self.frame not in ("main", "floating"):
            raise InputError("frame", self.frame, 'choose "main" or "floating"')
        if not (math.isfinite(self.mass) and self.mass > 0.0):
            raise InputError("mass", self.mass, "give a mass above 0 kg")
        if not math.isfinite(self.velocity):
            raise InputError("velocity", self.velocity, "give a finite velocity in m/s")


Disturbance = Impulse | LoadStep | Lump


def _check_time(t: float) -> None:
    if not (math.isfinite(t) and t >= 0.0):
        raise InputError("t", t, "give a time from 0 s on")
