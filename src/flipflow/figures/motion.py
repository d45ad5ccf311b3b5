"""Motions in time: relative motion over two turns, phase portrait, x-y orbits of the frames."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flipflow.analyses.assessment import Assessment, CaseAssessment
from flipflow.figures.palette import case_colour, case_symbol
from flipflow.figures.parts import Axis, Band, Figure, Line, Panel, Trace
from flipflow.figures.response import coordinates, label
from flipflow.figures.scales import MM, RPM
from flipflow.model.elements import ClearanceSpring
from flipflow.model.system import Coordinate
from flipflow.results.orbit import Orbit

Real = NDArray[np.float64]
TURNS = 2
POINTS = 181
TICKS = tuple((90.0 * k, f"{90 * k}") for k in range(0, 4 * TURNS + 1, 2))
CONTACT_WORDS = (
    "Shaded: the stop is touched; dark on the plus side (x2 > 0), light on the minus side."
)
NO_CONTACT = "The stop is not reached."
PORTRAIT = "Velocity over displacement of the relative motion: one closed loop a turn."


def orbit_figure(orbit: Orbit) -> Figure:
    """Relative motion over two turns and its phase portrait, for one motion.

    Parameters
    ----------
    orbit
        A periodic motion.

    Returns
    -------
    Figure
        Two panels side by side.
    """
    which = _across(orbit)
    touched = bool(orbit.contact_intervals)
    caption = f"{CONTACT_WORDS if touched else NO_CONTACT} {PORTRAIT}"
    title = f"Motion at {orbit.omega * RPM:.4g} rpm"
    name = label(which)
    panels = (
        Panel(
            _shaft(), Axis(f"{name} displacement", "mm"), (_in_time(orbit, which, name),),
            bands=tuple(contact_bands(orbit)), lines=gap_lines(orbit),
        ),
        Panel(
            Axis(f"{name} displacement", "mm"), Axis("velocity", "m/s"),
            (_loop(orbit, which, name),), lines=gap_lines(orbit, "x", text=False),
        ),
    )  # fmt: skip
    return Figure(title, caption, panels, columns=2, height=300, shares=(0.6, 0.4))


def two_turns_figure(assessment: Assessment) -> Figure | None:
    """Relative motion of all load cases over two turns; contact of the first case shaded."""
    found = _with_motion(assessment)
    if not found:
        return None
    traces = tuple(_in_time(orbit, "relative", case.name, k) for k, case, orbit in found)
    _, case, orbit = found[0]
    said = f"The stop is not reached in case {case.name}."
    if case.stop_reached:
        share = 100.0 * orbit.contact_share()
        said = f"{CONTACT_WORDS} Case {case.name}, {share:.3g} % of the turn."
    panel = Panel(
        _shaft(), Axis("relative displacement (x2)", "mm"), traces,
        bands=tuple(contact_bands(orbit)), lines=gap_lines(orbit),
    )  # fmt: skip
    return Figure("Relative motion over two turns", said, (panel,), height=270)


def portrait_figure(assessment: Assessment) -> Figure | None:
    """Phase portrait of the relative motion, all load cases."""
    found = _with_motion(assessment)
    if not found:
        return None
    traces = tuple(_loop(orbit, "relative", case.name, k) for k, case, orbit in found)
    panel = Panel(
        Axis("relative displacement (x2)", "mm"), Axis("relative velocity (x2')", "m/s"), traces,
        lines=gap_lines(found[0][2], "x"),
    )  # fmt: skip
    caption = (
        f"{PORTRAIT} Beyond the gap per side (e) the stop bends the loop; a loop that closes "
        "after one turn means that every turn is like the last."
    )
    return Figure("Phase portrait", caption, (panel,), height=380)


def orbits_figure(assessment: Assessment) -> Figure | None:
    """Paths of both frames in the x-y plane at true scale, one panel for each load case."""
    found = [(case, orbit) for _, case, orbit in _with_motion(assessment) if case.normal]
    if not found:
        return None
    reach = 1.08 * max(float(np.abs(v).max()) for c, o in found for v in _paths(c, o).values())
    columns = 4 if len(found) == 4 or len(found) > 6 else 3
    panels = tuple(
        _orbit_panel(case, orbit, reach, first=k == 0, left=k % columns == 0)
        for k, (case, orbit) in enumerate(found)
    )
    rows = math.ceil(len(panels) / columns)
    caption = (
        "Path of each frame in one turn, x along the screen surface and y normal to it, the same "
        "scale on both axes. Dot: where the frame is when the unbalance points along x."
    )
    height = 84 + rows * (580 // columns) + (rows - 1) * 71
    return Figure("Orbits of both frames", caption, panels, columns=columns, height=height)


def contact_bands(orbit: Orbit, spring: int = 0) -> Iterator[Band]:
    """Strips over the shaft angle in degrees in which a stop is touched."""
    turn = 360.0 / orbit.period * orbit.periods
    for touch in orbit.contact_intervals:
        if touch.spring != spring:
            continue
        role = "contact" if touch.side > 0 else "contact minus"
        for k in range(-1, TURNS):
            low = max(touch.start * turn + 360.0 * k * orbit.periods, 0.0)
            high = min(touch.end * turn + 360.0 * k * orbit.periods, 360.0 * TURNS)
            if low < high:
                yield Band("x", low, high, role)  # type: ignore[arg-type]


def gap_lines(
    orbit: Orbit, axis: Literal["x", "y"] = "y", *, text: bool = True
) -> tuple[Line, ...]:
    """Lines at the gap on both sides of the first stop."""
    stop = _stop(orbit)
    if stop is None:
        return ()
    plus, minus = stop.gaps
    moving = orbit.displacement(_across(orbit))[:-1]
    # The label of a gap stands where the motion is at the other side, so that no line covers it.
    ends = ((plus, "gap (e)", moving.argmin()), (-minus, "gap (-e)", moving.argmax()))
    return tuple(
        Line(axis, at * MM, word if text else "", "gap", text_at=_free(place / moving.size))
        for at, word, place in ends
        if math.isfinite(at)
    )


def _free(share: float) -> float:
    """Share of the panel's width for a moment of the turn, the turn chosen away from the edge."""
    return share / TURNS if share > 0.15 else (1.0 + share) / TURNS


