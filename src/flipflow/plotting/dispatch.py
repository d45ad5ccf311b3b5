"""``flipflow.figure``: the figure of a result, chosen by its type."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

from flipflow.continuation.bifurcation_curve import BifurcationCurve
from flipflow.continuation.branch import Branch
from flipflow.continuation.field_branch import FieldBranch
from flipflow.dynamics.linear_response import LinearResponse
from flipflow.errors import IncompleteError, InputError
from flipflow.model.arguments import checked_flag, checked_positive
from flipflow.model.system import Coordinate
from flipflow.periodic.orbit import Orbit
from flipflow.plotting.bars import region_figure
from flipflow.plotting.basins import basins_figure
from flipflow.plotting.branches import (
    branches_figure,
    curves_figure,
    field_branch_figure,
    field_branches_figure,
    multipliers_figure,
)
from flipflow.plotting.compare import comparison_figure
from flipflow.plotting.design import proposal_figure
from flipflow.plotting.design_map import design_map_figure
from flipflow.plotting.family import family_figure
from flipflow.plotting.figure import Figure
from flipflow.plotting.foundation import foundation_figure
from flipflow.plotting.history import history_figure
from flipflow.plotting.jump_risk import jump_risk_figure
from flipflow.plotting.layout import PIXELS_A_MM, least_width
from flipflow.plotting.loading import loading_figure
from flipflow.plotting.motion import orbit_figure, orbits_in_time_figure
from flipflow.plotting.nonperiodic import (
    bifurcation_figure,
    lyapunov_figure,
    section_figure,
    spectrum_figure,
)
from flipflow.plotting.response import branch_figure, cases_figure, linear_figure
from flipflow.plotting.sensitivity import sensitivity_figure
from flipflow.plotting.study import study_figure
from flipflow.plotting.sweep import ramp_figure, sweep_figure
from flipflow.plotting.tolerance import tolerance_figure
from flipflow.plotting.transient import run_up_figure
from flipflow.plotting.units import in_units, units_for
from flipflow.plotting.worst_case import worst_case_figure
from flipflow.studies.assessment import Assessment
from flipflow.studies.basins import Basins
from flipflow.studies.bifurcation_diagram import BifurcationDiagram
from flipflow.studies.compare import Comparison
from flipflow.studies.design import Proposal
from flipflow.studies.design_map import DesignMap
from flipflow.studies.foundation_loads import FoundationLoads
from flipflow.studies.jump_risk import JumpRisk
from flipflow.studies.loading import Loading
from flipflow.studies.lyapunov import LyapunovExponents
from flipflow.studies.operating_region import OperatingRegion
from flipflow.studies.poincare import Section, Spectrum
from flipflow.studies.ramp import Ramp
from flipflow.studies.response_family import ResponseFamily
from flipflow.studies.sensitivity import Sensitivity
from flipflow.studies.study import Study
from flipflow.studies.tolerance import Tolerance
from flipflow.studies.worst_case import WorstCase
from flipflow.transient.history import History
from flipflow.transient.run_up import RunUp
from flipflow.transient.sweep import Sweep

# The figures of results that have a choice of coordinates, and of those that have none.
OF_A_COORDINATE: dict[type, Callable[..., Figure]] = {
    Branch: branch_figure,
    FieldBranch: field_branch_figure,
    LinearResponse: linear_figure,
    Orbit: orbit_figure,
    History: history_figure,
    Ramp: ramp_figure,
    ResponseFamily: family_figure,
    Section: section_figure,
    BifurcationDiagram: bifurcation_figure,
}
OF_THE_WHOLE: dict[type, Callable[..., Figure]] = {
    OperatingRegion: region_figure,
    Assessment: cases_figure,
    RunUp: run_up_figure,
    Sensitivity: sensitivity_figure,
    Loading: loading_figure,
    Basins: basins_figure,
    Spectrum: spectrum_figure,
    LyapunovExponents: lyapunov_figure,
    JumpRisk: jump_risk_figure,
    Comparison: comparison_figure,
    BifurcationCurve: curves_figure,
    DesignMap: design_map_figure,
    FoundationLoads: foundation_figure,
    Study: study_figure,
    Tolerance: tolerance_figure,
    WorstCase: worst_case_figure,
    Proposal: proposal_figure,
}


def figure(
    result: object,
    *,
    coordinate: Coordinate | None = None,
    units: str | None = None,
    width: float | None = None,
    multipliers: bool = False,
) -> Figure:
    """Make the figure of a result; ``figure(result).write("x.html")`` writes it.

    Parameters
    ----------
    result
        What an analysis returns: a branch, an orbit, a sweep, an assessment, ...; a list of
        branches over frequency, of branches over one field, or of bifurcation curves, or the
        motions of ``periodic_orbits``.
    coordinate
        What is drawn of the motion, a name or an index; None: what matters most, or all.
    units
        "engineering" (mm, rpm, kN), "SI" or "dimensionless" (no unit is written); None: the first
        for a screen, the last for any other machine.
    width
        Width in mm, such as 84 for a column of a journal; None: an A4 page within its margins.
    multipliers
        Of a branch, its multipliers over frequency and in the complex plane, in place of its
        amplitudes.

    Returns
    -------
    Figure
        A neutral description; :meth:`~flipflow.plotting.figure.Figure.write` makes ``.html``,
        ``.svg``, ``.pdf`` or ``.png`` of it.

    Raises
    ------
    InputError
        For anything else, and for a width without room for panels.
    IncompleteError
        For a branch without points, with why it has none.
    """
    _refuse_empty(result)
    build = _builder(result, coordinate)
    if checked_flag("multipliers", multipliers):
        if not isinstance(result, (Branch, FieldBranch)):
            raise InputError("multipliers", True, "give a branch: only its points have them")
        build = partial(multipliers_figure, result)
    drawn = in_units(build(), units_for(result, units))
    if width is None:
        return drawn
    least = math.ceil(least_width(drawn) / PIXELS_A_MM)
    if checked_positive("width", width) < least:
        raise InputError("width", width, f"give {least} mm or more")
    return drawn.narrowed(PIXELS_A_MM * width)


def _refuse_empty(result: object) -> None:
    """Say why a branch has no points, or the first of several of which none has any."""
    several = result if isinstance(result, (list, tuple)) else (result,)
    kinds = (Branch, FieldBranch, BifurcationCurve)
    if several and all(isinstance(one, kinds) and one.omega.size == 0 for one in several):
        raise IncompleteError(f"The branch has no points. {several[0].status.value}")


def _builder(result: object, which: Coordinate | None) -> Callable[[], Figure]:
    """What makes the figure of a result."""
    kind = type(result)
    if isinstance(result, (list, tuple)):
        return partial(_of_several, result, which)
    if isinstance(result, Sweep):
        return partial(sweep_figure, (result,), which=which)
    if kind in OF_A_COORDINATE:
        return partial(OF_A_COORDINATE[kind], result, which=which)
    if kind not in OF_THE_WHOLE:
        names = sorted(one.__name__ for one in (*OF_A_COORDINATE, *OF_THE_WHOLE, Sweep))
        remedy = f"a figure can be made of {', '.join(names)}"
        raise InputError("result", kind.__name__, remedy)
    if which is not None:
        raise InputError(
            "coordinate", which, f"the figure of {kind.__name__} has no choice of them"
        )
    return partial(OF_THE_WHOLE[kind], result)


def _of_several(result: Sequence[object], which: Coordinate | None) -> Figure:
    if result and all(isinstance(one, Orbit) for one in result):
        return orbits_in_time_figure(result, which)  # type: ignore[arg-type]
    if result and all(isinstance(one, BifurcationCurve) for one in result):
        return curves_figure(*result)  # type: ignore[arg-type]
    if result and all(isinstance(one, FieldBranch) for one in result):
        return field_branches_figure(result, which)  # type: ignore[arg-type]
    return branches_figure(result, which)  # type: ignore[arg-type]
