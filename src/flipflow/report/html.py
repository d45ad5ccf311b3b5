"""The report as one HTML file that opens without network and prints on A4."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict

from flipflow.errors import required
from flipflow.plotting.figure import Figure
from flipflow.plotting.layout import LEGEND_ROW, legend_rows
from flipflow.plotting.plotly import START, element, library
from flipflow.plotting.symbols import html_subscript, with_symbols
from flipflow.report.blocks import Block, TitleBlock
from flipflow.report.registry import blocks_of
from flipflow.results.store import write_file
from flipflow.studies.assessment import Assessment
from flipflow.studies.compare import Comparison
from flipflow.studies.design import Proposal
from flipflow.studies.study import Study

if TYPE_CHECKING:
    import jinja2
    from markupsafe import Markup

TEMPLATES = "templates"
LONG = 15  # letters of a word from which on it can be broken anywhere in a table
SHORT = 8  # rows of a table that is not cut across two pages
NARROW = 360.0  # pixels for a figure on a telephone
Reported = Assessment | Comparison | Proposal


class Head(TypedDict):
    """What a report is called, its kind, and what stands at its foot."""

    title: str
    kind: str
    footer: str


def write_html(assessment: Assessment, path: str | os.PathLike[str]) -> Path:
    """Write the report of an assessment as one self-contained HTML file.

    Parameters
    ----------
    assessment
        What :func:`flipflow.assess` returns.
    path
        The file.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    MissingExtra
        When jinja2 is not installed.
    StoreError
        When the file cannot be written.
    """
    target = Path(path)
    write_file(target, html(assessment))
    return target


def html(result: Reported, blocks: Sequence[Block] | None = None) -> str:
    """The report of a result as text; ``blocks`` are those of the result, where they are made."""
    return page(blocks_of(result) if blocks is None else blocks, **head_of(result))


def head_of(result: Reported) -> Head:
    """What the report of a result is called, and what stands at its foot."""
    if isinstance(result, Comparison):
        inputs = ", ".join(one.input_hash for one in result.assessments)
        title, kind, made_of = " and ".join(result.names), "comparison", f"inputs {inputs}"
    elif isinstance(result, Proposal):
        title, kind = result.duty.name, "design"
        made_of = f"duty {title}, seed {result.duty.seed}"
    else:
        title = result.project.document.name or result.project.name
        kind, made_of = "vibration report", f"input {result.input_hash}"
    return {"title": title, "kind": kind, "footer": f"flipflow {result.version}, {made_of}"}


def study_html(found: Study, blocks: Iterable[Block], title: str, name: str) -> str:
    """The page of a study as text; its blocks are those of :mod:`flipflow.report.study`."""
    head = TitleBlock(title, (("Study", name),))
    footer = f"flipflow {found.version}, study {name}"
    return page((head, *blocks), title=title, kind="study", footer=footer)


def page(
    blocks: Sequence[Block], *, title: str, kind: str, footer: str, symbols: bool = False
) -> str:
    """Blocks as one self-contained HTML page.

    Parameters
    ----------
    blocks
        What stands on it.
    title, kind
        Name of the page, and what it is; the latter stands small behind a title block's title.
    footer
        At the foot of every printed sheet.
    symbols
        Whether words such as w_ea and k2 are shown as symbols, and tables keep their words whole:
        for pages without names that are a user's.

    Raises
    ------
    MissingExtra
        When jinja2 is not installed.
    """
    templates = require_templates()
    templates.filters["said"] = _with_symbols if symbols else str
    return templates.get_template("report.html").render(
        blocks=blocks,
        title=title,
        kind=kind,
        footer=footer,
        whole_words=symbols,
        longest=LONG,
        short=SHORT,
        style=_template("report.css"),
        library=library(),
        start=START,
        fit=_template("fit.js"),
        element=_element,
    )


def _element(figure: Figure) -> str:
    """A figure and its layout for a narrow screen, taller by what the legend then takes more."""
    narrow = figure.narrowed(NARROW)
    more = LEGEND_ROW * (legend_rows(narrow) - legend_rows(figure))
    return element(figure, replace(narrow, height=narrow.height + max(more, 0)))


def _with_symbols(text: str) -> Markup:
    from markupsafe import Markup, escape  # noqa: PLC0415  comes with jinja2

    return Markup(with_symbols(str(escape(text)), html_subscript))  # noqa: S704  escaped before


def require_templates() -> jinja2.Environment:
    """What fills the templates; called before long work, so that it is not lost for want of it.

    Raises
    ------
    MissingExtra
        When jinja2 is not installed.
    """
    templates = required("jinja2", "Reports need jinja2", "report")
    made: jinja2.Environment = templates.Environment(
        loader=templates.FunctionLoader(_template),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=templates.StrictUndefined,
    )
    return made


def _template(name: str) -> str:
    return (resources.files("flipflow.report") / TEMPLATES / name).read_text(encoding="utf-8")
