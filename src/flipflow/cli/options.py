"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flipflow.cli.progress import progress
from flipflow.errors import InputError, as_written
from flipflow.model.constants import RPM
from flipflow.model.numerals import case_words, rpm

if TYPE_CHECKING:
    from flipflow.model.project import Project
    from flipflow.model.screen import Load

OR_SPEED = "give it, or --speed '850 rpm'"
IN_FILE = "give it: the rubber in warm air is as warm as its work at that speed keeps it"
WARMING = "warming the rubber; the first run of a version compiles"
# Slower, a turn takes minutes of calculation; faster, no screen runs.
SLOWEST, FASTEST = 1.0, 100_000.0

FILE_HELP = (
    "Machine file, or a bundled name: ffs0827 (with stops), ffs0827-linear (without), rig-lin2024 "
    "(a two-mass rig)."
)

File = Annotated[str, typer.Argument(metavar="FILE", help=FILE_HELP)]
Files = Annotated[list[str], typer.Argument(metavar="FILE...", help=FILE_HELP)]
Speed = Annotated[
    str | None,
    typer.Option("--speed", metavar="SPEED", help="Shaft speed: '850 rpm', '203 rad/s'."),
]
Speeds = Annotated[
    tuple[str, str] | None,
    typer.Option("--speeds", metavar="LOW HIGH", help='From and to: "300 rpm" "40 Hz".'),
]
Case = Annotated[
    str | None,
    typer.Option("--case", metavar="NAME", help="A load case of the machine file, by its name."),
]
Output = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="DIR", help="Write figures into this folder."),
]
Folder = Annotated[
    Path | None,
    typer.Option(
        "--output", "-o", metavar="DIR", help="Folder for figures and data; else NAME-flipflow."
    ),
]
Json = Annotated[
    str | None,
    typer.Option("--json", metavar="FILE", help="Write what is found as JSON; - prints it."),
]
Force = Annotated[
    bool, typer.Option("--force", help="Let values through that look like a slip of units.")
]


def whole(option: str, metavar: str, least: int, most: int, sentence: str) -> Any:
    """An option that takes a whole number; another value is refused in one sentence."""
    return typer.Option(
        option, metavar=metavar, parser=str, callback=_read_whole(least, most), help=sentence
    )


def _read_whole(least: int, most: int) -> Callable[[typer.CallbackParam, Any], Any]:
    def read(param: typer.CallbackParam, written: Any) -> Any:
        if written is None:
            return None
        try:
            number = int(written)
        except ValueError:
            number = least - 1
        if not least <= number <= most:
            remedy = f"give a whole number from {least} to {most}"
            raise InputError(param.opts[0], written, remedy)
        return number

    return read


def in_case(
    project: Project, name: str | None, speed: str | None = None, remedy: str = OR_SPEED
) -> Project:
    """The project of a machine under one of its load cases; as it is where none is named.

    Where the case gives the air's temperature, the rubber is as warm as its work keeps it at the
    speed asked for, else at that of the machine file; stderr tells how warm. That takes seconds:
    other options are read before. Without a speed, what is said is the ``remedy``.
    """
    if name is None:
        return project
    for load in project.load_cases:
        if load.name == name:
            load = _at_work(project, load, speed, remedy)  # noqa: PLW2901
            return replace(project, screen=project.screen.loaded(load), load_cases=(load,))
    known = ", ".join(repr(load.name) for load in project.load_cases)
    raise InputError("--case", name, f"there is no such load case, choose one of {known}")


def _at_work(project: Project, load: Load, speed: str | None, remedy: str) -> Load:
    """A load case with the temperature of the rubber."""
    from flipflow.model.screen import of_air  # noqa: PLC0415  keeps --help quick

    if not of_air(load):
        return load
    from flipflow.studies.rubber_temperature import warmed_load  # noqa: PLC0415  slow to import

    omega = speed_of(project, speed, remedy)
    with progress(WARMING):
        found = warmed_load(project.screen, load, omega)
    told = found.note or (
        f"{case_words(load.name, capital=True)}: the rubber settles at {found.rubber:.3g} degC "
        f"at {rpm(omega)} rpm."
    )
    typer.echo(f"Note: {told}", err=True)
    return found.load


def title_of(project: Project, case: str | None) -> str:
    """Name of the machine, and of the load case where one was asked for."""
    name = project.document.name or project.name
    return name if case is None else f"{name}, {case_words(case)}"


def marked(project: Project, case: str | None) -> str:
    """What a figure carries: machine, load case, revision, date."""
    revision = project.document.revision
    parts = [
        project.document.name or project.name,
        case_words(case) if case is not None else "empty machine",
        f"revision {revision}" if revision else "no revision",
        datetime.now(UTC).astimezone().date().isoformat(),
    ]
    return ", ".join(parts)


def speed_of(project: Project, written: str | None, remedy: str = OR_SPEED) -> float:
    """Speed in rad/s as asked for, else the working speed of the machine file."""
    from flipflow.io.layout import SPEED  # noqa: PLC0415  keeps --help quick
    from flipflow.io.values import read_number  # noqa: PLC0415

    if written is not None:
        omega = read_number(written, SPEED, label="--speed")
        _check_speed("--speed", written, omega)
        return omega
    if project.speed is None:
        raise InputError("operation.speed", "(left out)", remedy)
    _check_speed("operation.speed", f"{project.speed * RPM:.6g} rpm", project.speed)
    return project.speed


def speeds_of(written: tuple[str, str]) -> tuple[float, float]:
    """Speeds (low, high) in rad/s as asked for."""
    from flipflow.io.units import parse_quantity  # noqa: PLC0415
    from flipflow.model.arguments import checked_interval  # noqa: PLC0415  quick --help

    low, high = (parse_quantity(one, "rad/s", field="--speeds") for one in written)
    both = " to ".join(written)
    with as_written("--speeds", both):
        checked_interval("omega", (low, high))
    for omega in (low, high):
        _check_speed("--speeds", both, omega)
    return low, high


def _check_speed(option: str, written: str, omega: float) -> None:
    if not SLOWEST <= round(omega * RPM, 6) <= FASTEST:
        remedy = f"give a speed from {SLOWEST:.0f} rpm to {FASTEST:.0f} rpm"
        raise InputError(option, written, remedy)


MOST_WORKERS = 256
Workers = Annotated[
    int | None,
    whole("--workers", "N", 1, MOST_WORKERS, "Run on N worker processes instead of threads."),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        "--scheduler", metavar="ADDRESS", help="Run on a cluster of dask: 'tcp://host:8786'."
    ),
]
