"""A rendered figure or drawing as a file, in the format that the name's ending tells."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

from flipflow.errors import InputError
from flipflow.model.arguments import checked_path
from flipflow.results.store import write_file


def write_rendered(
    path: str | os.PathLike[str], formats: Sequence[str], rendered: Callable[[str], bytes]
) -> Path:
    """Write what ``rendered`` makes for the path's ending, one of ``formats``; the file.

    Raises
    ------
    InputError
        For another ending.
    StoreError
        When the file cannot be written.
    """
    target = checked_path("path", path)
    ending = target.suffix.lower()
    if ending not in formats:
        raise InputError("path", str(path), f"give a name that ends in {', '.join(formats)}")
    write_file(target, rendered(ending))
    return target
