"""Figures 12 to 21: one field of the machine varied in each."""

from __future__ import annotations

import numpy as np

from flipflow.paper.claims import Claim, Evaluation, Name, Number, Part, decide
from flipflow.paper.families import (
    NO_RANGE,
    RISING,
    SHOWN,
    WHOLE,
    FamilyPlan,
    draw_family,
    family_tables,
)
from flipflow.paper.figure import PaperFigure
from flipflow.paper.trends import (
    ANTIRESONANCE,
    DOWN,
    FIRST,
    FIRST_PEAK,
    REGION,
    RELATIVE_PEAK,
    SECOND,
    SECOND_PEAK,
    UP,
    AmplitudeTrend,
    FamilyPair,
    Rule,
    Trend,
    Unchanged,
    ZoneTrend,
    trend_claim,
)
from flipflow.plotting.figure import Figure
from flipflow.studies.response_family import Member

SAME = 1e-6
BELOW = "greatest relative difference from the largest gap"


def coincide(pair: FamilyPair) -> Evaluation:
    """Below contact all members move as the one with the largest gap."""
    parts: list[Part] = []
    numbers: dict[Name, Number] = {}
    members = pair.exact.members
    widest = members[-1]
    for member, label in zip(members[:-1], pair.labels[:-1], strict=True):
        worst = _difference(member, widest)
        parts.append(Part(label, None if worst is None else worst < SAME))
        numbers[BELOW, label] = Number(worst)
    numbers[BELOW, pair.labels[-1]] = Number(0.0)
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


def _family(
    number: int,
    title: str,
    plan: FamilyPlan,
    *trends: tuple[str, str, Rule],
    first: tuple[Claim[FamilyPair], ...] = (),
) -> PaperFigure[FamilyPair]:
    """Amplitudes over frequency for several values of one field; ``first`` are other claims."""

    def drawn(pair: FamilyPair) -> Figure:
        return draw_family(pair, title, plan.note)

    rest = (trend_claim(id_, f"Fig. {number}", told, rule) for id_, told, rule in trends)
    return PaperFigure(
        f"figure-{number}", title, plan.compute, drawn, (*first, *rest), family_tables
    )


