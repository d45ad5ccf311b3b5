"""``flipflow new``: a commented machine file, or duty file, to start from."""

from __future__ import annotations

from typing import Annotated

import typer


def new(
    file: Annotated[str, typer.Argument(metavar="NAME.toml", help="File to write.")],
    duty: Annotated[bool, typer.Option("--duty", help="A duty file, for flipflow design.")] = False,
) -> None:
    """Write a commented machine or duty file, never over another."""
    from flipflow.io.template import write_template  # noqa: PLC0415  keeps --help quick

    if duty:
        from flipflow.io.duty_template import duty_template  # noqa: PLC0415

        path = write_template(file, duty_template())
        typer.echo(f"{path} is written. Replace its values, then run: flipflow design {path}")
        return
    path = write_template(file)
    typer.echo(f"{path} is written. Replace its values, then run: flipflow check {path}")
