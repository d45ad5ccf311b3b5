"""Neutral figures show the result's own numbers, in rpm and mm; both renderers take them."""

from __future__ import annotations

import dataclasses
import itertools
import json
import math
import re
import subprocess
import sys
import xml.etree.ElementTree as ET

import numpy as np
import pytest

import flipflow as ff
from flipflow.errors import InputError, MissingExtra, StoreError
from flipflow.plotting import font
from flipflow.plotting.bars import energy_figure, region_figure
from flipflow.plotting.curves import Curve
from flipflow.plotting.figure import Figure
from flipflow.plotting.history import history_figure
from flipflow.plotting.layout import arrange, place_labels
from flipflow.plotting.motion import contact_bands, motions_figure, orbits_figures, portrait_figure
from flipflow.plotting.panels import PAGE_WIDTH, Axis, Line, Panel
from flipflow.plotting.plotly import described
from flipflow.plotting.print import svg_alone
from flipflow.plotting.response import cases_figure
from flipflow.plotting.scales import MM, RPM
from flipflow.plotting.schematic import schematic
from flipflow.plotting.transient import run_ups_figure
from flipflow.studies.assessment import assess
from svg_words import Box, boxes_of


@pytest.fixture(scope="module")
def assessment(analysed):
    return analysed("ffs0827")


@pytest.fixture(scope="module")
def branch(assessment):
    return assessment.cases[0].branch


@pytest.fixture(scope="module")
def orbit(assessment):
    return assessment.cases[0].orbit


def figures(assessment):
    case = assessment.cases[0]
    omega = np.linspace(5.0, 250.0, 50)
    results = (
        case.branch,
        case.orbit,
        ff.linear_response(assessment.project.screen, omega),
        assessment.region,
        assessment,
    )
    made = [*orbits_figures(assessment), portrait_figure(assessment), energy_figure(assessment)]
    return [*map(ff.figure, results), *made, motions_figure(assessment)]


def test_every_result_has_a_figure_with_units(assessment):
    for figure in figures(assessment):
        assert figure.title
        assert figure.caption.endswith(".")
        for panel in figure.panels:
            assert panel.x.unit in {"rpm", "mm", "deg", "kW"}
            assert panel.y.unit or panel.y.ticks


def test_unknown_result_is_refused_with_what_would_do():
    with pytest.raises(InputError, match=r"result = 'int'.*Assessment, Basins, .*, Branch, "):
        ff.figure(3)


def test_branch_is_drawn_in_rpm_and_mm_with_unstable_parts_apart(branch):
    panel = ff.figure(branch).panels[0]
    lines = [t for t in panel.traces if t.name == "relative (x2)"]
    assert {t.role for t in lines} == {"stable", "unstable"}
    drawn = np.concatenate([t.x for t in lines])
    assert drawn.min() == pytest.approx(branch.omega.min() * RPM)
    assert drawn.max() == pytest.approx(branch.omega.max() * RPM)
    top = max(float(t.y.max()) for t in lines)
    assert top == pytest.approx(branch.amplitude("relative").max() * MM)
    assert sum(t.legend for t in lines) == 1
    for trace in lines:
        hertz, radians = (values for _, values in trace.x_also)
        assert np.allclose(hertz * 60.0, trace.x)
        assert np.allclose(radians * RPM, trace.x)


def test_runs_meet_and_the_stable_one_ends_at_the_fold(branch):
    curve = Curve.of(branch, "relative")
    runs = list(curve.runs())
    assert runs[0][1].start == 0
    assert runs[-1][1].stop == curve.omega.size
    for (_, one), (_, two) in itertools.pairwise(runs):
        assert one.stop - 1 == two.start
    _, first = runs[0]
    assert curve.omega[first][-1] == branch.folds[0].omega


def test_jumps_start_at_the_folds_and_end_on_the_branch(branch):
    rising, falling = Curve.of(branch, "relative").jumps()
    upper, lower = branch.folds
    assert (rising.omega, rising.start) == (upper.omega, upper.amplitude("relative"))
    assert (falling.omega, falling.start) == (lower.omega, lower.amplitude("relative"))
    assert rising.end < rising.start
    assert falling.end > falling.start
    for jump in (rising, falling):
        motions = [o.amplitude("relative") for o in branch.orbits_at(jump.omega)]
        # The line between two points of the branch is what the eye sees there.
        assert min(abs(jump.end - a) for a in motions) < 2e-2 * max(motions)


