"""The one decorator through which every kernel is compiled, and where compiled code is kept.

A numba cache entry is renewed when its own file changes, not when a kernel it calls in another
file does. The cache folder is therefore named after a digest of all kernel sources: any change
moves to a new folder, and stale code cannot run.
"""

from __future__ import annotations

import functools
import hashlib
import logging
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast, overload

import numba
from numba import config
from numba.extending import overload as numba_overload

from flipflow.compiled.parts import PartCompiler

P = ParamSpec("P")
R = TypeVar("R")

KEPT_CACHES = 4
logger = logging.getLogger("flipflow")


@overload
def kernel(function: Callable[P, R]) -> Callable[P, R]: ...


@overload
def kernel(
    *, entry: bool = False, inline: bool = False
) -> Callable[[Callable[P, R]], Callable[P, R]]: ...


def kernel(
    function: Callable[P, R] | None = None, *, entry: bool = False, inline: bool = False
) -> Callable[P, R] | Callable[[Callable[P, R]], Callable[P, R]]:
    """Compile a scalar function: cached on disk, without the interpreter lock, IEEE arithmetic.

    Floating-point contraction is allowed; reassociation and the NaN-dropping parts of fastmath
    are not, because kernels test for NaN. Only an ``entry`` can be called from Python: the
    wrappers that unpack its arguments cost more time to compile than most kernels do. ``inline``
    is for what runs at every step of a search: its scratch, dozens of arrays, is then not passed.
    Kernels allocate nothing, and so they count no references either: that took half of the time.
    """
    if function is None:
        return functools.partial(_compile, entry=entry, inline=inline)
    return _compile(function, entry=entry, inline=inline)


def _compile(function: Callable[P, R], *, entry: bool, inline: bool) -> Callable[P, R]:
    options: dict[str, Any] = _OPTIONS if entry else _PART_OPTIONS
    with _CacheFolder():
        compiled = numba.njit(cache=entry, forceinline=inline, **options)(function)
    return cast("Callable[P, R]", compiled)


_OPTIONS: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract"},
    "no_cfunc_wrapper": True,
    "_nrt": False,
}
_PART_OPTIONS = _OPTIONS | {"no_cpython_wrapper": True, "pipeline_class": PartCompiler}


def chosen_by_type(function: Callable[P, R]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Let kernels call a plain function: decorates what returns the one to run for given types."""
    decorate = numba_overload(function, jit_options=_PART_OPTIONS)
    return cast("Callable[[Callable[..., Any]], Callable[..., Any]]", decorate)


def cache_folder() -> Path:
    """Folder of the compiled kernels of exactly these sources; created, writable."""
    return _cache_folder()


def source_digest(folder: Path) -> str:
    """Digest of all Python sources in ``folder`` and of the versions they are compiled with."""
    digest = hashlib.sha256(f"{sys.version_info[:3]} numba {numba.__version__}".encode())
    for source in sorted(folder.rglob("*.py")):
        digest.update(str(source.relative_to(folder)).encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


@functools.cache
def _cache_folder() -> Path:
    digest = source_digest(Path(__file__).parent.parent)
    for root in _cache_roots():
        folder = root / digest
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                pass
        except OSError:
            continue
        _drop_old(root, keep=folder)
        return folder
    folder = Path(tempfile.mkdtemp(prefix="flipflow-kernels-"))
    logger.warning("no writable cache folder: kernels are compiled anew in every process")
    return folder


def _cache_roots() -> list[Path]:
    if given := os.environ.get("FLIPFLOW_CACHE_DIR"):
        return [Path(given)]
    home = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    roots = [Path(home) / "flipflow"] if home else []
    try:
        roots.append(Path.home() / ".cache" / "flipflow")
    except RuntimeError:
        logger.debug("this user has no home folder")
    return roots


def _drop_old(root: Path, keep: Path) -> None:
    """Remove all but the newest few caches; one in use by another version may still be wanted."""
    month = 30 * 86400.0
    folders = sorted((f for f in root.iterdir() if f.is_dir()), key=lambda f: f.stat().st_mtime)
    for folder in folders[:-KEPT_CACHES]:
        if folder != keep and time.time() - folder.stat().st_mtime > month:
            shutil.rmtree(folder, ignore_errors=True)


class _CacheFolder:
    """Point numba at our folder while a kernel is decorated, and only then."""

    def __enter__(self) -> None:
        self._before = config.CACHE_DIR
        config.CACHE_DIR = str(_cache_folder())

    def __exit__(self, *_: object) -> None:
        config.CACHE_DIR = self._before
