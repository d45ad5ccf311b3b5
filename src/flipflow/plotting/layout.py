"""Where panels, legend and labels go, in pixels: one geometry for all renderers."""

from __future__ import annotations

import dataclasses
import math
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from flipflow.plotting.panels import PAGE_WIDTH, Line, Panel, PanelGrid

PIXELS_A_MM = 96.0 / 25.4
POINT = 72.0 / 96.0  # points a pixel
FONT = 32.0 / 3.0  # 8 point
CHARACTER = 6.3
LABEL_ROW, TITLE_ROW, LEGEND_ROW = 15, 17, 19
BOTTOM, LEFT, RIGHT = 40, 58, 14
NARROWEST = 60  # pixels of a panel
BARE_GAP, ROW_GAP = 26, 48
LEGEND_MARK, LEGEND_LETTERS = 42, 48
NAME_LETTERS = 36  # of a line of words beside an axis
LARGEST, SMALLEST, MARKS = 5.0, 0.8, 30  # marks in points; up to how many they are large
SIDES = {0.0: "left", 1.0: "right"}  # flush ends of a horizontal line's label


@dataclass(frozen=True)
class Rect:
    """A panel's axes: left and top from the upper left corner of the figure, width, height."""

    left: float
    top: float
    width: float
    height: float


@dataclass(frozen=True)
class Label:
    """Where the label of a vertical line stands: row above the axes, shift to the right."""

    level: int
    shift: float


@dataclass(frozen=True)
class Geometry:
    """The figure laid out.

    Parameters
    ----------
    rects
        Axes of each panel.
    labels
        For each panel, where the label of each vertical line stands above it.
    titles
        For each panel, the height of its title's foot above the axes.
    """

    rects: tuple[Rect, ...]
    labels: tuple[dict[int, Label], ...]
    titles: tuple[float, ...]


def arrange(figure: PanelGrid, *, even: bool = True) -> Geometry:
    """Lay out a figure in its width; the columns of the legend are ``even`` in plotly.js alone."""
    rows, spans = _grid(figure)
    heads = [_head(row, spans) for row in rows]
    height = max((figure.height - beside_panels(figure, even=even)) / len(rows), 20.0)
    rects, labels, titles = [], [], []
    top = float(LEGEND_ROW * legend_rows(figure, even=even))
    for row, head in zip(rows, heads, strict=True):
        top += head
        for panel, (left, width) in zip(row, spans, strict=False):
            rects.append(Rect(left, top, width, height))
            labels.append(place_labels(panel, width))
            titles.append(head - 6.0 - TITLE_ROW)
        top += height + ROW_GAP
    return Geometry(tuple(rects), tuple(labels), tuple(titles))


def beside_panels(figure: PanelGrid, *, even: bool = True) -> float:
    """Height that legend, labels, titles and axes take, all but the panels themselves."""
    rows, spans = _grid(figure)
    legend = LEGEND_ROW * legend_rows(figure, even=even)
    heads = sum(_head(row, spans) for row in rows)
    return legend + heads + BOTTOM + ROW_GAP * (len(rows) - 1)


def least_width(figure: PanelGrid) -> float:
    """Width in pixels that panels below each other need beside what is written at their axes."""
    return max(map(_left, figure.panels)) + NARROWEST + RIGHT


def mark_size(count: int) -> float:
    """Size of each of so many marks in points: a cloud shows its structure."""
    return min(LARGEST, max(SMALLEST, LARGEST * MARKS / max(count, 1)))


def fitted(panel: Panel, width: float) -> Panel:
    """The panel with room for its words: at the ends of bars, and of notes within the axes."""
    if panel.x.bounds is None:
        return panel
    low, high = panel.x.bounds
    for bar in panel.bars:
        share = 1.0 - _length(bar.words, width)
        if bar.words and share > 0.0:
            high = max(high, low + (bar.high - low) / share)
    notes = tuple(
        dataclasses.replace(note, x=min(note.x, high - _length(note.text, width) * (high - low)))
        if note.anchor == "left"
        else note
        for note in panel.notes
    )
    axis = dataclasses.replace(panel.x, bounds=(low, high))
    return dataclasses.replace(panel, x=axis, notes=notes)


def _length(text: str, width: float) -> float:
    """Length of a text and of a blank, as a share of the width."""
    return CHARACTER * (max(map(len, text.split("<br>"))) + 1) / width


def legend_names(figure: PanelGrid) -> list[str]:
    """Entries of the legend, each once, in the order of their first appearance."""
    names = [t.name for p in figure.panels for t in p.traces if t.legend]
    names += [b.name for p in figure.panels for b in p.bars if b.legend]
    return list(dict.fromkeys(names))


def within(text: str, width: int, lines: int = 1) -> str:
    """Text in at most so many lines of so many letters; dots stand for what is cut off."""
    return "\n".join(
        textwrap.wrap(text, width, max_lines=lines, placeholder=" ...", break_on_hyphens=False)
    )


