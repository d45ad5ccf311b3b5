"""The rig of Minerals 2024, 14, 406, section 5, identified from its six published points.

The paper prints the rig's parameters in a picture only. Its text gives six points of the relative
amplitude, two jumps and a pair of coexisting motions, which fewer than nine parameters would fix.
A rig is therefore drawn from a prior, and the nearest rig to it that meets the points is sought by
least squares; the median of the prior gives the bundled machine, the draws give the spread.

The points say nothing about the scale of all masses, springs and dampers together: the main mass
is set. JSON on stdout: the rig, its residuals, and the range of each parameter over all draws.
"""

import argparse
import json
import math
import sys
import time
from dataclasses import dataclass

import numpy as np
from one_core import stay_on_one_core
from scipy.optimize import brentq, least_squares
from scipy.stats import norm, qmc

import flipflow as ff

MAIN_MASS = 126.0
INTERVAL, POINTS = (60.0, 140.0), 200
JUMP_UP, JUMP_DOWN = (120.17, 123.31), (91.89, 95.03)
# (rad/s, mm) on the motion with contact and on the motion without.
UPPER, LOWER = ((120.17, 2.85), (91.89, 2.52)), ((123.31, 0.54), (95.03, 1.97))
PAIR = (2.6, 1.25)
AMPLITUDE_SHARE, JUMP_SHARE = 0.01, 0.29  # standard deviations; the latter of an even spread
MET = 0.03

# Median and factor of one standard deviation. Ratios and damping ratios are those of FFS0827, of
# which the rig is a model; the last three are what the two points without contact give at once.
PRIOR = {
    "mass ratio m2/m1": (310.0 / 916.0, 2.0),
    "isolation sqrt(k1/(m1+m2)), rad/s": (22.7, 2.0),
    "isolation damping ratio": (0.18, 2.0),
    "shear damping ratio": (0.05, 2.0),
    "stop damping ratio": (0.05, 3.0),
    "stiffness ratio k3/k2": (3.0, 3.0),
    "free sqrt(k2/mu), rad/s": (88.5, 1.2),
    "m0r/m1, mm": (0.262, 1.5),
    "gap, mm": (2.3, 1.5),
}
MIDDLE, SPREAD = np.log(list(PRIOR.values())).T
# A rig whose jumps lie near the published ones: from the prior's median, which has no jump, a
# search ends in rigs that never touch the stop.
START = np.log([0.29, 13.5, 0.085, 0.047, 0.052, 8.7, 90.9, 0.244, 2.39])


@dataclass(frozen=True)
class Reading:
    """What a rig does at the published points; amplitudes in mm, frequencies in rad/s."""

    jump_up: float
    jump_down: float
    upper: tuple[float, float]
    lower: tuple[float, float]
    point_a: float
    pair: tuple[float, float]

    @property
    def deviations(self):
        """Relative deviation of the six amplitudes."""
        wanted = [mm for _, mm in (*UPPER, *LOWER)] + list(PAIR)
        return np.array([*self.upper, *self.lower, *self.pair]) / wanted - 1.0

    @property
    def off_middle(self):
        """How far each jump lies from the middle of its bracket, as a share of the bracket."""
        pairs = ((self.jump_up, JUMP_UP), (self.jump_down, JUMP_DOWN))
        return np.array([(omega - (a + b) / 2.0) / (b - a) for omega, (a, b) in pairs])

    @property
    def met(self):
        """Whether both jumps lie in their brackets and all amplitudes within ``MET``."""
        within = np.abs(self.deviations) < MET
        return bool(np.all(within) and np.all(np.abs(self.off_middle) < 0.5))


def rig_of(logarithms):
    """The screen of the logarithms of the parameters in ``PRIOR``."""
    ratio, isolation, zeta1, zeta2, zeta3, stiffer, free, throw, gap = np.exp(logarithms)
    m1, m2 = MAIN_MASS, MAIN_MASS * ratio
    mu = m1 * m2 / (m1 + m2)
    return ff.FlipFlowScreen(
        main_mass=m1,
        floating_mass=m2,
        eccentric_moment=1e-3 * throw * m1,
        isolation_stiffness=(m1 + m2) * isolation**2,
        isolation_damping=2.0 * zeta1 * (m1 + m2) * isolation,
        shear_stiffness=mu * free**2,
        shear_damping=2.0 * zeta2 * mu * free,
        stop_stiffness=stiffer * mu * free**2,
        stop_damping=2.0 * zeta3 * mu * free,
        clearance=1e-3 * gap,
    )


