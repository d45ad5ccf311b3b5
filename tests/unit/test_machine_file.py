"""Machine files: what is read, assumed, summed, questioned; schema and template."""

from __future__ import annotations

import dataclasses
import json
import math
import re
import tomllib

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import flipflow as ff
from flipflow.errors import InputError
from flipflow.io.check import check_project
from flipflow.io.derived import derive
from flipflow.io.layout import SECTIONS, sections_within
from flipflow.io.results import document_of
from flipflow.io.schema import machine_schema
from flipflow.io.source import bundled_names
from flipflow.io.template import template
from flipflow.model.fields import FIELDS
from flipflow.model.limits import LIMIT_FIELDS, PASSAGES, PASSING_FIELDS

SMALL = """
[frames]
main_mass = "916 kg"
floating_mass = "310 kg"
[exciter]
eccentric_moment = "4168.25 kg mm"
[isolation]
stiffness = "630 kN/m"
damping = "9.866 kN s/m"
[shear_springs]
stiffness = "2700 kN/m"
damping = "2.605 kN s/m"
"""


@pytest.fixture
def project_of(tmp_path):
    def read(text, **options):
        path = tmp_path / "machine.toml"
        path.write_text(text, encoding="utf-8")
        return ff.load_project(path, **options)

    return read


def test_ffs0827_has_the_papers_values():
    """Table 1 and section 3 of Minerals 2024, 14, 406, digit for digit in SI."""
    screen = ff.load("ffs0827")
    assert (screen.main_mass, screen.floating_mass) == (916.0, 310.0)
    assert screen.eccentric_moment == 4.16825
    assert (screen.isolation_stiffness, screen.isolation_damping) == (630e3, 9866.0)
    assert (screen.shear_stiffness, screen.shear_damping) == (2700e3, 2605.0)
    assert (screen.stop_stiffness, screen.stop_damping) == (8100e3, 2605.0)
    assert (screen.clearance, screen.clearance_minus) == (6e-3, None)


def test_ffs0827_project():
    project = ff.load_project("ffs0827")
    assert project.name == "ffs0827"
    assert project.path is None
    assert project.document.name == "FFS0827"
    assert project.speed == pytest.approx(850 * 2 * math.pi / 60)
    assert [case.name for case in project.load_cases] == [
        "empty", "full, stiffening", "full, carried mass", "hot",
    ]  # fmt: skip
    assert project.load_cases[2].main_mass == pytest.approx(0.5 * 30 * 2.16)
    assert project.limits.given == tuple(limit.name for limit in LIMIT_FIELDS)
    assert project.limits.relative_amplitude == (5e-3, 8e-3)
    assert project.limits.main_frame_acceleration == pytest.approx(29.41995)
    assert project.warnings == ()


def test_every_bundled_value_has_a_source():
    """A paper value names its table or section; all else is marked as assumed or identified."""
    for name in bundled_names():
        project = ff.load_project(name)
        for key in project.written:
            named = (
                project.sources.get(key)
                or project.sources.get(key.split(".")[0])
                or key.startswith("load case ")
            )
            assert named, key
        if name.startswith("ffs0827"):
            assert project.sources["frames.main_mass"] == "Minerals 2024, 14, 406, Table 1"
            assert project.sources["limits"] == "assumed for demonstration"
        for case in project.load_cases:
            assert f"load_cases.{case.name}" in project.sources


def test_linear_machine_is_the_same_without_stops():
    linear = ff.load("ffs0827-linear")
    assert not linear.has_stop
    no_stop = {"stop_stiffness": 0.0, "stop_damping": 0.0, "clearance": math.inf}
    assert linear == ff.load("ffs0827").replace(**no_stop, stop_pieces=None)


def test_small_file_and_what_it_assumes(project_of):
    project = project_of(SMALL)
    assert not project.screen.has_stop
    assert project.speed is None
    assert project.limits == ff.Limits()
    assert project.load_cases == (ff.Load(name="empty"),)
    assert project.document.name == "machine"
    assert any("[stops]" in sentence for sentence in project.assumed)
    missing = {gap.missing: gap.disables for gap in check_project(project).missing}
    assert "throw number" in missing["isolation.normal_stiffness"]
    assert "operation.speed" in missing


