"""The smooth stand-in of the paper for the switch of a stop at its gap."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow.errors import InputError
from flipflow.model.elements import ClearanceSpring

SHARPNESS = 1e6


def smooth_force(
    spring: ClearanceSpring, gap: ArrayLike, rate: ArrayLike, sharpness: float = SHARPNESS
) -> NDArray[np.float64]:
    r"""Force of a stop whose switch at the gap is a hyperbolic tangent, in N.

    .. math::

        G = [c \dot y + k (y - e_+)] \tfrac12 [1 + \tanh \epsilon (y - e_+)]
          + [c \dot y + k (y + e_-)] \tfrac12 [1 - \tanh \epsilon (y + e_-)]

    Parameters
    ----------
    spring
        The stop; its piecewise law is :meth:`~flipflow.ClearanceSpring.force`.
    gap, rate
        y in m and its rate in m/s, of one shape or broadcast to one.
    sharpness
        epsilon in 1/m; the paper's is 1e6.

    Returns
    -------
    numpy.ndarray
        G in N, in the shape of ``gap`` and ``rate``.

    Raises
    ------
    InputError
        For a law other than the paper's, which have no such form, and a sharpness of 0 or less.

    Notes
    -----
    Minerals 2024, 14, 406, Eq. (3).
    """
    if spring.law != "paper":
        raise InputError("law", spring.law, "only the paper's law has a smooth form")
    if not 0.0 < sharpness < math.inf:
        raise InputError("sharpness", sharpness, "give a finite number above 0, in 1/m")
    y, v = np.broadcast_arrays(np.asarray(gap, float), np.asarray(rate, float))
    force = np.zeros(y.shape)
    for side, e in zip((1.0, -1.0), spring.gaps, strict=True):
        if math.isfinite(e):
            depth = side * y - e
            pushed = spring.damping * side * v + spring.stiffness * depth
            force += side * pushed * (1.0 + np.tanh(sharpness * depth)) / 2.0
    return force
