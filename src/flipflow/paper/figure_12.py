"""Figure 12: the gap of the stop."""

from __future__ import annotations

import numpy as np

from flipflow.paper.claims import Claim, Evaluation, Name, Number, Part, decide
from flipflow.paper.families import FamilyPlan, family_paper_figure
from flipflow.paper.trends import (
    DOWN,
    REGION,
    SECOND,
    SECOND_PEAK,
    UP,
    AmplitudeTrend,
    FamilyPair,
    Trend,
    ZoneTrend,
    trend_claim,
)
from flipflow.studies.response_family import Member

WHERE = "Fig. 12"
PLAN = FamilyPlan("clearance", (2, 3, 4, 5, 6, 7, 8), (2, 4, 6, 8), None)
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


FIGURE = family_paper_figure(
    "figure-12", "Effect of the clearance of the stop spring", PLAN,
    (
        Claim("V1a", WHERE, "below contact the curves of all clearances coincide", coincide),
        trend_claim("V1b", WHERE, "as e grows, w02 moves left", Trend(SECOND, DOWN)),
        trend_claim("V1c", WHERE, "as e grows, the second peak grows", Trend(SECOND_PEAK, UP)),
        trend_claim("V1d", WHERE, "as e grows, a zone of several solutions appears and widens",
                    ZoneTrend(UP, appears=True)),
        trend_claim("V1e", WHERE, "as e grows, the operating region shrinks", Trend(REGION, DOWN)),
        trend_claim("V1f", WHERE, "as e grows, the relative amplitude in the region grows",
                    AmplitudeTrend(UP)),
    ),
)  # fmt: skip
