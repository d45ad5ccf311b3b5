"""How a periodic motion is computed: small, validated options."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

from flipflow.errors import InputError
from flipflow.model.arguments import checked_count, checked_kind, checked_positive

MOST_HARMONICS = 200  # highest harmonic that may be asked for
MOST_POINTS = 5000  # steps of full length into which an interval may be divided
MOST_SAMPLES = 2**17  # samples of the contact force in a turn


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
        _keep_counts(self, points=MOST_POINTS)


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
        _keep_counts(self, harmonics=MOST_HARMONICS, points=MOST_POINTS)


@dataclass(frozen=True)
class SampledHarmonicBalance:
    """Fourier series with a smooth contact law sampled at fixed times: to reproduce others only.

    The paper's Eq. (3) replaces the switch at the gap by tanh(sharpness (x2 - e)), and the usual
    alternating frequency-time scheme samples it. Between two samples the motion crosses, unseen,
    the layer in which the law switches, a few 1 / sharpness thick; the force jumps when a sample
    enters the layer. The branch then shows turning points that the machine does not have, or
    stalls, which its ``status`` says. Every use gives a
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
        _keep_counts(self, harmonics=MOST_HARMONICS, samples=MOST_SAMPLES, points=MOST_POINTS)
        if self.samples <= 4 * self.harmonics:
            remedy = f"give more than four samples a harmonic, {4 * self.harmonics + 1} or more"
            raise InputError("samples", self.samples, remedy)
        sharpness = checked_positive("sharpness", self.sharpness, "in 1/m")
        object.__setattr__(self, "sharpness", sharpness)


Method = PiecewiseExact | HarmonicBalance | SampledHarmonicBalance


def checked_method(method: object) -> Method:
    """The method itself; where none is given the exact one."""
    if method is None:
        return PiecewiseExact()
    remedy = "give ff.PiecewiseExact() or ff.HarmonicBalance(3)"
    kinds = (PiecewiseExact, HarmonicBalance, SampledHarmonicBalance)
    return cast("Method", checked_kind("method", method, kinds, remedy))


def _keep_counts(options: Method, **most: int) -> None:
    """Check whole numbers of an option from 1 to the most allowed, and keep them as int."""
    for name, limit in most.items():
        count = checked_count(name, getattr(options, name), limit)
        object.__setattr__(options, name, count)
