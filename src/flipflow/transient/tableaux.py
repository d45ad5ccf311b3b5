"""Butcher tableaux of the explicit Runge-Kutta methods, as data."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

Fractions = tuple[Fraction, ...]


@dataclass(frozen=True)
class Tableau:
    """Stages a, weights b; ``error`` weighs the stages and, last, the slope at the end.

    A step is s + h sum_i b_i k_i with k_i the slope at s + h sum_j a_ij k_j. The error estimate is
    h sum_i error_i k_i, k at the end of the step included; zeros where there is none.
    """

    order: int
    a: tuple[Fractions, ...]
    b: Fractions
    error: Fractions


def _row(text: str) -> Fractions:
    return tuple(map(Fraction, text.split()))


# Kutta, Z. Math. Phys. 46 (1901) 435-453.
RK4 = Tableau(
    order=4,
    a=(_row(""), _row("1/2"), _row("0 1/2"), _row("0 0 1")),
    b=_row("1/6 1/3 1/3 1/6"),
    error=_row("0 0 0 0 0"),
)

# Dormand and Prince, J. Comp. Appl. Math. 6 (1980) 19-26, the pair RK5(4)7M.
DORMAND_PRINCE = Tableau(
    order=5,
    a=(
        _row(""),
        _row("1/5"),
        _row("3/40 9/40"),
        _row("44/45 -56/15 32/9"),
        _row("19372/6561 -25360/2187 64448/6561 -212/729"),
        _row("9017/3168 -355/33 46732/5247 49/176 -5103/18656"),
    ),
    b=_row("35/384 0 500/1113 125/192 -2187/6784 11/84"),
    error=_row("71/57600 0 -71/16695 71/1920 -17253/339200 22/525 -1/40"),
)
