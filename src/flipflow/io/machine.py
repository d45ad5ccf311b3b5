"""From the sections of a machine file to the screen."""

from __future__ import annotations

import math
from collections.abc import Mapping

from flipflow.errors import InputError
from flipflow.io.layout import SECTIONS, entry_of
from flipflow.io.values import (
    LEFT_OUT,
    Notes,
    Table,
    read_choice,
    read_number,
    read_temperatures,
    read_total,
)
from flipflow.model.fields import FIELD, FIELDS, Field
from flipflow.model.screen import FlipFlowScreen

Tables = dict[str, Table]
TEMPERATURE_TABLES = {
    "shear_springs": "temperature_factor", "stops": "stop_temperature_factor",
}  # fmt: skip


def read_screen(tables: Tables, notes: Notes) -> FlipFlowScreen:
    """Build the screen from sections whose keys are known; notes what was written and assumed.

    Raises
    ------
    InputError
        For the first value that is missing, of the wrong kind, or forbidden by physics.
    """
    counts = _counts(tables, notes)
    values: dict[str, object] = {}
    for field in FIELDS:
        value = counts.get(field.name)
        if not field.whole:
            value = read_total(_section(tables, field), field, _count(field, counts), notes)
        if value is not None:
            values[field.name] = value
        elif field.required:
            raise _left_out(field)
    _stops(tables, values, notes)
    _choice(tables, "exciter.type", "circular", notes)
    values["rotation"] = _choice(tables, "exciter.rotation", "with-flow", notes)
    if "stops" in tables:
        values["stop_law"] = _choice(tables, "stops.law", "paper", notes)
        measured = _choice(tables, "stops.clearance_measured", "standing", notes)
        values["clearance_measured"] = measured
    for section, name in TEMPERATURE_TABLES.items():
        rows = tables.get(section, {}).get("temperature_factor")
        if rows is not None:
            label = f"{section}.temperature_factor"
            notes.written[label] = rows
            values[name] = read_temperatures(rows, label)
    return FlipFlowScreen(**values)  # type: ignore[arg-type]


def _section(tables: Tables, field: Field) -> Table:
    return tables.get(entry_of(field).section, {})


def _counts(tables: Tables, notes: Notes) -> dict[str, float]:
    counts = {}
    for field in FIELDS:
        key = entry_of(field).key
        table = _section(tables, field)
        if field.whole and key in table:
            notes.written[field.key] = table[key]
            counts[field.name] = read_number(table[key], field)
    return counts


def _count(field: Field, counts: Mapping[str, float]) -> float | None:
    """How many pieces make a total; one isolation spring at each support if nothing else is said.

    Raises
    ------
    InputError
        For isolation springs that are no multiple of the supports.
    """
    if field.count is None:
        return None
    pieces, supports = counts.get(field.count), counts.get("supports")
    if field.count != "isolation_pieces" or supports is None:
        return pieces
    if pieces is not None and pieces % supports:
        remedy = f"give a multiple of the {supports:g} supports"
        raise InputError(FIELD[field.count].key, int(pieces), remedy)
    return supports if pieces is None else pieces


def _choice(tables: Tables, label: str, default: str, notes: Notes) -> str:
    section, _ = label.split(".")
    entry = next(entry for entry in SECTIONS[section] if entry.label == label)
    return read_choice(tables.get(section, {}), entry, notes, default=default)


def _left_out(field: Field) -> InputError:
    return InputError(field.key, LEFT_OUT, f"it must be given, for example {field.example!r}")


def _stops(tables: Tables, values: dict[str, object], notes: Notes) -> None:
    """Refuse a half-described stop: a gap without stiffness would silently be none at all."""
    if "stops" not in tables:
        notes.assumed.append("no stop springs, because there is no section [stops]")
        return
    gaps = [values.get("clearance"), values.get("clearance_minus")]
    if gaps[0] is None:
        raise InputError(
            "stops.clearance", LEFT_OUT,
            "give the gap per side, for example '6 mm', or leave out [stops] for no stop springs",
        )  # fmt: skip
    if all(gap in {None, math.inf} for gap in gaps):
        return
    if "stop_stiffness" not in values:
        raise _left_out(FIELD["stop_stiffness"])
    if "stop_damping" not in values:
        notes.assumed.append("stops.damping = 0, because it is left out")
    if gaps[1] is None:
        notes.assumed.append("the same gap on both sides, because clearance_minus is left out")
