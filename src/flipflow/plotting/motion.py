"""Motions in time: relative motion over two turns, phase portrait, x-y orbits of the frames."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np

from flipflow.model.elements import ClearanceSpring
from flipflow.model.numerals import case_words
from flipflow.model.system import Coordinate
from flipflow.periodic.orbit import Orbit
from flipflow.plotting.figure import Figure
from flipflow.plotting.layout import within
from flipflow.plotting.panels import Axis, Band, Line, Panel, Trace
from flipflow.plotting.response import case_look, case_names, coordinates, label
from flipflow.plotting.scales import MM
from flipflow.plotting.units import length_of, speed_of
from flipflow.studies.assessment import Assessment, CaseAssessment

Found = Sequence[tuple[int, CaseAssessment, Orbit]]
TURNS = 2
POINTS = 181
MOTION_HEIGHT = 186
ORBIT_WIDTH, ORBIT_HEIGHTS, ORBIT_WORDS = 277.0, (60.0, 140.0), 71.0
PAGE_ROOM, TITLE_LETTERS = 980.0, 48  # pixels of a page for a figure; letters over a panel
MARGIN, BESIDE = 1.08, 1.5  # round a portrait; a gap within this of its width is shown
TICKS = tuple((90.0 * k, f"{90 * k}") for k in range(0, 4 * TURNS + 1, 2))
CONTACT_WORDS = "Shaded: a stop is touched; dark on the plus side, light on the minus side."
NO_CONTACT, NO_STOP = "The stop is not reached.", "The machine has no stop."
ORBITS = (
    "Orbit: path of a frame in one turn, both axes at the same scale; dot: where it is when the "
    "unbalance points along x."
)
PORTRAIT = "Velocity over displacement of the relative motion: one closed loop a turn."
ANY_PORTRAIT = "Velocity over displacement: one closed loop a turn."


def orbit_figure(orbit: Orbit, which: Coordinate | None = None) -> Figure:
    """Relative motion over two turns and its phase portrait, for one motion.

    Parameters
    ----------
    orbit
        A periodic motion.
    which
        The coordinate; None: the one across the stop.

    Returns
    -------
    Figure
        Two panels side by side.
    """
    (chosen,) = (_across(orbit),) if which is None else coordinates(orbit.system, which)
    lines = gap_lines(orbit) if chosen == _across(orbit) else ()
    touched = bool(orbit.contact_intervals)
    said = CONTACT_WORDS if touched else NO_CONTACT if _stops(orbit) else NO_STOP
    caption = f"{said} {_portrait(chosen)}"
    title = f"Motion at {speed_of(orbit, orbit.omega)}"
    name = label(chosen)
    panels = (
        Panel(
            _shaft(), Axis(name, "mm"), (_in_time(orbit, chosen, name),),
            bands=tuple(contact_bands(orbit)), lines=lines,
        ),
        Panel(
            Axis(f"{name} displacement", "mm"), Axis("velocity", "m/s"),
            (_loop(orbit, chosen, name),),
            lines=gap_lines(orbit, "x", text=False) if lines else (),
        ),
    )  # fmt: skip
    return Figure(title, caption, panels, columns=2, height=300, shares=(0.6, 0.4))


def orbits_in_time_figure(orbits: Sequence[Orbit], which: Coordinate | None = None) -> Figure:
    """Coexisting motions over their turns, and their phase portraits."""
    (chosen,) = (_across(orbits[0]),) if which is None else coordinates(orbits[0].system, which)
    words = [
        f"{length_of(orbit, orbit.amplitude(chosen), 4)}, {orbit.stability}" for orbit in orbits
    ]
    pairs = list(enumerate(zip(orbits, words, strict=True)))
    panels = (
        Panel(
            _shaft(), Axis(label(chosen), "mm"),
            tuple(_in_time(orbit, chosen, word, k) for k, (orbit, word) in pairs),
        ),
        Panel(
            Axis(f"{label(chosen)} displacement", "mm"), Axis("velocity", "m/s"),
            tuple(_loop(orbit, chosen, word, k) for k, (orbit, word) in pairs),
        ),
    )  # fmt: skip
    title = f"Motions at {speed_of(orbits, orbits[0].omega)}"
    return Figure(title, _portrait(chosen), panels, columns=2, height=340, shares=(0.6, 0.4))


def _portrait(chosen: Coordinate) -> str:
    """What a phase portrait of a coordinate shows; its axis has the name."""
    return PORTRAIT if chosen == "relative" else ANY_PORTRAIT


def motions_figure(assessment: Assessment) -> Figure | None:
    """Orbits of both frames beside two turns of relative motion, all load cases.

    The first case is drawn bold, and its contact is shaded. Without the normal direction there
    are no orbits.
    """
    found = _with_motion(assessment)
    if not found:
        return None
    _, case, orbit = found[0]
    traces = tuple(
        _in_time(o, "relative", c.name, k, len(found), legend=False) for k, c, o in found
    )
    turns = Panel(
        _shaft(), Axis("relative motion (x2)", "mm"), traces,
        bands=tuple(contact_bands(orbit)), lines=gap_lines(orbit),
    )  # fmt: skip
    said = (
        f"The stop is not reached in {case_words(case.name)}." if case.screen.has_stop else NO_STOP
    )
    if case.stop_reached:
        said = f"Shaded: the stop is touched, {_shares_of_turn(orbit)} ({case_words(case.name)})."
    orbits = _orbits(found)
    if orbits is None:
        return Figure("Relative motion over two turns", said, (turns,), height=MOTION_HEIGHT)
    return Figure(
        "Orbits of both frames at true scale; relative motion over two turns",
        f"Dot: the unbalance points along x. {said}", (orbits, turns), 2, MOTION_HEIGHT,
        _shares(orbits),
    )  # fmt: skip


def portrait_figure(assessment: Assessment) -> Figure | None:
    """Phase portrait of the relative motion, all load cases."""
    found = _with_motion(assessment)
    if not found:
        return None
    names = case_names([case.name for _, case, _ in found])
    traces = tuple(
        _loop(orbit, "relative", name, k, len(found))
        for name, (k, _, orbit) in zip(names, found, strict=True)
    )
    width = MARGIN * max(float(np.abs(trace.x).max()) for trace in traces)
    height = MARGIN * max(float(np.abs(trace.y).max()) for trace in traces)
    lines = gap_lines(found[0][2], "x")
    near = [abs(line.at) for line in lines if abs(line.at) < BESIDE * width]
    width = max(width, *(MARGIN * at for at in near), 0.0)
    panel = Panel(
        Axis("relative displacement (x2)", "mm", (-width, width)),
        Axis("relative velocity (x2')", "m/s", (-height, height)),
        traces,
        lines=tuple(line for line in lines if abs(line.at) < width),
    )
    bent = " Beyond the gap per side (e) the stop bends the loop." if lines else ""
    caption = (
        f"{PORTRAIT}{bent} A loop that closes after one turn means that every turn is like the "
        "last."
    )
    return Figure("Phase portrait", caption, (panel,), height=380)


def orbits_figures(assessment: Assessment) -> tuple[Figure, ...]:
    """Paths of both frames in the x-y plane at true scale, one panel for each load case.

    Each figure fits a page; without the normal direction there is none.
    """
    found = [one for one in _with_motion(assessment) if one[1].normal is not None]
    whole = _orbits(found)
    if whole is None:
        return ()
    columns = 2
    # At true scale the orbits are only as high as this; the rest of a row is for words.
    orbit = min(max(ORBIT_WIDTH * _height_over_width(whole), ORBIT_HEIGHTS[0]), ORBIT_HEIGHTS[1])
    row = ORBIT_WORDS + orbit
    count = columns * int(PAGE_ROOM / row)
    figures = []
    for first in range(0, len(found), count):
        some = found[first : first + count]
        panels = tuple(
            Panel(
                whole.x, whole.y, tuple(_paths([one], legend=k == 0)), equal=True,
                title=within(one[1].name, TITLE_LETTERS),
            )
            for k, one in enumerate(some)
        )  # fmt: skip
        title = "Orbits of both frames" + (", continued" if first else "")
        height = 12 + round(row * math.ceil(len(panels) / columns))
        figures.append(Figure(title, ORBITS, panels, columns, height))
    return tuple(figures)


def contact_bands(orbit: Orbit) -> Iterator[Band]:
    """Strips over the shaft angle in degrees in which a stop is touched, on either side."""
    turn = 360.0 / orbit.period * orbit.periods
    along = {number: sign for number, (sign, _) in _stops(orbit).items()}
    for touch in orbit.contact_intervals:
        plus = touch.side * (along[touch.spring] or 1) > 0
        role = "contact" if plus else "contact minus"
        for k in range(-1, TURNS):
            low = max(touch.start * turn + 360.0 * k * orbit.periods, 0.0)
            high = min(touch.end * turn + 360.0 * k * orbit.periods, 360.0 * TURNS)
            if low < high:
                yield Band("x", low, high, role)  # type: ignore[arg-type]


def gap_lines(
    orbit: Orbit, axis: Literal["x", "y"] = "y", *, text: bool = True
) -> tuple[Line, ...]:
    """Lines at every gap of the stops across the coordinate drawn, on both sides."""
    moving = orbit.displacement(_across(orbit))[:-1]
    # The label of a gap stands where the motion is at the other side, so that no line covers it.
    free = {1: _free(moving.argmin() / moving.size), -1: _free(moving.argmax() / moving.size)}
    places = dict.fromkeys(
        (sign * side * gap, _gap_word(stop, side), sign * side)
        for sign, stop in _stops(orbit).values()
        for side, gap in zip((1, -1), stop.gaps, strict=True)
        if sign and math.isfinite(gap)
    )
    return tuple(
        Line(axis, at * MM, word if text else "", "gap", text_at=free[side])
        for at, word, side in places
    )


def _gap_word(stop: ClearanceSpring, side: int) -> str:
    plus, minus = stop.gaps
    mark = "" if plus == minus else "+" if side > 0 else "-"
    return f"gap ({'' if side > 0 else '-'}e{mark})"


def _shares_of_turn(orbit: Orbit) -> str:
    """Share of the turn in contact; side by side where the gaps differ."""
    if orbit.system.symmetric:
        share = 100.0 * orbit.contact_share()
        return f"{share:.3g} % of the turn; dark on the plus side, light on the minus side"
    touches = orbit.contact_intervals
    plus, minus = (
        100.0 * sum(t.end - t.start for t in touches if t.side == side) / orbit.period
        for side in (1, -1)
    )
    return (
        f"{plus:.3g} % of the turn on the plus side (dark), {minus:.3g} % on the minus side (light)"
    )


def _free(share: float) -> float:
    """Share of the panel's width for a moment of the turn, the turn chosen away from the edge."""
    return share / TURNS if share > 0.15 else (1.0 + share) / TURNS


