"""Figures for print: SVG whose words stay text, on the same geometry as on a screen."""

from __future__ import annotations

import html
import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Real
from flipflow.plotting.font import ASCENT, DESCENT, FAMILY, LINE_HEIGHT, MIDDLE, width_of
from flipflow.plotting.layout import (
    FONT,
    LABEL_ROW,
    LEGEND_ROW,
    PIXELS_A_MM,
    POINT,
    SIDES,
    Geometry,
    Label,
    arrange,
    fitted,
    legend_columns,
    legend_names,
    mark_size,
)
from flipflow.plotting.palette import COLOURS, DASHES, FAINT, FILLS, INK, SYMBOLS, TINTS
from flipflow.plotting.panels import Arrow, Band, Bar, Cells, Line, Note, Panel, PanelGrid, Trace
from flipflow.plotting.view import TICK, TICK_PAD, TITLE_PAD, View, view_of, widest

PT = 1.0 / POINT  # pixels
EDGE = 1.0  # pixels between a figure's edge and what is written
MARK = 4.0  # points; of those along a line
MARKS_APART = 0.15  # along a line, as a share of the panel's diagonal
LEAST_IN_LEGEND = 3.0  # points; a mark of a cloud would not be seen there
OVERLAID = 1.8  # how much larger a bold mark is, which others are laid over
# Drawn and left out, as multiples of the width of a line; what is not here is solid.
STYLES = {"dash": (5.0, 2.5), "dot": (1.0, 2.0), "dashdot": (5.0, 2.0, 1.0, 2.0)}
RULE = 0.9  # points; width of a reference line
FRAME, GRID, TICKS, BAR_EDGE = 0.7 * PT, 0.6 * PT, 0.8 * PT, 0.5 * PT  # widths of strokes
# Of the legend: its edge, the length of a sample, from there to its word, from that to the next.
KEY_EDGE, KEY, KEY_PAD, KEY_GAP = 0.6 * FONT, 2.4 * FONT, 0.8 * FONT, 1.2 * FONT
KEY_HEIGHT = 0.7 * FONT
HEAD_LENGTH, HEAD_HALF = 3.2 * PT, 1.6 * PT  # of an arrow
ANCHORS = {"left": "start", "center": "middle", "right": "end"}
HATCH, HATCH_STROKE = 10.0, 0.8  # pixels; side of the tile of a hatch
RISING = "M-.5 .5L.5 -.5M-.5 1.5L1.5 -.5M.5 1.5L1.5 .5"  # with the corners of tiles beside it
FALLING = "M-.5 .5L.5 1.5M-.5 -.5L1.5 1.5M.5 -.5L1.5 .5"
HATCHES = {"/": RISING, "\\": FALLING, "x": RISING + FALLING, "-": "M0 .5H1", ".": "M.4 .5h.2"}
DIAGONAL = math.sqrt(2.0)
# Corners of marks beside their middle, y down, for a size of 2; all others are circles.
CORNERS: dict[str, tuple[tuple[float, float], ...]] = {
    "square": ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)),
    "triangle": ((0.0, -1.0), (1.0, 1.0), (-1.0, 1.0)),
    "triangle-open": ((0.0, 1.0), (1.0, -1.0), (-1.0, -1.0)),
    "diamond": ((0.0, -DIAGONAL), (DIAGONAL, 0.0), (0.0, DIAGONAL), (-DIAGONAL, 0.0)),
    "star": tuple(
        (r * math.sin(k * math.pi / 5.0), -r * math.cos(k * math.pi / 5.0))
        for k, r in enumerate((1.0, 0.382) * 5)
    ),
}


def searchable_svg(figure: PanelGrid) -> str:
    """The figure as SVG whose words stay text, for a page in whose fonts it is set.

    Raises
    ------
    MissingExtra
        When matplotlib, whose font it is, is not installed.
    """
    return sheet(figure_elements(figure), figure.width, figure.height, FAMILY)


def sheet(elements: str, wide: float, high: float, families: str) -> str:
    """SVG of a size in pixels, its words in the first of the families of fonts that is there."""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide:g} {high:g}" '
        f'width="{wide / PIXELS_A_MM:g}mm" height="{high / PIXELS_A_MM:g}mm" '
        f'font-family="{families}" font-size="{FONT:.4g}" fill="none" stroke-linejoin="round">'
        f"{elements}</svg>"
    )


