"""Machine files: from a bundled name or a path to the project they describe."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from flipflow.errors import InputError
from flipflow.io.drive import read_drive
from flipflow.io.layout import FORMAT, SECTIONS, SPEED, refuse_unknown, sections_within
from flipflow.io.load_cases import read_load_cases
from flipflow.io.machine import Tables, read_screen
from flipflow.io.plausibility import implausible
from flipflow.io.source import read_source
from flipflow.io.values import (
    Notes,
    Table,
    checked_words,
    read_interval,
    read_number,
    read_text,
)
from flipflow.model.arguments import checked_flag
from flipflow.model.limits import (
    LIMIT_FIELDS,
    PASSAGES,
    PASSING_FIELDS,
    LimitField,
    Limits,
    PassingLimits,
)
from flipflow.model.project import Document, Project
from flipflow.model.screen import FlipFlowScreen

# Sections of the files that name a machine file, what such a file is called, and its command.
OTHER_FILES = {
    "duty": ("duty", "flipflow design"),
    "free": ("duty", "flipflow design"),
    "study": ("study", "flipflow study"),
    "vary": ("study", "flipflow study"),
}
MACHINE_FILE, FRAMES = "machine", "frames"  # a kind of file, and the section that only it has


def load(name_or_path: str | os.PathLike[str], *, force: bool = False) -> FlipFlowScreen:
    """Load the screen of a bundled machine or of a machine file.

    Parameters
    ----------
    name_or_path
        ``"ffs0827"``, ``"ffs0827-linear"``, ``"rig-lin2024"``, or the path of a ``.toml`` file.
    force
        Let values through that are possible but look like a slip of units.

    Returns
    -------
    FlipFlowScreen
        The machine, empty, in SI.

    Raises
    ------
    InputError
        For a file that cannot be read, or a value in it that is wrong, missing or implausible.
    """
    return load_project(name_or_path, force=force).screen


def load_project(name_or_path: str | os.PathLike[str], *, force: bool = False) -> Project:
    """Load a whole machine file: screen, limits, load cases, speed, document, sources.

    Parameters
    ----------
    name_or_path
        ``"ffs0827"``, ``"ffs0827-linear"``, ``"rig-lin2024"``, or the path of a ``.toml`` file.
    force
        Let values through that are possible but look like a slip of units; they are then listed
        in ``warnings``.

    Returns
    -------
    Project
        What the file says, in SI, with what it leaves out noted in ``assumed``.

    Raises
    ------
    InputError
        For a file that cannot be read, or a value in it that is wrong, missing or implausible.
    """
    checked_flag("force", force)
    source = read_source(name_or_path)
    tables, cases = _sections(source.tables)
    notes = Notes()
    check_format(source.tables)
    if "format" not in source.tables:
        notes.assumed.append(f"format = {FORMAT}")
    screen = read_screen(tables, notes)
    speed = _speed(tables.get("operation", {}), notes)
    project = Project(
        screen=screen,
        limits=read_limits(tables, notes),
        load_cases=read_load_cases(cases, screen, notes),
        speed=speed,
        drive=read_drive(tables.get("drive"), screen, speed, notes),
        document=_document(tables.get("document", {}), source.name, notes),
        sources=_sources(tables.get("sources", {}), cases),
        name=source.name,
        path=source.path,
        written=notes.written,
        sums=notes.sums,
        assumed=tuple(notes.assumed),
    )
    return _plausible(project, force=force)


def _plausible(project: Project, *, force: bool) -> Project:
    found = implausible(
        project.screen, project.limits, project.load_cases, project.speed, project.drive,
        project.written,
    )  # fmt: skip
    if found and not force:
        raise found[0]
    return replace(project, warnings=tuple(map(str, found)))


def _sections(tables: Mapping[str, object]) -> tuple[Tables, list[Table]]:
    """Check that every section is there in the right shape and holds only known keys."""
    refuse_other_files(tables, MACHINE_FILE)
    refuse_unknown(tables, ["format", *(name for name in SECTIONS if "." not in name)], place="")
    sections: Tables = {}
    for name, entries in SECTIONS.items():
        within, _, last = name.rpartition(".")
        table = (sections.get(within, {}) if within else tables).get(last)
        if table is None or name == "load_cases":
            continue
        if not isinstance(table, dict):
            raise InputError(name, table, f"write it as a section, [{name}] on a line of its own")
        if name != "sources":
            known = [*(entry.key for entry in entries), *sections_within(name)]
            refuse_unknown(table, known, place=f"{name}.")
        sections[name] = table
    cases = tables.get("load_cases", [])
    if not isinstance(cases, list) or not all(isinstance(case, dict) for case in cases):
        shown = "[load_cases]" if isinstance(cases, dict) else cases
        raise InputError(
            "load_cases", shown, "write each case as a section of its own, [[load_cases]]"
        )
    return sections, cases


def refuse_other_files(tables: Mapping[str, object], kind: str) -> None:
    """Name the command of a file that is not of this kind: "machine", "study" or "duty".

    Raises
    ------
    InputError
        For a file of another kind.
    """
    if isinstance(tables.get("machine"), str):
        for section, (other, command) in OTHER_FILES.items():
            if section in tables and other != kind:
                remedy = f"this is a {other} file, which {command} reads"
                raise InputError("section", f"[{section}]", remedy)
    elif kind != MACHINE_FILE and FRAMES in tables:
        remedy = f'this is a machine file; name it in a {kind} file, machine = "..."'
        raise InputError("section", f"[{FRAMES}]", remedy)


def check_format(tables: Mapping[str, object]) -> None:
    """Refuse a file of another format."""
    written = tables.get("format", FORMAT)
    if isinstance(written, bool) or written != FORMAT:
        raise InputError("format", written, f"this version of flipflow reads format = {FORMAT}")


def read_limits(tables: Tables, notes: Notes) -> Limits:
    """Limits of the sections ``limits``, ``limits.start``, ``limits.stop``."""
    passing: dict[str, Any] = {
        passage: PassingLimits(
            **_limit_values(tables.get(f"limits.{passage}", {}), PASSING_FIELDS[passage], notes)
        )
        for passage in PASSAGES
    }
    return Limits(**_limit_values(tables.get("limits", {}), LIMIT_FIELDS, notes), **passing)


def _limit_values(table: Table, fields: tuple[LimitField, ...], notes: Notes) -> dict[str, Any]:
    values = {}
    for limit in fields:
        if limit.name in table:
            written = notes.written[limit.key] = table[limit.name]
            read = read_interval if limit.interval else read_number
            values[limit.name] = read(written, limit)
    return values


def _speed(table: Table, notes: Notes) -> float | None:
    if "speed" not in table:
        return None
    notes.written[SPEED.key] = table["speed"]
    return read_number(table["speed"], SPEED)


def _document(table: Table, stem: str, notes: Notes) -> Document:
    values = {entry.key: read_text(table, entry) for entry in SECTIONS["document"]}
    if not values["name"]:
        notes.assumed.append(f'document.name = "{stem}"')
        values["name"] = stem
    return Document(**values)


def _sources(table: Table, cases: list[Table]) -> Mapping[str, str]:
    """Read the sources; TOML reads an unquoted ``section.key`` as a table in a table."""
    flat: dict[str, object] = {}
    for key, value in table.items():
        inner = value if isinstance(value, dict) else {"": value}
        flat.update({f"{key}.{name}".rstrip("."): text for name, text in inner.items()})
    known = [*(entry.label for entries in SECTIONS.values() for entry in entries), *SECTIONS]
    known += [f"load_cases.{case.get('name')}" for case in cases]
    refuse_unknown(flat, known, place="sources.")
    for key, text in flat.items():
        if not isinstance(text, str):
            raise InputError(f"sources.{key}", text, 'write text in quotes, such as "drawing 4711"')
        checked_words(text, f"sources.{key}")
    return {key: str(text) for key, text in flat.items()}
