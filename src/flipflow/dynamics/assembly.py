"""From a system to the arrays the kernels work on."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flipflow.dynamics.plan import Plan
from flipflow.errors import InputError
from flipflow.model.system import MechanicalSystem

MAX_SPRINGS = 12
PREPARED_AT_ONCE = 27
NEARLY_DEFECTIVE = 1e6
NUDGE, MOST_NUDGES = 1e-10, 3

Complex = NDArray[np.complex128]


class PlanBuilder:
    """Prepares configurations of a system and adds those that a kernel finds missing.

    Parameters
    ----------
    system
        The machine; springs that always act are moved into C and K first.

    Raises
    ------
    InputError
        Without any damping (no steady state is reached), with a singular stiffness (nothing
        holds the machine), or with more springs than configurations can be counted for.
    """

    def __init__(self, system: MechanicalSystem) -> None:
        self.original = system
        self.system = system.with_bonded()
        self.springs = self.system.springs
        if len(self.springs) > MAX_SPRINGS:
            raise InputError(
                "springs", len(self.springs), f"at most {MAX_SPRINGS} springs with a gap"
            )
        self.system.require_damping()
        if np.linalg.matrix_rank(self.system.K) < self.system.size:
            raise InputError(
                "K",
                "singular",
                "with all stops open nothing holds the machine in place; give every free motion "
                "a spring",
            )
        self._rows: dict[int, _Configuration] = {}
        self._solved: dict[
            tuple[bool, ...], tuple[Complex, Complex, Complex, NDArray[np.float64]]
        ] = {}
        everything = 3 ** len(self.springs) <= PREPARED_AT_ONCE
        self.add(range(3 ** len(self.springs)) if everything else [0])

    def add(self, codes: Iterable[int]) -> None:
        """Prepare configurations and rebuild :attr:`plan`."""
        for code in codes:
            if self._reachable(code):
                self._rows.setdefault(code, self._configuration(code))
        self.plan = self._assemble()

    def add_contact_state(self, state: NDArray[np.int64]) -> None:
        """Prepare the configuration of a flow's contact state (m,)."""
        digits = np.select([state == 1, state == -1], [1, 2], 0)
        self.add([int(digits @ 3 ** np.arange(digits.size))])

    def _digits(self, code: int) -> list[int]:
        return [code // 3**j % 3 for j in range(len(self.springs))]

    def _reachable(self, code: int) -> bool:
        return all(
            digit == 0 or np.isfinite(spring.gaps[digit - 1])
            for digit, spring in zip(self._digits(code), self.springs, strict=True)
        )

    def _configuration(self, code: int) -> _Configuration:
        """Modes of one configuration."""
        n = self.system.size
        digits = self._digits(code)
        preload = np.zeros(n)
        for digit, spring in zip(digits, self.springs, strict=True):
            if digit:
                offset = spring.gaps[0] if digit == 1 else -spring.gaps[1]
                preload += spring.stiffness * offset * spring.direction
        rate, right, left, K = self._modes(tuple(digit > 0 for digit in digits))
        rest = np.concatenate([np.linalg.solve(K, preload), np.zeros(n)])
        return _Configuration(rate, right, left, rest)

    def _modes(
        self, engaged: tuple[bool, ...]
    ) -> tuple[Complex, Complex, Complex, NDArray[np.float64]]:
        """Rates, right and left vectors, and stiffness; the same for either side of a spring."""
        if engaged not in self._solved:
            C, K = self.system.C.copy(), self.system.K.copy()
            for acts, spring in zip(engaged, self.springs, strict=True):
                if acts:
                    outer = np.outer(spring.direction, spring.direction)
                    C, K = C + spring.damping * outer, K + spring.stiffness * outer
            rate, right = _eigen(self.system.M, C, K)
            keep = rate.imag >= 0.0
            left = np.asarray(np.linalg.inv(right))
            self._solved[engaged] = rate[keep], right[:, keep], left[keep], K
        return self._solved[engaged]

    def contact_free(self, omega: NDArray[np.float64]) -> Complex:
        """X in x = Re(X exp(i omega t)) without contact, (n, N), by the open machine's modes."""
        plan, n = self.plan, self.system.size
        rate, pair = plan.rate[0], plan.weight[0] == 2.0
        shape = plan.right[0, :n]
        s = 1j * omega[:, None]
        answer = (plan.force[0] / (s - rate)) @ shape.T
        answer += (pair * plan.force_conj[0] / (s - rate.conj())) @ shape.conj().T
        return np.asarray(answer * omega[:, None] ** plan.power)

    def _directions(self) -> NDArray[np.float64]:
        return np.array([s.direction for s in self.springs]).reshape(-1, self.system.size)

    def _assemble(self) -> Plan:
        n, m, rows = self.system.size, len(self.springs), self._rows
        slot = np.full(3**m, -1, dtype=np.int64)
        for place, code in enumerate(rows):
            slot[code] = place
        modes = 2 * n
        D = self._directions()
        spread = np.linalg.solve(self.system.M, D.T)
        push = np.concatenate(
            [np.zeros(n), np.linalg.solve(self.system.M, self.system.excitation.vector)]
        )
        right = _padded([row.right for row in rows.values()], (modes, modes))
        left = _padded([row.left for row in rows.values()], (modes, modes))
        damping = np.array([s.damping for s in self.springs], dtype=float)
        return Plan(
            slot=slot,
            mode_count=np.array([row.rate.size for row in rows.values()], dtype=np.int64),
            rate=_padded([row.rate for row in rows.values()], (modes,)),
            weight=_padded([row.weight for row in rows.values()], (modes,)).real.copy(),
            right=right,
            left=left,
            rest=np.array([row.rest for row in rows.values()], dtype=float),
            force=left @ push,
            force_conj=left.conj() @ push,
            gap_shape=np.ascontiguousarray(D @ right[:, :n]),
            gap_pick=np.ascontiguousarray(left[0, :, n:] @ spread),
            direction=D,
            kick=np.ascontiguousarray((damping[:, None] * spread.T).reshape(m, n)),
            stiffness=np.array([s.stiffness for s in self.springs], dtype=float),
            damping=damping,
            gap_plus=np.array([s.gaps[0] for s in self.springs], dtype=float),
            gap_minus=np.array([s.gaps[1] for s in self.springs], dtype=float),
            clipped=np.array([s.law != "paper" for s in self.springs], dtype=np.int64),
            power=self.system.excitation.power,
        )


@dataclass(frozen=True, eq=False)
class _Configuration:
    """Modes of one configuration, one of each conjugate pair, and where it would stand still."""

    rate: Complex  # (r,)
    right: Complex  # (2 N, r)
    left: Complex  # (r, 2 N)
    rest: NDArray[np.float64]  # (2 N,)

    @property
    def weight(self) -> Complex:
        """2 for a conjugate pair, 1 for a real eigenvalue."""
        return np.where(self.rate.imag > 0.0, 2.0, 1.0).astype(np.complex128)


def _padded(arrays: list[Complex], shape: tuple[int, ...]) -> Complex:
    """Arrays of up to ``shape`` as rows of one, with zeros behind the last mode of each."""
    rows = np.zeros((len(arrays), *shape), np.complex128)
    for row, array in zip(rows, arrays, strict=True):
        row[tuple(slice(size) for size in array.shape)] = array
    return rows


def _eigen(
    M: NDArray[np.float64], C: NDArray[np.float64], K: NDArray[np.float64]
) -> tuple[Complex, Complex]:
    """Eigenvalues and right vectors of the state matrix; conjugate pairs exactly conjugate."""
    n = M.shape[0]
    accelerations = np.linalg.solve(M, np.hstack([K, C]))
    for nudge in range(MOST_NUDGES + 1):
        damping = accelerations[:, n:] * (1.0 + nudge * NUDGE)
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-accelerations[:, :n], -damping]])
        rate, right = np.linalg.eig(A)
        # Exactly critical damping has no full set of eigenvectors; a damping changed in its
        # tenth digit has one, and costs less than the digits a defective basis would.
        if np.linalg.cond(right / _scale(right)) < NEARLY_DEFECTIVE:
            break
    return rate.astype(np.complex128), right.astype(np.complex128)


def _scale(right: Complex) -> NDArray[np.float64]:
    """Row scale that brings displacements and velocities to one size."""
    return np.asarray(np.maximum(np.abs(right).max(axis=1, keepdims=True), np.finfo(float).tiny))