def short_names(names: Sequence[str], letters: int = LEGEND_LETTERS) -> list[str]:
    """Names in at most so many letters, all different; numbers tell apart what would be alike."""
    shown = [within(name, letters) for name in names]
    if len(set(shown)) == len(shown):
        return shown
    return [f"{k}: {within(name, letters - 3)}" for k, name in enumerate(names, start=1)]


def legend_columns(figure: PanelGrid) -> int:
    """Columns of the legend, each as wide as its own entries, filled from the left."""
    names = legend_names(figure)
    for columns in range(len(names), 1, -1):
        parts = np.array_split([len(name) for name in names], columns)
        if sum(LEGEND_MARK + CHARACTER * part.max() for part in parts) <= figure.width - RIGHT:
            return columns
    return 1


def legend_rows(figure: PanelGrid, *, even: bool = True) -> int:
    """Rows the legend needs; none where there is one entry only."""
    names = legend_names(figure)
    if even or len(names) < 2:
        return legend_lines(names, figure.width)
    return math.ceil(len(names) / legend_columns(figure))


def legend_lines(names: Sequence[str], width: float = PAGE_WIDTH) -> int:
    """Rows that a legend of these entries needs."""
    return math.ceil(len(names) / _entries_in_a_row(names, width)) if len(names) > 1 else 0


def _entries_in_a_row(names: Sequence[str], width: float) -> int:
    widest = max(map(len, names), default=0)
    return max(int((width - RIGHT) / (LEGEND_MARK + CHARACTER * widest)), 1)


def place_labels(panel: Panel, width: float) -> dict[int, Label]:
    """Places for the labels of vertical lines, so that none covers another or is cut off.

    Labels of two lines close together are pushed apart, the next ones go a row up.
    """
    marked = sorted((line.at, k) for k, line in enumerate(panel.lines) if _labelled(line))
    if panel.x.bounds is None:
        return {k: Label(0, 0.0) for _, k in marked}
    low, high = panel.x.bounds
    lines = [(at - low) / (high - low) * width for at, _ in marked]
    halves = [CHARACTER * len(panel.lines[k].text) / 2.0 + 3.0 for _, k in marked]
    middles = list(_apart(lines, halves, width))
    ends: list[float] = []
    labels: dict[int, Label] = {}
    for (_, k), line, half, middle in zip(marked, lines, halves, middles, strict=True):
        level = next((n for n, end in enumerate(ends) if middle - half >= end - 1.0), len(ends))
        ends[level : level + 1] = [middle + half]
        labels[k] = Label(level, middle - line)
    return labels


def _apart(lines: list[float], halves: list[float], width: float) -> Iterator[float]:
    """Middles of labels: a label too close to the next moves left of its line, the next right."""
    moved = False
    for k, (line, half) in enumerate(zip(lines, halves, strict=True)):
        middle = line
        if moved:
            middle, moved = line + half - 1.0, False
        elif k + 1 < len(lines) and line + half > lines[k + 1] - halves[k + 1]:
            middle, moved = line - half + 1.0, True
        yield max(min(middle, width + RIGHT - half), half - 20.0)


def _labelled(line: Line) -> bool:
    return line.axis == "x" and bool(line.text)


def _labels_height(labels: dict[int, Label]) -> float:
    return float(LABEL_ROW * (max(one.level for one in labels.values()) + 1)) if labels else 0.0


def _grid(
    figure: PanelGrid,
) -> tuple[list[tuple[Panel, ...]], list[tuple[float, float]]]:
    """Panels row by row; left edge and width of each column."""
    columns = figure.columns
    rows = [figure.panels[k : k + columns] for k in range(0, len(figure.panels), columns)]
    return rows, list(_columns(rows, figure.shares or (1.0,) * columns, figure.width))


def _head(row: Sequence[Panel], spans: Sequence[tuple[float, float]]) -> float:
    """Height above the axes of a row for labels and titles."""
    labels = max(
        _labels_height(place_labels(panel, width))
        for panel, (_, width) in zip(row, spans, strict=False)
    )
    return labels + (TITLE_ROW if any(panel.title for panel in row) else 0.0) + 6.0


def _columns(
    rows: Sequence[Sequence[Panel]], shares: Sequence[float], whole: float
) -> Iterator[tuple[float, float]]:
    """Left edge and width of each column."""
    lefts = [
        max((_left(row[k]) for row in rows if k < len(row)), default=float(BARE_GAP))
        for k in range(len(shares))
    ]
    lefts = [left if k == 0 else left + 6.0 for k, left in enumerate(lefts)]
    room = whole - RIGHT - sum(lefts)
    left = 0.0
    for share, own in zip(shares, lefts, strict=True):
        left += own
        width = room * share / sum(shares)
        yield left, width
        left += width


def _left(panel: Panel) -> float:
    """Room for the labels of the y axis."""
    if panel.y.ticks:
        lines = (line for _, word in panel.y.ticks for line in word.splitlines())
        title = TITLE_ROW if panel.y.title else 0.0
        return 14.0 + title + CHARACTER * max(map(len, lines), default=0)
    return float(LEFT if panel.y.title else BARE_GAP)
