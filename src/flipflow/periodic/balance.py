r"""Harmonic balance, exact at the contact and condensed to the motion at the gaps.

With theta = omega t and y_j = Re sum_h A_hj exp(i h theta), the linear part of the machine answers
the contact forces through its receptance G_h(omega), so that only the A_hj are unknown:

    r_h = A_h + G_h Lambda_h(A) - delta_h1 A_linear.

Lambda_h are the Fourier coefficients of the contact force over its intervals of contact, whose
limits are found by the certified search and never sampled. With the penetration p, zero at a
limit that lies at the gap, integration by parts turns the force k p + c p' into

    Lambda_h = (k + i c omega h) p_h + boundary,

where the boundary is left only by a clipped spring that lets go beyond its gap. In the same form
the derivative needs no term for the moving limits: what they add to dLambda_h / dA_l cancels
against (k + i c omega l) - (k + i c omega h).
"""

from __future__ import annotations

import math

from flipflow.compiled import status
from flipflow.compiled.compile import kernel
from flipflow.dynamics.contact_search import reciprocal
from flipflow.dynamics.flow import prepare_drive
from flipflow.dynamics.plan import Real
from flipflow.periodic.series import (
    Balance,
    amplitude_of,
    contact_integrals,
    place,
    record_contacts,
    set_series,
    whole_integral,
)


@kernel(inline=True)
def prepare_receptance(problem: Balance, omega: float) -> None:
    """G_h = D (K - h^2 omega^2 M + i h omega C)^-1 D^T by modes, and its derivative in omega."""
    plan = problem.plan
    m = problem.linear.shape[0]
    n = plan.direction.shape[1]
    prepare_drive(plan, problem.flow, 0, omega)
    for j in range(m):
        problem.linear[j] = 0.0
        problem.linear_slope[j] = 0.0
        for k in range(n):
            problem.linear[j] += plan.direction[j, k] * problem.flow.drive[0, k]
            problem.linear_slope[j] += plan.direction[j, k] * problem.flow.drive_slope[0, k]
    for a in range(problem.harmonics.shape[0]):
        h = problem.harmonics[a]
        for j in range(m):
            for c in range(m):
                total = 0j
                slope = 0j
                for i in range(plan.mode_count[0]):
                    share = plan.gap_shape[0, j, i] * plan.gap_pick[i, c]
                    gap = reciprocal(1j * (h * omega) - plan.rate[0, i])
                    total += share * gap
                    slope -= 1j * h * share * gap * gap
                    if plan.weight[0, i] == 2.0:
                        gap = reciprocal(1j * (h * omega) - plan.rate[0, i].conjugate())
                        total += share.conjugate() * gap
                        slope -= 1j * h * share.conjugate() * gap * gap
                problem.receptance[a, j, c] = total
                problem.receptance_slope[a, j, c] = slope


@kernel(inline=True)
def contact_forces(problem: Balance, omega: float) -> None:
    """Lambda_h and its derivative in omega at fixed A, from the integrals."""
    plan = problem.plan
    for j in range(problem.linear.shape[0]):
        for a in range(problem.harmonics.shape[0]):
            h = problem.harmonics[a]
            depth = -problem.integral_gap[j, h].conjugate()
            for b in range(problem.harmonics.shape[0]):
                k = problem.harmonics[b]
                A = amplitude_of(problem, b, j)
                if k == 0:
                    depth += A * whole_integral(problem, j, -h)
                else:
                    depth += 0.5 * A * whole_integral(problem, j, k - h)
                    depth += 0.5 * A.conjugate() * whole_integral(problem, j, -k - h)
            share = 1.0 / math.pi if h > 0 else 0.5 / math.pi
            k_spring, c = plan.stiffness[j], plan.damping[j]
            edge = problem.edge_depth[j, h]
            problem.force[a, j] = share * (
                (k_spring + 1j * c * omega * h) * depth + c * omega * edge
            )
            problem.force_slope[a, j] = share * c * (1j * h * depth + edge)


