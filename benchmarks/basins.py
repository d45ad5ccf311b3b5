"""A basin of FFS0827 between its folds, beside scipy's solve_ivp on a few of the same cells.

solve_ivp gets the smooth pieces only: it stops at every contact by an event, and starts again. It
runs each cell for as many turns as ours needed until it knew the label. ``--profile`` splits our
time into the search for motions, their neighbourhoods, and the lanes.
"""

import argparse
import json
import statistics
import time

import numpy as np
from scipy_flow import carried

import flipflow as ff
from flipflow.studies.attractors import Attractors

OMEGA = 203.0
DISPLACEMENT, VELOCITY = 0.08, 16.0
TARGET_SECONDS = 15.0
PEER_CELLS = 12
RTOL, ATOL = 1e-8, 1e-10


def window(cells):
    share = np.linspace(-1.0, 1.0, cells)
    return {"relative": DISPLACEMENT * share}, {"relative": VELOCITY * share}


def ours(screen, cells, threads, runs):
    """Median seconds of warm runs, and the last result."""
    displacement, velocity = window(cells)
    ff.basins(screen, OMEGA, *window(3), threads=threads)
    seconds = []
    for _ in range(runs):
        start = time.perf_counter()
        found = ff.basins(screen, OMEGA, displacement, velocity, threads=threads)
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds), found


def peer(screen, found):
    """Seconds a cell of solve_ivp, and whether it is nearest to the motion of our label."""
    system = screen.system()
    rng = np.random.default_rng(0)
    x, v = (axis.values for axis in found.axes)
    scale = np.repeat([1.0, OMEGA], 2)
    seconds, turns, agree = [], 0, 0
    for i, j in rng.integers(0, x.size, (PEER_CELLS, 2)):
        turns += int(found.turns[i, j])
        start = time.perf_counter()
        begin = np.array([0.0, -x[i], 0.0, -v[j]])
        end = carried(system, begin, OMEGA, int(found.turns[i, j]), RTOL, ATOL)
        seconds.append(time.perf_counter() - start)
        away = [np.abs((end - orbit.state) / scale).max() for orbit in found.orbits]
        agree += int(np.argmin(away) == found.labels[i, j])
    return {"seconds_a_cell": statistics.mean(seconds), "turns": turns, "agree": agree}


def profile(screen, found, threads):
    """Where our time goes."""
    start = time.perf_counter()
    ff.periodic_orbits(screen, OMEGA)
    searched = time.perf_counter()
    attractors = Attractors(screen, OMEGA, 0, threads)
    ready = time.perf_counter()
    x, v = (axis.values for axis in found.axes)
    states = np.zeros((found.labels.size, 4))
    states[:, 1], states[:, 3] = (-one.ravel() for one in np.meshgrid(x, v, indexing="ij"))
    run = attractors.run(states, found.most_turns)
    done = time.perf_counter()
    assert np.array_equal(run.label.reshape(found.labels.shape), found.labels)
    search = searched - start
    lanes = done - ready
    return {
        "search": search,
        "neighbourhoods": ready - searched - search,
        "lanes": lanes,
        "microseconds_a_turn_and_thread": 1e6 * lanes * attractors.lanes.threads / run.turns.sum(),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=200)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--profile", action="store_true")
    given = parser.parse_args()
    screen = ff.load("ffs0827")
    seconds, found = ours(screen, given.cells, given.threads, given.runs)
    assert np.all(found.labels >= 0)
    beside = peer(screen, found)
    row = {
        "cells": found.labels.size,
        "threads": given.threads,
        "seconds": seconds,
        "target_seconds": TARGET_SECONDS,
        "turns_a_cell": float(found.turns.mean()),
        "shares": found.shares.tolist(),
        "share_intervals": found.share_intervals.tolist(),
        "solve_ivp": beside | {"cells": PEER_CELLS},
        "times_faster_a_cell_and_thread": beside["seconds_a_cell"]
        / (seconds * given.threads / found.labels.size),
    }
    if given.profile:
        row["profile"] = profile(screen, found, given.threads)
    print(json.dumps(row, indent=2))


if __name__ == "__main__":
    main()
