"""Quantities with units: to SI and back, and what is refused."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flipflow.errors import InputError
from flipflow.io.units import _UNITS, in_unit, measured, parse_quantity, shown

EVERY_UNIT = [(unit, si) for si, (_, _, known) in _UNITS.items() for unit in known]


@pytest.mark.parametrize(
    ("written", "unit", "expected"),
    [
        ("916 kg", "kg", 916.0),
        ("4168.25 kg mm", "kg m", 4.16825),
        ("2700 kN/m", "N/m", 2.7e6),
        ("2.605 kN s/m", "N s/m", 2605.0),
        ("2.605 kN·s/m", "N s/m", 2605.0),
        ("2.605 kN*s / m", "N s/m", 2605.0),
        ("6mm", "m", 6e-3),
        ("1e3 mm", "m", 1.0),
        ("2.16 m²", "m^2", 2.16),
        ("30 kg/m2", "kg/m^2", 30.0),
        ("3 g", "m/s^2", 3 * 9.80665),
        ("500 g", "kg", 0.5),
        ("20 %", "", 0.2),
        (0.2, "", 0.2),
        (12, "", 12.0),
        ("50 degC", "degC", 50.0),
        ("323.15 K", "degC", 50.0),
        ("122 degF", "degC", 50.0),
        ("15 deg", "rad", math.pi / 12),
        ("-15°", "rad", -math.pi / 12),
        ("100 lbf/in", "N/m", 17512.6835),
        ("2 inch", "m", 0.0508),
        ("1 hp", "W", 745.69987),
    ],
)
def test_to_si(written, unit, expected):
    assert parse_quantity(written, unit, field="x") == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        ("15 Hz", 30 * math.pi),
        ("900 rpm", 30 * math.pi),
        ("900 1/min", 30 * math.pi),
        ("15 rad/s", 15.0),
    ],
)
def test_hertz_and_rpm_are_turns_and_never_reach_pint(written, expected):
    """Pint reads 15 Hz as 15 rad/s."""
    assert parse_quantity(written, "rad/s", field="speed") == pytest.approx(expected)


def test_decimals_are_exact():
    """The paper's 4168.25 kg mm is 4.16825 kg m, not a last digit beside it."""
    assert parse_quantity("4168.25 kg mm", "kg m", field="x") == 4.16825
    assert parse_quantity("9.866 kN s/m", "N s/m", field="x") == 9866.0


@pytest.mark.parametrize(
    ("written", "unit", "remedy"),
    [
        ("2,7 kN/m", "N/m", "write a point"),
        ("2,700 kN/m", "N/m", "write a point"),
        ("850 rpm", "N/m", "a shaft speed where a stiffness belongs"),
        ("2700 kN", "N/m", "a force where a stiffness belongs"),
        ("3 psi", "N/m", "not the unit of a stiffness"),
        ("2700 KN/m", "N/m", "perhaps 'kN/m'"),
        ("2700 foo", "N/m", "not known"),
        ("6 m**9**9**9", "m", "not known"),
        ("2700", "N/m", "write the unit"),
        (2700, "N/m", "write the unit"),
        (10**400, "N/m", "write the unit"),
        (True, "N/m", "belongs here"),
        ("soft", "N/m", "belongs here"),
        ("", "N/m", "belongs here"),
        ([1], "N/m", "belongs here"),
        ("inf", "N/m", "belongs here"),
        ("nan kg", "kg", "belongs here"),
        ("1e999 kg", "kg", "finite"),
        (math.inf, "", "finite"),
        (math.nan, "", "finite"),
        (10**400, "", "finite"),
        (True, "", "a ratio belongs here"),
        ("15 grad", "rad", "not known"),
    ],
)
def test_refused_with_field_value_and_remedy(written, unit, remedy):
    with pytest.raises(InputError) as caught:
        parse_quantity(written, unit, field="frames.thing")
    assert caught.value.field == "frames.thing"
    assert remedy in str(caught.value)


def test_infinity_where_it_is_a_value():
    assert parse_quantity("inf", "m", field="x", allow_infinite=True) == math.inf
    assert parse_quantity(math.inf, "m", field="x", allow_infinite=True) == math.inf
    with pytest.raises(InputError):
        parse_quantity("-inf", "m", field="x", allow_infinite=True)


@given(
    st.floats(-1e12, 1e12, allow_nan=False).filter(lambda x: x == 0 or abs(x) > 1e-12),
    st.sampled_from(EVERY_UNIT),
)
def test_round_trip(value, pair):
    unit, si = pair
    text = f"{in_unit(value, unit, si)!r} {unit}".strip()
    if unit:
        read = parse_quantity(text, si, field="x")
    else:
        read = parse_quantity(in_unit(value, unit, si), si, field="x")
    assert read == pytest.approx(value, rel=1e-12, abs=1e-9 if si == "degC" else 0.0)


@given(st.text(max_size=30), st.sampled_from(list(_UNITS)))
def test_any_text_is_a_number_or_a_sentence(text, unit):
    try:
        value = parse_quantity(text, unit, field="x")
    except InputError:
        return
    assert math.isfinite(value)


def test_shown_and_measured():
    assert shown(2.7e6, "kN/m", "N/m") == "2700 kN/m"
    assert measured("30 kg/m^2") == "kg/m^2"
    assert measured("60 kg") == "kg"
    assert measured("60") is None
    assert measured("soft") is None


def test_a_unit_that_no_file_has_is_its_own():
    """As that of a least blow, which the report of a comparison tells."""
    assert in_unit(12.5, "kg m/s", "kg m/s") == 12.5