def figure_elements(figure: PanelGrid) -> str:
    """What stands on the sheet of a figure: its legend and its panels.

    Raises
    ------
    MissingExtra
        When matplotlib is not installed.
    """
    geometry = arrange(figure, even=False)
    pieces = list(_legend(figure))
    for k, panel in enumerate(figure.panels):
        rect = geometry.rects[k]
        shown = fitted(panel, rect.width)
        view = view_of(shown, rect, _wall(figure, geometry, k))
        pieces += _drawn(shown, view, f"p{k}")
        pieces += _axes(shown, view)
        pieces += _labels(shown, view, geometry, k)
    return "".join(pieces)


def _wall(figure: PanelGrid, geometry: Geometry, index: int) -> float:
    """Pixels from the left from which on a panel and the words at its axis may stand."""
    if index % figure.columns == 0:
        return EDGE
    before = geometry.rects[index - 1]
    return before.left + before.width + EDGE


def _drawn(panel: Panel, view: View, name: str) -> Iterator[str]:
    """What stands within the axes, from the lowest up; ``name`` begins those of its parts."""
    rect = view.rect
    box = _box(rect.left, rect.top, rect.width, rect.height)
    yield f'<clipPath id="{name}"><path d="{box}"/></clipPath><g clip-path="url(#{name})">'
    yield from (piece for cells in panel.cells for piece in _cells(cells, view))
    yield from (_band(band, view) for band in panel.bands)
    yield _grid(view)
    yield from (_area(trace, view) for trace in panel.traces if trace.lower is not None)
    yield from (_bar(bar, view, f"{name}h{k}") for k, bar in enumerate(panel.bars))
    lines = [trace for trace in panel.traces if trace.lower is None and trace.role != "point"]
    yield from (_line(trace, view) for trace in lines)
    yield from (_rule(line, view) for line in panel.lines)
    yield f'</g><path d="{box}" stroke="{INK}" stroke-width="{FRAME:.3g}"/>'
    yield f'<g clip-path="url(#{name})">'
    for trace in panel.traces:
        if trace.role == "point":
            yield _marks(trace, view.across(trace.x), view.down(trace.y), _point_size(trace))
    yield "</g>"
    yield from (_arrow(one, view) for one in panel.arrows if view.holds(one.x1, one.y1))


def _grid(view: View) -> str:
    rect = view.rect
    across = [f"M{x:.2f} {rect.top:.2f}v{rect.height:.2f}" for x in _ticks_across(view)]
    up = [f"M{rect.left:.2f} {y:.2f}h{rect.width:.2f}" for y in _ticks_down(view)]
    return f'<path d="{"".join(across + up)}" stroke="{FAINT}" stroke-width="{GRID:.3g}"/>'


def _ticks_across(view: View) -> list[float]:
    return [view.at(at, 0.0)[0] for at, _ in view.x_ticks]


def _ticks_down(view: View) -> list[float]:
    return [view.at(0.0, at)[1] for at, _ in view.y_ticks]


def _axes(panel: Panel, view: View) -> Iterator[str]:
    """Ticks, their words and the titles of both axes."""
    rect, foot = view.rect, view.foot
    across, down = _ticks_across(view), _ticks_down(view)
    ticks = [f"M{x:.2f} {foot:.2f}v{TICK:.2f}" for x in across]
    ticks += [f"M{rect.left:.2f} {y:.2f}h{-TICK:.2f}" for y in down]
    yield f'<path d="{"".join(ticks)}" stroke="{INK}" stroke-width="{TICKS:.3g}"/>'
    under, left = foot + TICK + TICK_PAD, rect.left - TICK - TICK_PAD
    for x, (_, word) in zip(across, view.x_ticks, strict=True):
        yield written(x, under + ASCENT, word, "center")
    for y, (_, word) in zip(down, view.y_ticks, strict=True):
        yield written(left, _centred(y, word), word, "right")
    rows = max((word.count("\n") + 1 for _, word in view.x_ticks), default=0)
    base = under + rows * LINE_HEIGHT + TITLE_PAD + ASCENT - (LINE_HEIGHT - FONT)
    yield written(rect.left + rect.width / 2.0, base, panel.x.title, "center")
    beside = left - widest(view.y_ticks) - TITLE_PAD - DESCENT
    yield written(beside, rect.top + rect.height / 2.0, panel.y.title, "center", turned=True)


