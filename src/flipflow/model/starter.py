"""How a motor is put on the mains: at once, in star and then delta, or behind a converter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import NoneType

from flipflow.errors import InputError
from flipflow.model.arguments import checked_positive

STAR_TORQUE = 1.0 / 3.0  # share of its torque that a motor gives in star


@dataclass(frozen=True, kw_only=True)
class StarDelta:
    """The motor starts in star, with a third of its torque, and is switched over to delta.

    Parameters
    ----------
    speed
        Speed of the motor in rad/s at which it is switched over; or give ``time``.
    time
        Time in s after which it is switched over.

    Raises
    ------
    InputError
        Unless exactly one of the two is given, above 0.
    """

    speed: float | None = None
    time: float | None = None

    def __post_init__(self) -> None:
        if (self.speed is None) == (self.time is None):
            raise InputError("switch_over", self.speed, "give either a speed or a time")
        for name in ("speed", "time"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, checked_positive(name, getattr(self, name)))


@dataclass(frozen=True, kw_only=True)
class Converter:
    r"""A frequency converter: the field's speed rises evenly, the torque follows the slip.

    With the rated torque :math:`T_r` at the rated slip :math:`\Omega_r`, the field's speed
    :math:`\Omega_f` and the motor's :math:`\Omega`,

    .. math:: T = T_r (\Omega_f - \Omega) / \Omega_r, \quad |T| \le T_\mathrm{max} .

    Parameters
    ----------
    ramp
        Rise of the field's speed at the motor in rad/s^2.
    torque_limit
        Largest torque over the rated one.
    end_speed
        Speed of the field at the motor in rad/s at which the ramp ends; None: such that the shaft
        settles at working speed, or the motor's synchronous speed where that is not known.

    Raises
    ------
    InputError
        For values that are not finite and above 0.
    """

    ramp: float
    torque_limit: float = 1.5
    end_speed: float | None = None

    def __post_init__(self) -> None:
        for name in ("ramp", "torque_limit", "end_speed"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, checked_positive(name, getattr(self, name)))


Starter = StarDelta | Converter
STARTS: Mapping[type, str] = {
    NoneType: "direct", StarDelta: "star-delta", Converter: "converter",
}  # fmt: skip
