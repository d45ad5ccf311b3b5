"""What goes into the ground: the greatest dynamic force of every load case, start and stop."""

from __future__ import annotations

from flipflow.plotting.figure import Figure
from flipflow.plotting.layout import NAME_LETTERS, within
from flipflow.plotting.panels import Axis, Bar, Panel
from flipflow.plotting.scales import KN
from flipflow.studies.foundation_loads import Components, FoundationLoads

WAYS = (("vertical", "relative"), ("horizontal", "main"))
ALONG = (("normal", "relative"), ("along", "main"))


def foundation_figure(loads: FoundationLoads) -> Figure:
    """Bars of all supports together, vertical and horizontal; along and normal without angle."""
    rows: list[tuple[str, Components]] = [(one.name, one.running) for one in loads.cases]
    rows += [(one.name, one.peaks) for one in loads.runs]
    ways = WAYS if loads.deck_angle is not None else ALONG
    bars = []
    for k, (_, peaks) in enumerate(rows):
        for place, (way, colour) in enumerate(ways):
            force = getattr(peaks, way)
            if force is not None:
                at = float(len(rows) - 1 - k) + 0.2 - 0.4 * place
                bars.append(Bar(way, at, 0.0, force * KN, 0.36, colour, legend=k == 0))
    words = (within(name, NAME_LETTERS, 2) for name, _ in rows)
    ticks = tuple((float(len(rows) - 1 - k), word) for k, word in enumerate(words))
    top = 1.1 * max((bar.high for bar in bars), default=1.0)
    panel = Panel(
        Axis("greatest dynamic force", "kN", (0.0, top)),
        Axis("", "", (-0.6, len(rows) - 0.4), ticks), bars=tuple(bars),
    )  # fmt: skip
    caption = " ".join(["All supports together.", *loads.notes])
    return Figure("Loads on the foundation", caption, (panel,), 1, 80 + 44 * len(rows))
