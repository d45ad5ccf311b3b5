"""Parts of a machine that neither matrices nor springs connect: each moves on its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from flipflow.compiled.arrays import Real
from flipflow.model.elements import ClearanceSpring
from flipflow.model.excitation import restricted
from flipflow.model.system import MechanicalSystem


@dataclass(frozen=True, eq=False)
class IndependentPart:
    """One part as a machine, and its degrees of freedom within the whole."""

    system: MechanicalSystem
    freedoms: NDArray[np.int64]


def independent_parts(system: MechanicalSystem) -> list[IndependentPart]:
    """The parts of a machine; itself alone where all hangs together or a part has no damping."""
    connected = np.abs(system.M) + np.abs(system.C) + np.abs(system.K)
    for spring in system.springs:
        connected = connected + np.abs(np.outer(spring.direction, spring.direction))
    count, owner = connected_components(connected != 0.0, directed=False)
    parts = [_part(system, np.flatnonzero(owner == k)) for k in range(count)]
    if not all(np.count_nonzero(part.system.C) for part in parts):
        return [IndependentPart(system, np.arange(system.size))]
    return parts


def joined_state(parts: Sequence[IndependentPart], states: Sequence[Real]) -> Real:
    """State (x, x') of the whole from those of its parts, (2 N,)."""
    size = sum(part.freedoms.size for part in parts)
    z = np.empty(2 * size)
    for part, state in zip(parts, states, strict=True):
        z[part.freedoms], z[size + part.freedoms] = np.split(state, 2)
    return z


def _part(system: MechanicalSystem, freedoms: NDArray[np.int64]) -> IndependentPart:
    block = np.ix_(freedoms, freedoms)
    M, C, K = (matrix[block] for matrix in (system.M, system.C, system.K))
    springs = [
        ClearanceSpring(one.direction[freedoms], one.stiffness, one.damping, *one.gaps, one.law)
        for one in system.springs
        if one.direction[freedoms].any()
    ]
    forces = [restricted(one, freedoms) for one in system.excitations]
    static = system.constant_force[freedoms]
    part = MechanicalSystem(M, C, K, springs, forces, static_force=static)
    return IndependentPart(part, freedoms)
