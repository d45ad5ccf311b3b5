"""The continuation loop: pseudo-arclength over omega, compiled whole.

Unknowns w = (u, omega) are measured in steps: each unknown by its own size times ``u_step``,
omega by ``omega_step``, so that a step of length one is the longest that is wanted in each.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from flipflow.compiled import status
from flipflow.compiled.arrays import Int, Real
from flipflow.compiled.compile import kernel
from flipflow.compiled.dense import lu_factor, lu_sign, lu_solve
from flipflow.continuation.problem import (
    better_section,
    carried,
    depths,
    mirrored,
    residual,
    set_section,
    signature,
    unknown_scale,
)

# Lengths are measured in steps, as the unknowns are.
NEWTON_MOST = 8  # iterations after which a correction has failed
NEWTON_FEW = 3  # iterations up to which the next step grows
NEWTON_MANY = 4  # iterations from which the next step shrinks; with more the step is refused
QUICK = 1e-6  # last Newton step where a branch is followed; below it, one that stalls is rounding
SHARP = 1e-10  # last Newton step where a single point is refined
GROW = 1.5  # factor on the step after few iterations
SHRINK = 0.7  # factor on the step after many iterations
HALVE = 0.5  # factor on a step that was refused
LONGEST = 1.0  # length beyond which a step does not grow
SHORTEST = 1e-10  # length below which the branch is given up
FAR = 2.0  # from this many chords on, the tangent predicts a step, not the cubic
TOLERATED = 1e-4  # last Newton step, at most this share of the step along the branch
TURN_MOST = 0.90  # least cosine between the tangents at both ends of a step
ASTRAY_MOST = 0.05  # largest distance of the corrected point from the guess, as a share of the step
ASTRAY_AT_CORNER = 0.3  # the same for a step up to SHORT_STEP
AWAY = 3.0  # distance from its first point that a branch must reach before it can close
BACK = 0.9  # share of a step within which it has then come back to that point
CONTACT_STEP = 0.03  # longest step that may change the contacts of a turn
STRAND_STEP = 1e-4  # longest step that may change the sign of det [J; tangent]
SHORT_STEP = 1e-3  # longest step that may turn a corner or take more than NEWTON_MANY iterations
CORNER_STEP = 1e-4  # longest refused step after which the branch is sought round a corner
ROUND = (2.0, 8.0, 32.0, 128.0)  # multiples of it at which it is sought
EVEN = 1e-6  # difference of the depths on both sides that is none, in steps
LEANING = 1e-3  # the same as a share of the step: from here on a motion leans
# Why a step was refused, as a branch records it.
REASON_NONE, REASON_NEWTON, REASON_TURN, REASON_CONTACT, REASON_BOUND, REASON_STRAND = range(6)


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


class Course(NamedTuple):
    """Where the branch is followed, and how long a step is."""

    lower: float  # bounds of omega
    upper: float
    omega_step: float  # longest step in omega, rad/s
    u_step: float  # longest step in the unknowns, as a share of their size
    direction: float  # +1 or -1: sign of d omega at the start
    tolerance: float  # last Newton step, in steps; the error left is about its square


class Corrector(NamedTuple):
    """Scratch of the bordered Newton solves, and the last two points, all at one section."""

    here: Real  # (n + 1,) the last point, w = (u, omega)
    here_tangent: Real  # (n + 1,) not scaled
    behind: Real  # (n + 1,) the point before
    behind_tangent: Real  # (n + 1,)
    home: Real  # (n + 1,) a point at section 0
    home_tangent: Real  # (n + 1,)
    phase: Real  # (1,) the section
    w: Real  # (n + 1,)
    guess: Real  # (n + 1,)
    border: Real  # (n + 1,) normal of the plane to solve in
    before: Real  # (n + 1,) tangent at the point before
    tangent: Real  # (n + 1,)
    scale: Real  # (n + 1,)
    side: Real  # (1,) sign of det [J; tangent]
    r: Real  # (n,)
    J: Real  # (n, n + 1)
    A: Real  # (n + 1, n + 1)
    b: Real  # (n + 1,)
    pivot: Int  # (n + 1,)
    depth: Real  # (m, 2) depth beyond each gap, as a branch records it


@kernel
def set_scale(problem: Any, work: Corrector, u: Real, omega: float, course: Course) -> None:
    """Length of one step in each unknown."""
    n = work.r.shape[0]
    unknown_scale(problem, u, omega, work.scale)
    for k in range(n):
        work.scale[k] *= course.u_step
    work.scale[n] = course.omega_step


@kernel
def bordered(work: Corrector) -> bool:
    """Factor [J; work.border] in scaled unknowns; False when it is singular."""
    n = work.r.shape[0]
    for i in range(n):
        for j in range(n + 1):
            work.A[i, j] = work.J[i, j] * work.scale[j] / work.scale[i]
    for j in range(n + 1):
        work.A[n, j] = work.border[j]
    return lu_factor(work.A, work.pivot)


@kernel
def newton_update(work: Corrector) -> float:
    """Add the bordered Newton step to work.w; its length, in steps."""
    n = work.r.shape[0]
    plane = 0.0
    for k in range(n):
        work.b[k] = -work.r[k] / work.scale[k]
    for k in range(n + 1):
        plane += work.border[k] * (work.w[k] - work.guess[k]) / work.scale[k]
    work.b[n] = -plane
    lu_solve(work.A, work.pivot, work.b)
    length = 0.0
    for k in range(n + 1):
        length += work.b[k] ** 2
        work.w[k] += work.b[k] * work.scale[k]
    return math.sqrt(length)


@kernel
def correct(problem: Any, scratch: Any, work: Corrector, tolerance: float) -> tuple[int, int]:
    """Newton from work.guess within the plane through it normal to work.border (scaled).

    The plane omega = constant has the border (0, ..., 0, 1). Returns status and iterations; the
    solution stands in work.w, J and its factors belong to the last iterate but one.
    """
    n = work.r.shape[0]
    for k in range(n + 1):
        work.w[k] = work.guess[k]
    before, contacts = math.inf, -1
    for iteration in range(1, NEWTON_MOST + 1):
        if not work.w[n] > 0.0:
            return status.NO_CONVERGENCE, iteration
        code = residual(problem, scratch, work.w, float(work.w[n]), work.r, work.J)
        if code != status.OK:
            return code, iteration
        same = signature(problem, scratch) == contacts
        contacts = signature(problem, scratch)
        if not bordered(work):
            return status.SINGULAR, iteration
        length = newton_update(work)
        if not length < 1e3:
            return status.NO_CONVERGENCE, iteration
        # A step that no longer shrinks and is tiny has met the rounding of the residual, unless it
        # goes to and fro over a grazing.
        if length < tolerance or (same and before <= length < QUICK):
            return status.OK, iteration
        before = length
    return status.NO_CONVERGENCE, NEWTON_MOST


@kernel
def new_tangent(work: Corrector) -> float:
    """Unit tangent (scaled) from the last factors, into work.tangent; its cosine to work.before."""
    n = work.r.shape[0]
    for k in range(n):
        work.b[k] = 0.0
    work.b[n] = 1.0
    lu_solve(work.A, work.pivot, work.b)
    norm = 0.0
    cosine = 0.0
    for k in range(n + 1):
        norm += work.b[k] ** 2
    norm = math.sqrt(norm)
    for k in range(n + 1):
        work.tangent[k] = work.b[k] / norm
        cosine += work.tangent[k] * work.before[k]
    return cosine


@kernel
def store(problem: Any, scratch: Any, work: Corrector, branch: Record, p: int) -> int:
    """Write point p of the branch from the corrector's scratch."""
    n = work.r.shape[0]
    branch.signature[p] = signature(problem, scratch)
    branch.side[p] = work.side[0]
    depths(problem, scratch, float(work.w[n]), branch.depth[p])
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
def bring_home(problem: Any, scratch: Any, work: Corrector) -> int:
    """The point in work and its tangent as they are at section 0."""
    for k in range(work.w.shape[0]):
        work.home[k] = work.w[k]
        work.home_tangent[k] = work.tangent[k] * work.scale[k]
    return carried(problem, scratch, work.home, work.home_tangent, 0.0)


