"""What every public result can do: become arrays, be drawn, be saved.

Arrays, figures and files stand in rooms above the results; a method calls up to them when it is
used, so that a result loads neither.
"""

from __future__ import annotations

import dataclasses
import importlib
import os
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes

    from flipflow.model.system import Coordinate


def above(module: str, name: str) -> Any:
    """A function of a room above, loaded when it is called for."""
    return getattr(importlib.import_module(f"flipflow.{module}"), name)


class Frozen:
    """A frozen dataclass whose copies hold its fields alone.

    What was worked out when it was asked for stays behind where a result is copied or sent to
    another process: another thread may be adding to it.
    """

    def __getstate__(self) -> dict[str, object]:
        """The fields."""
        own: Any = self
        return {field.name: getattr(own, field.name) for field in dataclasses.fields(own)}


class Result:
    """Base of all public results."""

    def to_xarray(self) -> xr.Dataset:
        """Return the result as labelled arrays, units as attributes, complex numbers kept.

        Raises
        ------
        MissingExtra
            Where xarray is not installed.
        """
        return cast("xr.Dataset", above("io.tables", "dataset")(self._arrays()))

    def to_dataframe(self) -> pd.DataFrame:
        """Return the result as one table, a column for each coordinate; units in ``attrs``.

        Raises
        ------
        MissingExtra
            Where pandas is not installed.
        """
        return cast("pd.DataFrame", above("io.tables", "dataframe")(self._arrays()))

    def _arrays(self) -> Any:
        return above("io.arrays", "arrays_of")(self)

    def plot(
        self,
        ax: Axes | None = None,
        *,
        coordinate: Coordinate | None = None,
        units: str | None = None,
    ) -> Axes:
        """Draw the result on matplotlib Axes, in their style, and return them.

        Parameters
        ----------
        ax
            Where to draw; None: new ones.
        coordinate
            What is drawn of the motion; None: what its figure shows first.
        units
            "engineering" (mm, rpm, kN), "SI" or "dimensionless" (no unit is written); None: the
            first for a screen, the last for any other machine.

        Raises
        ------
        InputError
            For a coordinate that the machine does not have, and for other units.
        MissingExtra
            Where matplotlib is not installed.
        """
        return cast("Axes", above("plotting.axes", "draw_on")(self, ax, coordinate, units))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the result to a file: see :func:`flipflow.save`."""
        above("io.results", "save")(self, path)

    def _repr_html_(self) -> str:
        """A small table and a small picture, for notebooks."""
        table = above("io.tables", "html_table")(self._arrays())
        return str(table + above("plotting.notebook", "picture_of")(self))
