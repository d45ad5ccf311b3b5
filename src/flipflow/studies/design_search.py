r"""The search for machines that do a duty: a Pareto set, then the best of it, polished.

The set is found by NSGA-II over the candidates of :mod:`flipflow.studies.candidates`, whole
generations at a time on lanes. The machine that is recommended is polished as the minimax problem

.. math:: \min_{p, a, b} \; b - a, \qquad a \le A_j(p) \le b, \qquad g_i(p) \le 0

over its continuous fields p, by sequential quadratic programming; A_j is the relative amplitude
under combination j. Its Lagrange multipliers say what a little more of each limit would buy.

Deb and others, IEEE Transactions on Evolutionary Computation 6 (2002) 182-197.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize, nnls

from flipflow.batch.chunk_store import ChunkStore
from flipflow.batch.run_chunks import run_chunks
from flipflow.batch.side_by_side import Tell
from flipflow.compiled.arrays import Real
from flipflow.errors import Cancelled, required
from flipflow.studies.candidates import JUMP, MET, TARGET, Judged, Space
from flipflow.studies.design_store import SHARES, keep, looked_at

POPULATION = 64
GENERATIONS = 60
TOGETHER = 8  # candidates that a worker judges at once
CLOSE = 0.1  # share by which a candidate may be worse in what comes first, for what comes next
STEP = 1e-4  # of a share, for central differences: lanes are exact, their error is its square
STRIDES = (0.05, 0.02, 0.008, 0.003, 0.0012)  # of a compass search, in shares of what is free
LOOKS = 8  # rounds with one stride
NEARER = 20.0  # strides by which it looks towards its goal, as a share of the way, at most all
BETTER = 1e-5  # share by which a band must be smaller to be better
ROUNDS = 40
ACTIVE = 1e-3  # excess above which a limit that is met binds
HUGE = 1e3  # stands for infinity in the search
SCALE = 1e6  # objectives are in N, W, m/s^2 and m


@dataclass(frozen=True, eq=False)
class Front:
    """What a search found: candidates (P, D), what they are like, and whether it was stopped.

    They are judged in ``space``: without machines as built where none of these keeps its margin.
    """

    space: Space
    u: Real
    judged: Judged
    cancelled: bool
    evaluated: int


def search(
    space: Space,
    generations: int,
    tell: Tell | None,
    *,
    kept: ChunkStore | None = None,
    executor: Executor | None = None,
) -> Front:
    """The Pareto set of a duty; where no candidate fits, those that miss least.

    ``kept`` is the store of the search, held for writing, if it has one. Candidates are judged by
    ``executor``, if there is one, else by threads.

    Raises
    ------
    MissingExtra
        When pymoo is not installed.
    """
    required("pymoo", "A design needs pymoo", "study")
    from pymoo.algorithms.moo.nsga2 import NSGA2  # noqa: PLC0415  an extra
    from pymoo.core.evaluator import Evaluator  # noqa: PLC0415
    from pymoo.core.problem import Problem  # noqa: PLC0415

    size, goals, rules = len(space.genes), len(space.objectives), len(space.constraints)

    judging = _Judging(space, executor, kept)

    class Candidates(Problem):  # type: ignore[misc]  # pymoo is untyped
        def _evaluate(self, x: Real, out: dict[str, Any], *_: Any, **__: Any) -> None:
            out["F"], out["G"] = judging.judged(x)

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
    judged = space.judge(u, margins=space.duty.loads)
    if not judged.fits.any() and JUMP in space.constraints and space.duty.scatter:
        space = replace(space, margin_as_built=False)
        judged = space.judge(u, margins=space.duty.loads)
    best = _front(space, judged)
    return Front(space, u[best], _rows(judged, best), cancelled, algorithm.evaluator.n_eval)


class _Judging:
    """Objectives and excesses of one generation after the other, those of before from a store."""

    def __init__(self, space: Space, executor: Executor | None, kept: ChunkStore | None) -> None:
        self.space, self.executor, self.kept = space, executor, kept
        self.generation = 0

    def judged(self, u: Real) -> tuple[Real, Real]:
        """Objectives (C, O) and excesses (C, G) of candidates (C, D), both finite."""
        at, self.generation = self.generation, self.generation + 1
        before = None if self.kept is None else looked_at(self.kept, at, u)
        if before is not None:
            return before
        judged = _judged_by(self.executor, self.space, u)
        values = [judged.objective(one) for one in self.space.objectives]
        objective = np.minimum(np.stack(values, axis=1), HUGE * SCALE)
        excess = np.minimum(judged.excess, HUGE)
        if self.kept is not None:
            keep(self.kept, at, {SHARES: u, "objective": objective, "excess": excess})
        return objective, excess


def _judged_by(executor: Executor | None, space: Space, u: Real) -> Judged:
    """Candidates judged, a few at a time where an executor does it."""
    if executor is None:
        return space.judge(u, margins=space.farthest)
    tasks = [(k, (space, u[k : k + TOGETHER])) for k in range(0, u.shape[0], TOGETHER)]
    found = dict(run_chunks(executor, _judged, tasks))
    parts = [found[k] for k, _ in tasks]
    return Judged(
        np.concatenate([one.amplitude for one in parts]),
        {name: np.concatenate([one.worst[name] for one in parts]) for name in parts[0].worst},
        np.concatenate([one.excess for one in parts]),
    )


def _judged(space: Space, u: Real) -> Judged:
    return space.judge(u, margins=space.farthest)


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


def by_preference(front: Front) -> list[int]:
    """Candidates of a Pareto set as they are preferred.

    Near the best in what comes first, the best in what comes next, and so on.
    """
    left, order = list(range(front.u.shape[0])), []
    while left:
        near = np.array(left)
        for one in front.space.objectives:
            value = front.judged.objective(one)[near]
            near = near[value <= value.min() * (1.0 + CLOSE)]
        order.append(int(near[0]))
        left.remove(order[-1])
    return order


@dataclass(frozen=True, eq=False)
class Polished:
    """A candidate after its polish.

    Parameters
    ----------
    u
        Its shares, (D,).
    judged
        What it is like.
    price
        By binding constraint, how much the band in m falls for each share of it that is given
        more; of the ends of what is free, for each share of their interval.
    against
        Where nothing fits: the constraints that exclude each other, the dearest first.
    """

    u: Real
    judged: Judged
    price: Mapping[str, float]
    against: tuple[str, ...] = ()


def polish(space: Space, u: Real, tell: Tell | None = None) -> Polished:
    """Make the band of a candidate as small as it gets near it, within all constraints.

    One that does not fit is brought as near to fitting as it gets: its greatest excess is made
    small instead.
    """
    around = _Around(space, u, _moving(space))
    judged = space.judge(u[None])
    if not around.moving.size or not np.isfinite(judged.band[0]):
        return Polished(u, judged, {}, _missed(space, judged))
    best, found = _least_excess(around, tell) if not judged.fits[0] else (u, judged)
    if not found.fits[0]:
        return Polished(best, found, {}, _against(around, best))
    around = _Around(space, best, around.moving)
    best, found = _least_band(around, tell)
    return Polished(best, found, _prices(around, best))


def _moving(space: Space) -> NDArray[np.int64]:
    """Places of what has values between."""
    return np.flatnonzero([not gene.values for gene in space.genes])


def _missed(space: Space, judged: Judged) -> tuple[str, ...]:
    order = np.argsort(-judged.excess[0], kind="stable").tolist()
    return tuple(space.constraints[g] for g in order if judged.excess[0, g] > MET)


class _Around:
    """Amplitudes and excesses near a candidate, with their slopes in what moves.

    A point and the sides of its central differences are lanes of one call; the last is kept.
    """

    def __init__(self, space: Space, u: Real, moving: NDArray[np.int64]) -> None:
        self.space, self.u, self.moving = space.around(u), u, moving
        self.target = space.duty.target
        self._last: tuple[bytes, Real, Real] | None = None

    def full(self, x: Real) -> Real:
        """The whole candidate, (D,)."""
        full = self.u.copy()
        full[self.moving] = x[: self.moving.size].clip(0.0, 1.0)
        return full

    def at(self, u: Real) -> tuple[Real, Real]:
        """Values (J + G,), amplitudes over the target and excesses, and slopes (J + G, M)."""
        key = u.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = (key, *self._looked(u))
        return self._last[1:]

    def _looked(self, u: Real) -> tuple[Real, Real]:
        rows = np.repeat(u[None], 1 + 2 * self.moving.size, axis=0)
        for k, d in enumerate(self.moving):
            rows[1 + 2 * k, d] = min(u[d] + STEP, 1.0)
            rows[2 + 2 * k, d] = max(u[d] - STEP, 0.0)
        judged = self.space.judge(rows)
        table = np.concatenate([judged.amplitude / self.target, judged.excess], axis=1)
        widths = [rows[1 + 2 * k, d] - rows[2 + 2 * k, d] for k, d in enumerate(self.moving)]
        with np.errstate(invalid="ignore"):
            slopes = (table[1::2] - table[2::2]) / np.array(widths)[:, None]
        return table[0], np.nan_to_num(slopes, nan=0.0, posinf=0.0, neginf=0.0).T

    @property
    def combinations(self) -> int:
        """How many amplitudes come before the excesses."""
        return self.at(self.u)[0].size - len(self.space.constraints)


def _solved(
    around: _Around, more: Real, sides: Real, shift: Real, width: Real, tell: Tell | None
) -> Real:
    """Minimise ``width`` times further unknowns y, where no ``sides`` v + ``shift`` exceeds y.

    Rows of ``sides`` (C, J + G + Y) take values, then the further unknowns, whose start is
    ``more``; returned are the shares of what moves, (M,).
    """
    known, count, done = around.at(around.u)[0].size, around.moving.size, 0
    of_values, of_more = sides[:, :known], sides[:, known:]

    def inside(x: Real) -> Real:
        values = around.at(around.full(x))[0]
        values = np.nan_to_num(values, nan=HUGE, posinf=HUGE, neginf=-HUGE)
        return np.asarray(shift + of_values @ values + of_more @ x[count:])

    def slope(x: Real) -> Real:
        return np.hstack([of_values @ around.at(around.full(x))[1], of_more])

    def step(_: Real) -> None:
        nonlocal done
        done += 1
        if tell is not None:
            tell(min(done / ROUNDS, 1.0))

    gradient = np.concatenate([np.zeros(count), width])
    found = minimize(
        lambda x: float(gradient @ x),
        np.concatenate([around.u[around.moving], more]),
        jac=lambda _: gradient,
        method="SLSQP",
        bounds=[(0.0, 1.0)] * count + [(-HUGE, HUGE)] * more.size,
        constraints={"type": "ineq", "fun": inside, "jac": slope},
        callback=step,
        options={"maxiter": ROUNDS, "ftol": 1e-9},
    )
    return np.asarray(found.x[:count])


def _least_band(around: _Around, tell: Tell | None) -> tuple[Real, Judged]:
    """The band in units of the target between two further unknowns, within all constraints."""
    J = around.combinations
    A = around.at(around.u)[0][:J]
    rules = len(around.space.constraints)
    one, zero = np.eye(J), np.zeros((J, rules))
    first, last = np.tile([1.0, 0.0], (J, 1)), np.tile([0.0, 1.0], (J, 1))
    sides = np.vstack(
        [
            np.hstack([-one, zero, last]),
            np.hstack([one, zero, -first]),
            np.hstack([zero.T, -np.eye(rules), np.zeros((rules, 2))]),
        ]
    )
    ends = np.array([A.min(), A.max()])
    x = _solved(around, ends, sides, np.zeros(sides.shape[0]), np.array([-1.0, 1.0]), tell)
    return _better(around, x, lambda judged: float(judged.band[0]))


def tightened(space: Space, found: Polished, goal: Real, tell: Tell | None = None) -> Polished:
    """A candidate that fits with a smaller band, where the goal of its polish does not fit.

    What ends the way to the goal, another motion or a jump, has no slopes: a compass search looks
    along single shares, pairs of them, and towards the goal, at candidates that still fit.
    """
    moves = _compass(_moving(space), found.u.size)
    for k, stride in enumerate(STRIDES):
        if tell is not None:
            tell(k / len(STRIDES))  # it lets the user stop
        for _ in range(LOOKS):
            nearer = found.u + min(1.0, NEARER * stride) * (goal - found.u)
            rows = np.vstack([found.u + stride * moves, nearer]).clip(0.0, 1.0)
            judged = space.around(found.u).judge(rows, margins=space.duty.loads)
            bands = np.where(judged.fits, judged.band, np.inf)
            best = np.array([np.argmin(bands)])
            if not bands[best[0]] < float(found.judged.band[0]) * (1.0 - BETTER):
                break
            found = Polished(rows[best[0]], _rows(judged, best), {})
    return found


def _compass(moving: NDArray[np.int64], size: int) -> Real:
    """Directions: up and down in single shares of what moves, and in pairs of them."""
    single = np.eye(size)[moving]
    pairs = [a + side * b for a, b in combinations(single, 2) for side in (1.0, -1.0)]
    both = np.array([*single, *pairs]).reshape(-1, size)
    return np.concatenate([both, -both])


def _least_excess(around: _Around, tell: Tell | None) -> tuple[Real, Judged]:
    """The greatest excess made small."""
    sides, shift = _excesses(around)
    values = around.at(around.u)[0]
    worst = float((-(shift + sides[:, :-1] @ values)).max())
    x = _solved(around, np.array([worst]), sides, shift, np.array([1.0]), tell)
    return _better(around, x, lambda judged: float(judged.excess[0].max()))


def _excesses(around: _Around) -> tuple[Real, Real]:
    """Rows of further unknown less excess; that of the target one for each side of each case."""
    J, rules = around.combinations, len(around.space.constraints)
    share = around.space.duty.tolerance / around.target
    one, zero = np.eye(J), np.zeros((J, rules))
    sides = np.vstack(
        [
            np.hstack([-one, zero]),
            np.hstack([one, zero]),
            np.hstack([zero.T, -np.eye(rules)])[1:],
        ]
    )
    shift = np.concatenate([np.full(J, 1.0 + share), np.full(J, share - 1.0), np.zeros(rules - 1)])
    return np.hstack([sides, np.ones((sides.shape[0], 1))]), shift


def _better(around: _Around, x: Real, size: Callable[[Judged], float]) -> tuple[Real, Judged]:
    """The candidate found, where it is better and misses no more; else that it began with."""
    space, first = around.space, around.space.judge(around.u[None])
    polished = around.full(x)
    judged = space.judge(polished[None])
    allowed = max(float(first.excess[0].max()), 0.0) + MET
    better = size(judged) < size(first) and float(judged.excess[0].max()) <= allowed
    return (polished, judged) if better else (around.u, first)


def _against(around: _Around, u: Real) -> tuple[str, ...]:
    """Constraints whose excesses cannot all fall: of the greatest, those with a multiplier.

    Where the greatest excess is least, a sum of slopes of the excesses that are as great, none with
    a wrong sign, is zero, but for what is free at its end.
    """
    values, slopes = around.at(u)
    sides, shift = _excesses(around)
    excess = -(shift + sides[:, :-1] @ values)
    active = np.flatnonzero(excess >= excess.max() - ACTIVE)
    rows = np.hstack([-(sides[active, :-1] @ slopes), np.ones((active.size, 1))])
    low, high = _at_ends(around, u)
    ends = np.vstack([-np.eye(around.moving.size)[low], np.eye(around.moving.size)[high]])
    rows = np.vstack([rows, np.pad(ends, ((0, 0), (0, 1)))])
    goal = np.zeros(around.moving.size + 1)
    goal[-1] = 1.0
    factors, _ = nnls(rows.T, goal)
    J, total = around.combinations, Counter[str]()
    for place, factor in zip(active.tolist(), factors[: active.size].tolist(), strict=True):
        name = TARGET if place < 2 * J else around.space.constraints[place - 2 * J + 1]
        total[name] += factor
    names = [around.space.genes[d].name for d in around.moving.tolist()]
    at_end = [f"least {names[k]}" for k in low] + [f"greatest {names[k]}" for k in high]
    total.update(dict(zip(at_end, factors[active.size :].tolist(), strict=True)))
    return tuple(name for name, factor in total.most_common() if factor > 0.0)


def _at_ends(around: _Around, u: Real) -> tuple[list[int], list[int]]:
    """Which of what moves is at its least, and which at its greatest."""
    own = u[around.moving]
    return np.flatnonzero(own <= STEP).tolist(), np.flatnonzero(own >= 1.0 - STEP).tolist()


def _prices(around: _Around, u: Real) -> dict[str, float]:
    """Multipliers of what binds by non-negative least squares, as m of band a share of each.

    At the optimum the gradient of the band is a sum of those of what binds, none with a wrong sign.
    """
    values, slopes = around.at(u)
    J, M = around.combinations, around.moving.size
    A, excess = values[:J], values[J:]
    top, bottom = (np.flatnonzero(side <= ACTIVE) for side in (A.max() - A, A - A.min()))
    binding = np.flatnonzero(excess >= -ACTIVE)
    low, high = _at_ends(around, u)
    rows = np.vstack(
        [
            np.hstack([-slopes[top], np.tile([0.0, 1.0], (top.size, 1))]),
            np.hstack([slopes[bottom], np.tile([-1.0, 0.0], (bottom.size, 1))]),
            np.pad(-slopes[J + binding], ((0, 0), (0, 2))),
            np.pad(np.eye(M)[low], ((0, 0), (0, 2))),
            np.pad(-np.eye(M)[high], ((0, 0), (0, 2))),
        ]
    )
    goal = np.concatenate([np.zeros(M), [-1.0, 1.0]])
    factors = nnls(rows.T, goal)[0][top.size + bottom.size :] * around.target
    names = [around.space.genes[d].name for d in around.moving.tolist()]
    words = [around.space.constraints[g] for g in binding.tolist()]
    words += [f"least {names[k]}" for k in low] + [f"greatest {names[k]}" for k in high]
    return {word: one for word, one in zip(words, factors.tolist(), strict=True) if one > 0.0}
