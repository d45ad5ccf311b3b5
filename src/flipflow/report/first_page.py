"""The first page: what it is, whether it may run so, and the numbers behind the verdict."""

from __future__ import annotations

import math
from collections.abc import Iterator

from flipflow.analyses.assessment import Assessment, CaseAssessment, LimitRow
from flipflow.analyses.feasible import Bound
from flipflow.analyses.quantities import QUANTITIES
from flipflow.figures.motion import motions_figure
from flipflow.figures.response import cases_figure
from flipflow.report.blocks import (
    Block,
    Cell,
    Column,
    FigureBlock,
    Note,
    Table,
    Text,
    TitleBlock,
    Values,
    Verdict,
)
from flipflow.report.numbers import NOTHING, bounds, named, percent, quantity, rpm, span, speed
from flipflow.report.registry import Part, section

FAIL, ATTENTION, PASS, NOT_CHECKED = "fail", "attention", "pass", "not checked"
NO_NORMAL = (
    "Orbits are not drawn: isolation.normal_stiffness or isolation.normal_damping is missing in "
    "the machine file."
)
NO_LIMIT = (-math.inf, math.inf)
CASE_COLUMNS = (
    ("relative_amplitude", "amplitude"),
    ("stroke", "stroke"),
    ("relative_phase", "phase"),
    ("main_frame_acceleration", "main frame"),
    ("floating_frame_acceleration", "floating frame"),
    ("stop_force", "stop force"),
)


@section(Assessment, Part.FIRST_PAGE, 10)
def title_block(assessment: Assessment) -> Iterator[Block]:
    """Name, project, customer, drawing, and who signs."""
    document, omega = assessment.project.document, assessment.omega
    yield TitleBlock(
        document.name or assessment.project.name,
        (
            ("Project", document.project),
            ("Customer", document.customer),
            ("Drawing", document.drawing),
            ("Revision", document.revision),
            ("Prepared by", document.prepared_by),
            ("Checked by", document.checked_by),
            ("Date", ""),
            ("Signature", ""),
            ("Speed", speed(omega) if omega is not None else "not given"),
        ),
    )


@section(Assessment, Part.FIRST_PAGE, 20, brief=True)
def verdict(assessment: Assessment) -> Iterator[Block]:
    """The verdict, and what it rests on."""
    yield Verdict(assessment.verdict, verdict_state(assessment))
    yield Text(allowed_range(assessment), "Allowed speed range:")
    stop = stop_sentence(assessment)
    if stop:
        yield Text(stop, "Stop:")
    yield from (Note(note) for note in assessment.notes)


@section(Assessment, Part.FIRST_PAGE, 30)
def amplitude(assessment: Assessment) -> Iterator[Block]:
    """Amplitude over rpm with the band of load cases."""
    yield FigureBlock(cases_figure(assessment))


@section(Assessment, Part.FIRST_PAGE, 40)
def motions(assessment: Assessment) -> Iterator[Block]:
    """Orbits at true scale, and two turns of relative motion."""
    figure = motions_figure(assessment)
    if figure is not None:
        yield FigureBlock(figure)
        if not any(case.normal for case in assessment.cases):
            yield Note(NO_NORMAL)
    elif assessment.omega is not None:
        yield Note("No motion was found at the working speed, so none is drawn.")


@section(Assessment, Part.FIRST_PAGE, 50, brief=True)
def limits(assessment: Assessment) -> Iterator[Block]:
    """Every limit with its worst case."""
    columns = (
        Column("Limit"),
        Column("Allowed"),
        Column("Worst", numeric=True),
        Column("Case"),
        Column("Margin", numeric=True),
        Column("State"),
    )
    caption = (
        "Worst value over all load cases. Margin: distance from the limit as a share of it. "
        "Attention: met by less than 5 %."
    )
    rows = tuple(_limit_row(row) for row in assessment.limits_table)
    yield Table("", columns, rows, caption)


@section(Assessment, Part.FIRST_PAGE, 60, brief=True)
def cases(assessment: Assessment) -> Iterator[Block]:
    """Load cases by amplitude, stroke, phase, g of both frames, stop force."""
    if assessment.omega is None:
        return
    columns = [Column("Load case")]
    for name, title in CASE_COLUMNS:
        columns.append(Column(title, QUANTITIES[name].shown_unit, numeric=True))
    caption = (
        "Relative motion: amplitude (|x2|), stroke (twice that), phase to the unbalance force "
        "(negative: it lags). Frames: greatest acceleration in any direction."
    )
    rows = tuple(_case_row(case) for case in assessment.cases)
    yield Table("", tuple(columns), rows, caption)


