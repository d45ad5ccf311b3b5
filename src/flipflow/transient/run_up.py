"""What a start or a coast-down has come to: its outcome, and what is greatest on the way."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from flipflow.compiled import status
from flipflow.compiled.arrays import Real
from flipflow.dynamics.linear_response import linear_response
from flipflow.dynamics.normal import normal_direction
from flipflow.model.constants import GRAVITY, RPM
from flipflow.model.drive import Drive, SpeedProfile
from flipflow.model.excitation import Unbalance
from flipflow.model.screen import FlipFlowScreen, unit_in
from flipflow.model.system import Machine
from flipflow.results.result import Result
from flipflow.transient.history import History
from flipflow.transient.speed_run import (
    MOST_PERIODS,
    STATUS,
    turn_amplitudes,
    turn_means,
    unbalance_weight,
)
from flipflow.transient.time_stepping import CREEP

Outcome = Literal[
    "reached", "captured", "short", "not started", "unfinished", "stopped", "followed"
]
AT_SPEED = 0.95  # of the working speed: a motor's slip differs with its load
LAST_TURNS = 20  # turns over which the means at the end are taken
STEADY = 1e-5  # relative change of the mean speed from these turns to the next: nothing changes
AT_REST = 0.02  # share of the working speed below which the shaft has not started
STOPPED = 0.02  # share of its first speed at which a coast-down ends
NEAR = (0.8, 1.1)  # final speed over the natural frequency by which a start is captured
PASSING = (0.8, 1.25)  # speeds over w01 between which the time of passing is taken
AS_ONE = 1e-6  # share of the next step in time, below which rows are as good as at one time
FREE = 1e-6  # a natural frequency below this share of the highest is that of a free body


@dataclass(frozen=True)
class Peak:
    """The greatest value of a quantity on the way, in SI, with the speed in rad/s and time in s."""

    value: float
    omega: float
    t: float


class NaturalFrequency(NamedTuple):
    """A natural frequency: its name, as w01, and its value in rad/s."""

    name: str
    omega: float


@dataclass(frozen=True)
class RunSummary:
    """A start or a coast-down without its motion; the fields are those of :class:`RunUp`."""

    outcome: Outcome
    verdict: str
    angle: float
    final_speed: float
    time_to_speed: float | None
    duration: float
    passing: float | None
    peaks: Mapping[str, Peak]


@dataclass(frozen=True, eq=False)
class RunUp(Result):
    """A start or a coast-down, and what it does to the machine.

    Parameters
    ----------
    machine, drive
        What was run, and by what.
    speed
        Working speed in rad/s: where a start shall end, or where a coast-down began.
    history
        The motion in time.
    outcome
        "reached" (the speed ends within 5 % of the working speed, or above), "captured" (it stays
        near a natural frequency, the motor overloaded), "short" (it stays below the working speed
        elsewhere), "not started", "unfinished" (still changing when the time was up), "stopped"
        (coast-down), "followed" (a given speed over time).
    final_speed
        Speed at the end in rad/s; with a motor the mean over the last turns.
    near
        The natural frequency at which it is captured, else None.
    first_frequency
        w01 in rad/s; 0 for a machine that nothing holds.
    passing
        Time in s between 0.8 and 1.25 times w01; None where it is not passed.
    peaks
        ``"main_amplitude"`` (m; the greatest distance from rest in any direction, or its amplitude
        along the surface, where that direction alone is known), ``"relative_amplitude"`` (m),
        ``"shear_strain"``, ``"foundation_force"`` (N) and ``"stop_force"`` (N), as far as the
        machine has them. Amplitudes are half the way from peak to peak in one turn of the shaft;
        at a steady end, whose motion may repeat after some turns, in six.
    power
        Means over the last turns in W: ``"motor"``, ``"friction"``, ``"dampers"``; empty where
        the speed is given or changes.
    notes
        What was assumed or left out.
    angle
        Shaft angle in rad in which it began.
    """

    machine: Machine
    drive: Drive | SpeedProfile
    speed: float
    history: History
    outcome: Outcome
    final_speed: float
    near: NaturalFrequency | None
    first_frequency: float
    passing: float | None
    peaks: Mapping[str, Peak]
    power: Mapping[str, float]
    notes: tuple[str, ...]
    angle: float = 0.0

    def __repr__(self) -> str:
        speed, time = (unit_in(self.machine, unit) for unit in ("rad/s", "s"))
        end = f"{self.final_speed:.6g}{speed} after {self.duration:.4g}{time}"
        return f"RunUp({self.outcome}, {end})"

    @property
    def duration(self) -> float:
        """Time calculated in s."""
        return float(self.history.t[-1])

    @property
    def time_to_speed(self) -> float | None:
        """Time in s at which the shaft first has the working speed; None where it never has."""
        return None if self.outcome == "stopped" else self._time_at(self.speed)

    def _time_at(self, speed: float) -> float | None:
        """Time in s at which the shaft first has a speed in rad/s, between two steps."""
        omega, t = self.history.omega, self.history.t
        reached = np.flatnonzero(omega >= speed)
        if reached.size == 0:
            return None
        k = int(reached[0])
        if k == 0 or omega[k] == omega[k - 1]:
            return float(t[k])
        share = (speed - omega[k - 1]) / (omega[k] - omega[k - 1])
        return float(t[k - 1] + share * (t[k] - t[k - 1]))

    @property
    def verdict(self) -> str:
        """The outcome as a sentence, rpm first."""
        now, wanted = f"{self.final_speed * RPM:.0f} rpm", f"{self.speed * RPM:.0f} rpm"
        seconds = f"{self.duration:.3g} s"
        if self.outcome == "captured" and self.near is not None:
            held = f"{self.near.name} = {self.near.omega * RPM:.0f} rpm"
            return f"captured at {now}, near the natural frequency {held}"
        sentences = {
            "reached": f"reaches {self._reached(wanted)}, then runs at {now}",
            "short": f"stays at {now}, below the working speed of {wanted}: {self._why_short}",
            "not started": "does not start: the torque at rest does not turn the shaft",
            "unfinished": f"at {now} after {seconds}, still changing; calculate a longer time",
            "stopped": f"comes down from {wanted} in {seconds}",
            "followed": f"follows the given speed for {seconds}, ending at {now}",
        }
        return sentences[self.outcome]

    def _reached(self, wanted: str) -> str:
        """When it has its speed; 95 % of it, where it never has the whole."""
        if (time := self.time_to_speed) is not None:
            return f"{wanted} in {time:.3g} s"
        time = self._time_at(AT_SPEED * self.speed) or 0.0
        return f"{100.0 * AT_SPEED:.0f} % of {wanted} in {time:.3g} s"

    @property
    def summary(self) -> RunSummary:
        """The run without its motion."""
        return RunSummary(
            self.outcome, self.verdict, self.angle, self.final_speed, self.time_to_speed,
            self.duration, self.passing, self.peaks,
        )  # fmt: skip

    @property
    def _why_short(self) -> str:
        end = self.drive.end_speed if isinstance(self.drive, Drive) else None
        if end is not None and end <= self.speed:
            return f"its synchronous speed is {end * RPM:.0f} rpm"
        return "the drive is too weak"


def judged(
    machine: Machine,
    drive: Drive | SpeedProfile,
    speed: float,
    history: History,
    notes: tuple[str, ...] = (),
) -> RunUp:
    """A run of a machine towards ``speed`` in rad/s, and what is read off its history."""
    frequencies = _natural_frequencies(machine)
    final = turn_means(history, history.angle, LAST_TURNS)
    if math.isnan(final) or isinstance(drive, SpeedProfile) or drive.motor is None:
        final = float(history.omega[-1])
    outcome, near = _outcome(drive, speed, final, history, frequencies)
    first = frequencies.get("w01", 0.0)
    steady = outcome in {"reached", "captured", "short"}
    return RunUp(
        machine, drive, speed, history, outcome, final, near, first,
        _passing(history, first), _peaks(machine, history, steady),
        _power(history) if steady and isinstance(drive, Drive) else {},
        (*_ended_early(history), *notes, *_notes(machine, drive)),
        float(history.angle[0]),
    )  # fmt: skip


def _ended_early(history: History) -> tuple[str, ...]:
    usual = (STATUS[status.OK], STATUS[status.REACHED_LOWER])
    return () if history.status in usual else (history.status,)


def _outcome(
    drive: Drive | SpeedProfile,
    speed: float,
    final: float,
    history: History,
    frequencies: Mapping[str, float],
) -> tuple[Outcome, NaturalFrequency | None]:
    """What became of the run, and the natural frequency that holds it."""
    if isinstance(drive, SpeedProfile):
        return "followed", None
    if drive.motor is None:
        down = history.omega[-1] <= 1.001 * STOPPED * speed
        return ("stopped" if down else "unfinished"), None
    if final < AT_REST * speed and (
        drive.torque_at_rest <= drive.friction or _turned_back(history)
    ):
        return "not started", None
    if not _is_steady(history):
        return "unfinished", None
    return _steady_outcome(drive, speed, final, frequencies)


def _turned_back(history: History) -> bool:
    """Whether the shaft turned, and stood or swung back within its first turn."""
    within = float(history.angle.max() - history.angle[0]) < 2.0 * np.pi
    after = np.maximum.accumulate(history.omega) > CREEP
    return within and bool((history.omega[after] <= CREEP).any())


def _steady_outcome(
    drive: Drive, speed: float, final: float, frequencies: Mapping[str, float]
) -> tuple[Outcome, NaturalFrequency | None]:
    """A motor that gives no more than its rated torque is not held by anything: it runs."""
    if final >= AT_SPEED * speed:
        return "reached", None
    rated = drive.motor.rated_torque * drive.ratio if drive.motor else 0.0
    if not frequencies or (
        float(drive.torque(final)) <= rated and final > 0.5 * (drive.end_speed or 0.0)
    ):
        return "short", None
    name = min(frequencies, key=lambda one: abs(math.log(final / frequencies[one])))
    if NEAR[0] <= final / frequencies[name] <= NEAR[1]:
        return "captured", NaturalFrequency(name, frequencies[name])
    return "short", None


def _is_steady(history: History) -> bool:
    one, two = (turn_means(history, history.angle, k * LAST_TURNS) for k in (1, 2))
    return abs(one / two - 1.0) < STEADY


def _natural_frequencies(machine: Machine) -> dict[str, float]:
    """Those of the open machine, w01 first, and w0n normal to the surface; none of a free body."""
    found = linear_response(machine, 1.0).natural_frequencies
    vibrating = found[found > FREE * found[-1]]
    named = {f"w0{k + 1}": float(omega) for k, omega in enumerate(vibrating)}
    normal = normal_direction(machine)
    if normal is not None:
        named["w0n"] = math.sqrt(normal.stiffness / normal.mass)
    return named


def _passing(history: History, omega: float) -> float | None:
    """Time in s between both sides of a natural frequency, up or down; None if not passed."""
    inside = (history.omega > PASSING[0] * omega) & (history.omega < PASSING[1] * omega)
    within = np.flatnonzero(inside)
    if within.size == 0 or within[0] == 0 or within[-1] == inside.size - 1:
        return None
    sides = history.omega[[within[0] - 1, within[-1] + 1]] > omega
    if sides[0] == sides[1]:
        return None
    return float(history.t[within[-1]] - history.t[within[0]])


def _peaks(machine: Machine, history: History, steady: bool) -> dict[str, Peak]:
    """The greatest on the way; the motion of a steady end may repeat after some turns."""
    found = {}
    screen = machine if isinstance(machine, FlipFlowScreen) else None
    for which in ("main", "relative") if screen else history.system.named:
        times, sizes = turn_amplitudes(history, which)
        if sizes.size and steady:
            sizes[-1] = turn_amplitudes(history, which, MOST_PERIODS)[1][-1]
        if sizes.size:
            found[f"{which}_amplitude"] = _greatest(history, times, sizes)
    if screen is not None:
        if history.normal is not None:
            reach = np.hypot(history.displacement("main"), history.normal[:, 0])
            found["main_amplitude"] = top_between_steps(history, reach)
        if screen.shear_height is not None:
            reach = np.abs(history.displacement("relative"))
            found["shear_strain"] = top_between_steps(history, reach / screen.shear_height)
        found["foundation_force"] = top_between_steps(history, foundation_force(screen, history))
    for j in range(history.force.shape[1]):
        name = "stop_force" if history.force.shape[1] == 1 else f"stop_force_{j}"
        found[name] = top_between_steps(history, np.abs(history.stop_force(j)))
    return found


def _greatest(history: History, times: Real, values: Real) -> Peak:
    """The greatest of single values."""
    k = int(values.argmax())
    t = float(times[k])
    return Peak(float(values[k]), float(np.interp(t, history.t, history.omega)), t)


def top_between_steps(history: History, values: Real) -> Peak:
    """The greatest value; between steps, the top of the parabola through it and its neighbours."""
    times = history.t
    # At an event two rows have one time, of which either may lead to the top.
    rows = np.flatnonzero(times == times[int(values.argmax())])
    value, t = max(_top(times, values, int(k)) for k in rows)
    return Peak(value, float(np.interp(t, times, history.omega)), t)


def _top(times: Real, values: Real, k: int) -> tuple[float, float]:
    """Value and time of a top near row k, by three rows between which there is no event."""
    value, t = float(values[k]), float(times[k])
    for first in (k - 1, k, k - 2):
        rows = slice(first, first + 3)
        if first < 0 or times[rows].size < 3:
            continue
        steps = np.diff(times[rows])
        if steps.min() <= AS_ONE * steps.max():
            continue
        bend, slope, _ = np.polyfit(times[rows] - t, values[rows], 2)
        away = float(
            np.clip(-0.5 * slope / bend if bend < 0.0 else 0.0, *(times[rows][[0, 2]] - t))
        )
        return max(value, value + away * float(slope + bend * away)), t + away
    return value, t


def foundation_force(screen: FlipFlowScreen, history: History) -> Real:
    """Force of the isolation on the foundation in N, both directions where both are known, (n,)."""
    k, c = screen.isolation_stiffness, screen.isolation_damping
    along = k * history.displacement("main") + c * history.velocity("main")
    normal = normal_direction(screen)
    if normal is None or history.normal is None:
        return np.abs(along)
    across = normal.stiffness * history.normal[:, 0] + normal.damping * history.normal[:, 1]
    return np.asarray(np.hypot(along, across))


def _power(history: History) -> dict[str, float]:
    """Means over the last whole turns."""
    means = {name: turn_means(history, total, LAST_TURNS) for name, total in history.works.items()}
    return {
        "motor": means["input"],
        "friction": means["friction"],
        "dampers": means["dissipated"] - means["friction"],
    }


def _notes(machine: Machine, drive: Drive | SpeedProfile) -> list[str]:
    notes = []
    if isinstance(machine, FlipFlowScreen) and normal_direction(machine) is None:
        notes.append(
            "Normal direction not checked, for want of isolation.normal_stiffness and "
            "normal_damping: amplitudes and forces are those along the surface, the force on the "
            "foundation is larger."
        )
    if isinstance(drive, Drive):
        notes += [*_gravity(machine, drive), *(f"Assumed: {text}." for text in drive.assumed)]
    return notes


def _gravity(machine: Machine, drive: Drive) -> list[str]:
    """What the weight of the unbalance would change, where the equations leave it out."""
    if unbalance_weight(machine).torque != 0.0:
        return []
    forces = machine.system().excitations
    # A shaft that turns order times as fast is driven through as much of a gear.
    moment = sum(
        abs(f.order) * float(np.abs(f.vector).max()) for f in forces if isinstance(f, Unbalance)
    )
    torque = moment * GRAVITY
    if torque == 0.0:
        return []
    left_out = (
        f"Weight not considered: gravity on the unbalance, up to {torque:.3g} N m at the shaft, "
        "is not calculated."
    )
    if drive.motor is None:
        over = 2.0 * math.sqrt(torque / drive.inertia) * RPM
        swings = f"Coasting below about {over:.0f} rpm, the shaft would swing instead of turning."
        return [left_out, swings]
    at_rest = drive.torque_at_rest
    if at_rest < torque:
        lift = f"The torque at rest, {at_rest:.3g} N m at the shaft, may not lift the unbalance."
        return [left_out, lift]
    return [left_out]
