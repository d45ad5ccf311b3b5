"""From a system to the arrays that kernels take."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.law import Stops
from flipflow.errors import InputError
from flipflow.model.contact_law import NUMBER
from flipflow.model.elements import ClearanceSpring
from flipflow.model.system import MechanicalSystem

EPSILON = float(np.finfo(float).eps)


def machine_arrays(system: MechanicalSystem, *, damped: bool = True) -> MachineArrays:
    """Flatten a system whose springs can all open and close.

    Parameters
    ----------
    system
        The machine.
    damped
        Whether it must have damping: without any no steady state is reached.

    Raises
    ------
    InputError
        Without a damping that is needed, and with a singular stiffness (nothing holds the machine).
    """
    if damped:
        system.require_damping()
    n, springs = system.size, system.springs
    m, force = len(springs), system.excitation.vector
    D = np.array([spring.direction for spring in springs]).reshape(m, n)
    parts = force.view(np.float64).reshape(n, 2)
    right = np.concatenate([system.K, system.C, D.T, parts], axis=1)
    solved = np.asarray(np.linalg.solve(system.M, right), np.float64)
    held = [abs(value) for value in np.linalg.eigvalsh(system.K).tolist()]
    if min(held) <= n * EPSILON * max(held):
        raise InputError(
            "K",
            "singular",
            "with all stops open nothing holds the machine in place; give every free motion a "
            "spring",
        )
    return MachineArrays(
        stiffness=solved[:, :n].copy(),
        damping=solved[:, n : 2 * n].copy(),
        direction=D,
        reach=np.ascontiguousarray(solved[:, 2 * n : 2 * n + m].T),
        push=solved[:, -2:].copy().view(np.complex128)[:, 0],
        power=system.excitation.power,
        stops=stops_of(springs),
    )


def stops_of(springs: Sequence[ClearanceSpring]) -> Stops:
    """Laws and numbers of springs."""
    return Stops(
        law=np.array([NUMBER[spring.law] for spring in springs], np.int64),
        stiffness=np.array([spring.stiffness for spring in springs], float),
        damping=np.array([spring.damping for spring in springs], float),
        gap=np.array([spring.gaps for spring in springs], float).reshape(-1, 2),
    )
