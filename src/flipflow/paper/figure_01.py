"""Figure 1: the machine as a drawing, without stop."""

from __future__ import annotations

import math

from flipflow.model.screen import FlipFlowScreen
from flipflow.paper.figure import PaperFigure
from flipflow.plotting.drawing import Drawing
from flipflow.plotting.schematic import schematic
from flipflow.plotting.symbols import svg_with_symbols
from flipflow.report.details import drawn_values

TITLE = "The flip-flow vibrating screen"
ALONG = (
    "Along the screen surface: the exciter drives the main frame (x1), which rests on isolation "
    "springs; shear springs carry the floating frame (xf) along. The screen panels are stretched "
    "and slackened by the relative motion x2 = x1 - xf."
)
CAPTION = f"{ALONG} The paper's picture shows the structure; this is the model of it."


def compute(screen: FlipFlowScreen) -> FlipFlowScreen:
    """The machine without its stop."""
    return screen.replace(clearance=math.inf, clearance_minus=None)


def draw_machine(screen: FlipFlowScreen, title: str, caption: str) -> Drawing:
    """The schematic with the machine's own values."""
    return Drawing(title, caption, svg_with_symbols(schematic(screen, drawn_values(screen))))


def draw(screen: FlipFlowScreen) -> Drawing:
    """Frames, springs, dampers, unbalance."""
    return draw_machine(screen, TITLE, CAPTION)


FIGURE = PaperFigure("figure-01", TITLE, compute, draw, (), needs_stop=False)
