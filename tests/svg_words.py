"""Where the words of a figure's SVG stand, as wide as in the widest font that it may be set in."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from functools import cache

from matplotlib.ft2font import FT2Font, LoadFlags

from flipflow.plotting.font import ASCENT, DESCENT, font_folder
from flipflow.plotting.layout import FONT

NAME = "{http://www.w3.org/2000/svg}"
SHARE_LEFT = {"start": 0.0, "middle": 0.5, "end": 1.0}


@dataclass(frozen=True)
class Box:
    """A line of text; its edges in pixels, y down."""

    text: str
    left: float
    top: float
    right: float
    foot: float

    def overlap(self, other: Box) -> float:
        """Pixels by which both would have to part; at most 0 where they are apart."""
        return min(
            self.right - other.left, other.right - self.left, self.foot - other.top,
            other.foot - self.top,
        )  # fmt: skip


@cache
def _font(file: str) -> FT2Font:
    font = FT2Font(str(font_folder() / file))
    font.set_size(FONT, 72.0)
    return font


def boxes_of(svg: str) -> list[Box]:
    """Every line of text that is seen."""
    return [_box(one) for one in ET.fromstring(svg).iter(f"{NAME}text")]  # noqa: S314  ours


def _box(one: ET.Element) -> Box:
    text = "".join(one.itertext())
    font = _font("DejaVuSans-Bold.ttf" if one.get("font-weight") else "DejaVuSans.ttf")
    font.set_text(text, 0.0, flags=LoadFlags.NO_HINTING)
    wide = font.get_width_height()[0] / 64.0
    x, y = float(one.attrib["x"]), float(one.attrib["y"])
    left = -wide * SHARE_LEFT[one.attrib["text-anchor"]]
    if one.get("transform"):  # upwards
        return Box(text, x - ASCENT, y - left - wide, x + DESCENT, y - left)
    return Box(text, x + left, y - ASCENT, x + left + wide, y + DESCENT)
