"""How wide words are in the widest font of figures for print, which matplotlib carries."""

from __future__ import annotations

import shutil
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from flipflow.errors import required
from flipflow.plotting.layout import FONT

if TYPE_CHECKING:
    from matplotlib.ft2font import FT2Font

FAMILY = "DejaVu Sans"
FILE = "DejaVuSans.ttf"
LAST_RESORT = "LastResort"  # a font that draws a box for every letter there is
# In pixels: capitals above the base line, half of that, letters below it, from line to line.
ASCENT, MIDDLE, DESCENT, LINE_HEIGHT = 0.76 * FONT, 0.365 * FONT, 0.24 * FONT, 1.2 * FONT
_ONE_AT_A_TIME = threading.Lock()  # a font holds the letter that it loaded last


def require_matplotlib() -> None:
    """See that figures can be printed.

    Raises
    ------
    MissingExtra
        When matplotlib is not installed.
    """
    required("matplotlib", "Figures for print need matplotlib", "report")


def font_folder() -> Path:
    """Where matplotlib keeps the font.

    Raises
    ------
    MissingExtra
        When matplotlib is not installed.
    """
    require_matplotlib()
    found = find_spec("matplotlib")
    return Path(str(found and found.origin)).parent / "mpl-data" / "fonts" / "ttf"


@contextmanager
def fonts_for_typst() -> Iterator[str]:
    """A folder, for as long as it is needed, with the fonts that matplotlib keeps but one.

    That one has every letter, so that typst sets a whole name in its boxes where one letter of
    the name is Chinese, say.

    Raises
    ------
    MissingExtra
        When matplotlib is not installed.
    """
    # What typst still holds cannot be removed everywhere; the system does so later.
    with tempfile.TemporaryDirectory(prefix="flipflow-", ignore_cleanup_errors=True) as folder:
        for font in font_folder().glob("*.ttf"):
            if not font.name.startswith(LAST_RESORT):
                _put(font, Path(folder) / font.name)
        yield folder


def _put(font: Path, where: Path) -> None:
    """A link, or a copy where links need a right."""
    try:
        where.symlink_to(font)
    except OSError:
        shutil.copyfile(font, where)


def width_of(text: str) -> float:
    """Width in pixels of the widest line of a text.

    Raises
    ------
    MissingExtra
        When matplotlib is not installed.
    """
    return max(sum(map(_advance, line)) for line in text.split("\n"))


@cache
def _advance(letter: str) -> float:
    """Width of a letter in pixels; one that the font has not is taken from another, and wide."""
    font = _font()
    with _ONE_AT_A_TIME:
        if not font.get_char_index(ord(letter)):
            return FONT
        return float(font.load_char(ord(letter)).linearHoriAdvance / 65536.0)


@cache
def _font() -> FT2Font:
    folder = font_folder()
    from matplotlib.ft2font import FT2Font  # noqa: PLC0415  an extra, slow to import

    font = FT2Font(str(folder / FILE))
    font.set_size(FONT, 72.0)
    return font
