"""The continuation loop: pseudo-arclength over omega, compiled whole.

Corrections stand in :mod:`flipflow.continuation.correction`, what happens where contacts begin and
end in :mod:`flipflow.continuation.corners`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from flipflow.compiled import status
from flipflow.compiled.arrays import Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.compiled.dense import lu_sign, lu_spread
from flipflow.continuation.corners import (
    TURN_MOST,
    becomes_even,
    begins_to_lean,
    distance,
    orient,
    runs_back,
    turn_corner,
)
from flipflow.continuation.correction import (
    STALLED,
    TOLERATED,
    Corrector,
    Course,
    astray,
    bend,
    bring_home,
    choose_section,
    chord_behind,
    correct,
    correct_between,
    in_bounds,
    move_section,
    new_tangent,
    recall,
    set_scale,
)
from flipflow.continuation.problem import (
    better_section,
    carried,
    depths,
    set_section,
    signature,
)

# Lengths are measured in steps, as the unknowns are.
NEWTON_FEW = 3  # iterations up to which the next step grows
NEWTON_MANY = 4  # iterations from which the next step shrinks; with more the step is refused
GROW = 1.5  # factor on the step after few iterations
SHRINK = 0.7  # factor on the step after many iterations
HALVE = 0.5  # factor on a step that was refused
LONGEST = 1.0  # length beyond which a step does not grow
SHORTEST = 1e-10  # length below which the branch is given up
CREEPING = 2e-4  # length of steps that lead nowhere where many follow each other
CREEPING_MOST = 500  # such steps in a row after which the branch is given up where they begin
FAR = 2.0  # from this many chords on, the tangent predicts a step, not the cubic
ASTRAY_MOST = 0.05  # largest distance of the corrected point from the guess, as a share of the step
ASTRAY_AT_CORNER = 0.3  # the same for a step up to SHORT_STEP
AWAY = 3.0  # steps like the last one that a branch must have gone before it can close
BACK = 1.0  # share of a step within which it may then have come back to that point
MET = 1e-3  # distance from that point of a branch that has
CONTACT_STEP = 0.03  # longest step that may change the contacts of a turn
STRAND_STEP = 1e-4  # longest step that may change the sign of det [J; tangent]
CROSSING_STEP = 1e-2  # the same where the branch goes straight on
STRAIGHT_STEPS = (1e-2, 1e-4, 1e-6)  # tried along the chord where tangents mix
STRAIGHT = 0.9999  # cosine between the tangents from which on it does
STRAIGHT_MOST = 1e-3  # largest distance from the guess for that, as a share of the step
CROSSING = 1e-2  # how near to singular that matrix is where others may cross
SHORT_STEP = 1e-3  # longest step that may turn a corner or take more than NEWTON_MANY iterations
CORNER_STEP = 1e-4  # longest refused step after which the branch is sought round a corner
NOTHING = -1  # in place of an unknown that ends on a bound
# Why a step was refused, as a branch records it.
REASON_NONE, REASON_NEWTON, REASON_TURN, REASON_CONTACT, REASON_BOUND, REASON_STRAND = range(6)


@by_reference
class Record(NamedTuple):
    """Record of up to P points with n unknowns each."""

    u: Real  # (P, n) at section 0
    omega: Real  # (P,)
    tangent: Real  # (P, n + 1) there; a unit in the unknowns scaled at the point's own section
    phase: Real  # (P,) section at which the point was solved for
    jacobian: Real  # (P, n, n) dr/du there, or (P, 0, 0) where nothing is read off it
    side: Real  # (P,) sign of det [J; tangent]
    signature: Int  # (P,)
    depth: Real  # (P, m, 2) greatest depth in m beyond each gap, plus and minus side
    iterations: Int  # (P,) Newton iterations
    rejected: Int  # (P,) steps rejected on the way to the point
    reason: Int  # (P,) why the last of them was


@kernel
def clear(branch: Record, p: int) -> None:
    """Count nothing on the way to point p yet, where the record has room for it."""
    if p < branch.omega.shape[0]:
        branch.rejected[p] = branch.iterations[p] = 0
        branch.reason[p] = REASON_NONE


@kernel
def store(problem: Any, scratch: Any, work: Corrector, branch: Record, p: int) -> int:
    """Write point p of the branch from the corrector's scratch."""
    n = work.r.shape[0]
    branch.signature[p] = signature(problem, scratch)
    branch.side[p] = work.side[0]
    for j in range(branch.depth.shape[1]):
        for side in range(2):
            branch.depth[p, j, side] = work.depth[j, side]
    branch.phase[p] = work.phase[0]
    for i in range(branch.jacobian.shape[1]):
        for j in range(n):
            branch.jacobian[p, i, j] = work.J[i, j]
    code = bring_home(problem, scratch, work)
    for i in range(n):
        branch.u[p, i] = work.home[i]
    branch.omega[p] = work.w[n]
    for k in range(n + 1):
        branch.tangent[p, k] = work.home_tangent[k]
    return code


