"""Figure 5: the machine as a drawing, with stop."""

from __future__ import annotations

from flipflow.model.screen import FlipFlowScreen
from flipflow.paper.figure import PaperFigure
from flipflow.paper.figure_01 import ALONG, draw_machine
from flipflow.plotting.drawing import Drawing

TITLE = "The screen with piecewise linear springs"
CAPTION = f"{ALONG} A stop (k3, c3) is touched on either side when |x2| exceeds the gap e."


def compute(screen: FlipFlowScreen) -> FlipFlowScreen:
    """The machine as it is."""
    return screen


def draw(screen: FlipFlowScreen) -> Drawing:
    """Frames, springs, dampers, unbalance and stops."""
    return draw_machine(screen, TITLE, CAPTION)


FIGURE = PaperFigure("figure-05", TITLE, compute, draw, ())
