"""Which periodic motions exist over frequency."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from itertools import chain
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flipflow import __version__
from flipflow.compiled import status
from flipflow.compiled.arrays import Real
from flipflow.continuation import correction
from flipflow.continuation.branch import Branch, SpecialPoint
from flipflow.continuation.branch_status import BranchStatus
from flipflow.continuation.special_points import STABILITY_CHANGES, Found, find_special_points
from flipflow.continuation.starts import found_motions
from flipflow.dynamics.contact_free_range import contact_free_up_to
from flipflow.errors import IncompleteError, InputError, SampledContactWarning
from flipflow.model.arguments import checked_interval
from flipflow.model.contact_law import pushes_whole
from flipflow.model.system import Machine, MechanicalSystem, system_of
from flipflow.periodic.balance_solver import BalanceSolver, SampledSolver
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.one_state import contact_free_motion, state_of, touches_nothing
from flipflow.periodic.options import (
    HarmonicBalance,
    Method,
    PiecewiseExact,
    SampledHarmonicBalance,
    checked_method,
)
from flipflow.periodic.orbit import Orbit, state_at_rest
from flipflow.periodic.solver import STEP_SHARE, Formulation, Solver, Traced
from flipflow.periodic.stability import (
    UNDETERMINED,
    beyond_where_rising,
    full_turn,
    saddle_side,
    stability_words,
)
from flipflow.periodic.two_event import TwoEventProblem

SETTLING_TURNS = 4000  # forcing periods for which a machine is left to settle from rest
BACK = 0.6  # share of the last frequency without contact down to which its branch may turn back
STEPS_UP = 8  # least steps from there to the frequency asked for
RATIO_UP = 1.25  # of the frequencies above that are tried for a motion without contact
RATIOS_UP = 40  # of them at most
RATIO_SETTLED = 2.0  # of those at which the machine is left to settle
RATIOS_SETTLED = 6  # of them at most
REPEATS = 1e-8  # share of a motion within which it is the same after half a turn
SAMPLED = (
    "The contact force was sampled at fixed times, to reproduce that method: the branch may stall "
    "or show turning points that the machine does not have. HarmonicBalance integrates it exactly."
)


class Way(NamedTuple):
    """How a branch is followed of which only the last point is wanted."""

    share: float  # longest step in the unknowns, as a share of their size
    tolerance: float  # last Newton step, in steps
    points: int  # after which it is given up


# Where long steps end short of the frequency asked for, as at a corner, short ones try again.
WAYS = (
    Way(2.0, correction.TOLERATED, 1_000),
    Way(STEP_SHARE, correction.QUICK, 3_000),
)


def frequency_response(
    machine: Machine, omega: tuple[float, float], method: Method | None = None
) -> Branch:
    """Follow the periodic motions of a machine over an interval of frequency.

    The branch is the one reached from below: it starts from the motion that is connected with
    the contact-free one at lower frequency, and is followed through its folds by pseudo-arclength
    until it leaves the interval. Every point has its stability and error, every special point is
    refined. Motions detached from this branch are not seen. A machine that stands on its stops has
    no motion without contact: there the branch is that of the motion into which it settles or,
    where that one turns back, one that motions at higher frequencies lead down to.

    Parameters
    ----------
    machine
        Whatever has ``.system()``: a screen or a :class:`~flipflow.MechanicalSystem`.
    omega
        The interval (low, high) in rad/s.
    method
        :class:`~flipflow.PiecewiseExact` (default) or :class:`~flipflow.HarmonicBalance`;
        :class:`~flipflow.SampledHarmonicBalance` only to reproduce what others do.

    Returns
    -------
    Branch
        Its ``status`` says whether the whole interval was covered.

    Raises
    ------
    InputError
        For an interval that is empty, reversed or absurd, and for a machine without damping.

    Warns
    -----
    SampledContactWarning
        When the method samples the contact force; the branch has the same sentence as a note.
    """
    low, high = checked_interval("omega", omega)
    method = checked_method(method)
    solver = solver_for(system_of(machine), method)
    course = correction.Course(
        low, high, (high - low) / method.points, STEP_SHARE, 1.0, correction.QUICK
    )
    if isinstance(solver, SampledSolver):
        warnings.warn(SAMPLED, SampledContactWarning, stacklevel=2)
    return followed(machine, method, solver, course)


def followed(machine: Machine, method: Method, solver: Solver, course: correction.Course) -> Branch:
    """The branch over ``course`` with stability and special points."""
    traced = solver.trace(first_unknowns(solver, course.lower), course.lower, course)
    if traced.code == status.REACHED_LOWER and not _begins_free(solver, course.lower):
        spanning = (one for one in _others(solver, course) if one.code == status.REACHED_UPPER)
        traced = next(spanning, traced)
    return described(machine, method, solver, traced)


def _begins_free(solver: Solver, omega: float) -> bool:
    """Whether some lower frequency than ``omega`` touches no stop."""
    return contact_free_up_to(solver.machine, solver.flow.modes, omega) > 0.0


def _others(solver: Solver, course: correction.Course) -> Iterator[Traced]:
    """Other branches at the lower bound, to which motions at higher frequencies lead down.

    A machine that stands on its stops is reached from below by many motions, and that into which
    it happens to settle may lie on a branch that only turns back.
    """
    down = course._replace(direction=-1.0)
    start = some_unknowns(solver, course.upper)
    last = solver.end_of_branch(start, course.upper, down)
    if last is not None:
        yield solver.trace(last, course.lower, course)
    exact = _exact(solver, half_turn=solver.half_turn)
    for z in chain(_followed_down(exact, course.lower), _settled_above(exact, course.lower)):
        u = _unknowns_of(solver, exact, z, course.lower)
        yield solver.trace(u, course.lower, course)


def described(machine: Machine, method: Method, solver: Solver, traced: Traced) -> Branch:
    """Stability and special points of traced motions."""
    if traced.omega.size == 0:
        return _finished(machine, method, solver, traced, np.zeros((0, 0, 0)), [], [])
    maps = solver.return_maps(traced.u, traced.omega, traced.jacobian)
    eigenvalues = solver.eigenvalues(traced, maps)
    found, notes = find_special_points(solver, traced, maps, eigenvalues)
    return _finished(machine, method, solver, traced, maps, found, notes, eigenvalues)


def solver_for(system: MechanicalSystem, method: Method) -> Solver:
    """A solver of a method's equations for a machine: see :func:`formulation_of`."""
    return formulation_of(system, method).solver()


