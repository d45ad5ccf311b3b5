"""A commented machine file to start from, generated from the layout."""

from __future__ import annotations

import json
import os
import textwrap
from pathlib import Path

from flipflow.errors import InputError
from flipflow.io.layout import FORMAT, SECTION_SENTENCES, SECTIONS, Entry, toml, unchecked_without
from flipflow.results.store import write_file

_HEAD = f"""\
# A machine file of flipflow. The values are those of no real machine: replace every one.
# Quantities stand in quotes with their unit, "916 kg", "2700 kN/m", "850 rpm", and a decimal
# point. What is unknown is left out: flipflow says what it then cannot check, and guesses nothing.
# A line that starts with # is not read.
format = {FORMAT}
"""

# Keys that say in other words what another key says already: shown, but commented out.
_ALTERNATIVES = frozenset(
    {
        "stops.clearance_minus", "stops.temperature_factor", "drive.torque_table",
        "drive.switch_over_speed", "drive.switch_over_time", "drive.ramp", "drive.ramp_time",
        "drive.torque_limit",
    }
)  # fmt: skip


def template() -> str:
    """Return a commented machine file; as it is, it describes a generic screen.

    Returns
    -------
    str
        TOML that loads as it stands.
    """
    sections = [
        _section(name, SECTIONS[name]) for name in SECTIONS if name not in {"load_cases", "sources"}
    ]
    return "\n".join([_HEAD, *sections, _load_cases(), _sources()])


def write_template(path: str | os.PathLike[str], text: str | None = None) -> Path:
    """Write the template to a new file.

    Parameters
    ----------
    path
        Path that ends in ``.toml``; an existing file is never overwritten.
    text
        What to write; None: the template of a machine file.

    Returns
    -------
    Path
        Where it was written.

    Raises
    ------
    InputError
        When the file exists, or does not end in ``.toml``.
    StoreError
        When it cannot be written.
    """
    target = Path(path)
    if target.suffix != ".toml":
        raise InputError("file", str(target), "let the name end in .toml")
    write_file(target, template() if text is None else text, "file", fresh=True)
    return target


def _section(name: str, entries: tuple[Entry, ...]) -> str:
    lines = [f"# {SECTION_SENTENCES[name]}", f"[{name}]"]
    for entry in entries:
        lines += _lines(entry)
    return "\n".join(lines) + "\n"


def _lines(entry: Entry) -> list[str]:
    """Write one key, its sentence above it; pieces and alternatives are commented out."""
    if entry.kind == "each":
        return []
    words = entry.sentence
    if entry.choices[1:]:
        words += f" One of {', '.join(map(json.dumps, entry.choices))}."
    if entry.field is not None and entry.field.count is not None:
        words += f" Or {entry.key}_each, of one piece."
    if entry.field is not None and (lost := unchecked_without(entry.field)):
        words += f" Left out, not checked: {lost}."
    off = "# " if entry.label in _ALTERNATIVES else ""
    return [*_comment(words), f"{off}{entry.key} = {toml(entry.example)}"]


def _comment(words: str) -> list[str]:
    return textwrap.wrap(words, 96, initial_indent="# ", subsequent_indent="# ")


def _load_cases() -> str:
    lines = [
        f"# {SECTION_SENTENCES['load_cases']}",
        "# A case may hold, and leave out what does not apply:",
    ]
    for entry in SECTIONS["load_cases"]:
        lines += [f"#   {entry.key} = {toml(entry.example)}", *_indented(entry.sentence)]
    cases = (
        ("empty", ()),
        ("full", ("material", "split_main_floating")),
        ("full, stiffening", ("shear_stiffness_factor",)),
        ("hot", ("temperature",)),
    )
    examples = {entry.key: entry.example for entry in SECTIONS["load_cases"]}
    for name, keys in cases:
        lines += ["", "[[load_cases]]", f"name = {toml(name)}"]
        lines += [f"{key} = {toml(examples[key])}" for key in keys]
    return "\n".join(lines) + "\n"


def _indented(words: str) -> list[str]:
    return textwrap.wrap(words, 90, initial_indent="#       ", subsequent_indent="#       ")


def _sources() -> str:
    return f'# {SECTION_SENTENCES["sources"]}\n[sources]\n# "frames.main_mass" = "weighed"\n'
