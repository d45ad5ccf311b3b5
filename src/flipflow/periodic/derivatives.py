"""Exact derivatives of a periodic motion with respect to parameters of its machine and to omega.

With the flow phi over the period, or half of it with sign, z = phi(z, p) gives

    z_p = (I - M)^-1 phi_p,

M the monodromy matrix. Columns stand for the P parameters in their order, omega last. Along the
motion derivatives are taken at a fixed phase omega t of the force, so that all of them repeat with
the motion.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled import status
from flipflow.compiled.arrays import Complex, Real
from flipflow.compiled.eigen import new_schur
from flipflow.dynamics.machine_columns import MachineColumns
from flipflow.dynamics.motion import Motion, motion_of_flow
from flipflow.dynamics.multiplier_slopes import multiplier_slopes, new_multiplier_work
from flipflow.dynamics.parameter_tangent import new_column_work
from flipflow.dynamics.parameter_variation import columns_at, slopes_along
from flipflow.errors import IncompleteError, InputError
from flipflow.model.contact_law import shares, signed_gap
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.near_grazing import GRAZES
from flipflow.periodic.parameter_shooting import residual_columns
from flipflow.periodic.shooting import Shooting
from flipflow.periodic.solver import Formulation
from flipflow.periodic.stability import full_turn

Pieces = NDArray[np.intp]
SINGULAR = 1e-9  # share of the largest singular value of I - M below which the least one is none
NEWTON = 6  # steps towards the summit of a path at a gap
SAMPLES = 2048  # times of a period at which a grazing touch is looked for
SMOOTH_LAWS = ("paper", "elasto-gap")  # under which a motion that grazes has a derivative
FOLDED = (
    "The motion stands at a fold, where it moves infinitely fast with every parameter; ask the "
    "special point how its speed moves."
)


class MotionDerivatives:
    """A periodic motion and its derivatives with respect to P parameters and omega.

    Parameters
    ----------
    formulation
        What was solved; of an exact motion.
    z, omega
        State at t = 0 and frequency.
    columns
        How the machine changes with the parameters.

    Raises
    ------
    InputError
        For a motion that is no exact one, and for a derivative that the contact law does not have.
    IncompleteError
        Where the flow over the period does not end.
    """

    def __init__(
        self, formulation: Formulation, z: Real, omega: float, columns: MachineColumns
    ) -> None:
        if formulation.kind is not ExactSolver:
            remedy = "derivatives are those of exact motions; follow it by ff.PiecewiseExact()"
            raise InputError("orbit", formulation.kind.__name__, remedy)
        self.solver = ExactSolver(
            formulation.system, half_turn=formulation.half_turn, turns=formulation.turns
        )
        self.z, self.omega, self.columns = np.array(z), float(omega), columns
        self.parameters = columns.solved.static.shape[0]
        self.work = new_column_work(self.solver.machine, self.parameters)
        self._flown = 0.0  # fraction of a period that the flow holds
        self._refuse_one_sided_damping()

    @property
    def half_turn(self) -> bool:
        """Whether half a turn tells all: of a motion and parameters that keep the symmetry."""
        return self.solver.half_turn and self.columns.keeps_mirror

    @cached_property
    def problem(self) -> Shooting:
        """The shooting problem over half the period or all of it."""
        return self.solver.shooting(half_turn=self.half_turn)

    @cached_property
    def residual_slopes(self) -> tuple[Real, Real]:
        """dr/dz (2 N, 2 N) and dr/dp (2 N, P + 1) of the residual phi(z, p) - z."""
        return self._slopes_of(self.problem)

    @cached_property
    def scale(self) -> Real:
        """What is of one size in each component of the state, (2 N,).

        Coordinates may have units of their own, metres beside radians, which their masses tell;
        rates are larger than displacements by omega.
        """
        sizes = 1.0 / np.sqrt(np.diag(self.solver.system.M))
        return np.concatenate([sizes, self.omega * sizes])

    @cached_property
    def state(self) -> Real:
        """z_p of the state at t = 0, (2 N, P + 1).

        Raises
        ------
        IncompleteError
            At a fold.
        """
        J, D = self.residual_slopes
        scale = self.scale
        sizes = np.linalg.svd(J * scale / scale[:, None], compute_uv=False)
        if not sizes[-1] > SINGULAR * max(sizes[0], 1.0):
            raise IncompleteError(FOLDED)
        return np.asarray(np.linalg.solve(J, -D))

    @cached_property
    def motion(self) -> Motion:
        """The motion over the whole period."""
        self._fly(self.solver.whole)
        period = 2.0 * np.pi * self.solver.turns / self.omega
        return motion_of_flow(self.solver.system, self.solver.flow, self.omega, period)

    @cached_property
    def _along(self) -> tuple[Real, Real]:
        """Derivatives at the segments' starts and of the segments' limits, both at fixed time."""
        starts, _, shift = self._carried(self.solver.whole)
        return starts, shift

    @cached_property
    def shifts(self) -> Real:
        """How the limits of the pieces move at a fixed phase of the force, (E + 1, P + 1), in s."""
        shift = self._along[1].copy()
        ends = np.append(self.motion.start, self.motion.start[-1] + self.motion.length[-1])
        shift[:, -1] += ends / self.omega
        shift[[0, -1]] = 0.0
        return shift

    def at(self, t: Real, piece: Pieces) -> tuple[Real, Real, Real]:
        """Derivatives of x, x' and x'' at times in given pieces, (K, N, P + 2) each.

        The last column is the derivative in time.
        """
        starts = self._along[0]
        out = np.zeros((t.size, *self.state.shape))
        machine, flow = self.solver.machine, self.solver.flow
        self._fly(self.solver.whole)
        columns_at(
            machine, flow, self.omega, self.columns.solved, starts, np.array(t),
            np.array(piece, np.int64), out, self.work,
        )  # fmt: skip
        x, v, a = (self.motion.piece_derivative(t, piece, order) for order in range(3))
        n = x.shape[1]
        dx, dv = out[:, :n], out[:, n:]
        da = self._accelerations(t, piece, x, v, a, dx, dv)
        jerk = self._jerk(t, piece, v, a)
        later = t[:, None] / self.omega
        moved = []
        for slope, rate in ((dx, v), (dv, a), (da, jerk)):
            slope[:, :, -1] -= later * rate
            moved.append(np.concatenate([slope, rate[:, :, None]], axis=2))
        return moved[0], moved[1], moved[2]

    @cached_property
    def multipliers(self) -> tuple[Complex, Complex]:
        """Floquet multipliers of the period (2 N,), largest first, and their derivatives.

        Those are (2 N, P + 1), NaN where two multipliers coincide and may part as a square root.
        """
        value, slope = self.eigenvalues
        if self.half_turn:
            slope = 2.0 * value[:, None] * slope
        order = np.argsort(-np.abs(value), kind="stable")
        return full_turn(value, half_turn=self.half_turn), slope[order]

    @cached_property
    def eigenvalues(self) -> tuple[Complex, Complex]:
        """Eigenvalues of the return map (2 N,) and their derivatives (2 N, P + 1)."""
        solver = self.solver
        _, tangents, shift = self._carried(self.problem)
        value = np.linalg.eigvals(self.problem.sign * tangents[-1]).astype(complex)
        slope = np.full((value.size, self.parameters + 1), np.nan, complex)
        multiplier_slopes(
            solver.machine, solver.flow, self.omega, self.columns.solved, self.problem.sign, False,
            shift, tangents, value, new_schur(value.size),
            new_multiplier_work(value.size, self.parameters), self.work, slope,
        )  # fmt: skip
        return value, slope

    def require_smooth(self, *, roots: bool = False) -> None:
        """Refuse a motion that grazes a stop where the derivative has two sides.

        Parameters
        ----------
        roots
            Whether multipliers or times of contact are asked for: beside any grazing they move as
            a square root.

        Raises
        ------
        IncompleteError
            Where it grazes a stop whose law kicks on entry, or any one and ``roots`` holds.
        """
        for j, spring in enumerate(self.solver.springs):
            corner = spring.damping > 0.0 and spring.law not in SMOOTH_LAWS
            if (corner or roots) and self._grazes(j):
                what = "its multipliers and times of contact have" if roots else "it has"
                raise IncompleteError(
                    f"The motion grazes stop {j} at {self.omega:.9g} rad/s, where {what} another "
                    "derivative to each side; ask a little beside it."
                )

    def _grazes(self, j: int) -> bool:
        """Whether the path at a gap turns back just there."""
        motion, spring = self.motion, self.solver.springs[j]
        t, piece = motion.samples(SAMPLES * self.solver.turns)
        y, v = (motion.piece_derivative(t, piece, k) @ spring.direction for k in range(2))
        turn = np.flatnonzero((v[:-1] * v[1:] <= 0.0) & (np.diff(piece) == 0))
        if turn.size == 0:
            return False
        low, high, where = t[turn], t[turn + 1], piece[turn]
        top = 0.5 * (low + high)
        for _ in range(NEWTON):
            rate, bend = (motion.piece_derivative(top, where, k) @ spring.direction for k in (1, 2))
            step = np.divide(rate, bend, out=np.zeros(rate.shape), where=bend != 0.0)
            top = np.clip(top - step, low, high)
        tops = motion.piece_derivative(top, where, 0) @ spring.direction
        gaps = np.array([spring.gaps[0], -spring.gaps[1]])
        away = float(np.min(np.abs(np.subtract.outer(tops, gaps))))
        return away < GRAZES * float(np.abs(y).max())

    def _refuse_one_sided_damping(self) -> None:
        """A damper that acts on the way in alone has no derivative at zero damping."""
        touched = np.flatnonzero(self.columns.parts["stop"][:, 1].any(axis=0))
        for j, spring in enumerate(self.solver.springs):
            if j in touched and spring.damping == 0.0 and spring.law == "undamped-rebound":
                remedy = "give the undamped-rebound stop some damping first"
                raise InputError("damping", spring.damping, remedy)

    def _slopes_of(self, problem: Shooting) -> tuple[Real, Real]:
        """dr/dz and dr/dp of a shooting problem; its flow stays recorded."""
        size = self.z.size
        r, J = np.empty(size), np.empty((size, size + 1))
        D = np.empty((size, self.parameters))
        code = residual_columns(
            problem, self.solver.shooting_work, self.z, self.omega, self.columns.solved, self.work,
            r, J, D,
        )  # fmt: skip
        if code != status.OK:
            raise IncompleteError(f"the flow over one turn at {self.omega:.6g} rad/s did not end")
        self._flown = problem.fraction
        return J[:, :size].copy(), np.column_stack([D, J[:, size]])

    def _fly(self, problem: Shooting) -> None:
        """Let the flow hold the motion over a problem's part of the period."""
        if self._flown != problem.fraction:
            self._slopes_of(problem)

    def _carried(self, problem: Shooting) -> tuple[Real, Real, Real]:
        """Columns and maps at the limits of the segments of a problem's flow, and their shifts."""
        state = self.state  # over half a turn it may fly that half
        self._fly(problem)
        flow, (size, columns) = self.solver.flow, state.shape
        limits = int(flow.segments[0]) + 1
        starts, shift = np.zeros((limits, size, columns)), np.zeros((limits, columns))
        tangents = np.zeros((limits, size, size))
        slopes_along(
            self.solver.machine, flow, self.omega, self.columns.solved, state, starts, tangents,
            np.zeros_like(state), shift, self.work,
        )  # fmt: skip
        return starts, tangents, shift

    def _shares(self, piece: Pieces) -> Iterator[tuple[Real, Real, Real]]:
        """f_k, f_c and the gap's position of each stop in given pieces, (K,) each."""
        for j, spring in enumerate(self.solver.springs):
            regime = self.motion.regime[piece, j]
            f_k, f_c = shares(spring.law, regime)
            yield f_k, f_c, np.where(f_k != 0.0, signed_gap(regime, spring.gaps), 0.0)

    def _answer(self, piece: Pieces, dx: Real, dv: Real) -> Real:
        """Acceleration (K, N, C) that disturbances dx, dv (K, N, C) of the state bring."""
        machine = self.solver.machine
        a = -(machine.stiffness @ dx + machine.damping @ dv)
        for j, (f_k, f_c, _) in enumerate(self._shares(piece)):
            k, c, d = machine.stops.stiffness[j], machine.stops.damping[j], machine.direction[j]
            force = (f_k * k)[:, None] * (d @ dx) + (f_c * c)[:, None] * (d @ dv)
            a -= machine.reach[j][:, None] * force[:, None, :]
        return np.asarray(a)

    def _jerk(self, t: Real, piece: Pieces, v: Real, a: Real) -> Real:
        """x''' (K, N)."""
        jerk = self._answer(piece, v[:, :, None], a[:, :, None])[:, :, 0]
        machine, w = self.solver.machine, self.omega
        for push, power, wave in zip(machine.push, machine.power, machine.wave, strict=True):
            turning = 1j * machine.order[wave] * w
            jerk += ((turning * w**power * np.exp(turning * t))[:, None] * push).real
        return np.asarray(jerk)

    def _drive_slope(self, t: Real) -> Real:
        """Derivative in omega of the excitation's acceleration at fixed time, (K, N)."""
        machine, w = self.solver.machine, self.omega
        slope = np.zeros((t.size, machine.direction.shape[1]))
        for push, power, wave in zip(machine.push, machine.power, machine.wave, strict=True):
            turning = 1j * machine.order[wave]
            turn = (power / w + turning * t) * w**power * np.exp(turning * w * t)
            slope += (turn[:, None] * push).real
        return slope

    def _accelerations(
        self, t: Real, piece: Pieces, x: Real, v: Real, a: Real, dx: Real, dv: Real
    ) -> Real:
        """Derivatives of x'' at fixed time, (K, N, P + 1)."""
        machine, c = self.solver.machine, self.columns.solved
        found = self._answer(piece, dx, dv)
        found[:, :, -1] += self._drive_slope(t)
        turning = 1j * self.omega * machine.order[machine.wave]
        turn = np.exp(np.outer(t, turning)) * self.omega**machine.power
        push = np.einsum("ke,per->kpr", turn, c.push).real + c.static
        for matrix, motion in ((c.inertia, a), (c.damping, v), (c.stiffness, x)):
            push -= np.einsum("prs,ks->kpr", matrix, motion)
        for j, (f_k, f_c, gap) in enumerate(self._shares(piece)):
            side = np.sign(self.motion.regime[piece, j])[:, None]
            moved = np.where(side > 0, c.gap[:, j, 0], np.where(side < 0, -c.gap[:, j, 1], 0.0))
            k, damping, d = (
                machine.stops.stiffness[j], machine.stops.damping[j], machine.direction[j],
            )  # fmt: skip
            depth, rate, turned = (x @ d - gap)[:, None], (v @ d)[:, None], c.direction[:, j].T
            force = f_k[:, None] * k * depth + f_c[:, None] * damping * rate
            slope = f_k[:, None] * (c.stop_stiffness[:, j] * depth + k * (x @ turned - moved))
            slope += f_c[:, None] * (c.stop_damping[:, j] * rate + damping * (v @ turned))
            push -= force[:, :, None] * c.reach[:, j] + slope[:, :, None] * machine.reach[j]
        found[:, :, :-1] += push.swapaxes(1, 2)
        return found
