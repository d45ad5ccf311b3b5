"""Numbers in sentences: significant digits, and never an exponent for what is large."""

from __future__ import annotations

import math


def digits(value: float, count: int = 3) -> str:
    """``count`` significant digits without zeros at the end; large numbers are whole.

    1207.3 is "1207" and never "1.21e+03", so that one number reads alike everywhere.
    """
    if math.isfinite(value) and abs(value) >= 10.0**count - 0.5:
        return f"{value:.0f}"
    return f"{value:.{count}g}"
