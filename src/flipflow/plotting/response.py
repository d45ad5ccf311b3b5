"""Response over speed: one branch in full, or the relative amplitude of all load cases."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.continuation.branch import Branch, SpecialPoint
from flipflow.continuation.field_branch import FieldBranch
from flipflow.dynamics.linear_response import LinearResponse
from flipflow.model.numerals import rpm
from flipflow.model.system import Coordinate, MechanicalSystem
from flipflow.plotting.curves import Curve, Jump, is_jump
from flipflow.plotting.figure import Figure
from flipflow.plotting.layout import (
    LEGEND_LETTERS,
    LEGEND_ROW,
    legend_rows,
    short_names,
    within,
)
from flipflow.plotting.palette import CASES, case_colour, case_symbol
from flipflow.plotting.panels import Arrow, Axis, Band, Line, Panel, Trace
from flipflow.plotting.scales import DEGREES, HZ, MINUS, MM, RPM, SPEEDS
from flipflow.studies.assessment import Assessment

LABELS = {"main": "main frame (x1)", "floating": "floating frame (xf)", "relative": "relative (x2)"}
SYMBOLS = {"main": "square", "floating": "triangle"}
KIND_WORDS = {
    "fold": "jump (fold)", "contact begin": "contact begins", "contact end": "contact ends",
}  # fmt: skip
UNSTABLE_FOLD = "fold, both sides unstable"
KIND_SYMBOLS = {
    "fold": "diamond", "contact begin": "circle-open", "contact end": "cross",
    "period doubling": "triangle", "symmetry breaking": "square", "Neimark-Sacker": "star",
    "branch point": "triangle-open", "cusp": "diamond-open",
}  # fmt: skip
BAND_POINTS = 300
ROWS, ROW_HEIGHT = 5, 186  # of load cases one below the other on a page, pixels
OTHER_CASES = "the other load cases"
NEAR = 0.35
NOWHERE = np.array([np.nan])
MOST_COORDINATES = CASES
LEGEND_WITHIN = 2  # rows of the legend of all load cases that its height has room for
READING = (
    "Solid: the motion returns after a small disturbance. Dashed: it does not, so the machine "
    "leaves it. Arrows: the amplitude jumps, as the speed rises or falls."
)


def branch_figure(
    branch: Branch,
    omega: float | None = None,
    title: str = "",
    which: Coordinate | None = None,
) -> Figure:
    """Amplitude and phase of every coordinate along a branch.

    Parameters
    ----------
    branch
        What :func:`flipflow.frequency_response` returns.
    omega
        Working speed in rad/s, marked where it is given.
    title
        Title; names the load case in reports.
    which
        The only coordinate to draw; None: all.

    Returns
    -------
    Figure
        Two panels, amplitude and phase, over rpm; the first alone where nothing moves with the
        forcing frequency itself, so that there is no phase.
    """
    names = coordinates(branch.system, which)
    curves = [Curve.of(branch, name) for name in names]
    amplitude = _traces(branch.system, names, curves, "amplitude")
    phase = _traces(branch.system, names, curves, "phase")
    axis = speed_axis(branch.omega)
    points = special_point_traces([branch], names[-1])
    jumps = curves[-1].jumps()
    top = Panel(
        axis, _amplitude_axis(curves, which),
        traces=(*amplitude, *stability_key(amplitude), *points),
        lines=(*_working(omega), *_jump_lines(jumps)),
        arrows=_arrows(jumps),
    )  # fmt: skip
    bottom = Panel(
        axis, _phase_axis(curves, which), traces=tuple(phase),
        lines=_working(omega, text=False),
    )  # fmt: skip
    known = any(np.isfinite(curve.phase).any() for curve in curves)
    of_phase = (
        "; phase is that of the first harmonic against the unbalance force, negative when the "
        "motion lags"
    )
    caption = f"Amplitude is half the peak-to-peak motion{of_phase if known else ''}. {READING}"
    panels = (top, bottom) if known else (top,)
    return Figure(title or "Response over speed", caption, panels, height=430)


def responses_figures(
    branches: Sequence[tuple[str, Branch]], omega: float | None = None
) -> tuple[Figure, ...]:
    """Amplitude and phase along many branches, one below the other; each figure fits a page.

    Parameters
    ----------
    branches
        Names of load cases and their branches.
    omega
        Working speed in rad/s, marked where it is given.
    """
    figures = []
    for first in range(0, len(branches), ROWS):
        some = branches[first : first + ROWS]
        panels = [panel for name, branch in some for panel in _row(name, branch, omega)]
        title = "Response over speed" + (", continued" if first else "")
        caption = f"Left amplitude, right phase of each load case. {READING}"
        figures.append(
            Figure(title, caption, tuple(panels), 2, 40 + ROW_HEIGHT * len(some), (0.56, 0.44))
        )
    return tuple(figures)


def _row(name: str, branch: Branch, omega: float | None) -> tuple[Panel, Panel]:
    """Amplitude and phase of one load case side by side, without marks at special points."""
    names = coordinates(branch.system)
    curves = [Curve.of(branch, one) for one in names]
    axis, lines = speed_axis(branch.omega), _working(omega, text=False)
    left = Panel(
        axis, _amplitude_axis(curves),
        traces=tuple(_traces(branch.system, names, curves, "amplitude")), lines=lines,
        arrows=_arrows(curves[-1].jumps()), title=within(name, LEGEND_LETTERS),
    )  # fmt: skip
    phase = tuple(_traces(branch.system, names, curves, "phase"))
    return left, Panel(axis, _phase_axis(curves), traces=phase, lines=lines)


def linear_figure(response: LinearResponse, which: Coordinate | None = None) -> Figure:
    """Amplitude and phase without contact over rpm, with the natural frequencies marked."""
    names = coordinates(response.system, which)
    curves = [
        Curve(
            response.omega,
            response.amplitude(name),
            np.unwrap(response.phase(name)),
            np.full(response.omega.shape, "stable"),
        )
        for name in names
    ]
    amplitude = _traces(response.system, names, curves, "amplitude")
    phase = _traces(response.system, names, curves, "phase")
    axis = speed_axis(response.omega)
    marks = tuple(
        Line("x", w * RPM, f"w0{k}", "mark")
        for k, w in enumerate(response.natural_frequencies, start=1)
        if response.omega.min() <= w <= response.omega.max()
    )
    panels = (
        Panel(axis, _amplitude_axis(curves, which),
              traces=tuple(amplitude), lines=marks),
        Panel(axis, _phase_axis(curves, which), traces=tuple(phase)),
    )  # fmt: skip
    caption = (
        "As long as no stop is touched. Amplitude is half the peak-to-peak motion; phase is "
        "negative when the motion lags behind the unbalance force."
    )
    return Figure("Response without contact", caption, panels, height=520)


def cases_figure(assessment: Assessment) -> Figure:
    """Relative amplitude over rpm: band of load cases, jumps, allowed speeds, working speed.

    Parameters
    ----------
    assessment
        What :func:`flipflow.assess` returns.

    Returns
    -------
    Figure
        The neighbourhood of the working speed beside the whole range; without a working speed
        only the whole range.
    """
    curves = [Curve.of(case.branch, "relative") for case in assessment.cases]
    names = case_names([case.name for case in assessment.cases])
    whole = _cases_panel(assessment, names, curves, None)
    near = near_range(assessment)
    close = () if near is None else (_cases_panel(assessment, names, curves, near),)
    panels = (*close, whole)
    caption = (
        "Half the peak-to-peak motion. Green strip: allowed speeds. Dashed: does not return after "
        "a small disturbance. Arrows: jumps."
    )
    figure = Figure(
        "Amplitude of the relative motion over speed", caption, panels, len(panels), 196,
        shares=(0.56, 0.44) if len(panels) == 2 else (),
    )  # fmt: skip
    beyond = max(legend_rows(figure) - LEGEND_WITHIN, 0)
    return dataclasses.replace(figure, height=figure.height + LEGEND_ROW * beyond)


def case_names(names: Sequence[str]) -> list[str]:
    """What load cases are called in a legend: all but the first alike where they are many.

    Colours and marks tell no more than six apart.
    """
    if len(names) > CASES:
        return [within(names[0], LEGEND_LETTERS), *[OTHER_CASES] * (len(names) - 1)]
    return short_names(names)


def case_look(index: int, count: int) -> tuple[str, str | None]:
    """Colour and symbol of a load case; all but the first are grey where they are many."""
    if count > CASES and index:
        return case_colour(CASES - 1), None
    return case_colour(index), case_symbol(index)


def coordinates(
    system: MechanicalSystem, which: Coordinate | None = None
) -> tuple[Coordinate, ...]:
    """What is drawn of a system: ``which``, its named coordinates, or a few degrees of freedom.

    Raises
    ------
    InputError
        For a coordinate that the system does not have.
    """
    if which is not None:
        system.coordinate(which)
        return (which,)
    if system.coordinates:
        return tuple(system.coordinates)
    return tuple(range(min(system.size, MOST_COORDINATES)))


def label(which: Coordinate) -> str:
    """Words for a coordinate."""
    return LABELS.get(which, which) if isinstance(which, str) else f"x[{which}]"


def speed_axis(omega: Real, bounds: tuple[float, float] | None = None) -> Axis:
    """Axis of the shaft speed in rpm over all of ``omega`` (rad/s), or over ``bounds`` (rpm)."""
    ends = bounds or (float(omega.min()) * RPM, float(omega.max()) * RPM)
    return Axis("shaft speed", "rpm", ends)


def near_range(assessment: Assessment) -> tuple[float, float] | None:
    """The speeds around the working speed in rad/s; None without one."""
    omega = assessment.omega
    if omega is None:
        return None
    ends = [omega * (1.0 - NEAR), omega * (1.0 + NEAR)]
    if assessment.project.limits.speed is not None:
        low, high = assessment.project.limits.speed
        ends = [min(ends[0], 0.95 * low), max(ends[1], 1.05 * high)]
    reach = assessment.cases[0].branch.omega
    low, high = max(ends[0], float(reach.min())), min(ends[1], float(reach.max()))
    return (low, high) if low < omega < high else None


def _traces(
    system: MechanicalSystem, names: Sequence[Coordinate], curves: Sequence[Curve], quantity: str
) -> list[Trace]:
    """Amplitude or phase of every coordinate, each in its own colour."""
    scale = MM if quantity == "amplitude" else DEGREES
    traces: list[Trace] = []
    for which, curve in zip(names, curves, strict=True):
        colour, symbol = coordinate_look(system, which)
        traces += curve_traces(
            label(which), curve, getattr(curve, quantity) * scale, colour=colour, symbol=symbol,
            bold=which == "relative", legend=quantity == "amplitude",
        )  # fmt: skip
    return traces


def coordinate_look(system: MechanicalSystem, which: Coordinate) -> tuple[str, str | None]:
    """Colour and symbol of a coordinate: a screen's own, else those of its place among all."""
    if isinstance(which, str) and which in LABELS:
        return which, SYMBOLS.get(which)
    index = list(system.coordinates).index(which) if isinstance(which, str) else which
    # A colour that comes again has another symbol.
    return case_colour(index), case_symbol(index + index // CASES)


def curve_traces(
    name: str, curve: Curve, y: Real, *, colour: str, symbol: str | None, bold: bool,
    legend: bool = True, unit: str = "rpm",
) -> Iterator[Trace]:  # fmt: skip
    """One trace for each run of equal stability; the first stands in the legend."""
    for stability, run in curve.runs():
        omega = curve.omega[run]
        yield Trace(
            name, omega * SPEEDS[unit], y[run], stability, colour,  # type: ignore[arg-type]
            symbol=symbol if stability == "stable" else None, bold=bold, legend=legend,
            x_also=tuple((u, omega * scale) for u, scale in SPEEDS.items() if u != unit),
        )  # fmt: skip
        legend = False


def underlay(branch: Branch, which: Coordinate) -> Iterator[Trace]:
    """The periodic motions that what is reached in time is laid over."""
    curve = Curve.of(branch, which)
    return curve_traces(
        "periodic motions", curve, curve.amplitude * MM, colour="relative", symbol=None, bold=False
    )


def stability_key(traces: Sequence[Trace]) -> Iterator[Trace]:
    """Entries of the legend that say what dashed and dotted lines are, where there are any."""
    for role in ("unstable", "undetermined"):
        if any(trace.role == role for trace in traces):
            yield Trace(role, NOWHERE, NOWHERE, role, "gap")


def special_point_traces(branches: Sequence[Branch], which: Coordinate) -> Iterator[Trace]:
    """Marks at special points of branches, one entry of the legend for each kind."""
    called = [(mark_of(branch, one), one) for branch in branches for one in branch.special_points]
    for word, symbol in dict.fromkeys(mark for mark, _ in called):
        points = [point for mark, point in called if mark == (word, symbol)]
        omega = np.array([point.omega for point in points])
        yield Trace(
            word, omega * RPM,
            np.array([point.amplitude(which) for point in points]) * MM, "point", "jump",
            symbol=symbol, x_also=(("Hz", omega * HZ), ("rad/s", omega)),
        )  # fmt: skip


def mark_of(branch: Branch | FieldBranch, point: SpecialPoint) -> tuple[str, str]:
    """Word and symbol of a special point; a fold between two unstable motions is no jump."""
    if point.kind == "fold" and not is_jump(branch, point):
        return UNSTABLE_FOLD, "diamond-open"
    return KIND_WORDS.get(point.kind, point.kind), KIND_SYMBOLS.get(point.kind, "square-open")


def _cases_panel(
    assessment: Assessment,
    names: Sequence[str],
    curves: Sequence[Curve],
    near: tuple[float, float] | None,
) -> Panel:
    """All load cases over the whole range, or over ``near`` (rad/s) only."""
    drawn = [curve if near is None else _within(curve, near) for curve in curves]
    first = near is not None or near_range(assessment) is None
    traces = [t for t in (_case_band(curves, near, legend=first),) if t is not None]
    for k, (name, curve) in enumerate(zip(names, drawn, strict=True)):
        colour, symbol = case_look(k, len(names))
        traces += curve_traces(
            name, curve, curve.amplitude * MM, colour=colour, symbol=symbol, bold=k == 0,
            legend=first,
        )  # fmt: skip
    jumps = curves[0].jumps() if near is None else ()
    limits = assessment.project.limits.relative_amplitude or ()
    top = max((float(curve.amplitude.max()) for curve in drawn), default=0.0)
    words = ("least", "most") if near is not None else ("", "")
    bounds = None if near is None else (near[0] * RPM, near[1] * RPM)
    return Panel(
        speed_axis(curves[0].omega, bounds),
        Axis("amplitude (|x2|)", "mm", (0.0, 1.08 * MM * max(top, *limits, 0.0))),
        traces=tuple(traces),
        bands=tuple(Band("x", a * RPM, b * RPM) for a, b in assessment.region.feasible),
        lines=(
            *_working(assessment.omega, text=near is not None),
            *_jump_lines(jumps, brief=True),
            *(
                Line(
                    "y",
                    limit * MM,
                    f"{word} {limit * MM:.3g} mm" if word else "",
                    text_at=at,
                    under=word == "least",
                )
                for limit, word, at in zip(limits, words, (1.0, 0.0), strict=False)
            ),
        ),
        arrows=_arrows(jumps),
    )


def _case_band(
    curves: Sequence[Curve], near: tuple[float, float] | None, *, legend: bool
) -> Trace | None:
    """Area between the least and the greatest amplitude of all cases, as the speed rises."""
    if len(curves) < 2:
        return None
    low = max(float(curve.omega.min()) for curve in curves)
    high = min(float(curve.omega.max()) for curve in curves)
    grid = np.linspace(*(near or (low, high)), BAND_POINTS)
    values = np.array([np.interp(grid, *curve.from_below()) for curve in curves]) * MM
    return Trace(
        "band of load cases", grid * RPM, values.max(axis=0), "case band", "case band",
        legend=legend, lower=values.min(axis=0),
    )  # fmt: skip


def _within(curve: Curve, near: tuple[float, float]) -> Curve:
    """The part of a curve in a range, its neighbours outside included so that lines reach it."""
    inside = (curve.omega >= near[0]) & (curve.omega <= near[1])
    keep = inside.copy()
    keep[1:] |= inside[:-1]
    keep[:-1] |= inside[1:]
    return curve.part(keep)


def _working(omega: float | None, *, text: bool = True) -> tuple[Line, ...]:
    if omega is None:
        return ()
    return (Line("x", omega * RPM, f"{rpm(omega)} rpm" if text else "", "speed", "dashdot"),)


def _arrows(jumps: Sequence[Jump]) -> tuple[Arrow, ...]:
    return tuple(Arrow(j.omega * RPM, j.start * MM, j.omega * RPM, j.end * MM) for j in jumps)


def _jump_lines(jumps: Sequence[Jump], *, brief: bool = False) -> tuple[Line, ...]:
    """The jump speeds, labelled above the panel."""
    words = {True: "" if brief else "jump (rising) ", False: "" if brief else "jump (falling) "}
    return tuple(
        Line("x", j.omega * RPM, f"{words[j.rising_speed]}{rpm(j.omega)} rpm", "mark")
        for j in jumps
    )


def quantity_label(quantity: str, which: Coordinate | None) -> str:
    """A quantity for an axis, and the coordinate where only one is drawn."""
    return quantity if which is None else f"{quantity}, {label(which)}"


def _amplitude_axis(curves: Sequence[Curve], which: Coordinate | None = None) -> Axis:
    """Amplitude in mm from 0."""
    top = max(float(curve.amplitude.max()) for curve in curves) * MM
    bounds = 0.0, 1.08 * top if top > 0.0 and math.isfinite(top) else 1.0
    return Axis(quantity_label("amplitude", which), "mm", bounds)


def _phase_axis(curves: Sequence[Curve], which: Coordinate | None = None) -> Axis:
    """Phase in degrees, ticked at quarters or halves of a turn."""
    phases = np.concatenate([curve.phase[np.isfinite(curve.phase)] for curve in curves])
    low, high = (phases.min() * DEGREES, phases.max() * DEGREES) if phases.size else (-180.0, 0.0)
    step = 90.0 if high - low < 600.0 else 180.0
    first, last = math.floor(low / step + 0.1), math.ceil(high / step - 0.1)
    ticks = tuple((k * step, f"{k * step:.0f}".replace("-", MINUS)) for k in range(first, last + 1))
    margin = 0.04 * (high - low)
    bounds = (min(low - margin, first * step), max(high + margin, last * step))
    return Axis(quantity_label("phase", which), "deg", bounds, ticks)
