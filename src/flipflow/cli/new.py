"""``flipflow new``: a commented machine file to start from."""

from __future__ import annotations

from typing import Annotated

import typer


def new(
    file: Annotated[str, typer.Argument(metavar="NAME.toml", help="File to write.")],
) -> None:
    """Write a commented machine file; never overwrites one."""
    from flipflow.io.template import write_template  # noqa: PLC0415  keeps --help quick

    path = write_template(file)
    typer.echo(f"{path} is written. Replace its values, then run: flipflow check {path}")
