"""The first page: what it is, whether it may run so, and the numbers behind the verdict."""

from __future__ import annotations

import itertools
import math
import textwrap
from collections.abc import Iterator

from flipflow.model.limits import PASSAGES
from flipflow.model.numerals import capitalized, case_words, rpm
from flipflow.model.quantities import QUANTITIES, missing_words
from flipflow.periodic.stability import RETURNS
from flipflow.plotting.layout import legend_lines
from flipflow.plotting.motion import motions_figure
from flipflow.plotting.response import LEGEND_WITHIN, case_names, cases_figure
from flipflow.report.blocks import (
    Block,
    Cell,
    Column,
    FigureBlock,
    Note,
    Table,
    Text,
    TitleBlock,
    Values,
    Verdict,
)
from flipflow.report.numbers import NOTHING, bounds, in_rpm, named, percent, quantity, speed
from flipflow.report.parts import worst_of
from flipflow.report.registry import Part, section
from flipflow.report.weight import AT_REST, contact
from flipflow.studies.allowed_range import allowed_range
from flipflow.studies.assessment import (
    Assessment,
    CaseAssessment,
    LimitRow,
)
from flipflow.studies.operating_region import OperatingRegion
from flipflow.studies.start_sentence import does_it_start

NO_NORMAL = (
    "Orbits are not drawn: isolation.normal_stiffness or isolation.normal_damping is missing in "
    "the machine file."
)
# What an A4 page has room for beside all that stands there always: rows of load cases, a line of
# a note being as high as so many rows; lines of notes when the table of load cases is overleaf.
MOST_ROWS, NOTE_ROWS, NOTE_LINES, LINE_LENGTH = 4, 1.5, 4, 118
# Lines beyond which what the surroundings bear goes overleaf, too.
MOST_LINES = 5
# Letters that fit one line: the title, cells of its block (by column, less those of the label),
# the verdict, the name of a load case in the table of limits.
TITLE_LETTERS, CELL_LETTERS, VERDICT_LETTERS, CASE_LETTERS = 48, (31, 31, 42), 98, 34
MOST_NAMED = 4
OVERLEAF, OVERLEAF_TITLE = 'under "Load cases and notes" on the next page', "Load cases and notes"
CASE_COLUMNS = (
    ("relative_amplitude", "amplitude"),
    ("stroke", "stroke"),
    ("relative_phase", "phase"),
    ("main_frame_acceleration", "main frame"),
    ("floating_frame_acceleration", "floating frame"),
    ("stop_force", "stop force"),
)


@section(Assessment, Part.FIRST_PAGE, 10)
def title_block(assessment: Assessment) -> Iterator[Block]:
    """Name, project, customer, drawing, and who signs."""
    yield _title_block(assessment)


def _title_block(assessment: Assessment) -> TitleBlock:
    document, omega = assessment.project.document, assessment.omega
    return TitleBlock(
        document.name or assessment.project.name,
        (
            ("Project", document.project),
            ("Customer", document.customer),
            ("Drawing", document.drawing),
            ("Revision", document.revision),
            ("Prepared by", document.prepared_by),
            ("Checked by", document.checked_by),
            ("Date", ""),
            ("Signature", ""),
            ("Speed", speed(omega) if omega is not None else "not given"),
        ),
    )


@section(Assessment, Part.FIRST_PAGE, 20, brief=True)
def verdict(assessment: Assessment) -> Iterator[Block]:
    """The verdict, and what it rests on."""
    yield Verdict(assessment.verdict, assessment.state)
    yield Text(allowed_range(assessment.region), "Allowed speed range:")
    for lead, text in (
        ("Contact begins:", contact_sentence(assessment.region)),
        ("Stop:", stop_sentence(assessment)),
    ):
        if text:
            yield Text(text, lead)
    yield Text(does_it_start(assessment.transients), "Does it start:")
    yield from (Note(note) for note in assessment.notes[: notes_that_fit(assessment)])


