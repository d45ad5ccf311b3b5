"""Loads of single parts for those who buy them: value, formula and source side by side."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from flipflow.model.fields import FIELD
from flipflow.model.numerals import capitalized, case_words
from flipflow.model.quantities import QUANTITIES, missing_words
from flipflow.model.screen import WarmedLoad, of_air
from flipflow.report.blocks import Block, Cell, Column, Note, Table
from flipflow.report.numbers import NOTHING, named, number
from flipflow.report.registry import Part, section
from flipflow.studies.assessment import Assessment, CaseAssessment
from flipflow.studies.rubber_temperature import RISE, WITHIN, settled_at_work

EQUATION = "Minerals 2024, 14, 406, Eq. (1)"
STOP_LAW = "Minerals 2024, 14, 406, Eq. (2), and the law chosen"
VIBRATORY = "FAG, Special spherical roller bearings for vibratory machinery, TPI 197"


class PartRow(NamedTuple):
    """One line: the part, the quantity, by what formula, and who says so."""

    part: str
    name: str
    formula: str
    source: str
    least_is_worst: bool = False


ROWS = (
    PartRow("Shear spring", "shear_piece_force", "max |k2 x2 + c2 x2'| / n2", EQUATION),
    PartRow("Shear spring", "shear_strain", "max |x2| / h2", "engineering strain"),
    PartRow("Shear spring", "shear_piece_power", "c2 mean(x2'^2) / n2", EQUATION),
    PartRow(
        "Shear spring", "shear_temperature_rise", "P2 / (n2 G2)",
        "heat balance with the conductance of the machine file",
    ),
    PartRow("Stop spring", "stop_piece_force", "max |H| / n3", STOP_LAW),
    PartRow("Stop spring", "stop_approach_speed", "|x2'| where the gap closes", EQUATION),
    PartRow(
        "Bearing", "bearing_load", "max |m0r w^2 e - mr a1| / nb",
        f"the rotating mass mr moves with the frame; {VIBRATORY}, circle throw",
    ),
    PartRow(
        "Bearing", "bearing_life", "1e6 / (60 n) (C / P)^p, P = fz F",
        f"ISO 281; factor fz: {VIBRATORY}", least_is_worst=True,
    ),
)  # fmt: skip


@section(Assessment, Part.DETAILS, 35)
def parts(assessment: Assessment) -> Iterator[Block]:
    """Every part's load in its worst case."""
    cases = [case for case in assessment.cases if case.values]
    if not cases:
        return
    columns = (
        Column("One part"),
        Column("Quantity"),
        Column("Worst", numeric=True),
        Column("Case"),
        Column("Formula and source"),
    )
    rows = tuple(
        _row(assessment, cases, one) for one in ROWS
        if assessment.project.screen.has_stop or not QUANTITIES[one.name].of_stops
    )  # fmt: skip
    screen = assessment.project.screen
    caption = (
        "At working speed, every case in the table of quantities. "
        f"fz = {number(screen.bearing_load_factor)}, p = {number(screen.bearing_life_exponent)}."
    )
    yield Table("Parts", columns, rows, caption)
    yield from (Note(text) for text in _notes(assessment))


def warmed_loads(assessment: Assessment) -> Iterator[WarmedLoad]:
    """The load cases with the temperature at which the rubber settles."""
    for given, case in zip(assessment.project.load_cases, assessment.cases, strict=True):
        rise = case.values.get(RISE)
        yield settled_at_work(assessment.project.screen, given, case.load, rise)


def _row(assessment: Assessment, cases: list[CaseAssessment], one: PartRow) -> tuple[Cell, ...]:
    quantity = QUANTITIES[one.name]
    label = capitalized(quantity.label)
    formula = Cell(one.formula, one.source)
    worst = worst_of(cases, one.name, lowest=one.least_is_worst)
    if worst is None:
        missing = missing_words(quantity.missing(assessment.project.screen))
        return Cell(one.part), Cell(label), Cell(NOTHING), Cell(missing), formula
    value, case = worst
    return Cell(one.part), Cell(label), Cell(named(quantity, value)), Cell(case.name), formula


def worst_of(
    cases: Iterable[CaseAssessment], name: str, *, lowest: bool = False
) -> tuple[float, CaseAssessment] | None:
    """The greatest, or lowest, value of a quantity with its load case; None where none is known."""
    known = [(value, case) for case in cases if (value := case.values.get(name)) is not None]
    return (min if lowest else max)(known, key=lambda one: one[0], default=None)


def _notes(assessment: Assessment) -> Iterator[str]:
    screen = assessment.project.screen
    if screen.weight_considered and screen.shear_pieces:
        yield (
            "The weight of the floating frame, which the shear springs bear at rest, is not part "
            "of their force and strain."
        )
    given = assessment.project.load_cases
    for load, warmed, case in zip(given, warmed_loads(assessment), assessment.cases, strict=True):
        if load.temperature is None or not case.values:
            continue
        whose = "the air's" if of_air(load) else "the rubber's"
        name = case_words(case.name, capital=True)
        text = f"{name}: {number(load.temperature)} degC is {whose} temperature"
        if warmed.rubber is not None:
            text += f"; the rubber settles at {number(warmed.rubber)} degC"
            held = warmed.load.temperature or 0.0
            if abs(warmed.rubber - held) > WITHIN:
                text += f", its stiffness is that at {number(held)} degC"
        yield f"{text}."
    if screen.shear_conductance is None:
        key = FIELD["shear_conductance"].key
        yield f"How warm the shear springs get is not calculated: {key} is missing."
