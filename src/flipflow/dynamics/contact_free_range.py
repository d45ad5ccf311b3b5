r"""How far up in frequency a machine moves without meeting a stop, certified by its modes.

At the gap j an excitation gives the motion without contact the complex amplitude
:math:`\omega^p S_j(\omega)` with

.. math:: S_j(\omega) = \sum_i \frac{a_{ij}}{i n \omega - \lambda_i}

over the modes of the open machine. Between two frequencies a distance h apart it is at most

.. math:: |S_j| \le \max(|S_j(\text{low})|, |S_j(\text{high})|) + \frac{h^2}{8} \max |S_j''|, \qquad
    |S_j''| \le \sum_i \frac{2 n^2 |a_{ij}|}{\min |i n \omega - \lambda_i|^3}.

The search takes steps as long as the sum of these bounds over all excitations stays below what the
rest leaves of the gap.
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


@kernel
def is_contact_free_below(machine: MachineArrays, modes: Modes, omega: float) -> bool:
    """Whether no motion without contact meets a gap up to ``omega``; soon told where one does."""
    if modes.ready[0] == 0:
        prepare(machine, modes, 0)
    if modes.ready[0] != 1 or not _stays_below(machine, modes, omega, omega, True):
        return False
    return contact_free_up_to(machine, modes, omega) == omega


@kernel(inline=True)
def _stays_below(
    machine: MachineArrays, modes: Modes, low: float, high: float, only_there: bool
) -> bool:
    """Whether motions between two frequencies stay below all gaps, or only that at the high one."""
    for j in range(machine.direction.shape[0]):
        reach, rest = 0.0, 0.0
        for k in range(machine.direction.shape[1]):
            if modes.drift[0, k] != 0.0:
                return False
            rest += machine.direction[j, k] * modes.static[0, k]
        for e in range(machine.power.shape[0]):
            most = _size(machine, modes, e, j, high)
            if not only_there:
                curved = _curvature(machine, modes, e, j, low, high)
                most = max(most, _size(machine, modes, e, j, low))
                most += 0.125 * (high - low) ** 2 * curved
            reach += most * high ** machine.power[e]
        if not reach < min(machine.stops.gap[j, 0] - rest, machine.stops.gap[j, 1] + rest):
            return False
    return True


@kernel(inline=True)
def _size(machine: MachineArrays, modes: Modes, e: int, j: int, omega: float) -> float:
    """|S_j| of excitation e."""
    total, turning = 0j, 1j * (machine.order[machine.wave[e]] * omega)
    for i in range(modes.mode_count[0]):
        rate, shape = modes.rate[0, i], modes.gap_shape[0, j, i]
        total += shape * modes.force[0, e, i] * reciprocal(turning - rate)
        if modes.weight[0, i] == 2.0:
            gap = reciprocal(turning - rate.conjugate())
            total += shape.conjugate() * modes.force_conj[0, e, i] * gap
    return modulus(total)


@kernel(inline=True)
def _curvature(
    machine: MachineArrays, modes: Modes, e: int, j: int, low: float, high: float
) -> float:
    """A bound on |S_j''| of excitation e between two frequencies."""
    total, order = 0.0, float(machine.order[machine.wave[e]])
    for i in range(modes.mode_count[0]):
        rate, shape = modes.rate[0, i], modulus(modes.gap_shape[0, j, i])
        beside = max(order * low - rate.imag, rate.imag - order * high, 0.0)
        near = math.hypot(rate.real, beside)
        total += 2.0 * shape * modulus(modes.force[0, e, i]) / near**3
        if modes.weight[0, i] == 2.0:
            away = math.hypot(rate.real, order * low + rate.imag)
            total += 2.0 * shape * modulus(modes.force_conj[0, e, i]) / away**3
    return order**2 * total
