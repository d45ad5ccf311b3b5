"""``flipflow.reproduce``: the paper's figures computed, drawn, and every claim decided."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from flipflow import __version__
from flipflow.errors import IncompleteError, InputError, MissingExtra, StoreError
from flipflow.io.project import load
from flipflow.io.read_off import read_off
from flipflow.io.results import SCHEMAS, SUMMARISED
from flipflow.model.arguments import checked_all, checked_monitor
from flipflow.model.monitor import Monitor
from flipflow.model.screen import FlipFlowScreen
from flipflow.paper.claims import (
    WORDS,
    WORDS_OF_TIES,
    DecidedClaim,
    Evaluation,
    Name,
    Number,
    Numbers,
    Part,
    Verdict,
    flat,
)
from flipflow.paper.figure import PaperFigure
from flipflow.paper.registry import FIGURES, chosen
from flipflow.plotting.drawing import Drawing
from flipflow.plotting.figure import Figure
from flipflow.report.blocks import Table
from flipflow.results.codec import Form
from flipflow.studies.documents import CODEC, machine_document

SCHEMA = "flipflow/claims/1"
PAPER = "Lin, Wang, Xu, Zuo, Liang, Minerals 2024, 14, 406"
MACHINE = "ffs0827"


@dataclass(frozen=True, eq=False)
class ReproducedFigure:
    """One figure of the paper: picture, tables, claims.

    Parameters
    ----------
    name, title
        "figure-08", and what it shows.
    figure
        None where it could not be computed.
    tables, claims
        Tables of its page, and what the paper says of it, decided.
    findings
        What the paper does not say, decided in the same way.
    failure
        Why it could not be computed, a sentence; empty where it was.
    """

    name: str
    title: str
    figure: Figure | Drawing | None
    tables: tuple[Table, ...]
    claims: tuple[DecidedClaim, ...]
    failure: str = ""
    findings: tuple[DecidedClaim, ...] = ()


@dataclass(frozen=True, eq=False)
class Reproduction:
    """Figures and claims of the paper on one machine; returned by :func:`flipflow.reproduce`."""

    screen: FlipFlowScreen
    figures: tuple[ReproducedFigure, ...]

    def __repr__(self) -> str:
        counted = ", ".join(f"{count} {verdict}" for verdict, count in self.counts.items() if count)
        return f"Reproduction({len(self.figures)} figures; claims: {counted or 'none'})"

    @property
    def claims(self) -> tuple[DecidedClaim, ...]:
        """Every claim with its verdict, in the paper's order."""
        return tuple(claim for figure in self.figures for claim in figure.claims)

    @property
    def findings(self) -> tuple[DecidedClaim, ...]:
        """What is found beyond the paper; no claim of it, and not counted."""
        return tuple(finding for figure in self.figures for finding in figure.findings)

    @property
    def counts(self) -> dict[str, int]:
        """How many claims have each verdict."""
        found = Counter(claim.evaluation.verdict for claim in self.claims)
        return {str(verdict): found[verdict] for verdict in Verdict}

    def document(self) -> dict[str, Any]:
        """The claims as JSON types; :func:`flipflow.save` writes this and what opens again."""
        return {
            "schema": SCHEMA,
            "version": __version__,
            "paper": PAPER,
            "machine": machine_document(self.screen),
            "claims": [claim.document() for claim in self.claims],
            "counts": self.counts,
            "found_beyond_the_paper": [finding.document() for finding in self.findings],
        }


def reproduce(
    screen: FlipFlowScreen | None = None,
    figures: Sequence[str] = (),
    *,
    monitor: Monitor | None = None,
) -> Reproduction:
    """Compute the figures of the paper and decide its claims by the numbers found.

    Parameters
    ----------
    screen
        The machine; the paper's, FFS0827, where none is given. Another machine has other
        verdicts: nothing is written down but the paper's own numbers.
    figures
        Names such as "figure-08"; all where none is given.
    monitor
        Called with a sentence and the share done, 0 to 1.

    Raises
    ------
    InputError
        For an unknown figure, and for anything but a screen.
    """
    machine = load(MACHINE) if screen is None else screen
    if not isinstance(machine, FlipFlowScreen):
        raise InputError("screen", type(machine).__name__, "give a FlipFlowScreen")
    say = checked_monitor(monitor)
    remedy = "give a list of names, such as ['figure-08']"
    wanted = chosen(checked_all("figures", figures, str, remedy))
    made = []
    for k, one in enumerate(wanted):
        say(one.name, k / len(wanted))
        made.append(_reproduced(one, machine))
    say("done", 1.0)
    return Reproduction(machine, tuple(made))


def _reproduced(one: PaperFigure[Any], screen: FlipFlowScreen) -> ReproducedFigure:
    if one.needs_stop and not screen.has_stop:
        return _without(one, "It needs a machine with stop.")
    try:
        data = one.compute(screen)
        picture, tables = one.draw(data), one.tables(data)
        claims, findings = (
            tuple(DecidedClaim(claim, one.name, claim.evaluate(data)) for claim in group)
            for group in (one.claims, one.findings)
        )
    except (IncompleteError, MissingExtra) as error:
        return _without(one, str(error))
    if isinstance(picture, Figure):
        picture = dataclasses.replace(picture, symbols=True)
    return ReproducedFigure(one.name, one.title, picture, tables, claims, "", findings)


def _without(one: PaperFigure[Any], why: str) -> ReproducedFigure:
    """The figure that could not be computed, and its claims that cannot be decided."""
    evaluation = Evaluation(Verdict.UNDECIDED, {}, why)
    claims, findings = (
        tuple(DecidedClaim(claim, one.name, evaluation) for claim in group)
        for group in (one.claims, one.findings)
    )
    return ReproducedFigure(one.name, one.title, None, (), claims, why, findings)


def _claim_from(document: Mapping[str, Any]) -> DecidedClaim:
    """The claim that :meth:`~flipflow.paper.claims.DecidedClaim.document` wrote."""
    name, figure = document["id"], document["figure"]
    one = FIGURES.get(figure)
    known = {} if one is None else {claim.id: claim for claim in (*one.claims, *one.findings)}
    if name not in known:
        raise StoreError(f"the claim {name!r} of {figure!r} is not known; update flipflow")
    pairs = [(first, second) for first, second in document.get("names_in_two", ())]
    names: dict[str, Name] = {flat(pair): pair for pair in pairs}
    numbers: Numbers = {
        names.get(key, key): Number(**value) for key, value in document["numbers"].items()
    }
    told = document.get("parts", ())
    tied = any(part["answer"] == WORDS_OF_TIES[None] for part in told)
    words = WORDS_OF_TIES if tied else WORDS
    answers = {word: answer for answer, word in words.items()}
    parts = tuple(Part(part["what"], answers[part["answer"]]) for part in told)
    where = document["holds_where"]
    note = document.get("note", "")
    evaluation = Evaluation(Verdict(document["verdict"]), numbers, where, parts, words, note)
    return DecidedClaim(known[name], figure, evaluation)


CODEC.learn({DecidedClaim: Form(DecidedClaim.document, _claim_from)})
SCHEMAS[Reproduction] = SCHEMA
SUMMARISED.add(Reproduction)
read_off.register(Reproduction, Reproduction.document)
