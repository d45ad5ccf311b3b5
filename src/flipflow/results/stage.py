"""A set of files that take their places together: each command's outputs, old or new, never half.

They are written aside first. Then the folder that holds them, beside which stands the folder as it
is to be, changes places with it in one step of the file system. Where that cannot be, the files are
renamed one by one, and what was renamed is undone when one of them fails.
"""

from __future__ import annotations

import contextlib
import fcntl
import glob
import os
import shutil
import stat
import sys
import time
import uuid
from collections.abc import Iterable, Iterator
from pathlib import Path

from flipflow.errors import StoreError
from flipflow.results.store import (
    because,
    checked_place,
    refused,
    sync_folder,
    write_beside,
    write_file,
)
from flipflow.signals import undisturbed

MOST_KEPT = 1000  # other files of a folder that are carried along
ABANDONED = 10.0  # s after which files aside that nobody holds are those of a killed command
EXCHANGE, HERE = 2, -100  # RENAME_EXCHANGE and AT_FDCWD of Linux


class Stage:
    """Files aside, until they take their places in a folder; and single files elsewhere.

    Parameters
    ----------
    folder
        Where they are to stand; it exists. None where there are only files elsewhere.
    field
        The argument or option that a sentence names.
    """

    def __init__(self, folder: Path | None, field: str) -> None:
        self._named, self._field = folder, field
        self._folder = None if folder is None else Path(os.path.realpath(folder))
        self._aside: Path | None = None
        self._lock = -1
        self._elsewhere: list[tuple[str, str, str]] = []
        self._parts: list[tuple[Path, Path]] = []
        self._dropped: frozenset[str] = frozenset()

    @property
    def aside(self) -> Path:
        """The folder that the files are written into."""
        if self._aside is None:
            with undisturbed():
                self._aside = self._made()
        return self._aside

    def hold(self, target: str, content: str, field: str) -> None:
        """Take a file that is to stand elsewhere; ``field`` is what a sentence on it names."""
        self._elsewhere.append((target, content, field))

    def drop(self, names: Iterable[str]) -> None:
        """Files of the folder that go when those aside come: of a set that is no longer there."""
        self._dropped = frozenset(names)

    def told(self, sentence: str) -> str:
        """A sentence on a file aside, made one on the file that the user knows."""
        return sentence.replace(str(self._aside), str(self._named)) if self._aside else sentence

    def prepare(self) -> None:
        """Write the files that are to stand elsewhere beside their places.

        A device or a pipe gets its file now, and may let it wait: Ctrl-C ends that.

        Raises
        ------
        StoreError
            When one cannot be written.
        """
        for target, content, field in self._elsewhere:
            if not self._is_aside(target):
                self._beside(target, content, field)
        self._elsewhere = []

    def commit(self) -> None:
        """Let all files take their places.

        Raises
        ------
        StoreError
            When one cannot; then all are as they were.
        """
        self.prepare()
        parts, self._parts = self._parts, []
        try:
            exchanged = self._aside is not None and self._exchanged()
            if self._aside is not None and not exchanged:
                parts += self._single()
            _take_places(parts)
            if self._folder is not None and not exchanged:
                for name in self._dropped - {part.name for part, _ in parts}:
                    (self._folder / name).unlink(missing_ok=True)
        except OSError as error:
            raise refused(self._field, self._named or "", because(error)) from None
        finally:
            for part, _ in parts:
                part.unlink(missing_ok=True)
            self.discard()

    def discard(self) -> None:
        """Remove what is aside."""
        while self._parts:
            self._parts.pop()[0].unlink(missing_ok=True)
        if self._aside is not None:
            shutil.rmtree(self._aside, ignore_errors=True)
            self._aside = None
        if self._lock >= 0:
            os.close(self._lock)
            self._lock = -1

    def _made(self) -> Path:
        """A folder for the files: beside theirs, or in it where nothing can be made beside it."""
        folder = self._folder
        if folder is None:
            raise StoreError(f"{self._field}: files are written, but no folder is named.")
        sweep(folder)
        name = f".{folder.name}-{uuid.uuid4().hex}.part"
        for place in (folder.parent / name, folder / name):
            with contextlib.suppress(OSError):
                place.mkdir()
                with contextlib.suppress(OSError):  # a file system without locks
                    self._lock = held(place)
                return place
        raise refused(self._field, self._named or "", "nothing can be written there, name another")

    def _beside(self, target: str, content: str, field: str) -> None:
        """A file elsewhere, written beside its place; a device or a pipe gets it as it is."""
        place = checked_place(target, field)
        if place.exists() and not place.is_file():
            write_file(place, content, field)
            return
        try:
            with undisturbed():
                self._parts.append((write_beside(place, content), place))
        except OSError as error:
            raise refused(field, target, because(error)) from None

    def _is_aside(self, target: str) -> bool:
        """Whether the folder gets a file of this name, which says the same and more."""
        place = Path(os.path.realpath(target))
        own = self._aside is not None and place.parent == self._folder
        return own and (self.aside / place.name).exists()

    def _exchanged(self) -> bool:
        """Whether the folder as it is to be has taken the place of the one that was."""
        old, new = self._folder, self._aside
        if old is None or new is None or not _plain(old) or new.parent != old.parent:
            return False
        own = {path.name for path in new.iterdir()}
        try:
            for entry in _entries(old):
                if entry.name not in own | self._dropped:
                    os.link(entry.path, new / entry.name, follow_symlinks=False)
                elif entry.name not in own:
                    continue
                elif entry.is_symlink() or not entry.is_file():
                    return False
                else:
                    (new / entry.name).chmod(stat.S_IMODE(entry.stat().st_mode))
            new.chmod(stat.S_IMODE(old.stat().st_mode))
            sync_folder(new)
            if not _exchange(new, old):
                return False
        except OSError:
            return False
        finally:
            self._forget_links(own)
        sync_folder(old.parent)
        return True

    def _forget_links(self, own: set[str]) -> None:
        """Remove from aside what is in the folder, too, and give it what came to it meanwhile."""
        if self._aside is None or self._folder is None:
            return
        for entry in _entries(self._aside):
            there = self._folder / entry.name
            if entry.name in own | self._dropped:
                continue
            if os.path.lexists(there) and there.lstat().st_ino == entry.inode():
                Path(entry.path).unlink()
            else:
                Path(entry.path).replace(there)

    def _single(self) -> Iterator[tuple[Path, Path]]:
        """Each file aside with its place, links followed, in a form that only needs renaming."""
        for part in sorted(self.aside.iterdir()):
            place = checked_place((self._folder or Path()) / part.name, self._field)
            if place.exists() and not place.is_file():
                write_file(place, part.read_bytes(), self._field)
            elif place.parent != self._folder:
                yield write_beside(place, part.read_bytes()), place
            else:
                if place.exists():
                    part.chmod(stat.S_IMODE(place.stat().st_mode))
                yield part, place


