"""What a load case is called within a sentence."""

from __future__ import annotations

import re

from flipflow.model.numerals import capitalized

OWN_WORD = re.compile(r"(load )?case\b", re.IGNORECASE)


def case_words(name: str, *, capital: bool = False) -> str:
    """Write "case hot" for "hot"; a name such as "case 29" has the word already."""
    words = name if OWN_WORD.match(name) else f"case {name}"
    return capitalized(words) if capital else words
