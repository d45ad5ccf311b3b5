"""``flipflow analyze``: from a machine file to a verdict, a report and the numbers behind it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flipflow.cli.options import File, Folder, Force, Json, Speeds, speed_of, speeds_of, whole

if TYPE_CHECKING:
    from flipflow.cli.destination import Destination
    from flipflow.cli.kept_report import ReportKey
    from flipflow.studies.assessment import Assessment

    Formatted = Callable[[Assessment], Mapping[str, bytes | str]]

PDF = "report.pdf"


def analyze(
    file: File,
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
    """Analyze a machine: verdict, allowed speed range, report."""
    from flipflow.cli.destination import Destination  # noqa: PLC0415  keeps --help quick
    from flipflow.cli.kept_report import kept_in, key_of  # noqa: PLC0415
    from flipflow.io.project import load_project  # noqa: PLC0415

    project = load_project(file, force=force)
    if project.speed is not None:
        speed_of(project, None)
    options = _options(speeds, harmonics)
    folder = output or Path(f"{project.name}-flipflow")
    key = key_of(project, _written(speeds, harmonics))
    old = kept_in(folder, key, overwrite=overwrite)
    formats = _formats(paper or ("a4" if pdf else None), tables=tables)
    with Destination(folder, json, [file]) as target:
        target.replaces(old)
        from flipflow.cli.progress import with_progress  # noqa: PLC0415
        from flipflow.studies.assessment import assess  # noqa: PLC0415

        assessment = with_progress(lambda monitor: assess(project, monitor, **options))
        _write(assessment, target, key, formats)


def _written(speeds: tuple[str, str] | None, harmonics: int | None) -> dict[str, object]:
    """Options that change what is found, as they are written."""
    given = {"--speeds": speeds and " ".join(speeds), "--harmonics": harmonics}
    return {name: value for name, value in given.items() if value is not None}


def _formats(paper: str | None, *, tables: bool) -> dict[str, Formatted]:
    """What writes the report beside its page, by name; missing extras are seen at once."""
    from flipflow.report.html import require_templates  # noqa: PLC0415  keeps --help quick

    require_templates()
    formats: dict[str, Formatted] = {}
    if paper is not None:
        from flipflow.report.pdf import checked_paper, pdf, require_typst  # noqa: PLC0415

        checked_paper(paper, "--paper")
        require_typst()
        formats["pdf"] = lambda assessment: {PDF: pdf(assessment, paper)}
    if tables:
        from flipflow.io.spreadsheet import require_openpyxl  # noqa: PLC0415
        from flipflow.report.tables import table_files  # noqa: PLC0415

        require_openpyxl()
        formats["tables"] = table_files
    return formats


def _write(
    assessment: Assessment, target: Destination, key: ReportKey, formats: dict[str, Formatted]
) -> None:
    """The report, the numbers behind it, the summary in the terminal."""
    from flipflow.cli.kept_report import KEY, REPORT, RESULTS  # noqa: PLC0415  quick --help
    from flipflow.cli.output import console  # noqa: PLC0415
    from flipflow.io.response import NAMES, write_response  # noqa: PLC0415
    from flipflow.io.results import document_of  # noqa: PLC0415
    from flipflow.report.html import html  # noqa: PLC0415
    from flipflow.report.terminal import summary  # noqa: PLC0415

    document = document_of(assessment)
    more = {name: text for make in formats.values() for name, text in make(assessment).items()}
    files = (REPORT, RESULTS, *NAMES, *more)
    kept = {KEY: replace(key, files=files).document()}
    target.content(REPORT, html(assessment))
    target.wrote(REPORT)
    target.data(RESULTS, {"schema": document["schema"], **kept, **document})
    write_response(assessment, target.all_of(NAMES))
    target.wrote(*NAMES)
    for name, text in more.items():
        target.content(name, text)
    target.wrote(*_told(more))
    target.document(document)
    target.keep()
    if target.spoken:
        summary(assessment, console())
    target.tell()


def _told(names: Collection[str]) -> list[str]:
    """Names of files for the terminal; the many tables are counted."""
    from flipflow.report.tables import PREFIX  # noqa: PLC0415  keeps --help quick

    listed = [name for name in names if not name.startswith(PREFIX)]
    count = len(names) - len(listed)
    return [*listed, f"{PREFIX}*.csv ({count} tables)"] if count else listed


def _options(speeds: tuple[str, str] | None, harmonics: int | None) -> dict[str, Any]:
    """Interval and method as the analysis takes them."""
    from flipflow.periodic.options import HarmonicBalance  # noqa: PLC0415  quick --help

    options: dict[str, Any] = {}
    if speeds is not None:
        options["omega"] = speeds_of(speeds)
    if harmonics is not None:
        options["method"] = HarmonicBalance(harmonics)
    return options
