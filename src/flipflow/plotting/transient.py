"""Start and coast-down over time: speed, amplitudes, torque or force on the foundation."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Real
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.system import Coordinate
from flipflow.plotting.figure import Figure
from flipflow.plotting.palette import case_colour, case_symbol
from flipflow.plotting.panels import Axis, Line, Panel, Trace
from flipflow.plotting.response import LABELS, SYMBOLS, coordinates, label
from flipflow.plotting.scales import KN, MM, RPM
from flipflow.transient.run_up import RunUp, foundation_force
from flipflow.transient.speed_run import behind_first_turn, turn_amplitudes

MOST_POINTS = 1500
READING = (
    "Amplitude is half the way from peak to peak in one turn of the shaft; w01 is the first "
    "natural frequency."
)
HEADROOM = 1.08


def run_up_figure(run: RunUp) -> Figure:
    """Speed, amplitudes and torque of a start or a coast-down, over time.

    Parameters
    ----------
    run
        What :func:`flipflow.start_up` or :func:`flipflow.coast_down` returns.

    Returns
    -------
    Figure
        Panels one below the other, over seconds; torque where a motor turns the shaft, else the
        force on the foundation.
    """
    panels = _panels(run)
    caption = f"The machine {run.verdict}. {READING}"
    return Figure(_title(run), caption, panels, height=60 + 170 * len(panels))


def run_ups_figure(runs: Sequence[RunUp]) -> Figure:
    """Start and coast-down of a screen side by side, each with the panels of its own figure.

    Parameters
    ----------
    runs
        What :func:`flipflow.start_up` and :func:`flipflow.coast_down` return.

    Returns
    -------
    Figure
        A column for each run.
    """
    columns = [_panels(run) for run in runs]
    columns = [
        (dataclasses.replace(first, title=_title(run)), *others)
        for run, (first, *others) in zip(runs, columns, strict=True)
    ]
    panels = tuple(panel for row in zip(*columns, strict=True) for panel in row)
    title = " and ".join(_title(run).lower() for run in runs).capitalize()
    return Figure(title, READING, panels, len(runs), height=80 + 140 * len(columns[0]))


def _panels(run: RunUp) -> tuple[Panel, ...]:
    time = Axis("time", "s", (0.0, run.duration))
    panels = (_speed(run, time), _amplitudes(run, time))
    if run.history.torque is not None and np.any(run.history.torque):
        return (*panels, _torque(run, time))
    if isinstance(run.machine, FlipFlowScreen):
        return (*panels, _foundation(run, run.machine, time))
    return panels


def _title(run: RunUp) -> str:
    return "Coast-down" if _falls(run) else "Start"


def _falls(run: RunUp) -> bool:
    """Whether the speed comes down: a start that fails may end a little below 0, still swinging."""
    return bool(run.history.omega[0] > max(run.history.omega[-1], 0.0))


def _speed(run: RunUp, time: Axis) -> Panel:
    t, omega = _thinned(run.history.t, run.history.omega * RPM)
    marks = (
        (run.first_frequency * RPM, "w01", "mark"),
        (run.speed * RPM, "running speed" if _falls(run) else "working speed", "speed"),
    )
    # The label of the working speed stands where the speed is not yet, or no longer, near it.
    flush = 1.0 if _falls(run) else 0.0
    top = 1.2 * max(float(omega.max()), *(at for at, _, _ in marks))
    return Panel(
        time, Axis("shaft speed", "rpm", (min(0.0, float(omega.min())), top)),
        traces=(Trace("shaft speed", t, omega, colour="relative", legend=False),),
        lines=tuple(Line("y", at, text, colour, text_at=flush) for at, text, colour in marks),
    )  # fmt: skip


def _amplitudes(run: RunUp, time: Axis) -> Panel:
    traces = []
    for index, which in enumerate(_shown(run)):
        t, size = turn_amplitudes(run.history, which)
        if run.history.omega[0] > 0.0:  # it begins in motion, of which the first turn has a part
            whole = behind_first_turn(run.history, t)
            t, size = t[whole], size[whole]
        t, size = _envelope(t, size * MM)
        known = isinstance(which, str) and which in LABELS
        traces.append(
            Trace(
                label(which), t, size, colour=str(which) if known else case_colour(index),
                symbol=SYMBOLS.get(str(which)) if known else case_symbol(index),
                bold=which == "relative",
            )
        )  # fmt: skip
    top = max((float(trace.y.max()) for trace in traces if trace.y.size), default=1.0)
    return Panel(time, Axis("amplitude", "mm", (0.0, HEADROOM * top)), tuple(traces))


def _torque(run: RunUp, time: Axis) -> Panel:
    history = run.history
    torque = np.zeros(0) if history.torque is None else history.torque
    t, values = _thinned(history.t, torque)
    low = min(0.0, float(values.min()))
    return Panel(
        time, Axis("torque at the shaft", "N m", (low, HEADROOM * float(values.max()))),
        traces=(Trace("torque at the shaft", t, values, colour="input", legend=False),),
    )  # fmt: skip


def _foundation(run: RunUp, screen: FlipFlowScreen, time: Axis) -> Panel:
    t, force = _greatest_of_turns(run, foundation_force(screen, run.history) * KN)
    return Panel(
        time, Axis("foundation force", "kN", (0.0, HEADROOM * float(force.max(initial=1e-9)))),
        traces=(Trace("foundation force", t, force, colour="isolation", legend=False),),
    )  # fmt: skip


def _shown(run: RunUp) -> tuple[Coordinate, ...]:
    if isinstance(run.machine, FlipFlowScreen):
        return ("main", "relative")
    return coordinates(run.history.system)


def _thinned(t: Real, values: Real) -> tuple[Real, Real]:
    rows = np.unique(np.linspace(0, t.size - 1, MOST_POINTS).round().astype(int))
    return t[rows], values[rows]


def _greatest_of_turns(run: RunUp, values: Real) -> tuple[Real, Real]:
    """The greatest value of each turn of the shaft, and when it was; thinned by the greatest."""
    turns = np.floor(run.history.angle / (2.0 * np.pi))
    starts = np.flatnonzero(np.diff(turns, prepend=turns[0] - 1.0))
    rows = _largest_rows(values, starts)
    return _envelope(run.history.t[rows], values[rows])


def _envelope(t: Real, values: Real) -> tuple[Real, Real]:
    """The greatest value of each of many short spans: thinned without losing a peak."""
    if t.size <= MOST_POINTS:
        return t, values
    starts = np.linspace(0, t.size, MOST_POINTS, endpoint=False).astype(int)
    rows = _largest_rows(values, starts)
    return t[rows], values[rows]


def _largest_rows(values: Real, starts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Row of the greatest value of each span."""
    ends = [*starts[1:], values.size]
    return np.array([a + int(values[a:b].argmax()) for a, b in zip(starts, ends, strict=True)])
