"""Figures on their own for print: vector or bitmap files by matplotlib, laid out as on the page."""

from __future__ import annotations

import io
import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from flipflow.errors import MissingExtra
from flipflow.plotting.layout import (
    CHARACTER,
    FONT,
    LABEL_ROW,
    SIDES,
    Geometry,
    Label,
    arrange,
    fitted,
    legend_columns,
    legend_names,
    mark_size,
)
from flipflow.plotting.palette import (
    COLOURS,
    DASHES,
    FAINT,
    FILLS,
    INK,
    MARKERS,
    SYMBOLS,
    TINTS,
)
from flipflow.plotting.panels import Axis, Bar, Cells, Line, Panel, PanelGrid, Trace
from flipflow.plotting.symbols import mathtext_subscript, with_symbols

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Sheet

PIXELS_AN_INCH = 96.0
POINT = 72.0 / PIXELS_AN_INCH
RESOLUTION = 300
DATE = {"pdf": "CreationDate", "svg": "Date"}
STYLES = {"dash": (0, (5, 2.5)), "dot": (0, (1, 2)), "dashdot": (0, (5, 2, 1, 2)), "solid": "-"}
MARKS_APART = 0.15  # along a line, as a share of the panel's diagonal
EDGE = 1.0  # pixels between a figure's edge and what is written
LEAST_IN_LEGEND = 3.0  # points; a mark of a cloud would not be seen there
OVERLAID = 1.8  # how much larger a bold mark is, which others are laid over
VEIL = {"facecolor": "white", "alpha": 0.85, "edgecolor": "none", "pad": 1.0}
FAMILIES = ("Arial", "Liberation Sans", "DejaVu Sans")
STYLE = {
    "font.size": FONT * POINT,
    "axes.edgecolor": INK,
    "axes.linewidth": 0.7,
    "grid.color": FAINT,
    "grid.linewidth": 0.6,
    "text.color": INK,
    "svg.hashsalt": "flipflow",  # the same figure makes the same file
    "pdf.fonttype": 42,
    "hatch.linewidth": 0.6,
    "text.parse_math": False,  # a load case may be called "$x$"
}


def printed(figure: PanelGrid, form: str) -> bytes:
    """The figure as a file of the format ``form``: "svg", "pdf" or "png".

    Raises
    ------
    MissingExtra
        When matplotlib is not installed.
    """
    require_matplotlib()
    return _saved(figure, form, {"font.family": _families()})


def require_matplotlib() -> None:
    """See that figures can be printed.

    Raises
    ------
    MissingExtra
        When matplotlib is not installed.
    """
    try:
        import matplotlib  # noqa: F401, ICN001, PLC0415  slow to import
    except ImportError as error:
        raise MissingExtra(
            "Figures for print need matplotlib: pip install 'flipflow[report]'."
        ) from error


def drawn_sheet(figure: PanelGrid) -> Sheet:
    """The figure as a sheet of matplotlib, in the style that is set."""
    from matplotlib.figure import Figure as Sheet  # noqa: PLC0415  slow to import

    foot = subject_lines(figure)
    height = figure.height + LABEL_ROW * len(foot)
    size = (figure.width / PIXELS_AN_INCH, height / PIXELS_AN_INCH)
    sheet = Sheet(figsize=size, dpi=PIXELS_AN_INCH)
    _draw(sheet, figure, arrange(figure, even=False), height)
    if figure.symbols:
        _set_symbols(sheet)
    if foot:
        sheet.text(3.0 / figure.width, 3.0 / height, "\n".join(foot), color=COLOURS["mark"],
                   va="bottom")  # fmt: skip
    _keep_within(sheet)
    return sheet


