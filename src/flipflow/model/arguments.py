"""Arguments of the public face, checked: a sentence with field, value and remedy, or the value."""

from __future__ import annotations

import math
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow.errors import InputError

Real = NDArray[np.float64]
OMEGA_MOST = 1e6


def is_number(value: object) -> bool:
    """Whether a value is one real number; a boolean is none."""
    numbers = (int, float, np.integer, np.floating)
    return isinstance(value, numbers) and not isinstance(value, bool)


def checked_positive(name: str, value: object, unit: str) -> float:
    """A finite number above 0."""
    if not is_number(value) or not 0.0 < cast("float", value) < math.inf:
        raise InputError(name, value, f"give a finite number above 0 {unit}")
    return float(cast("float", value))


def checked_speed(omega: object) -> float:
    """One frequency in rad/s."""
    if not is_number(omega) or not math.isfinite(cast("float", omega)):
        raise InputError("omega", omega, "give a finite frequency above 0 rad/s")
    if not 0.0 < cast("float", omega) <= OMEGA_MOST:
        most = f"{OMEGA_MOST:g} rad/s"
        remedy = f"no screen runs above {most}; give a frequency above 0 and up to {most}"
        raise InputError("omega", omega, remedy)
    return float(cast("float", omega))


def checked_speeds(omega: ArrayLike) -> Real:
    """Frequencies in rad/s, (n,)."""
    try:
        speeds = np.atleast_1d(np.asarray(omega, float))
    except (TypeError, ValueError):
        raise InputError("omega", omega, "give an array of frequencies in rad/s") from None
    if speeds.ndim != 1 or speeds.size == 0:
        raise InputError("omega", omega, "give at least one frequency in rad/s, in one row")
    if not (np.isfinite(speeds).all() and (speeds > 0.0).all()):
        raise InputError("omega", omega, "give finite frequencies above 0 rad/s")
    if speeds.max() > OMEGA_MOST:
        raise InputError("omega", omega, f"no screen runs above {OMEGA_MOST:g} rad/s")
    return speeds


def checked_count(name: str, value: object, most: int, *, least: int = 1) -> int:
    """A whole number from ``least`` to ``most``."""
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not whole or not least <= cast("int", value) <= most:
        raise InputError(name, value, f"give a whole number from {least} to {most}")
    return int(cast("int", value))


def checked_generator(rng: object) -> np.random.Generator:
    """The generator itself, or one of a seed."""
    try:
        return np.random.default_rng(rng)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise InputError("rng", rng, "give a whole number of at least 0, or a Generator") from None


def check_interval(omega: object) -> tuple[float, float]:
    """The interval (low, high) in rad/s, or a sentence that says what is wrong with it."""
    try:
        low, high = (float(x) for x in cast("tuple[float, float]", omega))
    except (TypeError, ValueError):
        raise InputError("omega", omega, "give an interval (low, high) in rad/s") from None
    if not (math.isfinite(low) and math.isfinite(high) and low > 0.0):
        raise InputError("omega", omega, "give two finite speeds above 0 rad/s")
    if high <= low:
        raise InputError(
            "omega", omega, "the interval is empty or reversed; give the lower end first"
        )
    if high > OMEGA_MOST:
        raise InputError("omega", omega, f"no screen runs above {OMEGA_MOST:g} rad/s")
    return low, high
