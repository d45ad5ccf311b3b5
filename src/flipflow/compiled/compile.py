"""The one decorator through which every kernel is compiled.

Compiled code is kept on disk under a digest of all sources that the kernel's module imports, the
versions that compile it and the options: any change moves to a new folder, and stale code cannot
run.

With versions of numba on whose inside this has not been tried kernels are compiled as numba
compiles any function: slower, and kept by numba's own cache, which needs a folder that can be
written and does not notice damaged files.
"""

from __future__ import annotations

import functools
import logging
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast, overload

import llvmlite
import numba
import numpy as np
from numba import config
from numba.extending import overload as numba_overload

from flipflow.compiled.digest import module_digest
from flipflow.compiled.folders import FOLDERS

P = ParamSpec("P")
R = TypeVar("R")

# The oldest and the newest numba with which entries.py, parts.py and cache.py work.
TRIED = ((0, 61), (0, 68))
OWN_CACHE = TRIED[0] <= tuple(map(int, numba.__version__.split(".")[:2])) <= TRIED[1]
logger = logging.getLogger("flipflow")


@overload
def kernel(function: Callable[P, R]) -> Callable[P, R]: ...


@overload
def kernel(
    *, entry: bool = False, shared: bool = False, inline: bool = False
) -> Callable[[Callable[P, R]], Callable[P, R]]: ...


def kernel(
    function: Callable[P, R] | None = None,
    *,
    entry: bool = False,
    shared: bool = False,
    inline: bool = False,
) -> Callable[P, R] | Callable[[Callable[P, R]], Callable[P, R]]:
    """Compile a scalar function: cached on disk, without the interpreter lock, IEEE arithmetic.

    Floating-point contraction is allowed; reassociation and the NaN-dropping parts of fastmath
    are not, because kernels test for NaN. Only an ``entry`` can be called from Python: the
    wrappers that unpack its arguments cost more time to compile than most kernels do. A ``shared``
    kernel is compiled once for all entries that call it; its annotation says what it returns.
    ``inline`` is for what runs at every step of a search. Kernels allocate nothing, and so they
    count no references either: that took half of the time.
    """
    if function is None:
        return functools.partial(_compile, entry=entry, shared=shared, inline=inline)
    return _compile(function, entry=entry, shared=shared, inline=inline)


_LANGUAGE: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}}
_ENTRY = _SHARED = _PART = _LANGUAGE
_COMPILED_BY = "numba alone"
if OWN_CACHE:
    from flipflow.compiled.cache import KernelCache
    from flipflow.compiled.entries import (
        OPTIMISATION,
        EntryCompiler,
        SharedCompiler,
        called_by_name,
    )
    from flipflow.compiled.parts import PartCompiler, without_literals

    _ENTRY = _LANGUAGE | {"no_cfunc_wrapper": True, "_nrt": False, "pipeline_class": EntryCompiler}
    _SHARED = _ENTRY | {"no_cpython_wrapper": True, "pipeline_class": SharedCompiler}
    _PART = _SHARED | {"pipeline_class": PartCompiler}
    _COMPILED_BY = f"optimised {OPTIMISATION}"
else:
    logger.debug("numba %s has not been tried: kernels compile slower", numba.__version__)

# Of numba's own settings those that change the code it makes; OPT by the making of machine code,
# whose level numba takes when it is first used, and not from entries.py.
_SETTINGS = (
    "OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "ENABLE_AVX", "DISABLE_INTEL_SVML", "DISABLE_JIT",
    "BOUNDSCHECK", "DEBUGINFO_DEFAULT",
)  # fmt: skip


def _compile(
    function: Callable[P, R], *, entry: bool, shared: bool, inline: bool
) -> Callable[P, R]:
    if not OWN_CACHE:
        plain = _by_numba_alone(function) if entry else numba.njit(**_PART)(function)
        return cast("Callable[P, R]", plain)
    options = _ENTRY if entry else _SHARED if shared else _PART
    compiled = numba.njit(forceinline=inline, **options)(function)
    if config.DISABLE_JIT:
        return function
    if entry or shared:
        compiled._cache = KernelCache(function, compiled_by())  # noqa: SLF001  numba offers no other way
    compiled = called_by_name(compiled) if shared else without_literals(compiled)
    return cast("Callable[P, R]", compiled)


def _by_numba_alone(function: Callable[..., Any]) -> Any:
    """Compile an entry with numba's own cache, in our folder."""
    digest = module_digest(function.__module__, compiled_by())
    # What lies in an archive numba would keep elsewhere, under the digest of this file alone.
    filed = Path(function.__code__.co_filename).exists()
    folder = FOLDERS.writable(digest) if digest is not None and filed else None
    before = config.CACHE_DIR
    config.CACHE_DIR = str(folder or before)
    try:
        return numba.njit(cache=folder is not None, **_ENTRY)(function)
    finally:
        config.CACHE_DIR = before


def chosen_by_type(function: Callable[P, R]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Let kernels call a plain function: decorates what returns the one to run for given types."""
    decorate = numba_overload(function, jit_options=_PART)
    return cast("Callable[[Callable[..., Any]], Callable[..., Any]]", decorate)


@functools.cache
def compiled_by() -> str:
    """All that changes compiled code, besides sources: versions, options, numba's settings."""
    versions = (sys.version, numba.__version__, llvmlite.__version__, np.__version__)
    options = sorted((name, repr(value)) for name, value in _ENTRY.items())
    settings = [repr(getattr(config, name, None)) for name in _SETTINGS]
    return repr((versions, options, _COMPILED_BY, settings))
