"""What the paper says, and how a statement is decided by computed numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

Data = TypeVar("Data")
AGREEMENT = 0.02


class Verdict(StrEnum):
    """What became of a claim."""

    HOLDS = "holds"
    IN_PART = "holds in part"
    FAILS = "does not hold"
    UNDECIDED = "cannot be decided"


@dataclass(frozen=True)
class Number:
    """A computed number in the unit the paper uses; None where there is none."""

    value: float | None
    unit: str = ""


# A name, or a row and a column of a table: ("width of the operating region", "2 mm").
Name = str | tuple[str, str]
Numbers = Mapping[Name, Number]


Answer = bool | None
Words = Mapping[Answer, str]
WORDS: Words = {True: "holds", False: "does not hold", None: "cannot be decided"}
# For what is within the noise of its rival.
WORDS_OF_TIES: Words = {**WORDS, None: "a tie"}


@dataclass(frozen=True)
class Part:
    """One thing a claim says; ``answer`` is None where it cannot be decided."""

    what: str
    answer: Answer


@dataclass(frozen=True)
class Evaluation:
    """The verdict on a claim and what it rests on.

    Parameters
    ----------
    verdict
        What became of it.
    numbers
        Computed numbers.
    where
        A sentence on where it holds, where it does not hold everywhere.
    parts
        What it says, one thing after the other, and whether that holds.
    words
        What the answers to the parts are called.
    note
        What else there is to say of it.
    """

    verdict: Verdict
    numbers: Numbers = field(default_factory=dict)
    where: str = ""
    parts: tuple[Part, ...] = ()
    words: Words = field(default_factory=lambda: WORDS)
    note: str = ""


@dataclass(frozen=True)
class Claim(Generic[Data]):
    """A statement of the paper.

    Parameters
    ----------
    id
        Its number in the list of claims, for example "M1".
    where
        Place in the paper.
    statement
        What is claimed, in a sentence.
    evaluate
        From what a figure computed to the verdict.
    """

    id: str
    where: str
    statement: str
    evaluate: Callable[[Data], Evaluation]


@dataclass(frozen=True)
class DecidedClaim:
    """A claim with its evaluation on one machine."""

    claim: Claim[Any]
    figure: str
    evaluation: Evaluation

    def document(self) -> dict[str, Any]:
        """JSON types: id, verdict, statement, numbers, and where in paper and range."""
        return {
            "id": self.claim.id,
            "verdict": str(self.evaluation.verdict),
            "statement": self.claim.statement,
            "where": self.claim.where,
            "figure": self.figure,
            "holds_where": self.evaluation.where,
            "note": self.evaluation.note,
            "parts": [
                {"what": part.what, "answer": self.evaluation.words[part.answer]}
                for part in self.evaluation.parts
            ],
            "numbers": {
                flat(name): {"value": _finite(one.value), "unit": one.unit}
                for name, one in self.evaluation.numbers.items()
            },
            "names_in_two": [list(one) for one in self.evaluation.numbers if one != flat(one)],
        }


def flat(name: Name) -> str:
    """A number's name in one piece."""
    return name if isinstance(name, str) else ", ".join(name)


def decide(
    parts: Sequence[Part], numbers: Numbers | None = None, words: Words = WORDS
) -> Evaluation:
    """The verdict on a claim from its parts: all, some or none of them hold.

    Where none holds, the claim fails if one part does, and is open if none could be decided.
    """
    known = [part for part in parts if part.answer is not None]
    if not known:
        verdict = Verdict.UNDECIDED
    elif all(part.answer for part in known):
        verdict = Verdict.HOLDS if len(known) == len(parts) else Verdict.IN_PART
    else:
        verdict = Verdict.IN_PART if any(part.answer for part in known) else Verdict.FAILS
    where = _where(parts, words)
    return Evaluation(verdict, numbers or {}, where, tuple(parts), words)


def undecided(missing: str) -> Evaluation:
    """A claim that cannot be decided; ``missing`` says what it would take."""
    return Evaluation(Verdict.UNDECIDED, {}, f"Missing: {missing}.")


def agrees(computed: float, published: float, digits: int) -> bool:
    """Whether a number is the published one: it rounds to it, or differs by less than 2 %.

    Parameters
    ----------
    computed, published
        In the same unit.
    digits
        Digits of the published number behind the decimal point.
    """
    low, high = meant(published, digits)
    return low <= computed <= high


def meant(published: float, digits: int) -> tuple[float, float]:
    """The numbers that :func:`agrees` takes for the published one: from, to."""
    off = max(0.5 * 10.0**-digits, AGREEMENT * abs(published))
    return published - off, published + off


def _where(parts: Sequence[Part], words: Words) -> str:
    if len({part.answer for part in parts}) < 2:
        return ""
    groups = {answer: [p.what for p in parts if p.answer is answer] for answer in words}
    return " ".join(
        f"{words[key].capitalize()}: {'; '.join(found)}." for key, found in groups.items() if found
    )


def runs(labels: Sequence[str], answers: Sequence[bool | None]) -> Iterator[Part]:
    """Steps between labelled values, one fewer than labels; equal neighbours become one part."""
    for first, last in _stretches(answers):
        yield Part(f"{labels[first]} to {labels[last + 1]}", answers[first])


def bands(omega: NDArray[np.float64], answers: Sequence[bool | None]) -> Iterator[Part]:
    """Frequencies in rad/s with their answers; equal neighbours become one part.

    A part reaches from the first to the last frequency that has its answer.
    """
    for first, last in _stretches(answers):
        low, high = f"{omega[first]:.4g}", f"{omega[last]:.4g}"
        words = f"at {low} rad/s" if first == last else f"{low} to {high} rad/s"
        yield Part(words, answers[first])


def _stretches(answers: Sequence[bool | None]) -> Iterator[tuple[int, int]]:
    """First and last index of equal neighbours."""
    start = 0
    for k, answer in enumerate(answers):
        if k + 1 == len(answers) or answers[k + 1] is not answer:
            yield start, k
            start = k + 1


def _finite(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)
