"""Start and coast-down: does the drive carry the machine through its resonance, and how hard."""

from __future__ import annotations

import math

import numpy as np

from flipflow.errors import InputError
from flipflow.model.arguments import (
    checked_monitor,
    checked_number,
    checked_positive,
    checked_speed,
)
from flipflow.model.drive import Drive, SpeedProfile
from flipflow.model.monitor import Monitor
from flipflow.model.system import Machine
from flipflow.transient.chosen_drive import NOT_SETTLED, default_drive, fitted_drive
from flipflow.transient.run_up import LAST_TURNS, STEADY, STOPPED, RunUp, judged
from flipflow.transient.shaft_equations import SHAFT_STATES
from flipflow.transient.speed_run import (
    at_rest,
    hanging_angle,
    movable,
    run_history,
    settled_start,
)
from flipflow.transient.time_stepping import CREEP, RungeKutta, Stretch

START_SECONDS = 60.0  # longest start in s unless told otherwise
COAST_SECONDS = 600.0  # longest coast-down in s unless told otherwise
MOST_SECONDS = 3600.0  # longest run in s that may be asked for
RECENT = 8  # stretches of the record that hold twice as many turns
UNSETTLED = (
    f"The motion in which the coast-down begins {NOT_SETTLED}: begun a turn later, it would have "
    "other peaks."
)


def start_up(
    machine: Machine,
    drive: Drive | SpeedProfile | None = None,
    *,
    speed: float | None = None,
    duration: float | None = None,
    angle: float | None = None,
    method: RungeKutta | None = None,
    monitor: Monitor | None = None,
) -> RunUp:
    r"""Start a machine from rest.

    With shaft angle phi, inertia J, motor torque T, friction T_f, deck angle alpha, and s = 1 for
    an unbalance that turns with the flow, -1 for one that turns counter to it,

    .. math:: J \ddot\varphi = T(\dot\varphi) - T_f + m_0 r (\ddot x_1 \sin\varphi
              - s \ddot y_1 \cos\varphi) - s m_0 r g \cos(\varphi + s \alpha) .

    The last term, gravity on the unbalance, is left out for a machine without ``deck_angle``; a
    note says so. Where the ratio of the drive is open, or the end of a converter's ramp, it is
    chosen such that the shaft settles at working speed; the result's drive has it.

    Parameters
    ----------
    machine
        A screen, or a :class:`~flipflow.MechanicalSystem` under an unbalance.
    drive
        A :class:`~flipflow.Drive`, a :class:`~flipflow.SpeedProfile`, or None for a drive that is
        assumed from the power the screen takes at working speed.
    speed
        Working speed in rad/s; None: the drive's rated speed, or the profile's highest.
    duration
        Longest time in s; None: 60 s or the profile's; a run ends when nothing changes any more.
    angle
        Shaft angle at rest in rad; None: the unbalance hangs, at -s pi/2 - s alpha, or 0 where
        gravity is left out.
    method
        How it is stepped.
    monitor
        Called with a sentence and the share done, 0 to 1; raise from it to cancel.

    Returns
    -------
    RunUp
        Whether the machine reaches its speed or is captured on the way, and the peaks.

    Raises
    ------
    InputError
        Without damping, for a bad speed or duration, and for a drive that cannot be.
    """
    movable(machine)
    given = None if speed is None else checked_speed(speed, "speed")
    checked_monitor(monitor)
    shaft = _shaft(machine, drive, given, method)
    wanted = given or _working_speed(shaft)
    begin = hanging_angle(machine)
    if angle is not None:
        begin = checked_number("angle", angle, "give a finite angle in rad")
    history = run_history(
        machine, shaft, at_rest(machine, begin), _longest(shaft, duration, START_SECONDS),
        fastest=_fastest(shaft, wanted), method=method, monitor=monitor,
        enough=None if isinstance(shaft, SpeedProfile) else _steady,
    )  # fmt: skip
    return judged(machine, shaft, wanted, history)


