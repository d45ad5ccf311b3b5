"""A design map: jump speeds, amplitude, region and steadiness over the gap, a line a stop."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.model.numerals import rpm
from flipflow.plotting.branches import field_axis
from flipflow.plotting.figure import Figure
from flipflow.plotting.palette import case_colour, case_symbol
from flipflow.plotting.panels import Axis, Line, Panel, Trace
from flipflow.plotting.scales import MM, RPM
from flipflow.studies.design_map import DesignMap

MN = 1e-6


def design_map_figure(found: DesignMap) -> Figure:
    """Speeds of contact and of jumps, amplitude at working speed, width of the region, load."""
    axis, _ = field_axis("clearance", found.clearance)
    x = found.clearance * MM
    words = [f"k3 = {k * MN:.4g} MN/m" for k in found.stop_stiffness]
    colour = {float(k): case_colour(j) for j, k in enumerate(found.stop_stiffness)}
    traces, cusps = _contact(found), []
    for curve in found.curves:
        if curve.kind == "grazing":
            continue
        stiffness = float(curve.machine.stop_stiffness)  # type: ignore[attr-defined]
        gaps, speeds = curve.along("clearance") * MM, curve.omega * RPM
        traces.append(Trace("jump speeds", gaps, speeds, colour=colour[stiffness], legend=False))
        cusps += [(point.values[0] * MM, point.omega * RPM) for point in curve.points_of("cusp")]
    if cusps:
        at = np.array(cusps)
        traces.append(
            Trace("folds are born (cusp)", at[:, 0], at[:, 1], "point", "jump",
                  symbol="diamond-open")
        )  # fmt: skip
    working = f"working speed {rpm(found.omega)} rpm"
    speed = Line("y", found.omega * RPM, working, "speed", "dashdot")
    panels = [
        Panel(axis, Axis("shaft speed", "rpm"), traces=tuple(traces), lines=(speed,)),
        Panel(axis, Axis("amplitude (|x2|)", "mm"), _lines(x, found.amplitude * MM, words, True)),
    ]
    if np.isfinite(found.width).any():
        region = Axis("width of region", "rpm")
        panels.append(Panel(axis, region, _lines(x, found.width * RPM, words, False)))
    under = ""
    if np.isfinite(found.steadiness).any():
        share = Axis("amplitude, loaded / empty")
        panels.append(Panel(axis, share, _lines(x, found.steadiness, words, False)))
        under = " Below: what is left of the amplitude under load."
    caption = (
        "Above: the speeds at which the machine jumps, a line for each stop in the colours of the "
        "panel below; where both speeds meet, in the cusp, the jump is gone. Dashed: contact "
        "begins, with unequal gaps on the side touched last. In the middle: the relative amplitude "
        "at working speed as it is reached from below, and the width of the operating region."
        f"{under}"
    )
    caption = " ".join([caption, *found.notes])
    return Figure("Gap and stop stiffness", caption, tuple(panels), height=220 * len(panels))


def _contact(found: DesignMap) -> list[Trace]:
    """Where contact begins: one curve for all stops, or the cells of each."""
    name, once = "contact begins", [one for one in found.curves if one.kind == "grazing"]
    if once:
        return [
            Trace(name, one.along("clearance") * MM, one.omega * RPM, colour="gap", dash="dash")
            for one in once
        ]
    touching = np.flatnonzero(np.isfinite(found.omega_cs).any(axis=1)).tolist()
    return [
        Trace(
            name, found.clearance * MM, found.omega_cs[j] * RPM, colour=case_colour(j),
            symbol=case_symbol(j), legend=j == touching[0], dash="dash",
        )
        for j in touching
    ]  # fmt: skip


def _lines(x: Real, rows: Real, words: Sequence[str], legend: bool) -> tuple[Trace, ...]:
    return tuple(
        Trace(word, x, row, "stable", case_colour(j), case_symbol(j), legend=legend)
        for j, (word, row) in enumerate(zip(words, rows, strict=True))
    )
