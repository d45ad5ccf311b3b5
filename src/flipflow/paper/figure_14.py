"""Figure 14: the damping of the stop."""

from __future__ import annotations

from flipflow.paper.families import FamilyPlan, family_paper_figure
from flipflow.paper.trends import (
    ANTIRESONANCE,
    DOWN,
    SECOND,
    SECOND_PEAK,
    UP,
    AmplitudeTrend,
    Trend,
    trend_claim,
)

WHERE = "Fig. 14"
PLAN = FamilyPlan("stop_damping", (1.0, 2.0, 3.0, 4.0), (1.0, 2.0, 3.0, 4.0), "shear_damping")
FIGURE = family_paper_figure(
    "figure-14",
    "Effect of the damping of the stop spring",
    PLAN,
    (
        trend_claim(
            "V3a", WHERE, "as c3 grows, w02 moves slightly left", Trend(SECOND, DOWN, slight=True)
        ),
        trend_claim("V3b", WHERE, "as c3 grows, the second peak falls", Trend(SECOND_PEAK, DOWN)),
        trend_claim(
            "V3c",
            WHERE,
            "as c3 grows, the main frame moves more near the anti-resonance",
            Trend(ANTIRESONANCE, UP),
        ),
        trend_claim(
            "V3d",
            WHERE,
            "as c3 grows, the relative amplitude near the anti-resonance falls",
            AmplitudeTrend(DOWN, near_antiresonance=True),
        ),
    ),
)
