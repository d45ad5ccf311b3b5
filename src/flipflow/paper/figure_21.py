"""Figure 21: the mass of the floating frame."""

from __future__ import annotations

from flipflow.paper.families import RISING, FamilyPlan, family_paper_figure
from flipflow.paper.trends import (
    DOWN,
    FIRST,
    FIRST_PEAK,
    SECOND,
    SECOND_PEAK,
    UP,
    AmplitudeTrend,
    Trend,
    trend_claim,
)

WHERE = "Fig. 21"
PLAN = FamilyPlan("floating_mass", RISING, RISING, "floating_mass")
FIGURE = family_paper_figure(
    "figure-21",
    "Effect of the mass of the floating frame",
    PLAN,
    (
        trend_claim("V10a", WHERE, "as m2 grows, w01 moves left", Trend(FIRST, DOWN)),
        trend_claim("V10b", WHERE, "as m2 grows, w02 moves left", Trend(SECOND, DOWN)),
        trend_claim(
            "V10c",
            WHERE,
            "as m2 grows, the first peak of the main frame falls",
            Trend(FIRST_PEAK, DOWN),
        ),
        trend_claim(
            "V10d",
            WHERE,
            "as m2 grows, the second peak of the main frame grows",
            Trend(SECOND_PEAK, UP),
        ),
        trend_claim(
            "V10e",
            WHERE,
            "as m2 grows, the relative amplitude in the region grows",
            AmplitudeTrend(UP),
        ),
    ),
)
