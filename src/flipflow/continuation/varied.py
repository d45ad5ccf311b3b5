"""Motions over a parameter of the machine, and folds over it, as problems of the loop.

Unknowns are the state z and the parameter's value, or z, omega and the value. A motion solves

    sign flow(z; omega, value) - z = 0,

a fold also det(d r / d z) = 0. Derivatives in the value, and those of the determinant, are central
differences; the rest is exact.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flipflow.compiled import status
from flipflow.compiled.arrays import Int, Real
from flipflow.compiled.compile import kernel
from flipflow.compiled.dense import lu_factor
from flipflow.dynamics.flow import run_flow
from flipflow.dynamics.machine_series import (
    MachineSeries,
    SeriesWork,
    new_series_work,
    set_machine,
)
from flipflow.periodic import section
from flipflow.periodic.shooting import (
    Shooting,
    ShootingWork,
    crossings,
    flow_depths,
    mirrored_shooting,
    shooting_residual,
    state_scale,
)

# Step of a difference quotient, as a share of the unknown's own size: the same share of a wide
# interval would swamp the value.
DIFFERENCE = 1e-6
BEYOND = 0.01  # share of the interval by which a correction may leave it on its way
SPEED_SHARE = 0.2  # size of omega as an unknown, as a share of it
VALUE_SHARE = 0.05  # longest step in the value, as a share of its size


class Varied(NamedTuple):
    """The problem: shooting, its machine rewritten for every value of the parameter."""

    shooting: Shooting
    series: MachineSeries
    omega: float  # frequency of the motions; 0 where it is an unknown and folds are sought
    own: float  # the value that sets the parameter's size


class VariedWork(NamedTuple):
    """Scratch of the problem."""

    shooting: ShootingWork
    series: SeriesWork
    at: Real  # (2,) value for which the machine stands, and the frequency of the last flow
    z: Real  # (2 N + 2,) unknowns moved for a difference
    move: Real  # (2 N + 2,) how far
    ahead: Real  # (2 N,)
    r: Real  # (2 N,)
    J: Real  # (2 N, 2 N + 1)
    square: Real  # (2 N, 2 N)
    pivot: Int  # (2 N,)


def new_varied_work(shooting: ShootingWork, size: int) -> VariedWork:
    """Scratch for machines of N degrees of freedom."""
    n = 2 * size
    return VariedWork(
        shooting=shooting,
        series=new_series_work(size),
        at=np.full(2, np.nan),
        z=np.zeros(n + 2),
        move=np.zeros(n + 2),
        ahead=np.zeros(n),
        r=np.zeros(n),
        J=np.zeros((n, n + 1)),
        square=np.zeros((n, n)),
        pivot=np.zeros(n, np.int64),
    )


@kernel
def stand_at(problem: Varied, work: VariedWork, value: float) -> bool:
    """Let the machine be that of a value; False where it cannot."""
    if work.at[0] == value:
        return True
    work.at[0] = math.nan
    series, width = problem.series, problem.series.high - problem.series.low
    if not series.low - BEYOND * width <= value <= series.high + BEYOND * width:
        return False
    flow = work.shooting.flow
    for slot in range(flow.modes.ready.shape[0]):
        flow.modes.ready[slot] = 0
        flow.driven_at[slot] = math.nan
    if not set_machine(series, work.series, value, problem.shooting.machine):
        return False
    work.at[0] = value
    return True


@kernel
def frequency(problem: Varied, u: Real) -> float:
    """Frequency of the unknowns u, without the value."""
    return problem.omega if problem.omega > 0.0 else float(u[u.shape[0] - 1])


@kernel
def varied_residual(
    problem: Varied, work: VariedWork, u: Real, value: float, r: Real, J: Real
) -> int:
    """r and J = [dr/du, dr/d value] of a motion, or of a fold."""
    size, n = work.r.shape[0], r.shape[0]
    for k in range(n):
        work.z[k] = u[k]
    work.z[n] = value
    set_moves(problem, work, n)
    code = status.OK
    if n > size:
        code = fold_row(problem, work, r, J)
    for k in range(size):
        J[k, n] = 0.0
    # At an end of the interval the difference is one-sided: beyond it may lie another law.
    step = float(work.move[n])
    low, high = max(value - step, problem.series.low), min(value + step, problem.series.high)
    if code == status.OK:
        code = add_value_slope(problem, work, n, high, 1.0 / (high - low), J)
    if code == status.OK:
        code = add_value_slope(problem, work, n, low, -1.0 / (high - low), J)
    if code != status.OK:
        return code
    if not stand_at(problem, work, value):
        return status.NO_CONVERGENCE
    omega = frequency(problem, u[:n])
    work.at[1] = omega
    code = shooting_residual(problem.shooting, work.shooting, u, omega, work.r, work.J)
    for i in range(size):
        r[i] = work.r[i]
        for k in range(n):
            J[i, k] = work.J[i, k]
    return code


@kernel
def set_moves(problem: Varied, work: VariedWork, n: int) -> None:
    """Steps of the difference quotients about the n + 1 unknowns in work.z."""
    size = work.r.shape[0]
    omega = frequency(problem, work.z[:n])
    state_scale(problem.shooting, work.z, omega, work.move)
    for k in range(size):
        work.move[k] *= DIFFERENCE
    if n > size:
        work.move[size] = DIFFERENCE * omega
    work.move[n] = DIFFERENCE * value_size(problem, float(work.z[n]))


@kernel
def value_size(problem: Varied, value: float) -> float:
    """Size of the parameter: the value's or the machine's own, and the interval at most."""
    width = problem.series.high - problem.series.low
    return min(width, max(abs(value), abs(problem.own))) if problem.own != 0.0 else width


@kernel
def add_value_slope(
    problem: Varied, work: VariedWork, n: int, value: float, weight: float, J: Real
) -> int:
    """Add one side's share of the difference quotient in the value to the last column of J."""
    size, flow = work.r.shape[0], work.shooting.flow
    omega = frequency(problem, work.z[:n])
    if not omega > 0.0 or not stand_at(problem, work, value):
        return status.NO_CONVERGENCE
    for k in range(size):
        flow.z[k] = work.z[k]
    begin = work.shooting.section[0] / omega
    duration = problem.shooting.fraction * 2.0 * math.pi / omega
    machine = problem.shooting.machine
    code = run_flow(machine, flow, omega, begin, duration, work.shooting.rate)
    for k in range(size):
        J[k, n] += weight * problem.shooting.sign * flow.z[k]
    return code


