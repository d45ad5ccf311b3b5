"""``flipflow reproduce``: the paper's figures, and a verdict on every claim."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flipflow.cli.options import Json, Output

if TYPE_CHECKING:
    from rich.console import Console

    from flipflow.analyses.monitor import Monitor
    from flipflow.paper.reproduce import Reproduction

FOLDER = Path("reproduction")


def reproduce(
    figures: Annotated[
        list[str] | None,
        typer.Argument(metavar="[FIGURE]...", help="figure-08, or 8; all where none is named."),
    ] = None,
    output: Output = None,
    json: Json = None,
    machine: Annotated[
        str, typer.Option("--machine", metavar="FILE", help="Another machine file.")
    ] = "ffs0827",
) -> None:
    """Reproduce the paper: its figures, and every claim decided by computing it."""
    from flipflow.cli.output import console, write_json  # noqa: PLC0415  keeps --help quick
    from flipflow.io.files import prepare_folder  # noqa: PLC0415
    from flipflow.io.project import load  # noqa: PLC0415
    from flipflow.paper.registry import chosen  # noqa: PLC0415

    names = tuple(figures or ())
    chosen(names)
    screen = load(machine)
    folder = output or FOLDER
    prepare_folder(folder)

    from flipflow.cli.progress import with_progress  # noqa: PLC0415
    from flipflow.paper.page import write_reproduction  # noqa: PLC0415
    from flipflow.paper.reproduce import reproduce as reproduced  # noqa: PLC0415

    def run(monitor: Monitor) -> tuple[Reproduction, tuple[str, ...]]:
        found = reproduced(screen, names, monitor)
        return found, write_reproduction(found, folder, monitor)

    found, written = with_progress(run)
    if json is not None:
        write_json(found.document(), json)
    if json != "-":
        _show(found, console(), folder, written)


def _show(found: Reproduction, out: Console, folder: Path, written: tuple[str, ...]) -> None:
    from rich.table import Table  # noqa: PLC0415  slow to import
    from rich.text import Text  # noqa: PLC0415

    from flipflow.paper.page import STATES  # noqa: PLC0415  keeps --help quick
    from flipflow.report.terminal import STYLES  # noqa: PLC0415

    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
    for title in ("Claim", "Verdict", "Statement"):
        table.add_column(title, no_wrap=title != "Statement")
    for one in found.claims:
        verdict = one.evaluation.verdict
        shown = Text(str(verdict), STYLES[STATES[verdict]])
        table.add_row(one.claim.id, shown, one.claim.statement)
    out.print(table)
    out.print()
    out.print(", ".join(f"{n} {verdict}" for verdict, n in found.counts.items() if n) + ".")
    for figure in found.figures:
        if figure.failure:
            out.print(f"{figure.name} is not drawn. {figure.failure}", style="yellow")
    pictures = (len(written) - 1) // 3
    out.print(
        f"Written to {folder}: {written[0]}, and {pictures} figures as HTML, SVG and PDF",
        soft_wrap=True,
    )
