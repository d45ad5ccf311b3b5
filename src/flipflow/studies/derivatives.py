"""Exact derivatives of motions, of what is read off them, and of special points."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Complex, Real
from flipflow.continuation.branch import SpecialPoint
from flipflow.continuation.special_points import (
    CONTACT_BEGIN,
    CONTACT_END,
    DOUBLING,
    FOLD,
    NEIMARK_SACKER,
    SYMMETRY,
)
from flipflow.dynamics.machine_columns import Named, machine_columns
from flipflow.errors import IncompleteError, InputError
from flipflow.model.arguments import checked_index, checked_text, members_of
from flipflow.model.parameters import differentiable
from flipflow.model.quantities import Quantity, missing_words, quantities_for
from flipflow.model.system import Coordinate, Machine
from flipflow.periodic.derivatives import MotionDerivatives
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.orbit import Orbit
from flipflow.studies.quantity_values import MOTION_VALUES
from flipflow.studies.tilted_motion import TILT, TiltedMotion

Asked = str | tuple[str, Coordinate]
OMEGA = "omega"
STATE, MULTIPLIERS = "state", "multipliers"
# Readings of an orbit by the names of its methods, each with a coordinate or a spring.
READINGS: Mapping[str, Callable[[TiltedMotion, Coordinate], Complex]] = {
    "amplitude": lambda motion, which: motion.amplitude(which),
    "mean": lambda motion, which: motion.mean(which),
    "phase": lambda motion, which: motion.phase(which),
    "mean_square_velocity": lambda motion, which: motion.mean_square_velocity(which),
    "contact_share": lambda motion, spring: motion.contact_share(_spring(motion, spring)),
    "stop_force_peak": lambda motion, spring: motion.stop_force_peak(_spring(motion, spring)),
}
# What moves as a square root beside a grazing.
ROOTS = (MULTIPLIERS, "largest_multiplier", "contact_share", "stop_approach_speed")
NULL = 1e-4  # share of the largest singular value of I - M below which one is that of a fold
JUMPED = 1e-3  # distance of a multiplier from what it is at a special point beyond which it jumps


def orbit_sensitivity(orbit: Orbit, quantity: Asked, names: Sequence[str]) -> NDArray[Any]:
    """Derivatives of what is read off a motion: see :meth:`flipflow.Orbit.sensitivity`."""
    asked = _checked_names(names)
    reading = _reading(orbit, quantity)
    parameters = [_named(orbit.machine, name) for name in asked if name != OMEGA]
    slopes = _slopes(orbit, parameters)
    slopes.require_smooth(roots=(quantity[0] if isinstance(quantity, tuple) else quantity) in ROOTS)
    if quantity == STATE:
        found: NDArray[Any] = slopes.state
    elif quantity == MULTIPLIERS:
        found = slopes.multipliers[1]
    else:
        tilted = reading(TiltedMotion(orbit, parameters, slopes))
        found = np.asarray(tilted.imag / TILT)[:-1]
    order = _columns_of(asked, parameters)
    return np.asarray(found[..., order])


def point_sensitivity(point: SpecialPoint, names: Sequence[str]) -> Real:
    """Derivatives of a special point's frequency: see :meth:`flipflow.SpecialPoint.sensitivity`."""
    asked = _checked_names(names)
    if OMEGA in asked:
        remedy = "the frequency is what the point answers with; name parameters of the machine"
        raise InputError("names", OMEGA, remedy)
    if point.kind not in _TESTS:
        known = ", ".join(_TESTS)
        raise InputError("kind", point.kind, f"a derivative is known of {known}")
    parameters = [_named(point.orbit.machine, name) for name in asked]
    slope = _TESTS[point.kind](point, parameters, _slopes(point.orbit, parameters))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(-slope[:-1] / slope[-1])


def _checked_names(names: object) -> tuple[str, ...]:
    """Names of parameters."""
    found = members_of(names)
    if not found:
        remedy = 'give names of parameters in a list, such as ["clearance"]'
        raise InputError("names", names, remedy)
    return tuple(checked_text("names", name) for name in found)


def _named(machine: Machine, name: str) -> Named:
    """A parameter of a machine, as its systems see it."""
    parameter = differentiable(machine, name)
    return Named(parameter.name, parameter.value, lambda value: parameter.at(value).system())


def _slopes(orbit: Orbit, parameters: Sequence[Named]) -> MotionDerivatives:
    """The motion's derivatives with respect to parameters and omega."""
    columns = machine_columns(orbit.machine.system(), parameters)
    return MotionDerivatives(orbit.point.formulation, orbit.state, orbit.omega, columns)


def _columns_of(asked: Sequence[str], parameters: Sequence[Named]) -> list[int]:
    """Where the derivatives with respect to each name stand; those to omega stand last."""
    places = iter(range(len(parameters)))
    return [len(parameters) if name == OMEGA else next(places) for name in asked]


