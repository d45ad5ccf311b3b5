"""``ff.compare`` and ``flipflow compare``: what differs, and how each result changes."""

from __future__ import annotations

import dataclasses
import json
import math
import shutil
from pathlib import Path

import pytest

import flipflow as ff
from flipflow.errors import InputError
from flipflow.io.source import bundled_text
from flipflow.plotting.compare import comparison_figure
from flipflow.report.blocks import Table
from flipflow.report.compare import main_changes
from flipflow.studies.compare import EMPTY

CASES = ("empty", "full, stiffening", "full, carried mass", "hot")
RPM = 30.0 / math.pi
SMALL = Path(__file__).parents[1] / "machines" / "small.toml"

pytestmark = pytest.mark.usefixtures("analysed_once")


@pytest.fixture(scope="module")
def machine(files):
    """As commands read it, so that it is analysed once."""
    return ff.load_project(files / "six.toml")


@pytest.fixture(scope="module")
def wider(files):
    """The same file but the gap."""
    return ff.load_project(files / "eight.toml")


@pytest.fixture(scope="module")
def found(machine, wider):
    return ff.compare([machine, wider])


@pytest.fixture(scope="module")
def swapped(machine, wider):
    return ff.compare([wider, machine])


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The bundled machine's file, and the same but the gap and the name."""
    folder = tmp_path_factory.mktemp("files")
    text = bundled_text("ffs0827")
    (folder / "six.toml").write_text(text, encoding="utf-8")
    other = text.replace('clearance = "6 mm"', 'clearance = "8 mm"')
    long = 'name = "Flip-Flow-Siebmaschine mit verlängerten Anschlagpuffern, Ausführung 2"'
    other = other.replace('name = "FFS0827"', long)
    (folder / "eight.toml").write_text(other, encoding="utf-8")
    return folder


def test_a_machine_that_does_not_jump_says_so_beside_one_that_does(machine):
    other = ff.Limits(jump_margin=0.1)
    calm = dataclasses.replace(
        machine, screen=machine.screen.replace(eccentric_moment=0.05), limits=other, name="calm",
        load_cases=machine.load_cases[:1],
    )  # fmt: skip
    near = dataclasses.replace(
        machine, limits=other, name="near", load_cases=machine.load_cases[:1]
    )
    tables = [block for block in main_changes(ff.compare([near, calm])) if isinstance(block, Table)]
    (row,) = (row for row in tables[0].rows if row[0].text == "Margin to the jump: margin")
    assert [cell.text for cell in row[3:]] == ["no jump", "-"]


def test_the_gap_is_the_one_input_that_differs(found):
    (gap,) = found.inputs
    assert (gap.key, gap.unit, gap.shown_unit) == ("stops.clearance", "m", "mm")
    assert gap.values == (6e-3, 8e-3)


def test_characteristic_speeds_are_those_of_the_regions(found, machine, wider):
    for k, project in enumerate((machine, wider)):
        region = ff.operating_region(project.screen)
        for name in ("omega_cs", "omega_lb", "omega_ub", "omega_ea", "omega_ar"):
            value = found.result(name).values[k]
            assert value == pytest.approx(getattr(region, name), rel=1e-9), name


def test_what_the_gap_does_not_touch_does_not_change(found):
    """w_ea and w_ar know no stop; the stiffened machine at 850 rpm does not reach it."""
    for name in ("omega_ea", "omega_ar"):
        assert not found.result(name).changes
        assert found.result(name).change() == 0.0
    assert not found.result("relative_amplitude", "full, stiffening").changes


@pytest.mark.parametrize("case", CASES)
def test_the_amplitude_is_that_of_each_motion(found, machine, wider, case):
    load = next(load for load in machine.load_cases if load.name == case)
    for k, project in enumerate((machine, wider)):
        (orbit,) = ff.periodic_orbits(project.screen.loaded(load), project.speed)
        value = found.result("relative_amplitude", case).values[k]
        assert value == pytest.approx(orbit.amplitude("relative"), rel=1e-8)


@pytest.mark.parametrize("case", CASES)
def test_every_limit_has_its_margin_in_every_case(found, machine, case):
    for name in machine.limits.given:
        margin = found.result(f"margin of {name}", case)
        assert all(value is not None for value in margin.values)
    force = found.result("stop_force", case).values
    expected = [(15e3 - value) / 15e3 for value in force]
    assert found.result("margin of stop_force", case).values == pytest.approx(expected, rel=1e-12)


def test_differences_flip_their_sign_when_swapped(found, swapped):
    changed = 0
    for row in found.results:
        back = swapped.result(row.name, row.case)
        assert back.values == row.values[::-1], row
        change = row.change()
        if change is None:
            assert back.change() is None
        else:
            assert back.change() == -change
            changed += row.changes
    assert changed > 50


