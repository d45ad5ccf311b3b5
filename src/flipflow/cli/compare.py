"""``flipflow compare``: which inputs of machines differ, and how each result changes."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from flipflow.cli.destination import Destination
from flipflow.cli.options import Files, Force, Json, Output, Speed, speed_of
from flipflow.cli.output import OUTPUT, console
from flipflow.cli.progress import with_progress
from flipflow.errors import InputError
from flipflow.results.store import write_file

if TYPE_CHECKING:
    from flipflow.model.project import Project
    from flipflow.studies.compare import Comparison

PAGE, CURVES, DATA = "comparison.html", "curves.html", "comparison.json"


def compare(
    files: Files,
    speed: Speed = None,
    output: Output = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Compare machines: inputs that differ, results that change.

    Each is looked at at its own working speed, or all at --speed; B, C, ... against A.
    """
    from flipflow.io.project import load_project  # noqa: PLC0415  keeps --help quick

    if len(files) < 2:
        raise InputError("FILE...", files[0], "name at least two machine files to compare")
    projects = [load_project(file, force=force) for file in files]
    if speed is not None:
        projects = [replace(one, speed=speed_of(one, speed)) for one in projects]
    with Destination(output, json, files) as target:
        from flipflow.report.html import require_templates  # noqa: PLC0415

        if output is not None:
            require_templates()
        _write(_compared(projects), target)


def _compared(projects: list[Project]) -> Comparison:
    from flipflow.studies.compare import compare as comparison  # noqa: PLC0415  keeps --help quick

    return with_progress(lambda monitor: comparison(projects, monitor=monitor))


def _write(found: Comparison, target: Destination) -> None:
    """The page, the curves and the numbers; the main changes in the terminal."""
    from flipflow.io.results import document_of  # noqa: PLC0415  keeps --help quick
    from flipflow.plotting.compare import comparison_figure  # noqa: PLC0415
    from flipflow.report import summary  # noqa: PLC0415
    from flipflow.report.html import html  # noqa: PLC0415

    if target.folder is not None or target.json is not None:
        document = document_of(found)
        if target.folder is not None:
            write_file(target.path(PAGE), html(found), OUTPUT)
            target.wrote(PAGE)
            target.picture(CURVES, comparison_figure(found), subject_of(found))
            target.data(DATA, document)
        target.document(document)
    if target.spoken:
        summary(found, console())
    target.tell()


def subject_of(found: Comparison) -> str:
    """What a figure of a comparison carries: machines, revisions, date."""
    parts = []
    for name, one in zip(found.names, found.assessments, strict=True):
        revision = one.project.document.revision
        parts.append(f"{name} ({f'revision {revision}' if revision else 'no revision'})")
    return f"{' and '.join(parts)}, {datetime.now(UTC).astimezone().date().isoformat()}"
