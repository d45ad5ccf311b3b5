"""Structures that kernels hand on by their address: read as they are at each call, and let go."""

from __future__ import annotations

import sys
from typing import NamedTuple

import numba
import numpy as np
import pytest

from flipflow.compiled.arrays import Int, Real
from flipflow.compiled.by_reference import Reference, by_reference
from flipflow.compiled.compile import kernel

compiled = pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")


@by_reference
class Inner(NamedTuple):
    """A structure within another."""

    flag: bool
    count: Int
    matrix: Real


@by_reference
class Outer(NamedTuple):
    """Fields of every kind that the package's structures have."""

    factor: float
    inner: Inner
    out: Real
    turn: complex


@kernel
def total(inner: Inner) -> float:
    """All elements, or nothing."""
    found = 0.0
    for i in range(inner.matrix.shape[0]):
        for j in range(inner.matrix.shape[1]):
            found += inner.matrix[i, j]
    return found if inner.flag else 0.0


@kernel(entry=True)
def weigh(outer: Outer, again: Inner) -> float:
    """Writes and returns what the fields say, two structures of a kind told apart."""
    outer.inner.count[0] += 1
    outer.out[0] = outer.factor * total(outer.inner) + outer.turn.imag
    return outer.out[0] - total(again)


def _inner(*, flag: bool = True, times: float = 1.0) -> Inner:
    return Inner(flag, np.zeros(1, np.int64), times * np.arange(6.0).reshape(2, 3))


def test_fields_are_read_and_arrays_written() -> None:
    """Numbers, flags, arrays and structures within structures, as each call finds them."""
    inner, out = _inner(), np.zeros(1)
    assert weigh(Outer(2.0, inner, out, 3.0 + 4.0j), _inner(times=2.0)) == 34.0 - 30.0
    assert out[0] == 34.0
    assert inner.count[0] == 1
    inner.matrix[:] = 1.0
    assert weigh(Outer(0.5, inner, out, 1j), inner) == 4.0 - 6.0
    assert weigh(Outer(0.5, inner._replace(flag=False), out, 1j), inner) == 1.0 - 6.0
    assert inner.count[0] == 3


@compiled
def test_a_structure_of_other_arrays_is_another_type() -> None:
    """An address says nothing of what lies there: the types of the fields are part of its own."""
    kinds = {
        numba.typeof(one)
        for one in (
            _inner(), _inner(times=3.0), _inner()._replace(matrix=np.zeros(2)),
            _inner()._replace(flag=1),
            _inner()._replace(matrix=np.asfortranarray(np.zeros((2, 3)))),
        )
    }  # fmt: skip
    assert len(kinds) == 4
    assert all(isinstance(kind, Reference) for kind in kinds)
    assert len({kind.name for kind in kinds}) == 4


@kernel(entry=True)
def misspelt(inner: Inner) -> float:
    """Asks for a field that is none."""
    return inner.matrx[0, 0]


@compiled
def test_what_no_kernel_can_read_is_refused() -> None:
    """A field of no type known to kernels, a name that is not a field, a plain tuple for one."""
    with pytest.raises(numba.TypingError, match="matrx"):
        misspelt(_inner())
    outer = Outer(2.0, _inner(), np.zeros(1), 1j)
    for wrong in (outer._replace(factor=object()), outer._replace(inner=tuple(_inner()))):
        with pytest.raises((TypeError, numba.TypingError)):
            weigh(wrong, _inner())


@compiled
def test_nothing_is_kept() -> None:
    """Neither of our own kernels nor, with memory counted, of numba's."""
    outer = Outer(2.0, _inner(), np.zeros(1), 1j)
    counted = numba.njit(weigh.py_func)
    weigh(outer, outer.inner), counted(outer, outer.inner)
    arrays = outer.out, outer.inner.matrix, outer.inner.count
    before = [sys.getrefcount(array) for array in arrays]
    for _ in range(100):
        assert weigh(outer, outer.inner) == counted(outer, outer.inner)
    assert [sys.getrefcount(array) for array in arrays] == before
