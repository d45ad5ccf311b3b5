"""Figure 9: the test rig as a drawing, with its identified parameters and their spread."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from flipflow.io.check import check_project
from flipflow.io.source import bundled_text
from flipflow.model.project import Project
from flipflow.model.screen import FlipFlowScreen
from flipflow.paper.figure import PaperFigure
from flipflow.paper.figure_01 import draw_machine
from flipflow.paper.rig import RIG, rig
from flipflow.plotting.drawing import Drawing
from flipflow.report.blocks import Column, Table, cells

TITLE = "The test rig"
SPREAD_LINE = re.compile(r"^# {3}(\w[\w ]+?) {2,}([\d.]+ +\.\.\. +[\d.]+ +\S.*)$", re.MULTILINE)
CAPTION = (
    "Inner mass: main frame; outer mass: floating frame. The paper prints the rig's parameters in "
    "a picture only, so they are identified from the six points of its text; many rigs have these "
    "points."
)
SAID = (
    "Spread: range of each parameter over 32 rigs that were drawn at random and fitted to the six "
    "points, with the inner mass set to the same value."
)


@dataclass(frozen=True, eq=False)
class Rig:
    """The rig's file, and the spread of each parameter as the file says it."""

    project: Project
    spread: Mapping[str, str]


def compute(_screen: FlipFlowScreen) -> Rig:
    """The bundled rig; the machine that is reproduced does not matter."""
    spread = {
        name: re.sub(r" +", " ", words) for name, words in SPREAD_LINE.findall(bundled_text(RIG))
    }
    return Rig(rig(), spread)


def draw(data: Rig) -> Drawing:
    """The rig's schematic."""
    return draw_machine(data.project.screen, TITLE, CAPTION)


def tables(data: Rig) -> tuple[Table, ...]:
    """Values of the rig's file, where they come from, and the spread."""
    columns = (Column("Value"), Column("As written", numeric=True), Column("Source"))
    rows = tuple(
        cells(value.key, value.written, value.source)
        for value in check_project(data.project).values
        if value.source
    )
    spread = tuple(cells(name, words) for name, words in data.spread.items())
    return (
        Table("Values of the rig's file", columns, rows),
        Table("Spread of the identification", (Column("Parameter"), Column("Range")), spread, SAID),
    )


FIGURE = PaperFigure("figure-09", TITLE, compute, draw, (), tables, needs_stop=False)
