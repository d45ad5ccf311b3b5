"""The parts of a neutral figure: what is drawn, in the units of its axes, without a word on how.

Builders make them from results; :mod:`flipflow.plotting.plotly` and :mod:`flipflow.plotting.svg`
draw them. Colours are named by what they mean;
:mod:`flipflow.plotting.palette` says what they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Real

PAGE_WIDTH = 690.0  # of an A4 page within its margins, 96 pixels an inch
Role = Literal[
    "stable", "unstable", "undetermined", "case band", "limit", "motion", "point", "beneath"
]
BandRole = Literal["allowed", "contact", "contact minus"]


@dataclass(frozen=True)
class Axis:
    """One axis: label, unit, and where it shall begin and end or be ticked, if that is fixed.

    Along an axis of ``decades`` stands the decimal logarithm of what is in the unit.
    """

    label: str
    unit: str = ""
    bounds: tuple[float, float] | None = None
    ticks: tuple[tuple[float, str], ...] = ()
    decades: bool = False

    @property
    def title(self) -> str:
        """Label with the unit."""
        return f"{self.label}, {self.unit}" if self.unit else self.label


def rows_axis(words: Sequence[str], beyond: float = 0.6) -> Axis:
    """An axis of rows, the first on top and the last at 0, which ends ``beyond`` both."""
    last = len(words) - 1
    ticks = tuple((float(last - k), word) for k, word in enumerate(words))
    return Axis("", "", (-beyond, last + beyond), ticks)


def decade_ticks(low: int, high: int) -> tuple[tuple[float, str], ...]:
    """A tick at each decade from 10 to the power ``low`` to that of ``high``."""
    return tuple((float(k), f"1e{k}") for k in range(low, high + 1))


@dataclass(frozen=True, eq=False)
class Trace:
    """A line, a cloud of points, or the area between two lines.

    Parameters
    ----------
    name
        What it is called in the legend.
    x, y
        Coordinates (n,) in the units of the axes.
    role
        "stable" is drawn solid, "unstable" dashed, "undetermined" dotted; "case band" is the area
        between ``lower`` and ``y``; "point" is drawn as symbols only; "beneath" is wide and pale,
        for a line that another is laid over.
    colour
        Name in the palette.
    symbol
        Marks set at a few points of a line, so that lines differ without colour.
    bold
        Whether the line is the one to look at.
    legend
        Whether it stands in the legend.
    lower
        Lower edge of an area, (n,).
    dash
        Another dash than the role's.
    x_also
        x in other units, for the hover text: pairs of unit and values.
    opacity
        Of a line: below 1 it shows what lies beneath, so that many lines show where they are dense.
    """

    name: str
    x: Real
    y: Real
    role: Role = "motion"
    colour: str = "relative"
    symbol: str | None = None
    bold: bool = False
    legend: bool = True
    lower: Real | None = None
    dash: str = ""
    x_also: tuple[tuple[str, Real], ...] = ()
    opacity: float = 1.0


@dataclass(frozen=True, eq=False)
class Cells:
    """A grid of cells, each filled with the colour of its kind.

    Parameters
    ----------
    x, y
        Edges of the cells, (n + 1,) and (m + 1,), rising.
    kind
        Index into ``colours`` of each cell, (m, n).
    colours
        Names in the palette of fills for cells.
    """

    x: Real
    y: Real
    kind: NDArray[np.int64]
    colours: tuple[str, ...]


def cell_edges(middles: Real) -> Real:
    """Edges of cells around their middles, (n + 1,) of (n,)."""
    if middles.size == 1:
        return np.array([middles[0] - 0.5, middles[0] + 0.5])
    inner = (middles[1:] + middles[:-1]) / 2.0
    return np.concatenate([[2.0 * middles[0] - inner[0]], inner, [2.0 * middles[-1] - inner[-1]]])


@dataclass(frozen=True)
class Bar:
    """A horizontal bar from ``low`` to ``high`` at height ``y``; ``thickness`` in units of y.

    Beside it stands ``text``; the numbers of its ends, in the unit of the axis, where ``ends``.
    """

    name: str
    y: float
    low: float
    high: float
    thickness: float = 0.7
    colour: str = "relative"
    hatch: str = ""
    legend: bool = False
    text: str = ""
    ends: bool = False

    @property
    def words(self) -> str:
        """What stands beside it."""
        return f"{self.low:.4g} to {self.high:.4g}" if self.ends else self.text


@dataclass(frozen=True)
class Line:
    """A reference line across the panel at ``at`` on the x or y axis.

    The label of a vertical line stands above the panel; that of a horizontal one stands on the
    line, or ``under`` it, its middle at the share ``text_at`` of the panel's width; 0 and 1 are
    flush.
    """

    axis: Literal["x", "y"]
    at: float
    text: str = ""
    colour: str = "limit"
    dash: str = "dot"
    text_at: float = 1.0
    under: bool = False


@dataclass(frozen=True)
class Band:
    """A shaded strip across the panel from ``low`` to ``high`` of the x or y axis."""

    axis: Literal["x", "y"]
    low: float
    high: float
    role: BandRole = "allowed"
    text: str = ""


@dataclass(frozen=True)
class Arrow:
    """An arrow from (x0, y0) to (x1, y1)."""

    x0: float
    y0: float
    x1: float
    y1: float
    colour: str = "jump"


@dataclass(frozen=True)
class Note:
    """Text at a point; ``anchor`` is the side of the text that touches the point."""

    x: float
    y: float
    text: str
    anchor: Literal["left", "right", "center"] = "left"
    colour: str = "jump"


@dataclass(frozen=True)
class Panel:
    """One pair of axes and all that is drawn into it; ``equal`` keeps both at the same scale."""

    x: Axis
    y: Axis
    traces: tuple[Trace, ...] = ()
    bars: tuple[Bar, ...] = ()
    bands: tuple[Band, ...] = ()
    lines: tuple[Line, ...] = ()
    arrows: tuple[Arrow, ...] = ()
    notes: tuple[Note, ...] = ()
    cells: tuple[Cells, ...] = ()
    title: str = ""
    equal: bool = False


@dataclass(frozen=True)
class PanelGrid:
    """One or more panels, row by row, with a title and a sentence that says what is seen.

    Parameters
    ----------
    title, caption
        What it is, and how it is to be read.
    panels
        At least one.
    columns
        Panels in a row.
    height
        Height in pixels at the width of an A4 page, 96 pixels an inch.
    shares
        Relative widths of the columns; empty for equal ones.
    subject
        What it belongs to, machine, load case, revision and date, for a figure on its own.
    width
        Width in pixels.
    symbols
        Whether words such as w_ea and k2 are shown as symbols with subscripts; only where no name
        is a user's.
    """

    title: str
    caption: str
    panels: tuple[Panel, ...]
    columns: int = 1
    height: int = 360
    shares: tuple[float, ...] = ()
    subject: str = ""
    width: float = PAGE_WIDTH
    symbols: bool = False
