"""Compile the kernels of an analysis ahead, in processes side by side.

numba compiles under one lock in a process, and the first analysis needs several large kernels.
Each part is compiled by a process of its own into the shared cache, once per version.
"""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable

import numpy as np

from flipflow.batch.lanes import Lanes
from flipflow.compiled.compile import cache_folder
from flipflow.continuation import arclength
from flipflow.model.drive import SpeedProfile
from flipflow.model.elements import ClearanceSpring, Unbalance
from flipflow.model.system import MechanicalSystem
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.solver import STEP_SHARE
from flipflow.transient.time_stepping import Stepper

logger = logging.getLogger("flipflow")
POLL_SECONDS = 0.2


def compile_ahead(tell: Callable[[float], None]) -> None:
    """Compile what an exact analysis needs, unless it is in the cache already.

    Parameters
    ----------
    tell
        Called every fraction of a second with the seconds passed.
    """
    marks = {part: cache_folder() / f"{part}-compiled" for part in PARTS}
    parts = [part for part, mark in marks.items() if not mark.exists()]
    if not parts:
        return
    command = [sys.executable, "-m", "flipflow.studies.compile_ahead"]
    # The kernels run as fast with light optimisation, and are compiled in four fifths of the time.
    environment = {**os.environ, "NUMBA_OPT": "1"}
    workers = [
        subprocess.Popen([*command, part], stdout=subprocess.DEVNULL, env=environment)  # noqa: S603  our own module
        for part in parts
    ]
    begin = time.monotonic()
    try:
        while any(worker.poll() is None for worker in workers):
            tell(time.monotonic() - begin)
            time.sleep(POLL_SECONDS)
    finally:
        for worker in workers:
            worker.kill()
    for part, worker in zip(parts, workers, strict=True):
        if worker.returncode == 0:
            marks[part].touch()
    if any(worker.returncode != 0 for worker in workers):
        logger.warning("compiling ahead failed; kernels are compiled as they are needed")


def _trace_part() -> None:
    solver = _small_solver()
    course = arclength.Course(0.5, 0.6, 0.01, STEP_SHARE, 1.0, arclength.QUICK)
    solver.trace(np.zeros(2), 0.5, course)


def _observe_part() -> None:
    solver = _small_solver()
    state, omega = np.zeros((1, 2)), np.ones(1)
    solver.extremes(state, omega, np.eye(1))
    solver.errors(state, omega)


def _lanes_part() -> None:
    states = np.zeros((1, 2))
    Lanes(_small_solver().system, 1.0, 1).carry(states, 1)


def _strobe_part() -> None:
    _small_solver().section(np.zeros(2), 1.0, 1)


def _start_up_part() -> None:
    profile = SpeedProfile((0.0, 1.0), (1.0, 1.0))
    for _ in Stepper(_small_solver().system, profile, np.zeros(2), fastest=1.0).run(1.0):
        pass


def _small_solver() -> ExactSolver:
    """One mass and one stop: kernels do not depend on the machine, only on the types."""
    stop = ClearanceSpring([1.0], 1.0, 0.1, 10.0)
    system = MechanicalSystem([[1.0]], [[0.1]], [[1.0]], [stop], Unbalance([1.0]))
    return ExactSolver(system, half_turn=True)


# Two parts, for two processors, that take about equally long; within a part what several kernels
# call is compiled once.
PARTS: dict[str, tuple[Callable[[], None], ...]] = {
    "branches": (_trace_part,),
    "runs": (_observe_part, _strobe_part, _lanes_part, _start_up_part),
}

if __name__ == "__main__":
    # Ctrl-C is the parent's to answer, which ends its workers.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for compile_part in PARTS[sys.argv[1]]:
        compile_part()
