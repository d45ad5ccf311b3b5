"""How a frame of small disturbances grows from forcing period to forcing period.

A motion is carried by the exact flow and a frame of 2 N tangents with it, saltation at contacts
included. From time to time the frame is made orthonormal again, column by column; the logarithms of
the lengths that this takes away add up to the growth (Benettin et al., Meccanica 15 (1980) 9-20).
Lengths are those of displacements and of velocities over omega.
"""

from __future__ import annotations

import math

from flipflow.compiled import status
from flipflow.compiled.arrays import Real
from flipflow.compiled.compile import kernel
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.flow import Flow, carry_tangent, run_flow
from flipflow.dynamics.law import kind
from flipflow.periodic.shooting import ShootingWork

# A column that loses more of its length than this to the columns before it has lost digits, too.
LEAST_SHARE = 1e-4


@kernel(entry=True)
def grow(
    machine: MachineArrays,
    work: ShootingWork,
    omega: float,
    parts: int,
    z: Real,
    frame: Real,
    growth: Real,
    states: Real,
    touched: Real,
) -> int:
    """Carry z (2 N,) and its orthonormal frame (2 N, 2 N) over P forcing periods.

    ``growth`` (P, 2 N) becomes the logarithm by which each column has grown in each period,
    ``states`` (P, 2 N) the states after them; ``touched`` (m,) gains the time in s for which each
    spring carried a force. The frame is made orthonormal ``parts`` times a period; SINGULAR says
    that this is not often enough.
    """
    flow, size = work.flow, z.shape[0]
    length = 2.0 * math.pi / omega / parts
    for k in range(size):
        flow.z[k] = z[k]
    for p in range(growth.shape[0]):
        for c in range(size):
            growth[p, c] = 0.0
        for part in range(parts):
            code = run_flow(machine, flow, omega, part * length, length, work.rate)
            if code != status.OK:
                return code
            add_touches(machine, flow, touched)
            carry_tangent(machine, flow, frame, 0.0, work.columns)
            if not orthonormal(frame, omega, growth, p):
                return status.SINGULAR
        for k in range(size):
            states[p, k] = flow.z[k]
            if not math.isfinite(flow.z[k]):
                return status.NOT_FINITE
    for k in range(size):
        z[k] = flow.z[k]
    return status.OK


@kernel(inline=True)
def add_touches(machine: MachineArrays, flow: Flow, touched: Real) -> None:
    """Add the times for which springs carry a force in the recorded flow."""
    for e in range(flow.segments[0]):
        for j in range(touched.shape[0]):
            if kind(machine.stops, j, flow.regimes[e, j]) != 0:
                touched[j] += flow.length[e]


@kernel(inline=True)
def orthonormal(frame: Real, omega: float, growth: Real, p: int) -> bool:
    """Make the frame orthonormal, and add the logarithms of the lengths to row p of ``growth``.

    Gram and Schmidt's way, each column twice, after which it is orthogonal to rounding. False where
    a column is so close to those before it that its length is lost in rounding.
    """
    for c in range(frame.shape[1]):
        before = inner(frame, c, c, omega)
        for _ in range(2):
            for b in range(c):
                share = inner(frame, b, c, omega)
                for k in range(frame.shape[0]):
                    frame[k, c] -= share * frame[k, b]
        after = inner(frame, c, c, omega)
        if not after > LEAST_SHARE * LEAST_SHARE * before:
            return False
        length = math.sqrt(after)
        growth[p, c] += math.log(length)
        for k in range(frame.shape[0]):
            frame[k, c] /= length
    return True


@kernel(inline=True)
def inner(frame: Real, b: int, c: int, omega: float) -> float:
    """Inner product of two columns of states (x, x' / omega)."""
    n = frame.shape[0] // 2
    places, rates = 0.0, 0.0
    for k in range(n):
        places += frame[k, b] * frame[k, c]
        rates += frame[n + k, b] * frame[n + k, c]
    return places + rates / (omega * omega)