@section(Assessment, Part.FIRST_PAGE, 25)
def further_notes(assessment: Assessment) -> Iterator[Block]:
    """Where the other notes are."""
    shown = notes_that_fit(assessment)
    left = len(assessment.notes) - shown
    if left:
        more = f"{left} more" if shown else str(left)
        yield Note(f"{more} {'note stands' if left == 1 else 'notes stand'} {OVERLEAF}.")


@section(Assessment, Part.FIRST_PAGE, 30)
def amplitude(assessment: Assessment) -> Iterator[Block]:
    """Amplitude over rpm with the band of load cases."""
    yield FigureBlock(cases_figure(assessment))


@section(Assessment, Part.FIRST_PAGE, 40)
def motions(assessment: Assessment) -> Iterator[Block]:
    """Orbits at true scale, and two turns of relative motion."""
    figure = motions_figure(assessment)
    if figure is not None:
        yield FigureBlock(figure)
        if not any(case.normal for case in assessment.cases):
            yield Note(NO_NORMAL)
    elif assessment.omega is not None:
        yield Note("No motion was found at the working speed, so none is drawn.")


@section(Assessment, Part.FIRST_PAGE, 50, brief=True)
def limits(assessment: Assessment) -> Iterator[Block]:
    """Every limit with its worst case."""
    columns = (
        Column("Limit"),
        Column("Allowed", ends=True),
        Column("Worst", numeric=True),
        Column("Case"),
        Column("Margin", numeric=True),
        Column("State"),
    )
    caption = (
        "Worst value over all load cases; of start and stop the tightest limit each. Margin: "
        "distance from the limit as a share of it. Attention: met by less than 5 %."
    )
    passing = tightest_on_the_way(assessment)
    rows = tuple(limit_cells(row) for row in (*assessment.limits_table, *passing))
    yield Table("", columns, rows, caption)


def tightest_on_the_way(assessment: Assessment) -> Iterator[LimitRow]:
    """Of the limits on the start, and of those on the stop, the one that leaves least."""
    for passage in PASSAGES:
        rows = [
            row
            for row in assessment.passing_table
            if row.margin is not None and row.name.startswith(f"limits.{passage}.")
        ]
        if rows:
            yield min(rows, key=lambda row: row.margin or 0.0)


@section(Assessment, Part.FIRST_PAGE, 60, brief=True)
def cases(assessment: Assessment) -> Iterator[Block]:
    """Load cases by amplitude, stroke, phase, g of both frames, stop force, if they fit."""
    if assessment.omega is not None and not crowded(assessment):
        yield _cases_table(assessment)


@section(Assessment, Part.FIRST_PAGE, 65)
def further_cases(assessment: Assessment) -> Iterator[Block]:
    """Where the table of load cases is."""
    if assessment.omega is not None and crowded(assessment):
        yield Text(f"{len(assessment.cases)}, in the table {OVERLEAF}.", "Load cases:")


@section(Assessment, Part.DETAILS, 5, brief=True)
def overleaf(assessment: Assessment) -> Iterator[Block]:
    """What the first page has no room for: the table of many load cases, further notes."""
    notes = assessment.notes[notes_that_fit(assessment) :]
    table = assessment.omega is not None and crowded(assessment)
    if table:
        yield _cases_table(assessment)
    yield from (Note(note) for note in notes)


def _cases_table(assessment: Assessment) -> Table:
    columns = [Column("Load case")]
    for name, title in CASE_COLUMNS:
        columns.append(Column(title, QUANTITIES[name].shown_unit, numeric=True))
    caption = (
        "Relative motion: amplitude (|x2|), stroke (twice that), phase to the unbalance force "
        "(negative: it lags). Frames: greatest acceleration in any direction."
    )
    rows = tuple(_case_row(case) for case in assessment.cases)
    return Table("", tuple(columns), rows, caption)


