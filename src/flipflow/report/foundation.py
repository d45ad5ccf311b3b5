"""The page for the civil engineer: what each support puts on the foundation."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from flipflow.io.units import in_unit
from flipflow.model.numerals import case_words, rpm
from flipflow.plotting.foundation import foundation_drawing
from flipflow.report.blocks import (
    Block,
    Cell,
    Column,
    DrawingBlock,
    Heading,
    Note,
    Table,
    Text,
    cells,
)
from flipflow.report.numbers import NOTHING, quantity, span_of, three_digits, written
from flipflow.report.registry import Part, section
from flipflow.studies.assessment import ATTENTION, PASS, Assessment
from flipflow.studies.foundation_loads import (
    CaseLoads,
    Components,
    FoundationLoads,
    RunLoads,
)

TITLE = "Loads on the foundation"
MOST_CASES = 6  # load cases that the page has room for: those that load the foundation most
LOADS = ("vertical", "horizontal", "along", "normal")
ROTATION = {
    "with-flow": "the top of the unbalance moves down the slope, with the material",
    "counter-flow": "the top of the unbalance moves up the slope, against the material",
}


@section(Assessment, Part.DETAILS, 80, brief=True)
def into_the_ground(assessment: Assessment) -> Iterator[Block]:
    """What goes into the ground, in a sentence."""
    if assessment.foundation is not None:
        # The figure of start and coast-down, half a page high, ends the page before; without it
        # that page may hold a few lines only.
        yield Heading(TITLE, 1, new_page=bool(assessment.foundation.runs))
        yield Text(assessment.foundation.sentence, "Into the ground:")


@section(Assessment, Part.DETAILS, 81)
def foundation_page(assessment: Assessment) -> Iterator[Block]:
    """Supports, static and running loads, start and stop, orders, travel."""
    loads = assessment.foundation
    if loads is None:
        return
    yield DrawingBlock(foundation_drawing(loads))
    shown = heaviest(loads)
    if shown:
        yield _running_table(loads, shown)
        yield _orders_table(loads, shown[0])
    if loads.runs:
        yield _runs_table(loads)
    yield _travel_table(loads, shown)
    for note in _notes(assessment, loads, shown):
        yield Note(note)


def heaviest(loads: FoundationLoads) -> list[CaseLoads]:
    """The load cases that are shown, that with the greatest dynamic load first."""
    size = {one.name: one.running.total or 0.0 for one in loads.cases}
    return sorted(loads.cases, key=lambda one: -size[one.name])[:MOST_CASES]


def _one(loads: FoundationLoads) -> str:
    return "One support" if loads.supports else "All supports together"


def _kilo(loads: FoundationLoads, load: Components, names: Sequence[str]) -> list[str]:
    """Components of one support's load in kN, as a table shows them."""
    each = loads.of_support(load)
    return [quantity(getattr(each, name), "kN", "N", with_unit=False) for name in names]


def _static(loads: FoundationLoads, case: CaseLoads) -> str:
    """Weight on a support in kN; from least to greatest where they differ."""
    (even,) = _kilo(loads, case.static, ("vertical",))
    if len(set(loads.static_shares)) < 2:
        return even
    every = sorted(loads.static_on(one, case).vertical or 0.0 for one in loads.supports)
    low, high = (quantity(force, "kN", "N", with_unit=False) for force in (every[0], every[-1]))
    return span_of(low, high)


def _state(least: Components) -> Cell:
    known = [value for value in (least.normal, least.vertical) if value is not None]
    if not known:
        return Cell("not checked", state="not checked")
    return Cell("lifts off", state=ATTENTION) if min(known) < 0.0 else Cell("stays", state=PASS)


def _running_table(loads: FoundationLoads, shown: Sequence[CaseLoads]) -> Table:
    columns = (
        Column("Load case"),
        Column("Static, vertical", "kN", numeric=True, ends=len(set(loads.static_shares)) > 1),
        *(Column(name.capitalize(), "kN", numeric=True) for name in LOADS),
        Column("Least, vertical", "kN", numeric=True),
        Column("Least, normal", "kN", numeric=True),
        Column("Spring"),
    )
    rows = tuple(
        (
            *cells(
                one.name,
                _static(loads, one),
                *_kilo(loads, one.running, LOADS),
                *_kilo(loads, one.least, ("vertical", "normal")),
            ),
            _state(one.least),
        )
        for one in shown
    )
    caption = (
        "Static: weight of machine and load. Then the greatest dynamic load to both sides, peak. "
        "Least: static less dynamic; a spring lifts off where one of both is below zero."
    )
    if loads.supports:
        count = len(loads.supports)
        caption += f" The {count} supports move in step: all together load {count} times as much."
    at = f"running at {rpm(shown[0].omega)} rpm"
    hertz = f"{in_unit(shown[0].omega, 'Hz', 'rad/s'):.4g} Hz"
    return Table(f"{_one(loads)}, {at} ({hertz})", columns, rows, caption)


