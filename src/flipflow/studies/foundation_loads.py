r"""What a machine puts on its foundation, support by support, running, starting and stopping.

The isolation presses on the foundation with k1 x1 + c1 x1' up the slope and k1n y + c1n y' away
from the surface. A civil engineer counts otherwise: "normal" is into the foundation and "vertical"
downwards, "horizontal" the way in which the surface rises. With the surface inclined by alpha,

.. math:: H = F_a \cos\alpha + F_n \sin\alpha , \quad V = F_n \cos\alpha - F_a \sin\alpha .

The frames are rigid and do not pitch, so every support carries the same dynamic load; at rest the
weight is shared evenly, or as the place of the centre of gravity has it. Motion and
load across the machine are not calculated.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.dynamics.motion import nodes_on
from flipflow.dynamics.normal import normal_motion
from flipflow.errors import InputError
from flipflow.model.arguments import checked_kind, checked_mapping, checked_text, checked_word
from flipflow.model.constants import GRAVITY, RPM
from flipflow.model.numerals import case_words, digits
from flipflow.model.screen import FlipFlowScreen, Rotation
from flipflow.periodic.orbit import Orbit
from flipflow.results.result import Result
from flipflow.transient.run_up import RunUp

Direction = Literal["along", "normal", "horizontal", "vertical"]
DIRECTIONS: tuple[Direction, ...] = get_args(Direction)
ORDERS = 3  # highest order of the shaft's speed of which amplitude and phase are told
EXCITED = math.sqrt(0.5)  # share of the greatest force that bounds the half-power band
WITHIN = 8  # times looked at within each step of a run
EQUAL = "assumed equal: the machine file holds no positions of the supports"
SHARED = (
    "shared at rest by a rigid frame on equal springs, evenly spaced up the slope, two abreast, "
    "from isolation.load_centre"
)
LATERAL = "Lateral loads, across the machine, are not calculated."


@dataclass(frozen=True)
class Components:
    """A force in N, or a way in m, by direction; None where a direction is not known.

    Parameters
    ----------
    along, normal
        Up the slope, and into the foundation at right angles to the surface.
    horizontal, vertical
        The way in which the surface rises, and downwards.
    total
        Greatest length of the vector.
    """

    along: float | None = None
    normal: float | None = None
    horizontal: float | None = None
    vertical: float | None = None
    total: float | None = None


@dataclass(frozen=True)
class OrderLoad:
    """The part of the running load at a multiple of the shaft's speed.

    Parameters
    ----------
    order
        The multiple; a motion that repeats after two turns has halves as well.
    amplitude
        Amplitudes in N.
    phase
        Phases in rad against the unbalance force along the surface; positive: it leads.
    """

    order: float
    amplitude: Components
    phase: Components


@dataclass(frozen=True)
class CaseLoads:
    """All supports together in one load case.

    Parameters
    ----------
    name, omega
        The case, and the speed in rad/s.
    static
        Weight of machine and load in N; "total" is the weight.
    running
        Greatest dynamic force in N at steady running.
    orders
        Orders 1 to 3 of it.
    least
        Least load in N over a turn, static less dynamic, "normal" and "vertical", of the support
        that carries least, times their number; its spring lifts off below zero.
    travel
        Greatest displacement from rest in m of the frames, "main" and "floating".
    """

    name: str
    omega: float
    static: Components
    running: Components
    orders: tuple[OrderLoad, ...]
    least: Components
    travel: Mapping[str, Components]


@dataclass(frozen=True)
class RunLoads:
    """All supports together during a start or a coast-down.

    Parameters
    ----------
    name
        Which run, and of which case.
    peaks
        Greatest dynamic force in N.
    at
        Shaft speed in rad/s at each peak.
    excited
        Lowest and highest speed in rad/s at which the force exceeds 71 % of its greatest.
    least, travel
        As in :class:`CaseLoads`.
    """

    name: str
    peaks: Components
    at: Components
    excited: tuple[float, float]
    least: Components
    travel: Mapping[str, Components]


@dataclass(frozen=True, repr=False)
class FoundationLoads(Result):
    """What goes into the ground; forces are those of all supports together.

    Parameters
    ----------
    supports
        Names of the supports; empty where their number is not known.
    position
        What is known of where they stand.
    deck_angle
        Inclination of the surface in rad; None: nothing is told of horizontal and vertical.
    rotation
        Which way the unbalance turns: it changes the horizontal load.
    cases
        Every load case at working speed.
    runs
        Every start and coast-down.
    notes
        What is left out.
    static_shares
        Share of the weight that each support carries at rest.
    """

    supports: tuple[str, ...]
    position: str
    deck_angle: float | None
    rotation: Rotation
    cases: tuple[CaseLoads, ...]
    runs: tuple[RunLoads, ...]
    notes: tuple[str, ...]
    static_shares: tuple[float, ...] = ()

    def __repr__(self) -> str:
        parts = f"{len(self.cases)} load cases, {len(self.runs)} runs"
        return f"FoundationLoads({len(self.supports)} supports, {parts})"

    def of_support(self, load: Components) -> Components:
        """The share of one support in a load of all together; all of it with no known number."""
        checked_kind("load", load, Components, "give a load of one of the cases or runs")
        count = max(len(self.supports), 1)
        return _times(load, 1.0 / count)

    def static_on(self, support: str, case: CaseLoads) -> Components:
        """Weight on one support in a load case, in N.

        Raises
        ------
        InputError
            For a support of another name.
        """
        checked_kind("case", case, CaseLoads, "give one of the load cases")
        checked_word("support", support, self.supports)
        return _times(case.static, self.static_shares[self.supports.index(support)])

    @property
    def sentence(self) -> str:
        """What goes into the ground, in a sentence."""
        count = len(self.supports)
        head = f"each of {count} supports" if count else "all supports together"
        parts = []
        if self.cases:
            heaviest = max(self.cases, key=lambda one: one.static.total or 0.0)
            one = max(self.cases, key=lambda one: one.running.total or one.running.along or 0.0)
            uneven = max(self.static_shares, default=1.0) * max(count, 1)
            most = "up to " if len(set(self.static_shares)) > 1 else ""
            weight = self._kilo(uneven * (heaviest.static.total or 0.0))
            case = "" if heaviest is one else f" ({case_words(heaviest.name)})"
            parts.append(f"{most}{weight} at rest{case}")
            parts.append(
                f"running at {digits(one.omega * RPM, 4)} rpm {self._worst(one.running)} "
                f"({case_words(one.name)})"
            )
        if self.runs:
            run = max(self.runs, key=lambda one: one.peaks.total or one.peaks.along or 0.0)
            at = run.at.total or run.at.along or 0.0
            parts.append(f"{run.name} {self._worst(run.peaks)} near {at * RPM:.0f} rpm")
        return f"{head}: {'; '.join(parts)}; {self._lift_words()}."

    @property
    def _every(self) -> tuple[CaseLoads | RunLoads, ...]:
        return (*self.cases, *self.runs)

    def _lift_words(self) -> str:
        lifting = self.lifting
        if lifting:
            return f"a spring lifts off in {'; '.join(lifting)}"
        known = any(one.least.normal is not None for one in self._every)
        return "no spring lifts off" if known else "lift-off is not checked"

    def _worst(self, load: Components) -> str:
        """Vertical and horizontal load of one support in words, else those that are known."""
        if load.vertical is None or load.horizontal is None:
            pairs = ((load.along, "along the surface"), (load.normal, "normal to it"))
        else:
            pairs = ((load.vertical, "vertical"), (load.horizontal, "horizontal"))
        known = (f"±{self._kilo(value)} {word}" for value, word in pairs if value is not None)
        return ", ".join(known)

    def _kilo(self, force: float | None) -> str:
        """A force of all supports, shared by them, in kN."""
        return f"{digits((force or 0.0) / max(len(self.supports), 1) / 1e3)} kN"

    @property
    def lifting(self) -> tuple[str, ...]:
        """Names of cases and runs in which a spring lifts off its support."""
        return tuple(
            one.name
            for one in self._every
            if min(one.least.normal or 0.0, one.least.vertical or 0.0) < 0.0
        )


def foundation_loads(
    motions: Mapping[str, Orbit], runs: Mapping[str, RunUp] | None = None
) -> FoundationLoads:
    """Loads on the foundation of a screen's motions at working speed, and of its starts and stops.

    Parameters
    ----------
    motions
        A periodic motion of the screen in each load case, by the case's name.
    runs
        Starts and coast-downs by name: what :func:`~flipflow.start_up` and
        :func:`~flipflow.coast_down` return.

    Returns
    -------
    FoundationLoads
        Static and dynamic loads by direction, their orders, peaks on the way, and travel.

    Raises
    ------
    InputError
        For anything but motions and runs of a :class:`~flipflow.FlipFlowScreen`.
    """
    checked_mapping("motions", motions, "give motions by the name of their load case")
    runs = checked_mapping("runs", {} if runs is None else runs, "give runs by name, or None")
    remedy = "give motions of periodic_orbits, and runs of start_up or coast_down"
    machines = [checked_kind("motions", one, Orbit, remedy).machine for one in motions.values()]
    machines += [checked_kind("runs", one, RunUp, remedy).machine for one in runs.values()]
    remedy = "give motions and runs of a FlipFlowScreen"
    screens = [checked_kind("motions", one, FlipFlowScreen, remedy) for one in machines]
    if not screens:
        raise InputError("motions", motions, "give at least one motion or run")
    for name in (*motions, *runs):
        checked_text("name", name)
    stands = {(one.supports, one.deck_angle, one.rotation, one.load_centre) for one in screens}
    if len(stands) > 1:
        raise InputError("motions", list(motions), "give load cases and runs of one machine")
    first = screens[0]
    names = tuple(f"S{k + 1}" for k in range(int(first.supports or 0)))
    return FoundationLoads(
        supports=names,
        position=EQUAL if first.load_centre is None else SHARED,
        deck_angle=first.deck_angle,
        rotation=first.rotation,
        cases=tuple(_case_loads(name, orbit) for name, orbit in motions.items()),
        runs=tuple(_run_loads(name, run) for name, run in runs.items()),
        notes=tuple(_notes(first)),
        static_shares=static_shares(len(names), first.load_centre),
    )


def static_shares(count: int, centre: float | None) -> tuple[float, ...]:
    r"""Share of the weight on each of ``count`` supports, two abreast up the slope.

    A rigid frame on equal springs at places u from 0 to 1, its centre of gravity at c:

    .. math:: p_i = \frac{1}{n} \left( 1 + \frac{(c - \bar u)(u_i - \bar u)}{\overline{(u -
              \bar u)^2}} \right) ,

    so that the shares add up to one and balance about the centre of gravity. The height of the
    centre of gravity above the springs is left out.
    """
    if count == 0:
        return ()
    column = np.arange(count) // 2
    place = column / max(column[-1], 1)
    spread = float(place.var())
    if centre is None or spread == 0.0:
        return (1.0 / count,) * count
    away = place - place.mean()
    return tuple((1.0 + (centre - float(place.mean())) * away / spread) / count)


def _smallest(screen: FlipFlowScreen) -> float:
    """Static load of the support that carries least over an even share."""
    shares = static_shares(int(screen.supports or 0), screen.load_centre)
    return min(shares, default=1.0) * max(len(shares), 1)


def _times(load: Components, factor: float) -> Components:
    return Components(**{k: None if v is None else factor * v for k, v in vars(load).items()})


def static_load(screen: FlipFlowScreen) -> Components:
    """Weight of the machine and what it carries on the foundation, in N."""
    weight = (screen.main_mass + screen.floating_mass) * GRAVITY
    angle = screen.deck_angle
    if angle is None:
        return Components(vertical=weight, horizontal=0.0, total=weight)
    return Components(
        -weight * math.sin(angle), weight * math.cos(angle), 0.0, weight, weight
    )  # fmt: skip


def _notes(screen: FlipFlowScreen) -> list[str]:
    notes = [LATERAL]
    if screen.normal_stiffness is None or screen.normal_damping is None:
        notes.append(
            "Normal, horizontal and vertical loads are not calculated: isolation.normal_stiffness "
            "or isolation.normal_damping is missing."
        )
    if screen.deck_angle is None:
        notes.append(
            "Loads are not turned to horizontal and vertical: frames.deck_angle is missing."
        )
    if screen.supports is None:
        notes.append("Loads are those of all supports together: isolation.supports is missing.")
    return notes


def _by_direction(along: Real, normal: Real | None, angle: float | None) -> dict[Direction, Real]:
    """A vector over time in every direction that is known."""
    known: dict[Direction, Real] = {"along": along}
    if normal is None:
        return known
    known["normal"] = normal
    if angle is not None:
        c, s = math.cos(angle), math.sin(angle)
        known["horizontal"] = c * along + s * normal
        known["vertical"] = c * normal - s * along
    return known


def _case_loads(name: str, orbit: Orbit) -> CaseLoads:
    screen: FlipFlowScreen = orbit.machine  # type: ignore[assignment]
    angle, normal = screen.deck_angle, normal_motion(screen, orbit.omega)
    k, c = screen.isolation_stiffness, screen.isolation_damping

    def force(t: Real, x: Real, v: Real, _a: Real) -> dict[Direction, Real]:
        across = None if normal is None else -normal.foundation_force(t)
        return _by_direction(k * x[:, 0] + c * v[:, 0], across, angle)

    def way(degree: int) -> Callable[[Real, Real, Real, Real], dict[Direction, Real]]:
        def found(t: Real, x: Real, _v: Real, _a: Real) -> dict[Direction, Real]:
            across = None if normal is None else -normal.displacement(t)
            return _by_direction(x[:, degree], across, angle)

        return found

    static = static_load(screen)
    return CaseLoads(
        name=name,
        omega=orbit.omega,
        static=static,
        running=_orbit_peaks(orbit, force),
        orders=tuple(_orders(orbit, screen)),
        least=_orbit_least(orbit, force, _times(static, _smallest(screen))),
        travel={frame: _orbit_peaks(orbit, way(k)) for k, frame in enumerate(("main", "floating"))},
    )


Quantity = Callable[[Real, Real, Real, Real], dict[Direction, Real]]


def _orbit_peaks(orbit: Orbit, vector: Quantity) -> Components:
    """Greatest size of each component of a vector over the period."""
    known = vector(*_first_row(orbit))
    found: dict[str, float] = {
        one: orbit.peak(lambda *at, one=one: vector(*at)[one]) for one in known
    }
    return Components(**found, total=orbit.peak(lambda *at: _length(vector(*at))))


def _orbit_least(orbit: Orbit, force: Quantity, static: Components) -> Components:
    """Least static plus dynamic load, normal and vertical, over the period."""
    found = {}
    for one in force(*_first_row(orbit)):
        weight = getattr(static, one)
        if one in {"normal", "vertical"} and weight is not None:
            # The load is below zero nowhere beyond what is taken from a weight far greater.
            far = 10.0 * weight + orbit.peak(lambda *at, one=one: force(*at)[one])
            deepest = orbit.peak(lambda *at, one=one, far=far: far - force(*at)[one])
            found[one] = weight + far - deepest
    return Components(**found)


def _first_row(orbit: Orbit) -> tuple[Real, Real, Real, Real]:
    """Time 0 and zeros, which tell what directions are known."""
    nothing = np.zeros((1, orbit.system.size))
    return np.zeros(1), nothing, nothing, nothing


def _length(vector: Mapping[Direction, Real]) -> Real:
    return np.asarray(np.hypot(vector["along"], vector.get("normal", 0.0)))


def _orders(orbit: Orbit, screen: FlipFlowScreen) -> list[OrderLoad]:
    """Orders up to the third; halves, too, where the motion repeats after two turns."""
    found, turns = [], orbit.periods
    angle, normal = screen.deck_angle, normal_motion(screen, orbit.omega)
    for k in range(1, ORDERS * turns + 1):
        order = k / turns
        rate = 1j * order * orbit.omega
        stiffness = screen.isolation_stiffness + rate * screen.isolation_damping
        along = np.array([stiffness * harmonic(orbit, "main", order)])
        across = None
        if normal is not None:
            impedance = normal.stiffness + rate * normal.damping
            across = np.array([-impedance * normal.complex_amplitude if order == 1.0 else 0.0j])
        parts = _by_direction(along, across, angle)
        amplitude = {one: float(abs(value[0])) for one, value in parts.items()}
        phase = {one: float(np.angle(value[0])) for one, value in parts.items()}
        found.append(OrderLoad(order, Components(**amplitude), Components(**phase)))
    return found


def harmonic(orbit: Orbit, which: str, order: float) -> complex:
    """X of Re(X exp(i order omega t)) of a coordinate."""
    t, piece, weight = nodes_on(orbit.motion)
    x = orbit.motion.piece_derivative(t, piece, 0) @ orbit.system.coordinate(which)
    return complex(2.0 * weight @ (x * np.exp(-1j * order * orbit.omega * t)))


def _run_loads(name: str, run: RunUp) -> RunLoads:
    screen: FlipFlowScreen = run.machine  # type: ignore[assignment]
    history, angle = run.history, screen.deck_angle
    k, c = screen.isolation_stiffness, screen.isolation_damping
    x, v, a = history.displacement("main"), history.velocity("main"), history.acceleration("main")
    along = _between(history.t, k * x + c * v, k * v + c * a)
    across = y = None
    if history.normal is not None and screen.normal_stiffness is not None:
        down = -history.normal.T
        kn, cn = screen.normal_stiffness, screen.normal_damping or 0.0
        across = _between(history.t, kn * down[0] + cn * down[1], kn * down[1] + cn * down[2])
        y = _between(history.t, down[0], down[1])
    times = _between(history.t, history.t, np.ones(history.t.size))
    omega = np.interp(times, history.t, history.omega)
    ways = {
        one: _between(history.t, history.displacement(one), history.velocity(one))
        for one in ("main", "floating")
    }
    force = _by_direction(along, across, angle)
    size, static = _length(force), static_load(screen)
    angles = np.interp(times, history.t, history.angle)
    rows: dict[str, int] = {one: int(np.abs(values).argmax()) for one, values in force.items()}
    rows["total"] = int(size.argmax())
    return RunLoads(
        name=name,
        peaks=_greatest(force),
        at=Components(**{one: float(omega[row]) for one, row in rows.items()}),
        excited=_excited(size, angles, omega),
        least=Components(**_least(force, _times(static, _smallest(screen)))),
        travel={one: _greatest(_by_direction(way, y, angle)) for one, way in ways.items()},
    )


def _excited(size: Real, angle: Real, omega: Real) -> tuple[float, float]:
    """Least and greatest speed about the greatest force that no whole turn below the band ends."""
    above = np.flatnonzero(size >= EXCITED * size.max())
    ends = np.flatnonzero(np.diff(angle[above]) > 2.0 * np.pi)
    peak = int(np.searchsorted(above, int(size.argmax())))
    group = int(np.searchsorted(ends, peak))
    speeds = omega[np.split(above, ends + 1)[group]]
    return float(speeds.min()), float(speeds.max())


def _least(force: Mapping[Direction, Real], static: Components) -> dict[str, float]:
    return {
        one: weight + float(force[one].min())
        for one in ("normal", "vertical")
        if one in force and (weight := getattr(static, one)) is not None
    }


def _between(t: Real, value: Real, rate: Real) -> Real:
    """Values over a run and within its steps, by the cubic through values and rates."""
    u = np.linspace(0.0, 1.0, WITHIN, endpoint=False)
    h = np.diff(t)[:, None]
    ends = value[:-1, None] * (1.0 - 3.0 * u**2 + 2.0 * u**3) + value[1:, None] * (
        3.0 * u**2 - 2.0 * u**3
    )
    slopes = rate[:-1, None] * (u - 2.0 * u**2 + u**3) + rate[1:, None] * (u**3 - u**2)
    return np.append((ends + h * slopes).ravel(), value[-1])


def _greatest(vector: Mapping[Direction, Real]) -> Components:
    sizes = {one: float(np.abs(values).max()) for one, values in vector.items()}
    return Components(**sizes, total=float(_length(vector).max()))
