"""``flipflow reproduce``: the paper's figures, and a verdict on every claim."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flipflow.cli.destination import Destination
from flipflow.cli.options import Json, Output
from flipflow.cli.progress import with_progress

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rich.console import Console

    from flipflow.model.monitor import Monitor
    from flipflow.model.screen import FlipFlowScreen
    from flipflow.paper.claims import DecidedClaim, Verdict
    from flipflow.paper.reproduce import ReproducedFigure, Reproduction

FOLDER = Path("reproduction")


def reproduce(
    figures: Annotated[
        list[str] | None,
        typer.Argument(metavar="FIGURE", help="figure-08, or 8; all where none is named."),
    ] = None,
    output: Output = None,
    json: Json = None,
    machine: Annotated[
        str, typer.Option("--machine", metavar="FILE", help="Another machine file.")
    ] = "ffs0827",
) -> None:
    """Reproduce the paper: its figures, a verdict on each claim."""
    from flipflow.io.project import load  # noqa: PLC0415  keeps --help quick
    from flipflow.paper.registry import chosen  # noqa: PLC0415

    names = tuple(figures or ())
    wanted = chosen(names)
    screen = load(machine)
    folder = output or FOLDER
    with Destination(folder, json, [machine]) as target:
        from flipflow.paper.page import ENDINGS, PAGE, write_page  # noqa: PLC0415
        from flipflow.report.html import require_templates  # noqa: PLC0415

        require_templates()
        files = [PAGE, *(one.name + ending for one in wanted for ending in ENDINGS)]
        folder = target.all_of(files)

        found = with_progress(
            lambda monitor: _finished(screen, [one.name for one in wanted], folder, monitor)
        )
        write_page(found, folder)
        if len(found.figures) == len(wanted):
            # A figure that this machine does not have would be left over from another one.
            target.replaces([name for name in files if not (folder / name).exists()])
        target.result(found)
        count = sum(one.figure is not None for one in found.figures)
        pictures = "1 figure" if count == 1 else f"{count} figures"
        target.wrote(PAGE, f"and {pictures} as HTML, SVG and PDF")
        target.finish(lambda out: _show(found, out))
        if len(found.figures) < len(wanted):
            raise target.stopped()


def _finished(
    screen: FlipFlowScreen, names: Sequence[str], folder: Path, monitor: Monitor
) -> Reproduction:
    """One figure after the other, each written at once; Ctrl-C ends it and keeps the finished."""
    from flipflow.paper.page import write_figure  # noqa: PLC0415  quick --help
    from flipflow.paper.reproduce import Reproduction  # noqa: PLC0415
    from flipflow.paper.reproduce import reproduce as reproduced  # noqa: PLC0415

    made: list[ReproducedFigure] = []
    for k, name in enumerate(names):
        monitor(name, k / len(names))
        try:
            (one,) = reproduced(screen, (name,)).figures
            write_figure(one, folder)
        except KeyboardInterrupt:
            if not made:
                raise
            break
        made.append(one)
    return Reproduction(screen, tuple(made))


def _show(found: Reproduction, out: Console) -> None:
    from rich.table import Table  # noqa: PLC0415  slow to import
    from rich.text import Text  # noqa: PLC0415

    from flipflow.paper.page import BEYOND, FOUND, STATES, VERDICTS  # noqa: PLC0415  quick --help
    from flipflow.report.terminal import STYLES  # noqa: PLC0415

    def shown(title: str, claims: Sequence[DecidedClaim], words: Mapping[Verdict, str]) -> None:
        table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
        for head in (title, "Verdict", "Statement"):
            table.add_column(head, no_wrap=head != "Statement")
        for one in claims:
            verdict = one.evaluation.verdict
            word = Text(words[verdict], STYLES[STATES[verdict]])
            table.add_row(one.claim.id, word, one.claim.statement)
        out.print(table)
        out.print()

    if found.claims:
        shown("Claim", found.claims, VERDICTS)
        out.print(", ".join(f"{n} {verdict}" for verdict, n in found.counts.items() if n) + ".")
    if found.findings:
        out.print(f"\n{BEYOND}:")
        shown("", found.findings, FOUND)
    for figure in found.figures:
        if figure.failure:
            out.print(f"{figure.name} is not drawn. {figure.failure}", style="yellow")
