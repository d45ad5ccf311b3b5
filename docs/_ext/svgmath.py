"""Mathematics as SVG, drawn at build time: nothing is loaded when a page is viewed.

Each formula is a picture of outlines in the colour of its text, so that it needs no font, no
script and no network, and prints as it shows.
"""

from __future__ import annotations

import html
from xml.etree import ElementTree as ET

import ziamath
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.math import get_node_equation_number
from sphinx.writers.html5 import HTML5Translator

SIZE = 16.0  # px to the em while drawing
SCALE = 1.15  # of a formula against the text around it

ziamath.config.svg2 = False  # outlines stand in every picture; shared ones need unique names


def setup(app: Sphinx) -> dict[str, object]:
    """Register the renderer as ``html_math_renderer = "svg"``."""
    app.add_html_math_renderer("svg", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def inline(self: HTML5Translator, node: nodes.math) -> None:
    """Write a formula within a line."""
    self.body.append(drawn(node.astext(), node, within_line=True))
    raise nodes.SkipNode


def block(self: HTML5Translator, node: nodes.math_block) -> None:
    """Write a displayed formula, with its number when it has a label."""
    self.body.append(self.starttag(node, "div", CLASS="math"))
    tex = node.astext()
    if r"\\" in tex and r"\begin" not in tex:
        tex = rf"\begin{{aligned}}{tex}\end{{aligned}}"
    self.body.append(drawn(tex, node, within_line=False))
    if node["number"]:
        self.body.append(f'<span class="eqno">({get_node_equation_number(self, node)})')
        self.add_permalink_ref(node, "Link to this equation")
        self.body.append("</span>")
    self.body.append("</div>")
    raise nodes.SkipNode


def drawn(tex: str, node: nodes.Node, *, within_line: bool) -> str:
    """A formula as an svg element, its size in em; one that cannot be drawn ends the build."""
    try:
        formula = ziamath.Latex(tex, size=SIZE, inline=within_line, color="currentColor")
        picture = formula.svgxml()
    except Exception as error:
        raise ExtensionError(f"{node.source}: {tex!r} cannot be drawn: {error}") from error
    _, top, width, height = (float(x) * SCALE / SIZE for x in picture.get("viewBox", "").split())
    picture.set("width", f"{width:.4f}em")
    picture.set("height", f"{height:.4f}em")
    picture.set("style", f"vertical-align: {-(top + height):.4f}em")  # zero is the base line
    picture.set("role", "img")
    picture.set("aria-label", html.escape(tex, quote=False))
    return ET.tostring(picture, encoding="unicode")
