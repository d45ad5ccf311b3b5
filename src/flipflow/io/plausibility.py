"""Slips of units that parse: values and figures that no flip-flow screen has."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from flipflow.errors import InputError
from flipflow.io.derived import Derived, derive
from flipflow.io.layout import LOAD_FIELDS, MATERIAL, SPEED, entry_of
from flipflow.io.units import in_unit, measured, parse_quantity, shown, with_three_decimals
from flipflow.model.drive import DRIVE_FIELDS, Drive
from flipflow.model.fields import FIELD, FIELDS, Field
from flipflow.model.limits import LIMIT_FIELDS, PASSING_FIELDS, Limits
from flipflow.model.screen import FlipFlowScreen, Load

_HERTZ = 2.0 * math.pi
NATURAL_FREQUENCIES = (0.2 * _HERTZ, 60.0 * _HERTZ)
STATIC_AMPLITUDES = (0.1e-3, 30e-3)
# Below the lesser, a damper is so weak that kN s/m was likely read as N s/m; zero is a choice.
DAMPING_RATIOS = (5e-4, 1.5)
OWN = {"switch_over_speed": "speed", "switch_over_time": "time"}  # names that a part has for them
# N/m: what is softer is no spring of a screen; such a total is likely the value of one piece.
LEAST_OF_ONE = {"isolation_stiffness": 20e3, "shear_stiffness": 20e3, "stop_stiffness": 50e3}
_FORCE = "or let it through with --force (force=True)"


def implausible(
    screen: FlipFlowScreen,
    limits: Limits,
    cases: Sequence[Load],
    speed: float | None,
    drive: Drive | None,
    written: Mapping[str, object],
) -> tuple[InputError, ...]:
    """Return what looks wrong, as errors to be raised or shown; empty when nothing does.

    Derived figures are judged only where every single value is plausible: otherwise they would
    repeat in other words what is wrong already. ``written`` holds values as the file has them.
    """
    values = (
        *_thousands(written),
        *_values(screen, limits, cases, speed, written),
        *_drive_values(drive, written),
        *_totals(screen, written),
    )
    return values or tuple(_figures(derive(screen)))


def _thousands(written: Mapping[str, object]) -> Iterator[InputError]:
    """Values such as "6.800 kg", where 6800 kg is as possible as 6.8 kg.

    Three decimals alone are no reason to ask: "9.866 kN s/m" is well measured. A zero at their end
    is one, or a value that no screen has.
    """
    fields = {field.key: field for field in (*FIELDS, SPEED, *LIMIT_FIELDS, *DRIVE_FIELDS)}
    for key, text in written.items():
        field = MATERIAL if key.endswith(", material") else fields.get(key.removesuffix("_each"))
        both = with_three_decimals(text)
        if both is None or field is None or measured(str(text)) != field.unit:
            continue
        as_point, as_thousand = (parse_quantity(one, field.unit, field=key) for one in both)
        odd = both[0] != text or not field.is_plausible(as_point)
        if odd and field.plausible is not None and field.is_plausible(as_thousand):
            yield InputError(
                key, text,
                f"it is read as {both[0]}, the point being the decimal sign, write {both[0]!r} or "
                f"{both[1]!r} {_FORCE}",
            )  # fmt: skip


def _totals(screen: FlipFlowScreen, written: Mapping[str, object]) -> Iterator[InputError]:
    """Totals whose pieces would be softer than any, while one such piece would not be."""
    for name, least in LEAST_OF_ONE.items():
        field, total = FIELD[name], getattr(screen, name)
        count = getattr(screen, str(field.count)) or 1.0
        if field.key in written and total / count < least <= total and count > 1.0:
            one = shown(total / count, field.file_unit, field.unit)
            each = f"{entry_of(field).key}_each"
            yield InputError(
                field.key, written[field.key],
                f"shared by {FIELD[str(field.count)].key} = {count:g} it leaves {one} for one, "
                f"which looks wrong, write {each} if it is the value of one piece {_FORCE}",
            )  # fmt: skip


def _values(
    screen: FlipFlowScreen,
    limits: Limits,
    cases: Sequence[Load],
    speed: float | None,
    written: Mapping[str, object],
) -> Iterator[InputError]:
    for field in FIELDS:
        yield from _question(field, getattr(screen, field.name), written)
    yield from _question(SPEED, speed, written)
    for limit in LIMIT_FIELDS:
        value = getattr(limits, limit.name)
        for end in value if isinstance(value, tuple) else (value,):
            yield from _question(limit, end, written)
    for passage, fields in PASSING_FIELDS.items():
        for limit in fields:
            yield from _question(limit, getattr(getattr(limits, passage), limit.name), written)
    for case in cases:
        for field in LOAD_FIELDS:
            yield from _question(field, getattr(case, field.name), {}, of=f" of {case.name!r}")
        carried = case.main_mass + case.floating_mass
        if carried > 3.0 * (screen.main_mass + screen.floating_mass):
            yield InputError(
                f"load_cases.material of {case.name!r}", f"{carried:.4g} kg",
                f"this looks wrong, it is more than three times the machine, check it {_FORCE}",
            )  # fmt: skip


def _drive_values(drive: Drive | None, written: Mapping[str, object]) -> Iterator[InputError]:
    if drive is None:
        return
    parts = (drive, drive.motor, drive.starter)
    for field in DRIVE_FIELDS:
        owner = next(
            (part for part in parts if hasattr(part, OWN.get(field.name, field.name))), None
        )
        if field.key in written and owner is not None:
            value = getattr(owner, OWN.get(field.name, field.name))
            yield from _question(field, value, written)


def _question(
    field: Field, value: float | None, written: Mapping[str, object], *, of: str = ""
) -> Iterator[InputError]:
    if value is None or field.plausible is None or field.is_plausible(value):
        return
    low, high = (in_unit(end, field.file_unit, field.unit) for end in field.plausible)
    yield InputError(
        field.key + of,
        written.get(field.key, shown(value, field.file_unit, field.unit)),
        f"this looks wrong, screens have {low:.4g} to {high:.6g} {field.file_unit}".rstrip()
        + f", check the unit {_FORCE}",
    )


def _figures(derived: Derived) -> Iterator[InputError]:
    low, high = NATURAL_FREQUENCIES
    for name, omega in zip(("w01", "w02"), derived.natural_frequencies, strict=True):
        if not low <= omega <= high:
            yield InputError(
                f"natural frequency {name}", f"{omega / _HERTZ:.4g} Hz",
                "this looks wrong, screens have 0.2 to 60 Hz, check the units of masses and "
                f"stiffnesses {_FORCE}",
            )  # fmt: skip
    if not STATIC_AMPLITUDES[0] <= derived.static_amplitude <= STATIC_AMPLITUDES[1]:
        yield InputError(
            "exciter.eccentric_moment over all mass", shown(derived.static_amplitude, "mm", "m"),
            f"this looks wrong, screens have 0.1 to 30 mm, check the unit of kg mm {_FORCE}",
        )  # fmt: skip
    for section, ratio in derived.damping_ratios.items():
        if ratio != 0.0 and not DAMPING_RATIOS[0] <= ratio <= DAMPING_RATIOS[1]:
            yield InputError(
                f"{section}.damping as damping ratio", f"{ratio:.3g}",
                f"this looks wrong, screens have {DAMPING_RATIOS[0]:g} to {DAMPING_RATIOS[1]:g}, "
                f"check the unit, kN s/m against N s/m, {_FORCE}",
            )  # fmt: skip
