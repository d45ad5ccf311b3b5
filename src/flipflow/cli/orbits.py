"""``flipflow orbits``: every motion possible at one speed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from flipflow.cli.options import RPM, File, Force, Json, Output, Speed, speed_of
from flipflow.cli.progress import progress

if TYPE_CHECKING:
    from rich.console import Console

    from flipflow.model.project import Project
    from flipflow.results.orbit import Orbit


def orbits(
    file: File,
    speed: Speed = None,
    max_periods: Annotated[
        int, typer.Option("--max-periods", metavar="N", help="Turns after which one may repeat.")
    ] = 6,
    output: Output = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """List every periodic motion found at a speed, whether it lasts or not."""
    from flipflow.analyses.periodic_orbits import periodic_orbits  # noqa: PLC0415  quick --help
    from flipflow.cli.output import console, write_json  # noqa: PLC0415
    from flipflow.io.files import prepare_folder  # noqa: PLC0415
    from flipflow.io.project import load_project  # noqa: PLC0415

    project = load_project(file, force=force)
    omega = speed_of(project, speed)
    if output is not None:
        prepare_folder(output)
    with progress("searching; the first run of a version compiles") as tell:
        found = periodic_orbits(project.screen, omega, max_periods, monitor=tell)
    if json is not None:
        from flipflow.io.results import document_of  # noqa: PLC0415  loads every analysis

        write_json(document_of(found), json)
    if output is not None:
        from flipflow.figures.motion import orbit_figure  # noqa: PLC0415  loads plotly

        for k, orbit in enumerate(found, 1):
            orbit_figure(orbit).write(output / f"motion-{k}.html")
    if json != "-":
        _show(project, omega, found, console())


def _show(project: Project, omega: float, found: tuple[Orbit, ...], out: Console) -> None:
    lasting = sum(orbit.stable for orbit in found)
    motions = "1 motion" if len(found) == 1 else f"{len(found)} motions"
    word = "returns" if lasting == 1 else "return"
    out.print(
        f"{project.document.name or project.name} at {omega * RPM:.4g} rpm: {motions}, "
        f"{lasting} of them {word} after a small disturbance",
        style="bold",
    )
    out.print(
        f"{'':>3}{'relative':>12}{'main':>12}{'floating':>12}  {'repeats after':<15}{'returns'}"
    )
    for k, orbit in enumerate(found, 1):
        sizes = "".join(
            f"{orbit.amplitude(name) * 1e3:>9.3f} mm" for name in ("relative", "main", "floating")
        )
        turns = "1 turn" if orbit.periods == 1 else f"{orbit.periods} turns"
        word = {"stable": "yes", "unstable": "no"}.get(orbit.stability, "undetermined")
        out.print(f"{k:>2} {sizes}  {turns:<15}{word}")
    out.print("A search, not a proof: what is rare and weak can be missed.")
