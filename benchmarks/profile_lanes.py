"""Where the time of a motion in lanes goes, stage by stage, in microseconds of processor.

    python benchmarks/profile_lanes.py [--omega 120] [--repeats 20000]

Each stage is what lanes call, repeated on the motion of FFS0827 reached from below. Where speeds
lie close a lane needs Newton's step, multipliers, guess and readings once each; a machine that has
no neighbour needs the modes of its contact states, too, and Newton's step some times. Derivatives
are those with respect to the ten parameters of lanes.py.
"""

import argparse
import math
import statistics
import time

import numpy as np
from lanes import FIELDS, slopes_asked

import flipflow as ff
from flipflow.batch.lane_columns import lane_columns
from flipflow.batch.lane_kernels import new_found, problem_of, run_lanes
from flipflow.batch.lane_path import (
    is_even,
    largest_multiplier,
    new_lane_work,
    newton_step,
    predict,
)
from flipflow.batch.lane_readings import new_reading_work, new_readings, read_lane
from flipflow.batch.lane_slopes import read_slopes, state_slopes
from flipflow.batch.reasons import FOUND, NOT_COMPUTED
from flipflow.batch.slope_readings import new_slope_work, new_slopes
from flipflow.batch.solutions import nothing_asked
from flipflow.batch.variants import batches
from flipflow.compiled.compile import kernel
from flipflow.dynamics.assembly import machine_arrays
from flipflow.dynamics.flow import run_flow
from flipflow.dynamics.modes import prepare
from flipflow.dynamics.multiplier_slopes import multiplier_slopes
from flipflow.dynamics.parameter_tangent import carry_starts
from flipflow.periodic.shooting import shoot
from flipflow.periodic.two_event import only_motion

ROUNDS = 7
SPEEDS = 28  # that a lane has behind it, as close as in lanes.py
STAGES = (
    "modes of two contact states", "flow over half a turn, with tangent", "Newton's step: that",
    "multipliers", "guess through the last motions", "readings", "whether there is one motion",
)  # fmt: skip
MODES, FLOW, STEP, MULTIPLIERS, GUESS, READINGS, ONLY = range(len(STAGES))
OF_SLOPES = (
    "flow alone", "derivatives over its segments", "derivatives of states: those, and the rest",
    "of readings", "of multipliers",
)  # fmt: skip
FLOW_ALONE, SEGMENTS, STATES, OF_READINGS, OF_MULTIPLIERS = range(len(OF_SLOPES))


@kernel(entry=True)
def repeated(stage, repeats, machine, length, omega, work, reading, asked, readings):
    """One stage of a motion again and again; the drive is that of another speed each time."""
    half = is_even(machine)
    problem, flow = problem_of(machine, half, length), work.shooting.flow
    turn = (1.0 if half else 2.0) * math.pi / omega
    for _ in range(repeats):
        if stage == MODES:
            prepare(machine, flow.modes, 0)
            prepare(machine, flow.modes, 1)
        elif stage == MULTIPLIERS:
            work.largest[0] = math.nan
            largest_multiplier(work, omega)
        elif stage == GUESS:
            predict(work, 1.01 * omega)
        elif stage == ONLY:
            only_motion(machine, flow, work.touch, omega)
        elif stage == READINGS:
            read_lane(machine, flow, reading, asked, omega, turn, half, readings, 0, 0)
        else:
            for slot in range(flow.driven_at.shape[0]):
                flow.driven_at[slot] = math.nan
            for k in range(work.z.shape[0]):
                work.z[k] = work.path[0, k]
            if stage == FLOW:
                shoot(problem, work.shooting, work.z, omega, work.shooting.tangent)
            else:
                newton_step(problem, work, omega)


@kernel(entry=True)
def repeated_slopes(stage, repeats, machine, length, omega, z, mu, work, asked, wanted, slopes):
    """One stage of the derivatives of a motion again and again."""
    half, columns = is_even(machine), work.machine_columns
    problem, flow = problem_of(machine, half, length), work.lane.shooting.flow
    turn = (1.0 if half else 2.0) * math.pi / omega
    for _ in range(repeats):
        if stage == FLOW_ALONE:
            for k in range(z.shape[0]):
                flow.z[k] = z[k]
            run_flow(machine, flow, omega, 0.0, turn, work.lane.shooting.rate)
        elif stage == SEGMENTS:
            carry_starts(machine, flow, omega, columns, work.starts, work.tangents, work.columns)
        elif stage == STATES:
            state_slopes(problem, columns, omega, z, work, slopes.state[0, 0])
        elif stage == OF_READINGS:
            read_slopes(problem, columns, omega, asked, wanted, True, work, slopes, 0, 0)
        else:
            multiplier_slopes(
                machine, flow, omega, columns, problem.sign, half, work.shift, work.tangents, mu,
                work.lane.schur, work.multiplier, work.columns, slopes.multiplier[0, 0],
            )  # fmt: skip


def told(name, stage, repeats, one):
    """Print the median time of a stage."""
    spent = []
    for _ in range(ROUNDS + 1):
        clock = time.process_time()
        one(stage, repeats)
        spent.append(time.process_time() - clock)
    print(f"{name:44s}{1e6 * statistics.median(spent[1:]) / repeats:8.2f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--omega", type=float, default=120.0)
    parser.add_argument("--repeats", type=int, default=20_000)
    given = parser.parse_args()
    screen = ff.load("ffs0827")
    system = screen.system().with_bonded()
    machine = machine_arrays(system)
    omega = np.linspace(given.omega - SPEEDS, given.omega, SPEEDS)
    asked = nothing_asked(2, omega.size)._replace(coordinate=np.array([[1.0, -1.0]]))
    (batch,), _ = batches(screen, {"clearance": np.array([screen.clearance])})
    work = new_lane_work(machine, np.zeros(1, np.int64))
    reading = new_reading_work(work.shooting.flow, machine, asked)
    found = new_found(1, omega.size, system.size, NOT_COMPUTED)
    readings = new_readings(1, omega.size, machine, asked)
    run_lanes(
        batch.arrays, 0, 1, omega, batch.length, work, reading, asked, found, readings,
    )  # fmt: skip
    assert (found.reason == FOUND).all()
    assert readings.share[0, -1, 0] > 0.0
    for stage, name in enumerate(STAGES):
        told(
            name,
            stage,
            given.repeats,
            lambda stage, repeats: repeated(
                stage, repeats, machine, batch.length, given.omega, work, reading, asked, readings
            ),
        )
    columns = {name: np.array([getattr(screen, name)]) for name in FIELDS}
    (batch,), _ = batches(screen, columns)
    changes = lane_columns(screen, columns, batch, FIELDS).solved
    slope_work = new_slope_work(machine, asked, changes, np.zeros(1, np.int64))
    slopes = new_slopes(found, machine, asked, len(FIELDS))
    wanted, z, mu = slopes_asked(omega), found.state[0, -1], found.multiplier[0, -1]
    for stage in range(len(OF_SLOPES)):
        told(
            OF_SLOPES[stage],
            stage,
            given.repeats,
            lambda stage, repeats: repeated_slopes(
                stage,
                repeats,
                machine,
                batch.length,
                given.omega,
                z,
                mu,
                slope_work,
                asked,
                wanted,
                slopes,
            ),
        )


if __name__ == "__main__":
    main()
