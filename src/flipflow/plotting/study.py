"""Studies drawn: maps with contours, curves over one field, tornado, parallel coordinates.

Of several frequencies the first is drawn; of several load cases, too, but curves show each.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

from flipflow.batch.reasons import FOUND
from flipflow.compiled.arrays import Real
from flipflow.errors import InputError, required
from flipflow.model.arguments import checked_word
from flipflow.model.fields import FIELD, symbol_of
from flipflow.model.limits import Limits, limit_bounds
from flipflow.model.numerals import capitalized, digits
from flipflow.model.parameters import value_of
from flipflow.model.quantities import QUANTITIES, Quantity, quantity_named
from flipflow.model.screen import FlipFlowScreen
from flipflow.plotting.figure import Figure
from flipflow.plotting.layout import LEGEND_LETTERS, within
from flipflow.plotting.palette import case_colour, case_symbol
from flipflow.plotting.panels import Axis, Cells, Line, Note, Panel, Trace, cell_edges
from flipflow.plotting.scales import MM, SHOWN
from flipflow.plotting.sensitivity import tornado_figure
from flipflow.plotting.units import speed_of
from flipflow.studies.sensitivity import OneAtATime
from flipflow.studies.study import Study
from flipflow.studies.tolerance import (
    FOLDS,
    Tolerance,
    folds_known,
    jumped_motions,
    limits_in_words,
    limits_known,
    limits_left_out,
)

LEVELS = 7  # contours of a map, about
MOST_AXES = 10  # of parallel coordinates: the fields, then quantities
MOST_MAPS = 4  # of one figure
MOST_LINES = 300  # machines of parallel coordinates
CLEAR_LINES, LEAST_OPACITY = 30, 0.12  # lines that may be opaque; of very many
FIELD_SCALES = {"mm": MM, "kN/m": 1e-3, "kN s/m": 1e-3, "kg mm": 1e3}


def study_figure(study: Study) -> Figure:
    """A map of a grid of two fields, curves over one, else parallel coordinates.

    Parameters
    ----------
    study
        What :func:`flipflow.study` returns.
    """
    if study.sampling == "grid":
        wide = wide_fields(study)
        if len(wide) >= 2:
            return maps_figure(study)
        if wide:
            return curves_figure(study, wide[0])
    return parallel_figure(study)


def map_figure(study: Study, quantity: str | None = None, limits: Limits | None = None) -> Figure:
    """Contours of a quantity over the first two fields of a grid, with folds and limits.

    Other fields stay at the value next to the machine's own.

    Parameters
    ----------
    study
        What :func:`flipflow.study` returns of a grid.
    quantity
        Which of the study's quantities; None: the first.
    limits
        Where they are met is shaded; their own contours are drawn, too.

    Raises
    ------
    InputError
        For a study that is no grid of two fields, and for a quantity that it did not ask for.
    MissingExtra
        When contourpy, which comes with matplotlib, is not installed.
    """
    name = checked_word("quantity", quantity or study.quantities[0], study.quantities)
    return _maps(study, (name,), limits)


def maps_figure(study: Study, limits: Limits | None = None) -> Figure:
    """A map of each of the first quantities; folds are lines of each, and none of their own.

    Parameters and errors as of :func:`map_figure`.
    """
    motions = [name for name in study.quantities if name not in FOLDS] or study.quantities
    return _maps(study, motions[:MOST_MAPS], limits)


def _maps(study: Study, names: Sequence[str], limits: Limits | None) -> Figure:
    across, up = _two_fields(study)
    grid = _Grid(study, across, up)
    asked = [quantity_named(name, study.machine) for name in names]
    panels = tuple(_map_panel(grid, one, limits) for one in asked)
    shaded = "" if limits is None else _shaded_words(study, limits)
    jumps = (
        " Dashed: beyond this line the machine has jumped, and no contour leads across. Dotted: "
        "from this line on two motions are possible."
        if any(trace.dash for panel in panels for trace in panel.traces)
        else ""
    )
    told = " and ".join(f"the {one.label} in {one.shown_unit or 'plain numbers'}" for one in asked)
    over = f"over {symbol_of(across)} and {symbol_of(up)}"
    title = f"{capitalized(asked[0].label)} {over}" if len(asked) == 1 else f"Maps {over}"
    caption = f"Contours of {told}.{_held_words(study, (across, up))}{shaded}{jumps}"
    return Figure(title, caption, panels, height=440 * len(panels))


def _map_panel(grid: _Grid, one: Quantity, limits: Limits | None) -> Panel:
    study = grid.study
    traces = list(_contours(grid, one))
    cells: tuple[Cells, ...] = ()
    if limits is not None:
        traces += _limit_contours(grid, limits)
        cells = (_met_cells(grid, limits),) if limits_known(study, limits) else ()
    traces += _fold_contours(grid)
    notes = tuple(_level_notes(traces))
    unit = f" in {one.shown_unit}" if one.shown_unit else ""
    where = _where(study, one)
    return Panel(
        _field_axis(study, grid.across, grid.x), _field_axis(study, grid.up, grid.y),
        tuple(trace for trace in traces if trace.x.size), cells=cells, notes=notes,
        title=", ".join(filter(None, (f"{capitalized(one.label)}{unit}", where))),
    )  # fmt: skip


def curves_figure(study: Study, field: str) -> Figure:
    """Every quantity over the one field of a grid, a line for each load case."""
    keep = _others_nearest(study, (field,))
    x = np.asarray(study.columns[field], float)[keep] * _field_scale(study, field)
    panels = []
    for k, name in enumerate(study.quantities):
        one = quantity_named(name, study.machine)
        values = _first(study, name)[keep] * SHOWN[one.shown_unit]
        traces = tuple(
            Trace(
                case, x, values[:, c], colour=case_colour(c), symbol=case_symbol(c), legend=k == 0
            )
            for c, case in enumerate(study.cases)
        )
        panels.append(Panel(_field_axis(study, field, x), Axis(one.label, one.shown_unit), traces))
    title = f"{symbol_of(field)} varied{speed_in_words(study, study.omega[0])}"
    caption = (
        "Each line: a load case. Where a line is broken the quantity has no value."
        f"{_held_words(study, (field,))}"
    )
    return Figure(title, caption, tuple(panels), height=230 * len(panels) + 60)


def study_tornado(study: Study, quantity: str) -> Figure:
    """Change of a quantity when one field alone moves to the low or high end of its range.

    Parameters
    ----------
    study
        What :func:`flipflow.study` returns.
    quantity
        One of its quantities.
    """
    checked_word("quantity", quantity, study.quantities)

    def read(table: Real) -> Real:
        whole = study.values[quantity].ndim == 2
        return table[..., 0] if whole else table[..., 0, 0]

    found = OneAtATime(
        machine=study.machine,
        quantity=quantity,
        names=study.names,
        distributions=study.distributions,
        omega=float(study.omega[0]),
        nominal=float(read(study.nominal[quantity])),
        at_low=np.asarray(read(study.at_low[quantity])),
        at_high=np.asarray(read(study.at_high[quantity])),
        own=tuple(value_of(study.machine, name) for name in study.names),
    )
    drawn = tornado_figure(found)
    if len(study.cases) == 1:
        return drawn
    return replace(drawn, title=f"{drawn.title}, load case {study.cases[0]}")


def parallel_figure(
    study: Study,
    passing: NDArray[np.bool_] | None = None,
    *,
    met: str = "every limit",
) -> Figure:
    """Each machine a line across its fields and quantities.

    Parameters
    ----------
    study
        What :func:`flipflow.study` returns.
    passing
        Which machines meet every limit, (S,); the others are drawn in another colour.
    met
        What those have met, in words.
    """
    fine = np.ones(study.size, bool) if passing is None else np.asarray(passing)
    columns = list(_axes(study))[:MOST_AXES]
    rows = np.linspace(0, study.size - 1, min(study.size, MOST_LINES)).astype(int)
    heights = np.stack([_share(values) for _, values in columns], axis=1)[rows]
    groups = [(f"meets {met}", fine[rows], "allowed"), ("does not", ~fine[rows], "limit")]
    if passing is None:
        groups = [("machine", fine[rows], "main")]
    traces = [
        trace
        for name, chosen, colour in groups[::-1]
        for trace in _machine_lines(name, heights[chosen], colour)
    ]
    ticks = tuple((float(k), label) for k, (label, _) in enumerate(columns))
    notes = tuple(_end_notes(columns))
    uprights = tuple(Line("x", float(k), "", "mark", "solid") for k in range(len(columns)))
    panel = Panel(
        Axis("", "", (-0.4, len(columns) - 0.6), ticks),
        Axis("share of the range", "", (-0.12, 1.12), ((0.0, "low"), (1.0, "high"))),
        tuple(traces), lines=uprights, notes=notes, title=_where(study, None),
    )  # fmt: skip
    shown = f" {rows.size} of {study.size} machines are drawn." if rows.size < study.size else ""
    caption = (
        "Each line is a machine: its fields, then what it does; the ends of every axis are the "
        f"least and the greatest value.{shown}"
    )
    if passing is not None:
        where = _in_every_case(study)
        caption += f" Green: the machine meets {met}{where}; red: it does not."
    return Figure("Machines of the study", caption, (panel,), height=400)


def _machine_lines(name: str, heights: Real, colour: str) -> Iterator[Trace]:
    """A line for each machine, (n, axes), and one without points for the legend.

    Lines of their own, for overlaid parts of one translucent line are no darker.
    """
    count, axes = heights.shape
    if count == 0:
        return
    yield Trace(name, np.full(1, np.nan), np.full(1, np.nan), colour=colour, bold=True)
    opacity = float(np.clip(CLEAR_LINES / count, LEAST_OPACITY, 1.0))
    for row in heights:
        yield Trace(name, np.arange(float(axes)), row, colour=colour, legend=False, opacity=opacity)


class _Grid:
    """Two fields of a grid as axes in shown units, and quantities over them."""

    def __init__(self, study: Study, across: str, up: str) -> None:
        self.study, self.across, self.up = study, across, up
        self._keep = _others_nearest(study, (across, up))
        first, second = (np.asarray(study.columns[n], float)[self._keep] for n in (across, up))
        x, y = np.unique(first), np.unique(second)
        # A value that was given twice makes the same machine twice.
        self._order = np.unique(np.stack([second, first]), axis=1, return_index=True)[1]
        self._shape = y.size, x.size
        self.x, self.y = x * _field_scale(study, across), y * _field_scale(study, up)

    def values(self, name: str, case: int = 0) -> Real:
        """A quantity, (rows of y, columns of x), SI."""
        table = _first(self.study, name)[self._keep, case]
        return np.asarray(table[self._order].reshape(self._shape))

    def lines(self, z: Real, level: float, *, parted: bool = True) -> Iterator[tuple[Real, Real]]:
        """Where z takes a level; ``parted`` by the jump for what is of a motion."""
        contourpy = required("contourpy", "Maps need contourpy", "report")
        for side in self._sides if parted else (np.ones(self._shape, bool),):
            hidden = np.ma.masked_where(~np.isfinite(z) | ~side, z)
            if hidden.count():
                for line in contourpy.contour_generator(self.x, self.y, hidden).lines(level):
                    yield np.asarray(line[:, 0]), np.asarray(line[:, 1])

    @cached_property
    def _sides(self) -> tuple[NDArray[np.bool_], ...]:
        """Machines before and beyond their jump: no line leads from one motion to the other."""
        everywhere = np.ones(self._shape, bool)
        if not folds_known(self.study):
            return (everywhere,)
        jumped = jumped_motions(self.study)[self._keep, 0, 0]
        beyond = jumped[self._order].reshape(self._shape)
        return ~beyond, beyond


def _contours(grid: _Grid, one: Quantity) -> Iterator[Trace]:
    z = grid.values(one.name) * SHOWN[one.shown_unit]
    finite = z[np.isfinite(z)]
    if finite.size == 0 or finite.min() == finite.max():
        return
    for level in _round_levels(float(finite.min()), float(finite.max())):
        yield _joined(digits(level, 4), grid.lines(z, level), "main", legend=False)


def _limit_contours(grid: _Grid, limits: Limits) -> Iterator[Trace]:
    for name in limits.given:
        if name not in grid.study.values:
            continue
        one = QUANTITIES[name]
        z = np.where(np.isposinf(values := grid.values(name)), 1e30, values)
        for bound in limit_bounds(limits, name):
            if np.isfinite(bound):
                yield _joined(f"limit on {one.label}", grid.lines(z, bound), "limit", bold=True)


def _fold_contours(grid: _Grid) -> Iterator[Trace]:
    omega = float(grid.study.omega[0])
    for name, dash in zip(FOLDS, ("dot", "dash"), strict=True):
        if name in grid.study.values and np.isfinite(omega):
            lines = grid.lines(grid.values(name), omega, parted=False)
            words = f"{QUANTITIES[name].label} = {speed_of(grid.study, omega)}"
            yield _joined(words, lines, "jump", dash=dash)


def _met_cells(grid: _Grid, limits: Limits) -> Cells:
    """Machines that meet every limit in every case, as cells around the points of the grid."""
    met = np.ones((grid.y.size, grid.x.size), bool)
    for name, case in product(limits_known(grid.study, limits), range(len(grid.study.cases))):
        low, high = limit_bounds(limits, name)
        operation = QUANTITIES[name].of == "operation"
        values = grid.study.omega[0] if operation else grid.values(name, case)
        met &= (values >= low) & (values <= high)
    return Cells(cell_edges(grid.x), cell_edges(grid.y), met.astype(np.int64), ("none", "case 3"))


def _shaded_words(study: Study, limits: Limits) -> str:
    """What the shading of a map means, and which limits it does not know."""
    known = limits_known(study, limits)
    if not known:
        return ""
    left_out = limits_left_out(limits, known)
    others = f" Not looked at: {', '.join(left_out)}." if left_out else ""
    met = f"{limits_in_words(limits, known)}{_in_every_case(study)}"
    return f" Shaded: machines that meet {met}.{others}"


def _in_every_case(study: Study) -> str:
    return " in every load case" if len(study.cases) > 1 else ""


def _held_words(study: Study, shown: tuple[str, ...]) -> str:
    """At which of their values other varied fields are held; empty where there are none."""
    keep = _others_nearest(study, shown)
    held = [
        f"{_axis_words(study, name)} = {_field_value(study, name, column[keep][0])}"
        for name, column in study.columns.items()
        if name not in shown and np.unique(column).size > 1
    ]
    return f" Held: {'; '.join(held)}." if held else ""


def _field_value(study: Study, field: str, value: object) -> str:
    if isinstance(value, float):
        return digits(value * _field_scale(study, field), 4)
    return str(value)


def _joined(
    name: str, lines: Iterator[tuple[Real, Real]], colour: str, *, bold: bool = False,
    dash: str = "", legend: bool = True,
) -> Trace:  # fmt: skip
    """All parts of a contour as one line with gaps."""
    x, y = [np.zeros(0)], [np.zeros(0)]
    for one, other in lines:
        x += [one, np.array([np.nan])]
        y += [other, np.array([np.nan])]
    return Trace(name, np.concatenate(x), np.concatenate(y), colour=colour, bold=bold, dash=dash,
                 legend=legend)  # fmt: skip


def _level_notes(traces: Sequence[Trace]) -> Iterator[Note]:
    """The level of a contour at the middle of its longest part."""
    for trace in traces:
        if trace.legend or trace.x.size == 0:
            continue
        ends = np.flatnonzero(np.isnan(trace.x))
        begins = np.concatenate([[0], ends[:-1] + 1])
        k = int(np.argmax(ends - begins))
        # A part of two points has its middle between them, not on the edge.
        middle = [(begins[k] + ends[k] - 1) // 2, (begins[k] + ends[k]) // 2]
        x, y = (float(line[middle].mean()) for line in (trace.x, trace.y))
        yield Note(x, y, trace.name, "center", "main")


def _round_levels(low: float, high: float) -> Real:
    """Round numbers between two, about as many as wanted."""
    raw = (high - low) / LEVELS
    step = 10.0 ** np.floor(np.log10(raw))
    step *= next(m for m in (1.0, 2.0, 5.0, 10.0) if m * step >= raw)
    return np.asarray(step * np.arange(np.floor(low / step) + 1.0, np.ceil(high / step)))


def wide_fields(study: Study) -> list[str]:
    """Fields with several numbers, in the order given."""
    return [
        name
        for name, column in study.columns.items()
        if column.dtype.kind == "f" and np.unique(column).size > 1
    ]


def _two_fields(study: Study) -> tuple[str, str]:
    wide = wide_fields(study) if study.sampling == "grid" else []
    if len(wide) < 2:
        remedy = "a map needs a grid of two fields with several values each"
        raise InputError("study", study.sampling, remedy)
    return wide[0], wide[1]


def _others_nearest(study: Study, shown: tuple[str, ...]) -> NDArray[np.bool_]:
    """Machines whose other fields are at the value next to the machine's own."""
    keep = np.ones(study.size, bool)
    for name, column in study.columns.items():
        if name in shown:
            continue
        values, own = np.unique(column), value_of(study.machine, name)
        if column.dtype.kind == "f" and isinstance(own, float) and np.isfinite(own):
            numbers = np.asarray(values, float)
            keep &= column == numbers[np.abs(numbers - own).argmin()]
        else:
            keep &= column == (own if own in values else values[0])
    return keep


