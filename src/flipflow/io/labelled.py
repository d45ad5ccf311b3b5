"""Values along named dimensions: what a result is before it is a table or a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray


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
