"""Motions that never change their contacts: in closed form, so that no search can miss them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np

from flipflow.compiled.arrays import Complex, Real
from flipflow.dynamics.contact_free import span
from flipflow.model.contact_law import LAWS, OPEN, shares
from flipflow.model.elements import ClearanceSpring
from flipflow.model.static_rest import MOST_STATES, engaged_sides, rest_of, signed_gap_of
from flipflow.model.system import MechanicalSystem


def one_state_motions(system: MechanicalSystem, omega: float) -> list[Real]:
    r"""States (x, x') at t = 0 of every motion that stays in one contact state, (2 N,) each.

    With all springs that are engaged on their sides s_j,

    .. math:: x = x_0 + \mathrm{Re} \sum_n X_n e^{i n \omega t}, \quad
              (K + \sum_j k_j d_j d_j^T) x_0 = f_0 + \sum_j s_j k_j e_j d_j,

    and X_n as of the linear machine. The motion holds where no switching function falls to zero
    over the turn.
    """
    linear = system.with_bonded()
    found = []
    for regimes in islice(_contact_states(linear), MOST_STATES):
        motion = _linear_motion(linear, regimes, omega)
        if motion is None or not np.isfinite(motion[1]).all():
            continue
        rest, X = motion
        if _holds(linear, regimes, rest, X, omega):
            found.append(state_of(linear, rest, X, omega))
    return found


def contact_free_motion(system: MechanicalSystem, omega: float) -> tuple[Real, Complex]:
    """Mean (N,) and harmonics (W, N) of the motion with all springs open, touching or not.

    NaN where an undamped mode resonates, and where nothing holds it against a constant force.
    """
    motion = _linear_motion(system, (OPEN,) * len(system.springs), omega)
    if motion is not None:
        return motion
    shape = len(system.orders), system.size
    return np.zeros(system.size), np.full(shape, np.nan, np.complex128)


def touches_nothing(system: MechanicalSystem, rest: Real, X: Complex) -> bool:
    """Whether a motion of mean (N,) and harmonics (W, N) stays within all gaps."""
    return _holds(system, (OPEN,) * len(system.springs), rest, X, 0.0)


def state_of(system: MechanicalSystem, rest: Real, X: Complex, omega: float) -> Real:
    """State (x, x') at t = 0 of a motion of mean (N,) and harmonics (W, N), (2 N,)."""
    orders = system.orders
    z = (np.array([[1.0] * len(orders), [1j * omega * n for n in orders]]) @ X).real
    z[0] += rest
    return np.asarray(z.ravel())


def _contact_states(system: MechanicalSystem) -> Iterator[tuple[int, ...]]:
    """Regimes (m,) of the springs: all open, then those with more and more of them engaged.

    A stop pushes towards the middle. Where K alone does so too, and no constant force or preload
    pushes against it, no stop is engaged all the time.
    """
    loose = all(min(spring.gaps) >= 0.0 for spring in system.springs)
    unforced = not system.constant_force.any()
    if loose and unforced and np.linalg.eigvalsh(system.K + system.K.T)[0] > 0.0:
        return iter([(OPEN,) * len(system.springs)])
    return engaged_sides(system.springs, [_engaged(spring) for spring in system.springs])


def _engaged(spring: ClearanceSpring) -> list[int]:
    """Regimes in which a spring pushes, on the sides that it has."""
    sides = [side for side, gap in zip((1, -1), spring.gaps, strict=True) if np.isfinite(gap)]
    pieces = range(1, len(LAWS[spring.law]) + 1)
    return [s * q for s in sides for q in pieces if shares(spring.law, q)[0] != 0.0]


def _linear_motion(
    system: MechanicalSystem, regimes: tuple[int, ...], omega: float
) -> tuple[Real, Complex] | None:
    """x_0 (N,) and X (W, N) of a contact state; None where nothing holds it, NaN in resonance."""
    rest = rest_of(system.K, system.springs, regimes, system.constant_force)
    if rest is None:
        return None
    K, C = system.K.copy(), system.C.copy()
    for spring, regime in zip(system.springs, regimes, strict=True):
        if regime != OPEN:
            f_k, f_c = shares(spring.law, regime)
            outer = np.outer(spring.direction, spring.direction)
            K += f_k * spring.stiffness * outer
            C += f_c * spring.damping * outer
    found = []
    for order in system.orders:
        w, force = order * omega, system.force(omega, order)
        try:
            found.append(np.linalg.solve(K - w**2 * system.M + 1j * w * C, force))
        except np.linalg.LinAlgError:
            found.append(np.full(system.size, np.nan, np.complex128))
    return rest, np.array(found)


def _holds(
    system: MechanicalSystem, regimes: tuple[int, ...], rest: Real, X: Complex, omega: float
) -> bool:
    """Whether no spring leaves its regime in a motion of mean (N,) and harmonics (W, N)."""
    for spring, regime in zip(system.springs, regimes, strict=True):
        y, A = float(spring.direction @ rest), X @ spring.direction
        if not _stays(spring, regime, y, A, system.orders, omega):
            return False
    return True


def _stays(
    spring: ClearanceSpring,
    regime: int,
    rest: float,
    A: Complex,
    orders: tuple[int, ...],
    omega: float,
) -> bool:
    """Whether a spring at rest + Re sum_n A_n exp(i n omega t) never leaves its regime."""
    low, high = span(orders, A)
    if regime == OPEN:
        return rest + high <= spring.gaps[0] and rest + low >= -spring.gaps[1]
    side = 1.0 if regime > OPEN else -1.0
    depth = side * (rest - signed_gap_of(spring, regime))
    if depth + span(orders, side * A)[0] < 0.0:
        return False
    turning = 1j * omega * np.array(orders)
    for way in LAWS[spring.law][abs(regime) - 1].exits:
        alpha = way.a + way.a_k * spring.stiffness
        beta = way.b + way.b_c * spring.damping
        if alpha * depth + span(orders, side * A * (alpha + beta * turning))[0] < 0.0:
            return False
    return True
