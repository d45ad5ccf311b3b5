"""Why a machine has no motion at a speed, as integers in arrays and as words."""

from __future__ import annotations

from collections.abc import Mapping

NOT_COMPUTED, FOUND, REFUSED, INCOMPLETE, NO_MOTION, UNSTABLE = -1, 0, 1, 2, 3, 4
UNSETTLED = 5

REASONS: Mapping[int, str] = {
    NOT_COMPUTED: "not computed yet",
    FOUND: "",
    REFUSED: "physics or the machine forbids these values",
    INCOMPLETE: "the branch of motions could not be followed to its end",
    NO_MOTION: "what the machine is brought to was not found to repeat after one turn",
    UNSTABLE: "the motion followed is unstable here, and no other of one turn was settled into",
    UNSETTLED: "the rubber does not settle at a temperature at this speed",
}
"""Why a machine has no values at a speed; where there is no reason, a NaN says that the quantity
itself has no value: no jump speed, say, of a machine that does not jump."""
