"""What a comparison of machines becomes in a report and in the terminal."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from flipflow.io.units import in_unit, shown
from flipflow.model.numerals import capitalized, case_words, rpm
from flipflow.model.quantities import QUANTITIES
from flipflow.plotting.compare import comparison_figure
from flipflow.report.blocks import (
    Block,
    Cell,
    Column,
    FigureBlock,
    Heading,
    Note,
    Table,
    Text,
    TitleBlock,
    Verdict,
    cells,
)
from flipflow.report.numbers import (
    NO_JUMP,
    NOTHING,
    Numeral,
    in_rpm,
    percent,
    quantity,
    signed,
    three_digits,
)
from flipflow.report.registry import Part, section
from flipflow.studies.allowed_range import allowed_range
from flipflow.studies.assessment import Assessment
from flipflow.studies.compare import (
    EMPTY,
    Comparison,
    Given,
    InputDifference,
    ResultChange,
    letter,
)

MARGIN, JUMP = "margin of ", "jump_margin"
ONE_NAME = 24  # letters of a name that the head of a column has room for
BRIEF = ("relative_amplitude", "start_speed")  # beside margins and speeds, what the terminal shows


@section(Comparison, Part.FIRST_PAGE, 10)
def title(found: Comparison) -> Iterator[Block]:
    """Which machines."""
    rows = tuple(
        (letter(k), _described(name, one))
        for k, (name, one) in enumerate(zip(found.names, found.assessments, strict=True))
    )
    yield TitleBlock(" and ".join(found.names) if len(rows) == 2 else f"{len(rows)} machines", rows)


@section(Comparison, Part.FIRST_PAGE, 20, brief=True)
def verdicts(found: Comparison) -> Iterator[Block]:
    """Each machine's verdict and allowed range."""
    for k, (name, one) in enumerate(zip(found.names, found.assessments, strict=True)):
        yield Verdict(f"{letter(k)}, {name}: {one.verdict}", one.state)
        yield Text(allowed_range(one.region), "Allowed speed range:")


@section(Comparison, Part.FIRST_PAGE, 30, brief=True)
def inputs(found: Comparison) -> Iterator[Block]:
    """The inputs that differ."""
    if not found.inputs:
        yield Note("No input differs.")
        return
    columns = (Column("Input that differs"), *_machine_columns(found))
    rows = tuple(
        cells(one.key, *(_given(one, value) for value in one.values)) for one in found.inputs
    )
    yield Table("Inputs", columns, rows)


@section(Comparison, Part.FIRST_PAGE, 40)
def responses(found: Comparison) -> Iterator[Block]:
    """The responses laid over."""
    yield FigureBlock(comparison_figure(found))


@section(Comparison, Part.DETAILS, 10, brief=True)
def main_changes(found: Comparison) -> Iterator[Block]:
    """Speeds, amplitude and margins that change, one table for each machine after the first."""
    if not any(row.changes for row in found.results):
        yield Note("No result changes.")
        return
    yield Heading("What changes", 1, new_page=False)
    for k in range(1, len(found.names)):
        rows = [row for row in found.results if _is_main(row) and _changes_in(row, k)]
        if rows:
            yield _changes(found, k, rows, f"{letter(k)} against {letter(0)}")


@section(Comparison, Part.APPENDIX, 10)
def every_result(found: Comparison) -> Iterator[Block]:
    """Every result, whether it changes or not."""
    yield Heading("Every result", 1)
    for case in dict.fromkeys(row.case for row in found.results):
        rows = [row for row in found.results if row.case == case]
        for k in range(1, len(found.names)):
            yield _changes(found, k, rows, f"{_headed(case)}, {letter(k)} against {letter(0)}")


def _described(name: str, one: Assessment) -> str:
    revision = one.project.document.revision
    speed = "no speed" if one.omega is None else f"{rpm(one.omega)} rpm"
    return f"{name}, {f'revision {revision}, ' if revision else ''}{speed}, input {one.input_hash}"


def _headed(case: str) -> str:
    return "Empty machine" if case == EMPTY else case_words(case, capital=True)


