"""Follow any periodic motion over frequency, or over a field of the machine."""

from __future__ import annotations

import dataclasses
import warnings
from dataclasses import replace

from flipflow.continuation import correction
from flipflow.continuation.branch import Branch, SpecialPoint
from flipflow.continuation.continue_field import SPECIAL_SHARE, field_branch
from flipflow.continuation.field_branch import FieldBranch
from flipflow.continuation.frequency_response import SAMPLED, described, method_of
from flipflow.continuation.special_points import DOUBLING, SYMMETRY
from flipflow.continuation.switching import (
    Followed,
    beside,
    child_of,
    distance_to,
    follow_away,
    follow_both_ways,
    image,
    meeting,
)
from flipflow.errors import InputError, SampledContactWarning
from flipflow.model.arguments import checked_interval, checked_monitor
from flipflow.model.monitor import Monitor
from flipflow.model.system import Machine
from flipflow.periodic.balance_solver import SampledSolver
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.options import Method, PiecewiseExact
from flipflow.periodic.orbit import Orbit, checked_orbit
from flipflow.periodic.solver import STEP_SHARE, Formulation, Point, Solver
from flipflow.periodic.stability import UNDETERMINED

SYMMETRIC = 1e-9  # distance from its mirror image, relative: a motion within it is symmetric


def continue_orbit(
    orbit: Orbit,
    field: str,
    interval: tuple[float, float],
    *,
    monitor: Monitor | None = None,
) -> Branch | FieldBranch:
    """Follow a periodic motion over frequency or over a field of the machine, both ways.

    The motion may repeat after any number of forcing periods, be stable or not, and lie on a
    branch detached from all others. Its branch is followed through its folds by
    pseudo-arclength until it leaves the interval, closes, or meets the branch from which it comes:
    that of half its period, or of the symmetric motions. A motion that is its own mirror image is
    followed as such, so that the loss of symmetry is seen.

    Parameters
    ----------
    orbit
        Where to start: a motion of :func:`~flipflow.periodic_orbits`, of a branch, or a special
        point's.
    field
        "omega", or a field of the screen such as "clearance", or of any frozen dataclass with
        ``.system()``; of a plain system "forcing", a factor on the excitation, or a path such as
        "springs[0].clearance". The speed then stays that of ``orbit``, and the motions are exact.
    interval
        (low, high) in rad/s or in the field's SI unit; it holds the motion's own value.
    monitor
        Called before each way with a sentence and the share done; raise from it to cancel.

    Returns
    -------
    Branch or FieldBranch
        Over omega a :class:`~flipflow.continuation.branch.Branch`, else a
        :class:`~flipflow.continuation.field_branch.FieldBranch`.

    Raises
    ------
    InputError
        For a field that is not known or has no finite value, and for an interval that is empty or
        does not hold the motion.

    Warns
    -----
    SampledContactWarning
        When the orbit's own method samples the contact force.
    """
    checked_orbit("orbit", orbit)
    say = checked_monitor(monitor)
    if not isinstance(field, str) or field != "omega":
        return field_branch(orbit, field, interval, formulation_like(orbit, ExactSolver), say)
    low, high = checked_interval("interval", interval)
    if not low <= orbit.omega <= high:
        remedy = f"the motion is one at {orbit.omega:.9g} rad/s; give an interval that holds it"
        raise InputError("interval", interval, remedy)
    own = orbit.point.formulation
    sought = formulation_like(orbit, own.kind)
    solver = sought.solver()
    u = orbit.unknowns if sought is own else solver.unknowns_from(orbit.motion)
    method = method_of(sought)
    if isinstance(solver, SampledSolver):
        warnings.warn(SAMPLED, SampledContactWarning, stacklevel=2)
    followed = follow_both_ways(solver, u, orbit.omega, _course(low, high, method), say)
    say("special points", SPECIAL_SHARE)
    return _branch(orbit.machine, method, solver, followed)


