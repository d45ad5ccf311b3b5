"""The small picture of a result that a notebook shows beside its table."""

from __future__ import annotations

from flipflow.errors import FlipflowError
from flipflow.plotting.dispatch import figure
from flipflow.plotting.print import svg_alone

PICTURE = 110.0  # mm


def picture_of(result: object) -> str:
    """The figure as SVG; none of a result without points, or where matplotlib is missing."""
    try:
        return svg_alone(figure(result, width=PICTURE))
    except FlipflowError:
        return ""