@kernel
def move_section(problem: Any, scratch: Any, work: Corrector, phase: float) -> int:
    """Carry the last two points to another section."""
    code = carried(problem, scratch, work.here, work.here_tangent, phase)
    if code == status.OK:
        code = carried(problem, scratch, work.behind, work.behind_tangent, phase)
    set_section(problem, scratch, phase)
    work.phase[0] = phase
    return code


@kernel
def load(
    problem: Any, scratch: Any, work: Corrector, branch: Record, p: int, course: Course
) -> int:
    """Take points p and p - 1 of a record, at a section that is good for the former."""
    n = work.r.shape[0]
    for k in range(n):
        work.here[k], work.behind[k] = branch.u[p, k], branch.u[p - 1, k]
    work.here[n], work.behind[n] = branch.omega[p], branch.omega[p - 1]
    for k in range(n + 1):
        work.here_tangent[k] = branch.tangent[p, k]
        work.behind_tangent[k] = branch.tangent[p - 1, k]
    code = choose_section(problem, scratch, work)
    recall(problem, work, course)
    return code


@kernel
def choose_section(problem: Any, scratch: Any, work: Corrector) -> int:
    """Take the two points in work, which stand at section 0, to a section that is good there."""
    work.phase[0] = 0.0
    set_section(problem, scratch, 0.0)
    omega = float(work.here[work.r.shape[0]])
    code = residual(problem, scratch, work.here, omega, work.r, work.J)
    if code != status.OK:
        return code
    return move_section(problem, scratch, work, better_section(problem, scratch, omega, True))


