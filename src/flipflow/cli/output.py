"""Where commands write: an 80-column console, and JSON documents."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

COLUMNS = 80
TERMINAL = "-"
JSON, OUTPUT = "--json", "--output"
IMPOSSIBLE = 6  # exit code of a duty that cannot be done with what is free
DOES_NOT_START = 5  # exit code of a start that fails, or a drive that does not fit, as given


def console() -> Console:
    """Return a console of at most 80 columns that takes text as it is, brackets included."""
    from rich.console import Console  # noqa: PLC0415  slow to import

    width = min(shutil.get_terminal_size().columns, COLUMNS)
    return Console(width=max(width, 40), highlight=False, markup=False, emoji=False)


def print_list(out: Console, title: str, lines: Iterable[str]) -> None:
    """Print a titled list whose lines wrap under their own beginning; nothing where it is empty."""
    from rich.padding import Padding  # noqa: PLC0415  slow to import

    lines = tuple(lines)
    if lines:
        out.print(f"\n{title}", style="bold")
    for line in lines:
        out.print(Padding(line, (0, 0, 0, 2)))


def printable(text: str) -> str:
    """Blanks for control characters, which a terminal would act on."""
    return "".join(c if c.isprintable() else " " for c in text)
