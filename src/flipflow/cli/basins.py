"""``flipflow basins``: on which motion the machine settles, and what throws it off."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from flipflow.cli.destination import Destination
from flipflow.cli.options import (
    Case,
    File,
    Folder,
    Force,
    Json,
    Speed,
    in_case,
    marked,
    speed_of,
    title_of,
    whole,
)
from flipflow.cli.output import printable
from flipflow.cli.progress import compile_first, progress, stoppable
from flipflow.errors import IncompleteError
from flipflow.model.numerals import rpm

if TYPE_CHECKING:
    from rich.console import Console

    from flipflow.model.screen import FlipFlowScreen
    from flipflow.studies.basins import Basins
    from flipflow.studies.jump_risk import JumpRisk

CELLS = 80
WINDOW = 2.0


def basins(
    file: File,
    speed: Speed = None,
    cells: Annotated[int, whole("--cells", "N", 2, 1000, "N x N starting states.")] = CELLS,
    case: Case = None,
    output: Folder = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Show on which motion a machine settles, and what throws it."""
    from flipflow.io.project import load_project  # noqa: PLC0415  keeps --help quick

    project = in_case(load_project(file, force=force), case, speed)
    omega = speed_of(project, speed)
    with Destination(output or Path(f"{project.name}-flipflow"), json, [file]) as target:
        found, risk, reason, stopped = _computed(project.screen, omega, cells)

        from flipflow.plotting.dispatch import figure  # noqa: PLC0415  keeps --help quick

        title = title_of(project, case)
        document = {**_document(found, risk), "name": title}
        target.picture("basins.html", figure(found), marked(project, case))
        target.data("basins.json", document)
        target.document(document)
        target.finish(lambda out: _show(title, found, risk, reason, out))
        if stopped:
            raise target.stopped()


def _computed(
    screen: FlipFlowScreen, omega: float, cells: int
) -> tuple[Basins, JumpRisk | None, str, bool]:
    """Basins, then the jump risk, or why there is none: basins that are found are not lost.

    The last is whether Ctrl-C has ended it.
    """
    from flipflow.studies.basins import basins as basins_of  # noqa: PLC0415  keeps --help quick
    from flipflow.studies.jump_risk import jump_risk  # noqa: PLC0415

    with progress("starting") as monitor:
        compile_first(monitor)
        x, v = _window(screen, omega, cells)
        with stoppable(monitor, "cells") as told:
            found = basins_of(screen, omega, {"relative": x}, {"relative": v}, monitor=told)
        if told.asked:
            return found, None, "", True
        try:
            return found, jump_risk(screen, omega, monitor=monitor), "", False
        except IncompleteError as error:
            return found, None, str(error), False


def _window(screen: FlipFlowScreen, omega: float, cells: int) -> tuple[Any, Any]:
    """Relative states up to twice the largest motion's displacement and velocity."""
    import numpy as np  # noqa: PLC0415  keeps --help quick

    from flipflow.studies.periodic_orbits import (  # noqa: PLC0415
        MOST_PERIODS,
        periodic_orbits,
    )

    orbits = periodic_orbits(screen, omega) or periodic_orbits(screen, omega, MOST_PERIODS)
    if not orbits:
        raise IncompleteError(
            f"No motion that repeats itself was found at {rpm(omega)} rpm, so there is none "
            "to settle on: try another --speed, or see with flipflow simulate what the machine "
            "does."
        )
    reach = max(float(np.abs(orbit.displacement("relative")).max()) for orbit in orbits)
    speed = max(float(np.abs(orbit.velocity("relative")).max()) for orbit in orbits)
    share = np.linspace(-WINDOW, WINDOW, cells)
    return reach * share, speed * share


def _document(found: Basins, risk: JumpRisk | None) -> dict[str, Any]:
    from flipflow.io.results import document_of  # noqa: PLC0415  keeps --help quick

    return document_of(found) | {"jump_risk": None if risk is None else document_of(risk)}


def _show(title: str, found: Basins, risk: JumpRisk | None, reason: str, out: Console) -> None:
    from flipflow.report.jump_risk import millimetres, risk_words  # noqa: PLC0415  quick --help
    from flipflow.report.numbers import speed  # noqa: PLC0415
    from flipflow.report.terminal import say  # noqa: PLC0415

    count = len(found.orbits)
    motions = f"{count} motion{'' if count == 1 else 's'}" if count else "no motion"
    head = f"{printable(title)} at {speed(found.omega)}"
    say(out, f"{head}: {motions} the machine can settle on", "bold")
    out.print()
    for orbit, share, (low, high) in zip(
        found.orbits, found.shares, found.share_intervals, strict=True
    ):
        say(
            out,
            f"{millimetres(orbit):>8} relative amplitude: {100 * share:5.1f} % of the starting "
            f"states ({100 * low:.1f} to {100 * high:.1f} %)",
        )
    for note in (*found.notes, *([f"No jump risk: {reason}"] if reason else [])):
        say(out, f"Note: {note}", "yellow")
    if risk is not None:
        out.print()
        for line in risk_words(risk):
            say(out, line)
