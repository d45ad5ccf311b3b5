"""A motion over time: displacements and the force on the stops."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.model.system import Coordinate
from flipflow.plotting.figure import Figure
from flipflow.plotting.palette import case_colour
from flipflow.plotting.panels import Axis, Panel, Trace
from flipflow.plotting.response import LABELS, coordinates, label, quantity_label
from flipflow.plotting.scales import KN, MM
from flipflow.plotting.units import speed_of
from flipflow.transient.history import History

SPANS = 400
LAST_TURNS = 3


def history_figure(history: History, which: Coordinate | None = None) -> Figure:
    """Displacement of every coordinate over time, and the force of each stop below.

    Parameters
    ----------
    history
        What :func:`flipflow.simulate` returns.
    which
        The only coordinate to draw; None: all.

    Returns
    -------
    Figure
        The whole time by its extremes at the left, the last turns at the right.
    """
    moving = []
    for k, name in enumerate(coordinates(history.system, which)):
        known = isinstance(name, str) and name in LABELS
        colour = str(name) if known else case_colour(k)
        moving.append((label(name), colour, history.displacement(name) * MM))
    rows = [(quantity_label("displacement", which), "mm", moving)]
    if history.force.shape[1]:
        forces = [
            (f"stop {j + 1}", case_colour(j), history.stop_force(j) * KN)
            for j in range(history.force.shape[1])
        ]
        rows.append(("stop force", "kN", forces))
    panels = [panel for row in rows for panel in _row(history, *row)]
    caption = (
        "Left: least and greatest values over the whole time. Right: the last turns. Shaft speed "
        f"{speed_of(history, history.omega[-1])} at the end."
    )
    return Figure(
        "Motion over time", caption, tuple(panels), columns=2, height=80 + 170 * len(rows),
        shares=(0.6, 0.4),
    )  # fmt: skip


def _row(
    history: History, name: str, unit: str, curves: Sequence[tuple[str, str, Real]]
) -> tuple[Panel, Panel]:
    t = history.t
    begin = t[-1] - LAST_TURNS * 2.0 * math.pi / float(history.omega[-1])
    last = t >= begin
    turns = int(float(history.angle[-1] - history.angle[0]) / (2.0 * math.pi))
    ends = float(t[0]), float(t[-1])
    whole, close = [], []
    for word, colour, values in curves:
        times, low, high = envelope(t, values, turns)
        legend = name.startswith("displacement")
        whole.append(Trace(word, times, high, colour=colour, legend=legend))
        whole.append(Trace(word, times, low, colour=colour, legend=False))
        close.append(Trace(word, t[last], values[last], colour=colour, legend=False))
    return (
        Panel(Axis("time", "s", ends), Axis(name, unit), tuple(whole)),
        Panel(Axis("time", "s", (max(begin, ends[0]), ends[1])), Axis(name, unit), tuple(close)),
    )


def envelope(t: Real, values: Real, turns: int) -> tuple[Real, Real, Real]:
    """Middle times, least and greatest values of at most 400 spans of a turn or more.

    Parameters
    ----------
    t, values
        A course over time, (n,).
    turns
        Turns in it.
    """
    count = max(min(SPANS, t.size, turns), 1)
    edges = np.unique(np.linspace(0, t.size, count + 1).astype(int))
    spans = np.split(values, edges[1:-1])
    low = np.array([span.min() for span in spans])
    high = np.array([span.max() for span in spans])
    return t[(edges[:-1] + edges[1:] - 1) // 2], low, high
