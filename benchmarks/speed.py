"""How fast FFS0827 is solved: warm, one core, medians. A table on stderr, JSON on stdout.

Contract of the responses (5 ... 250 rad/s): at least 300 points, steps of at most 2 rad/s, the
stability of every point, folds refined to 1e-6 rad/s. The error estimate is timed apart.
"""

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np
from contract import EXACT_FOLDS, FOLD_TOLERANCE, INTERVAL, check_response
from one_core import stay_on_one_core

import flipflow as ff
from flipflow.continuation.frequency_response import contact_free_unknowns, first_unknowns
from flipflow.periodic.exact_solver import ExactSolver

HERE = Path(__file__).parent
ORBIT_SPEED, EXACT_AMPLITUDE = 120.0, 9.969835637e-3
TURNS = 20_000
POINTS = 240  # the longest step is 1 rad/s; where the branch bends or a contact begins more follow
METHODS = {
    "H=3": (ff.HarmonicBalance(3, points=POINTS), 7e-3),
    "H=9": (ff.HarmonicBalance(9, points=POINTS), 9e-3),
    "exact": (ff.PiecewiseExact(points=POINTS), 5e-3),
}
PEERS = {"pyHarm-os": ("pyharm", "run_pyharm.py"), "mousai": ("mousai", "run_mousai.py")}


def timed(call, runs):
    """Median and quartiles in seconds of ``runs`` warm calls, and of the processor alone."""
    for _ in range(3):
        call()
    seconds, busy = [], []
    for _ in range(runs):
        start, start_busy = time.perf_counter(), time.process_time()
        call()
        seconds.append(time.perf_counter() - start)
        busy.append(time.process_time() - start_busy)
    low, median, high = statistics.quantiles(seconds, n=4)
    return {
        "seconds": median,
        "quartiles": [low, high],
        "processor_seconds": statistics.median(busy),
        "runs": runs,
    }


def response(machine, method, target, runs):
    """One method over the whole range."""
    branch = ff.frequency_response(machine, INTERVAL, method)
    check_response(branch)
    if isinstance(method, ff.PiecewiseExact):
        found = [fold.omega for fold in branch.folds]
        assert np.allclose(found, EXACT_FOLDS, rtol=0.0, atol=FOLD_TOLERANCE), found
    solver, traced = branch.formulation.solver(), branch.traced
    row = timed(lambda: ff.frequency_response(machine, INTERVAL, method), runs)
    error = timed(lambda: solver.errors(traced.u, traced.omega), runs)
    return row | {
        "target": target,
        "points": int(branch.omega.size),
        "largest_step": float(np.abs(np.diff(branch.omega)).max()),
        "folds": [fold.omega for fold in branch.folds],
        "error_estimate_seconds": error["seconds"],
    }


def orbit(machine, runs):
    """An exact orbit with its multipliers from the linear motion: no neighbour helps."""
    solver = ExactSolver(machine.system(), half_turn=True)

    def cold():
        point = solver.solve(contact_free_unknowns(solver, ORBIT_SPEED), ORBIT_SPEED)
        return point, np.linalg.eigvals(point.return_map) ** 2

    point, _ = cold()
    x1, xf = (
        solver.motion(point.u, ORBIT_SPEED)
        .derivative(np.linspace(0.0, 2.0 * np.pi / ORBIT_SPEED, 20_001), 0)
        .T
    )
    assert abs(np.ptp(x1 - xf) / 2.0 - EXACT_AMPLITUDE) < 1e-9
    return timed(cold, 50 * runs) | {"target": 100e-6}


def preparation(machine, runs):
    """A machine flattened and its scratch made, from its system."""
    system = machine.system()
    return timed(lambda: ExactSolver(system, half_turn=True), 50 * runs) | {"target": 50e-6}


def first_orbit(machine, runs):
    """The motion reached from below at one frequency, of a machine seen for the first time."""
    system = machine.system()

    def first():
        solver = ExactSolver(system, half_turn=True)
        return solver.solve(first_unknowns(solver, ORBIT_SPEED), ORBIT_SPEED)

    x1, xf = first().u[:2]
    assert abs(x1 - xf) < EXACT_AMPLITUDE
    return timed(first, 10 * runs) | {"target": 300e-6}