def switch_branch(
    point: SpecialPoint, interval: tuple[float, float], *, monitor: Monitor | None = None
) -> Branch:
    """Follow the motions that branch off at a period doubling or a symmetry breaking.

    From a period doubling come motions of twice the periods, from a symmetry breaking motions that
    lean to one side; the mirror images of these are motions too, of the same amplitudes. The first
    motion lies a small way along the critical eigenvector of the return map and is solved for in
    the plane of fixed amplitude, omega being unknown. Motions are exact, whatever the method
    that found the point.

    Parameters
    ----------
    point
        A special point of a branch over frequency, of one of these two kinds.
    interval
        (low, high) in rad/s; it holds the point.
    monitor
        Called with a sentence and the share done; raise from it to cancel.

    Returns
    -------
    Branch
        Its first special point is the one it comes from; where it ends on the parent branch again,
        its last one is that end.

    Raises
    ------
    InputError
        For a point of another kind, or an interval that does not hold it.
    IncompleteError
        When no motion was found beside the point.
    """
    low, high = checked_interval("interval", interval)
    say = checked_monitor(monitor)
    if not isinstance(point, SpecialPoint) or point.kind not in (DOUBLING, SYMMETRY):
        raise InputError("point", point, f"give a special point: {DOUBLING} or {SYMMETRY}")
    if not low < point.omega < high:
        remedy = f"the point stands at {point.omega:.9g} rad/s; give an interval around it"
        raise InputError("interval", interval, remedy)
    parent = _exact_point(point)
    child = child_of(parent.formulation)
    method = PiecewiseExact()
    course = _course(low, high, method)
    say("the first motion", 0.0)
    first = beside(child, parent, course)
    say(f"away from {point.omega:.6g} rad/s", 0.1)
    followed = follow_away(child, first, course, parent)
    say("special points", SPECIAL_SHARE)
    return _branch(point.orbit.machine, method, child, followed)


def formulation_like(orbit: Orbit, kind: type[Solver]) -> Formulation:
    """A formulation of a kind for the orbit's periods, mirror-symmetric where the orbit is.

    The orbit's own formulation where it is of that kind already.
    """
    own = orbit.point.formulation
    symmetric = own.half_turn
    if own.system.symmetric and own.turns % 2 == 1 and not symmetric:
        half = ExactSolver(own.system, half_turn=True, turns=own.turns)
        mirrored = image(half, orbit.state, orbit.omega)
        symmetric = distance_to(orbit.state, mirrored, orbit.omega) < SYMMETRIC
    if own.kind is kind:
        return own if own.half_turn == symmetric else replace(own, half_turn=symmetric)
    return Formulation(ExactSolver, own.system, symmetric, own.turns)


def _exact_point(point: SpecialPoint) -> Point:
    """The special point of the exact flow."""
    own = point.orbit.point.formulation
    sought = formulation_like(point.orbit, ExactSolver)
    if sought is own:
        return point.orbit.point
    solver = sought.solver()
    exact = meeting(solver, solver.unknowns_from(point.orbit.motion), point.omega)
    if exact is None:
        raise InputError(
            "point", point, "no exact motion has such a point near; use PiecewiseExact"
        )
    return exact


def _course(low: float, high: float, method: Method) -> correction.Course:
    return correction.Course(
        low, high, (high - low) / method.points, STEP_SHARE, 1.0, correction.QUICK
    )


def _branch(machine: Machine, method: Method, solver: Solver, followed: Followed) -> Branch:
    """The described branch, with the points at which it meets its parent."""
    branch = described(machine, method, solver, followed.traced)
    kind = DOUBLING if solver.turns % 2 == 0 else SYMMETRY
    start, end = (
        () if point is None else (SpecialPoint(kind, Orbit(machine, point, UNDETERMINED), at),)
        for point, at in ((followed.start, -0.5), (followed.end, branch.omega.size - 0.5))
    )
    return dataclasses.replace(branch, special_points=(*start, *branch.special_points, *end))
