"""``flipflow analyze``: from a machine file to a verdict, a report and the numbers behind it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from flipflow.cli.options import File, Folder, Force, Json, Speeds, speed_of, speeds_of, whole

if TYPE_CHECKING:
    from flipflow.cli.destination import Destination
    from flipflow.studies.assessment import Assessment


def analyze(
    file: File,
    output: Folder = None,
    json: Json = None,
    speeds: Speeds = None,
    harmonics: Annotated[
        int | None,
        whole("--harmonics", "H", 1, 200, "Harmonic balance instead of exact motion."),
    ] = None,
    force: Force = False,
) -> None:
    """Analyze a machine: verdict, allowed speed range, report."""
    from flipflow.cli.destination import Destination  # noqa: PLC0415  keeps --help quick
    from flipflow.io.project import load_project  # noqa: PLC0415

    project = load_project(file, force=force)
    if project.speed is not None:
        speed_of(project, None)
    options = _options(speeds, harmonics)
    with Destination(output or Path(f"{project.name}-flipflow"), json, [file]) as target:
        from flipflow.report.html import require_templates  # noqa: PLC0415

        require_templates()
        from flipflow.cli.progress import with_progress  # noqa: PLC0415
        from flipflow.studies.assessment import assess  # noqa: PLC0415

        assessment = with_progress(lambda monitor: assess(project, monitor=monitor, **options))
        _write(assessment, target)


def _write(assessment: Assessment, target: Destination) -> None:
    """The report, the numbers behind it, the summary in the terminal."""
    from flipflow.cli.output import console  # noqa: PLC0415  keeps --help quick
    from flipflow.io.response import NAMES, write_response  # noqa: PLC0415
    from flipflow.io.results import document_of  # noqa: PLC0415
    from flipflow.report.html import write_html  # noqa: PLC0415
    from flipflow.report.terminal import summary  # noqa: PLC0415

    document = document_of(assessment)
    write_html(assessment, target.path("report.html"))
    target.wrote("report.html")
    target.data("results.json", document)
    write_response(assessment, target.all_of(NAMES))
    target.wrote(*NAMES)
    target.document(document)
    if target.spoken:
        summary(assessment, console())
    target.tell()


def _options(speeds: tuple[str, str] | None, harmonics: int | None) -> dict[str, Any]:
    """Interval and method as the analysis takes them."""
    from flipflow.periodic.options import HarmonicBalance  # noqa: PLC0415  quick --help

    options: dict[str, Any] = {}
    if speeds is not None:
        options["omega"] = speeds_of(speeds)
    if harmonics is not None:
        options["method"] = HarmonicBalance(harmonics)
    return options
