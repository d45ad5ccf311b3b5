"""Machines compared: their responses laid over each other, load case by load case."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from flipflow.continuation.branch import Branch
from flipflow.model.screen import Load
from flipflow.plotting.curves import Curve
from flipflow.plotting.figure import Figure
from flipflow.plotting.layout import LEGEND_ROW, legend_rows, short_names, within
from flipflow.plotting.palette import case_colour, case_symbol
from flipflow.plotting.panels import Axis, Line, Panel
from flipflow.plotting.response import curve_traces
from flipflow.plotting.scales import MM, RPM
from flipflow.studies.compare import EMPTY, Comparison

COLUMNS, MOST_PANELS, ROW, TITLE_LETTERS = 2, 8, 205, 40
CAPTION = (
    "Half the peak-to-peak relative motion over speed; dashed: does not return after a small "
    "disturbance. Vertical line: working speed."
)
HEADROOM = 1.06


def comparison_figure(found: Comparison) -> Figure:
    """Relative amplitude of every machine over rpm, for the empty machine and each load case.

    A load case has a panel where it is the same word in at least two machines, as far as there is
    room; what follows is in the table.

    Parameters
    ----------
    found
        What :func:`flipflow.compare` returns.
    """
    shown = [(EMPTY, [(k, one.region.branch) for k, one in enumerate(found.assessments)])]
    names = dict.fromkeys(case.name for one in found.assessments for case in one.cases)
    for name in names:
        branches, changed = _of_case(found, name)
        if len(branches) > 1 and changed:
            shown.append((name, branches))
    left = len(shown) - MOST_PANELS
    panels = tuple(_panel(found, *one) for one in shown[:MOST_PANELS])
    rows = -(-len(panels) // COLUMNS)
    more = f" {left} more load cases are not drawn." if left > 0 else ""
    columns = min(COLUMNS, len(panels))
    figure = Figure("Responses laid over", CAPTION + more, panels, columns, 24 + ROW * rows)
    return dataclasses.replace(figure, height=figure.height + LEGEND_ROW * legend_rows(figure))


def _of_case(found: Comparison, name: str) -> tuple[list[tuple[int, Branch]], bool]:
    """The branches of a load case, and whether it changes any of the machines."""
    cases = [
        (k, case)
        for k, one in enumerate(found.assessments)
        for case in one.cases
        if case.name == name
    ]
    changed = any(case.load != Load(name=case.load.name) for _, case in cases)
    return [(k, case.branch) for k, case in cases], changed


def _panel(found: Comparison, name: str, branches: Sequence[tuple[int, Branch]]) -> Panel:
    names = short_names(found.names)
    curves = [(k, Curve.of(branch, "relative")) for k, branch in branches]
    traces = [
        trace
        for k, curve in curves
        for trace in curve_traces(
            names[k], curve, curve.amplitude * MM, colour=case_colour(k),
            symbol=case_symbol(k), bold=k == 0, legend=name == EMPTY,
        )
    ]  # fmt: skip
    low = min(float(curve.omega.min()) for _, curve in curves)
    high = max(float(curve.omega.max()) for _, curve in curves)
    top = max(float(curve.amplitude.max()) for _, curve in curves)
    speeds = dict.fromkeys(one.omega for one in found.assessments if one.omega is not None)
    lines = tuple(Line("x", w * RPM, "", "speed", "dashdot") for w in speeds if low <= w <= high)
    return Panel(
        Axis("shaft speed", "rpm", (low * RPM, high * RPM)),
        Axis("amplitude", "mm", (0.0, HEADROOM * top * MM)),
        traces=tuple(traces), lines=lines, title=within(name, TITLE_LETTERS),
    )  # fmt: skip
