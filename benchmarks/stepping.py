"""Time to step FFS0827 over its contacts at equal error: RK4, the 5(4) pair, scipy's DOP853.

Twenty turns at 120 rad/s from a disturbed start; the error is the largest difference of a
displacement at the end, in m, from the exact flow. Of every method the cheapest setting of a ladder
that keeps within the error is timed, in one run. A table on stderr, JSON on stdout.
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
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.transient.time_stepping import RungeKutta, Stepper

OMEGA, TURNS = 120.0, 20
TURN = 2.0 * np.pi / OMEGA
TARGETS = (1e-6, 1e-8, 1e-10)
LADDERS = {
    "RK4": [RungeKutta("rk4", step=TURN / n) for n in (25, 50, 100, 200, 400, 800, 1600)],
    "RK5(4)": [RungeKutta(tolerance=10.0**-k) for k in range(3, 14)],
    "scipy DOP853": [10.0**-k for k in range(3, 13)],
}


def stepped(system, start, setting):
    """Displacements at the end by flipflow's stepper."""
    profile = ff.SpeedProfile((0.0, 1.0), (OMEGA, OMEGA))
    stepper = Stepper(system, profile, start, method=setting, fastest=OMEGA)
    for _ in stepper.run(TURNS * TURN):
        pass
    return stepper.walk.s[:2].copy()


def by_scipy(system, start, tolerance):
    """The same by solve_ivp."""
    atol = 6e-3 * tolerance * np.array([1.0, 1.0, OMEGA, OMEGA])
    return carried(system, start, OMEGA, TURNS, tolerance, atol)[:2]


def cheapest(call, ladder, exact, target, runs):
    """Seconds, error and setting of the cheapest setting within the target; None if none is."""
    for setting in ladder:
        error = float(np.abs(call(setting) - exact).max())
        if error <= target:
            seconds = []
            for _ in range(runs):
                begin = time.perf_counter()
                call(setting)
                seconds.append(time.perf_counter() - begin)
            return {
                "seconds": statistics.median(seconds), "error": error, "setting": str(setting),
            }  # fmt: skip
    return None


def told(row):
    """A line of the table."""
    if row is None:
        return "not reached"
    line = f"{1e6 * row['seconds'] / TURNS:9.2f} us a turn, error {row['error']:.1e} m"
    if "scipy_over_ours" in row:
        line += f", scipy takes {row['scipy_over_ours']:.0f} times as long"
    return line


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20)
    options = parser.parse_args()
    system = ff.load("ffs0827").system()
    solver = ExactSolver(system, half_turn=False)
    start = solver.settled(np.zeros(4), OMEGA, 300) + np.array([1e-3, 0.0, 0.1, 0.0])
    exact = solver.settled(start.copy(), OMEGA, TURNS)[:2]
    rows = {}
    for target in TARGETS:
        for name, ladder in LADDERS.items():
            scipy_runs = name.startswith("scipy")
            route = by_scipy if scipy_runs else stepped
            rows[f"{name}, {target:g} m"] = cheapest(
                lambda setting, route=route: route(system, start, setting),
                ladder, exact, target, min(options.runs, 3) if scipy_runs else options.runs,
            )  # fmt: skip
        theirs = rows[f"scipy DOP853, {target:g} m"]
        for name in ("RK4", "RK5(4)"):
            ours = rows[f"{name}, {target:g} m"]
            if ours is not None and theirs is not None:
                ours["scipy_over_ours"] = theirs["seconds"] / ours["seconds"]
    for name, row in rows.items():
        print(f"{name:<24}{told(row)}", file=sys.stderr)
    print(json.dumps({"turns": TURNS, "rows": rows}, indent=1))


if __name__ == "__main__":
    stay_on_one_core()
    main()
