"""Numbers as a report shows them: three to four significant digits, with their unit."""

from __future__ import annotations

import math

from flipflow.io.units import in_unit
from flipflow.model.limits import Limits, limit_bounds
from flipflow.model.numerals import digits, rpm
from flipflow.model.quantities import QUANTITIES, Quantity

NOTHING, NO_JUMP = "-", "no jump"
LEAST_KILO = 100.0  # N or W; what is less is shown without kilo


def number(value: float) -> str:
    """Three significant digits; from 1000 on whole numbers."""
    if not math.isfinite(value):
        return "infinite" if value > 0.0 else NOTHING
    if value == 0.0 or abs(value) >= 99.95:
        return f"{value:.0f}"
    text = f"{value:#.3g}"
    return text if "e" in text else text.rstrip(".")


def four_digits(value: float) -> str:
    """Four significant digits, zeros at the end too, so that a column of numbers is even."""
    return f"{value:.0f}" if abs(value) >= 999.95 else f"{value:#.4g}"


def quantity(value: float | None, shown_unit: str, unit: str, *, with_unit: bool = True) -> str:
    """An SI value in the unit to show."""
    if value is None or math.isnan(value):
        return NOTHING
    if with_unit and shown_unit == f"k{unit}" and 0.0 < abs(value) < LEAST_KILO:
        shown_unit = unit
    if math.isinf(value):
        return number(value)
    text = number(in_unit(value, shown_unit, unit))
    return f"{text} {shown_unit}".strip() if with_unit else text


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

    def end(value: float) -> str:
        return digits(in_unit(value, shown_unit, unit), 4)

    if math.isfinite(low) and math.isfinite(high):
        return f"{end(low)} to {end(high)} {shown_unit}".strip()
    if math.isfinite(high):
        return f"at most {end(high)} {shown_unit}".strip()
    return f"at least {end(low)} {shown_unit}".strip() if math.isfinite(low) else NOTHING


def allowed(limits: Limits, name: str) -> str:
    """What limits allow of a registered quantity, in words."""
    one = QUANTITIES[name]
    return bounds(*limit_bounds(limits, name), one.shown_unit, one.unit)


def percent(share: float | None) -> str:
    """A margin with its sign; where there is no end to be near to, nothing."""
    if share is None:
        return NOTHING
    if not math.isfinite(share):
        return NOTHING
    return f"{'+' if share > 0.0 else ''}{number(100.0 * share)} %"


def multiplier(value: complex) -> str:
    """A Floquet multiplier; of a conjugate pair the upper one stands for both."""
    if abs(value.imag) < 1e-9 * max(abs(value), 1e-9):
        return f"{value.real:.4g}"
    return f"{value.real:.4g} ± {abs(value.imag):.4g}i"