@section(Assessment, Part.FIRST_PAGE, 70)
def surroundings(assessment: Assessment) -> Iterator[Block]:
    """What goes into the ground; a line each on springs, exciter and bearings, if they fit."""
    if assessment.omega is None:
        return
    loads = assessment.foundation
    yield Values((("Into the ground", "not known" if loads is None else loads.sentence),))
    if not packed(assessment):
        yield _surroundings(assessment)


@section(Assessment, Part.DETAILS, 6)
def further_surroundings(assessment: Assessment) -> Iterator[Block]:
    """Springs, exciter and bearings where the first page has no room for them."""
    if assessment.omega is not None and packed(assessment):
        yield _surroundings(assessment)


def _surroundings(assessment: Assessment) -> Values:
    screen = assessment.project.screen
    bearing = "bearing_force" if QUANTITIES["bearing_load"].missing(screen) else "bearing_load"
    return Values(
        (
            ("Springs", _springs(assessment)),
            ("Exciter, bearings", _line(assessment, "exciter_force", bearing)),
            ("Power, throw", _power_and_throw(assessment)),
        )
    )


def crowded(assessment: Assessment) -> bool:
    """Whether the table of load cases goes overleaf, for the first page shall be one page."""
    lines = sum(map(_note_lines, assessment.notes)) + _other_lines(assessment)
    return len(assessment.cases) + NOTE_ROWS * lines > MOST_ROWS


def packed(assessment: Assessment) -> bool:
    """Whether what foundation and springs bear goes overleaf, too."""
    shown = assessment.notes[: notes_that_fit(assessment)]
    return sum(map(_note_lines, shown)) + _other_lines(assessment) > MOST_LINES


def notes_that_fit(assessment: Assessment) -> int:
    """How many notes the first page has room for; where not all fit, a line says so."""
    room = NOTE_LINES - _other_lines(assessment)
    ends = list(itertools.accumulate(_note_lines(note) for note in assessment.notes))
    return len(ends) if not ends or ends[-1] <= room else sum(end < room for end in ends)


def _other_lines(assessment: Assessment) -> int:
    """Lines of the first page that not every machine needs."""
    names = ["band of load cases", *case_names([case.name for case in assessment.cases])]
    return (
        max(legend_lines(list(dict.fromkeys(names))) - LEGEND_WITHIN, 0)
        + bool(contact_sentence(assessment.region))
        + (not any(case.normal for case in assessment.cases))
        + _note_lines(f"Does it start: {does_it_start(assessment.transients)}")
        - 1
        + _title_lines(_title_block(assessment))
        + _wrapped(assessment.verdict, VERDICT_LETTERS)
        + _wrapped(stop_sentence(assessment), LINE_LENGTH)
        + sum(_wrapped(row.case, CASE_LETTERS) for row in assessment.limits_table)
    )


def _title_lines(block: TitleBlock) -> int:
    """Lines of the title and its block beyond one a row; a line of the title is two high."""
    lines = 2 * _wrapped(block.title, TITLE_LETTERS)
    columns = len(CELL_LETTERS)
    for row in (block.rows[k : k + columns] for k in range(0, len(block.rows), columns)):
        lines += max(
            _wrapped(text, room - len(label))
            for (label, text), room in zip(row, CELL_LETTERS, strict=False)
        )
    return lines


def _wrapped(text: str, letters: int) -> int:
    """Lines beyond the first."""
    return max(len(textwrap.wrap(text, letters)) - 1, 0)


def _note_lines(note: str) -> int:
    return math.ceil(len(note) / LINE_LENGTH)


def contact_sentence(region: OperatingRegion) -> str:
    """Where each side is first touched, where the gaps differ; empty where they do not."""
    speeds = region.contact_speeds
    if region.branch.system.symmetric or not speeds:
        return ""
    gaps = region.screen.stop().gaps
    sides = [
        f"{word} side {_touched(speeds.get(side), gap)}"
        for side, word, gap in ((1, "plus", gaps[0]), (-1, "minus", gaps[1]))
        if math.isfinite(gap)
    ]
    if len(sides) == 1:
        return f"{sides[0]} (empty); the other side has no stop."
    return f"{', '.join(sides)} (empty); w_cs is the last of them."


