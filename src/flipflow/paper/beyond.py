"""Found beyond the paper: what the exact motion does just above contact that no figure of it shows.

At small gaps the motion loses its symmetry; under the floating frame's weight, which the paper
leaves out, the motion of one turn gives way to one of two.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.continuation.branch import Branch
from flipflow.continuation.continue_orbit import switch_branch
from flipflow.continuation.frequency_response import frequency_response
from flipflow.continuation.special_points import DOUBLING
from flipflow.errors import IncompleteError
from flipflow.model.screen import FlipFlowScreen
from flipflow.paper.claims import Claim, Evaluation, Name, Number, Part, decide, undecided
from flipflow.paper.figure import PaperFigure
from flipflow.periodic.orbit import Orbit
from flipflow.plotting.family import leaning_panel, speed_axis_in_radians
from flipflow.plotting.figure import Figure
from flipflow.plotting.panels import Axis, Line, Panel, Role, Trace
from flipflow.plotting.scales import MM
from flipflow.studies.gaps_under_weight import GapsUnderWeight, gaps_under_weight
from flipflow.studies.landmarks import analysed_range
from flipflow.studies.leaning_motions import leaning_motions

TITLE = "Just above contact: motions that lean to one side, and motions of two turns"
LEANING, UPRIGHT = (2e-3, 3e-3), 4e-3  # gaps in m
MARGIN = 1.2  # times the speed of contact, followed under weight
WORKING_SPEED = 850.0 * math.pi / 30.0
SAMPLES = 720  # times in a turn at which a motion's extremes are looked for
SPEEDS = 25  # at which a stretch of equal stability is drawn
CAPTION = (
    "Excursion of the relative displacement just above the speed at which contact begins. Solid: "
    "stable; dashed: unstable. The first panels: small gaps, without weight; the machine leans to "
    "one side or, mirrored, to the other. The last: gaps as drawn, shifted by the floating frame's "
    "weight on the inclined deck, towards the side that is then farther away; between the period "
    "doublings every other turn reaches farther."
)


@dataclass(frozen=True, eq=False)
class Leaning:
    """A gap in m, its motions over speed, and windows of motions that lean to one side."""

    clearance: float
    branch: Branch
    windows: tuple[tuple[Orbit, ...], ...]

    @property
    def label(self) -> str:
        """The gap in words."""
        return f"e = {self.clearance * MM:g} mm"


@dataclass(frozen=True, eq=False)
class Weighed:
    """The machine under its weight: motions of one turn, gaps, contact, forces.

    ``doubled`` are motions of two turns that branch off just above contact.
    """

    branch: Branch
    gaps: GapsUnderWeight
    contact: float
    doubled: tuple[Branch, ...]

    @property
    def just_above(self) -> tuple[tuple[float, float], ...]:
        """Speeds in rad/s just above contact between which a turn gives way to two."""
        most = MARGIN * self.contact
        return tuple(pair for pair in self.gaps.doubled if self.contact < pair[0] < most)


@dataclass(frozen=True, eq=False)
class Beyond:
    """Both findings; ``weighed`` is None without a deck angle."""

    leaning: tuple[Leaning, ...]
    weighed: Weighed | None


def compute(screen: FlipFlowScreen) -> Beyond:
    """Three gaps without weight, and the machine as drawn with it."""
    even = screen.replace(clearance_measured="standing", clearance_minus=None)
    found = []
    for gap in (*LEANING, UPRIGHT):
        machine = even.replace(clearance=gap)
        branch = frequency_response(machine, analysed_range(machine))
        found.append(Leaning(gap, branch, leaning_motions(branch)))
    return Beyond(tuple(found), _weighed(screen) if screen.weight_considered else None)


def _weighed(screen: FlipFlowScreen) -> Weighed:
    """Motions around the speed of contact, and those of two turns that branch off."""
    drawn = screen.replace(clearance_measured="drawn")
    branch = frequency_response(drawn, analysed_range(drawn))
    gaps = gaps_under_weight(drawn, branch, branch.orbit_from_below(WORKING_SPEED))
    touched = [one for one in (gaps.contact_plus, gaps.contact_minus) if one is not None]
    if not touched:
        raise IncompleteError("The stop is never touched.")
    begin = min(touched)
    firsts = sorted(branch.points_of(DOUBLING), key=lambda point: point.position)[::2]
    doubled = [
        switch_branch(point, (begin / MARGIN, begin * MARGIN))
        for point in firsts
        if begin < point.omega < begin * MARGIN
    ]
    return Weighed(branch, gaps, begin, tuple(doubled))


def draw(data: Beyond) -> Figure:
    """A panel for each gap at which motions lean, and one for the weight."""
    panels = [
        leaning_panel(one.branch, one.windows, f"loss of symmetry at {one.label}")
        for one in data.leaning
        if one.windows
    ]
    if data.weighed is not None:
        panels.append(_doubled_panel(data.weighed))
    if not panels:
        raise IncompleteError("No motion leans or takes two turns, and there is no deck angle.")
    return Figure(TITLE, CAPTION, tuple(panels), height=60 + 220 * len(panels))


def _doubled_panel(data: Weighed) -> Panel:
    """Excursion of each turn towards the farther stop, where one turn and the next differ most."""
    ends = [speed for pair in data.just_above for speed in pair]
    contacts = [w for w in (data.gaps.contact_plus, data.gaps.contact_minus) if w is not None]
    low, high = min((*ends, *contacts)), max((*ends, *contacts))
    low, high = low - 0.25 * (high - low), high + 0.25 * (high - low)
    traces = list(_one_turn(data.branch, sorted((low, *ends, high))))
    for k, branch in enumerate(data.doubled):
        order = np.argsort(branch.omega)
        turns = np.sort([_excursions(branch.orbit(int(i))) for i in order], axis=1)
        for column, name, colour in ((1, "farther turn", "case 1"), (0, "other turn", "case 2")):
            traces.append(
                Trace(f"motion of two turns: {name}", branch.omega[order], turns[:, column],
                      "stable", colour, legend=k == 0, bold=True)
            )  # fmt: skip
    lines = tuple(Line("x", at, f"{at:.4g}", "mark") for at in ends)
    return Panel(
        speed_axis_in_radians(low, high), Axis("excursion |x2|", "mm"), tuple(traces), lines=lines,
        title="period doubling under the floating frame's weight",
    )  # fmt: skip


def _one_turn(branch: Branch, ends: list[float]) -> Iterator[Trace]:
    """Between two speeds at which its stability changes each, as the speed rises."""
    for k, (start, end) in enumerate(itertools.pairwise(ends)):
        omega = np.linspace(start, end, SPEEDS)
        orbits = [branch.orbit_from_below(float(speed)) for speed in omega]
        height = np.array([math.nan if o is None else _excursions(o)[0] for o in orbits])
        middle = orbits[SPEEDS // 2]
        role: Role = "stable" if middle is not None and middle.stable else "unstable"
        yield Trace("motion of one turn", omega, height, role, "case 0", legend=k == 0, bold=True)


def _excursions(orbit: Orbit) -> Real:
    """Greatest displacement of each turn towards the minus side in mm, (periods,)."""
    turn = 2.0 * math.pi / orbit.omega
    t = turn * np.arange(orbit.periods * SAMPLES) / SAMPLES
    x = orbit.displacement("relative", t).reshape(orbit.periods, SAMPLES)
    return np.asarray(-MM * x.min(axis=1))


def leans(data: Beyond) -> Evaluation:
    """B1: windows of stable motions with a mean, and none at the larger gap."""
    parts: list[Part] = []
    numbers: dict[Name, Number] = {}
    for one in data.leaning:
        wanted = one.clearance in LEANING
        parts.append(
            Part(f"{'' if wanted else 'none '}at {one.label}", bool(one.windows) is wanted)
        )
        for k, window in enumerate(one.windows):
            most = max(window, key=lambda orbit: abs(orbit.mean("relative")))
            half, mean = most.amplitude("relative"), abs(most.mean("relative"))
            row = one.label if k == 0 else f"{one.label}, again"
            numbers |= {
                (row, "from"): Number(window[0].omega, "rad/s"),
                (row, "to"): Number(window[-1].omega, "rad/s"),
                (row, "most at"): Number(most.omega, "rad/s"),
                (row, "farther side"): Number(MM * (half + mean), "mm"),
                (row, "nearer side"): Number(MM * (half - mean), "mm"),
            }
    return decide(parts, numbers)


def doubles(data: Beyond) -> Evaluation:
    """B2: shift of the gaps, contact on either side, and where a turn gives way to two."""
    if data.weighed is None:
        return undecided("frames.deck_angle, without which the weight is not considered")
    gaps = data.weighed.gaps
    numbers: dict[Name, Number] = {
        "shift of the gaps": Number(MM * gaps.shift, "mm"),
        **_speeds("contact begins, nearer side", gaps.contact_plus),
        **_speeds("contact begins, farther side", gaps.contact_minus),
    }
    for low, high in gaps.doubled:
        where = "just above contact" if (low, high) in data.weighed.just_above else "far above it"
        numbers |= _speeds(f"two turns {where}, from", low) | _speeds(f"{where}, to", high)
    if gaps.force_plus is not None and gaps.force_minus is not None:
        numbers["stop force at 850 rpm", "nearer side"] = Number(1e-3 * gaps.force_plus, "kN")
        numbers["stop force at 850 rpm", "farther side"] = Number(1e-3 * gaps.force_minus, "kN")
    followed = any(bool(np.any(branch.stable)) for branch in data.weighed.doubled)
    parts = [
        Part("the motion of one turn loses its stability", bool(data.weighed.just_above)),
        Part("a stable motion of two turns takes its place", followed),
    ]
    return decide(parts, numbers)


def _speeds(name: str, omega: float | None) -> dict[Name, Number]:
    rpm = None if omega is None else omega * 30.0 / math.pi
    return {(name, "speed"): Number(rpm, "rpm"), (name, "frequency"): Number(omega, "rad/s")}


FIGURE: PaperFigure[Beyond] = PaperFigure(
    "figure-beyond", TITLE, compute, draw, (),
    findings=(
        Claim("B1", "beside Fig. 12", "at e = 2 and 3 mm the exact motion leans to one side in a "
              "narrow band just above contact; at 4 mm it does not", leans),
        Claim("B2", "not in the model", "under the floating frame's weight on the inclined deck "
              "the motion of one turn gives way to one of two just above contact", doubles),
    ),
)  # fmt: skip
