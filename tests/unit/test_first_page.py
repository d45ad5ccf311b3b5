"""The first page where a machine is unlike FFS0827: unequal gaps, many cases, missing data."""

from __future__ import annotations

import dataclasses
import io
import math

import numpy as np
import pytest
from rich.console import Console

import flipflow as ff
from flipflow.periodic.orbit import Orbit
from flipflow.report import details, first_page, summary
from flipflow.report.blocks import DrawingBlock, Note, Table
from flipflow.report.registry import blocks_of
from flipflow.studies.allowed_range import allowed_range
from flipflow.studies.assessment import assess, verdict

RPM = 30.0 / math.pi


@pytest.fixture(scope="module")
def project():
    return ff.load_project("ffs0827")


@pytest.fixture(scope="module")
def lopsided(project):
    """Unequal gaps, no normal direction, no rubber height, no limit below contact."""
    screen = project.screen.replace(
        clearance_minus=7e-3, normal_stiffness=None, normal_damping=None, shear_height=None
    )
    return assess(dataclasses.replace(project, screen=screen, load_cases=project.load_cases[:1]))


@pytest.fixture(scope="module")
def many(project):
    loads = tuple(ff.Load(name=f"case {k}", stiffness_factor=1.0 + 0.02 * k) for k in range(8))
    return assess(dataclasses.replace(project, load_cases=loads))


def printed(assessment):
    out = io.StringIO()
    console = Console(file=out, width=80, highlight=False, markup=False, emoji=False)
    summary(assessment, console)
    return out.getvalue()


def test_both_contact_speeds_are_said_where_gaps_differ(lopsided):
    region = lopsided.region
    assert region.contact_speeds[1] < region.contact_speeds[-1] == region.omega_cs
    sentence = first_page.contact_sentence(region)
    for side, word in ((1, "plus"), (-1, "minus")):
        assert f"{word} side at {region.contact_speeds[side] * RPM:.4g} rpm" in sentence


@pytest.mark.parametrize(
    ("gaps", "side", "other"),
    [
        ({"clearance_minus": math.inf}, "plus", "no stop on the other side"),
        ({"clearance": math.inf, "clearance_minus": 6e-3}, "minus", "no stop on the plus side"),
    ],
)
def test_a_side_without_stop_is_told_so(project, gaps, side, other):
    """It was "not touched before", and its gap "inf mm"."""
    screen = project.screen.replace(**gaps)
    region = ff.operating_region(screen)
    sentence = first_page.contact_sentence(region)
    assert sentence.startswith(f"{side} side at {region.omega_cs * RPM:.4g} rpm (empty); ")
    assert sentence.endswith("the other side has no stop.")
    drawn = details.drawn_values(screen)
    assert other in drawn.values()
    assert not any("inf" in text for text in drawn.values())
    found = assess(dataclasses.replace(project, screen=screen, load_cases=project.load_cases[:1]))
    schematic = next(one for one in details.machine(found) if isinstance(one, DrawingBlock))
    assert schematic.drawing.caption.endswith("(e+)." if side == "plus" else "below -e-.")


def test_the_caption_of_a_machine_without_stop_tells_of_none():
    found = assess(ff.load_project("ffs0827-linear"))
    schematic = next(one for one in details.machine(found) if isinstance(one, DrawingBlock))
    assert "stop" not in schematic.drawing.caption


def test_equal_gaps_have_one_contact_speed(many):
    assert many.region.contact_speeds == {1: many.region.omega_cs}
    assert first_page.contact_sentence(many.region) == ""


def test_the_end_of_the_region_is_named_in_plain_words(lopsided):
    assert lopsided.region.ends == ("contact begins (w_cs)", "jump when the speed falls (w_lb)")
    words = allowed_range(lopsided.region)
    assert "from contact begins (w_cs, empty machine) to the limit on " in words
    free = dataclasses.replace(lopsided.project, limits=ff.Limits())
    ends = allowed_range(assess(free).region)
    assert "from contact begins (w_cs, empty machine) to jump when the speed falls (w_lb, " in ends
    for text in (ends, printed(lopsided)):
        assert "bound of the" not in text


def test_a_speed_outside_the_region_is_told_which_end_it_lies_beyond(project):
    slow = dataclasses.replace(
        project, speed=700.0 / RPM, limits=ff.Limits(stop_force=15e3),
        load_cases=project.load_cases[:1],
    )  # fmt: skip
    verdict = assess(slow).verdict
    assert verdict.endswith("but below the operating region: contact begins (w_cs) at 774.1 rpm.")


def test_a_limit_on_speed_that_binds_is_named(project):
    limits = ff.Limits(speed=(800.0 / RPM, 1000.0 / RPM))
    region = ff.operating_region(project.screen, limits)
    assert [bound.limit for bound in region.binding[0]] == ["speed", "speed"]


def test_nothing_is_cut_off_in_the_terminal(lopsided):
    text = printed(lopsided)
    assert max(map(len, text.splitlines())) <= 80
    assert "\u2026" not in text
    table = text.split("Margin State")[1]
    for piece in ("missing in the", "shear_springs.", "height", "isolation.", "normal_stiffness"):
        assert piece in table


def test_many_cases_stand_overleaf_and_in_the_terminal(many):
    assert first_page.crowded(many)
    assert not list(first_page.cases(many))
    (table,) = first_page.overleaf(many)
    assert isinstance(table, Table)
    assert len(table.rows) == 8
    assert "overleaf" not in printed(many)
    assert "next page" not in printed(many)
    assert "case 7" in printed(many)


def test_notes_without_room_stand_overleaf(many):
    notes = tuple(f"Note {k}:{20 * ' word'}." for k in range(7))
    noted = dataclasses.replace(many, notes=notes)
    shown = first_page.notes_that_fit(noted)
    assert 0 < shown < 7
    texts = [block.text for block in blocks_of(noted) if isinstance(block, Note)]
    assert [text for text in texts if text in notes] == list(notes)
    assert any(text.startswith(f"{7 - shown} more notes stand") for text in texts)
    assert all(note in " ".join(printed(noted).split()) for note in notes)


def test_a_side_that_the_weight_closes_is_touched_at_rest(project):
    screen = project.screen.replace(
        clearance=0.2e-3, clearance_minus=6e-3, clearance_measured="drawn", deck_angle=0.3
    )
    closed = dataclasses.replace(project, screen=screen, load_cases=project.load_cases[:1])
    found = assess(closed)
    assert screen.stop().gaps[0] < 0.0
    assert set(found.region.contact_speeds) == {-1}
    assert "plus side at rest, minus side at " in first_page.contact_sentence(found.region)


def test_a_motion_that_does_not_return_is_said_so_and_marked(many):
    """The multiplier -1.014 was told as "not sure to return", and its numbers bore no mark."""
    case = many.cases[0]
    map_ = np.diag([1.2, 0.5, 0.5, 0.5])
    point = dataclasses.replace(case.orbit.point, known_map=map_)
    lost = dataclasses.replace(
        case, working=dataclasses.replace(case.working, orbit=Orbit(case.screen, point))
    )
    assert lost.orbit.stability == "unstable"
    sentence = verdict(many.omega, many.limits_table, (lost, *many.cases[1:]), many.region)
    assert sentence.endswith("the motion does not return after a disturbance in case 0.")
    assert first_page._case_row(lost)[0].small == "the motion does not return"
