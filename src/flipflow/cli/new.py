"""``flipflow new``: a commented machine file, or duty file, to start from."""

from __future__ import annotations

from typing import Annotated

import typer

from flipflow.cli.outcome import OUTCOME
from flipflow.signals import undisturbed


def new(
    file: Annotated[str, typer.Argument(metavar="NAME.toml", help="File to write.")],
    duty: Annotated[bool, typer.Option("--duty", help="A duty file, for flipflow design.")] = False,
) -> None:
    """Write a commented machine or duty file, never over another."""
    from flipflow.io.duty_template import duty_template  # noqa: PLC0415
    from flipflow.io.template import write_template  # noqa: PLC0415  keeps --help quick

    with undisturbed():
        path = write_template(file, duty_template() if duty else None)
        OUTCOME.wrote(str(path))
    then = "design" if duty else "check"
    typer.echo(f"{path} is written. Replace its values, then run: flipflow {then} {path}")
