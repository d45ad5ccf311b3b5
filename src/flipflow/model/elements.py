"""The spring that acts beyond a clearance."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow.errors import InputError
from flipflow.model import contact_law
from flipflow.model.arguments import (
    checked_at_least_zero,
    checked_number,
    checked_numbers,
    checked_word,
    real,
)
from flipflow.model.contact_law import ContactLaw


@dataclass(frozen=True, eq=False)
class ClearanceSpring:
    r"""A spring and damper that act only beyond a clearance, on one side or on both.

    With the gap coordinate :math:`y = d^T x`, stiffness k, damping c and gaps e+ and e-, the
    paper's law (Eq. 2) is, for :math:`y > e_+`,

    .. math:: H = k (y - e_+) + c \dot y,

    and for :math:`y < -e_-` the same with :math:`y + e_-`; zero between. At the gap itself the
    force jumps by :math:`c \dot y` on entry and pulls for a moment before release. With
    the penetration p > 0 and its rate p' the other laws push with

    - "compression-only": :math:`\max(0, k p + c p')`, without that pull;
    - "undamped-rebound": :math:`k p + c \max(0, p')`, without damping on the way out;
    - "elasto-gap": :math:`k p + \mathrm{clip}(c p', -k p, k p)`, with no more damping than the
      spring carries, so that nothing jumps at the gap.

    Parameters
    ----------
    direction
        d, shape (N,): the gap coordinate is ``direction @ x``.
    stiffness, damping
        k in N/m and c in N s/m of one engaged side.
    clearance, clearance_minus
        e+ and e- in m; None means the same on both sides, infinity no stop on that side. A stop
        with a negative gap is preloaded: it touches at y = 0 already.
    law
        ``"paper"``, ``"compression-only"``, ``"undamped-rebound"`` or ``"elasto-gap"``.

    Raises
    ------
    InputError
        For negative stiffness or damping, for values that are not finite, and for two sides that
        would push at once, e+ + e- < 0.
    """

    direction: NDArray[np.float64]
    stiffness: float
    damping: float
    clearance: float
    clearance_minus: float | None = None
    law: ContactLaw = "paper"

    def __init__(
        self,
        direction: ArrayLike,
        stiffness: float,
        damping: float = 0.0,
        clearance: float = 0.0,
        clearance_minus: float | None = None,
        law: ContactLaw = "paper",
    ) -> None:
        remedy = "give a finite vector that is not zero"
        vector = frozen_array(checked_numbers("direction", direction, remedy))
        if vector.ndim != 1 or not np.any(vector):
            raise InputError("direction", direction, remedy)
        gap = _checked_gap("clearance", clearance)
        minus = gap if clearance_minus is None else _checked_gap("clearance_minus", clearance_minus)
        if gap + minus < 0.0:
            remedy = "give clearance_minus = inf for a stop on one side; one spring for each of two"
            raise InputError("clearance", clearance, f"both sides would push at once: {remedy}")
        object.__setattr__(self, "direction", vector)
        object.__setattr__(self, "stiffness", checked_at_least_zero("stiffness", stiffness))
        object.__setattr__(self, "damping", checked_at_least_zero("damping", damping))
        object.__setattr__(self, "clearance", gap)
        object.__setattr__(self, "clearance_minus", minus)
        object.__setattr__(self, "law", checked_word("law", law, get_args(ContactLaw)))

    @property
    def gaps(self) -> tuple[float, float]:
        """The gaps (e+, e-) in m."""
        minus = self.clearance if self.clearance_minus is None else self.clearance_minus
        return self.clearance, minus

    @property
    def symmetric(self) -> bool:
        """Whether both gaps are equal."""
        return self.gaps[0] == self.gaps[1]

    @property
    def bonded(self) -> bool:
        """Whether the spring always acts: no gap on either side."""
        return self.acts and self.gaps == (0.0, 0.0) and self.law == "paper"

    @property
    def opens(self) -> bool:
        """Whether the spring acts at times and at times does not."""
        return self.acts and not self.bonded

    @property
    def acts(self) -> bool:
        """Whether the spring can ever carry a force."""
        return (self.stiffness > 0.0 or self.damping > 0.0) and not all(map(math.isinf, self.gaps))

    def force(self, gap: ArrayLike, rate: ArrayLike) -> NDArray[np.float64]:
        """H in N at gap coordinate y in m and its rate in m/s; zero exactly at the gap."""
        y = checked_numbers("gap", gap, "give finite numbers in m")
        v = checked_numbers("rate", rate, "give finite numbers in m/s")
        if 0 not in (y.ndim, v.ndim) and y.shape != v.shape:
            raise InputError("rate", rate, f"give one rate, or one a gap: shape {y.shape}")
        of = self.law, self.stiffness, self.damping, self.gaps
        return contact_law.force_in(*of, contact_law.regime_at(*of, y, v), y, v)


def _checked_gap(name: str, value: object) -> float:
    gap = real(value)
    if gap is None or math.isnan(gap) or gap == -math.inf:
        raise InputError(name, value, "give a gap in m, or inf for no stop")
    return gap if math.isinf(gap) else checked_number(name, gap)


def frozen_array(values: ArrayLike) -> NDArray[np.float64]:
    """Return a read-only copy as float64."""
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array