def _take_places(parts: list[tuple[Path, Path]]) -> None:
    """Rename all, or none when one cannot be renamed."""
    kept: list[tuple[Path | None, Path]] = []
    try:
        for part, place in parts:
            kept.append((_copy_of(place), place))
            part.replace(place)
    except BaseException:
        for copy, place in reversed(kept):
            if copy is None:
                place.unlink(missing_ok=True)
            else:
                copy.replace(place)
        raise
    finally:
        for copy, _ in kept:
            if copy is not None:
                copy.unlink(missing_ok=True)
    for folder in {place.parent for _, place in parts}:
        sync_folder(folder)


def _copy_of(place: Path) -> Path | None:
    """Another name for a file, by which it can be brought back; None where there is no file."""
    if not place.exists():
        return None
    copy = place.with_name(f".{uuid.uuid4().hex}.part")
    try:
        os.link(place, copy)
    except OSError:  # a file system without links
        shutil.copy2(place, copy)
    return copy


def _plain(folder: Path) -> bool:
    """Whether a folder can be exchanged for another: files only, and nobody works in it."""
    if sys.platform != "linux":
        return False
    here = Path.cwd()
    if folder == here or folder in here.parents or folder.is_mount():
        return False
    if folder.stat().st_uid != os.geteuid() or os.listxattr(folder):
        return False
    kinds = [entry.is_file() or entry.is_symlink() for entry in _entries(folder)]
    return all(kinds) and len(kinds) <= MOST_KEPT


def _entries(folder: Path) -> list[os.DirEntry[str]]:
    with os.scandir(folder) as entries:
        return list(entries)


def _exchange(one: Path, other: Path) -> bool:
    """Two names change what they name, in one step; False where the system has no such step."""
    import ctypes  # noqa: PLC0415  keeps --help quick

    swap = getattr(ctypes.CDLL(None), "renameat2", None)
    return swap is not None and swap(HERE, bytes(one), HERE, bytes(other), EXCHANGE) == 0


def held(folder: Path) -> int:
    """The number of an open folder that other commands see to be held.

    Raises
    ------
    OSError
        When another command holds it.
    """
    number = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(number)
        raise
    return number


def sweep(folder: Path) -> None:
    """Remove what killed commands left aside."""
    for room in (folder.parent, folder):
        for left in room.glob(f".{glob.escape(folder.name)}-*.part"):
            with contextlib.suppress(OSError):
                if time.time() - left.stat().st_mtime > ABANDONED:
                    os.close(held(left))
                    shutil.rmtree(left)
