"""Whether every motion that random machines settle on is among those that a search lists.

    .venv/bin/python benchmarks/attractors.py [--machines 100] [--seed N] [--jobs 2]

Machines are chains of ``chain_draw.py``. At three speeds each is run from 20 states by the exact
flow; what repeats after up to twelve periods is looked for in ``periodic_orbits``. Every motion
that is not listed is printed with the number of its machine.
"""

import argparse
import json
import secrets
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

import numpy as np
from chain_draw import draw

import flipflow as ff
from flipflow.transient.settling import Settling

SPEEDS, STATES, PERIODS = 3, 20, 12
TURNS = 3_000  # forcing periods after which a state that has not settled is left out
SAME = 1e-6


def settled_on(machine, omega, rng):
    """Points of the different motions that states of all sizes settle on."""
    settling = Settling(machine, PERIODS)
    gaps = [abs(gap) for one in machine.springs for gap in one.gaps if np.isfinite(gap)]
    found = []
    for _ in range(STATES):
        size = 2.0 * max(gaps) * np.repeat([1.0, omega], machine.size)
        end = settling.settle(rng.uniform(-1.0, 1.0, 2 * machine.size) * size, omega, TURNS)
        if not end.settled:
            continue
        phases = settling.phases(end.point)
        if not any(settling.same(one.u, phases, omega).any() for one in found):
            found.append(end.point)
    return found


def check(number, seed):
    """How many motions a machine settled on at its speeds, and those that no search lists."""
    machine, interval = draw(seed, number)
    rng = np.random.default_rng([seed, number, 1])
    seen, missing = 0, []
    for omega in rng.uniform(*interval, SPEEDS):
        settling = Settling(machine, PERIODS)
        listed = ff.periodic_orbits(machine, float(omega), PERIODS)
        for point in settled_on(machine, float(omega), rng):
            seen += 1
            size = np.abs(point.u).max()
            phases = settling.phases(point)
            near = (
                np.abs(z - one.state).max() < SAME * size
                for z in phases for one in listed if one.periods == point.formulation.turns
            )  # fmt: skip
            if not any(near):
                missing.append((number, float(omega), point.formulation.turns))
    return seen, missing


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", type=int, default=100)
    parser.add_argument("--seed", type=int, default=secrets.randbelow(2**31))
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    print(f"seed {options.seed}")
    start, seen, lost = time.perf_counter(), 0, 0
    with ProcessPoolExecutor(options.jobs, mp_context=get_context("spawn")) as pool:
        todo = partial(check, seed=options.seed)
        for count, missing in pool.map(todo, range(options.machines), chunksize=2):
            seen, lost = seen + count, lost + len(missing)
            for one in missing:
                print(json.dumps(one), file=sys.stderr, flush=True)
    share = 1.0 - lost / max(seen, 1)
    seconds = time.perf_counter() - start
    print(f"{seen - lost} of {seen} motions listed ({share:.2%}), {seconds:.0f} s")


if __name__ == "__main__":
    main()
