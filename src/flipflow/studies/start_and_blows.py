"""What a machine meets beside steady running: start, coast-down, blows and lumps of material."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from flipflow.batch.run_chunks import executor_or_threads, run_chunks
from flipflow.errors import Cancelled, IncompleteError, InputError
from flipflow.model.drive import Drive
from flipflow.model.limits import Passage
from flipflow.model.monitor import Monitor
from flipflow.model.numerals import case_words, rpm
from flipflow.model.project import Project
from flipflow.model.screen import FlipFlowScreen
from flipflow.studies.drive_check import (
    Demand,
    Finding,
    drive_findings,
    power_that_passes,
    power_words,
)
from flipflow.studies.held_angles import badness, foundation_force, starts_from_rest
from flipflow.studies.jump_risk import JumpRisk, jump_risk
from flipflow.transient.chosen_drive import default_drive, fitted_drive
from flipflow.transient.run_up import Outcome, Peak, RunSummary, RunUp
from flipflow.transient.startup import coast_down

NOT_REACHED = "the start does not reach the working speed"
FAILED: tuple[Outcome, ...] = ("not started", "captured", "short", "unfinished")


@dataclass(frozen=True, eq=False)
class CaseRuns:
    """Start, coast-down and jump risk of one load case at its working speed.

    Parameters
    ----------
    case
        The load case.
    start
        From rest, from the worst angle at which the shaft can have stopped; None where it could
        not be calculated.
    coast_down
        From the speed that the start reaches, the motor switched off; None where it reaches none.
    peaks
        The greatest peaks of all starts of the case, by name.
    jump
        The least blow and the least lump that throw the working motion onto another one; None
        where it could not be calculated.
    reasons
        Why "start", "coast_down" or "jump" is None.
    """

    case: str
    start: RunSummary | None
    coast_down: RunSummary | None
    peaks: Mapping[str, Peak]
    jump: JumpRisk | None
    reasons: dict[str, str]

    def peaks_of(self, passage: Passage) -> Mapping[str, Peak]:
        """The greatest peaks while it starts, or stops."""
        if passage == "start":
            return self.peaks
        return {} if self.coast_down is None else self.coast_down.peaks


@dataclass(frozen=True, eq=False)
class Transients:
    """Start, coast-down and jump risk of every load case, and the drive.

    Parameters
    ----------
    assumed
        Whether the drive was assumed, for the machine file gives none.
    start
        The worst start of all load cases: one that fails, else that with the greatest force on the
        foundation; None where none could be calculated.
    coast_down
        The coast-down with the greatest force on the foundation; None where no start reaches the
        working speed.
    jump
        The least blow and the least lump of all load cases; None where it could not be calculated.
    reasons
        Why "start", "coast_down" or "jump" is None.
    cases
        Every load case; empty in results of earlier versions, which had the empty machine alone.
    case
        The load case of ``start``.
    findings
        What is wrong with the drive.
    loudest
        Of all starts from every angle and in every load case the one with the greatest force on the
        foundation, where that is not ``start``: a start that fails may end before it shakes much.
    loudest_case
        The load case of ``loudest``.
    """

    assumed: bool
    start: RunUp | None
    coast_down: RunUp | None
    jump: JumpRisk | None
    reasons: dict[str, str]
    cases: tuple[CaseRuns, ...] = ()
    case: str = "empty"
    findings: tuple[Finding, ...] = ()
    loudest: RunUp | None = None
    loudest_case: str = ""

    @property
    def peaks(self) -> Mapping[str, Peak]:
        """The greatest peaks of all starts, by name."""
        if self.cases:
            return _greatest(one.peaks for one in self.cases)
        return {} if self.start is None else self.start.peaks

    @property
    def failed(self) -> tuple[CaseRuns, ...]:
        """The load cases in which the start does not reach the working speed."""
        return tuple(one for one in self.cases if one.start and one.start.outcome in FAILED)

    @property
    def rests_on_assumed(self) -> bool:
        """Whether values of the drive were assumed."""
        drive = None if self.start is None else self.start.drive
        return isinstance(drive, Drive) and bool(drive.assumed_fields)

    @property
    def state(self) -> str:
        """Pass, attention, fail on given values, or "not checked"."""
        if self.start is None:
            return "not checked"
        states = {one.state for one in self.findings}
        if self.failed:
            states.add("attention" if self.rests_on_assumed else "fail")
        return next((word for word in ("fail", "attention") if word in states), "pass")


def transients(
    project: Project, omega: float, screens: Mapping[str, FlipFlowScreen], demand: Demand
) -> Transients:
    """Start, coast-down and jump risk of every load case at ``omega`` in rad/s.

    Parameters
    ----------
    project
        Its drive is taken; where it has none, one is assumed.
    omega
        Working speed in rad/s.
    screens
        The machine under each load case, by name; the first one chooses what is open of the drive.
    demand
        What the machine asks of its drive.

    Raises
    ------
    InputError
        For a drive in the project with which the machine cannot be started.
    """
    reasons: dict[str, str] = {}
    drive = _drive(project, omega, demand.screen, reasons)
    alike: dict[FlipFlowScreen, list[str]] = {}
    for name, screen in screens.items():
        alike.setdefault(screen, []).append(name)
    runs, jumps = _side_by_side(tuple(alike), drive, omega)
    if isinstance(runs, InputError):
        if _known(project):
            raise runs
        reasons["start"] = _not_assumed(runs)
        drive, runs = None, [_Runs((), None) for _ in alike]
    starts = {
        name: (run, jump)
        for names, run, jump in zip(alike.values(), runs, jumps, strict=True)
        for name in names
    }
    cases = tuple(_case(name, *starts[name], reasons) for name in screens)
    found = () if drive is None else drive_findings(drive, demand)
    whole = _worst(project, cases, {name: run for name, (run, _) in starts.items()}, reasons)
    if whole.failed and drive is not None:
        found = (*found, *_resonance(whole, drive, screens))
    return replace(whole, findings=found)


@dataclass(frozen=True, eq=False)
class _Runs:
    """The starts of a machine, the worst first, and its coast-down."""

    starts: tuple[RunUp, ...]
    coast_down: RunUp | None


def _side_by_side(
    screens: tuple[FlipFlowScreen, ...], drive: Drive | None, omega: float
) -> tuple[list[_Runs] | InputError, list[JumpRisk | str]]:
    """The runs of each screen on two threads, and its blows beside them.

    Where Ctrl-C ends the wait, all end.
    """
    ended = threading.Event()

    def heard(_sentence: str, _share: float) -> None:
        if ended.is_set():
            raise Cancelled("nobody waits for this run")

    jumps: list[JumpRisk | str] = []

    def runs(screen: FlipFlowScreen) -> _Runs | InputError:
        try:
            return _runs(screen, drive, omega, heard)
        except InputError as error:
            return error

    def tasks() -> Iterator[tuple[int, tuple[FlipFlowScreen]]]:
        yield from enumerate((screen,) for screen in screens)
        # While those run: kernels leave the interpreter free.
        jumps.extend(_jump(screen, omega) for screen in screens)

    with executor_or_threads(None, 2) as pool:
        try:
            found = dict(run_chunks(pool, runs, tasks()))
        finally:
            ended.set()
    refused = [one for one in found.values() if isinstance(one, InputError)]
    return refused[0] if refused else [found[k] for k in range(len(screens))], jumps


def _runs(screen: FlipFlowScreen, drive: Drive | None, omega: float, monitor: Monitor) -> _Runs:
    if drive is None:
        return _Runs((), None)
    starts = starts_from_rest(screen, drive, omega, monitor=monitor)
    if starts[0].outcome != "reached":
        return _Runs(starts, None)
    return _Runs(starts, coast_down(screen, starts[0].final_speed, drive, monitor=monitor))


def _case(name: str, runs: _Runs, jump: JumpRisk | str, nothing: Mapping[str, str]) -> CaseRuns:
    reasons = dict(nothing)
    if runs.coast_down is None:
        reasons["coast_down"] = NOT_REACHED
    if isinstance(jump, str):
        reasons["jump"] = jump
    return CaseRuns(
        name,
        runs.starts[0].summary if runs.starts else None,
        None if runs.coast_down is None else runs.coast_down.summary,
        _greatest(run.peaks for run in runs.starts),
        None if isinstance(jump, str) else jump,
        reasons,
    )


def _greatest(several: Iterable[Mapping[str, Peak]]) -> dict[str, Peak]:
    """The greatest peak of each name."""
    found: dict[str, Peak] = {}
    for peaks in several:
        for key, peak in peaks.items():
            if key not in found or peak.value > found[key].value:
                found[key] = peak
    return found


def _worst(
    project: Project,
    cases: tuple[CaseRuns, ...],
    runs: Mapping[str, _Runs],
    nothing: Mapping[str, str],
) -> Transients:
    """The worst of all cases, with its motion."""
    starts = {name: one.starts[0] for name, one in runs.items() if one.starts}
    case = min(starts, key=lambda name: badness(starts[name]), default=cases[0].case)
    every = [(name, run) for name, one in runs.items() for run in one.starts]
    loudest_case, loudest = max(every, key=lambda one: foundation_force(one[1]), default=("", None))
    if loudest is starts.get(case):
        loudest_case, loudest = "", None
    coasts = [one.coast_down for one in runs.values() if one.coast_down is not None]
    reasons = dict(nothing)
    if not coasts:
        reasons["coast_down"] = NOT_REACHED
    jumps = [one.jump for one in cases if one.jump is not None]
    jump = min(jumps, key=lambda one: (not one.others, one.impulse), default=None)
    if jump is None:
        reasons["jump"] = next(one.reasons["jump"] for one in cases)
    return Transients(
        not _known(project),
        starts.get(case),
        max(coasts, key=foundation_force, default=None),
        jump,
        reasons,
        cases,
        case,
        loudest=loudest,
        loudest_case=loudest_case,
    )


def _known(project: Project) -> bool:
    return project.drive is not None and project.drive.motor is not None


def _drive(
    project: Project, omega: float, screen: FlipFlowScreen, reasons: dict[str, str]
) -> Drive | None:
    """The drive of the project, or an assumed one, with what was open of it chosen."""
    if project.drive is not None and _known(project):
        return fitted_drive(screen, project.drive, omega)
    try:
        return default_drive(screen, omega)
    except InputError as error:
        reasons["start"] = _not_assumed(error)
        return None


def _not_assumed(error: InputError) -> str:
    """Nobody gave this drive, so the rest of the analysis need not end with it."""
    return f"no drive is given, and none can be assumed ({error})"


def _jump(screen: FlipFlowScreen, omega: float) -> JumpRisk | str:
    try:
        return jump_risk(screen, omega)
    except IncompleteError as error:
        return str(error).rstrip(".")


def _resonance(
    found: Transients, drive: Drive, screens: Mapping[str, FlipFlowScreen]
) -> tuple[Finding, ...]:
    """The rated power with which every case passes where the start is captured; else nothing."""
    run = found.start
    if run is None or run.near is None:
        return ()
    known = [power_that_passes(drive, screen, run.near.omega) for screen in screens.values()]
    powers = [power for power in known if power is not None]
    if not powers:
        return ()
    held = f"{run.near.name} = {rpm(run.near.omega)} rpm ({case_words(found.case)})"
    sentence = f"{power_words(max(powers))} of rated power pass {held} however slowly."
    return (Finding("resonance", "attention", sentence),)
