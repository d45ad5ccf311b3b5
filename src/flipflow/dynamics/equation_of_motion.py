"""A machine as arrays, solved for its accelerations, as kernels take it."""

from __future__ import annotations

from typing import NamedTuple

from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.dynamics.law import Stops


@by_reference
class MachineArrays(NamedTuple):
    """x'' = static - stiffness x - damping x' - sum_j reach_j H_j + sum_e Re(F_e e^(i n omega t)).

    F_e = push_e omega^power_e turns n = order[wave_e] times as fast as omega. N degrees of freedom,
    m springs, E excitations at W multiples of omega. Pure data: kernels write nothing here, but for
    ``set_machine``, by which a series rewrites the machine that is its own.
    """

    stiffness: Real  # (N, N) M^-1 K
    damping: Real  # (N, N) M^-1 C
    direction: Real  # (m, N) d_j
    reach: Real  # (m, N) M^-1 d_j
    static: Real  # (N,) M^-1 f_0
    push: Complex  # (E, N) M^-1 f
    power: Int  # (E,) the force grows with omega to this power: 2 unbalance, 0 constant
    wave: Int  # (E,) place of its multiple in ``order``
    order: Int  # (W,) multiples of omega, rising
    stops: Stops
