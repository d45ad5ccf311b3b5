"""Random flip-flow screens around FFS0827, each reproducible from a seed and its number."""

import math

import numpy as np

import flipflow as ff

PARAMETERS = (
    "main_mass",
    "floating_mass",
    "eccentric_moment",
    "isolation_stiffness",
    "isolation_damping",
    "shear_stiffness",
    "shear_damping",
    "stop_stiffness",
    "stop_damping",
)
LARGEST_FACTOR = 3.0
LEAST_DAMPING = 0.1
GAPS = 0.5e-3, 12e-3
LOWEST = 5.0
REACH = 1.155  # FFS0827: 1.155 times its bonded w02 of 216.3 rad/s is 250 rad/s


def draw(seed, number):
    """Machine ``number`` of ``seed``.

    Every parameter of FFS0827 times a factor, log-uniform in [1/3, 3]; all dampings times one more,
    log-uniform in [0.1, 1]; the gap uniform in 0.5 ... 12 mm.
    """
    rng = np.random.default_rng([seed, number])
    base = ff.load("ffs0827")
    factors = LARGEST_FACTOR ** rng.uniform(-1.0, 1.0, len(PARAMETERS))
    light = LEAST_DAMPING ** rng.uniform(0.0, 1.0)
    changes = {
        name: getattr(base, name) * factor * (light if name.endswith("damping") else 1.0)
        for name, factor in zip(PARAMETERS, factors, strict=True)
    }
    return base.replace(clearance=rng.uniform(*GAPS), **changes)


def speeds(screen):
    """Interval in rad/s: from 5 to 1.155 times the second frequency with the stop bonded.

    A fixed 5 ... 250 would end below the contact resonance of a stiff light machine and leave a
    soft heavy one far behind; this one shows each machine the part of its curve that 5 ... 250
    shows of FFS0827.
    """
    shear = screen.shear_stiffness + screen.stop_stiffness
    K = np.array([[screen.isolation_stiffness + shear, -shear], [-shear, shear]])
    M = np.diag([screen.main_mass, screen.floating_mass])
    squares = np.linalg.eigvals(np.linalg.solve(M, K)).real
    return LOWEST, REACH * math.sqrt(squares.max())


def linear_relative_amplitude(screen, omega):
    """Half peak-to-peak of x1 - xf in m while nothing touches: two equations, solved."""
    c1, c2 = screen.isolation_damping, screen.shear_damping
    k1, k2 = screen.isolation_stiffness, screen.shear_stiffness
    shear = k2 + 1j * omega * c2
    main = k1 + 1j * omega * c1 + shear - screen.main_mass * omega**2
    D = np.array([[main, -shear], [-shear, shear - screen.floating_mass * omega**2]])
    x1, xf = np.linalg.solve(D, [screen.eccentric_moment * omega**2, 0.0])
    return abs(x1 - xf)
