"""The section "Start, stop and disturbances" of ``flipflow analyze``."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import flipflow as ff
from flipflow.io.results import document_of
from flipflow.report.blocks import FigureBlock, Heading, Text
from flipflow.report.registry import blocks_of
from flipflow.studies.assessment import assess

pytestmark = pytest.mark.numerical


@pytest.fixture(scope="module")
def project():
    return ff.load_project("ffs0827")


@pytest.fixture(scope="module")
def assessment(analysed):
    return analysed("ffs0827")


@pytest.fixture(scope="module")
def rig(analysed):
    """The rig is bistable at its working speed."""
    return analysed("rig-lin2024")


def words(assessment):
    found = blocks_of(assessment, brief=True)
    return {block.lead: block.text for block in found if isinstance(block, Text)}


def test_numbers_are_those_of_the_analyses(project, assessment):
    document = document_of(assessment)["transients"]
    found = assessment.transients
    screens = {case.name: case.screen for case in assessment.cases}
    start = ff.start_up(
        screens[found.case], found.start.drive, speed=project.speed, angle=found.start.angle
    )
    coast = found.coast_down
    again = ff.coast_down(coast.machine, coast.speed, start.drive)
    assert again.duration == coast.duration
    assert document["drive_assumed"] is (project.drive is None)
    for name, run in (("start", start), ("coast_down", coast)):
        assert document[name]["outcome"] == run.outcome
        assert document[name]["final_speed"] == run.final_speed
        assert document[name]["passing"] == run.passing
        for key, peak in run.peaks.items():
            assert document[name]["peaks"][key] == dataclasses.asdict(peak)
    assert document["reasons"] == {}


def test_report_has_the_section_with_both_runs_side_by_side(assessment):
    found = blocks_of(assessment)
    titles = [block.text for block in found if isinstance(block, Heading)]
    assert titles.count("Start, stop and disturbances") == 1
    figures = [block.figure for block in found if isinstance(block, FigureBlock)]
    (both,) = (figure for figure in figures if figure.title == "Start and coast-down")
    assert both.columns == 2
    assert [panel.title for panel in both.panels] == ["Start", "Coast-down", "", "", "", ""]
    last = [panel.y.label for panel in both.panels[4:]]
    assert last == ["torque at the shaft", "foundation force"]


def test_words_of_the_worst_case(assessment):
    said = words(assessment)
    start = said["Start (full, stiffening):"]
    assert start.startswith("reaches 850 rpm in ")
    assert "passes the first natural frequency w01 = 215.2 rpm in " in start
    assert start.endswith("(drive assumed).")
    assert "comes down from " in said["Coast-down:"]
    blows = said["Blows and lumps (every load case):"]
    assert blows == "cannot jump: no other motion was found."


def test_a_drive_of_the_machine_file_is_taken(project):
    drive = dataclasses.replace(assess_drive(project), friction=0.0)
    given = assess(dataclasses.replace(project, drive=drive))
    assert given.transients.start.drive is drive
    (start,) = (text for lead, text in words(given).items() if lead.startswith("Start ("))
    assert start.endswith("(drive assumed in part).")


def test_a_machine_that_is_captured_has_no_coast_down(project):
    """A third of the assumed motor, by Kloss' formula, hangs at the first natural frequency."""
    project = dataclasses.replace(project, screen=project.screen.replace(deck_angle=None))
    drive = assess_drive(project)
    motor = dataclasses.replace(
        drive.motor, rated_power=1500.0, starting_ratio=None, pull_up_ratio=None
    )
    weak = assess(dataclasses.replace(project, drive=dataclasses.replace(drive, motor=motor)))
    said = words(weak)
    (start,) = (text for lead, text in said.items() if lead.startswith("Start ("))
    assert start.startswith("captured at ")
    assert "does not pass the first natural frequency" in start
    reason = "the start does not reach the working speed"
    assert said["Coast-down:"] == f"not checked: {reason}."
    document = document_of(weak)["transients"]
    assert document["coast_down"] is None
    assert document["reasons"] == {"coast_down": reason}


def test_least_blow_and_lump_of_a_bistable_machine(rig):
    risk = ff.jump_risk(rig.project.screen, rig.project.speed)
    found = document_of(rig)["transients"]["jump_risk"]
    assert found["other_motions"] == len(risk.others) > 0
    assert found["impulse"]["impulse"] == risk.worst_impulse.impulse
    assert found["lump"] is None or found["lump"]["lump"] == risk.worst_lump.lump
    blows = [text for lead, text in words(rig).items() if lead.startswith("Blows")]
    assert "kg m/s on the " in " ".join(blows)


def test_without_a_working_speed_nothing_is_checked(project):
    idle = dataclasses.replace(project, speed=None, load_cases=project.load_cases[:1])
    given = assess(idle, omega=(85.0, 90.0))
    assert given.transients is None
    assert document_of(given)["transients"] is None
    said = words(given)["Start, stop and disturbances:"]
    assert said == "not checked, for the machine file gives no working speed."


def assess_drive(project):
    """The drive that is assumed for the machine."""
    return ff.start_up(project.screen, speed=project.speed).drive


def test_the_report_shows_what_moves_the_amplitude(assessment):
    """The tornado chart: at 850 rpm the gap of FFS0827 moves its amplitude most."""
    found = assessment.tornado
    widest = int(np.argmax(np.abs(found.at_high - found.nominal)))
    assert found.names[widest] == "clearance"
    assert found.at_low[widest] < found.nominal < found.at_high[widest]
    titles = [b.figure.title for b in blocks_of(assessment) if isinstance(b, FigureBlock)]
    assert "Sensitivity of relative amplitude at 850 rpm" in titles
