"""Every point of curves in two parameters against a branch of its own; the law of hard stops.

The full size of ``tests/acceptance/test_curves_in_two_parameters.py``, whose machines these are.
"""

import argparse
import math
import time

import numpy as np

import flipflow as ff

STIFFNESS = "springs[0].stiffness"
K = np.array([[1.0, -1.0], [-1.0, 2.0]])
WIDE = (0.4, 0.95)


def chain(stiffness=100.0):
    """The public case of two masses."""
    stop = ff.ClearanceSpring([1.0, 0.0], stiffness, 0.0, 1.0, np.inf)
    return ff.MechanicalSystem(np.eye(2), 0.03 * K, K, (stop,), ff.HarmonicForce([0.0, 0.1]))


def hard(stiffness):
    """One mass before a stop without damping."""
    stop = ff.ClearanceSpring([1.0], stiffness, 0.0, 1.0, math.inf)
    return ff.MechanicalSystem([[1.0]], [[0.06]], [[1.0]], (stop,), ff.HarmonicForce([0.5]))


def cases():
    """Name, special point, plane, bounds, and the machine's branch at a value of its field."""
    screen = ff.load("ffs0827")
    nominal = ff.frequency_response(screen, (5.0, 250.0))
    for field, low, high in (
        ("clearance", 2e-3, 9e-3), ("stop_stiffness", 2.7e6, 13.5e6),
        ("shear_stiffness", 1.8e6, 4.5e6),
    ):  # fmt: skip
        yield (
            f"fold, {field}", nominal.folds[0], field, ((low, high), (120.0, 260.0)),
            lambda v, f=field: ff.frequency_response(screen.replace(**{f: v}), (5.0, 300.0)),
        )  # fmt: skip
    small = ff.frequency_response(screen.replace(clearance=2e-3), (50.0, 65.0))
    yield (
        "loss of symmetry, clearance", small.points_of("symmetry breaking")[0], "clearance",
        ((2e-3, 5e-3), (40.0, 110.0)),
        lambda v: ff.frequency_response(screen.replace(clearance=v), (30.0, 120.0)),
    )  # fmt: skip
    two = ff.frequency_response(chain(), (0.5, 0.8))
    for kind, k in (("period doubling", 0), ("Neimark-Sacker", 1), ("fold", 0)):
        yield (
            f"{kind}, stop stiffness of the chain", two.points_of(kind)[k], STIFFNESS,
            ((10.0, 200.0), (0.5, 0.9)), lambda v: ff.frequency_response(chain(v), WIDE),
        )  # fmt: skip
    drawn = screen.replace(clearance_measured="drawn")
    tilted = ff.frequency_response(drawn, (60.0, 100.0)).points_of("period doubling")[0]
    yield (
        "period doubling, deck angle", tilted, "deck_angle",
        ((math.radians(4.0), math.radians(25.0)), (60.0, 100.0)),
        lambda v: ff.frequency_response(drawn.replace(deck_angle=v), (50.0, 110.0)),
    )  # fmt: skip


def compared(points):
    """A line for each curve: points, special points, seconds, largest difference."""
    for name, point, field, bounds, alone in cases():
        begin = time.perf_counter()
        curve = ff.continue_bifurcation(point, (field, "omega"), bounds)
        took = time.perf_counter() - begin
        off, missed = [], 0
        some = np.unique(np.linspace(0, len(curve.orbits) - 1, points).astype(int))
        for i in some:
            found = alone(float(curve.along(field)[i])).points_of(point.kind)
            if found:
                off.append(min(abs(one.omega - curve.omega[i]) for one in found))
            else:
                missed += 1
        marks = [f"{one.kind} {one.values[0]:.6g}, {one.values[1]:.6g}"
                 for one in curve.special_points]  # fmt: skip
        print(f"{name}: {len(curve.orbits)} points in {took:.2f} s, {curve.status.name}; "
              f"{len(off)} compared, off by {max(off):.1e} rad/s at most, {missed} have none; "
              f"{'; '.join(marks)}")  # fmt: skip


def law():
    """Depth at the fold times k^2 over k, against m^2 a / (8 G^2)."""
    for omega in (1.3, 1.4, 1.5, 1.6):
        (free,) = (o for o in ff.periodic_orbits(hard(100.0), omega) if o.amplitude(0) < 1.0)
        fold = ff.continue_orbit(free, "forcing", (0.5, 8.0)).folds[0]
        curve = ff.continue_bifurcation(fold, (STIFFNESS, "forcing"), ((100.0, 1e4), (0.5, 8.0)))
        values, vectors = np.linalg.eig(np.array([[0.0, 1.0], [-1.0, -0.06]]) * 2 * np.pi / omega)
        M0 = (vectors * np.exp(values) @ np.linalg.inv(vectors)).real
        limit = omega**2 / (8.0 * np.linalg.inv(np.eye(2) - M0)[0, 1] ** 2)
        told = [
            f"k {curve.along(STIFFNESS)[i]:.0f}: "
            f"{curve.orbits[i].stop_force_peak() * curve.along(STIFFNESS)[i]:.5f}"
            for i in np.linspace(0, len(curve.orbits) - 1, 4).astype(int)
        ]
        print(f"{omega} rad/s, limit {limit:.5f}: {', '.join(told)}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=1000, help="of each curve; all by default")
    compared(parser.parse_args().points)
    law()
