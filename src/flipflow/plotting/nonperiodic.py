"""Motions that need not repeat: sections, spectra, bifurcation diagrams, Lyapunov exponents."""

from __future__ import annotations

import math

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.model.screen import unit_in
from flipflow.model.system import Coordinate
from flipflow.plotting.branches import field_axis
from flipflow.plotting.figure import Figure
from flipflow.plotting.palette import case_colour, case_symbol
from flipflow.plotting.panels import Axis, Band, Line, Panel, Trace, decade_ticks
from flipflow.plotting.response import coordinates, label, speed_axis
from flipflow.plotting.scales import HZ, MINUS, MM, RPM
from flipflow.studies.bifurcation_diagram import BifurcationDiagram, Direction
from flipflow.studies.lyapunov import LyapunovExponents
from flipflow.studies.poincare import Section, Spectrum

MOST_HARMONICS = 6.0
DECADES = 6.0
LEAST_SPAN = 0.02  # on either side of points that coincide, as a share of their value
DRAWN: tuple[tuple[Direction, str, str, str], ...] = (
    ("up", "rising", "main", "circle"), ("down", "falling", "floating", "square"),
)  # fmt: skip
MOST_SHOWN = 6  # exponents that are drawn


def section_figure(section: Section, which: Coordinate | None = None) -> Figure:
    """Velocity over displacement of every coordinate, one point a forcing period."""
    panels = []
    for name in coordinates(section.system, which):
        x, v = section.displacement(name) * MM, section.velocity(name)
        points = Trace("once a turn", x, v, "point", symbol="circle", legend=False)
        across, upwards = Axis(label(name), "mm", _around(x)), Axis("velocity", "m/s", _around(v))
        panels.append(Panel(across, upwards, (points,)))
    caption = (
        f"{section.states.shape[0]} turns, a point whenever the unbalance points along +x. A "
        "motion that repeats after n turns shows n points, one that never repeats "
        "shows closed curves."
    )
    columns = min(len(panels), 3)
    return Figure("Poincare section", caption, tuple(panels), columns=columns, height=260)


def _around(values: Real) -> tuple[float, float]:
    """Ends of an axis around points; those of a motion that repeats differ by rounding alone."""
    low, high = float(values.min()), float(values.max())
    margin = max(0.06 * (high - low), LEAST_SPAN * max(abs(low), abs(high))) or 1.0
    return low - margin, high + margin


def spectrum_figure(spectrum: Spectrum) -> Figure:
    """Amplitude over frequency, in decades, with the harmonics of the forcing marked."""
    shown = spectrum.frequencies <= MOST_HARMONICS * spectrum.omega
    amplitude = spectrum.amplitudes[shown] * MM
    top = float(amplitude.max())
    floor = top * 10.0**-DECADES
    level = np.log10(np.maximum(amplitude, floor))
    low, high = int(np.floor(np.log10(floor))), int(np.ceil(np.log10(top)))
    ticks = decade_ticks(low, high)
    frequency = spectrum.frequencies[shown] * HZ
    line = Trace(label(spectrum.which), frequency, level, legend=False)
    marks = tuple(
        Line("x", k * spectrum.omega * HZ, f"{k} w" if k > 1 else "w", "mark")
        for k in range(1, int(MOST_HARMONICS) + 1)
    )
    panel = Panel(
        Axis("frequency", "Hz", (0.0, float(frequency[-1]))),
        Axis(f"{label(spectrum.which)} amplitude", "mm", (float(low), float(high)), ticks, True),
        traces=(line,), lines=marks,
    )  # fmt: skip
    caption = "Amplitude of each harmonic part; w is the forcing frequency."
    return Figure("Spectrum", caption, (panel,), height=300)


def bifurcation_figure(diagram: BifurcationDiagram, which: Coordinate | None = None) -> Figure:
    """Displacement of every coordinate at the beginning of each forcing period."""
    over_omega = diagram.omega is None
    if over_omega:
        axis, scale = speed_axis(diagram.values), RPM
    else:
        axis, scale = field_axis(diagram.parameter, diagram.values)
    bands = tuple(
        Band("x", low * scale, high * scale, "contact minus") for low, high in diagram.hysteresis
    )
    panels = []
    for row, name in enumerate(coordinates(diagram.system, which)):
        traces = []
        for direction, word, colour, symbol in DRAWN:
            values, x = diagram.points(name, direction)
            also = (("Hz", values * HZ), ("rad/s", values)) if over_omega else ()
            if x.size:
                traces.append(
                    Trace(word, values * scale, x * MM, "point", colour, symbol,
                          legend=row == 0, bold=direction == "up", x_also=also)
                )  # fmt: skip
        panels.append(Panel(axis, Axis(label(name), "mm"), tuple(traces), bands=bands))
    caption = (
        "Points: displacement whenever the unbalance points along +x, of the motion settled to, "
        "each value reached from the one before. One point: the motion repeats after one turn; n "
        "points: after n turns; many: it does not repeat. Shaded: the two directions meet "
        "different motions."
    )
    return Figure("Bifurcation diagram", caption, tuple(panels), height=40 + 260 * len(panels))


def lyapunov_figure(result: LyapunovExponents) -> Figure:
    """Means up to each batch of forcing periods, with the standard error at the end."""
    batches, shown = result.batches.shape[0], min(result.exponents.size, MOST_SHOWN)
    count = np.arange(1.0, batches + 1.0)
    periods = count * result.periods / batches
    means = np.cumsum(result.batches, axis=0) / count[:, None]
    traces, unit = [], unit_in(result.machine, "1/s")
    for k in range(shown):
        name = _with_error(result.exponents[k], result.standard_error[k])
        traces.append(
            Trace(f"{name}{unit}", periods, means[:, k], "stable", case_colour(k), case_symbol(k),
                  bold=k == 0)
        )  # fmt: skip
    panel = Panel(
        Axis("forcing periods", ""), Axis("Lyapunov exponents", "1/s"), tuple(traces),
        lines=(Line("y", 0.0),),
    )  # fmt: skip
    caption = (
        f"Mean rates at which neighbouring motions part, up to each number of periods. The motion "
        f"is {result.word}. Above 0 neighbours part: chaos. All below 0: the motion comes to one "
        "that repeats. The legend gives the final values with their standard errors."
    )
    return Figure("Lyapunov exponents", caption, (panel,), height=340)


def _with_error(value: float, error: float) -> str:
    """A value and its standard error, to the second digit of the error."""
    if not (math.isfinite(value) and math.isfinite(error) and error > 0.0):
        return f"{value:.4g}"
    decimals = max(1 - math.floor(math.log10(error)), 0)
    return f"{value:.{decimals}f} ± {error:.{decimals}f}".replace("-", MINUS)
