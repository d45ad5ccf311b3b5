"""The rig of Minerals 2024, 14, 406, section 5, identified from its six published points.

The paper prints the rig's parameters in a picture only. Its text gives six points of the relative
amplitude, two jumps and a pair of coexisting motions, which fewer than nine parameters would fix.
A rig is therefore drawn from a prior, and the nearest rig to it that meets the points is sought by
least squares; the median of the prior gives the bundled machine, the draws give the spread.

The points say nothing about the scale of all masses, springs and dampers together: the main mass
is set. JSON on stdout: the rig, its residuals, and the range of each parameter over all draws.

With ``--left-out FILE`` the fits of claims R1 to R3 are made instead: each to the points that the
claim does not speak of, from a prior that does not know them. ``flipflow reproduce`` predicts a
claim's points by these rigs.
"""

import argparse
import csv
import json
import sys
import time
from pathlib import Path

import numpy as np
from one_core import stay_on_one_core
from scipy.optimize import least_squares
from scipy.stats import norm, qmc

import flipflow as ff
from flipflow.paper import rig as published

MAIN_MASS = 126.0
POINTS = ("before up", "after down", "after up", "before down", "a", "b", "up", "down")
AMPLITUDE_SHARE, JUMP_SHARE = 0.01, 0.29  # standard deviations; the latter of an even spread
SHARES = {"up": JUMP_SHARE, "down": JUMP_SHARE}
FIELDS = ("main_mass", "floating_mass", "eccentric_moment", "isolation_stiffness",
          "isolation_damping", "shear_stiffness", "shear_damping", "stop_stiffness",
          "stop_damping", "clearance")  # fmt: skip

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
# Where points are left out the last three know no more than the size of speeds and amplitudes.
WIDE = PRIOR | {
    "free sqrt(k2/mu), rad/s": (100.0, 1.5),
    "m0r/m1, mm": (0.5, 3.0),
    "gap, mm": (2.0, 2.0),
}
# A rig whose jumps lie near the published ones: from the prior's median, which has no jump, a
# search ends in rigs that never touch the stop.
START = np.log([0.29, 13.5, 0.085, 0.047, 0.052, 8.7, 90.9, 0.244, 2.39])
HEAD = """\
# Rigs fitted to the published points of Minerals 2024, 14, 406, section 5, without those of one
# claim: a main mass of 126 kg, all other parameters free; SI. From the repository:
# python benchmarks/identify_rig.py --draws {draws} --left-out src/flipflow/paper/rigs_left_out.csv
"""


def middle_and_spread(prior):
    """Logarithms of the medians and of the factors of a prior."""
    return np.log(list(prior.values())).T


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


def identified(drawn, start, points=POINTS, prior=PRIOR):
    """The nearest rig to a drawn one that meets the points: logarithms and the rig's motions."""
    middle, spread = middle_and_spread(prior)
    shares = np.array([SHARES.get(name, AMPLITUDE_SHARE) for name in points])

    def residual(logarithms):
        off = published.followed(rig_of(logarithms)).off
        missed = np.array([off[name] for name in points])
        return np.concatenate([missed / shares, (logarithms - drawn) / spread])

    bounds = (middle - 3.0 * spread, middle + 3.0 * spread)
    fit = least_squares(
        residual, start, x_scale=spread, diff_step=1e-5, ftol=1e-6, xtol=1e-8, bounds=bounds,
        max_nfev=100,
    )  # fmt: skip
    return fit.x, published.followed(rig_of(fit.x))


def draws(count, prior=PRIOR):
    """Logarithms of ``count`` rigs of the prior."""
    middle, spread = middle_and_spread(prior)
    points = qmc.Sobol(len(prior), seed=0).random(count)
    return middle + spread * norm.ppf(np.clip(points, 0.01, 0.99))


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


def described(logarithms, found):
    """One rig as JSON types."""
    return {
        "fields": fields(found.branch.machine),
        "parameters": dict(zip(PRIOR, np.exp(logarithms).tolist(), strict=True)),
        "jump up, down, rad/s": [found.jump_up, found.jump_down],
        "point a, rad/s": found.point_a,
        "off": found.off,
        "met": found.meets(POINTS),
    }


def summary_of(count):
    """The rig of the prior's median, and the range of every parameter over the draws."""
    begin = time.perf_counter()
    best, read = identified(middle_and_spread(PRIOR)[0], START)
    rig, found = described(best, read), []
    for drawn in draws(count):
        found.append(described(*identified(drawn, best)))
        seconds, worst = time.perf_counter() - begin, max(map(abs, found[-1]["off"].values()))
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
    return summary | {"point a": [min(at), max(at)]}


def write_left_out(path, count):
    """One row for each claim and each draw that ends in a rig with the other points."""
    with Path(path).open("w", encoding="utf-8", newline="") as file:
        file.write(HEAD.format(draws=count))
        table = csv.writer(file, lineterminator="\n")
        table.writerow(("left_out", *FIELDS))
        for claim, points in published.KEPT.items():
            kept = 0
            for drawn in draws(count, WIDE):
                try:
                    _, found = identified(drawn, START, points, WIDE)
                except ff.IncompleteError:
                    continue
                if found.meets(points):
                    kept += 1
                    values = (f"{getattr(found.branch.machine, name):.8g}" for name in FIELDS)
                    table.writerow((claim, *values))
            file.flush()
            print(f"{claim}: {kept} of {count} draws", file=sys.stderr, flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=32)
    parser.add_argument("--left-out", metavar="FILE", help="rigs for claims R1 to R3, as CSV")
    options = parser.parse_args()
    if options.left_out:
        write_left_out(options.left_out, options.draws)
    else:
        print(json.dumps(summary_of(options.draws), indent=1))


if __name__ == "__main__":
    stay_on_one_core()
    main()