def coast_down(
    machine: Machine,
    speed: float,
    drive: Drive | SpeedProfile | None = None,
    *,
    duration: float | None = None,
    method: RungeKutta | None = None,
    monitor: Monitor | None = None,
) -> RunUp:
    """Let a machine come down from its settled motion at ``speed``, the motor switched off.

    Gravity on the unbalance is considered as in :func:`start_up`. A free run ends where the speed
    first falls to 2 % of ``speed``: the shaft stops, or begins to swing.

    Parameters
    ----------
    machine
        A screen, or a :class:`~flipflow.MechanicalSystem` under an unbalance.
    speed
        Speed in rad/s at which it runs.
    drive
        Its inertia and friction are used; a :class:`~flipflow.SpeedProfile` gives the speed;
        None: the drive that :func:`start_up` assumes.
    duration
        Longest time in s; None: 600 s or the profile's. A free run ends at 2 % of ``speed``.
    method, monitor
        As for :func:`start_up`.

    Returns
    -------
    RunUp
        The peaks on the way down, and how long it takes.

    Raises
    ------
    InputError
        Without damping, for a bad speed or duration, and for a drive that cannot be.
    """
    movable(machine)
    omega = checked_speed(speed, "speed")
    checked_monitor(monitor)
    shaft, slowest = _shaft(machine, drive, omega, method), -math.inf
    if isinstance(shaft, Drive):
        shaft, slowest = shaft.switched_off(), STOPPED * omega
    elif shaft.speeds[0] != omega:
        raise InputError("speeds", shaft.speeds[0], f"begin the profile at {omega:.6g} rad/s")
    start = settled_start(machine, omega, method)
    history = run_history(
        machine, shaft, start, _longest(shaft, duration, COAST_SECONDS),
        fastest=_fastest(shaft, omega), slowest=slowest, method=method, monitor=monitor,
    )  # fmt: skip
    unsettled = () if start.settled else (UNSETTLED,)
    return judged(machine, shaft, omega, history, unsettled)


def _shaft(
    machine: Machine,
    drive: Drive | SpeedProfile | None,
    speed: float | None,
    method: RungeKutta | None,
) -> Drive | SpeedProfile:
    """What turns the shaft, as given or assumed."""
    if method is not None and not isinstance(method, RungeKutta):
        raise InputError("method", method, "leave it out, or give a RungeKutta")
    if drive is None:
        return default_drive(machine, speed, method)
    if not isinstance(drive, (Drive, SpeedProfile)):
        raise InputError("drive", drive, "give an ff.Drive or an ff.SpeedProfile")
    if speed is None or isinstance(drive, SpeedProfile):
        return drive
    return fitted_drive(machine, drive, speed, method)


def _longest(shaft: Drive | SpeedProfile, duration: float | None, usual: float) -> float:
    """Longest time in s: as asked for, else that of the profile, else the usual one."""
    if duration is None:
        return shaft.duration if isinstance(shaft, SpeedProfile) else usual
    seconds = checked_positive("duration", duration, "s")
    if seconds > MOST_SECONDS:
        raise InputError("duration", duration, f"give at most {MOST_SECONDS:g} s")
    return seconds


def _working_speed(drive: Drive | SpeedProfile) -> float:
    if isinstance(drive, SpeedProfile):
        return max(drive.speeds)
    rated = drive.rated_speed
    if rated is None:
        raise InputError("motor", None, "give the drive a Motor to start with")
    return rated


def _fastest(drive: Drive | SpeedProfile, speed: float) -> float:
    if isinstance(drive, SpeedProfile):
        return max(*drive.speeds, speed)
    return max(drive.synchronous_speed or 0.0, drive.end_speed or 0.0, speed)


def _steady(done: list[Stretch]) -> bool:
    """Whether the shaft stands, or has the same mean speed over the last turns and those before."""
    recent = done[-RECENT:]
    if len(recent) == RECENT and np.abs(recent[-1].states[:, 1 - SHAFT_STATES]).max() < CREEP:
        return True  # held by friction, which fades with the speed
    t = np.concatenate([one.t for one in recent])
    angle = np.concatenate([one.states[:, -SHAFT_STATES] for one in recent])
    marks = angle[-1] - 2.0 * np.pi * LAST_TURNS * np.array([0.0, 1.0, 2.0])
    if marks[-1] < angle[0]:
        return False
    times = np.interp(marks, angle, t)
    spans = times[:-1] - times[1:]
    return bool(abs(spans[0] / spans[1] - 1.0) < STEADY)
