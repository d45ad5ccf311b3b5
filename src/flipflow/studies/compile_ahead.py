"""Compile the kernels of an analysis ahead, in processes side by side, once per version."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flipflow.batch.solutions import nothing_asked, solve_lanes
from flipflow.batch.variants import batches
from flipflow.compiled.eigen import eigenvalues
from flipflow.compiled.workers import compile_parts, work
from flipflow.continuation import correction
from flipflow.continuation.frequency_response import first_unknowns
from flipflow.dynamics.motion import longest_on
from flipflow.model.drive import SpeedProfile
from flipflow.model.elements import ClearanceSpring
from flipflow.model.excitation import Unbalance
from flipflow.model.system import MechanicalSystem
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.solver import STEP_SHARE
from flipflow.transient.time_stepping import Stepper


def compile_ahead(tell: Callable[[float], None]) -> None:
    """Compile what an exact analysis needs, unless it is in the cache already.

    Parameters
    ----------
    tell
        Called every fraction of a second with the seconds passed.
    """
    compile_parts("flipflow.studies.compile_ahead", PARTS, tell)


def _trace_part() -> None:
    solver = _small_solver()
    course = correction.Course(0.5, 0.6, 0.01, STEP_SHARE, 1.0, correction.QUICK)
    solver.trace(first_unknowns(solver, 0.5), 0.5, course)
    eigenvalues(np.zeros((1, 1, 1)))


def _observe_part() -> None:
    solver = _small_solver()
    state, omega = np.zeros((1, 2)), np.ones(1)
    solver.extremes(state, omega, np.eye(1))
    solver.errors(state, omega)
    motion = solver.motion(state[0], 1.0)
    motion.extremes(np.eye(1))
    motion.derivative(0.0, 0)
    longest_on(motion, np.zeros((3, 1)), 0.0)


def _section_part() -> None:
    _small_solver().section(np.zeros(2), 1.0, 1)


def _lanes_part() -> None:
    solver = _small_solver()
    solver.residual(np.zeros(2), 0.5)
    (batch,), _ = batches(solver.system, {"forcing": np.ones(1)})
    solve_lanes(batch, np.array([0.5, 0.51]), nothing_asked(1, 2))


def _start_up_part() -> None:
    profile = SpeedProfile((0.0, 1.0), (1.0, 1.0))
    for _ in Stepper(_small_solver().system, profile, np.zeros(2), fastest=1.0).run(1.0):
        pass


def _small_solver() -> ExactSolver:
    """One mass and one stop: kernels do not depend on the machine, only on the types."""
    stop = ClearanceSpring([1.0], 1.0, 0.1, 10.0)
    system = MechanicalSystem([[1.0]], [[0.1]], [[1.0]], [stop], Unbalance([1.0]))
    return ExactSolver(system, half_turn=True)


# Two parts, for two processors, that take about equally long. The second has compiled what both
# share when the first, whose one large kernel takes longest, comes to need it.
PARTS: dict[str, tuple[Callable[[], None], ...]] = {
    "branches": (_start_up_part, _trace_part),
    "runs": (_section_part, _observe_part, _lanes_part),
}

if __name__ == "__main__":
    work(PARTS)