@kernel(inline=True)
def balance_residual(problem: Balance, u: Real, omega: float, r: Real, J: Real) -> int:
    """r_h = A_h + G_h Lambda_h - delta_h1 A_linear and J = [dr/du, dr/d omega], all real."""
    set_series(problem, u)
    prepare_receptance(problem, omega)
    code = record_contacts(problem, omega)
    if code != status.OK:
        return code
    contact_integrals(problem, omega)
    contact_forces(problem, omega)
    _jacobian(problem, omega, J)
    return write_residual(problem, r, J)


@kernel(inline=True)
def write_residual(problem: Balance, r: Real, J: Real) -> int:
    """r and dr/d omega, the last column of J, from the forces of the series last set."""
    m, size = problem.linear.shape[0], r.shape[0]
    for a in range(problem.harmonics.shape[0]):
        h = problem.harmonics[a]
        for j in range(m):
            value = amplitude_of(problem, a, j)
            slope = 0j
            if h == 1:
                value -= problem.linear[j]
                slope -= problem.linear_slope[j]
            for c in range(m):
                value += problem.receptance[a, j, c] * problem.force[a, c]
                slope += problem.receptance_slope[a, j, c] * problem.force[a, c]
                slope += problem.receptance[a, j, c] * problem.force_slope[a, c]
            k = place(problem, a, j)
            r[k] = value.real
            J[k, size] = slope.real
            if h > 0:
                r[k + 1] = value.imag
                J[k + 1, size] = slope.imag
    for k in range(size):
        if not math.isfinite(r[k]):
            return status.NOT_FINITE
    return status.OK


@kernel(inline=True)
def _jacobian(problem: Balance, omega: float, J: Real) -> None:
    """dr = c1 dA + c2 conj(dA): Toeplitz (l - h) and Hankel (-l - h) parts of the integrals."""
    plan = problem.plan
    m = problem.linear.shape[0]
    middle = problem.integral.shape[1] - 1
    for a in range(problem.harmonics.shape[0]):
        h = problem.harmonics[a]
        share = 0.5 / math.pi if h > 0 else 0.25 / math.pi
        for b in range(problem.harmonics.shape[0]):
            k = problem.harmonics[b]
            for c in range(m):
                dynamic = plan.stiffness[c] + 1j * plan.damping[c] * omega * h
                # What the moving limit of a clipped spring adds; zero for limits at the gap.
                moving = plan.damping[c] * omega
                direct = share * (
                    dynamic * whole_integral(problem, c, k - h)
                    + moving * problem.edge[c, k - h + middle]
                )
                mirror = share * (
                    dynamic * whole_integral(problem, c, -k - h)
                    + moving * problem.edge[c, -k - h + middle]
                )
                for j in range(m):
                    G = problem.receptance[a, j, c]
                    unit = 1.0 if a == b and j == c else 0.0
                    write_block(problem, a, j, b, c, G * direct, G * mirror, unit, J)


@kernel(inline=True)
def write_block(
    problem: Balance, a: int, j: int, b: int, c: int, direct: complex, mirror: complex,
    unit: float, J: Real,
) -> None:  # fmt: skip
    """Real block of c1 dA + c2 conj(dA) for harmonic a at gap j against harmonic b at gap c."""
    row, column = place(problem, a, j), place(problem, b, c)
    with_real = direct + mirror
    with_imag = 1j * (direct - mirror)
    J[row, column] = with_real.real + unit
    if problem.harmonics[a] > 0:
        J[row + 1, column] = with_real.imag
    if problem.harmonics[b] > 0:
        J[row, column + 1] = with_imag.real
        if problem.harmonics[a] > 0:
            J[row + 1, column + 1] = with_imag.imag + unit


@kernel(inline=True)
def series_scale(problem: Balance, u: Real, omega: float, scale: Real) -> None:  # noqa: ARG001
    """Size of each unknown: the largest amplitude of all."""
    size = problem.linear.shape[0] * (2 * problem.harmonics.shape[0])
    if problem.harmonics[0] == 0:
        size -= problem.linear.shape[0]
    largest = problem.length
    for k in range(size):
        largest = max(largest, abs(u[k]))
    for k in range(size):
        scale[k] = largest