@kernel
def load(
    problem: Any, scratch: Any, work: Corrector, branch: Record, p: int, course: Course
) -> int:
    """Take points p and p - 1 of a record, at a section that is good for the former."""
    n = work.r.shape[0]
    for k in range(n):
        work.here[k] = branch.u[p, k]
        work.behind[k] = branch.u[p - 1, k]
    work.here[n] = branch.omega[p]
    work.behind[n] = branch.omega[p - 1]
    for k in range(n + 1):
        work.here_tangent[k] = branch.tangent[p, k]
        work.behind_tangent[k] = branch.tangent[p - 1, k]
    code = choose_section(problem, scratch, work)
    recall(problem, work, course)
    return code


@kernel
def predict(work: Corrector, step: float, course: Course, bends: bool) -> int:
    """Guess a step along the branch from the last point; the unknown that ends on a bound, or -1.

    A guess beyond a bound is drawn back along the tangent and corrected with that unknown fixed.
    Where ``bends`` the guess lies on the cubic through the last two points, if these are not too
    near.
    """
    n, share, ended = work.r.shape[0], 1.0, NOTHING
    for k in range(n - 1, n + 1):
        low = course.lower if k == n else course.beside_lower
        high = course.upper if k == n else course.beside_upper
        ahead = float(work.here[k] + step * work.before[k] * work.scale[k])
        bound = min(max(ahead, low), high)
        if bound != ahead:
            to_bound = (bound - work.here[k]) / (ahead - work.here[k])
            if to_bound < share or ended == NOTHING:
                share, ended = float(to_bound), k
                work.guess[k] = bound
    for k in range(n + 1):
        if k != ended:
            work.guess[k] = work.here[k] + share * step * work.before[k] * work.scale[k]
        work.border[k] = work.before[k] if ended == NOTHING else 0.0
    if ended != NOTHING:
        work.border[ended] = 1.0
    elif bends:
        chord = chord_behind(work)
        if step < FAR * chord:
            bend(work, step, chord)
    return ended


@kernel
def judge(
    problem: Any, scratch: Any, work: Corrector, branch: Record, p: int, step: float, code: int,
    iterations: int, course: Course,
) -> int:  # fmt: skip
    """Why the corrected step from point p is refused, REASON_NONE when it is good.

    The sign of det [J; tangent] is the same all along a branch, except where others cross it and at
    corners. A corrected point where it differs lies on another strand that runs the other way.
    """
    laboured = iterations > NEWTON_MANY and step > SHORT_STEP
    if code != status.OK or laboured:
        return REASON_NEWTON
    if not in_bounds(work, course):
        return REASON_BOUND
    cosine = tangent_ahead(work)
    off = ASTRAY_MOST if step > SHORT_STEP else ASTRAY_AT_CORNER
    if cosine < TURN_MOST or astray(work) > off * step:
        return REASON_TURN
    contacts = signature(problem, scratch)
    changed = contacts != branch.signature[p]
    if changed and step > CONTACT_STEP:
        return REASON_CONTACT
    other_side = work.side[0] != branch.side[p]
    depths(problem, scratch, float(work.w[work.r.shape[0]]), work.depth)
    depth = branch.depth[p]
    leans = begins_to_lean(problem, scratch, work, depth, step, changed)
    other_strand = other_side and not may_cross(work, step, changed, cosine)
    back = changed and step > STRAND_STEP and runs_back(problem, scratch, work, contacts, step)
    if leans or other_strand or back or becomes_even(work, depth, step):
        return REASON_STRAND
    if changed and other_side:
        orient(problem, scratch, work, contacts, step)
    return REASON_NONE


