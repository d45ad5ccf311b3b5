"""``flipflow sensitivity``: which field of a machine matters most."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from flipflow.cli.destination import Destination
from flipflow.cli.options import (
    Case,
    File,
    Force,
    Json,
    Output,
    Speed,
    Speeds,
    in_case,
    marked,
    speed_of,
    speeds_of,
    title_of,
    whole,
)
from flipflow.cli.output import printable
from flipflow.cli.progress import progress
from flipflow.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console

    from flipflow.model.project import Project
    from flipflow.studies.sensitivity import Sensitivity

POINTS = 100
SAME_RUBBER = "the rubber of all variants is as warm; flipflow study finds that of each."


def sensitivity(
    file: File,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="FIELD=RANGE",
            help="What varies, once for each field: 'clearance=5.4 mm..6.6 mm', "
            "'floating_mass=+-5 %', 'shear_stiffness=2700 kN/m +/- 90 kN/m'.",
        ),
    ] = None,
    quantity: Annotated[
        str, typer.Option("--quantity", metavar="NAME", help="What it matters to.")
    ] = "relative_amplitude",
    speed: Speed = None,
    speeds: Speeds = None,
    n: Annotated[
        int, whole("--n", "N", 2, 2**20, "Groups of samples, best a power of two.")
    ] = 1024,
    seed: Annotated[int, whole("--seed", "N", 0, 2**63 - 1, "Seed of the sample.")] = 0,
    branch: Annotated[
        str,
        typer.Option(
            "--branch", metavar="WORD", help="Motion that is meant: from-below, upper or lower."
        ),
    ] = "from-below",
    case: Case = None,
    output: Output = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Rank a machine's fields by what they do to a quantity.

    By Sobol indices: the share of the variance that each field explains.
    """
    from flipflow.io.project import load_project  # noqa: PLC0415  keeps --help quick
    from flipflow.io.vary import read_vary  # noqa: PLC0415
    from flipflow.model.screen import as_cool_as_air, of_air  # noqa: PLC0415

    project = load_project(file, force=force)
    air = next((one for one in project.load_cases if one.name == case and of_air(one)), None)
    omega = _omega(project, quantity, speed, speeds, warming=air is not None)
    if air is not None:
        read_vary(vary or [], project.screen.loaded(as_cool_as_air(air)))
    project = in_case(project, case, speed)
    for warning in project.warnings:
        typer.echo(f"Warning: {warning}", err=True)
    if air is not None:
        typer.echo(f"Note: {SAME_RUBBER}", err=True)
    ranges = read_vary(vary or [], project.screen)
    options = {"n": n, "rng": seed, "branch": branch}
    with Destination(output, json, [file]) as target:
        result = _analysed((project.screen, ranges, quantity, omega), options)
        _write(result, target, title_of(project, case), marked(project, case))


def _omega(
    project: Project,
    quantity: str,
    speed: str | None,
    speeds: tuple[str, str] | None,
    *,
    warming: bool,
) -> Any:
    """Where the quantity is meant, rad/s, as the analysis takes it.

    The one speed may also be that at which the rubber is warming.
    """
    import numpy as np  # noqa: PLC0415  keeps --help quick

    from flipflow.model.quantities import quantity_named  # noqa: PLC0415

    whole = quantity_named(quantity, project.screen).of == "response"
    if speed is not None and not warming and (speeds is not None or whole):
        other = f"{quantity} belongs to the whole response" if whole else "--speeds is given, too"
        raise InputError("--speed", speed, f"{other}, leave it out")
    if speeds is not None:
        interval = speeds_of(speeds)
        return interval if whole else np.linspace(*interval, POINTS)
    return None if whole else speed_of(project, speed)


def _analysed(question: tuple[Any, ...], options: dict[str, Any]) -> Sensitivity:
    """Analyse with progress on stderr."""
    from flipflow.studies.sensitivity import sensitivity as analysis  # noqa: PLC0415

    with progress("starting") as tell:
        return analysis(*question, monitor=tell, **options)


def _write(result: Sensitivity, target: Destination, title: str, subject: str) -> None:
    from flipflow.io.results import document_of  # noqa: PLC0415  loads every analysis

    document = document_of(result) | {"name": title}
    if target.folder is not None:
        target.data("results.json", document)
        _write_figures(result, target, subject)
    target.document(document)

    def show(out: Console) -> None:
        from flipflow.report import summary  # noqa: PLC0415  keeps --help quick
        from flipflow.report.terminal import say  # noqa: PLC0415

        say(out, printable(title), "bold")
        summary(result, out)

    target.finish(show)


def _write_figures(result: Sensitivity, target: Destination, subject: str) -> None:
    from flipflow.plotting.sensitivity import sensitivity_figure, tornado_figure  # noqa: PLC0415

    target.picture("sensitivity.html", sensitivity_figure(result), subject)
    if not result.over_frequency:
        target.picture("tornado.html", tornado_figure(result), subject)
