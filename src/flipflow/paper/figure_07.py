"""Figure 7: response of the machine with stop, third-order harmonic balance and exact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flipflow.analyses.frequency_response import frequency_response
from flipflow.analyses.linear import linear_response
from flipflow.analyses.operating_region import Landmarks, analysed_range, landmarks
from flipflow.figures.family import BALANCE, beneath_traces, branch_traces, speed_axis_in_radians
from flipflow.figures.parts import Axis, Band, Figure, Line, Panel
from flipflow.figures.response import LABELS
from flipflow.methods.options import HarmonicBalance
from flipflow.model.screen import FlipFlowScreen
from flipflow.paper.claims import Claim, Evaluation, Number, Part, decide, undecided
from flipflow.paper.figure import PaperFigure
from flipflow.results.branch import Branch

TITLE = "Amplitude over frequency of the machine with stop"
SAMPLES = 60
SAME = 1e-6
CAPTION = (
    "Half the peak-to-peak motion. Solid: stable; dashed: unstable; crosses: folds, where the "
    f"amplitude jumps. Wide and pale beneath: {BALANCE}. Green: the paper's operating region."
)


@dataclass(frozen=True, eq=False)
class Responses:
    """The exact branch, the paper's approximation of it, and the region."""

    screen: FlipFlowScreen
    exact: Branch
    balance: Branch
    marks: Landmarks


def compute(screen: FlipFlowScreen) -> Responses:
    """Both methods over the whole range."""
    span = analysed_range(screen)
    exact = frequency_response(screen, span)
    balance = frequency_response(screen, span, HarmonicBalance(3))
    return Responses(screen, exact, balance, landmarks(screen, exact))


def draw(data: Responses) -> Figure:
    """Main frame and relative motion, a panel each."""
    return Figure(
        TITLE, CAPTION, tuple(_panel(data, which) for which in ("main", "relative")), height=460
    )


def _panel(data: Responses, which: str) -> Panel:
    first = which == "main"
    traces = (
        *beneath_traces(BALANCE, data.balance, which, legend=first),
        *branch_traces("exact", data.exact, which, 0, legend=first, bold=True),
    )
    marks = data.marks
    named = (("w_cs", marks.omega_cs), ("w_lb", marks.omega_lb), ("w_ub", marks.omega_ub))
    lines = tuple(Line("x", at, f"{name} {at:.5g}", "mark") for name, at in named if at is not None)
    top = max(float(trace.y.max()) for trace in traces)
    return Panel(
        speed_axis_in_radians(0.0, float(data.exact.omega.max())),
        Axis("amplitude", "mm", (0.0, 1.06 * top)), traces,
        bands=(Band("x", marks.lower, marks.upper),), lines=lines, title=LABELS[which],
    )  # fmt: skip


def linear_below_contact(data: Responses) -> Evaluation:
    """Relative difference from the linear response below w_cs."""
    if data.marks.omega_cs is None:
        return undecided("a speed at which contact begins")
    low = float(data.exact.omega.min())
    omega = np.linspace(low, data.marks.omega_cs, SAMPLES, endpoint=False)
    linear = linear_response(data.screen, omega)
    parts, numbers = [], {"w_cs": Number(data.marks.omega_cs, "rad/s")}
    for which in ("main", "relative"):
        orbits = [data.exact.orbit_from_below(float(w)) for w in omega]
        found = np.array([np.nan if o is None else o.amplitude(which) for o in orbits])
        worst = float(np.abs(found / linear.amplitude(which) - 1.0).max())
        parts.append(Part(LABELS[which], worst < SAME))
        numbers[f"greatest relative difference, {LABELS[which]}"] = Number(worst)
    return decide(parts, numbers)


FIGURE = PaperFigure(
    "figure-07", TITLE, compute, draw,
    (Claim("N4", "4.1", "below w_cs the stop changes nothing", linear_below_contact),),
)  # fmt: skip