@kernel
def recall(problem: Any, work: Corrector, course: Course) -> None:
    """Scale of the last point, and its unit tangent in scaled unknowns into work.before."""
    n = work.r.shape[0]
    set_scale(problem, work, work.here, float(work.here[n]), course)
    norm = 0.0
    for k in range(n + 1):
        work.before[k] = work.here_tangent[k] / work.scale[k]
        norm += work.before[k] ** 2
    for k in range(n + 1):
        work.before[k] /= math.sqrt(norm)


@kernel
def predict(work: Corrector, step: float, course: Course, bends: bool) -> bool:
    """Guess a step along the branch from the last point; True when it ends on a bound of omega.

    A guess beyond the bound is drawn back along the tangent and corrected at that omega. Where
    ``bends`` the guess lies on the cubic through the last two points, if these are not too near.
    """
    n = work.r.shape[0]
    omega = work.here[n] + step * work.before[n] * work.scale[n]
    share = 1.0
    ends = omega > course.upper or omega < course.lower
    if ends:
        bound = course.upper if omega > course.upper else course.lower
        share = (bound - work.here[n]) / (omega - work.here[n])
        omega = bound
    for k in range(n):
        work.guess[k] = work.here[k] + share * step * work.before[k] * work.scale[k]
        work.border[k] = 0.0 if ends else work.before[k]
    work.guess[n] = omega
    work.border[n] = 1.0 if ends else work.before[n]
    if not ends and bends:
        chord = chord_behind(work)
        if step < FAR * chord:
            bend(work, step, chord)
    return bool(ends)


@kernel
def chord_behind(work: Corrector) -> float:
    """The way between the last two points, in steps, into work.b; its length."""
    square = 0.0
    for k in range(work.b.shape[0]):
        work.b[k] = (work.here[k] - work.behind[k]) / work.scale[k]
        square += work.b[k] ** 2
    return math.sqrt(square)


@kernel
def bend(work: Corrector, step: float, chord: float) -> None:
    """Turn the guess on the tangent of the last point into one on the cubic through the last two.

    With h the chord, which ``chord_behind`` left in work.b, d its direction, t and t' the tangents
    at the last point and the one before, and r = step / h, the guess moves by
    step (r (2 t - 3 d + t') + r^2 (t - 2 d + t')).
    """
    norm = 0.0
    for k in range(work.b.shape[0]):
        norm += (work.behind_tangent[k] / work.scale[k]) ** 2
    norm = math.sqrt(norm)
    ratio = step / chord
    for k in range(work.b.shape[0]):
        d = work.b[k] / chord
        behind = work.behind_tangent[k] / (work.scale[k] * norm)
        second = 2.0 * work.before[k] - 3.0 * d + behind
        third = work.before[k] - 2.0 * d + behind
        work.guess[k] += step * work.scale[k] * ratio * (second + ratio * third)


@kernel
def astray(work: Corrector) -> float:
    """Distance of the corrected point from the guess, in steps; far away lies another strand."""
    square = 0.0
    for k in range(work.w.shape[0]):
        square += ((work.w[k] - work.guess[k]) / work.scale[k]) ** 2
    return math.sqrt(square)


