"""Random machines of any kind with stops, each reproducible from a seed and its number."""

import math

import numpy as np

import flipflow as ff

LAWS = ("paper", "compression-only")
MOST_MASSES, MOST_STOPS = 6, 4


def draw(seed, number, *, masses=MOST_MASSES, stops=MOST_STOPS, law=None, ratio=None):
    """Machine ``number`` of ``seed``, and the interval of speeds to look at.

    A chain of masses with springs to the ground and between them, damped in proportion; stops
    between masses or to the ground, one-sided or not, with gaps a share of the largest linear
    amplitude there, so that most machines touch; a force of any phase on one mass or an unbalance.
    """
    rng = np.random.default_rng([seed, number])
    n = int(rng.integers(1, masses + 1))
    M = np.diag(10.0 ** rng.uniform(-0.5, 0.5, n))
    K = np.zeros((n, n))
    for i in range(n):
        k = 10.0 ** rng.uniform(-0.5, 0.5)
        K[i, i] += k
        if i:
            K[i - 1, i - 1] += k
            K[i, i - 1] -= k
            K[i - 1, i] -= k
    natural = np.sqrt(np.linalg.eigvalsh(np.linalg.solve(M, K)).clip(1e-12))
    natural = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real))
    C = 2.0 * 10.0 ** rng.uniform(-2.0, -0.8) / natural[0] * K
    push = np.zeros(n, complex)
    push[int(rng.integers(n))] = np.exp(2j * math.pi * rng.uniform())
    force = ff.Unbalance(push.real + 0.1) if rng.uniform() < 0.3 else ff.HarmonicForce(push)
    interval = 0.3 * natural[0], float(rng.uniform(1.2, 2.5)) * natural[min(1, n - 1)]
    scan = np.linspace(*interval, 400)
    f = force.vector[None] * (scan[:, None] ** 2 if isinstance(force, ff.Unbalance) else 1.0)
    Z = K[None] - scan[:, None, None] ** 2 * M + 1j * scan[:, None, None] * C
    X = np.linalg.solve(Z, f[..., None])[..., 0]
    springs = []
    for _ in range(int(rng.integers(1, stops + 1))):
        d = np.zeros(n)
        a = int(rng.integers(n))
        d[a] = 1.0
        if n > 1 and rng.uniform() < 0.6:
            d[(a + 1) % n] -= 1.0
        amplitude = np.abs(X @ d).max()
        k = 10.0 ** rng.uniform(0.0, 2.5)
        zeta = rng.uniform(0.0, 1.0) if ratio is None else ratio
        effective = 1.0 / (d @ np.linalg.solve(M, d))
        c = 2.0 * zeta * math.sqrt(k * effective)
        gap = amplitude * rng.uniform(0.1, 0.95)
        kind = rng.uniform()
        other = math.inf if kind < 0.4 else None if kind < 0.7 else gap * rng.uniform(0.5, 2.0)
        name = LAWS[int(rng.integers(len(LAWS)))]
        springs.append(ff.ClearanceSpring(d, k, c, gap, other, law=law or name))
    return ff.MechanicalSystem(M, C, K, tuple(springs), force), interval
