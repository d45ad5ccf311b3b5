r"""Modes of the contact states that a motion meets, each prepared when it is first met.

Within one contact state the machine is linear. With the state z = (x, x'), right and left vectors
v_i and l_i of the state's matrix A,

    exp(A t) = Re sum_i weight_i v_i exp(rate_i t) l_i,

one term for a conjugate pair (weight 2) and one for a real eigenvalue (weight 1), so that
overdamped machines need no special case. Which side of a stop is engaged does not change the
matrix. A contact state is therefore identified by the kinds of force that its springs have; where
the machine would stand still follows from the gaps on the engaged sides.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.by_reference import by_reference
from flipflow.compiled.compile import kernel
from flipflow.compiled.dense import lu_factor, lu_solve
from flipflow.compiled.eigen import Schur, eigenvector, new_schur, real_schur
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.law import kind
from flipflow.errors import InputError
from flipflow.model.contact_law import FORCE, KIND, KINDS, MOST_PIECES

NEARLY_DEFECTIVE = 1e6  # condition of the basis of eigenvectors from which it has lost six digits
USELESS = 1e10  # condition from which it serves no more
NUDGE = 1e-10  # relative change of damping that splits a double eigenvalue
SINGULAR = 2e-16  # share of a stiffness below which a pivot is rounding
ZERO = 1e-13  # share of the fastest rate below which one of a singular stiffness is zero
MOST_NUDGES = 3  # such changes tried, each larger by one nudge
MOST_STATES = 2**12  # contact states for which tables are kept
MOST_BYTES = 2**32  # of tables, of which only what is met is ever touched


@by_reference
class Modes(NamedTuple):
    """Tables over S contact states, of up to R modes; ``ready`` tells which are filled."""

    place: Int  # (m,) the state's number is sum_j place_j kind_j
    ready: Int  # (S,) 0 not met yet, 1 filled, -1 no modes could be found
    mode_count: Int  # (S,) number of modes
    rate: Complex  # (S, R) eigenvalues in 1/s
    weight: Real  # (S, R)
    right: Complex  # (S, 2 N, R) v_i as columns
    left: Complex  # (S, R, 2 N) l_i as rows
    force: Complex  # (S, E, R) l_i (0, M^-1 f) with f the force vector
    force_conj: Complex  # (S, E, R) the same for the conjugate mode
    gap_shape: Complex  # (S, m, R) d_j phi_i: modes seen at the gaps
    gap_pick: Complex  # (S, R, m) l_i (0, M^-1 d_j)
    rest: Real  # (S, m, N) where spring j, engaged at a gap of 1 m, would hold the machine
    static: Real  # (S, N) where the constant force would hold it
    drift: Real  # (S, N) velocity to which it drives what nothing holds
    schur: Schur  # scratch
    held: Real  # (N, N) scratch
    basis: Real  # (2 N, 2 N) scratch
    factors: Real  # (2 N, 2 N) scratch
    pivot: Int  # (2 N,) scratch
    column: Real  # (2 N,) scratch


def new_modes(machine: MachineArrays) -> Modes:
    """Empty tables for a machine.

    Raises
    ------
    InputError
        For more springs than contact states can be kept of.
    """
    m, n = machine.direction.shape
    forces = machine.push.shape[0]
    place = [1]
    for law in machine.stops.law:
        place.append(place[-1] * int(KINDS[law]))
    states = place.pop()
    modes = 2 * n
    if states > MOST_STATES or states * (2 * modes + 2 * m) * modes * 16 > MOST_BYTES:
        remedy = (
            "give at most 12 springs with a gap, 7 of laws with three forces, fewer of a large "
            "machine"
        )
        raise InputError("springs", m, remedy)
    table = (states, modes)
    return Modes(
        place=np.array(place, np.int64),
        ready=np.zeros(states, np.int64),
        mode_count=np.zeros(states, np.int64),
        rate=np.zeros(table, np.complex128),
        weight=np.zeros(table),
        right=np.zeros((states, modes, modes), np.complex128),
        left=np.zeros((states, modes, modes), np.complex128),
        force=np.zeros((states, forces, modes), np.complex128),
        force_conj=np.zeros((states, forces, modes), np.complex128),
        gap_shape=np.zeros((states, m, modes), np.complex128),
        gap_pick=np.zeros((states, modes, m), np.complex128),
        rest=np.zeros((states, m, n)),
        static=np.zeros((states, n)),
        drift=np.zeros((states, n)),
        schur=new_schur(modes),
        held=np.zeros((n, n)),
        basis=np.zeros((modes, modes)),
        factors=np.zeros((modes, modes)),
        pivot=np.zeros(modes, np.int64),
        column=np.zeros(modes),
    )


@kernel(inline=True)
def state_number(machine: MachineArrays, modes: Modes, regime: Int) -> int:
    """Number of the contact state of regimes (m,), its modes prepared; negative: there are none."""
    number = 0
    for j in range(regime.shape[0]):
        number += modes.place[j] * kind(machine.stops, j, regime[j])
    if modes.ready[number] == 0:
        prepare(machine, modes, number)
    return number if modes.ready[number] == 1 else -1


@kernel(shared=True)
def prepare(machine: MachineArrays, modes: Modes, number: int) -> None:
    """Fill the tables of one contact state; ``ready`` tells whether that could be done.

    With exactly critical damping there is no full set of eigenvectors. A change of the damping in
    its tenth digit gives one, and loses fewer digits than a defective basis would.
    """
    modes.ready[number] = -1
    best, least = 0, math.inf
    for nudge in range(MOST_NUDGES + 1):
        condition = _basis(machine, modes, number, nudge)
        if condition < least:
            best, least = nudge, condition
        if condition < NEARLY_DEFECTIVE:
            break
    if not least < USELESS:
        return
    if nudge != best:
        _basis(machine, modes, number, best)
    _seen_from_outside(machine, modes, number)
    modes.ready[number] = 1


@kernel
def _basis(machine: MachineArrays, modes: Modes, number: int, nudge: int) -> float:
    """Modes with the damping changed by some nudges, and rests; the condition of their basis.

    Where the stiffness is singular to rounding, rates that are zero to rounding are.
    """
    _state_matrix(machine, modes, number, 1.0 + nudge * NUDGE)
    held = _rests(machine, modes, number)
    if not real_schur(modes.schur, True):
        return math.inf
    if held:
        return _vectors(modes, number)
    value, largest = modes.schur.value, 0.0
    for k in range(value.shape[0]):
        largest = max(largest, abs(value[k]))
    for k in range(value.shape[0]):
        if abs(value[k]) <= ZERO * largest:
            value[k] = 0.0
    condition = _vectors(modes, number)
    if condition < USELESS:
        _rests_by_modes(machine, modes, number)
    return condition


@kernel
def _shares(machine: MachineArrays, modes: Modes, number: int, j: int) -> tuple[float, float]:
    """f_k k and f_c c of spring j in a contact state."""
    law = machine.stops.law[j]
    k = number // modes.place[j] % KINDS[law]
    for piece in range(MOST_PIECES + 1):
        if KIND[law, piece] == k:
            f_k, f_c = FORCE[law, piece, 0], FORCE[law, piece, 1]
            return f_k * machine.stops.stiffness[j], f_c * machine.stops.damping[j]
    return 0.0, 0.0


@kernel
def _state_matrix(machine: MachineArrays, modes: Modes, number: int, stretch: float) -> None:
    """A = [[0, I], [-M^-1 K, -M^-1 C]] of a contact state; ``stretch`` is a factor on C."""
    m, n = machine.direction.shape
    T = modes.schur.T
    for r in range(n):
        for s in range(n):
            T[r, s] = 0.0
            T[r, n + s] = 1.0 if r == s else 0.0
            stiffness, damping = machine.stiffness[r, s], machine.damping[r, s]
            for j in range(m):
                k, c = _shares(machine, modes, number, j)
                stiffness += k * machine.reach[j, r] * machine.direction[j, s]
                damping += c * machine.reach[j, r] * machine.direction[j, s]
            T[n + r, s] = -stiffness
            T[n + r, n + s] = -damping * stretch


@kernel
def _rests(machine: MachineArrays, modes: Modes, number: int) -> bool:
    """Where the contact state of the matrix would stand still, for gaps and the constant force.

    False where its stiffness is singular to rounding: see :func:`_rests_by_modes`.
    """
    m, n = machine.direction.shape
    largest = 0.0
    for r in range(n):
        modes.drift[number, r] = 0.0
        for s in range(n):
            modes.held[r, s] = -modes.schur.T[n + r, s]
            largest = max(largest, abs(modes.held[r, s]))
    if not lu_factor(modes.held, modes.pivot):
        return False
    for r in range(n):
        if abs(modes.held[r, r]) <= n * SINGULAR * largest:
            return False
    for j in range(m + 1):
        for r in range(n):
            modes.column[r] = _steady_push(machine, modes, number, j, r)
        lu_solve(modes.held, modes.pivot, modes.column)
        for r in range(n):
            if j < m:
                modes.rest[number, j, r] = modes.column[r]
            else:
                modes.static[number, r] = modes.column[r]
    return True


@kernel
def _steady_push(machine: MachineArrays, modes: Modes, number: int, j: int, r: int) -> float:
    """Acceleration r by spring j engaged at a gap of 1 m; by the constant force for j beyond."""
    if j == machine.direction.shape[0]:
        return machine.static[r]
    k, _ = _shares(machine, modes, number, j)
    return k * machine.reach[j, r]


@kernel
def _rests_by_modes(machine: MachineArrays, modes: Modes, number: int) -> None:
    """Where a contact state stands still in the modes that are held; how it drifts in the others.

    A mode q' = rate q + g stands still at -g / rate. One whose rate is zero moves at g: only a
    constant force drives it, since a spring that is engaged holds it.
    """
    m, n = machine.direction.shape
    for j in range(m + 1):
        for r in range(n):
            if j < m:
                modes.rest[number, j, r] = 0.0
            else:
                modes.static[number, r] = 0.0
        for i in range(modes.mode_count[number]):
            g = 0j
            for r in range(n):
                g += modes.left[number, i, n + r] * _steady_push(machine, modes, number, j, r)
            rate, weight = modes.rate[number, i], modes.weight[number, i]
            for r in range(n):
                v = modes.right[number, r, i]
                if j < m:
                    if rate != 0.0:
                        modes.rest[number, j, r] -= (weight * v * g / rate).real
                elif rate != 0.0:
                    modes.static[number, r] -= (weight * v * g / rate).real
                else:
                    modes.drift[number, r] += (weight * v * g).real


@kernel
def _vectors(modes: Modes, number: int) -> float:
    """Right and left vectors from the Schur form; the condition of their basis.

    The basis is real: v itself, or Re v and Im v of a pair. With its inverse's rows a and b the
    left vector is a, or (a - i b) / 2. All of it is done on the balanced matrix.
    """
    schur, basis = modes.schur, modes.basis
    size = schur.T.shape[0]
    count, column, square = 0, 0, 0.0
    for k in range(size):
        value = schur.value[k]
        if value.imag < 0.0:
            continue
        eigenvector(schur, k)
        modes.rate[number, count] = value
        modes.weight[number, count] = 2.0 if value.imag > 0.0 else 1.0
        for r in range(size):
            v = schur.vector[r]
            modes.right[number, r, count] = v * schur.scale[r]
            basis[r, column] = v.real
            square += v.real * v.real + v.imag * v.imag
            if value.imag > 0.0:
                basis[r, column + 1] = v.imag
        column += 2 if value.imag > 0.0 else 1
        count += 1
    modes.mode_count[number] = count
    return math.sqrt(square) * _inverted(modes, number) / size


@kernel
def _inverted(modes: Modes, number: int) -> float:
    """Left vectors from the inverse of the basis; its norm, infinite where there is none."""
    factors, schur = modes.factors, modes.schur
    size = factors.shape[0]
    for r in range(size):
        for c in range(size):
            factors[r, c] = modes.basis[r, c]
    if not lu_factor(factors, modes.pivot):
        return math.inf
    square = 0.0
    for c in range(size):
        for r in range(size):
            modes.column[r] = 1.0 if r == c else 0.0
        lu_solve(factors, modes.pivot, modes.column)
        row = 0
        for i in range(modes.mode_count[number]):
            a = modes.column[row]
            square += a * a
            left = a + 0j
            if modes.weight[number, i] == 2.0:
                b = modes.column[row + 1]
                square += b * b
                left = 0.5 * complex(a, -b)
                row += 1
            row += 1
            modes.left[number, i, c] = left / schur.scale[c]
    return math.sqrt(square)


@kernel
def _seen_from_outside(machine: MachineArrays, modes: Modes, number: int) -> None:
    """How the exciter and the gaps act on the modes, and how the modes move the gaps."""
    m, n = machine.direction.shape
    for i in range(modes.mode_count[number]):
        for e in range(machine.push.shape[0]):
            force = 0j
            force_conj = 0j
            for r in range(n):
                left = modes.left[number, i, n + r]
                force += left * machine.push[e, r]
                force_conj += left.conjugate() * machine.push[e, r]
            modes.force[number, e, i] = force
            modes.force_conj[number, e, i] = force_conj
        for j in range(m):
            shape = 0j
            pick = 0j
            for r in range(n):
                shape += machine.direction[j, r] * modes.right[number, r, i]
                pick += modes.left[number, i, n + r] * machine.reach[j, r]
            modes.gap_shape[number, j, i] = shape
            modes.gap_pick[number, i, j] = pick
