"""Where each limit is met: speed intervals of every load case, and what binds their ends."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from scipy.optimize import brentq

from flipflow.continuation.branch import Branch, SpecialPoint, fold_at_end
from flipflow.continuation.special_points import STABILITY_CHANGES
from flipflow.errors import IncompleteError
from flipflow.model.limits import Limits, limit_bounds
from flipflow.model.quantities import QUANTITIES, missing_words
from flipflow.model.screen import FlipFlowScreen, Load
from flipflow.model.system import Machine
from flipflow.periodic.orbit import Orbit
from flipflow.studies.quantity_values import Working

Interval = tuple[float, float]
Intervals = tuple[Interval, ...]
STABILITY = "stability"
REGION = "operating region"


@dataclass(frozen=True)
class CaseWindow:
    """Speed intervals in rad/s in which each limit is met, for one load case.

    Parameters
    ----------
    name
        The load case.
    intervals
        By limit; "stability" says where the motion returns after a small disturbance.
    unchecked
        Limits that cannot be checked, and why.
    notes
        Where an interval is narrower than it may be, because motions are not known.
    """

    name: str
    intervals: Mapping[str, Intervals]
    unchecked: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Bound:
    """What ends an allowed interval: a limit and the load case that reaches it."""

    limit: str
    case: str


def case_window(
    screen: FlipFlowScreen, load: Load, branch: Branch, limits: Limits, span: Interval
) -> CaseWindow:
    """Intervals of every limit over ``span`` (rad/s) on the motion reached from below."""
    unchecked = {
        name: missing_words(missing)
        for name in limits.given
        if (missing := QUANTITIES[name].missing(screen))
    }
    runs = _runs(branch, screen, span)
    intervals: dict[str, Intervals] = {
        STABILITY: _joined([_stable_parts(run) for run in runs], span)
    }
    notes = list(_unknown_speeds(branch, runs, span))
    for name in limits.given:
        if name in unchecked:
            continue
        low, high = limit_bounds(limits, name)
        if QUANTITIES[name].of == "operation":
            intervals[name] = intersect(((low, high),), (span,))
            continue
        met = [_met(run, name, low, high) for run in runs]
        intervals[name] = _joined([parts for parts, _ in met], span)
        notes += [
            f"{QUANTITIES[name].label} is not known between {_rpm(a)} and {_rpm(b)} rpm, and its "
            "limit counts as broken there"
            for _, gaps in met
            for a, b in gaps
        ]
    return CaseWindow(load.name or "empty", intervals, unchecked, tuple(notes))


def _unknown_speeds(branch: Branch, runs: list[_Run], span: Interval) -> Iterator[str]:
    """A sentence on speeds at which no motion is known; an unfinished branch has its own."""
    reached, gaps = span[0], []
    ends = [(run.nodes[0].omega, run.nodes[-1].omega) for run in runs]
    for low, high in (*ends, *([(span[1], span[1])] if branch.complete else [])):
        if low > reached * (1.0 + 1e-9):
            gaps.append(f"{_rpm(reached)} to {_rpm(low)}")
        reached = max(reached, high)
    if gaps:
        yield (
            f"raised from below the speed meets no stable motion at {', '.join(gaps)} rpm, and no "
            "limit counts as met there"
        )


def _rpm(omega: float) -> str:
    return f"{omega * 30.0 / math.pi:.5g}"


def intersect(first: Intervals, second: Intervals) -> Intervals:
    """Common part of two lists of intervals, rising."""
    common = [(max(a, c), min(b, d)) for a, b in first for c, d in second if max(a, c) < min(b, d)]
    return tuple(sorted(common))


def common_window(
    region: Interval, cases: tuple[CaseWindow, ...]
) -> tuple[Intervals, tuple[tuple[Bound, Bound], ...]]:
    """Intervals in which every limit is met in every case, and what binds their two ends."""
    window: Intervals = (region,)
    ends: dict[float, Bound] = {
        region[0]: Bound(REGION, "empty"),
        region[1]: Bound(REGION, "empty"),
    }
    for case in cases:
        # The range analysed ends where the limit on speed does, and with it every other interval.
        for name in sorted(case.intervals, key=lambda name: name != "speed"):
            window = intersect(window, case.intervals[name])
            for low, high in case.intervals[name]:
                ends.setdefault(low, Bound(name, case.name))
                ends.setdefault(high, Bound(name, case.name))
    return window, tuple((ends[low], ends[high]) for low, high in window)


@dataclass(frozen=True, eq=False)
class _Run:
    """Rising motions of a branch, each ready to be measured."""

    branch: Branch
    screen: FlipFlowScreen
    run: slice
    jumps: tuple[float, ...]
    nodes: tuple[Working, ...]

    def at(self, omega: float) -> Working:
        orbit = self.branch.solve_in(self.run, omega)
        if orbit is None:
            raise IncompleteError(f"no motion found at {omega:.6g} rad/s between two of the branch")
        return Working(self.screen, orbit, self.jumps)


def _runs(branch: Branch, screen: FlipFlowScreen, span: Interval) -> list[_Run]:
    """The rising runs of a branch within ``span``, with motions at both ends of each."""
    jumps = tuple(fold.omega for fold in branch.folds)
    runs = []
    last = -math.inf
    for k, run in enumerate(branch.rising_path):
        fold = fold_at_end(branch, run)
        # Points behind the fold are motions of its other side.
        stop = run.stop if fold is None else min(run.stop, math.ceil(fold.position))
        end = float(branch.omega[stop - 1]) if fold is None else fold.omega
        low, high = max(span[0], last if k else branch.omega[run.start]), min(span[1], end)
        last = end
        if low >= high:
            continue
        rising = slice(run.start, stop)
        orbits = _orbits(branch, rising, (low, high), fold)
        nodes = tuple(Working(screen, orbit, jumps) for orbit in orbits)
        if nodes:
            runs.append(_Run(branch, screen, rising, jumps, nodes))
    return runs


def _orbits(
    branch: Branch, run: slice, span: Interval, fold: SpecialPoint | None
) -> Iterator[Orbit]:
    """Motions of a run over ``span``, rising: both ends, the branch's own, its special points.

    Between two special points one more motion stands, so that it is known what holds there.
    """
    last = run.stop - 1.0 if fold is None else fold.position
    inside = [i for i in range(run.start, run.stop) if span[0] < branch.omega[i] < span[1]]
    own = [branch.orbit(i) for i in inside]
    special = [
        point.orbit
        for point in branch.special_points
        if point.kind in STABILITY_CHANGES
        and run.start <= point.position <= last
        and span[0] < point.omega <= span[1]
    ]
    special.sort(key=_speed_of)
    middles = [(one.omega + two.omega) / 2.0 for one, two in itertools.pairwise(special)]
    ends = span[:1] if special and special[-1].omega == span[1] else span
    solved = [branch.solve_in(run, omega) for omega in (*ends, *middles)]
    found = [orbit for orbit in solved if orbit is not None]
    yield from sorted([*own, *special, *found], key=_speed_of)


def _speed_of(orbit: Orbit) -> float:
    return orbit.omega


def _met(run: _Run, name: str, low: float, high: float) -> tuple[list[Interval], list[Interval]]:
    """Parts of a run in which low <= quantity <= high, their ends solved for.

    Besides, the gaps in which an end lies and no motion is found; they are left out.
    """

    def clearance(motion: Working) -> float:
        value = motion.value(name)
        number = math.nan if value is None else min(value, 1e30)
        return min(number - low, high - number)

    values = [clearance(node) for node in run.nodes]
    parts: list[Interval] = []
    gaps: list[Interval] = []
    begin = run.nodes[0].omega if values[0] >= 0.0 else None
    for k in range(1, len(values)):
        if (values[k] >= 0.0) == (values[k - 1] >= 0.0):
            continue
        a, b = run.nodes[k - 1].omega, run.nodes[k].omega
        ends = {a: values[k - 1], b: values[k]}

        def height(omega: float, ends: dict[float, float] = ends) -> float:
            return ends[omega] if omega in ends else clearance(run.at(omega))

        try:
            root = float(brentq(height, a, b, xtol=1e-9 * b, rtol=1e-12))
        except IncompleteError:
            gaps.append((a, b))
            root = b if begin is None else a
        if begin is None:
            begin = root
        else:
            parts.append((begin, root))
            begin = None
    if begin is not None:
        parts.append((begin, run.nodes[-1].omega))
    return parts, gaps


def _stable_parts(run: _Run) -> list[Interval]:
    """Parts of a run in which the motion is not unstable; they end at special points."""
    parts: list[Interval] = []
    for one, two in itertools.pairwise(run.nodes):
        if "unstable" in (one.orbit.stability, two.orbit.stability):
            continue
        if parts and parts[-1][1] == one.omega:
            parts[-1] = (parts[-1][0], two.omega)
        else:
            parts.append((one.omega, two.omega))
    return parts


def _joined(parts: list[list[Interval]], span: Interval) -> Intervals:
    """Intervals of all runs within ``span``, those that touch joined."""
    joined: list[Interval] = []
    for low, high in sorted(part for run in parts for part in run):
        if joined and low <= joined[-1][1] * (1.0 + 1e-12):
            joined[-1] = (joined[-1][0], max(high, joined[-1][1]))
        else:
            joined.append((low, high))
    return intersect(tuple(joined), (span,))


def working_motion(machine: Machine, branch: Branch, omega: float) -> Working | None:
    """The motion reached from below at ``omega``, None where the branch does not cover it."""
    orbit: Orbit | None = branch.orbit_from_below(omega)
    jumps = tuple(fold.omega for fold in branch.folds)
    return None if orbit is None else Working(machine, orbit, jumps)
