"""``flipflow basins``: on which motion the machine settles, and what throws it off."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flipflow.cli.options import File, Force, Json, Output, Speed, speed_of
from flipflow.cli.progress import progress, stoppable

if TYPE_CHECKING:
    from rich.console import Console

    from flipflow.analyses.jump_risk import JumpRisk
    from flipflow.model.screen import FlipFlowScreen
    from flipflow.results.basins import Basins

CELLS = 80
MOST_CELLS_ASIDE = 1000
WINDOW = 2.0


def basins(
    file: File,
    speed: Speed = None,
    cells: Annotated[
        int, typer.Option("--cells", metavar="N", help="N x N starting states.")
    ] = CELLS,
    output: Output = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Show on which motion a machine settles, and what throws it off."""
    from flipflow.cli.output import console, write_json  # noqa: PLC0415  keeps --help quick
    from flipflow.errors import Cancelled, InputError  # noqa: PLC0415
    from flipflow.io.files import prepare_folder  # noqa: PLC0415
    from flipflow.io.project import load_project  # noqa: PLC0415

    project = load_project(file, force=force)
    omega = speed_of(project, speed)
    if not 2 <= cells <= MOST_CELLS_ASIDE:
        raise InputError("--cells", cells, f"give a whole number from 2 to {MOST_CELLS_ASIDE}")
    folder = output or Path(f"{project.name}-flipflow")
    prepare_folder(folder)
    found, risk = _computed(project.screen, omega, cells)

    from flipflow.figures.dispatch import figure  # noqa: PLC0415  keeps --help quick

    document = _document(found, risk)
    figure(found).write(folder / "basins.html")
    write_json(document, str(folder / "basins.json"))
    if json is not None:
        write_json(document, json)
    if json != "-":
        _show(found, risk, console())
        console().print(f"Written to {folder}: basins.html, basins.json", soft_wrap=True)
    if not found.complete:
        raise Cancelled("Stopped by the user; the cells that were finished are written.")


def _computed(screen: FlipFlowScreen, omega: float, cells: int) -> tuple[Basins, JumpRisk | None]:
    """Basins, then the jump risk unless the user stopped the run."""
    from flipflow.analyses.basins import basins as basins_of  # noqa: PLC0415  keeps --help quick
    from flipflow.analyses.jump_risk import jump_risk  # noqa: PLC0415
    from flipflow.methods.warm import compile_ahead  # noqa: PLC0415

    with progress("starting") as monitor:
        compile_ahead(lambda seconds: monitor(f"compiling, once per version: {seconds:.0f} s", 0.0))
        x, v = _window(screen, omega, cells)
        with stoppable(monitor, "cells") as told:
            found = basins_of(screen, omega, {"relative": x}, {"relative": v}, monitor=told)
        risk = jump_risk(screen, omega, monitor=monitor) if found.complete else None
    return found, risk


def _window(screen: FlipFlowScreen, omega: float, cells: int) -> tuple[Any, Any]:
    """Relative states up to twice the largest motion's displacement and velocity."""
    import numpy as np  # noqa: PLC0415  keeps --help quick

    from flipflow.analyses.periodic_orbits import periodic_orbits  # noqa: PLC0415

    orbits = periodic_orbits(screen, omega)
    reach = max(float(np.abs(orbit.displacement("relative")).max()) for orbit in orbits)
    speed = max(float(np.abs(orbit.velocity("relative")).max()) for orbit in orbits)
    share = np.linspace(-WINDOW, WINDOW, cells)
    return reach * share, speed * share


def _document(found: Basins, risk: JumpRisk | None) -> dict[str, Any]:
    from flipflow.io.jump_risk import risk_summary  # noqa: PLC0415  keeps --help quick
    from flipflow.io.results import document_of  # noqa: PLC0415

    return document_of(found) | {"jump_risk": None if risk is None else risk_summary(risk)}


def _show(found: Basins, risk: JumpRisk | None, out: Console) -> None:
    from flipflow.report.jump_risk import millimetres, risk_words  # noqa: PLC0415  quick --help
    from flipflow.report.numbers import speed  # noqa: PLC0415

    count = len(found.orbits)
    motions = f"{count} motion{'' if count == 1 else 's'}" if count else "no motion"
    out.print(f"{speed(found.omega)}: {motions} the machine can settle on", style="bold")
    out.print()
    for orbit, share, (low, high) in zip(
        found.orbits, found.shares, found.share_intervals, strict=True
    ):
        out.print(
            f"{millimetres(orbit):>8} relative amplitude: {100 * share:5.1f} % of the starting "
            f"states ({100 * low:.1f} to {100 * high:.1f} %)"
        )
    for note in found.notes:
        out.print(f"Note: {note}", style="yellow")
    if risk is not None:
        out.print()
        for line in risk_words(risk):
            out.print(line)