@kernel
def judge(
    problem: Any, scratch: Any, work: Corrector, branch: Record, p: int, step: float, code: int,
    iterations: int,
    course: Course,
) -> int:  # fmt: skip
    """Why the corrected step from point p is refused, REASON_NONE when it is good.

    The sign of det [J; tangent] is the same all along a branch. A corrected point where it differs
    lies on another strand that runs the other way.
    """
    n = work.r.shape[0]
    laboured = iterations > NEWTON_MANY and step > SHORT_STEP
    if code != status.OK or laboured:
        return REASON_NEWTON
    if work.w[n] > course.upper or work.w[n] < course.lower:
        return REASON_BOUND
    cosine = new_tangent(work)
    work.side[0] = lu_sign(work.A, work.pivot)
    if cosine < 0.0:
        work.side[0] = -work.side[0]
        for k in range(work.tangent.shape[0]):
            work.tangent[k] = -work.tangent[k]
    # Where two contacts change at once the branch has a corner, which only a short step may turn.
    off = ASTRAY_MOST if step > SHORT_STEP else ASTRAY_AT_CORNER
    if abs(cosine) < TURN_MOST or astray(work) > off * step:
        return REASON_TURN
    if work.side[0] != branch.side[p] and step > STRAND_STEP:
        return REASON_STRAND
    contacts = signature(problem, scratch)
    if contacts != branch.signature[p] and step > CONTACT_STEP:
        return REASON_CONTACT
    depths(problem, scratch, float(work.w[n]), work.depth)
    if step > 0.0 and begins_to_lean(work, branch, p, step):
        return REASON_STRAND
    if contacts != branch.signature[p] and work.side[0] != branch.side[p] and step > 0.0:
        orient(problem, scratch, work, contacts, step)
    return REASON_NONE


@kernel
def orient(problem: Any, scratch: Any, work: Corrector, contacts: int, step: float) -> None:
    """Let the tangent of a point with new contacts lead to where these stay: not back to the corner.

    At a corner where the branch turns back, both its sides may lie along one line.
    """
    n = work.r.shape[0]
    for multiple in ROUND:
        ahead = contacts_beside(problem, scratch, work, multiple * step) == contacts
        behind = contacts_beside(problem, scratch, work, -multiple * step) == contacts
        if ahead != behind:
            if behind:
                work.side[0] = -work.side[0]
                for k in range(n + 1):
                    work.tangent[k] = -work.tangent[k]
            break
    residual(problem, scratch, work.w, float(work.w[n]), work.r, work.J)


@kernel
def contacts_beside(problem: Any, scratch: Any, work: Corrector, step: float) -> int:
    """Contacts a step along work.tangent from the corrected point; -1: none known."""
    n = work.r.shape[0]
    for k in range(n + 1):
        work.b[k] = work.w[k] + step * work.tangent[k] * work.scale[k]
    code = residual(problem, scratch, work.b, float(work.b[n]), work.r, work.J)
    return signature(problem, scratch) if code == status.OK else -1


@kernel
def begins_to_lean(work: Corrector, branch: Record, p: int, step: float) -> bool:
    """Whether a motion that met its stops evenly on both sides now leans on one, for no reason.

    Where both sides begin to graze at once leaning motions branch off; the even one goes on. Once
    a stop is met on one side only, or not evenly, there is a reason.
    """
    leans = False
    for j in range(work.depth.shape[0]):
        evenly = abs(branch.depth[p, j, 0] - branch.depth[p, j, 1])
        size = work.depth[j, 0] - work.depth[j, 1]
        largest = max(work.depth[j, 0], work.depth[j, 1])
        if evenly < EVEN * work.scale[0]:
            leans = leans or (largest > 0.0 and abs(size) > LEANING * step * work.scale[0])
        elif largest > 0.0:
            return False
    return leans


@kernel
def from_start(work: Corrector, branch: Record, p: int) -> float:
    """Distance of point p from the first one, in steps."""
    n = work.r.shape[0]
    square = ((branch.omega[p] - branch.omega[0]) / work.scale[n]) ** 2
    for k in range(n):
        square += ((branch.u[p, k] - branch.u[0, k]) / work.scale[k]) ** 2
    return math.sqrt(square)


@kernel
def arrival(branch: Record, course: Course, p: int, ends: bool, back: bool) -> int:
    """How the branch ends with point p; OK when it goes on."""
    if back:
        return status.CLOSED
    if not ends:
        return status.OK
    return status.REACHED_UPPER if branch.omega[p] == course.upper else status.REACHED_LOWER


@kernel
def begin(
    problem: Any, scratch: Any, work: Corrector, u: Real, omega: float, course: Course
) -> int:
    """Correct the first point from (u, omega) at fixed omega."""
    n = work.r.shape[0]
    for k in range(n):
        work.here[k] = work.behind[k] = u[k]
    work.here[n] = work.behind[n] = omega
    for k in range(n + 1):
        work.here_tangent[k] = work.behind_tangent[k] = 0.0
    code = choose_section(problem, scratch, work)
    if code != status.OK:
        return code
    for k in range(n + 1):
        work.guess[k] = work.here[k]
        work.border[k] = work.before[k] = 0.0
    work.border[n] = 1.0
    work.before[n] = course.direction
    set_scale(problem, work, work.guess, omega, course)
    code, _ = correct(problem, scratch, work, course.tolerance)
    return code


