"""Corners of a branch, where a contact begins or ends: which way it goes on.

Under a law that pushes at once but lets go gently the tangent of a branch jumps at grazing, and the
branch may turn back there. Where both sides of a stop graze at once, the motion that goes on is its
own mirror image; motions that lean to one side are branches of their own.
"""

from __future__ import annotations

import math
from typing import Any

from flipflow.compiled import status
from flipflow.compiled.arrays import Real
from flipflow.compiled.compile import kernel
from flipflow.compiled.dense import lu_sign
from flipflow.continuation.correction import (
    STALLED,
    TOLERATED,
    Corrector,
    Course,
    astray,
    bordered,
    chord_behind,
    correct,
    in_bounds,
    new_tangent,
    recall,
)
from flipflow.continuation.problem import depths, mirrored, residual, signature

ROUND = (2.0, 8.0, 32.0, 128.0)  # multiples of the refused step at which the other side is sought
LEANING = 1e-3  # share of a step, or of a difference before it, from which on a motion leans
EVEN = 0.1  # share of a tangent from which on it leans
SHOWN = 1e-5  # difference of both depths, as a share of a step, that lets look for leaning
LEANT = 1e-5  # difference of both depths, in steps, that is more than Newton leaves at a crossing
UNTOLD = -1  # in place of contacts that are not known
TURN_MOST = 0.90  # least cosine between the tangents at both ends of a step


@kernel
def begins_to_lean(
    problem: Any, scratch: Any, work: Corrector, depth: Real, step: float, changed: bool
) -> bool:
    """Whether the corrected motion leans to one side, though the last point's did not.

    Where both sides of a stop begin to graze at once, be it for the second time in a turn, leaning
    motions branch off; the one that is its own mirror image goes on, until a stop is met that is
    not the same on both sides. Where contacts do not change, both depths tell. The last point has
    depths (m, 2).
    """
    n, suspect = work.r.shape[0], False
    for j in range(work.depth.shape[0]):
        size = abs(work.depth[j, 0] - work.depth[j, 1])
        met = max(work.depth[j, 0], work.depth[j, 1]) > 0.0
        evenly = work.uneven[j] == 0.0 and abs(depth[j, 0] - depth[j, 1]) <= LEANING * work.scale[0]
        if met and not evenly:
            return False
        shows = work.uneven[j] == 0.0 and size > SHOWN * step * work.scale[0]
        suspect = suspect or shows or (met and changed)
    if not suspect:
        return False
    leans = leaning(problem, scratch, work, work.w) > LEANING * step
    if changed and not leans:
        # Right at the corner, rounding may end the contact on one side only.
        for k in range(n + 1):
            work.home_tangent[k] = work.tangent[k] * work.scale[k]
        leans = not keeps_even(work, work.home_tangent)
    leans = leans and stays_even(problem, scratch, work)
    residual(problem, scratch, work.w, float(work.w[n]), work.r, work.J)
    return leans


@kernel
def becomes_even(work: Corrector, depth: Real, step: float) -> bool:
    """Whether a motion that leans to one side is its own mirror image after a step, by its depths.

    Leaning motions pass the even one on their way to their mirror images, but do not become it. The
    last point has depths (m, 2).
    """
    leant = False
    for j in range(work.depth.shape[0]):
        if work.uneven[j] != 0.0:
            continue
        before = abs(depth[j, 0] - depth[j, 1])
        after = abs(work.depth[j, 0] - work.depth[j, 1])
        if after > LEANING * before:
            return False
        leant = leant or before > max(LEANING * step, LEANT) * work.scale[0]
    return leant


@kernel
def leaning(problem: Any, scratch: Any, work: Corrector, point: Real) -> float:
    """How far a point's motion is from its own mirror image, in steps.

    work.r and work.J are then those of the mirrored problem.
    """
    n, off = work.r.shape[0], 0.0
    if residual(mirrored(problem), scratch, point, float(point[n]), work.r, work.J) != status.OK:
        return math.inf
    for i in range(n):
        off = max(off, abs(work.r[i]) / work.scale[i])
    return off


@kernel
def stays_even(problem: Any, scratch: Any, work: Corrector) -> bool:
    """Whether the last point's motion is its own mirror image, and stays so along the branch.

    A branch of leaning motions passes the even one, too, on the way to their mirror images: there
    the point before tells, for a tangent at a corner may be of either side.
    """
    near = LEANING
    chord = chord_behind(work)
    if chord > 0.0:
        near *= min(1.0, chord)
        if leaning(problem, scratch, work, work.behind) > near:
            return False
    off = leaning(problem, scratch, work, work.here)
    return off < near and (chord > 0.0 or keeps_even(work, work.here_tangent))


@kernel
def keeps_even(work: Corrector, tangent: Real) -> bool:
    """Whether a tangent (not scaled) of the point that ``leaning`` was asked of does not lean."""
    off = 0.0
    for i in range(work.r.shape[0]):
        turn = 0.0
        for k in range(work.w.shape[0]):
            turn += work.J[i, k] * tangent[k]
        off = max(off, abs(turn) / work.scale[i])
    return off < EVEN


@kernel
def runs_back(problem: Any, scratch: Any, work: Corrector, contacts: int, step: float) -> bool:
    """Whether a step over a corner has landed behind it, so that its tangent leads back there.

    Where the branch turns sharply at the corner, what lies ahead has other contacts again.
    """
    here, along = work.w, work.tangent
    ahead = contacts_beside(problem, scratch, work, here, along, step) == contacts
    behind = contacts_beside(problem, scratch, work, here, along, -step) == contacts
    residual(problem, scratch, work.w, float(work.w[work.r.shape[0]]), work.r, work.J)
    return behind and not ahead


