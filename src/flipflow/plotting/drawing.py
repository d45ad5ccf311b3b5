"""A drawing as SVG, and its files."""

from __future__ import annotations

import html
import json
import os
from dataclasses import dataclass
from pathlib import Path

from flipflow.errors import MissingExtra
from flipflow.plotting.files import write_rendered
from flipflow.plotting.palette import INK

FORMATS = (".html", ".svg", ".pdf")
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
            When typst, which makes the PDF, is not installed.
        """
        return write_rendered(path, FORMATS, self._rendered)

    def _rendered(self, ending: str) -> bytes:
        if ending == ".svg":
            return self.svg.encode()
        if ending == ".html":
            title, caption = html.escape(self.title), html.escape(self.caption)
            return PAGE.format(title=title, caption=caption, svg=self.svg, ink=INK).encode()
        return _pdf(self.svg)


def _pdf(svg: str) -> bytes:
    try:
        import typst  # noqa: PLC0415  an extra
    except ImportError as error:
        raise MissingExtra("Drawings as PDF need typst: pip install 'flipflow[report]'.") from error
    # A JSON string of plain text without control characters is a typst string as well.
    text = json.dumps(svg, ensure_ascii=False)
    source = (
        f'#set page(width: auto, height: auto, margin: 6pt)\n#image(bytes({text}), format: "svg")'
    )
    return bytes(typst.compile(source.encode(), format="pdf"))
