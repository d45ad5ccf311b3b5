"""What a machine may do: limits on amplitude, acceleration, speed, forces and power.

Unit and direction of each stand in :mod:`flipflow.model.quantities`, its evaluation in
:mod:`flipflow.studies.quantity_values`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import NoneType
from typing import Literal

from flipflow.errors import InputError
from flipflow.model.arguments import checked_kind
from flipflow.model.fields import Field
from flipflow.model.quantities import QUANTITIES, Direction, Limit

Interval = tuple[float, float]


@dataclass(frozen=True)
class LimitField(Field):
    """One limit as a field of the machine file: a number, or (least, greatest).

    Parameters
    ----------
    direction
        Which side of the limit is allowed.
    """

    direction: Direction = "at most"

    @property
    def interval(self) -> bool:
        """Whether the limit has two ends."""
        return self.direction == "between"


Passage = Literal["start", "stop"]
PASSAGES: tuple[Passage, ...] = ("start", "stop")


def _fields(section: str, limits: Mapping[str, Limit | None]) -> tuple[LimitField, ...]:
    """A field of a section for each quantity that may be limited there, in the table's order."""
    return tuple(
        LimitField(
            one.name, one.symbol, one.unit, one.shown_unit, f"{section}.{one.name}",
            limit.sentence, upper=limit.upper, lower_open=limit.direction == "at most",
            plausible=limit.plausible, default=None, example=limit.example,
            direction=limit.direction,
        )
        for one in QUANTITIES.values()
        if (limit := limits[one.name]) is not None
    )  # fmt: skip


LIMIT_FIELDS = _fields("limits", {one.name: one.limit for one in QUANTITIES.values()})
LIMIT_FIELD: Mapping[str, LimitField] = {field.name: field for field in LIMIT_FIELDS}
PASSING_FIELDS: Mapping[Passage, tuple[LimitField, ...]] = {
    passage: _fields(f"limits.{passage}", {one.name: one.passing for one in QUANTITIES.values()})
    for passage in PASSAGES
}


@dataclass(frozen=True, kw_only=True)
class PassingLimits:
    """What a machine may do while it starts, or stops, in SI; each left at None is not checked.

    Parameters
    ----------
    relative_amplitude
        Greatest amplitude of x1 - xf in m.
    main_amplitude
        Greatest displacement of the main frame in m, in any direction.
    shear_strain
        Greatest relative amplitude over rubber height, a ratio.
    stop_force, foundation_force
        Greatest peak force in N.

    Raises
    ------
    InputError
        For a limit that no machine can have.
    """

    relative_amplitude: float | None = None
    main_amplitude: float | None = None
    shear_strain: float | None = None
    stop_force: float | None = None
    foundation_force: float | None = None

    def __post_init__(self) -> None:
        for field in PASSING_FIELDS["start"]:
            object.__setattr__(self, field.name, field.check(getattr(self, field.name)))


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What a machine may do, in SI; each limit left at None is not checked.

    Parameters
    ----------
    relative_amplitude
        (least, greatest) amplitude of x1 - xf in m.
    main_frame_acceleration, floating_frame_acceleration
        Greatest peak acceleration in m/s^2, both directions together.
    speed
        (least, greatest) shaft speed in rad/s.
    shear_strain
        Greatest relative amplitude over rubber height, a ratio.
    stop_force, foundation_force
        Greatest peak force in N.
    dissipated_power
        Greatest mean power of the dampers in W.
    jump_margin
        Least distance from the jump speed, as a ratio of it.
    start, stop
        What it may do while it starts, and while it stops; None: nothing is limited.

    Raises
    ------
    InputError
        For a limit that no machine can have, or an interval whose ends are reversed.
    """

    relative_amplitude: Interval | None = None
    main_frame_acceleration: float | None = None
    floating_frame_acceleration: float | None = None
    speed: Interval | None = None
    shear_strain: float | None = None
    stop_force: float | None = None
    foundation_force: float | None = None
    dissipated_power: float | None = None
    jump_margin: float | None = None
    start: PassingLimits = PassingLimits()
    stop: PassingLimits = PassingLimits()

    def __post_init__(self) -> None:
        for passage in PASSAGES:
            given = getattr(self, passage)
            checked_kind(passage, given, (PassingLimits, NoneType), "give an ff.PassingLimits")
            object.__setattr__(self, passage, given or PassingLimits())
        for field in LIMIT_FIELDS:
            value = getattr(self, field.name)
            checked = _interval(field, value) if field.interval else field.check(value)
            object.__setattr__(self, field.name, checked)

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the limits that were given, in the order of the table."""
        return tuple(f.name for f in LIMIT_FIELDS if getattr(self, f.name) is not None)


def limit_bounds(limits: Limits, name: str) -> Interval:
    """(least, most) of a limit that was given, SI; infinite where there is no such end."""
    value = getattr(limits, name)
    direction = LIMIT_FIELD[name].direction
    if direction == "between":
        return float(value[0]), float(value[1])
    return (float(value), math.inf) if direction == "at least" else (-math.inf, float(value))


def _interval(field: LimitField, value: object) -> Interval | None:
    """Check both ends and their order."""
    if value is None:
        return None
    if not isinstance(value, (tuple, list)) or len(value) != 2:
        raise InputError(field.name, value, f"give (least, greatest), two numbers in {field.unit}")
    low, high = (field.check(end, label=field.name) for end in value)
    if low is None or high is None or not low < high or math.isinf(high):
        raise InputError(field.name, value, "give the lesser end first and a greater one second")
    return low, high
