"""The reproduction as one page, and every figure as a file."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from flipflow import __version__
from flipflow.io.project import load
from flipflow.model.fields import FIELD, MOTION_FIELDS
from flipflow.model.monitor import Monitor, silent
from flipflow.model.numerals import capitalized
from flipflow.model.screen import FlipFlowScreen
from flipflow.paper.claims import DecidedClaim, Evaluation, Number, Numbers, Verdict
from flipflow.paper.reproduce import MACHINE, PAPER, ReproducedFigure, Reproduction
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
    cells,
)
from flipflow.report.html import page
from flipflow.report.numbers import NOTHING, number, quantity
from flipflow.results.store import write_file

TITLE = "The paper, reproduced"
BEYOND = "Found beyond the paper"
PAGE = "reproduction.html"
ENDINGS = (".html", ".svg", ".pdf")
STATES = {
    Verdict.HOLDS: "pass",
    Verdict.IN_PART: "attention",
    Verdict.FAILS: "fail",
    Verdict.UNDECIDED: "not checked",
}
VERDICTS = {verdict: str(verdict) for verdict in Verdict}
FOUND = {
    Verdict.HOLDS: "found",
    Verdict.IN_PART: "found in part",
    Verdict.FAILS: "not found",
    Verdict.UNDECIDED: "cannot be decided",
}
ROUNDING = 1e-9  # below it only the size of a number means something
SINGLE = ("",)  # columns of numbers that stand in no table of their claim; they come last
ANSWERS = {True: "pass", False: "fail", None: "not checked"}
INTRODUCTION = (
    "Every figure below is computed from the machine file, and every claim is decided by the "
    "numbers found. A published number counts as met when the computed one rounds to it or "
    "differs by less than 2 %. Motions are exact (closed form between contacts, periodic motion "
    "by shooting); the paper's third-order harmonic balance lies beneath them. Each claim links to "
    "its figure, where the numbers stand that decide it."
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
        When jinja2, matplotlib or typst is not installed.
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

    Interrupted, it leaves none of them.

    Raises
    ------
    MissingExtra
        When matplotlib or typst is not installed.
    StoreError
        When a file cannot be written.
    """
    if one.figure is None:
        return ()
    names = tuple(f"{one.name}{ending}" for ending in ENDINGS)
    try:
        for name in names:
            one.figure.write(folder / name)
    except KeyboardInterrupt:
        for name in names:
            (folder / name).unlink(missing_ok=True)
        raise
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
        footer=f"flipflow {__version__}: {PAPER}", symbols=True,
    )  # fmt: skip
    write_file(folder / PAGE, text)
    return PAGE


def blocks(found: Reproduction) -> Iterator[Block]:
    """Title, all verdicts, what the paper does not say, then figure by figure."""
    counted = ", ".join(f"{count} {verdict}" for verdict, count in found.counts.items() if count)
    yield TitleBlock(TITLE, (("Paper", PAPER), ("flipflow", __version__), ("Claims", counted)))
    yield Text(_machine(found.screen), "Machine:")
    yield Text(INTRODUCTION)
    if found.claims:
        yield _summary("What the paper claims", found.claims, VERDICTS)
    if found.findings:
        yield _summary(BEYOND, found.findings, FOUND)
    for one in found.figures:
        yield from _figure_blocks(one)


def _machine(screen: FlipFlowScreen) -> str:
    """Whose machine it is, and its numbers."""
    fields = (FIELD[name] for name in MOTION_FIELDS)
    numbers = ", ".join(
        f"{one.symbol} {quantity(value, one.file_unit, one.unit)}"
        for one in fields
        if (value := getattr(screen, one.name)) is not None
    )
    whose = "the paper's" if screen == load(MACHINE) else "not the paper's"
    return f"{whose}, {numbers}."


def heading_of(one: ReproducedFigure) -> str:
    """What a figure's part of the page is called."""
    number_ = one.name.removeprefix("figure-").lstrip("0")
    if not number_[:1].isdigit():
        return f"{BEYOND}: {one.title[:1].lower()}{one.title[1:]}"
    return f"Figure {number_}: {one.title}"


def _summary(title: str, claims: tuple[DecidedClaim, ...], words: Mapping[Verdict, str]) -> Table:
    columns = (Column("Claim"), Column("Statement"), Column("Where"), Column("Verdict"))
    rows = tuple(
        (
            Cell(one.claim.id, link=one.figure),
            Cell(_sentence(one.claim.statement), _but(one.evaluation)),
            Cell(one.claim.where, link=one.figure),
            _verdict(one, words),
        )
        for one in claims
    )
    return Table(title, columns, rows)


def _figure_blocks(one: ReproducedFigure) -> Iterator[Block]:
    yield Heading(heading_of(one), 1, anchor=one.name)
    if one.figure is None:
        yield Note(one.failure)
        return
    # The heading says its title.
    if isinstance(one.figure, Drawing):
        yield DrawingBlock(replace(one.figure, title=""))
    else:
        yield FigureBlock(replace(one.figure, title=""))
    for claims, words in ((one.claims, VERDICTS), (one.findings, FOUND)):
        if claims:
            yield _stated(claims, words)
            yield from _parts(claims)
            yield from number_tables(claims)
    yield from one.tables


