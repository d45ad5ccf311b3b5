"""Results as JSON types and back, by the types of their fields.

Not a number is null; an infinite number is "inf" or "-inf". A complex number is a pair [re, im].
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from enum import Enum
from operator import attrgetter
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from flipflow.errors import StoreError
from flipflow.model.arguments import LARGEST

Json = Any
BEYOND = f"no result has a number beyond {LARGEST:g}"
MOST_WHOLE = 2**63  # what is larger is no count, index or seed


@dataclass(frozen=True)
class Form:
    """How the values of one type are written, and read again."""

    write: Callable[[Any], Json]
    read: Callable[[Any], Any]


class Codec:
    """The forms of types; that of a dataclass is made of those of its fields."""

    def __init__(self) -> None:
        self._forms: dict[Any, Form] = dict(OWN)

    def learn(self, own: Mapping[Any, Form]) -> None:
        """Take up types that have another form than their fields give them."""
        self._forms |= own

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
        kind = _spelt_out(kind)
        origin, parts = get_origin(kind), get_args(kind)
        if origin in MAKERS:
            return MAKERS[origin](self, parts)
        if isinstance(kind, type) and issubclass(kind, Enum):
            return Form(lambda value: value.name, lambda name: kind[_text(name)])
        if dataclasses.is_dataclass(kind) or hasattr(kind, "_fields"):
            return self.fields(kind)
        raise TypeError(f"no form is known for {kind!r}")

    def fields(self, kind: Any) -> Form:
        """An object by the fields of a dataclass or a named tuple; what is absent has its default.

        Forms are looked up when they are used, so that a type may hold others of its kind.
        """
        hints, fields = get_type_hints(kind), fields_of(kind)

        def read(document: Json) -> object:
            given = _object(document)
            present = {name: hints[name] for name, must in fields.items() if must or name in given}
            return kind(**self._read(present, given))

        return Form(self.table({name: hints[name] for name in fields}).write, read)

    def table(self, kinds: Mapping[str, Any], **paths: str) -> Form:
        """Parts of an object by name, each of a type; read, they are a dictionary.

        ``paths`` tells where a part stands that is no attribute of that name, as "traced.u".
        """
        parts = {name: attrgetter(paths.get(name, name)) for name in kinds}

        def write(value: object) -> Json:
            return {name: self.form(kinds[name]).write(part(value)) for name, part in parts.items()}

        def read(document: Json) -> dict[str, Any]:
            return self._read(kinds, _object(document))

        return Form(write, read)

    def _read(self, kinds: Mapping[str, Any], document: Mapping[str, Json]) -> dict[str, Any]:
        """Named parts of a document, each by the form of its type."""
        found = {}
        for name, kind in kinds.items():
            with _within(name):
                found[name] = self.form(kind).read(document[name])
        return found

    def tagged(self, key: str, kinds: Mapping[str, Any]) -> Form:
        """One of several types by its fields, told apart by a word that stands under ``key``."""
        forms = {word: self.fields(kind) for word, kind in kinds.items()}

        def write(value: object) -> Json:
            word = next(word for word, kind in kinds.items() if isinstance(value, kind))
            return {key: word, **forms[word].write(value)}

        def read(document: Json) -> object:
            word = _text(_object(document)[key])
            if word not in kinds:
                known = " or ".join(map(repr, kinds))
                raise StoreError(f"{key} = {word!r} is not known, only {known}; update flipflow")
            return forms[word].read(document)

        return Form(write, read)


def plain(value: object) -> Json:
    """JSON types only: arrays become lists, complex numbers [re, im], inf and NaN null."""
    return _jsonable(value, {})


def exact(value: object) -> Json:
    """As :func:`plain`, infinite numbers as "inf" and "-inf"."""
    return _jsonable(value, {math.inf: "inf", -math.inf: "-inf"})


def array(values: Json, dtype: type = float) -> NDArray[Any]:
    """The array of a list that :func:`plain` or :func:`exact` wrote; null is NaN."""
    if isinstance(values, Mapping):
        if 0 not in values["shape"]:
            raise ValueError(f"no array without elements has the shape {values['shape']}")
        return np.zeros(values["shape"], dtype)
    if np.issubdtype(dtype, np.complexfloating):
        pairs = _within_all(np.asarray(values, dtype=float))
        # Not a + 1j b, which is no number where one of them is infinite.
        return pairs.view(np.complex128)[..., 0] if pairs.size else np.zeros(0, dtype)
    return _within_all(np.asarray(values, dtype))


def _within_all(values: NDArray[Any]) -> NDArray[Any]:
    """The numbers, of which none is finite and beyond all that is worked with."""
    if values.dtype.kind == "f" and (np.isfinite(values) & (np.abs(values) > LARGEST)).any():
        raise ValueError(BEYOND)
    return values


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


def _spelt_out(kind: Any) -> Any:
    """A type in place of a ``type`` with parameters, as numpy's for arrays."""
    meant = getattr(get_origin(kind), "__value__", None)
    return kind if meant is None else meant[get_args(kind)]


