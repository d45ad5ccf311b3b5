"""Bifurcation diagrams: stroboscopic points over a parameter, rising and falling."""

from __future__ import annotations

from flipflow.model.system import Coordinate
from flipflow.plotting.branches import field_axis
from flipflow.plotting.figure import Figure
from flipflow.plotting.panels import Axis, Band, Panel, Trace
from flipflow.plotting.response import coordinates, label, speed_axis
from flipflow.plotting.scales import HZ, MM, RPM
from flipflow.studies.bifurcation_diagram import BifurcationDiagram, Direction

DRAWN: tuple[tuple[Direction, str, str, str], ...] = (
    ("up", "rising", "main", "circle"), ("down", "falling", "floating", "square"),
)  # fmt: skip


def bifurcation_figure(diagram: BifurcationDiagram, which: Coordinate | None = None) -> Figure:
    """Displacement of every coordinate at the beginning of each forcing period."""
    over_omega = diagram.omega is None
    if over_omega:
        axis, scale = speed_axis(diagram.values), RPM
    else:
        axis, scale = field_axis(diagram.parameter, diagram.values)
    bands = tuple(
        Band("x", low * scale, high * scale, "contact minus") for low, high in diagram.hysteresis
    )
    panels = []
    for row, name in enumerate(coordinates(diagram.system, which)):
        traces = []
        for direction, word, colour, symbol in DRAWN:
            values, x = diagram.points(name, direction)
            also = (("Hz", values * HZ), ("rad/s", values)) if over_omega else ()
            if x.size:
                traces.append(
                    Trace(word, values * scale, x * MM, "point", colour, symbol,
                          legend=row == 0, bold=direction == "up", x_also=also)
                )  # fmt: skip
        panels.append(Panel(axis, Axis(label(name), "mm"), tuple(traces), bands=bands))
    caption = (
        "Points: displacement whenever the unbalance points along +x, of the motion settled to, "
        "each value reached from the one before. One point: the motion repeats after one turn; n "
        "points: after n turns; many: it does not repeat. Shaded: the two directions meet "
        "different motions."
    )
    return Figure("Bifurcation diagram", caption, tuple(panels), height=40 + 260 * len(panels))
