"""From a system to the arrays that kernels take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.law import Stops
from flipflow.errors import InputError
from flipflow.model.contact_law import NUMBER
from flipflow.model.elements import ClearanceSpring
from flipflow.model.system import MechanicalSystem

EPSILON = float(np.finfo(float).eps)
HELD = 1e-12  # share of the stiffness, or of the damping, below which nothing holds a motion


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
        Without a damping that is needed, and with a stiffness that is singular where nothing ever
        holds the machine, or nothing damps it.
    """
    if damped:
        system.require_damping()
    _require_hold(system)
    n, springs = system.size, system.springs
    m = len(springs)
    D = np.array([spring.direction for spring in springs]).reshape(m, n)
    terms = [(one.order, *term) for one in system.excitations for term in one.terms]
    force = np.array([vector for _, _, vector in terms])
    forces = len(terms)
    ends = 2 * n, 2 * n + m, 2 * n + m + forces, 2 * n + m + 2 * forces
    gaps, real, imag = (slice(*pair) for pair in pairwise(ends))
    # One solution with M for all of them: what is called here takes longer than what is worked out.
    right = np.empty((n, 2 * n + m + 2 * forces + 1))
    right[:, :n], right[:, n : 2 * n], right[:, gaps] = system.K, system.C, D.T
    right[:, real], right[:, imag], right[:, -1] = force.real.T, force.imag.T, system.constant_force
    solved = np.asarray(np.linalg.solve(system.M, right), np.float64)
    push = np.empty((forces, n), np.complex128)
    push.real, push.imag = solved[:, real].T, solved[:, imag].T
    orders = system.orders
    return MachineArrays(
        stiffness=solved[:, :n].copy(),
        damping=solved[:, n : 2 * n].copy(),
        direction=D,
        reach=solved[:, gaps].T.copy(),
        static=solved[:, -1].copy(),
        push=push,
        power=np.array([power for _, power, _ in terms], np.int64),
        wave=np.array([orders.index(order) for order, _, _ in terms], np.int64),
        order=np.array(orders, np.int64),
        stops=stops_of(springs),
    )


def _require_hold(system: MechanicalSystem) -> None:
    """Refuse a machine with a free motion that no stop ever ends, or that nothing damps."""
    sizes = np.linalg.svd(system.K, compute_uv=False).tolist()
    if sizes[-1] > system.size * EPSILON * sizes[0]:
        return
    free = _null_space(system.K, float(np.linalg.norm(system.K)))
    springs = [spring for spring in system.springs if spring.stiffness > 0.0]
    D = np.array([spring.direction for spring in springs]).reshape(len(springs), system.size)
    if _null_space(D @ free, float(np.linalg.norm(D))).shape[1]:
        remedy = "nothing ever holds the machine; give every free motion a spring or a stop"
        raise InputError("K", "singular", remedy)
    if _null_space(system.C @ free, float(np.linalg.norm(system.C))).shape[1]:
        remedy = "a motion that no spring holds between the stops needs damping there; give it some"
        raise InputError("C", "singular", remedy)


def _null_space(matrix: Real, size: float) -> Real:
    """Columns that a matrix (n, k) takes to zero, (k, .), to rounding of numbers of a size."""
    if matrix.shape[0] == 0:
        return np.eye(matrix.shape[1])
    _, sizes, rows = np.linalg.svd(matrix)
    rank = np.count_nonzero(sizes > HELD * size)
    return np.asarray(rows[rank:].T)


def stops_of(springs: Sequence[ClearanceSpring]) -> Stops:
    """Laws and numbers of springs."""
    return Stops(
        law=np.array([NUMBER[spring.law] for spring in springs], np.int64),
        stiffness=np.array([spring.stiffness for spring in springs], float),
        damping=np.array([spring.damping for spring in springs], float),
        gap=np.array([spring.gaps for spring in springs], float).reshape(-1, 2),
    )


def with_springs(system: MechanicalSystem, kept: Sequence[int]) -> MechanicalSystem:
    """A system with these springs, whatever their gaps; of the others those that always act."""
    others = [spring for j, spring in enumerate(system.springs) if j not in kept]
    rest = replace(system, springs=tuple(others)).with_bonded()
    return replace(rest, springs=tuple(system.springs[j] for j in kept))


def machine_parts(system: MechanicalSystem) -> dict[str, Real]:
    """Arrays of a system, by the names of a series of machines."""
    springs = system.springs
    force = np.array([vector for one in system.excitations for _, vector in one.terms])
    m, n = len(springs), system.size
    return {
        "inertia": system.M,
        "damping": system.C,
        "stiffness": system.K,
        "direction": np.array([spring.direction for spring in springs]).reshape(m, n),
        "force": np.concatenate([force.real, force.imag]),
        "static": system.constant_force[None],
        "stop": np.array([[s.stiffness for s in springs], [s.damping for s in springs]], float),
        "gap": np.array([spring.gaps for spring in springs], float).reshape(m, 2),
    }
