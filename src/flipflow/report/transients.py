"""Start, coast-down and jump risk of the empty machine, in words a plant understands."""

from __future__ import annotations

from collections.abc import Iterator

from flipflow.plotting.transient import run_ups_figure
from flipflow.report.blocks import Block, Column, FigureBlock, Heading, Note, Table, Text, cells
from flipflow.report.jump_risk import millimetres, moment_words
from flipflow.report.numbers import NOTHING, number, quantity, rpm
from flipflow.report.registry import Part, section
from flipflow.studies.assessment import Assessment
from flipflow.studies.jump_risk import JumpRisk
from flipflow.studies.start_and_blows import Transients
from flipflow.transient.startup import RunUp

PEAKS = (
    ("main_amplitude", "Main frame, amplitude", "mm", "m"),
    ("relative_amplitude", "Relative motion, amplitude", "mm", "m"),
    ("foundation_force", "Force on the foundation", "kN", "N"),
    ("stop_force", "Force on the stops of a side", "kN", "N"),
)
ASSUMED = "Assumed: "
CANNOT_JUMP = "cannot jump: no other motion was found"
NO_SPEED = "not checked, for the machine file gives no working speed."


@section(Assessment, Part.DETAILS, 70, brief=True)
def start_and_stop(assessment: Assessment) -> Iterator[Block]:
    """Start, coast-down and jump risk in a line each."""
    yield Heading("Start, stop and disturbances", 1, new_page=False)
    found = assessment.transients
    if found is None:
        yield Text(NO_SPEED, "Start, stop and disturbances:")
        return
    yield Text(start_words(found), "Start (empty):")
    yield Text(coast_words(found), "Coast-down (empty):")
    yield Text(jump_words(found), "Blows and lumps (empty):")


@section(Assessment, Part.DETAILS, 71)
def start_and_stop_details(assessment: Assessment) -> Iterator[Block]:
    """The peaks on the way with their speeds, start and coast-down over time, the assumptions."""
    found = assessment.transients
    if found is None:
        return
    runs = [run for run in (found.start, found.coast_down) if run is not None]
    if found.jump is not None and found.jump.others:
        yield Text(moment_words(found.jump))
    if not runs:
        return
    yield _peaks_table(found)
    notes = dict.fromkeys(note for run in runs for note in run.notes)
    yield from (Note(note) for note in notes if not note.startswith(ASSUMED))
    assumed = [note.removeprefix(ASSUMED).rstrip(".") for note in notes if note.startswith(ASSUMED)]
    if assumed:
        yield Note(f"{ASSUMED}{'; '.join(assumed)}.")
    yield FigureBlock(run_ups_figure(runs))


def start_words(found: Transients) -> str:
    """What becomes of a start from rest, the greatest amplitude and force on the way."""
    run = found.start
    if run is None:
        return f"not checked: {found.reasons['start']}."
    drive = "drive assumed" if found.assumed else "drive of the machine file"
    first = f"the first natural frequency w01 = {rpm(run.first_frequency)} rpm"
    if run.passing is None:
        first = f"does not pass {first}"
    else:
        first = f"passes {first} in {run.passing:.2g} s"
    return f"{run.verdict}; {first}; {_greatest(run)} ({drive})."


def coast_words(found: Transients) -> str:
    """How long the machine comes down, the greatest amplitude and force on the way."""
    run = found.coast_down
    if run is None:
        return f"not checked: {found.reasons['coast_down']}."
    return f"{run.verdict}; {_greatest(run)}."


def jump_words(found: Transients) -> str:
    """The least blow on each frame and the least lump, or that nothing can throw the motion."""
    risk = found.jump
    if risk is None:
        return f"not checked: {found.reasons['jump']}."
    if not risk.others:
        return f"{CANNOT_JUMP}."
    return f"{_least_blows(risk)}; {_least_lump(risk)}."


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


def _greatest(run: RunUp) -> str:
    """Greatest amplitude of the main frame and force on the foundation, each with its speed."""
    parts = []
    for (name, _, shown, unit), what in zip(
        (PEAKS[0], PEAKS[2]), ("main frame", "foundation"), strict=True
    ):
        if peak := run.peaks.get(name):
            parts.append(f"{what} {quantity(peak.value, shown, unit)} at {rpm(peak.omega)} rpm")
    return f"greatest: {', '.join(parts)}"


def _peaks_table(found: Transients) -> Table:
    runs = (("start", found.start), ("coast-down", found.coast_down))
    columns = [Column("Greatest on the way")]
    for name, _ in runs:
        columns += [Column(name.capitalize(), numeric=True), Column("at", "rpm", numeric=True)]
    rows = []
    for name, label, shown, unit in PEAKS:
        row = [label]
        for _, run in runs:
            peak = None if run is None else run.peaks.get(name)
            if peak is None:
                row += [NOTHING, NOTHING]
            else:
                row += [quantity(peak.value, shown, unit), rpm(peak.omega)]
        if any(text != NOTHING for text in row[1:]):
            rows.append(cells(*row))
    caption = (
        "Empty machine. Amplitude: half the way from one turning point of the motion to the next."
    )
    return Table("", tuple(columns), tuple(rows), caption)