def _orders_table(loads: FoundationLoads, case: CaseLoads) -> Table:
    columns = [Column("Order"), Column("Hz", numeric=True)]
    for name in LOADS:
        columns += [
            Column(name.capitalize(), "kN", numeric=True),
            Column("phase", "deg", numeric=True),
        ]
    rows = []
    for one in case.orders:
        hertz = in_unit(one.order * case.omega, "Hz", "rad/s")
        row = [written(one.order, "g"), written(hertz, ".4g")]
        for name in LOADS:
            (amplitude,), angle = _kilo(loads, one.amplitude, (name,)), getattr(one.phase, name)
            zero = _is_nothing(getattr(one.amplitude, name), case)
            row += [three_digits(0.0), NOTHING] if zero else [amplitude, _degrees(angle)]
        rows.append(cells(*row))
    caption = (
        "Amplitude, and phase to the unbalance force along the surface (negative: it lags), of the "
        f"parts of the running load at multiples of the shaft's speed, {case_words(case.name)}."
    )
    return Table(f"{_one(loads)}, orders", tuple(columns), tuple(rows), caption)


def _is_nothing(amplitude: float | None, case: CaseLoads) -> bool:
    """Whether a part of the load is zero but for rounding: it then has no phase."""
    greatest = case.running.total or case.running.along or 0.0
    return amplitude is not None and amplitude <= 1e-9 * greatest


def _degrees(angle: float | None) -> str:
    return NOTHING if angle is None else written(math.degrees(angle), ".0f")


def _runs_table(loads: FoundationLoads) -> Table:
    columns = [Column("Start and stop")]
    for name in LOADS:
        columns += [
            Column(name.capitalize(), "kN", numeric=True),
            Column("at", "rpm", numeric=True),
        ]
    least = ("vertical", "normal")
    columns.append(Column("Excited", "rpm", ends=True))
    columns += [Column(f"Least, {name}", "kN", numeric=True) for name in least]
    columns.append(Column("Spring"))
    rows = tuple(
        (*cells(one.name, *_peaks(loads, one), _excited(one), *_kilo(loads, one.least, least)),
         _state(one.least))
        for one in loads.runs
    )  # fmt: skip
    caption = (
        "Greatest dynamic load on the way, and the speed at which it comes. Excited: the speeds "
        "about the greatest load at which it is above 71 % of it. Least: static less dynamic; a "
        "spring lifts off where one of both is below zero."
    )
    return Table(f"{_one(loads)}, start and stop", tuple(columns), rows, caption)


def _peaks(loads: FoundationLoads, run: RunLoads) -> Iterator[str]:
    for name in LOADS:
        yield from _kilo(loads, run.peaks, (name,))
        speed = getattr(run.at, name)
        yield NOTHING if speed is None else written(in_unit(speed, "rpm", "rad/s"), ".0f")


def _excited(run: RunLoads) -> str:
    low, high = (written(in_unit(omega, "rpm", "rad/s"), ".0f") for omega in run.excited)
    return span_of(low, high)


def _travel_table(loads: FoundationLoads, shown: Sequence[CaseLoads]) -> Table:
    names = ("along", "normal", "horizontal", "vertical")
    columns = (
        Column("Travel, for chutes"),
        Column("Frame"),
        *(Column(name.capitalize(), "mm", numeric=True) for name in names),
    )
    every: list[CaseLoads | RunLoads] = [*shown[:1], *loads.runs]
    rows = tuple(
        cells(
            one.name if isinstance(one, RunLoads) else f"running, {one.name}",
            frame,
            *(quantity(getattr(way, name), "mm", "m", with_unit=False) for name in names),
        )
        for one in every
        for frame, way in one.travel.items()
    )
    caption = "Greatest displacement from rest to either side."
    return Table("", columns, rows, caption)


def _notes(
    assessment: Assessment, loads: FoundationLoads, shown: Sequence[CaseLoads]
) -> Iterator[str]:
    if loads.supports:
        yield f"Loads of the {len(loads.supports)} supports are {loads.position}."
        if len(set(loads.static_shares)) > 1:
            pairs = zip(loads.supports, loads.static_shares, strict=True)
            yield "At rest " + ", ".join(f"{name} {100.0 * p:.3g} %" for name, p in pairs) + "."
    yield f"Rotation {loads.rotation}: {ROTATION[loads.rotation]}. It changes the horizontal load."
    yield from loads.notes
    missing = [case.name for case in assessment.cases if case.orbit is None]
    if missing:
        yield f"No motion was found in {'; '.join(missing)}."
    if len(shown) < len(loads.cases):
        yield (
            f"{len(loads.cases) - len(shown)} more load cases, whose dynamic loads are smaller, "
            "stand in results.json."
        )
