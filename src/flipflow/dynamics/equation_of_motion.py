"""A machine as arrays, solved for its accelerations, as kernels take it."""

from __future__ import annotations

from typing import NamedTuple

from flipflow.compiled.arrays import Complex, Real
from flipflow.dynamics.law import Stops


class MachineArrays(NamedTuple):
    """x'' = -stiffness x - damping x' - sum_j reach_j H_j + Re(push omega^power e^(i omega t)).

    N degrees of freedom, m springs. Pure data: kernels write nothing here, but for ``set_machine``,
    by which a series rewrites the machine that is its own.
    """

    stiffness: Real  # (N, N) M^-1 K
    damping: Real  # (N, N) M^-1 C
    direction: Real  # (m, N) d_j
    reach: Real  # (m, N) M^-1 d_j
    push: Complex  # (N,) M^-1 f
    power: int  # the force grows with omega to this power: 2 unbalance, 0 constant
    stops: Stops