def over_clearance(machine, runs):
    """The large motion at 203 rad/s over the clearance, special points included."""
    orbits = ff.frequency_response(machine, INTERVAL).orbits_at(203.0)
    largest = max(orbits, key=lambda orbit: orbit.amplitude("relative"))
    return timed(lambda: ff.continue_orbit(largest, "clearance", (2e-3, 9e-3)), runs) | {
        "target": 0.3
    }


def fold_curve(machine, runs):
    """A fold over the clearance, through the cusp to the other one."""
    fold = ff.frequency_response(machine, INTERVAL).folds[0]
    return timed(lambda: ff.continue_fold(fold, "clearance", (2e-3, 8e-3)), runs) | {"target": 1.0}


def period_of_flow(machine, runs):
    """One period of settled motion, of many in one call."""
    solver = ExactSolver(machine.system(), half_turn=False)
    state = solver.settled(np.zeros(4), ORBIT_SPEED, 1000)
    row = timed(lambda: solver.settled(state, ORBIT_SPEED, TURNS), runs)
    each = {key: row[key] / TURNS for key in ("seconds", "processor_seconds")}
    scaled = [quartile / TURNS for quartile in row["quartiles"]]
    return row | each | {"quartiles": scaled, "target": 4e-6}


def peer_run(folder, name, harmonics):
    """A response of FFS0827 by a peer at its best setting; None where it is not installed."""
    environment, script = PEERS[name]
    python = folder / environment / "bin" / "python"
    if not python.exists():
        print(f"{name}: no environment, see peers/README.md", file=sys.stderr)
        return None
    command = [python, HERE / "peers" / script, "--harmonics", str(harmonics)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def peer_runs(folder, ours):
    """Each peer that is installed, by its best setting, and how many times longer it took."""
    rows = {}
    for name in PEERS:
        for harmonics in (3, 9):
            row = peer_run(folder, name, harmonics)
            if row is None:
                break
            if row.get("seconds"):
                row["times_ours"] = row["seconds"] / ours[f"H={harmonics}"]["seconds"]
            rows[f"{name} H={harmonics}"] = row
    return rows


def print_table(rows, peers):
    for name, row in rows.items():
        share = row["seconds"] / row["target"]
        line = f"{name:<16}{_readable(row['seconds']):>10}"
        line += f"  processor {_readable(row['processor_seconds']):>8}"
        line += f"  target {_readable(row['target']):>8}"
        line += f"  {share:5.2f} of it"
        if "points" in row:
            line += f"  {row['points']} points, error {_readable(row['error_estimate_seconds'])}"
        print(line, file=sys.stderr)
    for name, row in peers.items():
        false = row.get("false_turning_points", 0) + row.get("impossible_points", 0)
        line = f"{name:<16}{_readable(row.get('seconds', float('nan'))):>10}"
        line += f"  {row.get('times_ours', float('nan')):5.0f} times ours, {row['points']} points"
        line += f", completed: {row['completed']}, false points: {false}"
        print(line, file=sys.stderr)


def _readable(seconds):
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-6:.3g} us"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=40)
    parser.add_argument(
        "--peers", type=Path, nargs="?", const=HERE / ".envs", help="folder of peers/setup.sh"
    )
    options = parser.parse_args()
    machine = ff.load("ffs0827")
    rows = {
        name: response(machine, method, target, options.runs)
        for name, (method, target) in METHODS.items()
    }
    rows["preparation"] = preparation(machine, options.runs)
    rows["first orbit"] = first_orbit(machine, options.runs)
    rows["orbit, cold"] = orbit(machine, options.runs)
    rows["period of flow"] = period_of_flow(machine, options.runs)
    rows["over clearance"] = over_clearance(machine, options.runs)
    rows["fold curve"] = fold_curve(machine, options.runs)
    peers = peer_runs(options.peers, rows) if options.peers else {}
    print_table(rows, peers)
    print(json.dumps({"machine": _machine(), "flipflow": rows, "peers": peers}, indent=1))


def _machine():
    packages = ("flipflow", "numpy", "numba")
    return {
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "cores": os.cpu_count(),
    } | {name: version(name) for name in packages}


if __name__ == "__main__":
    stay_on_one_core()
    main()
