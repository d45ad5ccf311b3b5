"""Explicit Runge-Kutta steps that end where a contact changes.

Within a step the contacts are frozen, so that every step is taken through smooth equations. Where a
switching function has turned positive by the end of a step, the length of the step that ends on
its zero is found by Newton's method on the step itself: the event is as accurate as the method,
and the method keeps its order across contacts.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from flipflow.compiled import status
from flipflow.compiled.arrays import Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.model.contact_law import MOST_EXITS
from flipflow.transient.shaft_equations import Equations, set_regimes, slopes, switch, switching

SAFETY = 0.9  # factor on the step that the error estimate allows
MIN_FACTOR = 0.2  # least factor from one step to the next
MAX_FACTOR = 5.0  # largest factor from one step to the next
MOST_TRIALS = 60  # steps tried to locate one event
LOCATED = 1e-15  # change of the step's length, relative to it, below which an event is located
BISECTIONS = 40  # halvings of a step in the search on its cubic
MOST_AT_ONCE = 100  # changes of contact without progress after which a stop chatters
SLIVER = 1e-9  # share of a step below which a remainder is no step of its own
# Places in a walk's tally.
STEPS, EVENTS, REJECTED, TRIALS, ROWS, CHANGES, AT_ONCE = range(7)
SMALLEST = 1e-12  # share of the longest step below which the run is given up
WAYS = max(2, MOST_EXITS)  # switching functions of a spring, and of the shaft


@by_reference
class Walk(NamedTuple):
    """Method, running state, scratch and record of one run of up to R rows."""

    a: Real  # (S, S) stages
    b: Real  # (S,) weights
    error: Real  # (S + 1,) weights of the error estimate; zeros for steps of fixed length
    order: int
    relative: float  # tolerance of the error estimate relative to the state
    absolute: Real  # (n,) added to it; infinite where the error is not watched
    longest: float  # longest step
    step: Real  # (1,) next step
    time: Real  # (1,)
    regime: Int  # (m,) of each spring
    s: Real  # (n,) running state
    end: Real  # (n,) state at the end of a trial step
    rows: Real  # (S + 1, n) slopes of the stages, and at the end
    tally: Int  # (7,) what the names above count
    t: Real  # (R,) record
    record: Real  # (R, n)
    rate: Real  # (R, n) slopes
    regimes: Int  # (R, m)
    change_time: Real  # (R,)
    change: Int  # (R, 2) spring and its regime then


@kernel(inline=True)
def attempt(eq: Equations, walk: Walk, h: float) -> None:
    """Write the state after a step of length h to ``walk.end`` and its slopes to the last row."""
    stages = walk.b.shape[0]
    size = walk.s.shape[0]
    for i in range(1, stages + 1):
        for k in range(size):
            total = 0.0
            for j in range(i):
                weight = walk.a[i, j] if i < stages else walk.b[j]
                total += weight * walk.rows[j, k]
            walk.end[k] = walk.s[k] + h * total
        slopes(eq, walk.regime, walk.end, walk.rows, i)


@kernel(inline=True)
def step_error(walk: Walk, h: float) -> float:
    """Largest error estimate of the trial step over its tolerance."""
    worst = 0.0
    for k in range(walk.s.shape[0]):
        if walk.absolute[k] == math.inf:
            continue
        total = 0.0
        for i in range(walk.error.shape[0]):
            total += walk.error[i] * walk.rows[i, k]
        size = max(abs(walk.s[k]), abs(walk.end[k]))
        share = abs(h * total) / (walk.absolute[k] + walk.relative * size)
        if math.isnan(share):
            return math.inf
        worst = max(worst, share)
    return worst


@kernel(inline=True)
def _hermite(h: float, g0: float, s0: float, g1: float, s1: float, share: float) -> float:
    """Cubic through values g and slopes s at both ends of a step."""
    rest = 1.0 - share
    bend = h * (s0 * rest - s1 * share)
    return g0 * rest + g1 * share + share * rest * (bend + (g0 - g1) * (rest - share))


@kernel(inline=True)
def _summit(h: float, g0: float, s0: float, g1: float, s1: float, sign: float) -> float:
    """Share of the step at which the cubic, times a sign, has its top, by golden section."""
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        one, two = low + 0.381966 * (high - low), low + 0.618034 * (high - low)
        if sign * (_hermite(h, g0, s0, g1, s1, one) - _hermite(h, g0, s0, g1, s1, two)) > 0.0:
            high = two
        else:
            low = one
    return 0.5 * (low + high)


@kernel(inline=True)
def _expected(h: float, g0: float, s0: float, g1: float, s1: float) -> float:
    """Share of the step at which a switching function is expected to turn positive; 2 if it is not.

    The share is negative if the function turns back within the step: its size then tells where the
    function is largest.
    """
    low, high = 0.0, 1.0
    if g1 <= 0.0:
        if not (s0 > 0.0 and s1 < 0.0):
            return 2.0
        top = _summit(h, g0, s0, g1, s1, 1.0)
        return 2.0 if _hermite(h, g0, s0, g1, s1, top) <= 0.0 else -top
    if g0 > 0.0 > s0:
        # What is left above zero by rounding and falls has acted already: it is to rise again.
        low = _summit(h, g0, s0, g1, s1, -1.0)
        if _hermite(h, g0, s0, g1, s1, low) > 0.0:
            return 2.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if _hermite(h, g0, s0, g1, s1, middle) > 0.0:
            high = middle
        else:
            low = middle
    return high


@kernel(inline=True)
def _first(eq: Equations, walk: Walk, h: float, skip: int) -> tuple[int, float]:
    """Number of the switching function expected to act first in the trial step, and its share."""
    stages = walk.b.shape[0]
    found = -1
    soonest = 2.0
    for number in range(WAYS * walk.regime.shape[0] + WAYS):
        if number == skip:
            continue
        j, which = number // WAYS, number % WAYS
        g1, s1 = switching(eq, walk.regime, walk.end, walk.rows, stages, j, which)
        if not g1 > -math.inf:
            continue
        g0, s0 = switching(eq, walk.regime, walk.s, walk.rows, 0, j, which)
        share = _expected(h, g0, s0, g1, s1)
        if abs(share) < abs(soonest):
            found, soonest = number, share
    return found, soonest


@kernel(inline=True)
def _locate(eq: Equations, walk: Walk, number: int, longest: float, guess: float) -> float:
    """Length of the step that ends where a switching function vanishes; the trial is that step.

    Newton on the length, whose derivative is the rate at the end, inside a bracket that holds a
    change from not above zero to above.
    """
    stages = walk.b.shape[0]
    j, which = number // WAYS, number % WAYS
    g, s = switching(eq, walk.regime, walk.s, walk.rows, 0, j, which)
    low, high = 0.0, longest
    # What stands above zero already, and rises, acts at once.
    h = 0.0 if g >= 0.0 and s > 0.0 else guess
    for _ in range(MOST_TRIALS):
        walk.tally[TRIALS] += 1
        attempt(eq, walk, h)
        if h == 0.0:
            break
        g, s = switching(eq, walk.regime, walk.end, walk.rows, stages, j, which)
        if g > 0.0:
            high = h
        else:
            low = h
        following = h - g / s if s > 0.0 else 0.5 * (low + high)
        if abs(following - h) <= LOCATED * longest:
            break
        h = following if low < following < high else 0.5 * (low + high)
    return h


@kernel(inline=True)
def _event(eq: Equations, walk: Walk, h: float) -> tuple[float, int]:
    """Shorten the trial step to its first event: its length, and the switching function or -1."""
    stages = walk.b.shape[0]
    fired = -1
    for _ in range(WAYS * walk.regime.shape[0] + WAYS):
        number, share = _first(eq, walk, h, fired)
        if number < 0:
            break
        if share < 0.0:
            # It touches and turns back: the step ends at the touch, and is looked at again.
            h *= -share
            attempt(eq, walk, h)
            g, _ = switching(
                eq, walk.regime, walk.end, walk.rows, stages, number // WAYS, number % WAYS
            )
            fired = -1
            if g <= 0.0:
                break
            continue
        h = _locate(eq, walk, number, h, share * h)
        fired = number
    return h, fired


@kernel(inline=True)
def _write(walk: Walk) -> None:
    """Append the running state to the record."""
    row = walk.tally[ROWS]
    walk.tally[ROWS] += 1
    walk.t[row] = walk.time[0]
    for k in range(walk.s.shape[0]):
        walk.record[row, k] = walk.s[k]
        walk.rate[row, k] = walk.rows[0, k]
    for j in range(walk.regime.shape[0]):
        walk.regimes[row, j] = walk.regime[j]


@kernel(inline=True)
def _accept(walk: Walk, h: float) -> bool:
    """Make the trial's end the running state; False when it is not finite."""
    last = walk.b.shape[0]
    finite = True
    for k in range(walk.s.shape[0]):
        walk.s[k] = walk.end[k]
        walk.rows[0, k] = walk.rows[last, k]
        finite = finite and math.isfinite(walk.s[k])
    walk.time[0] += h
    walk.tally[STEPS] += 1
    _write(walk)
    return finite