@kernel
def fold_row(problem: Varied, work: VariedWork, r: Real, J: Real) -> int:
    """The determinant and its derivatives, in the last row."""
    size, n = work.r.shape[0], r.shape[0]
    for k in range(n + 1):
        here = work.z[k]
        ahead, behind = here + work.move[k], here - work.move[k]
        if k == n:
            ahead, behind = min(ahead, problem.series.high), max(behind, problem.series.low)
        work.z[k] = ahead
        code, after = determinant(problem, work, n)
        work.z[k] = behind
        if code == status.OK:
            code, before = determinant(problem, work, n)
            J[size, k] = (after - before) / (ahead - behind)
        work.z[k] = here
        if code != status.OK:
            return code
    code, r[size] = determinant(problem, work, n)
    return code


@kernel
def determinant(problem: Varied, work: VariedWork, n: int) -> tuple[int, float]:
    """Status, and det(dr/dz) at the unknowns in work.z."""
    size = work.r.shape[0]
    omega = float(work.z[n - 1])
    if not stand_at(problem, work, float(work.z[n])):
        return status.NO_CONVERGENCE, math.nan
    code = shooting_residual(problem.shooting, work.shooting, work.z, omega, work.r, work.J)
    if code != status.OK:
        return code, math.nan
    product, total = 1.0, 0.0
    for i in range(size):
        for k in range(size):
            work.square[i, k] = work.J[i, k]
            total += abs(work.J[i, k])
    if not math.isfinite(total):
        return status.NOT_FINITE, math.nan
    if not lu_factor(work.square, work.pivot):
        return status.OK, 0.0  # singular to the last digit: a fold
    for k in range(size):
        product *= work.square[k, k] if work.pivot[k] == k else -work.square[k, k]
    return code, product


@kernel
def varied_crossings(problem: Varied, work: VariedWork) -> int:
    """The shooting's number of contacts."""
    return crossings(problem.shooting, work.shooting)


