"""How claims are decided, and the pieces that figures of the paper are made of."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import flipflow as ff
from flipflow.continuation.branch import _least
from flipflow.continuation.branch_status import BranchStatus
from flipflow.errors import InputError
from flipflow.paper.claims import Number, Part, Verdict, agrees, decide, runs
from flipflow.paper.page import blocks
from flipflow.paper.registry import FIGURES, chosen
from flipflow.paper.reproduce import reproduce
from flipflow.paper.trends import (
    DOWN,
    SECOND,
    UP,
    ZONE,
    AmplitudeTrend,
    Trend,
    Unchanged,
    ZoneTrend,
)
from flipflow.plotting.plotly import described
from flipflow.report.blocks import FigureBlock, Table
from flipflow.studies.response_family import ResponseFamily, response_family

LABELS = ("4 mm", "6 mm", "8 mm")


@pytest.fixture(scope="module")
def family(screen):
    return response_family(screen, {"clearance": [4e-3, 6e-3, 8e-3]}, omega=(5.0, 250.0))


@pytest.mark.parametrize(
    ("answers", "verdict"),
    [
        ((True, True), Verdict.HOLDS),
        ((True, False), Verdict.IN_PART),
        ((True, None), Verdict.IN_PART),
        ((False, None), Verdict.FAILS),
        ((False, False), Verdict.FAILS),
        ((None, None), Verdict.UNDECIDED),
        ((), Verdict.UNDECIDED),
    ],
)
def test_verdict_from_parts(answers, verdict):
    assert decide([Part(str(k), a) for k, a in enumerate(answers)]).verdict is verdict


def test_where_names_what_holds_and_what_does_not():
    found = decide([Part("left", True), Part("right", False)], {"x": Number(1.0, "mm")})
    assert found.where == "Holds: left. Does not hold: right."
    assert found.numbers["x"].unit == "mm"


@pytest.mark.parametrize(
    ("computed", "published", "digits", "answer"),
    [(5.548, 5.5, 1, True), (0.94, 1.0, 1, False), (0.951, 1.0, 1, True), (11.42, 11.5, 1, True),
     (31.6, 33.0, 0, False), (-16.94, -17.0, 1, True), (16.94, -17.0, 1, False)],
)  # fmt: skip
def test_agreement_with_a_published_number(computed, published, digits, answer):
    assert agrees(computed, published, digits) is answer


def test_runs_join_equal_steps():
    parts = list(runs(("2", "3", "4", "5"), (True, True, False)))
    assert parts == [Part("2 to 4", True), Part("4 to 5", False)]


def test_figures_are_found_by_short_and_long_names():
    names = [one.name for one in chosen(("12", "figure-02c", "2C", "figure-4"))]
    assert names == ["figure-02c", "figure-04", "figure-12"]
    assert [one.name for one in chosen(())] == list(FIGURES)
    with pytest.raises(InputError, match="figure-21"):
        chosen(("22",))


def test_trends_go_one_way_only(family):
    assert Trend(SECOND, DOWN).evaluate(family, LABELS).verdict is Verdict.HOLDS
    assert Trend(SECOND, UP).evaluate(family, LABELS).verdict is Verdict.FAILS
    assert ZoneTrend(UP, appears=True).evaluate(family, LABELS).verdict is Verdict.HOLDS
    assert ZoneTrend(DOWN).evaluate(family, LABELS).verdict is Verdict.IN_PART
    assert AmplitudeTrend(UP).evaluate(family, LABELS).verdict is Verdict.HOLDS
    assert AmplitudeTrend(DOWN).evaluate(family, LABELS).verdict is Verdict.FAILS
    assert Unchanged((ZONE,)).evaluate(family, LABELS).verdict is Verdict.FAILS


def test_a_failed_row_is_marked_and_leaves_claims_open(family):
    last = family.members[-1]
    failed = dataclasses.replace(last, marks=None, failure=BranchStatus.STEP_TOO_SMALL.value)
    broken = ResponseFamily(family.screen, family.field, (*family.members[:-1], failed))
    table = broken.table()
    assert table["failure"][-1]
    assert table["second_peak_main"][-1] is None
    assert table["second_peak_main"][0] == family.table()["second_peak_main"][0]
    found = Trend(SECOND, DOWN).evaluate(broken, LABELS)
    assert found.verdict is Verdict.IN_PART
    assert "Cannot be decided: 6 mm to 8 mm" in found.where


def test_peaks_and_troughs_are_stationary_and_on_the_branch(exact):
    first, last = exact.peaks("main")
    (foot,) = exact.troughs("main")
    assert first.omega < foot.omega < last.omega
    assert exact.peak("main").amplitude("main") == last.amplitude("main")
    for point, sign in ((first, 1.0), (foot, -1.0), (last, 1.0)):
        for step in (-0.05, 0.05):
            near = exact.orbit_from_below(point.omega + step)
            assert sign * near.amplitude("main") < sign * point.amplitude("main")
        (slope,) = point.orbit.sensitivity(("amplitude", "main"), ["omega"])
        assert abs(slope) * point.omega < 1e-5 * point.amplitude("main")


@pytest.mark.parametrize(
    ("function", "low", "high", "least"),
    [
        (lambda t: (t - 2.3) ** 2, 1.0, 3.0, 2.3),
        (lambda t: abs(t - 1.7), 1.0, 3.0, 1.7),
        (lambda t: (t - 1.7) ** 2, 1.0, 2.0, 1.7),
        (lambda t: -t, 1.0, 2.0, 2.0),
        (lambda t: (t - 2.9) ** 2, 1.0, 3.0, 2.9),
    ],
    ids=["smooth", "kink", "one step", "end", "beyond the point beside"],
)
def test_where_a_function_is_least(function, low, high, least):
    assert _least(function, low, high) == pytest.approx(least, abs=2e-7)


def test_a_branch_that_rises_to_its_end_peaks_there(screen):
    rising = ff.frequency_response(screen, (5.0, 30.0))
    top = rising.peak("relative")
    assert top.omega == pytest.approx(30.0, rel=1e-6)
    assert top.amplitude("relative") == pytest.approx(rising.amplitude("relative")[-1], rel=1e-6)


def test_first_peak_is_that_of_the_linear_machine(exact, screen):
    omega, amplitude = ff.linear_response(screen, 1.0).peaks("main")[0]
    peak = exact.peaks("main")[0]
    assert peak.omega == pytest.approx(omega, rel=1e-6)
    assert peak.amplitude("main") == pytest.approx(amplitude, rel=1e-9)


def test_figures_show_their_results_numbers(family, screen):
    drawn = ff.figure(family)
    for member, name in zip(family.members, ("4 mm", "6 mm", "8 mm"), strict=True):
        lines = [t for t in drawn.panels[2].traces if t.role == "stable" and name in t.name]
        peak = 1e3 * member.relative_peak.amplitude("relative")
        assert max(t.y.max() for t in lines) == pytest.approx(peak, rel=1e-3)
    loading = ff.loading(screen, ff.Load(stiffness_factor=1.3, name="full"))
    picture = ff.figure(loading)
    change = next(t for t in picture.panels[1].traces if t.name == "loaded minus empty")
    np.testing.assert_array_equal(change.y, 1e3 * loading.with_stop.region.change)
    assert described(picture)["data"]


def test_page_holds_every_figure_claim_and_number(screen):
    found = reproduce(screen, ("4", "12"))
    page = list(blocks(found))
    assert sum(isinstance(block, FigureBlock) for block in page) == 2
    claims = next(b for b in page if isinstance(b, Table))
    assert [row[0].text for row in claims.rows] == [one.claim.id for one in found.claims]
    document = found.document()
    assert document["schema"] == "flipflow/claims/1"
    assert {"id", "verdict", "statement", "numbers", "where"} <= set(document["claims"][0])
    assert sum(document["counts"].values()) == len(document["claims"])
