"""Where compiled kernels are kept between processes.

A file is written with the checksum of its content in front. What a full disk or a power cut has
left behind is told from it, and never unpickled.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import hashlib
import logging
import os
import re
import shutil
import tempfile
import time
import uuid
from pathlib import Path

logger = logging.getLogger("flipflow")

DAY = 86400.0  # s
KEPT_DAYS = 30.0  # after which compiled code that nobody has used is removed
_CHECKSUM_BYTES = hashlib.sha256().digest_size


class CacheFolders:
    """The folders that may hold compiled kernels: each is read, the first writable is written.

    Every digest of sources has a folder of its own in them.
    """

    def __init__(self) -> None:
        self._temporary: Path | None = None
        self._told = False
        self._tidied = False

    @functools.cached_property
    def roots(self) -> list[Path]:
        """``FLIPFLOW_CACHE_DIR`` alone where it is set, else where this system keeps caches."""
        if given := os.environ.get("FLIPFLOW_CACHE_DIR"):
            return [Path(given).absolute()]
        home = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
        roots = [Path(home) / "flipflow"] if home else []
        try:
            roots.append(Path.home() / ".cache" / "flipflow")
        except RuntimeError:
            logger.debug("this user has no home folder")
        return roots

    def read(self, digest: str, name: str) -> bytes | None:
        """Content of a file; a damaged one is removed, with a word."""
        for root in self._all_roots():
            path = root / digest / name
            try:
                stored = path.read_bytes()
            except OSError:
                continue
            checksum, content = stored[:_CHECKSUM_BYTES], stored[_CHECKSUM_BYTES:]
            if hashlib.sha256(content).digest() == checksum:
                _mark_used(path.parent)
                return content
            logger.warning("a damaged file of the kernel cache is compiled anew: %s", path)
            with contextlib.suppress(OSError):
                path.unlink()
        return None

    def write(self, digest: str, name: str, content: bytes) -> None:
        """Keep a file in the first folder that takes it; say once that none does."""
        refused = "there is none"
        for root in self._all_roots():
            try:
                _write_whole(root / digest / name, hashlib.sha256(content).digest() + content)
            except OSError as error:
                refused = f"{root}: {error.strerror or error}"
                continue
            if not self._tidied:
                self._tidied = True
                _drop_unused(root)
            return
        self._tell(refused)

    def remove(self, digest: str, pattern: str) -> None:
        """Remove files, where that is allowed."""
        for path in (p for root in self._all_roots() for p in (root / digest).glob(pattern)):
            with contextlib.suppress(OSError):
                path.unlink()

    def writable(self, digest: str) -> Path | None:
        """The first folder of this digest that takes a file; None, with a word, without one."""
        refused = "there is none"
        for root in self.roots:
            why = _refusal(root / digest)
            if not why:
                return root / digest
            refused = f"{root}: {why}"
        self._tell(refused)
        return None

    def lend_temporary(self) -> Path | None:
        """A folder of this process that its workers write to when all others refuse.

        It is removed at exit. None where not even that can be made.
        """
        if self._temporary is None:
            try:
                self._temporary = Path(tempfile.mkdtemp(prefix="flipflow-kernels-"))
            except OSError:
                return None
            atexit.register(_remove_at_exit, self._temporary, os.getpid())
        return self._temporary

    def take_back_temporary(self) -> bool:
        """Whether workers had to write to the temporary folder; removed if they had not."""
        if self._temporary is None:
            return False
        if any(self._temporary.iterdir()):
            # Where a small file still goes in, what the workers compiled was too large.
            why = [f"{root}: {_refusal(root) or 'full'}" for root in self.roots]
            self._tell(", ".join(why) or "there is none")
            return True
        self._temporary.rmdir()
        self._temporary = None
        return False

    def borrow_temporary(self, folder: Path | None) -> None:
        """Be a worker of a process that lends this folder, and says what there is to say."""
        self._temporary = folder
        self._told = True

    def _all_roots(self) -> list[Path]:
        return [*self.roots, self._temporary] if self._temporary else self.roots

    def _tell(self, refused: str) -> None:
        if not self._told:
            self._told = True
            logger.warning(
                "no writable cache folder (%s): kernels are compiled anew in every process; "
                "FLIPFLOW_CACHE_DIR may name another folder",
                refused,
            )


FOLDERS = CacheFolders()


def _write_whole(path: Path, stored: bytes) -> None:
    """Write a file that is seen whole or not at all, however many processes write it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f"{path.name}.{uuid.uuid4().hex}.tmp")
    try:
        unfinished.write_bytes(stored)
        unfinished.replace(path)
    except OSError:
        with contextlib.suppress(OSError):
            unfinished.unlink(missing_ok=True)
        raise


def _refusal(folder: Path) -> str:
    """Why a folder takes no file; empty if it does."""
    try:
        _write_whole(folder / "probe", b"")
        (folder / "probe").unlink(missing_ok=True)
    except OSError as error:
        return error.strerror or str(error)
    return ""


def _mark_used(folder: Path) -> None:
    with contextlib.suppress(OSError):
        if time.time() - folder.stat().st_mtime > DAY:
            os.utime(folder)


def _drop_unused(root: Path) -> None:
    """Remove what no process has used for a month, and files that none came to finish."""
    # Nothing else is touched: the user's folder may hold more than this cache.
    folders = [folder for folder in root.iterdir() if re.fullmatch("[0-9a-f]{16}", folder.name)]
    for folder in folders:
        with contextlib.suppress(OSError):
            if time.time() - folder.stat().st_mtime > KEPT_DAYS * DAY:
                shutil.rmtree(folder, ignore_errors=True)
            for unfinished in folder.glob("*.tmp"):
                if time.time() - unfinished.stat().st_mtime > DAY:
                    unfinished.unlink()


def _remove_at_exit(folder: Path, owner: int) -> None:
    # A forked child ends too, while its parent still reads.
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)
