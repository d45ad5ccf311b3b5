r"""The search for machines that do a duty: a Pareto set, then the best of it, polished.

The set is found by NSGA-II over the candidates of :mod:`flipflow.studies.candidates`, whole
generations at a time on lanes. The machine that is recommended is polished as the minimax problem

.. math:: \min_{p, a, b} \; b - a, \qquad a \le A_j(p) \le b, \qquad g_i(p) \le 0

over its continuous fields p, by sequential quadratic programming; A_j is the relative amplitude
under combination j. Its Lagrange multipliers say what a little more of each limit would buy.

Deb and others, IEEE Transactions on Evolutionary Computation 6 (2002) 182-197.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize, nnls

from flipflow.errors import Cancelled, MissingExtra
from flipflow.studies.candidates import Judged, Space

Real = NDArray[np.float64]
Tell = Callable[[float], None]
POPULATION = 64
GENERATIONS = 60
CLOSE = 0.1  # share by which a candidate may be worse in what comes first, for what comes next
STEP = 1e-4  # of a share, for central differences: lanes are exact, their error is its square
ROUNDS = 40
ACTIVE = 1e-3  # excess above which a limit that is met binds
HUGE = 1e3  # stands for infinity in the search


@dataclass(frozen=True, eq=False)
class Front:
    """What a search found: candidates (P, D), what they are like, and whether it was stopped."""

    u: Real
    judged: Judged
    cancelled: bool
    evaluated: int


def search(space: Space, generations: int, tell: Tell | None) -> Front:
    """The Pareto set of a duty; where no candidate fits, those that miss least.

    Raises
    ------
    MissingExtra
        When pymoo is not installed.
    """
    try:
        from pymoo.algorithms.moo.nsga2 import NSGA2  # noqa: PLC0415  an extra
        from pymoo.core.evaluator import Evaluator  # noqa: PLC0415
        from pymoo.core.problem import Problem  # noqa: PLC0415
    except ModuleNotFoundError:
        raise MissingExtra("A design needs pymoo: pip install 'flipflow[study]'.") from None
    size, goals, rules = len(space.genes), len(space.objectives), len(space.constraints)

    class Candidates(Problem):  # type: ignore[misc]  # pymoo is untyped
        def _evaluate(self, x: Real, out: dict[str, Any], *_: Any, **__: Any) -> None:
            judged = space.judge(x)
            values = [judged.objective(one) for one in space.objectives]
            out["F"] = np.minimum(np.stack(values, axis=1), HUGE * SCALE)
            out["G"] = np.minimum(judged.excess, HUGE)

    problem = Candidates(n_var=size, n_obj=goals, n_ieq_constr=rules, xl=0.0, xu=1.0)
    algorithm = NSGA2(pop_size=POPULATION, sampling=_first(space))
    algorithm.setup(problem, termination=("n_gen", generations), seed=space.duty.seed)
    algorithm.evaluator = Evaluator()
    cancelled = False
    try:
        while algorithm.has_next():
            algorithm.next()
            if tell is not None:
                tell(algorithm.n_gen / (generations + 1.0))
    except Cancelled:
        cancelled = True
    u = np.unique(np.array(algorithm.pop.get("X"), float), axis=0)
    judged = space.judge(u)
    kept = _front(space, judged)
    return Front(u[kept], _rows(judged, kept), cancelled, algorithm.evaluator.n_eval)


SCALE = 1e6  # objectives are in N, W, m/s^2 and m


def _first(space: Space) -> Real:
    """The first generation: the machine itself, and a sequence that fills the space."""
    from scipy.stats import qmc  # noqa: PLC0415  slow to import

    drawn = qmc.Sobol(len(space.genes), rng=space.duty.seed).random(POPULATION)
    drawn[0] = space.share_of(space.screen)
    return np.asarray(drawn)


def _rows(judged: Judged, rows: NDArray[np.int64]) -> Judged:
    worst = {name: one[rows] for name, one in judged.worst.items()}
    return Judged(judged.amplitude[rows], worst, judged.excess[rows])


def _front(space: Space, judged: Judged) -> NDArray[np.int64]:
    """Candidates that fit and that none beats in every objective; else that which misses least."""
    fit = np.flatnonzero(judged.fits)
    if fit.size == 0:
        missed = np.maximum(judged.excess, 0.0).sum(axis=1)
        return np.array([int(np.argmin(missed))])
    F = np.stack([judged.objective(one)[fit] for one in space.objectives], axis=1)
    beaten = [bool(((one >= F).all(axis=1) & (one > F).any(axis=1)).any()) for one in F]
    return np.asarray(fit[~np.array(beaten)])


def by_preference(space: Space, front: Front) -> list[int]:
    """Candidates of a Pareto set as they are preferred.

    Near the best in what comes first, the best in what comes next, and so on.
    """
    left, order = list(range(front.u.shape[0])), []
    while left:
        near = np.array(left)
        for one in space.objectives:
            value = front.judged.objective(one)[near]
            near = near[value <= value.min() * (1.0 + CLOSE)]
        order.append(int(near[0]))
        left.remove(order[-1])
    return order


@dataclass(frozen=True, eq=False)
class Polished:
    """A candidate after its polish: shares (D,), and what each binding limit costs.

    ``price`` is by constraint how much the band in m falls for each share of it that is given more.
    """

    u: Real
    judged: Judged
    price: Mapping[str, float]


def polish(space: Space, u: Real, tell: Tell | None = None) -> Polished:
    """Make the band of a candidate as small as it gets near it, within all constraints."""
    moving = np.flatnonzero([not gene.values for gene in space.genes])
    best, judged = u, space.judge(u[None])
    if moving.size and np.isfinite(judged.band[0]):
        best, judged = _descended(space, u, moving, tell)
    return Polished(best, judged, _prices(space, best, moving))


def _descended(
    space: Space, u: Real, moving: NDArray[np.int64], tell: Tell | None
) -> tuple[Real, Judged]:
    """SLSQP on shares and on the two ends of the band, in units of the target."""
    target = space.duty.target
    done = 0

    def at(x: Real) -> Real:
        full = u.copy()
        full[moving] = x[:-2].clip(0.0, 1.0)
        return full

    def inside(x: Real) -> Real:
        judged = space.judge(at(x)[None])
        A = judged.amplitude[0] / target
        met = np.concatenate([x[-1] - A, A - x[-2], -judged.excess[0]])
        return np.asarray(np.nan_to_num(met, nan=-1.0, posinf=HUGE, neginf=-HUGE))

    def slope(x: Real) -> Real:
        return _slopes(space, at(x), moving, target)

    def step(_: Real) -> None:
        nonlocal done
        done += 1
        if tell is not None:
            tell(min(done / ROUNDS, 1.0))

    first = space.judge(u[None])
    A = first.amplitude[0] / target
    start = np.concatenate([u[moving], [A.min(), A.max()]])
    width = np.zeros(start.size)
    width[-2:] = -1.0, 1.0
    found = minimize(
        lambda x: x[-1] - x[-2],
        start,
        jac=lambda _: width,
        method="SLSQP",
        bounds=[(0.0, 1.0)] * moving.size + [(0.0, 2.0 * float(A.max()))] * 2,
        constraints={"type": "ineq", "fun": inside, "jac": slope},
        callback=step,
        options={"maxiter": ROUNDS, "ftol": 1e-9},
    )
    polished = at(found.x)
    judged = space.judge(polished[None])
    allowed = np.maximum(first.excess[0], 0.0) + 1e-6
    better = judged.band[0] < first.band[0] and bool((judged.excess[0] <= allowed).all())
    return (polished, judged) if better else (u, first)


def _slopes(space: Space, u: Real, moving: NDArray[np.int64], target: float) -> Real:
    """Jacobian of what must be positive, by central differences of lanes, one-sided at an end."""
    sides = np.repeat(u[None], 2 * moving.size, axis=0)
    for k, d in enumerate(moving):
        sides[2 * k, d] = min(u[d] + STEP, 1.0)
        sides[2 * k + 1, d] = max(u[d] - STEP, 0.0)
    judged = space.judge(sides)
    combos, rules = judged.amplitude.shape[1], judged.excess.shape[1]
    J = np.zeros((2 * combos + rules, moving.size + 2))
    for k, d in enumerate(moving):
        width = sides[2 * k, d] - sides[2 * k + 1, d]
        A = (judged.amplitude[2 * k] - judged.amplitude[2 * k + 1]) / (target * width)
        g = (judged.excess[2 * k] - judged.excess[2 * k + 1]) / width
        J[:, k] = np.nan_to_num(np.concatenate([-A, A, -g]), nan=0.0, posinf=0.0, neginf=0.0)
    J[:combos, -1], J[combos : 2 * combos, -2] = 1.0, -1.0
    return J


def _prices(space: Space, u: Real, moving: NDArray[np.int64]) -> dict[str, float]:
    """Multipliers of the binding constraints by non-negative least squares, as m a share of each.

    At the optimum the gradient of the band is a sum of those of what binds, none with a wrong sign.
    """
    judged = space.judge(u[None])
    target = space.duty.target
    if not moving.size or not math.isfinite(judged.band[0]):
        return {}
    A = judged.amplitude[0] / target
    combos = A.size
    J = _slopes(space, u, moving, target)
    slack = np.concatenate([A.max() - A, A - A.min(), -judged.excess[0]])
    ends = np.concatenate([np.eye(moving.size), -np.eye(moving.size)])
    at_end = np.concatenate([u[moving] <= STEP, u[moving] >= 1.0 - STEP])
    active = np.flatnonzero(np.abs(slack) <= ACTIVE)
    rows = np.concatenate([J[active], np.pad(ends[at_end], ((0, 0), (0, 2)))])
    width = np.zeros(moving.size + 2)
    width[-2:] = -1.0, 1.0
    factors, _ = nnls(rows.T, width)
    found: dict[str, float] = {}
    for place, factor in zip(active.tolist(), factors[: active.size].tolist(), strict=True):
        if place >= 2 * combos and factor > 0.0:
            found[space.constraints[place - 2 * combos]] = factor * target
    names = [space.genes[d].name for d in moving.tolist()]
    bounds = [(name, end) for end in ("least", "greatest") for name in names]
    for (name, end), factor in zip(
        [one for one, there in zip(bounds, at_end.tolist(), strict=True) if there],
        factors[active.size :].tolist(),
        strict=True,
    ):
        if factor > 0.0:
            found[f"{end} {name}"] = factor * target
    return found
