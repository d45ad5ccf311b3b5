"""The pages behind the first: machine, values with sources, responses, portrait, energy."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from flipflow.io.check import Case, Check, Value, check_project
from flipflow.io.layout import SECTIONS
from flipflow.io.units import shown
from flipflow.model.fields import FIELD, MOTION_FIELDS
from flipflow.model.numerals import capitalized, case_words, rpm
from flipflow.model.quantities import quantities_of
from flipflow.model.screen import FlipFlowScreen
from flipflow.plotting.bars import energy_figure, region_figure
from flipflow.plotting.drawing import Drawing
from flipflow.plotting.motion import orbits_figures, portrait_figure
from flipflow.plotting.response import branch_figure, responses_figures
from flipflow.plotting.schematic import schematic
from flipflow.report.blocks import (
    Block,
    Cell,
    Column,
    DrawingBlock,
    FigureBlock,
    Heading,
    Note,
    Table,
    Text,
    cells,
)
from flipflow.report.first_page import OVERLEAF_TITLE, overleaf, packed
from flipflow.report.numbers import NOTHING, four_digits, named, written
from flipflow.report.parts import warmed_loads
from flipflow.report.registry import Part, section
from flipflow.studies.assessment import Assessment, CaseAssessment

SCHEMATIC = (
    "Along the screen surface: x1 is the main frame's motion, xf the floating frame's, and the "
    "relative motion is x2 = x1 - xf."
)
# By the sides that have a stop, plus and minus.
TOUCHED = {
    (True, True): (
        " The stop on one side is touched when x2 exceeds the gap per side (e), that on the other "
        "side when x2 falls below -e, or -e- where the gaps differ."
    ),
    (True, False): " The stop is touched when x2 exceeds the gap (e+).",
    (False, True): " The stop is touched when x2 falls below -e-.",
    (False, False): "",
}
NO_STOP = {
    "clearance": "no stop on the plus side",
    "clearance_minus": "no stop on the other side",
}
MACHINE_TITLE = "The machine"
MODEL_LIMITS = (
    "Both frames are rigid bodies that move along the surface and, together, normal to it; they do "
    "not pitch, roll or bend, and what lies off the centre of mass or varies over the deck is not "
    "seen. The panels appear by what their load case says of them, not as elastic or stretched "
    "parts of their own. Material is mass attached to the frames: it neither bounces nor flows. "
    "Springs and dampers are linear but for the stops, and the foundation does not move."
)
CASES_ABREAST = 6  # load cases for which a table has columns on an A4 page
SYMBOLS = {
    "clearance": "gap per side e",
    "clearance_minus": "other side e-",
    "eccentric_moment": "m0r",
}


@section(Assessment, Part.DETAILS, 1)
def model_limits(assessment: Assessment) -> Iterator[Block]:
    """What the model leaves out, on the back of the first page."""
    yield Heading(OVERLEAF_TITLE if _overflows(assessment) else MACHINE_TITLE, 1)
    yield Text(MODEL_LIMITS, "Model limits:")


@section(Assessment, Part.DETAILS, 10)
def machine(assessment: Assessment) -> Iterator[Block]:
    """The machine as a drawing."""
    screen = assessment.project.screen
    if _overflows(assessment):
        yield Heading(MACHINE_TITLE, 1, new_page=False)
    caption = SCHEMATIC + TOUCHED[_stopped(screen)]
    yield DrawingBlock(Drawing("Schematic", caption, schematic(screen, drawn_values(screen))))


@section(Assessment, Part.DETAILS, 20)
def parameters(assessment: Assessment) -> Iterator[Block]:
    """All values of the machine file with their sources."""
    check = check_project(assessment.project, list(warmed_loads(assessment)))
    titles = ("Value", "Symbol", "As written", "Source")
    columns = tuple(Column(title) for title in titles)
    rows = tuple(_parameter(value) for value in check.values)
    if not any(value.source for value in check.values):
        columns, rows = columns[:-1], tuple(row[:-1] for row in rows)
    yield Table("Values of the machine file", columns, rows)
    yield _derived(check)
    yield _load_cases(check.load_cases)
    unsourced = _without_source(check)
    if unsourced:
        yield Note(f"No source given for {unsourced}.")
    yield from (Note(f"Sum of pieces, {key}: {text}") for key, text in check.sums.items())
    yield from (Note(f"Assumed: {text}") for text in check.assumed)
    yield from (Note(f"Missing: {g.missing}; not available: {g.disables}") for g in check.missing)


@section(Assessment, Part.DETAILS, 30)
def quantities(assessment: Assessment) -> Iterator[Block]:
    """Every quantity in every case, each explained in a sentence."""
    found = [case for case in assessment.cases if case.values]
    if not found:
        return
    yield Heading("Results", 1, new_page=False)
    speed = "" if assessment.omega is None else f" at {rpm(assessment.omega)} rpm"
    for k in range(0, len(found), CASES_ABREAST):
        title = f"Quantities{speed}" + (", continued" if k else "")
        yield _quantities(title, found[k : k + CASES_ABREAST], explained=k == 0)


@section(Assessment, Part.DETAILS, 40)
def allowed_speeds(assessment: Assessment) -> Iterator[Block]:
    """The speeds each limit allows."""
    yield FigureBlock(region_figure(assessment.region, assessment.omega))


@section(Assessment, Part.DETAILS, 50)
def portrait(assessment: Assessment) -> Iterator[Block]:
    """Orbits case by case, phase portrait and energy balance."""
    yield from (FigureBlock(figure) for figure in orbits_figures(assessment))
    figures = [make(assessment) for make in (portrait_figure, energy_figure)]
    yield from (FigureBlock(figure) for figure in figures if figure is not None)


@section(Assessment, Part.DETAILS, 60)
def responses(assessment: Assessment) -> Iterator[Block]:
    """Response of main frame, floating frame and relative motion, case by case."""
    cases = assessment.cases
    if len(cases) > CASES_ABREAST:
        branches = [(case.name, case.branch) for case in cases]
        yield from map(FigureBlock, responses_figures(branches, assessment.omega))
        return
    for case in cases:
        title = f"Response over speed, {case_words(case.name)}"
        yield FigureBlock(branch_figure(case.branch, assessment.omega, title))


def _overflows(assessment: Assessment) -> bool:
    """Whether something of the first page stands overleaf."""
    return bool(list(overleaf(assessment))) or packed(assessment)


def _stopped(screen: FlipFlowScreen) -> tuple[bool, bool]:
    """Which of both sides, plus and minus, has a stop."""
    if not screen.has_stop:
        return False, False
    plus, minus = screen.stop().gaps
    return math.isfinite(plus), math.isfinite(minus)


def drawn_values(screen: FlipFlowScreen) -> dict[str, str]:
    """Text for the schematic, by field."""
    return {
        name: NO_STOP[name]
        if name in NO_STOP and math.isinf(value)
        else f"{SYMBOLS.get(name, FIELD[name].symbol)} = "
        f"{shown(value, FIELD[name].file_unit, FIELD[name].unit)}"
        for name in MOTION_FIELDS
        if (value := getattr(screen, name)) is not None
    }


def _quantities(title: str, cases: Sequence[CaseAssessment], *, explained: bool) -> Table:
    columns = (Column("Quantity"), Column("Symbol"), *(Column(c.name, numeric=True) for c in cases))
    rows = []
    for one in quantities_of("motion"):
        values = [named(one, case.values.get(one.name)) for case in cases]
        label = capitalized(one.label)
        sentence = one.sentence if explained else ""
        rows.append((Cell(label, sentence), Cell(one.symbol), *cells(*values)))
    return Table(title, columns, tuple(rows))


def _parameter(value: Value) -> tuple[Cell, ...]:
    section_name, _, key = value.key.rpartition(".")
    sentence = next((e.sentence for e in SECTIONS[section_name] if e.key == key), "")
    return (
        Cell(value.key, sentence),
        Cell(value.symbol),
        Cell(value.written),
        Cell(value.source),
    )


def _without_source(check: Check) -> str:
    """How many values and load cases have no source, in words; empty where all have one."""
    counts = (
        ("value", sum(not value.source for value in check.values), len(check.values)),
        ("load case", sum(not case.source for case in check.load_cases), len(check.load_cases)),
    )
    parts = [
        f"{count} of {every} {word}{'' if every == 1 else 's'}"
        for word, count, every in counts
        if count
    ]
    return " and ".join(parts)


def _derived(check: Check) -> Table:
    columns = (
        Column("Speed"),
        Column("Symbol"),
        Column("rpm", numeric=True),
        Column("Hz", numeric=True),
        Column("rad/s", numeric=True),
    )
    rows = tuple(
        cells(s.meaning, s.name, *map(four_digits, (s.rpm, s.hz, s.rad_s))) for s in check.speeds
    )
    return Table("Speeds that follow", columns, rows, "Empty machine, no stop touched.")


def _temperature(case: Case) -> Cell:
    """Temperature as the file gives it, and that of the rubber at work where it is another."""
    if case.temperature is None:
        return Cell(NOTHING)
    rubber = "" if case.rubber is None else f", rubber {case.rubber:.3g}"
    of_air = f"air{rubber}" if case.temperature_of == "air" else ""
    return Cell(written(case.temperature, ".4g"), of_air)


def _load_cases(cases: tuple[Case, ...]) -> Table:
    columns = (
        Column("Load case"),
        Column("Stiffness", "x k2", numeric=True),
        Column("Damping", "x c2", numeric=True),
        Column("Stops", "x k3", numeric=True),
        Column("Stops", "x c3", numeric=True),
        Column("Main frame", "+ kg", numeric=True),
        Column("Floating frame", "+ kg", numeric=True),
        Column("Temperature", "degC", numeric=True),
        Column("Source"),
    )
    rows = tuple(
        (
            *cells(
                case.name,
                *(written(x, ".4g") for x in (case.stiffness_factor, case.damping_factor)),
                *(
                    written(x, ".4g")
                    for x in (case.stop_stiffness_factor, case.stop_damping_factor)
                ),
                *(written(x, ".4g") for x in (case.main_mass, case.floating_mass)),
            ),
            _temperature(case),
            Cell(case.source),
        )
        for case in cases
    )
    caption = (
        "What each case does to the shear springs (k2, c2) and the stops (k3, c3), and adds to the "
        "frames. A temperature is the rubber's unless it says air; the factors are those of the "
        "rubber at work."
    )
    return Table("Load cases", columns, rows, caption)
