"""Branches over speed and over a field of the machine, their multipliers, and curves of points."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
from scipy.optimize import linear_sum_assignment

from flipflow.compiled.arrays import Complex, Real
from flipflow.continuation.bifurcation_curve import BifurcationCurve
from flipflow.continuation.branch import Branch
from flipflow.continuation.branch_status import BranchStatus
from flipflow.continuation.field_branch import FieldBranch
from flipflow.errors import InputError
from flipflow.model.fields import FIELD
from flipflow.model.system import Coordinate
from flipflow.plotting.curves import Curve, stable_beside
from flipflow.plotting.figure import Figure
from flipflow.plotting.palette import case_colour, case_symbol
from flipflow.plotting.panels import Axis, Line, Panel, Trace
from flipflow.plotting.response import (
    KIND_SYMBOLS,
    KIND_WORDS,
    READING,
    UNSTABLE_FOLD,
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

MOST_SHOWN = 6  # multipliers that are drawn
WIDEST = 1.6  # of the plane around the unit circle
CIRCLE = np.exp(2j * np.pi * np.linspace(0.0, 1.0, 181))
DASHES = {"grazing": "dot", "period doubling": "dash", "symmetry breaking": "dash",
          "Neimark-Sacker": "dashdot"}  # fmt: skip
OMEGA = "omega"
WORDS = {"fold": "jump speed (fold)", "grazing": "contact begins (grazing)"}
Read = Callable[[FieldBranch], tuple[Real, Real]]


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
        raise InputError("result", kinds, "give branches over frequency, or over one field")
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
    return field_branches_figure([branch], which)


def field_branches_figure(
    branches: Sequence[FieldBranch], which: Coordinate | None = None
) -> Figure:
    """Several branches over one field of a machine, or several curves of folds.

    Parameters
    ----------
    branches
        At least one that has points. Each has its own colour and entry of the legend.
    which
        The coordinate; None: the relative motion of a screen, or the first one there is.

    Raises
    ------
    InputError
        For branches over different fields, and for curves of folds among motions.
    """
    branches = [branch for branch in branches if branch.orbits] or branches
    field, of_folds = _what_is_drawn(branches)
    words = field.replace("_", " ")
    axis, scale = field_axis(field, np.concatenate([branch.values for branch in branches]))
    system = branches[0].machine.system()
    if which is None:
        which = "relative" if "relative" in system.coordinates else system.named[0]
    (which,) = coordinates(system, which)
    top = max(float(branch.amplitude(which).max()) for branch in branches) * MM
    bounds = None if of_folds else (0.0, 1.08 * top)
    rows: list[tuple[Axis, Read]] = [
        (Axis(f"amplitude, {label(which)}", "mm", bounds), partial(_amplitudes, which))
    ]
    if of_folds:
        rows.insert(0, (Axis("shaft speed", "rpm"), _speeds))
    names = _names_over_a_field(branches, "fold" if of_folds else label(which), of_folds)
    panels = []
    for k, (upwards, read) in enumerate(rows):
        drawn = [(branch, *read(branch)) for branch in branches]
        traces = [
            trace
            for j, (branch, y, _) in enumerate(drawn)
            for trace in _field_traces(branch, y, scale, names[j], j, of_folds, legend=k == 0)
        ]
        marks = _field_points([(branch, at) for branch, _, at in drawn], scale, legend=k == 0)
        panels.append(Panel(axis, upwards, (*traces, *stability_key(traces), *marks)))
    caption = f"Half the peak-to-peak motion as {words} is changed."
    if of_folds:
        caption = f"Speed and half the peak-to-peak motion at the fold as {words} is changed."
    return Figure(f"{'Folds' if of_folds else 'Motions'} over {words}", caption, tuple(panels))


def _what_is_drawn(branches: Sequence[FieldBranch]) -> tuple[str, bool]:
    """The field of all branches, and whether they are curves of folds."""
    fields = list(dict.fromkeys(branch.field for branch in branches))
    if len(fields) > 1:
        raise InputError("result", fields, f"give branches over {fields[0]} alone")
    of_folds = {bool(np.ptp(branch.omega) > 0.0) for branch in branches}
    if len(of_folds) > 1:
        remedy = "draw curves of folds and motions at one frequency in figures of their own"
        raise InputError("result", [repr(branch) for branch in branches], remedy)
    return fields[0], of_folds.pop()


def _amplitudes(which: Coordinate, branch: FieldBranch) -> tuple[Real, Real]:
    """Amplitudes in mm along a branch, and at its special points."""
    marked = np.array([point.amplitude(which) for point in branch.special_points])
    return branch.amplitude(which) * MM, marked * MM


def _speeds(branch: FieldBranch) -> tuple[Real, Real]:
    """Speeds in rpm along a branch, and at its special points."""
    return branch.omega * RPM, np.array([point.omega for point in branch.special_points]) * RPM


def _names_over_a_field(
    branches: Sequence[FieldBranch], alone: str, of_folds: bool
) -> Sequence[str]:
    """What the legend calls each branch: speeds of folds, periods of motions and their speed."""
    if len(branches) == 1:
        return [alone]
    names = []
    for branch in branches:
        low, high = (speed_of(branch, end) for end in (branch.omega.min(), branch.omega.max()))
        periods = branch.orbits[0].periods
        turns = "1 period" if periods == 1 else f"{periods} periods"
        names.append(
            f"fold, {low.removesuffix(' rpm')} to {high}" if of_folds else f"{turns}, at {low}"
        )
    if len(set(names)) < len(names):
        return [f"{k}: {name}" for k, name in enumerate(names, start=1)]
    return names


def _field_traces(
    branch: FieldBranch, y: Real, scale: float, name: str, index: int, of_folds: bool, *,
    legend: bool,
) -> Iterator[Trace]:  # fmt: skip
    """The line of one branch; on a curve of folds every motion is on the edge."""
    runs = Curve(branch.values, y, y, branch.stability).runs()
    for role, run in [("motion", slice(None))] if of_folds else runs:
        yield Trace(
            name, branch.values[run] * scale, y[run], role, case_colour(index),  # type: ignore[arg-type]
            symbol=case_symbol(index) if role in ("motion", "stable") else None, bold=index == 0,
            legend=legend,
        )  # fmt: skip
        legend = False


def _field_points(
    drawn: Sequence[tuple[FieldBranch, Real]], scale: float, *, legend: bool
) -> Iterator[Trace]:
    """Marks at special points over the field, one entry of the legend for each kind."""
    marks = [
        (mark_of(branch, point), point.value * scale, float(y))
        for branch, at in drawn
        for point, y in zip(branch.special_points, at, strict=True)
    ]
    for word, symbol in dict.fromkeys(mark for mark, _, _ in marks):
        x, y = np.array([(x, y) for mark, x, y in marks if mark == (word, symbol)]).T
        yield Trace(word, x, y, "point", "jump", symbol=symbol, legend=legend)


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


def multipliers_figure(branch: Branch | FieldBranch) -> Figure:
    """|mu| of each multiplier over the parameter, and mu beside the unit circle."""
    if isinstance(branch, Branch):
        x, axis = branch.omega * RPM, speed_axis(branch.omega)
    else:
        axis, scale = field_axis(branch.field, branch.values)
        x = branch.values * scale
    tracked = tracked_multipliers(branch.multipliers)
    largest = np.nanmax(np.abs(tracked), axis=0, initial=0.0)
    tracked = tracked[:, np.sort(np.argsort(-largest, kind="stable")[:MOST_SHOWN])]
    sizes, ways = [], [Trace("unit circle", CIRCLE.real, CIRCLE.imag, colour="gap")]
    for k, mu in enumerate(tracked.T):
        name, colour = f"multiplier {k + 1}", case_colour(k)
        sizes.append(Trace(name, x, np.abs(mu), colour=colour, symbol=case_symbol(k)))
        ways.append(Trace(name, mu.real, mu.imag, colour=colour, legend=False))
    ends = 1.05 * max(1.0, float(np.abs(tracked).max(initial=1.0)))
    left = Panel(axis, Axis("|multiplier|", "", (0.0, ends)), tuple(sizes), lines=(Line("y", 1.0),))
    wide = min(ends, WIDEST)
    right = Panel(
        Axis("real part", "", (-wide, wide)), Axis("imaginary part", "", (-wide, wide)),
        tuple(ways), equal=True,
    )  # fmt: skip
    caption = (
        "Factors by which small disturbances grow over a period; each line is one multiplier, "
        "followed along the branch. Below 1 the motion returns."
        + (f" The {MOST_SHOWN} that grow largest." if largest.size > MOST_SHOWN else "")
        + (f" The plane ends at {WIDEST}." if ends > WIDEST else "")
    )
    return Figure("Multipliers", caption, (left, right), 2, 320, (0.6, 0.4))


def tracked_multipliers(multipliers: Complex) -> Complex:
    """Rows (n, 2 N) reordered so that each column is one multiplier along the branch."""
    tracked = np.array(multipliers)
    for p in range(1, tracked.shape[0]):
        away = np.abs(tracked[p - 1][:, None] - multipliers[p][None, :])
        if np.isfinite(away).all():
            tracked[p] = multipliers[p][linear_sum_assignment(away)[1]]
    return tracked


def curves_figure(*curves: BifurcationCurve) -> Figure:
    """Curves of special points, and what stands on them, over two parameters of one machine.

    Raises
    ------
    InputError
        For a curve without points, and for curves over other parameters than the first's.
    """
    names = curves[0].parameters
    for curve in curves:
        if curve.parameters != names:
            over = " and ".join(names)
            raise InputError("result", curve.parameters, f"give curves over {over} alone")
        if not curve.orbits:
            raise InputError("result", "a curve without points", curve.status.value)
    every = np.concatenate([curve.values for curve in curves])
    (x_axis, x_scale), (y_axis, y_scale) = (
        _parameter_axis(name, every[:, k]) for k, name in enumerate(names)
    )
    traces, named = [], set[str]()
    for k, curve in enumerate(curves):
        name = _curve_name(curve)
        traces.append(
            Trace(
                name, curve.values[:, 0] * x_scale, curve.values[:, 1] * y_scale, "stable",
                case_colour(k), bold=curve.kind == "fold", legend=name not in named,
                dash=DASHES.get(curve.kind, ""),
            )
        )  # fmt: skip
        named.add(name)
    points = [point for curve in curves for point in curve.special_points]
    for kind in dict.fromkeys(point.kind for point in points):
        at = np.array([point.values for point in points if point.kind == kind])
        traces.append(
            Trace(KIND_WORDS.get(kind, kind), at[:, 0] * x_scale, at[:, 1] * y_scale, "point",
                  "jump", symbol=KIND_SYMBOLS.get(kind, "square-open"))
        )  # fmt: skip
    caption = (
        "Each line is where the motion changes its character in the plane of both parameters; "
        "marks are where two such changes meet, or where a line turns back."
    )
    title = " against ".join(name.replace("_", " ") for name in names)
    return Figure(title, caption, (Panel(x_axis, y_axis, traces=tuple(traces)),), height=430)


def _curve_name(curve: BifurcationCurve) -> str:
    """What the legend calls a curve; folds between unstable motions alone are no jumps."""
    if curve.kind == "fold" and all(stable_beside(orbit) is False for orbit in curve.orbits):
        return UNSTABLE_FOLD
    return WORDS.get(curve.kind, curve.kind)


def _parameter_axis(name: str, values: Real) -> tuple[Axis, float]:
    """Axis of a parameter over all of its values, and the factor from SI to its unit."""
    if name == OMEGA:
        return Axis("shaft speed", "rpm"), RPM
    return field_axis(name, values)
