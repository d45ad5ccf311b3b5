"""What turns the shaft: an induction motor over a belt or gear, or a speed laid down over time."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow.errors import InputError
from flipflow.model.arguments import (
    checked_all,
    checked_at_least_zero,
    checked_kind,
    checked_number,
    checked_numbers,
    checked_positive,
    checked_reals,
)
from flipflow.model.fields import Field

BREAKDOWN_RATIO, BREAKDOWN_SLIP = 2.5, 0.2
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
        "ratio", "i", "", "", "drive.ratio",
        "Speed of the motor over that of the shaft; left out, such that the motor has its rated "
        "speed at working speed.",
        lower_open=True, default=None, plausible=(0.2, 10.0),
        example=1.7,
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


@dataclass(frozen=True, kw_only=True)
class Motor:
    r"""An induction motor on the mains, by Kloss' formula.

    With slip :math:`s = 1 - \Omega / \Omega_s` the torque is

    .. math:: T = \frac{2 T_b}{s / s_b + s_b / s} .

    Parameters
    ----------
    synchronous_speed
        Speed :math:`\Omega_s` of the field at the motor in rad/s.
    rated_power
        Rated power in W; or give ``breakdown_torque``.
    breakdown_torque
        Largest torque :math:`T_b` in N m.
    breakdown_ratio
        Breakdown torque over rated torque; serves to find one from the other.
    breakdown_slip
        Slip :math:`s_b` at the largest torque.

    Raises
    ------
    InputError
        For values that are not finite or that no motor has, and unless exactly one of rated power
        and breakdown torque is given.
    """

    synchronous_speed: float
    rated_power: float | None = None
    breakdown_torque: float | None = None
    breakdown_ratio: float = BREAKDOWN_RATIO
    breakdown_slip: float = BREAKDOWN_SLIP

    def __post_init__(self) -> None:
        if (self.rated_power is None) == (self.breakdown_torque is None):
            raise InputError(
                "rated_power", self.rated_power, "give either the rated power or breakdown_torque"
            )
        given = "rated_power" if self.breakdown_torque is None else "breakdown_torque"
        for name in ("synchronous_speed", given):
            object.__setattr__(self, name, checked_positive(name, getattr(self, name)))
        ratio = checked_number("breakdown_ratio", self.breakdown_ratio, "give a ratio above 1")
        slip = checked_number("breakdown_slip", self.breakdown_slip, "give a slip between 0 and 1")
        if ratio <= 1.0:
            raise InputError("breakdown_ratio", self.breakdown_ratio, "give a ratio above 1")
        if not 0.0 < slip < 1.0:
            raise InputError("breakdown_slip", self.breakdown_slip, "give a slip between 0 and 1")
        object.__setattr__(self, "breakdown_ratio", ratio)
        object.__setattr__(self, "breakdown_slip", slip)

    @property
    def rated_slip(self) -> float:
        """Slip at the rated torque, on the stable side of the curve."""
        ratio = self.breakdown_ratio
        return self.breakdown_slip * (ratio - math.sqrt(ratio * ratio - 1.0))

    @property
    def rated_speed(self) -> float:
        """Speed at the rated torque in rad/s."""
        return self.synchronous_speed * (1.0 - self.rated_slip)

    @property
    def rated_torque(self) -> float:
        """Rated torque in N m."""
        return self.largest_torque / self.breakdown_ratio

    @property
    def largest_torque(self) -> float:
        """Breakdown torque in N m, given or from the rated power."""
        if self.breakdown_torque is not None:
            return self.breakdown_torque
        return self.breakdown_ratio * float(self.rated_power or 0.0) / self.rated_speed

    @property
    def power(self) -> float:
        """Rated power in W, given or from the breakdown torque."""
        return self.rated_torque * self.rated_speed

    def torque(self, speed: ArrayLike) -> NDArray[np.float64]:
        """Torque in N m at speeds of the motor in rad/s; negative above the synchronous one."""
        slip = 1.0 - _speeds("speed", speed) / self.synchronous_speed
        s_b = self.breakdown_slip
        return np.asarray(2.0 * self.largest_torque * slip * s_b / (slip**2 + s_b**2))


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

    def __post_init__(self) -> None:
        if self.motor is not None:
            checked_kind("motor", self.motor, Motor, "give an ff.Motor, or None: switched off")
        for name in ("inertia", "ratio"):
            object.__setattr__(self, name, checked_positive(name, getattr(self, name)))
        for name in ("friction", "viscous_friction"):
            object.__setattr__(self, name, checked_at_least_zero(name, getattr(self, name)))
        words = checked_all("assumed", self.assumed, str, "give a tuple of sentences")
        object.__setattr__(self, "assumed", words)

    @property
    def synchronous_speed(self) -> float | None:
        """Speed of the shaft in rad/s at which the motor gives no torque; None without motor."""
        return None if self.motor is None else self.motor.synchronous_speed / self.ratio

    @property
    def rated_speed(self) -> float | None:
        """Speed of the shaft in rad/s at the motor's rated torque; None without motor."""
        return None if self.motor is None else self.motor.rated_speed / self.ratio

    def torque(self, speed: ArrayLike) -> NDArray[np.float64]:
        """Torque of the motor at the shaft in N m at speeds of the shaft in rad/s."""
        speeds = _speeds("speed", speed)
        if self.motor is None:
            return np.zeros(speeds.shape)
        return np.asarray(self.ratio * self.motor.torque(self.ratio * speeds))

    def friction_torque(self, speed: ArrayLike) -> NDArray[np.float64]:
        """Friction in N m at speeds of the shaft in rad/s, against the motion."""
        speeds = _speeds("speed", speed)
        return np.asarray(self.friction * np.sign(speeds) + self.viscous_friction * speeds)

    def switched_off(self) -> Self:
        """Return the same shaft without motor."""
        left = tuple(word for word in self.assumed if word.startswith(("inertia", "friction")))
        return replace(self, motor=None, assumed=left)


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


