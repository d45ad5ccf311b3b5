r"""Harmonic balance, exact at the contact and condensed to the motion at the gaps.

With theta = omega t and y_j = Re sum_h A_hj exp(i h theta), the linear part of the machine answers
the contact forces through its receptance G_h(omega), so that only the A_hj are unknown:

    r_h = A_h + G_h Lambda_h(A) - A_linear,h.

Lambda_h are the Fourier coefficients of the contact force over its intervals of contact, whose
limits are found by the certified search and never sampled. With the penetration p, zero at a
limit that lies at the gap, integration by parts turns the force k p + c p' into

    Lambda_h = (k + i c omega h) p_h + boundary,

where only a clipped spring, which lets go beyond its gap, has a boundary term. In the same form the
derivative needs no term for the moving limits: what they add to dLambda_h / dA_l cancels
against (k + i c omega l) - (k + i c omega h).
"""

from __future__ import annotations

import math

from flipflow.compiled import status
from flipflow.compiled.arrays import Real
from flipflow.compiled.compile import kernel
from flipflow.dynamics.contact_search import reciprocal
from flipflow.dynamics.flow import prepare_drive
from flipflow.dynamics.modes import prepare
from flipflow.periodic.series import (
    Balance,
    BalanceWork,
    amplitude_of,
    contact_integrals,
    place,
    record_contacts,
    set_series,
    whole_integral,
)


@kernel(inline=True)
def prepare_receptance(problem: Balance, work: BalanceWork, omega: float) -> int:
    """G_h = D (K - h^2 omega^2 M + i h omega C)^-1 D^T by modes, and its derivative in omega."""
    machine, modes = problem.machine, work.flow.modes
    m = machine.direction.shape[0]
    if modes.ready[0] == 0:
        prepare(machine, modes, 0)
    if modes.ready[0] < 0:
        return status.NO_MODES
    prepare_drive(machine, work.flow, 0, omega)
    _set_linear(problem, work)
    for a in range(problem.harmonics.shape[0]):
        h = problem.harmonics[a]
        for j in range(m):
            for c in range(m):
                total = 0j
                slope = 0j
                for i in range(modes.mode_count[0]):
                    share = modes.gap_shape[0, j, i] * modes.gap_pick[0, i, c]
                    gap = reciprocal(1j * (h * omega) - modes.rate[0, i])
                    total += share * gap
                    slope -= 1j * h * share * gap * gap
                    if modes.weight[0, i] == 2.0:
                        gap = reciprocal(1j * (h * omega) - modes.rate[0, i].conjugate())
                        total += share.conjugate() * gap
                        slope -= 1j * h * share.conjugate() * gap * gap
                work.receptance[a, j, c] = total
                work.receptance_slope[a, j, c] = slope
    return status.OK


@kernel(inline=True)
def _set_linear(problem: Balance, work: BalanceWork) -> None:
    """Harmonics of the motion without contact at the gaps, and their derivatives in omega."""
    machine = problem.machine
    m, n = machine.direction.shape
    for a in range(problem.harmonics.shape[0]):
        h = problem.harmonics[a]
        for j in range(m):
            work.linear[a, j] = 0.0
            for k in range(n):
                moved = contact_free_harmonic(problem, work, h, k)
                work.linear[a, j] += machine.direction[j, k] * moved
            work.linear_slope[a, j] = 0.0
            for w in range(machine.order.shape[0]):
                for k in range(n if machine.order[w] == h else 0):
                    slope = work.flow.drive_slope[0, w, k]
                    work.linear_slope[a, j] += machine.direction[j, k] * slope


@kernel(inline=True)
def contact_free_harmonic(problem: Balance, work: BalanceWork, h: int, k: int) -> complex:
    """Harmonic h of displacement k of the motion without contact; h = 0 is its mean."""
    if h == 0:
        return work.flow.modes.static[0, k] + 0j
    machine = problem.machine
    for w in range(machine.order.shape[0]):
        if machine.order[w] == h:
            return work.flow.drive[0, w, k]
    return 0j


