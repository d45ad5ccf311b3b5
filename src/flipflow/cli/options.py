"""Options that several commands share."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from flipflow.model.project import Project

RPM = 30.0 / math.pi

File = Annotated[
    str, typer.Argument(metavar="FILE", help="Machine file, or a bundled name: ffs0827.")
]
Speed = Annotated[
    str | None,
    typer.Option("--speed", metavar="SPEED", help="Shaft speed: '850 rpm', '203 rad/s'."),
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
