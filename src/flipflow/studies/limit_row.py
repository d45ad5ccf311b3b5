"""One limit of a machine file against what was found, in all load cases."""

from __future__ import annotations

import math
from dataclasses import dataclass

PASS, ATTENTION, FAIL, NOT_CHECKED = "pass", "attention", "fail", "not checked"
CLOSE = 0.05
NO_LIMIT = (-math.inf, math.inf)


@dataclass(frozen=True)
class LimitRow:
    """One limit over all load cases.

    Parameters
    ----------
    name, label, unit, shown_unit
        Limit, its words, SI unit and unit to show.
    limit
        (least, most) in SI; infinite where there is no such end.
    worst
        The value nearest to or farthest beyond the limit, SI; None when not checked.
    case
        The load case in which it occurs.
    margin
        Distance from the limit as a share of the limit; negative when it is broken.
    state
        "pass", "attention" (met, but within 5 %), "fail" or "not checked".
    reason
        Why it was not checked.
    """

    name: str
    label: str
    unit: str
    shown_unit: str
    limit: tuple[float, float]
    worst: float | None = None
    case: str = ""
    margin: float | None = None
    state: str = NOT_CHECKED
    reason: str = ""


def relative_margin(value: float, low: float, high: float) -> float:
    """Distance from the nearer end as a share of that end; negative beyond it."""
    to_low = (value - low) / abs(low) if math.isfinite(low) and low != 0.0 else math.inf
    to_high = (high - value) / abs(high) if math.isfinite(high) and high != 0.0 else math.inf
    return min(to_low, to_high)
