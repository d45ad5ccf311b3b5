"""The entry point ``flipflow``: commands, version, and one place where errors become sentences."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from flipflow import __version__
from flipflow.cli.analyze import analyze
from flipflow.cli.basins import basins
from flipflow.cli.check import check
from flipflow.cli.new import new
from flipflow.cli.orbits import orbits
from flipflow.cli.reproduce import reproduce
from flipflow.cli.schema import schema
from flipflow.cli.sensitivity import sensitivity
from flipflow.cli.simulate import simulate
from flipflow.cli.startup import startup
from flipflow.cli.sweep import sweep
from flipflow.errors import FlipflowError

app = typer.Typer(
    name="flipflow",
    help="Dynamics, design and diagnosis of flip-flow vibrating screens.",
    no_args_is_help=True,
    add_completion=False,
    # Plain help: rich would be imported for it, which takes longer than everything else.
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
COMMANDS = (
    analyze,
    basins,
    check,
    new,
    schema,
    simulate,
    sweep,
    orbits,
    startup,
    sensitivity,
    reproduce,
)
for command in COMMANDS:
    app.command()(command)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"flipflow {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    """Dynamics, design and diagnosis of flip-flow vibrating screens."""


def main() -> None:
    """Run the command line; an error is one sentence on stderr and the exit code of its class."""
    try:
        app()
    except FlipflowError as error:
        typer.echo(f"Error: {_one_line(str(error))}", err=True)
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        sys.exit(130)


def _one_line(text: str) -> str:
    """Escape what is not printable: keys of a file may hold line breaks and control characters."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


if __name__ == "__main__":
    main()
