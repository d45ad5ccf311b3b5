"""The figure of a result: panels that can be written to a file."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

from flipflow.plotting.files import write_rendered
from flipflow.plotting.layout import arrange, beside_panels
from flipflow.plotting.panels import PanelGrid
from flipflow.plotting.print import printed

COLUMN = 250.0  # pixels that a column of panels needs at least
ASPECT, LOWEST = 0.66, 70.0  # height of a panel over its width, and its least height in pixels
PAGE_HEIGHT = 870.0  # pixels, 230 mm: a figure and its caption on a page
FORMATS = (".html", ".svg", ".pdf", ".png")


@dataclass(frozen=True)
class Figure(PanelGrid):
    """A grid of panels that can be written to a file; its fields are those of the grid."""

    def narrowed(self, width: float) -> Figure:
        """The same figure at another width in pixels, panels below each other where it is narrow.

        A panel is as high as two thirds of its width, unless it was lower or a page has less room.
        """
        columns = self.columns if width >= COLUMN * self.columns else 1
        shares = self.shares if columns == self.columns else ()
        figure = replace(self, width=width, columns=columns, shares=shares)
        rows, beside = -(-len(self.panels) // columns), beside_panels(figure, even=False)
        widest = max(rect.width for rect in arrange(figure).rects)
        was = arrange(self, even=False).rects[0].height
        each = min(was, ASPECT * widest, (PAGE_HEIGHT - beside) / rows)
        return replace(figure, height=round(beside + rows * max(each, LOWEST)))

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the figure to a file, in the format its ending names.

        Parameters
        ----------
        path
            ``.html`` is one interactive page that opens offline; ``.svg``, ``.pdf`` and ``.png``
            are for print.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        InputError
            For another ending.
        StoreError
            When the file cannot be written.
        MissingExtra
            When matplotlib, or typst for PDF and PNG, is needed and not installed.
        """
        return write_rendered(path, FORMATS, self._rendered)

    def _repr_svg_(self) -> str:
        """What a notebook shows."""
        return self._rendered(".svg").decode()

    def _rendered(self, ending: str) -> bytes:
        if ending == ".html":
            from flipflow.plotting.plotly import page  # noqa: PLC0415  loads plotly

            return page(self).encode()
        return printed(self, ending.removeprefix("."))