def test_pieces_make_the_total(project_of):
    text = SMALL.replace(
        'stiffness = "2700 kN/m"', 'stiffness_each = "225 kN/m"\npieces = 12'
    ).replace('stiffness = "630 kN/m"', 'stiffness_each = "157.5 kN/m"\nsupports = 4')
    project = project_of(text)
    assert project.screen.shear_stiffness == 2.7e6
    assert project.screen.isolation_stiffness == 630e3
    assert project.sums["shear_springs.stiffness"] == "12 x 225 kN/m = 2700 kN/m"


def test_total_may_repeat_its_pieces_rounded(project_of):
    text = SMALL.replace(
        'stiffness = "2700 kN/m"',
        'stiffness = "2700 kN/m"\nstiffness_each = "385.7 kN/m"\npieces = 7',
    )
    assert project_of(text).screen.shear_stiffness == 2.7e6


def test_stop_pieces_and_one_sided_stop(project_of):
    stops = '[stops]\nclearance = "6 mm"\nclearance_minus = "inf"\n'
    stops += 'stiffness_each = "2025 kN/m"\npieces_per_side = 4\nlaw = "compression-only"\n'
    screen = project_of(SMALL + stops).screen
    assert screen.stop_stiffness == 8.1e6
    assert screen.clearance_minus == math.inf
    assert screen.stop_law == "compression-only"
    assert screen.has_stop


@pytest.mark.parametrize("written", ["infinite", "inf mm"])
def test_how_no_stop_is_written_is_said(project_of, written):
    """The template says how, and so does what refuses another word."""
    assert '"inf" means no stop' in template()
    with pytest.raises(InputError, match="for example '6 mm' or 'inf'"):
        project_of(f'{SMALL}[stops]\nclearance = "6 mm"\nclearance_minus = "{written}"\n')


def test_infinite_clearance_is_no_stop(project_of):
    for written in ('"inf"', "inf"):
        assert not project_of(f"{SMALL}[stops]\nclearance = {written}\n").screen.has_stop


def test_sources_may_be_dotted_keys(project_of):
    project = project_of(SMALL + '[sources]\nframes.main_mass = "weighed"\n')
    assert project.sources == {"frames.main_mass": "weighed"}


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        ('"2700 kN/m"', '"2700 N/m"', "shear_springs.stiffness"),
        ('"630 kN/m"', '"630 N/m"', "isolation.stiffness"),
        ('"4168.25 kg mm"', '"4168.25 kg m"', "eccentric_moment"),
        ('"4168.25 kg mm"', '"4168.25 g mm"', "eccentric_moment"),
        ('"2.605 kN s/m"', '"2.605 N s/m"', "shear_springs.damping"),
        ('"9.866 kN s/m"', '"9.866 N s/m"', "isolation.damping"),
        ('"2.605 kN s/m"', '"2605 kN s/m"', "damping"),
        ('"310 kg"', '"3 kg"', "natural frequency w02"),
    ],
)
def test_slips_of_units_are_questioned_and_let_through(project_of, old, new, word):
    text = SMALL.replace(old, new)
    with pytest.raises(InputError, match="looks wrong") as caught:
        project_of(text)
    assert word in str(caught.value)
    assert "--force" in str(caught.value)
    assert any(word in warning for warning in project_of(text, force=True).warnings)


def test_ffs0827_and_damping_down_to_a_tenth_is_plausible(project_of):
    text = SMALL.replace('"2.605 kN s/m"', '"0.2605 kN s/m"')
    text = text.replace('"9.866 kN s/m"', '"0.9866 kN s/m"')
    assert project_of(text).warnings == ()


def test_derived_frequencies():
    """w_ea, w_ar by the formulas; w01, w02 as roots of the frequency equation."""
    screen = ff.load("ffs0827-linear")
    derived = derive(screen)
    system = screen.system()
    for omega in derived.natural_frequencies:
        stiffness = system.K - omega**2 * system.M
        assert abs(np.linalg.det(stiffness)) < 1e-9 * np.prod(np.abs(np.diag(system.K)))
    assert derived.omega_ar == pytest.approx(math.sqrt(2.7e6 / 310))
    assert derived.omega_ea == pytest.approx(2.7e6 / math.sqrt(2 * 310 * 2.7e6 - 2605**2))