@kernel(inline=True)
def _change(eq: Equations, walk: Walk, number: int) -> None:
    """Carry out a change of contact and record it, with a second row at the same time."""
    switch(eq, walk.regime, walk.s, number // WAYS, number % WAYS)
    slopes(eq, walk.regime, walk.s, walk.rows, 0)
    event = walk.tally[CHANGES]
    walk.change_time[event] = walk.time[0]
    walk.change[event, 0] = number // WAYS
    walk.change[event, 1] = walk.regime[number // WAYS]
    walk.tally[CHANGES] += 1
    walk.tally[EVENTS] += 1
    _write(walk)


@kernel(entry=True)
def begin(eq: Equations, walk: Walk) -> None:
    """Set the contacts at the running state and write the first row."""
    set_regimes(eq, walk.regime, walk.s)
    slopes(eq, walk.regime, walk.s, walk.rows, 0)
    _write(walk)


@kernel(inline=True)
def _refused(walk: Walk, h: float) -> bool:
    """Choose the next step by the error of the trial; whether the trial must be repeated."""
    error = step_error(walk, h)
    factor = MAX_FACTOR
    if error > 0.0:
        factor = min(max(SAFETY * error ** (-1.0 / walk.order), MIN_FACTOR), MAX_FACTOR)
    if error > 1.0:
        walk.tally[REJECTED] += 1
        walk.step[0] = h * factor
        return True
    # A step cut short says nothing about a longer one.
    if h == walk.step[0] or factor < 1.0:
        walk.step[0] = min(h * factor, walk.longest)
    return False


@kernel(inline=True)
def _finish(eq: Equations, walk: Walk, h: float, until: float) -> int:
    """Cut the trial step at its first event, accept it, and carry the event out."""
    last = until - walk.time[0]
    length, number = _event(eq, walk, h)
    if not _accept(walk, length):
        return status.NOT_FINITE
    if length == last:
        walk.time[0] = until
    if number < 0:
        walk.tally[AT_ONCE] = 0
        return status.OK
    if number // WAYS == walk.regime.shape[0]:
        return status.REACHED_UPPER if number % WAYS == 0 else status.REACHED_LOWER
    _change(eq, walk, number)
    walk.tally[AT_ONCE] = walk.tally[AT_ONCE] + 1 if length <= SLIVER * h else 0
    return status.TOO_MANY_EVENTS if walk.tally[AT_ONCE] > MOST_AT_ONCE else status.OK


@kernel(entry=True)
def advance(eq: Equations, walk: Walk, until: float) -> int:
    """Step to time ``until``; returns early when the record is full or the shaft's speed ends it.

    The slopes at the running state are written anew: what excites the machine may have changed.
    """
    adaptive = walk.relative > 0.0
    slopes(eq, walk.regime, walk.s, walk.rows, 0)
    while walk.time[0] < until:
        if walk.tally[ROWS] + 2 > walk.t.shape[0]:
            return status.POINT_LIMIT
        left = until - walk.time[0]
        h = min(walk.step[0], left)
        # No sliver is left over by rounding: the last step takes it.
        h = left if left - h < SLIVER * h else h
        attempt(eq, walk, h)
        if adaptive and _refused(walk, h):
            if walk.step[0] < SMALLEST * walk.longest:
                return status.STEP_TOO_SMALL
            continue
        code = _finish(eq, walk, h, until)
        if code != status.OK:
            return code
    return status.OK
