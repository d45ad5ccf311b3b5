"""A drawing as SVG, and its files."""

from __future__ import annotations

import html
import os
from dataclasses import dataclass
from pathlib import Path

from flipflow.plotting.files import write_rendered
from flipflow.plotting.palette import INK
from flipflow.plotting.print import typeset

FORMATS = (".html", ".svg", ".pdf")
MARGIN = 6.0  # points; of a PDF
PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<style>body {{ font-family: Arial, Helvetica, sans-serif; color: {ink}; width: 690px;
margin: 24px auto }} p {{ font-size: 13px }}</style></head>
<body><h1>{title}</h1>{svg}<p>{caption}</p></body></html>
"""


@dataclass(frozen=True)
class Drawing:
    """A drawing.

    Parameters
    ----------
    title, caption
        What it is, and how it is to be read.
    svg
        An SVG element.
    """

    title: str
    caption: str
    svg: str

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the drawing to a file, in the format its ending names.

        Parameters
        ----------
        path
            ``.html``, ``.svg`` or ``.pdf``.

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
            When typst or matplotlib, which a PDF needs, is not installed.
        """
        return write_rendered(path, FORMATS, self._rendered)

    def _rendered(self, ending: str) -> bytes:
        if ending == ".svg":
            return self.svg.encode()
        if ending == ".html":
            title, caption = html.escape(self.title), html.escape(self.caption)
            return PAGE.format(title=title, caption=caption, svg=self.svg, ink=INK).encode()
        return typeset(self.svg, "pdf", self.title, MARGIN)