def _machine_columns(found: Comparison) -> tuple[Column, ...]:
    return tuple(
        Column(letter(k), name if len(name) <= ONE_NAME else "", numeric=True)
        for k, name in enumerate(found.names)
    )


def _changes_in(row: ResultChange, k: int) -> bool:
    """Whether a machine differs from the first, whatever others do."""
    return replace(row, values=(row.values[0], row.values[k])).changes


def _is_main(row: ResultChange) -> bool:
    return row.case == EMPTY or row.name.startswith(MARGIN) or row.name in BRIEF


def _changes(found: Comparison, k: int, rows: Sequence[ResultChange], title_: str) -> Table:
    columns = (
        Column("Result"), Column("Case"), Column(letter(0), numeric=True),
        Column(letter(k), numeric=True), Column(f"{letter(k)} - {letter(0)}", numeric=True),
    )  # fmt: skip
    shown_rows = tuple(
        cells(
            _headline(row), row.case, _value(row, row.values[0]), _value(row, row.values[k]),
            _change(row, k),
        )
        for row in rows
    )  # fmt: skip
    names = f"{letter(0)}: {found.names[0]}; {letter(k)}: {found.names[k]}."
    return Table(title_, columns, shown_rows, names)


def _headline(row: ResultChange) -> str:
    return capitalized(row.label)


def _value(row: ResultChange, value: float | None) -> str:
    if value is None:
        return NOTHING
    if row.name.endswith(JUMP) and math.isinf(value):
        return NO_JUMP
    if row.name.startswith(MARGIN):
        return "no end" if math.isinf(value) else percent(value)
    if row.shown_unit == "rpm":
        return in_rpm(value, with_unit=True)
    return quantity(value, row.shown_unit, row.unit)


def _change(row: ResultChange, k: int) -> str:
    change = row.change(k)
    if change is None or math.isnan(change):
        return NOTHING
    if not row.changes or change == 0.0:
        return three_digits(0.0)
    if math.isinf(change):
        return NOTHING if row.name.endswith(JUMP) else f"{'+' if change > 0.0 else '-'}infinite"
    if row.name.startswith(MARGIN):
        return percent(change)
    unit = row.shown_unit
    zero = in_unit(0.0, unit, row.unit)  # a difference of temperatures has no offset
    difference = in_unit(change, unit, row.unit) - zero
    return Numeral(f"{signed(difference)} {unit}".strip(), difference, unit=unit)


def _given(one: InputDifference, value: Given) -> str:
    if value is None:
        return "not given"
    if isinstance(value, str):
        return value
    if math.isinf(value):
        return "infinite"
    text, unit = shown(value, one.shown_unit, one.unit), one.shown_unit
    return Numeral(text, in_unit(value, unit, one.unit), unit=unit)


def summary_table(names: Sequence[str], found: Sequence[Assessment]) -> Table:
    """One row a machine: verdict, speed, what binds, allowed range."""
    columns = (
        Column("Machine"), Column("Verdict"), Column("Speed", "rpm", numeric=True),
        Column("Allowed", "rpm"), Column("Tightest limit"), Column("Margin", numeric=True),
    )  # fmt: skip
    rows = tuple(_summary_row(name, one) for name, one in zip(names, found, strict=True))
    return Table("Summary", columns, rows)


def _summary_row(name: str, one: Assessment) -> tuple[Cell, ...]:
    allowed = "; ".join(f"{rpm(low)} to {rpm(high)}" for low, high in one.region.feasible)
    judged = [row for row in one.limits_table if row.margin is not None]
    tightest = min(judged, key=lambda row: row.margin or 0.0, default=None)
    label, case, margin = NOTHING, "", NOTHING
    if tightest is not None:
        label, margin = QUANTITIES[tightest.name].label, percent(tightest.margin)
        case = "" if tightest.name == "speed" else case_words(tightest.case)
    return (
        Cell(name), Cell(one.state, state=one.state), Cell(in_rpm(one.omega)),
        Cell(allowed or "none"),
        Cell(label, case), Cell(margin),
    )  # fmt: skip
