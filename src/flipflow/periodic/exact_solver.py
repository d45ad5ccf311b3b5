"""Exact periodic motions: shooting on the closed-form flow."""

from __future__ import annotations

import copy

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled import status
from flipflow.dynamics.motion import Motion, Pieces, PiecewiseMotion
from flipflow.errors import IncompleteError
from flipflow.model.system import MechanicalSystem
from flipflow.periodic.observe import observe_flow
from flipflow.periodic.scratch import new_gap_motion
from flipflow.periodic.shooting import shooting_step
from flipflow.periodic.solver import Complex, Real, Solver
from flipflow.periodic.turns import strobe


class ExactSolver(Solver):
    """Unknown: the state (x, x') at t = 0, where the unbalance points along +x.

    ``turns`` forcing periods pass before the motion repeats. With ``half_turn`` their number is
    odd, and the motion is its own mirror image after half of them.
    """

    reads_jacobian = True

    def __init__(self, system: MechanicalSystem, *, half_turn: bool, turns: int = 1) -> None:
        self.turns = turns
        super().__init__(system, half_turn=half_turn)

    def _prepare(self) -> None:
        self.unknowns = 2 * self.system.size
        self._new_work()
        self.problem = self.shooting(half_turn=self.half_turn)
        self.turn = self.shooting(half_turn=False)

    def residual(self, z: Real, omega: float) -> tuple[Real, Real] | None:
        """r = sign flow(z) - z and [dr/dz, dr/d omega]; None where the flow does not end."""
        r, J = np.empty(self.unknowns), np.empty((self.unknowns, self.unknowns + 1))
        while True:
            code = shooting_step(self.problem, np.array(z), omega, r, J)
            if code != status.MISSING_CONFIGURATION:
                return (r, J) if code == status.OK else None
            self.add_missing_configuration()

    def return_maps(self, u: Real, omega: Real, jacobian: Real) -> Real:  # noqa: ARG002
        return np.asarray(jacobian + np.eye(self.unknowns))

    def states(self, u: Real, omega: Real) -> Real:  # noqa: ARG002
        return u

    def series(self, u: Real, omega: Real) -> tuple[NDArray[np.int64], Complex]:
        return np.zeros(0, np.int64), np.zeros((omega.size, 0, u.shape[1] // 2), np.complex128)

    def extremes(self, u: Real, omega: Real, coordinates: Real) -> tuple[Real, Real, Complex]:
        low, high, first = self._observe(np.array(u), omega, coordinates)
        if self.half_turn:
            high = np.maximum(high, -low)
            low = -high
        return low, high, first

    def settled(self, z: Real, omega: float, turns: int) -> Real:
        """State in which the machine is after a number of turns from the state z."""
        states = np.array(z)[None]
        none = np.zeros((0, self.system.size))
        self._observe(states, np.array([omega]), none, whole_turn=True, waiting=turns)
        return np.asarray(states[0])

    def with_turns(self, turns: int) -> ExactSolver:
        """A solver of the same machine for motions that repeat after ``turns`` periods."""
        other = copy.copy(self)
        other.turns, other.half_turn = turns, False
        other._prepare()  # noqa: SLF001  a copy of itself
        return other

    def section(self, z: Real, omega: float, turns: int) -> Real:
        """States after 1, 2, ... ``turns`` of the solver's turns from z, (turns, 2 N).

        Raises
        ------
        IncompleteError
            When the flow over a turn does not end.
        """
        record = np.empty((turns, z.size))
        while True:
            code = strobe(self.turn, np.array(z), omega, record)
            if code == status.OK:
                return record
            if code != status.MISSING_CONFIGURATION:
                raise IncompleteError(f"the flow over one turn at {omega:.6g} rad/s did not end")
            self.add_configuration(self.turn.flow)

    def motion(self, u: Real, omega: float) -> Motion:
        states = np.array(u)[None]
        every = np.eye(self.system.size)
        low, _, _ = self._observe(states, np.array([omega]), every, whole_turn=True)
        if np.isnan(low).any():
            raise IncompleteError(f"the flow over one turn at {omega:.6g} rad/s did not end")
        flow = self.turn.flow
        pieces = Pieces.recorded(flow, flow.modes)
        period = 2.0 * np.pi / omega * self.turn.fraction
        return PiecewiseMotion(
            self.system, omega, period, pieces, self.builder.plan, flow.drive.copy()
        )

    def _observe(
        self,
        states: Real,
        omega: Real,
        coordinates: Real,
        *,
        whole_turn: bool = False,
        waiting: int = 0,
    ) -> tuple[Real, Real, Complex]:
        """Flow over a turn from each state, which becomes the one after ``waiting`` turns.

        Half a turn tells all of a motion that is its own mirror image after it.
        """
        # A read-only array is another type to the compiler, and would be compiled for anew.
        coordinates, omega = np.array(coordinates), np.array(omega)
        count = coordinates.shape[0]
        shape = (omega.size, count)
        low, high, first = np.empty(shape), np.empty(shape), np.empty(shape, np.complex128)
        code = np.zeros(omega.size, np.int64)
        begin = states.copy()
        while True:
            problem = self.turn if whole_turn else self.problem
            modes = self.builder.plan.rate.shape[1] + 1
            scratch = new_gap_motion(count, np.zeros(modes, np.complex128))
            observe_flow(
                problem, states, omega, waiting, coordinates, scratch, low, high, first, code
            )
            if not np.any(code == status.MISSING_CONFIGURATION):
                break
            self.add_configuration(problem.flow)
            states[:] = begin
        bad = code != status.OK
        low[bad], high[bad], first[bad] = np.nan, np.nan, np.nan
        return low, high, first

    def unknowns_from(self, motion: Motion) -> Real:
        return np.concatenate([motion.derivative(0.0, 0), motion.derivative(0.0, 1)])
