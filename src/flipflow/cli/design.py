"""``flipflow design``: from a duty file to a machine, its proof and a report."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flipflow.cli.destination import Destination
from flipflow.cli.options import Folder, Force, Json, Scheduler, Workers, whole
from flipflow.cli.outcome import NOTHING, OUTCOME
from flipflow.cli.output import IMPOSSIBLE
from flipflow.cli.progress import compile_first, progress, stoppable

if TYPE_CHECKING:
    from flipflow.model.duty import Duty
    from flipflow.studies.design import Proposal

MACHINE, FIGURE = "machine.toml", "candidates.html"
MOST_GENERATIONS = 9999
STAGE = "design"  # the stages of a design that keep what is found


def design(
    file: Annotated[str, typer.Argument(metavar="FILE", help="Duty file; see new --duty.")],
    output: Folder = None,
    json: Json = None,
    generations: Annotated[
        int | None,
        whole("--generations", "N", 1, MOST_GENERATIONS, "How long to search."),
    ] = None,
    store: Annotated[
        Path | None,
        typer.Option(
            "--store",
            metavar="DIR",
            help="Folder that keeps the search, to go on with.",
        ),
    ] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    pdf: Annotated[bool, typer.Option("--pdf", help="Write the report as PDF, too.")] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the report of another duty.")
    ] = False,
    force: Force = False,
) -> None:
    """Choose the machine for a duty, and prove it.

    Stopped, it keeps the best so far; with --store the same command goes on. Ends with code 6 where
    the duty cannot be done; the nearest machine is then shown.
    """
    from flipflow.cli.report_files import PROPOSAL, duty_key, replaced_files  # noqa: PLC0415
    from flipflow.io.duty import load_duty  # noqa: PLC0415  keeps --help quick
    from flipflow.report.html import require_templates  # noqa: PLC0415

    duty = load_duty(file, force=force)
    require_templates()
    if pdf:
        from flipflow.plotting.print import require_typst  # noqa: PLC0415

        require_typst()
    for warning in duty.project.warnings:
        typer.echo(f"Warning: {warning}", err=True)
    folder = output or Path(f"{duty.name}-flipflow")
    old = replaced_files(folder, PROPOSAL, duty_key(duty), overwrite=overwrite)
    with Destination(folder, json, [file]) as target:
        target.replaces(old)
        if store is not None:
            OUTCOME.words = lambda: _kept(store)
        found, stopped = _searched(duty, generations, store, workers, scheduler)
        _write(found, target, pdf=pdf)
        if stopped:
            raise target.stopped()
    if not found.possible:
        raise typer.Exit(IMPOSSIBLE)


def _kept(store: Path) -> str:
    """What is kept when the command is stopped before there is a machine."""
    return f"the search is in {store}, and the same command goes on" if store.exists() else NOTHING


def _searched(
    duty: Duty, generations: int | None, store: Path | None, workers: int | None,
    scheduler: str | None,
) -> tuple[Proposal, bool]:  # fmt: skip
    """The machine for a duty, with a bar, and whether Ctrl-C has ended it with the best so far."""
    from flipflow.cli.cluster import executor_of  # noqa: PLC0415  keeps --help quick
    from flipflow.studies.design import design as analysis  # noqa: PLC0415

    with (
        progress("starting") as tell,
        executor_of(workers, scheduler) as executor,
        stoppable(tell, STAGE) as told,
    ):
        compile_first(tell)
        found = analysis(
            duty, generations=generations, store=store, executor=executor, monitor=told
        )
        return found, told.asked


def _write(found: Proposal, target: Destination, *, pdf: bool) -> None:
    """Report, machine file, numbers; the summary in the terminal."""
    from flipflow.cli.report_files import KEY, PDF, PROPOSAL, REPORT, duty_key  # noqa: PLC0415
    from flipflow.io.results import document_of  # noqa: PLC0415
    from flipflow.plotting.dispatch import figure  # noqa: PLC0415
    from flipflow.report import summary  # noqa: PLC0415
    from flipflow.report.html import html  # noqa: PLC0415
    from flipflow.report.registry import blocks_of  # noqa: PLC0415

    blocks = blocks_of(found)
    target.content(REPORT, html(found, blocks))
    target.content(MACHINE, found.machine_file)
    target.wrote(REPORT, MACHINE)
    if pdf:
        from flipflow.report.pdf import pdf as sheets  # noqa: PLC0415

        target.content(PDF, sheets(found, blocks=blocks))
        target.wrote(PDF)
    else:
        target.replaces([PDF])  # one of another duty would stay beside this report
    document = document_of(found)
    files = (REPORT, MACHINE, PROPOSAL, FIGURE, *((PDF,) if pdf else ()))
    key = asdict(replace(duty_key(found.duty), files=files))
    target.data(PROPOSAL, {"schema": document["schema"], KEY: key, **document})
    target.picture(FIGURE, figure(found), found.duty.name)
    target.document(document)
    target.finish(lambda out: summary(found, out))