def _labels(panel: Panel, view: View, geometry: Geometry, index: int) -> Iterator[str]:
    """The panel's title, the words of its lines and bars, and its notes."""
    above = view.rect.top - geometry.titles[index] - 4.0
    yield written(view.rect.left, above, panel.title, "left", bold=True)
    for k, line in enumerate(panel.lines):
        yield _line_label(line, view, geometry.labels[index].get(k))
    for bar in panel.bars:
        if view.holds(bar.high, bar.y):
            x, y = view.at(bar.high, bar.y)
            yield written(x + 4.0 * PT, _centred(y, bar.words), bar.words, "left")
    yield from (_note(note, view) for note in panel.notes)


def _line_label(line: Line, view: View, place: Label | None) -> str:
    rect, colour = view.rect, COLOURS[line.colour]
    x, y = view.at(line.at, line.at)
    if place is not None:
        up = LABEL_ROW * place.level + PT + DESCENT
        return written(x + place.shift, rect.top - up, line.text, "center", colour)
    side = SIDES.get(line.text_at, "center")
    inwards = {"left": 3.0 * PT, "right": -3.0 * PT}.get(side, 0.0)
    below = 2.0 * PT + ASCENT if line.under else -2.0 * PT - DESCENT
    along = rect.left + line.text_at * rect.width + inwards
    return written(along, y + below, line.text, side, colour)


def _note(note: Note, view: View) -> str:
    """Words on a white veil, as lines may cross them."""
    text = note.text.replace("<br>", "\n")
    x, y = view.at(note.x, note.y)
    wide, high = width_of(text), ASCENT + text.count("\n") * LINE_HEIGHT + DESCENT
    left, top = x - {"left": 0.0, "center": wide / 2.0, "right": wide}[note.anchor], y - high / 2.0
    veil = _box(left - PT, top - PT, wide + 2.0 * PT, high + 2.0 * PT)
    said = written(x, top + ASCENT, text, note.anchor, COLOURS[note.colour])
    return f'<path d="{veil}" fill="white" fill-opacity="0.85"/>{said}'


def _line(trace: Trace, view: View) -> str:
    """A line and its marks."""
    x, y = view.across(trace.x), view.down(trace.y)
    drawn = f'<path d="{_path(x, y)}"{_stroke(trace)}/>'
    if trace.symbol and (np.isfinite(x) & np.isfinite(y)).any():
        apart = MARKS_APART * math.hypot(view.rect.width, view.rect.height)
        first = apart * SYMBOLS.index(trace.symbol) / len(SYMBOLS)  # where lines coincide
        drawn += _marks(trace, *_along(x, y, first, apart), MARK)
    return drawn if trace.opacity == 1.0 else f'<g opacity="{trace.opacity:g}">{drawn}</g>'


def _stroke(trace: Trace) -> str:
    width = 4.2 if trace.role == "beneath" else 1.6 if trace.bold else 1.0  # points
    stroke = f' stroke="{COLOURS[trace.colour]}" stroke-width="{width * PT:.3g}"'
    return stroke + _dashed(trace.dash or DASHES.get(trace.role, "solid"), width)


def _dashed(name: str, width: float) -> str:
    """The dash of a line of a width in points, with which it grows."""
    if name not in STYLES:
        return ' stroke-linecap="square"'
    return f' stroke-dasharray="{" ".join(f"{one * width * PT:.3g}" for one in STYLES[name])}"'


def _along(x: Real, y: Real, first: float, apart: float) -> tuple[Real, Real]:
    """The points of a line that are next to every ``apart`` pixels of its length, one at least."""
    drawn = np.isfinite(x) & np.isfinite(y)
    x, y = x[drawn], y[drawn]
    length = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))))
    places = np.arange(min(first, 0.5 * length[-1]), length[-1] + 1e-9 * apart, apart)
    chosen = np.unique(np.abs(length[:, None] - places).argmin(axis=0))
    return x[chosen], y[chosen]


def _point_size(trace: Trace) -> float:
    """Size in points of each mark of a cloud."""
    return mark_size(trace.x.size) * (OVERLAID if trace.bold else 1.0)


def _marks(trace: Trace, x: Real, y: Real, size: float) -> str:
    """A mark of a size in points at each place; along a line it is white, of a cloud full."""
    if not trace.symbol:
        return ""
    colour = COLOURS[trace.colour]
    within, edge = "white", 1.0
    if trace.role == "point":
        within = "none" if trace.symbol.endswith("-open") else colour
        edge = min(1.0, size / 4.0)
    dx, dy, outline = _outline(trace.symbol, size * PT / 2.0)
    drawn = np.isfinite(x) & np.isfinite(y)
    begins = zip((x[drawn] + dx).tolist(), (y[drawn] + dy).tolist(), strict=True)
    way = "".join(f"M{a:.2f} {b:.2f}{outline}" for a, b in begins)
    return f'<path d="{way}" fill="{within}" stroke="{colour}" stroke-width="{edge * PT:.3g}"/>'


