"""How a periodic motion is computed: small, validated options."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flipflow.errors import InputError

MOST_HARMONICS = 200
MOST_POINTS = 5000
MOST_SAMPLES = 2**17


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


@dataclass(frozen=True)
class SampledHarmonicBalance:
    """Fourier series with a smooth contact law sampled at fixed times: to reproduce others only.

    The paper's Eq. (3) replaces the switch at the gap by tanh(sharpness (x2 - e)), and the usual
    alternating frequency-time scheme samples it. Between two samples the motion passes the layer
    in which the law switches, of a few 1 / sharpness, unseen, and the force jumps when a sample
    enters it. The branch then shows turning points that the machine does not have, or stalls,
    which its ``status`` says. Every use gives a
    :class:`~flipflow.errors.SampledContactWarning`; take :class:`HarmonicBalance` for an answer.

    Parameters
    ----------
    harmonics
        H, the highest harmonic kept; 3 is the paper's.
    samples
        N, number of samples in a turn; more than 4 H.
    sharpness
        eps in 1/m; 1e6 is the paper's.
    points
        The longest step in omega is the interval divided by this number.

    Raises
    ------
    InputError
        For a number out of range.
    """

    harmonics: int = 3
    samples: int = 1024
    sharpness: float = 1e6
    points: int = 300

    def __post_init__(self) -> None:
        _check_count("harmonics", self.harmonics, MOST_HARMONICS)
        _check_count("samples", self.samples, MOST_SAMPLES)
        _check_count("points", self.points, MOST_POINTS)
        if self.samples <= 4 * self.harmonics:
            remedy = f"give more than four samples a harmonic, {4 * self.harmonics + 1} or more"
            raise InputError("samples", self.samples, remedy)
        if not (isinstance(self.sharpness, (int, float)) and 0.0 < self.sharpness < math.inf):
            raise InputError("sharpness", self.sharpness, "give a finite number above 0, in 1/m")


Method = PiecewiseExact | HarmonicBalance | SampledHarmonicBalance


def _check_count(name: str, value: object, most: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= most:
        raise InputError(name, value, f"give a whole number from 1 to {most}")
