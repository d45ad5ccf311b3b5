"""The equation of motion: M x'' + C x' + K x + forces of the stops = exciting force."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Protocol, cast, runtime_checkable

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
from flipflow.model.elements import ClearanceSpring, HarmonicForce, Unbalance, frozen_array

Coordinate = str | int


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
    r"""N degrees of freedom, any number of clearance springs, one harmonic excitation.

    .. math:: M \ddot x + C \dot x + K x + \sum_j d_j H_j(d_j^T x, d_j^T \dot x)
              = \mathrm{Re}(F(\omega) e^{i \omega t})

    Parameters
    ----------
    M, C, K
        Mass (kg), damping (N s/m) and stiffness (N/m), shape (N, N), symmetric; M positive
        definite.
    springs
        Clearance springs.
    excitation
        :class:`Unbalance` or :class:`HarmonicForce`.
    coordinates
        Names for vectors of shape (N,): ``{"relative": (1, -1)}`` lets results be asked for
        ``amplitude("relative")``. An integer always means that degree of freedom.

    Raises
    ------
    InputError
        When shapes disagree, M is not positive definite, or a matrix is not finite.
    """

    M: NDArray[np.float64]
    C: NDArray[np.float64]
    K: NDArray[np.float64]
    springs: tuple[ClearanceSpring, ...]
    excitation: Unbalance | HarmonicForce
    coordinates: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)

    def __init__(
        self,
        M: ArrayLike,
        C: ArrayLike,
        K: ArrayLike,
        springs: Sequence[ClearanceSpring] = (),
        excitation: Unbalance | HarmonicForce | None = None,
        coordinates: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        mass = _square("M", M, None)
        n = mass.shape[0]
        if np.linalg.eigvalsh(mass)[0] <= 0.0:
            raise InputError("M", M, "the mass matrix must be positive definite")
        remedy = "give ff.Unbalance(...) or ff.HarmonicForce(...)"
        if not isinstance(excitation, (Unbalance, HarmonicForce)):
            raise InputError("excitation", excitation, remedy)
        if excitation.vector.shape != (n,):
            raise InputError("excitation", excitation.vector, f"give {n} numbers, one per mass")
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
        object.__setattr__(self, "excitation", excitation)
        object.__setattr__(self, "coordinates", MappingProxyType(named))

    def __reduce__(self) -> tuple[type[MechanicalSystem], tuple[object, ...]]:
        """Copies are made anew: a read-only mapping cannot be sent to another process."""
        parts = self.M, self.C, self.K, self.springs, self.excitation, dict(self.coordinates)
        return type(self), parts

    @property
    def size(self) -> int:
        """N, the number of degrees of freedom."""
        return int(self.M.shape[0])

    @property
    def symmetric(self) -> bool:
        """Whether the machine is its own mirror image: equal gaps on every spring."""
        return all(spring.symmetric for spring in self.springs if spring.acts)

    def system(self) -> MechanicalSystem:
        """Return itself, so that functions take screens and systems alike."""
        return self

    def coordinate(self, which: Coordinate) -> NDArray[np.float64]:
        """Vector of shape (N,) that picks a coordinate by name or by degree of freedom."""
        if isinstance(which, str):
            if which not in self.coordinates:
                known = ", ".join(map(repr, self.coordinates)) or "none is named"
                raise InputError("coordinate", which, f"choose one of {known}, or an index")
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

    def with_bonded(self) -> MechanicalSystem:
        """Return the same machine with springs that always act moved into C and K."""
        if all(spring.acts and not spring.bonded for spring in self.springs):
            return self
        C, K = self.C.copy(), self.K.copy()
        kept = []
        for spring in self.springs:
            if spring.bonded:
                outer = np.outer(spring.direction, spring.direction)
                C, K = C + spring.damping * outer, K + spring.stiffness * outer
            elif spring.acts:
                kept.append(spring)
        return MechanicalSystem(self.M, C, K, kept, self.excitation, self.coordinates)


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


def _square(name: str, values: ArrayLike, size: int | None) -> NDArray[np.float64]:
    array = frozen_array(checked_reals(name, values, "give a square matrix of numbers"))
    if array.ndim != 2 or array.shape[0] != array.shape[1] or array.shape[0] == 0:
        raise InputError(name, array.shape, "give a square matrix")
    if size is not None and array.shape[0] != size:
        raise InputError(name, array.shape, f"give a {size} x {size} matrix, as M is")
    if not np.all(np.isfinite(array)):
        raise InputError(name, "not finite", "give finite numbers")
    if np.any(np.abs(array) > LARGEST):
        raise InputError(name, float(np.abs(array).max()), TOO_LARGE)
    if np.any(np.abs(array - array.T) > 1e-12 * np.abs(array)):
        raise InputError(name, "not symmetric", "give a symmetric matrix")
    return array
