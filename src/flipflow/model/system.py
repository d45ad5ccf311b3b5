"""The equation of motion: M x'' + C x' + K x + forces of the stops = exciting force."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Protocol, cast, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow.errors import InputError
from flipflow.model.arguments import (
    LARGEST,
    TOO_LARGE,
    checked_all,
    checked_index,
    checked_mapping,
    checked_numbers,
    checked_reals,
    takes,
)
from flipflow.model.elements import ClearanceSpring, frozen_array
from flipflow.model.excitation import Excitation, HarmonicForce, MovingBase, Unbalance
from flipflow.model.static_rest import static_rest

Coordinate = str | int
SYMMETRIC = 1e-12  # deviation from it, relative to the largest entry, that is rounding


def system_of(machine: object) -> MechanicalSystem:
    """The system of a screen or a system; anything else is refused with a sentence.

    A result has a ``system``, too, but none that is called for, and a class is no machine yet.
    """
    if not isinstance(machine, type) and takes(getattr(machine, "system", None), 0):
        system = cast("Machine", machine).system()
        if isinstance(system, MechanicalSystem):
            return system
    remedy = "give a FlipFlowScreen or a MechanicalSystem; of a project, its .screen"
    raise InputError("machine", type(machine).__name__, remedy)


def checked_coordinate(which: object) -> Coordinate:
    """A name or an index, whatever the machine."""
    if isinstance(which, str):
        return which
    return checked_index("coordinate", which, sys.maxsize, "give a coordinate's name or its index")


@runtime_checkable
class Machine(Protocol):
    """Whatever can be flattened into a :class:`MechanicalSystem`."""

    def system(self) -> MechanicalSystem:
        """Return the machine as mass, damping and stiffness matrices with its springs."""
        ...


@dataclass(frozen=True, eq=False)
class MechanicalSystem:
    r"""N degrees of freedom, any number of clearance springs, harmonic and constant forces.

    .. math:: M \ddot x + C \dot x + K x + \sum_j d_j H_j(d_j^T x, d_j^T \dot x)
              = f_0 + \sum_e \mathrm{Re}(F_e(\omega) e^{i n_e \omega t})

    Parameters
    ----------
    M, C, K
        Mass (kg), damping (N s/m) and stiffness (N/m), shape (N, N), as arrays or sparse
        matrices. M is symmetric and positive definite; C and K need not be symmetric: gyroscopic
        and cross-coupling terms are allowed.
    springs
        Clearance springs.
    excitation
        :class:`Unbalance`, :class:`HarmonicForce` or :class:`MovingBase`, or several of them in a
        tuple, each with its own whole multiple of omega.
    coordinates
        Names for vectors of shape (N,): ``{"relative": (1, -1)}`` lets results be asked for
        ``amplitude("relative")``. An integer always means that degree of freedom.
    static_force
        f_0, constant forces in N, shape (N,); None for none. Coordinates and gaps count from the
        unstressed springs.

    Raises
    ------
    InputError
        When shapes disagree, M is not symmetric and positive definite, or a number is not finite.
    """

    M: NDArray[np.float64]
    C: NDArray[np.float64]
    K: NDArray[np.float64]
    springs: tuple[ClearanceSpring, ...]
    excitation: Excitation | tuple[Excitation, ...]
    coordinates: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    static_force: NDArray[np.float64] | None = None

    def __init__(
        self,
        M: ArrayLike,
        C: ArrayLike,
        K: ArrayLike,
        springs: Sequence[ClearanceSpring] = (),
        excitation: Excitation | Sequence[Excitation] | None = None,
        coordinates: Mapping[str, ArrayLike] | None = None,
        static_force: ArrayLike | None = None,
    ) -> None:
        mass = _square("M", M, None)
        n = mass.shape[0]
        if not _is_symmetric(mass):
            raise InputError("M", "not symmetric", "give a symmetric matrix")
        if np.linalg.eigvalsh(mass)[0] <= 0.0:
            raise InputError("M", M, "the mass matrix must be positive definite")
        remedy = "give a list of ff.ClearanceSpring, or none"
        springs = checked_all("springs", springs, ClearanceSpring, remedy)
        for spring in springs:
            if spring.direction.shape != (n,):
                raise InputError("direction", spring.direction, f"give {n} numbers, one per mass")
        named = _named(coordinates, n)
        object.__setattr__(self, "M", mass)
        object.__setattr__(self, "C", _square("C", C, n))
        object.__setattr__(self, "K", _square("K", K, n))
        object.__setattr__(self, "springs", tuple(springs))
        object.__setattr__(self, "excitation", _checked_excitation(excitation, n))
        object.__setattr__(self, "coordinates", MappingProxyType(named))
        object.__setattr__(self, "static_force", _checked_force(static_force, n))

    def __reduce__(self) -> tuple[type[MechanicalSystem], tuple[object, ...]]:
        """Copies are made anew: a read-only mapping cannot be sent to another process."""
        parts = self.M, self.C, self.K, self.springs, self.excitation, dict(self.coordinates)
        return type(self), (*parts, self.static_force)

    @property
    def size(self) -> int:
        """N, the number of degrees of freedom."""
        return int(self.M.shape[0])

    @property
    def excitations(self) -> tuple[Excitation, ...]:
        """What excites the machine, one or several."""
        return self.excitation if isinstance(self.excitation, tuple) else (self.excitation,)

    @property
    def orders(self) -> tuple[int, ...]:
        """Multiples of omega at which the machine is excited, rising."""
        return tuple(sorted({one.order for one in self.excitations}))

    @property
    def constant_force(self) -> NDArray[np.float64]:
        """The static force, zeros where there is none, (N,)."""
        return np.zeros(self.size) if self.static_force is None else self.static_force

    @property
    def symmetric(self) -> bool:
        """Whether the machine is its own mirror image half a turn later.

        It has equal gaps on every spring, no constant force, and is excited at odd multiples of
        omega only.
        """
        even = all(spring.symmetric for spring in self.springs if spring.acts)
        odd = all(order % 2 == 1 for order in self.orders)
        return even and odd and not np.any(self.constant_force)

    def force(self, omega: ArrayLike, order: int = 1) -> NDArray[np.complex128]:
        """Amplitude in N of the excitation at a multiple of omega in rad/s (...), (..., N)."""
        speed = np.asarray(omega, float)[..., None]
        total = np.zeros((*speed.shape[:-1], self.size), np.complex128)
        for one in self.excitations:
            for power, vector in one.terms if one.order == order else ():
                total += vector * speed**power
        return total

    def static_position(self) -> NDArray[np.float64]:
        """Where the machine stands at rest under its static force, (N,), in m.

        K x + sum_j d_j H_j(d_j^T x) = f_0, with the stops at rest. It counts from the unstressed
        springs, and is zero without static force and preloaded stops. Where the machine can rest
        in several places, it is one of them.

        Raises
        ------
        InputError
            Where nothing holds the machine against the force.
        """
        return static_rest(self.K, self.springs, self.constant_force)

    def system(self) -> MechanicalSystem:
        """Return itself, so that functions take screens and systems alike."""
        return self

    def coordinate(self, which: Coordinate) -> NDArray[np.float64]:
        """Vector of shape (N,) that picks a coordinate by name or by degree of freedom."""
        if isinstance(which, str):
            if which not in self.coordinates:
                known = ", ".join(map(repr, self.coordinates))
                remedy = (
                    f"choose one of {known}, or an index"
                    if known
                    else "none is named: give an index"
                )
                raise InputError("coordinate", which, remedy)
            return self.coordinates[which]
        remedy = f"choose an index from 0 to {self.size - 1}, or a name"
        return np.asarray(np.eye(self.size)[checked_index("coordinate", which, self.size, remedy)])

    @property
    def named(self) -> tuple[Coordinate, ...]:
        """Names of the coordinates, or indices of degrees of freedom where none is named."""
        return tuple(self.coordinates) or tuple(range(self.size))

    def require_damping(self) -> None:
        """Raise InputError for a machine without any damping: it has no steady state."""
        if not np.count_nonzero(self.C):
            raise InputError(
                "damping",
                0.0,
                "without any damping while the stops are open a free vibration never dies out "
                "and no steady state exists; give one damping above 0 besides the stops'",
            )

    @property
    def opening(self) -> tuple[int, ...]:
        """Numbers of the springs that open and close; motions know no others."""
        return tuple(j for j, spring in enumerate(self.springs) if spring.opens)

    def with_bonded(self) -> MechanicalSystem:
        """Return the same machine with springs that always act moved into C and K."""
        if all(spring.opens for spring in self.springs):
            return self
        C, K = self.C.copy(), self.K.copy()
        kept = []
        for spring in self.springs:
            if spring.bonded:
                outer = np.outer(spring.direction, spring.direction)
                C, K = C + spring.damping * outer, K + spring.stiffness * outer
            elif spring.opens:
                kept.append(spring)
        return replace(self, C=C, K=K, springs=tuple(kept))


def _named(coordinates: object, n: int) -> dict[str, NDArray[np.float64]]:
    """Vectors by name, checked."""
    if coordinates is None:
        return {}
    remedy = 'give names with their vectors, as {"relative": (1, -1)}'
    named = {}
    for name, given in checked_mapping("coordinates", coordinates, remedy).items():
        field, remedy = f"coordinates[{name!r}]", f"give {n} finite numbers"
        named[name] = frozen_array(checked_numbers(field, given, remedy))
        if named[name].shape != (n,):
            raise InputError(field, given, remedy)
    return named


def _checked_excitation(given: object, n: int) -> Excitation | tuple[Excitation, ...]:
    """One excitation, or some of them."""
    kinds = (Unbalance, HarmonicForce, MovingBase)
    remedy = "give ff.Unbalance(...), ff.HarmonicForce(...) or ff.MovingBase(...), or a tuple"
    several = given if isinstance(given, (list, tuple)) else (given,)
    if not several or not all(isinstance(one, kinds) for one in several):
        raise InputError("excitation", given, remedy)
    found = tuple(cast("Sequence[Excitation]", several))
    for one in found:
        if one.vector.shape != (n,):
            raise InputError("excitation", one.vector, f"give {n} numbers, one per mass")
    return found[0] if len(found) == 1 else found


def _checked_force(given: object, n: int) -> NDArray[np.float64] | None:
    """A constant force; None where there is none."""
    if given is None:
        return None
    remedy = f"give {n} finite numbers in N, one per mass"
    force = frozen_array(checked_numbers("static_force", given, remedy))
    if force.shape != (n,):
        raise InputError("static_force", given, remedy)
    return force


def _is_symmetric(array: NDArray[np.float64]) -> bool:
    return bool(np.all(array == array.T))


def _square(name: str, values: object, size: int | None) -> NDArray[np.float64]:
    """A square matrix; one that is symmetric but for rounding is made so."""
    dense = cast("Any", values).toarray() if takes(getattr(values, "toarray", None), 0) else values
    array = np.array(checked_reals(name, dense, "give a square matrix of numbers"))
    if array.ndim != 2 or array.shape[0] != array.shape[1] or array.shape[0] == 0:
        raise InputError(name, array.shape, "give a square matrix")
    if size is not None and array.shape[0] != size:
        raise InputError(name, array.shape, f"give a {size} x {size} matrix, as M is")
    if not np.all(np.isfinite(array)):
        raise InputError(name, "not finite", "give finite numbers")
    largest = float(np.abs(array).max())
    if largest > LARGEST:
        raise InputError(name, largest, TOO_LARGE)
    if np.all(np.abs(array - array.T) <= SYMMETRIC * largest):
        array = 0.5 * (array + array.T)
    return frozen_array(array)
