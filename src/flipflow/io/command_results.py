"""What commands find that is more than one result, as their JSON documents hold it."""

from __future__ import annotations

from dataclasses import dataclass

from flipflow.studies.ramp import LateJump
from flipflow.transient.startup import RunUp
from flipflow.transient.sweep import Sweep


@dataclass(frozen=True, eq=False)
class Startup:
    """What ``flipflow startup`` finds.

    Parameters
    ----------
    name
        Of the machine.
    start
        The machine's start.
    coast_down
        Its coast-down; None where working speed was not reached.
    """

    name: str
    start: RunUp
    coast_down: RunUp | None = None


@dataclass(frozen=True)
class Glide:
    """A sweep that did not wait, without its motion.

    Parameters
    ----------
    rate
        In rad/s^2, negative where the speed falls.
    to
        Where it ended, rad/s.
    complete
        Whether that is where it should.
    """

    rate: float
    to: float
    complete: bool


@dataclass(frozen=True, eq=False)
class Sweeps:
    """What ``flipflow sweep`` finds.

    Parameters
    ----------
    name
        Of the machine.
    up, down
        With the speed rising, then falling; None where Ctrl-C came before.
    late, glides
        Where glides jump, and how far they came.
    complete
        Whether all of it was done.
    """

    name: str
    up: Sweep
    down: Sweep | None
    late: tuple[LateJump, ...]
    glides: tuple[Glide, ...]
    complete: bool