def _speeds(name: str, values: ArrayLike) -> NDArray[np.float64]:
    return checked_numbers(name, values, "give finite speeds in rad/s")


def _row(name: str, values: object) -> tuple[float, ...]:
    remedy = "give finite numbers in one row"
    row = checked_numbers(name, values, remedy)
    if row.ndim != 1:
        raise InputError(name, values, remedy)
    return tuple(row.tolist())


def assumed_drive(
    eccentric_moment: float, speed: float, power: float, given: Mapping[str, float] | None = None
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
        Any of ``synchronous_speed``, ``breakdown_ratio``, ``breakdown_slip``, ``ratio``,
        ``inertia``, ``friction``, ``viscous_friction``, in SI.
    """
    known = dict(given or {})
    words = []

    def take(name: str, value: float, sentence: str) -> float:
        if name not in known:
            words.append(sentence)
        return known.get(name, value)

    motor = Motor(
        rated_power=power,
        synchronous_speed=take(
            "synchronous_speed", SYNCHRONOUS_SPEED, "motor of 4 poles at 50 Hz, 1500 rpm"
        ),
        breakdown_ratio=take(
            "breakdown_ratio", BREAKDOWN_RATIO, f"breakdown torque {BREAKDOWN_RATIO:g} times rated"
        ),
        breakdown_slip=take("breakdown_slip", BREAKDOWN_SLIP, f"breakdown slip {BREAKDOWN_SLIP:g}"),
    )
    inertia = 2.0 * eccentric_moment * UNBALANCE_RADIUS
    return Drive(
        motor=motor,
        ratio=take(
            "ratio", motor.rated_speed / speed, "belt ratio for rated speed at working speed"
        ),
        inertia=take(
            "inertia", inertia,
            f"inertia {inertia:.3g} kg m^2, twice that of the unbalance at {UNBALANCE_RADIUS:g} m",
        ),
        friction=take(
            "friction", FRICTION_SHARE * power / speed,
            f"friction torque {100.0 * FRICTION_SHARE:.0f} % of rated torque",
        ),
        viscous_friction=known.get("viscous_friction", 0.0),
        assumed=tuple(words),
    )  # fmt: skip
