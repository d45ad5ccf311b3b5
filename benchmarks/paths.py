"""Which branches of random machines are followed to their end: a table by law and damping ratio.

    .venv/bin/python benchmarks/paths.py [--machines 100] [--seed N] [--jobs 2]

Machines are chains of ``chain_draw.py``; the seed is new each time unless one is given, and
printed. Every branch that is not complete is listed with its number, so that it can be drawn again.
"""

import argparse
import json
import secrets
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import product
from multiprocessing import get_context

from chain_draw import LAWS, draw

import flipflow as ff

RATIOS = (0.0, 0.05, 0.15, 0.4, 1.0)
CHUNK = 5  # machines that a worker is given at a time


def follow(task, seed):
    """How the branch of one machine ended, whether it touched a stop, and its points."""
    law, ratio, number = task
    machine, interval = draw(seed, number, law=law, ratio=ratio)
    try:
        branch = ff.frequency_response(machine, interval)
    except Exception as error:  # noqa: BLE001  whatever it is, it is listed
        return task, type(error).__name__, False, 0
    touched = any(point.kind.startswith("contact") for point in branch.special_points)
    begins = branch.omega.size and (branch.orbit(0).stop_force() != 0.0).any()
    return task, branch.status.name, bool(touched or begins), branch.omega.size


def rows(results):
    """A row of the table for each law and ratio."""
    for law, ratio in product(LAWS, RATIOS):
        mine = [one for one in results if one[0][:2] == (law, ratio)]
        ends = Counter(end for _, end, _, _ in mine)
        yield {
            "law": law, "ratio": ratio, "machines": len(mine),
            "complete": ends["COMPLETE"], "touch": sum(one[2] for one in mine),
            "points": sum(one[3] for one in mine) // max(len(mine), 1),
            "other": {end: n for end, n in ends.items() if end != "COMPLETE"},
        }  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", type=int, default=100, help="for each law and ratio")
    parser.add_argument("--seed", type=int, default=secrets.randbelow(2**31))
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    print(f"seed {options.seed}")
    tasks = list(product(LAWS, RATIOS, range(options.machines)))
    start, results = time.perf_counter(), []
    with ProcessPoolExecutor(options.jobs, mp_context=get_context("spawn")) as pool:
        for one in pool.map(partial(follow, seed=options.seed), tasks, chunksize=CHUNK):
            results.append(one)
            if one[1] != "COMPLETE":
                print(json.dumps(one), file=sys.stderr, flush=True)
    print("law                ratio  complete  touch  points  other")
    for row in rows(results):
        share, touch = row["complete"] / row["machines"], row["touch"] / row["machines"]
        print(
            f"{row['law']:18} {row['ratio']:5.2f} {share:9.1%} {touch:6.0%} {row['points']:7d}"
            f"  {row['other'] or ''}"
        )
    complete = sum(one[1] == "COMPLETE" for one in results)
    seconds = time.perf_counter() - start
    print(f"{complete} of {len(results)} complete, {seconds:.0f} s")


if __name__ == "__main__":
    main()
