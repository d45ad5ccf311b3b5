"""Basins: cells coloured by the motion that the machine settles on."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Real
from flipflow.errors import InputError
from flipflow.model.quantities import leading_coordinate
from flipflow.periodic.orbit import Orbit
from flipflow.plotting.figure import Figure
from flipflow.plotting.palette import case_colour
from flipflow.plotting.panels import Axis, Cells, Panel, Trace, cell_edges
from flipflow.plotting.response import label
from flipflow.plotting.scales import MM
from flipflow.plotting.units import length_of, speed_of
from flipflow.studies.basins import Basins, GridAxis

NOT_SETTLED = "none"
SYMBOLS = ("circle", "square", "triangle", "diamond")
READING = (
    "Each cell is a state at the moment when the unbalance points along x; its colour tells the "
    "motion that the machine settles on. Marks: where these motions themselves are at that moment, "
    "seen in this plane; what is not on its axes is 0 for the cells, but not for the motions."
)


def basins_figure(basins: Basins) -> Figure:
    """The grid as coloured cells with the motions' own points.

    Parameters
    ----------
    basins
        What :func:`flipflow.basins` returns, with one or two coordinates that vary.

    Returns
    -------
    Figure
        One panel; the legend gives amplitude and share.

    Raises
    ------
    InputError
        Where more than two coordinates vary.
    """
    varying = [k for k, axis in enumerate(basins.axes) if axis.values.size > 1]
    if len(varying) > 2:
        remedy = "a figure shows at most two; give single values for the others"
        raise InputError("coordinates that vary", len(varying), remedy)
    fixed = [k for k in range(len(basins.axes)) if k not in varying]
    across, *upwards = [basins.axes[k] for k in [*varying, *fixed]][:2]
    # An axis with one value lies beside the ones that vary only to make a strip of cells.
    shape = (across.values.size, upwards[0].values.size if upwards else 1)
    grid = basins.labels.transpose([*varying, *fixed]).reshape(shape).T
    traces = tuple(_marks(basins, across, upwards[0] if upwards else None))
    panel = Panel(
        _axis(across),
        _axis(upwards[0]) if upwards else Axis("", bounds=(-0.5, 0.5), ticks=((0.0, ""),)),
        traces,
        cells=(_cells(grid, across, upwards[0] if upwards else None, len(basins.orbits)),),
    )
    title = f"Basins at {speed_of(basins, basins.omega)}"
    return Figure(title, " ".join([READING, *basins.notes]), (panel,), height=430)


def _cells(
    grid: NDArray[np.int64], across: GridAxis, upwards: GridAxis | None, motions: int
) -> Cells:
    x = _shown(across, across.values)
    y = np.zeros(1) if upwards is None else _shown(upwards, upwards.values)
    columns, rows = np.argsort(x, kind="stable"), np.argsort(y, kind="stable")
    colours = (NOT_SETTLED, *(case_colour(k) for k in range(motions)))
    return Cells(
        cell_edges(x[columns]), cell_edges(y[rows]), grid[np.ix_(rows, columns)] + 1, colours
    )


def _shown(axis: GridAxis, values: Real) -> Real:
    """Displacements in mm, velocities in m/s."""
    return values * MM if axis.kind == "displacement" else values


def _axis(axis: GridAxis) -> Axis:
    edges = cell_edges(np.sort(_shown(axis, axis.values)))
    unit = "mm" if axis.kind == "displacement" else "m/s"
    return Axis(f"{label(axis.which)} {axis.kind}", unit, (float(edges[0]), float(edges[-1])))


def _marks(basins: Basins, across: GridAxis, upwards: GridAxis | None) -> Iterator[Trace]:
    """The motions at the start of each of their turns; their names carry amplitude and share."""
    for k, (orbit, share) in enumerate(zip(basins.orbits, basins.shares, strict=True)):
        x = _at_starts(orbit, across)
        y = np.zeros(x.size) if upwards is None else _at_starts(orbit, upwards)
        name = f"{_size(orbit)}: {100.0 * share:.3g} %"
        yield Trace(name, x, y, "point", case_colour(k), SYMBOLS[k % len(SYMBOLS)])
    if basins.unsettled > 0.0 or not basins.orbits:
        nowhere = np.array([np.nan])
        name = f"not settled: {100.0 * basins.unsettled:.3g} %"
        yield Trace(name, nowhere, nowhere, "point", "gap", "square-open")


def _at_starts(orbit: Orbit, axis: GridAxis) -> Real:
    t = 2.0 * np.pi / orbit.omega * np.arange(orbit.periods)
    read = orbit.displacement if axis.kind == "displacement" else orbit.velocity
    return _shown(axis, read(axis.which, t))


def _size(orbit: Orbit) -> str:
    which = leading_coordinate(orbit.system)
    turns = f", {orbit.periods} turns" if orbit.periods > 1 else ""
    name = which if isinstance(which, str) else label(which)
    return f"{length_of(orbit, orbit.amplitude(which), 3)} {name}{turns}"
