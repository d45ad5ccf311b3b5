"""A start or a coast-down: what became of it, and how hard it was on the machine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from flipflow.model.constants import RPM
from flipflow.model.drive import Drive, SpeedProfile
from flipflow.model.system import Machine
from flipflow.results.history import History

Outcome = Literal[
    "reached", "captured", "short", "not started", "unfinished", "stopped", "followed"
]
AT_SPEED = 0.95  # of the working speed: a motor's slip differs with its load


@dataclass(frozen=True)
class Peak:
    """The greatest value of a quantity on the way, in SI, with the speed in rad/s and time in s."""

    value: float
    omega: float
    t: float


class NaturalFrequency(NamedTuple):
    """A natural frequency: its name, as w01, and its value in rad/s."""

    name: str
    omega: float


@dataclass(frozen=True, eq=False)
class RunUp:
    """A start or a coast-down, and what it does to the machine.

    Parameters
    ----------
    machine, drive
        What was run, and by what.
    speed
        Working speed in rad/s: where a start shall end, or where a coast-down began.
    history
        The motion in time.
    outcome
        "reached", "captured" (the speed stays near a natural frequency), "short" (it stays below
        the working speed elsewhere), "not started", "unfinished" (still changing when the time was
        up), "stopped" (coast-down), "followed" (a given speed over time).
    final_speed
        Speed at the end in rad/s; with a motor the mean over the last turns.
    near
        The natural frequency at which it is captured, else None.
    first_frequency
        w01 in rad/s; 0 for a machine that nothing holds.
    passing
        Time in s between 0.8 and 1.25 times w01; None where it is not passed.
    peaks
        ``"main_amplitude"``, ``"relative_amplitude"`` (half the way from one turning point to the
        next, m), ``"foundation_force"`` (N) and ``"stop_force"`` (N), as far as the machine has
        them.
    power
        Means over the last turns in W: ``"motor"``, ``"friction"``, ``"dampers"``; empty where
        the speed is given or changes.
    notes
        What was assumed or left out.
    """

    machine: Machine
    drive: Drive | SpeedProfile
    speed: float
    history: History
    outcome: Outcome
    final_speed: float
    near: NaturalFrequency | None
    first_frequency: float
    passing: float | None
    peaks: Mapping[str, Peak]
    power: Mapping[str, float]
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        return f"RunUp({self.outcome}, {self.final_speed:.6g} rad/s after {self.duration:.4g} s)"

    @property
    def duration(self) -> float:
        """Time calculated in s."""
        return float(self.history.t[-1])

    @property
    def time_to_speed(self) -> float | None:
        """Time in s at which the shaft first has the working speed, within five per cent."""
        reached = np.flatnonzero(self.history.omega >= AT_SPEED * self.speed)
        if self.outcome == "stopped" or reached.size == 0:
            return None
        return float(self.history.t[reached[0]])

    @property
    def verdict(self) -> str:
        """The outcome as a sentence, rpm first."""
        now, wanted = f"{self.final_speed * RPM:.0f} rpm", f"{self.speed * RPM:.0f} rpm"
        seconds = f"{self.duration:.3g} s"
        if self.outcome == "captured" and self.near is not None:
            held = f"{self.near.name} = {self.near.omega * RPM:.0f} rpm"
            return f"captured at {now}, near the natural frequency {held}"
        sentences = {
            "reached": f"reaches {wanted} in {self.time_to_speed or 0.0:.2g} s, then runs at {now}",
            "short": f"stays at {now}, below the working speed of {wanted}: the drive is too weak",
            "not started": "does not start: the torque at rest does not turn the shaft",
            "unfinished": f"at {now} after {seconds}, still changing; calculate a longer time",
            "stopped": f"comes down from {wanted} in {seconds}",
            "followed": f"follows the given speed for {seconds}, ending at {now}",
        }
        return sentences[self.outcome]
