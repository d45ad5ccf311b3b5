"""A result on matplotlib Axes that are given, in the style that they have."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from flipflow.errors import InputError, MissingExtra
from flipflow.model.system import Coordinate
from flipflow.plotting.dispatch import figure
from flipflow.plotting.layout import MARKS, mark_size
from flipflow.plotting.palette import MARKERS
from flipflow.plotting.panels import Panel, Trace

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DASHES = {"unstable": "--", "undetermined": ":"}


def draw_on(
    result: object, ax: Axes | None, coordinate: Coordinate | None, units: str | None
) -> Axes:
    """Draw the first panel of a result's figure on Axes: see :meth:`Result.plot`."""
    try:
        import matplotlib.pyplot as plt  # noqa: PLC0415  slow to import
        from matplotlib.axes import Axes as Kind  # noqa: PLC0415
    except ImportError as error:
        raise MissingExtra("Plots need matplotlib: pip install 'flipflow[report]'.") from error
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
    """One trace; parts of one line, such as its unstable stretches, have one colour and entry."""
    name = trace.name if trace.legend else "_nolegend_"
    if trace.lower is not None:
        axes.fill_between(trace.x, trace.lower, trace.y, alpha=0.2, lw=0.0, label=name)
        return
    style: dict[str, Any] = {"label": name}
    if trace.role == "point":
        hollow = (trace.symbol or "").endswith("-open")
        mark = MARKERS.get(trace.symbol or "circle", "o")
        style |= {"ls": "none", "marker": mark} | ({"mfc": "none"} if hollow else {})
        if trace.x.size > MARKS:
            style |= {"ms": mark_size(trace.x.size), "mew": 0.0, "marker": "o"}
    else:
        style["ls"] = DASHES.get(trace.role, "-")
    if trace.colour in colours:
        style["color"] = colours[trace.colour]
    (drawn,) = axes.plot(trace.x, trace.y, **style)
    colours.setdefault(trace.colour, drawn.get_color())
