"""What results have in common that are a row of motions, each of a machine of its own."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Real
from flipflow.continuation.branch_status import BranchStatus
from flipflow.model.arguments import checked_index
from flipflow.model.system import Coordinate
from flipflow.periodic.orbit import Orbit
from flipflow.periodic.stability import STABLE
from flipflow.results.result import Frozen, Result


class OrbitRow(Frozen, Result):
    """Motions in their order along a branch or a curve, (n,), and what is read off them."""

    orbits: tuple[Orbit, ...]
    status: BranchStatus

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

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Where ``stability`` is "stable", (n,)."""
        return np.asarray(self.stability == STABLE)

    @cached_property
    def error(self) -> Real:
        """Estimated distance of each motion from the exact one in m, (n,); infinite: unknown."""
        return np.array([orbit.error for orbit in self.orbits])

    @property
    def complete(self) -> bool:
        """Whether the branch was followed to both its ends, or all round."""
        return self.status.complete

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
