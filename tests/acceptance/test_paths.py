"""Paths that never end early: sections, corners, leaning motions, on machines that nobody chose."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import flipflow as ff
from flipflow.dynamics.contact_free import complex_amplitudes
from judge import close

pytestmark = pytest.mark.numerical
SEED, MACHINES = 20261129, 64
SHIFTS = (math.pi / 6.0, math.pi / 3.0, 2.0, 4.0)


@cache
def draw():
    """The machines of ``benchmarks/chain_draw.py``."""
    sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
    try:
        from chain_draw import draw  # noqa: PLC0415  it stands beside the benchmarks
    finally:
        sys.path.pop(0)
    return draw


def one_sided(phase: float, damping: float, law: str = "paper") -> ff.MechanicalSystem:
    """One mass against one stop, under a force whose phase only shifts time."""
    stop = ff.ClearanceSpring([1.0], 30.0, damping, 0.4, math.inf, law=law)
    force = ff.HarmonicForce([0.5 * np.exp(1j * phase)])
    return ff.MechanicalSystem([[1.0]], [[0.06]], [[1.0]], (stop,), force)


def story(branch: ff.Branch) -> tuple[np.ndarray, np.ndarray]:
    """Where special points stand, in order, and all amplitudes at 20 speeds, sorted."""
    speeds = np.linspace(branch.omega[0], branch.omega[-1], 22)[1:-1]
    amplitudes = [sorted(o.amplitude(0) for o in branch.orbits_at(float(w))) for w in speeds]
    return np.array([p.omega for p in branch.special_points]), np.concatenate(amplitudes)


@pytest.mark.parametrize("damping", [1.0, 10.0])
@pytest.mark.parametrize("law", ["paper", "compression-only"])
def test_the_phase_of_the_force_only_shifts_time(damping: float, law: str) -> None:
    """With the state at a fixed phase as unknown it decided where the branch ended."""
    branch = ff.frequency_response(one_sided(0.0, damping, law), (0.3, 2.5))
    assert branch.complete, branch.status
    points, amplitudes = story(branch)
    for phase in SHIFTS:
        shifted = ff.frequency_response(one_sided(phase, damping, law), (0.3, 2.5))
        assert shifted.complete, (phase, shifted.status)
        its_points, its_amplitudes = story(shifted)
        close(f"special points at {phase}", its_points, points, rel=1e-9)
        close(f"amplitudes at {phase}", its_amplitudes, amplitudes, rel=1e-9)


def test_the_public_state_stays_at_phase_zero() -> None:
    """Wherever the section has moved to, an orbit's state is the one at t = 0."""
    branch = ff.frequency_response(one_sided(0.0, 1.0), (0.3, 2.5))
    assert (branch.traced.record.phase != 0.0).any()
    for i in range(0, branch.omega.size, 40):
        orbit = branch.orbit(i)
        again = ff.simulate(branch.machine, orbit.omega, periods=1, initial=orbit.state)
        close("a turn later", again.displacement(0)[-1], orbit.state[0], abs=1e-9)
        close("trace", orbit.monodromy.trace(), branch.multipliers[i].sum().real, rel=1e-6)


@pytest.mark.parametrize("chunk", range(8))
def test_random_machines_to_the_end(chunk: int) -> None:
    """Chains with stops of any damping under both laws; benchmarks/paths.py draws anew."""
    per = MACHINES // 8
    for number in range(chunk * per, (chunk + 1) * per):
        machine, interval = draw()(SEED, number)
        branch = ff.frequency_response(machine, interval)
        assert branch.complete, (number, branch.status)


@pytest.mark.parametrize(
    ("machine", "interval"),
    [
        (ff.load("rig-lin2024").replace(stop_law="compression-only"), (5.0, 475.0)),
        *(
            (
                ff.load("ffs0827").replace(stop_damping=2.0 * ratio * math.sqrt(8.1e6 * 231.6)),
                (5.0, 250.0),
            )
            for ratio in (0.7, 1.0)
        ),
        (
            ff.load("ffs0827").replace(
                stop_damping=2.0 * 0.4 * math.sqrt(8.1e6 * 231.6), clearance_minus=4e-3
            ),
            (5.0, 250.0),
        ),
    ],
    ids=["rig", "ratio-0.7", "ratio-1", "unequal-gaps"],
)
def test_damped_stops_of_the_bundled_machines(machine, interval) -> None:
    branch = ff.frequency_response(machine, interval)
    assert branch.complete, branch.status
    assert (branch.omega[0], branch.omega[-1]) == interval


