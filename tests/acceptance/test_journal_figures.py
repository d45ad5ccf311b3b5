"""Figures as a journal takes them: 84 mm wide, 8 point, nothing cut off, nothing covered."""

from __future__ import annotations

import ast
import itertools
import re
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import matplotlib as mpl
import pytest
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Sheet
from matplotlib.text import Text
from test_how_to import CELL, MOST_COLUMNS, MOST_STATEMENTS, QUESTION, statements
from test_results_travel import MADE, made

import flipflow as ff
from flipflow.plotting.print import STYLE, drawn_sheet
from flipflow.plotting.svg import searchable_svg
from judge import close

GALLERY = (Path(__file__).parents[2] / "docs" / "gallery.md").read_text(encoding="utf-8")
MACHINES, *PARTS = QUESTION.split(GALLERY)
CODE = dict(zip(PARTS[::2], (CELL.findall(part)[0] for part in PARTS[1::2]), strict=True))
WIDTH, POINTS = 84.0, 8.0
SLACK = 0.5  # pixels of 1/96 inch: boxes of text are rounded to whole ones


@pytest.fixture(scope="module")
def gallery() -> dict[str, ff.Figure]:
    """Each figure of the page, drawn by the page's own code."""
    names: dict[str, object] = {"__name__": "__main__"}
    figures = {}
    exec(CELL.findall(MACHINES)[0], names)  # noqa: S102
    for title, code in CODE.items():
        *before, last = ast.parse(code).body
        exec(compile(ast.Module(before, []), title, "exec"), names)  # noqa: S102
        figures[title] = eval(compile(ast.Expression(last.value), title, "eval"), names)  # noqa: S307
    return figures


@pytest.mark.parametrize("title", CODE)
def test_a_figure_takes_a_few_public_calls(title: str) -> None:
    """The last of them is the figure that the page shows: nothing comes after."""
    code = CODE[title]
    assert len(list(statements(code))) <= MOST_STATEMENTS
    assert max(map(len, code.splitlines())) <= MOST_COLUMNS
    assert re.fullmatch(r"ff\.figure\(.*, width=84\)", code.splitlines()[-1])
    assert "import" not in code


@pytest.mark.parametrize("title", CODE)
def test_a_figure_of_the_gallery_is_ready_for_print(gallery, title: str) -> None:
    _ready_for_print(gallery[title])


def test_the_gallery_shows_what_a_paper_needs() -> None:
    assert len(CODE) == 12
    for word in (
        "special points", "gaps", "unit circle", "Poincare", "Basins", "bifurcation", "Lyapunov",
        "cusp", "doubling", "matters", "phase portraits", "Loads",
    ):  # fmt: skip
        assert any(word in title for title in CODE), word


@pytest.mark.parametrize("name", MADE)
def test_every_result_is_ready_for_print(name: str) -> None:
    _ready_for_print(ff.figure(made(name), width=WIDTH))


@pytest.mark.parametrize("name", MADE)
def test_a_figure_within_a_page_says_the_words_of_that_on_its_own(name: str) -> None:
    """Two renderers draw them: ticks, titles, labels and legends are the same."""
    for width in (None, WIDTH):
        figure = ff.figure(made(name), width=width)
        page = ET.fromstring(searchable_svg(figure))  # noqa: S314  ours
        said = [one.text for one in page.iter("{http://www.w3.org/2000/svg}text")]
        with mpl.rc_context({**STYLE, "font.family": "DejaVu Sans"}):
            sheet = drawn_sheet(figure)
            alone = [line for one in _words(sheet) for line in one.get_text().split("\n")]
        assert Counter(said) == Counter(alone)


def test_a_notebook_shows_a_figure_as_it_is_written(tmp_path) -> None:
    drawn = ff.figure(made("Orbit"), width=WIDTH)
    written = drawn.write(tmp_path / "it.svg").read_text(encoding="utf-8")
    assert drawn._repr_svg_() == written


def _ready_for_print(figure: ff.Figure) -> None:
    with mpl.rc_context({**STYLE, "font.family": "DejaVu Sans"}):  # the widest of the families
        sheet = drawn_sheet(figure)
        canvas = FigureCanvasAgg(sheet)
        canvas.draw()
        renderer = canvas.get_renderer()
        close("width, mm", sheet.get_figwidth() * 25.4, WIDTH, rel=1e-9)
        words = list(_words(sheet))
        assert words
        for one in words:
            close(f"size of {one.get_text()!r}", one.get_fontsize(), POINTS, rel=1e-12)
        boxes = [(one.get_text(), one.get_window_extent(renderer)) for one in words]
        wide, high = canvas.get_width_height()
        for text, box in boxes:
            inside = min(box.x0, box.y0, wide - box.x1, high - box.y1) >= -SLACK
            assert inside, f"{text!r} is cut off: {box} of {wide} x {high}"
        for (one, first), (two, second) in itertools.combinations(boxes, 2):
            covered = min(first.x1, second.x1) - max(first.x0, second.x0) > SLACK and (
                min(first.y1, second.y1) - max(first.y0, second.y0) > SLACK
            )
            assert not covered, f"{one!r} and {two!r} cover each other: {first}, {second}"
        for legend in sheet.legends:
            box = legend.get_window_extent(renderer)
            assert not any(axes.get_window_extent(renderer).overlaps(box) for axes in sheet.axes)


def _words(sheet: Sheet) -> Iterator[Text]:
    """Every text that is seen: of legends, ticks, axes and labels."""
    for legend in sheet.legends:
        yield from legend.get_texts()
    for axes in sheet.axes:
        yield from (one for one in axes.texts if one.get_text())
        for axis in (axes.xaxis, axes.yaxis):
            yield from _along(axis)


def _along(axis: Axis) -> Iterator[Text]:
    shown = [tick.label1 for tick in axis._update_ticks()]
    yield from (one for one in (*shown, axis.label, axis.get_offset_text()) if one.get_text())
