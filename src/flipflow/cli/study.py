"""``flipflow study``: many variants of a machine, what they do, and which share is fit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flipflow.cli.destination import Destination
from flipflow.cli.options import Folder, Force, Json, Scheduler, Workers
from flipflow.cli.outcome import NOTHING, OUTCOME, STOPPED
from flipflow.cli.output import printable
from flipflow.cli.progress import compile_first, progress
from flipflow.errors import Cancelled, InputError

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rich.console import Console

    from flipflow.io.study_file import StudyFile
    from flipflow.model.limits import Limits
    from flipflow.model.monitor import Monitor
    from flipflow.studies.study import Study
    from flipflow.studies.tolerance import Tolerance

STORE, RESUME = "--store", "--resume"
REPORT, DATA, TABLE = "report.html", "results.json", "machines.csv"


def study(
    file: Annotated[
        str | None,
        typer.Argument(metavar="FILE", help="Study file; may be left out with --resume."),
    ] = None,
    store: Annotated[
        Path | None,
        typer.Option(
            "--store", metavar="DIR", help="Folder that grows as it runs; else NAME.zarr."
        ),
    ] = None,
    resume: Annotated[
        Path | None,
        typer.Option("--resume", metavar="DIR", help="Go on with the study in this folder."),
    ] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    output: Folder = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Look at many variants of a machine, under every load case.

    Stopped, it keeps the finished chunks, and --resume goes on.
    """
    from flipflow.cli.cluster import executor_of  # noqa: PLC0415  keeps --help quick
    from flipflow.report.html import require_templates  # noqa: PLC0415

    asked = _asked(file, store, resume, force=force)
    require_templates()
    with Destination(
        output or Path(f"{asked.name}-flipflow"), json, [file] if file else []
    ) as target:
        OUTCOME.words = lambda: _kept(file, asked.store)
        try:
            with progress("starting") as tell, executor_of(workers, scheduler) as executor:
                found = asked.run(executor, tell)
        except KeyboardInterrupt:
            raise Cancelled(f"{STOPPED}; {_kept(file, asked.store, counted=True)}.") from None
        judged = asked.judged(found)
        _write(found, judged, asked, target)


@dataclass(frozen=True, eq=False)
class _Asked:
    """A study that is asked for: by its file, by its store, or by both."""

    file: StudyFile | None
    store: Path

    @property
    def name(self) -> str:
        return self.store.stem if self.file is None else self.file.name

    @property
    def title(self) -> str:
        if self.file is None:
            return self.name
        return self.file.project.document.name or self.file.project.name

    @property
    def limits(self) -> Limits | None:
        """Limits of the machine file."""
        return None if self.file is None else self.file.project.limits

    def run(self, executor: Executor | None, tell: Monitor) -> Study:
        """Run, or go on."""
        from flipflow.studies.study import go_on  # noqa: PLC0415  keeps --help quick
        from flipflow.studies.study import study as analysis  # noqa: PLC0415

        compile_first(tell)
        if self.file is None:
            return go_on(self.store, executor=executor, monitor=tell)
        one = self.file
        return analysis(
            one.project.screen, one.vary, one.quantities, one.omega, load_cases=one.load_cases,
            sampling=one.sampling, branch=one.branch, derivatives=one.derivatives,
            store=self.store, executor=executor, monitor=tell,
        )  # fmt: skip

    def judged(self, found: Study) -> Tolerance | None:
        """The share that meets the limits of the machine file, where it can be told."""
        from flipflow.studies.tolerance import limits_known, tolerance  # noqa: PLC0415

        if self.file is None or found.sampling == "grid":
            return None
        limits = self.file.project.limits
        known = limits_known(found, limits)
        if not known:
            return None
        others = {name: None for name in limits.given if name not in known}
        kept = replace(limits, **others)  # type: ignore[arg-type]
        # The report tells the limits of the file that were not looked at.
        return replace(tolerance(found, kept), limits=limits)


