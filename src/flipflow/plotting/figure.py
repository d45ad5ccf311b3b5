"""The figure of a result: panels that can be written to a file."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from flipflow.plotting.files import Written
from flipflow.plotting.layout import arrange, beside_panels
from flipflow.plotting.panels import PanelGrid
from flipflow.plotting.print import printed

COLUMN = 250.0  # pixels that a column of panels needs at least
ASPECT, LOWEST = 0.66, 70.0  # height of a panel over its width, and its least height in pixels
PAGE_HEIGHT = 870.0  # pixels, 230 mm: a figure and its caption on a page


@dataclass(frozen=True)
class Figure(Written, PanelGrid):
    """A grid of panels that can be written to a file; its fields are those of the grid."""

    _FORMATS: ClassVar = (".html", ".svg", ".pdf", ".png")

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

    def _repr_svg_(self) -> str:
        """What a notebook shows."""
        return self._rendered(".svg").decode()

    def _rendered(self, ending: str) -> bytes:
        if ending == ".html":
            from flipflow.plotting.plotly import page  # noqa: PLC0415  loads plotly

            return page(self).encode()
        return printed(self, ending.removeprefix("."))
