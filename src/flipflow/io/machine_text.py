"""A project as a machine file: what is read back is the same machine, to the last bit."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping

from flipflow.errors import InputError
from flipflow.io.layout import (
    FORMAT,
    LOAD_FIELDS,
    SECTION_SENTENCES,
    SECTIONS,
    SPEED,
    Entry,
    entry_of,
    toml,
)
from flipflow.io.machine import TEMPERATURE_TABLES
from flipflow.io.units import in_unit, parse_quantity
from flipflow.model.fields import FIELD, Field
from flipflow.model.limits import LIMIT_FIELDS, PASSAGES, PASSING_FIELDS
from flipflow.model.project import Project
from flipflow.model.screen import FlipFlowScreen, Load

DIGITS = range(4, 18)  # significant ones, as few as tell the value apart
WRITTEN_WHOLE = 1e12  # below it a number is written without an exponent
CHOICES = {
    "exciter.rotation": "rotation", "stops.law": "stop_law",
    "stops.clearance_measured": "clearance_measured",
}  # fmt: skip
STOPS = "stops"
DRIVE = "drive."


def machine_text(project: Project, sources: Mapping[str, str] | None = None) -> str:
    """A machine file of a project: screen, speed, drive, limits, load cases, sources.

    Parameters
    ----------
    project
        The machine and what belongs to it. Its drive is written as its own file has it.
    sources
        Where values come from, by ``section.key``, that the project does not say.

    Returns
    -------
    str
        TOML, whose screen, speed and limits read back equal.

    Raises
    ------
    InputError
        For a machine under a load, whose gaps no file can tell, and a drive that no file gave.
    """
    if project.screen.measured_shift is not None:
        remedy = "give the machine as it stands empty; a file tells its loads as load cases"
        raise InputError("measured_shift", project.screen.measured_shift, remedy)
    written = {key: value for key, value in project.written.items() if key.startswith(DRIVE)}
    if project.drive is not None and not written:
        raise InputError("drive", project.drive, "only a drive that a machine file gave is written")
    sections = {
        "document": [(e.key, toml(getattr(project.document, e.key))) for e in SECTIONS["document"]],
        **_screen(project.screen),
        "operation": [("speed", quantity_text(w, SPEED)) for w in (project.speed,) if w],
        "drive": [(key.removeprefix(DRIVE), toml(value)) for key, value in written.items()],
        **_limits(project),
    }  # fmt: skip
    parts = [f"format = {FORMAT}\n"]
    parts += [_section(name, lines) for name, lines in sections.items() if lines]
    parts += [_load_case(load) for load in project.load_cases]
    parts.append(_sources(project, sources or {}))
    return "\n".join(parts)


def quantity_text(value: float, field: Field) -> str:
    """A value as TOML with the unit an engineer writes, as few digits as read back to it."""
    if field.whole:
        return f"{value:.0f}"
    if math.isinf(value):
        return '"inf"'
    for unit in dict.fromkeys((field.file_unit, field.unit)):
        for digits in DIGITS:
            text = f"{_plain_number(in_unit(value, unit, field.unit), digits)} {unit}".strip()
            if _reads(text, field) == value:
                return json.dumps(text) if unit else text
    text = f"{value!r} {field.unit}".strip()
    return json.dumps(text) if field.unit else text


def _plain_number(value: float, digits: int) -> str:
    """A number of so many digits; a large one is written whole, without an exponent."""
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text and abs(value) < WRITTEN_WHOLE else text


def _reads(text: str, field: Field) -> float:
    written: object = text if field.unit or "%" in text else float(text)
    return parse_quantity(written, field.unit, field=field.key)


def _section(name: str, lines: list[tuple[str, str]]) -> str:
    body = "\n".join(f"{key} = {text}" for key, text in lines)
    return f"# {SECTION_SENTENCES[name]}\n[{name}]\n{body}\n"


def _screen(screen: FlipFlowScreen) -> dict[str, list[tuple[str, str]]]:
    """Sections of the screen; that of the stops where it has any."""
    names = dict.fromkeys(entry_of(field).section for field in FIELD.values())
    found = {name: list(_of_section(screen, name)) for name in names}
    plain = all(
        getattr(screen, field.name) in (field.default, None)
        for field in FIELD.values()
        if entry_of(field).section == STOPS
    )
    if plain:
        found.pop(STOPS)
    return found


def _of_section(screen: FlipFlowScreen, name: str) -> Iterator[tuple[str, str]]:
    for entry in SECTIONS[name]:
        text = _entry(screen, entry)
        if text:
            yield entry.key, text


def _entry(screen: FlipFlowScreen, entry: Entry) -> str:
    """One key; nothing where the machine has none, or another key says it."""
    if entry.kind == "temperatures":
        rows = getattr(screen, TEMPERATURE_TABLES[entry.section])
        pairs = ", ".join(f'["{degrees!r} degC", {factor!r}]' for degrees, factor in rows)
        return f"[{pairs}]" if rows else ""
    if entry.label in CHOICES:
        return json.dumps(getattr(screen, CHOICES[entry.label]))
    if entry.kind != "quantity" or entry.field is None:
        return ""
    value = getattr(screen, entry.field.name)
    return "" if value is None else quantity_text(value, entry.field)


def _limits(project: Project) -> dict[str, list[tuple[str, str]]]:
    tables = {"limits": (project.limits, LIMIT_FIELDS)}
    tables |= {
        f"limits.{one}": (getattr(project.limits, one), PASSING_FIELDS[one]) for one in PASSAGES
    }
    return {
        name: [
            (field.name, _limit(getattr(owner, field.name), field))
            for field in fields
            if getattr(owner, field.name) is not None
        ]
        for name, (owner, fields) in tables.items()
    }


def _limit(value: float | tuple[float, float], field: Field) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(quantity_text(end, field) for end in value)}]"
    return quantity_text(value, field)


def _load_case(load: Load) -> str:
    lines = [("name", toml(load.name or "empty"))]
    lines += [
        (entry_of(field).key, quantity_text(value, field))
        for field in LOAD_FIELDS
        if (value := getattr(load, field.name)) not in (field.default, None)
    ]
    if load.temperature is not None and load.temperature_of != "rubber":
        lines.append(("temperature_of", json.dumps(load.temperature_of)))
    mass = load.main_mass + load.floating_mass
    if mass > 0.0:
        shares = load.main_mass / mass, load.floating_mass / mass
        lines.append(("material", f'"{mass!r} kg"'))
        lines.append(("split_main_floating", f"[{shares[0]!r}, {shares[1]!r}]"))
    body = "\n".join(f"{key} = {text}" for key, text in lines)
    return f"[[load_cases]]\n{body}\n"


def _sources(project: Project, more: Mapping[str, str]) -> str:
    """Sources of values that are still there."""
    cases = {f"load_cases.{load.name or 'empty'}" for load in project.load_cases}
    kept = {
        key: text
        for key, text in {**project.sources, **more}.items()
        if not key.startswith("load_cases.") or key in cases
    }
    lines = [(toml(key), toml(text)) for key, text in kept.items()]
    return _section("sources", lines) if lines else ""
