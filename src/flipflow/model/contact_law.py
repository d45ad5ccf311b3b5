r"""The contact laws, as a table of pieces: force, when a piece is left, energy.

With p the penetration, positive in contact, and p' its rate, a stop of stiffness k and damping c
carries in each piece of its law the force

.. math:: H = f_k k p + f_c c p',

and leaves the piece when a switching function

.. math:: h = (a + a_k k) p + (b + b_c c) p'

falls through zero. Between two changes the machine is therefore linear, whatever the law. A
regime is a piece with its side: 0 open, q or -q piece q on the plus or minus side. A side is
entered at the gap, with the piece that holds at p = 0 and p' > 0; there the force jumps by
f_c c p'. From piece to piece it does not jump: what two pieces differ by vanishes with the h
between them. Without damping every law is k p down to the gap, which piece 1 is.

=================  ==================================  ==========================================
law                force in contact                    source
=================  ==================================  ==========================================
paper              k p + c p', pulls before release    Lin et al., Minerals 14 (2024) 406, Eq. (2)
compression-only   max(0, k p + c p')                  the same, its pull cut off
undamped-rebound   k p + c max(0, p')                  Simscape's stop with undamped rebound
elasto-gap         k p + clip(c p', -k p, k p)         ElastoGap of Modelica's standard library
=================  ==================================  ==========================================
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow.compiled.arrays import Int, Real

ContactLaw = Literal["paper", "compression-only", "undamped-rebound", "elasto-gap"]
OPEN, WHOLE, NO_EXIT = 0, 1, -1  # piece 1 of every law carries all of k p + c p'


@dataclass(frozen=True)
class Exit:
    """A switching function h = (a + a_k k) p + (b + b_c c) p', and the piece that follows it."""

    to: int
    a: float = 0.0
    a_k: float = 0.0
    b: float = 0.0
    b_c: float = 0.0


@dataclass(frozen=True)
class Piece:
    """Shares of k p and c p' in the force of one piece, and how it is left."""

    stiffness: float
    damping: float
    exits: tuple[Exit, ...]


AT_THE_GAP = Exit(OPEN, a=1.0)
LAWS: dict[str, tuple[Piece, ...]] = {
    "paper": (Piece(1.0, 1.0, (AT_THE_GAP,)),),
    # Its force is gone before it reaches the gap, and returns where it would push again.
    "compression-only": (
        Piece(1.0, 1.0, (Exit(2, a_k=1.0, b_c=1.0),)),
        Piece(0.0, 0.0, (AT_THE_GAP, Exit(1, a_k=-1.0, b_c=-1.0))),
    ),
    # Its damper acts on the way in, and again where the way out turns back inwards.
    "undamped-rebound": (
        Piece(1.0, 1.0, (Exit(2, b=1.0),)),
        Piece(1.0, 0.0, (AT_THE_GAP, Exit(1, b=-1.0))),
    ),
    # Its damper never carries more than its spring: both are equal after entry, and cancel at last.
    "elasto-gap": (
        Piece(1.0, 1.0, (Exit(3, a_k=1.0, b_c=1.0), Exit(2, a_k=1.0, b_c=-1.0))),
        Piece(2.0, 0.0, (Exit(1, a_k=-1.0, b_c=1.0),)),
        Piece(0.0, 0.0, (AT_THE_GAP, Exit(1, a_k=-1.0, b_c=-1.0))),
    ),
}
NUMBER = {name: number for number, name in enumerate(get_args(ContactLaw))}

MOST_PIECES = max(map(len, LAWS.values()))
MOST_EXITS = max(len(piece.exits) for pieces in LAWS.values() for piece in pieces)


def _entered(pieces: tuple[Piece, ...]) -> int:
    """The piece that holds just inside the gap on the way in, p = 0 and p' > 0, with damping."""
    q = WHOLE
    for _ in pieces:
        q = next((way.to for way in pieces[q - 1].exits if way.b + way.b_c < 0.0), q)
    return q


