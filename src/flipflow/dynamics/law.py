"""The contact law in kernels: what :mod:`flipflow.model.contact_law` tabulates, spring by spring.

A regime is 0 for an open spring, +q or -q for piece q of its law on the plus or minus side.
"""

from __future__ import annotations

from typing import NamedTuple

from flipflow.compiled.arrays import Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.model.contact_law import (
    ENTRY,
    EXITS,
    FORCE,
    KIND,
    MOST_EXITS,
    MOST_PIECES,
    NO_EXIT,
    OPEN,
    TARGET,
    WHOLE,
)


@by_reference
class Stops(NamedTuple):
    """Laws and numbers of m springs."""

    law: Int  # (m,) number of the law
    stiffness: Real  # (m,)
    damping: Real  # (m,)
    gap: Real  # (m, 2) plus and minus side


@kernel(inline=True)
def stiffness_share(stops: Stops, j: int, regime: int) -> float:
    """f_k of spring j in a regime."""
    return FORCE[stops.law[j], abs(regime), 0]


@kernel(inline=True)
def damping_share(stops: Stops, j: int, regime: int) -> float:
    """f_c of spring j in a regime."""
    return FORCE[stops.law[j], abs(regime), 1]


@kernel(inline=True)
def kind(stops: Stops, j: int, regime: int) -> int:
    """Number of the regime's force law: 0 without force, the same on both sides."""
    return KIND[stops.law[j], abs(regime)]


@kernel(inline=True)
def signed_gap(stops: Stops, j: int, regime: int) -> float:
    """Position of the gap on the regime's side: e+ or -e-."""
    return stops.gap[j, 0] if regime > OPEN else -stops.gap[j, 1]


@kernel(inline=True)
def force(stops: Stops, j: int, regime: int, y: float, v: float) -> float:
    """H of spring j in a regime at position y and rate v."""
    f_k, f_c = stiffness_share(stops, j, regime), damping_share(stops, j, regime)
    if f_k == 0.0 and f_c == 0.0:
        return 0.0
    depth = y - signed_gap(stops, j, regime)
    return f_k * stops.stiffness[j] * depth + f_c * stops.damping[j] * v


@kernel(inline=True)
def spring_force(stops: Stops, j: int, regime: int, y: float) -> float:
    """What of the force the spring alone carries in a regime at position y: the rest is damping."""
    f_k = min(stiffness_share(stops, j, regime), 1.0)
    if f_k == 0.0:
        return 0.0
    return f_k * stops.stiffness[j] * (y - signed_gap(stops, j, regime))


@kernel(inline=True)
def stored_energy(stops: Stops, j: int, regime: int, y: float) -> float:
    """Energy in J that spring j holds in a regime at position y; 2 k p holds no more than k p."""
    if stiffness_share(stops, j, regime) == 0.0:
        return 0.0
    depth = y - signed_gap(stops, j, regime)
    return 0.5 * spring_force(stops, j, regime, y) * depth


@kernel(inline=True)
def entered(stops: Stops, j: int) -> int:
    """The piece with which spring j is entered at the gap."""
    return ENTRY[stops.law[j]] if stops.damping[j] > 0.0 else WHOLE


@kernel(inline=True)
def exit_of(stops: Stops, j: int, regime: int, e: int) -> tuple[float, float, int]:
    """Exit e of a regime, where h = alpha p + beta p' falls through zero: alpha, beta, next regime.

    The next regime is NO_EXIT where there is no such exit. With alpha = 1 and beta = 0 the exit
    stands at the gap.
    """
    law, piece = stops.law[j], abs(regime)
    target = TARGET[law, piece, e]
    if stops.damping[j] == 0.0:
        # Without damping the force falls to zero at the gap and not before: the spring opens.
        return (1.0, 0.0, OPEN) if e == 0 else (0.0, 0.0, NO_EXIT)
    if target == NO_EXIT:
        return 0.0, 0.0, NO_EXIT
    alpha = EXITS[law, piece, e, 0] + EXITS[law, piece, e, 1] * stops.stiffness[j]
    beta = EXITS[law, piece, e, 2] + EXITS[law, piece, e, 3] * stops.damping[j]
    return alpha, beta, target


@kernel(inline=True)
def exit_between(
    stops: Stops, j: int, before: int, after: int
) -> tuple[float, float, float, float]:
    """h = alpha p + beta p' of a change that has happened: alpha, beta, d alpha/dk, d beta/dc."""
    if before * after != 0:
        law, piece = stops.law[j], abs(before)
        for e in range(MOST_EXITS):
            alpha, beta, target = exit_of(stops, j, before, e)
            if target == abs(after):
                return alpha, beta, EXITS[law, piece, e, 1], EXITS[law, piece, e, 3]
    return 1.0, 0.0, 0.0, 0.0


@kernel(inline=True)
def regime_at(stops: Stops, j: int, y: float, v: float) -> int:
    """Regime of spring j at position y and rate v; exactly at the gap the rate decides."""
    plus, minus = stops.gap[j, 0], stops.gap[j, 1]
    if y > plus or (y == plus and v > 0.0):
        side = 1
    elif y < -minus or (y == -minus and v < 0.0):
        side = -1
    else:
        return OPEN
    depth, rate = side * (y - signed_gap(stops, j, side)), side * v
    piece = entered(stops, j)
    for _ in range(MOST_PIECES):
        for e in range(MOST_EXITS):
            alpha, beta, target = exit_of(stops, j, piece, e)
            if target > OPEN and alpha * depth + beta * rate < 0.0:
                piece = target
    return side * piece


@kernel(inline=True)
def tangent_kick(stops: Stops, j: int, before: int, after: int) -> float:
    """Sign of c M^-1 d d^T in the saltation of a change of regime.

    At the gap the force jumps by the change of f_c c p', which kicks the tangent. From piece
    to piece on one side of the gap the force does not jump, and the tangent is not kicked.
    """
    if before * after != 0:
        return 0.0
    return damping_share(stops, j, before) - damping_share(stops, j, after)
