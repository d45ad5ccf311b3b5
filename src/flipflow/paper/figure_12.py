"""Figure 12: the gap of the stop, and the loss of symmetry that the paper does not show."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from flipflow.continuation.special_points import SYMMETRY
from flipflow.model.screen import FlipFlowScreen
from flipflow.paper.claims import Claim, Evaluation, Number, Part, decide
from flipflow.paper.families import FamilyPlan, draw_family, family_tables
from flipflow.paper.figure import PaperFigure
from flipflow.paper.trends import (
    DOWN,
    REGION,
    SECOND,
    SECOND_PEAK,
    UP,
    AmplitudeTrend,
    FamilyPair,
    Rule,
    Trend,
    ZoneTrend,
    trend_claim,
)
from flipflow.periodic.orbit import Orbit
from flipflow.plotting.family import leaning_panel
from flipflow.plotting.figure import Figure
from flipflow.plotting.scales import MM
from flipflow.report.blocks import Column, Table, cells
from flipflow.studies.leaning_motions import leaning_motions
from flipflow.studies.response_family import Member

TITLE = "Effect of the clearance of the stop spring"
WHERE = "Fig. 12"
PLAN = FamilyPlan("clearance", (2, 3, 4, 5, 6, 7, 8), (2, 4, 6, 8), None)
SAME = 1e-6
SMALLEST = 0
NOTE = (
    "Lowest panel: just above contact the smallest gap loses its symmetry; the motion reaches "
    "farther to one side, which the paper's figure does not show."
)
SIDES = (
    "Loss of symmetry: between these speeds the symmetric motion is unstable, and the machine "
    "leans to one side or to the other."
)


@dataclass(frozen=True, eq=False)
class Clearances:
    """The family, and for each member the motions that lean to one side."""

    pair: FamilyPair
    leaning: tuple[tuple[tuple[Orbit, ...], ...], ...]


def compute(screen: FlipFlowScreen) -> Clearances:
    """The family and every loss of symmetry in it."""
    pair = PLAN.compute(screen)
    return Clearances(pair, tuple(leaning_motions(m.branch) for m in pair.exact.members))


def draw(data: Clearances) -> Figure:
    """The family, with a close-up of the first member that loses its symmetry."""
    figure = draw_family(data.pair, TITLE)
    leaning = next((k for k, windows in enumerate(data.leaning) if windows), None)
    if leaning is None:
        return figure
    title = f"loss of symmetry at e = {data.pair.labels[leaning]}"
    branch = data.pair.exact.members[leaning].branch
    panel = leaning_panel(branch, data.leaning[leaning], title)
    return dataclasses.replace(
        figure, panels=(*figure.panels, panel), height=figure.height + 190,
        caption=f"{figure.caption} {NOTE}",
    )  # fmt: skip


def tables(data: Clearances) -> tuple[Table, ...]:
    """The family's table, and the windows of lost symmetry."""
    rows = []
    for label, windows in zip(data.pair.labels, data.leaning, strict=True):
        for window in windows:
            most = max(window, key=lambda orbit: abs(orbit.mean("relative")))
            half, mean = most.amplitude("relative"), abs(most.mean("relative"))
            rows.append(
                cells(
                    label, f"{window[0].omega:.5g} to {window[-1].omega:.5g}", f"{most.omega:.5g}",
                    f"{MM * (half + mean):.5g}", f"{MM * (half - mean):.5g}",
                )
            )  # fmt: skip
    columns = (
        Column("e"), Column("Leaning motions", "rad/s"), Column("Most", "rad/s", numeric=True),
        Column("farther side", "mm", numeric=True), Column("nearer side", "mm", numeric=True),
    )  # fmt: skip
    lost = (Table("Loss of symmetry", columns, tuple(rows), SIDES),) if rows else ()
    return (*family_tables(data.pair), *lost)


def coincide(data: Clearances) -> Evaluation:
    """Below contact all members move as the one with the largest gap."""
    parts, numbers = [], {}
    members = data.pair.exact.members
    widest = members[-1]
    for member, label in zip(members[:-1], data.pair.labels[:-1], strict=True):
        worst = _difference(member, widest)
        parts.append(Part(label, None if worst is None else worst < SAME))
        numbers[f"greatest difference below contact, {label}"] = Number(worst)
    return decide(parts, numbers)


def symmetric(data: Clearances) -> Evaluation:
    """No symmetry-breaking point on any member."""
    parts, numbers = [], {}
    for member, label in zip(data.pair.exact.members, data.pair.labels, strict=True):
        points = member.branch.points_of(SYMMETRY)
        parts.append(Part(f"e = {label}", None if member.failure else not points))
        for k, point in enumerate(points, start=1):
            numbers[f"symmetry breaking {k}, {label}"] = Number(point.omega, "rad/s")
    return decide(parts, numbers)


def _difference(member: Member, widest: Member) -> float | None:
    """Largest relative difference of the relative amplitude below contact; None if unknown."""
    if member.marks is None or member.marks.omega_cs is None or widest.failure:
        return None
    low = float(widest.branch.omega.min())
    speeds = np.linspace(low, member.marks.omega_cs, 40, endpoint=False).tolist()
    found = [[m.relative_amplitude(omega) for omega in speeds] for m in (member, widest)]
    own, other = np.array(found)
    worst = float(np.max(np.abs(own - other) / other))
    return worst if np.isfinite(worst) else None


def _of_family(id_: str, statement: str, rule: Rule) -> Claim[Clearances]:
    claim = trend_claim(id_, WHERE, statement, rule)
    return Claim(id_, WHERE, statement, lambda data: claim.evaluate(data.pair))


FIGURE = PaperFigure(
    "figure-12", TITLE, compute, draw,
    (
        Claim("V1a", WHERE, "below contact the curves of all clearances coincide", coincide),
        _of_family("V1b", "as e grows, w02 moves left", Trend(SECOND, DOWN)),
        _of_family("V1c", "as e grows, the second peak grows", Trend(SECOND_PEAK, UP)),
        _of_family("V1d", "as e grows, a zone of several solutions appears and widens",
                   ZoneTrend(UP, appears=True)),
        _of_family("V1e", "as e grows, the operating region shrinks", Trend(REGION, DOWN)),
        _of_family("V1f", "as e grows, the relative amplitude in the region grows",
                   AmplitudeTrend(UP)),
        Claim("V1g", WHERE, "the motion stays symmetric at every clearance drawn", symmetric),
    ),
    tables,
)  # fmt: skip
