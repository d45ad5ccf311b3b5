"""``flipflow analyze``: from a machine file to a verdict, a report and the numbers behind it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from flipflow.cli.options import File, Force, Json, Output, Speeds, speeds_of


def analyze(
    file: File,
    output: Output = None,
    json: Json = None,
    speeds: Speeds = None,
    harmonics: Annotated[
        int | None,
        typer.Option("--harmonics", metavar="H", help="Harmonic balance instead of exact motion."),
    ] = None,
    force: Force = False,
) -> None:
    """Analyze a machine: verdict, allowed speed range, report."""
    from flipflow.cli.output import console, write_json  # noqa: PLC0415  keeps --help quick
    from flipflow.io.project import load_project  # noqa: PLC0415

    project = load_project(file, force=force)
    folder = output or Path(f"{project.name}-flipflow")
    from flipflow.io.files import prepare_folder  # noqa: PLC0415

    options = _options(speeds, harmonics)
    prepare_folder(folder)
    from flipflow.analyses.assessment import assess  # noqa: PLC0415
    from flipflow.cli.progress import with_progress  # noqa: PLC0415

    assessment = with_progress(lambda monitor: assess(project, monitor, **options))

    from flipflow.io.assessment import assessment_document  # noqa: PLC0415
    from flipflow.io.response import write_response  # noqa: PLC0415
    from flipflow.report.html import write_html  # noqa: PLC0415
    from flipflow.report.terminal import summary  # noqa: PLC0415

    document = assessment_document(assessment)
    write_html(assessment, folder / "report.html")
    write_json(document, str(folder / "results.json"))
    written = write_response(assessment, folder)
    if json is not None:
        write_json(document, json)
    if json != "-":
        out = console()
        summary(assessment, out)
        names = ", ".join(["report.html", "results.json", *written])
        out.print(f"Written to {folder}: {names}", soft_wrap=True)


def _options(speeds: tuple[str, str] | None, harmonics: int | None) -> dict[str, Any]:
    """Interval and method as the analysis takes them."""
    from flipflow.methods.options import HarmonicBalance  # noqa: PLC0415  quick --help

    options: dict[str, Any] = {}
    if speeds is not None:
        options["omega"] = speeds_of(speeds)
    if harmonics is not None:
        options["method"] = HarmonicBalance(harmonics)
    return options
