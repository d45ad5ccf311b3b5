"""How a calculation ended: an enumeration whose values are sentences that say what to try."""

from __future__ import annotations

from enum import Enum

from flipflow.compiled import status
from flipflow.continuation.frequency_loop import (
    REASON_BOUND,
    REASON_CONTACT,
    REASON_NEWTON,
    REASON_STRAND,
    REASON_TURN,
)


class BranchStatus(Enum):
    """How a branch ended."""

    COMPLETE = "The branch reached the end of the interval."
    CLOSED = "The branch is closed: it came back to where it started."
    FOLLOWED = (
        "The branch was followed to both its ends, where it leaves the interval or meets the "
        "branch from which it comes."
    )
    MEETS_GRAZING = (
        "The curve ends where another contact begins: beyond, the branch has a corner in its "
        "place. Follow that grazing with continue_bifurcation."
    )
    TURNED_BACK = (
        "The branch turned back and left the interval at its lower end; widen the interval to "
        "follow it."
    )
    STEP_TOO_SMALL = (
        "The branch or curve could not be followed on: the step became too small. Start from "
        "another point of it; over frequency the method takes more points, too."
    )
    POINT_LIMIT = "The branch has more points than are kept; shorten the interval."
    TOO_MANY_CONTACTS = (
        "A turn had too many contacts to record; the stops may chatter. Look at it in time."
    )
    NO_START = (
        "No periodic motion was found at the start of the interval. Start from another frequency; "
        "for harmonic balance, raise the harmonics."
    )
    NO_MODES = (
        "The modes of the machine could not be found in one of its contact states; change a "
        "damping a little."
    )
    NOT_FINITE = "A motion grew beyond all bounds; check damping and stiffness."

    @property
    def complete(self) -> bool:
        """Whether the branch was followed to both its ends, or all round."""
        return self in (
            BranchStatus.COMPLETE, BranchStatus.FOLLOWED, BranchStatus.CLOSED,
            BranchStatus.MEETS_GRAZING,
        )  # fmt: skip

    @staticmethod
    def from_code(code: int) -> BranchStatus:
        """The status of a kernel's code."""
        return _OF_CODE[code]


_OF_CODE = {
    status.REACHED_UPPER: BranchStatus.COMPLETE,
    status.FOLLOWED: BranchStatus.FOLLOWED,
    status.REACHED_LOWER: BranchStatus.TURNED_BACK,
    status.CLOSED: BranchStatus.CLOSED,
    status.STEP_TOO_SMALL: BranchStatus.STEP_TOO_SMALL,
    status.POINT_LIMIT: BranchStatus.POINT_LIMIT,
    status.TOO_MANY_EVENTS: BranchStatus.TOO_MANY_CONTACTS,
    status.NO_CONVERGENCE: BranchStatus.NO_START,
    status.SINGULAR: BranchStatus.NO_START,
    status.NOT_FINITE: BranchStatus.NOT_FINITE,
    status.NO_MODES: BranchStatus.NO_MODES,
    status.SEARCH_NOT_ENDED: BranchStatus.TOO_MANY_CONTACTS,
}

STEP_REASON = {
    REASON_NEWTON: "Newton did not converge",
    REASON_TURN: "the branch turned too far",
    REASON_CONTACT: "a contact changed",
    REASON_BOUND: "the step left the interval",
    REASON_STRAND: "the point lies on another strand of the branch",
}
