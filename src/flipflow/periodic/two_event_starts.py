"""Symmetric motions with one touch a side, found without a guess; shooting has the last word."""

from __future__ import annotations

import numpy as np

from flipflow.dynamics.assembly import PlanBuilder
from flipflow.periodic.scratch import new_flow
from flipflow.periodic.solver import Real
from flipflow.periodic.two_event import TwoEvent, force_excesses, two_event_states

SAMPLES = 48
MOST_MOTIONS = 8


class TwoEventProblem:
    """The scalar problem f(s) = |F(s, omega)| - 1 of a machine with one symmetric stop."""

    def __init__(self, builder: PlanBuilder) -> None:
        plan = builder.plan
        size = 2 * builder.system.size
        square = (size, size)
        self._problem = TwoEvent(
            plan=plan,
            flow=new_flow(plan),
            engaged=np.zeros(square),
            open=np.zeros(square),
            A=np.zeros(square),
            pivot=np.zeros(size, np.int64),
            column=np.zeros(size),
            begin=np.zeros((size, 3)),
            end=np.zeros((size, 3)),
            z=np.zeros(size),
            rate=np.zeros(size),
        )

    @staticmethod
    def applies(builder: PlanBuilder) -> bool:
        """Whether the machine has one stop, the same on both sides, with the paper's law."""
        springs = builder.springs
        return len(springs) == 1 and springs[0].symmetric and springs[0].law == "paper"

    def states(self, omega: float) -> tuple[Real, Real]:
        """States at t = 0, (k, 2 N), and contact shares, (k,), of the candidates at ``omega``."""
        states = np.empty((MOST_MOTIONS, self._problem.z.size))
        shares = np.empty(MOST_MOTIONS)
        found = two_event_states(self._problem, omega, SAMPLES, states, shares)
        return states[:found], shares[:found]

    def excess(self, omega: Real, share: Real) -> Real:
        """f at pairs of omega and contact share, (P,): 0 where the machine has such a motion."""
        out = np.empty(np.shape(omega))
        force_excesses(self._problem, np.ascontiguousarray(omega), np.ascontiguousarray(share), out)
        return out
