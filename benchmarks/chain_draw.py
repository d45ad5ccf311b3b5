"""Random chains of masses with stops, each reproducible from a seed and its number."""

import math

import numpy as np

import flipflow as ff

LAWS = ("paper", "compression-only", "undamped-rebound", "elasto-gap")
MOST_MASSES, MOST_STOPS = 6, 4
UNBALANCED = 0.3  # share of machines driven by an unbalance
BETWEEN = 0.6  # share of stops between two masses, where there are two
ONE_SIDED, EQUAL = 0.4, 0.3  # shares of stops on one side, and with equal gaps
PULLED = 1 / 3  # share of machines under a constant force


def draw(seed, number, *, law=None, ratio=None):
    """Machine ``number`` of ``seed``, and the interval of speeds to look at.

    A chain of one to six masses with springs between them and to the ground, damped in proportion,
    under a force of any phase or an unbalance, a third of them under a constant force as well. One
    to four stops act between neighbours or against the ground, each with a gap that is a share of
    the largest linear amplitude there, so that nearly all are met. ``law`` and the damping
    ``ratio`` of the stops are drawn where not given.
    """
    rng = np.random.default_rng([seed, number])
    n = int(rng.integers(1, MOST_MASSES + 1))
    M, K = np.diag(10.0 ** rng.uniform(-0.5, 0.5, n)), np.zeros((n, n))
    for i, k in enumerate(10.0 ** rng.uniform(-0.5, 0.5, n)):
        link = np.eye(n)[i] - (np.eye(n)[i - 1] if i else 0.0)
        K += k * np.outer(link, link)
    natural = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real))
    C = 2.0 * 10.0 ** rng.uniform(-2.0, -0.8) / natural[0] * K
    push = np.zeros(n, complex)
    push[int(rng.integers(n))] = np.exp(2j * math.pi * rng.uniform())
    force = ff.Unbalance(push.real + 0.1) if rng.uniform() < UNBALANCED else ff.HarmonicForce(push)
    interval = 0.3 * natural[0], rng.uniform(1.2, 2.5) * natural[min(1, n - 1)]
    scan = np.linspace(*interval, 400)
    X = ff.linear_response(ff.MechanicalSystem(M, C, K, (), force), scan).complex_amplitudes
    stops = [
        _stop(rng, M, X, law or LAWS[int(rng.integers(len(LAWS)))], ratio)
        for _ in range(int(rng.integers(1, MOST_STOPS + 1)))
    ]
    static = None
    if rng.uniform() < PULLED:
        static = K @ rng.uniform(-0.5, 0.5, n) * np.abs(X).max()
    return ff.MechanicalSystem(M, C, K, tuple(stops), force, static_force=static), interval


def _stop(rng, M, X, law, ratio):
    """A stop of a chain of masses M, whose linear motion over the interval is X (w, N)."""
    n = M.shape[0]
    d, at = np.zeros(n), int(rng.integers(n))
    d[at] = 1.0
    if n > 1 and rng.uniform() < BETWEEN:
        d[(at + 1) % n] -= 1.0
    k = 10.0 ** rng.uniform(0.0, 2.5)
    share = rng.uniform(0.0, 1.0) if ratio is None else ratio
    c = 2.0 * share * math.sqrt(k / (d @ np.linalg.solve(M, d)))
    gap = np.abs(X @ d).max() * rng.uniform(0.1, 0.95)
    kind = rng.uniform()
    other = gap * rng.uniform(0.5, 2.0)
    if kind < ONE_SIDED + EQUAL:
        other = math.inf if kind < ONE_SIDED else None
    return ff.ClearanceSpring(d, k, c, gap, other, law=law)
