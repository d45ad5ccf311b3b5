"""``flipflow.figure``: the figure of a result, chosen by its type."""

from __future__ import annotations

from collections.abc import Sequence
from functools import singledispatch

from flipflow.continuation.branch import Branch
from flipflow.continuation.field_branch import FieldBranch
from flipflow.dynamics.linear_response import LinearResponse
from flipflow.errors import InputError
from flipflow.periodic.orbit import Orbit
from flipflow.plotting.bars import region_figure
from flipflow.plotting.basins import basins_figure
from flipflow.plotting.bifurcation import bifurcation_figure
from flipflow.plotting.branches import branches_figure, field_branch_figure
from flipflow.plotting.compare import comparison_figure
from flipflow.plotting.family import family_figure
from flipflow.plotting.figure import Figure
from flipflow.plotting.history import history_figure
from flipflow.plotting.loading import loading_figure
from flipflow.plotting.lyapunov import lyapunov_figure
from flipflow.plotting.motion import orbit_figure
from flipflow.plotting.response import branch_figure, cases_figure, linear_figure
from flipflow.plotting.section import section_figure, spectrum_figure
from flipflow.plotting.sensitivity import sensitivity_figure
from flipflow.plotting.sweep import sweep_figure
from flipflow.plotting.transient import run_up_figure
from flipflow.studies.assessment import Assessment
from flipflow.studies.basins import Basins
from flipflow.studies.bifurcation_diagram import BifurcationDiagram
from flipflow.studies.compare import Comparison
from flipflow.studies.loading import Loading
from flipflow.studies.lyapunov import LyapunovExponents
from flipflow.studies.operating_region import OperatingRegion
from flipflow.studies.poincare import Section, Spectrum
from flipflow.studies.response_family import ResponseFamily
from flipflow.studies.sensitivity import Sensitivity
from flipflow.transient.history import History
from flipflow.transient.startup import RunUp
from flipflow.transient.sweep import Sweep


def figure(result: object) -> Figure:
    """Make the figure of a result; ``figure(result).write("x.html")`` writes it.

    Parameters
    ----------
    result
        What an analysis returns: a branch, an orbit, a sweep, an assessment, ...

    Returns
    -------
    Figure
        A neutral description; :meth:`~flipflow.plotting.figure.Figure.write` makes ``.html``,
        ``.svg``, ``.pdf`` or ``.png`` of it.

    Raises
    ------
    InputError
        For anything else.
    """
    # A function that dispatches by type takes its argument by position only.
    return _figure(result)


@singledispatch
def _figure(result: object) -> Figure:
    """The figure of a result of a kind registered below; anything else is refused."""
    known = ", ".join(sorted(kind.__name__ for kind in _figure.registry if kind is not object))
    raise InputError("result", type(result).__name__, f"a figure can be made of {known}")


@_figure.register
def _(result: Branch) -> Figure:
    return branch_figure(result)


@_figure.register(list)
@_figure.register(tuple)
def _(result: Sequence[Branch]) -> Figure:
    return branches_figure(result)


@_figure.register
def _(result: FieldBranch) -> Figure:
    return field_branch_figure(result)


@_figure.register
def _(result: LinearResponse) -> Figure:
    return linear_figure(result)


@_figure.register
def _(result: Orbit) -> Figure:
    return orbit_figure(result)


@_figure.register
def _(result: OperatingRegion) -> Figure:
    return region_figure(result)


@_figure.register
def _(result: Assessment) -> Figure:
    return cases_figure(result)


@_figure.register
def _(result: Comparison) -> Figure:
    return comparison_figure(result)


@_figure.register
def _(result: Sweep) -> Figure:
    return sweep_figure((result,))


@_figure.register
def _(result: History) -> Figure:
    return history_figure(result)


@_figure.register
def _(result: RunUp) -> Figure:
    return run_up_figure(result)


@_figure.register
def _(result: Sensitivity) -> Figure:
    return sensitivity_figure(result)


@_figure.register
def _(result: Loading) -> Figure:
    return loading_figure(result)


@_figure.register
def _(result: ResponseFamily) -> Figure:
    return family_figure(result)


@_figure.register
def _(result: Basins) -> Figure:
    return basins_figure(result)


@_figure.register
def _(result: Section) -> Figure:
    return section_figure(result)


@_figure.register
def _(result: Spectrum) -> Figure:
    return spectrum_figure(result)


@_figure.register
def _(result: LyapunovExponents) -> Figure:
    return lyapunov_figure(result)


@_figure.register
def _(result: BifurcationDiagram) -> Figure:
    return bifurcation_figure(result)
