"""Corrections in the loop: Newton in a plane, tangents, and the points behind.

Unknowns w = (u, omega) are measured in steps: each unknown by its own size times ``u_step``,
omega by ``omega_step``, so that a step of length one is the longest that is wanted in each.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from flipflow.compiled import status
from flipflow.compiled.arrays import Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.compiled.dense import lu_factor, lu_solve
from flipflow.continuation.problem import (
    better_section,
    carried,
    carried_home,
    residual,
    set_section,
    signature,
    unknown_scale,
)

# Lengths are measured in steps, as the unknowns are.
NEWTON_MOST = 8  # iterations after which a correction has failed
QUICK = 1e-6  # last Newton step where a branch is followed
SHARP = 1e-10  # last Newton step where a single point is refined
TOLERATED = 1e-4  # last Newton step, at most this share of the step along the branch
STALLED = 1e-2  # the same of one that shrinks no more, which QUICK bounds, too


@by_reference
class Course(NamedTuple):
    """Where the branch is followed, and how long a step is."""

    lower: float  # bounds of omega
    upper: float
    omega_step: float  # longest step in omega, rad/s
    u_step: float  # longest step in the unknowns, as a share of their size
    direction: float  # +1 or -1: sign of d omega at the start
    tolerance: float  # last Newton step, in steps; the error left is about its square
    # Bounds of the last of the unknowns u, which on a curve is a second parameter.
    beside_lower: float = -math.inf
    beside_upper: float = math.inf

    @property
    def along_omega(self) -> tuple[float, ...]:
        """All but the bounds of a second parameter, which a branch over frequency has none of."""
        return self[:6]


@by_reference
class Corrector(NamedTuple):
    """Scratch of the bordered Newton solves, and the last two points, all at one section."""

    here: Real  # (n + 1,) the last point, w = (u, omega)
    here_tangent: Real  # (n + 1,) not scaled
    behind: Real  # (n + 1,) the point before
    behind_tangent: Real  # (n + 1,)
    home: Real  # (n + 1,) a point at section 0
    home_tangent: Real  # (n + 1,)
    phase: Real  # (1,) the section
    uneven: Real  # (m,) 1 where a stop's gaps differ, 0 where it is the same on both sides
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
    stop: Int  # (1,) other than 0: nobody waits for the branch any more


def new_corrector(unknowns: int, uneven: Real) -> Corrector:
    """Scratch of the bordered Newton solves; ``uneven`` is that of the machine's stops, (m,)."""
    n, gaps = unknowns, uneven.size
    return Corrector(
        here=np.zeros(n + 1),
        here_tangent=np.zeros(n + 1),
        behind=np.zeros(n + 1),
        behind_tangent=np.zeros(n + 1),
        home=np.zeros(n + 1),
        home_tangent=np.zeros(n + 1),
        phase=np.zeros(1),
        uneven=uneven,
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
        stop=np.zeros(1, np.int64),
    )


@kernel
def set_scale(problem: Any, work: Corrector, u: Real, omega: float, course: Course) -> None:
    """Length of one step in each unknown."""
    n = work.r.shape[0]
    work.scale[n] = course.omega_step
    unknown_scale(problem, u, omega, work.scale)
    for k in range(n):
        work.scale[k] *= course.u_step
    work.scale[n] = min(float(work.scale[n]), course.omega_step)


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
def correct(
    problem: Any, scratch: Any, work: Corrector, tolerance: float, stalled: float = QUICK
) -> tuple[int, int]:
    """Newton from work.guess within the plane through it normal to work.border (scaled).

    The plane omega = constant has the border (0, ..., 0, 1). Returns status and iterations; the
    solution stands in work.w, J and its factors belong to the last iterate but one.
    """
    n = work.r.shape[0]
    for k in range(n + 1):
        work.w[k] = work.guess[k]
    before, contacts = math.inf, -1
    for iteration in range(1, NEWTON_MOST + 1):
        code = residual(problem, scratch, work.w, float(work.w[n]), work.r, work.J)
        if code != status.OK:
            return code, iteration
        met = signature(problem, scratch)
        same = met == contacts
        contacts = met
        if not bordered(work):
            return status.SINGULAR, iteration
        length = newton_update(work)
        if not length < 1e3:
            return status.NO_CONVERGENCE, iteration
        # A step that no longer shrinks and is tiny has met the rounding of the residual, unless it
        # goes to and fro over a grazing.
        if length < tolerance or (same and before <= length < min(QUICK, stalled)):
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
def astray(work: Corrector) -> float:
    """Distance of the corrected point from the guess, in steps; far away lies another strand."""
    square = 0.0
    for k in range(work.w.shape[0]):
        square += ((work.w[k] - work.guess[k]) / work.scale[k]) ** 2
    return math.sqrt(square)


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
def correct_between(
    problem: Any, scratch: Any, work: Corrector, share: float, course: Course
) -> int:
    """Find a point between the two that are loaded, near ``share`` of the cubic on them.

    The plane to solve in is normal to their chord. The point is left in work.w, its Jacobian in
    work.J, and its tangent, in the branch's direction, in work.tangent (scaled by work.scale).
    """
    recall(problem, work, course)
    chord = chord_behind(work)
    step = (share - 1.0) * chord
    for k in range(work.w.shape[0]):
        work.guess[k] = work.here[k] + step * work.before[k] * work.scale[k]
        work.border[k] = work.b[k] / chord
    bend(work, step, chord)
    for k in range(work.w.shape[0]):
        work.before[k] = work.border[k]
    code, _ = correct(problem, scratch, work, SHARP)
    if code != status.OK:
        return code
    new_tangent(work)
    return residual(problem, scratch, work.w, float(work.w[work.r.shape[0]]), work.r, work.J)


@kernel
def in_bounds(work: Corrector, course: Course) -> bool:
    """Whether the corrected point lies within the bounds of both parameters."""
    n = work.r.shape[0]
    beside = course.beside_lower <= work.w[n - 1] <= course.beside_upper
    return bool(beside and course.lower <= work.w[n] <= course.upper)


@kernel
def bring_home(problem: Any, scratch: Any, work: Corrector) -> int:
    """The point in work and its tangent as they are at section 0."""
    for k in range(work.w.shape[0]):
        work.home[k] = work.w[k]
        work.home_tangent[k] = work.tangent[k] * work.scale[k]
    return carried_home(problem, scratch, work.home, work.home_tangent)


@kernel
def move_section(problem: Any, scratch: Any, work: Corrector, phase: float) -> int:
    """Carry the last two points to another section."""
    code = carried(problem, scratch, work.here, work.here_tangent, phase)
    if code == status.OK:
        code = carried(problem, scratch, work.behind, work.behind_tangent, phase)
    set_section(problem, scratch, phase, False)
    work.phase[0] = phase
    return code


@kernel
def choose_section(problem: Any, scratch: Any, work: Corrector) -> int:
    """Take the two points in work, which stand at section 0, to a section that is good there."""
    work.phase[0] = 0.0
    set_section(problem, scratch, 0.0, True)
    omega = float(work.here[work.r.shape[0]])
    code = residual(problem, scratch, work.here, omega, work.r, work.J)
    if code != status.OK:
        return code
    return move_section(problem, scratch, work, better_section(problem, scratch, omega))
