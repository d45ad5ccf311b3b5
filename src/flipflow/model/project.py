"""A machine with all that its file says: what it must bear, what it may do, who says so."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

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
