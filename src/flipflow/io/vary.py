"""What may vary, as written on the command line: ``clearance=5.4 mm..6.6 mm``."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping

from flipflow.errors import InputError, as_written
from flipflow.io.units import parse_quantity
from flipflow.model.fields import FIELD, Field
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.vary import Normal, variations

OPTION = "--vary"
EXAMPLE = 'write for example "clearance=5.4 mm..6.6 mm"'
REVERSED = "the range is empty or reversed, give the lower end first"
PLUS_MINUS, SPREAD, EACH = "+-", "+/-", "_each"
BY_KEY: Mapping[str, Field] = {field.key: field for field in FIELD.values()}
WORDS = ", ".join(key for key, field in BY_KEY.items() if not field.whole)


def read_vary(words: Iterable[str], screen: FlipFlowScreen) -> dict[str, object]:
    """Convert words to the mapping that analyses take, SI.

    A word is ``field=low..high`` (uniform), ``field=+-5 %`` or ``field=+-0.5 mm`` (uniform about
    the machine's value) or ``field=mean +/- std`` (normal). The field is named as in Python, by its
    place in the file such as ``stops.clearance``, or by its last part where no other section has
    it. ``_each`` behind a name means one piece.

    Raises
    ------
    InputError
        For a word that cannot be read, a field named twice, and a value with a wrong unit.
    """
    found: dict[str, object] = {}
    for word in words:
        name, sign, text = (part.strip() for part in word.partition("="))
        if not sign or not text:
            raise InputError(OPTION, word, EXAMPLE)
        name, count = _pieces(name, word, screen)
        field = field_named(name, word)
        if field.name in found:
            raise InputError(OPTION, word, f"{field.name} is given twice, name each field once")
        found[field.name] = _checked(field, text, word, screen, count)
    if not found:
        raise InputError(OPTION, "(left out)", f"{EXAMPLE}, the field one of {WORDS}")
    return found


def field_named(name: str, word: str) -> Field:
    """A field by its name, its place in the file, or the last part of that.

    Raises
    ------
    InputError
        For what names no field, or several; ``word`` is what was written.
    """
    if name in FIELD:
        return FIELD[name]
    fitting = [key for key in BY_KEY if name in (key, key.rpartition(".")[2])]
    if len(fitting) == 1:
        return BY_KEY[fitting[0]]
    if fitting:
        raise InputError(OPTION, word, f"{name!r} may be {' or '.join(fitting)}, write one of them")
    near = difflib.get_close_matches(name, [*FIELD, *BY_KEY], n=1)
    hint = f"perhaps {near[0]!r} is meant; " if near else ""
    raise InputError(OPTION, word, f"the field {name!r} is not known, {hint}choose one of {WORDS}")


def _pieces(name: str, word: str, screen: FlipFlowScreen) -> tuple[str, float]:
    """The name of a total, and how many pieces make it where one piece is named."""
    total = name.removesuffix(EACH)
    if total == name:
        return name, 1.0
    counter = field_named(total, word).count
    if counter is None:
        raise InputError(OPTION, word, f"{total} is not made of pieces, leave {EACH} out")
    count = getattr(screen, counter)
    if count is None:
        raise InputError(OPTION, word, f"say in the machine file how many: {FIELD[counter].key}")
    return total, float(count)


def _checked(field: Field, text: str, word: str, screen: FlipFlowScreen, count: float) -> object:
    """A range that analyses take; what they would refuse names the option as it was written."""
    if field.whole:
        raise InputError(OPTION, word, f"{field.name} is counted, vary what has values between")
    given = _range(field, text, word, screen, count)
    if isinstance(given, tuple) and not given[0] < given[1]:
        raise InputError(OPTION, word, REVERSED)
    with as_written(OPTION, word):
        variations({field.name: given}, screen)
    return given


def _range(field: Field, text: str, word: str, screen: FlipFlowScreen, count: float) -> object:
    if text.startswith(PLUS_MINUS):
        return _about(field, text.removeprefix(PLUS_MINUS).strip(), word, screen, count)
    if text.startswith(SPREAD):
        remedy = (
            f'give the mean before "{SPREAD}", or write "{PLUS_MINUS}" about the machine\'s value'
        )
        raise InputError(OPTION, word, remedy)
    if SPREAD in text:
        mean, std = (count * _number(field, part) for part in text.split(SPREAD, 1))
        if not std > 0.0:
            raise InputError(OPTION, word, "give a standard deviation above 0")
        return Normal(mean, std)
    low, dots, high = text.partition("..")
    if not dots:
        raise InputError(OPTION, word, EXAMPLE)
    return count * _number(field, low), count * _number(field, high)


def _about(
    field: Field, text: str, word: str, screen: FlipFlowScreen, count: float
) -> tuple[float, float]:
    """An interval about the machine's own value: by a share of it, or by so much in its unit."""
    value = getattr(screen, field.name)
    if value is None or value in (0.0, float("inf")):
        raise InputError(OPTION, word, "the machine has no value to vary about, give low..high")
    if field.unit and any(one.isalpha() or one == "°" for one in text.lower().replace("e", "")):
        wide = count * _number(field, text)
        if not wide > 0.0:
            raise InputError(OPTION, word, "give a tolerance above 0")
        return value - wide, value + wide
    share = parse_quantity(text, "", field=f"{OPTION} {field.name}", example="5 %")
    if not 0.0 < share < 1.0:
        remedy = "give a share between 0 % and 100 % with its sign, such as 10 %"
        raise InputError(OPTION, word, remedy)
    return value * (1.0 - share), value * (1.0 + share)


def _number(field: Field, text: str) -> float:
    name = f"{OPTION} {field.name}"
    return parse_quantity(text.strip(), field.unit, field=name, example=str(field.example))
