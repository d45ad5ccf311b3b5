"""Several branches over speed in one panel, and a branch over a field of the machine."""

from __future__ import annotations

from collections.abc import Sequence

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
    KIND_SYMBOLS,
    KIND_WORDS,
    READING,
    coordinates,
    curve_traces,
    label,
    special_point_traces,
    speed_axis,
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
    traces += special_point_traces([p for b in branches for p in b.special_points], which)
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
        return f"{periods}, branches off at {speed_of(branch, met[0].omega)}"
    if branch.status is BranchStatus.CLOSED:
        return f"{periods}, closed"
    if branch.status is BranchStatus.FOLLOWED:
        low, high = (speed_of(branch, end) for end in (branch.omega.min(), branch.omega.max()))
        return f"{periods}, {low.removesuffix(' rpm')} to {high}"
    return f"{periods}, from below"


def field_branch_figure(branch: FieldBranch, which: Coordinate | None = None) -> Figure:
    """Relative amplitude over a field; of a curve of folds the jump speed, too."""
    if not branch.orbits:
        raise InputError("result", "a branch without points", branch.status.value)
    words = branch.field.replace("_", " ")
    axis, scale = field_axis(branch.field, branch.values)
    x = branch.values * scale
    system = branch.machine.system()
    named = which is None and "relative" in system.coordinates
    (which,) = coordinates(system, which or ("relative" if named else 0))
    amplitude = branch.amplitude(which)
    curve = Curve(branch.values, amplitude, amplitude, branch.stability)
    traces = [
        Trace(label(which), x[run], amplitude[run] * MM, role, bold=True)  # type: ignore[arg-type]
        for role, run in curve.runs()
    ]
    for kind in dict.fromkeys(point.kind for point in branch.special_points):
        points = branch.points_of(kind)
        at = np.array([point.value for point in points]) * scale
        heights = np.array([point.amplitude(which) for point in points]) * MM
        traces.append(
            Trace(KIND_WORDS.get(kind, kind), at, heights, "point", "jump",
                  symbol=KIND_SYMBOLS.get(kind, "square-open"))
        )  # fmt: skip
    height = Axis(
        "amplitude (|x2|)" if named else "amplitude",
        "mm",
        (0.0, 1.08 * MM * float(amplitude.max())),
    )
    panels = [Panel(axis, height, traces=tuple(traces))]
    if np.ptp(branch.omega) > 0.0:
        speed = Trace("speed of the fold", x, branch.omega * RPM, colour="main")
        panels.append(Panel(axis, Axis("shaft speed", "rpm"), traces=(speed,)))
    caption = f"Half the peak-to-peak motion as {words} is changed."
    return Figure(f"Motions over {words}", caption, tuple(panels))


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
