"""The test rig of Section 5: its published points, the bundled rig, rigs fitted without some.

The paper prints the rig's parameters in a picture only. ``benchmarks/identify_rig.py`` finds rigs
that have the points of its text. A rig fitted to a point says nothing about that point, so each
claim is judged by rigs that were fitted to the other points.
"""

from __future__ import annotations

import csv
import math
import statistics
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import resources

from scipy.optimize import brentq

from flipflow.continuation.branch import Branch, SpecialPoint
from flipflow.continuation.frequency_response import frequency_response
from flipflow.errors import IncompleteError
from flipflow.io.project import load_project
from flipflow.model.project import Project
from flipflow.model.screen import FlipFlowScreen
from flipflow.paper.claims import Evaluation, Name, Number, Part, decide
from flipflow.periodic.options import PiecewiseExact
from flipflow.periodic.orbit import Orbit
from flipflow.plotting.scales import MM

RIG = "rig-lin2024"
LEFT_OUT = "rigs_left_out.csv"
# (rad/s, mm) before and after each jump; the speed was changed in steps of 30 rpm.
BEFORE_UP, AFTER_UP = (120.17, 2.85), (123.31, 0.54)
BEFORE_DOWN, AFTER_DOWN = (95.03, 1.97), (91.89, 2.52)
STEP = math.pi
POINT_A, POINT_B = 2.6, 1.25
AT_A = 12.0
# Speeds over which a rig is followed: where the forward jump is left out it may come late.
INTERVAL, POINTS = (40.0, 300.0), 250
MET = 0.03  # share by which a fitted rig may miss an amplitude that it was fitted to
KEPT = {  # which points remain for the fit when a claim's own are left out
    "R1": ("down", "after down", "before down", "a", "b"),
    "R2": ("up", "before up", "after up", "a", "b"),
    "R3": ("up", "down", "before up", "after up", "before down", "after down"),
}


@dataclass(frozen=True, eq=False)
class RigBranch:
    """A rig's motions over speed, read where the paper measured."""

    branch: Branch

    @cached_property
    def _folds(self) -> tuple[SpecialPoint, SpecialPoint]:
        """The folds at which the amplitude falls and rises; the peak stands in for both."""
        folds = self.branch.folds or (self.branch.peak("relative"),)
        return max(folds, key=lambda f: f.omega), min(folds, key=lambda f: f.omega)

    @property
    def jump_up(self) -> float:
        """Speed in rad/s at which the amplitude falls as the speed rises."""
        return self._folds[0].omega

    @property
    def jump_down(self) -> float:
        """Speed in rad/s at which the amplitude grows as the speed falls."""
        return self._folds[1].omega

    def upper(self, omega: float) -> float:
        """Relative amplitude in mm of the motion with contact; beyond its fold that of the fold."""
        last = self._folds[0]
        run = slice(0, math.floor(last.position) + 1)
        return self._read(run, omega) if omega < last.omega else _millimetres(last.orbit)

    def lower(self, omega: float) -> float:
        """Relative amplitude in mm of the small motion; beyond its fold that of the fold."""
        first = self._folds[1]
        run = slice(math.ceil(first.position), self.branch.omega.size)
        return self._read(run, omega) if omega > first.omega else _millimetres(first.orbit)

    def rising(self, omega: float) -> float:
        """Relative amplitude in mm that a sweep of rising speed meets."""
        return self.upper(omega) if omega < self.jump_up else self.lower(omega)

    def falling(self, omega: float) -> float:
        """Relative amplitude in mm that a sweep of falling speed meets."""
        return self.lower(omega) if omega > self.jump_down else self.upper(omega)

    @cached_property
    def point_a(self) -> float:
        """Speed in rad/s at which the small motion has 1.25 mm; the paper does not print it."""
        ends = (self.jump_down, float(self.branch.omega.max()))
        if not self.lower(ends[1]) < POINT_B < self.lower(ends[0]):
            return ends[0]
        return float(brentq(lambda omega: self.lower(omega) - POINT_B, *ends))

    def _read(self, run: slice, omega: float) -> float:
        orbit = self.branch.solve_in(run, omega)
        if orbit is None:
            raise IncompleteError(f"The rig's motion at {omega:.6g} rad/s was not found.")
        return _millimetres(orbit)

    @cached_property
    def off(self) -> Mapping[str, float]:
        """How far each published point is missed.

        Amplitudes as a share of the published one, jumps from the middle of their two speeds as a
        share of the step between these.
        """
        wanted = {
            "before up": (self.upper, BEFORE_UP), "after up": (self.lower, AFTER_UP),
            "before down": (self.lower, BEFORE_DOWN), "after down": (self.upper, AFTER_DOWN),
            "a": (self.upper, (self.point_a, POINT_A)), "b": (self.lower, (self.point_a, POINT_B)),
        }  # fmt: skip
        amplitudes = {name: read(omega) / mm - 1.0 for name, (read, (omega, mm)) in wanted.items()}
        jumps = {"up": (self.jump_up, BEFORE_UP, AFTER_UP),
                 "down": (self.jump_down, BEFORE_DOWN, AFTER_DOWN)}  # fmt: skip
        return amplitudes | {
            name: (omega - (before[0] + after[0]) / 2.0) / abs(before[0] - after[0])
            for name, (omega, before, after) in jumps.items()
        }

    def meets(self, points: tuple[str, ...]) -> bool:
        """Whether jumps lie between their speeds and amplitudes within 3 %, of these points."""
        most = {"up": 0.5, "down": 0.5}
        return all(abs(self.off[name]) < most.get(name, MET) for name in points)