def _outline(symbol: str, r: float) -> tuple[float, float, str]:
    """Where the outline of a mark begins beside its middle, and how it goes on from there."""
    if symbol == "cross":
        return -r, -r, f"l{2 * r:.2f} {2 * r:.2f}m0 {-2 * r:.2f}l{-2 * r:.2f} {2 * r:.2f}"
    corners = CORNERS.get(symbol) or CORNERS.get(symbol.removesuffix("-open"))
    if corners is None:
        half = f"a{r:.2f} {r:.2f} 0 1 0"
        return -r, 0.0, f"{half} {2 * r:.2f} 0{half} {-2 * r:.2f} 0z"
    sides = "".join(f"l{r * (c - a):.2f} {r * (d - b):.2f}" for (a, b), (c, d) in pairwise(corners))
    return r * corners[0][0], r * corners[0][1], f"{sides}z"


def _area(trace: Trace, view: View) -> str:
    """The area between two lines; where either has a hole, there is none."""
    lower = np.asarray(trace.lower, float)
    x, top, foot = view.across(trace.x), view.down(trace.y), view.down(lower)
    around = (
        _path(np.append(x[run], x[run][::-1]), np.append(top[run], foot[run][::-1]))
        for run in _runs(np.isfinite(x) & np.isfinite(top) & np.isfinite(foot))
    )
    return f'<path d="{"".join(f"{way}z" for way in around)}" fill="{FILLS[trace.colour]}"/>'


def _path(x: Real, y: Real) -> str:
    """A line through points; one that is not finite leaves a hole."""
    points = [f"{a:.2f} {b:.2f}" for a, b in zip(x.tolist(), y.tolist(), strict=True)]
    return "".join(f"M{'L'.join(points[run])}" for run in _runs(np.isfinite(x) & np.isfinite(y)))


def _runs(drawn: NDArray[np.bool_]) -> Iterator[slice]:
    """Stretches of points that are drawn."""
    ends = np.flatnonzero(np.diff(np.concatenate(([False], drawn, [False])).astype(np.int8)))
    yield from (slice(int(a), int(b)) for a, b in zip(ends[::2], ends[1::2], strict=True))


def _box(left: float, top: float, wide: float, high: float) -> str:
    return f"M{left:.2f} {top:.2f}h{wide:.2f}v{high:.2f}h{-wide:.2f}z"


def _cells(cells: Cells, view: View) -> Iterator[str]:
    """All cells of a kind as one path, so that no seams show between them."""
    x, y = view.across(cells.x).tolist(), view.down(cells.y).tolist()
    for kind, colour in enumerate(cells.colours):
        way = "".join(
            _box(x[n], y[m], x[n + 1] - x[n], y[m + 1] - y[m])
            for m, n in np.argwhere(cells.kind == kind).tolist()
        )
        yield f'<path d="{way}" fill="{TINTS[colour]}"/>'


def _band(band: Band, view: View) -> str:
    rect = view.rect
    (x, foot), (right, y) = view.at(band.low, band.low), view.at(band.high, band.high)
    if band.axis == "x":
        way = _box(x, rect.top, right - x, rect.height)
    else:
        way = _box(rect.left, y, rect.width, foot - y)
    return f'<path d="{way}" fill="{FILLS[band.role]}"/>'


def _rule(line: Line, view: View) -> str:
    """A reference line across the panel."""
    rect, (x, y) = view.rect, view.at(line.at, line.at)
    if line.axis == "x":
        way = f"M{x:.2f} {view.foot:.2f}V{rect.top:.2f}"
    else:
        way = f"M{rect.left:.2f} {y:.2f}h{rect.width:.2f}"
    stroke = f'stroke="{COLOURS[line.colour]}" stroke-width="{RULE * PT:.3g}"'
    return f'<path d="{way}" {stroke}{_dashed(line.dash, RULE)}/>'


def _bar(bar: Bar, view: View, name: str) -> str:
    left, top = view.at(bar.low, bar.y + bar.thickness / 2.0)
    right, foot = view.at(bar.high, bar.y - bar.thickness / 2.0)
    return _filled(bar, _box(left, top, right - left, foot - top), name)


