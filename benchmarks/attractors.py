"""Whether every motion that random machines settle on is among those that a search lists.

    .venv/bin/python benchmarks/attractors.py [--machines 100] [--seed N] [--jobs 2] [--scipy]

Machines are chains of ``chain_draw.py``. At three speeds each is run from 20 states by the exact
flow; what repeats after up to twelve periods is looked for in ``periodic_orbits``. Every motion
that is not listed is printed with the number of its machine.

With ``--scipy`` each is run at one speed from two states by the event-located integration of
``tests/reference``, until it is within 1e-3 of a stable motion of the list and nearer than a turn
before, or repeats itself elsewhere. What does neither is counted as undecided: it is chaotic, say,
or decays slowly.
"""

import argparse
import json
import secrets
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from chain_draw import draw

import flipflow as ff
from flipflow.transient.settling import Settling

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from reference.integrate import Machine, flow

SPEEDS, STATES, PERIODS = 3, 20, 12
TURNS = 3_000  # forcing periods after which a state that has not settled is left out
SAME = 1e-6
OF_SCIPY, TURNS_OF_SCIPY = 2, 600  # states, turns
# Tolerance, and steps a turn at least: the coarse one may overlook a short contact.
COARSE, FINE = (1e-7, 20), (1e-11, 100)
NEAR, REPEATS = 1e-3, 1e-6  # distances as shares of a state


def settled_on(machine, omega, rng):
    """Points of the different motions that states of all sizes settle on."""
    settling = Settling(machine, PERIODS)
    found = []
    for start in _starts(machine, omega, rng, STATES):
        end = settling.settle(start, omega, TURNS)
        if not end.settled:
            continue
        phases = settling.phases(end.point)
        if not any(settling.same(one.u, phases, omega).any() for one in found):
            found.append(end.point)
    return found


def check_by_scipy(number, seed):
    """How many states scipy settled from at one speed, what is missing, and what is undecided."""
    machine, interval = draw(seed, number)
    rng = np.random.default_rng([seed, number, 2])
    omega = float(rng.uniform(*interval))
    settling = Settling(machine, PERIODS)
    listed = [
        settling.solver.section(one.state, omega, one.periods)
        for one in ff.periodic_orbits(machine, omega, PERIODS) if one.stable
    ]  # fmt: skip
    starts = _starts(machine, omega, rng, OF_SCIPY)
    ends = [_flown(machine, omega, start, listed) for start in starts]
    missing = [(number, omega, end) for end in ends if end]
    return len(ends) - ends.count(None), missing, ends.count(None)


def _starts(machine, omega, rng, count):
    """States of all sizes up to twice the largest gap."""
    gaps = [abs(gap) for one in machine.springs for gap in one.gaps if np.isfinite(gap)]
    size = 2.0 * max(gaps) * np.repeat([1.0, omega], machine.size)
    return rng.uniform(-1.0, 1.0, (count, 2 * machine.size)) * size


def _flown(machine, omega, z, listed):
    """0: towards a listed motion; the periods after which another repeats; None: undecided."""
    end = None
    for accuracy in (COARSE, FINE):
        end, z = _repeated(machine, omega, z, listed, accuracy)
        if not end:
            break
    return end


def _repeated(machine, omega, z, listed, accuracy):
    """The end of ``_flown`` by one accuracy, and the state there."""
    reference, turn = Machine.of(machine), 2.0 * np.pi / omega
    scale = np.repeat([1.0, 1.0 / omega], machine.size)
    past, before = [z * scale], np.full(len(listed), np.inf)
    for _ in range(TURNS_OF_SCIPY):
        z = flow(reference, z, omega, 0.0, turn, *accuracy).final
        size = np.abs(z * scale).max()
        off = np.array([np.abs((one - z) * scale).max(axis=1).min() for one in listed])
        if ((off < NEAR * size) & (off < before)).any():
            return 0, z
        before = off
        past = [*past[-PERIODS:], z * scale]
        for periods in range(1, len(past)):
            if np.abs(past[-1] - past[-1 - periods]).max() < REPEATS * size:
                return periods, z
    return None, z


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
    return seen, missing, 0


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", type=int, default=100)
    parser.add_argument("--seed", type=int, default=secrets.randbelow(2**31))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--scipy", action="store_true", help="run by event-located integration")
    options = parser.parse_args()
    print(f"seed {options.seed}")
    start, seen, lost, open_ = time.perf_counter(), 0, 0, 0
    with ProcessPoolExecutor(options.jobs, mp_context=get_context("spawn")) as pool:
        todo = partial(check_by_scipy if options.scipy else check, seed=options.seed)
        for count, missing, undecided in pool.map(todo, range(options.machines), chunksize=2):
            seen, lost, open_ = seen + count, lost + len(missing), open_ + undecided
            for one in missing:
                print(json.dumps(one), file=sys.stderr, flush=True)
    share = 1.0 - lost / max(seen, 1)
    seconds = time.perf_counter() - start
    what = f"states end at motions listed, {open_} undecided" if options.scipy else "motions listed"
    print(f"{seen - lost} of {seen} {what} ({share:.2%}), {seconds:.0f} s")


if __name__ == "__main__":
    main()
