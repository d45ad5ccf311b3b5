"""flipflow: dynamics, design and diagnosis of flip-flow vibrating screens.

The names below are the public face. They are loaded when first used, so that
``import flipflow`` and ``flipflow --help`` start at once.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

__version__ = "0.1.0"

_HOME = {
    "HarmonicBalance": "flipflow.periodic.options",
    "PiecewiseExact": "flipflow.periodic.options",
    "SampledHarmonicBalance": "flipflow.periodic.options",
    "frequency_response": "flipflow.continuation.frequency_response",
    "linear_response": "flipflow.dynamics.linear_response",
    "loading": "flipflow.studies.loading",
    "operating_region": "flipflow.studies.operating_region",
    "periodic_orbits": "flipflow.studies.periodic_orbits",
    "basins": "flipflow.studies.basins",
    "foundation_loads": "flipflow.studies.foundation_loads",
    "jump_risk": "flipflow.studies.jump_risk",
    "start_up": "flipflow.transient.startup",
    "coast_down": "flipflow.transient.startup",
    "continue_orbit": "flipflow.continuation.continue_orbit",
    "switch_branch": "flipflow.continuation.continue_orbit",
    "continue_bifurcation": "flipflow.continuation.continue_bifurcation",
    "continue_fold": "flipflow.continuation.continue_bifurcation",
    "design_map": "flipflow.studies.design_map",
    "assess": "flipflow.studies.assessment",
    "compare": "flipflow.studies.compare",
    "simulate": "flipflow.transient.simulate",
    "sweep": "flipflow.transient.sweep",
    "ramp": "flipflow.studies.ramp",
    "poincare_section": "flipflow.studies.poincare",
    "spectrum": "flipflow.studies.poincare",
    "lyapunov_exponents": "flipflow.studies.lyapunov",
    "bifurcation_diagram": "flipflow.studies.bifurcation_diagram",
    "sensitivity": "flipflow.studies.sensitivity",
    "study": "flipflow.studies.study",
    "open_study": "flipflow.studies.study",
    "tolerance": "flipflow.studies.tolerance",
    "worst_case": "flipflow.studies.worst_case",
    "design": "flipflow.studies.design",
    "Sample": "flipflow.model.sampling",
    "Choice": "flipflow.model.vary",
    "Normal": "flipflow.model.vary",
    "response_family": "flipflow.studies.response_family",
    "reproduce": "flipflow.paper.reproduce",
    "figure": "flipflow.plotting.dispatch",
    "ClearanceSpring": "flipflow.model.elements",
    "HarmonicForce": "flipflow.model.excitation",
    "MovingBase": "flipflow.model.excitation",
    "Unbalance": "flipflow.model.excitation",
    "MechanicalSystem": "flipflow.model.system",
    "FlipFlowScreen": "flipflow.model.screen",
    "Impulse": "flipflow.model.disturbance",
    "LoadStep": "flipflow.model.disturbance",
    "Lump": "flipflow.model.disturbance",
    "InputError": "flipflow.errors",
    "Load": "flipflow.model.screen",
    "Duty": "flipflow.model.duty",
    "SpringType": "flipflow.model.duty",
    "Motor": "flipflow.model.motor",
    "Drive": "flipflow.model.drive",
    "SpeedProfile": "flipflow.model.drive",
    "StarDelta": "flipflow.model.starter",
    "Converter": "flipflow.model.starter",
    "Limits": "flipflow.model.limits",
    "PassingLimits": "flipflow.model.limits",
    "Project": "flipflow.model.project",
    "load": "flipflow.io.project",
    "load_project": "flipflow.io.project",
    "load_duty": "flipflow.io.duty",
    "Assessment": "flipflow.studies.assessment",
    "Basins": "flipflow.studies.basins",
    "BifurcationCurve": "flipflow.continuation.bifurcation_curve",
    "BifurcationDiagram": "flipflow.studies.bifurcation_diagram",
    "Branch": "flipflow.continuation.branch",
    "BranchStatus": "flipflow.continuation.branch_status",
    "Comparison": "flipflow.studies.compare",
    "DesignMap": "flipflow.studies.design_map",
    "FieldBranch": "flipflow.continuation.field_branch",
    "Figure": "flipflow.plotting.figure",
    "FoundationLoads": "flipflow.studies.foundation_loads",
    "History": "flipflow.transient.history",
    "JumpRisk": "flipflow.studies.jump_risk",
    "LinearResponse": "flipflow.dynamics.linear_response",
    "Loading": "flipflow.studies.loading",
    "LyapunovExponents": "flipflow.studies.lyapunov",
    "Machine": "flipflow.model.system",
    "OperatingRegion": "flipflow.studies.operating_region",
    "Orbit": "flipflow.periodic.orbit",
    "Proposal": "flipflow.studies.design",
    "Ramp": "flipflow.studies.ramp",
    "ResponseFamily": "flipflow.studies.response_family",
    "RungeKutta": "flipflow.transient.time_stepping",
    "RunUp": "flipflow.transient.run_up",
    "Section": "flipflow.studies.poincare",
    "Sensitivity": "flipflow.studies.sensitivity",
    "SpecialPoint": "flipflow.continuation.branch",
    "Spectrum": "flipflow.studies.poincare",
    "Study": "flipflow.studies.study",
    "Sweep": "flipflow.transient.sweep",
    "Tolerance": "flipflow.studies.tolerance",
    "WorstCase": "flipflow.studies.worst_case",
    "Trial": "flipflow.studies.design",
    "Cancelled": "flipflow.errors",
    "IncompleteError": "flipflow.errors",
    "MissingExtra": "flipflow.errors",
    "StoreError": "flipflow.errors",
    "save": "flipflow.io.results",
    "open_result": "flipflow.io.results",
}

__all__ = [*_HOME, "__version__"]  # noqa: PLE0604  the keys are strings

if TYPE_CHECKING:
    from flipflow.continuation.bifurcation_curve import BifurcationCurve as BifurcationCurve
    from flipflow.continuation.branch import Branch as Branch
    from flipflow.continuation.branch import SpecialPoint as SpecialPoint
    from flipflow.continuation.branch_status import BranchStatus as BranchStatus

    # "X as X" marks a public name for type checkers; _HOME says where it is loaded from.
    from flipflow.continuation.continue_bifurcation import (
        continue_bifurcation as continue_bifurcation,
    )
    from flipflow.continuation.continue_bifurcation import continue_fold as continue_fold
    from flipflow.continuation.continue_orbit import continue_orbit as continue_orbit
    from flipflow.continuation.continue_orbit import switch_branch as switch_branch
    from flipflow.continuation.field_branch import FieldBranch as FieldBranch
    from flipflow.continuation.frequency_response import frequency_response as frequency_response
    from flipflow.dynamics.linear_response import LinearResponse as LinearResponse
    from flipflow.dynamics.linear_response import linear_response as linear_response
    from flipflow.errors import Cancelled as Cancelled
    from flipflow.errors import IncompleteError as IncompleteError
    from flipflow.errors import InputError as InputError
    from flipflow.errors import MissingExtra as MissingExtra
    from flipflow.errors import StoreError as StoreError
    from flipflow.io.duty import load_duty as load_duty
    from flipflow.io.project import load as load
    from flipflow.io.project import load_project as load_project
    from flipflow.io.results import open_result as open_result
    from flipflow.io.results import save as save
    from flipflow.model.disturbance import Impulse as Impulse
    from flipflow.model.disturbance import LoadStep as LoadStep
    from flipflow.model.disturbance import Lump as Lump
    from flipflow.model.drive import Drive as Drive
    from flipflow.model.drive import SpeedProfile as SpeedProfile
    from flipflow.model.duty import Duty as Duty
    from flipflow.model.duty import SpringType as SpringType
    from flipflow.model.elements import ClearanceSpring as ClearanceSpring
    from flipflow.model.excitation import HarmonicForce as HarmonicForce
    from flipflow.model.excitation import MovingBase as MovingBase
    from flipflow.model.excitation import Unbalance as Unbalance
    from flipflow.model.limits import Limits as Limits
    from flipflow.model.limits import PassingLimits as PassingLimits
    from flipflow.model.motor import Motor as Motor
    from flipflow.model.project import Project as Project
    from flipflow.model.sampling import Sample as Sample
    from flipflow.model.screen import FlipFlowScreen as FlipFlowScreen
    from flipflow.model.screen import Load as Load
    from flipflow.model.starter import Converter as Converter
    from flipflow.model.starter import StarDelta as StarDelta
    from flipflow.model.system import Machine as Machine
    from flipflow.model.system import MechanicalSystem as MechanicalSystem
    from flipflow.model.vary import Choice as Choice
    from flipflow.model.vary import Normal as Normal
    from flipflow.paper.reproduce import reproduce as reproduce
    from flipflow.periodic.options import HarmonicBalance as HarmonicBalance
    from flipflow.periodic.options import PiecewiseExact as PiecewiseExact
    from flipflow.periodic.options import SampledHarmonicBalance as SampledHarmonicBalance
    from flipflow.periodic.orbit import Orbit as Orbit
    from flipflow.plotting.dispatch import figure as figure
    from flipflow.plotting.figure import Figure as Figure
    from flipflow.studies.assessment import Assessment as Assessment
    from flipflow.studies.assessment import assess as assess
    from flipflow.studies.basins import Basins as Basins
    from flipflow.studies.basins import basins as basins
    from flipflow.studies.bifurcation_diagram import BifurcationDiagram as BifurcationDiagram
    from flipflow.studies.bifurcation_diagram import bifurcation_diagram as bifurcation_diagram
    from flipflow.studies.compare import Comparison as Comparison
    from flipflow.studies.compare import compare as compare
    from flipflow.studies.design import Proposal as Proposal
    from flipflow.studies.design import Trial as Trial
    from flipflow.studies.design import design as design
    from flipflow.studies.design_map import DesignMap as DesignMap
    from flipflow.studies.design_map import design_map as design_map
    from flipflow.studies.foundation_loads import FoundationLoads as FoundationLoads
    from flipflow.studies.foundation_loads import foundation_loads as foundation_loads
    from flipflow.studies.jump_risk import JumpRisk as JumpRisk
    from flipflow.studies.jump_risk import jump_risk as jump_risk
    from flipflow.studies.loading import Loading as Loading
    from flipflow.studies.loading import loading as loading
    from flipflow.studies.lyapunov import LyapunovExponents as LyapunovExponents
    from flipflow.studies.lyapunov import lyapunov_exponents as lyapunov_exponents
    from flipflow.studies.operating_region import OperatingRegion as OperatingRegion
    from flipflow.studies.operating_region import operating_region as operating_region
    from flipflow.studies.periodic_orbits import periodic_orbits as periodic_orbits
    from flipflow.studies.poincare import Section as Section
    from flipflow.studies.poincare import Spectrum as Spectrum
    from flipflow.studies.poincare import poincare_section as poincare_section
    from flipflow.studies.poincare import spectrum as spectrum
    from flipflow.studies.ramp import Ramp as Ramp
    from flipflow.studies.ramp import ramp as ramp
    from flipflow.studies.response_family import ResponseFamily as ResponseFamily
    from flipflow.studies.response_family import response_family as response_family
    from flipflow.studies.sensitivity import Sensitivity as Sensitivity
    from flipflow.studies.sensitivity import sensitivity as sensitivity
    from flipflow.studies.study import Study as Study
    from flipflow.studies.study import open_study as open_study
    from flipflow.studies.study import study as study
    from flipflow.studies.tolerance import Tolerance as Tolerance
    from flipflow.studies.tolerance import tolerance as tolerance
    from flipflow.studies.worst_case import WorstCase as WorstCase
    from flipflow.studies.worst_case import worst_case as worst_case
    from flipflow.transient.history import History as History
    from flipflow.transient.run_up import RunUp as RunUp
    from flipflow.transient.simulate import simulate as simulate
    from flipflow.transient.startup import coast_down as coast_down
    from flipflow.transient.startup import start_up as start_up
    from flipflow.transient.sweep import Sweep as Sweep
    from flipflow.transient.sweep import sweep as sweep
    from flipflow.transient.time_stepping import RungeKutta as RungeKutta


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module 'flipflow' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