def _filled(bar: Bar, way: str, name: str) -> str:
    """A closed way in the look of a bar; ``name`` is that of its hatch."""
    full = f'<path d="{way}" fill="{COLOURS[bar.colour]}"'
    if not bar.hatch:
        return f'{full} stroke="{INK}" stroke-width="{BAR_EDGE:.3g}"/>'
    return (
        f'<pattern id="{name}" patternUnits="userSpaceOnUse" width="{HATCH:g}" height="{HATCH:g}">'
        f'<path d="{HATCHES[bar.hatch]}" transform="scale({HATCH:g})" stroke="white" '
        f'stroke-width="{HATCH_STROKE / HATCH:g}"/></pattern>{full}/>'
        f'<path d="{way}" fill="url(#{name})" stroke="white" stroke-width="{BAR_EDGE:.3g}"/>'
    )


def _arrow(arrow: Arrow, view: View) -> str:
    (x0, y0), (x1, y1) = view.at(arrow.x0, arrow.y0), view.at(arrow.x1, arrow.y1)
    far = math.hypot(x1 - x0, y1 - y0)
    if far == 0.0:
        return ""
    ux, uy = (x1 - x0) / far, (y1 - y0) / far
    x, y, dx, dy = x1 - HEAD_LENGTH * ux, y1 - HEAD_LENGTH * uy, -HEAD_HALF * uy, HEAD_HALF * ux
    head = f"M{x + dx:.2f} {y + dy:.2f}L{x1:.2f} {y1:.2f}L{x - dx:.2f} {y - dy:.2f}z"
    colour = COLOURS[arrow.colour]
    return (
        f'<path d="M{x0:.2f} {y0:.2f}L{x:.2f} {y:.2f}{head}" fill="{colour}" stroke="{colour}" '
        f'stroke-width="{PT:.3g}"/>'
    )


def _legend(figure: PanelGrid) -> Iterator[str]:
    """The entries in columns, each as wide as its own words, filled from the left."""
    names = legend_names(figure)
    if len(names) < 2:
        return
    drawn: dict[str, Trace | Bar] = {}
    for panel in figure.panels:
        for one in panel.traces:
            drawn.setdefault(one.name, one)
        for bar in panel.bars:
            drawn.setdefault(bar.name, bar)
    left = KEY_EDGE
    for column in np.array_split(np.arange(len(names)), legend_columns(figure)):
        for row, k in enumerate(column.tolist()):
            middle = LEGEND_ROW * (row + 0.5) + EDGE
            yield _sample(drawn[names[k]], left, middle, f"l{k}")
            yield written(left + KEY + KEY_PAD, middle + MIDDLE, names[k], "left")
        left += KEY + KEY_PAD + max(width_of(names[k]) for k in column) + KEY_GAP


def _sample(one: Trace | Bar, left: float, middle: float, name: str) -> str:
    """What stands before a word of the legend."""
    box = _box(left, middle - KEY_HEIGHT / 2.0, KEY, KEY_HEIGHT)
    if isinstance(one, Bar):
        return _filled(one, box, name)
    if one.lower is not None:
        return f'<path d="{box}" fill="{FILLS[one.colour]}"/>'
    x, y = np.array([left + KEY / 2.0]), np.array([middle])
    if one.role == "point":
        return _marks(one, x, y, max(_point_size(one), LEAST_IN_LEGEND))
    line = f'<path d="M{left:.2f} {middle:.2f}h{KEY:.2f}"{_stroke(one)}/>'
    return line + _marks(one, x, y, MARK)


def _centred(middle: float, text: str) -> float:
    """The first base line of text whose lines stand around a height."""
    return middle + MIDDLE - text.count("\n") * LINE_HEIGHT / 2.0


def written(
    x: float, y: float, text: str, side: str, colour: str = INK, *, bold: bool = False,
    turned: bool = False,
) -> str:  # fmt: skip
    """Lines of text from a base line down; ``side`` is the side of them that is at ``x``."""
    look = f'text-anchor="{ANCHORS[side]}" fill="{colour}"'
    if bold:
        look += ' font-weight="bold"'
    if turned:
        look += f' transform="rotate(-90 {x:.2f} {y:.2f})"'
    return "".join(
        f'<text x="{x:.2f}" y="{y + k * LINE_HEIGHT:.2f}" {look}>{html.escape(line)}</text>'
        for k, line in enumerate(text.split("\n"))
        if line
    )
