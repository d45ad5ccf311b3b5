"""Figure 15: the stiffness of the shear springs."""

from __future__ import annotations

from flipflow.paper.families import NO_RANGE, SHOWN, WHOLE, FamilyPlan, family_paper_figure
from flipflow.paper.trends import (
    DOWN,
    FIRST,
    FIRST_PEAK,
    SECOND,
    SECOND_PEAK,
    UP,
    AmplitudeTrend,
    Trend,
    Unchanged,
    ZoneTrend,
    trend_claim,
)

WHERE = "Fig. 15"
PLAN = FamilyPlan("shear_stiffness", WHOLE, SHOWN, "shear_stiffness", NO_RANGE)
FIGURE = family_paper_figure(
    "figure-15",
    "Effect of the stiffness of the shear springs",
    PLAN,
    (
        trend_claim(
            "V4a",
            WHERE,
            "k2 acts to the right of w01, which it leaves alone",
            Unchanged((FIRST, FIRST_PEAK)),
        ),
        trend_claim("V4b", WHERE, "as k2 grows, w02 moves right", Trend(SECOND, UP)),
        trend_claim("V4c", WHERE, "as k2 grows, the second peak grows", Trend(SECOND_PEAK, UP)),
        trend_claim(
            "V4d", WHERE, "as k2 grows, the zone of several solutions shrinks", ZoneTrend(DOWN)
        ),
        trend_claim(
            "V4e",
            WHERE,
            "as k2 grows, the relative amplitude in the region falls",
            AmplitudeTrend(DOWN),
        ),
    ),
)
