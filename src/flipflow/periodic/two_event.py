"""The symmetric motion with one touch a side: a scalar problem.

One spring with equal gaps is touched for the share s of each half turn. Counting time from the
moment of contact, the half turn is an engaged piece of length s pi / omega and an open one, and
its end is minus its beginning. Given omega and s that is linear in the state z at contact and in
the force's complex size F (in units of the machine's own force), with y = e at both ends of the
touch: one 2 N x 2 N solve, then a 2 x 2 one. Motions of the machine are the zeros of

    f(s) = |F(s, omega)| - 1,

a fold is f_s = 0, a cusp f_s = f_ss = 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from flipflow.compiled import status
from flipflow.compiled.compile import kernel
from flipflow.compiled.dense import lu_factor, lu_solve
from flipflow.dynamics.contact_search import exponential
from flipflow.dynamics.flow import Flow, prepare_drive, run_flow
from flipflow.dynamics.plan import Int, Plan, Real

OPEN_SLOT, PLUS_SLOT = 0, 1
MOST_ROOT_STEPS = 60


class TwoEvent(NamedTuple):
    """Scratch of the scalar problem for 2 N states."""

    plan: Plan
    flow: Flow
    engaged: Real  # (2 N, 2 N) exp(A t) over the touch
    open: Real  # (2 N, 2 N) over the open piece
    A: Real  # (2 N, 2 N)
    pivot: Int  # (2 N,)
    column: Real  # (2 N,)
    begin: Real  # (2 N, 3) state at contact: constant, per real and per imaginary part of F
    end: Real  # (2 N, 3) the same at release
    z: Real  # (2 N,) state at contact
    rate: Real  # (2 N,)


@kernel
def piece_exponential(plan: Plan, slot: int, length: float, out: Real) -> None:
    """out = exp(A length) of one configuration, by its modes."""
    size = out.shape[0]
    for r in range(size):
        for c in range(size):
            out[r, c] = 0.0
    for i in range(plan.mode_count[slot]):
        factor = plan.weight[slot, i] * exponential(plan.rate[slot, i] * length)
        for r in range(size):
            v = plan.right[slot, r, i] * factor
            for c in range(size):
                left = plan.left[slot, i, c]
                out[r, c] += v.real * left.real - v.imag * left.imag


@kernel
def required_force(problem: TwoEvent, omega: float, s: float) -> complex:
    """F of the motion that touches for the share s; its state at contact into problem.z."""
    plan, flow = problem.plan, problem.flow
    size = problem.z.shape[0]
    half = math.pi / omega
    prepare_drive(plan, flow, OPEN_SLOT, omega)
    prepare_drive(plan, flow, PLUS_SLOT, omega)
    piece_exponential(plan, PLUS_SLOT, s * half, problem.engaged)
    piece_exponential(plan, OPEN_SLOT, (1.0 - s) * half, problem.open)
    turn = exponential(1j * (s * math.pi))
    _end_of_touch(problem, turn)
    # -z = open z_end + ..., with z_end = engaged z + end: (I + open engaged) z = right sides.
    for r in range(size):
        for c in range(size):
            total = 1.0 if r == c else 0.0
            for k in range(size):
                total += problem.open[r, k] * problem.engaged[k, c]
            problem.A[r, c] = total
    if not lu_factor(problem.A, problem.pivot):
        return complex(math.nan, math.nan)
    for part in range(3):
        _solve_begin(problem, turn, part)
    return _solve_force(problem, s * half)


@kernel
def _end_of_touch(problem: TwoEvent, turn: complex) -> None:
    """problem.end: the state at release less exp(A t) z, constant and per part of F."""
    plan, flow = problem.plan, problem.flow
    size = problem.z.shape[0]
    for r in range(size):
        drive = flow.drive[PLUS_SLOT, r] * turn
        constant, real, imag = plan.rest[PLUS_SLOT, r], drive.real, -drive.imag
        for c in range(size):
            before = flow.drive[PLUS_SLOT, c]
            constant -= problem.engaged[r, c] * plan.rest[PLUS_SLOT, c]
            real -= problem.engaged[r, c] * before.real
            imag += problem.engaged[r, c] * before.imag
        problem.end[r, 0], problem.end[r, 1], problem.end[r, 2] = constant, real, imag


@kernel
def _solve_begin(problem: TwoEvent, turn: complex, part: int) -> None:
    """One column of problem.begin, and of problem.end with exp(A t) z added."""
    flow = problem.flow
    size = problem.z.shape[0]
    for r in range(size):
        # At the end of the half turn the drive has the opposite sign.
        drive = flow.drive[OPEN_SLOT, r]
        total = 0.0 if part == 0 else drive.real if part == 1 else -drive.imag
        for c in range(size):
            before = flow.drive[OPEN_SLOT, c] * turn
            driven = 0.0 if part == 0 else before.real if part == 1 else -before.imag
            total -= problem.open[r, c] * (problem.end[c, part] - driven)
        problem.column[r] = total
    lu_solve(problem.A, problem.pivot, problem.column)
    for r in range(size):
        problem.begin[r, part] = problem.column[r]
    for r in range(size):
        for c in range(size):
            problem.end[r, part] += problem.engaged[r, c] * problem.column[c]


@kernel
def _solve_force(problem: TwoEvent, touch: float) -> complex:
    """F from y = e at both ends of the touch; the second as a difference quotient."""
    plan = problem.plan
    n = plan.direction.shape[1]
    gap = plan.gap_plus[0]
    first0, first1, first2 = -gap, 0.0, 0.0
    next0, next1, next2 = 0.0, 0.0, 0.0
    for k in range(n):
        d = plan.direction[0, k]
        first0 += d * problem.begin[k, 0]
        first1 += d * problem.begin[k, 1]
        first2 += d * problem.begin[k, 2]
        next0 += d * (problem.end[k, 0] - problem.begin[k, 0]) / touch
        next1 += d * (problem.end[k, 1] - problem.begin[k, 1]) / touch
        next2 += d * (problem.end[k, 2] - problem.begin[k, 2]) / touch
    det = first1 * next2 - first2 * next1
    a = (first2 * next0 - first0 * next2) / det
    b = (first0 * next1 - first1 * next0) / det
    for k in range(problem.z.shape[0]):
        problem.z[k] = problem.begin[k, 0] + a * problem.begin[k, 1] + b * problem.begin[k, 2]
    return complex(a, b)


@kernel
def force_excess(problem: TwoEvent, omega: float, s: float) -> float:
    """f(s) = |F| - 1."""
    F = required_force(problem, omega, s)
    return math.sqrt(F.real * F.real + F.imag * F.imag) - 1.0


@kernel
def root_between(
    problem: TwoEvent, omega: float, a: float, b: float, f_a: float, f_b: float
) -> float:
    """Zero of f in [a, b] by false position with halving of the stale end (Illinois)."""
    for _ in range(MOST_ROOT_STEPS):
        s = (a * f_b - b * f_a) / (f_b - f_a)
        f = force_excess(problem, omega, s)
        if abs(f) < 1e-14 or abs(b - a) < 1e-14:
            return s
        if f * f_b < 0.0:
            a, f_a = b, f_b
        else:
            f_a *= 0.5
        b, f_b = s, f
    return b


@kernel(entry=True)
def two_event_states(
    problem: TwoEvent, omega: float, samples: int, states: Real, shares: Real
) -> int:
    """All zeros of f that lie more than one sample apart: states at t = 0 and shares; their number.

    The state at contact is carried on by the exact flow to the next t = 0; whether its touches
    are those assumed is for the caller to see.
    """
    found = 0
    before, f_before = 0.0, math.nan
    for i in range(samples):
        s = (i + 0.5) / samples
        f = force_excess(problem, omega, s)
        if f * f_before < 0.0 and found < states.shape[0]:
            root = root_between(problem, omega, before, s, f_before, f)
            F = required_force(problem, omega, root)
            phase = math.atan2(F.imag, F.real) % (2.0 * math.pi)
            start = phase / omega
            for k in range(problem.z.shape[0]):
                problem.flow.z[k] = problem.z[k]
            rest = 2.0 * math.pi / omega - start
            code = run_flow(problem.plan, problem.flow, omega, start, rest, problem.rate)
            if code == status.OK:
                for k in range(problem.z.shape[0]):
                    states[found, k] = problem.flow.z[k]
                shares[found] = root
                found += 1
        before, f_before = s, f
    return found


@kernel(entry=True)
def force_excesses(problem: TwoEvent, omega: Real, shares: Real, out: Real) -> None:
    """f at pairs of omega and s, (P,)."""
    for p in range(omega.shape[0]):
        out[p] = force_excess(problem, omega[p], shares[p])
