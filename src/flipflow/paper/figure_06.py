"""Figure 6: the stop's piecewise law and the hyperbolic tangent that stands in for it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Real
from flipflow.dynamics.linear_response import linear_response
from flipflow.errors import IncompleteError, InputError
from flipflow.model.elements import ClearanceSpring
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.smooth import SHARPNESS, smooth_force
from flipflow.paper.claims import Claim, Evaluation, Name, Number, Part, decide
from flipflow.paper.figure import PaperFigure
from flipflow.plotting.figure import Figure
from flipflow.plotting.panels import Axis, Line, Panel, Trace
from flipflow.plotting.scales import KN, MM

TITLE = "The stop's law and the hyperbolic tangent that stands in for it"
REACH = 1.5
CLOSE_UP = 1.5
FITS, THIN = 1e-3, 1e-2
MICROMETRES = 1e6
UNSWITCHED = 1e-3  # share of the force that the smooth law has not switched at its layer's edge
POINTS = 20_001  # positions over the stroke, besides those in the layers
CAPTION = (
    "Force of the stop over the relative displacement. Wide and pale: piecewise law, Eq. (2); "
    f"thin: Eq. (3) with eps = 1e{round(math.log10(SHARPNESS))} per metre. With damping: at a "
    "constant rate. With a motion: x2 = 1.5 e sin(w t) at the antiresonance. Below: the same "
    "around the gap, where the tangent takes its time to switch."
)


@dataclass(frozen=True, eq=False)
class LawComparison:
    """Both laws along one course of the gap coordinate.

    Parameters
    ----------
    condition
        "stiffness alone", "with damping" or "with a motion".
    displacement, velocity
        Gap coordinate in m and its rate in m/s, (n,).
    piecewise, smooth
        Force by both laws in N, (n,).
    layer_width
        Width in m of the layer around a gap in which the smooth law has switched by more than
        one part in a thousand and less than all but that.
    outside
        Which points lie outside the layers, (n,).
    """

    condition: str
    displacement: Real
    velocity: Real
    piecewise: Real
    smooth: Real
    layer_width: float
    outside: NDArray[np.bool_]

    @property
    def largest(self) -> float:
        """Largest difference in N outside the layers."""
        return float(np.abs(self.smooth - self.piecewise)[self.outside].max())

    @property
    def rms(self) -> float:
        """Root mean square difference in N outside the layers."""
        return float(np.sqrt(np.mean((self.smooth - self.piecewise)[self.outside] ** 2)))

    @property
    def largest_inside(self) -> float:
        """Largest difference in N within the layers; zero where no point falls into one."""
        inside = np.abs(self.smooth - self.piecewise)[~self.outside]
        return float(inside.max(initial=0.0))

    @property
    def largest_force(self) -> float:
        """Largest force by the piecewise law in N, to measure the differences by."""
        return float(np.abs(self.piecewise).max())


def compare_laws(
    spring: ClearanceSpring, amplitude: float, omega: float
) -> tuple[LawComparison, LawComparison, LawComparison]:
    """Lay the smooth law over the piecewise one in three conditions.

    Stiffness alone: the gap coordinate y goes from ``-amplitude`` to ``amplitude`` without a rate.
    With damping: the same at the constant rate ``amplitude * omega``. With a motion:
    y = amplitude sin(omega t) over a period, with its own rate.

    Parameters
    ----------
    spring
        The stop, with at least one finite gap.
    amplitude
        Largest y in m, beyond a gap.
    omega
        Frequency of the motion in rad/s.

    Returns
    -------
    tuple of LawComparison
        In the order above. The points are even in y or t, with more of them in the layers.

    Raises
    ------
    InputError
        When the motion reaches no gap, and as :func:`~flipflow.model.smooth.smooth_force` does.
    """
    if not min(spring.gaps) < amplitude < math.inf:
        remedy = f"give a finite amplitude beyond the gap of {min(spring.gaps):g} m"
        raise InputError("amplitude", amplitude, remedy)
    if not 0.0 < omega < math.inf:
        raise InputError("omega", omega, "give a finite frequency above 0 rad/s")
    width = math.log(1.0 / UNSWITCHED - 1.0) / SHARPNESS
    y = _course(spring, amplitude, width)
    up = np.arcsin(y / amplitude)
    phase = np.concatenate([up, np.pi - up[::-1]])
    conditions = (
        ("stiffness alone", y, np.zeros_like(y)),
        ("with damping", y, np.full_like(y, amplitude * omega)),
        ("with a motion", amplitude * np.sin(phase), amplitude * omega * np.cos(phase)),
    )
    first, second, third = (
        LawComparison(
            condition,
            displacement,
            velocity,
            spring.force(displacement, velocity),
            smooth_force(spring, displacement, velocity),
            width,
            _outside(spring, displacement, width),
        )
        for condition, displacement, velocity in conditions
    )
    return first, second, third


def _course(spring: ClearanceSpring, amplitude: float, width: float) -> Real:
    """Positions from -amplitude to amplitude, even, and dense in the layers."""
    y = np.linspace(-amplitude, amplitude, POINTS)
    layer = np.linspace(-2.0 * width, 2.0 * width, 401)
    plus, minus = spring.gaps
    dense = [e + layer for e in (plus, -minus) if math.isfinite(e)]
    together = np.unique(np.concatenate([y, *dense]))
    return np.asarray(together[np.abs(together) <= amplitude])


def _outside(spring: ClearanceSpring, y: Real, width: float) -> NDArray[np.bool_]:
    plus, minus = spring.gaps
    half = width / 2.0
    return np.asarray((np.abs(y - plus) > half) & (np.abs(y + minus) > half))


@dataclass(frozen=True, eq=False)
class Laws:
    """Both laws in the paper's three conditions; the nearer gap stands at x2 = ``at``."""

    at: float
    conditions: tuple[LawComparison, ...]


