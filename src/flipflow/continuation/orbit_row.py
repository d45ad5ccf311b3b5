"""What branches and curves have in common, and those whose motions are each of another machine."""

from __future__ import annotations

from collections import Counter
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Real
from flipflow.continuation.branch_status import BranchStatus
from flipflow.model.arguments import checked_index
from flipflow.model.system import Coordinate
from flipflow.periodic.orbit import Orbit
from flipflow.periodic.stability import STABLE
from flipflow.results.result import Frozen, Result


class FollowedMotions(Frozen, Result):
    """Motions in their order along a branch or a curve, with special points among them."""

    special_points: tuple[Any, ...]
    status: BranchStatus

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Where ``stability`` is "stable", (n,)."""
        own: Any = self
        return np.asarray(own.stability == STABLE)

    @property
    def complete(self) -> bool:
        """Whether the branch was followed to both its ends, or all round."""
        return self.status.complete

    def _counted(self) -> str:
        """How many special points there are of each kind."""
        counts = Counter(point.kind for point in self.special_points)
        return ", ".join(f"{n} {kind}" for kind, n in counts.items()) or "no special points"


class OrbitRow(FollowedMotions):
    """What is read off motions that are each of a machine of its own, (n,)."""

    orbits: tuple[Orbit, ...]

    @cached_property
    def omega(self) -> Real:
        """Frequency in rad/s, (n,); it varies along curves in two parameters only."""
        return np.array([orbit.omega for orbit in self.orbits])

    @cached_property
    def multipliers(self) -> NDArray[np.complex128]:
        """Floquet multipliers of the full period, (n, 2 N), largest modulus first."""
        return np.array([orbit.multipliers for orbit in self.orbits])

    @cached_property
    def stability(self) -> NDArray[np.str_]:
        """Words, (n,): "stable", "unstable" or "undetermined"."""
        return np.array([orbit.stability for orbit in self.orbits], dtype="<U12")

    @cached_property
    def error(self) -> Real:
        """Estimated distance of each motion from the exact one in m, (n,); infinite: unknown."""
        return np.array([orbit.error for orbit in self.orbits])

    def amplitude(self, which: Coordinate) -> Real:
        """Half peak-to-peak of a coordinate at every point in m, (n,)."""
        return np.array([orbit.amplitude(which) for orbit in self.orbits])

    def phase(self, which: Coordinate) -> Real:
        """Phase of the first harmonic against the force in rad, (n,); positive: it leads."""
        return np.array([orbit.phase(which) for orbit in self.orbits])

    def orbit(self, i: int) -> Orbit:
        """The motion at point i of the branch."""
        n = len(self.orbits)
        remedy = f"the branch has points 0 to {n - 1}"
        return self.orbits[checked_index("i", i, n, remedy, least=-n)]
