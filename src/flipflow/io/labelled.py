"""Values along named dimensions: what a result is before it is a table or a file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow import __version__
from flipflow.model.fields import FIELD
from flipflow.model.screen import is_screen
from flipflow.model.system import Coordinate, Machine, MechanicalSystem

SI = {
    "length": "m", "velocity": "m/s", "acceleration": "m/s^2", "force": "N", "torque": "N m",
    "time": "s", "frequency": "rad/s", "rate": "1/s", "impulse": "kg m/s", "mass": "kg",
}  # fmt: skip


@dataclass(frozen=True)
class Variable:
    """Values along named dimensions, with their unit; "" where they have none."""

    dims: tuple[str, ...]
    data: NDArray[Any]
    units: str = ""


@dataclass(frozen=True)
class Arrays:
    """A result as arrays.

    Parameters
    ----------
    title
        What it is.
    index
        The dimension along which it is a table.
    coordinates
        Values that stand along a dimension.
    variables
        All other values.
    attributes
        What holds for all of it.
    """

    title: str
    index: str
    coordinates: Mapping[str, Variable]
    variables: Mapping[str, Variable]
    attributes: Mapping[str, str | float]


def units_of(machine: Machine | None) -> Mapping[str, str]:
    """SI for a screen; a machine of its user has units of its own, which nobody told."""
    return SI if machine is None or is_screen(machine) else dict.fromkeys(SI, "")


def labels(names: Iterable[Coordinate]) -> Variable:
    """The names of coordinates."""
    return Variable(("coordinate",), np.array([str(name) for name in names]))


def each(
    dim: str, system: MechanicalSystem, read: Callable[[Coordinate], ArrayLike], unit: str
) -> Variable:
    """A value of every coordinate along a dimension."""
    values = np.stack([np.asarray(read(name)) for name in system.named], axis=-1)
    return Variable((dim, "coordinate"), values, unit)


def column(dim: str, values: ArrayLike, unit: str = "") -> Variable:
    """Values along a dimension."""
    return Variable((dim,), np.asarray(values), unit)


def unit_of(parameter: str) -> str:
    """The unit of a parameter in SI; none of a field of a user's machine."""
    return "rad/s" if parameter == "omega" else FIELD[parameter].unit if parameter in FIELD else ""


def attributes(result: Any, **more: str | float) -> dict[str, str | float]:
    """What is said of every result, and more."""
    return {"flipflow_version": getattr(result, "version", __version__), **more}
