"""What may vary, as written on the command line: ``clearance=5.4 mm..6.6 mm``."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping

from flipflow.errors import InputError
from flipflow.io.units import parse_quantity
from flipflow.model.fields import FIELD, Field
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.vary import Normal, variations

OPTION = "--vary"
EXAMPLE = 'write for example "clearance=5.4 mm..6.6 mm"'
PLUS_MINUS, SPREAD = "+-", "+/-"
BY_KEY: Mapping[str, Field] = {field.key: field for field in FIELD.values()}


def read_vary(words: Iterable[str], screen: FlipFlowScreen) -> dict[str, object]:
    """Convert words to the mapping that analyses take, SI.

    A word is ``field=low..high`` (uniform), ``field=+-5 %`` (uniform about the machine's value) or
    ``field=mean +/- std`` (normal). The field is named as in Python or by its key in the file.

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
        field = _field(name, word)
        if field.name in found:
            raise InputError(OPTION, word, f"{field.name} is given twice, name each field once")
        found[field.name] = _checked(field, text, word, screen)
    if not found:
        raise InputError(OPTION, "(left out)", EXAMPLE)
    return found


def _field(name: str, word: str) -> Field:
    known = {**FIELD, **BY_KEY}
    if name not in known:
        near = difflib.get_close_matches(name, known, n=1)
        hint = f"perhaps {near[0]!r} is meant" if near else "name a field such as clearance"
        raise InputError(OPTION, word, f"the field {name!r} is not known, {hint}")
    return known[name]


def _checked(field: Field, text: str, word: str, screen: FlipFlowScreen) -> object:
    """A range that analyses take; what they would refuse names the option as it was written."""
    if field.whole:
        raise InputError(OPTION, word, f"{field.name} is counted, vary what has values between")
    given = _range(field, text, word, screen)
    if isinstance(given, tuple) and not given[0] < given[1]:
        raise InputError(OPTION, word, "the range is empty or reversed, give the lower end first")
    try:
        variations({field.name: given}, screen)
    except InputError as error:
        raise InputError(OPTION, word, error.remedy) from None
    return given


def _range(field: Field, text: str, word: str, screen: FlipFlowScreen) -> object:
    if text.startswith(PLUS_MINUS):
        return _about(field, text.removeprefix(PLUS_MINUS), word, screen)
    if SPREAD in text:
        mean, std = (_number(field, part) for part in text.split(SPREAD, 1))
        if not std > 0.0:
            raise InputError(OPTION, word, "give a standard deviation above 0")
        return Normal(mean, std)
    low, dots, high = text.partition("..")
    if not dots:
        raise InputError(OPTION, word, EXAMPLE)
    return _number(field, low), _number(field, high)


def _about(field: Field, text: str, word: str, screen: FlipFlowScreen) -> tuple[float, float]:
    value = getattr(screen, field.name)
    share = parse_quantity(text.strip(), "", field=f"{OPTION} {field.name}", example="5 %")
    if value is None or value in (0.0, float("inf")):
        raise InputError(OPTION, word, "the machine has no value to vary about, give low..high")
    if not 0.0 < share < 1.0:
        raise InputError(OPTION, word, "give a share between 0 % and 100 %")
    return value * (1.0 - share), value * (1.0 + share)


def _number(field: Field, text: str) -> float:
    name = f"{OPTION} {field.name}"
    return parse_quantity(text.strip(), field.unit, field=name, example=str(field.example))
