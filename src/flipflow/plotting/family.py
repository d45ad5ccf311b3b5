"""Amplitudes over angular frequency: families of machines, and motions that lean to one side."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from flipflow.continuation.branch import Branch
from flipflow.model.fields import FIELD, symbol_of
from flipflow.model.system import Coordinate
from flipflow.periodic.orbit import Orbit
from flipflow.plotting.curves import Curve
from flipflow.plotting.figure import Figure
from flipflow.plotting.palette import case_colour, case_symbol
from flipflow.plotting.panels import Axis, Line, Panel, Trace
from flipflow.plotting.response import (
    NOWHERE,
    coordinates,
    curve_traces,
    label,
    quantity_label,
    stability_key,
)
from flipflow.plotting.scales import HZ, MM, RPM
from flipflow.studies.response_family import Member, ResponseFamily

HEIGHT = 180
SPEED = "angular frequency"
BALANCE = "third-order harmonic balance"
READING = "Solid: stable; dashed: unstable; dotted: on the edge. Crosses: folds."


def family_figure(
    family: ResponseFamily,
    *,
    labels: Sequence[str] = (),
    beneath: ResponseFamily | None = None,
    title: str = "",
    note: str = "",
    which: Coordinate | None = None,
) -> Figure:
    """Amplitude of every coordinate over rad/s, one line for each member.

    Of a screen these are both frames and the relative motion.

    Parameters
    ----------
    family
        What ``response_family`` returns.
    labels
        A word for each member; its value and unit where none are given.
    beneath
        The same family by harmonic balance, drawn wide and pale beneath.
    title, note
        Title, and a sentence for the caption.
    which
        The only coordinate to draw; None: all.
    """
    symbol = symbol_of(family.field)
    words = list(labels) or [_value(family.field, member.value) for member in family.members]
    panels = tuple(
        _panel(
            name, family.members, words, beneath, quantity_label("amplitude", which), first=k == 0
        )
        for k, name in enumerate(coordinates(family.machine.system(), which))
    )
    under = f" Wide and pale beneath: {BALANCE}." if beneath is not None else ""
    caption = f"Half the peak-to-peak motion. {READING}{under} {note}".strip()
    return Figure(
        title or f"Response over {symbol}", caption, panels, height=HEIGHT * len(panels) + 80
    )


def branch_traces(
    name: str,
    branch: Branch,
    which: Coordinate,
    index: int,
    *,
    legend: bool = True,
    bold: bool = False,
) -> Iterator[Trace]:
    """One coordinate of a branch over rad/s, its folds as crosses."""
    curve = Curve.of(branch, which)
    yield from curve_traces(
        name, curve, curve.amplitude * MM, colour=case_colour(index), symbol=case_symbol(index),
        bold=bold, legend=legend, unit="rad/s",
    )  # fmt: skip
    if branch.folds:
        omega = np.array([fold.omega for fold in branch.folds])
        height = np.array([fold.amplitude(which) for fold in branch.folds]) * MM
        yield Trace(
            "fold", omega, height, "point", case_colour(index), symbol="cross", legend=False,
            x_also=(("rpm", omega * RPM), ("Hz", omega * HZ)),
        )  # fmt: skip


def beneath_traces(
    name: str, branch: Branch, which: Coordinate, *, legend: bool
) -> Iterator[Trace]:
    """A branch as one wide pale line that another is laid over."""
    curve = Curve.of(branch, which)
    yield Trace(name, curve.omega, curve.amplitude * MM, "beneath", "beneath", legend=legend)


def speed_axis_in_radians(low: float, high: float) -> Axis:
    """Axis of angular frequency."""
    return Axis(SPEED, "rad/s", (low, high))


def leaning_panel(branch: Branch, windows: Sequence[Sequence[Orbit]], title: str) -> Panel:
    """Greatest excursion to either side where the motion loses its symmetry, over rad/s.

    Parameters
    ----------
    branch
        The symmetric motions.
    windows
        What :func:`~flipflow.studies.leaning_motions.leaning_motions` returns.
    title
        Names the machine.
    """
    ends = [orbit.omega for window in windows for orbit in window]
    low, high = min(ends), max(ends)
    reach = 0.6 * (high - low)  # shown on both sides of the windows
    curve = Curve.of(branch, "relative")
    near = (curve.omega > low - reach) & (curve.omega < high + reach)
    traces = list(
        curve_traces(
            "symmetric motion", curve.part(near), curve.amplitude[near] * MM,
            colour="case 0", symbol=None, bold=True, unit="rad/s",
        )
    )  # fmt: skip
    for k, window in enumerate(windows):
        omega = np.array([orbit.omega for orbit in window])
        middle = np.array([orbit.mean("relative") for orbit in window])
        half = np.array([orbit.amplitude("relative") for orbit in window])
        far, close = half + np.abs(middle), half - np.abs(middle)
        sides = ((far, "leaning: farther side", "case 1"), (close, "nearer side", "case 2"))
        traces += [
            Trace(name, omega, side * MM, "stable", colour, legend=k == 0, bold=True)
            for side, name, colour in sides
        ]
    gap = min(branch.system.springs[0].gaps) * MM
    return Panel(
        speed_axis_in_radians(low - reach, high + reach), Axis("excursion |x2|", "mm"),
        tuple(traces), lines=(Line("y", gap, "gap (e)", "gap", text_at=1.0),), title=title,
    )  # fmt: skip


def _panel(
    which: Coordinate,
    members: Sequence[Member],
    labels: Sequence[str],
    beneath: ResponseFamily | None,
    height: str,
    *,
    first: bool,
) -> Panel:
    traces: list[Trace] = []
    for k, member in enumerate(() if beneath is None else beneath.members):
        traces += beneath_traces(BALANCE, member.branch, which, legend=first and k == 0)
    for k, (member, words) in enumerate(zip(members, labels, strict=True)):
        traces += branch_traces(words, member.branch, which, k, legend=first)
    top = max(float(trace.y.max()) for trace in traces)
    if first:
        traces += stability_key(traces)
        if any(member.branch.folds for member in members):
            traces.append(Trace("fold", NOWHERE, NOWHERE, "point", "gap", "cross"))
    return Panel(
        speed_axis_in_radians(0.0, max(float(one.branch.omega.max()) for one in members)),
        Axis(height, "mm", (0.0, 1.06 * top)), tuple(traces), title=label(which),
    )  # fmt: skip


def _value(field: str, value: float) -> str:
    if field not in FIELD:
        return f"{field} = {value:.4g}"
    known = FIELD[field]
    if known.unit == "m":  # as the axes
        return f"{known.symbol} = {value * MM:.4g} mm"
    return f"{known.symbol} = {value:.4g} {known.unit}"