@section(Assessment, Part.FIRST_PAGE, 70)
def surroundings(assessment: Assessment) -> Iterator[Block]:
    """One line each on foundation, springs, exciter and bearings."""
    if assessment.omega is None:
        return
    yield Values(
        (
            ("Foundation", _line(assessment, "foundation_force", "support_force")),
            ("Shear springs", _line(assessment, "shear_strain")),
            ("Stop springs", _line(assessment, "stop_force", "stop_piece_force")),
            ("Exciter, bearings", _line(assessment, "exciter_force", "bearing_force")),
            ("Power, throw", f"{_line(assessment, 'dissipated_power')}; {_throw(assessment)}"),
        )
    )


def verdict_state(assessment: Assessment) -> str:
    """The worst state of the limits that were given; fail without a motion that returns."""
    if assessment.omega is None:
        return NOT_CHECKED
    if any(case.orbit is None or case.orbit.stability == "unstable" for case in assessment.cases):
        return FAIL
    states = {row.state for row in assessment.limits_table if row.limit != NO_LIMIT}
    order = (FAIL, NOT_CHECKED, ATTENTION, PASS)
    return next((state for state in order if state in states), NOT_CHECKED)


def allowed_range(assessment: Assessment) -> str:
    """The allowed speed range and what ends it."""
    region = assessment.region
    if not region.feasible:
        return "none; no speed meets all limits in all load cases."
    parts = []
    for (low, high), (lower, upper) in zip(region.feasible, region.binding, strict=True):
        parts.append(f"{span(low, high)}, from {_bound(lower)} to {_bound(upper)}")
    return "; ".join(parts) + "."


def stop_sentence(assessment: Assessment) -> str:
    """Whether the stops are reached, case by case."""
    if assessment.omega is None:
        return ""
    if not assessment.project.screen.has_stop:
        return "the machine has none."
    if any(case.orbit is None for case in assessment.cases):
        return "not known, for no motion was found at working speed in every case."
    free = [case.name for case in assessment.cases if case.orbit and not case.stop_reached]
    if not free:
        return "reached in every load case."
    if len(free) == len(assessment.cases):
        return f"not reached in any load case at {rpm(assessment.omega)} rpm."
    return f"not reached in {'; '.join(free)}; reached in the other cases."


def _bound(bound: Bound) -> str:
    label = QUANTITIES[bound.limit].label if bound.limit in QUANTITIES else bound.limit
    if bound.limit in {"operating region", "speed"}:
        return f"the bound of the {label}" if bound.limit != "speed" else "the limit on speed"
    return f"the limit on {label} (case {bound.case})"


def _limit_row(row: LimitRow) -> tuple[Cell, ...]:
    allowed = bounds(*row.limit, row.shown_unit, row.unit)
    worst = quantity(row.worst, row.shown_unit, row.unit)
    if row.name == "speed" and row.worst is not None:
        worst = f"{rpm(row.worst)} rpm"
    if row.name == "jump_margin":
        worst = named(row.name, row.worst)
    case = row.reason if row.worst is None else row.case
    if row.name == "speed" and row.worst is not None:
        case = "all"
    label = row.label[:1].upper() + row.label[1:]
    return (
        Cell(label),
        Cell(allowed),
        Cell(worst),
        Cell(case),
        Cell(percent(row.margin)),
        Cell(row.state, state=row.state),
    )


def _case_row(case: CaseAssessment) -> tuple[Cell, ...]:
    if case.orbit is None:
        return (Cell(case.name, "no motion found"), *(Cell(NOTHING) for _ in CASE_COLUMNS))
    row = [Cell(case.name)]
    for name, _ in CASE_COLUMNS:
        text = named(name, case.values.get(name), with_unit=False)
        if name == "stop_force" and not case.stop_reached:
            text = "not reached" if case.screen.has_stop else "no stop"
        row.append(Cell(text))
    return tuple(row)


def _line(assessment: Assessment, *names: str, lowest: bool = False) -> str:
    """The first quantity's worst value and case, then the others in that case."""
    first = names[0]
    found = [(v, c) for c in assessment.cases if (v := c.values.get(first)) is not None]
    if not found:
        needs = ", ".join(QUANTITIES[first].needs)
        return f"not checked, missing: {needs}" if needs else "not checked"
    _, case = (min if lowest else max)(found, key=lambda one: one[0])
    if first == "stop_force" and not case.stop_reached:
        return "stop not reached" if case.screen.has_stop else "none fitted"
    parts = [
        f"{QUANTITIES[name].label} {named(name, case.values[name])}"
        for name in names
        if case.values.get(name) is not None
    ]
    where = f" (case {case.name})" if len(assessment.cases) > 1 else ""
    return f"{', '.join(parts)}{where}"


def _throw(assessment: Assessment) -> str:
    return _line(assessment, "throw_number", lowest=True)
