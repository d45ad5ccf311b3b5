"""Figure 2c: amplitude of the machine without stop over frequency."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flipflow.dynamics.linear_response import LinearResponse, linear_response
from flipflow.model.screen import FlipFlowScreen
from flipflow.paper.claims import Claim, Evaluation, Name, Number, Part, agrees, decide
from flipflow.paper.figure import PaperFigure
from flipflow.plotting.family import speed_axis_in_radians
from flipflow.plotting.figure import Figure
from flipflow.plotting.panels import Axis, Line, Panel, Trace
from flipflow.plotting.response import LABELS
from flipflow.plotting.scales import MM

TITLE = "Amplitude over frequency of the machine without stop"
HIGHEST = 1.4
POINTS = 1200
ALMOST_ONE = 0.1
CAPTION = (
    "No stop. w01, w02: natural frequencies; w_ea: main and relative amplitude are equal; w_ar: "
    "antiresonance of the main frame. The paper's operating region reaches from w_ea to w_ar."
)


@dataclass(frozen=True, eq=False)
class Linear:
    """Response without stop, and the frequencies that divide it."""

    response: LinearResponse
    w01: float
    w02: float
    w_ea: float | None
    w_ar: float | None


def compute(screen: FlipFlowScreen) -> Linear:
    """Closed form; the same speeds for every figure of the machine without stop."""
    bare = screen.replace(clearance=math.inf, clearance_minus=None)
    w01, w02 = (float(w) for w in linear_response(bare, 1.0).natural_frequencies)
    omega = np.linspace(HIGHEST * w02 / POINTS, HIGHEST * w02, POINTS)
    response = linear_response(bare, omega)
    return Linear(response, w01, w02, response.omega_ea, response.omega_ar)


def draw(data: Linear) -> Figure:
    """Main, floating and relative amplitude; the paper draws the first and the last."""
    omega = data.response.omega
    traces = tuple(
        Trace(LABELS[which], omega, data.response.amplitude(which) * MM, "motion", which,
              bold=which == "relative", dash="dashdot" if which == "floating" else "")
        for which in ("main", "floating", "relative")
    )  # fmt: skip
    marks = (("w01", data.w01), ("w_ea", data.w_ea), ("w_ar", data.w_ar), ("w02", data.w02))
    lines = tuple(Line("x", at, f"{name} {at:.4g}", "mark") for name, at in marks if at is not None)
    top = max(float(trace.y.max()) for trace in traces)
    panel = Panel(
        speed_axis_in_radians(0.0, float(omega[-1])), Axis("amplitude", "mm", (0.0, 1.05 * top)),
        traces, lines=lines,
    )  # fmt: skip
    return Figure(TITLE, CAPTION, (panel,), height=380)


def as_one(data: Linear) -> Evaluation:
    """Ratio of relative to main amplitude below w01."""
    below = data.response.omega < data.w01
    ratio = data.response.amplitude("relative")[below] / data.response.amplitude("main")[below]
    most = float(ratio.max())
    numbers: dict[Name, Number] = {
        "greatest x2/x1 below w01": Number(most),
        "w01": Number(data.w01, "rad/s"),
    }
    return decide([Part("x2/x1 stays below 0.1", most < ALMOST_ONE)], numbers)


def boundaries(data: Linear) -> Evaluation:
    """w_ea about 66 and w_ar about 93 rad/s."""
    found = (("w_ea", data.w_ea, 66.0), ("w_ar", data.w_ar, 93.0))
    parts = [
        Part(f"{name} is about {paper:.0f} rad/s", None if at is None else agrees(at, paper, 0))
        for name, at, paper in found
    ]
    return decide(parts, {name: Number(at, "rad/s") for name, at, _ in found})


def larger(data: Linear) -> Evaluation:
    """Sign of |x1| - |x2| over [w01, w_ea] and [w_ea, w_ar]."""
    parts: list[Part] = []
    numbers: dict[Name, Number] = {}
    bands = (("w01 to w_ea: more", data.w01, data.w_ea, 1.0),
             ("w_ea to w_ar: less", data.w_ea, data.w_ar, -1.0))  # fmt: skip
    difference = data.response.amplitude("main") - data.response.amplitude("relative")
    for name, low, high, sign in bands:
        if low is None or high is None:
            parts.append(Part(name, None))
            continue
        inside = (data.response.omega > low) & (data.response.omega < high)
        share = float(np.mean(sign * difference[inside] > 0.0)) if inside.any() else math.nan
        parts.append(Part(name, share == 1.0))
        numbers[f"share of the band, {name}"] = Number(100.0 * share, "%")
    return decide(parts, numbers)


FIGURE = PaperFigure(
    "figure-02c", TITLE, compute, draw,
    (
        Claim("L1", "Fig. 2c", "below w01 the two frames move almost as one", as_one),
        Claim("L2", "Fig. 2c, 2.3", "w_ea is about 66 and w_ar about 93 rad/s", boundaries),
        Claim("L3", "2.2", "the main frame moves more than the frames do relative to each other "
              "between w01 and w_ea, and less between w_ea and w_ar", larger),
    ),
    needs_stop=False,
)  # fmt: skip
