"""Poincare sections and spectra."""

from __future__ import annotations

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.model.system import Coordinate
from flipflow.plotting.figure import Figure
from flipflow.plotting.panels import Axis, Line, Panel, Trace, decade_ticks
from flipflow.plotting.response import coordinates, label
from flipflow.plotting.scales import HZ, MM
from flipflow.studies.poincare import Section, Spectrum

MOST_HARMONICS = 6.0
DECADES = 6.0
LEAST_SPAN = 0.02  # on either side of points that coincide, as a share of their value


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
