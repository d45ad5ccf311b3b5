"""The axes of a panel on a sheet for print: where they begin and end, their ticks, their scale."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.plotting.font import ASCENT, DESCENT, width_of
from flipflow.plotting.layout import FONT, POINT, Rect
from flipflow.plotting.panels import Axis, Panel
from flipflow.plotting.scales import MINUS

Ticks = tuple[tuple[float, str], ...]

# In pixels: length of a tick, from there to its words, from those to the title of the axis.
TICK, TICK_PAD, TITLE_PAD = 3.5 / POINT, 3.5 / POINT, 4.0 / POINT
STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)  # from tick to tick, as multiples of a power of ten
MOST_STEPS = 9
STEP_ACROSS, STEP_UP = 3.0 * FONT, 2.0 * FONT  # least pixels from tick to tick
MOST_DIGITS = 15
ROUNDING = 1e-9  # of a step: what is at an end but for rounding counts
MARGIN = 0.05  # beside the data, as a share of its extent, where an axis has no bounds


@dataclass(frozen=True)
class View:
    """A panel's axes in pixels, y down; the data at their ends; their ticks with words."""

    rect: Rect
    x: tuple[float, float]
    y: tuple[float, float]
    x_ticks: Ticks
    y_ticks: Ticks

    @property
    def foot(self) -> float:
        """The lower edge in pixels."""
        return self.rect.top + self.rect.height

    def across(self, x: Real) -> Real:
        """Pixels from the left of the sheet."""
        low, high = self.x
        return self.rect.left + (x - low) / (high - low) * self.rect.width

    def down(self, y: Real) -> Real:
        """Pixels from the top of the sheet."""
        low, high = self.y
        return self.rect.top + (high - y) / (high - low) * self.rect.height

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Pixels of a point from the left and from the top of the sheet."""
        return float(self.across(np.asarray(x))), float(self.down(np.asarray(y)))

    def holds(self, x: float, y: float) -> bool:
        """Whether a point lies within the axes."""
        return self.x[0] <= x <= self.x[1] and self.y[0] <= y <= self.y[1]


def view_of(panel: Panel, rect: Rect, wall: float) -> View:
    """The axes of a panel, moved right where what is written at them would pass the ``wall``."""
    x, y = _ends(panel, "x"), _ends(panel, "y")
    y_ticks = _ticks(panel.y, y, rect.height, upright=True)
    title = TITLE_PAD + ASCENT + DESCENT if panel.y.title else 0.0
    beside = TICK + TICK_PAD + widest(y_ticks) + title
    beyond = max(wall + beside - rect.left, 0.0)
    rect = Rect(rect.left + beyond, rect.top, rect.width - beyond, rect.height)
    if panel.equal:
        rect = _at_one_scale(rect, x[1] - x[0], y[1] - y[0])
        y_ticks = _ticks(panel.y, y, rect.height, upright=True)
    return View(rect, x, y, _ticks(panel.x, x, rect.width, upright=False), y_ticks)


def widest(ticks: Ticks) -> float:
    """Width in pixels of the widest words at ticks."""
    return max((width_of(word) for _, word in ticks), default=0.0)


def _at_one_scale(rect: Rect, wide: float, high: float) -> Rect:
    """The middle of a rectangle, as much of it as has the shape of the data."""
    scale = min(rect.width / wide, rect.height / high)
    left = rect.left + (rect.width - scale * wide) / 2.0
    top = rect.top + (rect.height - scale * high) / 2.0
    return Rect(left, top, scale * wide, scale * high)


def _ends(panel: Panel, way: str) -> tuple[float, float]:
    """Where an axis begins and ends: at its bounds, or a little beyond what is drawn."""
    axis = panel.x if way == "x" else panel.y
    if axis.bounds is not None and axis.bounds[0] < axis.bounds[1]:
        return axis.bounds
    values = np.concatenate([np.ravel(some) for some in _drawn(panel, way)])
    values = values[np.isfinite(values)]
    if not values.size:
        return 0.0, 1.0
    low, high = float(values.min()), float(values.max())
    margin = MARGIN * ((high - low) or abs(high) or 1.0)
    return low - margin, high + margin


def _drawn(panel: Panel, way: str) -> Iterator[Real]:
    """All that is drawn along one axis."""
    yield np.array([one.at for one in panel.lines if one.axis == way])
    yield from (np.array((one.low, one.high)) for one in panel.bands if one.axis == way)
    for trace in panel.traces:
        yield trace.x if way == "x" else trace.y
        if trace.lower is not None and way == "y":
            yield trace.lower
    for cells in panel.cells:
        yield cells.x if way == "x" else cells.y
    for bar in panel.bars:
        half = bar.thickness / 2.0
        yield np.array((bar.low, bar.high) if way == "x" else (bar.y - half, bar.y + half))


def _ticks(axis: Axis, ends: tuple[float, float], length: float, *, upright: bool) -> Ticks:
    """The ticks that an axis has, or as many round numbers as find room along it."""
    low, high = ends
    if axis.ticks:
        return tuple((at, word) for at, word in axis.ticks if low <= at <= high)
    most = min(int(length / (STEP_UP if upright else STEP_ACROSS)), MOST_STEPS)
    for steps in range(most, 1, -1):
        ticks = round_ticks(low, high, steps)
        apart = (ticks[1][0] - ticks[0][0]) / (high - low) * length
        if upright or widest(ticks) + FONT / 2.0 <= apart:
            return ticks
    return round_ticks(low, high, 1)


def round_ticks(low: float, high: float, steps: int) -> Ticks:
    """Two or more round numbers from ``low`` to ``high``, and how they are written.

    They make at most so many steps, unless there would be less than two of them.
    """
    least = (high - low) / steps
    power = 10.0 ** math.floor(math.log10(least))
    coarsest = next(k for k, one in enumerate(STEPS) if one * power >= least * (1.0 - ROUNDING))
    finer = [0.1 * one * power for one in STEPS[:-1]]
    for step in reversed([*finer, *(one * power for one in STEPS[: coarsest + 1])]):
        first, last = math.ceil(low / step - ROUNDING), math.floor(high / step + ROUNDING)
        if last > first:
            break
    digits = next(
        (n for n in range(MOST_DIGITS) if math.isclose(round(step, n), step)), MOST_DIGITS
    )
    numbers = [k * step for k in range(first, last + 1)]
    return tuple((at, f"{at:.{digits}f}".replace("-", MINUS)) for at in numbers)