def test_from_below_never_turns_back(branch):
    omega, amplitude = Curve.of(branch, "relative").from_below()
    assert np.all(np.diff(omega) > 0.0)
    assert amplitude.max() == pytest.approx(branch.amplitude("relative").max())


def test_phase_has_no_false_jumps(branch):
    assert np.abs(np.diff(Curve.of(branch, "floating").phase)).max() < 1.0


def test_shaded_contact_is_the_contact_share(orbit):
    shaded = sum(band.high - band.low for band in contact_bands(orbit))
    assert shaded == pytest.approx(720.0 * orbit.contact_share(), rel=1e-9)


@pytest.mark.parametrize("parts", [1, 2])
def test_both_sides_are_shaded_and_drawn_where_gaps_differ(screen, parts):
    """The stop as one spring with two gaps, and as two springs with one gap each."""
    stop = screen.replace(clearance_minus=7e-3).stop()
    springs = (stop,)
    if parts == 2:
        springs = (
            dataclasses.replace(stop, clearance_minus=math.inf),
            dataclasses.replace(
                stop, direction=-stop.direction, clearance=7e-3, clearance_minus=math.inf
            ),
        )
    system = dataclasses.replace(screen.system(), springs=springs)
    orbit = ff.frequency_response(system, (60.0, 110.0)).orbits_at(100.0)[0]
    bands = list(contact_bands(orbit))
    touched = {
        role: sum(band.high - band.low for band in bands if band.role == role)
        for role in ("contact", "contact minus")
    }
    moving = orbit.displacement("relative", np.linspace(0.0, orbit.period, 200001)[1:])
    assert touched["contact"] == pytest.approx(720.0 * (moving > 6e-3).mean(), abs=0.05)
    assert touched["contact minus"] == pytest.approx(720.0 * (moving < -7e-3).mean(), abs=0.05)
    lines = ff.figure(orbit).panels[0].lines
    assert sorted(line.at for line in lines) == pytest.approx([-7.0, 6.0])


def test_orbits_have_one_scale(assessment):
    figure = motions_figure(assessment)
    orbits = figure.panels[0]
    assert orbits.equal
    rect = arrange(figure).rects[0]
    scale = [
        size / (axis.bounds[1] - axis.bounds[0])
        for size, axis in ((rect.width, orbits.x), (rect.height, orbits.y))
    ]
    # The box fits the motion, so that little of the page is lost to the equal scales.
    assert scale[0] == pytest.approx(scale[1], rel=0.35)


def test_without_the_normal_direction_there_are_no_orbits():
    project = ff.load_project("ffs0827")
    screen = project.screen.replace(normal_stiffness=None)
    bare = assess(dataclasses.replace(project, screen=screen, load_cases=project.load_cases[:1]))
    assert orbits_figures(bare) == ()
    assert len(motions_figure(bare).panels) == 1


def test_without_a_speed_only_the_whole_range_is_drawn():
    project = ff.load_project("ffs0827")
    idle = assess(dataclasses.replace(project, speed=None, load_cases=project.load_cases[:1]))
    assert motions_figure(idle) is None
    assert energy_figure(idle) is None
    assert len(cases_figure(idle).panels) == 1


def test_band_holds_every_case_at_the_working_speed(assessment):
    panel = cases_figure(assessment).panels[0]
    band = next(t for t in panel.traces if t.lower is not None)
    at = assessment.omega * RPM
    low, high = np.interp(at, band.x, band.lower), np.interp(at, band.x, band.y)
    amplitudes = [case.values["relative_amplitude"] * MM for case in assessment.cases]
    assert low == pytest.approx(min(amplitudes), rel=2e-3)
    assert high == pytest.approx(max(amplitudes), rel=2e-3)


@pytest.fixture(scope="module")
def linear(analysed):
    return analysed("ffs0827-linear")


@pytest.fixture(scope="module")
def rig(analysed):
    return analysed("rig-lin2024")