def test_a_branch_turns_back_where_it_grazes() -> None:
    """Past the peak the motion in contact meets the one without where that begins to graze.

    Both lie on the side of higher speed: the fold stands at the grazing itself, which the linear
    motion tells.
    """
    machine = one_sided(0.0, 4.0, "compression-only")
    gap = machine.springs[0].gaps[0]

    def beyond(omega: float) -> float:
        return float(abs(complex_amplitudes(machine, np.array([omega]))[0, 0])) - gap

    grazing = brentq(beyond, 1.2, 2.5, xtol=1e-13)
    branch = ff.frequency_response(machine, (0.3, 2.5))
    assert branch.complete, branch.status
    turn = min(branch.folds, key=lambda fold: abs(fold.omega - grazing))
    close("where it turns", turn.omega, grazing, rel=1e-10)
    close("its amplitude", turn.amplitude(0), gap, rel=1e-10)
    touching, free = branch.orbits_at(grazing + 1e-4)[-2:]
    assert touching.amplitude(0) > gap > free.amplitude(0)


def test_both_sides_met_at_once_go_on_evenly() -> None:
    """A third stop, never met, keeps the machine from being its own mirror image in the file.

    Where both sides of the symmetric stop graze at once, motions that lean branch off; the branch
    is the even one, that of the machine without the third stop.
    """
    even = ff.load("ffs0827").replace(stop_law="compression-only")
    system = even.system()
    idle = ff.ClearanceSpring([1.0, 0.0], 1e6, 1e3, 0.5, math.inf)
    both = ff.MechanicalSystem(
        system.M, system.C, system.K, (*system.springs, idle), system.excitation
    )
    ours, reference = (ff.frequency_response(m, (5.0, 250.0)) for m in (both, even))
    assert ours.complete
    for speed in (100.0, 150.0, 203.0, 240.0):
        mine, its = (sorted(o.amplitude(0) for o in b.orbits_at(speed)) for b in (ours, reference))
        close(f"amplitudes at {speed}", mine, its, rel=1e-8)


@pytest.mark.parametrize(
    ("omega", "stable"), [(206.4035, [26.667e-3, 6.594e-3]), (198.6502716, [39.447e-3, 8.3918e-3])]
)
def test_motions_beside_a_fold(omega: float, stable: list[float]) -> None:
    """Both motions of the fold are found, and each word comes from its own multipliers."""
    branch = ff.frequency_response(ff.load("ffs0827"), (5.0, 250.0))
    orbits = branch.orbits_at(omega)
    assert len(orbits) == 3
    close("stable", [o.amplitude("relative") for o in orbits if o.stable], stable, rel=1e-4)
    assert all(o.stable == bool(abs(o.multipliers[0]) < 1.0) for o in orbits)


@pytest.mark.parametrize("share", [1e-9, 1e-7, 1e-5, 1e-4, 1e-3])
@pytest.mark.parametrize("method", [ff.PiecewiseExact(), ff.HarmonicBalance(3)], ids=repr)
def test_gaps_that_are_nearly_equal(share: float, method) -> None:
    """Only a stop that is exactly the same on both sides keeps a branch even."""
    screen = ff.load("ffs0827")
    machine = screen.replace(clearance_minus=screen.clearance * (1.0 + share))
    branch = ff.frequency_response(machine, (60.0, 250.0), method)
    assert branch.complete, branch.status


DRAWN = 1_690_858_624  # a seed of benchmarks/paths.py


