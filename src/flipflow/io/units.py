"""Quantities with units, as engineers write them, to SI and back.

A table holds the units of this trade, so that a machine file is read at once. Any other unit is
handed to pint, except where pint errs: angles, speeds, temperatures and ratios never reach it,
because it turns 15 Hz into 15 rad/s.
"""

from __future__ import annotations

import difflib
import functools
import math
import re
from collections.abc import Mapping
from decimal import Decimal
from typing import Any

from flipflow.errors import InputError, Shown
from flipflow.model.constants import GRAVITY

_TURN = 2.0 * math.pi

# SI unit -> (what it measures, an example, {unit: factor to SI}).
_UNITS: Mapping[str, tuple[str, str, Mapping[str, float]]] = {
    "kg": ("a mass", "916 kg", {"kg": 1.0, "t": 1e3, "g": 1e-3, "mg": 1e-6}),
    "m": ("a length", "6 mm", {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "µm": 1e-6}),
    "m^2": ("an area", "2.16 m^2", {"m^2": 1.0, "cm^2": 1e-4, "mm^2": 1e-6}),
    "N": ("a force", "15 kN", {"N": 1.0, "kN": 1e3, "MN": 1e6}),
    "N/m": (
        "a stiffness",
        "2700 kN/m",
        {"N/m": 1.0, "kN/m": 1e3, "MN/m": 1e6, "N/mm": 1e3, "kN/mm": 1e6, "N/cm": 1e2},
    ),
    "N s/m": (
        "a damping coefficient",
        "2.605 kN s/m",
        {
            "N s/m": 1.0,
            "kN s/m": 1e3,
            "N s/mm": 1e3,
            "kN s/mm": 1e6,
            "N/(m/s)": 1.0,
            "kN/(m/s)": 1e3,
            "kg/s": 1.0,
            "Ns/m": 1.0,
            "kNs/m": 1e3,
        },
    ),
    "kg m": (
        "a static moment",
        "4168.25 kg mm",
        {
            "kg m": 1.0,
            "kg mm": 1e-3,
            "kg cm": 1e-2,
            "g m": 1e-3,
            "g mm": 1e-6,
            "kgm": 1.0,
            "kgmm": 1e-3,
            "kgcm": 1e-2,
            "gm": 1e-3,
            "gmm": 1e-6,
        },
    ),
    "m/s^2": (
        "an acceleration",
        "3 g",
        {"m/s^2": 1.0, "mm/s^2": 1e-3, "g": GRAVITY, "g_n": GRAVITY},
    ),
    "rad/s^2": ("a rise of speed", "15 rad/s^2", {"rad/s^2": 1.0, "rpm/s": _TURN / 60.0}),
    "kg m^2": (
        "a moment of inertia",
        "0.8 kg m^2",
        {"kg m^2": 1.0, "kg cm^2": 1e-4, "kgm^2": 1.0, "kgcm^2": 1e-4},
    ),
    "N m": ("a torque", "40 N m", {"N m": 1.0, "kN m": 1e3, "Nm": 1.0, "kNm": 1e3}),
    "s": ("a time", "20 s", {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0}),
    "W": ("a power", "2 kW", {"W": 1.0, "kW": 1e3, "MW": 1e6}),
    "W/K": ("a thermal conductance", "1.5 W/K", {"W/K": 1.0}),
    "K": ("a difference of temperature", "10 K", {"K": 1.0}),
    "m/s": ("a speed", "0.4 m/s", {"m/s": 1.0, "mm/s": 1e-3}),
    "kg/m^2": ("a mass per area", "30 kg/m^2", {"kg/m^2": 1.0, "t/m^2": 1e3, "g/m^2": 1e-3}),
    "rad": ("an angle", "15 deg", {"rad": 1.0, "deg": math.pi / 180.0, "°": math.pi / 180.0}),
    "rad/s": (
        "a shaft speed",
        "850 rpm",
        {
            "rad/s": 1.0,
            "Hz": _TURN,
            **dict.fromkeys(("rpm", "1/min", "min^-1", "U/min", "r/min", "rev/min"), _TURN / 60.0),
        },
    ),
    "degC": ("a temperature", "50 degC", {"degC": 1.0, "°C": 1.0, "K": 1.0, "degF": 5.0 / 9.0}),
    "": ("a ratio", "20 %", {"": 1.0, "%": 1e-2}),
}
# Of temperatures, which count from another zero; differences of them do not.
_OFFSET: Mapping[tuple[str, str], float] = {
    ("degC", "K"): -273.15,
    ("degC", "degF"): -160.0 / 9.0,
}
MOST_WRITTEN = 100  # characters of a quantity
_NEVER_PINT = frozenset({"rad", "rad/s", "rad/s^2", "degC", ""})

