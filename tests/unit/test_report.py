"""The report: right words, right order, every section by itself; one file and 80 columns."""

from __future__ import annotations

import dataclasses
import io
import math
import re
import sys
from dataclasses import dataclass
from types import SimpleNamespace

import pytest
from rich.console import Console

import flipflow as ff
from flipflow.errors import MissingExtra, StoreError
from flipflow.model.quantities import QUANTITIES, quantities_of
from flipflow.plotting.plotly import library
from flipflow.report import first_page, summary, write_html
from flipflow.report.blocks import Heading, Note, Table, Text, TitleBlock, Values, Verdict
from flipflow.report.design import constraints_of_proposal
from flipflow.report.html import html
from flipflow.report.numbers import (
    bounds,
    four_digits,
    multiplier,
    named,
    number,
    percent,
    quantity,
    rpm,
    speed,
)
from flipflow.report.registry import Part, blocks_of, section
from flipflow.studies.allowed_range import allowed_range
from flipflow.studies.assessment import assess

LARGEST = 6e6
DUTY = SimpleNamespace(bounds=ff.Limits(main_frame_acceleration=30.0))


@pytest.fixture(scope="module")
def project():
    return ff.load_project("ffs0827")


@pytest.fixture(scope="module")
def assessment(analysed):
    return analysed("ffs0827")


@pytest.fixture(scope="module")
def page(assessment):
    return html(assessment).replace(library(), "")


def short(project, **changes):
    """The assessment of a changed project, its first case only."""
    return assess(dataclasses.replace(project, load_cases=project.load_cases[:1], **changes))


def printed(assessment):
    out = io.StringIO()
    console = Console(file=out, width=80, highlight=False, markup=False, emoji=False)
    summary(assessment, console)
    return out.getvalue()


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (5.1167, "5.12"), (0.97858, "0.979"), (11.638, "11.6"), (448.4, "448"), (1897.4, "1897"),
        (0.0, "0"), (-8.014, "-8.01"), (99.96, "100"), (math.inf, "infinite"), (math.nan, "-"),
    ],
)  # fmt: skip
def test_numbers_have_three_to_four_digits(value, text):
    assert number(value) == text


def test_quantities_come_with_their_unit():
    assert quantity(0.0051167, "mm", "m") == "5.12 mm"
    assert quantity(28.7359, "g", "m/s^2") == "2.93 g"
    assert quantity(None, "kN", "N") == "-"
    assert quantity(math.nan, "mm", "m") == "-"
    assert quantity(84.41, "kN", "N") == "84.4 N"
    assert quantity(8.24, "kW", "W", with_unit=False) == "0.00824"
    assert [four_digits(value) for value in (12.9, 713.0, 1971.2, 25000.0)] == [
        "12.90", "713.0", "1971", "25000",
    ]  # fmt: skip
    assert named(QUANTITIES["jump_margin"], math.inf) == "no jump"
    assert rpm(850.0 * math.pi / 30.0) == "850"
    assert speed(850.0 * math.pi / 30.0) == "850 rpm (14.17 Hz, 89.01 rad/s)"


def test_limits_are_said_in_words():
    assert bounds(0.005, 0.008, "mm", "m") == "5 to 8 mm"
    assert bounds(-math.inf, 15e3, "kN", "N") == "at most 15 kN"
    assert bounds(0.2, math.inf, "%", "") == "at least 20 %"
    assert bounds(-math.inf, math.inf, "%", "") == "-"
    assert percent(-0.0842) == "-8.42 %"
    assert percent(4.4837) == "+448 %"


def test_multipliers_show_pairs_once():
    assert multiplier(0.1319 - 0.7667j) == "0.1319 ± 0.7667i"
    assert multiplier(-0.5 + 0j) == "-0.5"


def test_the_report_opens_with_title_and_verdict(assessment):
    blocks = blocks_of(assessment)
    assert isinstance(blocks[0], TitleBlock)
    assert blocks[1] == Verdict(assessment.verdict, "attention")
    parts = [b.text for b in blocks if isinstance(b, Heading) and b.level == 1]
    assert parts == [
        "The machine",
        "Results",
        "What moves the amplitude",
        "Start, stop and disturbances",
        "Loads on the foundation",
        "Appendix",
    ]


def test_every_limit_stands_in_the_table_with_its_state(assessment):
    (table,) = first_page.limits(assessment)
    assert [row[0].text.lower() for row in table.rows] == [
        row.label for row in assessment.limits_table
    ]
    assert [row[-1].state for row in table.rows] == [row.state for row in assessment.limits_table]
    relative = table.rows[0]
    assert [cell.text for cell in relative[1:4]] == ["5 to 8 mm", "5.12 mm", "full, stiffening"]


def test_a_stop_that_is_not_reached_is_said(assessment):
    (table,) = first_page.cases(assessment)
    by_case = {row[0].text: row[-1].text for row in table.rows}
    assert by_case["full, stiffening"] == "not reached"
    assert by_case["empty"] == "7.14"
    assert first_page.stop_sentence(assessment).startswith("not reached in full, stiffening")


