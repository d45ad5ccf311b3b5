"""Find a machine file, by bundled name or by path, and read it as TOML."""

from __future__ import annotations

import difflib
import importlib.resources
import os
import re
import stat
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources.abc import Traversable
from pathlib import Path

from flipflow.errors import InputError

LARGEST = 1_000_000
_LINE = re.compile(r"\(at line (\d+), column \d+\)")


@dataclass(frozen=True)
class Source:
    """A machine file as TOML tables, with the name and, unless bundled, the path it came from."""

    tables: Mapping[str, object]
    name: str
    path: Path | None


def bundled_names() -> tuple[str, ...]:
    """Return the names of the machines that come with flipflow.

    Returns
    -------
    tuple of str
        Names that :func:`flipflow.load` takes in place of a path.
    """
    return tuple(
        sorted(
            entry.name.removesuffix(".toml")
            for entry in _machines().iterdir()
            if entry.name.endswith(".toml")
        )
    )


def read_source(name_or_path: str | os.PathLike[str]) -> Source:
    """Read a bundled machine or a machine file.

    Parameters
    ----------
    name_or_path
        Bundled name, or path of a TOML file of at most 1 MB.

    Returns
    -------
    Source
        Its tables, unchecked.

    Raises
    ------
    InputError
        When there is no such file, or it is a folder, empty, too large, not UTF-8 or not TOML.
    """
    if isinstance(name_or_path, str) and name_or_path in bundled_names():
        return Source(tomllib.loads(bundled_text(name_or_path)), name_or_path, None)
    if not isinstance(name_or_path, (str, os.PathLike)):
        raise InputError("machine file", name_or_path, "give a bundled name or a path")
    path = Path(name_or_path)
    text = _decoded(path, _content(path))
    return Source(_tables(path, text), path.stem, path)


def bundled_text(name: str) -> str:
    """The file of a bundled machine as it stands, comments included."""
    return (_machines() / f"{name}.toml").read_text(encoding="utf-8")


def _machines() -> Traversable:
    return importlib.resources.files("flipflow.io") / "machines"


def _check_kind(path: Path, status: os.stat_result) -> None:
    """Refuse what is no file of a machine's size."""
    if stat.S_ISDIR(status.st_mode):
        raise InputError("machine file", str(path), "this is a folder, name the .toml file in it")
    if not stat.S_ISREG(status.st_mode):
        raise InputError("machine file", str(path), "this is not a file, give a .toml file")
    if status.st_size > LARGEST:
        raise InputError(
            "machine file", str(path),
            f"it has {status.st_size / 1e6:.3g} MB, give a machine file of at most 1 MB",
        )  # fmt: skip


def _content(path: Path) -> bytes:
    """Read the file, but look at its kind and size before."""
    try:
        _check_kind(path, path.stat())
        return path.read_bytes()
    except FileNotFoundError:
        raise InputError("machine file", str(path), _missing(path)) from None
    except InputError:
        raise
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise InputError(
            "machine file", str(path), f"it cannot be read ({reason}), give a readable .toml file"
        ) from None


def _missing(path: Path) -> str:
    names = bundled_names()
    near = difflib.get_close_matches(path.stem.lower(), names, n=1, cutoff=0.6)
    hint = f"; did you mean {near[0]!r}? Give" if near else ", give"
    return f"there is no such file{hint} a path or a bundled name ({', '.join(names)})"


def _decoded(path: Path, content: bytes) -> str:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError(
            "machine file", str(path), f"line {line} is not UTF-8 text, save the file as UTF-8"
        ) from None
    if not text.strip():
        raise InputError(
            "machine file", str(path), "it is empty, 'flipflow new NAME.toml' writes a template"
        )
    return text


def _tables(path: Path, text: str) -> Mapping[str, object]:
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InputError(
            "machine file", str(path), "it is nested too deeply, write sections and keys only"
        ) from None
    except ValueError as error:
        raise InputError("machine file", str(path), _syntax(text, str(error))) from None


def _syntax(text: str, message: str) -> str:
    """Say where TOML breaks, and the two slips that are behind most of it."""
    lines = text.splitlines()
    found = _LINE.search(message)
    number = int(found.group(1)) if found else len(lines)
    line = lines[number - 1].strip() if 0 < number <= len(lines) else ""
    reason = _LINE.sub("", message.replace("(at end of document)", "")).strip()
    shown = line if len(line) <= 50 else line[:47] + "..."
    return (
        f"line {number} is not valid TOML, {shown!r} ({reason[:1].lower()}{reason[1:]}), "
        'write quantities in quotes, for example "916 kg", and close every quote and bracket'
    )
