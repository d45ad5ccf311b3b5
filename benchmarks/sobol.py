"""Sobol indices of the nonlinear amplitude: how long they take, and how much memory.

    python benchmarks/sobol.py [--samples 4096] [--speeds 100] [--threads 2] [--intervals 60]

Ten parameters of FFS0827 within 10 % over many frequencies, n (P + 2) machines at each; then six of
them at one frequency. Every motion is exact; not all of them touch a stop.

With ``--intervals`` alone: of so many seeds, how often confidence intervals of 95 % hold the index
of n = 8192, that field for which they do so least; of the linear machine within 5 %, at 80 rad/s.
"""

import argparse
import resource
import time

import numpy as np

import flipflow as ff

TEN = (
    "main_mass", "floating_mass", "shear_stiffness", "shear_damping", "stop_stiffness",
    "stop_damping", "clearance", "eccentric_moment", "isolation_stiffness", "isolation_damping",
)  # fmt: skip
SIX = TEN[:3] + TEN[4:7]
SEVEN = (*TEN[:4], *TEN[7:])


def study(screen, names, omega, samples, threads):
    """Wall and processor seconds of one study."""
    vary = {name: (0.9 * getattr(screen, name), 1.1 * getattr(screen, name)) for name in names}
    wall, processor = time.perf_counter(), time.process_time()
    ff.sensitivity(screen, vary, "relative_amplitude", omega=omega, n=samples, threads=threads)
    return time.perf_counter() - wall, time.process_time() - processor


def intervals(seeds):
    """Print for each n the least share of seeds whose intervals hold, of all fields and indices."""
    screen = ff.load("ffs0827-linear")
    vary = {name: (0.95 * getattr(screen, name), 1.05 * getattr(screen, name)) for name in SEVEN}

    def found(n, seed):
        return ff.sensitivity(screen, vary, "relative_amplitude", omega=80.0, n=n, rng=seed)

    known = found(8192, seeds)
    for n in (8, 16, 32, 64, 128):
        held = [
            [
                np.abs(one.total - known.total) <= one.total_confidence,
                np.abs(one.first_order - known.first_order) <= one.first_order_confidence,
            ]
            for one in (found(n, seed) for seed in range(seeds))
        ]
        print(f"n = {n}: intervals hold in {np.mean(held, axis=0).min():.0%} of {seeds} seeds")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=4096)
    parser.add_argument("--speeds", type=int, default=100)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--intervals", type=int, default=0)
    given = parser.parse_args()
    if given.intervals:
        intervals(given.intervals)
        return
    screen = ff.load("ffs0827")
    study(screen, SIX, 120.0, 64, given.threads)  # compiled beforehand
    for names, omega in ((SIX, np.array([120.0])), (TEN, np.linspace(60.0, 200.0, given.speeds))):
        wall, processor = study(screen, names, omega, given.samples, given.threads)
        machines = given.samples * (len(names) + 2)
        most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
        print(
            f"{len(names)} parameters, {machines} machines at {omega.size} frequencies: "
            f"{wall:.2f} s, {processor:.2f} s of processor, at most {most:.2f} GiB"
        )


if __name__ == "__main__":
    main()
