"""Where files are written: whole or not at all, or refused in one sentence.

Nothing here loads numpy, so that the command line refuses a file before it loads anything.
"""

from __future__ import annotations

import contextlib
import json
import os
import stat
import tempfile
import uuid
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from flipflow.errors import InputError, StoreError
from flipflow.signals import undisturbed

AS_WRITTEN: Any = {"ensure_ascii": False, "allow_nan": False}
MOST_SHOWN = 300  # characters of a path that a sentence shows


def json_text(document: Mapping[str, object]) -> str:
    """A document as it stands in a file or in the terminal, a line for each of its parts."""
    # An indentation throughout would take Python's slow encoder, and a line for every number.
    written = {part: json.dumps(document[part], **AS_WRITTEN) for part in document}
    lines = (f"{json.dumps(part, **AS_WRITTEN)}: {text}" for part, text in written.items())
    return "{\n" + ",\n".join(lines) + "\n}\n"


def write_file(
    target: str | Path, content: bytes | str, field: str = "path", *, fresh: bool = False
) -> None:
    """Write a whole file or nothing, text in UTF-8; where ``fresh`` one that exists is refused.

    The content is written beside the file under a name of its own, which is then changed: a reader
    sees the old file or the new one. A link is followed, and a file keeps its mode. A device or a
    pipe is written to as it is. ``field`` is the argument or option that a sentence names.

    Raises
    ------
    StoreError
        When it cannot be written.
    InputError
        When it exists and may not.
    """
    content = as_bytes(content)
    place = checked_place(target, field)
    try:
        if not fresh and place.exists() and not place.is_file():
            place.write_bytes(content)
        else:
            with undisturbed():
                (_put_new if fresh else _put)(place, content)
    except FileExistsError:
        remedy = "it exists and is not overwritten, choose another name"
        raise InputError(field, str(target), remedy) from None
    except OSError as error:
        raise refused(field, target, because(error)) from None


def checked_place(target: str | Path, field: str = "path") -> Path:
    """Where a file stands or will stand, links followed.

    Raises
    ------
    StoreError
        For a folder, a file in a folder that is not there, and what is not the user's to write.
    """
    named = Path(target)
    try:
        mode = named.stat().st_mode
    except FileNotFoundError:
        mode = 0
    except (OSError, ValueError) as error:
        raise refused(field, target, because(error)) from None
    if stat.S_ISDIR(mode):
        raise refused(field, target, "it cannot be written (this is a folder), name a file in it")
    if mode and not stat.S_ISREG(mode):
        return named
    place = Path(os.path.realpath(named))
    if not place.parent.is_dir():
        # A link may lead to a file in a folder that is not there.
        missing = place.parent if named.parent.is_dir() else named.parent
        why = f"it cannot be written (there is no folder {str(missing)!r})"
        raise refused(field, target, f"{why}, make it or name another")
    if not all(os.access(one, os.W_OK) for one in ([place] if mode else []) + [place.parent]):
        raise refused(field, target, "it may not be written, name a file in a folder you own")
    return place


def prepare_folder(folder: Path, field: str) -> None:
    """Make an output folder and see that it can be written, before anything is computed.

    Raises
    ------
    StoreError
        When it cannot.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except (FileExistsError, NotADirectoryError):
        why = "it cannot be written (a file is in its way), name a folder you own"
        raise refused(field, folder, why) from None
    except (OSError, ValueError) as error:
        raise refused(field, folder, because(error, "a folder")) from None


def refuse_input(target: str | Path, inputs: Iterable[str], field: str) -> None:
    """See that a file to write is none of those that are read, by whatever name.

    Raises
    ------
    InputError
        When it is.
    """
    if any(_same(target, one) for one in inputs):
        remedy = "this is the file that is read, name another to write"
        raise InputError(field, str(target), remedy)


def _same(target: str | Path, other: str) -> bool:
    """Whether both are names of one file that exists."""
    try:
        return Path(target).samefile(other)
    except (OSError, ValueError):
        return False


def write_beside(place: Path, content: bytes | str) -> Path:
    """Write a whole file beside its place, with the mode of the one that stands there.

    Raises
    ------
    OSError
        When it cannot be written; nothing is left.
    """
    part = place.with_name(f".{uuid.uuid4().hex}.part")
    try:
        with part.open("xb") as file:
            file.write(as_bytes(content))
            file.flush()
            if place.exists():
                part.chmod(stat.S_IMODE(place.stat().st_mode))
            os.fsync(file.fileno())
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    return part


def sync_folder(folder: Path) -> None:
    """See that the names in a folder are on the disk; some file systems cannot."""
    with contextlib.suppress(OSError):
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


def as_bytes(content: bytes | str) -> bytes:
    """Text in UTF-8; half of a surrogate pair has none, JSON reads its escape as what it was."""
    return content.encode(errors="backslashreplace") if isinstance(content, str) else content


def _put(place: Path, content: bytes) -> None:
    """Write beside a file, then take its place."""
    part = write_beside(place, content)
    try:
        part.replace(place)
    finally:
        part.unlink(missing_ok=True)


def _put_new(place: Path, content: bytes) -> None:
    """Write a file that is not there yet; its name is taken first, from other processes too."""
    place.touch(exist_ok=False)
    try:
        _put(place, content)
    except BaseException:
        place.unlink()
        raise


def because(error: OSError | ValueError, what: str = "a file in a folder") -> str:
    """Why writing ended, and what to do: the second half of a sentence of :func:`refused`."""
    reason = error.strerror if isinstance(error, OSError) else str(error)
    if isinstance(error, ValueError) and "null" in str(error):  # every Python has its own words
        reason = "its name holds a null byte"
    return f"it cannot be written ({reason}), name {what} you own"


def refused(field: str, target: str | Path, why: str) -> StoreError:
    """The error that says where nothing can be written, and why."""
    shown = repr(str(target))
    shown = shown if len(shown) <= MOST_SHOWN else f"{shown[: MOST_SHOWN - 3]}..."
    return StoreError(f"{field} = {shown}: {why}.")