@kernel
def advance(
    problem: Any, scratch: Any, work: Corrector, branch: Record, p: int, course: Course
) -> int:
    """Accept the corrected point as point p; the section moves where contacts change near it."""
    omega = float(work.w[work.r.shape[0]])
    phase = better_section(problem, scratch, omega, False)
    code = store(problem, scratch, work, branch, p)
    for k in range(work.w.shape[0]):
        work.behind[k], work.behind_tangent[k] = work.here[k], work.here_tangent[k]
        work.here[k], work.here_tangent[k] = work.w[k], work.tangent[k] * work.scale[k]
    if code == status.OK and phase != work.phase[0]:
        code = move_section(problem, scratch, work, phase)
    recall(problem, work, course)
    return code


@kernel
def turn_corner(
    problem: Any, scratch: Any, work: Corrector, branch: Record, p: int, step: float, course: Course
) -> float:
    """Go on from point p - 1 round a corner that a contact makes; the step, 0 where there is none.

    Where a law pushes at once but lets go gently, the tangent jumps at grazing, and the branch may
    turn back there. Where both sides graze at once, neither may be met alone: the motion that goes
    on is its own mirror image, and is sought as such. The point is left corrected in work.
    """
    length = go_round(problem, problem, scratch, work, branch, p, step, course)
    if length == 0.0:
        recall(problem, work, course)
        length = go_round(mirrored(problem), problem, scratch, work, branch, p, step, course)
    return length


@kernel
def go_round(
    sought: Any, problem: Any, scratch: Any, work: Corrector, branch: Record, p: int, step: float,
    course: Course,
) -> float:  # fmt: skip
    """The same for motions of the problem that solve ``sought`` as well.

    A little beyond, the other contacts tell the Jacobian of the other side; its tangent is followed
    to where those contacts are.
    """
    before = look_ahead(sought, scratch, work, 0.0, True)
    contacts = look_ahead(sought, scratch, work, step, True)
    if contacts < 0 or contacts == before or not bordered(work):
        return 0.0
    new_tangent(work)
    came_from_there = p > 1 and branch.signature[p - 2] == contacts
    for multiple in ROUND:
        length = multiple * step
        ahead = look_ahead(sought, scratch, work, length, False) == contacts
        behind = look_ahead(sought, scratch, work, -length, False) == contacts
        if ahead != behind:
            way = length if ahead else -length
            turned_back = behind and came_from_there
            if turned_back or not step_round(sought, scratch, work, contacts, way, course):
                return 0.0
            return length if confirm(problem, scratch, work, branch, p, length) else 0.0
    return 0.0


@kernel
def look_ahead(problem: Any, scratch: Any, work: Corrector, step: float, along: bool) -> int:
    """Contacts a step from the last point, along its tangent or along work.tangent; -1: none known.

    The Jacobian there is left in work.J.
    """
    n = work.r.shape[0]
    for k in range(n + 1):
        direction = work.before[k] if along else work.tangent[k]
        work.guess[k] = work.here[k] + step * direction * work.scale[k]
        work.border[k] = direction
    code = residual(problem, scratch, work.guess, float(work.guess[n]), work.r, work.J)
    return signature(problem, scratch) if code == status.OK else -1


@kernel
def step_round(
    sought: Any, scratch: Any, work: Corrector, contacts: int, step: float, course: Course
) -> bool:
    """Correct a step along work.tangent; whether it has the contacts of the other side."""
    n = work.r.shape[0]
    for k in range(n + 1):
        work.guess[k] = work.here[k] + step * work.tangent[k] * work.scale[k]
        work.border[k] = work.before[k] = math.copysign(1.0, step) * work.tangent[k]
    code, _ = correct(sought, scratch, work, TOLERATED * abs(step))
    if code != status.OK or signature(sought, scratch) != contacts:
        return False
    return bool(course.lower <= work.w[n] <= course.upper and astray(work) < abs(step))


