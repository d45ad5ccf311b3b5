"""What commands find that is more than one result, as their JSON documents hold it."""

from __future__ import annotations

from dataclasses import dataclass

from flipflow.studies.ramp import LateJump
from flipflow.transient.run_up import RunUp
from flipflow.transient.sweep import Sweep


@dataclass(frozen=True, eq=False)
class Startup:
    """A machine's start, and its coast-down where working speed was reached."""

    name: str
    start: RunUp
    coast_down: RunUp | None = None


@dataclass(frozen=True)
class Glide:
    """A sweep that did not wait, without its motion: rate in rad/s^2, last speed in rad/s."""

    rate: float
    to: float
    complete: bool


@dataclass(frozen=True, eq=False)
class Sweeps:
    """Sweeps with the speed rising, then falling; how late glides jump, and how far they came.

    What Ctrl-C ended has no ``down``, or is not ``complete``.
    """

    name: str
    up: Sweep
    down: Sweep | None
    late: tuple[LateJump, ...]
    glides: tuple[Glide, ...]
    complete: bool