def test_a_file_with_itself_differs_in_nothing(machine):
    same = ff.compare([machine, machine])
    assert same.inputs == ()
    assert not any(row.changes for row in same.results)
    assert set(same.names) == {"FFS0827 (A)", "FFS0827 (B)"}


def test_inputs_in_other_units_do_not_differ(tmp_path):
    """14.1666... Hz are 850 rpm but for the last digit."""
    text = SMALL.read_text(encoding="utf-8")
    for old, new in (("850 rpm", "14.166666666666666 Hz"), ("916 kg", "0.916 t")):
        assert old in text
        text = text.replace(f'"{old}"', f'"{new}"')
    (tmp_path / "units.toml").write_text(text, encoding="utf-8")
    assert ff.compare([SMALL, tmp_path / "units.toml"]).inputs == ()


def test_machines_paths_and_projects_can_be_compared(machine, files):
    linear = machine.screen.replace(clearance=math.inf)
    found = ff.compare([machine.screen, linear, files / "six.toml"], omega=80.0)
    keys = {one.key: one.values for one in found.inputs}
    assert keys["stops.clearance"] == (6e-3, math.inf, 6e-3)
    assert "operation.speed" not in keys
    assert keys["limits.stop_force"] == (None, None, 15e3)
    assert keys["load case hot"] == (None, None, "given")
    assert found.result("omega_cs").change(1) is None
    assert found.result("omega_cs").change(2) == 0.0


def test_load_cases_and_limits_that_differ_are_named(machine):
    loads = (
        *machine.load_cases[:3],
        dataclasses.replace(machine.load_cases[3], temperature=40.0),
    )
    limits = dataclasses.replace(machine.limits, relative_amplitude=(4e-3, 8e-3))
    other = dataclasses.replace(machine, load_cases=loads, limits=limits, speed=88.0)
    found = ff.compare([machine, other])
    assert {one.key: one.values for one in found.inputs} == {
        "operation.speed": (machine.speed, 88.0),
        "limits.relative_amplitude, least": (5e-3, 4e-3),
        "load case hot, temperature": (50.0, 40.0),
    }


@pytest.mark.parametrize("given", ["ffs0827", ["ffs0827"], [], None, ["ffs0827", 3], 5.0])
def test_what_cannot_be_compared_ends_in_a_sentence(given):
    with pytest.raises(InputError, match="at least two projects, screens or paths"):
        ff.compare(given)


def test_an_unknown_result_lists_what_there_is(found):
    with pytest.raises(InputError, match="omega_cs"):
        found.result("weight")
    with pytest.raises(InputError, match="full, carried mass"):
        found.result("stop_force", "half full")


def test_it_opens_as_it_was_saved(found, tmp_path):
    ff.save(found, tmp_path / "found.json")
    opened = ff.open_result(tmp_path / "found.json")
    assert opened.names == found.names
    assert opened.inputs == found.inputs
    assert opened.results == found.results
    document = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))
    assert document["schema"] == "flipflow/comparison/1"
    assert document["inputs"][0]["values"] == [6e-3, 8e-3]
    row = next(one for one in document["results"] if one["name"] == "omega_cs")
    assert row["changes"] == [row["values"][1] - row["values"][0]]


def test_the_curves_are_laid_over(found):
    found = dataclasses.replace(found, names=("six", "eight"))  # a legend has room for them
    figure = comparison_figure(found)
    assert ff.figure(found).title == figure.title
    assert [panel.title for panel in figure.panels] == [EMPTY, *CASES[1:]]
    for panel in figure.panels:
        assert {trace.name for trace in panel.traces} == set(found.names)
        (line,) = panel.lines
        assert line.at == pytest.approx(850.0)


def test_the_command_shows_both_and_what_changes(command, files, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    two = (files / "six.toml", files / "eight.toml")
    code, out, err = command("compare", *two, "-o", "out", "--json", "found.json")
    assert code == 0, err
    assert max(map(len, out.splitlines())) <= 80
    assert "A, FFS0827: 850 rpm: all limits met" in out
    assert "B, Flip-Flow-Siebmaschine mit verlängerten" in out
    begins = next(line for line in out.splitlines() if line.startswith("Contact begins"))
    assert begins.split()[-4:] == ["824.6", "rpm", "+50.5", "rpm"]
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"comparison.html", "curves.html", "comparison.json"}
    page = (tmp_path / "out" / "comparison.html").read_text(encoding="utf-8")
    assert "stops.clearance" in page
    assert "Flip-Flow-Siebmaschine mit verlängerten Anschlagpuffern" in page
    assert ff.open_result(tmp_path / "found.json").inputs[0].values == (6e-3, 8e-3)


def test_the_command_wants_two_files(command):
    code, _, err = command("compare", "ffs0827")
    assert code == 2
    assert "name at least two machine files" in err


