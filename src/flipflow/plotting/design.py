"""A proposal drawn: its Pareto set, and the amplitudes of the machines under every combination."""

from __future__ import annotations

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.model.fields import FIELD
from flipflow.plotting.figure import Figure
from flipflow.plotting.palette import case_colour, case_symbol
from flipflow.plotting.panels import Axis, Band, Line, Panel, Trace
from flipflow.plotting.scales import MM, SHOWN
from flipflow.plotting.study import FIELD_SCALES, field_unit
from flipflow.studies.candidates import quantity_of
from flipflow.studies.design import Proposal

COLUMNS, ROW = 2, 230


def proposal_figure(found: Proposal) -> Figure:
    """The Pareto set: each objective over the first, the machine of the set that is preferred.

    With one objective alone the free fields stand above it.

    Parameters
    ----------
    found
        What :func:`flipflow.design` returns.
    """
    first, *others = found.objectives
    x = _shown(found, first)
    ways = [(name, _axis(name), _shown(found, name)) for name in others]
    if not ways:
        ways = [
            (
                name,
                Axis(FIELD[name].symbol, field_unit(name)),
                values * FIELD_SCALES.get(field_unit(name), 1.0),
            )
            for name, values in found.fields.items()
        ]
    place = found.preferred
    panels = tuple(
        Panel(
            _axis(first),
            axis,
            (
                Trace("machines of the set", x, y, "point", "main", "circle", legend=k == 0),
                Trace(
                    "preferred, before its polish", x[place : place + 1], y[place : place + 1],
                    "point", "floating", "diamond", legend=k == 0,
                ),
            ),
        )
        for k, (_, axis, y) in enumerate(ways)
    )  # fmt: skip
    caption = (
        "Each point is a machine that meets every limit under every combination, and that no other "
        "beats in every objective; each value is the worst of all combinations."
    )
    if not found.possible:
        caption = "No machine meets every limit: the one that misses least."
    rows = -(-len(panels) // COLUMNS)
    columns = min(COLUMNS, len(panels))
    return Figure("Pareto set", caption, panels, columns, 60 + ROW * rows)


def band_figure(found: Proposal) -> Figure:
    """Relative amplitude under every combination: the chosen machine and those beside it.

    Parameters
    ----------
    found
        What :func:`flipflow.design` returns.
    """
    duty = found.duty
    traces = tuple(
        Trace(
            one.name, np.sort(one.amplitude[~np.isnan(one.amplitude)]) * MM,
            np.linspace(0.0, 100.0, int((~np.isnan(one.amplitude)).sum())), "motion",
            case_colour(k), symbol=case_symbol(k), bold=k == 0,
        )
        for k, one in enumerate((found.chosen, *found.beside))
        if not np.isnan(one.amplitude).all()
    )  # fmt: skip
    low, high = (MM * (duty.target + side * duty.tolerance) for side in (-1.0, 1.0))
    panel = Panel(
        Axis("relative amplitude", "mm"),
        Axis("combinations that lie below", "%", (-2.0, 102.0)),
        traces,
        bands=(Band("x", low, high, "allowed", "duty"),),
        lines=(Line("x", MM * duty.target, "", "mark"),),
    )
    caption = (
        "Share of all combinations of load, temperature, corner of the scatter and speed with a "
        "lesser amplitude: the steeper the line, the steadier the machine."
    )
    return Figure("Steadiness", caption, (panel,), height=300)


def _axis(name: str) -> Axis:
    one = quantity_of(name)
    words = "band of the relative amplitude" if name == "steadiness" else one.label
    return Axis(words, one.shown_unit)


def _shown(found: Proposal, name: str) -> Real:
    return np.asarray(found.objectives[name] * SHOWN[quantity_of(name).shown_unit])
