"""The errors flipflow raises, each with the exit code of the command line."""

from __future__ import annotations

import importlib
import numbers
import reprlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, ClassVar, cast

WIDTH = 60  # characters of a value that a sentence shows
PLAIN = (type(None), bool, int, float, complex, str, bytes)


class FlipflowError(Exception):
    """Base of every error that flipflow raises on purpose."""

    exit_code: ClassVar[int] = 1

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled and copied by what it holds: errors of a worker reach the process that waits."""
        state = {name: _portable(value) for name, value in self.__dict__.items()}
        return _revived, (type(self), self.args), state


def _revived(kind: type[FlipflowError], args: tuple[object, ...]) -> FlipflowError:
    """An error with its sentence as it stood; a constructor may take other arguments."""
    error = kind.__new__(kind, *args)
    super(FlipflowError, error).__init__(*args)
    return error


class Shown(str):
    """The words that a sentence shows of a value: one that cannot travel between processes."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


class InputError(FlipflowError, ValueError):
    """Bad input: one sentence that names the field, the value it got and the remedy.

    Parameters
    ----------
    field
        Name of the field as the user wrote it, for example ``"frames.main_mass"``.
    value
        What was given.
    remedy
        What is wrong with it and what would do, without a full stop.
    """

    exit_code = 2

    def __init__(self, field: str, value: object, remedy: str) -> None:
        self.field = field
        self.value = value
        self.remedy = remedy
        name = field if len(field) <= 2 * WIDTH else f"{field[: 2 * WIDTH - 3]}..."
        super().__init__(f"{name} = {_shown(value)}: {remedy}.")


@contextmanager
def as_written(field: str, written: object, more: str = "") -> Iterator[None]:
    """Let an input error name a field of the user and what was written there, then say ``more``."""
    try:
        yield
    except InputError as error:
        raise InputError(field, written, f"{error.remedy}{more}") from None


class IncompleteError(FlipflowError):
    """A calculation ended before it was finished; what was found is kept in its result."""

    exit_code = 3


class StoreError(FlipflowError):
    """A file or store could not be read or written."""

    exit_code = 4


class Cancelled(FlipflowError):  # noqa: N818  the field's word, fixed by the public face
    """The user stopped a long calculation."""

    exit_code = 130


class MissingExtra(FlipflowError, ImportError):  # noqa: N818  fixed by the public face
    """An optional dependency is not installed; the sentence says which extra to install."""

    exit_code = 2


def required(module: str, told: str, extra: str) -> Any:
    """An optional dependency, imported when it is needed.

    Parameters
    ----------
    module
        What is imported.
    told
        What needs it, in words that stand before "pip install".
    extra
        Which extra of flipflow brings it.

    Raises
    ------
    MissingExtra
        When it is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise MissingExtra(f"{told}: pip install 'flipflow[{extra}]'.") from error


class SampledContactWarning(UserWarning):
    """A contact force was sampled at fixed times: the answer reproduces that method, no more."""


class _Words(reprlib.Repr):
    """Shortened values: of a container the first few members, of a large array its ends."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlist = self.maxtuple = self.maxdict = self.maxset = self.maxfrozenset = 20
        self.maxstring = self.maxother = self.maxlong = 10 * WIDTH

    def repr_int(self, x: int, level: int) -> str:  # noqa: ARG002  as reprlib calls it
        """A whole number; Python refuses to write one of many thousand digits."""
        return _number(x)


_WORDS = _Words()


def _shown(value: object) -> str:
    """A value on one line, shortened."""
    if isinstance(value, Shown):
        text = str(value)
    elif isinstance(value, (str, bytes)):
        text = repr(value[:WIDTH])
    elif isinstance(value, numbers.Number):
        text = _number(value)
    else:
        text = " ".join(_WORDS.repr(value).split())
    return text if len(text) <= WIDTH else text[: WIDTH - 3] + "..."


def _number(value: object) -> str:
    """A number; of one with very many digits how many."""
    if isinstance(value, numbers.Integral) and abs(int(value)) >= 10**WIDTH:
        return f"a number of {int(value).bit_length() * 3 // 10} digits"
    if isinstance(value, numbers.Rational) and not isinstance(value, numbers.Integral):
        return f"{_number(value.numerator)}/{_number(value.denominator)}"
    return str(value)


def _portable(value: object) -> object:
    """What can be pickled wherever an error may go; anything else as it is shown."""
    known = type(value).__module__ in ("numpy", "fractions", "decimal")
    if type(value) in PLAIN or (known and isinstance(value, numbers.Number)):
        return value
    row = type(value) in (list, tuple)
    if row and all(type(one) in PLAIN for one in cast("Iterable[object]", value)):
        return value
    return Shown(_shown(value))