@kernel
def varied_depths(problem: Varied, work: VariedWork, value: float, depth: Real) -> None:
    """The shooting's depths, (m, 2); the machine stands at the value already."""
    flow_depths(problem.shooting, work.shooting, float(work.at[1]), depth)


@kernel
def varied_scale(problem: Varied, u: Real, value: float, scale: Real) -> None:
    """Size of each unknown, and the longest step in the value."""
    size = 2 * problem.shooting.machine.direction.shape[1]
    n = scale.shape[0] - 1
    omega = frequency(problem, u[:n])
    state_scale(problem.shooting, u, omega, scale)
    if n > size:
        scale[size] = SPEED_SHARE * omega
    scale[n] = VALUE_SHARE * value_size(problem, value)


@kernel
def varied_better(problem: Varied, work: VariedWork, value: float) -> float:
    """The shooting's better section."""
    return section.better_section(problem.shooting, work.shooting, float(work.at[1]))


@kernel
def varied_section(problem: Varied, work: VariedWork, phase: float, anew: bool) -> None:
    """Set the shooting's section."""
    section.set_section(problem.shooting, work.shooting, phase, anew)


@kernel
def varied_mirrored(problem: Varied) -> Varied:
    """The problem of motions that are their own mirror image."""
    half = mirrored_shooting(problem.shooting)
    return Varied(half, problem.series, problem.omega, problem.own)


@kernel
def varied_carried(problem: Varied, work: VariedWork, w: Real, tangent: Real, end: float) -> int:
    """Carry unknowns w and a tangent dw to another section; the tangent by differences."""
    size, n = work.r.shape[0], w.shape[0] - 1
    if end == work.shooting.section[0]:
        return status.OK
    for k in range(n + 1):
        work.z[k] = w[k]
    set_moves(problem, work, n)
    share = 0.0
    for k in range(n + 1):
        share = max(share, abs(tangent[k]) / work.move[k])
    step = 1.0 / share if share > 0.0 else 0.0
    code_ahead = arrive_beside(problem, work, w, tangent, step, end)
    for k in range(size):
        work.ahead[k] = work.z[k]
    code_behind = arrive_beside(problem, work, w, tangent, -step, end)
    for k in range(size):
        work.ahead[k] = 0.5 * share * (work.ahead[k] - work.z[k])
    code = arrive_beside(problem, work, w, tangent, 0.0, end)
    if code == status.OK:
        code = code_ahead if code_ahead != status.OK else code_behind
    if code != status.OK:
        return code
    for k in range(size):
        w[k] = work.z[k]
        tangent[k] = work.ahead[k]
    return code


@kernel
def varied_home(problem: Varied, work: VariedWork, w: Real, tangent: Real) -> int:
    """Carry unknowns w and a tangent dw to phase 0."""
    return varied_carried(problem, work, w, tangent, 0.0)


@kernel
def arrive_beside(
    problem: Varied, work: VariedWork, w: Real, tangent: Real, step: float, end: float
) -> int:
    """Carry the unknowns a step along the tangent to a section; the state is left in work.z."""
    for k in range(w.shape[0]):
        work.z[k] = w[k] + step * tangent[k]
    return arrive(problem, work, w.shape[0] - 1, end)


@kernel
def arrive(problem: Varied, work: VariedWork, n: int, end: float) -> int:
    """Carry the state in work.z to a section ahead, with the problem's sign in the next turn."""
    size, flow, shooting = work.r.shape[0], work.shooting.flow, problem.shooting
    omega = frequency(problem, work.z[:n])
    if not omega > 0.0 or not stand_at(problem, work, float(work.z[n])):
        return status.NO_CONVERGENCE
    sign, angle = 1.0, end - work.shooting.section[0]
    if angle < 0.0:
        sign, angle = shooting.sign, angle + shooting.fraction * 2.0 * math.pi
    for k in range(size):
        flow.z[k] = work.z[k]
    begin = work.shooting.section[0] / omega
    code = run_flow(shooting.machine, flow, omega, begin, angle / omega, work.shooting.rate)
    for k in range(size):
        work.z[k] = sign * flow.z[k]
    return code