@kernel
def may_cross(work: Corrector, step: float, changed: bool, cosine: float) -> bool:
    """Whether the sign of det [J; tangent] may change in a step because another branch crosses.

    There the matrix is singular, which it is not where the step leads to another strand; close by
    tangents mix, so that where the branch goes straight on it is passed in a longer step.
    """
    straight = not changed and cosine > STRAIGHT and astray(work) < STRAIGHT_MOST * step
    if step > (CROSSING_STEP if straight else STRAND_STEP):
        return False
    return changed or lu_spread(work.A, work.pivot, work.b) < CROSSING


@kernel
def tangent_ahead(work: Corrector) -> float:
    """The tangent of the corrected point in the direction of work.before; the angle's cosine."""
    cosine = new_tangent(work)
    work.side[0] = lu_sign(work.A, work.pivot)
    if cosine < 0.0:
        work.side[0] = -work.side[0]
        for k in range(work.tangent.shape[0]):
            work.tangent[k] = -work.tangent[k]
    return abs(cosine)


@kernel
def passes_start(
    problem: Any, scratch: Any, work: Corrector, branch: Record, p: int, course: Course
) -> bool:
    """Whether the step to point p goes through the first point, in the direction taken there.

    Another strand may pass it closely.
    """
    n = work.r.shape[0]
    if not branch.tangent[p, n] * branch.tangent[0, n] > 0.0:
        return False
    for k in range(n):
        work.home[k] = branch.u[0, k]
    work.home[n] = branch.omega[0]
    for k in range(n + 1):
        work.home_tangent[k] = branch.tangent[0, k]
    set_section(problem, scratch, 0.0, False)
    code = carried(problem, scratch, work.home, work.home_tangent, float(work.phase[0]))
    set_section(problem, scratch, float(work.phase[0]), False)
    chord = chord_behind(work)
    share = 0.0
    for k in range(n + 1):
        share += work.b[k] * (work.home[k] - work.behind[k]) / (work.scale[k] * chord * chord)
    if code != status.OK or not 0.0 < share <= 1.0:
        return False
    code = correct_between(problem, scratch, work, share, course)
    off = 0.0
    for k in range(n + 1):
        off = max(off, abs(work.w[k] - work.home[k]) / work.scale[k])
    recall(problem, work, course)
    return code == status.OK and off < MET


@kernel
def arrival(branch: Record, course: Course, p: int, ends: bool, back: bool) -> int:
    """How the branch ends with point p; OK when it goes on."""
    if back:
        return status.CLOSED
    if not ends:
        return status.OK
    upper = branch.omega[p] == course.upper or branch.u[p, -1] == course.beside_upper
    return status.REACHED_UPPER if upper else status.REACHED_LOWER


