"""Several branches over speed in one panel, and a branch over a field of the machine."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from flipflow.continuation.branch import Branch
from flipflow.continuation.branch_status import BranchStatus
from flipflow.continuation.field_branch import FieldBranch
from flipflow.errors import InputError
from flipflow.model.fields import FIELD
from flipflow.model.system import Coordinate
from flipflow.plotting.curves import Curve
from flipflow.plotting.figure import Figure
from flipflow.plotting.palette import case_colour, case_symbol
from flipflow.plotting.panels import Axis, Panel, Trace
from flipflow.plotting.response import (
    READING,
    coordinates,
    curve_traces,
    label,
    mark_of,
    special_point_traces,
    speed_axis,
    stability_key,
)
from flipflow.plotting.scales import MM, RPM
from flipflow.plotting.units import speed_of

Real = NDArray[np.float64]


def branches_figure(branches: Sequence[Branch], which: Coordinate | None = None) -> Figure:
    """Amplitude of the relative motion along several branches of one machine over rpm.

    Parameters
    ----------
    branches
        Branches over frequency: the one from below, detached ones, those of several periods.
        Each has its own colour and symbol; the legend names its periods and where it comes from.
    which
        The coordinate; None: the relative motion of a screen, or the last one there is.

    Returns
    -------
    Figure
        One panel.

    Raises
    ------
    InputError
        Where there is no branch, or something else among them.
    IncompleteError
        When none of them has points.
    """
    if not branches or not all(isinstance(branch, Branch) for branch in branches):
        kinds = [type(branch).__name__ for branch in branches]
        raise InputError("result", kinds, "give a list of branches over frequency")
    which = coordinates(branches[0].system, which)[-1]
    branches = [branch for branch in branches if branch.omega.size] or branches[:1]
    curves = [Curve.of(branch, which) for branch in branches]
    traces: list[Trace] = []
    for k, (branch, curve) in enumerate(zip(branches, curves, strict=True)):
        traces += curve_traces(
            branch_name(branch), curve, curve.amplitude * MM, colour=case_colour(k),
            symbol=case_symbol(k), bold=k == 0,
        )  # fmt: skip
    traces += stability_key(traces)
    traces += special_point_traces(branches, which)
    top = max(float(curve.amplitude.max()) for curve in curves) * MM
    omega = np.concatenate([curve.omega for curve in curves])
    panel = Panel(
        speed_axis(omega), Axis(f"amplitude, {label(which)}", "mm", (0.0, 1.08 * top)),
        traces=tuple(traces),
    )  # fmt: skip
    caption = (
        "Half the peak-to-peak motion of every branch. A motion of n periods repeats after n turns "
        f"of the shaft. {READING.split(' Arrows', maxsplit=1)[0]}"
    )
    return Figure("Motions over speed", caption, (panel,), height=430)


def branch_name(branch: Branch) -> str:
    """Periods of a branch and where it comes from."""
    periods = "1 period" if branch.periods == 1 else f"{branch.periods} periods"
    met = [point for point in branch.special_points if point.position < 0.0]
    if met:
        return f"{periods}, from {speed_of(branch, met[0].omega)}"
    if branch.status is BranchStatus.CLOSED:
        return f"{periods}, closed"
    if branch.status is BranchStatus.FOLLOWED:
        low, high = (speed_of(branch, end) for end in (branch.omega.min(), branch.omega.max()))
        return f"{periods}, {low.removesuffix(' rpm')} to {high}"
    return f"{periods}, from below"


def field_branch_figure(branch: FieldBranch, which: Coordinate | None = None) -> Figure:
    """Amplitude over a field; of a curve of folds first the frequency, then the amplitude."""
    if not branch.orbits:
        raise InputError("result", "a branch without points", branch.status.value)
    words = branch.field.replace("_", " ")
    axis, scale = field_axis(branch.field, branch.values)
    system = branch.machine.system()
    named = which is None and "relative" in system.coordinates
    (which,) = coordinates(system, which or ("relative" if named else 0))
    of_folds = bool(np.ptp(branch.omega) > 0.0)
    height = np.array([point.amplitude(which) for point in branch.special_points]) * MM
    amplitude = branch.amplitude(which) * MM
    title = f"amplitude, {label(which)}"
    bounds = None if of_folds else (0.0, 1.08 * float(amplitude.max()))
    drawn = [(Axis(title, "mm", bounds), amplitude, height)]
    if of_folds:
        speed = np.array([point.omega for point in branch.special_points]) * RPM
        drawn.insert(0, (Axis("shaft speed", "rpm"), branch.omega * RPM, speed))
    name = "fold" if of_folds else label(which)
    panels = []
    for k, (upwards, y, at_points) in enumerate(drawn):
        curve = Curve(branch.values, y, y, branch.stability)
        # On a curve of folds every motion is on the edge.
        runs = [("motion", slice(None))] if of_folds else list(curve.runs())
        traces = [
            Trace(name, branch.values[run] * scale, y[run], role, bold=True, legend=k == 0)  # type: ignore[arg-type]
            for role, run in runs
        ]
        marks = _field_points(branch, at_points, scale, legend=k == 0)
        panels.append(Panel(axis, upwards, (*traces, *stability_key(traces), *marks)))
    caption = f"Half the peak-to-peak motion as {words} is changed."
    if of_folds:
        caption = f"Speed and half the peak-to-peak motion at the fold as {words} is changed."
    return Figure(f"{'Folds' if of_folds else 'Motions'} over {words}", caption, tuple(panels))


def _field_points(branch: FieldBranch, y: Real, scale: float, *, legend: bool) -> Iterator[Trace]:
    """Marks at special points over the field, one entry of the legend for each kind."""
    marks = [mark_of(branch, point) for point in branch.special_points]
    values = np.array([point.value for point in branch.special_points]) * scale
    for word, symbol in dict.fromkeys(marks):
        at = np.array([mark == (word, symbol) for mark in marks])
        yield Trace(word, values[at], y[at], "point", "jump", symbol=symbol, legend=legend)


def field_axis(name: str, values: Real) -> tuple[Axis, float]:
    """Axis of a field over all of its values, and the factor from SI to its unit.

    Lengths are read in mm; every other field is drawn in SI, that of another machine as it is.
    """
    field, words = FIELD.get(name), name.replace("_", " ")
    scale, unit = (MM, "mm") if field and field.unit == "m" else (1.0, field.unit if field else "")
    label = f"{words} ({field.symbol})" if field else words
    return Axis(label, unit, _with_margin(values * scale)), scale


def _with_margin(x: Real) -> tuple[float, float]:
    """Ends of an axis a little beyond the values."""
    margin = 0.02 * float(np.ptp(x))
    return float(x.min()) - margin, float(x.max()) + margin
