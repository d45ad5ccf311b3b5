"""Starts from every angle at which the shaft can have stopped: hanging, or held by friction."""

from __future__ import annotations

import math

import numpy as np

from flipflow.model.drive import Drive
from flipflow.model.monitor import Monitor
from flipflow.model.screen import FlipFlowScreen
from flipflow.transient.run_up import RunUp
from flipflow.transient.speed_run import hanging_angle, unbalance_weight
from flipflow.transient.startup import start_up

ANYWHERE = 8  # angles tried where friction holds the shaft in every one
WORST_FIRST = ("not started", "captured", "short", "unfinished", "reached")


def held_angles(screen: FlipFlowScreen, drive: Drive) -> tuple[float, ...]:
    """Angles in rad: hanging first, then the ends of the ranges that friction holds, and the top.

    Friction T_f holds the shaft where gravity's torque m0 r g |cos(phi + s alpha)| is no larger,
    with s = 1 for an unbalance that turns with the flow, else -1.
    Without gravity all angles are alike but for a shift of the frames' phase: 0 stands for them.
    """
    weight = abs(unbalance_weight(screen).torque)
    hanging = hanging_angle(screen)
    if weight == 0.0 or drive.friction == 0.0:
        return (hanging,)
    if drive.friction >= weight:
        turn = 2.0 * np.pi * np.arange(ANYWHERE) / ANYWHERE
        return tuple((hanging + turn).tolist())
    held = math.asin(drive.friction / weight)
    top = hanging + math.pi
    return (hanging, hanging - held, hanging + held, top - held, top, top + held)


def starts_from_rest(
    screen: FlipFlowScreen,
    drive: Drive,
    speed: float,
    duration: float | None = None,
    monitor: Monitor | None = None,
) -> tuple[RunUp, ...]:
    """A start from each of those angles, the worst first: what fails, else the greatest force.

    What is open of the drive must be chosen; ``duration`` and ``monitor`` as of
    :func:`~flipflow.start_up`.
    """
    runs = [
        start_up(screen, drive, speed=speed, duration=duration, angle=angle, monitor=monitor)
        for angle in held_angles(screen, drive)
    ]
    return tuple(sorted(runs, key=badness))


def badness(run: RunUp) -> tuple[int, float]:
    """A key by which the worst start comes first."""
    return WORST_FIRST.index(run.outcome), -foundation_force(run)


def foundation_force(run: RunUp) -> float:
    """The greatest force of a run on the foundation in N; 0 where none is known."""
    force = run.peaks.get("foundation_force")
    return 0.0 if force is None else force.value