def _flattened() -> tuple[Real, Real, Int, Int, Int]:
    """The table as arrays over law and piece; piece 0 is open: no force, no exit of its own."""
    shape = (len(NUMBER), MOST_PIECES + 1)
    force, exits = np.zeros((*shape, 2)), np.zeros((*shape, MOST_EXITS, 4))
    target = np.full((*shape, MOST_EXITS), NO_EXIT)
    kind, kinds = np.zeros(shape, np.int64), np.zeros(len(NUMBER), np.int64)
    for name, law in NUMBER.items():
        known = [(0.0, 0.0)]
        for q, piece in enumerate(LAWS[name], start=1):
            shares = piece.stiffness, piece.damping
            known += [shares] if shares not in known else []
            force[law, q], kind[law, q] = shares, known.index(shares)
            for e, way in enumerate(piece.exits):
                exits[law, q, e] = way.a, way.a_k, way.b, way.b_c
                target[law, q, e] = way.to
        kinds[law] = len(known)
    return force, exits, target, kind, kinds


# What kernels read: f_k and f_c; a, a_k, b, b_c; the piece that follows; pieces of equal force
# have one number, since the machine is the same linear one in all of them; how many there are.
FORCE, EXITS, TARGET, KIND, KINDS = _flattened()
ENTRY: Int = np.array([_entered(LAWS[name]) for name in NUMBER])  # the piece entered, with damping


def shares(law: ContactLaw, regime: Int | int) -> tuple[Real, Real]:
    """f_k and f_c of regimes, in the shape of ``regime``."""
    force = FORCE[NUMBER[law], np.abs(regime)]
    return force[..., 0], force[..., 1]


def carries_force(law: ContactLaw, regime: Int | int) -> NDArray[np.bool_]:
    """Where a regime has a force at all."""
    f_k, f_c = shares(law, regime)
    return np.asarray((f_k != 0.0) | (f_c != 0.0))


def engaged_side(law: ContactLaw, regime: Int | int) -> Int:
    """Side (+1, -1) on which regimes carry a force, 0 where there is none."""
    return np.where(carries_force(law, regime), np.sign(regime), 0)


def pushes_whole(law: ContactLaw) -> bool:
    """Whether each piece of a law carries all of k p + c p', or nothing."""
    return {(p.stiffness, p.damping) for p in LAWS[law]} <= {(0.0, 0.0), (1.0, 1.0)}


def signed_gap(regime: Int, gaps: tuple[float, float]) -> Real:
    """Position of the gap that a regime lies beyond: e+ or -e-; 0 where it is open."""
    return np.select([regime > OPEN, regime < OPEN], [gaps[0], -gaps[1]], 0.0)


def force_in(
    law: ContactLaw, k: float, c: float, gaps: tuple[float, float], regime: Int, y: Real, v: Real
) -> Real:
    """H in N, positive against +d, of a stop in known regimes at positions y and rates v."""
    f_k, f_c = shares(law, regime)
    held = carries_force(law, regime)
    depth = np.where(held, y - np.where(held, signed_gap(regime, gaps), 0.0), 0.0)
    return np.asarray(f_k * k * depth + f_c * c * v)


def stored_energy(
    law: ContactLaw, k: float, gaps: tuple[float, float], regime: Int, y: Real
) -> Real:
    """Energy in J of a stop's spring in known regimes; what a force of 2 k p adds is damping."""
    f_k, _ = shares(law, regime)
    f_k = np.minimum(f_k, 1.0)
    depth = np.where(f_k != 0.0, y - np.where(f_k != 0.0, signed_gap(regime, gaps), 0.0), 0.0)
    return np.asarray(0.5 * f_k * k * depth**2)


def regime_at(
    law: ContactLaw, k: float, c: float, gaps: tuple[float, float], y: ArrayLike, v: ArrayLike
) -> Int:
    """Regime of a stop at positions y and rates v; exactly at the gap the rate decides."""
    y, v = np.broadcast_arrays(np.asarray(y, float), np.asarray(v, float))
    plus = (y > gaps[0]) | ((y == gaps[0]) & (v > 0.0))
    minus = (y < -gaps[1]) | ((y == -gaps[1]) & (v < 0.0))
    side = np.where(plus, 1, np.where(minus, -1, 0))
    depth = np.where(side != 0, side * (y - np.where(side != 0, signed_gap(side, gaps), 0.0)), 0.0)
    piece = np.abs(side) * WHOLE
    for _ in range(MOST_PIECES if c > 0.0 else 0):
        for e in range(MOST_EXITS):
            a, a_k, b, b_c = np.moveaxis(EXITS[NUMBER[law], piece, e], -1, 0)
            target = TARGET[NUMBER[law], piece, e]
            h = (a + a_k * k) * depth + (b + b_c * c) * side * v
            piece = np.where((target > OPEN) & (h < 0.0), target, piece)
    return np.asarray(side * piece)
