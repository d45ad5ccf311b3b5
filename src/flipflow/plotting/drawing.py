"""A drawing as SVG, and its files."""

from __future__ import annotations

import html
from dataclasses import dataclass
from typing import ClassVar

from flipflow.plotting.files import Written
from flipflow.plotting.palette import INK
from flipflow.plotting.print import typeset

MARGIN = 6.0  # points; of a PDF
PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<style>body {{ font-family: Arial, Helvetica, sans-serif; color: {ink}; width: 690px;
margin: 24px auto }} p {{ font-size: 13px }}</style></head>
<body><h1>{title}</h1>{svg}<p>{caption}</p></body></html>
"""


@dataclass(frozen=True)
class Drawing(Written):
    """A drawing.

    Parameters
    ----------
    title, caption
        What it is, and how it is to be read.
    svg
        An SVG element.
    """

    _FORMATS: ClassVar = (".html", ".svg", ".pdf")

    title: str
    caption: str
    svg: str

    def _rendered(self, ending: str) -> bytes:
        if ending == ".svg":
            return self.svg.encode()
        if ending == ".html":
            title, caption = html.escape(self.title), html.escape(self.caption)
            return PAGE.format(title=title, caption=caption, svg=self.svg, ink=INK).encode()
        return typeset(self.svg, "pdf", self.title, MARGIN)