def _keep_within(sheet: Sheet) -> None:
    """Move the left edge of panels whose ticks are so long that the axis' title is cut off."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415  slow to import

    canvas: Any = FigureCanvasAgg(sheet)
    renderer = canvas.get_renderer()
    for axes in sheet.axes:
        words = axes.yaxis.get_tightbbox(renderer)
        if words is not None and words.x0 < EDGE:
            place, beyond = axes.get_position(), (EDGE - words.x0) / sheet.bbox.width
            axes.set_position((place.x0 + beyond, place.y0, place.width - beyond, place.height))


def _saved(figure: PanelGrid, form: str, own: dict[str, Any]) -> bytes:
    import matplotlib as mpl  # noqa: PLC0415  slow to import

    buffer = io.BytesIO()
    style: Any = {**STYLE, **own}
    with mpl.rc_context(style):
        sheet = drawn_sheet(figure)
        undated = {DATE[form]: None} if form in DATE else {}
        sheet.savefig(buffer, format=form, dpi=RESOLUTION, metadata=undated)
    return buffer.getvalue()


def _set_symbols(sheet: Sheet) -> None:
    from matplotlib.text import Text  # noqa: PLC0415  slow to import

    for text in sheet.findobj(Text):
        said = text.get_text()
        shown = with_symbols(said, mathtext_subscript)
        if shown != said:
            text.set_parse_math(True)
            text.set_text(shown)


def _families() -> list[str]:
    """The fonts of the list that are installed: matplotlib warns of each that is not."""
    from matplotlib import font_manager  # noqa: PLC0415

    known = {entry.name for entry in font_manager.fontManager.ttflist}
    return [name for name in FAMILIES if name in known]


def subject_lines(figure: PanelGrid) -> list[str]:
    """What a figure on its own belongs to, as lines below it."""
    return textwrap.wrap(figure.subject, int(figure.width / CHARACTER), break_on_hyphens=False)


def _draw(sheet: Sheet, figure: PanelGrid, geometry: Geometry, height: float) -> None:
    """The panels and the legend on a sheet of this height in pixels, from its top down."""
    handles: dict[str, Any] = {}
    for k, (panel, rect) in enumerate(zip(figure.panels, geometry.rects, strict=True)):
        foot = height - rect.top - rect.height
        place = (rect.left / figure.width, foot / height, rect.width / figure.width,
                 rect.height / height)  # fmt: skip
        axes, shown = sheet.add_axes(place), fitted(panel, rect.width)
        _draw_panel(axes, shown, handles)
        _draw_labels(axes, shown, geometry, k)
    names = legend_names(figure)
    if len(names) > 1:
        legend = sheet.legend(
            [handles[name] for name in names], names, loc="upper left", frameon=False,
            bbox_to_anchor=(0.0, 1.0), ncols=legend_columns(figure),
            borderaxespad=0.2, handlelength=2.4, columnspacing=1.2,
        )  # fmt: skip
        for line in legend.get_lines():
            line.set_markersize(max(line.get_markersize(), LEAST_IN_LEGEND))


def _draw_panel(axes: Axes, panel: Panel, handles: dict[str, Any]) -> None:
    axes.set_axisbelow(True)
    axes.grid(visible=True)
    for band in panel.bands:
        span = axes.axvspan if band.axis == "x" else axes.axhspan
        span(band.low, band.high, facecolor=_rgba(FILLS[band.role]), edgecolor="none", zorder=0.5)
    for cells in panel.cells:
        _draw_cells(axes, cells)
    for trace in panel.traces:
        _draw_trace(axes, trace, handles)
    for bar in panel.bars:
        _draw_bar(axes, bar, handles)
    for line in panel.lines:
        rule = axes.axvline if line.axis == "x" else axes.axhline
        rule(line.at, color=COLOURS[line.colour], lw=0.9, ls=STYLES[line.dash])
    for arrow in panel.arrows:
        style = {
            "arrowstyle": "-|>", "color": COLOURS[arrow.colour], "lw": 1.0, "shrinkA": 0.0,
            "shrinkB": 0.0,
        }  # fmt: skip
        axes.annotate("", (arrow.x1, arrow.y1), (arrow.x0, arrow.y0), arrowprops=style)
    _set_axis(axes, panel.x, "x")
    _set_axis(axes, panel.y, "y")
    if panel.equal:
        axes.set_aspect("equal", adjustable="box")


def _draw_trace(axes: Axes, trace: Trace, handles: dict[str, Any]) -> None:
    if trace.lower is not None:
        fill = _rgba(FILLS[trace.colour])
        area = axes.fill_between(trace.x, trace.lower, trace.y, color=fill, lw=0.0, zorder=1.0)
        handles.setdefault(trace.name, area)
        return
    colour = COLOURS[trace.colour]
    style: dict[str, Any] = {"color": colour}
    hollow = (trace.symbol or "").endswith("-open")
    if trace.role == "point":
        size = point_size(trace)
        style |= {"ls": "none", "ms": size, "mew": min(1.0, size / 4.0), "zorder": 3.0,
                  "mfc": "none" if hollow else colour}  # fmt: skip
    else:
        style |= {"lw": line_width(trace), "ms": 4.0, "mfc": "white",
                  "ls": STYLES[line_dash(trace)], "markevery": mark_places(trace),
                  "alpha": trace.opacity}  # fmt: skip
    (handle,) = axes.plot(trace.x, trace.y, marker=MARKERS.get(trace.symbol or "", ""), **style)
    handles.setdefault(trace.name, handle)


def point_size(trace: Trace) -> float:
    """Size in points of each mark of a cloud."""
    return mark_size(trace.x.size) * (OVERLAID if trace.bold else 1.0)


def line_width(trace: Trace) -> float:
    """Width of a line in points."""
    return 4.2 if trace.role == "beneath" else 1.6 if trace.bold else 1.0


def line_dash(trace: Trace) -> str:
    """Name of a line's dash in ``STYLES``."""
    return trace.dash or DASHES.get(trace.role, "solid")


