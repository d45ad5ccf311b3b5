"""What turns the shaft: an induction motor over a belt or gear, or a speed laid down over time."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import NoneType
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow.errors import InputError
from flipflow.model.arguments import (
    checked_all,
    checked_at_least_zero,
    checked_flag,
    checked_kind,
    checked_numbers,
    checked_positive,
    checked_reals,
)
from flipflow.model.fields import Field
from flipflow.model.motor import BREAKDOWN_RATIO, BREAKDOWN_SLIP, Motor, Row, checked_speeds_of
from flipflow.model.starter import STAR_TORQUE, Converter, StarDelta, Starter

STARTING_RATIO, PULL_UP_RATIO = 2.0, 1.6  # usual of cage motors
SWITCH_OVER = 0.8  # of the synchronous speed, where star is switched over to delta
RAMP_TIME, TORQUE_LIMIT = 10.0, 1.5  # s to the synchronous speed, and share of the rated torque
SYNCHRONOUS_SPEED = 50.0 * math.pi
UNBALANCE_RADIUS, FRICTION_SHARE = 0.1, 0.05

# A table reads as a table: one line for the names, one for the sentence, one for the numbers.
# fmt: off
DRIVE_FIELDS: tuple[Field, ...] = (
    Field(
        "rated_power", "P", "W", "kW", "drive.rated_power",
        "Rated power of the motor, or of all motors together.",
        lower_open=True, plausible=(100.0, 1e6),
        example="5.5 kW",
    ),
    Field(
        "synchronous_speed", "Omega_s", "rad/s", "rpm", "drive.synchronous_speed",
        "Speed of the motor's field; left out, 1500 rpm is assumed.",
        lower_open=True, default=None, plausible=(40.0, 400.0),
        example="1500 rpm",
    ),
    Field(
        "breakdown_ratio", "Tb/Tr", "", "", "drive.breakdown_torque_ratio",
        "Largest torque of the motor over its rated torque; left out, 2.5 is assumed.",
        lower=1.0, lower_open=True, default=None, plausible=(1.2, 6.0),
        example=2.5,
    ),
    Field(
        "breakdown_slip", "s_b", "", "%", "drive.breakdown_slip",
        "Slip of the motor at its largest torque; left out, 20 % is assumed.",
        lower_open=True, upper=0.99, default=None, plausible=(0.02, 0.6),
        example="20 %",
    ),
    Field(
        "starting_ratio", "Ta/Tr", "", "", "drive.starting_torque_ratio",
        "Torque of the motor at standstill over its rated torque; left out, 2 is assumed.",
        lower_open=True, default=None, plausible=(0.3, 5.0),
        example=2.0,
    ),
    Field(
        "pull_up_ratio", "Tu/Tr", "", "", "drive.pull_up_torque_ratio",
        "Least torque of the motor on the way up over its rated torque; left out, 1.6 is assumed.",
        lower_open=True, default=None, plausible=(0.3, 5.0),
        example=1.6,
    ),
    Field(
        "switch_over_speed", "Omega_y", "rad/s", "rpm", "drive.switch_over_speed",
        "For a start in star and delta: speed of the motor at which it is switched over; without "
        "speed and time, 80 % of the synchronous speed is assumed.",
        lower_open=True, default=None, plausible=(10.0, 400.0),
        example="1200 rpm",
    ),
    Field(
        "switch_over_time", "t_y", "s", "s", "drive.switch_over_time",
        "For a start in star and delta: time after which it is switched over.",
        lower_open=True, default=None, plausible=(0.1, 60.0),
        example="4 s",
    ),
    Field(
        "ramp", "a", "rad/s^2", "rad/s^2", "drive.ramp",
        "For a converter: rise of the speed of the motor's field; or give ramp_time.",
        lower_open=True, default=None, plausible=(0.5, 500.0),
        example="15 rad/s^2",
    ),
    Field(
        "ramp_time", "t_a", "s", "s", "drive.ramp_time",
        "For a converter: time in which the field rises to the motor's synchronous speed; without "
        "ramp and time, 10 s is assumed.",
        lower_open=True, default=None, plausible=(0.5, 300.0),
        example="10 s",
    ),
    Field(
        "torque_limit", "Tmax/Tr", "", "", "drive.torque_limit",
        "For a converter: largest torque over the rated one; left out, 1.5 is assumed.",
        lower_open=True, default=None, plausible=(0.5, 4.0),
        example=1.5,
    ),
    Field(
        "ratio", "i", "", "", "drive.ratio",
        "Speed of the motor over that of the shaft; left out, such that the shaft settles at "
        "working speed.",
        lower_open=True, default=None, plausible=(0.2, 10.0),
        example=1.75,
    ),
    Field(
        "inertia", "J", "kg m^2", "kg m^2", "drive.inertia",
        "Moment of inertia at the shaft: unbalances, shafts, pulleys, and the rotor times the "
        "ratio squared; left out, twice that of the unbalance at 100 mm is assumed.",
        lower_open=True, default=None, plausible=(1e-4, 1e3),
        example="0.9 kg m^2",
    ),
    Field(
        "friction", "T_f", "N m", "N m", "drive.friction",
        "Friction torque at the shaft; left out, 5 % of the rated torque is assumed.",
        default=None, plausible=(0.0, 1e3),
        example="3 N m",
    ),
)
# fmt: on


BISECTIONS = 60  # halvings of an interval of ratios


@dataclass(frozen=True, kw_only=True)
class Drive:
    """The exciter's shaft with what drives and brakes it.

    Parameters
    ----------
    inertia
        Moment of inertia at the shaft in kg m^2: unbalances, shafts, pulleys, and the motor's
        rotor times the square of the ratio.
    motor
        The motor; None where it is switched off.
    ratio
        Speed of the motor over that of the shaft.
    friction
        Constant friction torque at the shaft in N m.
    viscous_friction
        Friction torque that grows with speed, in N m s.
    assumed
        What was assumed of it, as sentences.
    starter
        How the motor is put on the mains: a :class:`~flipflow.StarDelta`, a
        :class:`~flipflow.Converter`, or None: at once.
    assumed_fields
        Names of the fields that were assumed, of the motor's, too.
    open_ratio
        Whether ``ratio`` is still to be chosen such that the shaft settles at working speed, which
        :func:`~flipflow.start_up` does.

    Raises
    ------
    InputError
        For values that are not finite or that no drive has.
    """

    inertia: float
    motor: Motor | None = None
    ratio: float = 1.0
    friction: float = 0.0
    viscous_friction: float = 0.0
    assumed: tuple[str, ...] = ()
    starter: Starter | None = None
    assumed_fields: tuple[str, ...] = ()
    open_ratio: bool = False

    def __post_init__(self) -> None:
        if self.motor is not None:
            checked_kind("motor", self.motor, Motor, "give an ff.Motor, or None: switched off")
        for name in ("inertia", "ratio"):
            object.__setattr__(self, name, checked_positive(name, getattr(self, name)))
        for name in ("friction", "viscous_friction"):
            object.__setattr__(self, name, checked_at_least_zero(name, getattr(self, name)))
        for name in ("assumed", "assumed_fields"):
            words = checked_all(name, getattr(self, name), str, "give a tuple of texts")
            object.__setattr__(self, name, words)
        kinds = (StarDelta, Converter, NoneType)
        checked_kind("starter", self.starter, kinds, "give a StarDelta, a Converter, or None")
        checked_flag("open_ratio", self.open_ratio)

    @property
    def synchronous_speed(self) -> float | None:
        """Speed of the shaft in rad/s at which the motor gives no torque; None without motor."""
        return None if self.motor is None else self.motor.synchronous_speed / self.ratio

    @property
    def rated_speed(self) -> float | None:
        """Speed of the shaft in rad/s at the motor's rated torque; None without motor."""
        return None if self.motor is None else self.motor.rated_speed / self.ratio

    @property
    def end_speed(self) -> float | None:
        """Speed of the shaft in rad/s at which the field ends up; None without motor."""
        if self.motor is None:
            return None
        given = self.starter.end_speed if isinstance(self.starter, Converter) else None
        return (given or self.motor.synchronous_speed) / self.ratio

    def torque(self, speed: ArrayLike) -> NDArray[np.float64]:
        """Torque at the shaft in N m at speeds of the shaft in rad/s, once it is switched up.

        It is the motor's, times the ratio; that of a converter at the end of its ramp.
        """
        speeds = checked_speeds_of("speed", speed)
        if self.motor is None:
            return np.zeros(speeds.shape)
        if isinstance(self.starter, Converter):
            return self.converter_torque(self.starter, speeds, np.asarray(self.end_speed))
        return np.asarray(self.ratio * self.motor.torque(self.ratio * speeds))

    def converter_torque(
        self, converter: Converter, speed: NDArray[np.float64], field: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Torque at the shaft in N m behind a converter, by shaft speeds of rotor and field."""
        slope, most = self.converter_slope_and_limit(converter)
        return np.clip(slope * (field - speed), -most, most)

    def converter_slope_and_limit(self, converter: Converter) -> tuple[float, float]:
        """Torque at the shaft in N m s a unit of slip there, and its limit in N m."""
        motor = self.motor
        if motor is None:
            return 0.0, 0.0
        rated = self.ratio * motor.rated_torque
        slip = motor.rated_slip * motor.synchronous_speed / self.ratio
        return rated / slip, converter.torque_limit * rated

    @property
    def torque_at_rest(self) -> float:
        """Torque at the shaft in N m with which a start begins: a third in star, the limit."""
        if self.motor is None:
            return 0.0
        if isinstance(self.starter, Converter):
            return self.converter_slope_and_limit(self.starter)[1]
        share = STAR_TORQUE if isinstance(self.starter, StarDelta) else 1.0
        return share * self.ratio * float(self.motor.torque(0.0))

    def ratio_for(self, speed: float, torque: float) -> float | None:
        """The ratio with which the shaft settles at a speed in rad/s under a torque in N m.

        None where the motor has not that torque there, on the side of its curve that is stable.
        """
        motor = self.motor
        if motor is None:
            return None
        low, high = motor.breakdown_speed / speed, motor.synchronous_speed / speed

        def excess(ratio: float) -> float:
            return ratio * float(motor.torque(ratio * speed)) - torque

        if excess(low) <= 0.0:
            return None
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if excess(middle) > 0.0 else (low, middle)
        return 0.5 * (low + high)

    def friction_torque(self, speed: ArrayLike) -> NDArray[np.float64]:
        """Friction in N m at speeds of the shaft in rad/s, against the motion."""
        speeds = checked_speeds_of("speed", speed)
        return np.asarray(self.friction * np.sign(speeds) + self.viscous_friction * speeds)

    def switched_off(self) -> Self:
        """Return the same shaft without motor."""
        kept = ("inertia", "friction")
        words = tuple(word for word in self.assumed if word.startswith(kept))
        names = tuple(name for name in self.assumed_fields if name in kept)
        return replace(
            self, motor=None, assumed=words, starter=None, assumed_fields=names, open_ratio=False
        )


@dataclass(frozen=True, eq=False)
class SpeedProfile:
    """Shaft speed over time, straight between the given points and constant after the last.

    Parameters
    ----------
    times
        In s, rising, from 0 on, (n,) with n >= 2.
    speeds
        In rad/s, none below 0, (n,).

    Raises
    ------
    InputError
        For times that do not rise, speeds below 0, and anything that is not finite.
    """

    times: tuple[float, ...]
    speeds: tuple[float, ...]

    def __init__(self, times: Sequence[float], speeds: Sequence[float]) -> None:
        t, w = _row("times", times), _row("speeds", speeds)
        if len(t) < 2 or len(t) != len(w):
            raise InputError("times", t, "give at least two times, and one speed for each")
        if t[0] != 0.0 or any(b <= a for a, b in itertools.pairwise(t)):
            raise InputError("times", t, "let times start at 0 s and rise from point to point")
        if min(w) < 0.0 or max(w) == 0.0:
            raise InputError("speeds", w, "give speeds of at least 0 rad/s, not all of them 0")
        object.__setattr__(self, "times", t)
        object.__setattr__(self, "speeds", w)

    @property
    def duration(self) -> float:
        """Time of the last point in s."""
        return self.times[-1]

    def speed(self, t: ArrayLike) -> NDArray[np.float64]:
        """Speed in rad/s at times in s."""
        seconds = checked_reals("t", t, "give times in s")
        return np.asarray(np.interp(seconds, self.times, self.speeds))


def _row(name: str, values: object) -> tuple[float, ...]:
    remedy = "give finite numbers in one row"
    row = checked_numbers(name, values, remedy)
    if row.ndim != 1:
        raise InputError(name, values, remedy)
    return tuple(row.tolist())


def assumed_drive(
    eccentric_moment: float,
    speed: float,
    power: float,
    given: Mapping[str, float] | None = None,
    *,
    torque_table: tuple[Row, ...] = (),
    start: str = "direct",
) -> Drive:
    """A drive of known power; what ``given`` leaves out is assumed, and said in ``assumed``.

    Parameters
    ----------
    eccentric_moment
        m0 r of the screen in kg m.
    speed
        Working speed in rad/s.
    power
        Rated power of the motor in W.
    given
        Any of the fields of a machine file's drive by name, and ``viscous_friction``, in SI.
    torque_table
        Rows (speed, torque over rated torque) instead of ratios and slip.
    start
        ``"direct"``, ``"star-delta"`` or ``"converter"``.
    """
    known = _Known(dict(given or {}), [], [])
    take = known.take
    synchronous = take(
        "synchronous_speed", SYNCHRONOUS_SPEED, "motor of 4 poles at 50 Hz, 1500 rpm"
    )
    if torque_table:
        motor = Motor(rated_power=power, synchronous_speed=synchronous, torque_table=torque_table)
    else:
        motor = _motor(power, synchronous, known, start)
    inertia = 2.0 * eccentric_moment * UNBALANCE_RADIUS
    open_ratio = "ratio" not in known.given
    return Drive(
        motor=motor,
        ratio=take(
            "ratio", motor.rated_speed / speed, "belt ratio such that it settles at working speed"
        ),
        inertia=take(
            "inertia", inertia,
            f"inertia {inertia:.3g} kg m^2, twice that of the unbalance at {UNBALANCE_RADIUS:g} m",
        ),
        friction=take(
            "friction", FRICTION_SHARE * power / speed,
            f"friction torque {100.0 * FRICTION_SHARE:.0f} % of rated torque",
        ),
        viscous_friction=known.given.get("viscous_friction", 0.0),
        starter=_starter(start, synchronous, known),
        assumed=tuple(known.words),
        assumed_fields=tuple(known.names),
        open_ratio=open_ratio,
    )  # fmt: skip


@dataclass(frozen=True)
class _Known:
    """Values that are given, and what was assumed for want of others: sentences and names."""

    given: dict[str, float]
    words: list[str]
    names: list[str]

    def take(self, name: str, value: float, sentence: str) -> float:
        if name not in self.given:
            self.words.append(sentence)
            self.names.append(name)
        return self.given.get(name, value)


def _motor(power: float, synchronous: float, known: _Known, start: str) -> Motor:
    """A motor by ratios and slip; behind a converter the way up has no part."""
    breakdown = known.take(
        "breakdown_ratio", BREAKDOWN_RATIO, f"breakdown torque {BREAKDOWN_RATIO:g} times rated"
    )
    slip = known.take("breakdown_slip", BREAKDOWN_SLIP, f"breakdown slip {BREAKDOWN_SLIP:g}")
    motor = Motor(
        rated_power=power, synchronous_speed=synchronous, breakdown_ratio=breakdown,
        breakdown_slip=slip,
    )  # fmt: skip
    if start == "converter":
        return motor
    # A pull-up torque alone tells that the torque at standstill is at least as large.
    starting = max(STARTING_RATIO, known.given.get("pull_up_ratio", 0.0))
    starting = known.take("starting_ratio", starting, f"starting torque {starting:g} times rated")
    pull_up = min(PULL_UP_RATIO, starting, breakdown)
    pull_up = known.take("pull_up_ratio", pull_up, f"pull-up torque {pull_up:g} times rated")
    return replace(motor, starting_ratio=starting, pull_up_ratio=pull_up)


def _starter(start: str, synchronous: float, known: _Known) -> Starter | None:
    if start == "star-delta":
        time = known.given.get("switch_over_time")
        if time is not None and "switch_over_speed" not in known.given:
            return StarDelta(time=time)
        words = f"switched over to delta at {100.0 * SWITCH_OVER:.0f} % of the synchronous speed"
        speed = known.take("switch_over_speed", SWITCH_OVER * synchronous, words)
        return StarDelta(speed=speed, time=time)
    if start == "converter":
        ramp = known.given.get("ramp")
        if ramp is None:
            words = f"the converter's ramp takes {RAMP_TIME:g} s"
            ramp = synchronous / known.take("ramp_time", RAMP_TIME, words)
        elif "ramp_time" in known.given:
            raise InputError("ramp_time", known.given["ramp_time"], "give it or ramp, not both")
        words = f"the converter's torque limit {TORQUE_LIMIT:g} times rated"
        return Converter(ramp=ramp, torque_limit=known.take("torque_limit", TORQUE_LIMIT, words))
    return None
