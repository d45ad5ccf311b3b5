"""Figures for the page: plotly's plain dictionaries, and one HTML file that opens offline.

The dictionaries are built here and checked by plotly.js in the browser, so that plotly's Python
classes, which take half a second to load, are not needed.
"""

from __future__ import annotations

import html
import json
import math
from collections.abc import Iterator
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flipflow.plotting.layout import (
    FONT,
    LABEL_ROW,
    SIDES,
    Geometry,
    Label,
    Rect,
    arrange,
    fitted,
    legend_names,
    mark_size,
)
from flipflow.plotting.palette import COLOURS, DASHES, FAINT, FILLS, INK, STABILITY_WORDS, TINTS
from flipflow.plotting.panels import Axis, Bar, Cells, Line, Panel, PanelGrid, Trace
from flipflow.plotting.symbols import described_with_symbols, html_subscript, with_symbols

Json = dict[str, Any]
FAMILY = "Arial, Helvetica, 'Liberation Sans', sans-serif"
SYMBOLS = {"triangle": "triangle-up", "triangle-open": "triangle-down-open", "cross": "x-thin-open"}
VEIL = "rgba(255,255,255,0.85)"  # behind words that lines may cross
MARKS_SHOWN = 9
PIXELS_A_POINT = 1.4  # on a screen marks are somewhat larger than in print
# The bar of tools would cover the legend; zoom, pan and reset work with the mouse alone.
CONFIG = {"displayModeBar": False, "displaylogo": False, "responsive": False, "showTips": False}
START = """
for (const place of document.querySelectorAll("[data-figure]")) {
  const figure = JSON.parse(place.querySelector("script").textContent);
  const narrow = innerWidth < 780 && place.querySelector("script[data-narrow]");
  const layout = narrow ? JSON.parse(narrow.textContent) : figure.layout;
  place.style.width = `${layout.width}px`;
  place.style.height = `${layout.height}px`;
  Plotly.newPlot(place, figure.data, layout, figure.config);
}
"""
PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<link rel="icon" href="data:,">
<style>body {{ font: 14px {family}; color: {ink}; width: {width}px; margin: 1.5em auto; }}
h1 {{ font-size: 1.3em; }}</style></head>
<body><h1>{title}</h1>{subject}{figure}<p>{caption}</p>
<script>{library}</script><script>{start}</script></body></html>
"""


def page(figure: PanelGrid) -> str:
    """One HTML page with the figure, plotly.js embedded."""
    subject = f"<p>{html.escape(figure.subject)}</p>" if figure.subject else ""
    caption = html.escape(figure.caption)
    if figure.symbols:
        caption = with_symbols(caption, html_subscript)
    return PAGE.format(
        subject=subject, title=html.escape(figure.title), caption=caption,
        family=FAMILY, ink=INK, width=figure.width, figure=element(figure), library=library(),
        start=START,
    )  # fmt: skip


def words(text: str) -> str:
    """Text as plotly.js shows it: it reads "<i>" and some entities, but not the one of a quote."""
    plain = text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return plain.replace("\n", "<br>")


def element(figure: PanelGrid, narrow: PanelGrid | None = None) -> str:
    """The place of a figure in a page, its data inside; :data:`START` draws it.

    ``narrow`` is the same figure for a narrow screen: its layout is taken there.
    """
    inside = f'<script type="application/json">{_as_json(described(figure))}</script>'
    if narrow is not None:
        layout = _as_json(layout_of(narrow, arrange(narrow)))
        inside += f'<script type="application/json" data-narrow>{layout}</script>'
    size = f"width:{figure.width:g}px;height:{figure.height}px"
    return f'<div data-figure style="{size}">{inside}</div>'


def _as_json(described: Json) -> str:
    """JSON within a script element, which "<" could end early."""
    return json.dumps(described, separators=(",", ":")).replace("<", "\\u003c")


def library() -> str:
    """plotly.js as text, from the installed package."""
    file = resources.files("plotly") / "package_data" / "plotly.min.js"
    return file.read_text(encoding="utf-8")


def described(figure: PanelGrid) -> Json:
    """The figure as plotly.js takes it: data, layout and config."""
    geometry = arrange(figure)
    data: list[Json] = []
    for k, panel in enumerate(figure.panels):
        key = _key(k)
        shown = fitted(panel, geometry.rects[k].width)
        data += [_cells(cells, key) for cells in shown.cells]
        data += [item for trace in shown.traces for item in _trace(trace, shown, key)]
        data += _bars(shown.bars, key)
    _legend_once(data)
    layout = layout_of(figure, geometry)
    return {"data": _said(data, figure), "layout": layout, "config": CONFIG}


def layout_of(figure: PanelGrid, geometry: Geometry) -> Json:
    """The layout of a figure as plotly.js takes it, without its data."""
    layout = _frame(figure)
    for k, (panel, rect) in enumerate(zip(figure.panels, geometry.rects, strict=True)):
        key, shown = _key(k), fitted(panel, rect.width)
        layout[f"xaxis{key}"] = _axis(shown.x, rect, figure, key, across=True)
        layout[f"yaxis{key}"] = _axis(shown.y, rect, figure, key, across=False)
        if shown.equal:
            layout[f"yaxis{key}"] |= {"scaleanchor": f"x{key}", "constrain": "domain"}
            layout[f"xaxis{key}"]["constrain"] = "domain"
        layout["shapes"] += _shapes(shown, key)
        layout["annotations"] += _annotations(shown, key, geometry, k)
    layout["showlegend"] = len(legend_names(figure)) > 1
    said: Json = _said(layout, figure)
    return said


def _key(index: int) -> str:
    """What plotly.js calls the axes of a panel, behind their letter."""
    return "" if index == 0 else str(index + 1)


def _said(found: Any, figure: PanelGrid) -> Any:
    """What is shown of a figure, with symbols where it has them."""
    return described_with_symbols(found) if figure.symbols else found


def _frame(figure: PanelGrid) -> Json:
    """Paper without margins: every panel is placed by its own domain."""
    return {
        "width": figure.width, "height": figure.height, "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
        "font": {"family": FAMILY, "size": FONT, "color": INK}, "hovermode": "closest",
        "paper_bgcolor": "white", "plot_bgcolor": "white", "barmode": "overlay",
        "hoverlabel": {"bgcolor": "white", "bordercolor": INK, "font": {"color": INK}},
        "legend": {"orientation": "h", "x": 0, "y": 1, "yanchor": "top", "xanchor": "left",
                   "bgcolor": "rgba(255,255,255,0)", "itemsizing": "trace",
                   "tracegroupgap": 0},
        # A point and nothing between thousands: plotly.js writes "3,040.5" beside "3041" else.
        "separators": ".",
        "shapes": [], "annotations": [],
    }  # fmt: skip


def _axis(axis: Axis, rect: Rect, figure: PanelGrid, key: str, *, across: bool) -> Json:
    start = rect.left if across else figure.height - rect.top - rect.height
    length, whole = (rect.width, figure.width) if across else (rect.height, figure.height)
    made: Json = {
        "domain": [start / whole, min((start + length) / whole, 1.0)],
        "anchor": f"{'y' if across else 'x'}{key}",
        "title": {"text": words(axis.title), "standoff": 5, "font": {"size": FONT}},
        "ticks": "outside", "ticklen": 4, "tickcolor": INK, "linecolor": INK, "mirror": True,
        "showline": True, "gridcolor": FAINT, "zeroline": False, "automargin": False,
        "exponentformat": "none", "separatethousands": False,
    }  # fmt: skip
    if axis.bounds is not None:
        made["range"] = list(axis.bounds)
    if axis.ticks:
        made |= {
            "tickvals": [at for at, _ in axis.ticks],
            "ticktext": [words(w) for _, w in axis.ticks],
        }
        made["showgrid"] = across
    return made


def _trace(trace: Trace, panel: Panel, key: str) -> Iterator[Json]:
    base = {
        "type": "scatter", "name": words(trace.name), "xaxis": f"x{key}", "yaxis": f"y{key}",
        "legendgroup": words(trace.name), "x": _plain(trace.x),
    }  # fmt: skip
    if trace.lower is not None:
        hidden = {"mode": "lines", "line": {"width": 0}, "hoverinfo": "skip"}
        fill = {"fill": "tonexty", "fillcolor": FILLS[trace.colour], "showlegend": trace.legend}
        yield base | hidden | {"y": _plain(trace.lower), "showlegend": False}
        yield base | hidden | {"y": _plain(trace.y)} | fill
        return
    also = [_plain(values) for _, values in trace.x_also]
    colour = COLOURS[trace.colour]
    yield (
        base
        | _look(trace, colour)
        | {
            "y": _plain(trace.y),
            "showlegend": trace.legend,
            "customdata": [list(row) for row in zip(*also, strict=True)],
            "hovertemplate": _hover(trace, panel),
        }
    )


def _cells(cells: Cells, key: str) -> Json:
    """One image; the colour scale has a step for each kind."""
    count = len(cells.colours)
    scale = [
        [(k + end) / count, TINTS[name]] for k, name in enumerate(cells.colours) for end in (0, 1)
    ]
    return {
        "type": "heatmap", "name": "", "x": _plain(cells.x), "y": _plain(cells.y),
        "z": cells.kind.tolist(), "zmin": -0.5, "zmax": count - 0.5, "colorscale": scale,
        "showscale": False, "showlegend": False, "hoverinfo": "skip", "xaxis": f"x{key}",
        "yaxis": f"y{key}",
    }  # fmt: skip


def _look(trace: Trace, colour: str) -> Json:
    if trace.role == "point":
        size = PIXELS_A_POINT * mark_size(trace.x.size)
        mark = {
            "symbol": SYMBOLS.get(trace.symbol or "", trace.symbol),
            "size": size,
            "color": colour,
        }
        return {
            "mode": "markers",
            "marker": mark | {"line": {"width": size / 5.0, "color": colour}},
        }
    width = 6.0 if trace.role == "beneath" else 2.2 if trace.bold else 1.4
    look: Json = {
        "mode": "lines",
        "line": {
            "color": colour,
            "width": width,
            "dash": trace.dash or DASHES.get(trace.role, "solid"),
        },
    }
    if trace.opacity < 1.0:
        look["opacity"] = trace.opacity
    if trace.symbol:
        shape = SYMBOLS.get(trace.symbol, trace.symbol)
        # Marks only tell lines apart, so a few along the line will do.
        look["mode"] = "lines+markers"
        look["marker"] = {
            "symbol": shape, "size": 6, "color": "white", "maxdisplayed": MARKS_SHOWN,
            "line": {"width": 1.3, "color": colour},
        }  # fmt: skip
    return look


def _hover(trace: Trace, panel: Panel) -> str:
    units = [f"%{{x:.4~r}} {panel.x.unit}"]
    units += [f"%{{customdata[{k}]:.4~r}} {unit}" for k, (unit, _) in enumerate(trace.x_also)]
    rows = [f"<b>{words(trace.name)}</b>", " = ".join(units)]
    rows.append(f"{panel.y.label}: %{{y:.4~r}} {panel.y.unit}")
    if trace.role in STABILITY_WORDS:
        rows.append(STABILITY_WORDS[trace.role])
    return "<br>".join(rows) + "<extra></extra>"


def _bars(bars: tuple[Bar, ...], key: str) -> Iterator[Json]:
    """One trace for each kind of bar, in the order of their first appearance."""
    kinds: dict[tuple[str, str, str], list[Bar]] = {}
    for bar in bars:
        kinds.setdefault((bar.name, bar.colour, bar.hatch), []).append(bar)
    for (name, colour, hatch), some in kinds.items():
        yield {
            "type": "bar", "orientation": "h", "name": words(name), "legendgroup": words(name),
            "showlegend": any(bar.legend for bar in some), "xaxis": f"x{key}", "yaxis": f"y{key}",
            "base": [bar.low for bar in some], "x": [bar.high - bar.low for bar in some],
            "y": [bar.y for bar in some], "width": [bar.thickness for bar in some],
            "text": [words(bar.words) for bar in some], "textposition": "outside",
            "cliponaxis": False,
            "customdata": [[bar.low, bar.high] for bar in some],
            "hovertemplate": f"<b>{words(name)}</b><br>"
            "%{customdata[0]:.4~r} to %{customdata[1]:.4~r}<extra></extra>",
            "marker": {"color": COLOURS[colour], "line": {"width": 0.6, "color": INK},
                       "pattern": {"shape": hatch, "bgcolor": COLOURS[colour],
                                   "fgcolor": "white", "solidity": 0.25, "size": 5}},
        }  # fmt: skip


def _legend_once(data: list[Json]) -> None:
    """Keep the first entry of each name."""
    seen: set[str] = set()
    for item in data:
        if item.get("showlegend", True) and item["name"] in seen:
            item["showlegend"] = False
        elif item.get("showlegend", True):
            seen.add(item["name"])


def _shapes(panel: Panel, key: str) -> Iterator[Json]:
    for band in panel.bands:
        strip = {"type": "rect", "layer": "below", "fillcolor": FILLS[band.role]}
        edge = (
            {"width": 0.8, "color": COLOURS["allowed"]} if band.role == "allowed" else {"width": 0}
        )
        yield strip | {"line": edge} | _along(band.axis, band.low, band.high, key)
    for line in panel.lines:
        dash = {"color": COLOURS[line.colour], "width": 1.2, "dash": line.dash}
        yield {"type": "line", "line": dash} | _along(line.axis, line.at, line.at, key)


def _along(axis: str, low: float, high: float, key: str) -> Json:
    """Span the panel across, from low to high along ``axis``."""
    other = "y" if axis == "x" else "x"
    return {
        f"{axis}ref": f"{axis}{key}", f"{axis}0": low, f"{axis}1": high,
        f"{other}ref": f"{other}{key} domain", f"{other}0": 0, f"{other}1": 1,
    }  # fmt: skip


def _annotations(panel: Panel, key: str, geometry: Geometry, index: int) -> Iterator[Json]:
    over = {"xref": f"x{key} domain", "yref": f"y{key} domain", "showarrow": False}
    data = {"xref": f"x{key}", "yref": f"y{key}"}
    if panel.title:
        above = geometry.titles[index] + 2
        yield over | {"text": f"<b>{words(panel.title)}</b>", "x": 0, "y": 1,
                      "xanchor": "left", "yanchor": "bottom", "yshift": above}  # fmt: skip
    for k, line in enumerate(panel.lines):
        if line.text:
            yield _line_label(line, data, over, geometry.labels[index].get(k))
    for arrow in panel.arrows:
        yield data | {
            "text": "", "showarrow": True, "arrowhead": 2, "arrowsize": 1.1, "arrowwidth": 1.4,
            "arrowcolor": COLOURS[arrow.colour], "x": arrow.x1, "y": arrow.y1, "ax": arrow.x0,
            "ay": arrow.y0, "axref": data["xref"], "ayref": data["yref"],
        }  # fmt: skip
    for note in panel.notes:
        text = "<br>".join(map(words, note.text.split("<br>")))
        yield data | {"text": text, "x": note.x, "y": note.y, "showarrow": False,
                      "xanchor": note.anchor, "align": note.anchor, "bgcolor": VEIL,
                      "font": {"color": COLOURS[note.colour]}}  # fmt: skip


def _line_label(line: Line, data: Json, over: Json, place: Label | None) -> Json:
    label = {"text": words(line.text), "showarrow": False, "font": {"color": COLOURS[line.colour]}}
    if place is not None:
        return label | {"xref": data["xref"], "yref": over["yref"], "x": line.at, "y": 1,
                        "yanchor": "bottom", "yshift": LABEL_ROW * place.level,
                        "xshift": place.shift}  # fmt: skip
    return label | {"xref": over["xref"], "yref": data["yref"], "x": line.text_at, "y": line.at,
                    "xanchor": SIDES.get(line.text_at, "center"),
                    "yanchor": "top" if line.under else "bottom"}  # fmt: skip


def _plain(values: NDArray[np.float64]) -> list[float | None]:
    """Five digits of the values' spread, finer than a pixel; what is not finite is a hole."""
    finite = values[np.isfinite(values)]
    spread, size = (float(np.ptp(finite)), float(np.abs(finite).max())) if finite.size else (0, 0)
    digits = min(5 + math.ceil(math.log10(size / spread)), 15) if 0.0 < spread < size else 5
    return [float(f"{v:.{digits}g}") if math.isfinite(v) else None for v in values.tolist()]
