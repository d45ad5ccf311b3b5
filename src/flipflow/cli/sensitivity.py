"""``flipflow sensitivity``: which field of a machine matters most."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flipflow.cli.options import File, Force, Json, Output, Speed, Speeds, speed_of, speeds_of
from flipflow.cli.progress import progress

if TYPE_CHECKING:
    from flipflow.model.project import Project
    from flipflow.results.sensitivity import Sensitivity

POINTS = 100


def sensitivity(
    file: File,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="FIELD=RANGE",
            help='What varies, once a field: "clearance=5.4 mm..6.6 mm", "floating_mass=+-5 %", '
            '"shear_stiffness=2700 kN/m +/- 90 kN/m".',
        ),
    ] = None,
    quantity: Annotated[
        str, typer.Option("--quantity", metavar="NAME", help="What it matters to.")
    ] = "relative_amplitude",
    speed: Speed = None,
    speeds: Speeds = None,
    n: Annotated[int, typer.Option("--n", help="Groups of samples, best a power of two.")] = 1024,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the sample.")] = 0,
    branch: Annotated[
        str,
        typer.Option("--branch", help="Motion that is meant: from-below, upper or lower."),
    ] = "from-below",
    output: Output = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Rank the fields of a machine by what they do to a quantity (Sobol indices)."""
    from flipflow.io.project import load_project  # noqa: PLC0415  keeps --help quick
    from flipflow.io.vary import read_vary  # noqa: PLC0415

    project = load_project(file, force=force)
    for warning in project.warnings:
        typer.echo(f"Warning: {warning}", err=True)
    ranges = read_vary(vary or [], project.screen)
    omega = _omega(project, quantity, speed, speeds)
    if output is not None:
        from flipflow.io.files import prepare_folder  # noqa: PLC0415

        prepare_folder(output)
    options = {"n": n, "rng": seed, "branch": branch}
    result = _analysed((project.screen, ranges, quantity, omega), options)
    _show(result, output, json)


def _omega(
    project: Project, quantity: str, speed: str | None, speeds: tuple[str, str] | None
) -> Any:
    """Where the quantity is meant, rad/s, as the analysis takes it."""
    import numpy as np  # noqa: PLC0415  keeps --help quick

    from flipflow.analyses.response_quantities import (  # noqa: PLC0415
        ResponseQuantity,
        quantity_named,
    )
    from flipflow.errors import InputError  # noqa: PLC0415

    whole = isinstance(quantity_named(quantity), ResponseQuantity)
    if speed is not None and (speeds is not None or whole):
        other = f"{quantity} belongs to the whole response" if whole else "--speeds is given, too"
        raise InputError("--speed", speed, f"{other}, leave it out")
    if speeds is not None:
        interval = speeds_of(speeds)
        return interval if whole else np.linspace(*interval, POINTS)
    return None if whole else speed_of(project, speed)


def _analysed(question: tuple[Any, ...], options: dict[str, Any]) -> Sensitivity:
    """Analyse with progress on stderr."""
    from flipflow.analyses.sensitivity import sensitivity as analysis  # noqa: PLC0415

    with progress("starting") as tell:
        return analysis(*question, monitor=tell, **options)


def _show(result: Sensitivity, output: Path | None, json: str | None) -> None:
    from flipflow.cli.output import console, write_json  # noqa: PLC0415  keeps --help quick

    written = _written(result, output) if output is not None else ""
    if json is not None:
        from flipflow.io.results import document_of  # noqa: PLC0415  loads every analysis

        write_json(document_of(result), json)
    if json != "-":
        from flipflow.report import summary  # noqa: PLC0415

        out = console()
        summary(result, out)
        if written:
            out.print(written, soft_wrap=True)


def _written(result: Sensitivity, folder: Path) -> str:
    """Write results and figures; the sentence that says where."""
    from flipflow.figures.sensitivity import sensitivity_figure, tornado_figure  # noqa: PLC0415
    from flipflow.io.results import save  # noqa: PLC0415

    save(result, folder / "results.json")
    names = ["results.json", "sensitivity.html"]
    sensitivity_figure(result).write(folder / "sensitivity.html")
    if not result.over_frequency:
        tornado_figure(result).write(folder / "tornado.html")
        names.append("tornado.html")
    return f"Written to {folder}: {', '.join(names)}"
