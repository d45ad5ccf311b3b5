"""An induction motor: torque over speed from a few ratios, or from a table."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow.errors import InputError
from flipflow.model.arguments import checked_number, checked_numbers, checked_positive
from flipflow.model.torque_curve import (
    NO_PIECES,
    TorqueCurve,
    cage_curve,
    rated_point,
    table_curve,
)

BREAKDOWN_RATIO, BREAKDOWN_SLIP = 2.5, 0.2
Row = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Motor:
    r"""An induction motor on the mains.

    From breakdown to synchronous speed the torque is Kloss' formula: with slip
    :math:`s = 1 - \Omega / \Omega_s`

    .. math:: T = \frac{2 T_b}{s / s_b + s_b / s} .

    Below, it is Kloss' formula, too, which understates a cage motor; with a starting torque, and
    a pull-up torque, cubics that are level there and at breakdown; with a table, straight lines.

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
    starting_ratio
        Torque at standstill over rated torque; None: as Kloss' formula has it.
    pull_up_ratio
        Least torque on the way up over rated torque, at a quarter of the speed at breakdown;
        needs the starting torque.
    torque_table
        Rows (speed of the motor in rad/s, torque over rated torque) from standstill on, instead of
        all ratios and slips; needs the rated power.

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
    starting_ratio: float | None = None
    pull_up_ratio: float | None = None
    torque_table: tuple[Row, ...] = ()

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
        self._check_way_up(ratio)
        object.__setattr__(self, "torque_table", self._checked_table())

    def _check_way_up(self, breakdown: float) -> None:
        for name in ("starting_ratio", "pull_up_ratio"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, checked_positive(name, getattr(self, name)))
        if self.pull_up_ratio is None:
            return
        if self.starting_ratio is None:
            raise InputError("pull_up_ratio", self.pull_up_ratio, "give starting_ratio with it")
        if self.pull_up_ratio > min(self.starting_ratio, breakdown):
            remedy = "it is the least torque on the way up, give at most the starting torque's"
            raise InputError("pull_up_ratio", self.pull_up_ratio, remedy)

    def _checked_table(self) -> tuple[Row, ...]:
        rows = checked_torque_table("torque_table", self.torque_table)
        if rows and self.breakdown_torque is not None:
            raise InputError("breakdown_torque", self.breakdown_torque, TABLE_NEEDS_POWER)
        if rows and rows[-1][0] > self.synchronous_speed:
            remedy = "end at the synchronous speed, where there is no torque"
            raise InputError("torque_table", rows[-1][0], remedy)
        if rows and rated_point(self._all_rows(rows), None) is None:
            raise InputError("torque_table", rows, "let it fall through 1, the rated torque")
        return rows

    def _all_rows(self, rows: tuple[Row, ...]) -> NDArray[np.float64]:
        """The rows of the table, with that of the synchronous speed."""
        last = () if rows[-1][0] == self.synchronous_speed else ((self.synchronous_speed, 0.0),)
        return np.array([*rows, *last])

    @property
    def rated_slip(self) -> float:
        """Slip at the rated torque, on the stable side of the curve."""
        if self.torque_table:
            point = rated_point(self._all_rows(self.torque_table), None)
            return 1.0 - cast("Row", point)[0] / self.synchronous_speed
        ratio = self.breakdown_ratio
        return self.breakdown_slip * (ratio - math.sqrt(ratio * ratio - 1.0))

    @property
    def rated_speed(self) -> float:
        """Speed at the rated torque in rad/s."""
        return self.synchronous_speed * (1.0 - self.rated_slip)

    @property
    def rated_torque(self) -> float:
        """Rated torque in N m."""
        if self.breakdown_torque is not None:
            return self.breakdown_torque / self.breakdown_ratio
        return float(self.rated_power or 0.0) / self.rated_speed

    @property
    def largest_torque(self) -> float:
        """Breakdown torque in N m, given, from the rated power or from the table."""
        if self.breakdown_torque is not None:
            return self.breakdown_torque
        ratios = [row[1] for row in self.torque_table] or [self.breakdown_ratio]
        return max(ratios) * self.rated_torque

    @property
    def breakdown_speed(self) -> float:
        """Speed at the largest torque in rad/s: beyond it, more load means a little less speed."""
        if self.torque_table:
            return max(self.torque_table, key=lambda row: (row[1], row[0]))[0]
        return self.synchronous_speed * (1.0 - self.breakdown_slip)

    @property
    def power(self) -> float:
        """Rated power in W, given or from the breakdown torque."""
        return self.rated_torque * self.rated_speed

    @cached_property
    def curve(self) -> TorqueCurve:
        """Torque in N m over speed in rad/s where it is not Kloss' formula."""
        if self.torque_table:
            rows = np.array(self.torque_table) * [1.0, self.rated_torque]
            return table_curve(rows, self.synchronous_speed)
        if self.starting_ratio is None:
            return NO_PIECES
        way = cage_curve(
            self.starting_ratio, self.pull_up_ratio, self.breakdown_ratio, self.breakdown_speed
        )
        return way.scaled(self.rated_torque, 1.0)

    def torque(self, speed: ArrayLike) -> NDArray[np.float64]:
        """Torque in N m at speeds of the motor in rad/s; negative above the synchronous one."""
        speeds = checked_speeds_of("speed", speed)
        slip = 1.0 - speeds / self.synchronous_speed
        s_b = self.breakdown_slip
        kloss = 2.0 * self.largest_torque * slip * s_b / (slip**2 + s_b**2)
        return np.where(speeds < self.curve.end, self.curve.torque(speeds), kloss)


TABLE_NEEDS_POWER = "give the rated power with a torque table"


def checked_torque_table(name: str, rows: object) -> tuple[Row, ...]:
    """Rows (speed, torque above 0) from standstill on, rising in speed; none is a table, too."""
    remedy = "give rows (speed, torque) from standstill on, rising in speed, torques above 0"
    table = checked_numbers(name, rows, remedy)
    if table.size == 0:
        return ()
    good = table.ndim == 2 and table.shape[1] == 2 and table.shape[0] > 1
    if not good or table[0, 0] != 0.0 or (np.diff(table[:, 0]) <= 0.0).any():
        raise InputError(name, rows, remedy)
    if (table[:-1, 1] <= 0.0).any() or table[-1, 1] < 0.0:
        raise InputError(name, rows, remedy)
    return tuple((float(speed), float(torque)) for speed, torque in table)


def checked_speeds_of(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Speeds in rad/s, all finite."""
    return checked_numbers(name, values, "give finite speeds in rad/s")
