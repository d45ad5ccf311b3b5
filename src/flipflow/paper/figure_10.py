"""Figure 10: the test rig's response, its sweeps, and the points that the paper measured."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from flipflow.continuation.branch import Branch
from flipflow.continuation.frequency_response import frequency_response
from flipflow.errors import IncompleteError
from flipflow.model.screen import FlipFlowScreen
from flipflow.paper.claims import Claim, Evaluation, meant
from flipflow.paper.figure import PaperFigure
from flipflow.paper.rig import (
    AFTER_DOWN,
    AFTER_UP,
    BEFORE_DOWN,
    BEFORE_UP,
    POINT_A,
    POINT_B,
    STEP,
    Prediction,
    RigBranch,
    judged,
    rig,
    rigs_without,
)
from flipflow.plotting.curves import Curve
from flipflow.plotting.family import branch_traces, speed_axis_in_radians
from flipflow.plotting.figure import Figure
from flipflow.plotting.panels import Axis, Line, Note, Panel, Trace
from flipflow.plotting.scales import MM
from flipflow.report.blocks import Column, Table, cells
from flipflow.transient.sweep import Sweep, sweep

TITLE = "Relative amplitude of the test rig over frequency"
LOW, HIGH = 20.0, 160.0
HIGHEST, TALLEST = 200.0, 6.0  # rad/s and mm shown of rigs that jump late
BELOW, ABOVE = 20, 10
CAPTION = (
    "Above: the rig fitted to all points. Solid: stable; dashed: unstable; crosses: folds. Small "
    "symbols: exact sweeps in the paper's steps of 30 rpm. Filled: the six points that the "
    "paper's text gives. Below: rigs that were fitted without the points of one jump, a thin line "
    "each, followed up to 300 rad/s; how far they spread is what the other points leave open."
)


@dataclass(frozen=True, eq=False)
class RigResponse:
    """The rig drawn, and rigs fitted without the points of a claim.

    Parameters
    ----------
    branch, rising, falling
        Its motions over speed, and its sweeps.
    point_a
        Speed of point "a" in rad/s.
    without
        For R1 and R2, the rigs fitted to the other points.
    """

    branch: Branch
    rising: Sweep
    falling: Sweep
    point_a: float
    without: Mapping[str, tuple[RigBranch, ...]]


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
    without = {claim: rigs_without(claim) for claim in ("R1", "R2")}
    return RigResponse(branch, rising, falling, project.speed, without)


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
        title="fitted to all six points",
    )  # fmt: skip
    below = (
        _spread(data, "R1", "fitted without the jump at rising speed", 1),
        _spread(data, "R2", "fitted without the jump at falling speed", 2),
    )
    return Figure(TITLE, CAPTION, (panel, *below), height=860)


def _spread(data: RigResponse, claim: str, title: str, group: int) -> Panel:
    """Every rig that was fitted without a claim's points, and these points."""
    lines = []
    for k, one in enumerate(data.without[claim]):
        curve = Curve.of(one.branch, "relative")
        near = (curve.omega > LOW) & (curve.omega < HIGHEST)
        lines.append(
            Trace("rigs fitted without these points", curve.omega[near],
                  curve.amplitude[near] * MM, colour="case 5", legend=group == 1 and k == 0)
        )  # fmt: skip
    points = [dataclasses.replace(one, legend=False) for one in _published(data)]
    top = max((float(trace.y.max()) for trace in lines), default=POINT_A)
    return Panel(
        speed_axis_in_radians(LOW, HIGHEST),
        Axis("relative amplitude (x2)", "mm", (0.0, min(1.08 * top, TALLEST))),
        (*lines, *points), title=title,
    )  # fmt: skip


def _symbols(data: RigResponse) -> Iterator[Trace]:
    swept = (("rising", data.rising, "case 1", "circle-open"),
             ("falling", data.falling, "case 2", "cross"))  # fmt: skip
    for way, one, colour, symbol in swept:
        yield Trace(f"sweep, {way}", one.omega, one.amplitude("relative") * MM, "point",
                    colour, symbol=symbol)  # fmt: skip
    yield from _published(data)


def _published(data: RigResponse) -> Iterator[Trace]:
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
    rigs = data.without["R1"]
    speeds = tuple(one.jump_up for one in rigs)
    return judged(
        (
            Prediction("speed of the jump", "rad/s", BEFORE_UP[0], AFTER_UP[0], speeds),
            _amplitude("before the jump", BEFORE_UP, [one.rising(BEFORE_UP[0]) for one in rigs]),
            _amplitude("after the jump", AFTER_UP, [one.rising(AFTER_UP[0]) for one in rigs]),
        )
    )


def backward(data: RigResponse) -> Evaluation:
    """R2: with falling speed from 1.97 mm at 95.03 rad/s to 2.52 mm at 91.89 rad/s."""
    rigs = data.without["R2"]
    speeds = tuple(one.jump_down for one in rigs)
    return judged(
        (
            Prediction("speed of the jump", "rad/s", AFTER_DOWN[0], BEFORE_DOWN[0], speeds),
            _amplitude(
                "before the jump", BEFORE_DOWN, [one.falling(BEFORE_DOWN[0]) for one in rigs]
            ),
            _amplitude("after the jump", AFTER_DOWN, [one.falling(AFTER_DOWN[0]) for one in rigs]),
        )
    )


def _amplitude(when: str, point: tuple[float, float], values: list[float]) -> Prediction:
    omega, published = point
    name = f"relative amplitude {when}, at {omega:g} rad/s"
    return Prediction(name, "mm", *meant(published, 2), tuple(values))


def tables(data: RigResponse) -> tuple[Table, ...]:
    """How the rig that was fitted to all points meets them."""
    found = RigBranch(data.branch)
    rows = []
    for name, read, (omega, published) in (
        ("rising, before the jump", found.upper, BEFORE_UP),
        ("rising, after it", found.lower, AFTER_UP),
        ("falling, before the jump", found.lower, BEFORE_DOWN),
        ("falling, after it", found.upper, AFTER_DOWN),
        ("point a, upper motion", found.upper, (found.point_a, POINT_A)),
        ("point b, lower motion", found.lower, (found.point_a, POINT_B)),
    ):
        amplitude = read(omega)
        off = f"{100.0 * (amplitude / published - 1.0):+.1f}"
        rows.append(cells(name, f"{omega:.2f}", f"{published:g}", f"{amplitude:.3f}", off))
    columns = (
        Column("Point"), Column("speed", "rad/s", numeric=True),
        Column("paper", "mm", numeric=True), Column("rig drawn", "mm", numeric=True),
        Column("off", "%", numeric=True),
    )  # fmt: skip
    jumps = f"{found.jump_up:.5g} rad/s rising and {found.jump_down:.5g} rad/s falling"
    caption = f"Its jumps: {jumps}. It was fitted to these points, so this decides no claim."
    return (Table("The rig fitted to all six points", columns, tuple(rows), caption),)


FIGURE = PaperFigure(
    "figure-10", TITLE, compute, draw,
    (
        Claim("R1", "Fig. 10, 5.2", "on the rig, rising speed jumps between 120.17 and 123.31 "
              "rad/s from 2.85 to 0.54 mm", forward),
        Claim("R2", "Fig. 10, 5.2", "on the rig, falling speed jumps between 95.03 and 91.89 "
              "rad/s from 1.97 to 2.52 mm", backward),
    ),
    tables, needs_stop=False,
)  # fmt: skip
