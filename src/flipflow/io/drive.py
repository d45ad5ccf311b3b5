"""The drive of a machine file: the motor's power is given, what else is left out is assumed."""

from __future__ import annotations

from flipflow.errors import InputError
from flipflow.io.layout import SPEED, entry_of
from flipflow.io.units import parse_quantity
from flipflow.io.values import LEFT_OUT, Notes, Table, read_number
from flipflow.model.drive import DRIVE_FIELDS, Drive, SpeedProfile, assumed_drive
from flipflow.model.screen import FlipFlowScreen

EXAMPLE = "0 s: 0 rpm, 20 s: 850 rpm"


def read_drive(
    table: Table | None, screen: FlipFlowScreen, speed: float | None, notes: Notes
) -> Drive | None:
    """Read the section ``[drive]``; None where there is none.

    Raises
    ------
    InputError
        Without the rated power or the working speed.
    """
    if table is None:
        return None
    values = {}
    for field in DRIVE_FIELDS:
        entry = entry_of(field)
        if entry.key in table:
            notes.written[entry.label] = table[entry.key]
            values[field.name] = read_number(table[entry.key], field)
        elif field.required:
            remedy = f"it must be given, for example {field.example!r}, or leave out [drive]"
            raise InputError(field.key, LEFT_OUT, remedy)
    if speed is None:
        remedy = "give the working speed, for example '850 rpm', or leave out [drive]"
        raise InputError(SPEED.key, LEFT_OUT, remedy)
    power = values.pop("rated_power")
    drive = assumed_drive(screen.eccentric_moment, speed, power, values)
    notes.assumed.extend(f"drive: {text}" for text in drive.assumed)
    return drive


def parse_profile(written: str, field: str) -> SpeedProfile:
    """The profile of a text such as ``"0 s: 0 rpm, 20 s: 850 rpm"``.

    Raises
    ------
    InputError
        For text of another shape, wrong units, and what a profile may not be.
    """
    times, speeds = [], []
    for point in written.split(","):
        parts = point.split(":")
        if len(parts) != 2:
            raise InputError(field, written, f"write points such as {EXAMPLE!r}")
        times.append(parse_quantity(parts[0], "s", field=field))
        speeds.append(parse_quantity(parts[1], "rad/s", field=field))
    try:
        return SpeedProfile(times, speeds)
    except InputError as error:
        raise InputError(field, written, f"{error.remedy}, for example {EXAMPLE!r}") from None
