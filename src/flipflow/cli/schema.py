"""``flipflow schema``: the JSON schema of the machine file."""

from __future__ import annotations

from typing import Annotated

import typer

from flipflow.cli.destination import Destination


def schema(
    json: Annotated[
        str, typer.Option("--json", metavar="FILE", help="Where to write it, - for the terminal.")
    ] = "-",
) -> None:
    """Print the JSON schema of the machine file, for editors."""
    from flipflow.io.schema import machine_schema  # noqa: PLC0415  keeps --help quick

    with Destination(None, json) as target:
        target.document(machine_schema())
        target.tell()
