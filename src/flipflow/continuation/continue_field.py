"""Follow a periodic motion over a field of the machine."""

from __future__ import annotations

from typing import cast

from flipflow import __version__
from flipflow.continuation.branch_status import BranchStatus
from flipflow.continuation.correction import QUICK, Course
from flipflow.continuation.field_branch import FieldBranch, FieldSpecialPoint
from flipflow.continuation.field_solver import FieldPoint, FieldSolver
from flipflow.continuation.special_points import (
    DOUBLING,
    STABILITY_CHANGES,
    SYMMETRY,
    find_special_points,
)
from flipflow.continuation.switching import follow_both_ways
from flipflow.errors import InputError
from flipflow.model.arguments import checked_pair
from flipflow.model.monitor import Monitor
from flipflow.model.parameters import Parameter, parameter_of
from flipflow.periodic.orbit import Orbit
from flipflow.periodic.solver import STEP_SHARE, Formulation, Point
from flipflow.periodic.stability import UNDETERMINED

POINTS = 200  # the longest step in the field is the interval divided by this
SPECIAL_SHARE = 0.8  # of the work is done where the special points are sought


def field_branch(
    orbit: Orbit, field: str, interval: tuple[float, float], sought: Formulation, monitor: Monitor
) -> FieldBranch:
    """The branch of a motion over a field, sought as a formulation has it."""
    parameter = parameter_of(orbit.machine, field)
    bounds = checked_bounds("interval", parameter, interval)
    half_turn = sought.half_turn and _stays_symmetric(parameter, bounds)
    solver = FieldSolver(
        lambda value, _: parameter.at(value).system(), bounds, parameter.value, orbit.omega,
        half_turn=half_turn, turns=sought.turns,
    )  # fmt: skip
    followed = follow_both_ways(
        solver, orbit.state, parameter.value, course_over(bounds, QUICK), monitor
    )
    traced = followed.traced
    monitor("special points", SPECIAL_SHARE)
    maps = solver.return_maps(traced.u, traced.omega, traced.jacobian)
    found, notes = find_special_points(solver, traced, maps, solver.eigenvalues(traced, maps))
    special = [
        _special(parameter, one.kind, one.point, one.index + one.share, one.spring, one.side)
        for one in found
    ]
    kind = DOUBLING if sought.turns % 2 == 0 else SYMMETRY
    ends = (followed.start, -0.5), (followed.end, traced.omega.size - 0.5)
    met = [_special(parameter, kind, point, at) for point, at in ends if point is not None]
    special = sorted([*special, *met], key=lambda point: point.position)
    points = solver.points(traced)
    machines = [parameter.at(float(value)) for value in traced.omega]
    return FieldBranch(
        machine=orbit.machine,
        field=parameter.name,
        orbits=tuple(Orbit(m, point) for m, point in zip(machines, points, strict=True)),
        values=traced.omega.copy(),
        special_points=tuple(special),
        status=BranchStatus.from_code(traced.code),
        notes=tuple(notes),
        version=__version__,
    )


def course_over(bounds: tuple[float, float], tolerance: float) -> Course:
    """The course over the bounds of a field."""
    low, high = bounds
    return Course(low, high, (high - low) / POINTS, STEP_SHARE, 1.0, tolerance)


def checked_bounds(name: str, parameter: Parameter, interval: object) -> tuple[float, float]:
    """The interval (low, high) of the parameter, or a sentence that says what is wrong with it."""
    low, high = checked_pair(name, interval, f"give (low, high) of {parameter.name} in SI")
    if low >= high:
        raise InputError(name, interval, "give two finite values, the lower one first")
    for end in (low, high):
        parameter.at(end)
    if not low <= parameter.value <= high:
        own = f"the machine's {parameter.name} is {parameter.value:.9g}"
        raise InputError(name, interval, f"{own}; give an interval that holds it")
    return low, high


def _stays_symmetric(parameter: Parameter, bounds: tuple[float, float]) -> bool:
    return all(parameter.at(end).system().symmetric for end in bounds)


def _special(
    parameter: Parameter, kind: str, point: Point, position: float, spring: int = -1, side: int = 0
) -> FieldSpecialPoint:
    value = cast("FieldPoint", point).value
    word = UNDETERMINED if kind in STABILITY_CHANGES else None
    orbit = Orbit(parameter.at(value), point, word)
    return FieldSpecialPoint(kind, orbit, position, spring, side, value)
