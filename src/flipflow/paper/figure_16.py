"""Figure 16: the damping of the shear springs."""

from __future__ import annotations

from flipflow.paper.families import NO_RANGE, SHOWN, WHOLE, FamilyPlan, family_paper_figure
from flipflow.paper.trends import (
    ANTIRESONANCE,
    DOWN,
    SECOND,
    SECOND_PEAK,
    UP,
    Trend,
    trend_claim,
)

WHERE = "Fig. 16"
PLAN = FamilyPlan("shear_damping", WHOLE, SHOWN, "shear_damping", NO_RANGE)
FIGURE = family_paper_figure(
    "figure-16",
    "Effect of the damping of the shear springs",
    PLAN,
    (
        trend_claim("V5a", WHERE, "as c2 grows, the second peak falls", Trend(SECOND_PEAK, DOWN)),
        trend_claim(
            "V5b", WHERE, "as c2 grows, w02 moves slightly left", Trend(SECOND, DOWN, slight=True)
        ),
        trend_claim(
            "V5c",
            WHERE,
            "as c2 grows, the main frame moves more at the anti-resonance",
            Trend(ANTIRESONANCE, UP),
        ),
    ),
)