def test_energy_bars_add_up_to_what_is_fed_in(assessment):
    figure = energy_figure(assessment)
    for y, case in zip((3.0, 2.0, 1.0, 0.0), assessment.cases, strict=True):
        end = max(bar.high for bar in figure.panels[0].bars if bar.y == y)
        fed = case.energy["input"] + case.energy["normal"]
        assert end == pytest.approx(fed * 1e-3, rel=1e-9)


def test_energy_names_no_damper_that_takes_nothing_and_small_power_in_watts(rig):
    figure = energy_figure(rig)
    assert {bar.name for bar in figure.panels[0].bars} == {
        "isolation (c1)", "shear springs (c2)", "stops (c3)",
    }  # fmt: skip
    assert figure.panels[0].x.unit == "W"
    assert figure.panels[0].bars[-1].text == "8.24 W"


def test_a_machine_without_stop_is_not_said_to_leave_it(linear):
    assert motions_figure(linear).caption.endswith("The machine has no stop.")
    assert ff.figure(linear.cases[0].orbit).caption.startswith("The machine has no stop.")
    assert "stop bends" not in portrait_figure(linear).caption


def test_portraits_keep_clear_of_their_frame(assessment, linear, rig):
    for one in (assessment, linear, rig):
        panel = portrait_figure(one).panels[0]
        for axis, values in ((panel.x, "x"), (panel.y, "y")):
            reach = max(np.abs(getattr(trace, values)).max() for trace in panel.traces)
            assert axis.bounds[1] == -axis.bounds[0] >= 1.05 * reach
        assert all(abs(line.at) < panel.x.bounds[1] for line in panel.lines)


def test_orbits_leave_no_empty_rows(assessment, linear):
    for one in (assessment, linear):
        (figure,) = orbits_figures(one)
        panel, rect = figure.panels[0], arrange(figure).rects[0]
        wide, high = (axis.bounds[1] for axis in (panel.x, panel.y))
        assert rect.height == pytest.approx(rect.width * high / wide, abs=8.0)


def test_the_row_of_allowed_speeds_says_its_speeds_or_none(assessment, linear):
    (note,) = region_figure(assessment.region).panels[0].notes
    assert note.text == "845 to 860.7 rpm"
    (note,) = region_figure(linear.region).panels[0].notes
    assert note.text == "none"


def test_labels_of_two_limits_keep_apart(linear):
    lines = {line.text: line for line in cases_figure(linear).panels[0].lines}
    assert lines["least 5 mm"].under
    assert not lines["most 8 mm"].under


def test_rows_of_the_legend_are_as_high_as_they_are_laid_out(assessment):
    legend = described(cases_figure(assessment))["layout"]["legend"]
    assert legend["tracegroupgap"] == 0


def test_thousands_are_not_set_apart_in_a_page(assessment):
    """plotly.js set them apart in numbers with decimals alone: "3,040.5" beside "3041"."""
    assert described(cases_figure(assessment))["layout"]["separators"] == "."


def test_start_and_coast_down_stand_side_by_side(rig):
    runs = rig.transients.start, rig.transients.coast_down
    figure = run_ups_figure(runs)
    assert [panel.title for panel in figure.panels[:3]] == ["Start", "Coast-down", ""]
    assert [line.text for line in figure.panels[0].lines] == ["w01", "working speed"]
    assert [line.text for line in figure.panels[1].lines] == ["w01", "running speed"]
    alone = [ff.figure(run) for run in runs]
    assert [one.title for one in alone] == ["Start", "Coast-down"]
    assert [one.panels[1].y for one in alone] == [panel.y for panel in figure.panels[2:4]]


def test_force_on_the_foundation_is_the_greatest_of_each_turn(rig):
    """A thin line through the peaks, the greatest of all included, no saw between them."""
    run = rig.transients.coast_down
    (force,) = ff.figure(run).panels[2].traces
    assert force.y.max() == pytest.approx(run.peaks["foundation_force"].value / 1e3, rel=1e-4)
    turns = (run.history.angle[-1] - run.history.angle[0]) / (2.0 * np.pi)
    assert force.x.size <= min(turns + 2.0, 1500.0)
    rises = np.sign(np.diff(force.y))
    assert (rises[1:] * rises[:-1] < 0.0).mean() < 0.1