def _stops(orbit: Orbit) -> dict[int, tuple[int, ClearanceSpring]]:
    """Every stop with a gap by number, and its sign along the coordinate drawn, or 0."""
    drawn = orbit.system.coordinate(_across(orbit))
    return {
        number: (next((s for s in (1, -1) if np.allclose(s * drawn, stop.direction)), 0), stop)
        for number, stop in enumerate(orbit.machine.system().springs)
        if stop.opens
    }


def _across(orbit: Orbit) -> Coordinate:
    """The coordinate across the stop where it has a name, or the last one there is."""
    return coordinates(orbit.system)[-1]


def _with_motion(assessment: Assessment) -> Found:
    return [(k, c, c.orbit) for k, c in enumerate(assessment.cases) if c.orbit is not None]


def _shaft() -> Axis:
    return Axis("shaft angle", "deg", (0.0, 360.0 * TURNS), TICKS)


def _in_time(
    orbit: Orbit, which: Coordinate, name: str, index: int = 0, count: int = 1, *,
    legend: bool = True,
) -> Trace:  # fmt: skip
    angle = np.linspace(0.0, 360.0 * TURNS, TURNS * POINTS)
    t = np.radians(angle) / orbit.omega
    colour, symbol = case_look(index, count)
    return Trace(
        name, angle, orbit.displacement(which, t) * MM, "motion", colour, symbol=symbol,
        bold=index == 0, legend=legend,
    )  # fmt: skip