def test_the_document_alone_is_printed(command, files):
    code, out, err = command("compare", "ffs0827", files / "eight.toml", "--json", "-")
    assert code == 0, err
    assert json.loads(out)["schema"] == "flipflow/comparison/1"


def test_analyze_makes_a_report_each_and_one_table(command, files, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    two = (files / "six.toml", files / "eight.toml")
    code, out, err = command("analyze", *two, "-o", "out", "--json", "found.json")
    assert code == 0, err
    assert max(map(len, out.splitlines())) <= 80
    for name in ("six-flipflow", "eight-flipflow"):
        assert (tmp_path / "out" / name / "report.html").is_file()
    page = (tmp_path / "out" / "summary.html").read_text(encoding="utf-8")
    table = out[out.index("Tightest limit") :]
    for words in ("FFS0827", "fail", "attention", "845 to 860.7", "relative amplitude"):
        assert words in page
        assert words in table
    opened = ff.open_result(tmp_path / "found.json")
    assert [one.omega for one in opened.assessments] == pytest.approx([850.0 / RPM] * 2)


def test_files_of_one_name_get_folders_of_their_own(command, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "other").mkdir()
    for folder in (".", "other"):
        shutil.copy(SMALL, tmp_path / folder / "six.toml")
    code, out, err = command("analyze", "six.toml", "other/six.toml")
    assert code == 0, err
    assert "Written to six-2-flipflow:" in out
    assert (tmp_path / "six-flipflow" / "report.html").is_file()
    assert (tmp_path / "six-2-flipflow" / "report.html").is_file()


def test_a_bad_file_is_refused_before_anything_is_computed(command, files, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    code, _, err = command("analyze", files / "six.toml", "missing.toml")
    assert code == 2
    assert "missing.toml" in err
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def started():
    """Two files that differ in how the motor is put on, which decides whether it starts."""
    text = SMALL.read_text(encoding="utf-8")
    drive = '[drive]\nrated_power = "5.5 kW"\nfriction = "60 N m"\nstart = "{}"\n\n[limits.start]\n'
    made = []
    for start, most in (("star-delta", "0.04 m"), ("direct", "0.05 m")):
        one = text.replace(
            "[limits]", f'{drive.format(start)}main_amplitude = "{most}"\n\n[limits]'
        )
        one = one.replace('["20 degC", 1.0]', f'["20 degC", {1.0 if start == "direct" else 1.02}]')
        made.append(one)
    return made


def test_inputs_are_named_as_in_the_file_and_a_start_that_fails_is_a_result(started, tmp_path):
    """No result was said to change between a machine that starts and one that does not."""
    paths = []
    for name, text in zip(("star", "direct"), started, strict=True):
        paths.append(tmp_path / f"{name}.toml")
        paths[-1].write_text(text, encoding="utf-8")
    found = ff.compare(paths)
    inputs = {one.key: (one.values, one.shown_unit) for one in found.inputs}
    assert inputs["drive.start"] == (("star-delta", "direct"), "")
    assert inputs["limits.start.main_amplitude"] == ((0.04, 0.05), "mm")
    assert inputs["shear_springs.temperature_factor, factor 2"] == ((1.02, 1.0), "")
    (speed, time), unit = inputs["drive.switch_over_speed"]
    assert speed is not None
    assert time is None
    assert unit == "rpm"
    assert not [key for key in inputs if "assumed" in key or "[" in key]
    start = found.result("start_speed", "empty")
    assert start.values[0] == 0.0
    assert start.values[1] > 0.95 * found.assessments[1].omega
    assert found.result("start_time", "empty").values[0] is None
    assert found.result("stop.foundation_force", "empty").changes
    tables = [block for block in main_changes(found) if isinstance(block, Table)]
    assert "Speed that the start reaches" in [row[0].text for row in tables[0].rows]


def test_what_a_load_case_holds_is_called_as_in_the_machine_file(machine):
    one, two = (
        dataclasses.replace(
            machine, load_cases=(ff.Load(name="wet", stiffness_factor=k, damping_factor=k,
                                         main_mass=10.0 * k, floating_mass=20.0 * k),)
        )
        for k in (1.1, 1.2)
    )  # fmt: skip
    assert [row.key for row in ff.compare([one, two]).inputs] == [
        "load case wet, shear_stiffness_factor",
        "load case wet, shear_damping_factor",
        "load case wet, material on the main frame",
        "load case wet, material on the floating frame",
    ]


def test_a_machine_is_told_what_changes_in_it_alone(machine, wider):
    """What another machine changes stood there, too, with nothing beside it."""
    found = ff.compare([machine, wider, machine])
    (table,) = (one for one in main_changes(found) if isinstance(one, Table))
    assert table.title == "B against A"
