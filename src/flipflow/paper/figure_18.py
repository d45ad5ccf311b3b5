"""Figure 18: the stiffness of the isolation."""

from __future__ import annotations

from flipflow.paper.families import NO_RANGE, SHOWN, WHOLE, FamilyPlan, family_paper_figure
from flipflow.paper.trends import (
    ANTIRESONANCE,
    FIRST,
    FIRST_PEAK,
    REGION,
    RELATIVE_PEAK,
    SECOND,
    SECOND_PEAK,
    UP,
    Trend,
    Unchanged,
    trend_claim,
)

WHERE = "Fig. 18"
PLAN = FamilyPlan("isolation_stiffness", WHOLE, SHOWN, "isolation_stiffness", NO_RANGE)
FIGURE = family_paper_figure(
    "figure-18",
    "Effect of the stiffness of the isolation springs",
    PLAN,
    (
        trend_claim("V7a", WHERE, "as k1 grows, w01 moves right", Trend(FIRST, UP)),
        trend_claim("V7b", WHERE, "as k1 grows, the first peak grows", Trend(FIRST_PEAK, UP)),
        trend_claim(
            "V7c",
            WHERE,
            "k1 changes little else",
            Unchanged((SECOND, SECOND_PEAK, RELATIVE_PEAK, REGION, ANTIRESONANCE)),
        ),
    ),
)
