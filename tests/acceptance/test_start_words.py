"""What is said of a start: of every load case, of the drive, whichever way the unbalance turns."""

from __future__ import annotations

import dataclasses
import math

import flipflow as ff
from flipflow.model.constants import RPM
from flipflow.report import transients
from flipflow.report.numbers import quantity
from flipflow.studies.assessment import loads_of
from flipflow.studies.drive_check import Demand, drive_findings, settled_speed
from flipflow.studies.start_and_blows import CaseRuns, Transients
from flipflow.studies.start_sentence import does_it_start

WORKING = 850.0 / RPM


def given(power=5500.0, **changes):
    """A drive without an assumption: cage motor of 1500 rpm."""
    motor = ff.Motor(synchronous_speed=1500.0 / RPM, rated_power=power)
    return ff.Drive(**{"motor": motor, "inertia": 0.9, "ratio": 1.75, "friction": 3.0} | changes)


def test_counter_flow_is_weighed_as_with_flow(screen):
    """The torque at rest against the unbalance, and no note that its weight is left out."""
    weak = given(1500.0)
    told = []
    for rotation in ("with-flow", "counter-flow"):
        machine = screen.replace(rotation=rotation)
        demand = Demand(machine, WORKING, ((0.0, math.inf),), {}, lambda _speed: 0.0)
        (rest,) = (one for one in drive_findings(weak, demand) if one.subject == "torque at rest")
        told.append(rest.sentence)
        run = ff.start_up(machine, weak, speed=WORKING)
        assert run.outcome == "not started"
        assert not any("Weight not considered" in note for note in run.notes)
    assert told[0] == told[1]
    assert "lifting the unbalance takes 40.9 N m" in told[0]


def test_a_working_speed_that_is_not_allowed_is_no_fault_of_the_drive(screen):
    """The ratio that keeps it cannot help; a speed that is allowed and not kept is told."""
    drive = given(ratio=1.7)
    settled = settled_speed(drive, Demand(screen, WORKING, (), {}, lambda _speed: 1000.0))
    assert settled is not None
    for share, told in ((1.0001, []), (0.9999, ["speed"])):
        allowed = ((share * settled, math.inf),) if share > 1.0 else ((0.0, share * settled),)
        demand = Demand(screen, 0.9998 * settled, allowed, {}, lambda _speed: 1000.0)
        assert [one.subject for one in drive_findings(drive, demand)] == told


def test_one_sentence_for_starts_that_differ(screen):
    run = ff.start_up(screen, given(), speed=WORKING)
    slow = dataclasses.replace(run.summary, time_to_speed=2.5, final_speed=0.99 * WORKING)
    near = dataclasses.replace(run.summary, time_to_speed=None, final_speed=0.98 * WORKING)

    def said_of(**starts):
        cases = tuple(CaseRuns(name, one, None, {}, None, {}) for name, one in starts.items())
        return does_it_start(Transients(False, run, None, None, {}, cases)).partition(": ")[2]

    ends = f"{0.98 * 850.0:.0f} to {run.final_speed * RPM:.0f} rpm in every load case."
    head = "it reaches 850 rpm in at most 2.5 s"
    assert said_of(a=run.summary, b=slow, c=near) == f"{head}, but not quite in case c, then {ends}"
    assert said_of(b=slow) == f"{head}, then {0.99 * 850.0:.0f} rpm."
    part = said_of(a=None, b=slow)
    assert part == f"{head}, then {0.99 * 850.0:.0f} rpm in case b."
    both = said_of(c=near, d=near)
    assert both == f"it comes near 850 rpm, then {0.98 * 850.0:.0f} rpm in every load case."


def test_a_start_that_fails_is_not_drawn_as_a_coast_down(screen):
    """The unbalance swings out, at its end a little backwards, and settles at no speed."""
    run = ff.start_up(screen, given(1500.0), speed=WORKING)
    omega = run.history.omega.copy()
    omega[-1] = -1e-9
    swung = dataclasses.replace(
        run, history=dataclasses.replace(run.history, omega=omega), final_speed=-1e-9
    )
    assert ff.figure(swung).title == "Start"
    case = CaseRuns("empty", swung.summary, None, {}, None, {})
    (row,) = transients.cases_table(Transients(False, swung, None, None, {}, (case,))).rows
    assert [cell.text for cell in row[:4]] == ["empty", "not started", "-", "-"]


def test_a_start_that_fails_hides_no_greater_force():
    """Hanging it does not turn over; from another angle it does, and shakes sixty times as hard."""
    project = dataclasses.replace(ff.load_project("ffs0827"), drive=given(1500.0))
    found = ff.assess(project)
    runs = found.transients
    assert runs.start.outcome == "not started"
    greatest = max(case.peaks_of("start")["foundation_force"].value for case in runs.cases)
    assert greatest > 10.0 * runs.start.peaks["foundation_force"].value
    assert runs.loudest.peaks["foundation_force"].value == greatest
    loads = {one.name: one.peaks for one in found.foundation.runs}
    assert runs.loudest_case != runs.case
    assert loads[f"start ({runs.loudest_case})"].total >= 0.9 * greatest
    one_case = dataclasses.replace(runs, loudest_case=runs.case)
    names = [one.name for one in loads_of(found.cases, one_case).runs]
    assert names == [f"start ({runs.case})", f"start ({runs.case}), from another angle"]
    words = transients.start_words(runs)
    assert "greatest of all starts: main frame" in words
    assert f"foundation {quantity(greatest, 'kN', 'N')}" in words


def test_peaks_of_the_start_that_is_told_are_not_said_to_be_of_others(screen):
    run = ff.start_up(screen, given(), speed=WORKING)
    other = {
        name: dataclasses.replace(one, value=2.0 * one.value) for name, one in run.peaks.items()
    }
    for peaks, told in ((run.peaks, "greatest"), (other, "greatest of all starts")):
        case = CaseRuns("empty", run.summary, None, peaks, None, {})
        words = transients.start_words(Transients(False, run, None, None, {}, (case,)))
        assert f"; {told}: main frame {quantity(peaks['main_amplitude'].value, 'mm', 'm')}" in words
