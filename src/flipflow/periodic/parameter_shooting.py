"""Derivatives of the shooting residual with respect to parameters of the machine."""

from __future__ import annotations

from flipflow.compiled import status
from flipflow.compiled.arrays import Real
from flipflow.compiled.compile import kernel
from flipflow.dynamics.parameter_tangent import Columns, ColumnWork, carry_columns
from flipflow.periodic.shooting import Shooting, ShootingWork, shooting_residual


@kernel(inline=True)
def parameter_residual(
    problem: Shooting,
    work: ShootingWork,
    omega: float,
    columns: Columns,
    scratch: ColumnWork,
    D: Real,
) -> None:
    """D = dr/dp, (2 N, P), of the motion that ``shooting_residual`` has just flown."""
    for k in range(D.shape[0]):
        for p in range(D.shape[1]):
            D[k, p] = 0.0
    carry_columns(problem.machine, work.flow, omega, columns, D, scratch)
    for k in range(D.shape[0]):
        for p in range(D.shape[1]):
            D[k, p] *= problem.sign


@kernel(entry=True)
def residual_columns(
    problem: Shooting,
    work: ShootingWork,
    z: Real,
    omega: float,
    columns: Columns,
    scratch: ColumnWork,
    r: Real,
    J: Real,
    D: Real,
) -> int:
    """``shooting_residual``, and its derivatives D (2 N, P) with respect to P parameters."""
    code = shooting_residual(problem, work, z, omega, r, J)
    if code == status.OK:
        parameter_residual(problem, work, omega, columns, scratch, D)
    return code
