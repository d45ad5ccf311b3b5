"""What a notebook shows of a result: a small table and a small picture."""

from __future__ import annotations

from flipflow.errors import FlipflowError, MissingExtra
from flipflow.io.arrays import arrays_of
from flipflow.io.tables import html_table
from flipflow.plotting.dispatch import figure
from flipflow.plotting.print import printed

PICTURE = 110.0  # mm


def html_of(result: object) -> str:
    """The table, and the figure as SVG where matplotlib is there to draw it."""
    table = html_table(arrays_of(result))
    try:
        drawing = printed(figure(result, width=PICTURE), "svg").decode()
    except (MissingExtra, FlipflowError):
        return table  # a result without points, or an install without plots
    return table + drawing[drawing.index("<svg") :]
