"""What a kernel can report, as integers; what each means to a user is said where it is reported."""

from __future__ import annotations

OK = 0
TOO_MANY_EVENTS = 2  # more changes of contact than are recorded
NOT_FINITE = 3  # infinite or not a number
SINGULAR = 4  # a matrix that must be inverted is singular
NO_CONVERGENCE = 5  # an iteration did not converge
REACHED_UPPER = 6  # the upper bound of frequency or speed was reached
REACHED_LOWER = 7  # the lower bound was reached
STEP_TOO_SMALL = 8  # the step was halved until it was of no use
POINT_LIMIT = 9  # the record is full
SEARCH_NOT_ENDED = 10  # the search for the next contact took too many steps
CLOSED = 11  # the branch came back to its first point
FOLLOWED = 12  # the branch was followed to both its ends
NO_MODES = 13  # no basis of modes was found in one of the contact states
STOPPED = 14  # nobody waits for it any more
