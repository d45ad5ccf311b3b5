"""The jump risk of a screen in numbers."""

from __future__ import annotations

from typing import Any

from flipflow.results.codec import exact
from flipflow.studies.jump_risk import JumpRisk, Throw


def risk_summary(risk: JumpRisk) -> dict[str, Any]:
    """Least impulse and lump, SI and rad; null where nothing throws the motion."""
    return {
        "working_relative_amplitude": risk.orbit.amplitude("relative"),
        "other_motions": len(risk.others),
        "impulse": _throw_summary(risk.worst_impulse),
        "lump": _throw_summary(risk.worst_lump),
        "largest_impulse": {str(frame): size for frame, size in risk.largest_impulse.items()},
        "notes": list(risk.notes),
    }


def _throw_summary(throw: Throw | None) -> dict[str, Any] | None:
    if throw is None:
        return None
    fields = dict(vars(throw))
    lands = fields.pop("lands")
    return {**exact(fields), "lands_on_relative_amplitude": lands.amplitude("relative")}
