"""Units and words of a machine file as engineers write them, and slips that are questioned."""

from __future__ import annotations

import math
import subprocess
import sys

import pytest

import flipflow as ff
from flipflow.errors import InputError
from flipflow.io.source import bundled_text
from flipflow.io.units import parse_quantity
from flipflow.io.vary import read_vary

RPM = math.pi / 30.0


@pytest.fixture
def changed(tmp_path):
    """The bundled machine's file with some words replaced, and loaded."""

    def load(*pairs, force=False):
        text = bundled_text("ffs0827")
        for old, new in pairs:
            assert old in text, old
            text = text.replace(old, new)
        path = tmp_path / "changed.toml"
        path.write_text(text, encoding="utf-8")
        return ff.load_project(path, force=force)

    return load


@pytest.mark.parametrize("unit", ["U/min", "min^-1", "min-1", "min⁻¹", "r/min", "1/min", "rpm"])
def test_every_word_for_turns_a_minute_is_understood(unit):
    omega = parse_quantity(f"850 {unit}", "rad/s", field="speed")
    assert omega == pytest.approx(850 * RPM, rel=1e-15)


@pytest.mark.parametrize(
    ("written", "unit", "value"),
    [
        ("4168.25 kgmm", "kg m", 4.16825),
        ("40 Nm", "N m", 40.0),
        ("0.8 kgm²", "kg m^2", 0.8),
        ("2.605 kNs/m", "N s/m", 2605.0),
        ("6 800 kg", "kg", 6800.0),
        ("6\N{NO-BREAK SPACE}800.5 kg", "kg", 6800.5),
        ("1\N{NARROW NO-BREAK SPACE}250\N{NARROW NO-BREAK SPACE}000 N", "N", 1.25e6),
        ("6.800 kg", "kg", 6.8),
    ],
)
def test_quantities_as_engineers_write_them(written, unit, value):
    assert parse_quantity(written, unit, field="value") == value


@pytest.mark.parametrize("written", ["6 80 kg", "6 8000 kg", "6,800 kg", "6 800 000.5.2 kg"])
def test_what_is_no_group_of_thousands_is_refused(written):
    with pytest.raises(InputError):
        parse_quantity(written, "kg", field="value")


def test_a_point_that_may_set_thousands_apart_is_questioned(changed):
    words = ('main_mass = "916 kg"', 'main_mass = "6.800 kg"')
    with pytest.raises(InputError, match=r"read as 6\.8 kg.*'6\.8 kg' or '6800 kg'"):
        changed(words)
    assert changed(words, force=True).screen.main_mass == 6.8


def test_a_plausible_value_with_a_zero_at_its_end_is_questioned_too(changed):
    words = ('floating_mass = "310 kg"', 'floating_mass = "3.100 kg"')
    with pytest.raises(InputError, match="'3100 kg'"):
        changed(words)


def test_three_decimals_that_were_measured_are_not_questioned(changed):
    assert changed().screen.isolation_damping == 9866.0


def test_carried_material_is_questioned_too(changed):
    with pytest.raises(InputError, match=r"load case 3, material.*'1200 kg'"):
        changed(('material = "30 kg/m^2"', 'material = "1.200 kg"'))


def test_carried_material_in_any_unit_of_mass(changed):
    """In pounds it was refused as no mass per area, where the masses of the frames are taken so."""
    case = changed(('material = "30 kg/m^2"', 'material = "140 lb"')).load_cases[2]
    assert case.main_mass + case.floating_mass == pytest.approx(63.503, rel=1e-5)
    area = changed(('material = "30 kg/m^2"', 'material = "6 lb/ft^2"')).load_cases[2]
    assert area.main_mass + area.floating_mass == pytest.approx(2.16 * 29.2946, rel=1e-5)


def test_a_total_that_looks_like_one_piece_is_questioned(changed):
    words = (
        ('stiffness = "2700 kN/m"', 'stiffness = "0.38 kN/mm"'),
        ("pieces = 12", "pieces = 40"),
    )
    with pytest.raises(InputError, match=r"leaves 9\.5 kN/m for one.*stiffness_each"):
        changed(*words)
    assert changed(*words, force=True).screen.shear_stiffness == 380e3


def test_the_same_as_one_piece_is_taken(changed):
    project = changed(
        ('stiffness = "2700 kN/m"', 'stiffness_each = "0.38 kN/mm"'),
        ("pieces = 12", "pieces = 40"),
    )
    assert project.screen.shear_stiffness == pytest.approx(15.2e6)


@pytest.mark.parametrize(
    "number", ["1e-99999999999999999999", "1e-400", "0.5E-9999999999999999999"]
)
def test_a_value_too_small_for_a_number_ends_in_a_sentence(changed, number):
    with pytest.raises(InputError, match=r"floating_mass.*told from 0"):
        changed(('floating_mass = "310 kg"', f'floating_mass = "{number} kg"'))


@pytest.mark.parametrize("number", ["0", "0.0", "0e5"])
def test_zero_stays_zero(number):
    assert parse_quantity(f"{number} kN s/m", "N s/m", field="damping") == 0.0


SCREEN = ff.load("ffs0827")


@pytest.mark.parametrize("name", ["clearance", "stops.clearance"])
def test_vary_takes_the_words_of_the_machine_file(name):
    assert read_vary([f"{name}=5 mm..7 mm"], SCREEN) == {"clearance": (5e-3, 7e-3)}


def test_vary_takes_the_last_word_of_a_key_where_one_section_has_it():
    assert read_vary(["height=45 mm..55 mm"], SCREEN) == {"shear_height": (0.045, 0.055)}


def test_vary_takes_one_piece():
    found = read_vary(["shear_springs.stiffness_each=200 kN/m..250 kN/m"], SCREEN)
    assert found == {"shear_stiffness": (2.4e6, 3.0e6)}


def test_vary_asks_which_section_is_meant():
    with pytest.raises(InputError, match=r"isolation\.stiffness or shear_springs\.stiffness or"):
        read_vary(["stiffness=1 kN/m..2 kN/m"], SCREEN)


@pytest.mark.parametrize("words", [["gapp=1 mm..2 mm"], []])
def test_vary_lists_the_words(words):
    with pytest.raises(InputError) as refused:
        read_vary(words, SCREEN)
    for word in ("stops.clearance", "frames.main_mass", "isolation.normal_damping"):
        assert word in str(refused.value)


def test_reading_a_file_loads_neither_scipy_nor_pint(tmp_path):
    path = tmp_path / "words.toml"
    path.write_text(
        bundled_text("ffs0827").replace('"850 rpm"', '"850 U/min"').replace("kg mm", "kgmm"),
        encoding="utf-8",
    )
    code = (
        "import sys; import flipflow as ff; ff.load_project(sys.argv[1]); "
        "print(*[n for n in ('scipy', 'pint', 'numba', 'xarray') if n in sys.modules])"
    )
    run = subprocess.run(
        [sys.executable, "-c", code, path], capture_output=True, text=True, check=True
    )
    assert run.stdout.split() == []
