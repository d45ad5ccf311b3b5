"""``flipflow.figure``: the figure of a result, chosen by its type."""

from __future__ import annotations

from functools import singledispatch

from flipflow.analyses.assessment import Assessment
from flipflow.analyses.linear import LinearResponse
from flipflow.analyses.loading import Loading
from flipflow.analyses.operating_region import OperatingRegion
from flipflow.analyses.response_family import ResponseFamily
from flipflow.errors import InputError
from flipflow.figures.bars import region_figure
from flipflow.figures.family import family_figure
from flipflow.figures.loading import loading_figure
from flipflow.figures.motion import orbit_figure
from flipflow.figures.parts import Figure
from flipflow.figures.response import branch_figure, cases_figure, linear_figure
from flipflow.results.branch import Branch
from flipflow.results.orbit import Orbit


@singledispatch
def figure(result: object) -> Figure:
    """Make the figure of a result; ``figure(result).write("x.html")`` writes it.

    Parameters
    ----------
    result
        A branch, an orbit, a linear response, an operating region, an assessment, a loading or a
        family of responses.

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
def _(result: Loading) -> Figure:
    return loading_figure(result)


@figure.register
def _(result: ResponseFamily) -> Figure:
    return family_figure(result)
