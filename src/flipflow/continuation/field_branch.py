"""A branch of periodic motions over a field of the machine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.continuation.branch import SpecialPoint
from flipflow.continuation.branch_status import BranchStatus
from flipflow.continuation.orbit_row import OrbitRow
from flipflow.continuation.special_points import CUSP, FOLD, KINDS
from flipflow.model.arguments import checked_word
from flipflow.model.screen import unit_in
from flipflow.model.system import Machine
from flipflow.periodic.orbit import Orbit


@dataclass(frozen=True, eq=False)
class FieldSpecialPoint(SpecialPoint):
    """A special point of a branch over a field; ``value`` is the field's, in SI.

    A "cusp" stands on a curve of folds, where two folds are born.
    """

    value: float = np.nan

    def __repr__(self) -> str:
        omega = f"{self.omega:.9g}{unit_in(self.orbit.machine, 'rad/s')}"
        return f"FieldSpecialPoint({self.kind}, {self.value:.9g} at {omega})"


@dataclass(frozen=True, eq=False)
class FieldBranch(OrbitRow):
    """Periodic motions, or folds, followed over a field of the machine.

    Arrays are (n,) over its points, in their order along the branch. It is what
    :func:`flipflow.continue_orbit` returns for a field of the machine, and
    :func:`flipflow.continue_fold`.

    Parameters
    ----------
    machine
        The machine from which the branch was followed.
    field
        Name of the field.
    orbits
        The motions, each of its own machine.
    values
        The field's values in SI, (n,).
    special_points
        In branch order, each refined on corrected points.
    status
        How the branch ended; ``status.complete`` is False when it could not be finished.
    notes
        A sentence for each thing that could not be settled.
    version
        Version of flipflow.
    """

    machine: Machine
    field: str
    orbits: tuple[Orbit, ...]
    values: Real
    special_points: tuple[FieldSpecialPoint, ...]
    status: BranchStatus
    notes: tuple[str, ...]
    version: str

    def __repr__(self) -> str:
        ends = f"{self.values.min():.6g} to {self.values.max():.6g}, " if self.orbits else ""
        size, kinds = len(self.orbits), self._counted()
        return f"FieldBranch({self.field}, {size} points, {ends}{kinds}, {self.status.name})"

    @property
    def folds(self) -> tuple[FieldSpecialPoint, ...]:
        """The saddle-nodes, in branch order."""
        return self.points_of(FOLD)

    def points_of(self, kind: str) -> tuple[FieldSpecialPoint, ...]:
        """Special points of one kind, in branch order.

        Raises
        ------
        InputError
            For a word that is no kind.
        """
        own = (point.kind for point in self.special_points)
        checked_word("kind", kind, tuple(dict.fromkeys((*KINDS, CUSP, *own))))
        return tuple(point for point in self.special_points if point.kind == kind)