@pytest.mark.parametrize(
    ("law", "ratio", "number", "seed"),
    [
        # From the motion without contact the branch leads far down before it leads up.
        ("paper", 0.0, 10, 726483726),
        # Sharp turns beside a stop on which the machine rests, and hardly moves.
        ("paper", 0.0, 258, 726483726),
        ("paper", 0.0, 356, 726483726),
        # No pivot told that the matrix is nearly singular where leaning motions branch off.
        ("paper", 1.0, 489, 726483726),
        ("undamped-rebound", 0.15, 36, 631589201),
        # Rounding ended a contact on one side only, and the tangent leaned.
        ("compression-only", 0.05, 17, 631589201),
        # What it settles into only turns back; what it does at higher speeds leads down.
        ("paper", 0.0, 293, 1948909184),
        ("paper", 1.0, 204, 201260871),
        ("paper", 0.15, 271, 201260871),
        # A step over a sharp corner landed on the other side, and led back over it.
        ("paper", 0.0, 92, 221801667),
        # Tangents mix so far around a crossing that no short step leads on: the chord does.
        ("undamped-rebound", 1.0, 312, 221801667),
        ("undamped-rebound", 0.05, 92, 221801667),
        ("paper", 0.0, 261, DRAWN),  # a Newton step that shrinks no more was taken for rounding
        ("paper", 0.05, 360, DRAWN),
        ("paper", 0.15, 117, DRAWN),  # a short step at a crossing led onto leaning motions
        ("compression-only", 0.05, 7, DRAWN),  # went back to contacts two points before a corner
        ("compression-only", 1.0, 215, DRAWN),  # leaning motions from a second touch, in rounds
        ("compression-only", 1.0, 480, DRAWN),
        ("compression-only", 0.05, 220, DRAWN),  # what Newton leaves at a crossing is no leaning
        ("undamped-rebound", 0.05, 203, DRAWN),  # a long step from leaning motions to the even one
    ],
)
def test_machines_whose_branch_ended_early(law: str, ratio: float, number: int, seed: int) -> None:
    """Machines of benchmarks/paths.py, each with the reason for which it did."""
    machine, interval = draw()(seed, number, law=law, ratio=ratio)
    branch = ff.frequency_response(machine, interval)
    assert branch.complete, branch.status
    assert (branch.omega[0], branch.omega[-1]) == interval


def test_crossings_are_passed_with_steps_of_any_length() -> None:
    """Close to where leaning motions branch off both tangents mix; it failed once in ten."""
    machine, _ = draw()(DRAWN, 227, law="paper", ratio=0.0)
    for points in range(17, 27):
        branch = ff.frequency_response(machine, (0.55, 0.7), ff.PiecewiseExact(points=points))
        assert branch.complete, (points, branch.status)
        assert len(branch.points_of("branch point")) == 4


@pytest.mark.parametrize("pull", [1e-7, 1e-5, 1e-3])
@pytest.mark.parametrize("order", [0, 2])
def test_machines_that_are_hardly_uneven(pull: float, order: int) -> None:
    """Equal gaps, and a little constant force or one twice as fast: no motion is even."""
    stop = ff.ClearanceSpring([1.0], 20.0, 0.2, 3.0)
    forces = (ff.Unbalance([1.0]), *([ff.HarmonicForce([pull], order=order)] if order else []))
    machine = ff.MechanicalSystem(
        [[1.0]], [[0.1]], [[1.0]], [stop], forces, static_force=None if order else [pull]
    )
    branch = ff.frequency_response(machine, (0.3, 6.0))
    assert branch.complete, branch.status


@pytest.mark.parametrize(
    ("number", "law", "omega", "word"),
    [
        (10, "undamped-rebound", 1.9335034, "contact begin"),
        (6, "compression-only", 0.9235096, "contact end"),
    ],
)
def test_a_contact_at_a_corner_has_the_word_of_the_motion_without_it(number, law, omega, word):
    """It was that of the side on which the corner was reached, by chance of the phase."""
    system, interval = draw()(61, number, law=law)
    for phase in (0.0, 0.9, 2.1, 3.3, 4.6):
        given = system.excitation
        turned = replace(given, vector=given.vector * np.exp(1j * phase))
        branch = ff.frequency_response(replace(system, excitation=turned), interval)
        (corner,) = (
            point
            for point in branch.special_points
            if point.kind.startswith("contact") and abs(point.omega - omega) < 1e-6
        )
        assert corner.kind == word, phase
