"""The summary in the terminal: the brief blocks of the report within 80 columns."""

from __future__ import annotations

import re
from functools import singledispatch
from typing import TYPE_CHECKING

from flipflow.report.blocks import Block, Cell, Column, Note, Table, Text, Values, Verdict
from flipflow.report.registry import blocks_of

if TYPE_CHECKING:
    from rich.console import Console

# Names of the machine file that no column has room for; they break after their section.
LONG_WORD = re.compile(r"\S{15,}")
WITHIN = re.compile(r"\.(?=\w)")
# A number and the unit behind it belong on one line.
BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:%|deg|g|Hz|k?[NWJ]|kg m/s|k?g|mm|rad/s|rpm|s)(?![\w/]))")
HARD_BLANK = "\ue000"  # stands for a blank at which no line is broken; a letter of no language
STYLES = {
    "pass": "green",
    "attention": "bold yellow",
    "fail": "bold red",
    "not checked": "dim",
}


def summary(result: object, console: Console) -> None:
    """Print the brief blocks of a result: of an assessment verdict, limits, cases, allowed speeds.

    Parameters
    ----------
    result
        An assessment, or another result with sections of its own.
    console
        Where to print.
    """
    for block in blocks_of(result, brief=True):
        show(block, console)


def show(block: Block, console: Console) -> None:
    """Print one block; one that a terminal cannot show is left out."""
    _show(block, console)


def say(console: Console, text: str, style: str = "") -> None:
    """Print a sentence, broken between words but not between a number and its unit."""
    from rich.text import Text as Words  # noqa: PLC0415

    tied = BEFORE_UNIT.sub(HARD_BLANK, " ".join(text.split("\n")))
    # Chinese letters are two columns wide, which textwrap does not know.
    lines = (line.plain.rstrip() for line in Words(tied).wrap(console, console.width))
    console.print("\n".join(lines).replace(HARD_BLANK, " "), style=style or None)


@singledispatch
def _show(block: Block, console: Console) -> None:
    """Blocks that a terminal cannot show are left out."""


@_show.register(Verdict)
def _(block: Verdict, console: Console) -> None:
    say(console, block.text, STYLES[block.state] if block.state != "not checked" else "bold")


@_show.register(Text)
def _(block: Text, console: Console) -> None:
    say(console, f"{block.lead} {block.text}".strip())


@_show.register(Note)
def _(block: Note, console: Console) -> None:
    say(console, f"Note: {block.text}", "yellow")


@_show.register(Values)
def _(block: Values, console: Console) -> None:
    from rich.table import Table as Grid  # noqa: PLC0415  slow to import

    grid = Grid.grid(padding=(0, 2))
    grid.add_column(no_wrap=True)
    grid.add_column(overflow="fold")
    for label, text in block.rows:
        grid.add_row(label, text)
    console.print(grid)


@_show.register(Table)
def _(block: Table, console: Console) -> None:
    from rich.table import Table as Grid  # noqa: PLC0415  slow to import
    from rich.text import Text as Words  # noqa: PLC0415

    shown = [k for k, column in enumerate(block.columns) if column.brief]
    grid = Grid(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    for k in shown:
        grid.add_column(
            _title(block.columns[k]),
            justify="right" if block.columns[k].numeric else "left",
            overflow="fold",
        )
    for row in block.rows:
        grid.add_row(*(Words(_text(row[k]), STYLES.get(row[k].state, "")) for k in shown))
    console.print()
    console.print(grid)


def _title(column: Column) -> str:
    return f"{column.title}\n{column.unit}" if column.unit else column.title


def _text(cell: Cell) -> str:
    text = LONG_WORD.sub(lambda word: WITHIN.sub(".\n", word.group()), cell.text)
    return f"{text}\n({cell.small})" if cell.small else text
