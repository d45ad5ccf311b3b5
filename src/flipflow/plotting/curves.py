"""Branches as lines to draw: their stable and unstable runs, and the jumps between them."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Real
from flipflow.continuation.branch import Branch, SpecialPoint
from flipflow.continuation.branch_status import BranchStatus
from flipflow.continuation.field_branch import FieldBranch
from flipflow.errors import IncompleteError
from flipflow.model.system import Coordinate
from flipflow.periodic.orbit import Orbit

OF_FOLD = 0.05  # from 1 the multiplier of a fold, that of a truncated series, too
AT_ONE = 1e-3  # several multipliers stand at 1 in some folds, the square root of rounding apart


@dataclass(frozen=True)
class Jump:
    """Where the motion leaves a fold: speed, and the amplitude before and after."""

    omega: float
    start: float
    end: float
    rising_speed: bool


@dataclass(frozen=True, eq=False)
class Curve:
    """One coordinate along a branch, special points included: (n,) each, in branch order.

    At the folds ``unstable_folds``, omega in rad/s, no machine stands that could jump there.
    """

    omega: Real
    amplitude: Real
    phase: Real
    stability: NDArray[np.str_]
    unstable_folds: frozenset[float] = frozenset()

    @classmethod
    def of(cls, branch: Branch, which: Coordinate) -> Curve:
        """The curve of a coordinate, in SI and rad; the phase is continuous and starts near 0.

        It is NaN where nothing moves with the forcing frequency itself.

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
        order = order[np.isfinite(amplitude[order])]
        if order.size == 0:
            raise IncompleteError(f"The branch has no points. {branch.status.value}")
        continuous = phase[order]
        known = np.isfinite(continuous)
        continuous[known] = np.unwrap(continuous[known])
        return cls(
            omega[order],
            amplitude[order],
            continuous,
            np.append(branch.stability, following)[order],
            frozenset(fold.omega for fold in branch.folds if not is_jump(branch, fold)),
        )

    def part(self, keep: NDArray[np.bool_]) -> Curve:
        """The points to keep, as a curve of their own."""
        return dataclasses.replace(
            self, omega=self.omega[keep], amplitude=self.amplitude[keep], phase=self.phase[keep],
            stability=self.stability[keep],
        )  # fmt: skip

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
            *(
                Jump(omega, start, end, rising_speed=True)
                for omega, start, end in rising
                if omega not in self.unstable_folds
            ),
            *(
                Jump(-omega, start, end, rising_speed=False)
                for omega, start, end in falling
                if -omega not in self.unstable_folds
            ),
        )


def is_jump(branch: Branch | FieldBranch, fold: SpecialPoint) -> bool:
    """Whether a motion that meets its end in a fold is stable, so that a machine jumps there."""
    told = stable_beside(fold.orbit)
    if told is not None:
        return told
    # At a corner of the branch no multiplier stands at 1: its neighbours tell.
    last = branch.stability.size - 1
    sides = int(np.ceil(fold.position)) - 1, int(np.floor(fold.position)) + 1
    return any(branch.stability[min(max(side, 0), last)] != "unstable" for side in sides)


def stable_beside(orbit: Orbit) -> bool | None:
    """Whether a fold at this motion has a stable side; None where its multipliers do not tell.

    The one that stands at 1 tells both sides apart; of the others none must grow.
    """
    away = np.abs(orbit.multipliers - 1.0)
    if not away.min() < OF_FOLD:
        return None
    others = np.delete(orbit.multipliers, int(np.argmin(away)))
    return not bool((np.abs(others) > 1.0 + AT_ONE).any())


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