FAMILIES = (
    _family(
        12, "Effect of the clearance of the stop spring",
        FamilyPlan("clearance", (2, 3, 4, 5, 6, 7, 8), (2, 4, 6, 8), None),
        ("V1b", "as e grows, w02 moves left", Trend(SECOND, DOWN)),
        ("V1c", "as e grows, the second peak grows", Trend(SECOND_PEAK, UP)),
        ("V1d", "as e grows, a zone of several solutions appears and widens",
         ZoneTrend(UP, appears=True)),
        ("V1e", "as e grows, the operating region shrinks", Trend(REGION, DOWN)),
        ("V1f", "as e grows, the relative amplitude in the region grows", AmplitudeTrend(UP)),
        first=(
            Claim("V1a", "Fig. 12", "below contact the curves of all clearances coincide",
                  coincide),
        ),
    ),
    _family(
        13, "Effect of the stiffness of the stop spring",
        FamilyPlan("stop_stiffness", (1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0), (1.0, 2.0, 3.0, 4.0),
                   "shear_stiffness"),
        ("V2a", "as k3 grows, w02 moves right", Trend(SECOND, UP)),
        ("V2b", "as k3 grows, the second peak grows", Trend(SECOND_PEAK, UP)),
        ("V2c", "as k3 grows, a zone of several solutions appears and widens",
         ZoneTrend(UP, appears=True)),
        ("V2d", "as k3 grows, the operating region widens", Trend(REGION, UP)),
        ("V2e", "as k3 grows, the relative amplitude in the region falls", AmplitudeTrend(DOWN)),
    ),
    _family(
        14, "Effect of the damping of the stop spring",
        FamilyPlan("stop_damping", (1.0, 2.0, 3.0, 4.0), (1.0, 2.0, 3.0, 4.0), "shear_damping"),
        ("V3a", "as c3 grows, w02 moves slightly left", Trend(SECOND, DOWN, slight=True)),
        ("V3b", "as c3 grows, the second peak falls", Trend(SECOND_PEAK, DOWN)),
        ("V3c", "as c3 grows, the main frame moves more near the anti-resonance",
         Trend(ANTIRESONANCE, UP)),
        ("V3d", "as c3 grows, the relative amplitude near the anti-resonance falls",
         AmplitudeTrend(DOWN, near_antiresonance=True)),
    ),
    _family(
        15, "Effect of the stiffness of the shear springs",
        FamilyPlan("shear_stiffness", WHOLE, SHOWN, "shear_stiffness", NO_RANGE),
        ("V4a", "k2 acts to the right of w01, which it leaves alone",
         Unchanged((FIRST, FIRST_PEAK))),
        ("V4b", "as k2 grows, w02 moves right", Trend(SECOND, UP)),
        ("V4c", "as k2 grows, the second peak grows", Trend(SECOND_PEAK, UP)),
        ("V4d", "as k2 grows, the zone of several solutions shrinks", ZoneTrend(DOWN)),
        ("V4e", "as k2 grows, the relative amplitude in the region falls", AmplitudeTrend(DOWN)),
    ),
    _family(
        16, "Effect of the damping of the shear springs",
        FamilyPlan("shear_damping", WHOLE, SHOWN, "shear_damping", NO_RANGE),
        ("V5a", "as c2 grows, the second peak falls", Trend(SECOND_PEAK, DOWN)),
        ("V5b", "as c2 grows, w02 moves slightly left", Trend(SECOND, DOWN, slight=True)),
        ("V5c", "as c2 grows, the main frame moves more at the anti-resonance",
         Trend(ANTIRESONANCE, UP)),
    ),
    _family(
        17, "Effect of the eccentric mass moment",
        FamilyPlan("eccentric_moment", RISING, RISING, "eccentric_moment"),
        ("V6a", "as m0r grows, w02 moves right", Trend(SECOND, UP)),
        ("V6b", "as m0r grows, the second peak grows", Trend(SECOND_PEAK, UP)),
        ("V6c", "as m0r grows, the relative amplitude grows", AmplitudeTrend(UP)),
        ("V6d", "as m0r grows, the zone of several solutions shrinks", ZoneTrend(DOWN)),
        ("V6e", "as m0r grows, the operating region widens", Trend(REGION, UP)),
    ),
    _family(
        18, "Effect of the stiffness of the isolation springs",
        FamilyPlan("isolation_stiffness", WHOLE, SHOWN, "isolation_stiffness", NO_RANGE),
        ("V7a", "as k1 grows, w01 moves right", Trend(FIRST, UP)),
        ("V7b", "as k1 grows, the first peak grows", Trend(FIRST_PEAK, UP)),
        ("V7c", "k1 changes little else",
         Unchanged((SECOND, SECOND_PEAK, RELATIVE_PEAK, REGION, ANTIRESONANCE))),
    ),
    _family(
        19, "Effect of the damping of the isolation springs",
        FamilyPlan("isolation_damping", WHOLE, SHOWN, "isolation_damping", NO_RANGE),
        ("V8a", "as c1 grows, the first peak falls", Trend(FIRST_PEAK, DOWN)),
        ("V8b", "as c1 grows, the second peak falls", Trend(SECOND_PEAK, DOWN)),
    ),
    _family(
        20, "Effect of the mass of the main frame",
        FamilyPlan("main_mass", RISING, RISING, "main_mass"),
        ("V9a", "as m1 grows, w01 moves left", Trend(FIRST, DOWN)),
        ("V9b", "as m1 grows, w02 moves left", Trend(SECOND, DOWN)),
        ("V9c", "as m1 grows, the first peak falls", Trend(FIRST_PEAK, DOWN)),
        ("V9d", "as m1 grows, the second peak falls", Trend(SECOND_PEAK, DOWN)),
        ("V9e", "as m1 grows, the zone of several solutions widens", ZoneTrend(UP)),
        ("V9f", "as m1 grows, the operating region narrows", Trend(REGION, DOWN)),
    ),
    _family(
        21, "Effect of the mass of the floating frame",
        FamilyPlan("floating_mass", RISING, RISING, "floating_mass"),
        ("V10a", "as m2 grows, w01 moves left", Trend(FIRST, DOWN)),
        ("V10b", "as m2 grows, w02 moves left", Trend(SECOND, DOWN)),
        ("V10c", "as m2 grows, the first peak of the main frame falls", Trend(FIRST_PEAK, DOWN)),
        ("V10d", "as m2 grows, the second peak of the main frame grows", Trend(SECOND_PEAK, UP)),
        ("V10e", "as m2 grows, the relative amplitude in the region grows", AmplitudeTrend(UP)),
    ),
)  # fmt: skip