def test_region_shows_every_interval_of_every_case(assessment):
    bars = region_figure(assessment.region).panels[0].bars
    wanted = sum(len(i) for case in assessment.region.cases for i in case.intervals.values())
    names = {case.name for case in assessment.cases}
    assert sum(bar.name in names for bar in bars) == wanted
    (allowed,) = (bar for bar in bars if bar.name == "allowed speed range")
    assert (allowed.low, allowed.high) == pytest.approx(
        tuple(end * RPM for end in assessment.region.feasible[0])
    )


@pytest.mark.parametrize("places", [(500.0, 505.0), (500.0, 540.0, 560.0, 580.0), (0.0, 1000.0)])
def test_labels_of_lines_do_not_cover_each_other(places):
    lines = tuple(Line("x", at, "1234 rpm") for at in places)
    panel = Panel(Axis("speed", "rpm", (0.0, 1000.0)), Axis("y", "mm"), lines=lines)
    width = 0.5 * PAGE_WIDTH
    taken = {}
    for k, label in place_labels(panel, width).items():
        middle = places[k] / 1000.0 * width + label.shift
        for other in taken.get(label.level, []):
            assert abs(other - middle) > 40.0
        taken.setdefault(label.level, []).append(middle)


@pytest.mark.parametrize("middle", [2.0, 500.0, 998.0])
def test_many_labels_at_one_place_are_printed_apart(middle):
    """Six labels in the widest font: none touches another, the panel or the title."""
    places = [middle + 0.2 * k for k in range(6)]
    lines = tuple(Line("x", at, f"jump (rising) {at:.4g} rpm") for at in places)
    axes = (Axis("speed", "rpm", (0.0, 1000.0)), Axis("y", "mm", (0.0, 1.0)))
    figure = Figure("a", "b.", (Panel(*axes, lines=lines, title="Title"),) * 2, 2, 300)
    svg = svg_alone(figure)
    labels = [one for one in boxes_of(svg) if one.text.startswith(("jump", "Title"))]
    assert len(labels) == 14
    for one, two in itertools.combinations(labels, 2):
        assert one.overlap(two) <= 0.0
    for way in re.findall(r'<clipPath[^>]*><path d="M(.*?)z"', svg):
        left, top, wide, high = (float(one) for one in re.findall(r"(?<![\d.])-?[\d.]+", way)[:4])
        panel = Box("", left, top, left + wide, top + high)
        assert high > 100.0
        assert not any(panel.overlap(one) > 0.0 for one in labels)


def test_plotly_takes_plain_json(assessment):
    for figure in figures(assessment):
        text = json.dumps(described(figure), allow_nan=False)
        assert json.loads(text)["layout"]["width"] == PAGE_WIDTH


@pytest.mark.parametrize(
    ("ending", "start"),
    [(".html", b"<!DOCTYPE html>"), (".svg", b"<svg"), (".pdf", b"%PDF"), (".png", b"\x89PNG")],
)
def test_every_format_is_written(assessment, tmp_path, ending, start):
    for k, figure in enumerate(figures(assessment)[-2:]):
        path = figure.write(tmp_path / f"{k}{ending}")
        assert path.read_bytes().startswith(start)


def test_a_printed_figure_says_below_it_what_it_belongs_to(orbit, tmp_path):
    bare = ff.figure(orbit)
    words = "FFS0827, case $full$ <b>, revision A, 2026-03-01"
    heights = []
    for subject in ("", words, " ".join([words] * 4)):
        figure = dataclasses.replace(bare, subject=subject)
        sheet = figure.write(tmp_path / "one.svg").read_text(encoding="utf-8")
        told = " ".join(one.text for one in boxes_of(sheet))
        assert (words in told) == bool(subject)
        heights.append(float(ET.fromstring(sheet).attrib["viewBox"].split()[3]))  # noqa: S314
    assert heights[0] == bare.height
    assert heights[0] < heights[1] < heights[2]
    dataclasses.replace(bare, subject=words).write(tmp_path / "one.pdf")
    dataclasses.replace(bare, subject=words).write(tmp_path / "one.png")


def test_the_same_figure_makes_the_same_file(orbit, tmp_path):
    for ending in ("svg", "pdf", "png"):
        one, two = (ff.figure(orbit).write(tmp_path / f"{k}.{ending}") for k in "ab")
        assert one.read_bytes() == two.read_bytes()


