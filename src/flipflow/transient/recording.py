"""A machine carried through time at constant speed by the exact flow, stretch by stretch."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from flipflow.compiled import status
from flipflow.compiled.arrays import Real
from flipflow.dynamics.assembly import machine_arrays
from flipflow.dynamics.contact_free import state_matrix
from flipflow.dynamics.contact_search import new_gap_motion
from flipflow.dynamics.flow import MOST_SEGMENTS
from flipflow.errors import IncompleteError
from flipflow.model.arguments import LARGEST
from flipflow.model.system import MechanicalSystem
from flipflow.periodic.shooting import Shooting, ShootingWork, new_shooting, new_shooting_work
from flipflow.transient.sampling import (
    PANEL,
    Budget,
    Changes,
    Springs,
    Table,
    sample_motion,
)

GAUSS_NODES = 16  # in each panel over which powers are integrated
TURNS_A_CALL = 32  # turns calculated at once, between two calls of the monitor
WORK_A_CALL = 4e5  # Gauss panels times N^2 at most, a tenth of a second: the work at low speeds
SHORTEST = 2.0**-12  # share of a turn, or of what one call takes, at which it is given up


def work_rate(system: MechanicalSystem, omega: float) -> float:
    """Gauss panels times N^2 that a second of motion takes, by the fastest mode of any contact."""
    n = system.size
    fastest = omega
    for share in (0.0, 1.0):
        K, C = system.K.copy(), system.C.copy()
        for spring in system.springs:
            square = share * np.outer(spring.direction, spring.direction)
            K += spring.stiffness * square
            C += spring.damping * square
        A = state_matrix(system.M, C, K)
        fastest = max(fastest, float(np.abs(np.linalg.eigvals(A)).max()))
    return fastest * n**2 / PANEL


class Recording:
    """Samples, changes of contact and energies of a motion; the machine may change on the way.

    Parameters
    ----------
    t
        Times at which the motion is wanted, rising, (K,).
    size, springs
        Degrees of freedom N, and springs of the machine, whether they open or not.
    """

    def __init__(self, t: Real, size: int, springs: int) -> None:
        k = t.size
        x, v, a = np.empty((3, k, size))
        self.table = Table(t, x, v, a, np.zeros((k, springs)), np.zeros((k, springs)))
        self.row = 0
        self.changes: list[tuple[float, int, int]] = []
        self.work = {"input": 0.0, "dampers": 0.0, "stops": 0.0}

    def carry(
        self,
        system: MechanicalSystem,
        z: Real,
        omega: float,
        begin: float,
        end: float,
        tell: Callable[[float], None],
    ) -> Real:
        """State at ``end`` from z at ``begin``; ``tell`` is called with the time reached.

        Raises
        ------
        IncompleteError
            When the flow does not end even over a short part of a turn, as where stops chatter, and
        when the state is no longer finite.
        """
        linear = system.with_bonded()
        machine = machine_arrays(linear, damped=False)
        problem = new_shooting(machine, half_turn=False, length=math.nan)
        work = new_shooting_work(machine)
        springs = _springs(system, work)
        node, weight = np.polynomial.legendre.leggauss(GAUSS_NODES)
        budget = Budget(
            damping=linear.C.copy(),
            circulation=0.5 * (linear.K - linear.K.T),
            vector=np.array([v for one in linear.excitations for _, v in one.terms]),
            static=linear.constant_force.copy(),
            node=node,
            weight=weight,
            work=np.zeros(3),
        )
        turn = 2.0 * np.pi / omega
        stretch = min(TURNS_A_CALL * turn, WORK_A_CALL / work_rate(linear, omega))
        shortest = SHORTEST * min(stretch, turn)
        t = begin
        while t < end:
            until = min(t + stretch, end)
            reached = self._stretch(problem, work, z, omega, t, until, springs, budget)
            if reached is None:
                # A turn has more contacts than are recorded at once: go on by parts of it.
                stretch = min(stretch, turn) / 2.0
                if stretch < shortest:
                    raise IncompleteError(
                        f"the motion could not be carried on beyond {t:.6g} s: its contacts are "
                        "too many, it grows beyond all numbers, or it is in resonance without "
                        "damping"
                    )
                continue
            z, t = reached, until
            tell(t)
        for name, done in zip(self.work, budget.work, strict=True):
            self.work[name] += float(done)
        return z

    def _stretch(
        self,
        problem: Shooting,
        work: ShootingWork,
        z: Real,
        omega: float,
        t: float,
        until: float,
        springs: Springs,
        budget: Budget,
    ) -> Real | None:
        """State at ``until``; None, and nothing recorded, where the flow does not end."""
        capacity = (TURNS_A_CALL + 2) * MOST_SEGMENTS
        kept = budget.work.copy()
        changes = Changes(
            np.empty(capacity), np.empty(capacity, np.int64), np.empty(capacity, np.int64),
            np.zeros(1, np.int64),
        )  # fmt: skip
        work.flow.z[:] = z
        code, row = sample_motion(
            problem, work, omega, t, until, self.row, springs, self.table, changes, budget
        )
        if code != status.OK or not (np.abs(work.flow.z) < LARGEST).all():
            budget.work[:] = kept
            return None
        self.row = row
        count = int(changes.used[0])
        self.changes += zip(
            changes.t[:count].tolist(),
            springs.place[changes.spring[:count]].tolist(),
            changes.state[:count].tolist(),
            strict=True,
        )
        return work.flow.z.copy()


def _springs(system: MechanicalSystem, work: ShootingWork) -> Springs:
    """The springs of a machine, for the scratch of its flow."""
    always = [k for k, one in enumerate(system.springs) if one.bonded]
    held = [system.springs[k] for k in always]
    return Springs(
        place=np.array(system.opening, np.int64),
        always=np.array(always, np.int64),
        direction=np.array([one.direction for one in held]).reshape(len(held), system.size),
        stiffness=np.array([one.stiffness for one in held]),
        damping=np.array([one.damping for one in held]),
        motion=new_gap_motion(len(held), work.flow.motion.rate),
    )
