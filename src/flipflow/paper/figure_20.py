"""Figure 20: the mass of the main frame."""

from __future__ import annotations

from flipflow.paper.families import RISING, FamilyPlan, family_paper_figure
from flipflow.paper.trends import (
    DOWN,
    FIRST,
    FIRST_PEAK,
    REGION,
    SECOND,
    SECOND_PEAK,
    UP,
    Trend,
    ZoneTrend,
    trend_claim,
)

WHERE = "Fig. 20"
PLAN = FamilyPlan("main_mass", RISING, RISING, "main_mass")
FIGURE = family_paper_figure(
    "figure-20",
    "Effect of the mass of the main frame",
    PLAN,
    (
        trend_claim("V9a", WHERE, "as m1 grows, w01 moves left", Trend(FIRST, DOWN)),
        trend_claim("V9b", WHERE, "as m1 grows, w02 moves left", Trend(SECOND, DOWN)),
        trend_claim("V9c", WHERE, "as m1 grows, the first peak falls", Trend(FIRST_PEAK, DOWN)),
        trend_claim("V9d", WHERE, "as m1 grows, the second peak falls", Trend(SECOND_PEAK, DOWN)),
        trend_claim(
            "V9e", WHERE, "as m1 grows, the zone of several solutions widens", ZoneTrend(UP)
        ),
        trend_claim("V9f", WHERE, "as m1 grows, the operating region narrows", Trend(REGION, DOWN)),
    ),
)
