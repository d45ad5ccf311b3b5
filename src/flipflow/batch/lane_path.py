r"""One lane: the motion that a machine is brought to as its speed rises or falls slowly.

Newton's method follows the motion from frequency to frequency, each guess a polynomial through the
last motions. Where speeds lie close, the guess is as good as the motion, and one flow with its
tangent shows that it is.

A step is taken back and halved where Newton leads far away, where it does not go as the tangents at
its ends do, or where an eigenvalue of the return map has passed +1: the motion behind a fold is
another one. Where no step is short enough the machine jumps: the exact flow runs turn after turn
from the last motion, at the frequency ahead, until Newton finds the motion that it settles on.

A machine with equal gaps, odd multiples of the frequency and no constant force is flown over half a
turn, with sign. Where that motion loses its symmetry, the lane is flown to one that leans.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from flipflow.compiled import status
from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.compiled.dense import lu_factor, lu_sign, lu_solve
from flipflow.compiled.eigen import Schur, new_schur, real_schur
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import prepare_drive
from flipflow.dynamics.modes import prepare
from flipflow.periodic.shooting import (
    Shooting,
    ShootingWork,
    new_shooting_work,
    shooting_residual,
)
from flipflow.periodic.turn_by_turn import next_turn
from flipflow.periodic.two_event import TwoEvent, new_two_event

NEWTON_MOST = 8
CONVERGED = 1e-9  # last Newton step, as a share of the motion; the error left is about its square
HELD = 1e-13  # the same where a constant force holds the machine far from where it moves about
DIVERGED = 1e3  # Newton step, as a share of the motion, from which none follows
FAR = 0.1  # first Newton step along a path, as a share of the motion: farther lies another motion
ASTRAY = 0.2  # share of the way of a step by which it may differ from what its tangents tell
UNSEEN = 1e-3  # the same as a share of the motion
LONGEST = 0.05  # step in frequency, as a share of it
SHORTEST = 2e-5  # step in frequency, as a share of it, below which the motion has ended
KEPT = 10  # last motions through which a guess goes; more change it by no more than rounding
MARGIN = 1e-7  # distance of the largest multiplier from 1 within which stability is not told
TURNS_BETWEEN = 64  # turns flown before Newton is tried again
TURNS_MOST = 64 * 64
PUSH = 1e-2  # share of the state by which an even motion is pushed out of symmetry
SAME = 1e-6  # first Newton step, as a share of the motion, within which two motions are one


@by_reference
class LaneWork(NamedTuple):
    """Scratch of one thread for machines of N degrees of freedom; one lane after the other."""

    machine: MachineArrays  # of the lane
    shooting: ShootingWork
    schur: Schur
    touch: TwoEvent
    z: Real  # (2 N,) the state at phase 0
    slope: Real  # (2 N,) dz / d omega
    guess: Real  # (2 N,)
    path: Real  # (KEPT, 2 N) the last motions of the path, the very last one first
    slope_here: Real  # (2 N,) tangent of the very last one
    slope_behind: Real  # (2 N,) and of the one before
    omega: Real  # (KEPT,) of them, NaN: no such motion
    stride: Real  # (1,) next step in frequency, as a share of it
    share: Real  # (KEPT,) of them in a divided difference
    flown: Real  # (2 N,) state after some turns
    r: Real  # (2 N,)
    J: Real  # (2 N, 2 N + 1)
    A: Real  # (2 N, 2 N)
    pivot: Int  # (2 N,)
    step: Real  # (3,) last Newton step, as a share of the motion and in m; the motion's size in m
    mu: Complex  # (2 N,) eigenvalues of the return map, with the problem's sign
    largest: Real  # (1,) their largest modulus, NaN: not looked for since Newton's last step


def new_lane_work(machine: MachineArrays, stop: Int) -> LaneWork:
    """Scratch for lanes of machines that differ from a given one in numbers alone.

    Each lane's machine is written into the arrays of the given one.
    ``stop`` (1,) is the flag at which their flows end; none is followed any more.
    """
    shooting = new_shooting_work(machine)
    n = 2 * machine.direction.shape[1]
    vectors = ("z", "slope", "guess", "flown", "r", "slope_here", "slope_behind")
    return LaneWork(
        machine=machine,
        shooting=shooting._replace(flow=shooting.flow._replace(stop=stop)),
        touch=new_two_event(machine),
        schur=new_schur(n),
        path=np.zeros((KEPT, n)),
        omega=np.zeros(KEPT),
        stride=np.zeros(1),
        share=np.zeros(KEPT),
        J=np.zeros((n, n + 1)),
        A=np.zeros((n, n)),
        pivot=np.zeros(n, np.int64),
        step=np.zeros(3),
        mu=np.zeros(n, np.complex128),
        largest=np.zeros(1),
        **{name: np.zeros(n) for name in vectors},
    )


@kernel
def take(batch: Any, lane: int, one: Any) -> None:
    """Copy what an array of many machines holds for one of them."""
    for place, value in np.ndenumerate(batch[lane]):
        one[place] = value


@kernel
def begin_lane(batch: MachineArrays, lane: int, work: LaneWork) -> None:
    """Make the scratch that of one machine of many, which have laws and excitations in common."""
    machine = work.machine
    take(batch.stiffness, lane, machine.stiffness)
    take(batch.damping, lane, machine.damping)
    take(batch.direction, lane, machine.direction)
    take(batch.reach, lane, machine.reach)
    take(batch.static, lane, machine.static)
    take(batch.push, lane, machine.push)
    take(batch.stops.stiffness, lane, machine.stops.stiffness)
    take(batch.stops.damping, lane, machine.stops.damping)
    take(batch.stops.gap, lane, machine.stops.gap)
    flow = work.shooting.flow
    for s in range(flow.driven_at.shape[0]):
        flow.modes.ready[s] = 0
        flow.driven_at[s] = math.nan
    forget_path(work, 0)


@kernel
def forget_path(work: LaneWork, kept: int) -> None:
    """Keep some motions of the path alone."""
    for p in range(kept, KEPT):
        work.omega[p] = math.nan


@kernel
def is_even(machine: MachineArrays) -> bool:
    """Whether a motion of the machine can be its own mirror image after half a turn."""
    for j in range(machine.stops.gap.shape[0]):
        if machine.stops.gap[j, 0] != machine.stops.gap[j, 1]:
            return False
    if is_held(machine):
        return False
    for w in range(machine.order.shape[0]):
        even = machine.order[w] % 2 == 0
        if even:
            return False
    return True


@kernel
def is_held(machine: MachineArrays) -> bool:
    """Whether a constant force acts on the machine."""
    held = False
    for k in range(machine.static.shape[0]):
        held = held or machine.static[k] != 0.0
    return held


@kernel
def newton(problem: Shooting, work: LaneWork, omega: float, far: float) -> int:
    """The motion at omega from work.guess: work.z, its flow recorded, J, slope, Newton steps.

    None is looked for where the first step, as a share of the motion, is ``far`` or more. Of a
    machine under a constant force the motion may be a small part of the state: one step more is
    taken there where the last one was not as small as rounding.
    """
    size = work.z.shape[0]
    for k in range(size):
        work.z[k] = work.guess[k]
    again = is_held(problem.machine)
    for iteration in range(NEWTON_MOST):
        code = newton_step(problem, work, omega)
        if code != status.OK:
            return code
        if iteration == 0 and not work.step[0] < far:
            return status.NO_CONVERGENCE
        # A guess that is taken as it is has to be right beside a small motion, too.
        right = iteration > 0 or work.step[1] < CONVERGED * work.step[2]
        converged = right and work.step[0] < CONVERGED
        if converged and again and work.step[0] > HELD and iteration + 1 < NEWTON_MOST:
            again, converged = False, False
        if converged:
            for k in range(size):
                work.slope[k] = -work.J[k, size]
            lu_solve(work.A, work.pivot, work.slope)
            return status.OK
        if not work.step[0] < DIVERGED:
            return status.NO_CONVERGENCE
        for k in range(size):
            work.z[k] -= work.r[k]
    return status.NO_CONVERGENCE


@kernel
def newton_step(problem: Shooting, work: LaneWork, omega: float) -> int:
    """The step that Newton takes back from work.z, into work.r; its length."""
    size = work.z.shape[0]
    n = size // 2
    code = shooting_residual(problem, work.shooting, work.z, omega, work.r, work.J)
    if code != status.OK:
        return code
    for i in range(size):
        for j in range(size):
            work.A[i, j] = work.J[i, j]
    if not lu_factor(work.A, work.pivot):
        return status.SINGULAR
    lu_solve(work.A, work.pivot, work.r)
    large, step = 0.0, 0.0
    for k in range(n):
        large = max(large, abs(work.z[k]), abs(work.z[n + k]) / omega)
        step = max(step, abs(work.r[k]), abs(work.r[n + k]) / omega)
    work.step[0], work.step[1], work.step[2] = step / max(large, problem.length), step, large
    work.largest[0] = math.nan
    return code


@kernel
def largest_multiplier(work: LaneWork, omega: float) -> float:
    """Eigenvalues of the return map into work.mu, and their largest modulus.

    Infinite where they were not found.
    """
    if not math.isnan(work.largest[0]):
        return float(work.largest[0])
    work.largest[0] = math.inf
    size = work.z.shape[0]
    n, T = size // 2, work.schur.T
    # Rates are larger than displacements by omega: what balancing would find out.
    large = 2.0 ** math.frexp(omega)[1]
    for i in range(size):
        for j in range(size):
            T[i, j] = work.J[i, j]
            if i < n <= j:
                T[i, j] *= large
            elif j < n <= i:
                T[i, j] /= large
        T[i, i] += 1.0
    if not real_schur(work.schur, False):
        return math.inf
    largest = 0.0
    for k in range(size):
        mu = work.schur.value[k]
        work.mu[k] = mu
        largest = max(largest, math.hypot(mu.real, mu.imag))
    work.largest[0] = largest
    return largest


@kernel
def accept(work: LaneWork, omega: float) -> None:
    """Take the motion that Newton found as the next one of the path, its last step taken.

    A guess would multiply what the motions behind it lack.
    """
    for p in range(KEPT - 1, 0, -1):
        work.omega[p] = work.omega[p - 1]
        for k in range(work.z.shape[0]):
            work.path[p, k] = work.path[p - 1, k]
    work.omega[0] = omega
    for k in range(work.z.shape[0]):
        work.path[0, k] = work.z[k] - work.r[k]
        work.slope_behind[k], work.slope_here[k] = work.slope_here[k], work.slope[k]


@kernel
def restart(work: LaneWork, omega: float) -> None:
    """Take the motion that Newton found as the first one of a path."""
    forget_path(work, 0)
    accept(work, omega)
    work.stride[0] = LONGEST


@kernel
def predict(work: LaneWork, omega: float) -> None:
    """work.guess at omega by the polynomial through the last motions, and the last one's tangent.

    Newton's form, with the first place counted twice: each motion more adds its divided difference
    times the distances of omega from all places before. It is taken as long as it adds less than
    the one before did: behind a kink, as where contact begins, more of them lead astray. With two
    the guess is the cubic through their tangents, too. With more of them the earlier tangent is not
    taken: it lacks what Newton's last step changes in it, and that would grow from guess to guess.
    """
    size = work.z.shape[0]
    n, added = size // 2, math.inf
    place, share = work.omega, work.share
    ahead = omega - place[0]
    for k in range(size):
        work.guess[k] = work.path[0, k] + ahead * work.slope_here[k]
    distances, of_slope, sum_of_gaps, taken = ahead * ahead, 1.0, 0.0, 0
    for last in range(1, KEPT):
        if math.isnan(place[last]):
            break
        gap = 1.0 / (place[0] - place[last])
        of_slope *= gap
        sum_of_gaps += gap
        share[0], share[last] = -of_slope * sum_of_gaps, gap * gap
        for q in range(1, last):
            gap = 1.0 / (place[q] - place[last])
            share[q] *= gap
            share[last] *= -gap
        most = 0.0
        for k in range(size):
            difference = of_slope * work.slope_here[k]
            for q in range(last + 1):
                difference += share[q] * work.path[q, k]
            work.z[k] = distances * difference
            most = max(most, abs(work.z[k]) if k < n else abs(work.z[k]) / omega)
        if not most < added:
            break
        for k in range(size):
            work.guess[k] += work.z[k]
        distances *= omega - place[last]
        added, taken = most, last
    if taken == 1:
        add_cubic(work, omega)


@kernel
def add_cubic(work: LaneWork, omega: float) -> None:
    """Make the parabola through two motions and one tangent the cubic through both tangents."""
    back, ahead = work.omega[0] - work.omega[1], omega - work.omega[0]
    scale = ahead * ahead * (ahead + back) / (back * back)
    for k in range(work.z.shape[0]):
        chord = (work.path[0, k] - work.path[1, k]) / back
        bend = work.slope_here[k] + work.slope_behind[k] - 2.0 * chord
        work.guess[k] += scale * bend


@kernel
def keeps_course(work: LaneWork, omega: float, length: float) -> bool:
    """Whether a step goes as its tangents do; over a fold and back it leads to another motion."""
    size = work.z.shape[0]
    step, change, off, large = 0.5 * (omega - work.omega[0]), 0.0, 0.0, length
    for k in range(size):
        weight = 1.0 if 2 * k < size else 1.0 / omega
        gone = work.z[k] - work.r[k] - work.path[0, k]
        change = max(change, weight * abs(gone))
        off = max(off, weight * abs(gone - step * (work.slope_here[k] + work.slope[k])))
        large = max(large, weight * abs(work.z[k]))
    return off <= max(ASTRAY * change, UNSEEN * large)


@kernel
def follow(problem: Shooting, work: LaneWork, target: float) -> bool:
    """Follow the motion of the path to a frequency; False where it ends before, or turns back."""
    while work.omega[0] != target:
        omega = work.omega[0]
        most = work.stride[0] * omega
        ahead = target - omega
        whole = abs(ahead) <= most
        end = target if whole else omega + math.copysign(most, ahead)
        predict(work, end)
        code = newton(problem, work, end, FAR)
        # The determinant of J is the product of all mu - 1: negative with an odd number beyond +1.
        known = code == status.OK and lu_sign(work.A, work.pivot) > 0.0
        if known and keeps_course(work, end, problem.length):
            accept(work, end)
            work.stride[0] = min(LONGEST, 2.0 * work.stride[0])
            continue
        # Beyond a kink, as where contact begins, more motions lead farther away than the tangent.
        forget_path(work, 1)
        work.stride[0] = 0.5 * min(work.stride[0], abs(ahead) / omega)
        if work.stride[0] < SHORTEST:
            return False
    return True


@kernel
def settle(problem: Shooting, work: LaneWork, omega: float, most: int = TURNS_MOST) -> bool:
    """Fly from work.z at omega until Newton finds the motion settled on, which restarts the path.

    False where the flow settles on none that repeats after a turn of the problem, or not in
    ``most`` turns; work.z is where it has come to.
    """
    size = work.z.shape[0]
    flow = work.shooting.flow
    flown = 0
    while flown < most:
        for k in range(size):
            flow.z[k] = work.z[k]
        for _ in range(TURNS_BETWEEN):
            if next_turn(problem, work.shooting, omega) != status.OK:
                return False
        flown += TURNS_BETWEEN
        for k in range(size):
            work.z[k] = flow.z[k]
            work.guess[k] = flow.z[k]
            work.flown[k] = flow.z[k]
        found = newton(problem, work, omega, FAR) == status.OK
        if found and largest_multiplier(work, omega) < 1.0:
            restart(work, omega)
            return True
        for k in range(size):
            work.z[k] = work.flown[k]
    return False


@kernel
def contact_free_state(machine: MachineArrays, work: LaneWork, omega: float) -> bool:
    """The state at phase 0 of the motion with all stops open into work.guess; False without modes.

    Whether it touches a stop is not asked.
    """
    flow = work.shooting.flow
    n = machine.direction.shape[1]
    if flow.modes.ready[0] == 0:
        prepare(machine, flow.modes, 0)
    if flow.modes.ready[0] < 0:
        return False
    prepare_drive(machine, flow, 0, omega)
    for k in range(n):
        work.guess[k] = flow.modes.static[0, k]
        work.guess[n + k] = flow.modes.drift[0, k]
    for w in range(machine.order.shape[0]):
        for k in range(2 * n):
            work.guess[k] += flow.drive[0, w, k].real
    return True
