"""From a machine file to a verdict: every load case at working speed against every limit."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from flipflow import __version__
from flipflow.continuation.branch import Branch
from flipflow.dynamics.normal import NormalMotion
from flipflow.errors import InputError
from flipflow.model.constants import GRAVITY, RPM
from flipflow.model.fields import MOTION_FIELDS
from flipflow.model.limits import (
    LIMIT_FIELDS,
    PASSAGES,
    PASSING_FIELDS,
    LimitField,
    Passage,
    limit_bounds,
)
from flipflow.model.monitor import Monitor
from flipflow.model.numerals import case_words, digits, rpm
from flipflow.model.project import Project
from flipflow.model.quantities import QUANTITIES, missing_words, quantities_of
from flipflow.model.screen import FlipFlowScreen, Load
from flipflow.periodic.options import Method, checked_method
from flipflow.periodic.orbit import Orbit
from flipflow.periodic.stability import RETURNS, UNDETERMINED, UNSTABLE
from flipflow.results.result import Frozen, Result
from flipflow.studies.drive_check import Demand
from flipflow.studies.feasible import working_motion
from flipflow.studies.foundation_loads import FoundationLoads, foundation_loads
from flipflow.studies.gaps_under_weight import GapsUnderWeight, gaps_under_weight
from flipflow.studies.landmarks import analysed_range
from flipflow.studies.operating_region import OperatingRegion, operating_region
from flipflow.studies.quantity_values import Working
from flipflow.studies.rubber_temperature import warmed_load
from flipflow.studies.sensitivity import OneAtATime, one_at_a_time
from flipflow.studies.start_and_blows import Transients, transients
from flipflow.studies.start_sentence import ASSUMED, in_cases

TORNADO_SHARE = 0.05  # change of each field, down and up, relative to its value
PASS, ATTENTION, FAIL, NOT_CHECKED = "pass", "attention", "fail", "not checked"
CLOSE = 0.05  # margin to a limit, relative, below which it asks for attention
NO_LIMIT = (-math.inf, math.inf)
NOT_SO_FAR = "the machine does not come so far"  # what is not judged on the way


@dataclass(frozen=True)
class LimitRow:
    """One limit over all load cases.

    Parameters
    ----------
    name, label, unit, shown_unit
        Limit, its words, SI unit and unit to show.
    limit
        (least, most) in SI; infinite where there is no such end.
    worst
        The value nearest to or farthest beyond the limit, SI; None when not checked.
    case
        The load case in which it occurs.
    margin
        Distance from the limit as a share of the limit; negative when it is broken.
    state
        "pass", "attention" (met, but within 5 %), "fail" or "not checked".
    reason
        Why it was not checked.
    """

    name: str
    label: str
    unit: str
    shown_unit: str
    limit: tuple[float, float]
    worst: float | None = None
    case: str = ""
    margin: float | None = None
    state: str = NOT_CHECKED
    reason: str = ""


@dataclass(frozen=True, eq=False)
class CaseAssessment(Frozen):
    """One load case at working speed.

    Parameters
    ----------
    name, load, screen
        The case and the screen under it.
    branch
        Its motions over the analysed range.
    working
        The motion reached from below at working speed, None without a speed.
    orbits
        All motions of the branch at working speed.
    values
        Quantities by name, SI; None where data are missing.
    energy
        Mean powers in W: "input" and what isolation, shear springs, stop and the normal
        direction's isolation take.
    """

    name: str
    load: Load
    screen: FlipFlowScreen
    branch: Branch
    working: Working | None
    orbits: tuple[Orbit, ...]
    values: Mapping[str, float | None]
    energy: Mapping[str, float]

    @property
    def orbit(self) -> Orbit | None:
        """The motion at working speed."""
        return None if self.working is None else self.working.orbit

    @property
    def normal(self) -> NormalMotion | None:
        """The motion normal to the surface at working speed."""
        return None if self.working is None else self.working.normal

    @cached_property
    def gaps(self) -> GapsUnderWeight:
        """The gaps under the weight, and how the two sides of the stops differ."""
        return gaps_under_weight(self.screen, self.branch, self.orbit)

    @property
    def stop_reached(self) -> bool:
        """Whether a stop is touched at working speed."""
        return self.orbit is not None and self.orbit.touches


@dataclass(frozen=True, eq=False)
class Assessment(Result):
    """A project judged: what ``flipflow analyze`` shows.

    Parameters
    ----------
    project
        The machine file.
    region
        Operating region and feasible window.
    cases
        Every load case at working speed.
    omega
        Working speed in rad/s, None where the file gives none.
    limits_table
        Every limit with its worst case.
    verdict
        One sentence.
    tornado
        The empty machine's relative amplitude with one field at a time 5 % lower and higher; None
        without a working speed.
    transients
        Start, coast-down and jump risk of every load case; None without a working speed.
    notes
        What was not checked or not finished.
    method, version, input_hash
        How, by which version, from which input.
    foundation
        What goes into the ground; None without a motion or a run.
    passing_table
        The limits on start and stop, and what is greatest there where no limit is given.
    """

    project: Project
    region: OperatingRegion
    cases: tuple[CaseAssessment, ...]
    omega: float | None
    limits_table: tuple[LimitRow, ...]
    verdict: str
    tornado: OneAtATime | None
    transients: Transients | None
    notes: tuple[str, ...]
    method: Method
    version: str
    input_hash: str
    foundation: FoundationLoads | None = None
    passing_table: tuple[LimitRow, ...] = ()

    @property
    def state(self) -> str:
        """The worst state of limits and drive; fail without a motion that returns."""
        if self.omega is None:
            return NOT_CHECKED
        if any(one.orbit is None or one.orbit.stability == "unstable" for one in self.cases):
            return FAIL
        rows = (*self.limits_table, *self.passing_table)
        judged = (row for row in rows if row.limit != NO_LIMIT and row.reason != NOT_SO_FAR)
        states = {row.state for row in judged}
        if self.transients is not None and self.transients.cases:
            states.add(self.transients.state)
        order = (FAIL, NOT_CHECKED, ATTENTION, PASS)
        return next((state for state in order if state in states), NOT_CHECKED)

    @property
    def start_fails(self) -> bool:
        """Whether the machine does not start, or runs where it may not, by the drive given."""
        return self.transients is not None and self.transients.state == FAIL

    def __repr__(self) -> str:
        name = self.project.document.name or self.project.name
        return f"Assessment({name}: {self.verdict})"


def assess(
    project: Project,
    *,
    monitor: Monitor | None = None,
    omega: tuple[float, float] | None = None,
    method: Method | None = None,
) -> Assessment:
    """Judge a project: operating region, feasible window, every case against every limit.

    Where a case gives the air's temperature, the rubber is as warm as its work at working speed
    keeps it, at every speed.

    Parameters
    ----------
    project
        What :func:`flipflow.load_project` returns.
    monitor
        Called with a sentence and the share done, 0 to 1.
    omega, method
        As for :func:`~flipflow.operating_region`.

    Raises
    ------
    InputError
        For anything but a project.
    """
    if not isinstance(project, Project):
        remedy = "give a project, such as ff.load_project('ffs0827')"
        raise InputError("project", type(project).__name__, remedy)
    span = analysed_range(project.screen, project.speed)
    warmed = [
        warmed_load(project.screen, load, project.speed, method) for load in project.load_cases
    ]
    loads = [one.load for one in warmed]
    region = operating_region(
        project.screen,
        project.limits,
        loads,
        monitor=monitor,
        omega=span if omega is None else omega,
        method=method,
    )
    cases = tuple(
        assess_case(project.screen.loaded(load), load, branch, project.speed)
        for load, branch in zip(loads, region.branches, strict=True)
    )
    rows = tuple(limit_row(project, cases, limit.name) for limit in LIMIT_FIELDS)
    found = None if project.speed is None else passing(project, project.speed, cases, region)
    on_the_way = () if found is None else passing_rows(project, found)
    return Assessment(
        project=project,
        region=region,
        cases=cases,
        omega=project.speed,
        limits_table=rows,
        verdict=with_start(verdict(project.speed, rows, cases, region), found, on_the_way),
        tornado=None if project.speed is None else tornado(project.screen, project.speed),
        transients=found,
        notes=(
            *project.warnings,
            *region.notes,
            *coexisting(cases),
            *(one.note for one in warmed if one.note),
        ),
        method=checked_method(method),
        version=__version__,
        input_hash=input_hash(project),
        foundation=loads_of(cases, found),
        passing_table=on_the_way,
    )


def loads_of(cases: tuple[CaseAssessment, ...], found: Transients | None) -> FoundationLoads | None:
    """What goes into the ground in every load case, at the worst start and coast-down."""
    motions = {case.name: case.orbit for case in cases if case.orbit is not None}
    runs = {}
    if found is not None:
        named = {f"start ({found.case})": found.start, "coast-down": found.coast_down}
        angle = ", from another angle" if found.loudest_case == found.case else ""
        named[f"start ({found.loudest_case}){angle}"] = found.loudest
        runs = {name: run for name, run in named.items() if run is not None}
    return foundation_loads(motions, runs) if motions or runs else None


def passing(
    project: Project, omega: float, cases: tuple[CaseAssessment, ...], region: OperatingRegion
) -> Transients:
    """Start, coast-down and jump risk of every load case, and the drive against the machine."""
    screens = {case.name: case.screen for case in cases}
    powers = {case.name: total_power(case.energy) for case in cases if case.energy}
    first = cases[0]

    def power_at(speed: float) -> float | None:
        working = working_motion(first.screen, first.branch, speed)
        return None if working is None else total_power(energy_balance(working))

    demand = Demand(first.screen, omega, region.feasible, powers, power_at)
    return transients(project, omega, screens, demand)


def total_power(energy: Mapping[str, float]) -> float:
    """Mean power in W that the dampers take of a motion in both directions."""
    return energy["input"] + energy.get("normal", 0.0)


def tornado(screen: FlipFlowScreen, omega: float) -> OneAtATime:
    """The relative amplitude with each value of the machine alone 5 % lower and higher.

    5 % is the spread of Table 1 of the paper; what is zero, infinite or not given does not vary.
    """
    present = {name: getattr(screen, name) or 0.0 for name in MOTION_FIELDS}
    vary = {
        name: ((1.0 - TORNADO_SHARE) * value, (1.0 + TORNADO_SHARE) * value)
        for name, value in present.items()
        if 0.0 < value < math.inf
    }
    return one_at_a_time(screen, vary, "relative_amplitude", omega)


def assess_case(
    screen: FlipFlowScreen, load: Load, branch: Branch, omega: float | None
) -> CaseAssessment:
    """One load case at working speed."""
    working = None if omega is None else working_motion(screen, branch, omega)
    values: dict[str, float | None] = {}
    if working is not None:
        values = {one.name: working.value(one.name) for one in quantities_of("motion")}
    return CaseAssessment(
        name=load.name or "empty",
        load=load,
        screen=screen,
        branch=branch,
        working=working,
        orbits=() if working is None else branch.orbits_at(working.omega),
        values=values,
        energy={} if working is None else energy_balance(working),
    )


def energy_balance(working: Working) -> dict[str, float]:
    """Mean powers in W; "input" along the surface equals isolation + shear + stop.

    The stop's is what its damping takes and what it still holds when it lets go early.
    """
    orbit = working.orbit
    powers = {
        "input": orbit.input_power(),
        "isolation": working.field("isolation_damping") * orbit.mean_square_velocity("main"),
        "shear": working.field("shear_damping") * orbit.mean_square_velocity("relative"),
        "stop": 0.0,
    }
    if working.stops:
        powers["stop"] = orbit.stop_power()
    if working.normal is not None:
        powers["normal"] = working.normal.power
    return powers


def limit_row(project: Project, cases: tuple[CaseAssessment, ...], name: str) -> LimitRow:
    """The worst case of one limit."""
    quantity = QUANTITIES[name]
    row = LimitRow(name, quantity.label, quantity.unit, quantity.shown_unit, NO_LIMIT)
    if getattr(project.limits, name) is None:
        return dataclasses.replace(row, reason="no limit in the machine file")
    low, high = limit_bounds(project.limits, name)
    row = dataclasses.replace(row, limit=(low, high))
    missing = quantity.missing(project.screen)
    if missing:
        return dataclasses.replace(row, reason=missing_words(missing))
    if project.speed is None:
        return dataclasses.replace(row, reason="no operating speed in the machine file")
    given = project.speed if quantity.of == "operation" else None
    judged = [
        (relative_margin(value, low, high), value, case.name)
        for case in cases
        if (value := given if given is not None else case.values.get(name)) is not None
    ]
    if not judged:
        return dataclasses.replace(row, reason="no motion found at working speed")
    margin, worst, case_name = min(judged, key=lambda one: one[0])
    return _judged(dataclasses.replace(row, worst=worst, case=case_name), margin)


def passing_rows(project: Project, found: Transients) -> tuple[LimitRow, ...]:
    """The limits on start and stop with their worst case, and what has none there."""
    rows = (
        passing_row(project, found, passage, field)
        for passage in PASSAGES
        for field in PASSING_FIELDS[passage]
    )
    return tuple(row for row in rows if row is not None)


def passing_row(
    project: Project, found: Transients, passage: Passage, field: LimitField
) -> LimitRow | None:
    """The worst case of one quantity on the way; None where it has neither value nor limit."""
    quantity = QUANTITIES[field.name]
    label = f"{quantity.label}, {passage}"
    row = LimitRow(field.key, label, quantity.unit, quantity.shown_unit, NO_LIMIT)
    most = getattr(getattr(project.limits, passage), field.name)
    worst = [
        (peak.value, case.case)
        for case in found.cases
        if (peak := case.peaks_of(passage).get(field.name)) is not None
    ]
    if most is not None:
        row = dataclasses.replace(row, limit=(-math.inf, most))
    missing = quantity.missing(project.screen)
    if not worst or missing:
        reason = missing_words(missing) if missing else NOT_SO_FAR
        return None if most is None else dataclasses.replace(row, reason=reason)
    value, case = max(worst)
    row = dataclasses.replace(row, worst=value, case=case)
    if most is None:
        return dataclasses.replace(row, reason=f"no limit given for the {passage}")
    return _judged(row, relative_margin(value, -math.inf, most))


def _judged(row: LimitRow, margin: float) -> LimitRow:
    state = FAIL if margin < 0.0 else ATTENTION if margin < CLOSE else PASS
    return dataclasses.replace(row, margin=margin, state=state)


def running_limit(project: Project, row: LimitRow) -> float | None:
    """The greatest value that the running limit allows of what is greatest on the way, SI."""
    name = row.name.rpartition(".")[2]
    if getattr(project.limits, name, None) is None:
        return None
    return limit_bounds(project.limits, name)[1]


def with_start(sentence: str, found: Transients | None, rows: tuple[LimitRow, ...]) -> str:
    """The verdict with what start, stop and drive add to it."""
    if found is None or not found.cases:
        return sentence
    broken = sum(row.state == FAIL for row in rows)
    parts = []
    if found.failed:
        where = in_cases([one.case for one in found.failed], len(found.cases))
        rests = f" ({ASSUMED})" if found.rests_on_assumed else ""
        parts.append(f"the start fails {where}{rests}")
    elif any(one.state == FAIL for one in found.findings):
        parts.append("the drive does not fit")
    if broken:
        parts.append(f"{broken} {'limit' if broken == 1 else 'limits'} on start and stop broken")
    return f"{sentence.rstrip('.')}; {' and '.join(parts)}." if parts else sentence


def relative_margin(value: float, low: float, high: float) -> float:
    """Distance from the nearer end as a share of that end; negative beyond it."""
    to_low = (value - low) / abs(low) if math.isfinite(low) and low != 0.0 else math.inf
    to_high = (high - value) / abs(high) if math.isfinite(high) and high != 0.0 else math.inf
    return min(to_low, to_high)


def verdict(
    omega: float | None,
    rows: tuple[LimitRow, ...],
    cases: tuple[CaseAssessment, ...],
    region: OperatingRegion,
) -> str:
    """One sentence for the top of the report."""
    if omega is None:
        return "No operating speed is given: the allowed speed range stands below."
    speed = f"{rpm(omega)} rpm"
    unknown = [case for case in cases if case.orbit is None]
    if unknown:
        return f"{speed}: not judged, for {_why_unknown(omega, unknown)}."
    lost = {
        case.name: case.orbit.stability
        for case in cases
        if case.orbit is not None and not case.orbit.stable
    }
    if lost:
        where = "; ".join(lost) if len(lost) < len(cases) else "every load case"
        word = UNSTABLE if set(lost.values()) == {UNSTABLE} else UNDETERMINED
        return f"{speed}: the motion {RETURNS[word]} after a disturbance in {where}."
    judged = [row for row in rows if row.margin is not None]
    unchecked = [row for row in rows if row.state == NOT_CHECKED and row.limit != NO_LIMIT]
    if not judged:
        return f"{speed}: no limit could be checked."
    tightest = min(judged, key=lambda row: row.margin if row.margin is not None else math.inf)
    broken = [row for row in judged if row.state == FAIL]
    where = "in all cases" if len(cases) > 1 else "for the machine"
    head = f"all limits met {where}; tightest"
    if broken:
        head = f"{len(broken)} of {len(judged)} limits broken; worst"
    elif unchecked:
        head = f"all limits that could be checked are met {where}; tightest"
    outside = "" if broken else _outside(omega, region)
    return f"{speed}: {head}: {_against(tightest)}{outside}."


def _why_unknown(omega: float, cases: list[CaseAssessment]) -> str:
    """Why no motion is known in these cases at working speed, in words."""
    names = ", ".join(case.name for case in cases)
    speeds = [case.branch.omega for case in cases]
    if all(one.min() <= omega <= one.max() for one in speeds):
        return f"raised from below it meets no stable motion in {names}"
    return f"the speeds analysed do not hold it in {names}"


def _outside(omega: float, region: OperatingRegion) -> str:
    """Which end of the region the speed lies beyond, in words; empty where it may run."""
    if any(low <= omega <= high for low, high in region.feasible):
        return ""
    if region.lower <= omega <= region.upper:
        return ", but outside the allowed speed range"
    below = omega < region.lower
    end, words = (region.lower, region.ends[0]) if below else (region.upper, region.ends[1])
    side = "below" if below else "above"
    return f", but {side} the operating region: {words} at {rpm(end)} rpm"


def coexisting(cases: tuple[CaseAssessment, ...]) -> tuple[str, ...]:
    """A sentence that names the cases in which another motion is possible at working speed."""
    names = [case.name for case in cases if sum(orbit.stable for orbit in case.orbits) > 1]
    if not names:
        return ()
    head = f"Cases {'; '.join(names)}"
    if len(names) == 1:
        head = case_words(names[0], capital=True)
    sentence = (
        f"{head}: another motion is possible at this speed; shown is the one reached when the "
        "speed is raised from below."
    )
    return (sentence,)


def _against(row: LimitRow) -> str:
    """Words such as: relative amplitude, full, 5.12 mm of 5 mm least."""
    scale = {"mm": 1e3, "kN": 1e-3, "kW": 1e-3, "%": 100.0, "g": 1.0 / GRAVITY, "rpm": RPM}
    factor = scale.get(row.shown_unit, 1.0)
    low, high = row.limit
    worst = row.worst if row.worst is not None else math.nan
    at_low = relative_margin(worst, low, math.inf) <= relative_margin(worst, -math.inf, high)
    end, word = (low, "least") if at_low else (high, "most")
    case = f", {row.case}" if row.name != "speed" else ""
    unit = row.shown_unit
    worst_digits, end_digits = digits(worst * factor), digits(end * factor)
    return f"{row.label}{case}, {worst_digits} {unit} of {end_digits} {unit} {word}"


def input_hash(project: Project) -> str:
    """Digest of all values of the project that decide a result, and of the version."""
    inputs = {
        "screen": dataclasses.asdict(project.screen),
        "limits": dataclasses.asdict(project.limits),
        "cases": [dataclasses.asdict(load) for load in project.load_cases],
        "speed": project.speed,
        "drive": None if project.drive is None else dataclasses.asdict(project.drive),
        "version": __version__,
    }
    return hashlib.sha256(json.dumps(inputs, sort_keys=True).encode()).hexdigest()[:16]
