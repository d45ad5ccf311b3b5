"""``flipflow simulate``: a motion over time at constant speed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import typer

from flipflow.cli.options import RPM, File, Force, Json, Output, Speed, speed_of
from flipflow.cli.progress import progress

if TYPE_CHECKING:
    from rich.console import Console

    from flipflow.model.project import Project
    from flipflow.results.history import History


def simulate(
    file: File,
    speed: Speed = None,
    periods: Annotated[
        int, typer.Option("--periods", metavar="N", help="Turns of the shaft.")
    ] = 200,
    impulse: Annotated[
        list[str] | None,
        typer.Option(
            "--impulse", metavar="BLOW", help="A blow, '2 s: main 300' in kg m/s; may be repeated."
        ),
    ] = None,
    output: Output = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Run a machine from rest at constant speed: motion, stop force, energies."""
    from flipflow.analyses.simulate import simulate as run  # noqa: PLC0415  keeps --help quick
    from flipflow.cli.output import console, write_json  # noqa: PLC0415
    from flipflow.io.blows import parse_blow  # noqa: PLC0415
    from flipflow.io.files import prepare_folder  # noqa: PLC0415
    from flipflow.io.project import load_project  # noqa: PLC0415

    project = load_project(file, force=force)
    omega = speed_of(project, speed)
    blows = tuple(parse_blow(one, "--impulse") for one in impulse or ())
    if output is not None:
        prepare_folder(output)
    with progress("simulating; the first run of a version compiles") as tell:
        history = run(project.screen, omega, periods, disturbances=blows, monitor=tell)
    if json is not None:
        from flipflow.io.results import document_of  # noqa: PLC0415  loads every analysis

        write_json(document_of(history), json)
    if output is not None:
        from flipflow.figures.history import history_figure  # noqa: PLC0415  loads plotly

        history_figure(history).write(output / "motion.html")
    if json != "-":
        _show(project, history, console())


def _show(project: Project, history: History, out: Console) -> None:
    omega = float(history.omega[-1])
    last = history.t >= history.t[-1] - 2.0 * math.pi / omega
    out.print(
        f"{project.document.name or project.name} at {omega * RPM:.4g} rpm, "
        f"{history.t[-1]:.4g} s from rest",
        style="bold",
    )
    if history.distance is None:
        out.print("No periodic motion lies near the end: the motion has not settled.")
    else:
        word = "Settled" if history.settled else "Not settled yet"
        out.print(f"{word}: {history.distance * 1e3:.2g} mm from the periodic motion ahead.")
    out.print(f"{'':<24}{'last turn':>14}{'greatest':>14}")
    for name in history.system.named:
        x = history.displacement(name) * 1e3
        half = (x[last].max() - x[last].min()) / 2.0
        out.print(f"  {name!s:<22}{half:>11.3f} mm{abs(x).max():>11.3f} mm")
    if history.force.shape[1]:
        force = abs(history.stop_force()) / 1e3
        out.print(f"  {'stop force':<22}{force[last].max():>11.3f} kN{force.max():>11.3f} kN")
    e = history.energy
    names = ("input", "impulses", "loads", "dissipated", "stored")
    out.print("Energy: " + ", ".join(f"{n} {e[n] / 1e3:.4g} kJ" for n in names if e[n]))
