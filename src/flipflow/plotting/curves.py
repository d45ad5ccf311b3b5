"""Branches as lines to draw: their stable and unstable runs, and the jumps between them."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flipflow.continuation.branch import Branch
from flipflow.continuation.branch_status import BranchStatus
from flipflow.errors import IncompleteError
from flipflow.model.system import Coordinate

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Jump:
    """Where the motion leaves a fold: speed, and the amplitude before and after."""

    omega: float
    start: float
    end: float
    rising_speed: bool


@dataclass(frozen=True, eq=False)
class Curve:
    """One coordinate along a branch, special points included: (n,) each, in branch order."""

    omega: Real
    amplitude: Real
    phase: Real
    stability: NDArray[np.str_]

    @classmethod
    def of(cls, branch: Branch, which: Coordinate) -> Curve:
        """The curve of a coordinate, in SI and rad; the phase is continuous and starts near 0.

        Points at which the flow over a turn does not end have no amplitude, and are left out.

        Raises
        ------
        IncompleteError
            When the branch has no points.
        """
        if branch.omega.size == 0:
            raise IncompleteError(f"The branch has no points. {branch.status.value}")
        special = branch.special_points
        position = [*range(branch.omega.size), *(point.position for point in special)]
        order = np.argsort(position, kind="stable")
        omega = np.append(branch.omega, [point.omega for point in special])
        amplitude = np.append(branch.amplitude(which), [p.amplitude(which) for p in special])
        phase = np.append(branch.phase(which), [p.orbit.phase(which) for p in special])
        following = [branch.stability[_next(point.position, branch)] for point in special]
        if branch.status is BranchStatus.CLOSED:
            order = np.append(order, order[0])
        order = order[np.isfinite(amplitude[order]) & np.isfinite(phase[order])]
        if order.size == 0:
            raise IncompleteError(f"The branch has no points. {branch.status.value}")
        return cls(
            omega[order],
            amplitude[order],
            np.unwrap(phase[order]),
            np.append(branch.stability, following)[order],
        )

    def runs(self) -> Iterator[tuple[str, slice]]:
        """Stretches of the same stability; each ends where the next begins."""
        change = np.flatnonzero(self.stability[1:] != self.stability[:-1]) + 1
        starts = [0, *change]
        ends = [*(change + 1), self.omega.size]
        for start, end in zip(starts, ends, strict=True):
            yield str(self.stability[start]), slice(start, end)

    def from_below(self) -> tuple[Real, Real]:
        """Speed and amplitude as met when the speed rises slowly from the lower end."""
        highest = np.maximum.accumulate(self.omega)
        new = np.append(True, self.omega[1:] > highest[:-1])
        return self.omega[new], self.amplitude[new]

    def jumps(self) -> tuple[Jump, ...]:
        """The jumps met when the speed rises, then those met when it falls."""
        rising = _jumps(self.omega, self.amplitude)
        falling = _jumps(-self.omega[::-1], self.amplitude[::-1])
        return (
            *(Jump(omega, start, end, rising_speed=True) for omega, start, end in rising),
            *(Jump(-omega, start, end, rising_speed=False) for omega, start, end in falling),
        )


def _next(position: float, branch: Branch) -> int:
    return min(int(np.floor(position)) + 1, branch.omega.size - 1)


def _jumps(omega: Real, amplitude: Real) -> Iterator[tuple[float, float, float]]:
    """Speed, amplitude before and after, where a walk to higher omega must leave the curve."""
    highest = np.maximum.accumulate(omega)
    met = np.flatnonzero(np.append(True, omega[1:] > highest[:-1]))
    for here, there in itertools.pairwise(met):
        if there == here + 1:
            continue
        share = (omega[here] - omega[there - 1]) / (omega[there] - omega[there - 1])
        after = amplitude[there - 1] + share * (amplitude[there] - amplitude[there - 1])
        yield float(omega[here]), float(amplitude[here]), float(after)