@kernel(inline=True)
def contact_forces(problem: Balance, work: BalanceWork, omega: float) -> None:
    """Lambda_h and its derivative in omega at fixed A, from the integrals."""
    stops = problem.machine.stops
    for j in range(work.linear.shape[1]):
        for a in range(problem.harmonics.shape[0]):
            h = problem.harmonics[a]
            depth = -work.integral_gap[j, h].conjugate()
            for b in range(problem.harmonics.shape[0]):
                k = problem.harmonics[b]
                A = amplitude_of(problem, work, b, j)
                if k == 0:
                    depth += A * whole_integral(work, j, -h)
                else:
                    depth += 0.5 * A * whole_integral(work, j, k - h)
                    depth += 0.5 * A.conjugate() * whole_integral(work, j, -k - h)
            share = 1.0 / math.pi if h > 0 else 0.5 / math.pi
            k_spring, c = stops.stiffness[j], stops.damping[j]
            edge = work.edge_depth[j, h]
            work.force[a, j] = share * ((k_spring + 1j * c * omega * h) * depth + c * omega * edge)
            work.force_slope[a, j] = share * c * (1j * h * depth + edge)


@kernel(inline=True)
def balance_residual(
    problem: Balance, work: BalanceWork, u: Real, omega: float, r: Real, J: Real
) -> int:
    """r_h = A_h + G_h Lambda_h - A_linear,h and J = [dr/du, dr/d omega], all real."""
    set_series(problem, work, u)
    code = prepare_receptance(problem, work, omega) if omega > 0.0 else status.NO_CONVERGENCE
    if code == status.OK:
        code = record_contacts(problem, work, omega)
    if code != status.OK:
        return code
    contact_integrals(problem, work, omega)
    contact_forces(problem, work, omega)
    _jacobian(problem, work, omega, J)
    return write_residual(problem, work, r, J)


@kernel(inline=True)
def write_residual(problem: Balance, work: BalanceWork, r: Real, J: Real) -> int:
    """r and dr/d omega, the last column of J, from the forces of the series last set."""
    m, size = work.linear.shape[1], r.shape[0]
    for a in range(problem.harmonics.shape[0]):
        h = problem.harmonics[a]
        for j in range(m):
            value = amplitude_of(problem, work, a, j) - work.linear[a, j]
            slope = -work.linear_slope[a, j]
            for c in range(m):
                value += work.receptance[a, j, c] * work.force[a, c]
                slope += work.receptance_slope[a, j, c] * work.force[a, c]
                slope += work.receptance[a, j, c] * work.force_slope[a, c]
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
def _jacobian(problem: Balance, work: BalanceWork, omega: float, J: Real) -> None:
    """dr = c1 dA + c2 conj(dA): Toeplitz (l - h) and Hankel (-l - h) parts of the integrals."""
    stops = problem.machine.stops
    m = work.linear.shape[1]
    middle = work.integral.shape[1] - 1
    for a in range(problem.harmonics.shape[0]):
        h = problem.harmonics[a]
        share = 0.5 / math.pi if h > 0 else 0.25 / math.pi
        for b in range(problem.harmonics.shape[0]):
            k = problem.harmonics[b]
            for c in range(m):
                dynamic = stops.stiffness[c] + 1j * stops.damping[c] * omega * h
                # What the moving limit of a clipped spring adds; zero for limits at the gap.
                moving = stops.damping[c] * omega
                direct = share * (
                    dynamic * whole_integral(work, c, k - h) + moving * work.edge[c, k - h + middle]
                )
                mirror = share * (
                    dynamic * whole_integral(work, c, -k - h)
                    + moving * work.edge[c, -k - h + middle]
                )
                for j in range(m):
                    G = work.receptance[a, j, c]
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
    m = problem.machine.direction.shape[0]
    size = m * (2 * problem.harmonics.shape[0])
    if problem.harmonics[0] == 0:
        size -= m
    largest = problem.length
    for k in range(size):
        largest = max(largest, abs(u[k]))
    for k in range(size):
        scale[k] = largest
