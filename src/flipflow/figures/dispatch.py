"""``flipflow.figure``: the figure of a result, chosen by its type."""

from __future__ import annotations

from functools import singledispatch

from flipflow.analyses.assessment import Assessment
from flipflow.analyses.linear import LinearResponse
from flipflow.analyses.operating_region import OperatingRegion
from flipflow.analyses.startup import RunUp
from flipflow.errors import InputError
from flipflow.figures.bars import region_figure
from flipflow.figures.basins import basins_figure
from flipflow.figures.history import history_figure
from flipflow.figures.motion import orbit_figure
from flipflow.figures.parts import Figure
from flipflow.figures.response import branch_figure, cases_figure, linear_figure
from flipflow.figures.sweep import sweep_figure
from flipflow.figures.transient import run_up_figure
from flipflow.results.basins import Basins
from flipflow.results.branch import Branch
from flipflow.results.history import History
from flipflow.results.orbit import Orbit
from flipflow.results.sweep import Sweep


@singledispatch
def figure(result: object) -> Figure:
    """Make the figure of a result; ``figure(result).write("x.html")`` writes it.

    Parameters
    ----------
    result
        A branch, an orbit, basins, a motion over time, a sweep, a start or coast-down, a linear
        response, an operating region or an assessment.

    Returns
    -------
    Figure
        A neutral description; :meth:`~flipflow.figures.parts.Figure.write` makes ``.html``,
        ``.svg``, ``.pdf`` or ``.png`` of it.

    Raises
    ------
    InputError
        For anything else.
    """
    known = ", ".join(sorted(kind.__name__ for kind in figure.registry if kind is not object))
    raise InputError("result", type(result).__name__, f"a figure can be made of {known}")


@figure.register
def _(result: Branch) -> Figure:
    return branch_figure(result)


@figure.register
def _(result: LinearResponse) -> Figure:
    return linear_figure(result)


@figure.register
def _(result: Orbit) -> Figure:
    return orbit_figure(result)


@figure.register
def _(result: OperatingRegion) -> Figure:
    return region_figure(result)


@figure.register
def _(result: Assessment) -> Figure:
    return cases_figure(result)


@figure.register
def _(result: Sweep) -> Figure:
    return sweep_figure((result,))


@figure.register
def _(result: History) -> Figure:
    return history_figure(result)


@figure.register
def _(result: RunUp) -> Figure:
    return run_up_figure(result)


@figure.register
def _(result: Basins) -> Figure:
    return basins_figure(result)