@kernel
def confirm(
    problem: Any, scratch: Any, work: Corrector, branch: Record, p: int, step: float
) -> bool:
    """Correct the point in work as one of the problem; whether it is one, and leads on."""
    for k in range(work.w.shape[0]):
        work.guess[k] = work.w[k]
    code, _ = correct(problem, scratch, work, TOLERATED * step)
    if code != status.OK or astray(work) > step:
        return False
    depths(problem, scratch, float(work.w[work.r.shape[0]]), work.depth)
    if begins_to_lean(work, branch, p - 1, step):
        return False
    cosine = new_tangent(work)
    work.side[0] = lu_sign(work.A, work.pivot)
    return cosine > TURN_MOST


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
    p, step, length, travelled, iterations = 0, 0.0, 0.1, 0.0, 0
    ends = False
    while p < branch.omega.shape[0]:
        if p == 0:
            code = begin(problem, scratch, work, u, omega, course)
            if code != status.OK:
                return code, p
        else:
            step = min(length, 0.999 / max(abs(float(work.before[n])), 1e-3))
            same = p > 1 and branch.signature[p - 1] == branch.signature[p - 2]
            ends = predict(work, step, course, same)
            # A correction as long as the step itself would not tell one strand from the next.
            tolerance = min(course.tolerance, TOLERATED * step)
            code, iterations = correct(problem, scratch, work, tolerance)
        reason = judge(
            problem, scratch, work, branch, max(p - 1, 0), step, code, iterations, course
        )
        if reason != REASON_NONE and p > 0:
            branch.reason[p] = reason
            branch.rejected[p] += 1
            rounded = 0.0
            if step < CORNER_STEP:
                recall(problem, work, course)
                rounded = turn_corner(problem, scratch, work, branch, p, step, course)
            if rounded == 0.0:
                recall(problem, work, course)
                length = step * HALVE
                if length < SHORTEST:
                    return status.STEP_TOO_SMALL, p
                continue
            step, ends, iterations = rounded, False, NEWTON_FEW
        branch.iterations[p] = iterations
        code = advance(problem, scratch, work, branch, p, course)
        if code != status.OK:
            return code, p
        distance = from_start(work, branch, p)
        travelled = max(travelled, distance)
        # Beside a fold the other strand also passes the first point, but with omega the other way.
        same_way = branch.tangent[p, n] * branch.tangent[0, n] > 0.0
        back = travelled > AWAY and distance < BACK * step and same_way
        ended = arrival(branch, course, p, ends, back)
        if ended != status.OK:
            return ended, p + 1
        if p > 0 and iterations <= NEWTON_FEW:
            length = min(step * GROW, LONGEST)
        elif p > 0 and iterations >= NEWTON_MANY:
            length = step * SHRINK
        p += 1
    return status.POINT_LIMIT, p


def new_corrector(unknowns: int, gaps: int) -> Corrector:
    """Scratch of the bordered Newton solves."""
    n = unknowns
    return Corrector(
        here=np.zeros(n + 1),
        here_tangent=np.zeros(n + 1),
        behind=np.zeros(n + 1),
        behind_tangent=np.zeros(n + 1),
        home=np.zeros(n + 1),
        home_tangent=np.zeros(n + 1),
        phase=np.zeros(1),
        w=np.zeros(n + 1),
        guess=np.zeros(n + 1),
        border=np.zeros(n + 1),
        before=np.zeros(n + 1),
        tangent=np.zeros(n + 1),
        scale=np.ones(n + 1),
        side=np.zeros(1),
        r=np.zeros(n),
        J=np.zeros((n, n + 1)),
        A=np.zeros((n + 1, n + 1)),
        b=np.zeros(n + 1),
        pivot=np.zeros(n + 1, np.int64),
        depth=np.zeros((gaps, 2)),
    )


def new_branch(unknowns: int, gaps: int, points: int, *, with_jacobian: bool = True) -> Record:
    """Record of a branch of up to ``points`` points."""
    n = unknowns
    return Record(
        u=np.empty((points, n)),
        omega=np.empty(points),
        tangent=np.empty((points, n + 1)),
        phase=np.zeros(points),
        jacobian=np.empty((points, n, n) if with_jacobian else (points, 0, 0)),
        side=np.empty(points),
        signature=np.empty(points, np.int64),
        depth=np.empty((points, gaps, 2)),
        iterations=np.empty(points, np.int64),
        rejected=np.zeros(points, np.int64),
        reason=np.zeros(points, np.int64),
    )


def first_points(branch: Record, points: int) -> Record:
    """A copy of the first points of a record."""
    rows = {name: array[:points].copy() for name, array in branch._asdict().items()}
    return Record(**rows)
