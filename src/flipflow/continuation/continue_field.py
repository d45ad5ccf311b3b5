"""Follow a periodic motion, or a fold, over a field of the machine."""

from __future__ import annotations

from functools import partial
from typing import cast

import numpy as np

from flipflow import __version__
from flipflow.continuation.branch import SpecialPoint
from flipflow.continuation.branch_status import BranchStatus
from flipflow.continuation.correction import QUICK, SHARP, Course
from flipflow.continuation.field_branch import FieldBranch, FieldSpecialPoint
from flipflow.continuation.field_solver import FieldPoint, FieldSolver, FoldSolver, SystemAt
from flipflow.continuation.refinement import FOLD as OF_FOLD
from flipflow.continuation.special_points import (
    DOUBLING,
    FOLD,
    STABILITY_CHANGES,
    SYMMETRY,
    Test,
    find_special_points,
    zeros_of,
)
from flipflow.continuation.switching import follow_both_ways
from flipflow.errors import InputError
from flipflow.model.arguments import checked_monitor, checked_pair
from flipflow.model.monitor import Monitor
from flipflow.model.parameters import Parameter, parameter_of
from flipflow.model.system import Machine
from flipflow.periodic.orbit import Orbit
from flipflow.periodic.solver import STEP_SHARE, Formulation, Point, Traced
from flipflow.periodic.stability import UNDETERMINED

POINTS = 200  # the longest step in the field is the interval divided by this
SPECIAL_SHARE = 0.8  # of the work is done where the special points are sought
CUSP = "cusp"


def continue_fold(
    fold: SpecialPoint,
    field: str,
    interval: tuple[float, float],
    *,
    monitor: Monitor | None = None,
) -> FieldBranch:
    """Follow a fold over a field of the machine: the jump speed as the machine is changed.

    Unknowns are the motion, omega and the field; the equations those of the motion and
    det(I - P) = 0 with P its return map. Where two folds are born in a cusp the curve passes
    from the one to the other.

    Parameters
    ----------
    fold
        A fold of a branch over frequency.
    field
        A field of the screen, such as "clearance", or of any frozen dataclass with ``.system()``;
        of a plain system "forcing", a factor on the excitation, or a path such as
        "springs[0].clearance".
    interval
        (low, high) in the field's SI unit; it holds the machine's own value.
    monitor
        Called before each way with a sentence and the share done; raise from it to cancel.

    Returns
    -------
    FieldBranch
        Its ``omega`` varies along the curve; special points are "cusp", and "fold" where the
        curve itself turns back in the field elsewhere.

    Raises
    ------
    InputError
        For a point that is not a fold, a field that is not known or has no finite value, and an
        interval that is empty or does not hold it.
    """
    if not isinstance(fold, SpecialPoint) or fold.kind != FOLD:
        raise InputError("fold", fold, "give a fold of a branch, such as branch.folds[0]")
    say = checked_monitor(monitor)
    orbit = fold.orbit
    parameter = parameter_of(orbit.machine, field)
    bounds = _check_bounds(parameter, interval)
    own = orbit.point.formulation
    solver = FoldSolver(
        _system_of(parameter), bounds, parameter.value,
        half_turn=own.half_turn and _stays_symmetric(parameter, bounds), turns=own.turns,
    )  # fmt: skip
    u = np.append(orbit.state, orbit.omega)
    traced = follow_both_ways(solver, u, parameter.value, _course(bounds, SHARP), say).traced
    say("special points", SPECIAL_SHARE)
    zero = partial(solver.zero_between, traced, OF_FOLD)
    test = Test(CUSP, traced.tangent[:, -1], lambda point: point.omega_tangent, zero=zero)
    found, notes = zeros_of([test], solver, traced)
    turns = np.diff(np.sign(traced.tangent[:, -2])) != 0.0
    special = [
        _special(parameter, CUSP if turns[one.index] else FOLD, one.point, one.index + one.share)
        for one in found
    ]
    return _finished(orbit.machine, parameter, solver, traced, special, notes, UNDETERMINED)


def field_branch(
    orbit: Orbit, field: str, interval: tuple[float, float], sought: Formulation, monitor: Monitor
) -> FieldBranch:
    """The branch of a motion over a field, sought as a formulation has it."""
    parameter = parameter_of(orbit.machine, field)
    bounds = _check_bounds(parameter, interval)
    half_turn = sought.half_turn and _stays_symmetric(parameter, bounds)
    solver = FieldSolver(
        _system_of(parameter), bounds, parameter.value, orbit.omega,
        half_turn=half_turn, turns=sought.turns,
    )  # fmt: skip
    followed = follow_both_ways(
        solver, orbit.state, parameter.value, _course(bounds, QUICK), monitor
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
    return _finished(orbit.machine, parameter, solver, traced, special, notes, None)


def _course(bounds: tuple[float, float], tolerance: float) -> Course:
    low, high = bounds
    return Course(low, high, (high - low) / POINTS, STEP_SHARE, 1.0, tolerance)


def _check_bounds(parameter: Parameter, interval: object) -> tuple[float, float]:
    """The interval (low, high) of the parameter, or a sentence that says what is wrong with it."""
    low, high = checked_pair("interval", interval, f"give (low, high) of {parameter.name} in SI")
    if low >= high:
        raise InputError("interval", interval, "give two finite values, the lower one first")
    for end in (low, high):
        parameter.at(end)
    if not low <= parameter.value <= high:
        own = f"the machine's {parameter.name} is {parameter.value:.9g}"
        raise InputError("interval", interval, f"{own}; give an interval that holds it")
    return low, high


def _stays_symmetric(parameter: Parameter, bounds: tuple[float, float]) -> bool:
    return all(parameter.at(end).system().symmetric for end in bounds)


def _system_of(parameter: Parameter) -> SystemAt:
    return lambda value: parameter.at(value).system()


def _special(
    parameter: Parameter, kind: str, point: Point, position: float, spring: int = -1, side: int = 0
) -> FieldSpecialPoint:
    value = cast("FieldPoint", point).value
    word = UNDETERMINED if kind in (*STABILITY_CHANGES, CUSP) else None
    orbit = Orbit(parameter.at(value), point, word)
    return FieldSpecialPoint(kind, orbit, position, spring, side, value)


def _finished(
    machine: Machine, parameter: Parameter, solver: FieldSolver, traced: Traced,
    special: list[FieldSpecialPoint], notes: list[str], word: str | None,
) -> FieldBranch:  # fmt: skip
    points = solver.points(traced)
    machines = [parameter.at(float(value)) for value in traced.omega]
    return FieldBranch(
        machine=machine,
        field=parameter.name,
        orbits=tuple(Orbit(m, point, word) for m, point in zip(machines, points, strict=True)),
        values=traced.omega.copy(),
        special_points=tuple(special),
        status=BranchStatus.from_code(traced.code),
        notes=tuple(notes),
        version=__version__,
    )
