"""What binds: the allowed speed range in one sentence, for page, terminal and document."""

from __future__ import annotations

from flipflow.model.numerals import case_words, span
from flipflow.model.quantities import QUANTITIES
from flipflow.studies.feasible import REGION, STABILITY, Bound
from flipflow.studies.operating_region import OperatingRegion


def allowed_range(region: OperatingRegion) -> str:
    """The allowed speed range and what ends it."""
    if not region.feasible:
        return "none; no speed meets all limits in all load cases."
    parts = []
    for (low, high), (lower, upper) in zip(region.feasible, region.binding, strict=True):
        first, last = _bound(lower, region.ends[0]), _bound(upper, region.ends[1])
        parts.append(f"{span(low, high)}, from {first} to {last}")
    return "; ".join(parts) + "."


def _bound(bound: Bound, region_end: str) -> str:
    """What ends the allowed range; ``region_end`` says what ends the operating region there."""
    if bound.limit == REGION:
        words = region_end.removesuffix(")")
        return f"{words}{', ' if words != region_end else ' ('}empty machine)"
    if bound.limit == "speed":
        return "the limit on speed"
    if bound.limit == STABILITY:
        return (
            f"where the motion is not sure to return after a disturbance ({case_words(bound.case)})"
        )
    return f"the limit on {QUANTITIES[bound.limit].label} ({case_words(bound.case)})"