def _stated(claims: tuple[DecidedClaim, ...], words: Mapping[Verdict, str]) -> Table:
    columns = (Column("Claim"), Column("Statement"), Column("Verdict"))
    rows = tuple(
        (Cell(one.claim.id), Cell(_sentence(one.claim.statement)), _verdict(one, words))
        for one in claims
    )
    return Table("Verdicts", columns, rows)


def _parts(claims: tuple[DecidedClaim, ...]) -> Iterator[Table]:
    """What each claim of several parts says where they do not agree."""
    rows = []
    for one in claims:
        parts = one.evaluation.parts
        if len(parts) < 2 or one.evaluation.verdict is Verdict.HOLDS:
            continue
        for k, part in enumerate(parts):
            answer = Cell(one.evaluation.words[part.answer], state=ANSWERS[part.answer])
            rows.append((Cell(one.claim.id if k == 0 else ""), Cell(part.what), answer))
    if rows:
        columns = (Column("Claim"), Column("Part"), Column("Answer"))
        yield Table("Part by part", columns, tuple(rows))


def number_tables(claims: Iterable[DecidedClaim]) -> Iterator[Table]:
    """The numbers that claims rest on; neighbours with the same columns share a table."""
    lines = [
        (columns, one.claim.id, name, row)
        for one in claims
        for columns, name, row in _lines(one.evaluation.numbers)
    ]
    lines.sort(key=lambda line: line[0] == SINGLE)
    title = "Numbers behind the verdicts"
    for columns, group in itertools.groupby(lines, key=lambda line: line[0]):
        rows = [(id_, name, row) for _, id_, name, row in group]
        yield _number_table(title, columns, rows)
        title = ""


Row = tuple[Number, ...]


def _lines(numbers: Numbers) -> Iterator[tuple[tuple[str, ...], str, Row]]:
    """Columns, name and numbers of each row."""
    rows: dict[str, dict[str, Number]] = {}
    for name, one in numbers.items():
        row, column = (name, *SINGLE) if isinstance(name, str) else name
        rows.setdefault(row, {})[column] = one
    for name, row_ in rows.items():
        yield tuple(row_), name, tuple(row_.values())


def _number_table(title: str, columns: tuple[str, ...], rows: list[tuple[str, str, Row]]) -> Table:
    """Units stand in the head of their column, else beside the name of their row, else in cells."""
    units = [[one.unit for one in row] for _, _, row in rows]
    of_columns = [
        column[0] if len(set(column)) == 1 else None for column in zip(*units, strict=True)
    ]
    of_rows = [row[0] if len(set(row)) == 1 else None for row in units]
    by_column, by_row = None not in of_columns, None not in of_rows and columns != SINGLE
    heads = [
        Column(name or "Value", (unit or "") if by_column else "", numeric=True)
        for name, unit in zip(columns, of_columns, strict=True)
    ]
    made, last = [], ""
    for (id_, name, row), unit in zip(rows, of_rows, strict=True):
        beside = f"{name}, {unit}" if by_row and not by_column and unit else name
        shown = [_shown(one, with_unit=not (by_column or by_row)) for one in row]
        made.append(cells(id_ if id_ != last else "", beside, *shown))
        last = id_
    head = (Column("Claim"), Column("Quantity"), *heads)
    return Table(title, head, tuple(made))


def _verdict(one: DecidedClaim, words: Mapping[Verdict, str]) -> Cell:
    verdict = one.evaluation.verdict
    return Cell(words[verdict], state=STATES[verdict])


def _but(evaluation: Evaluation) -> str:
    """What does not hold or is open, where a claim does not hold as a whole, and what to add."""
    if len({part.answer for part in evaluation.parts}) < 2:
        return f"{evaluation.where} {evaluation.note}".strip()
    groups = {
        answer: [part.what for part in evaluation.parts if part.answer is answer]
        for answer in (False, None)
    }
    sentences = [
        f"{evaluation.words[answer].capitalize()}: {'; '.join(found)}."
        for answer, found in groups.items()
        if found
    ]
    return " ".join((*sentences, evaluation.note)).strip()


def _shown(value: Number, *, with_unit: bool) -> str:
    if value.value is None or not math.isfinite(value.value):
        return NOTHING
    if isinstance(value.value, int):
        text = str(value.value)
    elif 0.0 < abs(value.value) < ROUNDING:
        text = f"{value.value:.0e}"
    else:
        text = f"{value.value:.2f}" if value.unit == "rad/s" else number(value.value)
    return f"{text} {value.unit}".strip() if with_unit else text


def _sentence(text: str) -> str:
    symbol = not text.split(maxsplit=1)[0].rstrip(",").replace("-", "").isalpha()
    return f"{text if symbol else capitalized(text)}."