def _first(study: Study, name: str) -> Real:
    """A quantity at the first frequency, (S, C)."""
    table = study.values[name]
    return np.asarray(table if table.ndim == 2 else table[:, :, 0])


def _axes(study: Study) -> Iterator[tuple[str, Real]]:
    """Label and values of every axis of parallel coordinates, in shown units."""
    for name, column in study.columns.items():
        if column.dtype.kind == "f":
            yield _axis_words(study, name), np.asarray(column, float) * _field_scale(study, name)
    for name in study.quantities:
        one = quantity_named(name, study.machine)
        values = _first(study, name)[:, 0] * SHOWN[one.shown_unit]
        unit = f", {one.shown_unit}" if one.shown_unit else ""
        known = study.reason[:, 0, 0] == FOUND
        yield f"{one.symbol}{unit}", np.where(known & np.isfinite(values), values, np.nan)


def _share(values: Real) -> Real:
    finite = values[np.isfinite(values)]
    if finite.size == 0 or np.ptp(finite) == 0.0:
        return np.where(np.isfinite(values), 0.5, np.nan)
    return np.asarray((values - finite.min()) / np.ptp(finite))


def _end_notes(columns: Sequence[tuple[str, Real]]) -> Iterator[Note]:
    for k, (_, values) in enumerate(columns):
        finite = values[np.isfinite(values)]
        if finite.size:
            yield Note(float(k), -0.06, digits(float(finite.min()), 4), "center", "mark")
            yield Note(float(k), 1.06, digits(float(finite.max()), 4), "center", "mark")


