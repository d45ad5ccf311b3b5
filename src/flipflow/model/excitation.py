"""What excites a machine: unbalances, forces, a moving base; each at a whole multiple of omega."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow.errors import InputError
from flipflow.model.arguments import checked_count, checked_numbers, checked_vector
from flipflow.model.elements import frozen_array

MOST_ORDER = 1000
Term = tuple[int, NDArray[np.complex128]]


@dataclass(frozen=True, eq=False, init=False)
class _Turning:
    """``Re(vector (n w)^power exp(i n w t))``."""

    vector: NDArray[np.complex128]
    order: int = 1
    power: ClassVar[int]

    def __init__(self, vector: ArrayLike, order: int = 1) -> None:
        object.__setattr__(self, "vector", _force_vector(vector))
        object.__setattr__(self, "order", checked_count("order", order, MOST_ORDER))

    @property
    def terms(self) -> tuple[Term, ...]:
        """The force's amplitude as a sum of powers of omega: (power, vector (N,)) each."""
        return ((self.power, self.order**self.power * self.vector),)


@dataclass(frozen=True, eq=False, init=False)
class Unbalance(_Turning):
    """Rotating unbalance: the force on the machine is ``Re(vector (n w)^2 exp(i n w t))``.

    Parameters
    ----------
    vector
        m0 r in kg m on each degree of freedom, shape (N,); complex for a phase.
    order
        n, a whole number: it turns n times as fast as the shaft.
    """

    power = 2


@dataclass(frozen=True, eq=False, init=False)
class HarmonicForce(_Turning):
    """Force of constant amplitude: ``Re(vector exp(i n w t))``.

    Parameters
    ----------
    vector
        Force in N on each degree of freedom, shape (N,); complex for a phase.
    order
        n, a whole number.
    """

    power = 0


@dataclass(frozen=True, eq=False)
class MovingBase:
    """A base that moves by ``Re(X exp(i n w t))``: the force is ``(k + i n w c) X`` of that.

    Parameters
    ----------
    displacement
        X in m; complex for a phase.
    stiffness, damping
        k in N/m and c in N s/m of what ties each degree of freedom to the base, shape (N,). They
        stand in the machine's own K and C as well.
    order
        n, a whole number.
    """

    displacement: complex
    stiffness: NDArray[np.float64]
    damping: NDArray[np.float64]
    order: int = 1

    def __init__(
        self,
        displacement: complex,
        stiffness: ArrayLike,
        damping: ArrayLike | None = None,
        order: int = 1,
    ) -> None:
        remedy = "give finite numbers, one per degree of freedom"
        k = frozen_array(checked_numbers("stiffness", stiffness, remedy))
        c = np.zeros(k.shape) if damping is None else checked_numbers("damping", damping, remedy)
        if k.ndim != 1:
            raise InputError("stiffness", stiffness, remedy)
        if c.shape != k.shape:
            raise InputError("damping", damping, remedy)
        moved = _force_vector([displacement], "displacement", "give a finite number in m")
        object.__setattr__(self, "displacement", complex(moved[0]))
        object.__setattr__(self, "stiffness", k)
        object.__setattr__(self, "damping", frozen_array(c))
        object.__setattr__(self, "order", checked_count("order", order, MOST_ORDER))

    @property
    def vector(self) -> NDArray[np.complex128]:
        """k X, the force of a base that moves slowly, shape (N,)."""
        return np.asarray(self.stiffness * self.displacement, np.complex128)

    @property
    def terms(self) -> tuple[Term, ...]:
        """The force's amplitude as a sum of powers of omega: (power, vector (N,)) each."""
        moving = np.asarray(1j * self.order * self.displacement * self.damping, np.complex128)
        return (0, self.vector), (1, moving)


Excitation = Unbalance | HarmonicForce | MovingBase


def scaled(excitation: Excitation, factor: float) -> Excitation:
    """An excitation times a factor."""
    if isinstance(excitation, MovingBase):
        return replace(excitation, displacement=factor * excitation.displacement)
    return replace(excitation, vector=factor * excitation.vector)


def restricted(excitation: Excitation, freedoms: NDArray[np.int64]) -> Excitation:
    """An excitation as some degrees of freedom feel it."""
    if isinstance(excitation, MovingBase):
        k, c = excitation.stiffness[freedoms], excitation.damping[freedoms]
        return replace(excitation, stiffness=k, damping=c)
    return replace(excitation, vector=excitation.vector[freedoms])


def _force_vector(
    vector: ArrayLike,
    name: str = "vector",
    remedy: str = "give a finite vector, one number per degree of freedom",
) -> NDArray[np.complex128]:
    array = checked_vector(name, vector, remedy).copy()
    array.setflags(write=False)
    return array
