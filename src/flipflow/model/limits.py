"""What a machine may do: limits on amplitude, acceleration, speed, forces and power."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from flipflow.errors import InputError
from flipflow.model.constants import GRAVITY
from flipflow.model.fields import Field

Interval = tuple[float, float]


@dataclass(frozen=True)
class LimitField(Field):
    """One limit: a field whose value is an upper bound or, as ``interval``, (least, most).

    Parameters
    ----------
    interval
        Whether the limit has two ends.
    needs
        Fields of the screen without which the limit cannot be checked.
    """

    interval: bool = False
    needs: tuple[str, ...] = ()


_NORMAL = ("normal_stiffness", "normal_damping")

# A table reads as a table: one line for the names, one for the sentence, one for the numbers.
# fmt: off
LIMIT_FIELDS: tuple[LimitField, ...] = (
    LimitField(
        "relative_amplitude", "|x2|", "m", "mm", "limits.relative_amplitude",
        "Least and greatest relative amplitude, half peak to peak.",
        default=None, plausible=(0.0, 0.1), example=("4 mm", "8 mm"), interval=True,
    ),
    LimitField(
        "main_frame_acceleration", "a1", "m/s^2", "g", "limits.main_frame_acceleration",
        "Greatest acceleration of the main frame, peak, in any direction.",
        lower_open=True, default=None, plausible=(0.5 * GRAVITY, 100.0 * GRAVITY), example="4 g",
        needs=_NORMAL,
    ),
    LimitField(
        "floating_frame_acceleration", "af", "m/s^2", "g", "limits.floating_frame_acceleration",
        "Greatest acceleration of the floating frame, peak, in any direction.",
        lower_open=True, default=None, plausible=(0.5 * GRAVITY, 100.0 * GRAVITY), example="10 g",
        needs=_NORMAL,
    ),
    LimitField(
        "speed", "omega", "rad/s", "rpm", "limits.speed",
        "Least and greatest shaft speed of the drive.",
        default=None, plausible=(0.0, 320.0), example=("600 rpm", "1000 rpm"), interval=True,
    ),
    LimitField(
        "shear_strain", "gamma", "", "%", "limits.shear_strain",
        "Greatest relative amplitude over the rubber height of a shear spring.",
        lower_open=True, default=None, plausible=(0.005, 3.0), example="20 %",
        needs=("shear_height",),
    ),
    LimitField(
        "stop_force", "H", "N", "kN", "limits.stop_force",
        "Greatest force on the stop springs of one side together, peak.",
        lower_open=True, default=None, plausible=(100.0, 10e6), example="15 kN",
    ),
    LimitField(
        "foundation_force", "F1", "N", "kN", "limits.foundation_force",
        "Greatest dynamic force on the foundation, peak, in any direction.",
        lower_open=True, default=None, plausible=(50.0, 5e6), example="8 kN",
        needs=_NORMAL,
    ),
    LimitField(
        "dissipated_power", "P", "W", "kW", "limits.dissipated_power",
        "Greatest power that the dampers turn into heat, mean over a turn.",
        lower_open=True, default=None, plausible=(20.0, 1e6), example="2 kW",
    ),
    LimitField(
        "jump_margin", "s", "", "%", "limits.jump_margin",
        "Least distance of the speed from the jump, as a share of the jump speed.",
        upper=1.0, default=None, plausible=(0.0, 0.9), example="20 %",
    ),
)
# fmt: on

LIMIT_FIELD: Mapping[str, LimitField] = {field.name: field for field in LIMIT_FIELDS}


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

    def __post_init__(self) -> None:
        for field in LIMIT_FIELDS:
            value = getattr(self, field.name)
            checked = _interval(field, value) if field.interval else field.check(value)
            object.__setattr__(self, field.name, checked)

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the limits that were given, in the order of the table."""
        return tuple(f.name for f in LIMIT_FIELDS if getattr(self, f.name) is not None)


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
