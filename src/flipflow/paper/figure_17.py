"""Figure 17: the eccentric moment."""

from __future__ import annotations

from flipflow.paper.families import RISING, FamilyPlan, family_paper_figure
from flipflow.paper.trends import (
    DOWN,
    REGION,
    SECOND,
    SECOND_PEAK,
    UP,
    AmplitudeTrend,
    Trend,
    ZoneTrend,
    trend_claim,
)

WHERE = "Fig. 17"
PLAN = FamilyPlan("eccentric_moment", RISING, RISING, "eccentric_moment")
FIGURE = family_paper_figure(
    "figure-17",
    "Effect of the eccentric mass moment",
    PLAN,
    (
        trend_claim("V6a", WHERE, "as m0r grows, w02 moves right", Trend(SECOND, UP)),
        trend_claim("V6b", WHERE, "as m0r grows, the second peak grows", Trend(SECOND_PEAK, UP)),
        trend_claim("V6c", WHERE, "as m0r grows, the relative amplitude grows", AmplitudeTrend(UP)),
        trend_claim(
            "V6d", WHERE, "as m0r grows, the zone of several solutions shrinks", ZoneTrend(DOWN)
        ),
        trend_claim("V6e", WHERE, "as m0r grows, the operating region widens", Trend(REGION, UP)),
    ),
)
