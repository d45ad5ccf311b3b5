"""Exact periodic motions: shooting on the closed-form flow."""

from __future__ import annotations

import copy

import numpy as np

from flipflow.compiled import status
from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.compiled.interruptible import interruptible
from flipflow.dynamics.contact_search import new_gap_motion
from flipflow.dynamics.flow import Flow
from flipflow.dynamics.motion import Motion, motion_of_flow
from flipflow.errors import IncompleteError
from flipflow.model.system import MechanicalSystem
from flipflow.periodic.readings import observe_flow
from flipflow.periodic.shooting import shooting_step
from flipflow.periodic.solver import Solver
from flipflow.periodic.turn_by_turn import settle_lanes


class ExactSolver(Solver):
    """Unknown: the state (x, x') at t = 0, where the unbalance points along +x.

    ``turns`` forcing periods pass before the motion repeats. With ``half_turn`` their number is
    odd, and the motion is its own mirror image after half of them.
    """

    reads_jacobian = True
    unit = " rad/s"  # of the parameter over which motions are followed
    branches_off = True  # whether its branches may meet those of other symmetry or fewer turns

    def __init__(self, system: MechanicalSystem, *, half_turn: bool, turns: int = 1) -> None:
        super().__init__(system, half_turn=half_turn, turns=turns)
        self.unknowns = 2 * self.system.size
        self.scratch = self.shooting_work
        self.problem = self.shooting(half_turn=half_turn)
        self.whole = self.shooting(half_turn=False)
        self.contacts = 0  # contact number of the last residual's motion

    @property
    def flow(self) -> Flow:
        return self.shooting_work.flow

    def like(self, *, half_turn: bool, turns: int) -> ExactSolver:
        """A solver of the same machine's motions of another kind."""
        return ExactSolver(self.system, half_turn=half_turn, turns=turns)

    def frequency(self, at: float) -> float:
        """Frequency in rad/s of motions at a value of the parameter that is followed."""
        return at

    def residual(self, z: Real, omega: float) -> tuple[Real, Real] | None:
        """r = sign flow(z) - z and [dr/dz, dr/d omega]; None where the flow does not end."""
        r, J = np.empty(self.unknowns), np.empty((self.unknowns, self.unknowns + 1))
        code, self.contacts = shooting_step(self.problem, self.scratch, np.array(z), omega, r, J)
        return (r, J) if code == status.OK else None

    def return_maps(self, u: Real, omega: Real, jacobian: Real) -> Real:
        if jacobian.shape[1:] == (self.unknowns, self.unknowns):
            return np.asarray(jacobian + np.eye(self.unknowns))
        solved = (self.residual(z, float(w)) for z, w in zip(u, omega, strict=True))
        unknown = np.full((self.unknowns, self.unknowns), np.nan)
        return np.array(
            [unknown if one is None else one[1][:, :-1] + np.eye(self.unknowns) for one in solved]
        )

    def states(self, u: Real, omega: Real) -> Real:  # noqa: ARG002
        return u

    def series(self, u: Real, omega: Real) -> tuple[Int, Complex]:
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
        other.problem = other.whole = other.shooting(half_turn=False)
        other.__dict__.pop("formulation", None)
        return other

    def section(self, z: Real, omega: float, turns: int) -> Real:
        """States after 1, 2, ... ``turns`` of the solver's turns from z, (turns, 2 N).

        Raises
        ------
        IncompleteError
            When the flow over a turn does not end.
        """
        record, states = np.empty((1, turns, z.size)), np.array(z)[None]
        nothing = np.zeros((0, z.size)), np.zeros((0, z.size, z.size)), np.zeros(0, np.int64)
        label, run, code = (np.zeros(1, np.int64) for _ in range(3))
        interruptible(
            lambda: settle_lanes(
                self.whole, self.scratch, states, np.zeros(1), omega, *nothing, turns, record,
                label, run, code,
            ),
            self.flow.stop,
            work=turns * self.turns * self.system.size**2,
        )  # fmt: skip
        if code[0] != status.OK:
            raise IncompleteError(f"the flow over one turn at {omega:.6g} rad/s did not end")
        return np.asarray(record[0])

    def motion(self, u: Real, omega: float) -> Motion:
        states = np.array(u)[None]
        every = np.eye(self.system.size)
        low, _, _ = self._observe(states, np.array([omega]), every, whole_turn=True)
        if np.isnan(low).any():
            raise IncompleteError(f"the flow over one turn at {omega:.6g} rad/s did not end")
        period = 2.0 * np.pi / omega * self.whole.fraction
        return motion_of_flow(self.system, self.flow, omega, period)

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
        problem = self.whole if whole_turn else self.problem
        modes = self.flow.modes.rate.shape[1] + self.machine.order.size
        scratch = new_gap_motion(count, np.zeros(modes, np.complex128))
        interruptible(
            lambda: observe_flow(
                problem, self.scratch, states, omega, waiting, coordinates, scratch, low, high,
                first, code,
            ),
            self.flow.stop,
            work=omega.size * (1 + waiting) * self.turns * self.system.size**2,
        )  # fmt: skip
        bad = code != status.OK
        low[bad], high[bad], first[bad] = np.nan, np.nan, np.nan
        return low, high, first

    def unknowns_from(self, motion: Motion) -> Real:
        return np.concatenate([motion.derivative(0.0, 0), motion.derivative(0.0, 1)])
