"""Start, coast-down and jump risk of every load case, in words a plant understands."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from flipflow.model.numerals import capitalized, case_words, rpm
from flipflow.plotting.transient import run_ups_figure
from flipflow.report.blocks import (
    Block,
    Cell,
    Column,
    FigureBlock,
    Heading,
    Note,
    Table,
    Text,
    cells,
)
from flipflow.report.first_page import limit_cells
from flipflow.report.jump_risk import millimetres, moment_words
from flipflow.report.numbers import NOTHING, bounds, in_rpm, number, quantity, written
from flipflow.report.registry import Part, section
from flipflow.studies.assessment import NO_LIMIT, Assessment, LimitRow, running_limit
from flipflow.studies.jump_risk import JumpRisk
from flipflow.studies.start_and_blows import CaseRuns, Transients
from flipflow.studies.start_sentence import NO_SPEED, drive_words
from flipflow.transient.run_up import Peak, RunUp

GREATEST = (
    ("main_amplitude", "main frame", "mm", "m"),
    ("foundation_force", "foundation", "kN", "N"),
)
ASSUMED = "Assumed: "
CANNOT_JUMP = "cannot jump: no other motion was found"
MOST_NAMED = 3  # load cases that a line names


@section(Assessment, Part.DETAILS, 70, brief=True)
def start_and_stop(assessment: Assessment) -> Iterator[Block]:
    """Start, coast-down and jump risk in a line each, of the worst load case."""
    yield Heading("Start, stop and disturbances", 1, new_page=False)
    found = assessment.transients
    if found is None:
        yield Text(NO_SPEED, "Start, stop and disturbances:")
        return
    yield Text(start_words(found), f"Start ({found.case}):")
    yield Text(coast_words(found), "Coast-down:")
    yield from jump_lines(found)
    yield from (Note(text) for text in beyond_running(assessment))


@section(Assessment, Part.DETAILS, 71)
def start_and_stop_details(assessment: Assessment) -> Iterator[Block]:
    """The peaks on the way with their limits, every load case, runs over time, assumptions."""
    found = assessment.transients
    if found is None:
        return
    runs = [run for run in (found.start, found.coast_down) if run is not None]
    if found.jump is not None and found.jump.others:
        yield Text(moment_words(found.jump))
    if not runs:
        return
    if found.cases:
        yield cases_table(found)
    if assessment.passing_table:
        yield _limits_table(assessment)
    notes = dict.fromkeys(note for run in runs for note in run.notes)
    yield from (Note(note) for note in notes if not note.startswith(ASSUMED))
    assumed = [note.removeprefix(ASSUMED).rstrip(".") for note in notes if note.startswith(ASSUMED)]
    if assumed:
        yield Note(f"{ASSUMED}{'; '.join(assumed)}.")
    yield FigureBlock(run_ups_figure(runs))


def start_words(found: Transients) -> str:
    """What becomes of the worst start, the greatest amplitude and force on the way."""
    run = found.start
    if run is None:
        return f"not checked: {found.reasons['start']}."
    first = f"the first natural frequency w01 = {rpm(run.first_frequency)} rpm"
    if run.passing is None:
        first = f"does not pass {first}"
    else:
        first = f"passes {first} in {run.passing:.2g} s"
    peaks = found.peaks
    own = all(run.peaks[name] == peak for name, peak in peaks.items() if name in run.peaks)
    what = "greatest" if own else "greatest of all starts"
    return f"{run.verdict}; {first}; {what}: {_greatest(run, peaks)} ({drive_words(found)})."


def coast_words(found: Transients) -> str:
    """How long the machine comes down, the greatest amplitude and force on the way."""
    run = found.coast_down
    if run is None:
        return f"not checked: {found.reasons['coast_down']}."
    return f"{run.verdict}; greatest: {_greatest(run, run.peaks)}."


def jump_lines(found: Transients) -> Iterator[Text]:
    """Blows and lumps of the worst load case, and which load cases cannot jump."""
    if not found.cases:
        yield Text(jump_words(found.jump, found.reasons), "Blows and lumps (empty):")
        return
    able = [one for one in found.cases if one.jump is not None and one.jump.others]
    worst = min(able, key=lambda one: one.jump.impulse if one.jump else 0.0, default=None)
    if worst is not None:
        yield Text(jump_words(worst.jump, worst.reasons), f"Blows and lumps ({worst.case}):")
    for words, cases in _alike([one for one in found.cases if one not in able]).items():
        every = len(cases) == len(found.cases)
        names = "every load case" if every and len(cases) > 1 else _names(cases)
        yield Text(words, f"Blows and lumps ({names}):")


def _alike(cases: list[CaseRuns]) -> dict[str, list[str]]:
    """Load cases by what is said of them."""
    said: dict[str, list[str]] = {}
    for one in cases:
        said.setdefault(jump_words(one.jump, one.reasons), []).append(one.case)
    return said


def _names(names: list[str]) -> str:
    return "; ".join(names) if len(names) <= MOST_NAMED else f"{len(names)} load cases"


def jump_words(risk: JumpRisk | None, reasons: dict[str, str]) -> str:
    """The least blow on each frame and the least lump, or that nothing can throw the motion."""
    if risk is None:
        return f"not checked: {reasons['jump']}."
    if not risk.others:
        return f"{CANNOT_JUMP}."
    return f"{_least_blows(risk)}; {_least_lump(risk)}."


def beyond_running(assessment: Assessment) -> Iterator[str]:
    """What is greater on the way than the running limit, where there is no limit for the way."""
    for row in assessment.passing_table:
        most = running_limit(assessment.project, row)
        if row.limit != NO_LIMIT or row.worst is None or most is None or row.worst <= most:
            continue
        worst, limit = (quantity(value, row.shown_unit, row.unit) for value in (row.worst, most))
        yield (
            f"{capitalized(row.label)}: {worst} ({case_words(row.case)}) exceeds the "
            f"running limit of {limit}; {row.reason}."
        )


def _least_blows(risk: JumpRisk) -> str:
    if not risk.impulses:
        return "no blow that was tried throws the motion onto another one"
    parts = [
        f"{number(one.size)} kg m/s on the {one.frame} frame (to {millimetres(one.lands)})"
        for one in risk.impulses
    ]
    return (
        f"the working motion, {millimetres(risk.orbit)}, is thrown onto another one by a blow of "
        f"{' or '.join(parts)} at the worst moment"
    )


def _least_lump(risk: JumpRisk) -> str:
    lump = risk.worst_lump
    if lump is None:
        return "no lump of material does so, however heavy"
    return f"a lump of {number(lump.size)} kg that lands on the {lump.frame} frame does so, too"


def _greatest(run: RunUp, peaks: Mapping[str, Peak]) -> str:
    """Greatest amplitude of the main frame and force on the foundation, each with its speed."""
    parts = []
    for name, what, shown, unit in GREATEST:
        if peak := peaks.get(name):
            parts.append(f"{what} {quantity(peak.value, shown, unit)} at {rpm(peak.omega)} rpm")
    along = "" if run.history.normal is not None else ", along the surface only"
    return f"{', '.join(parts)}{along}"


def cases_table(found: Transients) -> Table:
    """Start and coast-down of every load case."""
    columns = [Column("Load case"), Column("Start"), Column("at speed", "s", numeric=True)]
    columns.append(Column("settles at", "rpm", numeric=True))
    for passage in ("start", "stop"):
        columns += [
            Column(f"{what}, {passage}", shown, numeric=True) for _, what, shown, _ in GREATEST
        ]
    rows = tuple(_case_row(one) for one in found.cases)
    caption = (
        "The worst start from hanging and from every angle at which friction holds the shaft. "
        "Main frame: greatest distance from rest; foundation: greatest dynamic force."
    )
    return Table("Starts and coast-downs", tuple(columns), rows, caption)


def _case_row(case: CaseRuns) -> tuple[Cell, ...]:
    run = case.start
    if run is None:
        return cells(case.case, "not checked", *[NOTHING] * 6)
    time = NOTHING if run.time_to_speed is None else written(run.time_to_speed, ".3g")
    peaks = [
        quantity(peak.value, shown, unit, with_unit=False)
        if (peak := values.get(name)) is not None
        else NOTHING
        for values in (case.peaks, case.peaks_of("stop"))
        for name, _, shown, unit in GREATEST
    ]
    # A shaft that is not turned over swings out: what is left of its speed means nothing.
    settled = NOTHING if run.outcome == "not started" else in_rpm(run.final_speed)
    return cells(case.case, run.outcome, time, settled, *peaks)


def _limits_table(assessment: Assessment) -> Table:
    columns = (
        Column("Greatest on the way"),
        Column("Allowed", ends=True),
        Column("Worst", numeric=True),
        Column("Case"),
        Column("Margin", numeric=True),
        Column("State"),
    )
    rows = tuple(_limit_row(assessment, row) for row in assessment.passing_table)
    caption = (
        "Amplitude: half the way from peak to peak in one turn of the shaft; main frame: "
        "distance from rest, in any direction where the normal direction is known."
    )
    return Table("Limits on start and stop", columns, rows, caption)


def _limit_row(assessment: Assessment, row: LimitRow) -> tuple[Cell, ...]:
    if row.limit != NO_LIMIT:
        return limit_cells(row)
    label, _, worst, case, margin, _ = limit_cells(row)
    most = running_limit(assessment.project, row)
    running = Cell(NOTHING)
    if most is not None:
        running = Cell(bounds(-math.inf, most, row.shown_unit, row.unit), "while running")
    return label, running, worst, case, margin, Cell(row.reason)
