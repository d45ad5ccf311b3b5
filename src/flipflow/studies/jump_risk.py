"""How small a blow, or a lump of material, throws the working motion onto another one."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from flipflow import __version__
from flipflow.batch.side_by_side import Tell, within
from flipflow.compiled.arrays import Real
from flipflow.continuation.frequency_response import first_unknowns
from flipflow.errors import IncompleteError, InputError
from flipflow.model.arguments import checked_monitor, checked_number, checked_speed, real
from flipflow.model.monitor import Monitor
from flipflow.model.screen import unit_in
from flipflow.model.system import Coordinate, Machine, MechanicalSystem
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.orbit import Orbit
from flipflow.periodic.solver import Point
from flipflow.results.result import Result
from flipflow.studies.attractors import Attractors
from flipflow.studies.blows import Blows
from flipflow.transient.settling import is_stable

PHASES = 60  # in each forcing period at which blows fall
LONE_STRIDE = 6  # every so many phases serve where no other motion is known
LONE = 0.1  # share of the scan when another motion has been looked for
REFINED = 0.9  # shares of the work when all blows are scanned, of a throw when it is refined
MOST_IMPULSE = 1e9  # kg m/s, largest impulse that may be asked for
NO_OTHER = "No other motion found: it cannot jump."


@dataclass(frozen=True, eq=False)
class Throw:
    """The least blow of one kind on one frame, at the worst moment of the turn.

    Parameters
    ----------
    frame
        The frame: a named coordinate, or the index of a degree of freedom.
    impulse
        What it gives to the frame in kg m/s; positive along +x.
    lump
        Mass in kg that takes this momentum off the frame; None for a plain impulse.
    phase
        Angle of the unbalance at that moment in rad, from the +x direction. Where the motion
        repeats after several turns it is counted on through them.
    lands
        The motion that the machine settles on.
    sharp
        Whether one per cent more throws it too, and one per cent less does not.
    """

    frame: Coordinate
    impulse: float
    lump: float | None
    phase: float
    lands: Orbit
    sharp: bool

    @property
    def size(self) -> float:
        """The lump's mass in kg, or the impulse's size in kg m/s."""
        return abs(self.impulse) if self.lump is None else self.lump


@dataclass(frozen=True, eq=False)
class JumpRisk(Result):
    """How little it takes to throw a motion onto another one.

    Parameters
    ----------
    machine
        The machine.
    orbit
        The working motion.
    others
        The other stable motions at the same frequency.
    impulses, lumps
        For each frame that can be hit so, the least impulse and the least lump.
    largest_impulse
        Largest impulse tried, by frame, in kg m/s.
    phases, thresholds
        Angles of the unbalance in rad, (P,), and by frame the least impulse along +x and along
        -x at each of them, (2, P), in kg m/s; infinite where none up to the largest throws it.
    notes
        What was not decided, and why.
    version
        Of flipflow.
    """

    machine: Machine
    orbit: Orbit
    others: tuple[Orbit, ...]
    impulses: tuple[Throw, ...]
    lumps: tuple[Throw, ...]
    largest_impulse: dict[Coordinate, float]
    phases: Real
    thresholds: dict[Coordinate, Real]
    notes: tuple[str, ...] = ()
    version: str = field(default=__version__)

    def __repr__(self) -> str:
        sizes = ((self.impulse, "kg m/s"), (self.lump, "kg"))
        blows = ", ".join(f"{size:.4g}{unit_in(self.machine, unit)}" for size, unit in sizes)
        return f"JumpRisk({self.omega:.6g}{unit_in(self.machine, 'rad/s')}, {blows})"

    @property
    def omega(self) -> float:
        """Forcing frequency in rad/s."""
        return self.orbit.omega

    @property
    def worst_impulse(self) -> Throw | None:
        """The least impulse of all frames; None where none was found."""
        return min(self.impulses, key=lambda throw: throw.size, default=None)

    @property
    def worst_lump(self) -> Throw | None:
        """The least lump of all frames; None where even an infinite one does not throw it."""
        return min(self.lumps, key=lambda throw: throw.size, default=None)

    @property
    def impulse(self) -> float:
        """Size of the least impulse in kg m/s; infinite where none was found."""
        worst = self.worst_impulse
        return math.inf if worst is None else worst.size

    @property
    def lump(self) -> float:
        """The least lump in kg; infinite where none was found."""
        worst = self.worst_lump
        return math.inf if worst is None else worst.size


def jump_risk(
    machine: Machine,
    motion: float | Orbit,
    *,
    largest_impulse: float | None = None,
    rng: int | np.random.Generator = 0,
    threads: int | None = None,
    monitor: Monitor | None = None,
) -> JumpRisk:
    r"""The least impulse, and the least lump of material, that throws a motion onto another one.

    An impulse J on a frame changes the velocities at once by

    .. math:: \Delta \dot x = M^{-1} e J,

    which for a screen is J / m on that frame. A **lump** lands on a frame without bouncing and
    leaves with the feed before the turn is over: the frame loses the momentum it gives to the
    lump, and that is all that is counted. With its velocity v,

    .. math:: J = - v \, \frac{L}{1 + L \, e^T M^{-1} e},

    so the frame's velocity becomes v m / (m + L); an infinitely heavy lump stops the frame for a
    moment. Moments of the turn and sizes are scanned, each size a fifth above the one before
    and no step above a sixtieth of the largest; the first that throws the motion out is refined by
    bisection, and so is the moment. A window of sizes narrower than a step of the scan can be
    missed.

    Parameters
    ----------
    machine
        A screen, a :class:`~flipflow.MechanicalSystem`, or any machine with ``.system()``. Frames
        are the named coordinates that are single degrees of freedom ("main" and "floating" of a
        screen), or all degrees of freedom.
    motion
        Forcing frequency in rad/s, for the motion that is reached from below; or a stable Orbit.
    largest_impulse
        Largest impulse in kg m/s to try on any frame. None: four times the frame's largest
        momentum.
    rng, threads
        As of :func:`~flipflow.basins`.
    monitor
        Called with a sentence and the share done. When it raises
        :class:`~flipflow.errors.Cancelled`, that error passes on: there is no partial answer.

    Raises
    ------
    InputError
        For an impulse that is not finite or not above 0, and for a motion that is not stable.
    IncompleteError
        When no stable motion is reached from below.
    """
    largest_impulse = _checked_impulse(largest_impulse)
    say = checked_monitor(monitor)
    if not isinstance(motion, Orbit):
        if real(motion) is None:
            raise InputError("motion", motion, "give a frequency omega in rad/s, or a stable Orbit")
        motion = checked_speed(motion)
    say("motions", 0.0)
    omega = motion.omega if isinstance(motion, Orbit) else motion
    attractors = Attractors(machine, omega, rng, threads)
    point = _working_point(attractors.system, motion)
    home = attractors.add(point)
    if home is None:
        raise IncompleteError(
            "No neighbourhood of the working motion goes back to it as a whole: it stands on the "
            "edge of a jump. Try a speed a little lower."
        )
    blows = Blows(attractors, point, home, largest_impulse)
    turns = point.formulation.turns
    phases = 2.0 * np.pi * np.arange(PHASES * turns) / PHASES

    def tell(share: float) -> None:
        say("blows", share)

    least = _scanned(blows, phases, within(tell, 0.0, REFINED))
    rows = len(blows.rows)
    parts = [within(within(tell, REFINED, 1.0), k / rows, (k + 1) / rows) for k in range(rows)]
    throws = [_throw(blows, k, phases, least[k], part) for k, part in enumerate(parts)]
    found = [throw for throw in throws if throw is not None]
    others = tuple(o for k, o in enumerate(attractors.orbits) if k != home)
    say("done", 1.0)
    return JumpRisk(
        machine,
        attractors.orbits[home],
        others,
        _least_of_frames([one for one in found if one.lump is None]),
        _least_of_frames([one for one in found if one.lump is not None]),
        {row.frame: row.largest for row in blows.rows},
        phases,
        _thresholds(blows, least),
        _notes(blows, others, found),
    )


def _scanned(blows: Blows, phases: Real, tick: Tell) -> Real:
    """The least share of each row that throws at each phase, (rows, P).

    Where no other motion is known, few blows are to find one first.
    """
    every = np.arange(len(blows.rows))
    few = phases[::LONE_STRIDE]
    if len(blows.attractors.orbits) == 1:
        blows.least(np.repeat(every, few.size), np.tile(few, every.size), within(tick, 0.0, LONE))
    if len(blows.attractors.orbits) == 1:
        return np.full((every.size, phases.size), np.inf)
    rows, moments = np.repeat(every, phases.size), np.tile(phases, every.size)
    return blows.least(rows, moments, within(tick, LONE, 1.0)).reshape(every.size, phases.size)


def _checked_impulse(largest: object) -> float | None:
    if largest is None:
        return None
    remedy = f"give an impulse above 0 and up to {MOST_IMPULSE:g} kg m/s"
    impulse = checked_number("largest_impulse", largest, remedy)
    if not 0.0 < impulse <= MOST_IMPULSE:
        raise InputError("largest_impulse", largest, remedy)
    return impulse


def _working_point(system: MechanicalSystem, motion: float | Orbit) -> Point:
    """The motion that is hit, solved for over whole turns."""
    turns = motion.periods if isinstance(motion, Orbit) else 1
    solver = ExactSolver(system, half_turn=False, turns=turns)
    if isinstance(motion, Orbit):
        if motion.state.size != 2 * system.size:
            raise InputError("motion", motion, "give an orbit of this machine")
        if not motion.stable:
            raise InputError("motion", motion, "give a stable motion; it does not stay on this one")
        start, omega = motion.state, motion.omega
    else:
        start, omega = first_unknowns(solver, motion), float(motion)
    point = solver.solve(start, omega)
    if point is None or not is_stable(point):
        raise IncompleteError(
            f"No stable motion of one turn is reached from below at {omega:.6g} rad/s; give the "
            "working motion as an orbit, for example one of ff.periodic_orbits."
        )
    return point


def _throw(blows: Blows, row: int, phases: Real, least: Real, tick: Tell) -> Throw | None:
    """The least blow of a row, None where none throws the motion."""
    if not np.isfinite(least).any():
        return None
    share, phase = blows.worst_moment(row, phases, least, within(tick, 0.0, REFINED))
    one = blows.rows[row]
    lump = blows.lump(row, share) if one.kind == "lump" else None
    shares = share * np.array([1.0, 0.99, 1.01])
    if lump is not None:
        shares[1:] = [blows.lump_share(row, lump * factor) for factor in (0.99, 1.01)]
    labels = blows.labels(np.full(3, row), shares, np.full(3, phase), within(tick, REFINED, 1.0))
    thrown = blows.thrown(labels)
    sharp = bool(not thrown[1] and thrown[2])
    lands = blows.attractors.orbits[int(labels[0])]
    return Throw(one.frame, blows.impulse(row, share, phase), lump, phase, lands, sharp)


def _least_of_frames(throws: list[Throw]) -> tuple[Throw, ...]:
    """The least throw of each frame, the least of all first."""
    frames = dict.fromkeys(throw.frame for throw in throws)
    best = (min((t for t in throws if t.frame == f), key=lambda t: t.size) for f in frames)
    return tuple(sorted(best, key=lambda throw: throw.size))


def _thresholds(blows: Blows, least: Real) -> dict[Coordinate, Real]:
    """Least impulses along +x and -x of each frame over the turn, (2, P)."""
    return {
        frame: np.array(
            [
                least[k] * row.largest
                for k, row in enumerate(blows.rows)
                if row.frame == frame and row.kind != "lump"
            ]
        )
        for frame in dict.fromkeys(row.frame for row in blows.rows)
    }


def _notes(blows: Blows, others: tuple[Orbit, ...], found: list[Throw]) -> tuple[str, ...]:
    notes = [] if others else [NO_OTHER]
    if blows.undecided:
        notes.append(
            f"{blows.undecided} of {blows.tried} motions did not settle after their blow, and are "
            "not counted as jumps."
        )
    if not all(throw.sharp for throw in found):
        notes.append("Close to a least blow the outcome changes more than once within 1 %.")
    hit = {throw.frame for throw in found}
    idle = [f for f in dict.fromkeys(row.frame for row in blows.rows) if f not in hit]
    if others and idle:
        names = " or ".join(map(str, idle))
        notes.append(f"No impulse or lump tried on {names} throws the motion onto another.")
    return tuple(notes)
