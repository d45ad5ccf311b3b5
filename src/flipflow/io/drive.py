"""The drive of a machine file: the motor's power is given, what else is left out is assumed."""

from __future__ import annotations

import numpy as np

from flipflow.errors import InputError, as_written
from flipflow.io.layout import SPEED, START, TORQUE_TABLE, entry_of
from flipflow.io.units import parse_quantity
from flipflow.io.values import (
    LEFT_OUT,
    Notes,
    Table,
    read_choice,
    read_number,
    read_torques,
)
from flipflow.model.drive import (
    DRIVE_FIELDS,
    SYNCHRONOUS_SPEED,
    Drive,
    SpeedProfile,
    assumed_drive,
)
from flipflow.model.motor import checked_torque_table
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.torque_curve import rated_point

# Fields that say nothing with a torque table, and those of one way of starting.
OF_RATIOS = ("breakdown_ratio", "breakdown_slip", "starting_ratio", "pull_up_ratio")
OF_STARTS = {
    "switch_over_speed": "star-delta", "switch_over_time": "star-delta",
    "ramp": "converter", "ramp_time": "converter", "torque_limit": "converter",
}  # fmt: skip
EXAMPLE = "0 s: 0 rpm, 20 s: 850 rpm"


def read_drive(
    table: Table | None, screen: FlipFlowScreen, speed: float | None, notes: Notes
) -> Drive | None:
    """Read the section ``[drive]``; None where there is none.

    Raises
    ------
    InputError
        Without the rated power or the working speed, and for values that contradict each other.
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
    start = "direct"
    if START.key in table:
        start = read_choice(table, START, notes, default="direct")
    _check_start(table, values, start)
    rows = _torque_table(table, power, values, notes)
    drive = assumed_drive(
        screen.eccentric_moment, speed, power, values, torque_table=rows, start=start
    )
    notes.assumed.extend(f"drive: {text}" for text in drive.assumed)
    return drive


def _check_start(table: Table, values: dict[str, float], start: str) -> None:
    """Refuse what belongs to another way of starting, or is said twice."""
    fields = {field.name: field for field in DRIVE_FIELDS}
    for name, way in OF_STARTS.items():
        if name in values and start != way:
            key = entry_of(fields[name]).key
            raise InputError(
                fields[name].key,
                table[key],
                f'write drive.start = "{way}" with it, or leave it out',
            )
    for one, other in (("switch_over_speed", "switch_over_time"), ("ramp", "ramp_time")):
        if one in values and other in values:
            key = entry_of(fields[one]).key
            raise InputError(fields[one].key, table[key], f"give it or drive.{other}, not both")
    if start == "converter" and "ramp_time" in values:
        synchronous = values.get("synchronous_speed", SYNCHRONOUS_SPEED)
        values["ramp"] = synchronous / values.pop("ramp_time")


def _torque_table(
    table: Table, power: float, values: dict[str, float], notes: Notes
) -> tuple[tuple[float, float], ...]:
    """The table of torque over speed with torques over the rated one; empty where there is none."""
    if TORQUE_TABLE.key not in table:
        return ()
    written = notes.written[TORQUE_TABLE.label] = table[TORQUE_TABLE.key]
    for field in DRIVE_FIELDS:
        if field.name in OF_RATIOS and field.name in values:
            key = entry_of(field).key
            raise InputError(
                field.key, table[key], "the torque table says it, leave one of them out"
            )
    read, in_torque = read_torques(written, TORQUE_TABLE.label)
    rows = checked_torque_table(TORQUE_TABLE.label, read)
    synchronous = values.get("synchronous_speed", SYNCHRONOUS_SPEED)
    last = () if rows[-1][0] >= synchronous else ((synchronous, 0.0),)
    point = rated_point(np.array([*rows, *last]), power if in_torque else None)
    if point is None:
        raise InputError(
            TORQUE_TABLE.label, written, "let it fall through the rated torque before its end"
        )
    rated = point[1] if in_torque else 1.0
    return tuple((speed, torque / rated) for speed, torque in rows)


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
    with as_written(field, written, f", for example {EXAMPLE!r}"):
        return SpeedProfile(times, speeds)
