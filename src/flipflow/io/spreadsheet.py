"""Tables for other programs as XLSX and CSV: numbers as numbers, no formula from a user's text."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from flipflow.errors import required

Value = float | int | str | None
# A text that begins so is taken for a formula by programs that open a CSV file.
FORMULA = ("=", "+", "-", "@", "\t", "\r")
NOT_IN_XML = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")
NOT_IN_NAMES = re.compile(r"[\[\]:*?/\\]")
LONGEST_NAME, LONGEST_TEXT = 31, 32767  # characters, by the format
WIDEST, NARROWEST = 60, 9


@dataclass(frozen=True)
class Sheet:
    """A table: its name, a head with units in brackets, rows of numbers, texts, and nothing."""

    name: str
    head: tuple[str, ...]
    rows: tuple[tuple[Value, ...], ...]


def xlsx(sheets: Sequence[Sheet]) -> bytes:
    """Tables as one XLSX file, a sheet each.

    Raises
    ------
    MissingExtra
        When openpyxl is not installed.
    """
    require_openpyxl()
    from openpyxl import Workbook  # noqa: PLC0415  an extra
    from openpyxl.styles import Alignment, Font  # noqa: PLC0415

    book = Workbook()
    book.remove(book.worksheets[0])
    taken: set[str] = set()
    for sheet in sheets:
        page = book.create_sheet(_name(sheet.name, taken))
        for row in (sheet.head, *sheet.rows):
            page.append([None] * len(row))
        for line, row in enumerate((sheet.head, *sheet.rows), 1):
            for column, value in enumerate(row, 1):
                if isinstance(value, str):
                    cell = page.cell(line, column)
                    cell.value = NOT_IN_XML.sub(" ", value)[:LONGEST_TEXT]
                    cell.data_type = "s"
                    cell.quotePrefix = value.startswith(FORMULA)
                elif _is_number(value):
                    page.cell(line, column).value = value
        for cell in page[1]:
            cell.font = Font(bold=True)
            cell.alignment = Alignment(wrap_text=True, vertical="bottom")
        page.freeze_panes = "A2"
        for column, width in enumerate(_widths(sheet)):
            page.column_dimensions[page.cell(1, column + 1).column_letter].width = width
    content = io.BytesIO()
    book.save(content)
    return content.getvalue()


def csv_text(head: Iterable[str], rows: Iterable[Iterable[Value]]) -> str:
    """A table as CSV; numbers with all their digits."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([neutral(title) for title in head])
    writer.writerows([_csv_cell(value) for value in row] for row in rows)
    return text.getvalue()


def neutral(text: str) -> str:
    """A text that no program takes for a formula: an apostrophe before what begins like one."""
    return f"'{text}" if text.startswith(FORMULA) else text


def require_openpyxl() -> None:
    """See that XLSX can be written; called before long work.

    Raises
    ------
    MissingExtra
        When openpyxl is not installed.
    """
    required("openpyxl", "Tables need openpyxl", "report")


def _csv_cell(value: Value) -> Value:
    if isinstance(value, str):
        return neutral(value)
    return "" if value is None or value != value else value  # noqa: PLR0124  not a number


def _is_number(value: Value) -> bool:
    return isinstance(value, (int, float)) and math.isfinite(value)


def _name(wanted: str, taken: set[str]) -> str:
    """A name of a sheet that the format allows and no other sheet has."""
    clean = NOT_IN_NAMES.sub(" ", NOT_IN_XML.sub(" ", wanted)).strip("' ") or "Table"
    name, count = clean[:LONGEST_NAME], 1
    while name.lower() in taken:
        count += 1
        end = f" ({count})"
        name = clean[: LONGEST_NAME - len(end)] + end
    taken.add(name.lower())
    return name


def _widths(sheet: Sheet) -> list[int]:
    """Widths of columns in characters, by the first rows."""
    rows = (sheet.head, *sheet.rows[:50])
    longest = [max(len(_brief(row[k])) for row in rows) for k in range(len(sheet.head))]
    return [min(max(width + 2, NARROWEST), WIDEST) for width in longest]


def _brief(value: Value) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value or "")