def test_bad_paths_are_refused(orbit, tmp_path):
    with pytest.raises(InputError, match=r"ends in \.html, \.svg, \.pdf, \.png"):
        ff.figure(orbit).write(tmp_path / "x.docx")
    with pytest.raises(StoreError, match="cannot be written"):
        ff.figure(orbit).write(tmp_path / "no" / "x.html")


@pytest.mark.parametrize(
    ("module", "ending", "says"),
    [
        ("matplotlib", "svg", "Figures for print need matplotlib"),
        ("matplotlib", "pdf", "Figures for print need matplotlib"),
        ("typst", "pdf", "A PDF needs typst"),
        ("typst", "png", "A PNG needs typst"),
    ],
)
def test_what_is_missing_is_named_with_its_extra(
    orbit, tmp_path, monkeypatch, module, ending, says
):
    monkeypatch.setitem(sys.modules, module, None)
    for measured in (font._font, font._advance):
        measured.cache_clear()
    with pytest.raises(MissingExtra, match=rf"{says}: pip install 'flipflow\[report\]'"):
        ff.figure(orbit).write(tmp_path / f"x.{ending}")


def test_a_figure_as_svg_and_in_a_notebook_needs_no_typst(orbit, monkeypatch):
    monkeypatch.setitem(sys.modules, "typst", None)
    assert "<svg" in orbit._repr_html_()


def test_general_systems_are_drawn_by_degree_of_freedom():
    system = ff.MechanicalSystem(
        M=np.eye(2), C=0.1 * np.eye(2), K=[[2.0, -1.0], [-1.0, 2.0]],
        excitation=ff.HarmonicForce([1.0, 0.0]),
    )  # fmt: skip
    figure = ff.figure(ff.frequency_response(system, (0.2, 3.0)))
    assert {t.name for t in figure.panels[0].traces} == {"x[0]", "x[1]"}


@pytest.mark.parametrize(
    ("changes", "stops"),
    [({}, 2), ({"clearance_minus": math.inf}, 1), ({"clearance": math.inf}, 0)],
)
def test_schematic_is_a_drawing_with_the_stops_there_are(screen, changes, stops):
    drawing = schematic(screen.replace(**changes), {"main_mass": "m1 = 1 < 2 kg"})
    root = ET.fromstring(drawing)  # noqa: S314  our own text
    words = [element.text for element in root.iter("{http://www.w3.org/2000/svg}text")]
    assert "m1 = 1 < 2 kg" in words
    assert sum(word in {"e", "e+", "e-"} for word in words) == stops


def test_figures_load_no_renderer():
    code = (
        "import sys, flipflow.plotting.dispatch; "
        "print([m for m in ('plotly', 'matplotlib') if m in sys.modules])"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_a_figure_is_frozen():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Figure("a", "b", ()).title = "c"


def test_the_schematic_turns_as_the_unbalance(screen):
    """x1 counts to the right, up the slope: counter-flow goes over the top to the right."""
    ways = {}
    for rotation in ("with-flow", "counter-flow"):
        drawn = schematic(screen.replace(rotation=rotation), {})
        (begin, sweep, along) = re.search(r"M(\d+) 128a17 17 0 0 (\d) (-?\d+) 8", drawn).groups()
        ways[rotation] = (int(begin) < 266, int(sweep), int(along))
    assert ways == {"with-flow": (True, 0, 24), "counter-flow": (False, 1, -24)}


def test_the_last_turns_of_a_long_run_are_not_drawn_in_stairs():
    """Five digits of the time itself are coarser, after some seconds, than the samples."""
    history = ff.simulate(ff.load("ffs0827"), 89.0, 200)
    figure = history_figure(history)
    data = described(figure)["data"]
    last = [trace["x"] for trace in data if min(trace["x"]) > 13.0]
    assert last
    for times in last:
        assert np.all(np.diff(times) > 0.0)


def test_a_portrait_of_another_coordinate_is_none_of_the_relative_motion(orbit):
    for drawn in (orbit, [orbit, orbit]):
        assert "of the relative motion" in ff.figure(drawn).caption
        assert "relative" not in ff.figure(drawn, coordinate="main").caption
    rig = ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], [], ff.HarmonicForce([0.7]))
    assert "relative" not in ff.figure(ff.periodic_orbits(rig, 0.5)[0]).caption
