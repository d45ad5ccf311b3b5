"""Files and folders to write into."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from flipflow.errors import InputError


def prepare_folder(folder: Path) -> None:
    """Make an output folder and see that it can be written, before anything is computed.

    Raises
    ------
    InputError
        When it cannot.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        in_the_way = isinstance(error, (FileExistsError, NotADirectoryError))
        reason = "a file is in its way" if in_the_way else error.strerror
        remedy = f"it cannot be written ({reason}), name a folder you own"
        raise InputError("--output", str(folder), remedy) from None


def write_file(target: Path, content: bytes) -> None:
    """Write a whole file or nothing."""
    try:
        with tempfile.NamedTemporaryFile(dir=target.parent, delete=False) as part:
            whole = Path(part.name)
            try:
                part.write(content)
                part.flush()
                # A temporary file is its owner's alone; a result is as readable as any other file.
                whole.chmod(0o666 & ~_umask())
                whole.replace(target)
            finally:
                whole.unlink(missing_ok=True)
    except OSError as error:
        remedy = f"it cannot be written ({error.strerror}); name a file in a folder you own"
        raise InputError("path", str(target), remedy) from None


def _umask() -> int:
    current = os.umask(0)
    os.umask(current)
    return current