@kernel
def begin(
    problem: Any, scratch: Any, work: Corrector, u: Real, omega: float, course: Course
) -> tuple[int, int]:
    """Correct the first point from (u, omega) at fixed omega; status and iterations."""
    n = work.r.shape[0]
    for k in range(n):
        work.here[k] = work.behind[k] = u[k]
    work.here[n] = work.behind[n] = omega
    for k in range(n + 1):
        work.here_tangent[k] = work.behind_tangent[k] = 0.0
    code = choose_section(problem, scratch, work)
    if code != status.OK:
        return code, 0
    for k in range(n + 1):
        work.guess[k] = work.here[k]
        work.border[k] = work.before[k] = 0.0
    work.border[n] = 1.0
    work.before[n] = course.direction
    set_scale(problem, work, work.guess, omega, course)
    code, iterations = correct(problem, scratch, work, course.tolerance)
    if code == status.OK:
        tangent_ahead(work)
        depths(problem, scratch, omega, work.depth)
        for k in range(n + 1):
            work.here[k] = work.w[k]
    return code, iterations


@kernel
def advance(
    problem: Any, scratch: Any, work: Corrector, branch: Record, p: int, course: Course
) -> int:
    """Accept the corrected point as point p; the section moves where contacts change near it."""
    omega = float(work.w[work.r.shape[0]])
    phase = better_section(problem, scratch, omega)
    code = store(problem, scratch, work, branch, p)
    for k in range(work.w.shape[0]):
        work.behind[k], work.behind_tangent[k] = work.here[k], work.here_tangent[k]
        work.here[k], work.here_tangent[k] = work.w[k], work.tangent[k] * work.scale[k]
    if code == status.OK and phase != work.phase[0]:
        code = move_section(problem, scratch, work, phase)
    recall(problem, work, course)
    return code


@kernel
def attempt(
    problem: Any, scratch: Any, work: Corrector, branch: Record, p: int, step: float,
    course: Course,
) -> tuple[float, bool, int]:  # fmt: skip
    """Try a step to point p; its length, 0 where it is refused, whether it ends, iterations."""
    # Asked as a condition of the loop over points, this makes a branch take 40 % longer.
    if work.stop[0] != 0:
        return 0.0, False, 0
    same = p > 1 and branch.signature[p - 1] == branch.signature[p - 2]
    ended = predict(work, step, course, same)
    # A correction as long as the step itself would not tell one strand from the next.
    tolerance = min(course.tolerance, TOLERATED * step)
    code, iterations = correct(problem, scratch, work, tolerance, STALLED * step)
    if ended != NOTHING:
        work.w[ended] = work.guess[ended]  # to the last digit
    reason = judge(problem, scratch, work, branch, p - 1, step, code, iterations, course)
    if reason == REASON_NONE:
        return step, ended != NOTHING, iterations
    branch.reason[p] = reason
    branch.rejected[p] += 1
    if step > CORNER_STEP:
        return 0.0, False, iterations
    step = turn_corner(problem, scratch, work, branch, p - 1, step, course)
    if step == 0.0 and reason == REASON_STRAND:
        step = go_straight(problem, scratch, work, branch, p - 1, course)
    return step, False, NEWTON_FEW


@kernel
def go_straight(
    problem: Any, scratch: Any, work: Corrector, branch: Record, p: int, course: Course
) -> float:
    """Go on from point p along the chord behind it; the step, 0 if that leads nowhere.

    Right where another branch crosses the tangents of both mix, however short the next step is.
    """
    chord = chord_behind(work)
    if not chord > 0.0:
        return 0.0
    for k in range(work.b.shape[0]):
        work.border[k] = work.b[k] / chord
    for step in STRAIGHT_STEPS:
        for k in range(work.b.shape[0]):
            work.before[k] = work.border[k]
            work.guess[k] = work.here[k] + step * work.before[k] * work.scale[k]
        code, _ = correct(problem, scratch, work, TOLERATED * step, STALLED * step)
        if code == status.OK and keeps_straight(problem, scratch, work, branch, p, step, course):
            return step
    recall(problem, work, course)
    return 0.0