def formulation_of(
    system: MechanicalSystem, method: Method, *, half_turn: bool | None = None, turns: int = 1
) -> Formulation:
    """The equations of a method. Without stops all are the closed form, which shooting meets."""
    symmetric = system.symmetric if half_turn is None else half_turn
    linear = system.with_bonded()
    if isinstance(method, HarmonicBalance) and linear.springs:
        for spring in linear.springs:
            if not pushes_whole(spring.law):
                raise InputError("law", spring.law, "it has no series: give PiecewiseExact()")
        return Formulation(BalanceSolver, linear, symmetric, options=(method.harmonics,))
    if isinstance(method, SampledHarmonicBalance) and linear.springs:
        for spring in linear.springs:
            if spring.law != "paper":
                remedy = "only the paper's law has a smooth form to sample"
                raise InputError("law", spring.law, remedy)
        options = method.harmonics, method.samples, method.sharpness
        return Formulation(SampledSolver, linear, symmetric, options=options)
    return Formulation(ExactSolver, linear, symmetric, turns)


def method_of(formulation: Formulation) -> Method:
    """The method that a formulation belongs to, with the usual number of points."""
    if formulation.kind is SampledSolver:
        harmonics, samples, sharpness = formulation.options
        return SampledHarmonicBalance(int(harmonics), int(samples), sharpness)
    if formulation.kind is BalanceSolver:
        return HarmonicBalance(int(formulation.options[0]))
    return PiecewiseExact()


def first_unknowns(solver: Solver, omega: float) -> Real:
    """Unknowns of the motion at ``omega`` that is reached from below.

    Where no lower frequency touches a stop, it is the contact-free motion. Otherwise the branch is
    followed up from the last motion without contact, but where the scalar problem of one stop tells
    that there is only one motion. Where no lower one is without contact, the motion is that into
    which the machine settles from rest; failing that, that on the branch which has no contact at
    some higher frequency; failing that, any.
    """
    free = contact_free_up_to(solver.machine, solver.flow.modes, omega)
    if free == omega:
        return contact_free_unknowns(solver, omega)
    last = _followed_up(solver, free, omega) if free > 0.0 else None
    return some_unknowns(solver, omega) if last is None else last


def some_unknowns(solver: Solver, omega: float) -> Real:
    """Unknowns of a motion that is not reached from below, or the best guess of one."""
    settled = settled_unknowns(solver, omega)
    if solver.starts(settled, omega):
        return settled
    exact = _exact(solver, half_turn=solver.half_turn)
    ways = _followed_down(exact, omega), found_motions(exact, omega), _settled_above(exact, omega)
    for z in chain(*ways):
        u = _unknowns_of(solver, exact, z, omega)
        if solver.starts(u, omega):
            return u
    return settled


def _followed_down(solver: ExactSolver, omega: float) -> Iterator[Real]:
    """State at ``omega`` on the branch that is without contact at a higher frequency."""
    for free in (omega * RATIO_UP ** np.arange(1, RATIOS_UP)).tolist():
        if touches_nothing(solver.system, *contact_free_motion(solver.system, free)):
            break
    else:
        return
    last = _led(solver, contact_free_unknowns(solver, free), free, omega)
    if last is not None:
        yield last


def _settled_above(solver: ExactSolver, omega: float) -> Iterator[Real]:
    """States at ``omega`` on branches of what the machine settles to from rest at higher ones.

    At low frequency a turn on the way to a motion may have more contacts than can be recorded.
    """
    for above in (omega * RATIO_SETTLED ** np.arange(1, RATIOS_SETTLED)).tolist():
        start = settled_unknowns(solver, above)
        last = _led(solver, start, above, omega) if solver.starts(start, above) else None
        if last is not None:
            yield last