def _touched(speed: float | None, gap: float) -> str:
    """Where a side is first touched, in words."""
    word = contact(speed, gap)
    return {NOTHING: "not touched before", AT_REST: AT_REST}.get(word, f"at {word} rpm")


def stop_sentence(assessment: Assessment) -> str:
    """Whether the stops are reached, case by case."""
    if assessment.omega is None:
        return ""
    if not assessment.project.screen.has_stop:
        return "the machine has none."
    if any(case.orbit is None for case in assessment.cases):
        return "not known, for no motion was found at working speed in every case."
    return _reached(assessment.omega, assessment.cases)


def _reached(omega: float, cases: tuple[CaseAssessment, ...]) -> str:
    free = [case.name for case in cases if case.orbit and not case.stop_reached]
    if not free:
        return "reached in every load case."
    if len(free) == len(cases):
        return f"not reached in any load case at {rpm(omega)} rpm."
    if len(free) > MOST_NAMED:
        return f"not reached in {len(free)} of {len(cases)} load cases."
    return f"not reached in {'; '.join(free)}; reached in the other cases."


def limit_cells(row: LimitRow) -> tuple[Cell, ...]:
    """A limit, what it allows, the worst value with its load case, the margin and the state."""
    allowed = bounds(*row.limit, row.shown_unit, row.unit)
    worst = quantity(row.worst, row.shown_unit, row.unit)
    if row.name == "speed" and row.worst is not None:
        worst = in_rpm(row.worst, with_unit=True)
    if row.name == "jump_margin":
        worst = named(QUANTITIES[row.name], row.worst)
    case = row.reason if row.worst is None else row.case
    if row.name == "speed" and row.worst is not None:
        case = "all"
    return (
        Cell(capitalized(row.label)),
        Cell(allowed),
        Cell(worst),
        Cell(case),
        Cell(percent(row.margin)),
        Cell(row.state, state=row.state),
    )


def _case_row(case: CaseAssessment) -> tuple[Cell, ...]:
    if case.orbit is None:
        return (Cell(case.name, "no motion found"), *(Cell(NOTHING) for _ in CASE_COLUMNS))
    word = "" if case.orbit.stable else f"the motion {RETURNS[case.orbit.stability]}"
    row = [Cell(case.name, word)]
    for name, _ in CASE_COLUMNS:
        text = named(QUANTITIES[name], case.values.get(name), with_unit=False)
        if name == "stop_force" and not case.stop_reached:
            text = "not reached" if case.screen.has_stop else "no stop"
        row.append(Cell(text))
    return tuple(row)


def _line(assessment: Assessment, *names: str, lowest: bool = False) -> str:
    """Quantities in the case in which the last of them that is known is worst."""
    first = names[0]
    found = [worst_of(assessment.cases, name, lowest=lowest) for name in names]
    worst = next(filter(None, reversed(found)), None)
    if worst is None:
        screen = assessment.project.screen
        missing = QUANTITIES[first].missing(screen)
        return f"not checked, {missing_words(missing)}" if missing else "not checked"
    _, case = worst
    if first == "stop_force" and not case.stop_reached:
        return "stop not reached" if case.screen.has_stop else "no stops fitted"
    parts = [
        f"{QUANTITIES[name].label} {named(QUANTITIES[name], case.values[name])}"
        for name in names
        if case.values.get(name) is not None
    ]
    where = f" ({case_words(case.name)})" if len(assessment.cases) > 1 else ""
    return f"{', '.join(parts)}{where}"


def _springs(assessment: Assessment) -> str:
    shear, stop = _line(assessment, "shear_piece_force"), _line(assessment, "stop_force")
    return f"{shear}; {stop}"


def _power_and_throw(assessment: Assessment) -> str:
    power = _line(assessment, "dissipated_power")
    throw = _line(assessment, "throw_number", lowest=True)
    # Where both lack the same data they are named once.
    return throw if throw.startswith(power) else f"{power}; {throw}"
