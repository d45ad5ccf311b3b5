"""Motion at varying speed: event-located Runge-Kutta on the machine with its shaft."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled import status
from flipflow.compiled.arrays import Real
from flipflow.dynamics.assembly import stops_of
from flipflow.dynamics.normal import NormalDirection
from flipflow.errors import InputError
from flipflow.model.arguments import checked_number, checked_positive, checked_word
from flipflow.model.contact_law import stored_energy
from flipflow.model.drive import Drive, SpeedProfile
from flipflow.model.excitation import Unbalance
from flipflow.model.starter import STAR_TORQUE, Converter, StarDelta
from flipflow.model.system import MechanicalSystem
from flipflow.model.torque_curve import NO_PIECES
from flipflow.transient import runge_kutta
from flipflow.transient.runge_kutta import Walk
from flipflow.transient.shaft_equations import (
    CONVERTER,
    MAINS,
    SHAFT_STATES,
    UNBALANCE,
    Equations,
    Shaft,
)
from flipflow.transient.tableaux import DORMAND_PRINCE, RK4, Tableau

Formula = Literal["dopri5", "rk4"]
TABLEAUX: dict[str, Tableau] = {"dopri5": DORMAND_PRINCE, "rk4": RK4}
CHUNK = 2048  # rows of the record, after which a stretch is handed over
STEPS_PER_TURN = 40  # of the fastest turn or vibration: the longest step is one of them
CREEP = 0.1  # rad/s, shaft speed below which the constant friction fades


@dataclass(frozen=True)
class RungeKutta:
    """How a motion at varying speed is stepped.

    Parameters
    ----------
    formula
        ``"dopri5"`` (Dormand and Prince's 5(4) pair) or ``"rk4"`` (the classical method).
    tolerance
        Error allowed in one step, relative to the motion; "dopri5" only.
    step
        Length of a step in s; None: by the tolerance for "dopri5", a fortieth of the fastest turn
        or vibration for "rk4".
    """

    formula: Formula = "dopri5"
    tolerance: float = 1e-8
    step: float | None = None

    def __post_init__(self) -> None:
        checked_word("formula", self.formula, get_args(Formula), "choose dopri5 or rk4")
        remedy = "choose between 1e-13 and 1e-2"
        tolerance = checked_number("tolerance", self.tolerance, remedy)
        if not 1e-13 <= tolerance <= 1e-2:
            raise InputError("tolerance", self.tolerance, remedy)
        object.__setattr__(self, "tolerance", tolerance)
        if self.step is not None:
            object.__setattr__(self, "step", checked_positive("step", self.step, "s"))


class UnbalanceWeight(NamedTuple):
    """Gravity on the unbalance: m0r g in N m, and the incline of the x direction in rad."""

    torque: float
    incline: float

    def energy(self, angle: float) -> float:
        """Energy in J that lifting it to a shaft angle in rad takes, from the shaft's height."""
        return self.torque * math.sin(angle + self.incline)


WEIGHTLESS = UnbalanceWeight(0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Stretch:
    """Rows of a record: times (n,), states and their slopes (n, 2 N + 6), contacts (n, m)."""

    t: Real
    states: Real
    slopes: Real
    contacts: NDArray[np.int64]


class Stepper:
    """One run of a machine with its shaft, carried on stretch by stretch.

    Parameters
    ----------
    system
        The machine, springs that always act included.
    shaft
        What turns it.
    state
        (x, x') at the start, (2 N,).
    angle, speed
        Shaft angle in rad and, for a drive, its speed in rad/s at the start.
    normal
        The direction normal to the surface as one more degree of freedom with its (y, y') at the
        end of ``state``; the exciter is circular then.
    method
        Formula and tolerance.
    fastest
        Highest shaft speed in rad/s that is expected, for the longest step.
    end_speeds
        The run ends where the speed falls to the first or rises to the second.
    weight
        Gravity on the unbalance.
    """

    def __init__(
        self,
        system: MechanicalSystem,
        shaft: Drive | SpeedProfile,
        state: Real,
        *,
        angle: float = 0.0,
        speed: float = 0.0,
        normal: NormalDirection | None = None,
        method: RungeKutta | None = None,
        fastest: float,
        end_speeds: tuple[float, float] = (-math.inf, math.inf),
        weight: UnbalanceWeight = WEIGHTLESS,
    ) -> None:
        self.method = method or RungeKutta()
        self.profile = shaft if isinstance(shaft, SpeedProfile) else None
        linear = system.with_bonded()
        self.M, C, K, vector, static = extended(linear, normal)
        self.size = self.M.shape[0]
        self.springs = linear.springs
        drive = shaft if isinstance(shaft, Drive) else None
        inverse = np.asarray(np.linalg.inv(self.M), dtype=np.float64)
        terms = [(one, power) for one in linear.excitations for power, _ in one.terms]
        self.order = np.array([one.order for one, _ in terms], np.int64)
        self.power = np.array([power for _, power in terms], np.int64)
        if drive is not None:
            _check_drive(drive, inverse, vector, self.order, linear)
        self.vector, self.drive, self.weight = vector, drive, weight
        self.K, self.static = K, static
        self._plan = _plan(shaft, end_speeds)
        self._dials = Dials(np.zeros(1), np.ones(1), np.zeros(1), np.array(end_speeds))
        self.equations = Equations(
            inverse_mass=inverse, damping=C, stiffness=K,
            direction=self._directions(), stops=stops_of(linear.springs), static=static,
            circulation=0.5 * (K - K.T), vector=vector, order=self.order, power=self.power,
            shaft=_shaft(drive, weight, self._dials),
            pull=np.zeros(self.size), lever=np.zeros(self.size), push=np.zeros(self.size),
            answer=np.zeros(self.size),
        )  # fmt: skip
        start = speed if self.profile is None else self.profile.speeds[0]
        s = np.concatenate([state, [angle, start], np.zeros(SHAFT_STATES - 2)])
        self.walk = self._walk(s, fastest)
        runge_kutta.begin(self.equations, self.walk)
        self.code = status.OK

    @property
    def time(self) -> float:
        """Time reached in s."""
        return float(self.walk.time[0])

    @property
    def speed(self) -> float:
        """Shaft speed reached in rad/s."""
        return float(self.walk.s[2 * self.size + 1])

    @property
    def longest_step(self) -> float:
        """Longest step in s; the only one of a method with a fixed step."""
        return float(self.method.step or self.walk.longest)

    @property
    def counters(self) -> dict[str, int]:
        """Steps, events, rejected steps."""
        count = self.walk.tally
        return {
            "steps": int(count[runge_kutta.STEPS]),
            "events": int(count[runge_kutta.EVENTS]),
            "rejected": int(count[runge_kutta.REJECTED]),
        }

    def run(self, until: float) -> Iterator[Stretch]:
        """Step to time ``until`` in s, handing over the record whenever it is full."""
        for leg in self._plan:
            if leg.until <= self.time or self.time >= until:
                continue
            self._dials.set(leg)
            end = min(leg.until, until)
            while True:
                self.code = runge_kutta.advance(self.equations, self.walk, end)
                if self.code != status.POINT_LIMIT:
                    break
                yield self._emptied()
            switched = leg.switch_over is not None and self.code == status.REACHED_UPPER
            if self.code != status.OK and not switched:
                break
        yield self._emptied()

    def changes(self) -> list[tuple[float, int, int]]:
        """Changes of contact since the last call: time, spring, its state then."""
        walk, count = self.walk, int(self.walk.tally[runge_kutta.CHANGES])
        self.walk.tally[runge_kutta.CHANGES] = 0
        rows = zip(walk.change_time[:count], walk.change[:count], strict=True)
        return [(float(t), int(j), int(state)) for t, (j, state) in rows]

    def stored_energy(self, state: Real, contacts: NDArray[np.int64]) -> float:
        """Energy in J of masses, springs, engaged stops and, with a drive, the shaft."""
        n = self.size
        x, v, angle, speed = state[:n], state[n : 2 * n], state[2 * n], state[2 * n + 1]
        energy = 0.5 * float(v @ self.M @ v + x @ self.K @ x)
        for spring, regime in zip(self.springs, contacts, strict=True):
            y = np.asarray(spring.direction @ x[: spring.direction.size])
            held = stored_energy(spring.law, spring.stiffness, spring.gaps, np.asarray(regime), y)
            energy += float(held)
        if self.drive is not None:
            # Beside a given speed the constant force's work counts as put in.
            energy -= float(self.static @ x)
            turns = np.exp(1j * self.order * angle) / self.order
            lever = (turns @ self.vector).imag
            energy += 0.5 * self.drive.inertia * speed**2 - speed * float(lever @ v)
            energy += self.weight.energy(float(angle))
        return energy

    def _emptied(self) -> Stretch:
        walk, rows = self.walk, int(self.walk.tally[runge_kutta.ROWS])
        walk.tally[runge_kutta.ROWS] = 0
        return Stretch(
            walk.t[:rows].copy(), walk.record[:rows].copy(), walk.rate[:rows].copy(),
            walk.regimes[:rows].copy(),
        )  # fmt: skip

    def _directions(self) -> Real:
        """Directions of the springs, (m, N); none acts normal to the surface."""
        directions = np.zeros((len(self.springs), self.size))
        for row, spring in zip(directions, self.springs, strict=True):
            row[: spring.direction.size] = spring.direction
        return directions

    def _walk(self, s: Real, fastest: float) -> Walk:
        method, tableau = self.method, TABLEAUX[self.method.formula]
        stages, m = len(tableau.b), len(self.springs)
        a = np.zeros((stages, stages))
        for i, row in enumerate(tableau.a):
            a[i, : len(row)] = [float(value) for value in row]
        longest = _longest_step(self.M, self.K, fastest * int(self.order.max()))
        adaptive = method.formula == "dopri5" and method.step is None
        rows = CHUNK + 2
        return Walk(
            a=a, b=np.array([float(value) for value in tableau.b]),
            error=np.array([float(value) for value in tableau.error]), order=tableau.order,
            relative=method.tolerance if adaptive else 0.0,
            absolute=self._absolute(s, fastest), longest=longest,
            step=np.array([method.step or longest]), time=np.zeros(1),
            regime=np.zeros(m, np.int64), s=s.copy(), end=np.zeros(s.size),
            rows=np.zeros((stages + 1, s.size)), tally=np.zeros(7, np.int64), t=np.zeros(rows),
            record=np.zeros((rows, s.size)), rate=np.zeros((rows, s.size)),
            regimes=np.zeros((rows, m), np.int64), change_time=np.zeros(rows),
            change=np.zeros((rows, 2), np.int64),
        )  # fmt: skip

    def _absolute(self, s: Real, fastest: float) -> Real:
        """Absolute tolerances: the size of the motion, its speed, the shaft; works not watched."""
        n = self.size
        reach = np.abs(self.vector) @ np.abs(self.equations.inverse_mass).T
        thrown = float(reach[self.power == UNBALANCE].max(initial=0.0))
        length = max(thrown, float(np.abs(s[:n]).max()))
        gaps = [abs(gap) for spring in self.springs for gap in spring.gaps if math.isfinite(gap)]
        length = max([length, *gaps]) or float(reach.max()) / fastest**2 or 1.0
        sizes = [*[length] * n, *[length * fastest] * n, 1.0, fastest, *[math.inf] * 4]
        return self.method.tolerance * np.array(sizes)


def extended(
    system: MechanicalSystem, normal: NormalDirection | None
) -> tuple[Real, Real, Real, NDArray[np.complex128], Real]:
    """M, C, K, vectors of the exciting terms (E, N) and constant force, with the normal direction.

    It is one more degree of freedom. Normal to the surface the unbalance acts a quarter of a turn
    later, or sooner where it turns the other way: its component is -i, or i, times that along the
    surface.
    """
    vector = np.array([vector for one in system.excitations for _, vector in one.terms])
    static = np.array(system.constant_force)
    if normal is None:
        return np.array(system.M), np.array(system.C), np.array(system.K), vector, static
    pairs = ((system.M, normal.mass), (system.C, normal.damping), (system.K, normal.stiffness))
    M, C, K = (np.block([[A, np.zeros((len(A), 1))], [np.zeros(len(A)), b]]) for A, b in pairs)
    across = -1j * normal.sense * vector.sum(axis=1, keepdims=True)
    return M, C, K, np.concatenate([vector, across], axis=1), np.append(static, 0.0)


def _longest_step(M: Real, K: Real, fastest: float) -> float:
    """A fortieth of the fastest turn or of the fastest vibration of the open machine."""
    highest = math.sqrt(max(float(np.linalg.eigvals(np.linalg.solve(M, K)).real.max()), 0.0))
    return 2.0 * math.pi / STEPS_PER_TURN / max(fastest, highest)


@dataclass(frozen=True)
class Leg:
    """A part of a run in which nothing is switched: its end in s, and how the shaft is driven.

    ``acceleration`` of a given speed, ``field_rate`` of a converter's field in rad/s^2; ``share``
    of its torque that a motor gives; speeds in rad/s at which the run ends, and at which the leg
    does.
    """

    until: float
    ends: tuple[float, float]
    acceleration: float = 0.0
    share: float = 1.0
    field_rate: float = 0.0
    switch_over: float | None = None


class Dials(NamedTuple):
    """What is set from leg to leg, as the equations read it."""

    acceleration: Real  # (1,)
    share: Real  # (1,)
    field_rate: Real  # (1,)
    ends: Real  # (2,)

    def set(self, leg: Leg) -> None:
        """Turn them as a leg says."""
        self.acceleration[0], self.share[0] = leg.acceleration, leg.share
        self.field_rate[0], self.ends[:] = leg.field_rate, leg.ends
        if leg.switch_over is not None:
            self.ends[1] = leg.switch_over


def _plan(shaft: Drive | SpeedProfile, ends: tuple[float, float]) -> tuple[Leg, ...]:
    """The legs of a run: straight pieces of a profile, star and delta, the ramp of a converter."""
    last = Leg(math.inf, ends)
    if isinstance(shaft, SpeedProfile):
        points = list(zip(shaft.times, shaft.speeds, strict=True))
        rises = ((b, (v - u) / (b - a)) for (a, u), (b, v) in itertools.pairwise(points))
        return (*(Leg(end, ends, acceleration=rise) for end, rise in rises), last)
    starter = shaft.starter
    if isinstance(starter, StarDelta):
        speed = None if starter.speed is None else starter.speed / shaft.ratio
        star = Leg(starter.time or math.inf, ends, share=STAR_TORQUE, switch_over=speed)
        return (star, last)
    if isinstance(starter, Converter):
        rate = starter.ramp / shaft.ratio
        return (Leg((shaft.end_speed or 0.0) / rate, ends, field_rate=rate), last)
    return (last,)


def _shaft(drive: Drive | None, weight: UnbalanceWeight, dials: Dials) -> Shaft:
    motor = None if drive is None else drive.motor
    ratio = 1.0 if drive is None else drive.ratio
    curve = NO_PIECES if motor is None else motor.curve.scaled(ratio, 1.0 / ratio)
    starter = None if drive is None else drive.starter
    slope, limit = 0.0, 0.0
    if drive is not None and isinstance(starter, Converter):
        slope, limit = drive.converter_slope_and_limit(starter)
    return Shaft(
        free=int(drive is not None),
        inertia=1.0 if drive is None else float(drive.inertia),
        breakdown_torque=0.0 if motor is None else ratio * motor.largest_torque,
        breakdown_slip=1.0 if motor is None else float(motor.breakdown_slip),
        synchronous_speed=1.0 if motor is None else motor.synchronous_speed / ratio,
        pieces=np.ascontiguousarray(curve.pieces),
        pieces_end=float(curve.end),
        feed=CONVERTER if isinstance(starter, Converter) else MAINS,
        slip_torque=slope,
        torque_limit=limit,
        friction=0.0 if drive is None else float(drive.friction),
        viscous=0.0 if drive is None else float(drive.viscous_friction),
        creep=CREEP,
        weight=float(weight.torque),
        incline=float(weight.incline),
        ends=dials.ends,
        acceleration=dials.acceleration,
        share=dials.share,
        field_rate=dials.field_rate,
    )


def _check_drive(
    drive: Drive,
    inverse: Real,
    vector: NDArray[np.complex128],
    order: NDArray[np.int64],
    system: MechanicalSystem,
) -> None:
    """Refuse a force that no shaft makes, and an inertia less than that of the unbalances."""
    for one in system.excitations:
        if not isinstance(one, Unbalance):
            remedy = "a motor turns an Unbalance; give a SpeedProfile"
            raise InputError("excitation", type(one).__name__, remedy)
    levers = vector / order[:, None]
    parts = [np.array([lever.real, lever.imag]) for lever in levers]
    least = sum(math.sqrt(np.linalg.eigvalsh(one @ inverse @ one.T)[-1]) for one in parts) ** 2
    if drive.inertia <= least:
        raise InputError(
            "inertia", drive.inertia,
            f"it must exceed (m0r)^2 over the moving mass, {least:.4g} kg m^2, since the unbalance "
            "is part of it",
        )  # fmt: skip