def _followed_up(solver: Solver, free: float, omega: float) -> Real | None:
    """Unknowns at ``omega`` on the branch of the motion without contact at ``free``.

    A machine that is its own mirror image is followed by half turns: over whole ones the loop may
    leave the branch, or end, where motions that lean to one side begin.
    """
    if isinstance(solver, ExactSolver) and not solver.half_turn and solver.system.symmetric:
        solver = ExactSolver(solver.system, half_turn=True)
    only = _only_unknowns(solver, omega)
    if only is not None:
        return only
    return _led(solver, contact_free_unknowns(solver, free), free, omega)


def _only_unknowns(solver: Solver, omega: float) -> Real | None:
    """The only motion at ``omega`` that touches once a half turn; None where there may be more."""
    if not isinstance(solver, ExactSolver) or not solver.half_turn:
        return None
    if not TwoEventProblem.applies(solver.system):
        return None
    share, only = TwoEventProblem(solver.machine, solver.flow).only(omega)
    found = solver.residual(only, omega) if share > 0.0 else None
    if found is None:
        return None
    lengths = np.repeat([1.0, 1.0 / omega], solver.system.size)
    # It does not repeat where there are other events than those assumed.
    same = np.abs(lengths * found[0]).max() <= REPEATS * np.abs(lengths * only).max()
    return only if same else None


def _led(solver: Solver, start: Real, begin: float, omega: float) -> Real | None:
    """Unknowns at ``omega`` on the branch through a motion at another frequency."""
    up, step = omega > begin, abs(omega - begin) / STEPS_UP
    low, high = (BACK * begin, omega) if up else (omega, begin / BACK)
    for way in WAYS:
        direction = 1.0 if up else -1.0
        course = correction.Course(low, high, step, way.share, direction, way.tolerance)
        last = solver.end_of_branch(start, begin, course, way.points)
        if last is not None:
            return last
    return None


def contact_free_unknowns(solver: Solver, omega: float) -> Real:
    """The solver's unknowns of the linear motion."""
    rest, X = contact_free_motion(solver.system, omega)
    if isinstance(solver, BalanceSolver):
        return solver.unknowns_of(solver.system.orders, rest, X)
    return state_of(solver.system, rest, X, omega)


def settled_unknowns(solver: Solver, omega: float) -> Real:
    """Unknowns of the motion into which the machine settles from rest, or the best guess of it."""
    exact = _exact(solver, half_turn=False)
    z = exact.settled(state_at_rest(exact.system), omega, SETTLING_TURNS)
    point = None if exact is solver else exact.solve(z, omega)
    return _unknowns_of(solver, exact, z if point is None else point.u, omega)


def _unknowns_of(solver: Solver, exact: ExactSolver, z: Real, omega: float) -> Real:
    """Unknowns of the motion from a state; where its flow does not end, of that without contact."""
    if exact is solver:
        return z
    try:
        return solver.unknowns_from(exact.motion(z, omega))
    except IncompleteError:
        return contact_free_unknowns(solver, omega)


def _exact(solver: Solver, *, half_turn: bool) -> ExactSolver:
    """The solver itself where it is exact, else one of the same machine."""
    if isinstance(solver, ExactSolver):
        return solver
    return ExactSolver(solver.system, half_turn=half_turn)


def _finished(
    machine: Machine,
    method: Method,
    solver: Solver,
    traced: Traced,
    maps: Real,
    found: list[Found],
    notes: list[str],
    eigenvalues: NDArray[np.complex128] | None = None,
) -> Branch:
    if eigenvalues is None:
        eigenvalues = np.zeros((0, 2 * solver.system.size), np.complex128)
    told = eigenvalues.size and not solver.reads_jacobian
    side = saddle_side(traced.tangent[:, -1], eigenvalues) if told else None
    beyond = beyond_where_rising(traced.tangent[:, -1], eigenvalues)
    special = tuple(
        SpecialPoint(
            one.kind,
            Orbit(machine, one.point, word_of(one.kind)),
            one.index + one.share,
            one.spring,
            one.side,
        )
        for one in found
    )
    return Branch(
        machine=machine,
        method=method,
        formulation=solver.formulation,
        traced=traced,
        return_maps=maps,
        saddle_side_at_start=beyond,
        multipliers=full_turn(eigenvalues, half_turn=solver.half_turn),
        stability=stability_words(eigenvalues, side),
        special_points=special,
        status=BranchStatus.from_code(traced.code),
        notes=(*([SAMPLED] if isinstance(solver, SampledSolver) else []), *notes),
        version=__version__,
    )


def word_of(kind: str) -> str | None:
    """The stability where it changes, which is neither; None leaves it to the multipliers."""
    return UNDETERMINED if kind in STABILITY_CHANGES else None
