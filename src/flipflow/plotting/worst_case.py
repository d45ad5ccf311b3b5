"""Worst cases drawn: the band between least and greatest, and where in their intervals they are."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flipflow.model.fields import symbol_of
from flipflow.model.quantities import Quantity, quantity_named
from flipflow.plotting.figure import Figure
from flipflow.plotting.palette import CASES, case_colour, case_symbol
from flipflow.plotting.panels import Axis, Bar, Line, Panel, Trace, rows_axis
from flipflow.plotting.scales import HZ, RPM, SHOWN
from flipflow.plotting.units import speed_of
from flipflow.studies.worst_case import End, WorstCase

ENDS: tuple[End, ...] = ("least", "greatest")
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
        np.where(np.isfinite(values), values, np.nan)[order] * scale
        for values in (found.least, found.greatest, found.nominal)
    )
    speed = Axis("shaft speed", "rpm", (float(x.min()), float(x.max())))
    band = Panel(
        speed, Axis(one.label, one.shown_unit),
        (
            Trace("least to greatest", x, high, "case band", "case band", lower=low),
            Trace("the machine itself", x, own, bold=True, x_also=also),
        ),
    )  # fmt: skip
    panels = [band]
    for end in ENDS:
        lines = tuple(
            Trace(symbol_of(name), x, found.places(end)[order, j], colour=case_colour(j + 1),
                  symbol=case_symbol(j + 1), dash="dash" if j + 1 >= CASES else "",
                  legend=end == ENDS[0], x_also=also)
            for j, name in enumerate(found.names)
        )  # fmt: skip
        panels.append(Panel(speed, Axis(f"place at the {end}", "", WHOLE), lines))
    caption = (
        f"Above: what the quantity can be at each speed ({found.branch}) while every parameter may "
        "lie anywhere in its interval. Below: where each lies when it is least, and greatest; 0 is "
        f"the low end, 1 the high end, equal lines cover each other. {_words(found)}"
    )
    return Figure(f"Worst case of {one.label}", caption, tuple(panels), height=840)


def _at_one(found: WorstCase) -> Figure:
    one = quantity_named(found.quantity, found.machine)
    last = len(found.names) - 1
    place = Axis("place in the interval (0: low end, 1: high end)", "", WHOLE)
    names = rows_axis([symbol_of(name) for name in found.names])
    places = Panel(place, names, tuple(_marks(found, last)))
    speed = "" if np.isnan(found.omega[0]) else f" at {speed_of(found, found.omega[0])}"
    caption = (
        "Above: what the quantity can be while every parameter may lie anywhere in its interval. "
        f"Below: where each lies when it is least and greatest. {_words(found)}"
    )
    title = f"Worst case of {one.label}{speed}"
    height = 300 + 30 * len(found.names)
    return Figure(title, caption, (_span(found, one), places), height=height)


def _span(found: WorstCase, one: Quantity) -> Panel:
    """From the least to the greatest, as far as they are known and finite."""
    low, high, own = (
        float(values[0] * SHOWN[one.shown_unit])
        for values in (found.least, found.greatest, found.nominal)
    )
    known = [value for value in (low, high, own) if np.isfinite(value)] or [0.0]
    margin = 0.25 * (max(known) - min(known)) or 0.1 * abs(known[0]) or 1.0
    bar = Bar("least to greatest", 0.0, low, high, 0.5, "case 1", ends=True)
    return Panel(
        Axis(one.label, one.shown_unit, (min(known) - margin, max(known) + margin)),
        rows_axis(["range"]),
        bars=(bar,) if np.isfinite([low, high]).all() else (),
        lines=(Line("x", own, "the machine itself", "mark"),) if np.isfinite(own) else (),
    )


def _marks(found: WorstCase, last: int) -> Iterator[Trace]:
    """A mark for each parameter at the least and at the greatest."""
    rows = last - np.arange(last + 1.0)
    for k, end in enumerate(ENDS):
        y = rows + 0.12 - 0.24 * k
        yield Trace(end, found.places(end)[0], y, "point", case_colour(k + 1), case_symbol(k + 1))


def _words(found: WorstCase) -> str:
    """How many machines were looked at, and the notes."""
    notes = "".join(f" {note[0].upper()}{note[1:]}." for note in found.notes)
    return f"{found.looked_at} machines were looked at.{notes}"