def _jsonable(value: object, words: Mapping[float, str]) -> Json:
    if isinstance(value, (np.ndarray, np.generic)):
        if value.dtype.kind == "c":
            value = np.stack([value.real, value.imag], axis=-1)
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


@contextmanager
def _within(name: str) -> Iterator[None]:
    """Let what is wrong be told with the name of the field where it stands."""
    try:
        yield
    except KeyError as error:
        raise ValueError(f"{error.args[0]} is missing") from None
    except (ValueError, TypeError, LookupError, ArithmeticError) as error:
        raise ValueError(f"{name}: {error}") from None


def _typed(what: str, *kinds: type) -> Callable[[Json], Any]:
    """What passes values of some JSON types; true and false are no numbers."""

    def read(document: Json) -> Any:
        if type(document) not in kinds:
            raise TypeError(f"{what} is expected, not {type(document).__name__}")
        return document

    return read


_object = _typed("an object", dict)
_list = _typed("a list", list)
_text = _typed("a text", str)
_truth = _typed("true or false", bool)
_real = _typed("a number", float, int)
_count = _typed("a whole number", int)


def _number(document: Json) -> float:
    if document is None:
        return math.nan
    if document in ("inf", "-inf"):
        return float(document)
    if LARGEST < abs(float(_real(document))) < math.inf:  # a whole number may not fit at all
        raise ValueError(BEYOND)
    return document  # type: ignore[no-any-return]


def _complex(document: Json) -> complex:
    real, imaginary = map(_number, _list(document))
    return complex(real, imaginary)


def _whole(document: Json) -> int:
    if abs(_count(document)) > MOST_WHOLE:
        raise ValueError("a whole number is too large")
    return document  # type: ignore[no-any-return]


def _arrays(_codec: Codec, parts: tuple[Any, ...]) -> Form:
    """Arrays by their element's type; without elements the shape tells more than a list."""
    (dtype,) = get_args(parts[1])

    def write(values: NDArray[Any]) -> Json:
        values = np.asarray(values)
        bare = values.size == 0 and values.ndim > 1
        return {"shape": list(values.shape)} if bare else exact(values)

    def read(document: Json) -> NDArray[Any]:
        return array(document if isinstance(document, Mapping) else _list(document), dtype)

    return Form(write, read)


def _tuples(codec: Codec, parts: tuple[Any, ...]) -> Form:
    if parts[1:] == (...,):
        every = codec.form(parts[0])
        return Form(
            lambda value: [every.write(one) for one in value],
            lambda document: tuple(map(every.read, _list(document))),
        )
    forms = [codec.form(part) for part in parts]
    return Form(
        lambda value: [form.write(one) for form, one in zip(forms, value, strict=True)],
        lambda document: tuple(
            form.read(one) for form, one in zip(forms, _list(document), strict=True)
        ),
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
    kinds = [_spelt_out(part) for part in parts if part is not NoneType]

    def write(value: object) -> Json:
        if value is None:
            return None
        fits = (kind for kind in kinds if isinstance(value, get_origin(kind) or kind))
        return codec.form(next(fits, kinds[0])).write(value)

    def read(document: Json) -> object:
        if document is None and NoneType in parts:
            return None
        keys = set(document) if isinstance(document, Mapping) else set()
        *fits, last = [kind for kind in kinds if not keys or _holds(kind, keys)] or kinds[:1]
        for kind in fits:
            with suppress(TypeError, ValueError):
                return codec.form(kind).read(document)
        return codec.form(last).read(document)

    return Form(write, read)


def _words(_codec: Codec, parts: tuple[Any, ...]) -> Form:
    def read(document: Json) -> object:
        if document not in parts:
            raise ValueError(f"{document!r} is none of {', '.join(map(repr, parts))}")
        return document

    return Form(exact, read)


def _holds(kind: Any, keys: set[str]) -> bool:
    """Whether a value of the type can be made of fields with these names."""
    if not dataclasses.is_dataclass(kind):
        return True
    fields = fields_of(kind)
    return keys <= set(fields) and all(name in keys for name, needed in fields.items() if needed)


AS_IT_IS = Form(exact, lambda document: document)
OWN: Mapping[Any, Form] = {
    **dict.fromkeys((object, Any, NoneType), AS_IT_IS),
    bool: Form(exact, _truth),
    int: Form(exact, _whole),
    str: Form(exact, _text),
    float: Form(exact, _number),
    complex: Form(exact, _complex),
    Path: Form(str, lambda document: Path(_text(document))),
}
MAKERS: Mapping[Any, Callable[[Codec, tuple[Any, ...]], Form]] = {
    np.ndarray: _arrays,
    tuple: _tuples,
    dict: _mappings,
    Mapping: _mappings,
    Union: _unions,
    UnionType: _unions,
    Literal: _words,
}
