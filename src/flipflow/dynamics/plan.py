"""A machine flattened into arrays: the modes of every contact configuration.

A configuration says of each spring whether it is open, engaged on its plus side or on its minus
side; within one the machine is linear. ``slot`` maps the configuration's code (base 3, one digit a
spring: 0 open, 1 plus, 2 minus) to its row in the tables, -1 where it has not been prepared.

With the state z = (x, x'), right and left vectors v_i and l_i of the configuration's matrix A,

    exp(A t) = Re sum_i weight_i v_i exp(rate_i t) l_i,

one term for a conjugate pair (weight 2) and one for a real eigenvalue (weight 1), so that
overdamped machines need no special case.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
Int = NDArray[np.int64]


class Plan(NamedTuple):
    """N degrees of freedom, m springs, S prepared configurations of up to R modes."""

    slot: Int  # (3**m,)
    mode_count: Int  # (S,) number of modes
    rate: Complex  # (S, R) eigenvalues in 1/s
    weight: Real  # (S, R)
    right: Complex  # (S, 2 N, R) v_i as columns
    left: Complex  # (S, R, 2 N) l_i as rows
    rest: Real  # (S, 2 N) where the configuration would stand still
    force: Complex  # (S, R) l_i (0, M^-1 f) with f the force vector
    force_conj: Complex  # (S, R) the same for the conjugate mode
    gap_shape: Complex  # (S, m, R) d_j phi_i: modes seen at the gaps
    gap_pick: Complex  # (R, m) l_i (0, M^-1 d_j) of the open configuration
    direction: Real  # (m, N) d_j
    kick: Real  # (m, N) c_j M^-1 d_j: what a velocity jump in the force does
    stiffness: Real  # (m,)
    damping: Real  # (m,)
    gap_plus: Real  # (m,)
    gap_minus: Real  # (m,)
    clipped: Int  # (m,) 1 for the compression-only law
    power: int  # the force grows with omega to this power: 2 unbalance, 0 constant
