"""What every problem offers to the arc-length loop: residual, signature, depth, scale.

Dispatch is by problem type at compile time. A compiled function handed over as an argument would
be compiled anew in every process. The plain functions serve where compiling is switched off.
"""

from __future__ import annotations

from typing import Any

from numba.core.types import NamedTuple as NamedTupleType

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

_RESIDUAL: dict[type, Any] = {
    Varied: varied.varied_residual,
    Shooting: shooting_residual,
    Balance: balance_residual,
    Sampled: sampled_residual,
}
_SIGNATURE: dict[type, Any] = {
    Varied: varied.varied_crossings,
    Shooting: crossings,
    Balance: contact_count,
    Sampled: passages,
}
_DEPTHS: dict[type, Any] = {
    Varied: varied.varied_depths,
    Shooting: flow_depths,
    Balance: series_depths,
    Sampled: sampled_depths,
}
_SCALE: dict[type, Any] = {
    Varied: varied.varied_scale,
    Shooting: state_scale,
    Balance: series_scale,
    Sampled: sampled_scale,
}


@kernel
def _no_better(problem: Any, scratch: Any, omega: float, anew: bool) -> float:
    return 0.0


@kernel
def _stays(problem: Any, scratch: Any, w: Real, tangent: Real, end: float) -> int:
    return status.OK


@kernel
def _no_section(problem: Any, scratch: Any, phase: float) -> None:
    """A series has none."""


@kernel
def _itself(problem: Any) -> Any:
    return problem


_MIRRORED: dict[type, Any] = {
    Varied: varied.varied_mirrored,
    Shooting: mirrored_shooting,
    Balance: _itself,
    Sampled: _itself,
}
_BETTER: dict[type, Any] = {
    Varied: varied.varied_better,
    Shooting: section.better_section,
    Balance: _no_better,
    Sampled: _no_better,
}
_CARRIED: dict[type, Any] = {
    Varied: varied.varied_carried,
    Shooting: section.carried,
    Balance: _stays,
    Sampled: _stays,
}
_SET: dict[type, Any] = {
    Varied: varied.varied_section,
    Shooting: section.set_section,
    Balance: _no_section,
    Sampled: _no_section,
}


def residual(problem: Any, scratch: Any, u: Real, omega: float, r: Real, J: Real) -> int:
    """Write the residual r(u, omega) and J = [dr/du, dr/d omega]; return a status."""
    return int(_RESIDUAL[type(problem)](problem, scratch, u, omega, r, J))


def signature(problem: Any, scratch: Any) -> int:
    """A number that changes when the contacts of the last residual's motion change."""
    return int(_SIGNATURE[type(problem)](problem, scratch))


def depths(problem: Any, scratch: Any, omega: float, depth: Real) -> None:
    """Write the greatest depth in m beyond each gap, (m, 2), of the last residual's motion."""
    _DEPTHS[type(problem)](problem, scratch, omega, depth)


def unknown_scale(problem: Any, u: Real, omega: float, scale: Real) -> None:
    """Write the size of each unknown."""
    _SCALE[type(problem)](problem, u, omega, scale)


def better_section(problem: Any, scratch: Any, omega: float, anew: bool) -> float:
    """Phase to which the section had better move for the motion of the last residual."""
    return float(_BETTER[type(problem)](problem, scratch, omega, anew))


def carried(problem: Any, scratch: Any, w: Real, tangent: Real, end: float) -> int:
    """Carry unknowns w = (u, omega) and a tangent dw from the section to another; a status."""
    return int(_CARRIED[type(problem)](problem, scratch, w, tangent, end))


def set_section(problem: Any, scratch: Any, phase: float) -> None:
    """Let the unknowns stand at a phase of the force."""
    _SET[type(problem)](problem, scratch, phase)


def mirrored(problem: Any) -> Any:
    """The problem of those motions that are their own mirror image after half their time."""
    return _MIRRORED[type(problem)](problem)


def _kind(problem: Any) -> Any:
    return problem.instance_class if isinstance(problem, NamedTupleType) else None


@chosen_by_type(residual)
def _residual(problem: Any, scratch: Any, u: Any, omega: Any, r: Any, J: Any) -> Any:
    chosen = _RESIDUAL[_kind(problem)]

    def run(problem: Any, scratch: Any, u: Any, omega: Any, r: Any, J: Any) -> Any:
        return chosen(problem, scratch, u, omega, r, J)

    return run


@chosen_by_type(signature)
def _signature(problem: Any, scratch: Any) -> Any:
    chosen = _SIGNATURE[_kind(problem)]

    def run(problem: Any, scratch: Any) -> Any:
        return chosen(problem, scratch)

    return run


@chosen_by_type(depths)
def _depths(problem: Any, scratch: Any, omega: Any, depth: Any) -> Any:
    chosen = _DEPTHS[_kind(problem)]

    def run(problem: Any, scratch: Any, omega: Any, depth: Any) -> Any:
        return chosen(problem, scratch, omega, depth)

    return run


@chosen_by_type(unknown_scale)
def _unknown_scale(problem: Any, u: Any, omega: Any, scale: Any) -> Any:
    chosen = _SCALE[_kind(problem)]

    def run(problem: Any, u: Any, omega: Any, scale: Any) -> Any:
        return chosen(problem, u, omega, scale)

    return run


@chosen_by_type(better_section)
def _better_section(problem: Any, scratch: Any, omega: Any, anew: Any) -> Any:
    chosen = _BETTER[_kind(problem)]

    def run(problem: Any, scratch: Any, omega: Any, anew: Any) -> Any:
        return chosen(problem, scratch, omega, anew)

    return run


@chosen_by_type(carried)
def _carried(problem: Any, scratch: Any, w: Any, tangent: Any, end: Any) -> Any:
    chosen = _CARRIED[_kind(problem)]

    def run(problem: Any, scratch: Any, w: Any, tangent: Any, end: Any) -> Any:
        return chosen(problem, scratch, w, tangent, end)

    return run


@chosen_by_type(set_section)
def _set_section(problem: Any, scratch: Any, phase: Any) -> Any:
    chosen = _SET[_kind(problem)]

    def run(problem: Any, scratch: Any, phase: Any) -> Any:
        return chosen(problem, scratch, phase)

    return run


@chosen_by_type(mirrored)
def _mirrored(problem: Any) -> Any:
    chosen = _MIRRORED[_kind(problem)]

    def run(problem: Any) -> Any:
        return chosen(problem)

    return run
