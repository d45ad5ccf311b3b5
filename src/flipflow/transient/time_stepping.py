"""Motion at varying speed: event-located Runge-Kutta on the machine with its shaft."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled import status
from flipflow.dynamics.assembly import stops_of
from flipflow.errors import InputError
from flipflow.model.arguments import checked_number, checked_positive, checked_word
from flipflow.model.contact_law import stored_energy
from flipflow.model.drive import Drive, SpeedProfile
from flipflow.model.excitation import Unbalance
from flipflow.model.system import MechanicalSystem
from flipflow.transient import runge_kutta
from flipflow.transient.runge_kutta import Walk
from flipflow.transient.shaft_equations import SHAFT_STATES, UNBALANCE, Equations, Shaft
from flipflow.transient.tableaux import DORMAND_PRINCE, RK4, Tableau

Real = NDArray[np.float64]
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


@dataclass(frozen=True)
class NormalDirection:
    """Mass, stiffness and damping of the motion normal to the surface, in SI."""

    mass: float
    stiffness: float
    damping: float


@dataclass(frozen=True, eq=False)
class Stretch:
    """Rows of a record: times (n,), states and their slopes (n, 2 N + 5), contacts (n, m)."""

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
        self.vector, self.drive = vector, drive
        self.K, self.static = K, static
        self._acceleration = np.zeros(1)
        self.equations = Equations(
            inverse_mass=inverse, damping=C, stiffness=K,
            direction=self._directions(), stops=stops_of(linear.springs), static=static,
            circulation=0.5 * (K - K.T), vector=vector, order=self.order, power=self.power,
            shaft=_shaft(drive, end_speeds, self._acceleration),
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
        for end, acceleration in self._legs(until):
            self._acceleration[0] = acceleration
            while True:
                self.code = runge_kutta.advance(self.equations, self.walk, end)
                if self.code != status.POINT_LIMIT:
                    break
                yield self._emptied()
            if self.code != status.OK:
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
            turns = np.exp(1j * self.order * angle) / self.order
            lever = (turns @ self.vector).imag
            energy += 0.5 * self.drive.inertia * speed**2 - speed * float(lever @ v)
        return energy

    def _legs(self, until: float) -> Iterator[tuple[float, float]]:
        """End and acceleration of each straight piece of the profile; one piece for a drive."""
        if self.profile is not None:
            times, speeds = self.profile.times, self.profile.speeds
            for k in range(1, len(times)):
                if self.time < times[k] and self.time < until:
                    slope = (speeds[k] - speeds[k - 1]) / (times[k] - times[k - 1])
                    yield min(times[k], until), slope
        if self.time < until:
            yield until, 0.0

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
        longest = _longest_step(self.M, self.K, fastest)
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
        sizes = [*[length] * n, *[length * fastest] * n, 1.0, fastest, *[math.inf] * 3]
        return self.method.tolerance * np.array(sizes)


def extended(
    system: MechanicalSystem, normal: NormalDirection | None
) -> tuple[Real, Real, Real, NDArray[np.complex128], Real]:
    """M, C, K, vectors of the exciting terms (E, N) and constant force, with the normal direction.

    It is one more degree of freedom. Normal to the surface the unbalance acts a quarter of a turn
    later: its component is -i times that along the surface.
    """
    vector = np.array([vector for one in system.excitations for _, vector in one.terms])
    static = np.array(system.constant_force)
    if normal is None:
        return np.array(system.M), np.array(system.C), np.array(system.K), vector, static
    pairs = ((system.M, normal.mass), (system.C, normal.damping), (system.K, normal.stiffness))
    M, C, K = (np.block([[A, np.zeros((len(A), 1))], [np.zeros(len(A)), b]]) for A, b in pairs)
    across = -1j * vector.sum(axis=1, keepdims=True)
    return M, C, K, np.concatenate([vector, across], axis=1), np.append(static, 0.0)


def _longest_step(M: Real, K: Real, fastest: float) -> float:
    """A fortieth of the fastest turn or of the fastest vibration of the open machine."""
    highest = math.sqrt(max(float(np.linalg.eigvals(np.linalg.solve(M, K)).real.max()), 0.0))
    return 2.0 * math.pi / STEPS_PER_TURN / max(fastest, highest)


def _shaft(drive: Drive | None, end_speeds: tuple[float, float], acceleration: Real) -> Shaft:
    motor = None if drive is None else drive.motor
    return Shaft(
        free=int(drive is not None),
        inertia=1.0 if drive is None else float(drive.inertia),
        breakdown_torque=0.0 if not (drive and motor) else drive.ratio * motor.largest_torque,
        breakdown_slip=1.0 if motor is None else float(motor.breakdown_slip),
        synchronous_speed=1.0 if not (drive and motor) else motor.synchronous_speed / drive.ratio,
        friction=0.0 if drive is None else float(drive.friction),
        viscous=0.0 if drive is None else float(drive.viscous_friction),
        creep=CREEP,
        speed_low=float(end_speeds[0]),
        speed_high=float(end_speeds[1]),
        acceleration=acceleration,
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
