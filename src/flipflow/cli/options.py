"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flipflow.model import constants

if TYPE_CHECKING:
    from flipflow.model.project import Project

RPM = constants.RPM

FILE_HELP = (
    "Machine file, or a bundled name: ffs0827 (with stops), ffs0827-linear (without), rig-lin2024 "
    "(a two-mass rig)."
)

File = Annotated[str, typer.Argument(metavar="FILE", help=FILE_HELP)]
Speed = Annotated[
    str | None,
    typer.Option("--speed", metavar="SPEED", help="Shaft speed: '850 rpm', '203 rad/s'."),
]
Speeds = Annotated[
    tuple[str, str] | None,
    typer.Option("--speeds", metavar="LOW HIGH", help='From and to: "300 rpm" "40 Hz".'),
]
Output = Annotated[
    Path | None, typer.Option("--output", "-o", metavar="DIR", help="Folder for figures and data.")
]
Json = Annotated[
    str | None, typer.Option("--json", metavar="FILE", help="Write it as JSON, - for the terminal.")
]
Force = Annotated[
    bool, typer.Option("--force", help="Let values through that look like a slip of units.")
]


def speed_of(project: Project, written: str | None) -> float:
    """Speed in rad/s as asked for, else the working speed of the machine file."""
    from flipflow.errors import InputError  # noqa: PLC0415  keeps --help quick
    from flipflow.io.layout import SPEED  # noqa: PLC0415
    from flipflow.io.values import read_number  # noqa: PLC0415

    if written is not None:
        return read_number(written, SPEED, label="--speed")
    if project.speed is None:
        raise InputError("operation.speed", "(left out)", "give it, or --speed '850 rpm'")
    return project.speed


def speeds_of(written: tuple[str, str]) -> tuple[float, float]:
    """Speeds (low, high) in rad/s as asked for."""
    from flipflow.analyses.frequency_response import check_interval  # noqa: PLC0415  quick --help
    from flipflow.errors import InputError  # noqa: PLC0415
    from flipflow.io.units import parse_quantity  # noqa: PLC0415

    low, high = (parse_quantity(one, "rad/s", field="--speeds") for one in written)
    try:
        return check_interval((low, high))
    except InputError as error:
        raise InputError("--speeds", " to ".join(written), error.remedy) from None
