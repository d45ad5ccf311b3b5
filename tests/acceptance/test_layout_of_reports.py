"""Many load cases, long names and odd ones: nothing is cut, squashed or taken for markup."""

from __future__ import annotations

import dataclasses
import json
import re
import shutil
import subprocess

import pytest

import flipflow as ff
from flipflow.plotting.bars import energy_figure
from flipflow.plotting.layout import arrange
from flipflow.plotting.panels import PAGE_WIDTH
from flipflow.plotting.plotly import described
from flipflow.plotting.print import svg_alone
from flipflow.plotting.response import case_names, cases_figure
from flipflow.report.blocks import FigureBlock, Heading, Note, Table, Text
from flipflow.report.registry import blocks_of
from flipflow.studies.assessment import assess
from flipflow.studies.compare import Comparison
from svg_words import boxes_of

CHROMIUM = shutil.which("chromium")
READER = shutil.which("pdftotext")
SHEET = 1054  # pixels of an A4 page within its margins
ODD = 'voll <i> "Öl" & $x_1$'
LONG = "vollbeladen mit nassem, klebrigem Schüttgut bei halber Aufgabeleistung und Frost"
CUSTOMER = "Gesellschaft für Aufbereitungstechnik und Siebmaschinenbau mbH"


@pytest.fixture(scope="module")
def project():
    return ff.load_project("ffs0827")


@pytest.fixture(scope="module")
def odd(project):
    """Load cases with names that a figure could choke on."""
    loads = tuple(
        ff.Load(name=name, stiffness_factor=1.0 + 0.1 * k)
        for k, name in enumerate(("empty", ODD, LONG))
    )
    return assess(dataclasses.replace(project, load_cases=loads))


def figures_of(assessment):
    return [b.figure for b in blocks_of(assessment) if isinstance(b, FigureBlock)]


def texts(sheet):
    """The text of each page."""
    text = subprocess.run([READER, "-layout", sheet, "-"], capture_output=True, check=True).stdout
    return text.decode().split("\f")[:-1]


def test_no_word_of_a_name_is_markup_or_an_entity(odd):
    """plotly.js reads "<i>" as markup and shows entities it does not know, "&quot;" say."""
    escaped = 'voll &lt;i&gt; "Öl" &amp; $x_1$'
    for figure in figures_of(odd):
        text = json.dumps(described(figure), ensure_ascii=False)
        assert "&quot;" not in text
        assert "<i>" not in text
    names = {item["name"] for item in described(cases_figure(odd))["data"]}
    assert escaped in names


def test_a_name_in_dollars_is_no_formula_in_print(odd, tmp_path):
    path = cases_figure(odd).write(tmp_path / "cases.svg")
    assert "$x_1$" in path.read_text(encoding="utf-8")


def test_a_long_name_leaves_the_energy_chart_its_room(odd):
    figure = energy_figure(odd)
    (rect,) = arrange(figure).rects
    assert rect.width > 0.5 * PAGE_WIDTH
    words = [word for _, word in figure.panels[0].y.ticks]
    assert words[2].startswith("vollbeladen mit nassem")
    assert max(len(line) for word in words for line in word.splitlines()) <= 36


def test_long_names_stay_within_every_figure(odd):
    """Legends, titles of panels and words beside bars were cut off at the edge."""
    longer = f"{LONG}, {LONG}"
    names = (f"{longer}, A", f"{longer}, B")
    loads = (ff.Load(name="empty"), *(ff.Load(name=name, stiffness_factor=1.2) for name in names))
    project = dataclasses.replace(odd.project, load_cases=loads[1:], name=names[0])
    found = assess(project)
    twin = dataclasses.replace(found, project=dataclasses.replace(project, name=names[1]))
    grid = {"clearance": [5e-3, 6e-3], "stop_stiffness": [7e6, 8e6]}
    study = ff.study(project.screen, grid, ("stroke",), omega=project.speed, load_cases=loads[1:])
    motions = {name: case.orbit for name, case in zip(names, found.cases, strict=True)}
    drawn = (
        Comparison(names, (found, twin)), found.region, study,
        ff.loading(project.screen, loads[1]), ff.foundation_loads(motions),
    )  # fmt: skip
    for result in drawn:
        figure = ff.figure(result)
        boxes = boxes_of(svg_alone(figure))
        told = [box.text for box in boxes if LONG[:20] in box.text]
        assert told
        assert all(box.left >= 0.0 and box.right <= figure.width for box in boxes), told


def test_long_names_that_begin_alike_stay_apart():
    names = [f"{LONG}, Fall {k}" for k in range(3)]
    assert len(set(case_names(names))) == 3


def test_every_figure_of_many_cases_fits_a_page(thirty_cases):
    for figure in figures_of(thirty_cases):
        assert figure.height < SHEET - 60, figure.title
    orbits = [f for f in figures_of(thirty_cases) if f.title.startswith("Orbits of both frames")]
    shown = [panel.title for figure in orbits for panel in figure.panels if panel.equal]
    assert [title for title in shown if title] == [case.name for case in thirty_cases.cases]


def test_the_model_limits_stand_on_the_back_of_the_first_page(odd, thirty_cases):
    for assessment in (odd, thirty_cases):
        blocks = blocks_of(assessment)
        first = next(k for k, b in enumerate(blocks) if isinstance(b, Heading) and b.new_page)
        paragraph = blocks[first + 1]
        assert isinstance(paragraph, Text)
        assert paragraph.lead == "Model limits:"
        for word in ("rigid", "pitch", "panels", "mass attached"):
            assert word in paragraph.text
        assert sum(isinstance(b, Text) and b.lead == "Model limits:" for b in blocks) == 1


def test_values_without_a_source_are_one_line(project):
    bare = dataclasses.replace(project, sources={}, load_cases=project.load_cases[:2])
    blocks = blocks_of(assess(bare))
    notes = [b.text for b in blocks if isinstance(b, Note) and "No source given" in b.text]
    assert len(notes) == 1
    assert re.fullmatch(r"No source given for (\d+) of \1 values and 2 of 2 load cases\.", notes[0])
    cells = [c.text for b in blocks if isinstance(b, Table) for row in b.rows for c in row]
    assert not any("no source" in text.lower() for text in cells)


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None or READER is None, reason="chromium or pdftotext is missing")
def test_thirty_cases_stand_on_fewer_than_thirty_pages(thirty_cases, printed_page):
    pages = texts(printed_page(thirty_cases))
    assert len(pages) < 30
    for page in pages[:-1]:
        assert len(page.split()) > 40


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None or READER is None, reason="chromium or pdftotext is missing")
@pytest.mark.parametrize("count", [1, 4])
@pytest.mark.parametrize("name", ["FFS0827", "Spannwellensiebmaschine für Rostasche, " + LONG])
def test_a_long_title_block_leaves_no_page_of_five_lines(
    project, analysed, printed_page, count, name
):
    document = dataclasses.replace(project.document, customer=CUSTOMER, name=name)
    found = analysed(dataclasses.replace(project, load_cases=project.load_cases[:count]))
    changed = dataclasses.replace(found.project, document=document)
    changed = dataclasses.replace(found, project=changed)
    _, second, *_ = texts(printed_page(changed, begin=True))
    assert len(second.split()) > 150
    assert "Model limits" in second
