"""What report a folder holds: of which input, by which options; another is not overwritten."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from flipflow.cli.output import OUTPUT
from flipflow.errors import InputError

if TYPE_CHECKING:
    from flipflow.model.project import Project

RESULTS, REPORT, KEY = "results.json", "report.html", "report"
HEAD_LINES = 4  # within which a document of ours names what it is
REMEDY = "give --overwrite to replace it, or name another folder"


@dataclass(frozen=True)
class ReportKey:
    """What makes a report what it is, as its folder keeps it in ``results.json``.

    Parameters
    ----------
    input
        Digest of all that the machine file says.
    options
        Options of the command that change what is found, as written.
    files
        The files of the report.
    """

    input: str
    options: Mapping[str, object]
    files: tuple[str, ...] = ()

    def document(self) -> dict[str, object]:
        """As it stands in ``results.json``."""
        return asdict(self)


def key_of(project: Project, options: Mapping[str, object]) -> ReportKey:
    """The key of the report of a project."""
    from flipflow.studies.assessment import input_hash  # noqa: PLC0415  keeps --help quick

    said = [input_hash(project), asdict(project.document)]
    said += [dict(project.sources), dict(project.written), project.warnings]
    digest = hashlib.sha256(json.dumps(said, sort_keys=True, default=str).encode())
    return ReportKey(digest.hexdigest()[:16], json.loads(json.dumps(options)))


def kept_in(folder: Path, new: ReportKey, *, overwrite: bool) -> tuple[str, ...]:
    """The files of the report that a folder holds; those of the same report are none to replace.

    Raises
    ------
    InputError
        Where the folder holds another report, unless it is to be overwritten.
    """
    there = [name for name in (RESULTS, REPORT) if (folder / name).exists()]
    if not there:
        return ()
    old = _read(folder / RESULTS)
    if old is not None and (old.input, old.options) == (new.input, new.options):
        return ()
    if not overwrite:
        raise InputError(OUTPUT, str(folder), f"{_differs(old, new)}, {REMEDY}")
    return () if old is None else tuple(old.files)


def _differs(old: ReportKey | None, new: ReportKey) -> str:
    if old is None:
        return "it holds a report or results whose input is not known"
    if old.input != new.input:
        return "it holds the report of another input"
    written = " ".join(f"{name} {value}" for name, value in old.options.items())
    return f"it holds the report of this input by other options ({written or 'none'})"


def _read(results: Path) -> ReportKey | None:
    """The key in a folder's results; None where there is none."""
    try:
        with results.open(encoding="utf-8") as lines:
            head = [line for line, _ in zip(lines, range(HEAD_LINES), strict=False)]
        found = next(line for line in head if line.startswith(f'"{KEY}": '))
        document = json.loads(found.partition(": ")[2].rstrip().rstrip(","))
        return ReportKey(document["input"], document["options"], tuple(document["files"]))
    except (OSError, StopIteration, ValueError, LookupError, TypeError):
        return None
