"""Which motion a machine settles to while its speed is changed in steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow import __version__
from flipflow.analyses.arguments import checked_count, checked_speeds, initial_state
from flipflow.analyses.monitor import Monitor
from flipflow.errors import Cancelled
from flipflow.methods.settle import MOST_TURNS, Settled, Settling
from flipflow.model.system import Machine, system_of
from flipflow.results.orbit import Orbit
from flipflow.results.sweep import Jump, Sweep

Real = NDArray[np.float64]
MAX_PERIODS = 6
JUMP_SHARE = 0.05


def sweep(
    machine: Machine,
    omega: ArrayLike,
    *,
    initial: str | Orbit | ArrayLike = "rest",
    max_periods: int = MAX_PERIODS,
    most_turns: int = MOST_TURNS,
    monitor: Monitor | None = None,
) -> Sweep:
    """Settle at one frequency after the other, each from where the one before ended.

    The speed changes when the unbalance points along +x. At each frequency the exact flow runs
    until the periodic motion it approaches is closer than 1e-9 of the motion's size. That motion
    is solved for, so that lingering just past a fold is not taken for settling; its leading
    multiplier says how many turns are still to go.

    Parameters
    ----------
    machine
        A screen or a :class:`~flipflow.MechanicalSystem`.
    omega
        Frequencies in rad/s in the order to pass, (n,).
    initial
        "rest", an :class:`~flipflow.results.orbit.Orbit`, or a state (x, x'), (2 N,).
    max_periods
        Longest period looked for, in forcing periods.
    most_turns
        Most forcing periods waited at a step; what has not settled then is marked so.
    monitor
        Called with a sentence and the share done. When it raises
        :class:`~flipflow.errors.Cancelled`, the frequencies that are finished are kept and
        returned, and ``complete`` is False.

    Returns
    -------
    Sweep
        Settled amplitudes, periods, jumps.

    Raises
    ------
    InputError
        For frequencies that are not finite and above 0, a count below 1, a state of wrong shape,
        or a machine without damping, which never settles.
    """
    speeds = checked_speeds(omega)
    checked_count("max_periods", max_periods, 12)
    checked_count("most_turns", most_turns, 10_000_000)
    settling = Settling(system_of(machine), max_periods)
    z = initial_state(settling.solver.system.size, initial)
    rows: list[Settled] = []
    jumps: list[Jump] = []
    for k, speed in enumerate(speeds):
        row = settling.settle(z, float(speed), most=most_turns)
        if rows and _jumped(settling, rows[-1], row, float(speed)):
            jumps.append(Jump(k, float(speeds[k - 1]), float(speed)))
        rows.append(_kept(row))
        z = row.state
        if monitor is not None:
            try:
                monitor(f"settled at {speed:.4g} rad/s", (k + 1) / speeds.size)
            except Cancelled:
                break
    done = len(rows)
    return Sweep(
        machine, speeds[:done], tuple(rows), tuple(jumps), max_periods, most_turns,
        settling.solver, __version__, complete=done == speeds.size,
    )  # fmt: skip


def _kept(row: Settled) -> Settled:
    """A row with the states of one period only where the motion repeats."""
    if row.point is None or not row.settled:
        return row
    return replace(row, recent=row.recent[-row.point.solver.turns :])


def _jumped(settling: Settling, before: Settled, after: Settled, omega: float) -> bool:
    """Whether the motion before cannot be followed to the motion after, or lies far from it."""
    if before.point is None or after.point is None:
        return (before.point is None) != (after.point is None)
    followed = settling.continued(before.point, omega)
    if followed is None:
        return True
    share = JUMP_SHARE * settling.size(after.recent, omega)
    images = settling.phases(followed)
    return all(settling.distance(image, after.state, omega) > share for image in images)
