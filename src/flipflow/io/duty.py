"""Duty files: what a machine is to do, what may be chosen for it, and from which catalogue."""

from __future__ import annotations

import csv
import difflib
import math
import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from flipflow.errors import InputError, required
from flipflow.io.layout import SPEED, refuse_unknown
from flipflow.io.load_cases import read_load_cases
from flipflow.io.project import read_limits
from flipflow.io.study_file import IN_FILE as RANGES
from flipflow.io.study_file import (
    chosen_cases,
    field_of,
    flat_keys,
    read_with_machine,
    section_of,
    varied_field,
    whole_number,
)
from flipflow.io.units import parse_quantity
from flipflow.io.values import LEFT_OUT, Notes, Table, read_number
from flipflow.io.vary import EACH, PLUS_MINUS
from flipflow.model.duty import OBJECTIVES, Duty, SpringType
from flipflow.model.fields import FIELD
from flipflow.model.limits import LIMIT_FIELDS, Limits
from flipflow.model.project import Project
from flipflow.model.vary import Choice, Normal

SECTIONS = (
    "format", "machine", "duty", "free", "scatter", "limits", "load_cases", "catalogue",
)  # fmt: skip
DUTY = (
    "relative_amplitude", "tolerance", "speed", "temperatures", "load_cases", "prefer", "seed",
)  # fmt: skip
CATALOGUE = ("file", "pieces")
CHOICES = "choices"
CHOSEN = 'write for example "2 mm..9 mm", "+-5 %" or { choices = ["4 mm", "6 mm"] }'
# Where an argument of a duty stands in the file.
IN_FILE: Mapping[str, tuple[str, str]] = {
    "target": ("duty", "relative_amplitude"),
    **{key: ("duty", key) for key in ("tolerance", "speed", "temperatures", "prefer")},
    "pieces": ("catalogue", "pieces"),
}
# Sections of fields, by the word before a field that a duty refuses.
OF_FIELDS: Mapping[str, str] = {"vary": "free", "free": "free", "scatter": "scatter"}
# Columns of a catalogue: unit in SI, and whether it must be there.
COLUMNS: Mapping[str, tuple[str, bool]] = {
    "stiffness": ("N/m", True),
    "loss_factor": ("", True),
    "height": ("m", False),
    "strain": ("", False),
    "force": ("N", False),
    "price": ("", False),
}


def load_duty(path: str | os.PathLike[str], *, force: bool = False) -> Duty:
    """Load a duty file and the machine file that it names.

    Parameters
    ----------
    path
        Path of a ``.toml`` file.
    force
        Let values of the machine through that look like a slip of units.

    Returns
    -------
    Duty
        What it asks, in SI.

    Raises
    ------
    InputError
        For a file that cannot be read, and a value in it that is wrong or missing.
    """
    source, project = read_with_machine(path, "duty", SECTIONS, force=force)
    tables = source.tables
    table = section_of(tables, "duty")
    refuse_unknown(table, DUTY, place="duty.")
    springs, pieces = _catalogue(section_of(tables, "catalogue"), source.path)
    values: dict[str, Any] = {
        "project": project,
        "target": _quantity(table, "relative_amplitude", unit="m", example="7 mm"),
        "tolerance": _quantity(table, "tolerance", unit="m", example="0.5 mm"),
        "speed": _speed(table, project),
        "free": _free(section_of(tables, "free"), project),
        "load_cases": _load_cases(tables, table, project),
        "temperatures": _temperatures(table),
        "scatter": _scatter(section_of(tables, "scatter")),
        "limits": _limits(tables, project),
        "catalogue": springs,
        "pieces": pieces,
        "prefer": _prefer(table),
        "seed": whole_number(table.get("seed", 0), "duty.seed", 0, 2**31 - 1),
        "name": source.name,
    }
    try:
        return Duty(**values)
    except InputError as error:
        raise _as_in_file(error, tables) from None


def _as_in_file(error: InputError, tables: Table) -> InputError:
    """What a duty refuses, by its place in the file and as it is written there, not in SI."""
    section, _, name = error.field.partition(" ")
    if section in OF_FIELDS and name in FIELD:
        section = OF_FIELDS[section]
        words = (name, FIELD[name].key, FIELD[name].key.rpartition(".")[2])
        for key, written in flat_keys(section_of(tables, section)).items():
            if key.removesuffix(f".{CHOICES}").removesuffix(EACH) in words:
                return InputError(f"{section}.{key}", written, error.remedy)
    if error.field not in IN_FILE:
        return error
    section, key = IN_FILE[error.field]
    given = section_of(tables, section).get(key, error.value)
    one = isinstance(given, list) and error.value in given  # a word of a list
    return InputError(f"{section}.{key}", error.value if one else given, error.remedy)


