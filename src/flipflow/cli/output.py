"""Where commands write: an 80-column console, and JSON documents."""

from __future__ import annotations

import json
import math
import os
import shutil
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from flipflow.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console

COLUMNS = 80
TERMINAL = "-"
JSON = "--json"


def console() -> Console:
    """Return a console of at most 80 columns that takes text as it is, brackets included."""
    from rich.console import Console  # noqa: PLC0415  slow to import

    width = min(shutil.get_terminal_size().columns, COLUMNS)
    return Console(width=max(width, 40), highlight=False, markup=False, emoji=False)


def print_list(out: Console, title: str, lines: Iterable[str]) -> None:
    """Print a titled list whose lines wrap under their own beginning; nothing where it is empty."""
    from rich.padding import Padding  # noqa: PLC0415  slow to import

    lines = tuple(lines)
    if lines:
        out.print(f"\n{title}", style="bold")
    for line in lines:
        out.print(Padding(line, (0, 0, 0, 2)))


def printable(text: str) -> str:
    """Blanks for control characters, which a terminal would act on."""
    return "".join(c if c.isprintable() else " " for c in text)


def check_json(target: str) -> None:
    """See that a document can be written to ``target``, before there is one.

    Raises
    ------
    InputError
        For a folder, a file in a folder that is not there, and what is not the user's to write.
    """
    path = Path(target)
    if target == TERMINAL:
        return
    if not target or "\0" in target:
        raise InputError(JSON, target, "name a file, or - for the terminal")
    if path.is_dir():
        raise InputError(JSON, target, "this is a folder, name a file in it")
    if not path.parent.is_dir():
        raise InputError(
            JSON, target, f"there is no folder {str(path.parent)!r}, make it or name another"
        )
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise InputError(JSON, target, "it may not be written, name a file in a folder you own")


def write_json(document: Mapping[str, object], target: str) -> None:
    """Write a document to a file, or to stdout for ``-``; what is not finite becomes null.

    Raises
    ------
    InputError
        When the file cannot be written.
    """
    text = json.dumps(_finite(document), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    if target == TERMINAL:
        sys.stdout.write(text)
        return
    try:
        Path(target).write_text(text, encoding="utf-8")
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise InputError(
            JSON, target, f"it cannot be written ({reason}), name a file in a folder you own"
        ) from None


def _finite(value: object) -> object:
    if isinstance(value, Mapping):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(inner) for inner in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
