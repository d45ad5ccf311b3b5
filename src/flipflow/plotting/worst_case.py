"""Worst cases drawn: the band between least and greatest, and where in their intervals they are."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from flipflow.model.quantities import quantity_named
from flipflow.plotting.figure import Figure
from flipflow.plotting.palette import CASES, case_colour, case_symbol
from flipflow.plotting.panels import Axis, Bar, Line, Panel, Trace
from flipflow.plotting.scales import HZ, RPM
from flipflow.plotting.sensitivity import SHOWN
from flipflow.plotting.study import symbol_of
from flipflow.plotting.units import speed_of
from flipflow.studies.worst_case import End, WorstCase

Real = NDArray[np.float64]
WHOLE = (-0.05, 1.05)  # of an interval, with a margin


def worst_case_figure(found: WorstCase) -> Figure:
    """The least and the greatest over frequency, or at one, and the parameters that lead there.

    Parameters
    ----------
    found
        What :func:`flipflow.worst_case` returns.
    """
    return _over_frequency(found) if found.omega.size > 1 else _at_one(found)


def _over_frequency(found: WorstCase) -> Figure:
    one = quantity_named(found.quantity, found.machine)
    scale, order = SHOWN[one.shown_unit], np.argsort(found.omega, kind="stable")
    x, also = found.omega[order] * RPM, (("Hz", found.omega[order] * HZ),)
    low, high, own = (
        values[order] * scale for values in (found.least, found.greatest, found.nominal)
    )
    speed = Axis("shaft speed", "rpm", (float(x.min()), float(x.max())))
    band = Panel(
        speed, Axis(one.label, one.shown_unit),
        (
            Trace("least to greatest", x, high, "case band", "case band", lower=low),
            Trace("the machine itself", x, own, bold=True, x_also=also),
        ),
    )  # fmt: skip
    lines = tuple(
        Trace(symbol_of(name), x, _shares(found, "greatest")[order, j], colour=case_colour(j),
              symbol=case_symbol(j), dash="dash" if j >= CASES else "", x_also=also)
        for j, name in enumerate(found.names)
    )  # fmt: skip
    places = Panel(speed, Axis("place in the interval at the greatest", "", WHOLE), lines)
    caption = (
        "Above: what the quantity can be at each speed while every parameter may lie anywhere in "
        "its interval. Below: where each lies when it is greatest; 0 is the low end, 1 the high "
        f"end. {_looked_at(found)}"
    )
    return Figure(f"Worst case of {one.label}", caption, (band, places), height=620)


def _at_one(found: WorstCase) -> Figure:
    one = quantity_named(found.quantity, found.machine)
    scale, last = SHOWN[one.shown_unit], len(found.names) - 1
    low, high, own = (
        float(values[0] * scale) for values in (found.least, found.greatest, found.nominal)
    )
    margin = 0.25 * (high - low) or 1.0
    words = f"{low:.4g} to {high:.4g}"
    span = Panel(
        Axis(one.label, one.shown_unit, (low - margin, high + margin)),
        Axis("", "", (-0.6, 0.6), ((0.0, "all together"),)),
        bars=(Bar("least to greatest", 0.0, low, high, 0.5, "case 1", text=words),),
        lines=(Line("x", own, "the machine itself", "mark", "solid"),),
    )
    ticks = tuple((float(last - j), symbol_of(name)) for j, name in enumerate(found.names))
    place = Axis("place in the interval (0: low end, 1: high end)", "", WHOLE)
    places = Panel(place, Axis("", "", (-0.6, last + 0.6), ticks), tuple(_marks(found, last)))
    speed = "" if np.isnan(found.omega[0]) else f" at {speed_of(found, found.omega[0])}"
    caption = (
        "Above: what the quantity can be while every parameter may lie anywhere in its interval. "
        f"Below: where each lies when it is least and greatest. {_looked_at(found)}"
    )
    title = f"Worst case of {one.label}{speed}"
    return Figure(title, caption, (span, places), height=300 + 30 * len(found.names))


def _marks(found: WorstCase, last: int) -> Iterator[Trace]:
    """A mark for each parameter at the least and at the greatest."""
    rows = last - np.arange(last + 1.0)
    ends: tuple[End, ...] = ("least", "greatest")
    for k, end in enumerate(ends):
        y = rows + 0.12 - 0.24 * k
        yield Trace(end, _shares(found, end)[0], y, "point", case_colour(k + 1), case_symbol(k + 1))


def _shares(found: WorstCase, end: End) -> Real:
    """Places in the intervals, 0 to 1, (K, P)."""
    low, high = found.intervals.T
    at = found.least_at if end == "least" else found.greatest_at
    return np.asarray((at - low) / (high - low))


def _looked_at(found: WorstCase) -> str:
    return f"{found.looked_at} machines were looked at."