def _quantity(table: Table, key: str, *, unit: str, example: str) -> float:
    written = table.get(key, LEFT_OUT)
    return parse_quantity(written, unit, field=f"duty.{key}", example=example)


def _speed(table: Table, project: Project) -> tuple[float, float]:
    """One speed twice, or (least, greatest); that of the machine's file where none is given."""
    written = table.get("speed", LEFT_OUT)
    if written is LEFT_OUT and project.speed is not None:
        return project.speed, project.speed
    ends = written if isinstance(written, list) else [written, written]
    if len(ends) != 2:
        raise InputError("duty.speed", written, 'give "800 rpm", or ["780 rpm", "820 rpm"]')
    low, high = (read_number(one, SPEED, label="duty.speed") for one in ends)
    return low, high


def _free(table: Mapping[str, Any], project: Project) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, written in flat_keys(table).items():
        name, last = key.rpartition(".")[::2]
        if last == CHOICES:
            (field, values) = next(iter(_varied(name, written, project).items()))
            found[field] = Choice(tuple(float(one) for one in values))
        else:
            found |= _varied(key, written, project)
    return found


def _varied(key: str, written: object, project: Project) -> dict[str, Any]:
    """A field that may be chosen and its values; what a study draws at random is no choice."""
    try:
        found = varied_field(key, written, project, "free")
    except InputError as error:
        remedy = CHOSEN if error.remedy == RANGES else error.remedy
        raise InputError(error.field, error.value, remedy) from None
    if any(isinstance(one, Normal) for one in found.values()):
        raise InputError(f"free.{key}", written, CHOSEN)
    return found


def _scatter(table: Mapping[str, Any]) -> dict[str, float]:
    found = {}
    for key, written in flat_keys(table).items():
        label = f"scatter.{key}"
        name = field_of(key, label, written)
        share = written.strip().removeprefix(PLUS_MINUS) if isinstance(written, str) else written
        found[name] = parse_quantity(share, "", field=label, example="15 %")
    return found


def _temperatures(table: Table) -> tuple[float, ...]:
    written = table.get("temperatures", [])
    if not isinstance(written, list):
        raise InputError("duty.temperatures", written, 'give a list, ["-10 degC", "50 degC"]')
    return tuple(
        parse_quantity(one, "degC", field="duty.temperatures", example="50 degC") for one in written
    )


def _load_cases(tables: Table, table: Table, project: Project) -> tuple[Any, ...]:
    """Load cases of the duty's own, else those of the machine's that it names, else all."""
    own = tables.get("load_cases")
    if own is None:
        return chosen_cases(table, project, "duty")
    if "load_cases" in table:
        remedy = "[[load_cases]] stand in this file, too; leave one of the two out"
        raise InputError("duty.load_cases", table["load_cases"], remedy)
    if not isinstance(own, list):
        raise InputError("load_cases", own, "write each case as a section, [[load_cases]]")
    return read_load_cases(own, project.screen, Notes())


def _limits(tables: Table, project: Project) -> Limits:
    """Limits of the machine's, those of this file in their places."""
    if "limits" not in tables:
        return project.limits
    table = section_of(tables, "limits")
    refuse_unknown(table, [one.name for one in LIMIT_FIELDS], place="limits.")
    own = read_limits({"limits": dict(table)}, Notes())
    return replace(project.limits, **{name: getattr(own, name) for name in own.given})


def _prefer(table: Table) -> tuple[Any, ...]:
    written = table.get("prefer", list(OBJECTIVES))
    if not isinstance(written, list) or not written:
        raise InputError("duty.prefer", written, f"list some of {', '.join(OBJECTIVES)}")
    return tuple(written)


def _catalogue(
    table: Mapping[str, Any], path: Path | None
) -> tuple[tuple[SpringType, ...], tuple[int, int]]:
    """Springs of a catalogue file, and the numbers of pieces; none without the section."""
    if not table:
        return (), (4, 40)
    refuse_unknown(table, CATALOGUE, place="catalogue.")
    written = table.get("file", LEFT_OUT)
    if not isinstance(written, str):
        raise InputError("catalogue.file", written, 'name a file, file = "springs.csv"')
    ends = table.get("pieces", [4, 40])
    if not isinstance(ends, list) or len(ends) != 2:
        raise InputError("catalogue.pieces", ends, "give [from, to], [8, 16] for example")
    low, high = (whole_number(one, "catalogue.pieces", 1, 1000) for one in ends)
    return _springs((path.parent if path else Path()) / written), (low, high)