_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
# Thousands set apart by blanks, as "6 800 kg"; no comma or point ever does that here.
_GROUPED = re.compile(r"[+-]?[0-9]{1,3}(?: [0-9]{3})+(?![0-9])(?:\.[0-9]*)?")
_DIGIT = re.compile("[^eE]*[1-9]")  # one that is not 0, before the power of ten
_BLANKS = re.compile("[\N{NO-BREAK SPACE}\N{NARROW NO-BREAK SPACE}\N{THIN SPACE}]")
# Where a point sets thousands apart, "6.800 kg" is 6800 kg.
_THREE_DECIMALS = re.compile(r"[+-]?[0-9]{1,3}\.[0-9]{3}(?![0-9eE.])")
# Only names with small exponents go to pint: it evaluates arithmetic, however large.
_SAFE_UNIT = re.compile(r"[A-Za-zµ_]+(?:\^-?[1-4])?(?:[ /][A-Za-zµ_]+(?:\^-?[1-4])?)*")
_SPELLINGS = (
    ("**", "^"), ("²", "^2"), ("·", " "), ("*", " "), ("m2", "m^2"), ("s2", "s^2"),
    ("\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT ONE}", "^-1"), ("\N{MINUS SIGN}", "-"),
    ("min-1", "min^-1"),
)  # fmt: skip


def parse_quantity(
    written: object, unit: str, *, field: str, example: str = "", allow_infinite: bool = False
) -> float:
    """Convert a quantity such as ``"2700 kN/m"`` to SI.

    Parameters
    ----------
    written
        What the user wrote: text with a unit; a bare number only where ``unit`` is empty.
    unit
        SI unit of the result, one of those flipflow uses: ``"N/m"``, ``"rad/s"``, ``"degC"``
        (temperatures stay in degrees Celsius), ``""`` for a ratio.
    field
        Name for the error sentence.
    example
        What to write, for the error sentence.
    allow_infinite
        Whether ``"inf"`` is a value.

    Returns
    -------
    float
        The value in ``unit``.

    Raises
    ------
    InputError
        For a boolean, text without a number, a missing, unknown or wrong unit, or a comma.
    """
    what, usual, _ = _UNITS[unit]
    example = example or usual
    if isinstance(written, (int, float)) and not isinstance(written, bool):
        return _bare(written, unit, field, example, allow_infinite=allow_infinite)
    if not isinstance(written, str):
        raise InputError(field, as_toml(written), f"{what} belongs here, for example {example!r}")
    if len(written) > MOST_WRITTEN:
        remedy = f"{what} has at most {MOST_WRITTEN} characters, for example {example!r}"
        raise InputError(field, written, remedy)
    text = _BLANKS.sub(" ", written).strip()
    if allow_infinite and text in {"inf", "+inf"}:
        return math.inf
    if "," in text:
        raise InputError(
            field,
            written,
            f"write a point as the decimal sign and no commas, for example {example!r}",
        )
    number, name = _parts(text)
    if not number:
        remedy = f"{what} belongs here, for example {example!r}"
        raise InputError(field, written, f"{remedy} or 'inf'" if allow_infinite else remedy)
    value = _convert(number, name, unit, field=field, written=written, example=example)
    if not math.isfinite(value):
        raise InputError(field, written, f"give a finite value, for example {example!r}")
    return value


def in_unit(value: float, unit: str, si_unit: str) -> float:
    """Convert an SI value to ``unit``, for example 2.7e6 N/m to 2700 kN/m.

    Parameters
    ----------
    value
        Value in ``si_unit``.
    unit, si_unit
        A unit of the table, and the SI unit it belongs to; or the same unit twice, which the table
        need not have.

    Returns
    -------
    float
        The value in ``unit``.
    """
    if unit == si_unit:
        return value
    return (value - _OFFSET.get((si_unit, unit), 0.0)) / _UNITS[si_unit][2][unit]


def shown(value: float, unit: str, si_unit: str) -> str:
    """Return an SI value as text in ``unit``, six significant digits at most: ``"2700 kN/m"``."""
    return f"{in_unit(value, unit, si_unit):.6g} {unit}".strip()


def measured(text: str) -> str | None:
    """SI unit of the quantity in ``text``, None when its unit is not in the table."""
    _, name = _parts(_BLANKS.sub(" ", text).strip())
    return next((si for si, (_, _, known) in _UNITS.items() if name and name in known), None)


