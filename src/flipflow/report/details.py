"""The pages behind the first: machine, values with sources, responses, portrait, energy."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from flipflow.io.check import Case, Check, Value, check_project
from flipflow.io.layout import SECTIONS
from flipflow.io.units import shown
from flipflow.model.fields import FIELD, MOTION_FIELDS
from flipflow.model.quantities import quantities_of
from flipflow.model.screen import FlipFlowScreen
from flipflow.plotting.bars import energy_figure, region_figure
from flipflow.plotting.drawing import Drawing
from flipflow.plotting.motion import orbits_figure, portrait_figure
from flipflow.plotting.response import branch_figure
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
    cells,
)
from flipflow.report.first_page import overleaf
from flipflow.report.numbers import four_digits, named, rpm
from flipflow.report.registry import Part, section
from flipflow.studies.assessment import Assessment, CaseAssessment

SCHEMATIC = (
    "Along the screen surface: x1 is the main frame's motion, xf the floating frame's, and the "
    "relative motion is x2 = x1 - xf. The stop on one side is touched when x2 exceeds the gap per "
    "side (e), that on the other side when x2 falls below -e."
)
CASES_ABREAST = 6  # load cases for which a table has columns on an A4 page
SYMBOLS = {
    "clearance": "gap per side e",
    "clearance_minus": "other side e-",
    "eccentric_moment": "m0r",
}


@section(Assessment, Part.DETAILS, 10)
def machine(assessment: Assessment) -> Iterator[Block]:
    """The machine as a drawing."""
    screen = assessment.project.screen
    yield Heading("The machine", 1, new_page=not list(overleaf(assessment)))
    yield DrawingBlock(Drawing("Schematic", SCHEMATIC, schematic(screen, drawn_values(screen))))


@section(Assessment, Part.DETAILS, 20)
def parameters(assessment: Assessment) -> Iterator[Block]:
    """All values of the machine file with their sources."""
    check = check_project(assessment.project)
    columns = (Column("Value"), Column("Symbol"), Column("As written"), Column("Source"))
    rows = tuple(_parameter(value) for value in check.values)
    yield Table("Values of the machine file", columns, rows)
    yield _derived(check)
    yield _load_cases(check.load_cases)
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
    for group in (found[k : k + CASES_ABREAST] for k in range(0, len(found), CASES_ABREAST)):
        yield _quantities(f"Quantities{speed}", group)


@section(Assessment, Part.DETAILS, 40)
def allowed_speeds(assessment: Assessment) -> Iterator[Block]:
    """The speeds each limit allows."""
    yield FigureBlock(region_figure(assessment.region, assessment.omega))


@section(Assessment, Part.DETAILS, 50)
def portrait(assessment: Assessment) -> Iterator[Block]:
    """Orbits case by case, phase portrait and energy balance."""
    figures = [make(assessment) for make in (orbits_figure, portrait_figure, energy_figure)]
    yield from (FigureBlock(figure) for figure in figures if figure is not None)


@section(Assessment, Part.DETAILS, 60)
def responses(assessment: Assessment) -> Iterator[Block]:
    """Response of main frame, floating frame and relative motion, case by case."""
    for case in assessment.cases:
        title = f"Response over speed, case {case.name}"
        yield FigureBlock(branch_figure(case.branch, assessment.omega, title))


def drawn_values(screen: FlipFlowScreen) -> dict[str, str]:
    """Text for the schematic, by field."""
    return {
        name: f"{SYMBOLS.get(name, FIELD[name].symbol)} = "
        f"{shown(value, FIELD[name].file_unit, FIELD[name].unit)}"
        for name in MOTION_FIELDS
        if (value := getattr(screen, name)) is not None
    }


def _quantities(title: str, cases: Sequence[CaseAssessment]) -> Table:
    columns = (Column("Quantity"), Column("Symbol"), *(Column(c.name, numeric=True) for c in cases))
    rows = []
    for one in quantities_of("motion"):
        values = [named(one.name, case.values.get(one.name)) for case in cases]
        label = one.label[:1].upper() + one.label[1:]
        rows.append((Cell(label, one.sentence), Cell(one.symbol), *cells(*values)))
    return Table(title, columns, tuple(rows))


def _parameter(value: Value) -> tuple[Cell, ...]:
    section_name, _, key = value.key.rpartition(".")
    sentence = next((e.sentence for e in SECTIONS[section_name] if e.key == key), "")
    return (
        Cell(value.key, sentence),
        Cell(value.symbol),
        Cell(value.written),
        Cell(value.source or "no source given"),
    )


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


def _of_air(case: Case) -> str:
    return " (air)" if case.temperature_of == "air" else ""


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
        cells(
            case.name,
            *(f"{x:.4g}" for x in (case.stiffness_factor, case.damping_factor)),
            *(f"{x:.4g}" for x in (case.stop_stiffness_factor, case.stop_damping_factor)),
            *(f"{x:.4g}" for x in (case.main_mass, case.floating_mass)),
            "-" if case.temperature is None else f"{case.temperature:.4g}{_of_air(case)}",
            case.source or "no source given",
        )
        for case in cases
    )
    caption = (
        "What each case does to the shear springs (k2, c2) and the stops (k3, c3), and adds to the "
        "frames. A temperature is the rubber's unless it says air."
    )
    return Table("Load cases", columns, rows, caption)
