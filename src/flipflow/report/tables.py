"""The tables of a report for other programs: the same blocks, numbers with their unit."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.io.spreadsheet import Sheet, Value, csv_text, xlsx
from flipflow.io.units import in_unit
from flipflow.model.numerals import capitalized
from flipflow.model.quantities import QUANTITIES
from flipflow.report.blocks import Block, Table, TitleBlock, Values, Verdict
from flipflow.report.html import Head, head_of
from flipflow.report.numbers import NOTHING, Numeral
from flipflow.report.registry import blocks_of
from flipflow.studies.assessment import Assessment, CaseAssessment
from flipflow.studies.quantity_values import Working, number_or_nan

BOOK, PREFIX = "tables.xlsx", "table-"
UNIT, REMARK = "Unit", "remark"
DIGITS = 12  # more would show the rounding of a change of units
RESPONSE = "Response over speed"
# What the response lists beside speed, in the units of the machine file.
LISTED = (
    "main_amplitude", "floating_amplitude", "relative_amplitude", "relative_phase",
    "main_frame_acceleration", "floating_frame_acceleration", "stop_force", "foundation_force",
    "exciter_force",
)  # fmt: skip


def table_files(
    assessment: Assessment, blocks: Sequence[Block] | None = None
) -> dict[str, bytes | str]:
    """All tables of a report, and the response, by the name of the file: one XLSX, and CSV.

    ``blocks`` are those of the assessment, where they are made.

    Raises
    ------
    MissingExtra
        When openpyxl is not installed.
    """
    blocks = blocks_of(assessment) if blocks is None else blocks
    tables = (_sheet(block) for block in blocks if isinstance(block, Table))
    sheets = [_report_sheet(head_of(assessment), blocks), *tables, response_sheet(assessment)]
    files: dict[str, bytes | str] = {BOOK: xlsx(sheets)}
    for sheet in sheets:
        name = _file_name(sheet.name, files)
        files[name] = csv_text(sheet.head, sheet.rows)
    return files


def response_sheet(assessment: Assessment) -> Sheet:
    """Every motion of every case's branch: speed, amplitudes, phase, g, forces."""
    head = ["Load case", "Speed [rpm]", "Speed [Hz]", "Returns after a disturbance"]
    for name in LISTED:
        one = QUANTITIES[name]
        head.append(f"{capitalized(one.label)} [{one.shown_unit}]")
    rows = [row for case in assessment.cases for row in _response_rows(case)]
    return Sheet(RESPONSE, tuple(head), tuple(rows))


def _response_rows(case: CaseAssessment) -> Iterator[tuple[Value, ...]]:
    branch = case.branch
    columns = [branch.omega * in_unit(1.0, "rpm", "rad/s"), branch.omega / (2.0 * np.pi)]
    for name, values in zip(LISTED, _listed(case), strict=True):
        one = QUANTITIES[name]
        columns.append(values * in_unit(1.0, one.shown_unit, one.unit))
    for k, word in enumerate(branch.stability):
        speed, hertz, *others = (float(column[k]) for column in columns)
        yield (case.name, speed, hertz, str(word), *others)


def _listed(case: CaseAssessment) -> Real:
    """What is listed, of every motion of a branch, in SI, (L, n); NaN where data are missing."""
    branch = case.branch
    jumps = tuple(fold.omega for fold in branch.folds)
    motions = (Working(case.screen, branch.orbit(i), jumps) for i in range(branch.omega.size))
    rows = [[number_or_nan(motion.value(name)) for name in LISTED] for motion in motions]
    return np.array(rows).reshape(-1, len(LISTED)).T


def _report_sheet(head: Head, blocks: Sequence[Block]) -> Sheet:
    """What the report is of, and what it says in words beside a label."""
    rows: list[tuple[Value, ...]] = [("Report", head["kind"]), ("Made by", head["footer"])]
    for block in blocks:
        if isinstance(block, TitleBlock):
            rows += [("Machine", block.title), *block.rows]
        elif isinstance(block, Verdict):
            rows += [("Verdict", block.text), ("State", block.state)]
        elif isinstance(block, Values):
            rows += block.rows
    return Sheet("Report", ("What", "Text"), tuple(rows))


def _sheet(table: Table) -> Sheet:
    """A table with the numbers that its cells show; their units stand in its head, or beside."""
    every = [one for k in range(len(table.columns)) for one in _columns(table, k)]
    mixed = [one for one in every if one.mixed]
    units = _row_units(mixed, len(table.rows))
    head: list[str] = []
    columns: list[list[Value]] = []
    for one in every:
        if mixed and one is mixed[0]:
            head.append(UNIT)
            columns.append([unit or None for unit in units])
        head.append(f"{one.title} [{one.unit}]" if one.unit else one.title)
        columns.append(one.values(units if one.mixed else [one.unit] * len(units)))
    rows = tuple(zip(*columns, strict=True))
    return Sheet(table.title or table.columns[0].title, tuple(head), rows)


class _Column:
    """One column: of each cell its number and unit, or its text."""

    def __init__(self, title: str, unit: str, cells: Sequence[tuple[Value, str]]) -> None:
        self.title, self.cells = title, cells
        found = {own for _, own in cells if own}
        self.mixed = not unit and len(found) > 1
        self.unit = unit or (found.pop() if len(found) == 1 else "")

    def values(self, units: Sequence[str]) -> list[Value]:
        """What stands in each row; with its own unit where that is another than the row's."""
        return [
            value if own in ("", unit) else f"{value} {own}"
            for (value, own), unit in zip(self.cells, units, strict=True)
        ]


def _columns(table: Table, k: int) -> list[_Column]:
    """The columns that a column of a report becomes."""
    column, cells = table.columns[k], [row[k] for row in table.rows]
    words = ("least", "most") if column.ends else ("",)
    found = [
        _Column(f"{column.title}, {word}" if word else column.title, column.unit,
                [_measure(cell.text, end, len(words)) for cell in cells])
        for end, word in enumerate(words)
    ]  # fmt: skip
    if any(cell.small for cell in cells):
        title = f"{column.title}, {REMARK}"
        found.append(_Column(title, "", [(cell.small or None, "") for cell in cells]))
    return found


def _measure(text: str, end: int, ends: int) -> tuple[Value, str]:
    """The number that a cell shows, of a range one of its ends, and its unit; else its text."""
    if isinstance(text, Numeral) and len(text.numbers) <= ends:
        number = text.numbers[min(end, len(text.numbers) - 1)]
        if number is None:
            return None, ""
        return number if isinstance(number, int) else float(f"{number:.{DIGITS}g}"), text.unit
    return (None if text == NOTHING or end else str(text)), ""


def _row_units(columns: Sequence[_Column], rows: int) -> list[str]:
    """The unit of each row, over the columns whose unit differs from row to row."""
    units = [{column.cells[k][1] for column in columns} - {""} for k in range(rows)]
    return [min(own, default="") for own in units]


def _file_name(sheet: str, taken: dict[str, bytes | str]) -> str:
    """A name of a CSV file that no other has."""
    words = re.sub(r"[^a-z0-9]+", "-", sheet.lower()).strip("-") or "table"
    name, count = f"{PREFIX}{words}.csv", 1
    while name in taken:
        count += 1
        name = f"{PREFIX}{words}-{count}.csv"
    return name
