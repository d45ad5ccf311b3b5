"""The reproduction as one page, and every figure as a file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from flipflow import __version__
from flipflow.model.monitor import Monitor, silent
from flipflow.paper.claims import DecidedClaim, Number, Verdict
from flipflow.paper.reproduce import PAPER, ReproducedFigure, Reproduction
from flipflow.plotting.drawing import Drawing
from flipflow.report.blocks import (
    Block,
    Cell,
    Column,
    DrawingBlock,
    FigureBlock,
    Heading,
    Note,
    Table,
    Text,
    TitleBlock,
)
from flipflow.report.html import page
from flipflow.report.numbers import NOTHING, number
from flipflow.results.store import write_file

TITLE = "The paper, reproduced"
PAGE = "reproduction.html"
ENDINGS = (".html", ".svg", ".pdf")
STATES = {
    Verdict.HOLDS: "pass",
    Verdict.IN_PART: "attention",
    Verdict.FAILS: "fail",
    Verdict.UNDECIDED: "not checked",
}
INTRODUCTION = (
    "Every figure below is computed from the machine file, and every claim is decided by the "
    "numbers found. A published number counts as met when the computed one rounds to it or "
    "differs by less than 2 %. Motions are exact (closed form between contacts, periodic motion "
    "by shooting); the paper's third-order harmonic balance lies beneath them."
)


def write_reproduction(
    found: Reproduction, folder: Path, monitor: Monitor | None = None
) -> tuple[str, ...]:
    """Write the page, and each figure as HTML, SVG and PDF, into an existing folder.

    Parameters
    ----------
    found
        What :func:`flipflow.reproduce` returns.
    folder
        Where to.
    monitor
        Called with a file's name and the share done, 0 to 1.

    Returns
    -------
    tuple of str
        Names of the files.

    Raises
    ------
    MissingExtra
        When jinja2 or matplotlib is not installed.
    StoreError
        When a file cannot be written.
    """
    say = monitor or silent
    names: list[str] = []
    for k, one in enumerate(found.figures):
        say(f"writing {one.name}", k / len(found.figures))
        names += write_figure(one, folder)
    return (write_page(found, folder), *names)


def write_figure(one: ReproducedFigure, folder: Path) -> tuple[str, ...]:
    """Write one figure as HTML, SVG and PDF into an existing folder; names of the files.

    Raises
    ------
    MissingExtra
        When matplotlib is not installed.
    StoreError
        When a file cannot be written.
    """
    if one.figure is None:
        return ()
    names = tuple(f"{one.name}{ending}" for ending in ENDINGS)
    for name in names:
        one.figure.write(folder / name)
    return names


def write_page(found: Reproduction, folder: Path) -> str:
    """Write the page of all figures and claims into an existing folder; name of the file.

    Raises
    ------
    MissingExtra
        When jinja2 is not installed.
    StoreError
        When the file cannot be written.
    """
    text = page(
        tuple(blocks(found)), title=TITLE, kind="figures and claims",
        footer=f"flipflow {__version__}: {PAPER}",
    )  # fmt: skip
    write_file(folder / PAGE, text)
    return PAGE


def blocks(found: Reproduction) -> Iterator[Block]:
    """Title, all verdicts, then figure by figure."""
    counted = ", ".join(f"{count} {verdict}" for verdict, count in found.counts.items() if count)
    yield TitleBlock(TITLE, (("Paper", PAPER), ("flipflow", __version__), ("Claims", counted)))
    yield Text(INTRODUCTION)
    yield claims_table(found.claims)
    for one in found.figures:
        yield from _figure_blocks(one)


def claims_table(claims: tuple[DecidedClaim, ...]) -> Table:
    """Every claim with its verdict and where it holds."""
    columns = (Column("Claim"), Column("Statement"), Column("Verdict"))
    rows = tuple(
        (
            Cell(one.claim.id),
            Cell(f"{_sentence(one.claim.statement)} ({one.claim.where})", one.evaluation.where),
            _verdict(one),
        )
        for one in claims
    )
    return Table("What the paper claims", columns, rows)


def _figure_blocks(one: ReproducedFigure) -> Iterator[Block]:
    number_ = one.name.removeprefix("figure-").lstrip("0")
    yield Heading(f"Figure {number_}: {one.title}", 1)
    if one.figure is None:
        yield Note(one.failure)
        return
    if isinstance(one.figure, Drawing):
        yield DrawingBlock(one.figure)
    else:
        yield FigureBlock(one.figure)
    yield from one.tables
    if one.claims:
        yield _claims_of(one)


def _claims_of(one: ReproducedFigure) -> Table:
    columns = (Column("Claim"), Column("Verdict"), Column("Numbers"))
    rows = tuple(
        (
            Cell(decided.claim.id),
            _verdict(decided),
            Cell(_sentence(decided.claim.statement), _numbers(decided)),
        )
        for decided in one.claims
    )
    return Table("Numbers behind the verdicts", columns, rows)


def _verdict(one: DecidedClaim) -> Cell:
    verdict = one.evaluation.verdict
    return Cell(str(verdict), state=STATES[verdict])


def _numbers(one: DecidedClaim) -> str:
    return "; ".join(f"{name}: {_shown(value)}" for name, value in one.evaluation.numbers.items())


def _shown(value: Number) -> str:
    if value.value is None:
        return NOTHING
    if isinstance(value.value, int):
        return f"{value.value} {value.unit}"
    return f"{number(value.value) if value.unit != 'rad/s' else f'{value.value:.6g}'} {value.unit}"


def _sentence(text: str) -> str:
    symbol = not text.split(maxsplit=1)[0].rstrip(",").replace("-", "").isalpha()
    return f"{text if symbol else text[:1].upper() + text[1:]}."
