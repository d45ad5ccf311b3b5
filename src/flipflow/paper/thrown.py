"""A blow between the folds: how large it must be, and a run in which it throws the motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flipflow.continuation.branch import Branch
from flipflow.model.disturbance import Impulse
from flipflow.model.screen import FlipFlowScreen
from flipflow.paper.claims import Evaluation, Name, Number, Part, decide
from flipflow.plotting.history import envelope
from flipflow.plotting.panels import Axis, Line, Panel, Trace
from flipflow.plotting.scales import DEGREES, MM
from flipflow.studies.basins import Basins, basins
from flipflow.studies.jump_risk import JumpRisk, Throw, jump_risk
from flipflow.transient.history import History
from flipflow.transient.simulate import simulate

CELLS = 60
TURNS, BLOW_AFTER = 240, 60
MORE = 1.02
REACHED = 1e-3


@dataclass(frozen=True, eq=False)
class Thrown:
    """What a blow does to the upper motion at a speed between the folds.

    Parameters
    ----------
    omega
        The speed in rad/s.
    basins
        Which motion states settle on, over relative displacement and velocity.
    risk
        The least blows.
    blow, history
        A blow a little above the least, and the run with it; None where none was found.
    """

    omega: float
    basins: Basins
    risk: JumpRisk
    blow: Impulse | None
    history: History | None


def thrown(screen: FlipFlowScreen, branch: Branch, omega: float) -> Thrown:
    """Basins as far as the upper motion swings, the least blow, and a run with it."""
    upper = branch.orbits_at(omega)[0]
    reach = upper.amplitude("relative")
    share = np.linspace(-1.0, 1.0, CELLS)
    found = basins(screen, omega, {"relative": reach * share}, {"relative": omega * reach * share})
    risk = jump_risk(screen, upper)
    worst = risk.worst_impulse
    if worst is None:
        return Thrown(omega, found, risk, None, None)
    blow = _blow(worst, omega)
    history = simulate(screen, omega, TURNS, initial=upper, disturbances=(blow,))
    return Thrown(omega, found, risk, blow, history)


def _blow(least: Throw, omega: float) -> Impulse:
    t = (2.0 * math.pi * BLOW_AFTER + least.phase) / omega
    return Impulse(t, least.frame, MORE * least.impulse)


def thrown_panel(data: Thrown) -> Panel:
    """Least and greatest relative displacement turn by turn."""
    title = f"relative displacement at {data.omega:.6g} rad/s"
    axes = Axis("time", "s"), Axis("displacement", "mm")
    if data.history is None or data.blow is None:
        return Panel(*axes, title=f"{title}: no blow throws it")
    h = data.history
    t, low, high = envelope(h.t, h.displacement("relative") * MM, TURNS)
    area = Trace(
        "relative displacement", t, high, "case band", "case band", legend=False, lower=low
    )
    edges = [Trace("", t, y, colour="relative", legend=False) for y in (low, high)]
    words = f"{data.blow.impulse:.4g} kg m/s on the {data.blow.which} frame"
    line = Line("x", data.blow.t, words, "limit")
    return Panel(
        Axis("time", "s", (0.0, float(h.t[-1]))), axes[1], (area, *edges), lines=(line,),
        title=title,
    )  # fmt: skip


def thrown_to_the_lower(data: Thrown) -> Evaluation:
    """Whether the blow ends on a stable motion of smaller amplitude, and the numbers to it."""
    shares = {id(o): float(s) for o, s in zip(data.basins.orbits, data.basins.shares, strict=True)}
    ordered = sorted(data.basins.orbits, key=lambda o: o.amplitude("relative"))
    numbers: dict[Name, Number] = {
        "speed": Number(data.omega, "rad/s"),
        "share of states that settle on the lower motion": Number(100.0 * shares[id(ordered[0])],
                                                                  "%"),
        "on the upper": Number(100.0 * shares[id(ordered[-1])], "%"),
    }  # fmt: skip
    if data.history is None or data.blow is None or data.risk.worst_impulse is None:
        return decide([Part("a blow that does it", False)], numbers)
    worst, h = data.risk.worst_impulse, data.history
    last = h.displacement("relative")[h.angle > h.angle[-1] - 2.0 * math.pi]
    end = float(last.max() - last.min()) / 2.0
    expected = worst.lands.amplitude("relative")
    before = data.risk.orbit.amplitude("relative")
    numbers |= {
        f"least impulse, {worst.frame} frame": Number(abs(worst.impulse), "kg m/s"),
        "unbalance ahead of +x then": Number(worst.phase * DEGREES, "deg"),
        "impulse of the run": Number(abs(data.blow.impulse), "kg m/s"),
        "its time": Number(data.blow.t, "s"),
        "amplitude before": Number(MM * before, "mm"),
        "amplitude at the end": Number(MM * end, "mm"),
        "of the lower motion": Number(MM * expected, "mm"),
    }
    reached = bool(h.settled) and abs(end / expected - 1.0) < REACHED
    return decide([Part("the run ends on the lower motion", reached and end < before)], numbers)
