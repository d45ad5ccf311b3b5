"""A result on matplotlib Axes that are given, in the style that they have."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from flipflow.errors import InputError, required
from flipflow.model.system import Coordinate
from flipflow.plotting.dispatch import figure
from flipflow.plotting.layout import MARKS, mark_size
from flipflow.plotting.panels import Panel, Trace

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MARKERS = {
    "circle": "o", "circle-open": "o", "square": "s", "square-open": "s", "triangle": "^",
    "triangle-open": "v", "diamond": "D", "diamond-open": "D", "cross": "x", "star": "*",
}  # fmt: skip
DASHES = {"unstable": "--", "undetermined": ":"}
NEUTRAL = "0.35"  # of entries of the legend that belong to no line
OF_A_LINE = "jump"  # the colour that marks upon a line have on a page


def draw_on(
    result: object, ax: Axes | None, coordinate: Coordinate | None, units: str | None
) -> Axes:
    """Draw the first panel of a result's figure on Axes: see :meth:`Result.plot`."""
    required("matplotlib.pyplot", "Plots need matplotlib", "report")
    import matplotlib.pyplot as plt  # noqa: PLC0415  slow to import
    from matplotlib.axes import Axes as Kind  # noqa: PLC0415

    if ax is not None and not isinstance(ax, Kind):
        raise InputError("ax", type(ax).__name__, "give matplotlib Axes, or None for new ones")
    panel = figure(result, coordinate=coordinate, units=units).panels[0]
    axes = plt.subplots()[1] if ax is None else ax
    _draw(axes, panel)
    return axes


def _draw(axes: Axes, panel: Panel) -> None:
    colours: dict[str, Any] = {}
    for band in panel.bands:
        span = axes.axvspan if band.axis == "x" else axes.axhspan
        span(band.low, band.high, color="0.5", alpha=0.15, lw=0.0)
    for cells in panel.cells:
        axes.pcolormesh(cells.x, cells.y, cells.kind, rasterized=True)
    for trace in panel.traces:
        _draw_trace(axes, trace, colours)
    for bar in panel.bars:
        axes.barh(bar.y, bar.high - bar.low, bar.thickness, bar.low)
    for line in panel.lines:
        rule = axes.axvline if line.axis == "x" else axes.axhline
        rule(line.at, color="0.5", lw=0.8, ls=":")
    axes.set(xlabel=panel.x.title, ylabel=panel.y.title)
    for axis, way in ((panel.x, axes.xaxis), (panel.y, axes.yaxis)):
        if axis.ticks:
            way.set_ticks([at for at, _ in axis.ticks], labels=[word for _, word in axis.ticks])
    if panel.equal:
        axes.set_aspect("equal", adjustable="datalim")


def _draw_trace(axes: Axes, trace: Trace, colours: dict[str, Any]) -> None:
    """One trace; parts of one line, such as its unstable stretches, have one colour and entry.

    Marks upon a line have its colour, and one entry for all lines of the Axes: only lines take
    colours of the cycle.
    """
    name = trace.name if trace.legend else "_nolegend_"
    if trace.lower is not None:
        axes.fill_between(trace.x, trace.lower, trace.y, alpha=0.2, lw=0.0, label=name)
        return
    style = _style(trace)
    marks = trace.role == "point" and trace.colour == OF_A_LINE
    explains = not np.isfinite(trace.x).any()
    if marks or explains:
        if trace.legend and not _explained(axes, trace.name):
            axes.plot([], [], label=trace.name, **style, color=NEUTRAL)
        name = "_nolegend_"
    if explains:
        return
    if marks:
        style["color"] = next(reversed(colours.values()), NEUTRAL)
    elif trace.colour in colours:
        style["color"] = colours[trace.colour]
    (drawn,) = axes.plot(trace.x, trace.y, label=name, **style)
    if not marks:
        colours.setdefault(trace.colour, drawn.get_color())


def _explained(axes: Axes, name: str) -> bool:
    """Whether the legend has such an entry already, of a result that was drawn before."""
    return any(line.get_label() == name and line.get_color() == NEUTRAL for line in axes.lines)


def _style(trace: Trace) -> dict[str, Any]:
    """How matplotlib draws a trace, but for its colour."""
    if trace.role != "point":
        return {"ls": DASHES.get(trace.role, "-")}
    if trace.x.size > MARKS:
        return {"ls": "none", "marker": "o", "ms": mark_size(trace.x.size), "mew": 0.0}
    hollow = (trace.symbol or "").endswith("-open")
    mark = MARKERS.get(trace.symbol or "circle", "o")
    return {"ls": "none", "marker": mark} | ({"mfc": "none"} if hollow else {})
