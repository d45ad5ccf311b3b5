"""Blows as words on the command line: ``2 s: main 300``."""

from __future__ import annotations

from flipflow.errors import InputError, as_written
from flipflow.io.units import parse_quantity
from flipflow.model.disturbance import Impulse

FRAMES = ("main", "floating", "relative")
EXAMPLE = "'2 s: main 300'"


def parse_blow(text: str, field: str) -> Impulse:
    """A blow from its time, its frame and its impulse in kg m/s.

    Raises
    ------
    InputError
        Naming ``field`` and what is wrong.
    """
    when, colon, what = text.partition(":")
    words = what.split()
    if not colon or len(words) != 2 or words[0] not in FRAMES:
        frames = ", ".join(FRAMES)
        raise InputError(field, text, f"write time, frame ({frames}) and kg m/s, as {EXAMPLE}")
    try:
        size = float(words[1])
    except ValueError:
        raise InputError(field, text, f"give the impulse as a number, as {EXAMPLE}") from None
    t = parse_quantity(when.strip(), "s", field=field, example="2 s")
    with as_written(field, text):
        return Impulse(t, words[0], size)
