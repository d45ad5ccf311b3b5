"""Motions over a parameter of the machine, and curves in two parameters, as problems of the loop.

Unknowns are the state z and the parameter's value; on a curve z, a second parameter, which is omega
or another field, and the value. A motion solves

    sign flow(z; omega, value) - z = 0,

a point of a curve also g = 0, g being a test function of its return map or the depth beyond a gap.
All derivatives are exact, those of g, which hold the second ones of the flow, too.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flipflow.compiled import status
from flipflow.compiled.arrays import Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.continuation.conditions import (
    GRAZING,
    MOTION,
    ConditionWork,
    critical_slopes,
    curve_columns,
    depth_slopes,
    field_columns,
    new_condition_work,
)
from flipflow.dynamics.machine_series import (
    MachineSeries,
    SeriesWork,
    new_series_work,
    set_columns,
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

BEYOND = 0.01  # share of the interval by which a correction may leave it on its way
BESIDE_SHARE = 0.2  # size of the second parameter as an unknown, as a share of it
VALUE_SHARE = 0.05  # longest step in the value, as a share of its size


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
    z: Real  # (2 N + 1,) state and frequency on their way to another section
    tangent: Real  # (2 N + 1,) and a tangent
    r: Real  # (2 N,)
    J: Real  # (2 N, 2 N + 1)
    slopes: ConditionWork


def new_varied_work(problem: Varied, shooting: ShootingWork) -> VariedWork:
    """Scratch of a problem."""
    stops, size = problem.shooting.machine.direction.shape
    n = 2 * size
    return VariedWork(
        shooting=shooting,
        series=new_series_work(size),
        at=np.full(3, np.nan),
        gap=np.full((stops, 2), np.inf),
        z=np.zeros(n + 1),
        tangent=np.zeros(n + 1),
        r=np.zeros(n),
        J=np.zeros((n, n + 1)),
        slopes=new_condition_work(problem.series, problem.shooting.machine, problem.test),
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


@kernel(shared=True)
def varied_residual(
    problem: Varied, work: VariedWork, u: Real, value: float, r: Real, J: Real
) -> int:
    """r and J = [dr/du, dr/d value] of a motion, or of one where a test function is zero."""
    size, n, slopes = work.r.shape[0], r.shape[0], work.slopes
    # The loop's unknowns end with the value.
    omega, beside = frequency(problem, u[:n]), value_beside(problem, u[:n])
    if not stand_at(problem, work, value, beside):
        return status.NO_CONVERGENCE
    work.at[2] = omega
    shooting, flown = problem.shooting, work.shooting
    code = shooting_residual(shooting, flown, u[:size], omega, work.r, work.J)
    if code != status.OK:
        return code
    set_columns(problem.series, work.series, value, beside, slopes.columns)
    for i in range(size):
        r[i] = work.r[i]
        for k in range(size):
            J[i, k] = work.J[i, k]
        if n > size:
            J[i, size] = work.J[i, size]
    if n == size:
        field_columns(shooting, flown, omega, slopes)
        for i in range(size):
            J[i, n] = shooting.sign * slopes.fields[i, 0]
        return code
    return condition_row(problem, work, omega, r, J)


@kernel
def condition_row(problem: Varied, work: VariedWork, omega: float, r: Real, J: Real) -> int:
    """The test function of the motion just flown, its derivatives, and the state's in fields."""
    size, shooting, flown, slopes = work.r.shape[0], problem.shooting, work.shooting, work.slopes
    curve_columns(shooting, flown, omega, slopes)
    if problem.test == GRAZING:
        show_gaps(problem, work)
        r[size] = depth_slopes(shooting, flown, omega, problem.gap, slopes)
        open_gaps(problem)
    else:
        code, r[size] = critical_slopes(shooting, flown, omega, problem.test, work.J, slopes)
        if code != status.OK:
            return code
    # The columns: one field or both, the state, and omega last.
    last = slopes.row.shape[0] - 1
    fields = last - size
    for k in range(size):
        J[size, k] = slopes.row[fields + k]
    J[size, size] = slopes.row[last] if problem.omega == 0.0 else slopes.row[1]
    J[size, size + 1] = slopes.row[0]
    end = slopes.starts[flown.flow.segments[0]]
    for i in range(size):
        J[i, size + 1] = shooting.sign * end[i, 0]
        if problem.omega > 0.0:
            J[i, size] = shooting.sign * end[i, 1]
    return status.OK


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


@kernel(shared=True)
def varied_carried(problem: Varied, work: VariedWork, w: Real, tangent: Real, end: float) -> int:
    """Carry unknowns w and a tangent dw to another section."""
    size, n, shooting, flown = work.r.shape[0], w.shape[0] - 1, problem.shooting, work.shooting
    omega, value, beside = frequency(problem, w[:n]), float(w[n]), value_beside(problem, w[:n])
    if end == flown.section[0]:
        return status.OK
    if not omega > 0.0 or not stand_at(problem, work, value, beside):
        return status.NO_CONVERGENCE
    for k in range(size):
        work.z[k], work.tangent[k] = w[k], tangent[k]
    work.z[size], work.tangent[size] = omega, 0.0
    if problem.omega == 0.0:
        work.tangent[size] = tangent[size]
    # The next turn begins with the problem's sign.
    sign = 1.0 if end > flown.section[0] else shooting.sign
    code = section.carried(shooting, flown, work.z, work.tangent, end)
    if code != status.OK:
        return code
    set_columns(problem.series, work.series, value, beside, work.slopes.columns)
    field_columns(shooting, flown, omega, work.slopes)
    for k in range(size):
        w[k], tangent[k] = work.z[k], work.tangent[k]
        tangent[k] += sign * work.slopes.fields[k, 0] * tangent[n]
        if n > size and problem.omega > 0.0:
            tangent[k] += sign * work.slopes.fields[k, 1] * tangent[size]
    return code


@kernel
def varied_home(problem: Varied, work: VariedWork, w: Real, tangent: Real) -> int:
    """Carry unknowns w and a tangent dw to phase 0."""
    return varied_carried(problem, work, w, tangent, 0.0)
