"""A machine with all that its file says: what it must bear, what it may do, who says so."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from types import NoneType

from flipflow.errors import InputError
from flipflow.model.arguments import (
    checked_all,
    checked_kind,
    checked_mapping,
    checked_positive,
    checked_text,
)
from flipflow.model.drive import Drive
from flipflow.model.limits import Limits
from flipflow.model.screen import FlipFlowScreen, Load


@dataclass(frozen=True, kw_only=True)
class Document:
    """Title block of a report."""

    name: str = ""
    project: str = ""
    customer: str = ""
    drawing: str = ""
    revision: str = ""
    prepared_by: str = ""
    checked_by: str = ""

    def __post_init__(self) -> None:
        for entry in fields(self):
            checked_text(entry.name, getattr(self, entry.name))


@dataclass(frozen=True, kw_only=True)
class Project:
    """A machine file: the machine, what it must bear, what it may do, and where that is known from.

    Parameters
    ----------
    screen
        The machine, empty.
    limits
        What it may do; a limit at None is not checked.
    load_cases
        At least one; the empty machine where the file names none.
    speed
        Operating speed in rad/s, None where the file gives none.
    document
        Title block.
    sources
        Where values come from, by ``section.key``, by section, or by ``load_cases.<name>``.
    name, path
        Bundled name or the file's stem, and the path; None for a bundled machine.
    written
        Values as the file has them, by ``section.key``.
    sums
        Totals that were given in pieces, as sentences, by ``section.key``.
    assumed
        What was taken because the file leaves it out.
    warnings
        What looked implausible and was let through by ``force``.
    drive
        Motor and shaft; None where the file gives none.
    """

    screen: FlipFlowScreen
    limits: Limits
    load_cases: tuple[Load, ...]
    speed: float | None
    document: Document
    sources: Mapping[str, str]
    name: str
    path: Path | None
    written: Mapping[str, object] = field(repr=False)
    sums: Mapping[str, str]
    assumed: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    drive: Drive | None = None

    def __post_init__(self) -> None:
        checked_kind("screen", self.screen, FlipFlowScreen, "give an ff.FlipFlowScreen")
        checked_kind("limits", self.limits, Limits, "give an ff.Limits")
        checked_kind("document", self.document, Document, "give a Document")
        checked_kind("drive", self.drive, (Drive, NoneType), "give an ff.Drive, or None")
        checked_kind("path", self.path, (Path, NoneType), "give a pathlib.Path, or None")
        checked_text("name", self.name)
        if self.speed is not None:
            object.__setattr__(self, "speed", checked_positive("speed", self.speed, "rad/s"))
        loads = checked_all("load_cases", self.load_cases, Load, "give at least one ff.Load")
        if not loads:
            raise InputError("load_cases", self.load_cases, "give at least one ff.Load")
        object.__setattr__(self, "load_cases", loads)
        for name in ("sources", "written", "sums"):
            checked_mapping(name, getattr(self, name), "give a mapping by section.key")
        for name in ("assumed", "warnings"):
            words = checked_all(name, getattr(self, name), str, "give a tuple of sentences")
            object.__setattr__(self, name, words)