@kernel
def keeps_straight(
    problem: Any, scratch: Any, work: Corrector, branch: Record, p: int, step: float,
    course: Course,
) -> bool:  # fmt: skip
    """Whether a corrected step from point p goes straight on to a motion of the same kind."""
    straight = in_bounds(work, course) and astray(work) < STRAIGHT_MOST * step
    if not straight or signature(problem, scratch) != branch.signature[p]:
        return False
    if tangent_ahead(work) < STRAIGHT:
        return False
    depths(problem, scratch, float(work.w[work.r.shape[0]]), work.depth)
    depth = branch.depth[p]
    leans = begins_to_lean(problem, scratch, work, depth, step, False)
    return not leans and not becomes_even(work, depth, step)


@kernel
def length_after(step: float, iterations: int, length: float) -> float:
    """Length of the next step after one that took so many iterations, sought at ``length``."""
    if iterations <= NEWTON_FEW:
        return min(step * GROW, LONGEST)
    return step * SHRINK if iterations >= NEWTON_MANY else length


@kernel
def trace(
    problem: Any, scratch: Any, work: Corrector, branch: Record, u: Real, omega: float,
    course: Course,
) -> tuple[int, int]:  # fmt: skip
    """Follow the branch from (u, omega) until omega leaves its bounds; status and points.

    The first point is corrected at fixed omega, the last one stands exactly on the bound; a branch
    that comes back to its first point is closed there. A step is refused and halved when Newton
    fails, when the tangent turns too far, and, down to a small length, when the contacts of a turn
    change. Points then gather where a contact begins, because narrow details of the branch stand
    there.
    """
    n = work.r.shape[0]
    clear(branch, 0)
    code, branch.iterations[0] = begin(problem, scratch, work, u, omega, course)
    if code == status.OK:
        code = advance(problem, scratch, work, branch, 0, course)
    if code != status.OK:
        return code, 0
    length, travelled, p, creeping = 0.1, 0.0, 1, 0
    clear(branch, p)
    while p < branch.omega.shape[0]:
        longest = min(length, 0.999 / max(abs(float(work.before[n])), 1e-3))
        step, ends, iterations = attempt(problem, scratch, work, branch, p, longest, course)
        if step == 0.0:
            length = longest * HALVE
            if length < SHORTEST:
                return status.STEP_TOO_SMALL, p
            continue
        branch.iterations[p] = iterations
        code = advance(problem, scratch, work, branch, p, course)
        if code != status.OK:
            return code, p
        # Counted in steps, for a closed branch may be smaller than the longest one.
        travelled += step
        near = travelled > AWAY * step and distance(work, branch, p, 0) < BACK * step
        closed = near and passes_start(problem, scratch, work, branch, p, course)
        ended = arrival(branch, course, p, ends, closed)
        p += 1
        clear(branch, p)
        if ended != status.OK:
            return ended, p
        creeping = creeping + 1 if step < CREEPING else 0
        if creeping > CREEPING_MOST:
            return status.STEP_TOO_SMALL, p - CREEPING_MOST
        length = length_after(step, iterations, length)
    return status.POINT_LIMIT, p


def new_branch(
    unknowns: int, gaps: int, points: int, *, with_jacobian: bool = True, to_follow: bool = False
) -> Record:
    """Record of a branch of up to ``points`` points.

    One to follow is not zeroed: of many thousand points the loop reaches a few hundred, and clears
    those.
    """
    n, made = unknowns, np.empty if to_follow else np.zeros
    return Record(
        u=np.empty((points, n)),
        omega=np.empty(points),
        tangent=np.empty((points, n + 1)),
        phase=made(points),
        jacobian=np.empty((points, n, n) if with_jacobian else (points, 0, 0)),
        side=np.empty(points),
        signature=made(points, np.int64),
        depth=np.empty((points, gaps, 2)),
        iterations=made(points, np.int64),
        rejected=made(points, np.int64),
        reason=made(points, np.int64),
    )


def first_points(branch: Record, points: int) -> Record:
    """A copy of the first points of a record."""
    rows = {name: array[:points].copy() for name, array in branch._asdict().items()}
    return Record(**rows)
