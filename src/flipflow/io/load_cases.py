"""Load cases of a machine file: stiffening, carried material, temperature."""

from __future__ import annotations

import math
from typing import Any, get_args

from flipflow.errors import InputError
from flipflow.io.layout import LOAD_FIELDS, MATERIAL, MATERIAL_PER_AREA, SECTIONS, refuse_unknown
from flipflow.io.units import converts
from flipflow.io.values import LEFT_OUT, Notes, Table, read_number, read_text
from flipflow.model.screen import FlipFlowScreen, Load, TemperatureOf, as_cool_as_air


def read_load_cases(tables: list[Table], screen: FlipFlowScreen, notes: Notes) -> tuple[Load, ...]:
    """Read the load cases of a screen; without any, the empty machine is assumed.

    Raises
    ------
    InputError
        For a case without a name or with the name of another, or one the screen cannot take.
    """
    if not tables:
        notes.assumed.append('one load case, "empty", because there are no [[load_cases]]')
        return (Load(name="empty"),)
    cases: dict[str, Load] = {}
    for number, table in enumerate(tables, start=1):
        case = _read_case(table, f"load case {number}", screen, notes)
        if case.name in cases:
            raise InputError(
                f"load case {number}, name", case.name, "another case has it, give each its own"
            )
        cases[case.name] = case
    return tuple(cases.values())


def _read_case(table: Table, label: str, screen: FlipFlowScreen, notes: Notes) -> Load:
    entries = SECTIONS["load_cases"]
    refuse_unknown(table, [entry.key for entry in entries], place=f"{label}, ")
    name = read_text(table, entries[0], label=f"{label}, name", lines=False)
    if not name.strip():
        raise InputError(f"{label}, name", table.get("name", LEFT_OUT), 'give one, such as "full"')
    values: dict[str, Any] = {}
    for field in LOAD_FIELDS:
        key = field.key.split(".")[1]
        if key in table:
            values[field.name] = read_number(table[key], field, label=f"{label}, {key}")
    values.update(_material(table, label, screen))
    values["temperature_of"] = _temperature_of(table, label)
    for key, written in table.items():
        if key != "name":
            notes.written[f"{label}, {key}"] = written
    load = Load(name=name, **values)
    try:
        screen.loaded(as_cool_as_air(load))
    except InputError as error:
        written = table.get(error.field, error.value)
        raise InputError(f"{label}, {error.field}", written, error.remedy) from None
    return load


def _temperature_of(table: Table, label: str) -> str:
    """Whose temperature a case gives."""
    written = table.get("temperature_of", "rubber")
    if written not in get_args(TemperatureOf):
        remedy = f"choose one of {', '.join(get_args(TemperatureOf))}"
        raise InputError(f"{label}, temperature_of", written, remedy)
    return str(written)


def _material(table: Table, label: str, screen: FlipFlowScreen) -> dict[str, float]:
    """Split the carried material between the frames."""
    material, split = table.get("material"), table.get("split_main_floating")
    if material is None:
        if split is not None:
            raise InputError(
                f"{label}, split_main_floating",
                split,
                f"add material, such as {MATERIAL.example!r}",
            )
        return {}
    name = f"{label}, material"
    if isinstance(material, str) and converts(material, MATERIAL.unit):
        mass = read_number(material, MATERIAL, label=name)
    else:
        per_area = read_number(material, MATERIAL_PER_AREA, label=name)
        if screen.deck_area is None:
            raise InputError(name, material, "a mass per area needs frames.deck_area, add it")
        mass = per_area * screen.deck_area
    main, floating = _shares(split, f"{label}, split_main_floating")
    return {"main_mass": main * mass, "floating_mass": floating * mass}


def _shares(split: object, label: str) -> tuple[float, float]:
    if split is None:
        raise InputError(label, LEFT_OUT, "say what share each frame carries, such as [0.5, 0.5]")
    numbers = [x for x in split if _is_share(x)] if isinstance(split, list) else []
    if len(numbers) != 2 or split != numbers or not math.isclose(sum(numbers), 1.0, abs_tol=1e-6):
        raise InputError(
            label,
            split,
            "give the shares of main and floating frame, which add up to 1: [0.5, 0.5]",
        )
    return float(numbers[0]), float(numbers[1])


def _is_share(x: object) -> bool:
    return isinstance(x, (int, float)) and not isinstance(x, bool) and 0.0 <= x <= 1.0