def rig() -> Project:
    """The bundled rig, identified from these points."""
    return load_project(RIG)


def followed(screen: FlipFlowScreen) -> RigBranch:
    """A rig's motions over the speeds of the test and beyond."""
    return RigBranch(frequency_response(screen, INTERVAL, PiecewiseExact(points=POINTS)))


def rigs_without(claim: str) -> tuple[RigBranch, ...]:
    """Rigs fitted to all published points but those of a claim, which meet the points they had."""
    file = resources.files("flipflow.paper") / LEFT_OUT
    lines = [line for line in file.read_text(encoding="utf-8").splitlines() if line[:1] != "#"]
    rows = [row for row in csv.DictReader(lines) if row.pop("left_out") == claim]
    screen = rig().screen
    found = (
        followed(screen.replace(**{name: float(value) for name, value in row.items()}))
        for row in rows
    )
    return tuple(one for one in found if one.meets(KEPT[claim]))


@dataclass(frozen=True)
class Prediction:
    """A published quantity as rigs predict it that were fitted without it.

    Parameters
    ----------
    what, unit
        The quantity.
    low, high
        Between which the paper's number lies.
    values
        One of each rig.
    """

    what: str
    unit: str
    low: float
    high: float
    values: tuple[float, ...]

    @property
    def answer(self) -> bool | None:
        """Whether all rigs meet the number, or all miss it by more than their spread; else None."""
        if not self.values:
            return None
        least, most = min(self.values), max(self.values)
        if self.low <= least and most <= self.high:
            return True
        missed = max(self.low - most, least - self.high)
        return False if missed > most - least else None


def judged(predictions: tuple[Prediction, ...]) -> Evaluation:
    """A claim by the predictions of its numbers, with their spread."""
    numbers: dict[Name, Number] = {}
    for one in predictions:
        values = sorted(one.values) or [math.nan]
        shown = {
            "paper, from": one.low, "to": one.high, "least": values[0],
            "median": statistics.median(values), "greatest": values[-1],
        }  # fmt: skip
        numbers |= {(one.what, name): Number(x, one.unit) for name, x in shown.items()}
    numbers["rigs fitted to the other points"] = Number(
        max((len(one.values) for one in predictions), default=0)
    )
    return decide([Part(one.what, one.answer) for one in predictions], numbers)


def _millimetres(orbit: Orbit) -> float:
    return MM * orbit.amplitude("relative")
