"""Does it start: the start of every load case in one sentence, for page, terminal and document."""

from __future__ import annotations

from collections.abc import Sequence

from flipflow.model.constants import RPM
from flipflow.model.numerals import capitalized, case_words, rpm
from flipflow.studies.drive_check import Finding
from flipflow.studies.start_and_blows import CaseRuns, Transients
from flipflow.transient.run_up import RunUp

NO_SPEED = "not checked, for the machine file gives no working speed."
ASSUMED = "drive assumed"


def does_it_start(found: Transients | None) -> str:
    """Whether the machine starts, how fast, or why not and what would do."""
    if found is None:
        return NO_SPEED
    if found.start is None:
        return f"not checked: {found.reasons['start']}."
    drive = f" ({drive_words(found)})"
    if found.failed:
        return f"no{drive}: {_failure(found.failed, len(found.cases))}.{_remedies(found.findings)}"
    return f"yes{drive}: {_success(found.start, found.cases)}.{_remedies(found.findings)}"


def drive_words(found: Transients) -> str:
    """How far the drive is given."""
    if found.assumed:
        return ASSUMED
    return f"{ASSUMED} in part" if found.rests_on_assumed else "drive of the machine file"


def in_cases(names: Sequence[str], count: int) -> str:
    """In which load cases, in words; of many only their number."""
    if len(names) == count:
        return "in every load case" if count > 1 else f"in {case_words(names[0])}"
    if len(names) > MOST_NAMED:
        return f"in {len(names)} of {count} load cases"
    return f"in {'case' if len(names) == 1 else 'cases'} {'; '.join(names)}"


MOST_NAMED = 3


def _failure(failed: tuple[CaseRuns, ...], count: int) -> str:
    """What becomes of the starts that fail: those of the first kind in their cases."""
    told = failed[0].start
    verb = "is " if told and told.outcome in {"captured", "unfinished"} else ""
    verdict = told.verdict if told else ""
    return f"{in_cases([one.case for one in failed], count)} it {verb}{verdict}"


def _success(run: RunUp, cases: tuple[CaseRuns, ...]) -> str:
    """How fast, and at what speeds the load cases then run."""
    told = [(one.case, one.start) for one in cases if one.start]
    times = [start.time_to_speed for _, start in told if start.time_to_speed is not None]
    if not told or (len(told) == 1 and not times):
        return f"it {run.verdict}"
    wanted = f"{rpm(run.speed)} rpm"
    reached = f"comes near {wanted}"
    if times:
        short = [name for name, start in told if start.time_to_speed is None]
        but = f", but not quite {in_cases(short, len(cases))}" if short else ""
        reached = f"reaches {wanted} in at most {max(times):.3g} s{but}"
    ends = [start.final_speed * RPM for _, start in told]
    low, high = f"{min(ends):.0f}", f"{max(ends):.0f}"
    where = f" {in_cases([name for name, _ in told], len(cases))}" if len(cases) > 1 else ""
    return f"it {reached}, then {low if low == high else f'{low} to {high}'} rpm{where}"


def _remedies(findings: tuple[Finding, ...]) -> str:
    """The findings on the drive as sentences of their own."""
    return "".join(f" {capitalized(one.sentence)}" for one in findings)
