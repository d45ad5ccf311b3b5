"""Which motions exist beside the ordinary one: 20 ... 600 rad/s, with full, half, quarter damping.

``periodic_orbits`` searches a grid of speeds for motions of up to six periods. Each motion that is
not on a branch known already is followed both ways by ``continue_orbit``, so that a family of
motions is one row of the table, whatever the number of speeds at which it was met. The families'
ends are their refined folds. Speeds closer than the grid's step to each other may hide a family.
"""

import argparse
import sys
import time

import numpy as np

import flipflow as ff
from flipflow.continuation.special_points import DOUBLING, STABILITY_CHANGES

LOW, HIGH, STEP = 20.0, 600.0, 5.0
FOLLOWED = (10.0, 900.0)
DAMPINGS = (1.0, 0.5, 0.25)
MAX_PERIODS = 6
SAME = 1e-7
WINDOW, CELLS = 0.02, 30
COLUMNS = (
    "periods", "exists, rad/s", "stable, rad/s", "amplitude while stable, mm",
    "share of starts", "settle on nothing", "branch", "period doublings, rad/s",
)  # fmt: skip


def damped(screen, share):
    names = ("isolation_damping", "shear_damping", "stop_damping")
    return screen.replace(**{name: share * getattr(screen, name) for name in names})


def lies_on(orbit, branch):
    """Whether the motion, or its mirror image, is one of the branch."""
    if branch.periods != orbit.periods or not (
        branch.omega.min() <= orbit.omega <= branch.omega.max()
    ):
        return False
    away = [
        abs(other.amplitude("relative") - orbit.amplitude("relative"))
        for other in branch.orbits_at(orbit.omega)
    ]
    return min(away, default=np.inf) < SAME


def leans(orbit):
    """Whether the motion differs from its mirror image."""
    t = np.linspace(0.0, orbit.periods * 2.0 * np.pi / orbit.omega, 1441)
    x = orbit.motion.derivative(t, 0) @ orbit.system.coordinate("relative")
    return bool(abs(x.max() + x.min()) > SAME)


def families(screen, speeds, report):
    """The branch from below, every other family of motions, and the speeds where each was met."""
    ordinary = ff.frequency_response(screen, (LOW, HIGH))
    known, met = [], []
    for omega in speeds:
        for orbit in ff.periodic_orbits(screen, float(omega), max_periods=MAX_PERIODS):
            if orbit.periods == 1 and lies_on(orbit, ordinary):
                continue
            k = next((k for k, one in enumerate(known) if lies_on(orbit, one)), None)
            if k is None:
                k = len(known)
                known.append(ff.continue_orbit(orbit, "omega", FOLLOWED))
                met.append([])
            met[k].append(orbit)
        report(omega, len(known))
    return ordinary, known, met


def stable_windows(branch):
    """Intervals of speed with a stable motion of the branch, ended at refined points."""
    stable = branch.stable
    edges = np.flatnonzero(np.diff(np.concatenate([[False], stable, [False]]).astype(int)))
    changes = [p for p in branch.special_points if p.kind in STABILITY_CHANGES]
    windows = []
    for first, end in edges.reshape(-1, 2):
        beside = [p.omega for p in changes if first - 1 <= p.position <= end]
        speeds = [*branch.omega[first:end], *beside]
        windows.append([float(min(speeds)), float(max(speeds))])
    if branch.status is branch.status.CLOSED and stable[0] and stable[-1] and len(windows) > 1:
        # The record of a closed branch begins within a window.
        first, last = windows[0], windows.pop()
        windows[0] = [min(first[0], last[0]), max(first[1], last[1])]
    return sorted(windows)


def share_of(screen, branch, omega):
    """Share of a window of starts that settles on the family, both images, and what does not.

    Relative displacements up to WINDOW, relative velocities up to omega times that.
    """
    x = np.linspace(-WINDOW, WINDOW, CELLS)
    b = ff.basins(screen, omega, {"relative": x}, {"relative": omega * x})
    ours = [
        share for orbit, share in zip(b.orbits, b.shares, strict=True) if lies_on(orbit, branch)
    ]
    return {"omega": omega, "share": float(sum(ours)), "unsettled": b.unsettled}


def row(screen, branch, orbit):
    """One family as cells of the table; angles and speeds in rad/s, lengths in mm."""
    windows = stable_windows(branch)
    size = 1e3 * branch.amplitude("relative")[branch.stable]
    low, high = max(windows, key=lambda one: one[1] - one[0])
    tried = share_of(screen, branch, float(round((low + high) / 2.0)))
    ends = [branch.omega.min(), branch.omega.max(), *(fold.omega for fold in branch.folds)]
    doublings = [p.omega for p in branch.special_points if p.kind == DOUBLING]
    return [
        f"{branch.periods}" + (", leans" if leans(orbit) else ""),
        f"{min(ends):.3f} ... {max(ends):.3f}",
        ", ".join(f"{low:.3f} ... {high:.3f}" for low, high in windows),
        f"{size.min():.1f} ... {size.max():.1f}",
        f"{100.0 * tried['share']:.0f} % at {tried['omega']:.0f}",
        f"{100.0 * tried['unsettled']:.1f} %",
        "closed" if branch.status is branch.status.CLOSED else branch.status.value,
        ", ".join(f"{omega:.3f}" for omega in sorted(doublings)),
    ]


def explore(screen, speeds, damping):
    """Print the rows of one damping."""
    begin = time.perf_counter()

    def report(omega, count):
        said = f"damping x{damping:g}, {omega:5.0f} rad/s: {count} families"
        sys.stderr.write(f"\r{said}, {time.perf_counter() - begin:.0f} s ")

    ordinary, known, met = families(screen, speeds, report)
    sys.stderr.write("\n")
    folds = ", ".join(f"{fold.omega:.3f}" for fold in ordinary.folds)
    peak = ordinary.peak("relative")
    top = 1e3 * peak.amplitude("relative")
    print(f"\ndamping x{damping:g}: ordinary branch folds at {folds}; peak {top:.1f} mm")
    print("| " + " | ".join(COLUMNS) + " |")
    print("|" + "---|" * len(COLUMNS))
    for branch, orbits in zip(known, met, strict=True):
        print("| " + " | ".join(row(screen, branch, orbits[0])) + " |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--step", type=float, default=STEP, help="between speeds, rad/s")
    given = parser.parse_args()
    speeds = np.arange(LOW, HIGH + given.step / 2.0, given.step)
    screen = ff.load("ffs0827")
    for damping in DAMPINGS:
        explore(damped(screen, damping), speeds, damping)


if __name__ == "__main__":
    main()
