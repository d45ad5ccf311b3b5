"""What a sensitivity becomes in a report and in the terminal."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flipflow.model.fields import FIELD
from flipflow.model.quantities import quantity_named
from flipflow.plotting.sensitivity import changes, index_order, sensitivity_figure, tornado_figure
from flipflow.plotting.units import speed_of
from flipflow.report.blocks import (
    Block,
    Column,
    FigureBlock,
    Heading,
    Note,
    Table,
    Text,
    Values,
    cells,
)
from flipflow.report.numbers import NOTHING, quantity, signed, written
from flipflow.report.registry import Part, section
from flipflow.studies.assessment import Assessment
from flipflow.studies.sensitivity import Sensitivity


@section(Sensitivity, Part.DETAILS, 10, brief=True)
def summary_of_indices(result: Sensitivity) -> Iterator[Block]:
    """What was asked, the table of indices, and what is to be kept in mind."""
    one = quantity_named(result.quantity, result.machine)
    rows = [("Quantity", one.label), ("Samples", f"{result.n * (len(result.names) + 2)}")]
    if isinstance(result.omega, float):
        rows.append(("Speed", speed_of(result, result.omega)))
    if not result.over_frequency:
        rows.append(("Nominal", quantity(float(result.nominal), one.shown_unit, one.unit)))
    yield Values(tuple(rows))
    yield _over_frequency(result) if result.over_frequency else _at_one(result)
    yield from (Note(text) for text in result.notes)


@section(Sensitivity, Part.DETAILS, 20)
def figures_of_indices(result: Sensitivity) -> Iterator[Block]:
    """Indices over frequency, or as bars with the tornado chart."""
    yield FigureBlock(sensitivity_figure(result))


@section(Assessment, Part.DETAILS, 65)
def tornado(assessment: Assessment) -> Iterator[Block]:
    """What moves the amplitude most, one value of the empty machine at a time."""
    found = assessment.tornado
    if found is None or not np.isfinite(found.nominal):
        return
    yield Heading("What moves the amplitude", 1, new_page=False)
    yield Text(
        "The relative amplitude of the empty machine at working speed when one value alone is 5 % "
        "lower or higher; the longest bar is the value to make and keep most exactly."
    )
    yield FigureBlock(tornado_figure(found))


def _at_one(result: Sensitivity) -> Table:
    unit = quantity_named(result.quantity, result.machine).shown_unit
    columns = (
        Column("Field"), Column("Symbol", brief=False),
        Column("First", "order", numeric=True), Column("+/-", "95 %", numeric=True),
        Column("Total", "", numeric=True), Column("+/-", "95 %", numeric=True),
        Column("Low end", unit, numeric=True), Column("High end", unit, numeric=True),
    )  # fmt: skip
    low, high = changes(result, None)
    rows = tuple(
        cells(
            result.names[i], _symbol(result.names[i]),
            _index(result.first_order[i]), _index(result.first_order_confidence[i]),
            _index(result.total[i]), _index(result.total_confidence[i]),
            *(signed(float(change[i])) for change in (low, high)),
        )
        for i in index_order(result)
    )  # fmt: skip
    caption = "Ends: change of the quantity when that field alone moves to the end of its range."
    return Table("Sobol indices", columns, rows, caption)


def _over_frequency(result: Sensitivity) -> Table:
    speeds = [speed_of(result, float(one)).partition(" ") for one in np.asarray(result.omega)]
    at = Column("at", speeds[0][2], numeric=True)
    columns = (
        Column("Field"), Column("Symbol"), Column("Greatest", "total", numeric=True),
        Column("+/-", "95 %", numeric=True), at, Column("Least", "total", numeric=True), at,
    )  # fmt: skip
    rows = []
    for i in index_order(result):
        total = result.total[:, i]
        if np.all(np.isnan(total)):
            rows.append(cells(result.names[i], _symbol(result.names[i]), *[NOTHING] * 5))
            continue
        top, foot = int(np.nanargmax(total)), int(np.nanargmin(total))
        rows.append(
            cells(
                result.names[i], _symbol(result.names[i]),
                _index(total[top]), _index(result.total_confidence[top, i]), speeds[top][0],
                _index(total[foot]), speeds[foot][0],
            )
        )  # fmt: skip
    return Table("Sobol indices over frequency", columns, tuple(rows))


def _symbol(field: str) -> str:
    return FIELD[field].symbol if field in FIELD else NOTHING


def _index(value: float) -> str:
    return written(float(value), ".3f")
