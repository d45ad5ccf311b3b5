"""Words and numbers in sentences: significant digits, and no exponent for what is large."""

from __future__ import annotations

import math
import re

from flipflow.model.constants import RPM

OWN_WORD = re.compile(r"(load )?case\b", re.IGNORECASE)


def capitalized(words: str) -> str:
    """Words as a sentence begins: the first letter large, all others as they are."""
    return words[:1].upper() + words[1:]


def case_words(name: str, *, capital: bool = False) -> str:
    """Write "case hot" for "hot"; a name such as "case 29" has the word already."""
    words = name if OWN_WORD.match(name) else f"case {name}"
    return capitalized(words) if capital else words


def digits(value: float, count: int = 3) -> str:
    """``count`` significant digits without zeros at the end; large numbers are whole.

    1207.3 is "1207" and never "1.21e+03", so that one number reads alike everywhere.
    """
    if math.isfinite(value) and abs(value) >= 10.0**count - 0.5:
        return f"{value:.0f}"
    return f"{value:.{count}g}"


def rpm(omega: float) -> str:
    """A speed in rpm, four significant digits."""
    value = omega * RPM
    return f"{value:.0f}" if value >= 999.95 else f"{value:.4g}"


def span(low: float, high: float) -> str:
    """A range of speeds in rpm, Hz and rad/s."""
    hertz = [f"{omega / (2.0 * math.pi):.4g}" for omega in (low, high)]
    return (
        f"{rpm(low)} to {rpm(high)} rpm ({hertz[0]} to {hertz[1]} Hz, "
        f"{low:.4g} to {high:.4g} rad/s)"
    )
