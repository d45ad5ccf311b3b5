"""What may vary and how: the vocabulary of sensitivity, studies and design.

``vary`` maps a parameter of the machine to an interval, which is a tuple (low, high), an array or a
list of values that is sampled as it stands, :class:`Normal` or :class:`Choice`. Each becomes a
:class:`Variation`, which turns numbers between 0 and 1 into values of its field.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Real
from flipflow.errors import InputError
from flipflow.model.arguments import (
    checked_number,
    checked_numbers,
    checked_positive,
    checked_word,
    members_of,
)
from flipflow.model.fields import FIELD
from flipflow.model.parameters import named_parameter, with_values
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.system import Machine

Values = NDArray[np.float64] | NDArray[np.str_]
Vary = Mapping[str, object]
LAW = "stop_law"
TAIL = 0.025
REMEDY = (
    "give an interval as a tuple (low, high), values in a list or an array, ff.Normal(mean, std) "
    "or ff.Choice(values)"
)
VALUES = "give an array or a list of at least two finite numbers, shape (n,)"
WORDS = "give a list or ff.Choice of at least two words"


class Distribution(ABC):
    """How one field varies."""

    @abstractmethod
    def quantile(self, u: Real) -> Values:
        """Values at the shares ``u`` of the distribution, 0 to 1; any shape."""

    @property
    @abstractmethod
    def ends(self) -> tuple[object, object]:
        """The low and the high end that stand for the whole range in a one-at-a-time look."""

    @property
    @abstractmethod
    def checked(self) -> tuple[object, ...]:
        """Values that physics must allow for the distribution to make sense."""


@dataclass(frozen=True)
class Interval(Distribution):
    """Uniform between ``low`` and ``high``."""

    low: float
    high: float

    def quantile(self, u: Real) -> Values:
        """``low + u (high - low)``."""
        return self.low + u * (self.high - self.low)

    @property
    def ends(self) -> tuple[object, object]:
        """Both ends."""
        return self.low, self.high

    @property
    def checked(self) -> tuple[object, ...]:
        """Both ends."""
        return self.low, self.high


@dataclass(frozen=True)
class Normal(Distribution):
    """Normal distribution of a field, in SI.

    Values that physics forbids, such as a mass below 0, can be drawn where ``std`` is large; such
    samples count as failed.

    Parameters
    ----------
    mean, std
        Mean and standard deviation.

    Raises
    ------
    InputError
        For values that are not finite and for a deviation that is not above 0.
    """

    mean: float
    std: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "mean", checked_number("mean", self.mean))
        object.__setattr__(self, "std", checked_positive("std", self.std))

    def quantile(self, u: Real) -> Values:
        """``mean + std Phi^-1(u)``; shares of 0 and 1, which lie at infinity, are kept inside."""
        from scipy.special import ndtri  # noqa: PLC0415  slow to import

        smallest = 2.0**-33
        inside = np.clip(_shares(u), smallest, 1.0 - smallest)
        return np.asarray(self.mean + self.std * ndtri(inside))

    @property
    def ends(self) -> tuple[object, object]:
        """What 2.5 % of all values fall below and exceed."""
        low, high = self.quantile(np.array([TAIL, 1.0 - TAIL]))
        return float(low), float(high)

    @property
    def checked(self) -> tuple[object, ...]:
        """The mean alone: its tails may reach beyond what physics allows."""
        return (self.mean,)


@dataclass(frozen=True)
class Choice(Distribution):
    """One of several values, each as likely.

    Parameters
    ----------
    values
        At least two values of the field, in SI; words where the field holds a word.

    Raises
    ------
    InputError
        For fewer than two values, and for numbers mixed with words.
    """

    values: tuple[float, ...] | tuple[str, ...]

    def __post_init__(self) -> None:
        given = members_of(self.values)
        if given is None:
            remedy = "give at least two values, for example (6e-3, 8e-3)"
            raise InputError("values", self.values, remedy)
        remedy = "give at least two finite numbers, or words only"
        if len(given) < 2:
            raise InputError("values", self.values, remedy)
        words = all(isinstance(value, str) for value in given)
        kept = map(str, given) if words else (checked_number("values", v, remedy) for v in given)
        object.__setattr__(self, "values", tuple(kept))

    def quantile(self, u: Real) -> Values:
        """Value k of K for shares from k/K up to (k + 1)/K."""
        values = np.asarray(self.values)
        last = values.size - 1
        return values[np.minimum((_shares(u) * values.size).astype(np.int64), last)]

    @property
    def ends(self) -> tuple[object, object]:
        """The least and the greatest number; the first and the last word."""
        words = isinstance(self.values[0], str)
        order = self.values if words else sorted(self.values)
        return order[0], order[-1]

    @property
    def checked(self) -> tuple[object, ...]:
        """Every value."""
        return self.values


@dataclass(frozen=True)
class Variation:
    """A field of the machine and how it varies."""

    name: str
    distribution: Distribution


def variations(vary: Vary, machine: Machine) -> tuple[Variation, ...]:
    """The entries of ``vary``, checked against a machine, in the order given.

    Raises
    ------
    InputError
        For an unknown field, a range that is empty or not understood, and values that physics
        forbids.
    """
    if not isinstance(vary, Mapping) or not vary:
        raise InputError("vary", vary, 'map fields to ranges, {"clearance": (5.4e-3, 6.6e-3)}')
    one = _of_screen if isinstance(machine, FlipFlowScreen) else _of_machine
    return tuple(one(name, given, machine) for name, given in vary.items())


def _of_screen(name: str, given: object, screen: Machine) -> Variation:
    checked_word("vary", name, (*FIELD, LAW))
    distribution = _distribution(name, given)
    counted = name == LAW or FIELD[name].whole
    if counted and not isinstance(distribution, Choice):
        raise InputError(f"vary {name}", given, "it has no values between; give ff.Choice(values)")
    for value in distribution.checked:
        if name != LAW:
            FIELD[name].check(value, label=f"vary {name}")
        with_values(screen, {name: value})
    return Variation(name, distribution)


def _of_machine(name: str, given: object, machine: Machine) -> Variation:
    """A parameter of a machine that is no screen."""
    named_parameter(machine, name, "vary")
    distribution = _distribution(name, given)
    for value in distribution.checked:
        if isinstance(value, str):
            raise InputError(f"vary {name}", value, "give numbers")
        with_values(machine, {name: value})
    return Variation(name, distribution)


def _distribution(name: str, given: object) -> Distribution:
    if isinstance(given, Distribution):
        return given
    field = f"vary {name}"
    if isinstance(given, list) and name == LAW:
        if len(given) < 2 or not all(isinstance(one, str) for one in given):
            raise InputError(field, given, WORDS)
        return Choice(tuple(given))
    if isinstance(given, list):
        if len(given) < 2:
            raise InputError(field, given, VALUES)
        numbers = [checked_number(field, value, VALUES) for value in given]
        return _distribution(name, np.array(numbers))
    if isinstance(given, np.ndarray):
        if given.ndim != 1 or given.size < 2 or given.dtype.kind not in "iuf":
            raise InputError(field, given, VALUES)
        return Choice(tuple(sorted(float(value) for value in given)))
    if not isinstance(given, tuple) or len(given) != 2:
        raise InputError(field, given, REMEDY)
    low, high = (checked_number(field, value, REMEDY) for value in given)
    if not low < high:
        raise InputError(field, given, "the interval is empty or reversed; give (low, high)")
    return Interval(low, high)


def _shares(u: object) -> Real:
    remedy = "give shares of the distribution from 0 to 1"
    shares = checked_numbers("u", u, remedy)
    if ((shares < 0.0) | (shares > 1.0)).any():
        raise InputError("u", u, remedy)
    return shares
