"""What the weight of the floating frame does to the gaps, in report and terminal."""

from __future__ import annotations

import math
from collections.abc import Iterator

from flipflow.model.numerals import rpm
from flipflow.report.blocks import Block, Column, Note, Table, Text, cells
from flipflow.report.numbers import in_rpm, quantity, written
from flipflow.report.registry import Part, section
from flipflow.studies.assessment import Assessment, CaseAssessment
from flipflow.studies.gaps_under_weight import GapsUnderWeight

LEAD = "Weight:"
AT_REST = "at rest"  # where a side is touched that the weight closes
NOT_CONSIDERED = (
    "weight not considered: frames.deck_angle is missing, so both gaps are taken as they are given."
)
MEASURED = {
    "standing": "gaps as measured on the standing, empty machine; what a case adds shifts them",
    "drawn": "gaps as drawn with unstressed springs; the floating frame's weight shifts them",
}
NEAR_CONTACT = 1.1  # share of the contact speed up to which a speed lies just above it
MOST_CASES = 8  # load cases for which the table has room


@section(Assessment, Part.DETAILS, 32, brief=True)
def weight(assessment: Assessment) -> Iterator[Block]:
    """Shift of the gaps, both gaps, contact speed and stop force of either side."""
    screen = assessment.project.screen
    if not screen.has_stop:
        return
    if not screen.weight_considered:
        yield Text(NOT_CONSIDERED, LEAD)
        return
    shifted = [case for case in assessment.cases if not case.gaps.even]
    measured = MEASURED[screen.clearance_measured]
    if not shifted:
        yield Text(f"{measured}; both gaps are even in every load case.", LEAD)
        return
    yield Text(f"{measured}.", LEAD)
    most = sorted(shifted, key=lambda case: -abs(case.gaps.shift))[:MOST_CASES]
    yield _table([case for case in shifted if case in most])
    even = len(assessment.cases) - len(shifted)
    if even:
        yield Note(f"In {even} load case{'s' * (even > 1)} both gaps are even.")
    if len(shifted) > MOST_CASES:
        left = len(shifted) - MOST_CASES
        yield Note(f"{left} more load cases, whose gaps shift less, stand in results.json.")


@section(Assessment, Part.DETAILS, 33, brief=True)
def doubled(assessment: Assessment) -> Iterator[Block]:
    """Where, just above contact, a motion of two turns takes the place of one."""
    found = [
        f"{rpm(low)} to {rpm(high)} rpm ({case.name})"
        for case in assessment.cases
        for low, high in case.gaps.doubled
        if _just_above_contact(case.gaps, low)
    ]
    if found:
        yield Note(
            "Just above contact the motion of one period gives way to one of two: "
            f"{'; '.join(found)}."
        )


def _just_above_contact(gaps: GapsUnderWeight, low: float) -> bool:
    touched = min(gaps.contact_plus or math.inf, gaps.contact_minus or math.inf)
    return touched <= low <= NEAR_CONTACT * touched


def _table(cases: list[CaseAssessment]) -> Table:
    columns = (
        Column("Load case"),
        Column("Shift", "mm", numeric=True),
        Column("Gap +", "mm", numeric=True),
        Column("Gap -", "mm", numeric=True),
        Column("Contact +", "rpm", numeric=True),
        Column("Contact -", "rpm", numeric=True),
        Column("Force +", "kN", numeric=True),
        Column("Force -", "kN", numeric=True),
    )
    rows = tuple(
        cells(
            case.name,
            _millimetres(case.gaps.shift),
            _millimetres(case.gaps.plus),
            _millimetres(case.gaps.minus),
            contact(case.gaps.contact_plus, case.gaps.plus),
            contact(case.gaps.contact_minus, case.gaps.minus),
            quantity(case.gaps.force_plus, "kN", "N", with_unit=False),
            quantity(case.gaps.force_minus, "kN", "N", with_unit=False),
        )
        for case in cases
    )
    caption = (
        "The floating frame hangs down the slope, nearer to the plus side. Contact: speed at which "
        "a side is first touched. Force: greatest of a side at working speed."
    )
    return Table("Weight and gaps", columns, rows, caption)


def _millimetres(value: float) -> str:
    """Two decimals: a shift is small beside the gap it takes from."""
    return "no stop" if math.isinf(value) else written(1e3 * value, ".2f")


def contact(omega: float | None, gap: float) -> str:
    """Where a side is first touched: the speed in rpm, "at rest", or nothing."""
    if gap <= 0.0:
        return AT_REST
    return in_rpm(omega)