@kernel
def orient(problem: Any, scratch: Any, work: Corrector, contacts: int, step: float) -> None:
    """Let the tangent of a point with new contacts lead to where these stay.

    At a corner where the branch turns back, both its sides may lie along one line.
    """
    n = work.r.shape[0]
    for multiple in ROUND:
        length = multiple * step
        here, along = work.w, work.tangent
        ahead = contacts_beside(problem, scratch, work, here, along, length) == contacts
        behind = contacts_beside(problem, scratch, work, here, along, -length) == contacts
        if ahead != behind:
            if behind:
                work.side[0] = -work.side[0]
                for k in range(n + 1):
                    work.tangent[k] = -work.tangent[k]
            break
    residual(problem, scratch, work.w, float(work.w[n]), work.r, work.J)


@kernel
def contacts_beside(
    problem: Any, scratch: Any, work: Corrector, point: Real, direction: Real, step: float
) -> int:
    """Contacts a step along a direction from a point; -1: none known.

    The Jacobian there is left in work.J, the place in work.guess.
    """
    n = work.r.shape[0]
    for k in range(n + 1):
        work.guess[k] = point[k] + step * direction[k] * work.scale[k]
    code = residual(problem, scratch, work.guess, float(work.guess[n]), work.r, work.J)
    return signature(problem, scratch) if code == status.OK else UNTOLD


@kernel
def turn_corner(
    problem: Any, scratch: Any, work: Corrector, branch: Any, p: int, step: float, course: Course
) -> float:  # fmt: skip
    """Go on from point p round a corner that a contact makes; the step, 0 if there is none.

    Where both sides of a stop graze at once, neither can be met alone: then the motion that goes on
    is sought as its own mirror image. The point is left corrected in work.
    """
    recall(problem, work, course)
    told = branch.signature[p]
    length = go_round(problem, problem, scratch, work, branch, p, told, step, course)
    if length == 0.0:
        recall(problem, work, course)
        half = mirrored(problem)
        length = go_round(half, problem, scratch, work, branch, p, UNTOLD, step, course)
    if length == 0.0:
        recall(problem, work, course)
    return length


@kernel
def go_round(
    sought: Any, problem: Any, scratch: Any, work: Corrector, branch: Any, p: int, told: int,
    step: float, course: Course,
) -> float:  # fmt: skip
    """The same for motions of the problem that solve ``sought`` as well.

    A little beyond, the other contacts tell the Jacobian of the other side; its tangent is followed
    to where those contacts are. The last Newton step may have led point p there, from where it had
    the contacts ``told``.
    """
    here, along = work.here, work.tangent
    before = contacts_beside(sought, scratch, work, here, work.before, 0.0)
    contacts = contacts_beside(sought, scratch, work, here, work.before, step)
    for k in range(work.border.shape[0]):
        work.border[k] = work.before[k]
    beyond = told not in (UNTOLD, contacts)
    if contacts == UNTOLD or (contacts == before and not beyond) or not bordered(work):
        return 0.0
    new_tangent(work)
    for multiple in ROUND:
        length = multiple * step
        ahead = contacts_beside(sought, scratch, work, here, along, length) == contacts
        behind = contacts_beside(sought, scratch, work, here, along, -length) == contacts
        if ahead == behind:
            continue
        # Where the branch turns sharply, only a longer way leads round.
        way = length if ahead else -length
        if step_round(sought, scratch, work, contacts, way, course):
            if not confirm(problem, scratch, work, branch.depth[p], length):
                return 0.0
            met = signature(problem, scratch)
            return 0.0 if behind and came_through(work, branch, p, met, length) else length
    return 0.0


@kernel
def came_through(work: Corrector, branch: Any, p: int, contacts: int, length: float) -> bool:
    """Whether the branch had such contacts within a length, in steps, before point p."""
    way, q = 0.0, p
    while q > 0 and way < length:
        way += distance(work, branch, q, q - 1)
        q -= 1
        if branch.signature[q] == contacts:
            return True
    return False


@kernel
def distance(work: Corrector, branch: Any, p: int, q: int) -> float:
    """Distance of two points of a branch, in steps."""
    n = work.r.shape[0]
    square = ((branch.omega[p] - branch.omega[q]) / work.scale[n]) ** 2
    for k in range(n):
        square += ((branch.u[p, k] - branch.u[q, k]) / work.scale[k]) ** 2
    return math.sqrt(square)


@kernel
def step_round(
    sought: Any, scratch: Any, work: Corrector, contacts: int, step: float, course: Course
) -> bool:
    """Correct a step along work.tangent; whether it has the contacts of the other side."""
    n = work.r.shape[0]
    for k in range(n + 1):
        work.guess[k] = work.here[k] + step * work.tangent[k] * work.scale[k]
        work.border[k] = work.before[k] = math.copysign(1.0, step) * work.tangent[k]
    code, _ = correct(sought, scratch, work, TOLERATED * abs(step), STALLED * abs(step))
    if code != status.OK or signature(sought, scratch) != contacts:
        return False
    return in_bounds(work, course) and astray(work) < abs(step)


@kernel
def confirm(problem: Any, scratch: Any, work: Corrector, depth: Real, step: float) -> bool:
    """Correct the point in work as one of the problem; whether it is one, and leads on."""
    for k in range(work.w.shape[0]):
        work.guess[k] = work.w[k]
    code, _ = correct(problem, scratch, work, TOLERATED * step, STALLED * step)
    if code != status.OK or astray(work) > step:
        return False
    depths(problem, scratch, float(work.w[work.r.shape[0]]), work.depth)
    if begins_to_lean(problem, scratch, work, depth, step, True):
        return False
    cosine = new_tangent(work)
    work.side[0] = lu_sign(work.A, work.pivot)
    return cosine > TURN_MOST