def _springs(path: Path) -> tuple[SpringType, ...]:
    """Springs of a CSV or XLSX file, a row each under a head of names."""
    rows = _rows(path)
    if len(rows) < 2:
        raise InputError("catalogue.file", path.name, "give a head and at least one spring")
    heads = [_head(str(one), path) for one in rows[0]]
    names, units = [name for name, _ in heads], dict(heads)
    missing = [one for one in ("name", "stiffness", "loss_factor") if one not in names]
    if missing:
        raise InputError("catalogue.file", path.name, f"a column is missing: {missing[0]}")
    return tuple(_spring(dict(zip(names, row, strict=False)), units, path) for row in rows[1:])


def _head(written: str, path: Path) -> tuple[str, str]:
    """Name of a column, and the unit behind it in brackets."""
    name, _, unit = written.strip().removesuffix("]").partition("[")
    name, known = name.strip(), ("name", *COLUMNS)
    if name not in known:
        near = difflib.get_close_matches(name, known, 1)
        meant = f"'{near[0]}' perhaps; " if near else ""
        remedy = f"{meant}name each column one of {', '.join(known)}"
        raise InputError(f"{path.name}, head", name, remedy)
    return name, unit.strip()


def _spring(row: Mapping[str, Any], units: Mapping[str, str], path: Path) -> SpringType:
    values: dict[str, Any] = {"name": str(row["name"]).strip()}
    for key, (unit, needed) in COLUMNS.items():
        written = row.get(key)
        label = f"{path.name}, {values['name']}, {key}"
        if written is None or str(written).strip() == "":
            if needed:
                raise InputError(label, LEFT_OUT, "give it")
            continue
        if unit and _is_number(written):
            if not units[key]:
                remedy = f"give its unit, behind it or in the head: '{key} [k{unit}]' for example"
                raise InputError(label, written, remedy)
            written = f"{written} {units[key]}"
        values[key] = parse_quantity(
            written if unit else _plain(written, label), unit, field=label,
            example=f"225 {unit}".strip(),
        )  # fmt: skip
    return SpringType(**values)


def _is_number(written: object) -> bool:
    try:
        float(str(written))
    except ValueError:
        return False
    return True


def _plain(written: object, label: str) -> Any:
    """A number of a column without a unit, or of one in SI."""
    try:
        value = float(str(written).strip().rstrip("%"))
    except ValueError:
        raise InputError(label, written, "give a number") from None
    if not math.isfinite(value):
        raise InputError(label, written, "give a finite number")
    return value / 100.0 if str(written).strip().endswith("%") else value


def _rows(path: Path) -> list[list[Any]]:
    try:
        if path.suffix == ".xlsx":
            return _sheet_rows(path)
        lines = path.read_text(encoding="utf-8-sig").splitlines()
        # What a spreadsheet writes where the comma stands in numbers.
        apart = ";" if lines and ";" in lines[0] and "," not in lines[0] else ","
        rows = csv.reader(lines, delimiter=apart)
        return [row for row in rows if any(cell.strip() for cell in row)]
    except FileNotFoundError:
        remedy = "there is no such file, it is looked for beside the duty file"
        raise InputError("catalogue.file", path.name, remedy) from None
    except UnicodeDecodeError:
        remedy = "it is not UTF-8 text, save the file as UTF-8"
        raise InputError("catalogue.file", path.name, remedy) from None
    except OSError as error:
        remedy = f"it cannot be read ({error.strerror})"
        raise InputError("catalogue.file", path.name, remedy) from None
    except csv.Error as error:
        raise InputError("catalogue.file", path.name, f"it cannot be read, {error}") from None


def _sheet_rows(path: Path) -> list[list[Any]]:
    openpyxl = required("openpyxl", "A catalogue as XLSX needs openpyxl", "report")
    book = openpyxl.load_workbook(path, read_only=True, data_only=True)
    rows = [list(row) for row in book.worksheets[0].iter_rows(values_only=True)]
    return [row for row in rows if any(cell is not None for cell in row)]
