"""Scratch and record arrays for the kernels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flipflow.continuation.arclength import Branch, Corrector
from flipflow.dynamics.contact_search import Contact, GapMotion
from flipflow.dynamics.flow import Flow
from flipflow.dynamics.plan import Plan
from flipflow.periodic.sampled import Sampled
from flipflow.periodic.series import Balance
from flipflow.periodic.shooting import Shooting

MOST_SEGMENTS = 600


def contact_of(plan: Plan) -> Contact:
    """The contact law of a plan's springs."""
    return Contact(plan.gap_plus, plan.gap_minus, plan.stiffness, plan.damping, plan.clipped)


def new_gap_motion(gaps: int, rates: NDArray[np.complex128], spacing: int = 0) -> GapMotion:
    """Scratch for a sum of exponentials at some gaps or coordinates."""
    shape = (gaps, rates.size)
    return GapMotion(
        offset=np.zeros(gaps),
        amplitude=np.zeros(shape, np.complex128),
        rate=rates.copy(),
        factor=np.zeros(rates.size, np.complex128),
        decay=np.zeros(rates.size),
        curve=np.zeros(shape, np.complex128),
        bound=np.zeros(shape),
        size=np.zeros(rates.size),
        turn=np.zeros(rates.size, np.complex128),
        ratio=np.zeros(rates.size, np.complex128),
        spacing=np.array([spacing], np.int64),
    )


def new_flow(plan: Plan) -> Flow:
    """Scratch for one lane of exact flow."""
    configurations, modes = plan.rate.shape
    m, n = plan.direction.shape
    e = MOST_SEGMENTS
    motion = new_gap_motion(m, np.zeros(modes + 1, np.complex128))
    return Flow(
        drive=np.zeros((configurations, 2 * n), np.complex128),
        drive_slope=np.zeros((configurations, 2 * n), np.complex128),
        driven_at=np.full(configurations, np.nan),
        motion=motion,
        contact=contact_of(plan),
        state=np.zeros(m, np.int64),
        z=np.zeros(2 * n),
        segments=np.zeros(1, np.int64),
        slot=np.zeros(e, np.int64),
        start=np.zeros(e),
        length=np.zeros(e),
        modes=np.zeros((e, modes), np.complex128),
        spring=np.zeros(e, np.int64),
        kick=np.zeros(e),
        states=np.zeros((e, m), np.int64),
    )


def new_shooting(plan: Plan, *, half_turn: bool, length: float, turns: int = 1) -> Shooting:
    """The shooting problem over ``turns``, or half of them for a mirror-symmetric motion."""
    size = 2 * plan.direction.shape[1]
    return Shooting(
        plan=plan,
        flow=new_flow(plan),
        tangent=np.zeros((size, size + 1)),
        map=np.zeros((size, size)),
        work=np.zeros((plan.rate.shape[1], size + 1), np.complex128),
        rate=np.zeros(size),
        fraction=0.5 * turns if half_turn else float(turns),
        sign=-1.0 if half_turn else 1.0,
        length=length,
    )


def new_corrector(unknowns: int, gaps: int) -> Corrector:
    """Scratch of the bordered Newton solves."""
    n = unknowns
    return Corrector(
        w=np.zeros(n + 1),
        guess=np.zeros(n + 1),
        border=np.zeros(n + 1),
        before=np.zeros(n + 1),
        tangent=np.zeros(n + 1),
        scale=np.ones(n + 1),
        side=np.zeros(1),
        r=np.zeros(n),
        J=np.zeros((n, n + 1)),
        A=np.zeros((n + 1, n + 1)),
        b=np.zeros(n + 1),
        pivot=np.zeros(n + 1, np.int64),
        depth=np.zeros((gaps, 2)),
    )


def new_branch(unknowns: int, gaps: int, points: int, *, with_jacobian: bool = True) -> Branch:
    """Record of a branch of up to ``points`` points."""
    n = unknowns
    return Branch(
        u=np.empty((points, n)),
        omega=np.empty(points),
        tangent=np.empty((points, n + 1)),
        jacobian=np.empty((points, n, n) if with_jacobian else (points, 0, 0)),
        side=np.empty(points),
        signature=np.empty(points, np.int64),
        depth=np.empty((points, gaps, 2)),
        iterations=np.empty(points, np.int64),
        rejected=np.zeros(points, np.int64),
        reason=np.zeros(points, np.int64),
    )


def new_balance(plan: Plan, harmonics: int, *, half_turn: bool, length: float) -> Balance:
    """The harmonic-balance problem; a mirror-symmetric motion has odd harmonics only."""
    kept = np.arange(1, harmonics + 1, 2) if half_turn else np.arange(harmonics + 1)
    m, most = plan.direction.shape[0], 2 * harmonics + 1
    rates = 1j * kept[kept > 0].astype(np.complex128)

    def series() -> GapMotion:
        return new_gap_motion(m, rates, spacing=2 if half_turn else 1)

    flow = new_flow(plan)
    contact = flow.contact._replace(damping=np.zeros(m))
    return Balance(
        plan=plan,
        flow=flow._replace(motion=series(), contact=contact),
        motion=series(),
        harmonics=kept.astype(np.int64),
        receptance=np.zeros((kept.size, m, m), np.complex128),
        receptance_slope=np.zeros((kept.size, m, m), np.complex128),
        linear=np.zeros(m, np.complex128),
        linear_slope=np.zeros(m, np.complex128),
        integral=np.zeros((m, most), np.complex128),
        integral_gap=np.zeros((m, most), np.complex128),
        edge=np.zeros((m, 2 * most - 1), np.complex128),
        edge_depth=np.zeros((m, most), np.complex128),
        force=np.zeros((kept.size, m), np.complex128),
        force_slope=np.zeros((kept.size, m), np.complex128),
        walk=np.pi if half_turn else 2.0 * np.pi,
        length=length,
    )


def new_sampled(balance: Balance, samples: int, sharpness: float) -> Sampled:
    """The same with the smooth law sampled at fixed times."""
    m, most = balance.integral.shape
    return Sampled(
        balance=balance,
        turn=np.exp(2j * np.pi * np.arange(samples) / samples),
        stiffness=np.zeros((m, most), np.complex128),
        damping=np.zeros((m, most), np.complex128),
        beyond=np.zeros(m, np.int64),
        sharpness=float(sharpness),
    )
