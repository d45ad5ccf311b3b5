"""Whether lanes are on the motion from below where a variant has two, against its own branch.

Beside a fold of many, close to each other, it hangs on basins where a jump leads: what differs from
the branch is held against a slow sweep, too.

    python benchmarks/lanes_from_below.py [--screens 200] [--seed N]

One field of a random screen (``plausible_draw.py``) is varied by up to 60 %. Each variant is asked
for midway between its folds, where the screen itself may have one motion alone.
"""

import argparse
import math
import time
from collections import Counter

import numpy as np
from plausible_draw import KINDS, draw

import flipflow as ff
from flipflow.studies.landmarks import analysed_range

FIELDS = "clearance", "stop_stiffness", "shear_stiffness", "floating_mass", "eccentric_moment"
FACTORS = 0.6, 1.6
VARIANTS = 3  # of a screen
SWEPT = 400  # speeds
CLOSE = 1e-5  # share by which amplitudes of one motion may differ


def asked(seed, number):
    """Kind, screen, and of variants with folds: field, value, speed, amplitude from below."""
    kind, screen, _ = draw(seed, number)
    rng = np.random.default_rng([seed, number, 1])
    name = FIELDS[rng.integers(len(FIELDS))]
    found = []
    for value in (getattr(screen, name) * rng.uniform(*FACTORS, VARIANTS)).tolist():
        variant = screen.replace(**{name: value})
        branch = ff.frequency_response(variant, analysed_range(variant))
        folds = [fold.omega for fold in branch.folds]
        for high, low in zip(folds[::2], folds[1::2], strict=False):
            orbit = branch.orbit_from_below(0.5 * (low + high))
            if high > low and orbit is not None and orbit.stable:
                found.append((name, value, orbit.omega, orbit.amplitude("relative")))
    return kind, screen, found


def told(screen, name, value, omega):
    """The amplitude of a variant as a study of the screen tells it."""
    vary = {name: [value, value]}
    quantity = "relative_amplitude"
    found = ff.study(screen, vary, quantity, omega, sampling="list")
    return found.values[quantity][0, 0, 0]


def swept(screen, name, value, omega):
    """Where a sweep that rises slowly ends."""
    speeds = np.linspace(0.25 * omega, omega, SWEPT)
    return ff.sweep(screen.replace(**{name: value}), speeds).amplitude("relative")[-1]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--screens", type=int, default=200)
    parser.add_argument("--seed", type=int, default=int(time.time()))
    given = parser.parse_args()
    print(f"seed {given.seed}, {given.screens} screens")
    motions, other, wrong = Counter(), Counter(), Counter()
    for number in range(given.screens):
        kind, screen, variants = asked(given.seed, number)
        for name, value, omega, amplitude in variants:
            got = told(screen, name, value, omega)
            motions[kind] += 1
            if math.isclose(got, amplitude, rel_tol=CLOSE):
                continue
            other[kind] += 1
            end = swept(screen, name, value, omega)
            if not math.isclose(got, end, rel_tol=CLOSE):
                wrong[kind] += 1
                told_by = ("study", got), ("branch", amplitude), ("sweep", end)
                sizes = ", ".join(f"{who} {1e3 * size:.6g} mm" for who, size in told_by)
                print(f"{number} {kind}: {name} = {value!r} at {omega:.6g} rad/s: {sizes}")
    for kind in (*KINDS, "all"):
        asked_for, differ, both = (
            one.total() if kind == "all" else one[kind] for one in (motions, other, wrong)
        )
        print(
            f"{kind:10s}{asked_for:6d} asked{differ:6d} not as the branch{both:6d} nor as a sweep"
        )


if __name__ == "__main__":
    main()
