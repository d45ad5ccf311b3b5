"""What every problem offers to the arc-length loop: residual, signature, depth, scale, section.

Dispatch is by problem type at compile time. A compiled function handed over as an argument would
be compiled anew in every process. The plain functions serve where compiling is switched off.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from flipflow.compiled import status
from flipflow.compiled.arrays import Real
from flipflow.compiled.compile import chosen_by_type, kernel
from flipflow.continuation import varied
from flipflow.continuation.varied import Varied
from flipflow.periodic import section
from flipflow.periodic.balance import balance_residual, series_scale
from flipflow.periodic.sampled import (
    Sampled,
    passages,
    sampled_depths,
    sampled_residual,
    sampled_scale,
)
from flipflow.periodic.series import Balance, contact_count, series_depths
from flipflow.periodic.shooting import (
    Shooting,
    crossings,
    flow_depths,
    mirrored_shooting,
    shooting_residual,
    state_scale,
)


class Operations(NamedTuple):
    """The kernels of one kind of problem, by the names of the functions below."""

    residual: Any
    signature: Any
    depths: Any
    unknown_scale: Any
    better_section: Any
    carried: Any
    carried_home: Any
    set_section: Any
    mirrored: Any


@kernel
def _no_better(problem: Any, scratch: Any, omega: float) -> float:
    return 0.0


@kernel
def _stays(problem: Any, scratch: Any, w: Real, tangent: Real, end: float) -> int:
    return status.OK


@kernel
def _is_home(problem: Any, scratch: Any, w: Real, tangent: Real) -> int:
    return status.OK


@kernel
def _no_section(problem: Any, scratch: Any, phase: float, anew: bool) -> None:
    """A series has none."""


@kernel
def _itself(problem: Any) -> Any:
    return problem


_WITHOUT_SECTION = _no_better, _stays, _is_home, _no_section, _itself
OPERATIONS: dict[type, Operations] = {
    Shooting: Operations(
        shooting_residual, crossings, flow_depths, state_scale,
        section.better_section, section.carried, section.carried_home, section.set_section,
        mirrored_shooting,
    ),
    Varied: Operations(
        varied.varied_residual, varied.varied_crossings, varied.varied_depths,
        varied.varied_scale, varied.varied_better, varied.varied_carried,
        varied.varied_home, varied.varied_section, varied.varied_mirrored,
    ),
    Balance: Operations(
        balance_residual, contact_count, series_depths, series_scale, *_WITHOUT_SECTION
    ),
    Sampled: Operations(
        sampled_residual, passages, sampled_depths, sampled_scale, *_WITHOUT_SECTION
    ),
}  # fmt: skip


def residual(problem: Any, scratch: Any, u: Real, omega: float, r: Real, J: Real) -> int:
    """Write the residual r(u, omega) and J = [dr/du, dr/d omega]; return a status."""
    return int(OPERATIONS[type(problem)].residual(problem, scratch, u, omega, r, J))


def signature(problem: Any, scratch: Any) -> int:
    """A number that changes when the contacts of the last residual's motion change."""
    return int(OPERATIONS[type(problem)].signature(problem, scratch))


def depths(problem: Any, scratch: Any, omega: float, depth: Real) -> None:
    """Write the greatest depth in m beyond each gap, (m, 2), of the last residual's motion."""
    OPERATIONS[type(problem)].depths(problem, scratch, omega, depth)


def unknown_scale(problem: Any, u: Real, omega: float, scale: Real) -> None:
    """Write the size of each unknown."""
    OPERATIONS[type(problem)].unknown_scale(problem, u, omega, scale)


def better_section(problem: Any, scratch: Any, omega: float) -> float:
    """Phase to which the section had better move for the motion of the last residual."""
    return float(OPERATIONS[type(problem)].better_section(problem, scratch, omega))


def carried(problem: Any, scratch: Any, w: Real, tangent: Real, end: float) -> int:
    """Carry unknowns w = (u, omega) and a tangent dw from the section to another; a status."""
    return int(OPERATIONS[type(problem)].carried(problem, scratch, w, tangent, end))


def carried_home(problem: Any, scratch: Any, w: Real, tangent: Real) -> int:
    """Carry unknowns that Newton's last step reached, and a tangent, to section 0; a status."""
    return int(OPERATIONS[type(problem)].carried_home(problem, scratch, w, tangent))


def set_section(problem: Any, scratch: Any, phase: float, anew: bool) -> None:
    """Let the unknowns stand at a phase of the force; ``anew`` forgets how good the last was."""
    OPERATIONS[type(problem)].set_section(problem, scratch, phase, anew)


def mirrored(problem: Any) -> Any:
    """The problem of motions that are their own mirror image after half their time.

    The problem itself where it is that already, and where there is none, as of a series.
    """
    return OPERATIONS[type(problem)].mirrored(problem)


def _choose(operation: Any) -> None:
    """Let kernels call an operation: of the problem's own kind, chosen when they are compiled."""

    @chosen_by_type(operation)
    def choose(problem: Any, *rest: Any) -> Any:
        chosen = getattr(OPERATIONS[problem.instance_class], operation.__name__)

        def run(problem: Any, *rest: Any) -> Any:
            return chosen(problem, *rest)

        return run


for _operation in (
    residual, signature, depths, unknown_scale, better_section, carried, carried_home, set_section,
    mirrored,
):  # fmt: skip
    _choose(_operation)