def _stop(orbit: Orbit) -> ClearanceSpring | None:
    return orbit.system.springs[0] if orbit.system.springs else None


def _across(orbit: Orbit) -> Coordinate:
    """The coordinate across the stop where it has a name, or the last one there is."""
    return coordinates(orbit.system)[-1]


def _with_motion(assessment: Assessment) -> Sequence[tuple[int, CaseAssessment, Orbit]]:
    return [(k, c, c.orbit) for k, c in enumerate(assessment.cases) if c.orbit is not None]


def _shaft() -> Axis:
    return Axis("shaft angle", "deg", (0.0, 360.0 * TURNS), TICKS)


def _in_time(orbit: Orbit, which: Coordinate, name: str, index: int = 0) -> Trace:
    angle = np.linspace(0.0, 360.0 * TURNS, TURNS * POINTS)
    t = np.radians(angle) / orbit.omega
    return Trace(
        name, angle, orbit.displacement(which, t) * MM, "motion", case_colour(index),
        symbol=case_symbol(index), bold=index == 0,
    )  # fmt: skip


def _loop(orbit: Orbit, which: Coordinate, name: str, index: int = 0) -> Trace:
    t = np.linspace(0.0, orbit.period, POINTS * orbit.periods)
    return Trace(
        name, orbit.displacement(which, t) * MM, orbit.velocity(which, t), "motion",
        case_colour(index), symbol=case_symbol(index), bold=index == 0,
    )  # fmt: skip


def _paths(case: CaseAssessment, orbit: Orbit) -> dict[str, Real]:
    t = np.linspace(0.0, orbit.period, POINTS)
    y = case.normal.displacement(t) if case.normal is not None else np.zeros_like(t)
    return {name: np.array([orbit.displacement(name, t), y]) * MM for name in ("main", "floating")}


def _orbit_panel(
    case: CaseAssessment, orbit: Orbit, reach: float, *, first: bool, left: bool
) -> Panel:
    traces = []
    for name, (x, y) in _paths(case, orbit).items():
        start = (x[:1], y[:1])
        traces += [
            Trace(label(name), x, y, "motion", name, bold=name == "main", legend=first),
            Trace(label(name), *start, "point", name, symbol="circle", legend=False),
        ]
    axis = Axis("x", "mm", (-reach, reach))
    across = Axis("y" if left else "", "mm" if left else "", (-reach, reach))
    return Panel(axis, across, tuple(traces), title=case.name, equal=True)
