"""The commands of ``flipflow`` and its version, and one place where errors become sentences."""

from __future__ import annotations

import contextlib
import os
import shutil
import sys
import textwrap
from typing import Annotated

import typer

from flipflow import __version__
from flipflow.cli.analyze import analyze
from flipflow.cli.basins import basins
from flipflow.cli.check import check
from flipflow.cli.compare import compare
from flipflow.cli.design import design
from flipflow.cli.new import new
from flipflow.cli.orbits import orbits
from flipflow.cli.outcome import OUTCOME
from flipflow.cli.reproduce import reproduce
from flipflow.cli.schema import schema
from flipflow.cli.sensitivity import sensitivity
from flipflow.cli.simulate import simulate
from flipflow.cli.startup import startup
from flipflow.cli.store import info
from flipflow.cli.study import study
from flipflow.cli.sweep import sweep
from flipflow.errors import Cancelled, FlipflowError, StoreError

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
    compare,
    new,
    schema,
    simulate,
    sweep,
    orbits,
    startup,
    sensitivity,
    study,
    design,
    reproduce,
)


for one in COMMANDS:
    app.command()(one)


stores = typer.Typer(
    help="Stores of studies.", no_args_is_help=True, add_completion=False, rich_markup_mode=None
)
stores.command()(info)
app.add_typer(stores, name="store")


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


def run() -> None:
    """Read the command line and do what it says.

    Raises
    ------
    KeyboardInterrupt
        When it is stopped.
    OSError
        When what was found cannot be shown.
    """
    try:
        app()
    except SystemExit as ended:
        # So typer answers Ctrl-C.
        if ended.code == Cancelled.exit_code:
            raise KeyboardInterrupt from None
        sys.stdout.flush()
        raise
    except FlipflowError:
        sys.stdout.flush()
        raise


def said(error: KeyboardInterrupt | FlipflowError | OSError) -> int:
    """Say what has ended a command in one sentence on stderr; the exit code of its class."""
    if isinstance(error, OSError):
        # What is written to files has its own sentence; this is the terminal, or a pipe from it.
        _say(f"Error: what was found cannot be shown ({error.strerror}).")
        _drop_what_is_not_shown()
        return StoreError.exit_code
    if isinstance(error, KeyboardInterrupt):
        _drop_what_is_not_shown()
        error = OUTCOME.error()
    head = "" if isinstance(error, Cancelled) else "Error: "
    _say(_for_terminal(f"{head}{_sentence(str(error))}"))
    return error.exit_code


def _drop_what_is_not_shown() -> None:
    """Have the interpreter's end not try, and fail or wait again, to show what is held back."""
    with contextlib.suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _say(sentence: str) -> None:
    """Show a sentence on stderr; where that is closed the exit code says enough."""
    with contextlib.suppress(OSError):
        typer.echo(sentence, err=True)


def _sentence(text: str) -> str:
    """One line with a full stop; keys of a file may hold line breaks and control characters."""
    line = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    return line if line.endswith((".", "?", ")")) else f"{line}."


def _for_terminal(sentence: str) -> str:
    """Break a sentence between words where a terminal would break it anywhere; not in a file."""
    if not sys.stderr.isatty():
        return sentence
    width = shutil.get_terminal_size().columns
    return textwrap.fill(sentence, width, break_long_words=False, break_on_hyphens=False)
