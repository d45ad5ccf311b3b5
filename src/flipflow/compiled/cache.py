"""Compiled code of entries on disk, in place of numba's own cache.

numba reads the sources of a kernel's own file only, unpickles whatever it finds, and wants its
folder writable; where two processes fill it with different argument types, one may get the code
of the other.
"""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable
from functools import cached_property
from importlib import import_module
from typing import Any

from numba.core.caching import _Cache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from flipflow.compiled.digest import describe_code, module_digest
from flipflow.compiled.folders import FOLDERS

SUFFIX = ".kernel"


class KernelCache(_Cache):
    """One entry's compiled code, a file for every list of argument types.

    Nothing is read before the entry is first called.
    """

    def __init__(self, function: Callable[..., Any], compiled_by: str) -> None:
        self._module = function.__module__
        self._name = f"{self._module}.{function.__qualname__}".replace("<", "").replace(">", "")
        self._code = function.__code__
        # What is enclosed need not come from a module that this one imports.
        self._enabled = function.__closure__ is None
        self._compiled_by = compiled_by

    @property
    def cache_path(self) -> str | None:
        """The folder's name within the roots."""
        return self._digest()

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Compiled code for these argument types; None if there is none."""
        target_context.refresh()
        digest = self._digest()
        if digest is None:
            return None
        key = self._key(sig, target_context.codegen())
        content = FOLDERS.read(digest, self._file(key))
        if content is None:
            return None
        stored_key, shared, reduced = pickle.loads(content)  # noqa: S301  the checksum says that we wrote it
        if stored_key != key:
            return None
        for module, name, called in shared:
            getattr(import_module(module), name).compile(called)
        return CompileResult._rebuild(target_context, *reduced)  # noqa: SLF001  as numba's own cache

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled for these argument types."""
        digest = self._digest()
        if digest is None or data.library.has_dynamic_globals:
            return
        key = self._key(sig, data.codegen)
        shared = [(each.__module__, each.__name__, called) for each, called in data.library.shared]
        FOLDERS.write(digest, self._file(key), dumps((key, shared, data._reduce())))  # noqa: SLF001  the same

    def enable(self) -> None:
        """Read and write."""
        self._enabled = True

    def disable(self) -> None:
        """Neither read nor write."""
        self._enabled = False

    def flush(self) -> None:
        """Forget what was compiled for all argument types."""
        if (digest := self._digest()) is not None:
            FOLDERS.remove(digest, f"{self._name}-*{SUFFIX}")

    @cached_property
    def _described(self) -> str:
        # As it is before the first call: under a profiler numba changes the flags of the code.
        return describe_code(self._code)

    def _digest(self) -> str | None:
        return module_digest(self._module, self._compiled_by) if self._enabled else None

    def _key(self, sig: Any, codegen: Any) -> tuple[Any, ...]:
        """What the code is for: the function, its argument types and the processor."""
        return (self._name, self._described, sig, codegen.magic_tuple())

    def _file(self, key: tuple[Any, ...]) -> str:
        return f"{self._name}-{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}{SUFFIX}"
