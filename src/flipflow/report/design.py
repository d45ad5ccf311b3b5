"""What a proposal becomes in a report and in the terminal: the duty, the machine, its proof."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flipflow.model.fields import FIELD
from flipflow.model.limits import LIMIT_FIELDS
from flipflow.model.numerals import capitalized, rpm
from flipflow.plotting.design import band_figure, proposal_figure
from flipflow.report.blocks import (
    Block,
    Column,
    FigureBlock,
    Heading,
    Note,
    Table,
    Text,
    TitleBlock,
    Values,
    Verdict,
    cells,
)
from flipflow.report.first_page import cases, limits
from flipflow.report.numbers import NOTHING, allowed, number, quantity, three_digits, written
from flipflow.report.registry import Part, section
from flipflow.studies.assessment import ATTENTION, FAIL, PASS
from flipflow.studies.candidates import ALONE, BUILT, EVEN, MET, MOTION, label_of
from flipflow.studies.design import Proposal, Trial

GAPS = ("clearance", "clearance_minus")
CERTAIN = 0.99  # share of machines as built from which a proposal passes
NOT_COVERED = (
    "The search judges scatter at its corners and on the drawing. The material moves with the "
    "frames that carry it. Jumps that blows cause are judged for the machine as drawn, not at the "
    "corners. The margin to the jump, starts and other motions are judged as drawn and with every "
    "part at one end of its scatter; where no machine keeps the margin there, that of the drawing "
    "has to do. Fatigue of rubber, its wear and its creep are not computed: bounds on gap and "
    "shear stiffness keep the search away from machines that hang on them."
)


@section(Proposal, Part.FIRST_PAGE, 0)
def head_of_proposal(found: Proposal) -> Iterator[Block]:
    """The duty by its name, and the machine it begins with."""
    duty = found.duty
    rows = (("Duty", duty.name), ("Machine to begin with", duty.project.name))
    yield TitleBlock(duty.name, rows)


@section(Proposal, Part.FIRST_PAGE, 10, brief=True)
def verdict_of_proposal(found: Proposal) -> Iterator[Block]:
    """What was found."""
    yield Verdict(f"{capitalized(found.sentence)}.", _state(found))
    if found.cancelled:
        yield Note("The search was stopped: this is the best so far, and it is not proved.")
    for why in found.thrown_out:
        yield Note(f"Thrown out: {why}")


@section(Proposal, Part.FIRST_PAGE, 20)
def duty_of_proposal(found: Proposal) -> Iterator[Block]:
    """What was asked."""
    duty = found.duty
    speeds = " to ".join(dict.fromkeys(rpm(one) for one in duty.speed))
    target, within = (quantity(one, "mm", "m") for one in (duty.target, duty.tolerance))
    scatter = ", ".join(
        f"{FIELD[name].key} +-{100.0 * one:.3g} %" for name, one in duty.scatter.items()
    )
    yield Heading("The duty", 1, new_page=False)
    yield Values(
        (
            ("Relative amplitude", f"{target} within {within} either way"),
            ("Speed", f"{speeds} rpm"),
            ("Combinations", _combinations(found)),
            ("Loads", "; ".join(load.name or "empty" for load in duty.loads)),
            ("Scatter of parts", scatter or "none"),
            ("Preferred", ", ".join(duty.prefer)),
            ("Machines looked at", f"{found.evaluated}, seed {duty.seed}"),
        )
    )  # fmt: skip


@section(Proposal, Part.FIRST_PAGE, 30, brief=True)
def machine_of_proposal(found: Proposal) -> Iterator[Block]:
    """The parts that were chosen."""
    yield Heading("The machine", 1, new_page=False)
    columns = (
        Column("In the machine file"), Column("Of the file", numeric=True),
        Column("Proposed", numeric=True), Column("Free", brief=False),
    )  # fmt: skip
    own, new, free = found.duty.project.screen, found.screen, _free(found)
    rows = [
        cells(
            FIELD[name].key,
            *(_field(name, getattr(screen, name)) for screen in (own, new)),
            free.get(name, NOTHING),
        )
        for name in found.fields
    ]
    for name in _other_gap(found):
        kept = _field(name, getattr(new, name))
        rows.append(cells(FIELD[name].key, kept, f"{kept}, unchanged", NOTHING))
    yield Table("Parts", columns, tuple(rows))
    if found.springs is not None:
        one, count = found.springs
        price = "" if one.price is None else f", {number(count * one.price)} together"
        yield Text(f"{count} of {one.name}{price}.", "Shear springs:")


@section(Proposal, Part.FIRST_PAGE, 40, brief=True)
def steadiness_of_proposal(found: Proposal) -> Iterator[Block]:
    """The band of the machine and of those beside it."""
    columns = (
        Column("Machine"), Column("Least", "mm", numeric=True),
        Column("Greatest", "mm", numeric=True), Column("Band", "mm", numeric=True),
    )  # fmt: skip
    rows = [cells(one.name, *_ends(one)) for one in (found.chosen, *found.beside)]
    yield Table("Relative amplitude over all combinations", columns, tuple(rows))


@section(Proposal, Part.FIRST_PAGE, 50, brief=True)
def constraints_of_proposal(found: Proposal) -> Iterator[Block]:
    """How far each constraint is away, and what it costs."""
    priced = bool(found.prices)
    columns = (
        Column("Constraint"), Column("Allowed", brief=False), Column("Margin", "%", numeric=True),
        *([Column("1 % more of it narrows the band by", "um", numeric=True)] if priced else []),
    )  # fmt: skip
    rows = [
        cells(
            label_of(name), _allowed(found, name), _margin(name, share),
            *([_price(found, name)] if priced else []),
        )
        for name, share in found.excess.items()
    ]  # fmt: skip
    rows += [
        cells(label_of(name), "end of what is free", written(0.0, ".2f"), _price(found, name))
        for name in found.prices
        if name not in found.excess
    ]
    caption = (
        "Of the relative amplitude 1 % of the target more to each side; of an end 1 % of its "
        "interval."
    )
    if not priced and found.assessment is None:
        caption = "What a constraint costs is told of a machine that is proved; this one is not."
    elif not priced:
        caption = (
            "What a constraint costs is told of a machine that its polish ends at; this one lies "
            "before, where it leaves another motion or the jump far enough away."
        )
    yield Table("What binds, and what it costs", columns, tuple(rows), caption)


@section(Proposal, Part.DETAILS, 10)
def figures_of_proposal(found: Proposal) -> Iterator[Block]:
    """The Pareto set and the band."""
    yield Heading("Candidates", 1)
    yield FigureBlock(band_figure(found))
    yield FigureBlock(proposal_figure(found))


@section(Proposal, Part.DETAILS, 20)
def proof_of_proposal(found: Proposal) -> Iterator[Block]:
    """The chosen machine judged by the exact solution, with its start and blows."""
    yield Heading("Verification", 1)
    if found.assessment is None:
        yield Note("No machine was proved.")
    else:
        yield Verdict(found.assessment.verdict, found.assessment.state)
        yield from limits(found.assessment)
        yield from cases(found.assessment)
        yield from (Note(one) for one in found.assessment.notes)
    if not np.isnan(found.passing):
        low, high = (f"{100.0 * one:.4g}" for one in found.passing_interval)
        yield Text(
            f"{100.0 * found.passing:.4g} % ({low} to {high} %, 95 % confidence) of {BUILT:,} "
            "machines, their parts drawn evenly within the scatter, meet every constraint in every "
            f"combination.{_failing(found)}",
            "Yield:",
        )
    yield Text(NOT_COVERED, "Not covered:")


def _state(found: Proposal) -> str:
    """Attention where the machine is not proved, or where some of those that are built fail."""
    if not found.possible:
        return FAIL
    some_fail = found.passing < CERTAIN
    return ATTENTION if found.cancelled or found.assessment is None or some_fail else PASS


def _margin(name: str, excess: float) -> str:
    """Margin in percent; of what is a question of yes or no, the answer."""
    if np.isnan(excess):
        return NOTHING
    if name in (MOTION, EVEN, ALONE):
        return "met" if excess <= MET else "not met"
    # Rounded before its sign is turned: what is used up to the last digits has a margin of 0.00.
    return written(0.0 - round(100.0 * excess, 2), ".2f")


def _failing(found: Proposal) -> str:
    """What the others miss."""
    missed = {name: share for name, share in found.failing.items() if share > 0.0}
    told = [
        f"{label_of(n)} ({100.0 * missed[n]:.3g} %)" for n in sorted(missed, key=missed.__getitem__)
    ]
    return f" Others miss: {', '.join(told[::-1])}." if told else ""


def _combinations(found: Proposal) -> str:
    loads, corners = len(found.duty.loads), len(found.duty.corners)
    return f"{loads} of load and temperature, each at {corners} points of the scatter"


def _field(name: str, value: float | None) -> str:
    one = FIELD[name]
    return quantity(value, one.file_unit, one.unit)


def _free(found: Proposal) -> dict[str, str]:
    return {
        one.name: " to ".join(_field(one.name, float(str(end))) for end in one.distribution.ends)
        for one in found.duty.varied
    }


def _other_gap(found: Proposal) -> list[str]:
    """The gap of the other side, where it is one of its own and only one of both was free."""
    chosen = [name for name in GAPS if name in found.fields]
    if len(chosen) != 1 or found.screen.clearance_minus is None:
        return []
    return [name for name in GAPS if name not in chosen]


def _ends(one: Trial) -> list[str]:
    if np.isnan(one.amplitude).any():
        return [NOTHING, NOTHING, "no stable motion in every combination"]
    values = one.amplitude.min(), one.amplitude.max(), one.band
    return [quantity(float(value), "mm", "m", with_unit=False) for value in values]


def _allowed(found: Proposal, name: str) -> str:
    limited = name in {field.name for field in LIMIT_FIELDS}
    return allowed(found.duty.bounds, name) if limited else NOTHING


def _price(found: Proposal, name: str) -> str:
    return three_digits(1e4 * found.prices[name]) if name in found.prices else NOTHING
