"""Figures and drawings for print: SVG whose words are text, and what typst makes of it."""

from __future__ import annotations

import hashlib
import html
import re
import struct
import textwrap
import zlib
from collections.abc import Callable
from typing import Any

from flipflow.errors import required
from flipflow.plotting.font import DESCENT, LINE_HEIGHT, fonts_for_typst, require_matplotlib
from flipflow.plotting.layout import CHARACTER, LABEL_ROW
from flipflow.plotting.palette import COLOURS
from flipflow.plotting.panels import PanelGrid
from flipflow.plotting.svg import figure_elements, sheet, written
from flipflow.plotting.symbols import svg_with_symbols

# The first that is there is taken. There is room for DejaVu Sans, the widest, which typst is given.
FAMILIES = "Arial, Liberation Sans, DejaVu Sans, sans-serif"
RESOLUTION = 300  # dots per inch
METRE = 1.0 / 0.0254  # inches
HEAD = 33  # bytes of a PNG before its second part
BESIDE = 3.0  # pixels between the edge and the lines below a figure
# Texts are inputs, so that typst takes none for markup.
SOURCE = """#set document(title: sys.inputs.title, date: none)
#set page(width: auto, height: auto, margin: {margin}pt)
#image(bytes(sys.inputs.svg), format: "svg", alt: sys.inputs.title)
"""


def printed(figure: PanelGrid, form: str) -> bytes:
    """The figure as a file of the format ``form``: "svg", "pdf" or "png".

    Raises
    ------
    MissingExtra
        When matplotlib, or typst for all but SVG, is not installed.
    """
    svg = svg_alone(figure)
    return svg.encode() if form == "svg" else typeset(svg, form, figure.title)


def svg_alone(figure: PanelGrid) -> str:
    """The figure as SVG in its own size, on white, with what it belongs to below it.

    Raises
    ------
    MissingExtra
        When matplotlib is not installed.
    """
    foot = subject_lines(figure)
    high = figure.height + LABEL_ROW * len(foot)
    base = high - BESIDE - DESCENT - (len(foot) - 1) * LINE_HEIGHT
    drawn = figure_elements(figure) + written(
        BESIDE, base, "\n".join(foot), "left", COLOURS["mark"]
    )
    if figure.symbols:
        drawn = svg_with_symbols(drawn)
    # Several figures stand in one page of a notebook: what is referred to has another name in each.
    own = hashlib.sha256(drawn.encode()).hexdigest()[:8]
    drawn = re.sub(r'(?<=id=")|(?<="url\(#)', f"f{own}", drawn)
    ground = '<rect width="100%" height="100%" fill="white"/>'
    title = f"<title>{html.escape(figure.title)}</title>"
    return sheet(title + ground + drawn, figure.width, high, FAMILIES)


def subject_lines(figure: PanelGrid) -> list[str]:
    """What a figure on its own belongs to, as lines below it."""
    return textwrap.wrap(figure.subject, int(figure.width / CHARACTER), break_on_hyphens=False)


def typeset(svg: str, form: str, title: str, margin: float = 0.0) -> bytes:
    """An SVG as "pdf" or "png" of its size and a margin in points, with the fonts embedded.

    Raises
    ------
    MissingExtra
        When typst or matplotlib is not installed.
    """
    compiled = require_typst(f"A {form.upper()}")
    with fonts_for_typst() as fonts:
        made = compiled(
            SOURCE.format(margin=margin).encode(),
            format=form,
            ppi=RESOLUTION,
            font_paths=[fonts],
            sys_inputs={"svg": svg, "title": title},
        )
    return _resolved(made) if form == "png" else bytes(made)


def _resolved(png: bytes) -> bytes:
    """A PNG that says how many dots it has per metre, as typst does not."""
    dots = round(RESOLUTION * METRE)
    said = b"pHYs" + struct.pack(">IIB", dots, dots, 1)
    part = struct.pack(">I", len(said) - 4) + said + struct.pack(">I", zlib.crc32(said))
    return png[:HEAD] + part + png[HEAD:]


def require_typst(what: str = "A PDF") -> Callable[..., Any]:
    """What sets sheets; called before long work, so that it is not lost for want of it.

    Raises
    ------
    MissingExtra
        When typst or matplotlib is not installed.
    """
    typst = required("typst", f"{what} needs typst", "report")
    require_matplotlib()
    compiled: Callable[..., Any] = typst.compile
    return compiled
