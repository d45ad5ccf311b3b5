r"""How far up in frequency a machine moves without meeting a stop, certified by its modes.

At the gap j the motion without contact has the complex amplitude :math:`\omega^p S_j(\omega)` with

.. math:: S_j(\omega) = \sum_i \frac{a_{ij}}{i \omega - \lambda_i}

over the modes of the open machine. Between two frequencies a distance h apart it is at most

.. math:: |S_j| \le \max(|S_j(\text{low})|, |S_j(\text{high})|) + \frac{h^2}{8} \max |S_j''|, \qquad
    |S_j''| \le \sum_i \frac{2 |a_{ij}|}{\min |i \omega - \lambda_i|^3}.

The search takes steps as long as this bound stays below the gap.
"""

from __future__ import annotations

import math

from flipflow.compiled.compile import kernel
from flipflow.dynamics.contact_search import modulus, reciprocal
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.modes import Modes, prepare

FINEST = 1.0 / 2000.0  # share of the highest frequency below which a step needs no certificate
NEAR_ZERO = 1e-3  # share of such a step down to which a motion without contact is looked for


@kernel(entry=True)
def contact_free_up_to(machine: MachineArrays, modes: Modes, omega: float) -> float:
    """The highest frequency up to ``omega`` below which no motion without contact meets a gap.

    It is less than ``omega`` by steps of FINEST at most, and 0 where there is no such motion.
    Without modes nothing is known of contact, and it is ``omega``.
    """
    if modes.ready[0] == 0:
        prepare(machine, modes, 0)
    if modes.ready[0] != 1:
        return omega
    free, step, finest = 0.0, omega, FINEST * omega
    while free < omega:
        end = min(free + step, omega)
        small = step <= finest
        if _stays_below(machine, modes, free, end, small):
            free = end
            step *= 2.0
        elif small and (free > 0.0 or step <= NEAR_ZERO * finest):
            return free
        else:
            step *= 0.5
    return free


@kernel(inline=True)
def _stays_below(
    machine: MachineArrays, modes: Modes, low: float, high: float, only_there: bool
) -> bool:
    """Whether motions between two frequencies stay below all gaps, or only that at the high one."""
    scale = high**machine.power
    for j in range(machine.direction.shape[0]):
        most = _size(modes, j, high)
        if not only_there:
            curved = _curvature(modes, j, low, high)
            most = max(most, _size(modes, j, low)) + 0.125 * (high - low) ** 2 * curved
        if not most * scale < min(machine.stops.gap[j, 0], machine.stops.gap[j, 1]):
            return False
    return True


@kernel(inline=True)
def _size(modes: Modes, j: int, omega: float) -> float:
    """|S_j|."""
    total = 0j
    for i in range(modes.mode_count[0]):
        rate, shape = modes.rate[0, i], modes.gap_shape[0, j, i]
        total += shape * modes.force[0, i] * reciprocal(1j * omega - rate)
        if modes.weight[0, i] == 2.0:
            gap = reciprocal(1j * omega - rate.conjugate())
            total += shape.conjugate() * modes.force_conj[0, i] * gap
    return modulus(total)


@kernel(inline=True)
def _curvature(modes: Modes, j: int, low: float, high: float) -> float:
    """A bound on |S_j''| between two frequencies."""
    total = 0.0
    for i in range(modes.mode_count[0]):
        rate, shape = modes.rate[0, i], modulus(modes.gap_shape[0, j, i])
        beside = max(low - rate.imag, rate.imag - high, 0.0)
        total += 2.0 * shape * modulus(modes.force[0, i]) / math.hypot(rate.real, beside) ** 3
        if modes.weight[0, i] == 2.0:
            away = math.hypot(rate.real, low + rate.imag)
            total += 2.0 * shape * modulus(modes.force_conj[0, i]) / away**3
    return total