def mark_places(trace: Trace) -> tuple[float, float] | None:
    """Where marks begin on a line, and how far apart, as shares of the panel's diagonal.

    Those of lines that coincide alternate; None where there are none.
    """
    drawn = np.isfinite(np.asarray(trace.x, float)) & np.isfinite(np.asarray(trace.y, float))
    if not trace.symbol or not drawn.any():
        return None
    return MARKS_APART * SYMBOLS.index(trace.symbol) / len(SYMBOLS), MARKS_APART


def _draw_cells(axes: Axes, cells: Cells) -> None:
    from matplotlib.colors import ListedColormap  # noqa: PLC0415  slow to import

    colours = ListedColormap([TINTS[name] for name in cells.colours])
    axes.pcolormesh(
        cells.x, cells.y, cells.kind, cmap=colours, vmin=-0.5, vmax=len(cells.colours) - 0.5,
        rasterized=True, zorder=0.4,
    )  # fmt: skip


def _draw_bar(axes: Axes, bar: Bar, handles: dict[str, Any]) -> None:
    box = axes.barh(
        bar.y, bar.high - bar.low, bar.thickness, bar.low, color=COLOURS[bar.colour],
        hatch=2 * bar.hatch, edgecolor="white" if bar.hatch else INK, lw=0.5,
    )  # fmt: skip
    handles.setdefault(bar.name, box)
    if bar.text:
        axes.annotate(bar.text, (bar.high, bar.y), (4.0, 0.0), textcoords="offset points",
                      va="center")  # fmt: skip


def _draw_labels(axes: Axes, panel: Panel, geometry: Geometry, index: int) -> None:
    if panel.title:
        axes.annotate(
            panel.title, (0.0, 1.0), (0.0, (geometry.titles[index] + 4.0) * POINT),
            xycoords="axes fraction", textcoords="offset points", weight="bold",
        )  # fmt: skip
    for k, line in enumerate(panel.lines):
        if line.text:
            _draw_line_label(axes, line, geometry.labels[index].get(k))
    for note in panel.notes:
        axes.text(note.x, note.y, note.text.replace("<br>", "\n"), color=COLOURS[note.colour],
                  ha=note.anchor, va="center", bbox=VEIL)  # fmt: skip


def _draw_line_label(axes: Axes, line: Line, place: Label | None) -> None:
    colour = COLOURS[line.colour]
    if place is not None:
        up = LABEL_ROW * place.level + 1.0
        axes.annotate(line.text, (line.at, 1.0), (place.shift * POINT, up * POINT),
                      xycoords=("data", "axes fraction"), textcoords="offset points",
                      ha="center", va="bottom", color=colour)  # fmt: skip
    else:
        side = SIDES.get(line.text_at, "center")
        inwards = {"left": 3.0, "right": -3.0}.get(side, 0.0)
        up, foot = (-2.0, "top") if line.under else (2.0, "bottom")
        axes.annotate(line.text, (line.text_at, line.at), (inwards, up),
                      xycoords=("axes fraction", "data"), textcoords="offset points",
                      ha=side, va=foot, color=colour)  # fmt: skip


def _set_axis(axes: Axes, axis: Axis, way: str) -> None:
    ends: dict[str, Any] = {} if axis.bounds is None else {f"{way}lim": axis.bounds}
    axes.set(**{f"{way}label": axis.title}, **ends)
    if axis.ticks:
        ruler = axes.xaxis if way == "x" else axes.yaxis
        ruler.set_ticks([at for at, _ in axis.ticks], labels=[word for _, word in axis.ticks])


def _rgba(css: str) -> tuple[float, float, float, float]:
    red, green, blue, alpha = (float(part) for part in css[5:-1].split(","))
    return red / 255.0, green / 255.0, blue / 255.0, alpha
