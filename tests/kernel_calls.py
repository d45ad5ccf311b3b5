"""Kernels that only other kernels call, made callable for tests; cached as the package's own."""

from __future__ import annotations

import math

import numpy as np

from flipflow.batch.lane_path import predict as predict_lane
from flipflow.compiled import status
from flipflow.compiled.compile import kernel
from flipflow.compiled.dense import lu_factor, lu_sign, lu_solve, lu_spread
from flipflow.continuation.correction import Course, new_corrector
from flipflow.continuation.frequency_loop import new_branch, predict
from flipflow.continuation.refinement import TRACE_ALL, follow
from flipflow.continuation.varied import varied_carried, varied_residual
from flipflow.dynamics.contact_search import extremes, next_change, prepare_search
from flipflow.dynamics.flow import contact_number, saltation
from flipflow.dynamics.law import force, regime_at, stored_energy
from flipflow.dynamics.machine_series import set_machine
from flipflow.periodic.shooting import shooting_step
from flipflow.periodic.two_event import force_excess

NO_STEPS = Course(0.0, math.inf, math.nan, math.nan, 1.0, 1.0)


@kernel(entry=True)
def solve(A, pivot, b):
    """Solution in b, factors in A; the determinant's sign, 0 for a singular matrix."""
    if not lu_factor(A, pivot):
        return 0.0
    lu_solve(A, pivot, b)
    return lu_sign(A, pivot)


@kernel(entry=True)
def spread(A, pivot, b):
    """``lu_spread`` of a matrix, of which the factors are left in A."""
    lu_factor(A, pivot)
    return lu_spread(A, pivot, b)


@kernel(entry=True)
def change_after(motion, stops, regime, horizon, fired):
    """``next_change`` with all terms of the motion."""
    return next_change(motion, stops, regime, motion.rate.shape[0], horizon, fired)


@kernel(entry=True)
def range_of(motion, duration):
    """``extremes`` of the first gap."""
    prepare_search(motion, motion.rate.shape[0])
    return extremes(motion, motion.rate.shape[0], 0, duration)


@kernel(entry=True)
def law_of_spring(stops, regime, y, v, found):
    """``force``, ``stored_energy`` and ``regime_at`` of the first spring at K states, (K, 3)."""
    for k in range(y.shape[0]):
        found[k, 0] = force(stops, 0, regime[k], y[k], v[k])
        found[k, 1] = stored_energy(stops, 0, regime[k], y[k])
        found[k, 2] = regime_at(stops, 0, y[k], v[k])


def shoot(problem, work, z, omega, r, J):
    """``shooting_residual``, by the package's own entry to it."""
    return shooting_step(problem, work, z, omega, r, J)[0]


@kernel(entry=True)
def lane_guess(work, omega):
    """``predict`` of a lane: its guess in work.guess."""
    predict_lane(work, omega)


def balance(problem, work, u, omega, r, J):
    """``balance_residual`` or ``sampled_residual``, by the loop that follows branches.

    The loop is compiled already, and of these alone it would be compiled anew. Its first correction
    begins with the residual at (u, omega), and ends there for want of a length of its steps.
    """
    corrector = new_corrector(u.size, np.ones(1))
    corrector.r[:], corrector.J[:] = np.nan, np.nan
    record = new_branch(u.size, 1, 1, with_jacobian=False)
    follow(problem, work, corrector, record, u, omega, NO_STEPS, TRACE_ALL, 0.0, 0.0, 0)
    r[:], J[:] = corrector.r, corrector.J
    return status.OK if np.isfinite(J).all() else status.NOT_FINITE


@kernel(entry=True)
def excess(machine, flow, work, omega, share):
    """``force_excess``."""
    return force_excess(machine, flow, work, omega, share)


@kernel(entry=True)
def jump(machine, spring, sign, U):
    """``saltation``."""
    saltation(machine, spring, sign, U, U.shape[0])


def residual_of(call, problem, work, unknowns: int):
    """A Python function (u, omega) -> (r, J) of a residual kernel."""

    def evaluate(u: np.ndarray, omega: float) -> tuple[np.ndarray, np.ndarray]:
        r, J = np.zeros(unknowns), np.zeros((unknowns, unknowns + 1))
        code = call(problem, work, np.ascontiguousarray(u), float(omega), r, J)
        assert code == 0, f"status {code}"
        return r, J

    return evaluate


def central_differences(evaluate, u: np.ndarray, omega: float, steps: np.ndarray) -> np.ndarray:
    """[dr/du, dr/d omega] by central differences; the last step is that of omega."""
    columns = []
    for k, h in enumerate(steps):
        d = np.zeros(u.size)
        if k < u.size:
            d[k] = h
        dw = h if k == u.size else 0.0
        ahead, behind = evaluate(u + d, omega + dw)[0], evaluate(u - d, omega - dw)[0]
        columns.append((ahead - behind) / (2.0 * h))
    return np.array(columns).T


@kernel(entry=True)
def predicted(work, step, course, bends):
    """``predict``."""
    return predict(work, step, course, bends)


@kernel(entry=True)
def number_of(flow, sided):
    """``contact_number``."""
    return contact_number(flow, sided)


@kernel(entry=True)
def varied(problem, work, u, value, r, J):
    """``varied_residual``."""
    return varied_residual(problem, work, u, value, r, J)


@kernel(entry=True)
def varied_to(problem, work, w, tangent, end):
    """``varied_carried``."""
    return varied_carried(problem, work, w, tangent, end)


@kernel(entry=True)
def series_machine(series, work, value, beside, machine):
    """``set_machine``."""
    return set_machine(series, work, value, beside, machine)
