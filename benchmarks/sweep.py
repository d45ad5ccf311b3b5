"""A settled sweep of FFS0827, up and down, beside scipy: seconds on one core.

A hundred speeds from 150 to 220 rad/s, both jumps among them, each settled to 1e-9 of the motion's
size. scipy's ``solve_ivp`` runs from the same states for as many turns at a few of the speeds; its
time for the whole sweep is that per turn times all turns. A table on stderr, JSON on stdout.
"""

import argparse
import json
import statistics
import sys
import time

import numpy as np
from one_core import stay_on_one_core
from scipy_flow import carried

import flipflow as ff

SPEEDS = np.linspace(150.0, 220.0, 100)
FOLDS = (206.405559, 198.649272)
TARGET = 0.5
PEER_ROWS, PEER_MOST_TURNS = 8, 60
RTOL, ATOL = 1e-10, 1e-12


def both_ways(screen):
    up = ff.sweep(screen, SPEEDS)
    return up, ff.sweep(screen, SPEEDS[::-1], initial=up.rows[-1].state)


def check(up, down):
    """What has to hold before the speed counts."""
    step = SPEEDS[1] - SPEEDS[0]
    for swept, fold in ((up, FOLDS[0]), (down, FOLDS[1])):
        (jump,) = swept.jumps
        assert abs(jump.omega_after - fold) <= step, jump
        assert swept.settled.all()


def peer(screen, up):
    """Seconds a turn of solve_ivp, and how far it ends from our state, in m."""
    system, seconds, turns, away = screen.system(), 0.0, 0, 0.0
    for k in np.linspace(1, SPEEDS.size - 1, PEER_ROWS).astype(int):
        count = min(int(up.turns[k]), PEER_MOST_TURNS)
        begin = up.rows[k - 1].state
        start = time.perf_counter()
        end = carried(system, begin, float(SPEEDS[k]), count, RTOL, ATOL)
        seconds += time.perf_counter() - start
        turns += count
        ours = up.formulation.solver().section(begin, float(SPEEDS[k]), count)[-1]
        away = max(away, float(np.abs(end[:2] - ours[:2]).max()))
    return {"seconds_a_turn": seconds / turns, "turns": turns, "largest_difference_m": away}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=9)
    runs = parser.parse_args().runs
    screen = ff.load("ffs0827")
    up, down = both_ways(screen)
    check(up, down)
    seconds = []
    for _ in range(runs):
        start = time.perf_counter()
        both_ways(screen)
        seconds.append(time.perf_counter() - start)
    turns = int(up.turns.sum() + down.turns.sum())
    row = peer(screen, up)
    row["seconds_for_the_sweep"] = row["seconds_a_turn"] * turns
    ours = statistics.median(seconds)
    row["times_ours"] = row["seconds_for_the_sweep"] / ours
    print(
        f"sweep up and down: {ours:.3f} s (target {TARGET} s), {turns} turns\n"
        f"solve_ivp: {row['seconds_for_the_sweep']:.0f} s for as many, {row['times_ours']:.0f} "
        f"times ours; differs by {row['largest_difference_m']:.1e} m at most",
        file=sys.stderr,
    )
    print(json.dumps({"seconds": ours, "turns": turns, "runs": runs, "peer": row}, indent=1))


if __name__ == "__main__":
    stay_on_one_core()
    main()
