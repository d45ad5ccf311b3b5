"""Figure 13: the stiffness of the stop."""

from __future__ import annotations

from flipflow.paper.families import FamilyPlan, family_paper_figure
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

WHERE = "Fig. 13"
PLAN = FamilyPlan(
    "stop_stiffness", (1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0), (1.0, 2.0, 3.0, 4.0), "shear_stiffness"
)
FIGURE = family_paper_figure(
    "figure-13",
    "Effect of the stiffness of the stop spring",
    PLAN,
    (
        trend_claim("V2a", WHERE, "as k3 grows, w02 moves right", Trend(SECOND, UP)),
        trend_claim("V2b", WHERE, "as k3 grows, the second peak grows", Trend(SECOND_PEAK, UP)),
        trend_claim(
            "V2c",
            WHERE,
            "as k3 grows, a zone of several solutions appears and widens",
            ZoneTrend(UP, appears=True),
        ),
        trend_claim("V2d", WHERE, "as k3 grows, the operating region widens", Trend(REGION, UP)),
        trend_claim(
            "V2e",
            WHERE,
            "as k3 grows, the relative amplitude in the region falls",
            AmplitudeTrend(DOWN),
        ),
    ),
)
