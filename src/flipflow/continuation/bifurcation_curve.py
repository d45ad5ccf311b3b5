"""A curve of special points in two parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.continuation.branch import SpecialPoint
from flipflow.continuation.branch_status import BranchStatus
from flipflow.continuation.orbit_row import OrbitRow
from flipflow.errors import InputError
from flipflow.model.arguments import checked_text
from flipflow.model.system import Machine
from flipflow.periodic.orbit import Orbit


@dataclass(frozen=True, eq=False)
class CurvePoint(SpecialPoint):
    """A special point of a curve; ``values`` are those of the curve's parameters, in SI."""

    values: tuple[float, float] = (math.nan, math.nan)

    def __repr__(self) -> str:
        first, second = self.values
        return f"CurvePoint({self.kind}, {first:.9g}, {second:.9g})"


@dataclass(frozen=True, eq=False)
class BifurcationCurve(OrbitRow):
    """Special points of one kind followed in the plane of two parameters.

    Arrays are (n,) over its points, in their order along the curve. It is what
    :func:`flipflow.continue_bifurcation` returns.

    Parameters
    ----------
    machine
        The machine from which the curve was followed.
    kind
        "fold", "grazing", "symmetry breaking", "period doubling" or "Neimark-Sacker".
    parameters
        Names of both, "omega" among them or not.
    orbits
        The motions, each of its own machine.
    values
        The parameters' values in SI, (n, 2).
    special_points
        In the curve's order, refined: "cusp", where two folds are born; "turning point", where
        the curve turns back in one of the parameters; "1:1 resonance" to "1:4 resonance", where a
        second multiplier stands at +1 or -1, or a pair at such an angle; and points where the
        curve meets another, such as "fold and period doubling" or "grazing and fold".
    status
        How the curve ended; ``status.complete`` is False when it could not be finished.
    notes
        A sentence for each thing that could not be settled.
    version
        Version of flipflow.
    """

    machine: Machine
    kind: str
    parameters: tuple[str, str]
    orbits: tuple[Orbit, ...]
    values: Real
    special_points: tuple[CurvePoint, ...]
    status: BranchStatus
    notes: tuple[str, ...]
    version: str

    def __repr__(self) -> str:
        over = " and ".join(self.parameters)
        size, kinds = len(self.orbits), self._counted()
        return (
            f"BifurcationCurve({self.kind} over {over}, {size} points, {kinds}, {self.status.name})"
        )

    def along(self, parameter: str) -> Real:
        """Values of one of both parameters along the curve, (n,)."""
        if parameter not in self.parameters:
            choice = " or ".join(map(repr, self.parameters))
            raise InputError("parameter", parameter, f"give {choice}")
        return np.asarray(self.values[:, self.parameters.index(parameter)])

    def points_of(self, kind: str) -> tuple[CurvePoint, ...]:
        """Special points of one kind, in the curve's order."""
        checked_text("kind", kind)
        return tuple(point for point in self.special_points if point.kind == kind)
