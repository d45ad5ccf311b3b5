"""Designs at full size: the factor against the paper's machine, a grid, seeds, and the time.

``python benchmarks/design.py``: tests/acceptance/test_design.py is the same in small.
"""

from __future__ import annotations

import itertools
import os
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import flipflow as ff
from flipflow.studies.candidates import Space

sys.path[:0] = [str(Path(__file__).parents[1] / "tests" / one) for one in (".", "acceptance")]
from test_design import duty, exact_amplitudes  # noqa: E402

POINTS = 20  # of the grid, a field
ROWS = 2000  # machines of one call
ASKED = 120.0  # s on two cores for six fields and twelve combinations


def steadiest() -> None:
    """Must show 1 and 2."""
    found, other = ff.design(duty()), ff.design(duty(seed=2))
    exact = exact_amplitudes(found.screen, found.duty)
    own = exact_amplitudes(found.duty.project.screen, found.duty)
    off = float(np.abs(exact / found.chosen.amplitude - 1.0).max())
    print(found.sentence)
    print(f"factor {np.ptp(own) / np.ptp(exact):.4g}, lanes off the exact branch by {off:.1e}")
    print(f"another seed: {other.chosen.band / found.chosen.band - 1.0:+.2e} of the band")
    space, best = Space(found.duty), np.inf
    shares = np.linspace(0.0, 1.0, POINTS)
    points = itertools.product(shares, repeat=len(space.genes))
    while rows := list(itertools.islice(points, ROWS)):
        judged = space.judge(np.array(rows))
        better = np.array(rows)[judged.fits & (judged.band < best)]
        # Other motions are looked for where it matters.
        judged = space.judge(better, margins=space.duty.loads) if better.size else judged
        best = min(best, float(judged.band[judged.fits].min(initial=np.inf)))
    print(f"grid of {POINTS} points a field: {best:.6g} m, proposed {found.chosen.band:.6g} m")


def in_time() -> None:
    """Must show 6: six free fields, twelve combinations, tolerances on."""
    project = ff.load_project("ffs0827")
    asked = replace(
        duty(),
        project=project,
        load_cases=(*project.load_cases[:3], ff.Load(name="heavy", floating_mass=40.0)),
        temperatures=(-10.0, 20.0, 50.0),
        tolerance=2e-3,
        limits=replace(ff.Limits(), jump_margin=0.1, stop_force=60e3),
        free={**duty().free, "shear_damping": (1e3, 8e3), "isolation_stiffness": (4e5, 9e5)},
    )
    begin = time.perf_counter()
    found = ff.design(asked)
    seconds = time.perf_counter() - begin
    print(found.sentence)
    print(f"{len(asked.loads)} combinations, {len(asked.free)} fields: {seconds:.0f} s "
          f"of {ASKED:.0f} s on {os.cpu_count()} cores")  # fmt: skip


if __name__ == "__main__":
    in_time()
    steadiest()
