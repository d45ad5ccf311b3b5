"""A motion over time: displacements and the force on the stops."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flipflow.figures.palette import case_colour
from flipflow.figures.parts import Axis, Figure, Panel, Trace
from flipflow.figures.response import LABELS, coordinates, label
from flipflow.figures.scales import KN, MM, RPM
from flipflow.results.history import History

Real = NDArray[np.float64]
MOST_POINTS = 6000


def history_figure(history: History) -> Figure:
    """Displacement of every coordinate over time, and the force of each stop below.

    Parameters
    ----------
    history
        What :func:`flipflow.simulate` returns.

    Returns
    -------
    Figure
        Two panels over seconds; one without stops. A long motion is drawn by its extremes.
    """
    time = Axis("time", "s", (float(history.t[0]), float(history.t[-1])))
    traces = []
    for k, which in enumerate(coordinates(history.system)):
        t, x = _drawn(history.t, history.displacement(which) * MM)
        known = isinstance(which, str) and which in LABELS
        colour = str(which) if known else case_colour(k)
        traces.append(Trace(label(which), t, x, colour=colour, bold=which == "relative"))
    panels = [Panel(time, Axis("displacement", "mm"), tuple(traces))]
    if history.force.shape[1]:
        stops = []
        for j in range(history.force.shape[1]):
            t, force = _drawn(history.t, history.stop_force(j) * KN)
            stops.append(Trace(f"stop {j + 1}", t, force, colour=case_colour(j), legend=j > 0))
        panels.append(Panel(time, Axis("stop force", "kN"), tuple(stops)))
    caption = f"{history.status} Shaft speed {history.omega[-1] * RPM:.4g} rpm at the end."
    return Figure("Motion over time", caption, tuple(panels), height=130 + 150 * len(panels))


def _drawn(t: Real, values: Real) -> tuple[Real, Real]:
    """All samples, or of a long motion the least and the greatest of each of many spans."""
    if t.size <= MOST_POINTS:
        return t, values
    edges = np.linspace(0, t.size, MOST_POINTS // 2, endpoint=False).astype(int)
    rows = [
        edge + offset
        for edge, span in zip(edges, np.split(values, edges[1:]), strict=True)
        for offset in sorted((int(span.argmin()), int(span.argmax())))
    ]
    return t[rows], values[rows]
