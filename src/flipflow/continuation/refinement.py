"""Points between those of a branch: folds and contacts refined there; and the entry to the loop.

A fold is a zero of the tangent's share in omega, a contact begins or ends at a zero of the depth
beyond its gap. Both are sought on corrected points, never interpolated.
"""

from __future__ import annotations

import math
from typing import Any

from flipflow.compiled import status
from flipflow.compiled.arrays import Real
from flipflow.compiled.compile import kernel
from flipflow.continuation.correction import (
    SHARP,
    Corrector,
    Course,
    bring_home,
    chord_behind,
    correct,
    correct_between,
    new_tangent,
    recall,
)
from flipflow.continuation.frequency_loop import (
    Record,
    load,
    trace,
)
from flipflow.continuation.problem import depths, residual, set_section

TRACE_ALL = -1  # in place of a step: follow the whole branch
FOLD = -1  # number of the test for a fold; those from 0 on are depths beyond gaps
SHARE_TOLERANCE = 1e-10  # share of a step to which a zero is located
MOST_SECANTS = 20  # steps of the search for a grazing along one side of a corner
FARTHEST = 3.0  # chords from the side's end to which it is sought
JUMP = 1e-3  # cosine of the tangent with omega above which a fold found is a jump of it
SHORT = 0.999  # share of a secant step that is taken, not to pass the grazing
GRAZED = 1e-6  # share of the chord; a secant step that short is far closer to the grazing
# Times that the grazing is passed until a height as small, as a share of that at the side's end, is
# close enough: at a corner Newton's method finds the motion on the other side again and again.
AGAIN = 3
MOST_ROOT_STEPS = 100  # steps of the search for one zero


