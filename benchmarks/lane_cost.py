"""What a motion in lanes costs against lanes, masses, stops and excitations, as a law.

    python benchmarks/lane_cost.py [--plot cost.svg] [--seed N]

Machines are chains of equal masses whose first ones meet a stop each; their forces lie within 10 %.
One number is varied at a time from two masses with one stop, one excitation, 256 lanes and 24
speeds. Counted are solutions with contact, multipliers and last Newton step, in microseconds of
processor; a + b n^p is fitted to each series.
"""

import argparse
import statistics
import time
from pathlib import Path

import numpy as np
from scipy.optimize import curve_fit

import flipflow as ff
from flipflow.batch.reasons import FOUND
from flipflow.batch.solutions import nothing_asked, solve_lanes
from flipflow.batch.variants import batches

SERIES = {
    "lanes": (1, 4, 16, 64, 256, 1024, 4096),
    "masses": (1, 2, 3, 4, 6, 8),
    "stops": (1, 2, 3, 4),
    "excitations": (1, 2, 3, 4),
}
USUAL = {"lanes": 256, "masses": 2, "stops": 1, "excitations": 1}
OF_STOPS = {"masses": 4}  # what else is changed, so that there is room for as many stops
SPEEDS = np.linspace(0.3, 0.4, 24)
ROUNDS = 3


def chain(masses, stops, excitations):
    """Equal masses in a row, the first fixed by its spring, the first ones with a stop each."""
    K = 2.0 * np.eye(masses) - np.eye(masses, k=1) - np.eye(masses, k=-1)
    K[-1, -1] = 1.0
    springs = [
        ff.ClearanceSpring(np.eye(masses)[j], 1.0, 0.1, 0.3 * (1.0 + j)) for j in range(stops)
    ]
    forces = [
        ff.HarmonicForce(0.6 / (2 * h + 1) ** 2 * np.eye(masses)[0], order=2 * h + 1)
        for h in range(excitations)
    ]
    return ff.MechanicalSystem(np.eye(masses), 0.3 * K, K, tuple(springs), tuple(forces))


def cost(numbers, rng):
    """Microseconds of processor a solution, and the share of lanes with contact."""
    machine = chain(numbers["masses"], numbers["stops"], numbers["excitations"])
    columns = {"forcing": rng.uniform(0.9, 1.1, numbers["lanes"])}
    (batch,), _ = batches(machine, columns)
    asked = nothing_asked(numbers["masses"], SPEEDS.size)
    spent = []
    for _ in range(ROUNDS + 1):
        clock = time.process_time()
        found, read = solve_lanes(batch, SPEEDS, asked)
        spent.append(time.process_time() - clock)
    there = found.reason == FOUND
    touching = there & (read.share > 0.0).any(axis=2)
    return 1e6 * statistics.median(spent[1:]) / max(there.sum(), 1), touching.mean()


def law(n, a, b, p):
    """What is fitted."""
    return a + b * n**p


def fitted(n, values):
    """a, b and p."""
    bounds = ([0.0, 0.0, -1.0], [np.inf, np.inf, 4.0])
    found, _ = curve_fit(law, n, values, p0=(1.0, values[0], 1.0), sigma=values, bounds=bounds)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plot", type=Path, help="SVG, PDF or PNG to draw")
    parser.add_argument("--seed", type=int, default=int(time.time()))
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    print(f"seed {given.seed}")
    drawn = {}
    for name, counts in SERIES.items():
        more = OF_STOPS if name == "stops" else {}
        told = [cost(USUAL | more | {name: count}, rng) for count in counts]
        values = np.array([one for one, _ in told])
        a, b, p = fitted(np.array(counts, float), values)
        drawn[name] = counts, values, (a, b, p)
        print(f"{name}: {a:.2f} + {b:.2f} n^{p:.2f} microseconds")
        for count, (value, touching) in zip(counts, told, strict=True):
            print(f"    {count:5d} {value:9.2f}   {touching:.0%} with contact")
    if given.plot:
        draw(drawn, given.plot)


def draw(drawn, path):
    """One panel a series."""
    from matplotlib.figure import Figure  # noqa: PLC0415  only for a plot

    figure = Figure((10.0, 2.8), layout="constrained")
    for axes, (name, (counts, values, found)) in zip(
        figure.subplots(1, len(drawn), sharey=True), drawn.items(), strict=True
    ):
        n = np.geomspace(counts[0], counts[-1], 200)
        a, b, p = found
        axes.plot(n, law(n, *found), label=f"{a:.1f} + {b:.1f} n$^{{{p:.2f}}}$")
        axes.plot(counts, values, "o")
        axes.set(xlabel=name, xscale="log" if name == "lanes" else "linear", yscale="log")
        axes.legend()
    figure.supylabel("µs a solution")
    figure.savefig(path)


if __name__ == "__main__":
    main()
