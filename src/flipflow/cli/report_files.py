"""The files of a report: in which formats, and that no folder's other report is overwritten."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from flipflow.cli.output import OUTPUT
from flipflow.errors import InputError

if TYPE_CHECKING:
    from flipflow.cli.destination import Destination
    from flipflow.model.duty import Duty
    from flipflow.model.project import Project
    from flipflow.report.blocks import Block
    from flipflow.studies.assessment import Assessment

    Format = Callable[[Assessment, Sequence[Block]], Mapping[str, bytes | str]]

RESULTS, REPORT, PDF, KEY = "results.json", "report.html", "report.pdf", "report"
PROPOSAL = "proposal.json"
DOCUMENTS = (RESULTS, PROPOSAL)  # in which a report of an analysis, and of a design, keep their key
PAPER = "a4"
HEAD_LINES = 4  # within which a document of ours names what it is
REMEDY = "give --overwrite to replace it, or name another folder"


@dataclass(frozen=True)
class ReportKey:
    """What makes a report what it is, as its folder keeps it in one of ``DOCUMENTS``.

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


@dataclass(frozen=True)
class ReportFiles:
    """What ``flipflow analyze`` writes of one machine.

    Parameters
    ----------
    options
        Options of the command that change what is found, as written.
    formats
        What makes further files of an assessment and its blocks, by name.
    overwrite
        Whether another report may be replaced.
    """

    options: Mapping[str, object]
    formats: tuple[Format, ...]
    overwrite: bool

    def replaced(self, folder: Path, project: Project) -> tuple[str, ...]:
        """The files of another report that go from the folder.

        Raises
        ------
        InputError
            Where the folder holds another report, unless it is to be overwritten.
        """
        key = _key_of(project, self.options)
        return replaced_files(folder, RESULTS, key, overwrite=self.overwrite)

    def write(
        self, assessment: Assessment, target: Destination, document: Mapping[str, object]
    ) -> None:
        """Write the report, the numbers behind it and what else is asked for."""
        from flipflow.io.response import NAMES, write_response  # noqa: PLC0415  quick --help
        from flipflow.report.html import html  # noqa: PLC0415
        from flipflow.report.registry import blocks_of  # noqa: PLC0415

        blocks = blocks_of(assessment)
        more = {
            name: text for make in self.formats for name, text in make(assessment, blocks).items()
        }
        key = _key_of(assessment.project, self.options)
        old = _read(Path(target.folder or "") / RESULTS)
        still = old.files if old is not None and _same(old, key) else ()
        kept = asdict(replace(key, files=_once(REPORT, RESULTS, *NAMES, *more, *still)))
        target.content(REPORT, html(assessment, blocks))
        target.wrote(REPORT)
        target.data(RESULTS, {"schema": document["schema"], KEY: kept, **document})
        write_response(assessment, target.all_of(NAMES))
        target.wrote(*NAMES)
        for name, text in more.items():
            target.content(name, text)
        target.wrote(*_told(more))


def formats_of(paper: str | None, *, tables: bool) -> tuple[Format, ...]:
    """What makes the files beside the page, a PDF on a paper and tables; missing extras end it.

    Raises
    ------
    InputError
        For a paper that is not known.
    MissingExtra
        When what is asked for needs an extra that is not installed.
    """
    from flipflow.report.html import require_templates  # noqa: PLC0415  keeps --help quick

    require_templates()
    formats: list[Format] = []
    if paper is not None:
        from flipflow.plotting.print import require_typst  # noqa: PLC0415
        from flipflow.report.pdf import checked_paper, pdf  # noqa: PLC0415

        checked_paper(paper, "--paper")
        require_typst()
        formats.append(lambda assessment, blocks: {PDF: pdf(assessment, paper, blocks)})
    if tables:
        from flipflow.io.spreadsheet import require_openpyxl  # noqa: PLC0415
        from flipflow.report.tables import table_files  # noqa: PLC0415

        require_openpyxl()
        formats.append(table_files)
    return tuple(formats)


def _told(names: Collection[str]) -> list[str]:
    """Names of files for the terminal; the many tables are counted."""
    tables = [name for name in names if name.endswith(".csv")]
    counted = [f"{len(tables)} tables as CSV"] if tables else []
    return [*(name for name in names if name not in tables), *counted]


def _key_of(project: Project, options: Mapping[str, object]) -> ReportKey:
    """The key of the report of a project."""
    from flipflow.studies.assessment import input_hash  # noqa: PLC0415  keeps --help quick

    said = [input_hash(project), asdict(project.document)]
    said += [dict(project.sources), dict(project.written), project.warnings]
    digest = hashlib.sha256(json.dumps(said, sort_keys=True, default=str).encode())
    return ReportKey(digest.hexdigest()[:16], json.loads(json.dumps(options)))


def duty_key(duty: Duty) -> ReportKey:
    """The key of the report of a design; how long it was searched for makes no other report."""
    from flipflow.studies.documents import CODEC  # noqa: PLC0415  keeps --help quick

    said = json.dumps(CODEC.form(type(duty)).write(duty), sort_keys=True)
    return ReportKey(hashlib.sha256(said.encode()).hexdigest()[:16], {})


def replaced_files(
    folder: Path, document: str, new: ReportKey, *, overwrite: bool
) -> tuple[str, ...]:
    """The files of another report that go from a folder; of the same report none go.

    ``document`` is the file in which such a report keeps its key.

    Raises
    ------
    InputError
        Where the folder holds another report, unless it is to be overwritten.
    """
    there = [name for name in (*DOCUMENTS, REPORT) if (folder / name).exists()]
    if not there:
        return ()
    old = {name: _read(folder / name) for name in DOCUMENTS if name in there}
    known = [key for key in old.values() if key is not None]
    if set(old) == {document} and known and _same(known[0], new):
        return ()
    if not overwrite:
        raise InputError(OUTPUT, str(folder), f"{_differs(known, new)}, {REMEDY}")
    return _once(*(name for key in known for name in key.files))


def _same(old: ReportKey, new: ReportKey) -> bool:
    return (old.input, old.options) == (new.input, new.options)


def _once(*names: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(names))


def _differs(known: Sequence[ReportKey], new: ReportKey) -> str:
    if not known:
        return "it holds a report or results whose input is not known"
    if any(old.input != new.input for old in known):
        return "it holds the report of another input"
    written = " ".join(f"{name} {value}" for name, value in known[0].options.items())
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
