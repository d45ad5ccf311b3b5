"""How little it takes to throw a working motion onto another one, in a plant's words."""

from __future__ import annotations

import math

from flipflow.periodic.orbit import Orbit
from flipflow.report.numbers import number, quantity
from flipflow.studies.jump_risk import JumpRisk


def risk_words(risk: JumpRisk) -> list[str]:
    """The jump risk in a plant's words."""
    here = f"The working motion, {millimetres(risk.orbit)}, is the one reached from below."
    words = [here]
    if not risk.others:
        words.append(risk.notes[0])
        return words
    blow = risk.worst_impulse
    if blow is None:
        words.append("No blow that was tried throws it onto another motion.")
    else:
        words.append(
            f"A blow of {number(blow.size)} kg m/s along the surface on the {blow.frame} frame "
            f"throws it to {millimetres(blow.lands)}, at the worst moment "
            f"({_degrees(blow.phase)} of the unbalance, towards "
            f"{'+x' if blow.impulse > 0 else '-x'}"
            "). At no other moment, and on neither frame, was a lighter one found."
        )
    lump = risk.worst_lump
    if lump is None:
        words.append(
            "A lump of material that lands on a frame and leaves with the feed does not, however "
            "heavy it is."
        )
    else:
        words.append(
            f"So does a lump of {number(lump.size)} kg that lands on the {lump.frame} frame at "
            f"{_degrees(lump.phase)} and leaves with the feed within the turn."
        )
    words += [f"Note: {note}" for note in risk.notes]
    return words


def moment_words(risk: JumpRisk) -> str:
    """When the least blow and the least lump do it, for a reader who knows their sizes."""
    words = ["The working motion is the one reached from below."]
    if blow := risk.worst_impulse:
        words.append(
            f"The worst moment for the {blow.frame} frame is {_degrees(blow.phase)} of the "
            f"unbalance, for a blow along the surface towards {'+x' if blow.impulse > 0 else '-x'}."
        )
    if lump := risk.worst_lump:
        words.append(
            f"The lump lands at {_degrees(lump.phase)} and leaves with the feed within the turn."
        )
    return " ".join([*words, *risk.notes])


def _degrees(phase: float) -> str:
    return f"{math.degrees(phase):.0f} deg"


def millimetres(orbit: Orbit) -> str:
    """Amplitude of the relative motion."""
    return quantity(orbit.amplitude("relative"), "mm", "m")
