"""Figures within a page for print: ticks and widths are matplotlib's, words stay words."""

from __future__ import annotations

import itertools
import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from matplotlib import font_manager
from matplotlib.ft2font import LoadFlags
from matplotlib.ticker import MaxNLocator, ScalarFormatter

from flipflow.plotting.figure import Figure
from flipflow.plotting.font import FAMILY, font_folder, width_of
from flipflow.plotting.layout import FONT
from flipflow.plotting.panels import Axis, Band, Bar, Cells, Line, Note, Panel, Trace
from flipflow.plotting.svg import searchable_svg
from flipflow.plotting.view import STEPS, round_ticks

NAME = "{http://www.w3.org/2000/svg}"
X, Y = Axis("x", "mm", (0.0, 10.0)), Axis("y", "mm", (0.0, 10.0))


def drawn(*panels, columns=1):
    return ET.fromstring(searchable_svg(Figure("a", "b.", panels, columns)))  # noqa: S314  ours


def words(root):
    return [text.text for text in root.iter(f"{NAME}text")]


def paths(root, **look):
    """The ways of the paths of such a look."""
    found = [one for one in root.iter(f"{NAME}path") if look.items() <= one.attrib.items()]
    return [one.attrib["d"] for one in found]


def test_round_ticks_are_those_of_matplotlib():
    rng = np.random.default_rng(1)
    for _ in range(200):
        low = rng.normal() * 10.0 ** rng.uniform(-2.0, 4.0)
        high = low + 10.0 ** rng.uniform(-2.0, 4.0)
        steps = int(rng.integers(3, 10))
        at = MaxNLocator(steps, steps=STEPS).tick_values(low, high)
        at = at[(at >= low) & (at <= high)]
        writer = ScalarFormatter(useOffset=False)
        writer.set_scientific(False)
        writer.create_dummy_axis()
        writer.axis.set_view_interval(low, high)
        ticks = round_ticks(low, high, steps)
        np.testing.assert_allclose([one for one, _ in ticks], at, atol=1e-9 * (high - low))
        assert [word for _, word in ticks] == writer.format_ticks(at)


def test_words_are_as_wide_as_in_the_font():
    file = font_manager.findfont(FAMILY)
    assert file.startswith(str(font_folder()))
    font = font_manager.get_font(file)
    font.set_size(FONT, 72.0)
    for text in ("full, carried mass", "-0.0025", "WWW", "Siebbelagsversteifung ± ω"):
        font.set_text(text, 0.0, flags=LoadFlags.NO_HINTING)
        assert width_of(text) == pytest.approx(font.get_width_height()[0] / 64.0, abs=3.0)
    assert width_of("a\nWWW") == width_of("WWW")
    assert width_of("载荷") == 2.0 * FONT


def test_ticks_whose_words_would_touch_are_fewer():
    narrow = Axis("x", "mm", (0.0, 0.0001))
    root = drawn(*[Panel(narrow, Y)] * 4, columns=4)
    assert words(root).count("0.00000") == 4
    boxes = [
        (float(one.get("x")), width_of(one.text))
        for one in root.iter(f"{NAME}text") if (one.text or "").startswith("0.0000")
    ]  # fmt: skip
    for (x, wide), (other, also) in itertools.pairwise(boxes):
        assert other < x or other - x > (wide + also) / 2.0


def test_an_axis_without_bounds_shows_all_and_one_without_data_something():
    trace = Trace("a", np.array([2.0, 3.0, np.nan]), np.array([5.0, 5.0, 1.0]), "point", "main")
    line = Line("x", 4.0)
    root = drawn(Panel(Axis("x"), Axis("y"), (trace,), lines=(line,)), Panel(Axis("x"), Axis("y")))
    shown = [float(one.replace("\N{MINUS SIGN}", "-")) for one in words(root) if one not in "xy"]
    assert min(shown) == 0.0
    assert max(shown) == 5.0
    one = Panel(Axis("x"), Axis("y", "", (0.0, 0.0)), (Trace("a", np.ones(1), np.zeros(1)),))
    assert "0.00" in words(drawn(one))


