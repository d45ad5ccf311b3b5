"""``flipflow simulate``: a motion over time at constant speed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import typer

from flipflow.cli.destination import Destination
from flipflow.cli.options import (
    Case,
    File,
    Force,
    Json,
    Output,
    Speed,
    in_case,
    marked,
    speed_of,
    title_of,
    whole,
)
from flipflow.cli.output import printable
from flipflow.cli.progress import progress
from flipflow.errors import InputError
from flipflow.model.numerals import rpm

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from flipflow.model.disturbance import Impulse
    from flipflow.transient.history import History

IMPULSE = "--impulse"
MOST_TURNS = 100_000  # 128 points a turn are calculated
MOST_ROWS = 50_000  # of a document, some 30 MB


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
    case: Case = None,
    output: Output = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Run a machine from rest at constant speed.

    Shows the motion, the stop force, the energies, and whether the machine has settled.
    """
    from flipflow.io.project import load_project  # noqa: PLC0415
    from flipflow.report.terminal import say  # noqa: PLC0415
    from flipflow.transient.history import thinned  # noqa: PLC0415
    from flipflow.transient.simulate import simulate as run  # noqa: PLC0415  keeps --help quick

    project = load_project(file, force=force)
    omega = speed_of(project, speed)
    blows = _blows(impulse or (), periods * 2.0 * math.pi / omega)
    project = in_case(project, case, speed)
    with Destination(output, json, [file]) as target:
        with progress("simulating; the first run of a version compiles") as tell:
            history = run(project.screen, omega, periods, disturbances=blows, monitor=tell)
        title, kept = title_of(project, case), history
        if output is not None:
            from flipflow.plotting.history import history_figure  # noqa: PLC0415  loads plotly

            target.picture("motion.html", history_figure(history), marked(project, case))
        if json is not None:
            kept = thinned(history, MOST_ROWS)
            target.result(kept, name=title)

        def show(out: Console) -> None:
            _show(title, history, blows, out)
            if kept is not history:
                say(out, f"The document is thinned. {kept.notes[-1]}")

        target.finish(show)


def _blows(written: Sequence[str], end: float) -> tuple[Impulse, ...]:
    from flipflow.io.blows import parse_blow  # noqa: PLC0415  keeps --help quick

    blows = tuple(parse_blow(one, IMPULSE) for one in written)
    for one, blow in zip(written, blows, strict=True):
        if blow.t >= end:
            raise InputError(IMPULSE, one, f"give a time before the end, {end:.4g} s")
    return blows


def _spans(history: History, blows: Sequence[Impulse]) -> dict[str, slice]:
    """The rows of the start from rest, and those from the first blow on."""
    blow = min((one.t for one in blows), default=math.inf)
    first = int(history.t.searchsorted(blow))
    if first >= history.t.size:
        return {"start": slice(None)}
    return {"start": slice(0, max(first, 1)), "blow": slice(first, None)}


def _show(title: str, history: History, blows: Sequence[Impulse], out: Console) -> None:
    import numpy as np  # noqa: PLC0415  keeps --help quick

    from flipflow.report.terminal import say  # noqa: PLC0415
    from flipflow.transient.speed_run import turning_points  # noqa: PLC0415

    omega = float(history.omega[-1])
    run = round(history.angle[-1] / (2.0 * math.pi))
    turns = min(history.repeats_after or 1, max(run, 1))
    begin = history.t[-1] - turns * 2.0 * math.pi / omega
    head = f"{printable(title)} at {rpm(omega)} rpm"
    say(out, f"{head}, {history.t[-1]:.4g} s from rest", "bold")
    if history.distance is None:
        out.print("No periodic motion lies near the end: the motion has not settled.")
    else:
        word = "Settled" if history.settled else "Not settled yet"
        periods = history.repeats_after or 1
        again = f", which repeats after {periods} turns" if periods > 1 else ""
        away = f"{word}: {history.distance * 1e3:.2g} mm from the periodic motion ahead"
        say(out, f"{away}{again}.")
    spans = _spans(history, blows)
    parts = [history.t[rows] for rows in spans.values()]
    heads = "".join(f"{f'{name}, greatest':>20}" for name in spans)
    last = "last turn" if turns == 1 else f"last {turns} turns"
    out.print(f"{'':<18}{last:>14}{heads}")
    for which in history.system.named:
        x = history.displacement(which)
        x = x - x[0]
        times, ends = turning_points(history.t, x, history.velocity(which))
        t, x = np.append(history.t, times), np.append(x, ends)
        here = x[t >= begin]
        half = (here.max() - here.min()) / 2e-3
        reach = (abs(x[(t >= part[0]) & (t <= part[-1])]).max() for part in parts)
        most = "".join(f"{far * 1e3:>17.3f} mm" for far in reach)
        out.print(f"  {which!s:<16}{half:>11.3f} mm{most}")
    if history.force.shape[1]:
        force = (abs(history.force) if history.peak is None else history.peak)[:, 0] / 1e3
        most = "".join(f"{force[rows].max():>17.3f} kN" for rows in spans.values())
        # A row's peak is that since the row before.
        out.print(f"  {'stop force':<16}{force[history.t > begin].max():>11.3f} kN{most}")
    said = "half the way from end to end; greatest: farthest from where it began."
    say(out, f"{last.capitalize()}: {said}")
    e = history.energy
    names = ("input", "impulses", "loads", "dissipated", "stored")
    say(out, "Energy: " + ", ".join(f"{n} {e[n] / 1e3:.4g} kJ" for n in names if e[n]))