def test_a_machine_without_stops_says_so(analysed):
    linear = analysed("ffs0827-linear")
    assert first_page.stop_sentence(linear) == "the machine has none."
    assert linear.state == "fail"
    assert "none; no speed meets all limits" in allowed_range(linear.region)
    assert "fail" in printed(linear)


def test_what_cannot_be_checked_names_what_is_missing(project):
    bare = short(project, screen=project.screen.replace(shear_height=None, normal_damping=None))
    (table,) = first_page.limits(bare)
    rows = {row[0].text: row for row in table.rows}
    assert rows["Shear strain"][-1].text == "not checked"
    assert "shear_springs.height" in rows["Shear strain"][3].text
    assert bare.state == "not checked"
    notes = [b.text for b in blocks_of(bare) if isinstance(b, Note)]
    assert any("Orbits are not drawn" in note for note in notes)


def test_without_a_speed_the_allowed_range_remains(project):
    idle = short(project, speed=None)
    kinds = [type(block) for block in first_page.verdict(idle)]
    assert kinds[:2] == [Verdict, Text]
    assert not list(first_page.cases(idle))
    assert not list(first_page.surroundings(idle))
    assert "not given" in html(idle).replace(library(), "")


def test_every_quantity_is_explained(page):
    for one in quantities_of("motion"):
        assert one.sentence.replace("'", "&#39;") in page


def test_every_value_stands_with_its_source(page, project):
    for key in project.written:
        assert key.startswith("load case") or key in page
    assert "Minerals 2024, 14, 406, Table 1" in page


def test_the_appendix_names_method_version_and_input(assessment, page):
    for text in ("pseudo-arclength", f"version {assessment.version}", assessment.input_hash):
        assert text in page
    assert "returns after a small disturbance" in page
    assert "jump when the speed rises (fold)" in page


def test_the_page_asks_for_nothing_outside_itself(page):
    own = re.sub(r'xmlns="http://www\.w3\.org/2000/svg"', "", page)
    assert "http" not in own
    assert not re.search(r'(?:src|href)="(?!data:)', own)
    assert "@import" not in own
    assert "url(" not in own


def test_text_of_the_file_cannot_become_markup(project):
    document = dataclasses.replace(project.document, name="<script>alert(1)</script>")
    loads = (ff.Load(name="</script><b>full</b>"),)
    tricky = assess(dataclasses.replace(project, document=document, load_cases=loads))
    text = html(tricky)
    assert "<script>alert" not in text
    assert "</script><b>" not in text


def test_the_file_is_one_and_not_too_large(assessment, tmp_path):
    path = write_html(assessment, tmp_path / "report.html")
    assert path.stat().st_size < LARGEST
    assert path.read_text(encoding="utf-8").count(library()[:200]) == 1
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_that_cannot_be_written_is_an_error(assessment, tmp_path):
    with pytest.raises(StoreError, match="cannot be written"):
        write_html(assessment, tmp_path / "missing" / "report.html")


def test_without_jinja_the_extra_is_named(assessment, monkeypatch):
    monkeypatch.setitem(sys.modules, "jinja2", None)
    with pytest.raises(MissingExtra, match="report"):
        html(assessment)


def test_the_summary_opens_with_the_verdict_and_keeps_80_columns(assessment):
    text = printed(assessment)
    assert max(map(len, text.splitlines())) <= 80
    words = " ".join(text.split())
    assert words.startswith(assessment.verdict)
    for expected in ("Allowed speed range: 845 to", "attention", "not reached"):
        assert expected in words


def test_later_work_adds_sections_without_touching_a_template():
    @dataclass(frozen=True)
    class Study:
        count: int

    @section(Study, Part.DETAILS, 20)
    def table(study):
        yield Values((("Machines", str(study.count)),))

    @section(Study, Part.FIRST_PAGE, 10, brief=True)
    def head(_study):
        yield Verdict("All is well.", "pass")

    assert blocks_of(Study(3)) == (
        Verdict("All is well.", "pass"),
        Values((("Machines", "3"),)),
    )
    assert blocks_of(Study(3), brief=True) == (Verdict("All is well.", "pass"),)


def test_rows_fit_their_columns(assessment):
    for block in blocks_of(assessment):
        if isinstance(block, Table):
            assert {len(row) for row in block.rows} == {len(block.columns)}


def test_a_gap_without_end_has_no_unit():
    assert quantity(math.inf, "mm", "m") == "infinite"


@pytest.mark.parametrize(("excess", "said"), [(1e-7, "0.00"), (-1e-7, "0.00"), (0.1, "-10.00")])
def test_a_margin_that_is_used_up_has_no_sign(excess, said):
    (row,) = (
        row
        for block in constraints_of_proposal(
            SimpleNamespace(
                prices={},
                excess={"main_frame_acceleration": excess},
                duty=DUTY,
                assessment=None,
            )
        )
        if isinstance(block, Table)
        for row in block.rows
    )
    assert row[2].text == said
