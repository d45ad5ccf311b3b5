"""Figure 11: a disturbance at the twelfth second throws the test rig to its smaller motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flipflow.compiled.arrays import Real
from flipflow.continuation.frequency_response import frequency_response
from flipflow.errors import IncompleteError
from flipflow.model.disturbance import Impulse
from flipflow.model.screen import FlipFlowScreen
from flipflow.paper.claims import Claim, Evaluation, Name, Number, Part, decide, meant
from flipflow.paper.figure import PaperFigure
from flipflow.paper.figure_10 import HIGH, LOW
from flipflow.paper.rig import (
    AT_A,
    POINT_A,
    POINT_B,
    Prediction,
    RigBranch,
    judged,
    rig,
    rigs_without,
)
from flipflow.plotting.figure import Figure
from flipflow.plotting.history import envelope
from flipflow.plotting.panels import Axis, Line, Panel, Trace
from flipflow.plotting.scales import MM
from flipflow.transient.history import History
from flipflow.transient.simulate import simulate

TITLE = 'Relative displacement of the test rig at point "a", disturbed after 12 s'
# kg m/s on the outer mass while the unbalance points along +x; the paper does not say its own.
IMPULSE = 2.0
DURATION = 24.0
BEFORE, AFTER = 0.4, 1.6
CAPTION = (
    f"The rig as identified. An impulse of {IMPULSE:g} kg m/s on the outer mass, at the first "
    "moment after 12 s at which the unbalance points along +x; the paper does not say what its "
    "disturbance was. Above, shaded: from the least to the greatest value of each turn. Dotted: "
    "the published amplitudes, 2.6 and 1.25 mm. Below: around the disturbance. The paper does not "
    "print the speed of point a: it is taken where the lower motion has 1.25 mm, so "
    "that one number is left to judge."
)


@dataclass(frozen=True, eq=False)
class Disturbed:
    """The motion over time, the disturbance, and what rigs do that were fitted without it.

    Parameters
    ----------
    omega
        Speed in rad/s.
    history, blow
        The run and its disturbance.
    before, after
        Amplitude before the disturbance and at the end in m.
    without
        Rigs fitted to all points but the amplitudes at "a" and "b".
    """

    omega: float
    history: History
    blow: Impulse
    before: float
    after: float
    without: tuple[RigBranch, ...]


def compute(_screen: FlipFlowScreen) -> Disturbed:
    """The bundled rig from its upper motion; the machine that is reproduced does not matter."""
    project = rig()
    omega = project.speed
    if omega is None:
        raise IncompleteError("The rig's file has no speed.")
    upper = frequency_response(project.screen, (LOW, HIGH)).orbits_at(omega)[0]
    turn = 2.0 * math.pi / omega
    blow = Impulse(math.ceil(AT_A / turn) * turn, "floating", IMPULSE)
    history = simulate(
        project.screen, omega, math.ceil(DURATION / turn), initial=upper, disturbances=(blow,)
    )
    x, t = history.displacement("relative"), history.t
    before = _half_range(x[(t < blow.t) & (t > blow.t - turn)])
    after = _half_range(x[t > t[-1] - turn])
    return Disturbed(omega, history, blow, before, after, rigs_without("R3"))


def _half_range(x: Real) -> float:
    return float(x.max() - x.min()) / 2.0


def draw(data: Disturbed) -> Figure:
    """The whole time, and around the disturbance."""
    t, x = data.history.t, data.history.displacement("relative") * MM
    times, low, high = envelope(t, x, round(DURATION * data.omega / (2.0 * math.pi)))
    area = Trace("from least to greatest", times, high, "case band", "case band", lower=low)
    edges = [Trace("edges", times, y, colour="main", legend=False) for y in (low, high)]
    near = (t > data.blow.t - BEFORE) & (t < data.blow.t + AFTER)
    course = Trace("relative displacement", t[near], x[near], colour="relative")
    ends = data.blow.t - BEFORE, data.blow.t + AFTER
    reach = 1.25 * max(POINT_A, MM * data.before)
    return Figure(
        TITLE, CAPTION,
        (
            _panel((0.0, float(t[-1])), reach, (area, *edges), "disturbed", data.blow.t),
            _panel(ends, reach, (course,), "", data.blow.t),
        ),
        height=480,
    )  # fmt: skip


def _panel(
    ends: tuple[float, float],
    reach: float,
    traces: tuple[Trace, ...],
    word: str,
    at: float,
) -> Panel:
    levels = ((POINT_A, 0.0), (-POINT_A, 0.0), (POINT_B, 1.0), (-POINT_B, 1.0))
    lines = tuple(
        Line("y", level, f"{level:g} mm" if level > 0.0 else "", "mark", text_at=place)
        for level, place in levels
    )
    return Panel(
        Axis("time", "s", ends), Axis("displacement", "mm", (-reach, reach)), traces,
        lines=(*lines, Line("x", at, word, "limit")),
    )  # fmt: skip


def drops(data: Disturbed) -> Evaluation:
    """R3: where the lower motion has 1.25 mm the upper one has 2.6 mm, and a blow ends on it."""
    values = tuple(one.upper(one.point_a) for one in data.without)
    name = "relative amplitude of the upper motion where the lower has 1.25 mm"
    found = judged((Prediction(name, "mm", *meant(POINT_A, 1), values),))
    fall = data.history.settled and data.after < data.before
    parts = [*found.parts, Part("a blow drops the rig drawn from the upper to the lower", fall)]
    numbers: dict[Name, Number] = dict(found.numbers)
    speeds = [one.point_a for one in data.without]
    numbers |= {
        "least speed of point a": Number(min(speeds, default=math.nan), "rad/s"),
        "greatest": Number(max(speeds, default=math.nan), "rad/s"),
        "run: speed": Number(data.omega, "rad/s"),
        "run: impulse on the outer mass": Number(IMPULSE, "kg m/s"),
        "run: its time": Number(data.blow.t, "s"),
        "run: amplitude before": Number(MM * data.before, "mm"),
        "run: amplitude after": Number(MM * data.after, "mm"),
    }
    return decide(parts, numbers)


FIGURE = PaperFigure(
    "figure-11", TITLE, compute, draw,
    (
        Claim("R3", "Fig. 11, 5.3", "on the rig at point a, a disturbance at 12 s drops the "
              "relative amplitude from 2.6 to 1.25 mm", drops),
    ),
    needs_stop=False,
)  # fmt: skip