def test_holes_of_lines_and_areas_stay_open():
    x = np.arange(7.0)
    y = np.array([1.0, 2.0, np.nan, 4.0, 5.0, np.inf, 7.0])
    area = Trace("b", x, y, lower=np.zeros(7), colour="case band")
    root = drawn(Panel(X, Y, (Trace("a", x, y, colour="main"), area)))
    (_, line) = paths(root, **{"stroke-linecap": "square", "stroke": "#1f5fa8"})
    assert [way.count("L") for way in line.split("M")[1:]] == [1, 1, 0]
    (_, filled) = paths(root, fill="rgba(31,95,168,0.15)")
    assert filled.count("z") == 3


def test_marks_stand_along_a_line_and_none_where_it_has_no_point():
    x = np.linspace(0.0, 10.0, 1001)
    line = Trace("a", x, x, colour="main", symbol="square")
    (marks,) = paths(drawn(Panel(X, Y, (line,))), fill="white")
    assert marks.count("M") == 7  # apart by 15 % of the diagonal, the first half a step in
    nothing = Trace("a", np.array([np.nan]), np.array([np.nan]), colour="main", symbol="square")
    assert paths(drawn(Panel(X, Y, (nothing, nothing))), fill="white") == []


@pytest.mark.parametrize("length", [0.0, 0.1])
def test_a_line_too_short_for_the_first_mark_has_one(length):
    x = np.array([5.0, 5.0 + length])
    line = Trace("a", x, x, colour="main", symbol="triangle")
    (marks,) = paths(drawn(Panel(X, Y, (line,))), fill="white")
    assert marks.count("M") == 1


def test_cells_of_a_kind_are_one_path():
    cells = Cells(np.arange(4.0), np.arange(3.0), np.array([[0, 1, 1], [0, 0, 1]]),
                  ("case 0", "case 1"))  # fmt: skip
    root = drawn(Panel(X, Y, cells=(cells,)))
    assert [paths(root, fill=fill)[0].count("z") for fill in ("#eceef0", "#8fb7e6")] == [3, 3]


def test_every_hatch_and_every_mark_is_drawn():
    bars = [
        Bar("b", 1.0, 2.0, 3.0, hatch=hatch, text="7 kW") for hatch in ("/", "\\", "x", "-", ".")
    ]
    kinds = ("circle", "circle-open", "square", "triangle", "triangle-open", "diamond", "cross",
             "star")  # fmt: skip
    clouds = [Trace(one, np.ones(1), np.ones(1), "point", "main", one) for one in kinds]
    root = drawn(Panel(X, Y, tuple(clouds), tuple(bars)))
    patterns = {one.attrib["id"] for one in root.iter(f"{NAME}pattern")}
    assert len(patterns) == 5
    used = {one.get("fill") for one in root.iter(f"{NAME}path")}
    assert {f"url(#{one})" for one in patterns} <= used
    assert words(root).count("7 kW") == 5
    outlines = [re.sub(r"^M\S+ [^a-z]+", "", way) for way in paths(root, stroke="#1f5fa8")]
    assert len(set(outlines)) == 7  # open and full circles have the same


def test_a_text_of_a_user_is_no_markup_and_its_lines_stand_apart():
    note = Note(5.0, 5.0, '<i> & "Öl"<br>$x_1$', "center")
    root = drawn(Panel(X, Y, notes=(note,), bands=(Band("y", 1.0, 2.0, "contact"),)))
    first, second = (one for one in root.iter(f"{NAME}text") if one.text in {'<i> & "Öl"', "$x_1$"})
    assert float(second.get("y")) - float(first.get("y")) == pytest.approx(1.2 * FONT, abs=0.01)


def test_panels_at_one_scale_and_those_that_give_way_keep_within_their_place():
    wide = Panel(X, Axis("y", "mm", (0.0, 1e-5)), title="first")
    root = drawn(wide, Panel(X, Axis("y", "mm", (0.0, 2.0)), equal=True), columns=2)
    first, second = (
        [float(n) for n in re.findall(r"-?[\d.]+", clip[0].attrib["d"])]
        for clip in root.iter(f"{NAME}clipPath")
    )
    assert second[2] / second[3] == pytest.approx(5.0, rel=1e-3)
    (title,) = (one for one in root.iter(f"{NAME}text") if one.get("transform") and
                float(one.get("x")) < first[0])  # fmt: skip
    assert float(title.get("x")) > 0.7 * FONT