def _asked(file: str | None, store: Path | None, resume: Path | None, *, force: bool) -> _Asked:
    from flipflow.io.study_file import read_study_file  # noqa: PLC0415  keeps --help quick

    if store is not None and resume is not None:
        raise InputError(STORE, str(store), f"{RESUME} names the folder, leave one of the two out")
    if file is None and resume is None:
        raise InputError("FILE", "(left out)", f"name a study file, or {RESUME} a folder")
    one = None if file is None else read_study_file(file, force=force)
    if one is not None:
        for warning in one.project.warnings:
            typer.echo(f"Warning: {warning}", err=True)
    if resume is not None:
        if not resume.exists():
            raise InputError(RESUME, str(resume), "there is no such folder; leave the option out")
        return _Asked(one, resume)
    place = store or Path(f"{one.name if one else ''}.zarr")
    if place.exists():
        remedy = f"it exists; go on with {RESUME} {place}, or name another {STORE}"
        raise InputError(STORE, str(place), remedy)
    return _Asked(one, place)


def _kept(file: str | None, store: Path, *, counted: bool = False) -> str:
    """What is kept when the command is stopped, and how it goes on.

    The file is named, for limits and title are in it, and not in the store. To count chunks takes
    a moment, for each is read.
    """
    import shlex  # noqa: PLC0415  keeps --help quick

    from flipflow.batch.chunk_store import FINISHED, ChunkStore  # noqa: PLC0415  quick --help

    if not store.exists():
        return NOTHING
    kept = "the finished chunks"
    if counted:
        states = ChunkStore(store).states()
        finished = [state.word == FINISHED for state in states]
        kept = f"{sum(finished)} of {len(finished)} chunks"
    words = ["flipflow", "study", *([file] if file else []), RESUME, str(store)]
    return f"{kept} are in {store}, and {shlex.join(words)} goes on"


def _write(found: Study, judged: Tolerance | None, asked: _Asked, target: Destination) -> None:
    """Report, figures, numbers; the summary in the terminal."""
    from flipflow.io.arrays import arrays_of  # noqa: PLC0415  loads every analysis
    from flipflow.io.results import document_of  # noqa: PLC0415
    from flipflow.io.tables import csv_text  # noqa: PLC0415
    from flipflow.report.html import study_html  # noqa: PLC0415
    from flipflow.report.study import study_blocks  # noqa: PLC0415

    blocks = study_blocks(found, judged, asked.limits)
    target.content(REPORT, study_html(found, blocks, asked.title, asked.name))
    target.content(TABLE, csv_text(arrays_of(found)))
    target.wrote(REPORT, TABLE)
    document = document_of(found if judged is None else judged) | {"name": asked.title}
    target.data(DATA, document)
    _write_figures(found, judged, asked, target)
    target.document(document)
    target.finish(lambda out: _show(found, judged, asked, out))


def _show(found: Study, judged: Tolerance | None, asked: _Asked, out: Console) -> None:
    from flipflow.report import summary  # noqa: PLC0415  keeps --help quick
    from flipflow.report.study import spread_table  # noqa: PLC0415
    from flipflow.report.terminal import say, show  # noqa: PLC0415

    say(out, printable(asked.title), "bold")
    for result in (found, judged):
        if result is not None:
            summary(result, out)
    if judged is None:
        table = spread_table(found)
        out.print()
        say(out, f"{table.title}:")
        show(table, out)
        if table.caption:
            say(out, table.caption)
    if asked.file is None:
        told = f"limits and title are in the study file, flipflow study FILE {RESUME}"
        say(out, f"Note: no limit is judged; {told} {asked.store} reads them.", "yellow")
    out.print(f"Store: {asked.store}", soft_wrap=True)


def _write_figures(
    found: Study, judged: Tolerance | None, asked: _Asked, target: Destination
) -> None:
    from flipflow.plotting.dispatch import figure  # noqa: PLC0415  keeps --help quick
    from flipflow.plotting.study import maps_figure, wide_fields  # noqa: PLC0415

    figures: dict[str, Any] = {"study.html": figure(found)}
    if found.sampling == "grid" and len(wide_fields(found)) > 1 and asked.file is not None:
        figures["map.html"] = maps_figure(found, asked.limits)
    if judged is not None:
        figures["tolerance.html"] = figure(judged)
    for name, one in figures.items():
        target.picture(name, one, asked.title)
