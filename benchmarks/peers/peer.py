"""What both peers share: the machine, the yardstick, and runs with a wall-clock limit."""

import argparse
import json
import os
import statistics
import subprocess
import sys
import time

import numpy as np

# FFS0827 with the stop, SI.
M1, M2, M0R = 916.0, 310.0, 4.16825
K1, C1 = 630e3, 9866.0
K2, C2 = 2700e3, 2605.0
K3, C3, GAP = 8100e3, 2605.0, 6e-3

OMEGA_START, OMEGA_END, STEP = 5.0, 250.0, 2.0
TRUE_FOLDS, FOLD_TOLERANCE = (206.4, 198.65), 1.0
REPEATS, REPEAT_BELOW, START_UP = 3, 60.0, 60.0


def half_peak_to_peak(constant, cosines, sines):
    """Half peak-to-peak of a Fourier series (coefficients along the last axis)."""
    harmonics = np.arange(1, cosines.shape[-1] + 1)
    angle = np.outer(harmonics, np.linspace(0.0, 2.0 * np.pi, 4096, endpoint=False))
    y = constant[..., None] + cosines @ np.cos(angle) + sines @ np.sin(angle)
    return (y.max(axis=-1) - y.min(axis=-1)) / 2.0


def turning_points(omega):
    """Speeds where the sign of d omega / d s changes along the points of a branch."""
    step = np.diff(omega)
    middle = omega[1:-1]
    return middle[step[1:] * step[:-1] < 0.0]


def count_false(folds):
    """Count the turning points beyond the two true ones, each of which excuses one."""
    true = sum(bool(np.any(np.abs(folds - f) <= FOLD_TOLERANCE)) for f in TRUE_FOLDS)
    return len(folds) - true


def timed(solve):
    """Solve once, then give the median time of three warm ones (slow: the first time)."""
    start = time.perf_counter()
    result = solve()
    first = time.perf_counter() - start
    if first > REPEAT_BELOW:
        return result, first
    seconds = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        result = solve()
        seconds.append(time.perf_counter() - start)
    return result, statistics.median(seconds)


def attempt(script, setting, harmonics, limit):
    """Run one setting in a process of its own; kill it when it overstays."""
    one_core = {f"{lib}_NUM_THREADS": "1" for lib in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
    command = [sys.executable, script, "--worker", "--setting", setting]
    command += ["--harmonics", str(harmonics), "--limit", str(limit)]
    failed = {"setting": setting, "harmonics": harmonics, "completed": False, "reached": None}
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            check=True,
            env=os.environ | one_core,
            timeout=limit + REPEATS * REPEAT_BELOW + START_UP,
        )
    except subprocess.TimeoutExpired:
        return failed | {"note": "killed at the wall-clock limit"}
    except subprocess.CalledProcessError as error:
        last = (error.stderr.strip().splitlines() or ["no message"])[-1]
        return failed | {"note": f"ended with an error: {last}"}
    return json.loads(done.stdout)


def merit(result):
    """Best first: completed, fewest false points, farthest, fastest."""
    completed = result["completed"]
    false = result.get("false_turning_points", 0) + result.get("impossible_points", 0)
    return (
        not completed,
        false if completed else 0,
        -min(result["reached"] or 0.0, OMEGA_END),
        result.get("seconds", float("inf")),
    )


def main(script, settings, default, solve):
    """Command line of a peer: print one JSON object, the best of the settings tried."""
    parser = argparse.ArgumentParser(description=f"FFS0827 by {os.path.basename(script)}")  # noqa: PTH119
    parser.add_argument("--harmonics", type=int, default=3)
    parser.add_argument("--setting", choices=sorted(settings), default=default)
    parser.add_argument("--all", action="store_true", help="try every setting, report the best")
    parser.add_argument("--limit", type=float, default=240.0, help="seconds for one solve")
    parser.add_argument("--worker", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        print(json.dumps(solve(options.setting, options.harmonics, options.limit)))
        return
    names = settings if options.all else [options.setting]
    tried = [attempt(script, name, options.harmonics, options.limit) for name in names]
    tried.sort(key=merit)
    best = dict(tried[0])
    if options.all:
        best["tried"] = tried
    print(json.dumps(best))