def converts(text: str, unit: str) -> bool:
    """Whether the unit of the quantity in ``text`` is one of ``unit``, also beside the table."""
    _, name = _parts(_BLANKS.sub(" ", text).strip())
    other = measured(text)
    if other is not None or not _SAFE_UNIT.fullmatch(name):
        return other == unit
    try:
        _pint_factor(name, unit, field="", written=text, example="")
    except InputError:
        return False
    return True


def with_three_decimals(written: object) -> tuple[str, str] | None:
    """A quantity such as "6.800 kg" read both ways: "6.8 kg" and "6800 kg"; else None."""
    text = written.strip() if isinstance(written, str) else ""
    match = _THREE_DECIMALS.match(text)
    if match is None:
        return None
    number, unit = match.group(), text[match.end() :]
    return f"{number.rstrip('0').rstrip('.')}{unit}", f"{number.replace('.', '')}{unit}"


def _parts(text: str) -> tuple[str, str]:
    """Number and unit of a quantity; no number where there is none."""
    match = _GROUPED.match(text) or _NUMBER.match(text)
    if match is None:
        return "", ""
    return match.group().replace(" ", ""), _normal(text[match.end() :])


def _bare(written: float, unit: str, field: str, example: str, *, allow_infinite: bool) -> float:
    try:
        value = float(written)
    except OverflowError:
        value = math.nan  # an integer beyond all floats, which no field may be
    if value == math.inf and allow_infinite:
        return value
    if unit:
        raise InputError(field, written, f"write the unit and quotes, for example {example!r}")
    if not math.isfinite(value):
        raise InputError(field, written, f"give a finite number, for example {example}")
    return value


def as_toml(value: object) -> object:
    """A value as a sentence shows it: a boolean as the file has it, without quotes."""
    return Shown(str(value).lower()) if isinstance(value, bool) else value


def _normal(unit: str) -> str:
    for spelling, plain in _SPELLINGS:
        unit = unit.replace(spelling, plain)
    return re.sub(r" ?/ ?", "/", " ".join(unit.split()))


def _convert(number: str, name: str, unit: str, *, field: str, written: str, example: str) -> float:
    what, _, known = _UNITS[unit]
    if float(number) == 0.0 and _DIGIT.match(number):
        remedy = f"give a value that can be told from 0, for example {example!r}"
        raise InputError(field, written, remedy)
    if name in known:
        return _times(number, known[name]) + _OFFSET.get((unit, name), 0.0)
    if not name:
        raise InputError(field, written, f"write the unit of {what}, for example {example!r}")
    other = next((w for w, _, units in _UNITS.values() if name in units), None)
    if other is not None:
        raise InputError(
            field, written, f"this is {other} where {what} belongs, for example {example!r}"
        )
    if unit in _NEVER_PINT or not _SAFE_UNIT.fullmatch(name):
        raise _unknown(field, written, name, known, example)
    return float(number) * _pint_factor(name, unit, field=field, written=written, example=example)


def _times(number: str, factor: float) -> float:
    """Multiply in decimals, so that "4168.25 kg mm" is 4.16825 kg m to the last digit."""
    if not math.isfinite(float(number)):
        return math.inf
    return float(Decimal(number) * Decimal(str(factor)))


def _unknown(
    field: str, written: str, name: str, known: Mapping[str, float], example: str
) -> InputError:
    lower = {unit.lower(): unit for unit in known}
    near = difflib.get_close_matches(name.lower(), lower, n=1, cutoff=0.5)
    hint = f" (perhaps {lower[near[0]]!r} is meant)" if near else ""
    return InputError(
        field, written, f"the unit {name!r} is not known{hint}, write for example {example!r}"
    )


def _pint_factor(name: str, unit: str, *, field: str, written: str, example: str) -> float:
    """Factor to SI of a unit outside the table, such as ``lbf/in``."""
    import pint  # noqa: PLC0415  half a second, for units few people write

    registry = _registry()
    what, _, known = _UNITS[unit]
    try:
        return float(registry.Quantity(1.0, name).to(unit.replace(" ", " * ")).magnitude)
    except pint.DimensionalityError:
        raise InputError(
            field, written, f"{name!r} is not the unit of {what}, write for example {example!r}"
        ) from None
    except Exception:  # noqa: BLE001  pint raises many kinds for text it cannot read
        raise _unknown(field, written, name, known, example) from None


@functools.lru_cache(maxsize=1)
def _registry() -> Any:
    import pint  # noqa: PLC0415  half a second, for units few people write

    return pint.UnitRegistry()
