"""The least blow that makes a motion jump, over the moment at which it strikes."""

from __future__ import annotations

import numpy as np

from flipflow.plotting.figure import Figure
from flipflow.plotting.palette import case_colour, case_symbol
from flipflow.plotting.panels import Axis, Panel, Trace
from flipflow.plotting.scales import DEGREES
from flipflow.plotting.units import speed_of
from flipflow.studies.jump_risk import JumpRisk

WAYS = ("along +x", "along -x")


def jump_risk_figure(risk: JumpRisk) -> Figure:
    """Least impulse on each frame, either way, over the angle of the unbalance."""
    traces = []
    for row, (frame, both) in enumerate(risk.thresholds.items()):
        for k, (way, least) in enumerate(zip(WAYS, both, strict=True)):
            shown = np.where(np.isfinite(least), least, np.nan)
            index = 2 * row + k
            traces.append(
                Trace(f"{frame}, {way}", risk.phases * DEGREES, shown, colour=case_colour(index),
                      symbol=case_symbol(index), bold=index == 0)
            )  # fmt: skip
    highest = [float(np.nanmax(t.y)) for t in traces if np.isfinite(t.y).any()]
    top = 1.08 * max(highest, default=1.0)
    panel = Panel(
        Axis("shaft angle", "deg"), Axis("least impulse", "kg m/s", (0.0, top)), tuple(traces)
    )
    caption = (
        f"At {speed_of(risk, risk.omega)}: an impulse at or above the line throws the machine onto "
        "another motion. Where there is no line, none that was tried does."
    )
    return Figure("What makes the motion jump", caption, (panel,), height=340)
