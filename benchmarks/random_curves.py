"""Which curves in two parameters of random machines are followed to their ends: a table by kind.

    .venv/bin/python benchmarks/random_curves.py [--machines 100] [--seed N] [--jobs 2]

Machines are chains of ``chain_draw.py``; the seed is new each time unless one is given, and
printed. On the branch of each machine a special point is drawn, and followed over speed and a
parameter of the machine, 0.7 to 1.4 times its value. A curve ends on a bound, closes, or ends where
another contact begins; those that end otherwise are listed, to be drawn again. "SAYS_WHY" is a
point without a curve, with a note about it. "off" is the largest distance of a multiplier from its
critical value on any curve of folds, doublings and lost symmetry, but for those that follow a
grazing in their place.
"""

import argparse
import json
import secrets
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

import numpy as np
from chain_draw import draw

import flipflow as ff

CRITICAL = {"fold": 1.0, "period doubling": -1.0, "symmetry breaking": 1.0}
KINDS = (*CRITICAL, "Neimark-Sacker", "contact begin", "contact end")
PARAMETERS = ("forcing", "springs[0].stiffness", "springs[0].clearance")
WHOLE = ("FOLLOWED", "CLOSED", "MEETS_GRAZING")
SAYS_WHY = "SAYS_WHY"
CHUNK = 5  # machines that a worker is given at a time


def follow(number, seed):
    """Kind and end of one curve, its points, seconds, and how far off its multipliers are."""
    rng = np.random.default_rng([seed, number, 1])
    machine, interval = draw(seed, number)
    branch = ff.frequency_response(machine, interval)
    points = [point for point in branch.special_points if point.kind in KINDS]
    name = PARAMETERS[int(rng.integers(len(PARAMETERS)))]
    spring = machine.springs[0]
    own = 1.0 if name == "forcing" else getattr(spring, name.rpartition(".")[2])
    if not points or not 0.0 < own < np.inf:
        return None
    point = points[int(rng.integers(len(points)))]
    bounds = (0.7 * own, 1.4 * own), (point.omega / 3.0, 3.0 * point.omega)
    start = time.perf_counter()
    try:
        curve = ff.continue_bifurcation(point, (name, "omega"), bounds)
    except Exception as error:  # noqa: BLE001  whatever it is, it is listed
        return number, point.kind, type(error).__name__, 0, time.perf_counter() - start, 0.0
    seconds, off = time.perf_counter() - start, 0.0
    if curve.kind in CRITICAL and curve.orbits and not curve.notes:
        off = float(np.abs(curve.multipliers - CRITICAL[curve.kind]).min(axis=1).max())
    end = curve.status.name if curve.orbits or not curve.notes else SAYS_WHY
    return number, point.kind, end, len(curve.orbits), seconds, off


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", type=int, default=100)
    parser.add_argument("--seed", type=int, default=secrets.randbelow(2**31))
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    print(f"seed {options.seed}")
    with ProcessPoolExecutor(options.jobs, mp_context=get_context("spawn")) as pool:
        tasks = pool.map(
            partial(follow, seed=options.seed), range(options.machines), chunksize=CHUNK
        )
        results = [one for one in tasks if one is not None]
    for one in results:
        if one[2] not in WHOLE:
            print(json.dumps(one), file=sys.stderr)
    print("kind               curves  to their ends  points  seconds      off  ends")
    for kind in KINDS:
        mine = [one for one in results if one[1] == kind]
        if mine:
            ends = Counter(one[2] for one in mine)
            whole, count = sum(ends[end] for end in WHOLE), len(mine)
            points, seconds = (sum(one[k] for one in mine) / count for k in (3, 4))
            off = max(one[5] for one in mine)
            print(
                f"{kind:18} {count:6d} {whole:14d} {points:7.0f} {seconds:8.2f} {off:8.1e}"
                f"  {dict(ends)}"
            )


if __name__ == "__main__":
    main()