def _field_scale(study: Study, field: str) -> float:
    return FIELD_SCALES.get(_field_unit(study, field), 1.0)


def _field_unit(study: Study, field: str) -> str:
    if field not in FIELD or not isinstance(study.machine, FlipFlowScreen):
        return ""
    return field_unit(field)


def field_unit(field: str) -> str:
    """Unit in which a field of a screen is drawn: that of its file where its scale is known."""
    known = FIELD[field]
    return known.file_unit if known.file_unit in FIELD_SCALES else known.unit


def _axis_words(study: Study, field: str) -> str:
    unit = _field_unit(study, field)
    return f"{symbol_of(field)}, {unit}" if unit else symbol_of(field)


def _field_axis(study: Study, field: str, shown: Real) -> Axis:
    words = f"{field.replace('_', ' ')} ({symbol_of(field)})" if field in FIELD else field
    return Axis(words, _field_unit(study, field), (float(shown.min()), float(shown.max())))


def _where(study: Study, one: Quantity | None) -> str:
    """Load case and speed of a panel."""
    name = within(study.cases[0], LEGEND_LETTERS)
    case = f"load case {name}" if len(study.cases) > 1 else ""
    whole = one is not None and one.of == "response"
    speed = "" if whole else speed_in_words(study, study.omega[0]).removeprefix(" ")
    return " ".join(filter(None, (case, speed)))


def speed_in_words(found: Study | Tolerance, omega: float) -> str:
    """A blank and "at 850 rpm"; nothing for a study of whole responses alone."""
    return f" at {speed_of(found, float(omega))}" if np.isfinite(omega) else ""
