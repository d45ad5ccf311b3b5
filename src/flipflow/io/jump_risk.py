"""The data document of a jump risk."""

from __future__ import annotations

import dataclasses
from typing import Any

from flipflow.analyses.jump_risk import JumpRisk, Throw


def risk_document(risk: JumpRisk) -> dict[str, Any]:
    """Least impulse and lump, SI and rad; null where nothing throws the motion."""
    return {
        "working_relative_amplitude": risk.orbit.amplitude("relative"),
        "other_motions": len(risk.others),
        "impulse": _throw_document(risk.worst_impulse),
        "lump": _throw_document(risk.worst_lump),
        "largest_impulse": {str(frame): size for frame, size in risk.largest_impulse.items()},
        "notes": list(risk.notes),
    }


def _throw_document(throw: Throw | None) -> dict[str, Any] | None:
    if throw is None:
        return None
    fields = {f.name: getattr(throw, f.name) for f in dataclasses.fields(throw)}
    lands = fields.pop("lands")
    return fields | {"lands_on_relative_amplitude": lands.amplitude("relative")}
