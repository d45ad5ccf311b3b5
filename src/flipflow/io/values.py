"""Values of one section of a machine file, each read as its entry says."""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, field

from flipflow.errors import InputError, as_written
from flipflow.io.layout import Entry, each_of, entry_of
from flipflow.io.units import as_toml, parse_quantity, shown
from flipflow.model.fields import FIELD, Field

Table = Mapping[str, object]

# A total and the sum of its pieces may differ by the rounding of a catalogue value.
ROUNDING = 1e-3


class _LeftOut:
    """Stands in error sentences for a value that is not there."""

    def __repr__(self) -> str:
        return "(left out)"


LEFT_OUT = _LeftOut()


@dataclass
class Notes:
    """What is noted while a file is read: values as written, what was assumed, sums of pieces."""

    written: dict[str, object] = field(default_factory=dict)
    assumed: list[str] = field(default_factory=list)
    sums: dict[str, str] = field(default_factory=dict)


def read_number(written: object, of: Field, *, label: str | None = None) -> float:
    """Convert one number of the file to SI and check what physics allows.

    Raises
    ------
    InputError
        Naming ``label`` (the field's key unless given) and the value as written.
    """
    name = label or of.key
    value = parse_quantity(
        _counted(written, of, name),
        of.unit,
        field=name,
        example=str(of.example),
        allow_infinite=of.infinite,
    )
    with as_written(name, written, f", for example {of.example!r}"):
        of.check(value)
    return value


def read_interval(written: object, of: Field) -> tuple[float, float]:
    """Convert ``["5 mm", "8 mm"]`` to SI; the lesser end comes first."""
    if not isinstance(written, list) or len(written) != 2:
        raise InputError(of.key, written, _two_ends(written, of))
    low, high = (_end(end, of, index) for index, end in enumerate(written))
    if not low < high:
        raise InputError(of.key, written, "give the lesser value first and a greater one second")
    return low, high


def read_total(table: Table, of: Field, count: float | None, notes: Notes) -> float | None:
    """Read a total that may be given in pieces; None when neither is there.

    Raises
    ------
    InputError
        When the total contradicts its pieces; the sentence names both.
    """
    entry, each = entry_of(of), each_of(of)
    total = None
    if entry.key in table:
        total = read_number(table[entry.key], of)
        notes.written[entry.label] = table[entry.key]
    if each is None or each.key not in table:
        return total
    written = table[each.key]
    one = read_number(written, of, label=each.label)
    notes.written[each.label] = written
    counter = FIELD[str(of.count)].key
    if count is None:
        raise InputError(each.label, written, f"say how many there are with {counter}")
    total_of_pieces = count * one
    sum_text = f"{count:g} x {written} = {shown(total_of_pieces, of.file_unit, of.unit)}"
    if total is not None and not math.isclose(total, total_of_pieces, rel_tol=ROUNDING):
        raise InputError(
            entry.label,
            table[entry.key],
            f"it contradicts its pieces, {sum_text}, correct one of them or {counter}",
        )
    notes.sums[entry.label] = sum_text
    return total_of_pieces if total is None else total


def read_choice(table: Table, entry: Entry, notes: Notes, *, default: str) -> str:
    """Read one of the words an entry allows; left out, the default is noted as assumed."""
    if entry.key not in table:
        notes.assumed.append(f'{entry.label} = "{default}"')
        return default
    written = notes.written[entry.label] = table[entry.key]
    if not isinstance(written, str) or written not in entry.choices:
        raise InputError(entry.label, written, f"choose one of {', '.join(entry.choices)}")
    return written


def read_text(table: Table, entry: Entry, *, label: str | None = None, lines: bool = True) -> str:
    """Read text; a number or a boolean is refused, and what :func:`checked_words` refuses."""
    written = table.get(entry.key, "")
    if not isinstance(written, str):
        raise InputError(label or entry.label, written, 'write text in quotes, for example "A"')
    return checked_words(written, label or entry.label, lines=lines)


def checked_words(written: str, label: str, *, lines: bool = True) -> str:
    """Text that any program can show: without control characters, but line breaks where ``lines``.

    Raises
    ------
    InputError
        Naming ``label``, the character and its place.
    """
    for place, character in enumerate(written, 1):
        if unicodedata.category(character) == "Cc" and not (lines and character == "\n"):
            what = f"character {place} is a control character (U+{ord(character):04X})"
            raise InputError(label, written, f"{what}, remove it")
    return written


def read_temperatures(written: object, label: str) -> tuple[tuple[float, float], ...]:
    """Read rows of temperature and stiffness factor, rising in temperature."""
    shape = 'give rows such as [["-10 degC", 1.15], ["50 degC", 0.85]]'
    if not isinstance(written, list) or not written:
        raise InputError(label, written, shape)
    rows: list[tuple[float, float]] = []
    for row in written:
        if not isinstance(row, list) or len(row) != 2:
            raise InputError(label, row, shape)
        temperature = parse_quantity(row[0], "degC", field=label)
        factor = parse_quantity(row[1], "", field=label, example="1.15")
        if factor <= 0.0:
            raise InputError(label, row[1], "give a factor above 0, for example 1.15")
        if rows and temperature <= rows[-1][0]:
            raise InputError(label, row[0], "list temperatures in rising order")
        rows.append((temperature, factor))
    return tuple(rows)


def read_torques(written: object, label: str) -> tuple[list[tuple[float, float]], bool]:
    """Read rows of speed and torque in rad/s and N m, or shares; whether they are in N m."""
    shape = 'give rows such as [["0 rpm", 2.0], ["1440 rpm", 1.0]] or ["0 rpm", "70 N m"]'
    if not isinstance(written, list) or len(written) < 2:
        raise InputError(label, written, shape)
    in_torque = isinstance(written[0], list) and any("N m" in str(one) for one in written[0])
    rows = []
    for row in written:
        if not isinstance(row, list) or len(row) != 2:
            raise InputError(label, row, shape)
        speed = parse_quantity(row[0], "rad/s", field=label)
        unit, example = ("N m", "70 N m") if in_torque else ("", "2.0")
        rows.append((speed, parse_quantity(row[1], unit, field=label, example=example)))
    return rows, in_torque


def _two_ends(written: object, of: Field) -> str:
    """What to write where least and greatest belong; one end alone is taken as the greatest."""
    least, most = of.example if isinstance(of.example, tuple) else ("", "")
    key = of.key.rpartition(".")[2]
    remedy = f'least and greatest belong here, write for example {key} = ["{least}", "{most}"]'
    one = written[0] if isinstance(written, list) and len(written) == 1 else written
    try:
        value = parse_quantity(one, of.unit, field=of.key)
    except InputError:
        return remedy
    zero = shown(0.0, of.file_unit, of.unit)
    return f'{remedy}, or {key} = ["{zero}", "{one}"] for at most {one}' if value > 0.0 else remedy


def _counted(written: object, of: Field, name: str) -> object:
    """Refuse text where pieces are counted; a ratio may be text, "20 %"."""
    if of.whole and (isinstance(written, bool) or not isinstance(written, (int, float))):
        quotes = " without quotes" if isinstance(written, str) else ""
        remedy = f"write a whole number{quotes}, for example {of.example}"
        raise InputError(name, as_toml(written), remedy)
    return written


def _end(written: object, of: Field, index: int) -> float:
    example = of.example[index] if isinstance(of.example, tuple) else ""
    value = parse_quantity(written, of.unit, field=of.key, example=example)
    with as_written(of.key, written, f", for example {example!r}"):
        of.check(value)
    return value
