"""Figures as a journal takes them: 84 mm wide, 8 point, nothing cut off, nothing covered."""

from __future__ import annotations

import ast
import itertools
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import pytest
from PIL import Image
from test_how_to import CELL, MOST_COLUMNS, MOST_STATEMENTS, QUESTION, statements
from test_results_travel import MADE, made

import flipflow as ff
from flipflow.plotting.layout import legend_names
from flipflow.plotting.print import printed, svg_alone
from judge import close
from svg_words import boxes_of

poppler = pytest.mark.skipif(
    shutil.which("pdftotext") is None, reason="poppler-utils is not installed"
)

GALLERY = (Path(__file__).parents[2] / "docs" / "gallery.md").read_text(encoding="utf-8")
MACHINES, *PARTS = QUESTION.split(GALLERY)
CODE = dict(zip(PARTS[::2], (CELL.findall(part)[0] for part in PARTS[1::2]), strict=True))
WIDTH, POINTS = 84.0, 8.0
SLACK = 0.5  # pixels of 1/96 inch: letters reach a little beyond where they begin


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


def test_a_notebook_shows_a_figure_as_it_is_written(tmp_path) -> None:
    drawn = ff.figure(made("Orbit"), width=WIDTH)
    written = drawn.write(tmp_path / "it.svg").read_text(encoding="utf-8")
    assert drawn._repr_svg_() == written


def test_what_figures_of_one_page_refer_to_is_their_own() -> None:
    """A page of a notebook holds several, of which each clips and hatches by name."""
    shown = [ff.figure(made(name), width=WIDTH)._repr_svg_() for name in ("Sensitivity", "Orbit")]
    named = [set(re.findall(r'id="(\w+)"', one)) for one in shown]
    assert all(named)
    assert named[0].isdisjoint(named[1])
    for one, names in zip(shown, named, strict=True):
        assert set(re.findall(r'="url\(#(\w+)\)"', one)) == names


def test_words_of_an_svg_are_text_and_symbols_have_subscripts() -> None:
    figure = replace(ff.figure(made("OperatingRegion"), width=WIDTH), symbols=True)
    words = ET.fromstring(svg_alone(figure)).iter("{http://www.w3.org/2000/svg}text")  # noqa: S314
    said = {"".join(one.itertext()): [part.text for part in one] for one in words}
    assert said["ωea"] == ["ea"]
    assert said["shaft speed, rpm"] == []


@poppler
def test_a_pdf_has_its_size_its_words_and_its_fonts(tmp_path) -> None:
    figure = replace(ff.figure(made("Branch"), width=WIDTH), subject="FFS0827, *b* $c$ #d <i>")
    sheet = figure.write(tmp_path / "it.pdf")
    assert printed(figure, "pdf") == sheet.read_bytes()
    told = _told("pdfinfo", sheet)
    wide, _ = re.findall(r"Page size: +([\d.]+) x ([\d.]+)", told)[0]
    close("width, mm", float(wide) * 25.4 / 72.0, WIDTH, abs=0.01)
    assert re.search(rf"Title: +{figure.title}\n", told)
    assert "CreationDate" not in told
    assert all(
        row.split()[-5:-2] == ["yes"] * 3 for row in _told("pdffonts", sheet).splitlines()[2:]
    )
    assert len(_told("pdfimages", "-list", sheet).splitlines()) == 2
    words = " ".join(_told("pdftotext", sheet, "-").split())
    for said in ("jump (rising) 1971 rpm", "main frame (x1)", figure.subject):
        assert said in words


@poppler
def test_a_letter_that_no_font_has_leaves_the_others_as_they_are(tmp_path) -> None:
    """matplotlib keeps a font of boxes for every letter, which a whole name was set in."""
    figure = replace(ff.figure(made("Branch"), width=WIDTH), subject="Sieb 筛分机, load case hot")
    fonts = _told("pdffonts", figure.write(tmp_path / "it.pdf"))
    assert "LastResort" not in fonts
    assert "DejaVuSans" in fonts or "Liberation" in fonts or "Arial" in fonts


def test_a_png_has_its_dots() -> None:
    figure = ff.figure(made("Branch"), width=WIDTH)
    content = printed(figure, "png")
    assert printed(figure, "png") == content
    with Image.open(BytesIO(content)) as picture:
        assert picture.size[0] == round(WIDTH / 25.4 * 300.0)
        close("dots per inch", picture.info["dpi"][0], 300.0, abs=0.01)
        assert picture.convert("RGBA").getpixel((0, 0)) == (255, 255, 255, 255)


def _told(*command: str | Path) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def _ready_for_print(figure: ff.Figure) -> None:
    svg = svg_alone(figure)
    sheet = ET.fromstring(svg)  # noqa: S314  ours
    wide, high = (float(one) for one in sheet.attrib["viewBox"].split()[2:])
    scale = float(sheet.attrib["width"].removesuffix("mm")) / wide
    close("width, mm", scale * wide, WIDTH, rel=1e-5)
    close("height", float(sheet.attrib["height"].removesuffix("mm")), scale * high, rel=1e-5)
    close("size of words", float(sheet.attrib["font-size"]) * scale * 72.0 / 25.4, POINTS, rel=1e-3)
    assert not any(one.get("font-size") for one in sheet.iter() if one is not sheet)
    boxes = boxes_of(svg)
    assert boxes
    for one in boxes:
        inside = min(one.left, one.top, wide - one.right, high - one.foot) >= -SLACK
        assert inside, f"{one} is cut off: {wide} x {high}"
    for one, two in itertools.combinations(boxes, 2):
        assert one.overlap(two) <= SLACK, f"{one} and {two} cover each other"
    names = legend_names(figure)
    foot = max((one.foot for one in boxes if one.text in names), default=0.0)
    panels = [one[0].attrib["d"] for one in sheet.iter("{http://www.w3.org/2000/svg}clipPath")]
    assert len(panels) == len(figure.panels)
    assert all(float(way.split("h")[0].split()[1]) >= foot for way in panels)
