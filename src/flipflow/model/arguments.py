"""Arguments of the public face, checked: the value, or a sentence with field, value and remedy.

One vocabulary for every public name: what counts as a number, an array of numbers, a word, a
sequence, a callable is decided here and nowhere else. numpy's scalars and arrays without axes are
numbers; a boolean is none, and neither is a text that reads as one.
"""

from __future__ import annotations

import inspect
import math
import numbers
import os
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from types import FunctionType, MethodType
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Complex, Real
from flipflow.errors import InputError
from flipflow.model.monitor import Monitor, silent

Kind = TypeVar("Kind")
OMEGA_LEAST, OMEGA_MOST = 1e-9, 1e6
WITHIN = (
    f"no screen runs above {OMEGA_MOST:g} or below {OMEGA_LEAST:g} rad/s; give a frequency between"
)
# The square of a number beyond it overflows, and with it whatever is worked out from it.
LARGEST = 1e150
TOO_LARGE = f"no machine has a number beyond {LARGEST:g}; give a smaller one"
MOST_AXES = 64  # of an array of numpy
REAL_KINDS, COMPLEX_KINDS = "iuf", "iufc"


def real(value: object) -> float | None:
    """A real number as float, None for what is none or does not fit a float."""
    if type(value) is float:  # by far the most frequent, and the other questions are slow
        return value
    if isinstance(value, np.ndarray) and value.ndim == 0 and value.dtype.kind in REAL_KINDS:
        value = value[()]
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        return None
    try:
        return float(value)
    except OverflowError:
        return None


def checked_number(name: str, value: object, remedy: str = "give a finite number") -> float:
    """A finite number."""
    number = real(value)
    if number is None or not math.isfinite(number):
        raise InputError(name, value, remedy)
    if abs(number) > LARGEST:
        raise InputError(name, value, TOO_LARGE)
    return number


def checked_positive(name: str, value: object, unit: str = "") -> float:
    """A finite number above 0."""
    remedy = f"give a finite number above 0 {unit}".strip()
    number = checked_number(name, value, remedy)
    if number <= 0.0:
        raise InputError(name, value, remedy)
    return number


def checked_at_least_zero(name: str, value: object, unit: str = "") -> float:
    """A finite number of at least 0."""
    remedy = f"give a finite number of at least 0 {unit}".strip()
    number = checked_number(name, value, remedy)
    if number < 0.0:
        raise InputError(name, value, remedy)
    return number


def checked_speed(omega: object, name: str = "omega") -> float:
    """One frequency in rad/s."""
    number = checked_number(name, omega, "give a finite frequency above 0 rad/s")
    if number <= 0.0:
        raise InputError(name, omega, "give a finite frequency above 0 rad/s")
    if not OMEGA_LEAST <= number <= OMEGA_MOST:
        raise InputError(name, omega, WITHIN)
    return number


def checked_speeds(
    omega: object, remedy: str = "give at least one finite frequency above 0 rad/s, in one row"
) -> Real:
    """Frequencies in rad/s, one or a row, (n,)."""
    speeds = np.atleast_1d(checked_reals("omega", omega, remedy))
    if speeds.ndim != 1 or speeds.size == 0:
        raise InputError("omega", omega, remedy)
    if not (np.isfinite(speeds).all() and (speeds > 0.0).all()):
        raise InputError("omega", omega, remedy)
    if speeds.min() < OMEGA_LEAST or speeds.max() > OMEGA_MOST:
        raise InputError("omega", omega, WITHIN)
    return speeds


def refuse_pair(name: str, values: object) -> None:
    """A tuple of two is an interval elsewhere, and would here be two values: it is refused."""
    if isinstance(values, tuple) and len(values) == 2:
        low, high = values
        remedy = (
            f"a pair is an interval elsewhere; give an array, as np.linspace({low}, {high}, 21)"
        )
        raise InputError(name, values, remedy)


def checked_pair(name: str, value: object, remedy: str) -> tuple[float, float]:
    """Two numbers, infinite and missing ones too."""
    pair = checked_reals(name, value, remedy)
    if pair.shape != (2,):
        raise InputError(name, value, remedy)
    return float(pair[0]), float(pair[1])


