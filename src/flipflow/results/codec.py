"""Results as JSON types and back, by the types of their fields.

Not a number is null; an infinite number is "inf" or "-inf". A complex number is a pair [re, im].
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

Json = Any


@dataclass(frozen=True)
class Form:
    """How the values of one type are written, and read again."""

    write: Callable[[Any], Json]
    read: Callable[[Any], Any]


class Codec:
    """The forms of types; that of a dataclass is made of those of its fields.

    Parameters
    ----------
    own
        Types that have another form than their fields give them.
    """

    def __init__(self, own: Mapping[Any, Form]) -> None:
        self.own = dict(own)
        self._forms: dict[Any, Form] = {**OWN, **own}

    def form(self, kind: Any) -> Form:
        """The form of a type: a class, or a hint such as ``tuple[Orbit, ...]``.

        Raises
        ------
        TypeError
            For a type that no form can be made of.
        """
        if kind not in self._forms:
            self._forms[kind] = self._made(kind)
        return self._forms[kind]

    def _made(self, kind: Any) -> Form:
        origin, parts = get_origin(kind), get_args(kind)
        if origin in MAKERS:
            return MAKERS[origin](self, parts)
        if isinstance(kind, type) and issubclass(kind, Enum):
            return Form(lambda value: value.name, lambda name: kind[name])
        if dataclasses.is_dataclass(kind) or hasattr(kind, "_fields"):
            return self._of_fields(kind)
        raise TypeError(f"no form is known for {kind!r}")

    def _of_fields(self, kind: Any) -> Form:
        """An object by the fields of a dataclass or a named tuple; what is absent has its default.

        Forms are looked up when they are used, so that a type may hold others of its kind.
        """
        hints, fields = get_type_hints(kind), fields_of(kind)

        def write(value: object) -> Json:
            return {name: self.form(hints[name]).write(getattr(value, name)) for name in fields}

        def read(document: Mapping[str, Json]) -> object:
            present = [name for name, needed in fields.items() if needed or name in document]
            return kind(**{name: self.form(hints[name]).read(document[name]) for name in present})

        return Form(write, read)


def plain(value: object) -> Json:
    """JSON types only: arrays become lists, complex numbers [re, im], inf and NaN null."""
    return _jsonable(value, {})


def exact(value: object) -> Json:
    """As :func:`plain`, infinite numbers as "inf" and "-inf"."""
    return _jsonable(value, {math.inf: "inf", -math.inf: "-inf"})


def array(values: object, dtype: type = float) -> NDArray[Any]:
    """The array of a list that :func:`plain` or :func:`exact` wrote; null is NaN."""
    if isinstance(values, Mapping):
        return np.zeros(values["shape"], dtype)
    if np.issubdtype(dtype, np.complexfloating):
        pairs = np.asarray(values, dtype=float)
        return pairs[..., 0] + 1j * pairs[..., 1] if pairs.size else np.zeros(0, dtype)
    return np.asarray(values, dtype)


def fields_of(kind: Any) -> dict[str, bool]:
    """What a dataclass or a named tuple is made of, and whether it cannot be left out."""
    if not dataclasses.is_dataclass(kind):
        return {name: name not in kind._field_defaults for name in kind._fields}
    nothing = dataclasses.MISSING
    return {
        field.name: field.default is nothing and field.default_factory is nothing
        for field in dataclasses.fields(kind)
        if field.init
    }


def _jsonable(value: object, words: Mapping[float, str]) -> Json:
    if isinstance(value, (np.ndarray, np.generic)):
        done = value.dtype.kind in "biuf" and np.isfinite(value).all()
        return value.tolist() if done else _jsonable(value.tolist(), words)
    if isinstance(value, Mapping):
        return {str(key): _jsonable(one, words) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_jsonable(one, words) for one in value]
    if isinstance(value, complex):
        return [_jsonable(value.real, words), _jsonable(value.imag, words)]
    if isinstance(value, float) and not math.isfinite(value):
        return words.get(value)
    return value


def _number(document: Json) -> float:
    if document is None:
        return math.nan
    return document if isinstance(document, int) else float(document)


def _arrays(_codec: Codec, parts: tuple[Any, ...]) -> Form:
    """Arrays by their element's type; without elements the shape tells more than a list."""
    (dtype,) = get_args(parts[1])

    def write(values: NDArray[Any]) -> Json:
        values = np.asarray(values)
        bare = values.size == 0 and values.ndim > 1
        return {"shape": list(values.shape)} if bare else exact(values)

    return Form(write, lambda document: array(document, dtype))


def _tuples(codec: Codec, parts: tuple[Any, ...]) -> Form:
    if parts[1:] == (...,):
        every = codec.form(parts[0])
        return Form(
            lambda value: [every.write(one) for one in value],
            lambda document: tuple(map(every.read, document)),
        )
    forms = [codec.form(part) for part in parts]
    return Form(
        lambda value: [form.write(one) for form, one in zip(forms, value, strict=True)],
        lambda document: tuple(form.read(one) for form, one in zip(forms, document, strict=True)),
    )


def _mappings(codec: Codec, parts: tuple[Any, ...]) -> Form:
    """Mappings as objects; as pairs where a key is no text, which an object would make of it."""
    inner = codec.form(parts[1])

    def write(value: Mapping[Any, Any]) -> Json:
        pairs = [[key, inner.write(one)] for key, one in value.items()]
        return dict(pairs) if all(isinstance(key, str) for key in value) else pairs

    def read(document: Json) -> dict[Any, Any]:
        pairs = document.items() if isinstance(document, Mapping) else document
        return {key: inner.read(one) for key, one in pairs}

    return Form(write, read)


def _unions(codec: Codec, parts: tuple[Any, ...]) -> Form:
    """One of several types: objects are told apart by their fields, null is None."""
    kinds = [part for part in parts if part is not NoneType]

    def write(value: object) -> Json:
        if value is None:
            return None
        fits = (kind for kind in kinds if isinstance(value, get_origin(kind) or kind))
        return codec.form(next(fits, kinds[0])).write(value)

    def read(document: Json) -> object:
        if document is None:
            return None
        keys = set(document) if isinstance(document, Mapping) else set()
        fits = (kind for kind in kinds if not keys or _holds(kind, keys))
        return codec.form(next(fits, kinds[0])).read(document)

    return Form(write, read)


def _holds(kind: Any, keys: set[str]) -> bool:
    """Whether a value of the type can be made of fields with these names."""
    if not dataclasses.is_dataclass(kind):
        return True
    fields = fields_of(kind)
    return keys <= set(fields) and all(name in keys for name, needed in fields.items() if needed)


AS_IT_IS = Form(exact, lambda document: document)
OWN: Mapping[Any, Form] = {
    **dict.fromkeys((int, str, bool, object, NoneType), AS_IT_IS),
    float: Form(exact, _number),
    Path: Form(str, Path),
}
MAKERS: Mapping[Any, Callable[[Codec, tuple[Any, ...]], Form]] = {
    np.ndarray: _arrays,
    tuple: _tuples,
    dict: _mappings,
    Mapping: _mappings,
    Union: _unions,
    UnionType: _unions,
    Literal: lambda _codec, _parts: AS_IT_IS,
}
