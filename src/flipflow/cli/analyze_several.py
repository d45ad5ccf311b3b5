"""``flipflow analyze A B ...``: a report each, and one table that sums them up."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from flipflow.cli.destination import Destination
from flipflow.cli.output import OUTPUT, console
from flipflow.results.store import write_file

if TYPE_CHECKING:
    from flipflow.model.project import Project
    from flipflow.report.blocks import Table
    from flipflow.studies.assessment import Assessment
    from flipflow.studies.compare import Comparison

SUMMARY = "summary.html"


class One(Protocol):
    """Analyzes one machine into a folder, and unless told to be quiet says so in the terminal."""

    def __call__(
        self, file: str, project: Project, folder: Path, json: str | None, *, quiet: bool
    ) -> Assessment:
        """Analyze it."""


def analyze_several(
    files: Sequence[str], projects: Sequence[Project], output: Path | None, json: str | None,
    one: One,
) -> list[Assessment]:  # fmt: skip
    """A report of each machine in a folder of its own, then one table of all.

    The folders stand in ``output``, with the table as a page, or where the command is run. The
    JSON document is that of a comparison, which holds every machine whole.
    """
    from flipflow.report.compare import summary_table  # noqa: PLC0415  keeps --help quick
    from flipflow.report.terminal import show  # noqa: PLC0415
    from flipflow.studies.compare import Comparison, distinct_names  # noqa: PLC0415

    names = distinct_names(projects)
    folders = [(output or Path()) / name for name in _folders(projects)]
    with Destination(output, json, files) as target:
        found = []
        for name, file, project, folder in zip(names, files, projects, folders, strict=True):
            if target.spoken:
                console().print(f"[{name}]", style="bold")
            found.append(one(file, project, folder, None, quiet=not target.spoken))
            if target.spoken:
                console().print()
        table = summary_table(names, found)
        _write(Comparison(names, tuple(found)), table, target)
        if target.spoken:
            show(table, console())
        target.tell()
    return found


def _folders(projects: Sequence[Project]) -> Iterator[str]:
    """A folder's name for each machine; files of one name are numbered."""
    seen: dict[str, int] = {}
    for project in projects:
        seen[project.name] = seen.get(project.name, 0) + 1
        number = seen[project.name]
        yield f"{project.name}{f'-{number}' if number > 1 else ''}-flipflow"


def _write(found: Comparison, table: Table, target: Destination) -> None:
    """The table as a page in the folder, and all machines as one JSON document."""
    from flipflow.report.html import page  # noqa: PLC0415

    if target.folder is not None:
        words = page(
            (table,), title=f"{len(found.names)} machines", kind="summary",
            footer=f"flipflow {found.version}",
        )  # fmt: skip
        write_file(target.path(SUMMARY), words, OUTPUT)
        target.wrote(SUMMARY)
    target.result(found)
