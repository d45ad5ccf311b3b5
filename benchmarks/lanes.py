"""Many machines in one call: solutions a second, with what bounds them.

    python benchmarks/lanes.py [--machines 2000] [--speeds 100] [--threads 2] [--seed N] [--peers]

Counted are lanes with contact only; each has its multipliers and its last Newton step, amplitude,
stop force and share of contact. Beside them in the same run: derivatives of states and readings,
and of multipliers, with respect to ten parameters; a loop of the package's own single solutions;
scipy's event-located integration of some turns; and, with ``--peers``, responses at H = 3 by
pyHarm-os in its environment of ``peers/setup.sh``.
"""

import argparse
import statistics
import time
from pathlib import Path

import numpy as np
from scipy_flow import carried
from speed import HERE, peer_run

import flipflow as ff
from flipflow.batch.lane_columns import lane_columns
from flipflow.batch.reasons import FOUND
from flipflow.batch.slope_readings import SlopesAsked
from flipflow.batch.solutions import nothing_asked, solve_lanes, solve_slopes
from flipflow.batch.variants import batches

FIELDS = (
    "main_mass", "floating_mass", "shear_stiffness", "shear_damping", "stop_stiffness",
    "stop_damping", "clearance", "eccentric_moment", "isolation_stiffness", "isolation_damping",
)  # fmt: skip
ROUNDS = 5
TRIED, TURNS = 3, 60  # machines that scipy settles, and for how long


def drawn(machine, rows, seed):
    """Ten fields of a machine, each within 10 %."""
    rng = np.random.default_rng(seed)
    return {name: getattr(machine, name) * rng.uniform(0.9, 1.1, rows) for name in FIELDS}


def rate(batch, omega, threads):
    """Solutions with contact a second of processor and of wall, medians of some rounds."""
    asked = nothing_asked(2, omega.size)._replace(coordinate=np.array([[1.0, -1.0]]))
    walls, processors = [], []
    for _ in range(ROUNDS):
        wall, processor = time.perf_counter(), time.process_time()
        found, read = solve_lanes(batch, omega, asked, threads)
        walls.append(time.perf_counter() - wall)
        processors.append(time.process_time() - processor)
    touching = int(((found.reason == FOUND) & (read.share[..., 0] > 0.0)).sum())
    failed = int((found.reason != FOUND).sum())
    return touching / statistics.median(processors), touching / statistics.median(walls), failed


def slopes_asked(omega):
    """Derivatives of states, extremes and forces, not of contact and multipliers."""
    none = np.zeros((1, omega.size, 0, len(FIELDS)), complex)
    return SlopesAsked(
        linear=np.zeros((1, 0, 3, 2, len(FIELDS))), along=none, across=none, means=False,
        contacts=False, multipliers=False, even=True, corner=np.zeros(1, np.int64),
    )  # fmt: skip


def derivative_ratios(batch, machine, columns, omega):
    """Time of solutions with derivatives over that of solutions alone; then multipliers, too."""
    asked = nothing_asked(2, omega.size)._replace(coordinate=np.array([[1.0, -1.0]]))
    wanted, spent = slopes_asked(omega), [[], [], []]
    for _ in range(ROUNDS + 1):
        clock = time.process_time()
        found, _ = solve_lanes(batch, omega, asked)
        spent[0].append(time.process_time() - clock)
        for k, multipliers in ((1, False), (2, True)):
            clock = time.process_time()
            changes = lane_columns(machine, columns, batch, FIELDS)
            one = wanted._replace(contacts=multipliers, multipliers=multipliers)
            solve_slopes(batch, changes.solved, omega, asked, one, found)
            spent[k].append(time.process_time() - clock)
    alone, slopes, maps = (statistics.median(one[1:]) for one in spent)
    return 1.0 + slopes / alone, 1.0 + maps / alone


def one_by_one(machine, columns, peers):
    """The same by loops, as a second of processor; pyHarm-os where there is a folder of it."""
    few = 20
    ff.periodic_orbits(machine, omega=120.0)  # compiled beforehand
    ff.frequency_response(machine, omega=(5.0, 250.0))
    clock = time.process_time()
    for row in range(few):
        alone = machine.replace(**{name: column[row] for name, column in columns.items()})
        ff.periodic_orbits(alone, omega=120.0)
    print(f"periodic_orbits, one by one {few / (time.process_time() - clock):20,.1f}")
    clock = time.process_time()
    for row in range(few):
        alone = machine.replace(**{name: column[row] for name, column in columns.items()})
        ff.frequency_response(alone, omega=(5.0, 250.0))
    print(f"whole responses, one by one {few / (time.process_time() - clock):20,.1f}")
    clock = time.process_time()
    for row in range(TRIED):
        alone = machine.replace(**{name: column[row] for name, column in columns.items()})
        carried(alone.system(), np.zeros(4), 120.0, TURNS, 1e-9, 1e-12)
    print(f"scipy, {TURNS} turns from rest {TRIED / (time.process_time() - clock):24,.2f}")
    row = peers and peer_run(peers, "pyHarm-os", 3)
    if row:
        print(f"pyHarm-os, points of a response {row['points'] / row['seconds']:20,.1f}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--machines", type=int, default=2000)
    parser.add_argument("--speeds", type=int, default=100)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("--peers", type=Path, nargs="?", const=HERE / ".envs")
    given = parser.parse_args()
    machine = ff.load("ffs0827")
    columns = drawn(machine, given.machines, given.seed)
    print(f"seed {given.seed}, {given.machines} machines within 10 %")
    clock = time.process_time()
    (batch,), _ = batches(machine, columns)
    spent = time.process_time() - clock
    print(f"assembly {1e6 * spent / given.machines:.1f} us a machine")
    along, single = np.linspace(90.0, 200.0, given.speeds), np.array([120.0])
    print(f"{'':34s}{'a second of':>14s}{'a second,':>14s}{'not found':>12s}")
    print(f"{'':34s}{'processor':>14s}{given.threads:>6d} threads{'':>12s}")
    for name, omega in (("along speed", along), ("unrelated, one speed", single)):
        for threads in (1, given.threads):
            of_processor, of_wall, failed = rate(batch, omega, threads)
            label = f"{name}, {threads} thread{'s' if threads > 1 else ''}"
            print(f"{label:34s}{of_processor:14,.0f}{of_wall:14,.0f}{failed:12d}")
    for name, omega in (("along speed", along), ("unrelated, one speed", single)):
        slopes, maps = derivative_ratios(batch, machine, columns, omega)
        label = f"with derivatives, {name}"
        print(f"{label:42s} {slopes:.2f} times as long, of multipliers too {maps:.2f}")
    one_by_one(machine, columns, given.peers)


if __name__ == "__main__":
    main()
