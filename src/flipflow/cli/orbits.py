"""``flipflow orbits``: every motion possible at one speed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

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
from flipflow.model.numerals import rpm

if TYPE_CHECKING:
    from rich.console import Console

    from flipflow.periodic.orbit import Orbit

AFTER = "after a small disturbance"


def orbits(
    file: File,
    speed: Speed = None,
    max_periods: Annotated[
        int, whole("--max-periods", "N", 1, 12, "Turns after which one may repeat.")
    ] = 6,
    case: Case = None,
    output: Output = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """List every motion found at a speed, lasting or not.

    A motion is one that repeats itself after one or more turns of the shaft.
    """
    from flipflow.io.project import load_project  # noqa: PLC0415
    from flipflow.studies.periodic_orbits import periodic_orbits  # noqa: PLC0415  quick --help

    project = in_case(load_project(file, force=force), case, speed)
    omega = speed_of(project, speed)
    with Destination(output, json, [file]) as target:
        with progress("searching; the first run of a version compiles") as tell:
            found = periodic_orbits(project.screen, omega, max_periods, monitor=tell)
        if output is not None:
            from flipflow.plotting.motion import orbit_figure  # noqa: PLC0415  loads plotly

            for k, orbit in enumerate(found, 1):
                target.picture(f"motion-{k}.html", orbit_figure(orbit), marked(project, case))
        title = title_of(project, case)
        target.result(found, name=title)
        target.finish(lambda out: _show(title, omega, found, out))


def _show(title: str, omega: float, found: tuple[Orbit, ...], out: Console) -> None:
    from flipflow.report.terminal import say  # noqa: PLC0415  keeps --help quick

    say(out, f"{printable(title)} at {rpm(omega)} rpm: {_count(found)}", "bold")
    if found:
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


def _count(found: tuple[Orbit, ...]) -> str:
    """How many motions there are, and how many of them last."""
    from flipflow.periodic.stability import RETURNS  # noqa: PLC0415  keeps --help quick

    lasting = sum(orbit.stable for orbit in found)
    if not found:
        return "no motion that repeats itself was found"
    if len(found) == 1:
        return f"1 motion, which {RETURNS[found[0].stability]} {AFTER}"
    return (
        f"{len(found)} motions, {lasting} of them {'returns' if lasting == 1 else 'return'} {AFTER}"
    )