def compute(screen: FlipFlowScreen) -> Laws:
    """Up to half as far again as the gap, at the speed of the antiresonance."""
    stop, omega = screen.stop(), linear_response(screen, 1.0).omega_ar
    plus, minus = stop.gaps
    if omega is None or stop.law != "paper" or min(plus, minus) == 0.0:
        raise IncompleteError("It needs the paper's law, a gap, and an antiresonance.")
    at = plus if plus <= minus else -minus
    return Laws(at, compare_laws(stop, REACH * abs(at), omega))


def draw(data: Laws) -> Figure:
    """A column for each condition: the whole course, and the layer at the gap."""
    whole = [_whole(one, legend=k == 0) for k, one in enumerate(data.conditions)]
    close = [_close(one, data.at) for one in data.conditions]
    return Figure(TITLE, CAPTION, (*whole, *close), columns=3, height=470)


def _whole(one: LawComparison, *, legend: bool) -> Panel:
    axis = Axis("relative displacement", "mm")
    traces = tuple(_traces(one, one.displacement * MM, slice(None), legend=legend))
    return Panel(axis, Axis("force", "kN"), traces, title=one.condition)


def _close(one: LawComparison, at: float) -> Panel:
    """Around the nearer gap, where x2 rises."""
    reach = CLOSE_UP * one.layer_width
    passed = np.flatnonzero((np.abs(one.displacement - at) < reach) & (one.velocity >= 0.0))
    rows = slice(int(passed[0]), int(passed[-1]) + 1)
    axis = Axis("displacement from the gap", "um", (-MICROMETRES * reach, MICROMETRES * reach))
    half = MICROMETRES * one.layer_width / 2.0
    lines = tuple(Line("x", edge, "", "gap") for edge in (-half, half))
    x = (one.displacement - at) * MICROMETRES
    return Panel(axis, Axis("force", "kN"), tuple(_traces(one, x, rows, legend=False)), lines=lines)


def _traces(one: LawComparison, x: np.ndarray, rows: slice, *, legend: bool) -> Iterator[Trace]:
    yield Trace("piecewise law", x[rows], one.piecewise[rows] * KN, "beneath", "beneath",
                legend=legend)  # fmt: skip
    yield Trace("hyperbolic tangent", x[rows], one.smooth[rows] * KN, colour="main",
                legend=legend)  # fmt: skip


def fits(data: Laws) -> Evaluation:
    """P1: differences outside the switching layers, and how wide these are."""
    parts: list[Part] = []
    numbers: dict[Name, Number] = {}
    for one in data.conditions:
        name = one.condition
        parts.append(Part(name, one.largest < FITS * one.largest_force))
        numbers |= {
            ("largest difference outside the layers", name): Number(one.largest, "N"),
            ("rms difference outside", name): Number(one.rms, "N"),
            ("largest difference inside", name): Number(one.largest_inside, "N"),
            ("largest force", name): Number(one.largest_force, "N"),
        }
    width = data.conditions[0].layer_width
    parts.append(Part("the layer is narrower than 1 % of the gap", width < THIN * abs(data.at)))
    numbers["width of the layer"] = Number(width * MICROMETRES, "um")
    return decide(parts, numbers)


FIGURE = PaperFigure(
    "figure-06", TITLE, compute, draw,
    (
        Claim("P1", "Fig. 6, 3", "tanh with eps = 1e6 fits the piecewise law in three conditions",
              fits),
    ),
)  # fmt: skip
