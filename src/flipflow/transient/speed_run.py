"""One run at varying speed as a history, and what is read off it: amplitudes, means, forces."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled import status
from flipflow.compiled.arrays import Real
from flipflow.dynamics.normal import normal_direction
from flipflow.errors import InputError
from flipflow.model.constants import GRAVITY
from flipflow.model.contact_law import engaged_side
from flipflow.model.drive import Drive, SpeedProfile
from flipflow.model.monitor import Monitor
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.starter import STAR_TORQUE, Converter, StarDelta
from flipflow.model.system import Coordinate, Machine, MechanicalSystem, system_of
from flipflow.transient.history import ContactChange, History, stop_forces
from flipflow.transient.time_stepping import (
    WEIGHTLESS,
    RungeKutta,
    Stepper,
    Stretch,
    UnbalanceWeight,
)

MOST_ROWS = 400_000  # rows after which a run is ended
SETTLED = 1e-7  # change of the state over a period, relative to it, within which it has settled
MOST_TURNS = 2000  # turns waited for a motion to settle
TURNS_AT_ONCE = 20  # turns between two looks at whether it has settled
MOST_PERIODS = 6  # turns after which a settled motion may repeat
MOST_STEPS = 5e6  # for these turns: half a minute, and it settles in twice as many at least

STATUS = {
    status.OK: "The whole time was calculated.",
    status.POINT_LIMIT: f"The run ended early, at {MOST_ROWS} steps; shorten its duration.",
    status.REACHED_LOWER: "The run ended when the shaft had come down to its last speed.",
    status.REACHED_UPPER: "The run ended when the shaft had reached its last speed.",
    status.NOT_FINITE: "The motion grew beyond all bounds; check damping and stiffness.",
    status.STEP_TOO_SMALL: "The step became too small; check damping and stiffness of the stops.",
    status.TOO_MANY_EVENTS: "A stop chattered without end; give it some damping or a gap.",
}


@dataclass(frozen=True)
class Start:
    """Where a run begins: (x, x') with the normal direction last in each, angle in rad, rad/s.

    ``settled`` is False where it was meant to be a settled motion and is none.
    """

    state: Real
    angle: float
    speed: float
    settled: bool = True


def unbalance_weight(machine: Machine) -> UnbalanceWeight:
    """Gravity on the unbalance of a screen; none where its ``deck_angle`` is not known."""
    if not isinstance(machine, FlipFlowScreen) or machine.deck_angle is None:
        return WEIGHTLESS
    # Turning the other way, the unbalance is lifted where it would fall: (cos phi, -sin phi).
    sense = machine.normal_sense
    return UnbalanceWeight(sense * machine.eccentric_moment * GRAVITY, sense * machine.deck_angle)


def hanging_angle(machine: Machine) -> float:
    """Shaft angle in rad at which the unbalance hangs; 0 where no weight is considered."""
    weight = unbalance_weight(machine)
    if weight.torque == 0.0:
        return 0.0
    return -math.copysign(0.5 * math.pi, weight.torque) - weight.incline


def movable(machine: Machine) -> MechanicalSystem:
    """The machine as a system, refused without damping."""
    system = system_of(machine)
    system.with_bonded().require_damping()
    return system


def at_rest(machine: Machine, angle: float = 0.0) -> Start:
    """Everything at rest, the unbalance at an angle to +x."""
    x = system_of(machine).static_position()
    if normal_direction(machine) is not None:
        x = np.append(x, 0.0)
    return Start(np.concatenate([x, np.zeros(x.size)]), angle, 0.0)


def run_history(
    machine: Machine,
    shaft: Drive | SpeedProfile,
    start: Start,
    duration: float,
    *,
    fastest: float,
    slowest: float = -np.inf,
    method: RungeKutta | None = None,
    monitor: Monitor | None = None,
    enough: Callable[[list[Stretch]], bool] | None = None,
) -> History:
    """Run a machine with its shaft and keep every step.

    ``enough`` is called with all that was calculated so far, and ends the run by returning True;
    ``monitor`` is called with the time reached.
    """
    system, normal = movable(machine), normal_direction(machine)
    stepper = Stepper(
        system, shaft, start.state, angle=start.angle, speed=start.speed, normal=normal,
        method=method, fastest=fastest, end_speeds=(slowest, np.inf),
        weight=unbalance_weight(machine),
    )  # fmt: skip
    done: list[Stretch] = []
    changes: list[tuple[float, int, int]] = []
    rows, early = 0, False
    for stretch in stepper.run(duration):
        changes += stepper.changes()
        if stretch.t.size:
            done.append(stretch)
        rows += stretch.t.size
        if monitor is not None:
            monitor(f"{stepper.time:.4g} s of {duration:.4g} s", min(stepper.time / duration, 1.0))
        early = stepper.code in (status.OK, status.POINT_LIMIT) and bool(enough and enough(done))
        if early or rows >= MOST_ROWS:
            break
    code = status.OK if early else stepper.code
    return _history(system, stepper, shaft, done, changes, STATUS[code])


def settled_start(machine: Machine, speed: float, method: RungeKutta | None = None) -> Start:
    """The state into which the machine settles from rest at constant speed, at angle 0.

    The motion may repeat after up to six turns. Where it has not settled after 2000 turns, the
    state reached then is returned, marked as not settled.

    Raises
    ------
    InputError
        Without damping, and where so slow a turn is too many steps of the fastest vibration.
    """
    movable(machine)
    duration = TURNS_AT_ONCE * 2.0 * np.pi / speed
    steps = duration / _stepper(machine, speed, at_rest(machine).state, method).longest_step
    if steps > MOST_STEPS:
        remedy = (
            f"{TURNS_AT_ONCE} turns at it are about {steps:.0e} steps, more than is waited for "
            "until the motion has settled; give a higher speed"
        )
        raise InputError("speed", speed, remedy)
    state = at_rest(machine).state
    for _ in range(MOST_TURNS // TURNS_AT_ONCE):
        state = _carried(machine, speed, state, TURNS_AT_ONCE - MOST_PERIODS, method)
        before = []
        for _ in range(MOST_PERIODS):
            before.append(state)
            state = _carried(machine, speed, state, 1, method)
        if np.abs(state - before).max(axis=1).min() <= SETTLED * np.abs(state).max():
            return Start(state, 0.0, speed)
    return Start(state, 0.0, speed, settled=False)


def _carried(
    machine: Machine, speed: float, state: Real, turns: int, method: RungeKutta | None
) -> Real:
    """The state after some turns at constant speed."""
    stepper = _stepper(machine, speed, state, method)
    for _stretch in stepper.run(turns * 2.0 * np.pi / speed):
        pass
    return stepper.walk.s[: state.size].copy()


def _stepper(machine: Machine, speed: float, state: Real, method: RungeKutta | None) -> Stepper:
    """A run at constant speed from a state."""
    return Stepper(
        system_of(machine), SpeedProfile((0.0, 1.0), (speed, speed)), state,
        normal=normal_direction(machine), method=method, fastest=speed,
    )  # fmt: skip


def steady_power(
    machine: Machine, speed: float, method: RungeKutta | None = None
) -> tuple[float, bool]:
    """Mean power in W that the dampers take at constant speed, and whether the motion has settled.

    Both directions together, over twenty turns.
    """
    start = settled_start(machine, speed, method)
    duration = TURNS_AT_ONCE * 2.0 * np.pi / speed
    profile = SpeedProfile((0.0, 1.0), (speed, speed))
    run = run_history(machine, profile, start, duration, fastest=speed, method=method)
    return run.energy["dissipated"] / duration, start.settled


def turn_amplitudes(history: History, which: Coordinate, turns: int = 1) -> tuple[Real, Real]:
    """Times in s of a coordinate's turning points behind the start, and its amplitude, (k,) each.

    Amplitude is half the way in m from the lowest to the highest turning point in the shaft's turn
    that ends there, 2 pi of its way there and back; where only one lies in it, from the one before.
    The start counts as a turning point.
    """
    t, x = history.t, history.displacement(which)
    times, ends = turning_points(t, x, history.velocity(which))
    if times.size == 0 or times[0] > t[0]:
        times, ends = np.append(t[0], times), np.append(x[0], ends)
    turned = np.interp(times, t, np.append(0.0, np.cumsum(np.abs(np.diff(history.angle)))))
    rows = np.arange(times.size)
    first = np.minimum(np.searchsorted(turned, turned - turns * 2.0 * np.pi, "right"), rows - 1)[1:]
    spans = np.column_stack([first, rows[1:] + 1]).ravel()
    ends = np.append(ends, 0.0)  # that of the last span lies behind the last turning point
    most, least = (of.reduceat(ends, spans)[::2] for of in (np.maximum, np.minimum))
    return times[1:], (most - least) / 2.0


def behind_first_turn(history: History, times: Real) -> NDArray[np.bool_]:
    """Which times in s, (k,), have a whole turn of the shaft behind them."""
    turned = np.interp(times, history.t, history.angle) - history.angle[0]
    return np.asarray(turned >= 2.0 * np.pi)


def turning_points(t: Real, x: Real, v: Real) -> tuple[Real, Real]:
    """Times of the turning points of x(t), and x there.

    A start at rest is a turning point; one in the midst of a motion is none.
    """
    # A row may stand right on a turning point: a law may change there, whose time is then found.
    moving = np.flatnonzero(v)
    before = moving[:-1][v[moving[:-1]] * v[moving[1:]] < 0.0]
    h = t[before + 1] - t[before]
    share = v[before] / (v[before] - v[before + 1])
    # The velocity is close to a straight line at a turning point, its area is the way there.
    ends = x[before] + 0.5 * share * h * v[before]
    times = t[before] + share * h
    if v[0] == 0.0:
        times, ends = np.append(t[0], times), np.append(x[0], ends)
    return times, ends


def turn_means(history: History, values: Real, turns: int) -> float:
    """Mean rate of a running total over the last whole turns; NaN with fewer turns than that."""
    end = float(history.angle[-1])
    begin = end - 2.0 * np.pi * turns
    if begin <= history.angle[0]:
        return float("nan")
    row = int(np.searchsorted(history.angle, begin))
    t, total = (
        float(np.interp(begin, history.angle[row - 1 : row + 1], y[row - 1 : row + 1]))
        for y in (history.t, values)
    )
    return float((values[-1] - total) / (history.t[-1] - t))


def _history(
    system: MechanicalSystem,
    stepper: Stepper,
    shaft: Drive | SpeedProfile,
    done: list[Stretch],
    changes: list[tuple[float, int, int]],
    ended: str,
) -> History:
    t, s, slope = (np.concatenate([getattr(one, k) for one in done]) for k in _PARTS)
    contacts = np.concatenate([one.contacts for one in done])
    n, size = system.size, stepper.size
    x, v = s[:, :n], s[:, size : size + n]
    speed = s[:, 2 * size + 1]
    across = [s[:, n], s[:, size + n], slope[:, size + n]] if size > n else None
    columns = system.opening
    stored = [stepper.stored_energy(s[k], contacts[k]) for k in (0, -1)]
    field, worked, damped, rubbed = s[:, 2 * size + 2 :].T
    return History(
        system, t, x, v, slope[:, size : size + n], stop_forces(system, x, v, contacts),
        speed, s[:, 2 * size],
        torque=_torque(shaft, t, speed, field) if isinstance(shaft, Drive) else None,
        normal=None if across is None else np.column_stack(across),
        energy={
            "input": float(worked[-1]), "dissipated": float(damped[-1] + rubbed[-1]),
            "impulses": 0.0, "loads": 0.0, "stored": float(stored[1] - stored[0]),
            "friction": float(rubbed[-1]),
        },
        events=tuple(
            ContactChange(time, columns[j], int(engaged_side(stepper.springs[j].law, regime)))
            for time, j, regime in changes
        ),
        status=ended, notes=(), method=f"event-located Runge-Kutta, {stepper.method.formula}",
        counters=stepper.counters,
        works={"input": worked, "dissipated": damped + rubbed, "friction": rubbed},
    )  # fmt: skip


def _torque(drive: Drive, t: Real, speed: Real, field: Real) -> Real:
    """Torque of the motor at the shaft over a run in N m, as it was switched."""
    starter = drive.starter
    if isinstance(starter, Converter):
        return drive.converter_torque(starter, speed, field)
    torque = drive.torque(speed)
    if isinstance(starter, StarDelta):
        in_delta = np.full(t.size, False)
        if starter.time is not None:
            in_delta |= t >= starter.time
        if starter.speed is not None:
            in_delta |= np.maximum.accumulate(speed) >= starter.speed / drive.ratio
        torque = np.where(in_delta, torque, STAR_TORQUE * torque)
    return torque


_PARTS = ("t", "states", "slopes")
