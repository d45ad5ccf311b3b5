"""The figures of the paper that can be reproduced, by name.

A new one is a module and a line here; one that varies a field is an entry of ``FAMILIES``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flipflow.errors import InputError
from flipflow.paper import (
    beyond,
    figure_01,
    figure_02c,
    figure_03,
    figure_04,
    figure_05,
    figure_06,
    figure_07,
    figure_08,
    figure_09,
    figure_10,
    figure_11,
)
from flipflow.paper.family_figures import FAMILIES
from flipflow.paper.figure import PaperFigure

MODULES = (
    figure_01, figure_02c, figure_03, figure_04, figure_05, figure_06, figure_07, figure_08,
    figure_09, figure_10, figure_11,
)  # fmt: skip
FIGURES: Mapping[str, PaperFigure[Any]] = {
    one.name: one for one in (*(m.FIGURE for m in MODULES), *FAMILIES, beyond.FIGURE)
}


def chosen(names: tuple[str, ...]) -> tuple[PaperFigure[Any], ...]:
    """Figures by name, each once, in the paper's order; all where none is named.

    ``figure-08``, ``08`` and ``8`` mean the same.

    Raises
    ------
    InputError
        For a name that is not known.
    """
    short = {_short(name): name for name in FIGURES}
    wanted = set()
    for name in names:
        if _short(name) not in short:
            raise InputError("FIGURE", name, f"choose from {', '.join(FIGURES)}")
        wanted.add(short[_short(name)])
    return tuple(one for name, one in FIGURES.items() if name in wanted or not names)


def _short(name: str) -> str:
    return name.lower().removeprefix("figure-").lstrip("0")
