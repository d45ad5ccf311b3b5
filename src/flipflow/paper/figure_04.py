"""Figure 4: phase portraits of both frames without stop, empty and loaded."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flipflow.dynamics.linear_response import LinearResponse, linear_response
from flipflow.model.screen import FlipFlowScreen, Load
from flipflow.paper.claims import Claim, Evaluation, Name, Number, Part, agrees, decide
from flipflow.paper.figure import PaperFigure
from flipflow.plotting.figure import Figure
from flipflow.plotting.palette import case_colour, case_symbol
from flipflow.plotting.panels import Axis, Panel, Trace
from flipflow.plotting.response import LABELS
from flipflow.plotting.scales import MM

TITLE = "Phase portraits of both frames, empty and loaded, without stop"
OMEGA = 79.5
LOAD = Load(stiffness_factor=1.1, name="k2 + 10 %")
POINTS = 361
CAPTION = (
    f"Velocity over displacement at {OMEGA} rad/s; the load stiffens the shear springs by 10 %."
)


@dataclass(frozen=True, eq=False)
class Portraits:
    """Both machines at the paper's speed, and the middle of the paper's region."""

    empty: LinearResponse
    loaded: LinearResponse
    middle: tuple[LinearResponse, LinearResponse] | None


def compute(screen: FlipFlowScreen) -> Portraits:
    """Closed form at 79.5 rad/s, and at the exact mean of w_ea and w_ar."""
    bare = screen.replace(clearance=math.inf, clearance_minus=None)
    heavy = bare.loaded(LOAD)
    empty, loaded = linear_response(bare, OMEGA), linear_response(heavy, OMEGA)
    ea, ar = empty.omega_ea, empty.omega_ar
    middle = None
    if ea is not None and ar is not None:
        mean = (ea + ar) / 2.0
        middle = (linear_response(bare, mean), linear_response(heavy, mean))
    return Portraits(empty, loaded, middle)


def draw(data: Portraits) -> Figure:
    """One panel a frame."""
    panels = tuple(_portrait(data, which, first=which == "main") for which in ("main", "floating"))
    return Figure(TITLE, CAPTION, panels, columns=2, height=360)


def _portrait(data: Portraits, which: str, *, first: bool) -> Panel:
    traces = []
    for k, (name, response) in enumerate((("empty", data.empty), (LOAD.name, data.loaded))):
        X = (response.complex_amplitudes @ response.system.coordinate(which))[0]
        turn = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, POINTS))
        traces.append(
            Trace(name, (X * turn).real * MM, (1j * OMEGA * X * turn).real, "motion",
                  case_colour(k), symbol=case_symbol(k), bold=k == 0, legend=first)
        )  # fmt: skip
    return Panel(
        Axis("displacement", "mm"), Axis("velocity", "m/s"), tuple(traces), title=LABELS[which]
    )


def _change(pair: tuple[LinearResponse, LinearResponse], which: str) -> float:
    empty, loaded = (float(response.amplitude(which)[0]) for response in pair)
    return 100.0 * (loaded / empty - 1.0)


def _judged(data: Portraits, which: str, published: float) -> Evaluation:
    at_paper = _change((data.empty, data.loaded), which)
    pairs = {f"at {OMEGA} rad/s": (data.empty, data.loaded)}
    if data.middle is not None:
        mean = float(data.middle[0].omega[0])
        pairs[f"at the middle of w_ea and w_ar, {mean:.5g} rad/s"] = data.middle
    numbers: dict[Name, Number] = {}
    for where, pair in pairs.items():
        numbers[where, "change"] = Number(_change(pair, which), "%")
        for word, one in zip(("empty", "loaded"), pair, strict=True):
            numbers[where, word] = Number(MM * float(one.amplitude(which)[0]), "mm")
    return decide([Part(f"{published:+.1f} %", agrees(at_paper, published, 1))], numbers)


FIGURE = PaperFigure(
    "figure-04", TITLE, compute, draw,
    (
        Claim("F1", "Fig. 4", "at 79.5 rad/s a load of k2 + 10 % changes the main frame's "
              "amplitude by +11.5 %", lambda data: _judged(data, "main", 11.5)),
        Claim("F2", "Fig. 4", "at 79.5 rad/s a load of k2 + 10 % changes the relative amplitude "
              "by -17.0 %", lambda data: _judged(data, "relative", -17.0)),
    ),
    needs_stop=False,
)  # fmt: skip