def test_file_sizes_and_kinds(tmp_path):
    large = tmp_path / "large.toml"
    with large.open("wb") as file:
        file.truncate(100_000_000)
    with pytest.raises(InputError, match="100 MB"):
        ff.load(large)
    marked = tmp_path / "marked.toml"
    marked.write_text(SMALL, encoding="utf-8-sig")
    assert ff.load(marked).main_mass == 916.0
    with pytest.raises(InputError, match="not a file"):
        ff.load("/dev/zero")
    with pytest.raises(InputError, match="bundled name"):
        ff.load(3)


def _refusal(read, text):
    try:
        read(text)
    except InputError as error:
        return error
    return None


def _toml(tables):
    """Write sections of plain values as TOML."""
    lines = []
    for section, table in tables.items():
        lines.append("[[load_cases]]" if section == "load_cases" else f"[{section}]")
        for key, value in table.items():
            lines.append(f"{key} = {value if isinstance(value, float) else json.dumps(value)}")
    return "\n".join(lines)


# No deadline: the first file read also imports pint.
ANY_FILE = settings(
    max_examples=100,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)


@ANY_FILE
@given(
    st.text(st.characters(exclude_categories=["Cs"]), max_size=60),
    st.sampled_from(["", SMALL, SMALL + "[stops]\n"]),
)
def test_any_text_loads_or_is_refused_in_a_sentence(project_of, text, head):
    refusal = _refusal(project_of, head + text)
    assert refusal is None or (refusal.field and refusal.remedy)


@ANY_FILE
@given(
    st.sampled_from([entry.label for entries in SECTIONS.values() for entry in entries]),
    st.one_of(
        st.booleans(),
        st.integers(),
        st.floats(),
        st.text("0123456789.,-+eE kNmsg/%", max_size=8),
        st.lists(st.integers(), max_size=2),
    ),
)
def test_any_value_loads_or_is_refused_in_a_sentence(project_of, label, value):
    section, _, key = label.rpartition(".")
    tables = tomllib.loads(SMALL)
    place = tables
    for part in section.split("."):
        place = place.setdefault(part, {})
    place[key] = value
    refusal = _refusal(project_of, _toml(tables))
    assert refusal is None or (refusal.field and refusal.remedy)


def test_template_loads_as_it_is(project_of):
    project = project_of(template())
    assert project.warnings == ()
    assert check_project(project).missing == ()
    for field in FIELDS:
        if field.name != "clearance_minus":
            assert getattr(project.screen, field.name) is not None


@ANY_FILE
@given(st.integers(800, 3000), st.integers(2000, 5000), st.sampled_from(["kg", "t"]))
def test_template_loads_when_filled_in(project_of, mass, stiffness, unit):
    written = f"{mass} kg" if unit == "kg" else f"{mass / 1000} t"
    text = template().replace('"1000 kg"', f'"{written}"')
    text = text.replace('"3000 kN/m"', f'"{stiffness} kN/m"')
    screen = project_of(text).screen
    assert screen.main_mass == pytest.approx(mass)
    assert screen.shear_stiffness == 1e3 * stiffness


def test_template_and_schema_know_every_key():
    schema = machine_schema()
    text = template()
    for section, entries in SECTIONS.items():
        table = schema
        for part in section.split("."):
            table = table["properties"][part]
        keys = table.get("items", table).get("properties", {})
        assert set(keys) == {*(entry.key for entry in entries), *sections_within(section)}
        assert all(re.search(rf"\b{entry.key}\b", text) for entry in entries)
    assert json.loads(json.dumps(schema)) == schema
    assert schema["properties"]["frames"]["allOf"][0] == {"anyOf": [{"required": ["main_mass"]}]}


def test_limits_table_and_class_agree():
    names = [field.name for field in dataclasses.fields(ff.Limits)]
    assert names == [*(limit.name for limit in LIMIT_FIELDS), *PASSAGES]
    passing = {field.name for field in dataclasses.fields(ff.PassingLimits)}
    assert all(passing == {limit.name for limit in PASSING_FIELDS[one]} for one in PASSAGES)
    with pytest.raises(InputError, match="lesser end first"):
        ff.Limits(speed=(100.0, 60.0))
    with pytest.raises(InputError, match="stop_force"):
        ff.Limits(stop_force=-1.0)
    with pytest.raises(InputError, match="two numbers"):
        ff.Limits(speed=100.0)


def test_check_document_is_plain_data():
    document = document_of(check_project(ff.load_project("ffs0827")))
    assert document["schema"] == "flipflow/check/1"
    assert json.loads(json.dumps(document))["speeds"][0]["name"] == "w01"
