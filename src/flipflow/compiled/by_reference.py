"""Structures of arrays that kernels hand to each other by their address.

numba hands over a tuple of arrays as the hundreds of numbers that describe them, at every call
anew; most of the time to compile went into that. A structure that is marked here lies in memory
once, where a kernel is called from Python, and what is not read costs nothing. Kernels read its
fields; they do not make one, which would have no place that outlives the kernel.
"""

from __future__ import annotations

import hashlib
from functools import cached_property
from typing import Any, TypeVar

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import impl_ret_borrowed, lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import NativeValue, models, register_model, typeof_impl, unbox

T = TypeVar("T", bound=type[tuple[Any, ...]])
WORD = 8  # bytes; each field begins at a multiple of them
POINTER = ir.IntType(8).as_pointer()


class Reference(types.Type):
    """Type of a structure's address: its class, and the types of its fields."""

    def __init__(self, structure: Any, fields: tuple[types.Type, ...]) -> None:
        self.structure, self.fields = structure, fields
        text = ", ".join(map(str, fields))
        digest = hashlib.blake2b(text.encode(), digest_size=8).hexdigest()
        super().__init__(f"{structure.__module__}.{structure.__qualname__}.{digest}")

    @property
    def instance_class(self) -> Any:
        """The class, by the name under which numba's own tuples have it."""
        return self.structure

    @cached_property
    def places(self) -> dict[str, int]:
        """Number of each field."""
        return {name: k for k, name in enumerate(self.structure._fields)}


register_model(Reference)(models.OpaqueModel)
_OFFSETS: dict[Reference, list[int]] = {}


def by_reference(structure: T) -> T:
    """Mark a named tuple of which kernels take the address."""

    def typed(value: Any, context: Any) -> Reference | None:
        fields = [typeof_impl(field, context) for field in value]
        return None if None in fields else Reference(structure, tuple(fields))

    typeof_impl.register(structure)(typed)
    return structure


def _offsets(context: Any, kind: Reference) -> list[int]:
    """Bytes before each field, and of all."""
    if kind not in _OFFSETS:
        offsets = [0]
        for field in kind.fields:
            size = context.get_abi_sizeof(context.get_data_type(field))
            offsets.append(offsets[-1] + -(-size // WORD) * WORD)
        _OFFSETS[kind] = offsets
    return _OFFSETS[kind]


def _field(context: Any, builder: Any, kind: types.Type, start: Any, offset: int) -> Any:
    """Address of a field."""
    place = builder.gep(start, [ir.Constant(ir.IntType(64), offset)], inbounds=True)
    return builder.bitcast(place, context.get_data_type(kind).as_pointer())


@infer_getattr
class _Fields(AttributeTemplate):
    key = Reference

    def generic_resolve(self, kind: Reference, name: str) -> types.Type | None:
        place = kind.places.get(name)
        return None if place is None else kind.fields[place]


@lower_getattr_generic(Reference)
def _read(context: Any, builder: Any, kind: Reference, start: Any, name: str) -> Any:
    place = kind.places[name]
    field = kind.fields[place]
    address = _field(context, builder, field, start, _offsets(context, kind)[place])
    loaded = builder.load(address, align=WORD)
    value = context.data_model_manager[field].from_data(builder, loaded)
    return impl_ret_borrowed(context, builder, field, value)


@unbox(Reference)
def _unbox(kind: Reference, value: Any, c: Any) -> NativeValue:
    """Lay the fields out in the frame of the call from Python."""
    offsets = _offsets(c.context, kind)
    words = ir.ArrayType(ir.IntType(8 * WORD), offsets[-1] // WORD)
    start = c.builder.bitcast(cgutils.alloca_once(c.builder, words), POINTER)
    failed = cgutils.alloca_once_value(c.builder, cgutils.false_bit)
    cleanups: list[Any] = []
    for k, field in enumerate(kind.fields):
        native = c.unbox(field, c.pyapi.tuple_getitem(value, k))
        data = c.context.data_model_manager[field].as_data(c.builder, native.value)
        c.builder.store(data, _field(c.context, c.builder, field, start, offsets[k]), align=WORD)
        c.builder.store(c.builder.or_(c.builder.load(failed), native.is_error), failed)
        if native.cleanup is not None:
            cleanups.append(native.cleanup)
        if c.context.enable_nrt:
            cleanups.append(_release(c, field, native.value))

    def cleanup() -> None:
        for each in reversed(cleanups):
            each()

    return NativeValue(start, is_error=c.builder.load(failed), cleanup=cleanup)


def _release(c: Any, field: types.Type, value: Any) -> Any:
    return lambda: c.context.nrt.decref(c.builder, field, value)
