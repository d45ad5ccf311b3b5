"""What a kernel can report, as integers; what each means to a user is said where it is reported."""

from __future__ import annotations

OK = 0
MISSING_CONFIGURATION = 1
TOO_MANY_EVENTS = 2
NOT_FINITE = 3
SINGULAR = 4
NO_CONVERGENCE = 5
REACHED_UPPER = 6
REACHED_LOWER = 7
STEP_TOO_SMALL = 8
POINT_LIMIT = 9
SEARCH_NOT_ENDED = 10
CLOSED = 11
FOLLOWED = 12
