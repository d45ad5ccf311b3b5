"""Figures in the units of their reader: an engineer's, SI, or none."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any, Literal, get_args

from flipflow.model.arguments import checked_word
from flipflow.model.numerals import rpm
from flipflow.model.screen import is_screen
from flipflow.plotting.figure import Figure
from flipflow.plotting.panels import Axis, Line, Panel, Trace, decade_ticks
from flipflow.plotting.scales import DEGREES, HZ, KN, MM, RPM

Units = Literal["engineering", "SI", "dimensionless"]
Way = Callable[[Any], Any]  # from a number in an axis' unit to one in another
# What one of an axis' unit is in another, and that unit. Figures of the paper stand over rad/s.
TO_ENGINEERING = {"rad/s": (RPM, "rpm")}
TO_SI = {
    "mm": (1.0 / MM, "m"), "um": (1e-6, "m"), "kN": (1.0 / KN, "N"), "rpm": (1.0 / RPM, "rad/s"),
    "rad/s": (1.0, "rad/s"), "Hz": (1.0 / HZ, "rad/s"), "deg": (1.0 / DEGREES, "rad"),
    "kW": (1e3, "W"),
}  # fmt: skip
TO = {"engineering": TO_ENGINEERING, "SI": TO_SI, "dimensionless": TO_SI}
WORDS = {
    "shaft speed": "angular frequency", "frequency": "angular frequency",
    "shaft angle": "phase of the force",
}  # fmt: skip


def units_for(result: object, units: str | None) -> str:
    """The units asked for; else an engineer's for a screen and none for any other machine.

    Raises
    ------
    InputError
        For units that are not known.
    """
    if units is not None:
        return checked_word("units", units, get_args(Units))
    first = result[0] if isinstance(result, (list, tuple)) and result else result
    machine = getattr(first, "machine", getattr(first, "system", None))
    return "engineering" if machine is None or is_screen(machine) else "dimensionless"


def length_of(owner: object, metres: float, digits: int) -> str:
    """A length as a legend says it: in mm for a screen, without a unit for any other machine."""
    if units_for(owner, None) == "engineering":
        return f"{metres * MM:.{digits}g} mm"
    return f"{metres:.{digits}g}"


def speed_of(owner: object, omega: float) -> str:
    """A frequency as a title says it: in rpm for a screen, without a unit for any other machine."""
    if units_for(owner, None) == "engineering":
        return f"{rpm(omega)} rpm"
    return f"{omega:.4g}"


def in_units(figure: Figure, units: str) -> Figure:
    """The figure, which is drawn in an engineer's units or over rad/s, in those asked for."""
    panels = tuple(_rescaled(panel, units) for panel in figure.panels)
    return dataclasses.replace(figure, panels=panels)


def _rescaled(panel: Panel, units: str) -> Panel:
    (x, across), (y, upwards) = (_axis_in(axis, units) for axis in (panel.x, panel.y))
    scale = {"x": across, "y": upwards}
    if (x, y) == (panel.x, panel.y) and units != "dimensionless":
        return panel

    def moved(part: Any, **ways: Way) -> Any:
        old = {name: getattr(part, name) for name in ways}
        new = {name: None if old[name] is None else way(old[name]) for name, way in ways.items()}
        return dataclasses.replace(part, **new)

    def trace_in(trace: Trace) -> Trace:
        known: Trace = moved(trace, x=across, y=upwards, lower=upwards)
        also = trace.x_also if units == "engineering" else ()
        if also and x != panel.x:
            also = (*(one for one in also if one[0] != x.unit), (panel.x.unit, trace.x))
        return dataclasses.replace(known, x_also=also)

    def line_in(line: Line) -> Line:
        known: Line = moved(line, at=scale[line.axis])
        words, _, unit = line.text.rpartition(" ")
        if unit not in TO[units]:
            return known
        value, to = f"{known.at:.4g}", "" if units == "dimensionless" else TO[units][unit][1]
        text = " ".join(filter(None, (words.rpartition(" ")[0], value, to)))
        return dataclasses.replace(known, text=text)

    return dataclasses.replace(
        panel,
        x=x,
        y=y,
        traces=tuple(map(trace_in, panel.traces)),
        bars=tuple(moved(b, low=across, high=across) for b in panel.bars),
        bands=tuple(moved(b, low=scale[b.axis], high=scale[b.axis]) for b in panel.bands),
        lines=tuple(map(line_in, panel.lines)),
        arrows=tuple(moved(a, x0=across, x1=across, y0=upwards, y1=upwards) for a in panel.arrows),
        notes=tuple(moved(note, x=across, y=upwards) for note in panel.notes),
        cells=tuple(moved(c, x=across, y=upwards) for c in panel.cells),
    )


def _axis_in(axis: Axis, units: str) -> tuple[Axis, Way]:
    """The axis in other units, or without one, and the way there of what is drawn."""
    factor, unit = TO[units].get(axis.unit, (1.0, axis.unit))
    shift = math.log10(factor)

    def way(value: Any) -> Any:
        return value + shift if axis.decades else value * factor

    bounds = None if axis.bounds is None else (way(axis.bounds[0]), way(axis.bounds[1]))
    # Ticks of an angle in degrees mean nothing in radians; words stay.
    ticks = axis.ticks if factor == 1.0 else ()
    if axis.decades and bounds is not None:
        ticks = decade_ticks(math.ceil(bounds[0]), math.floor(bounds[1]))
    if units == "engineering":
        label = "shaft speed" if axis.unit == "rad/s" else axis.label
    else:
        label = WORDS.get(axis.label, axis.label)
    known = "" if units == "dimensionless" and axis.unit not in ("", "%") else unit
    return Axis(label, known, bounds, ticks, axis.decades), way