def read(rig):
    """Follow the rig's branch; beyond a fold the motion at the fold stands in."""
    branch = ff.frequency_response(rig, INTERVAL, ff.PiecewiseExact(points=POINTS))
    folds = branch.folds or (branch.peak("relative"),)
    last, first = max(folds, key=lambda f: f.omega), min(folds, key=lambda f: f.omega)
    rising = slice(0, math.floor(last.position) + 1)
    beyond = slice(math.ceil(first.position), branch.omega.size)

    def upper(omega):
        orbit = branch.solve_in(rising, omega) if omega < last.omega else last.orbit
        return 1e3 * orbit.amplitude("relative")

    def lower(omega):
        orbit = branch.solve_in(beyond, omega) if omega > first.omega else first.orbit
        return 1e3 * orbit.amplitude("relative")

    ends = (first.omega, INTERVAL[1])
    inside = lower(ends[1]) < PAIR[1] < lower(ends[0])
    point_a = brentq(lambda omega: lower(omega) - PAIR[1], *ends) if inside else ends[0]
    return Reading(
        last.omega,
        first.omega,
        tuple(upper(omega) for omega, _ in UPPER),
        tuple(lower(omega) for omega, _ in LOWER),
        point_a,
        (upper(point_a), lower(point_a)),
    )


def identified(drawn, start):
    """The nearest rig to a drawn one that meets the points: logarithms and reading."""

    def residual(logarithms):
        reading = read(rig_of(logarithms))
        return np.concatenate(
            [
                reading.deviations / AMPLITUDE_SHARE,
                reading.off_middle / JUMP_SHARE,
                (logarithms - drawn) / SPREAD,
            ]
        )

    bounds = (MIDDLE - 3.0 * SPREAD, MIDDLE + 3.0 * SPREAD)
    fit = least_squares(
        residual, start, x_scale=SPREAD, diff_step=1e-5, ftol=1e-6, xtol=1e-8, bounds=bounds,
        max_nfev=100,
    )  # fmt: skip
    return fit.x, read(rig_of(fit.x))


def draws(count):
    """Logarithms of ``count`` rigs of the prior."""
    points = qmc.Sobol(len(PRIOR), seed=0).random(count)
    return MIDDLE + SPREAD * norm.ppf(np.clip(points, 0.01, 0.99))


def fields(rig):
    """The rig's fields in the units of the machine file."""
    return {
        "floating_mass, kg": rig.floating_mass,
        "eccentric_moment, kg mm": 1e3 * rig.eccentric_moment,
        "isolation stiffness, kN/m": 1e-3 * rig.isolation_stiffness,
        "isolation damping, kN s/m": 1e-3 * rig.isolation_damping,
        "shear stiffness, kN/m": 1e-3 * rig.shear_stiffness,
        "shear damping, kN s/m": 1e-3 * rig.shear_damping,
        "stop clearance, mm": 1e3 * rig.clearance,
        "stop stiffness, kN/m": 1e-3 * rig.stop_stiffness,
        "stop damping, kN s/m": 1e-3 * rig.stop_damping,
    }


def described(logarithms, reading):
    """One rig as JSON types."""
    return {
        "fields": fields(rig_of(logarithms)),
        "parameters": dict(zip(PRIOR, np.exp(logarithms).tolist(), strict=True)),
        "jump up, down, rad/s": [reading.jump_up, reading.jump_down],
        "point a, rad/s": reading.point_a,
        "upper, lower, pair, mm": [reading.upper, reading.lower, reading.pair],
        "deviations": reading.deviations.tolist(),
        "met": reading.met,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=32)
    options = parser.parse_args()
    begin = time.perf_counter()
    best, reading = identified(MIDDLE, START)
    rig, found = described(best, reading), []
    for drawn in draws(options.draws):
        found.append(described(*identified(drawn, best)))
        seconds, worst = time.perf_counter() - begin, np.abs(found[-1]["deviations"]).max()
        print(f"{len(found)}: {seconds:.0f} s, {worst:.2%}", file=sys.stderr, flush=True)
    good = [rig, *(one for one in found if one["met"])]
    ranges = {
        name: [min(values), max(values)]
        for group in ("fields", "parameters")
        for name in rig[group]
        for values in [[one[group][name] for one in good]]
    }
    at = [one["point a, rad/s"] for one in good]
    summary = {"rig": rig, "draws": len(found), "met": len(good) - 1, "ranges": ranges}
    print(json.dumps(summary | {"point a": [min(at), max(at)]}, indent=1))


if __name__ == "__main__":
    stay_on_one_core()
    main()
