"""A sweep that does not wait: the speed glides, and the jump comes late."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.continuation.branch import Branch, SpecialPoint
from flipflow.continuation.branch_status import BranchStatus
from flipflow.continuation.frequency_response import frequency_response
from flipflow.continuation.special_points import FOLD, STABILITY_CHANGES
from flipflow.dynamics.normal import normal_motion
from flipflow.errors import IncompleteError, InputError
from flipflow.model.arguments import checked_monitor, checked_positive, checked_speeds
from flipflow.model.drive import SpeedProfile
from flipflow.model.monitor import Monitor
from flipflow.model.quantities import leading_coordinate
from flipflow.model.screen import unit_in
from flipflow.model.system import Coordinate, Machine
from flipflow.periodic.orbit import Orbit
from flipflow.results.result import Result
from flipflow.studies.periodic_orbits import attracting_orbits
from flipflow.transient.history import History
from flipflow.transient.speed_run import Start, behind_first_turn, run_history, turn_amplitudes
from flipflow.transient.startup import MOST_SECONDS

BEYOND = 1e-4  # relative distance past the end of a motion at which the next one is looked for
SOON = 0.05  # share of a fold's speed over which irregular motion beyond is looked at
# Amplitudes of an irregular motion scatter about as much from turn to turn.
SMALL = 0.1  # share by which their median differs at most where there is no jump
WIDER = 0.15  # share by which the branch reaches beyond the speeds of the ramp
SHORTEST = 1e-6  # s, shortest ramp, far less than any machine's turn
LOWER_SHARES = (1.0 - WIDER, 0.6, 0.3, 0.1)  # starts of the branch over the lowest speed, in turn


@dataclass(frozen=True)
class LateJump:
    """A jump met on the way.

    Parameters
    ----------
    fold
        Speed in rad/s at which the motion ceases to exist, at a fold, or to be stable beside
        another stable one of one turn.
    omega
        Speed in rad/s at which the amplitude has gone half the way to that of the other motion.
        Where none of one turn is stable beyond a fold, it is that to the median of what follows
        within 5 % of the speed; one that differs by less than 10 % is no jump.
    """

    fold: float
    omega: float

    @property
    def late(self) -> float:
        """How far beyond that speed the jump comes, in rad/s."""
        return abs(self.omega - self.fold)


@dataclass(frozen=True, eq=False)
class Ramp(Result):
    """A motion while the speed glides at a constant rate.

    Parameters
    ----------
    machine
        What moves.
    rate
        In rad/s^2, negative where the speed falls.
    history
        The motion over time.
    branch
        The periodic motions over the same speeds.
    jumps
        Jumps with how late they come, from one motion of one turn; a motion of several turns that
        ends by a jump has none here, see :func:`~flipflow.sweep`.
    """

    machine: Machine
    rate: float
    history: History
    branch: Branch
    jumps: tuple[LateJump, ...]

    def __repr__(self) -> str:
        least, most = self.history.omega.min(), self.history.omega.max()
        ends = f"{least:.6g} to {most:.6g}{unit_in(self.machine, 'rad/s')}"
        rate = f"{self.rate:.4g}{unit_in(self.machine, 'rad/s^2')}"
        return f"Ramp({ends} at {rate}, {len(self.jumps)} jumps)"

    def amplitude(self, which: Coordinate) -> tuple[Real, Real]:
        """Speed in rad/s at every turning point of a coordinate, and its amplitude there in m.

        Amplitude is half the way from peak to peak in the turn that ends there, from the second
        turn on.
        """
        return _amplitudes(self.history, which)


def ramp(
    machine: Machine,
    omega: tuple[float, float],
    rate: float,
    *,
    monitor: Monitor | None = None,
) -> Ramp:
    """Let the speed glide from one value to another at a constant rate.

    The motion starts from the periodic one at the first speed that is reached from the side away
    from the last: from below where the speed rises, from above where it falls. Where that one is
    not stable it is the largest, or the smallest, of the stable motions found by a search. It is
    carried by the event-located Runge-Kutta pair 5(4).

    Parameters
    ----------
    machine
        A screen, a :class:`~flipflow.MechanicalSystem`, or any machine with ``.system()``.
    omega
        First and last speed in rad/s; the last may be the lower.
    rate
        Size of the rate in rad/s^2; 1 rpm/s is 0.1047 rad/s^2.
    monitor
        Called with a sentence and the share done; raise from it to cancel.

    Raises
    ------
    InputError
        For speeds or a rate that make no sense.
    IncompleteError
        When no stable motion of one turn is known at the first speed.
    """
    speeds = checked_speeds(omega)
    if speeds.size != 2 or speeds[0] == speeds[1]:
        raise InputError(
            "omega", omega, "give two different speeds in rad/s, the first and the last"
        )
    (first, last), (low, high) = speeds.tolist(), np.sort(speeds).tolist()
    rate, duration = _checked_rate(rate, high - low)
    say = checked_monitor(monitor)
    branch = _branch_over(machine, low, high)
    ends = branch.omega
    held = ends.size > 0 and ends.min() <= first <= ends.max()
    orbits = [orbit for orbit in branch.orbits_at(first) if orbit.stable] if held else []
    orbits = orbits or list(attracting_orbits(machine, first))
    if not orbits:
        raise IncompleteError(
            f"No stable motion of one turn is known at {first:.6g} rad/s; begin at another speed."
        )
    orbit = orbits[0] if last > first else orbits[-1]
    state = _with_normal(machine, first, orbit.state)
    history = run_history(
        machine, SpeedProfile((0.0, duration), (first, last)), Start(state, 0.0, first), duration,
        fastest=high, monitor=say,
    )  # fmt: skip
    which = leading_coordinate(orbit.system)
    jumps = _jumps(branch, history, orbit, which, rising=last > first)
    return Ramp(machine, math.copysign(rate, last - first), history, branch, jumps)


def _checked_rate(rate: object, span: float) -> tuple[float, float]:
    """The rate in rad/s^2, and how long the speed then glides over ``span``, in s."""
    size = checked_positive("rate", rate, "rad/s^2")
    duration = span / size
    if not SHORTEST <= duration <= MOST_SECONDS:
        remedy = f"the speed would glide for {duration:.3g} s; give a rate between"
        ends = f"{span / MOST_SECONDS:.3g} and {span / SHORTEST:.3g} rad/s^2"
        raise InputError("rate", rate, f"{remedy} {ends}")
    return size, duration


def _branch_over(machine: Machine, low: float, high: float) -> Branch:
    """The motions from below over the speeds, begun low enough to come back from every fold."""
    for share in LOWER_SHARES:
        branch = frequency_response(machine, (share * low, (1.0 + WIDER) * high))
        if branch.status is not BranchStatus.TURNED_BACK:
            break
    return branch


def _with_normal(machine: Machine, omega: float, state: Real) -> Real:
    """The state with the steady motion normal to the surface last in each half."""
    steady = normal_motion(machine, omega)
    if steady is None:
        return state
    x, v = np.split(state, 2)
    return np.concatenate([x, steady.displacement([0.0]), v, steady.velocity([0.0])])


def _jumps(
    branch: Branch, history: History, begun: Orbit, which: Coordinate, *, rising: bool
) -> tuple[LateJump, ...]:
    """Jumps in the order of the glide, which began with a periodic motion."""
    speed, size = _amplitudes(history, which)
    speed, size = np.append(history.omega[0], speed), np.append(begun.amplitude(which), size)
    found: list[LateJump] = []
    for point in branch.special_points:
        past = speed > point.omega if rising else speed < point.omega
        if not _loses(branch, point, rising=rising) or not past.any() or past.all():
            continue
        before = point.amplitude(which)
        other = _beyond(branch, point, rising=rising)
        soon = size[past & (np.abs(speed - point.omega) < SOON * point.omega)]
        after = _irregular(point, before, soon) if other is None else other.amplitude(which)
        if after is None:
            continue
        lost = np.abs(size - before) > np.abs(size - after)
        rows = np.flatnonzero(past & lost)
        # A glide that has left the motion before does not jump here.
        if rows.size and not lost[~past][-1]:
            found.append(LateJump(point.omega, float(speed[rows[0]])))
    jumps = [one for one in found if not _again(one, found)]
    return tuple(sorted(jumps, key=lambda jump: jump.omega, reverse=not rising))


def _irregular(point: SpecialPoint, before: float, beyond: Real) -> float | None:
    """Amplitude beyond a fold without a stable motion of one turn; None if it tells no jump."""
    if point.kind != FOLD or beyond.size == 0:
        return None  # where the period doubles, the motion goes over into another
    after = float(np.median(beyond))
    return after if abs(after - before) >= SMALL * before else None


def _amplitudes(history: History, which: Coordinate) -> tuple[Real, Real]:
    """Speed and amplitude at each turning point from the second turn on."""
    t, size = turn_amplitudes(history, which)
    whole = behind_first_turn(history, t)
    return np.interp(t[whole], history.t, history.omega), size[whole]


def _again(jump: LateJump, found: list[LateJump]) -> bool:
    """Whether the motion was stable again, and lost anew, before the jump."""
    way = sorted((jump.fold, jump.omega))
    return any(way[0] < other.fold < way[1] for other in found)


def _loses(branch: Branch, point: SpecialPoint, *, rising: bool) -> bool:
    """Whether a gliding speed loses a stable motion at a special point."""
    sign = 1.0 if rising else -1.0
    k = int(point.position)
    if point.kind == FOLD:  # it may open towards the way of the glide
        neighbours = branch.omega[max(k - 1, 0) : k + 3]
        ends = bool(np.mean(sign * (neighbours - point.omega)) <= 0.0)
        return ends and bool(branch.stable[max(k - 1, 0) : k + 3].any())
    if point.kind not in STABILITY_CHANGES or k + 1 >= branch.omega.size:
        return False
    near, far = (k, k + 1) if sign * (branch.omega[k + 1] - branch.omega[k]) > 0.0 else (k + 1, k)
    return bool(branch.stable[near] and not branch.stable[far])


def _beyond(branch: Branch, point: SpecialPoint, *, rising: bool) -> Orbit | None:
    """The stable motion of one turn just past a point; None where none is known."""
    past = (1.0 + (BEYOND if rising else -BEYOND)) * point.omega
    if not branch.omega.min() <= past <= branch.omega.max():
        return None
    return next((orbit for orbit in branch.orbits_at(past) if orbit.stable), None)
