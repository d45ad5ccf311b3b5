"""``flipflow simulate``: a motion over time at constant speed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import typer

from flipflow.cli.options import RPM, File, Force, Json, Output, Speed, speed_of, whole
from flipflow.cli.output import console, printable
from flipflow.cli.progress import progress

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from flipflow.model.disturbance import Impulse
    from flipflow.model.project import Project
    from flipflow.transient.history import History

IMPULSE = "--impulse"
MOST_TURNS = 100_000  # 128 points a turn are kept


def simulate(
    file: File,
    speed: Speed = None,
    periods: Annotated[int, whole("--periods", "N", 1, MOST_TURNS, "Turns of the shaft.")] = 200,
    impulse: Annotated[
        list[str] | None,
        typer.Option(
            IMPULSE, metavar="BLOW", help="A blow, '2 s: main 300' in kg m/s; may be repeated."
        ),
    ] = None,
    output: Output = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Run a machine from rest at constant speed.

    Shows the motion, the stop force, the energies, and whether the machine has settled.
    """
    from flipflow.cli.destination import Destination  # noqa: PLC0415
    from flipflow.io.project import load_project  # noqa: PLC0415
    from flipflow.transient.simulate import simulate as run  # noqa: PLC0415  keeps --help quick

    project = load_project(file, force=force)
    omega = speed_of(project, speed)
    blows = _blows(impulse or (), periods * 2.0 * math.pi / omega)
    with Destination(output, json, [file]) as target:
        with progress("simulating; the first run of a version compiles") as tell:
            history = run(project.screen, omega, periods, disturbances=blows, monitor=tell)
        if output is not None:
            from flipflow.plotting.history import history_figure  # noqa: PLC0415  loads plotly

            target.picture("motion.html", history_figure(history))
        if json is not None:
            from flipflow.io.results import document_of  # noqa: PLC0415  loads every analysis

            target.document(document_of(history))
        target.keep()
        if target.spoken:
            _show(project, history, console())
        target.tell()


def _blows(written: Sequence[str], end: float) -> tuple[Impulse, ...]:
    from flipflow.errors import InputError  # noqa: PLC0415  keeps --help quick
    from flipflow.io.blows import parse_blow  # noqa: PLC0415

    blows = tuple(parse_blow(one, IMPULSE) for one in written)
    for one, blow in zip(written, blows, strict=True):
        if blow.t >= end:
            raise InputError(IMPULSE, one, f"give a time before the end, {end:.4g} s")
    return blows


def _show(project: Project, history: History, out: Console) -> None:
    from flipflow.report.terminal import say  # noqa: PLC0415  keeps --help quick

    omega = float(history.omega[-1])
    last = history.t >= history.t[-1] - 2.0 * math.pi / omega
    name = printable(project.document.name or project.name)
    say(out, f"{name} at {omega * RPM:.4g} rpm, {history.t[-1]:.4g} s from rest", "bold")
    if history.distance is None:
        out.print("No periodic motion lies near the end: the motion has not settled.")
    else:
        word = "Settled" if history.settled else "Not settled yet"
        out.print(f"{word}: {history.distance * 1e3:.2g} mm from the periodic motion ahead.")
    out.print(f"{'':<24}{'last turn':>14}{'greatest':>14}")
    for which in history.system.named:
        x = history.displacement(which) * 1e3
        half = (x[last].max() - x[last].min()) / 2.0
        out.print(f"  {which!s:<22}{half:>11.3f} mm{abs(x).max():>11.3f} mm")
    if history.force.shape[1]:
        force = abs(history.stop_force()) / 1e3
        out.print(f"  {'stop force':<22}{force[last].max():>11.3f} kN{force.max():>11.3f} kN")
    e = history.energy
    names = ("input", "impulses", "loads", "dissipated", "stored")
    say(out, "Energy: " + ", ".join(f"{n} {e[n] / 1e3:.4g} kJ" for n in names if e[n]))
