"""Figure 10: the test rig's response, its sweeps, and the points that the paper measured."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flipflow.continuation.branch import Branch
from flipflow.continuation.frequency_response import frequency_response
from flipflow.errors import IncompleteError
from flipflow.model.screen import FlipFlowScreen
from flipflow.paper.claims import Claim, Evaluation, Number, Part, agrees, decide
from flipflow.paper.figure import PaperFigure
from flipflow.paper.rig import (
    AFTER_DOWN,
    AFTER_UP,
    BEFORE_DOWN,
    BEFORE_UP,
    POINT_A,
    POINT_B,
    STEP,
    rig,
)
from flipflow.plotting.family import branch_traces, speed_axis_in_radians
from flipflow.plotting.figure import Figure
from flipflow.plotting.panels import Axis, Line, Note, Panel, Trace
from flipflow.plotting.scales import MM
from flipflow.transient.sweep import Sweep, sweep

TITLE = "Relative amplitude of the test rig over frequency"
LOW, HIGH = 20.0, 160.0
BELOW, ABOVE = 20, 10
LARGEST_GAP = 0.05
CAPTION = (
    "The rig as identified. Solid: stable; dashed: unstable; crosses: folds. Small symbols: exact "
    "sweeps in the paper's steps of 30 rpm. Filled: the six points that the paper's text gives; "
    "the rig is identified from them, so meeting them is a test of the model's form, not of the "
    "rig's values."
)


@dataclass(frozen=True, eq=False)
class RigResponse:
    """Branch, sweeps with rising and with falling speed, and the speed of point "a"."""

    branch: Branch
    rising: Sweep
    falling: Sweep
    point_a: float


def compute(_screen: FlipFlowScreen) -> RigResponse:
    """The bundled rig over the paper's speeds; the machine that is reproduced does not matter."""
    project = rig()
    if project.speed is None:
        raise IncompleteError("The rig's file has no speed.")
    steps = np.arange(-BELOW, ABOVE + 1)
    rising = sweep(project.screen, BEFORE_UP[0] + STEP * steps)
    shift = round((BEFORE_UP[0] - BEFORE_DOWN[0]) / STEP)
    falling = sweep(project.screen, BEFORE_DOWN[0] + STEP * (steps[::-1] + shift))
    branch = frequency_response(project.screen, (LOW, HIGH))
    return RigResponse(branch, rising, falling, project.speed)


def draw(data: RigResponse) -> Figure:
    """The relative amplitude."""
    traces = (*branch_traces("exact", data.branch, "relative", 0, bold=True), *_symbols(data))
    lines = tuple(Line("x", f.omega, f"fold {f.omega:.5g}", "mark") for f in data.branch.folds)
    top = max(float(trace.y.max()) for trace in traces)
    notes = (
        Note(data.point_a, POINT_A + 0.14, "a", "center"),
        Note(data.point_a, POINT_B - 0.16, "b", "center"),
    )
    panel = Panel(
        speed_axis_in_radians(LOW, HIGH),
        Axis("relative amplitude (x2)", "mm", (0.0, 1.08 * top)), traces, lines=lines, notes=notes,
    )  # fmt: skip
    return Figure(TITLE, CAPTION, (panel,), height=420)


def _symbols(data: RigResponse) -> Iterator[Trace]:
    swept = (("rising", data.rising, "case 1", "circle-open"),
             ("falling", data.falling, "case 2", "cross"))  # fmt: skip
    for way, one, colour, symbol in swept:
        yield Trace(f"sweep, {way}", one.omega, one.amplitude("relative") * MM, "point",
                    colour, symbol=symbol)  # fmt: skip
    groups = (
        ("published, rising", (BEFORE_UP, AFTER_UP), "triangle", "case 1"),
        ("published, falling", (BEFORE_DOWN, AFTER_DOWN), "diamond", "case 2"),
        ("published, a and b", ((data.point_a, POINT_A), (data.point_a, POINT_B)), "square",
         "case 3"),
    )  # fmt: skip
    for name, points, symbol, colour in groups:
        omega, height = np.array(points).T
        yield Trace(name, omega, height, "point", colour, symbol=symbol)


def forward(data: RigResponse) -> Evaluation:
    """R1: with rising speed from 2.85 mm at 120.17 rad/s to 0.54 mm at 123.31 rad/s."""
    return _jump(data.rising, data.branch, BEFORE_UP, AFTER_UP)


def backward(data: RigResponse) -> Evaluation:
    """R2: with falling speed from 1.97 mm at 95.03 rad/s to 2.52 mm at 91.89 rad/s."""
    return _jump(data.falling, data.branch, BEFORE_DOWN, AFTER_DOWN)


def _jump(
    one: Sweep, branch: Branch, before: tuple[float, float], after: tuple[float, float]
) -> Evaluation:
    low, high = sorted((before[0], after[0]))
    folds = [fold.omega for fold in branch.folds if low < fold.omega < high]
    inside = [
        jump for jump in one.jumps
        if abs(jump.omega_before - before[0]) < LARGEST_GAP
        and abs(jump.omega_after - after[0]) < LARGEST_GAP
    ]  # fmt: skip
    parts = [
        Part("the only jump lies between the two speeds", len(inside) == len(one.jumps) == 1),
        Part("a fold lies between them", len(folds) == 1),
    ]
    numbers = {"fold": Number(folds[0] if folds else None, "rad/s")}
    for word, (omega, published) in (("before", before), ("after", after)):
        k = int(np.abs(one.omega - omega).argmin())
        found = MM * float(one.amplitude("relative")[k])
        parts.append(Part(f"{published:g} mm at {omega:g} rad/s", agrees(found, published, 2)))
        numbers[f"{word} the jump"] = Number(found, "mm")
        numbers[f"{word}, at"] = Number(float(one.omega[k]), "rad/s")
        numbers[f"{word}, off the published"] = Number(100.0 * (found / published - 1.0), "%")
    return decide(parts, numbers)


FIGURE = PaperFigure(
    "figure-10", TITLE, compute, draw,
    (
        Claim("R1", "Fig. 10, 5.2", "on the rig, rising speed jumps between 120.17 and 123.31 "
              "rad/s from 2.85 to 0.54 mm", forward),
        Claim("R2", "Fig. 10, 5.2", "on the rig, falling speed jumps between 95.03 and 91.89 "
              "rad/s from 1.97 to 2.52 mm", backward),
    ),
    needs_stop=False,
)  # fmt: skip
