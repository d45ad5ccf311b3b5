"""Numbers as a report shows them: three to four significant digits, with their unit.

What is shown knows the number that it shows, which a table for other programs takes.
"""

from __future__ import annotations

import math
from typing import Self

from flipflow.io.units import in_unit
from flipflow.model.constants import RPM
from flipflow.model.limits import Limits, limit_bounds
from flipflow.model.numerals import digits, rpm
from flipflow.model.quantities import QUANTITIES, Quantity

NOTHING, NO_JUMP = "-", "no jump"
LEAST_KILO = 100.0  # N or W; what is less is shown without kilo


class Numeral(str):
    """A text that shows one number, or the two ends of a range, and knows them."""

    __slots__ = ("numbers", "unit")

    numbers: tuple[float | None, ...]  # in ``unit``; None: a range without that end
    unit: str

    def __new__(cls, text: str, *numbers: float | None, unit: str = "") -> Self:
        """The text, and what it shows."""
        made = super().__new__(cls, text)
        made.numbers, made.unit = numbers, unit
        return made


def number(value: float) -> str:
    """Three significant digits for a sentence; from 1000 on whole numbers."""
    if not math.isfinite(value):
        return "infinite" if value > 0.0 else NOTHING
    if value == 0.0 or abs(value) >= 99.95:
        return f"{value:.0f}"
    text = f"{value:#.3g}"
    return text if "e" in text else text.rstrip(".")


def three_digits(value: float) -> str:
    """The digits of :func:`number` for a table."""
    return Numeral(number(value), value) if math.isfinite(value) else number(value)


def written(value: float, form: str) -> str:
    """A number in a format of Python; nothing where it is not one."""
    return Numeral(format(value, form), value) if math.isfinite(value) else NOTHING


def four_digits(value: float) -> str:
    """Four significant digits, zeros at the end too, so that a column of numbers is even."""
    return written(value, ".0f" if abs(value) >= 999.95 else "#.4g")


def in_rpm(omega: float | None, *, with_unit: bool = False) -> str:
    """A speed in rpm."""
    if omega is None or math.isnan(omega):
        return NOTHING
    return Numeral(f"{rpm(omega)}{' rpm' * with_unit}", omega * RPM, unit="rpm")


def span_of(low: str, high: str) -> str:
    """From one number to another of the same unit."""
    text = f"{low} to {high}"
    if not (isinstance(low, Numeral) and isinstance(high, Numeral)):
        return text
    return Numeral(text, *low.numbers, *high.numbers, unit=low.unit)


def quantity(value: float | None, shown_unit: str, unit: str, *, with_unit: bool = True) -> str:
    """An SI value in the unit to show."""
    if value is None or math.isnan(value):
        return NOTHING
    if math.isinf(value):
        return number(value)
    small = with_unit and shown_unit == f"k{unit}" and 0.0 < abs(value) < LEAST_KILO
    told = unit if small else shown_unit
    text = number(in_unit(value, told, unit))
    text = f"{text} {told}".strip() if with_unit else text
    # What is small is told without kilo; in a column every number has the same unit.
    return Numeral(text, in_unit(value, shown_unit, unit), unit=shown_unit)


def named(one: Quantity, value: float | None, *, with_unit: bool = True) -> str:
    """The value of a quantity; a margin to a jump that does not exist says so."""
    if one.name == "jump_margin" and value is not None and math.isinf(value):
        return NO_JUMP
    return quantity(value, one.shown_unit, one.unit, with_unit=with_unit)


def speed(omega: float) -> str:
    """A speed in rpm, Hz and rad/s."""
    return f"{rpm(omega)} rpm ({in_unit(omega, 'Hz', 'rad/s'):.4g} Hz, {omega:.4g} rad/s)"


def bounds(low: float, high: float, shown_unit: str, unit: str) -> str:
    """A limit in words: "5 to 8 mm", "at most 3 g", "at least 20 %"."""
    ends = [in_unit(end, shown_unit, unit) if math.isfinite(end) else None for end in (low, high)]
    told = [digits(end, 4) for end in ends if end is not None]
    if not told:
        return NOTHING
    word = "at least " if ends[1] is None else "at most " if ends[0] is None else ""
    return Numeral(f"{word}{' to '.join(told)} {shown_unit}".strip(), *ends, unit=shown_unit)


def allowed(limits: Limits, name: str) -> str:
    """What limits allow of a registered quantity, in words."""
    one = QUANTITIES[name]
    return bounds(*limit_bounds(limits, name), one.shown_unit, one.unit)


def percent(share: float | None) -> str:
    """A margin with its sign; where there is no end to be near to, nothing."""
    if share is None or not math.isfinite(share):
        return NOTHING
    return Numeral(f"{signed(100.0 * share)} %", 100.0 * share, unit="%")


def signed(value: float) -> str:
    """Three significant digits with a sign."""
    if not math.isfinite(value):
        return NOTHING
    return Numeral(f"{'+' * (value > 0.0)}{number(value)}", value)


def multiplier(value: complex) -> str:
    """A Floquet multiplier; of a conjugate pair the upper one stands for both."""
    if abs(value.imag) < 1e-9 * max(abs(value), 1e-9):
        return f"{value.real:.4g}"
    return f"{value.real:.4g} ± {abs(value.imag):.4g}i"