def checked_interval(name: str, value: object) -> tuple[float, float]:
    """The interval (low, high) in rad/s."""
    low, high = checked_pair(name, value, "give an interval (low, high) in rad/s")
    if not (math.isfinite(low) and math.isfinite(high) and low > 0.0):
        raise InputError(name, value, "give two finite speeds above 0 rad/s")
    if high <= low:
        raise InputError(name, value, "the interval is empty or reversed; give the lower end first")
    if low < OMEGA_LEAST or high > OMEGA_MOST:
        raise InputError(name, value, WITHIN)
    return low, high


def checked_count(name: str, value: object, most: int, *, least: int = 1) -> int:
    """A whole number from ``least`` to ``most``."""
    number = _whole(value)
    if number is None or not least <= number <= most:
        raise InputError(name, value, f"give a whole number from {least} to {most}")
    return number


def checked_index(name: str, value: object, count: int, remedy: str, *, least: int = 0) -> int:
    """A whole number from ``least`` to below ``count``."""
    number = _whole(value)
    if number is None or not least <= number < count:
        raise InputError(name, value, remedy)
    return number


def checked_flag(name: str, value: object) -> bool:
    """True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(name, value, "give True or False")
    return bool(value)


def checked_numbers(name: str, value: object, remedy: str) -> Real:
    """Finite numbers of any shape as an array; texts and booleans are none."""
    array = checked_reals(name, value, remedy)
    _check_sizes(name, value, array, remedy)
    return array


def checked_reals(name: str, value: object, remedy: str) -> Real:
    """Real numbers of any shape as an array, infinite and missing ones too."""
    array = _array(name, value, remedy)
    if array.dtype == np.float64:
        return array
    if array.dtype.kind not in REAL_KINDS:
        raise InputError(name, value, remedy)
    with np.errstate(all="ignore"):
        return np.asarray(array, np.float64)


def checked_vector(name: str, value: object, remedy: str) -> Complex:
    """Finite numbers in one row, complex ones too, (n,)."""
    array = _array(name, value, remedy)
    if array.dtype.kind not in COMPLEX_KINDS or array.ndim != 1 or array.size == 0:
        raise InputError(name, value, remedy)
    with np.errstate(all="ignore"):
        array = np.asarray(array, np.complex128)
    _check_sizes(name, value, array.real, remedy)
    _check_sizes(name, value, array.imag, remedy)
    return array


def checked_generator(rng: object) -> np.random.Generator:
    """The generator itself, or one of a seed."""
    if isinstance(rng, np.random.Generator):
        return rng
    seed = _whole(rng)
    if seed is None or seed < 0:
        raise InputError("rng", rng, "give a whole number of at least 0, or a Generator")
    return np.random.default_rng(seed)


def checked_monitor(monitor: object) -> Monitor:
    """What is called with a sentence and a share; one that tells nobody where none is given."""
    if monitor is None:
        return silent
    if not takes(monitor, 2):
        remedy = "give a function that takes a sentence and the share done, or None"
        raise InputError("monitor", monitor, remedy)
    return cast("Monitor", monitor)


def takes(function: object, count: int) -> bool:
    """Whether something is a function, not a class, that can be called with ``count`` arguments."""
    if isinstance(function, type) or not callable(function):
        return False
    if isinstance(function, MethodType) and isinstance(function.__func__, FunctionType):
        return _binds_in_class(function.__func__, count + 1)
    return _binds(function, count)


def _binds(function: Callable[..., object], count: int) -> bool:
    # A function without ornament, asked for at every motion, need not wait for its signature.
    if type(function) is FunctionType and not (function.__dict__ or function.__kwdefaults__):
        code = function.__code__
        few = code.co_argcount - len(function.__defaults__ or ()) <= count
        many = count <= code.co_argcount or bool(code.co_flags & inspect.CO_VARARGS)
        return few and many and not code.co_kwonlyargcount
    try:
        inspect.signature(function).bind(*range(count))
    except (TypeError, ValueError):
        return False
    return True


# A machine's own ``system`` is looked at before every analysis, and a signature takes long to read.
_binds_in_class = lru_cache(256)(_binds)


def checked_word(name: str, value: object, words: Collection[str], remedy: str = "") -> str:
    """One of several words."""
    if not isinstance(value, str) or value not in words:
        raise InputError(name, value, remedy or f"choose one of {', '.join(words)}")
    return str(value)


def checked_text(name: str, value: object) -> str:
    """A text, empty or not."""
    if not isinstance(value, str):
        raise InputError(name, value, "give a text")
    return value


def checked_path(name: str, value: object) -> Path:
    """A path of a file, as text or as a path object."""
    if isinstance(value, (str, os.PathLike)):
        path = os.fspath(value)
        if isinstance(path, str):
            return Path(path)
    raise InputError(name, value, "give the path of a file, as text or as a Path")


def checked_kind(
    name: str, value: object, kind: type[Kind] | tuple[type[Kind], ...], remedy: str
) -> Kind:
    """An object of a kind."""
    if not isinstance(value, kind):
        raise InputError(name, value, remedy)
    return value


def checked_all(
    name: str, values: object, kind: type[Kind] | tuple[type[Kind], ...], remedy: str
) -> tuple[Kind, ...]:
    """A sequence whose members are all of a kind.

    An iterator is none: it can be read once, and may have no end.
    """
    members = members_of(values)
    if members is None or not all(isinstance(one, kind) for one in members):
        raise InputError(name, values, remedy)
    return members


def members_of(values: object) -> tuple[Any, ...] | None:
    """The members of a list, a tuple or the like; None for texts, mappings, iterators, others."""
    if isinstance(values, (list, tuple)):
        return tuple(values)
    if isinstance(values, (str, bytes, bytearray, memoryview, Mapping, type, Iterator)):
        return None
    if not isinstance(values, Collection) or (isinstance(values, np.ndarray) and values.ndim == 0):
        return None
    return tuple(values)


def checked_mapping(name: str, value: object, remedy: str) -> Mapping[str, Any]:
    """A mapping whose keys are texts."""
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise InputError(name, value, remedy)
    return value


def _check_sizes(name: str, value: object, array: NDArray[Any], remedy: str) -> None:
    if (np.abs(array) <= LARGEST).all():
        return
    raise InputError(name, value, TOO_LARGE if np.isfinite(array).all() else remedy)


def _whole(value: object) -> int | None:
    """A whole number as int; a float is none, whatever its value."""
    if isinstance(value, np.ndarray) and value.ndim == 0 and value.dtype.kind in "iu":
        value = value[()]
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        return None
    return int(value)


def _array(name: str, value: object, remedy: str) -> NDArray[Any]:
    """What numpy makes of a number or of sequences of numbers.

    numpy takes True among floats for 1.0 and would read an iterator to no end: both are refused.
    """
    if isinstance(value, np.ma.MaskedArray):
        raise InputError(name, value, remedy)  # what is masked has no value
    if isinstance(value, np.ndarray) and value.dtype.kind != "O":
        return value
    if _has_flag(value) or isinstance(value, Iterator):
        raise InputError(name, value, remedy)
    try:
        array = np.asarray(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(name, value, remedy) from None
    if array.dtype.kind != "O":
        return array
    # Fractions, and whole numbers beyond 64 bits, come as objects.
    members = [real(one) for one in array.ravel()]
    if any(one is None for one in members):
        raise InputError(name, value, remedy)
    return np.array(members, np.float64).reshape(array.shape)


def _has_flag(value: object, depth: int = 0) -> bool:
    """Whether a boolean, or what is masked, stands among nested numbers.

    Also of a list that holds itself.
    """
    if not isinstance(value, (list, tuple)):
        return isinstance(value, (bool, np.bool_, np.ma.MaskedArray))
    if depth > MOST_AXES:
        return True
    for one in value:  # noqa: SIM110  a loop takes half the time of any()
        if type(one) is not float and _has_flag(one, depth + 1):
            return True
    return False