def _loop(orbit: Orbit, which: Coordinate, name: str, index: int = 0, count: int = 1) -> Trace:
    colour, symbol = case_look(index, count)
    t = np.linspace(0.0, orbit.period, POINTS * orbit.periods)
    return Trace(
        name, orbit.displacement(which, t) * MM, orbit.velocity(which, t), "motion",
        colour, symbol=symbol, bold=index == 0,
    )  # fmt: skip


def _orbits(found: Found) -> Panel | None:
    """Orbits of all load cases in one panel; None without the normal direction."""
    traces = tuple(_paths(found, legend=True))
    if not traces:
        return None
    x = 1.1 * max(float(np.abs(trace.x).max()) for trace in traces)
    y = 1.1 * max(float(np.abs(trace.y).max()) for trace in traces)
    return Panel(
        Axis("x, along the surface", "mm", (-x, x)), Axis("y, normal", "mm", (-y, y)), traces,
        equal=True,
    )  # fmt: skip


def _paths(found: Found, *, legend: bool) -> Iterator[Trace]:
    """Both frames of each case, the first bold, with a dot at shaft angle 0."""
    for k, case, orbit in found:
        if case.normal is None:
            continue
        t = np.linspace(0.0, orbit.period, POINTS * orbit.periods)
        y = case.normal.displacement(t) * MM
        first = k == found[0][0]
        for name in ("floating", "main"):
            x = orbit.displacement(name, t) * MM
            symbol = None if first else case_look(k, len(found))[1]
            yield Trace(
                label(name), x, y, "motion", name, symbol, bold=first, legend=legend and first,
                dash="dashdot" if name == "floating" else "",
            )  # fmt: skip
            if first:
                dot = (x[:1], y[:1])
                yield Trace(label(name), *dot, "point", name, symbol="circle", legend=False)


def _shares(orbits: Panel) -> tuple[float, float]:
    """Widths of the columns such that the orbits fill their panel at true scale."""
    room, chrome = 545.0, 66.0
    share = (MOTION_HEIGHT - chrome) / _height_over_width(orbits) / room
    share = min(max(share, 0.2), 0.55)
    return share, 1.0 - share


def _height_over_width(orbits: Panel) -> float:
    if orbits.x.bounds is None or orbits.y.bounds is None:
        return 1.0
    return orbits.y.bounds[1] / orbits.x.bounds[1]
