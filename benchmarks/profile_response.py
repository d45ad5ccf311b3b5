"""Where the time of one frequency response goes: split by stage, then by function."""

import argparse
import cProfile
import pstats
import statistics
import time

import numpy as np
from contract import INTERVAL
from one_core import stay_on_one_core

import flipflow as ff
from flipflow.continuation import correction
from flipflow.continuation.frequency_response import first_unknowns, solver_for
from flipflow.continuation.special_points import find_special_points
from flipflow.periodic.solver import STEP_SHARE

ROWS = 25


def stages(machine, method):
    """Seconds of each stage of one response, as ``frequency_response`` strings them together."""
    clock = [time.perf_counter()]

    def lap():
        clock.append(time.perf_counter())

    solver = solver_for(machine.system(), method)
    lap()
    low, high = INTERVAL
    course = correction.Course(
        low, high, (high - low) / method.points, STEP_SHARE, 1.0, correction.QUICK
    )
    start = first_unknowns(solver, low)
    lap()
    traced = solver.trace(start, low, course)
    lap()
    maps = solver.return_maps(traced.u, traced.omega, traced.jacobian)
    eigenvalues = solver.eigenvalues(traced, maps)
    lap()
    find_special_points(solver, traced, maps, eigenvalues)
    lap()
    names = ("machine and scratch", "start", "trace", "stability", "special points")
    return dict(zip(names, np.diff(clock), strict=True))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--harmonics", type=int, help="harmonic balance; exact when left out")
    parser.add_argument("--runs", type=int, default=200)
    options = parser.parse_args()
    machine = ff.load("ffs0827")
    method = ff.HarmonicBalance(options.harmonics) if options.harmonics else ff.PiecewiseExact()
    for _ in range(3):
        stages(machine, method)
    laps = [stages(machine, method) for _ in range(options.runs)]
    medians = {name: statistics.median(lap[name] for lap in laps) for name in laps[0]}
    total = sum(medians.values())
    print(f"{method}, median of {options.runs}: {1e3 * total:.2f} ms")
    for name, seconds in medians.items():
        print(f"  {name:<18}{1e3 * seconds:8.3f} ms {100.0 * seconds / total:6.1f} %")
    profile = cProfile.Profile()
    profile.enable()
    for _ in range(options.runs):
        ff.frequency_response(machine, INTERVAL, method)
    profile.disable()
    pstats.Stats(profile).strip_dirs().sort_stats("tottime").print_stats(ROWS)


if __name__ == "__main__":
    stay_on_one_core()
    main()
