"""Motions that never change their contacts: in closed form, so that no search can miss them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, islice, product

import numpy as np

from flipflow.compiled.arrays import Complex, Real
from flipflow.model.contact_law import LAWS, OPEN, shares
from flipflow.model.elements import ClearanceSpring
from flipflow.model.system import MechanicalSystem

MOST_STATES = 4096  # contact states that are tried, those with few springs engaged first


def one_state_motions(system: MechanicalSystem, omega: float) -> list[Real]:
    r"""States (x, x') at t = 0 of every motion that stays in one contact state, (2 N,) each.

    With all springs that are engaged on their sides s_j,

    .. math:: x = x_0 + \mathrm{Re}(X e^{i \omega t}), \quad
              (K + \sum_j k_j d_j d_j^T) x_0 = \sum_j s_j k_j e_j d_j,

    and X as of the linear machine. The motion holds where no switching function falls to zero over
    the turn.
    """
    linear = system.with_bonded()
    found = []
    for regimes in islice(_contact_states(linear), MOST_STATES):
        try:
            rest, X = _linear_motion(linear, regimes, omega)
        except np.linalg.LinAlgError:
            continue
        if all(
            _stays(
                spring, regime, float(spring.direction @ rest), complex(spring.direction @ X), omega
            )
            for spring, regime in zip(linear.springs, regimes, strict=True)
        ):
            found.append(np.concatenate([rest + X.real, (1j * omega * X).real]))
    return found


def _contact_states(system: MechanicalSystem) -> Iterator[tuple[int, ...]]:
    """Regimes (m,) of the springs: all open, then those with more and more of them engaged.

    A stop pushes towards the middle. Where K alone does so too, no stop is engaged all the time.
    """
    count = len(system.springs)
    yield (OPEN,) * count
    if np.linalg.eigvalsh(system.K)[0] > 0.0:
        return
    ways = [_engaged(spring) for spring in system.springs]
    for engaged in range(1, count + 1):
        for which in combinations(range(count), engaged):
            for chosen in product(*(ways[j] for j in which)):
                regimes = [OPEN] * count
                for j, regime in zip(which, chosen, strict=True):
                    regimes[j] = regime
                yield tuple(regimes)


def _engaged(spring: ClearanceSpring) -> list[int]:
    """Regimes in which a spring pushes, on the sides that it has."""
    sides = [side for side, gap in zip((1, -1), spring.gaps, strict=True) if np.isfinite(gap)]
    pieces = range(1, len(LAWS[spring.law]) + 1)
    return [s * q for s in sides for q in pieces if shares(spring.law, q)[0] != 0.0]


def _linear_motion(
    system: MechanicalSystem, regimes: tuple[int, ...], omega: float
) -> tuple[Real, Complex]:
    """x_0 and X of a contact state."""
    K, C, push = system.K.copy(), system.C.copy(), np.zeros(system.size)
    for spring, regime in zip(system.springs, regimes, strict=True):
        if regime == OPEN:
            continue
        f_k, f_c = shares(spring.law, regime)
        d = spring.direction
        K += f_k * spring.stiffness * np.outer(d, d)
        C += f_c * spring.damping * np.outer(d, d)
        push += f_k * spring.stiffness * _gap(spring, regime) * np.sign(regime) * d
    force = system.excitation.vector * omega**system.excitation.power
    Z = K - omega**2 * system.M + 1j * omega * C
    return np.asarray(np.linalg.solve(K, push)), np.asarray(np.linalg.solve(Z, force))


def _gap(spring: ClearanceSpring, regime: int) -> float:
    return spring.gaps[0] if regime > OPEN else spring.gaps[1]


def _stays(
    spring: ClearanceSpring, regime: int, rest: float, amplitude: complex, omega: float
) -> bool:
    """Whether a spring at rest + Re(amplitude exp(i omega t)) never leaves its regime."""
    if regime == OPEN:
        size = abs(amplitude)
        return rest + size <= spring.gaps[0] and rest - size >= -spring.gaps[1]
    depth = abs(rest) - _gap(spring, regime)
    if rest * regime <= 0.0 or depth < abs(amplitude):
        return False
    for way in LAWS[spring.law][abs(regime) - 1].exits:
        alpha = way.a + way.a_k * spring.stiffness
        beta = way.b + way.b_c * spring.damping
        if alpha * depth < abs(amplitude) * abs(alpha + 1j * omega * beta):
            return False
    return True
