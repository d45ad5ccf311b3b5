"""Periodic motions of many machines at many frequencies, on threads.

Every lane is solved by itself: what it finds depends on its machine and on the frequencies, and
neither on other lanes nor on the threads.
"""

from __future__ import annotations

import threading

import numpy as np

from flipflow.batch.lane_kernels import Found, new_found, run_lanes
from flipflow.batch.lane_path import new_lane_work
from flipflow.batch.lane_readings import Asked, Readings, new_reading_work, new_readings
from flipflow.batch.lane_slopes import slope_lanes
from flipflow.batch.reasons import NOT_COMPUTED
from flipflow.batch.side_by_side import Tell, side_by_side
from flipflow.batch.slope_readings import Slopes, SlopesAsked, new_slope_work, new_slopes
from flipflow.batch.variants import Batch
from flipflow.compiled.arrays import Int, Real
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.parameter_tangent import Columns

MOST = 2048  # motions that one task finds
TASKS = 4  # of each thread at least, since the last one to end is waited for


def nothing_asked(degrees: int, speeds: int) -> Asked:
    """Nothing but what every motion has."""
    return Asked(
        coordinate=np.zeros((0, degrees)),
        squared=np.zeros((0, degrees)),
        linear=np.zeros((1, 0, 3, degrees)),
        along=np.zeros((1, speeds, 0), np.complex128),
        across=np.zeros((1, speeds, 0), np.complex128),
    )


def solve_lanes(
    batch: Batch,
    omega: Real,
    asked: Asked,
    threads: int = 1,
    tell: Tell | None = None,
) -> tuple[Found, Readings]:
    """The motions of a batch of machines at frequencies in the order given, in rad/s.

    Rising frequencies are reached from below and falling ones from above, as a machine reaches them
    that is brought up or down slowly; where it jumps, so does the lane.

    Parameters
    ----------
    batch
        L machines.
    omega
        Frequencies, (F,), rising or falling.
    asked
        What is read off.
    threads
        Threads among which chunks of lanes are shared.
    tell
        Called with the share of lanes done; what it raises ends the work.
    """
    lanes, speeds = batch.rows.size, omega.size
    nominal = _machine(batch.arrays, 0)
    found = new_found(lanes, speeds, batch.system.size, NOT_COMPUTED)
    readings = new_readings(lanes, speeds, nominal, asked)
    # A read-only array is another type to the compiler, and would be compiled for anew.
    speeds_in_order = np.array(omega)

    own = threading.local()

    def chunk(part: slice, stop: Int) -> None:
        # At one frequency a chunk's scratch would take a tenth of its time.
        if not hasattr(own, "work"):
            own.work = new_lane_work(_machine(batch.arrays, 0), stop)
            own.reading = new_reading_work(own.work.shooting.flow, nominal, asked)
        run_lanes(
            batch.arrays, part.start, part.stop, speeds_in_order, batch.length, own.work,
            own.reading, asked, found, readings,
        )  # fmt: skip

    side_by_side(chunk, lanes, _lanes_of_task(lanes, speeds, threads), threads, tell)
    return found, readings


def _lanes_of_task(lanes: int, speeds: int, threads: int) -> int:
    """How many lanes a task has."""
    return max(min(lanes // (TASKS * threads), MOST // speeds), 1)


def _machine(arrays: MachineArrays, lane: int) -> MachineArrays:
    """One machine of many, with arrays of its own."""
    shared = {"power", "wave", "order", "stops"}
    own = {
        name: getattr(arrays, name)[lane].copy() for name in arrays._fields if name not in shared
    }
    stops = arrays.stops
    gaps = {name: getattr(stops, name)[lane].copy() for name in ("stiffness", "damping", "gap")}
    return arrays._replace(**own, stops=stops._replace(**gaps))


def solve_slopes(
    batch: Batch,
    columns: Columns,
    omega: Real,
    asked: Asked,
    wanted: SlopesAsked,
    found: Found,
    threads: int = 1,
) -> Slopes:
    """Derivatives of the stable motions that :func:`solve_lanes` found, and of their readings.

    Parameters
    ----------
    batch, omega, asked, threads
        As of :func:`solve_lanes`.
    columns
        How the machines change with P parameters.
    wanted
        What is differentiated.
    found
        The motions.
    """
    nominal, parameters = _machine(batch.arrays, 0), columns.touches.shape[0]
    slopes = new_slopes(found, nominal, asked, parameters)
    speeds_in_order, own = np.array(omega), threading.local()

    def chunk(part: slice, stop: Int) -> None:
        if not hasattr(own, "work"):
            own.work = new_slope_work(_machine(batch.arrays, 0), asked, columns, stop)
        slope_lanes(
            batch.arrays, columns, part.start, part.stop, speeds_in_order, batch.length, asked,
            wanted, own.work, found, slopes,
        )  # fmt: skip

    lanes = batch.rows.size
    side_by_side(chunk, lanes, _lanes_of_task(lanes, omega.size, threads), threads, None)
    return slopes
