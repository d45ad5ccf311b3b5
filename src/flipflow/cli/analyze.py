"""``flipflow analyze``: from a machine file to a verdict, a report and the numbers behind it."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flipflow.cli.destination import Destination
from flipflow.cli.options import Files, Folder, Force, Json, Speeds, speed_of, speeds_of, whole
from flipflow.cli.output import DOES_NOT_START
from flipflow.cli.progress import with_progress

if TYPE_CHECKING:
    from flipflow.cli.report_files import ReportFiles
    from flipflow.model.project import Project
    from flipflow.studies.assessment import Assessment


def analyze(
    files: Files,
    output: Folder = None,
    json: Json = None,
    speeds: Speeds = None,
    harmonics: Annotated[
        int | None,
        whole("--harmonics", "H", 1, 200, "Harmonic balance instead of exact motion."),
    ] = None,
    pdf: Annotated[bool, typer.Option("--pdf", help="Write the report as PDF, too.")] = False,
    paper: Annotated[
        str | None, typer.Option("--paper", metavar="NAME", help="Paper of the PDF: a4 or letter.")
    ] = None,
    tables: Annotated[
        bool, typer.Option("--tables", help="Write every table as XLSX and CSV, too.")
    ] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the report of another input.")
    ] = False,
    force: Force = False,
) -> None:
    """Analyze machines: verdict, allowed speed range, report.

    Of several files each has a report of its own, and one table sums them up. Ends with code 5
    where a machine does not start, or its drive does not fit, as given.
    """
    from flipflow.cli.analyze_several import analyze_several  # noqa: PLC0415  keeps --help quick
    from flipflow.cli.report_files import PAPER, ReportFiles, formats_of  # noqa: PLC0415
    from flipflow.io.project import load_project  # noqa: PLC0415

    options = _options(speeds, harmonics)
    projects = [load_project(file, force=force) for file in files]
    for project in projects:
        if project.speed is not None:
            speed_of(project, None)
    formats = formats_of(paper or (PAPER if pdf else None), tables=tables)
    written = ReportFiles(_written(speeds, harmonics), formats, overwrite)
    one = partial(_analyze, options=options, written=written)
    if len(files) > 1:
        found = analyze_several(files, projects, output, json, one)
    else:
        folder = output or Path(f"{projects[0].name}-flipflow")
        found = [one(files[0], projects[0], folder, json)]
    if any(assessment.start_fails for assessment in found):
        raise typer.Exit(DOES_NOT_START)


def _analyze(
    file: str, project: Project, folder: Path, json: str | None, *, options: dict[str, Any],
    written: ReportFiles, quiet: bool = False,
) -> Assessment:  # fmt: skip
    """One machine: its report in a folder, its summary in the terminal unless ``quiet``."""
    old = written.replaced(folder, project)
    with Destination(folder, json, [file], quiet=quiet) as target:
        target.replaces(old)
        from flipflow.studies.assessment import assess  # noqa: PLC0415

        assessment = with_progress(lambda monitor: assess(project, monitor=monitor, **options))
        _write(assessment, target, written)
    return assessment


def _write(assessment: Assessment, target: Destination, files: ReportFiles) -> None:
    """The report, the numbers behind it, the summary in the terminal."""
    from flipflow.io.results import document_of  # noqa: PLC0415  loads every analysis
    from flipflow.report.terminal import summary  # noqa: PLC0415

    document = document_of(assessment)
    files.write(assessment, target, document)
    target.document(document)
    target.finish(lambda out: summary(assessment, out))


def _written(speeds: tuple[str, str] | None, harmonics: int | None) -> dict[str, object]:
    """Options that change what is found, as they are written."""
    given = {"--speeds": speeds and " ".join(speeds), "--harmonics": harmonics}
    return {name: value for name, value in given.items() if value is not None}


def _options(speeds: tuple[str, str] | None, harmonics: int | None) -> dict[str, Any]:
    """Interval and method as the analysis takes them."""
    from flipflow.periodic.options import HarmonicBalance  # noqa: PLC0415  quick --help

    options: dict[str, Any] = {}
    if speeds is not None:
        options["omega"] = speeds_of(speeds)
    if harmonics is not None:
        options["method"] = HarmonicBalance(harmonics)
    return options
