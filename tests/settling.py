"""Where a state ends, by brute force: hundreds of turns of the exact flow."""

from __future__ import annotations

import numpy as np

BRUTE_TURNS = 400


def settled_on(solver, z, omega, orbits, turns=BRUTE_TURNS):
    """Index of the orbit that hundreds of turns of the exact flow end on."""
    end = solver.settled(z, omega, turns)
    scale = np.repeat([1.0, omega], end.size // 2)
    away = [np.abs((end - orbit.state) / scale).max() for orbit in orbits]
    assert min(away) < 1e-7, away
    return int(np.argmin(away))