@kernel
def height_of(problem: Any, scratch: Any, work: Corrector, test: int) -> float:
    """The test at the point in work: FOLD, or the depth beyond gap test // 2 on one side."""
    if test == FOLD:
        return float(work.tangent[work.r.shape[0]])
    depths(problem, scratch, float(work.w[work.r.shape[0]]), work.depth)
    return float(work.depth[test // 2, test % 2])


@kernel
def height_between(
    problem: Any,
    scratch: Any,
    work: Corrector,
    branch: Record,
    p: int,
    share: float,
    test: int,
    course: Course,
) -> tuple[int, float]:
    """Status, and the value of a test at a share of step p; at the step's ends the recorded one.

    Where a branch turns within a step, an end that is corrected anew would get its tangent along
    the chord.
    """
    if not 0.0 < share < 1.0:
        end = p + int(share)
        if test == FOLD:
            return status.OK, float(branch.tangent[end, work.r.shape[0]]) / course.omega_step
        return status.OK, float(branch.depth[end, test // 2, test % 2])
    code = correct_between(problem, scratch, work, share, course)
    if code != status.OK:
        return code, math.nan
    return code, height_of(problem, scratch, work, test)


@kernel
def zero_between(
    problem: Any, scratch: Any, work: Corrector, branch: Record, p: int, low: float, high: float,
    test: int, course: Course,
) -> tuple[int, float]:  # fmt: skip
    """Zero of a test between two shares of step p by Chandrupatla's method: status and share.

    The point is left in work. T. R. Chandrupatla, Advances in Engineering Software 28 (1997) 145.
    """
    a, b = low, high
    code_a, f_a = height_between(problem, scratch, work, branch, p, a, test, course)
    code_b, f_b = height_between(problem, scratch, work, branch, p, b, test, course)
    if code_a != status.OK or code_b != status.OK or not f_a * f_b < 0.0:
        return status.NO_CONVERGENCE, low
    c, f_c = a, f_a
    t = f_a / (f_a - f_b)
    for _ in range(MOST_ROOT_STEPS):
        x = a + t * (b - a)
        code, f = height_between(problem, scratch, work, branch, p, x, test, course)
        if code != status.OK:
            return code, x
        if (f > 0.0) == (f_a > 0.0):
            c, f_c = a, f_a
        else:
            c, f_c = b, f_b
            b, f_b = a, f_a
        a, f_a = x, f
        closest = SHARE_TOLERANCE / abs(b - a) if b != a else 1.0
        if closest > 0.5 or f == 0.0:
            return status.OK, x
        t = _next_share(a, b, c, f_a, f_b, f_c)
        t = min(1.0 - closest, max(closest, t))
    return status.NO_CONVERGENCE, a


@kernel
def special_between(
    problem: Any, scratch: Any, work: Corrector, branch: Record, p: int, low: float, high: float,
    test: int, course: Course,
) -> tuple[int, float]:  # fmt: skip
    """Zero of a test between two shares of step p; at a corner a fold stands where it grazes."""
    code, share = status.NO_CONVERGENCE, low
    if test == FOLD:
        code, share = zero_between(problem, scratch, work, branch, p, low, high, test, course)
        if code == status.OK and abs(height_of(problem, scratch, work, test)) < JUMP:
            return code, share
    if branch.signature[p] != branch.signature[p + 1]:
        for gap in range(2 * branch.depth.shape[1]):
            first = branch.depth[p, gap // 2, gap % 2]
            last = branch.depth[p + 1, gap // 2, gap % 2]
            if first * last < 0.0 and test in (FOLD, gap):
                load(problem, scratch, work, branch, p + 1, course)
                code, share = grazing_between(problem, scratch, work, branch, p, gap, course)
                if code == status.OK:
                    return code, share
    load(problem, scratch, work, branch, p + 1, course)
    return zero_between(problem, scratch, work, branch, p, low, high, test, course)


@kernel
def grazing_between(
    problem: Any, scratch: Any, work: Corrector, branch: Record, p: int, test: int, course: Course
) -> tuple[int, float]:
    """The point within step p at which the branch grazes a gap: status and share.

    It is sought by secants along the side without the contact, which is smooth up to there and a
    little beyond; at a corner the other side is not. The point is left in work.
    """
    n, backwards = work.r.shape[0], branch.depth[p, test // 2, test % 2] < 0.0
    way = 1.0 if backwards else -1.0
    if backwards:
        for k in range(n + 1):
            point, tangent = work.here[k], work.here_tangent[k]
            work.here[k], work.here_tangent[k] = work.behind[k], work.behind_tangent[k]
            work.behind[k], work.behind_tangent[k] = point, tangent
    recall(problem, work, course)
    chord = chord_behind(work)
    s_before, s = -0.5 * way * chord, 0.0
    code, f_before = height_beside(problem, scratch, work, s_before, test, course)
    f_end, passed = f_before, 0
    for _ in range(MOST_SECANTS):
        if code != status.OK or not abs(s) <= FARTHEST * chord:
            return status.NO_CONVERGENCE, 0.0
        code, f = height_beside(problem, scratch, work, s, test, course)
        f_end = f if s == 0.0 else f_end
        near = abs(s - s_before) <= GRAZED * chord
        if f > 0.0:
            passed += 1
            near = near or (passed >= AGAIN and f <= GRAZED * abs(f_end))
        if code == status.OK and near:
            share = share_of_way(work, abs(s))
            return code, share if backwards else 1.0 - share
        if code != status.OK or f > 0.0:
            # Beyond the grazing a contact disturbs Newton's method.
            code, s = status.OK, 0.5 * (s + s_before)
            continue
        s_before, f_before, s = s, f, s - SHORT * f * (s - s_before) / (f - f_before)
    return status.NO_CONVERGENCE, 0.0


@kernel
def share_of_way(work: Corrector, gone: float) -> float:
    """Share that ``gone`` is of the way by the point in work, which then leads to work.behind.

    At a sharp corner each of its two legs may be longer than the chord.
    """
    square = 0.0
    for k in range(work.w.shape[0]):
        square += ((work.w[k] - work.behind[k]) / work.scale[k]) ** 2
    return gone / (gone + math.sqrt(square)) if gone > 0.0 else 0.0


@kernel
def height_beside(
    problem: Any, scratch: Any, work: Corrector, step: float, test: int, course: Course
) -> tuple[int, float]:
    """Status, and the value of a test at a step along the tangent of the last point."""
    recall(problem, work, course)
    for k in range(work.w.shape[0]):
        work.guess[k] = work.here[k] + step * work.before[k] * work.scale[k]
        work.border[k] = work.before[k]
    code, _ = correct(problem, scratch, work, SHARP)
    if code != status.OK:
        return code, math.nan
    new_tangent(work)
    code = residual(problem, scratch, work.w, float(work.w[work.r.shape[0]]), work.r, work.J)
    return code, height_of(problem, scratch, work, test)


@kernel
def _next_share(a: float, b: float, c: float, f_a: float, f_b: float, f_c: float) -> float:
    """Share of the way from a to b: inverse quadratic where that is sure to shrink, else half."""
    place, height = (a - b) / (c - b), (f_a - f_b) / (f_c - f_b)
    if not (height * height < place and (1.0 - height) ** 2 < 1.0 - place):
        return 0.5
    outer = f_a / (f_b - f_a) * f_c / (f_b - f_c)
    return outer + (c - a) / (b - a) * f_a / (f_c - f_a) * f_b / (f_c - f_b)


@kernel(entry=True)
def follow(
    problem: Any,
    scratch: Any,
    work: Corrector,
    branch: Record,
    u: Real,
    omega: float,
    course: Course,
    p: int,
    low: float,
    high: float,
    test: int,
) -> tuple[int, int, float]:
    """Trace the branch from (u, omega), or find a point within step p >= 0.

    Within a step it is the point at the share ``low`` where ``high`` is the same, else the zero of
    a test between the two shares. Returns status, points and share. One entry serves all, because
    every entry is compiled together with all that it calls.
    """
    if p == TRACE_ALL:
        code, points = trace(problem, scratch, work, branch, u, omega, course)
        set_section(problem, scratch, 0.0, False)
        return code, points, 0.0
    code, share = load(problem, scratch, work, branch, p + 1, course), low
    if code == status.OK and low == high:
        code = correct_between(problem, scratch, work, low, course)
    elif code == status.OK:
        code, share = special_between(problem, scratch, work, branch, p, low, high, test, course)
    if code == status.OK:
        code = bring_home(problem, scratch, work)
    set_section(problem, scratch, 0.0, False)
    return code, p, share
