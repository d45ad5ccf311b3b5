"""What a report is made of: blocks, which every renderer knows how to show."""

from __future__ import annotations

from dataclasses import dataclass

from flipflow.plotting.drawing import Drawing
from flipflow.plotting.figure import Figure


@dataclass(frozen=True)
class Block:
    """Base of all blocks; renderers choose by :attr:`kind`."""

    @property
    def kind(self) -> str:
        """Name of the block's class."""
        return type(self).__name__


@dataclass(frozen=True)
class TitleBlock(Block):
    """The head of the first page: name of the machine, and pairs of label and text."""

    title: str
    rows: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Heading(Block):
    """A heading; level 1 is a part of the report, which begins a page unless told otherwise.

    ``anchor`` is what a :class:`Cell` links to.
    """

    text: str
    level: int = 2
    new_page: bool = True
    anchor: str = ""


@dataclass(frozen=True)
class Text(Block):
    """A paragraph; ``lead`` is printed bold before it."""

    text: str
    lead: str = ""


@dataclass(frozen=True)
class Note(Block):
    """Something to keep in mind: what was assumed, not checked or not finished."""

    text: str


@dataclass(frozen=True)
class Verdict(Block):
    """The sentence the report opens with, and its state: pass, attention, fail, not checked."""

    text: str
    state: str


@dataclass(frozen=True)
class Cell:
    """One cell of a table; ``small`` is printed below it, ``state`` gives it a colour.

    ``link`` is the anchor of a heading on the same page, for renderers that can follow it.
    """

    text: str
    small: str = ""
    state: str = ""
    link: str = ""


@dataclass(frozen=True)
class Column:
    """One column of a table.

    ``brief`` columns are also shown in the terminal; ``ends`` says that its cells are "5 to 8 mm",
    "at most 3 g" or the like, which are two numbers to other programs.
    """

    title: str
    unit: str = ""
    numeric: bool = False
    brief: bool = True
    ends: bool = False


@dataclass(frozen=True)
class Table(Block):
    """Rows under named columns, with a sentence above."""

    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    caption: str = ""


@dataclass(frozen=True)
class Values(Block):
    """Lines of label and text."""

    rows: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class FigureBlock(Block):
    """A figure with its caption."""

    figure: Figure


@dataclass(frozen=True)
class DrawingBlock(Block):
    """A drawing with its caption."""

    drawing: Drawing


def cells(*texts: str) -> tuple[Cell, ...]:
    """A row of plain cells."""
    return tuple(Cell(text) for text in texts)
