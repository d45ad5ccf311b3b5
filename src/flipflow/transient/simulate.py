"""What a machine does over time at constant speed, from rest or any state, disturbed or not."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from flipflow.compiled.arrays import Real
from flipflow.dynamics.normal import NormalDirection, normal_direction, normal_motion
from flipflow.errors import InputError
from flipflow.model.arguments import (
    checked_all,
    checked_count,
    checked_monitor,
    checked_numbers,
    checked_speed,
)
from flipflow.model.constants import GRAVITY
from flipflow.model.contact_law import engaged_side, regime_at, stored_energy
from flipflow.model.disturbance import Disturbance, Impulse, LoadStep, Lump
from flipflow.model.excitation import Unbalance
from flipflow.model.monitor import Monitor
from flipflow.model.screen import FlipFlowScreen, Load
from flipflow.model.system import Machine, MechanicalSystem, system_of
from flipflow.periodic.orbit import Orbit, initial_state
from flipflow.transient.history import ContactChange, History
from flipflow.transient.recording import Recording, work_rate
from flipflow.transient.settling import MAX_PERIODS, Settling

SAMPLES_A_TURN = 128  # default times in each forcing period
MOST_PERIODS = 1_000_000  # forcing periods that may be asked for
MOST_WORK = 5e10  # as work_rate counts it: some hours
WORK_AN_HOUR = 1.5e10  # on a processor of 2024
MOST_SAMPLES = 20_000_000  # default times that are given without being asked for
SILENT_SECONDS = 2.0  # before it is said how long the rest will take
SETTLED = 1e-6  # distance from the periodic motion, relative to it, within which it has settled
ROUNDING = 1e-12  # relative excess of the last time over the end that is rounding


def simulate(
    machine: Machine,
    omega: float,
    periods: int = 200,
    initial: str | Orbit | ArrayLike = "rest",
    disturbances: Sequence[Disturbance] = (),
    *,
    t: ArrayLike | None = None,
    monitor: Monitor | None = None,
) -> History:
    """Carry a machine through time at constant speed by the exact flow.

    Between contacts the motion is closed form, contacts are found by the certified search:
    the result is exact up to rounding, whatever the times asked for. Energies are integrated
    along the way by Gauss panels.

    Parameters
    ----------
    machine
        A screen, a :class:`~flipflow.MechanicalSystem`, or any machine with ``.system()``.
    omega
        Speed in rad/s; the unbalance points along +x at t = 0.
    periods
        Forcing periods to carry on for.
    initial
        "rest", an :class:`~flipflow.periodic.orbit.Orbit`, or a state (x, x'), (2 N,).
    disturbances
        Each an :class:`~flipflow.Impulse`, :class:`~flipflow.LoadStep` or
        :class:`~flipflow.Lump` at its time; the last two need a screen.
    t
        Times in s at which the motion is wanted; 128 a period when left out.
    monitor
        Called with a sentence, which after some seconds says how many more, and the share done;
        raise from it to cancel. The work grows with the time that is simulated, in vibrations of
        the fastest mode.

    Returns
    -------
    History
        Motion, stop forces, energies, whether the motion is periodic at the end, how far from the
        periodic motion it still is, and after how many turns that repeats. A motion is called
        settled within 1e-6 of its size.

    Raises
    ------
    InputError
        For a speed, count, state or disturbance that makes no sense, and for work of many hours.
    IncompleteError
        Where stops chatter: too many contacts even in a small part of a turn. Where the motion
        grows beyond all numbers, and at the very natural frequency of a machine without damping.
    """
    speed = checked_speed(omega)
    periods = checked_count("periods", periods, MOST_PERIODS)
    say = checked_monitor(monitor)
    turn = 2.0 * math.pi / speed
    end = periods * turn
    system = system_of(machine)
    _require_time_for(system, speed, periods)
    times = _times(t, periods, turn)
    blows = sorted(_checked_blows(disturbances), key=lambda one: one.t)
    if blows and blows[-1].t >= end:
        raise InputError("disturbances", blows[-1].t, f"give a time before the end, {end:.6g} s")
    z = initial_state(system, initial)
    run = _Run(machine, system_of, speed, end, say)
    run.carry(Recording(times, system.size, len(system.springs)), z, blows)
    distance, near, repeats = _settled(run.system(), run.z, speed)
    table = run.recording.table
    return History(
        system=system,
        t=times,
        x=table.x,
        v=table.v,
        a=table.a,
        force=table.force,
        peak=table.peak,
        omega=np.full(times.size, speed),
        angle=speed * times,
        normal=_normal(machine, speed, times, initial, blows, end),
        energy=run.energy(),
        settled=near,
        distance=distance,
        events=run.events(),
        status="The motion was carried to its end.",
        method="exact flow",
        counters={"events": len(run.recording.changes)},
        repeats_after=repeats,
    )


def _require_time_for(system: MechanicalSystem, omega: float, periods: int) -> None:
    """Refuse turns so slow that the vibrations in them take hours."""
    work = work_rate(system.with_bonded(), omega) * periods * 2.0 * math.pi / omega
    if work > MOST_WORK:
        raise InputError(
            "omega", omega,
            f"{periods} turns at it hold so many of the machine's own vibrations that they take "
            f"about {work / WORK_AN_HOUR:.2g} hours; give fewer periods or a higher speed",
        )  # fmt: skip


def _settled(
    system: MechanicalSystem, z: Real, omega: float
) -> tuple[float | None, bool, int | None]:
    """Distance of z from the motion ahead, whether it is next to none, turns of that motion."""
    if not np.count_nonzero(system.with_bonded().C):
        return None, False, None  # without damping no motion is approached
    settling = Settling(system, MAX_PERIODS)
    point = settling.ahead_of(z, omega)
    if point is None:
        return None, False, None
    distance = settling.distance_from(point, z)
    near = distance <= SETTLED * settling.size(z[None], omega)
    return distance, near, point.formulation.turns


def _checked_blows(disturbances: object) -> tuple[Disturbance, ...]:
    kinds, remedy = (Impulse, LoadStep, Lump), "give a list of ff.Impulse, ff.LoadStep or ff.Lump"
    given = checked_all("disturbances", disturbances, kinds, remedy)
    return cast("tuple[Disturbance, ...]", given)


def _times(t: ArrayLike | None, periods: int, turn: float) -> Real:
    if t is None:
        count = periods * SAMPLES_A_TURN
        if count > MOST_SAMPLES:
            raise InputError("periods", periods, "give the times t wanted for so long a run")
        return np.linspace(0.0, periods * turn, count + 1)
    remedy = "give finite times in one row"
    times = np.atleast_1d(checked_numbers("t", t, remedy))
    if times.ndim != 1 or times.size == 0:
        raise InputError("t", t, remedy)
    end = periods * turn
    if times[0] < 0.0 or times[-1] > end * (1.0 + ROUNDING) or (np.diff(times) < 0.0).any():
        raise InputError("t", t, f"give rising times from 0 to {end:.6g} s")
    return np.asarray(np.minimum(times, end))


class _Run:
    """One machine carried from blow to blow; ``build`` makes its equations of motion."""

    def __init__(
        self,
        machine: Machine,
        build: Callable[[Machine], MechanicalSystem],
        omega: float,
        end: float,
        monitor: Monitor | None,
    ) -> None:
        self.machine, self.build, self.omega, self.end = machine, build, omega, end
        self.monitor, self.began = monitor, time.monotonic()
        self.blown = {"impulses": 0.0, "loads": 0.0}
        self.sunk = np.zeros(build(machine).size)  # by the weight that came on the way, in m

    def carry(self, recording: Recording, z: Real, blows: Sequence[Disturbance]) -> None:
        """Fill ``recording`` from the state z to the end."""
        self.recording, self.z = recording, z
        self.begin = self.stored(), self.held()
        at = 0.0
        for blow in (*blows, None):
            until = self.end if blow is None else blow.t
            self.z = recording.carry(self.system(), self.z, self.omega, at, until, self._tell)
            at = until
            if blow is not None:
                before = self.moving()
                kind = "impulses" if isinstance(blow, Impulse) else "loads"
                self._strike(blow)
                # A blow that makes a clipped stop take hold, or let go, gives it no energy.
                self.blown[kind] += self.moving() - before

    def system(self) -> MechanicalSystem:
        """The machine as it is now; displacements count from where it hung at the beginning."""
        system = self.build(self.machine)
        if not self.sunk.any():
            return system
        return replace(system, static_force=system.constant_force + system.K @ self.sunk)

    def moving(self) -> float:
        """Energy in J of the masses and of the springs that always act."""
        system = self.system().with_bonded()
        x, v = np.split(self.z, 2)
        return float(0.5 * v @ system.M @ v + 0.5 * x @ system.K @ x)

    def stored(self) -> float:
        """Energy in J of the masses and of all springs."""
        return self.moving() + self.held()

    def held(self) -> float:
        """Energy in J of the stops that are touched."""
        system = self.system().with_bonded()
        x, v = np.split(self.z, 2)
        total = 0.0
        for spring in system.springs:
            y, rate = spring.direction @ x, spring.direction @ v
            regime = regime_at(spring.law, spring.stiffness, spring.damping, spring.gaps, y, rate)
            held = stored_energy(spring.law, spring.stiffness, spring.gaps, regime, np.asarray(y))
            total += float(held)
        return total

    def energy(self) -> dict[str, float]:
        """The balance over the whole time, J."""
        work = self.recording.work
        stored, held = self.stored() - self.begin[0], self.held() - self.begin[1]
        dissipated = work["dampers"] + work["stops"] - held
        return {"input": work["input"], **self.blown, "dissipated": dissipated, "stored": stored}

    def events(self) -> tuple[ContactChange, ...]:
        """Every change of contact."""
        springs = self.build(self.machine).springs
        return tuple(
            ContactChange(t, j, int(engaged_side(springs[j].law, regime)))
            for t, j, regime in self.recording.changes
        )

    def _strike(self, blow: Disturbance) -> None:
        system = self.system()
        n = system.size
        self.z = self.z.copy()
        if isinstance(blow, Impulse):
            push = np.linalg.solve(system.M, system.coordinate(blow.which))
            self.z[n:] += push * blow.impulse
            return
        if not isinstance(self.machine, FlipFlowScreen):
            raise InputError("disturbances", blow, "only a screen has frames that can be loaded")
        if isinstance(blow, LoadStep):
            self._take_up(blow.load)
            return
        frame = 0 if blow.frame == "main" or n == 1 else 1
        mass, velocity = system.M[frame, frame], blow.velocity if n > 1 else 0.0
        self.z[n + frame] = (mass * self.z[n + frame] + blow.mass * velocity) / (mass + blow.mass)
        main = blow.mass if blow.frame == "main" else 0.0
        self._take_up(Load(main_mass=main, floating_mass=blow.mass - main))

    def _take_up(self, load: Load) -> None:
        """Carry a load from now on: what it adds hangs on the springs as they are under it."""
        screen = cast("FlipFlowScreen", self.machine)
        self.machine = screen.loaded(load).replace(measured_shift=screen.gap_shift)
        if screen.deck_angle is None:
            return
        system = self.build(self.machine)
        weight = GRAVITY * np.array([load.main_mass, load.floating_mass])
        along = weight * math.sin(screen.deck_angle)
        across = weight.sum(keepdims=True) * math.cos(screen.deck_angle)
        self.sunk = self.sunk - np.linalg.solve(system.K, along if system.size > 1 else across)

    def _tell(self, t: float) -> None:
        if self.monitor is None:
            return
        passed = time.monotonic() - self.began
        sentence = f"{t:.4g} s of {self.end:.4g} s"
        if passed > SILENT_SECONDS:
            sentence += f", about {passed * (self.end / t - 1.0):.0f} s to go"
        self.monitor(sentence, t / self.end)


def _normal(
    machine: Machine,
    omega: float,
    times: Real,
    initial: str | Orbit | ArrayLike,
    blows: Sequence[Disturbance],
    end: float,
) -> Real | None:
    """y, y', y'' normal to the surface (K, 3): from rest, else from its steady motion."""
    steady = normal_motion(machine, omega)
    if steady is None:
        return None
    z = np.zeros(2)
    if not isinstance(initial, str):
        z = np.array([float(steady.displacement(0.0)), float(steady.velocity(0.0))])
    run = _Run(machine, _normal_system, omega, end, None)
    along = [blow for blow in blows if not isinstance(blow, Impulse)]
    run.carry(Recording(times, 1, 0), z, along)
    table = run.recording.table
    return np.column_stack([table.x, table.v, table.a])


def _normal_system(machine: Machine) -> MechanicalSystem:
    """Both frames as one mass on the isolation, under s m0r w^2 sin(w t), s its sense."""
    one = cast("NormalDirection", normal_direction(machine))
    moment = one.sense * cast("FlipFlowScreen", machine).eccentric_moment
    unbalance = Unbalance([-1j * moment])
    return MechanicalSystem([[one.mass]], [[one.damping]], [[one.stiffness]], (), unbalance)
