"""The report as PDF: the same blocks, set by typst with the fonts that it carries."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from importlib import resources
from types import MappingProxyType
from typing import Any

from flipflow.errors import InputError
from flipflow.plotting.font import fonts_for_typst
from flipflow.plotting.layout import POINT
from flipflow.plotting.panels import PAGE_WIDTH
from flipflow.plotting.print import require_typst
from flipflow.plotting.svg import searchable_svg
from flipflow.report.blocks import Block, DrawingBlock, FigureBlock, Table
from flipflow.report.html import LONG, SHORT, Reported, head_of
from flipflow.report.registry import blocks_of

# The name that typst has for a paper, and the height in points that a figure may have on it.
PAPERS: Mapping[str, tuple[str, float]] = MappingProxyType(
    {"a4": ("a4", 720.0), "letter": ("us-letter", 670.0)}
)
ROOM = 75  # characters beside the widest column of a table
TEMPLATE = "report.typ"


def pdf(result: Reported, paper: str = "a4", blocks: Sequence[Block] | None = None) -> bytes:
    """The report of a result as a PDF.

    Parameters
    ----------
    result
        What :func:`flipflow.assess` or another analysis with a report returns.
    paper
        "a4" or "letter".
    blocks
        Those of the result, where they are made.

    Raises
    ------
    InputError
        For another paper.
    MissingExtra
        When typst or matplotlib is not installed.
    """
    name, height = PAPERS[checked_paper(paper)]
    shown = blocks_of(result) if blocks is None else blocks
    report = {
        **head_of(result),
        "paper": name,
        "longest": LONG,
        "short": SHORT,
        "blocks": [_shown(block, height) for block in shown],
    }
    source = (resources.files("flipflow.report") / "templates" / TEMPLATE).read_bytes()
    compiled = require_typst()
    with fonts_for_typst() as fonts:
        content = compiled(
            source,
            format="pdf",
            # Fonts of the machine are asked for letters that these have not, as Chinese ones.
            font_paths=[fonts],
            sys_inputs={"report": json.dumps(report)},
        )
    return bytes(content)


def checked_paper(paper: str, field: str = "paper") -> str:
    """A name of a paper.

    Raises
    ------
    InputError
        For another.
    """
    if paper not in PAPERS:
        raise InputError(field, paper, f"choose one of {', '.join(PAPERS)}")
    return paper


def _shown(block: Block, highest: float) -> dict[str, Any]:
    """A block as the template reads it; figures and drawings as vectors no higher than a page."""
    told: dict[str, Any] = {"kind": block.kind}
    if isinstance(block, FigureBlock):
        figure = block.figure
        share = min(1.0, highest / (figure.height * POINT))
        told |= {"title": figure.title, "caption": figure.caption, "svg": searchable_svg(figure)}
        return told | {"width": PAGE_WIDTH * POINT * share}
    if isinstance(block, DrawingBlock):
        return told | dataclasses.asdict(block.drawing) | {"width": PAGE_WIDTH * POINT}
    told |= dataclasses.asdict(block)
    return told | {"wide": _wide(block)} if isinstance(block, Table) else told


def _wide(table: Table) -> int | None:
    """The column of words that takes what room the others leave; None where they leave little."""
    lengths = [
        max(len(column.title) + len(column.unit), *(len(row[k].text) for row in table.rows), 0)
        for k, column in enumerate(table.columns)
    ]
    words = {
        k: max((len(row[k].text) + len(row[k].small) for row in table.rows), default=0)
        for k, column in enumerate(table.columns)
        if not column.numeric
    }
    widest = max(words, key=lambda k: words[k], default=None)
    others = sum(length + 2 for k, length in enumerate(lengths) if k != widest)
    return widest if others <= ROOM else None
