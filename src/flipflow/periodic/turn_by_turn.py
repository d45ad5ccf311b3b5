"""Many motions (lanes) of one machine, run turn after turn until a known motion catches them."""

from __future__ import annotations

import math

from flipflow.compiled import status
from flipflow.compiled.arrays import Int, Real
from flipflow.compiled.compile import kernel
from flipflow.dynamics.flow import run_flow
from flipflow.periodic.shooting import Shooting, ShootingWork

NOT_SETTLED = -1  # label of a lane that nothing has caught


@kernel
def next_turn(problem: Shooting, work: ShootingWork, omega: float) -> int:
    """Carry flow.z over the problem's part of a turn, with its sign."""
    duration = problem.fraction * 2.0 * math.pi / omega
    code = run_flow(problem.machine, work.flow, omega, 0.0, duration, work.rate)
    for k in range(work.flow.z.shape[0]):
        work.flow.z[k] *= problem.sign
        if code == status.OK and not math.isfinite(work.flow.z[k]):
            code = status.NOT_FINITE
    return code


@kernel
def finish_turn(problem: Shooting, work: ShootingWork, omega: float, begin: float) -> int:
    """Carry flow.z from time ``begin`` to the end of the turn; at the start of it, nothing."""
    flow = work.flow
    for k in range(flow.z.shape[0]):
        if not math.isfinite(flow.z[k]):
            return status.NOT_FINITE
    if begin == 0.0:
        return status.OK
    duration = 2.0 * math.pi / omega - begin
    return run_flow(problem.machine, flow, omega, begin, duration, work.rate)


@kernel(entry=True)
def settle_lanes(
    problem: Shooting,
    work: ShootingWork,
    states: Real,
    begin: Real,
    omega: float,
    centre: Real,
    form: Real,
    owner: Int,
    most: int,
    record: Real,
    label: Int,
    turns: Int,
    code: Int,
) -> None:
    """Run every state (L, 2 N) until it is caught: label (L,) is the owner of what caught it.

    Each state holds at its time ``begin`` (L,) within the first turn, and is first carried to the
    end of that turn. Motion a catches what lies within (z - centre_a)^T form_a (z - centre_a) <= 1
    at the end of a turn. A lane that nothing catches within ``most`` turns keeps the label
    NOT_SETTLED. States end where they were caught; those after 1, 2, ... turns, a Poincare section,
    stand in ``record`` (L, T, 2 N) as far as it goes.
    """
    flow = work.flow
    for lane in range(states.shape[0]):
        for k in range(states.shape[1]):
            flow.z[k] = states[lane, k]
        turns[lane] = 0
        label[lane] = NOT_SETTLED
        code[lane] = finish_turn(problem, work, omega, begin[lane])
        if code[lane] == status.OK:
            label[lane] = caught(flow.z, centre, form, owner)
        while code[lane] == status.OK and label[lane] == NOT_SETTLED and turns[lane] < most:
            code[lane] = next_turn(problem, work, omega)
            if code[lane] != status.OK:
                break
            if turns[lane] < record.shape[1]:
                for k in range(states.shape[1]):
                    record[lane, turns[lane], k] = flow.z[k]
            turns[lane] += 1
            label[lane] = caught(flow.z, centre, form, owner)
        for k in range(states.shape[1]):
            states[lane, k] = flow.z[k]


@kernel
def caught(z: Real, centre: Real, form: Real, owner: Int) -> int:
    """Owner of the first motion whose neighbourhood holds z, or NOT_SETTLED."""
    size = z.shape[0]
    for a in range(centre.shape[0]):
        value = 0.0
        for i in range(size):
            row = 0.0
            for j in range(size):
                row += form[a, i, j] * (z[j] - centre[a, j])
            value += row * (z[i] - centre[a, i])
            if not math.isfinite(value):
                value = math.inf
                break
        if value <= 1.0:
            return int(owner[a])
    return NOT_SETTLED
