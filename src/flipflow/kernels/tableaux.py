"""Butcher tableaux of the explicit Runge-Kutta methods, as data."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction as F


@dataclass(frozen=True)
class Tableau:
    """Stages a, weights b, nodes c; ``error`` weighs the stages and, last, the slope at the end.

    A step is s + h sum_i b_i k_i with k_i the slope at s + h sum_j a_ij k_j. The error estimate is
    h sum_i error_i k_i, k at the end of the step included; zeros where there is none.
    """

    order: int
    a: tuple[tuple[F, ...], ...]
    b: tuple[F, ...]
    c: tuple[F, ...]
    error: tuple[F, ...]


# Kutta 1901.
RK4 = Tableau(
    4,
    ((), (F(1, 2),), (F(0), F(1, 2)), (F(0), F(0), F(1))),
    (F(1, 6), F(1, 3), F(1, 3), F(1, 6)),
    (F(0), F(1, 2), F(1, 2), F(1)),
    (F(0),) * 5,
)

# Dormand and Prince, J. Comp. Appl. Math. 6 (1980) 19-26, the pair RK5(4)7M.
DORMAND_PRINCE = Tableau(
    5,
    (
        (),
        (F(1, 5),),
        (F(3, 40), F(9, 40)),
        (F(44, 45), F(-56, 15), F(32, 9)),
        (F(19372, 6561), F(-25360, 2187), F(64448, 6561), F(-212, 729)),
        (F(9017, 3168), F(-355, 33), F(46732, 5247), F(49, 176), F(-5103, 18656)),
    ),
    (F(35, 384), F(0), F(500, 1113), F(125, 192), F(-2187, 6784), F(11, 84)),
    (F(0), F(1, 5), F(3, 10), F(4, 5), F(8, 9), F(1)),
    (
        F(71, 57600), F(0), F(-71, 16695), F(71, 1920), F(-17253, 339200), F(22, 525), F(-1, 40),
    ),
)  # fmt: skip