def _reading(orbit: Orbit, quantity: object) -> Callable[[TiltedMotion], Complex]:
    """How a quantity is read off a tilted motion."""
    if isinstance(quantity, tuple) and len(quantity) == 2:
        name, which = quantity
        if isinstance(name, str) and name in READINGS:
            read = READINGS[name]
            return lambda motion: read(motion, which)
    known = {
        name: one
        for name, one in quantities_for(orbit.machine).items()
        if one.of == "motion" and not one.of_folds
    }
    if isinstance(quantity, str) and quantity in (STATE, MULTIPLIERS):
        return lambda motion: motion.omega
    if not isinstance(quantity, str) or quantity not in known:
        pairs = ", ".join(f'("{name}", ...)' for name in READINGS)
        remedy = f"choose one of {STATE}, {MULTIPLIERS}, {', '.join(known)}, {pairs}"
        raise InputError("quantity", quantity, remedy)
    return _of_table(orbit, known[quantity])


def _of_table(orbit: Orbit, quantity: Quantity) -> Callable[[TiltedMotion], Complex]:
    """How a quantity of the table is read off."""
    which, part = quantity.coordinate, quantity.part
    if part is not None and which is not None:
        return lambda motion: READINGS[part](motion, which)
    missing = quantity.missing(orbit.machine)
    if missing:
        raise InputError("quantity", quantity.name, missing_words(missing))
    formula = cast("Callable[[Any], Complex]", MOTION_VALUES[quantity.name])
    return lambda motion: np.asarray(formula(motion))


def _spring(motion: TiltedMotion, number: object) -> int:
    """The number of a spring of the machine."""
    count = len(motion.machine.system().springs)
    return checked_index("spring", number, count, f"the machine has {count} springs, from 0 on")


def _of_fold(point: SpecialPoint, parameters: Sequence[Named], slopes: MotionDerivatives) -> Real:
    """l r_p of the residual, (P + 1,): l the left vector of the eigenvalue +1."""
    J, D = slopes.residual_slopes
    scale = slopes.scale
    left, sizes, _ = np.linalg.svd(J * scale / scale[:, None])
    null = np.count_nonzero(sizes < NULL * max(float(sizes[0]), 1.0))
    if null != 1:
        raise IncompleteError(
            f"The fold at {point.omega:.9g} rad/s of {_words(parameters)} is no smooth one: "
            + ("the branch turns at a corner." if null == 0 else "several multipliers are 1.")
        )
    return np.asarray((left[:, -1] / scale) @ D)


def _of_contact(
    point: SpecialPoint, parameters: Sequence[Named], slopes: MotionDerivatives
) -> Real:
    """Derivatives of the depth beyond the gap, (P + 1,)."""
    motion = TiltedMotion(point.orbit, parameters, slopes)
    return np.asarray(motion.depth(point.spring, point.side).imag / TILT)[:-1]


def _of_doubling(
    point: SpecialPoint, parameters: Sequence[Named], slopes: MotionDerivatives
) -> Real:
    """Derivatives of the eigenvalue -1 of the return map, (P + 1,)."""
    if slopes.solver.half_turn and not slopes.half_turn:
        raise IncompleteError(
            f"The motion loses a symmetry at {point.omega:.9g} rad/s that the machine itself has "
            f"not with other values of {_words(parameters)}: there is no such point beside it."
        )
    value, slope = slopes.eigenvalues
    off = np.abs(value + 1.0)
    _refuse_corner(point, parameters, off.min(), "no multiplier is -1")
    return np.asarray(slope[int(off.argmin())].real)


def _of_neimark_sacker(
    point: SpecialPoint, parameters: Sequence[Named], slopes: MotionDerivatives
) -> Real:
    """Derivatives of half the square of the size of the pair on the unit circle, (P + 1,)."""
    value, slope = slopes.eigenvalues
    away = np.where(value.imag > 0.0, np.abs(np.abs(value) - 1.0), np.inf)
    pair = int(away.argmin())
    _refuse_corner(point, parameters, away[pair], "no pair of multipliers has the size 1")
    return np.asarray((value[pair].conjugate() * slope[pair]).real)


def _refuse_corner(point: SpecialPoint, parameters: Sequence[Named], off: float, why: str) -> None:
    """Refuse an exact point at which multipliers jump past what they are said to be."""
    if off > JUMPED and point.orbit.point.formulation.kind is ExactSolver:
        raise IncompleteError(
            f"The {point.kind} at {point.omega:.9g} rad/s of {_words(parameters)} is no smooth "
            f"one: {why}, the branch has a corner there."
        )


_TESTS: Mapping[str, Callable[[SpecialPoint, Sequence[Named], MotionDerivatives], Real]] = {
    FOLD: _of_fold,
    CONTACT_BEGIN: _of_contact,
    CONTACT_END: _of_contact,
    SYMMETRY: _of_doubling,
    DOUBLING: _of_doubling,
    NEIMARK_SACKER: _of_neimark_sacker,
}


def _words(parameters: Sequence[Named]) -> str:
    return ", ".join(one.name for one in parameters)
