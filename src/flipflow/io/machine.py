"""From the sections of a machine file to the screen."""

from __future__ import annotations

import math

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
            count = counts.get(field.count) if field.count else None
            value = read_total(_section(tables, field), field, count, notes)
        if value is not None:
            values[field.name] = value
        elif field.required:
            raise _left_out(field)
    _stops(tables, values, notes)
    _choice(tables, "exciter.type", "circular", notes)
    if "stops" in tables:
        values["stop_law"] = _choice(tables, "stops.law", "paper", notes)
        measured = _choice(tables, "stops.clearance_measured", "standing", notes)
        values["clearance_measured"] = measured
    rows = tables.get("shear_springs", {}).get("temperature_factor")
    if rows is not None:
        label = "shear_springs.temperature_factor"
        notes.written[label] = rows
        values["temperature_factor"] = read_temperatures(rows, label)
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
