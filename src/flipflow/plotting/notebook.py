"""The small picture of a result that a notebook shows beside its table."""

from __future__ import annotations

from flipflow.errors import FlipflowError
from flipflow.plotting.dispatch import figure
from flipflow.plotting.print import printed

PICTURE = 110.0  # mm


def picture_of(result: object) -> str:
    """The figure as SVG; none of a result without points, or without matplotlib to draw it."""
    try:
        drawing = printed(figure(result, width=PICTURE), "svg").decode()
    except FlipflowError:
        return ""
    return drawing[drawing.index("<svg") :]
