"""Special points of a truncated series, checked against the exact flow.

Where a motion has sharper details than the harmonics kept can follow, the series wiggles about the
exact motion. The branch of the series then turns back where the exact branch does not, and Newton's
method reaches now one exact motion from the series, now another.

A fold of the series is one of the machine when the exact motions before and after it, up to the
next folds of the series, lie on opposite sides of an eigenvalue +1, and on the sides that follow
from the number of folds passed. Any other special point of the series is one of the machine when
its test function has a zero on the exact branch, between exact motions on both sides of the point.
Beside a fold there is no exact motion at the speed of the series; there the exact branch is
followed past the fold.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from flipflow.compiled import status
from flipflow.compiled.arrays import Real
from flipflow.continuation.correction import Course
from flipflow.errors import IncompleteError
from flipflow.periodic.balance_solver import BalanceSolver
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.solver import Point, Traced
from flipflow.periodic.stability import determinant_minus

BESIDE = (0.05, 0.25, 0.5, 1.0, 2.0, 4.0, 0.01, 1e-3, 1e-4)  # steps to both sides, in this order
FOLLOWED = (1.0, 4.0)  # steps before and after a point over which the exact branch is followed
FINER = 4.0  # factor on its steps, so that none passes over two folds that the series shows apart
EDGE = 1e-6  # relative widening of that interval of speeds
ZERO = 1e-3  # a test below this share of its values at the ends has a zero there, not a jump
LISTED = 8  # speeds that a note names


@dataclass(frozen=True, eq=False)
class ExactBeside:
    """The exact motions beside a branch of a truncated series."""

    solver: BalanceSolver
    traced: Traced

    @cached_property
    def exact(self) -> ExactSolver:
        """Solver of the exact motions, of the same symmetry."""
        return ExactSolver(self.solver.system, half_turn=self.solver.half_turn)

    def at(self, position: float) -> Point | None:
        """The exact motion that Newton reaches from the series at a position along the branch."""
        near = self._of_series(position)
        return None if near is None else self._beside(near)

    def _of_series(self, position: float) -> Point | None:
        """The motion of the series at a position along the branch."""
        p = int(position)
        if not 0 <= p < self.traced.omega.size - 1:
            return None
        try:
            return self.solver.between(self.traced, p, position - p)
        except IncompleteError:
            return None

    def _beside(self, near: Point) -> Point | None:
        """The exact motion that Newton reaches from one of the series."""
        state = self.solver.states(near.u[None], np.array([near.omega]))[0]
        return self.exact.solve(state, near.omega)

    def crosses(self, position: float, room: float, test: Callable[[Real], float]) -> bool:
        """Whether a test has a zero on the exact branch within ``room`` / 2 steps of a position."""
        for share in BESIDE:
            sides = [self.at(position + sign * share) for sign in (-1.0, 1.0) if share < 0.5 * room]
            ends = [side for side in sides if side is not None]
            if len(ends) == 2 and self._zero_between(ends[0], ends[1], test):
                return True
        return False

    def passes(
        self, position: float, rooms: tuple[float, float], test: Callable[[Traced, Real], Real]
    ) -> bool:
        """Whether the exact branch, followed past a position, has a zero of a test there.

        The exact branch is followed by its own arc length, from an exact motion before the position
        over the speeds that the series has up to as far after it. That also leads past folds, where
        no exact motion has the speed of the series. Where two folds stand close there may be none
        between them: then the branch is followed back from an exact motion after the position.
        ``rooms`` are the steps to the special points before and after it.
        """
        for (way, room), steps in product(zip((1.0, -1.0), rooms, strict=True), FOLLOWED):
            start = max(position - way * min(steps, 0.5 * room), 0.0)
            near = self._of_series(start)
            begin = None if near is None else self._beside(near)
            if near is None or begin is None:
                continue
            followed = self.exact.trace(
                begin.u, begin.omega, self._window(position, steps, near, way)
            )
            maps = self.exact.return_maps(followed.u, followed.omega, followed.jacobian)
            values = test(followed, maps)
            if np.any(values[1:] * values[:-1] < 0.0):
                return True
        return False

    def _window(self, position: float, steps: float, near: Point, way: float) -> Course:
        """The course over the speeds of the series around a position, from a motion beside it."""
        first, last = max(int(position - steps), 0), int(position + steps) + 2
        speeds = np.append(self.traced.omega[first:last], near.omega)
        low, high = float(speeds.min()), float(speeds.max())
        course = self.traced.course
        return course._replace(
            lower=low - EDGE * low,
            upper=high + EDGE * high,
            omega_step=course.omega_step / FINER,
            u_step=course.u_step / FINER,
            direction=way * float(np.sign(near.omega_tangent)),
        )

    def _zero_between(self, first: Point, last: Point, test: Callable[[Real], float]) -> bool:
        """Whether a test has a zero, not a jump, on the exact branch between two motions."""
        values = test(first.return_map), test(last.return_map)
        if not values[0] * values[1] < 0.0:
            return False
        record = self.exact.new_branch(2)
        for k, end in enumerate((first, last)):
            record.u[k], record.omega[k] = end.u, end.omega
        record.tangent[:] = np.append(last.u - first.u, last.omega - first.omega)
        chord = Traced.recorded(record, 2, status.OK, self.traced.course)

        def value(share: float) -> float:
            if share in (0.0, 1.0):
                return values[int(share)]
            return test(self.exact.return_map(self.exact.between(chord, 0, share)))

        try:
            root = float(brentq(value, 0.0, 1.0, xtol=1e-9, rtol=1e-9))
            return abs(value(root)) < ZERO * min(abs(values[0]), abs(values[1]))
        except IncompleteError:
            return False

    def folds_shown(self, positions: Real, side: NDArray[np.bool_]) -> list[bool]:
        """Which folds of the series at given positions the exact motions show.

        ``side`` tells for each point of the branch whether an odd number of eigenvalues should
        lie beyond +1.
        """
        maps, distance = self.solver.corrected_maps(self.traced.u, self.traced.omega)
        on_side = ((determinant_minus(maps) < 0.0) == side) & np.isfinite(distance)
        ends = [0, *(int(position) + 1 for position in positions), side.size]
        shown = [bool(on_side[first:last].any()) for first, last in pairwise(ends)]
        return [before and after for before, after in pairwise(shown)]


def unconfirmed_note(kind: str, omegas: Sequence[float]) -> str:
    """What is said of special points of the series that the exact flow does not show."""
    where = ", ".join(f"{omega:.7g}" for omega in omegas[:LISTED])
    more = f" and {len(omegas) - LISTED} more" if len(omegas) > LISTED else ""
    return (
        f"{kind} of the series at {where}{more} rad/s: the exact motions beside it do not show it; "
        "raise the harmonics"
    )
