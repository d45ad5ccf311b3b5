"""Figure 19: the damping of the isolation."""

from __future__ import annotations

from flipflow.paper.families import NO_RANGE, SHOWN, WHOLE, FamilyPlan, family_paper_figure
from flipflow.paper.trends import (
    DOWN,
    FIRST_PEAK,
    SECOND_PEAK,
    Trend,
    trend_claim,
)

WHERE = "Fig. 19"
PLAN = FamilyPlan("isolation_damping", WHOLE, SHOWN, "isolation_damping", NO_RANGE)
FIGURE = family_paper_figure(
    "figure-19",
    "Effect of the damping of the isolation springs",
    PLAN,
    (
        trend_claim("V8a", WHERE, "as c1 grows, the first peak falls", Trend(FIRST_PEAK, DOWN)),
        trend_claim("V8b", WHERE, "as c1 grows, the second peak falls", Trend(SECOND_PEAK, DOWN)),
    ),
)
