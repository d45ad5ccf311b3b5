"""Motions over a parameter of the machine, and curves in two parameters, as problems of the loop.

Unknowns are the state z and the parameter's value; on a curve z, a second parameter, which is omega
or another field, and the value. A motion solves

    sign flow(z; omega, value) - z = 0,

a point of a curve also g = 0, g being a test function of its return map or the depth beyond a gap.
Derivatives in fields of the machine, and those of g, which hold the second ones of the flow, are
central differences of second order; the rest is exact.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flipflow.compiled import status
from flipflow.compiled.arrays import Int, Real
from flipflow.compiled.by_reference import by_reference
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
from flipflow.periodic.near_grazing import near_grazing
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
OF_DEPTH = 0.01  # the same as a share of the depth to which a stop is touched
SMALLEST = 1e-11  # least step; at a smaller one rounding would drown the difference
BEYOND = 0.01  # share of the interval by which a correction may leave it on its way
BESIDE_SHARE = 0.2  # size of the second parameter as an unknown, as a share of it
VALUE_SHARE = 0.05  # longest step in the value, as a share of its size
# What is followed: motions, or those with a multiplier +1, with one -1, with two of product 1, and
# those that graze a gap.
MOTION, SADDLE_NODE, FLIP, PAIR, GRAZING = range(5)


class Varied(NamedTuple):
    """The problem: shooting, its machine rewritten for every value of the parameters."""

    shooting: Shooting
    series: MachineSeries
    omega: float  # frequency of the motions; 0 where it is the unknown beside the state
    own: float  # the value that sets the parameter's size
    beside: float  # that of the field beside the state, where there is one
    test: int  # MOTION, or the test function whose zeros are followed
    gap: int  # 2 * spring + side of the gap that is grazed
    opened: Int  # (m, 2) 1 for the gaps that are not met up to the grazing: those grazed at once


@by_reference
class VariedWork(NamedTuple):
    """Scratch of the problem."""

    shooting: ShootingWork
    series: SeriesWork
    at: Real  # (3,) values of both parameters for which the machine stands; the last frequency
    gap: Real  # (m, 2) gaps, of which the flow does not see those that are opened
    z: Real  # (2 N + 2,) unknowns moved for a difference
    move: Real  # (2 N + 2,) how far
    ahead: Real  # (2 N,)
    r: Real  # (2 N,)
    J: Real  # (2 N, 2 N + 1)
    depth: Real  # (m, 2)
    square: Real  # (2 N, 2 N), or of as many rows as there are pairs of multipliers
    pivot: Int  # one for each of its rows


def new_varied_work(shooting: ShootingWork, size: int, stops: int, *, pairs: bool) -> VariedWork:
    """Scratch for N degrees of freedom; ``pairs`` where pairs of multipliers count."""
    n = 2 * size
    rows = n * (n - 1) // 2 if pairs else n
    return VariedWork(
        shooting=shooting,
        series=new_series_work(size),
        at=np.full(3, np.nan),
        gap=np.full((stops, 2), np.inf),
        z=np.zeros(n + 2),
        move=np.zeros(n + 2),
        ahead=np.zeros(n),
        r=np.zeros(n),
        J=np.zeros((n, n + 1)),
        depth=np.zeros((stops, 2)),
        square=np.zeros((rows, rows)),
        pivot=np.zeros(rows, np.int64),
    )


@kernel
def stand_at(problem: Varied, work: VariedWork, value: float, beside: float) -> bool:
    """Let the machine be that of both values; False where it cannot."""
    if work.at[0] == value and work.at[1] == beside:
        return True
    work.at[0] = math.nan
    series, flow = problem.series, work.shooting.flow
    if not (
        inside(value, series.low, series.high)
        and inside(beside, series.beside_low, series.beside_high)
    ):
        return False
    for slot in range(flow.modes.ready.shape[0]):
        flow.modes.ready[slot] = 0
        flow.driven_at[slot] = math.nan
    machine = problem.shooting.machine
    if not set_machine(series, work.series, value, beside, machine):
        return False
    if problem.test == GRAZING:
        # Up to the grazing the gaps are not met: without them the motion is smooth beyond as well.
        for j in range(work.gap.shape[0]):
            for side in range(2):
                work.gap[j, side] = machine.stops.gap[j, side]
        open_gaps(problem)
    work.at[0], work.at[1] = value, beside
    return True


@kernel
def inside(value: float, low: float, high: float) -> bool:
    """Whether a value lies in an interval, or so little beyond that a correction may pass it."""
    width = high - low
    return low - BEYOND * width <= value <= high + BEYOND * width


@kernel
def open_gaps(problem: Varied) -> None:
    """Let the grazed gaps be infinite."""
    gap = problem.shooting.machine.stops.gap
    for j in range(gap.shape[0]):
        for side in range(2):
            if problem.opened[j, side] != 0:
                gap[j, side] = math.inf


@kernel
def show_gaps(problem: Varied, work: VariedWork) -> None:
    """Let the grazed gaps be what they are, for what is read off a motion."""
    if problem.test == GRAZING:
        for j in range(work.gap.shape[0]):
            for side in range(2):
                problem.shooting.machine.stops.gap[j, side] = work.gap[j, side]


@kernel
def frequency(problem: Varied, u: Real) -> float:
    """Frequency of the unknowns u, without the value."""
    return problem.omega if problem.omega > 0.0 else float(u[u.shape[0] - 1])


@kernel
def value_beside(problem: Varied, u: Real) -> float:
    """The field beside the state in the unknowns u, without the value."""
    if problem.omega > 0.0 and problem.test != MOTION:
        return float(u[u.shape[0] - 1])
    return problem.series.beside_low


@kernel
def varied_residual(
    problem: Varied, work: VariedWork, u: Real, value: float, r: Real, J: Real
) -> int:
    """r and J = [dr/du, dr/d value] of a motion, or of one where a test function is zero."""
    size, n = work.r.shape[0], r.shape[0]
    for k in range(n):
        work.z[k] = u[k]
    work.z[n] = value
    set_moves(problem, work, n, DIFFERENCE)
    if n > size:
        code, test = evaluate(problem, work, n)
        if code != status.OK:
            return code
        set_moves(problem, work, n, step_share(problem, work))
    for k in range(n + 1):
        code = add_differences(problem, work, n, k, J)
        if code != status.OK:
            return code
    code, test = evaluate(problem, work, n)
    omega_column = size if problem.omega == 0.0 else size - 1
    for i in range(size):
        r[i] = work.r[i]
        for k in range(omega_column + 1):
            J[i, k] = work.J[i, k]
    if n > size:
        r[size] = test
    return code


@kernel
def step_share(problem: Varied, work: VariedWork) -> float:
    """Step of a difference quotient of the last motion, as a share of the unknown's size.

    Where a stop is hardly touched, or hardly not, be it by the highest summit of a turn or by
    another, the map changes within that depth: the step is a share of it.
    """
    least = min(near_grazing(problem.shooting, work.shooting, float(work.at[2])))
    state_scale(problem.shooting, work.z, float(work.at[2]), work.move)
    return max(SMALLEST, min(DIFFERENCE, OF_DEPTH * least / float(work.move[0])))


@kernel
def set_moves(problem: Varied, work: VariedWork, n: int, share: float) -> None:
    """Steps of the difference quotients about the n + 1 unknowns in work.z."""
    size = work.r.shape[0]
    omega = frequency(problem, work.z[:n])
    state_scale(problem.shooting, work.z, omega, work.move)
    for k in range(size):
        work.move[k] *= share
    if n > size:
        work.move[size] = share * size_beside(problem, float(work.z[size]))
    work.move[n] = share * value_size(problem, float(work.z[n]))


@kernel
def value_size(problem: Varied, value: float) -> float:
    """Size of the parameter: the value's or the machine's own, and the interval at most."""
    width = problem.series.high - problem.series.low
    return min(width, max(abs(value), abs(problem.own))) if problem.own != 0.0 else width


@kernel
def size_beside(problem: Varied, value: float) -> float:
    """Size of the unknown beside the state: of omega its value."""
    if problem.omega == 0.0:
        return value
    width, own = problem.series.beside_high - problem.series.beside_low, abs(problem.beside)
    return min(width, max(abs(value), own)) if own != 0.0 else width


@kernel
def add_differences(problem: Varied, work: VariedWork, n: int, k: int, J: Real) -> int:
    """What of column k of J are central differences: of a field all of it, else the last row.

    At an end of an interval of a field they are one-sided: beyond it may lie another law.
    """
    size, here, step = work.r.shape[0], float(work.z[k]), float(work.move[k])
    field = k == n or (k == size and problem.omega > 0.0)
    if not field and n == size:
        return status.OK
    behind, ahead = here - step, here + step
    if field:
        series = problem.series
        low, high = (series.low, series.high) if k == n else (series.beside_low, series.beside_high)
        behind, ahead = max(behind, low), min(ahead, high)
    work.z[k] = ahead
    code, after = evaluate(problem, work, n)
    for i in range(size):
        work.ahead[i] = work.r[i]
    work.z[k] = behind
    if code == status.OK:
        code, before = evaluate(problem, work, n)
        if n > size:
            J[size, k] = (after - before) / (ahead - behind)
        if field:
            for i in range(size):
                J[i, k] = (work.ahead[i] - work.r[i]) / (ahead - behind)
    work.z[k] = here
    return code


@kernel
def evaluate(problem: Varied, work: VariedWork, n: int) -> tuple[int, float]:
    """Status, and the test function, at the unknowns in work.z; the motion's are left in work."""
    omega = frequency(problem, work.z[:n])
    if not stand_at(problem, work, float(work.z[n]), value_beside(problem, work.z[:n])):
        return status.NO_CONVERGENCE, math.nan
    work.at[2] = omega
    code = shooting_residual(problem.shooting, work.shooting, work.z, omega, work.r, work.J)
    if code != status.OK or problem.test == MOTION:
        return code, 0.0
    if problem.test == GRAZING:
        varied_depths(problem, work, 0.0, work.depth)
        return code, float(work.depth[problem.gap // 2, problem.gap % 2])
    return critical(problem, work)


@kernel
def critical(problem: Varied, work: VariedWork) -> tuple[int, float]:
    """Status, and the determinant that is zero where multipliers of work.J + I are critical.

    With one at +1 it is that of map - I, with one at -1 that of map + I, and with a product of two
    of 1 that of the second compound matrix of the map, whose eigenvalues these products are, - I.
    """
    size, J = work.r.shape[0], work.J
    total = 0.0
    for i in range(size):
        for k in range(size):
            total += abs(J[i, k])
    if not math.isfinite(total):
        return status.NOT_FINITE, math.nan
    if problem.test == PAIR:
        set_compound(work)
    else:
        for i in range(size):
            for k in range(size):
                work.square[i, k] = J[i, k]
            if problem.test == FLIP:
                work.square[i, i] += 2.0
    if not lu_factor(work.square, work.pivot):
        return status.OK, 0.0  # singular to the last digit
    product = 1.0
    for k in range(work.square.shape[0]):
        product *= work.square[k, k] if work.pivot[k] == k else -work.square[k, k]
    return status.OK, product


@kernel
def set_compound(work: VariedWork) -> None:
    """C - I into work.square, C the second compound matrix of the map: its minors of two rows."""
    size, J, row = work.r.shape[0], work.J, 0
    for i in range(size):
        J[i, i] += 1.0
    for p in range(size):
        for q in range(p + 1, size):
            column = 0
            for s in range(size):
                for t in range(s + 1, size):
                    work.square[row, column] = J[p, s] * J[q, t] - J[p, t] * J[q, s]
                    column += 1
            work.square[row, row] -= 1.0
            row += 1
    for i in range(size):
        J[i, i] -= 1.0


@kernel
def varied_crossings(problem: Varied, work: VariedWork) -> int:
    """The shooting's number of contacts."""
    return crossings(problem.shooting, work.shooting)


@kernel
def varied_depths(problem: Varied, work: VariedWork, value: float, depth: Real) -> None:
    """The shooting's depths, (m, 2); the machine stands at the value already."""
    show_gaps(problem, work)
    flow_depths(problem.shooting, work.shooting, float(work.at[2]), depth)
    if problem.test == GRAZING:
        open_gaps(problem)


@kernel
def varied_scale(problem: Varied, u: Real, value: float, scale: Real) -> None:
    """Size of each unknown, and the longest step in the value."""
    size = 2 * problem.shooting.machine.direction.shape[1]
    n = scale.shape[0] - 1
    state_scale(problem.shooting, u, frequency(problem, u[:n]), scale)
    if n > size:
        scale[size] = BESIDE_SHARE * size_beside(problem, float(u[size]))
    scale[n] = VALUE_SHARE * value_size(problem, value)


@kernel
def varied_better(problem: Varied, work: VariedWork, value: float) -> float:
    """The shooting's better section."""
    show_gaps(problem, work)
    phase = section.better_section(problem.shooting, work.shooting, float(work.at[2]))
    if problem.test == GRAZING:
        open_gaps(problem)
    return float(phase)


@kernel
def varied_section(problem: Varied, work: VariedWork, phase: float, anew: bool) -> None:
    """Set the shooting's section."""
    section.set_section(problem.shooting, work.shooting, phase, anew)


@kernel
def varied_mirrored(problem: Varied) -> Varied:
    """The problem of motions that are their own mirror image."""
    half = mirrored_shooting(problem.shooting)
    return Varied(
        half, problem.series, problem.omega, problem.own, problem.beside, problem.test, problem.gap,
        problem.opened,
    )  # fmt: skip


@kernel
def varied_carried(problem: Varied, work: VariedWork, w: Real, tangent: Real, end: float) -> int:
    """Carry unknowns w and a tangent dw to another section; the tangent by differences."""
    size, n = work.r.shape[0], w.shape[0] - 1
    if end == work.shooting.section[0]:
        return status.OK
    for k in range(n + 1):
        work.z[k] = w[k]
    set_moves(problem, work, n, DIFFERENCE)
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
    beside = value_beside(problem, work.z[:n])
    if not omega > 0.0 or not stand_at(problem, work, float(work.z[n]), beside):
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
