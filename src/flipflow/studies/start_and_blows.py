"""What a machine meets beside steady running: start, coast-down, blows and lumps of material."""

from __future__ import annotations

from dataclasses import dataclass

from flipflow.errors import IncompleteError, InputError
from flipflow.model.project import Project
from flipflow.model.screen import FlipFlowScreen
from flipflow.studies.jump_risk import JumpRisk, jump_risk
from flipflow.transient.startup import RunUp, coast_down, start_up


@dataclass(frozen=True, eq=False)
class Transients:
    """Start, coast-down and jump risk of the empty machine at its working speed.

    Parameters
    ----------
    assumed
        Whether the drive was assumed, for the machine file gives none.
    start
        From rest; None where it could not be calculated.
    coast_down
        From the speed that the start reaches, the motor switched off; None where it reaches none.
    jump
        The least blow and the least lump that throw the working motion onto another one; None
        where it could not be calculated.
    reasons
        Why "start", "coast_down" or "jump" is None.
    """

    assumed: bool
    start: RunUp | None
    coast_down: RunUp | None
    jump: JumpRisk | None
    reasons: dict[str, str]


def transients(project: Project, omega: float) -> Transients:
    """Start, coast-down and jump risk of a project's empty machine at ``omega`` in rad/s.

    Raises
    ------
    InputError
        For a drive in the project with which the machine cannot be started.
    """
    reasons: dict[str, str] = {}
    start = _start(project, omega, reasons)
    coast = None
    if start is not None and start.outcome == "reached":
        coast = coast_down(project.screen, start.final_speed, start.drive)
    else:
        reasons["coast_down"] = "the start does not reach the working speed"
    jump = _jump(project.screen, omega, reasons)
    return Transients(not _known(project), start, coast, jump, reasons)


def _known(project: Project) -> bool:
    return project.drive is not None and project.drive.motor is not None


def _start(project: Project, omega: float, reasons: dict[str, str]) -> RunUp | None:
    if _known(project):
        return start_up(project.screen, project.drive, speed=omega)
    try:
        return start_up(project.screen, speed=omega)
    except InputError as error:
        # Nobody gave this drive, so the rest of the analysis need not end with it.
        reasons["start"] = f"no drive is given, and none can be assumed ({error})"
        return None


def _jump(screen: FlipFlowScreen, omega: float, reasons: dict[str, str]) -> JumpRisk | None:
    try:
        return jump_risk(screen, omega)
    except IncompleteError as error:
        reasons["jump"] = str(error).rstrip(".")
        return None
