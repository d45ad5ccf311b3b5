"""Empty and loaded machine side by side: relative amplitude, and its change over the region."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flipflow.plotting.family import BALANCE, beneath_traces, branch_traces, speed_axis_in_radians
from flipflow.plotting.figure import Figure
from flipflow.plotting.layout import LEGEND_LETTERS, within
from flipflow.plotting.panels import Axis, Band, Line, Panel, Trace
from flipflow.plotting.scales import MM
from flipflow.studies.loading import LoadedMachine, Loading, RegionChange

WORDS = {"unloaded": "empty", "loaded": "loaded"}


def loading_figure(loading: Loading, title: str = "", beneath: Loading | None = None) -> Figure:
    """Relative amplitude over rad/s and its change over the region, with and without stop.

    Parameters
    ----------
    loading
        What :func:`flipflow.loading` returns.
    title
        Title of the figure.
    beneath
        The same by harmonic balance, drawn beneath for the machine with stop.

    Returns
    -------
    Figure
        For each machine a panel of amplitudes beside one of changes.
    """
    machines = [("with stop", loading.with_stop), ("without stop", loading.without_stop)]
    shown = [(name, machine) for name, machine in machines if machine is not None]
    panels = [
        panel
        for name, machine in shown
        for panel in (
            _amplitudes(name, machine, loading, beneath, first=machine is shown[0][1]),
            _changes(name, machine, first=machine is shown[0][1]),
        )
    ]
    caption = (
        "Half the peak-to-peak motion; green: operating region of the empty machine. Right: loaded "
        "minus empty over that region, with straight lines through its ends, as in the paper, and "
        "of least squares; the same over what the loaded machine's region leaves of it."
    )
    return Figure(
        title or "What the load does to the relative amplitude", caption, tuple(panels),
        columns=2, height=70 + 230 * (len(panels) // 2), shares=(0.58, 0.42),
    )  # fmt: skip


def _amplitudes(
    name: str, machine: LoadedMachine, loading: Loading, beneath: Loading | None, *, first: bool
) -> Panel:
    word = within(loading.load.name, LEGEND_LETTERS) or "loaded"
    under = None if beneath is None else beneath.with_stop
    pale = [
        trace
        for k, branch in enumerate(
            (under.unloaded, under.loaded) if under and machine is loading.with_stop else ()
        )
        for trace in beneath_traces(BALANCE, branch, "relative", legend=first and k == 0)
    ]
    traces = [
        *pale,
        *branch_traces("empty", machine.unloaded, "relative", 0, legend=first, bold=True),
        *branch_traces(word, machine.loaded, "relative", 1, legend=first),
    ]
    low, high = machine.region.lower, machine.region.upper
    last = float(machine.unloaded.omega.max())
    top = max(float(trace.y.max()) for trace in traces)
    marks = machine.unloaded_marks
    ends = ("w_cs", "w_lb") if marks.omega_lb == marks.upper else ("", "")
    if (marks.lower, marks.upper) == (marks.omega_ea, marks.omega_ar):
        ends = ("w_ea", "w_ar")
    lines = tuple(
        Line("x", at, f"{end} {at:.4g} rad/s".strip(), "mark")
        for end, at in zip(ends, (low, high), strict=True)
    )
    return Panel(
        speed_axis_in_radians(0.0, last), Axis("relative amplitude", "mm", (0.0, 1.06 * top)),
        tuple(traces), bands=(Band("x", low, high),), lines=lines, title=name,
    )  # fmt: skip


def _changes(name: str, machine: LoadedMachine, *, first: bool) -> Panel:
    regions = [one for one in (machine.region, machine.from_loaded) if one is not None]
    traces = [
        Trace(
            "loaded minus empty", machine.region.omega, machine.region.change * MM, "motion",
            "relative", bold=True, legend=first,
        )
    ]  # fmt: skip
    for region in regions:
        traces += _lines(region, legend=first)
    return Panel(
        speed_axis_in_radians(machine.region.lower, machine.region.upper),
        Axis("change", "mm"), tuple(traces), title=f"change, {name}",
    )  # fmt: skip


def _lines(region: RegionChange, *, legend: bool) -> Iterator[Trace]:
    ends = np.array([region.lower, region.upper])
    dash, colour = ("dash", "main") if region.start == "unloaded" else ("dashdot", "floating")
    kinds = (("ends", region.line_through_ends, dash, "square"),
             ("least squares", region.line_of_least_squares, "dot", None))  # fmt: skip
    for kind, line, style, symbol in kinds:
        yield Trace(
            f"{WORDS[region.start]} region: {kind}", ends,
            (line.intercept + line.slope * (ends - region.lower)) * MM, "motion", colour,
            symbol=symbol, dash=style, legend=legend,
        )  # fmt: skip
