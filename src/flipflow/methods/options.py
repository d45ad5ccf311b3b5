"""How a periodic motion is computed: small, validated options."""

from __future__ import annotations

from dataclasses import dataclass

from flipflow.errors import InputError

MOST_HARMONICS = 200
MOST_POINTS = 5000


@dataclass(frozen=True)
class PiecewiseExact:
    """Closed form between contacts, periodic motion by shooting: exact up to rounding.

    Parameters
    ----------
    points
        The longest step in omega is the interval divided by this number; steps shorten by
        themselves where the branch bends or a contact begins.
    """

    points: int = 300

    def __post_init__(self) -> None:
        _check_count("points", self.points, MOST_POINTS)


@dataclass(frozen=True)
class HarmonicBalance:
    """Fourier series up to a given harmonic, the contact force integrated exactly.

    Parameters
    ----------
    harmonics
        H, the highest harmonic kept; 3 is the paper's.
    points
        The longest step in omega is the interval divided by this number.
    """

    harmonics: int = 3
    points: int = 300

    def __post_init__(self) -> None:
        _check_count("harmonics", self.harmonics, MOST_HARMONICS)
        _check_count("points", self.points, MOST_POINTS)


Method = PiecewiseExact | HarmonicBalance


def _check_count(name: str, value: object, most: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= most:
        raise InputError(name, value, f"give a whole number from 1 to {most}")
