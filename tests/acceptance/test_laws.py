"""The four contact laws: force, exact motions, tangent; by formulas, DOP853 and differences."""

from __future__ import annotations

import math
from importlib import resources
from typing import get_args

import numpy as np
import pytest

import flipflow as ff
from flipflow.dynamics.assembly import machine_arrays
from flipflow.model.contact_law import LAWS, ContactLaw, Exit
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.shooting import new_shooting, new_shooting_work
from flipflow.studies.assessment import energy_balance
from flipflow.studies.quantity_values import Working
from judge import GAP, close, upper_orbit
from kernel_calls import central_differences, residual_of, shoot
from reference import integrate

pytestmark = pytest.mark.numerical
NAMES = get_args(ContactLaw)
NEW = ("undamped-rebound", "elasto-gap")
SHARE = 1e-8
MACHINES = 20
FORMULAS = {
    "paper": lambda kp, cv: kp + cv,
    "compression-only": lambda kp, cv: np.maximum(0.0, kp + cv),
    "undamped-rebound": lambda kp, cv: kp + np.maximum(0.0, cv),
    "elasto-gap": lambda kp, cv: kp + np.clip(cv, -kp, kp),
}
# Relative and main frame in mm at 120 rad/s, and the first steps of 1 rad/s after the jumps.
ROW_26 = {
    "undamped-rebound": (9.880, 1.274, 211.0, 200.0),
    "elasto-gap": (9.973, 1.323, 207.0, 198.0),
}


@pytest.mark.parametrize("law", NAMES)
@pytest.mark.parametrize("damping", [0.0, 7.0])
@pytest.mark.parametrize("gaps", [(0.4, 0.7), (0.0, 0.3), (0.5, math.inf)])
def test_force_by_formula(law, damping, gaps) -> None:
    """10,000 random positions and rates, with contact on both sides where there is a stop."""
    k, rng = 30.0, np.random.default_rng(8)
    y, v = rng.uniform(-2.0, 2.0, 10_000), rng.normal(size=10_000) * 5.0
    expected = np.zeros(y.shape)
    for side, gap in zip((1.0, -1.0), gaps, strict=True):
        if math.isfinite(gap):
            p = side * y - gap
            pushed = side * FORMULAS[law](k * p, damping * side * v)
            expected += np.where(p > 0.0, pushed, 0.0)
    spring = ff.ClearanceSpring([1.0], k, damping, *gaps, law=law)
    close("force", spring.force(y, v), expected, abs=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("law", NAMES)
def test_force_jumps_at_the_gap_alone(law) -> None:
    """Two pieces differ by a multiple of the function between them: the tangent is not kicked.

    With k = c = 1 a force f_k p + f_c p' and h = alpha p + beta p' are vectors of two entries.
    """
    pieces = LAWS[law]
    for piece in pieces:
        for way in piece.exits:
            if way == Exit(0, a=1.0):
                continue
            after = pieces[way.to - 1]
            change = np.array([piece.stiffness - after.stiffness, piece.damping - after.damping])
            h = np.array([way.a + way.a_k, way.b + way.b_c])
            assert np.any(change != 0.0)
            close("change x h", change[0] * h[1] - change[1] * h[0], 0.0)


@pytest.mark.parametrize("law", NEW)
def test_row_26(screen, law) -> None:
    """Amplitudes at 120 rad/s to 2e-3 mm; a sweep in steps of 1 rad/s jumps where it is said to."""
    relative, main, up, down = ROW_26[law]
    machine = screen.replace(stop_law=law)
    branch = ff.frequency_response(machine, (60.0, 230.0))
    assert branch.complete
    orbit = upper_orbit(branch, 120.0)
    close("relative, mm", 1e3 * orbit.amplitude("relative"), relative, abs=2e-3)
    close("main, mm", 1e3 * orbit.amplitude("main"), main, abs=2e-3)
    upper, lower = (fold.omega for fold in branch.folds)
    assert (math.ceil(upper), math.floor(lower)) == (up, down)
    rising = ff.sweep(machine, omega=np.arange(up - 4.0, up + 2.0))
    falling = ff.sweep(machine, omega=np.arange(up + 1.0, down - 2.0, -1.0))
    assert [jump.omega_after for jump in rising.jumps] == [up]
    assert [jump.omega_after for jump in falling.jumps] == [down]


def test_laws_are_different_machines(screen) -> None:
    """Main frame of FFS0827 at 160 rad/s: 1.948 mm by the paper's law, 1.631 by the third."""
    for law, expected in (("paper", 1.948), ("undamped-rebound", 1.631)):
        branch = ff.frequency_response(screen.replace(stop_law=law), (100.0, 160.0))
        close(law, 1e3 * upper_orbit(branch, 160.0).amplitude("main"), expected, abs=5e-4)


def check_motion(machine: ff.FlipFlowScreen, orbit: ff.Orbit) -> integrate.Trajectory:
    """Displacements over the turn against DOP853 from the same state, to 1e-8 of the amplitude."""
    path = integrate.flow(
        integrate.Machine.of(machine.system()), orbit.state, orbit.omega, 0.0, orbit.period
    )
    t = np.linspace(0.0, orbit.period, 101)
    x = np.stack([orbit.displacement(which, t) for which in ("main", "floating")], axis=1)
    size = np.abs(x).max()
    close(f"displacements at {orbit.omega}", x, path(t)[:, :2], abs=SHARE * size)
    close("back after the turn", path.final[:2], orbit.state[:2], abs=SHARE * size)
    y, v = path(t)[:, :2] @ GAP, path(t)[:, 2:] @ GAP
    force = machine.stop().force(y, v)
    # At a sample beside a change of contact either of two forces that differ is right.
    away = np.abs(t[:, None] - path.ends).min(axis=1) > 1e-6 * orbit.period
    close("force", orbit.stop_force(0, t)[away], force[away], abs=1e-6 * np.abs(force).max())
    return path


@pytest.mark.parametrize("law", NEW)
@pytest.mark.parametrize("damping", [2.605e3, 40e3])
@pytest.mark.parametrize("omega", [85.0, 120.0, 160.0])
def test_motions_of_ffs0827(screen, law, damping: float, omega: float) -> None:
    machine = screen.replace(stop_law=law, stop_damping=damping)
    orbit = upper_orbit(ff.frequency_response(machine, (60.0, omega)), omega)
    states = {state for pair in check_motion(machine, orbit).states for state in pair}
    pieces = {"undamped-rebound": {"outwards"}, "elasto-gap": {"doubled", "released"}}
    assert states == {"open", "engaged"} | pieces[law]


def random_machine(seed: int, law: str) -> ff.FlipFlowScreen:
    """FFS0827 with factors in [1/2, 2], a stop damped 1 to 30 times, unequal gaps on odd seeds."""
    rng, base = np.random.default_rng([26, seed]), ff.load("ffs0827")
    names = ("main_mass", "floating_mass", "shear_stiffness", "shear_damping", "stop_stiffness")
    changes = {name: getattr(base, name) * 2.0 ** rng.uniform(-1.0, 1.0) for name in names}
    gap = rng.uniform(2e-3, 7e-3)
    minus = gap * rng.choice([1.2, math.inf]) if seed % 2 else None
    damping = base.stop_damping * 30.0 ** rng.uniform()
    return base.replace(
        stop_law=law, clearance=gap, clearance_minus=minus, stop_damping=damping, **changes
    )


@pytest.mark.parametrize("law", NEW)
@pytest.mark.parametrize("seed", range(MACHINES))
def test_motions_of_random_machines(law, seed: int) -> None:
    """A motion in contact, half way along the part of the branch that is."""
    machine = random_machine(seed, law)
    branch = ff.frequency_response(machine, (20.0, 150.0))
    gap = min(machine.stop().gaps)
    touching = np.flatnonzero(branch.amplitude("relative") > 1.02 * gap)
    assert touching.size
    orbit = branch.orbit(int(touching[touching.size // 2]))
    assert orbit.contact_intervals
    check_motion(machine, orbit)


@pytest.mark.parametrize("law", NEW)
@pytest.mark.parametrize("damping", [2.605e3, 40e3])
@pytest.mark.parametrize("omega", [85.0, 120.0, 180.0])
def test_return_map_by_differences(screen, law, damping: float, omega: float) -> None:
    """1e-6 against central differences of the independent flow, velocities over omega."""
    machine = screen.replace(stop_law=law, stop_damping=damping, clearance_minus=7e-3)
    orbit = upper_orbit(ff.frequency_response(machine, (60.0, omega)), omega)
    reference = integrate.Machine.of(machine.system())
    scale = np.array([1.0, 1.0, omega, omega])
    columns = []
    for step in np.diag(1e-7 * scale):
        ends = [
            integrate.flow(reference, orbit.state + way, omega, 0.0, orbit.period, 1e-13).final
            for way in (step, -step)
        ]
        columns.append((ends[0] - ends[1]) / 2e-7 / scale)
    got = orbit.monodromy * scale / scale[:, None]
    close("return map", got, np.stack(columns, axis=1), abs=1e-6)


OMEGA, START = 100.0, np.array([1e-3, -2e-3, 0.3, -0.5])


@pytest.fixture(scope="module")
def greatest(screen) -> float:
    """Greatest relative displacement in m over the turn from START without a stop."""
    machine = integrate.Machine.of(screen.replace(clearance=math.inf).system())
    path = integrate.flow(machine, START, OMEGA, 0.0, 2.0 * np.pi / OMEGA, 1e-13)
    t = np.linspace(0.0, 2.0 * np.pi / OMEGA, 4001)
    return integrate.top(t, path(t)[:, :2] @ GAP, path, GAP)


def turn_map(screen, law: str, gap: float, depth: float) -> tuple[np.ndarray, np.ndarray]:
    """Tangent of a turn from START beside grazing, and the same by differences far finer.

    The stop is one-sided, and damped strongly enough for each law to show its own.
    """
    machine = screen.replace(
        stop_law=law, stop_damping=40e3, clearance=gap - depth, clearance_minus=math.inf
    )
    problem = new_shooting(machine_arrays(machine.system()), half_turn=False, length=1e-3)
    work = new_shooting_work(problem.machine)
    evaluate = residual_of(shoot, problem, work, 4)
    scale = np.array([1.0, 1.0, OMEGA, OMEGA])
    _, J = evaluate(START, OMEGA)
    assert (work.flow.segments[0] > 1) == (depth > 0.0)
    steps = 0.01 * abs(depth) * np.append(scale, OMEGA)
    F = central_differences(evaluate, START, OMEGA, steps)
    return tuple(part[:, :4] * scale / scale[:, None] for part in (J, F))


@pytest.mark.parametrize("law", NAMES)
@pytest.mark.parametrize("share", [1e-3, 1e-5, 1e-7])
@pytest.mark.parametrize("side", [1.0, -1.0], ids=["touching", "below"])
def test_tangent_beside_grazing(screen, greatest, law, share: float, side: float) -> None:
    """Against differences by a hundredth of the depth, itself a share of the gap."""
    J, F = turn_map(screen, law, greatest, side * share * greatest)
    close("tangent", J, F, abs=3e-6)


def test_corner_at_grazing(screen, greatest) -> None:
    """The tangents of both sides: apart by the kick of entry alone, or together.

    A touch of depth d lasts as the root of d, and so do the differences that are let through.
    """
    depth = 1e-9 * greatest
    corner = {}
    for law in NAMES:
        above, below = (turn_map(screen, law, greatest, side * depth)[0] for side in (1.0, -1.0))
        corner[law] = above - below
    kicked = corner["compression-only"]
    size = np.abs(kicked).max()
    assert size > 0.1
    close("undamped-rebound", corner["undamped-rebound"], kicked, abs=1e-3 * size)
    for law in ("paper", "elasto-gap"):
        close(law, corner[law], np.zeros((4, 4)), abs=1e-3 * size)


@pytest.mark.parametrize("law", NAMES)
@pytest.mark.parametrize("damping", [1e-6, 1.0, 100.0, 2.605e3])
def test_contact_begins_where_the_linear_machine_meets_the_gap(screen, law, damping) -> None:
    """Row 10: 81.0637405 rad/s, whatever the law, refined to 1e-6."""
    branch = ff.frequency_response(
        screen.replace(stop_law=law, stop_damping=damping), (60.0, 100.0)
    )
    (begin,) = branch.points_of("contact begin")
    close("contact begins", begin.omega, 81.0637405, abs=1e-6)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_all_laws_in_one_machine(seed: int) -> None:
    """Four masses, a stop of another law on each: five turns from a random state, to 1e-8."""
    shape = 2.0 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1)
    springs = [
        ff.ClearanceSpring(np.eye(4)[k], 20.0 + k, 1.0 + k, 0.3, 0.4, law)
        for k, law in enumerate(NAMES)
    ]
    system = ff.MechanicalSystem(
        np.eye(4), 0.1 * shape, shape, springs, ff.HarmonicForce([1.0, 0.0, 0.0, 0.5j])
    )
    z, end = np.random.default_rng(seed).normal(size=8), 5.0 * 2.0 * np.pi
    path = integrate.flow(integrate.Machine.of(system), z, 1.0, 0.0, end)
    assert {state for states in path.states for state in states} == {
        "open", "engaged", "released", "outwards", "doubled"
    }  # fmt: skip
    got = ExactSolver(system, half_turn=False).settled(z, 1.0, 5)
    close("state after five turns", got, path.final, abs=SHARE)


@pytest.mark.parametrize("law", NEW)
def test_laws_are_written_and_read_again(screen, law, tmp_path) -> None:
    """A branch, saved and opened, is of the same machine; a machine file names the law."""
    branch = ff.frequency_response(screen.replace(stop_law=law), (100.0, 120.0))
    ff.save(branch, tmp_path / "branch.json")
    again = ff.open_result(tmp_path / "branch.json")
    assert again.machine.stop_law == law
    assert again.orbits_at(110.0)[0].state.tolist() == branch.orbits_at(110.0)[0].state.tolist()
    text = resources.files("flipflow.io").joinpath("machines/ffs0827.toml").read_text()
    file = tmp_path / "machine.toml"
    file.write_text(text.replace('law = "paper"', f'law = "{law}"'))
    assert ff.load(file).stop_law == law


@pytest.mark.parametrize("law", NAMES)
@pytest.mark.parametrize("minus", [None, 3e-3, math.inf])
def test_power_balances(screen, law, minus) -> None:
    """What comes in is taken by isolation, shear springs and stop, to 1e-9."""
    machine = screen.replace(stop_law=law, stop_damping=2e4, clearance_minus=minus)
    orbit = ff.periodic_orbits(machine, 140.568)[0]
    powers = energy_balance(Working(machine, orbit))
    taken = powers["isolation"] + powers["shear"] + powers["stop"]
    close("power, W", taken, powers["input"], rel=1e-9)


@pytest.mark.parametrize("law", NAMES)
def test_without_damping_all_laws_are_one(screen, law) -> None:
    machines = [screen.replace(stop_law=name, stop_damping=0.0) for name in ("paper", law)]
    one, other = (ff.frequency_response(m, (60.0, 150.0)).orbits_at(150.0)[0] for m in machines)
    close("state", other.state, one.state, abs=1e-13)
    close("return map", other.monodromy, one.monodromy, abs=1e-9)
    assert {abs(r) for r in other.motion.regime[:, 0]} == {0, 1}


@pytest.mark.parametrize("law", NEW)
def test_laws_run_through_time(screen, law) -> None:
    """simulate, basins and start_up reach the motion of the branch, and start-up keeps its books.

    What is lost never falls: what elasto-gap carries beyond its spring is damping.
    """
    machine = screen.replace(stop_law=law, stop_damping=2e4)
    orbit = upper_orbit(ff.frequency_response(machine, (60.0, 120.0)), 120.0)
    history = ff.simulate(machine, omega=120.0, periods=200)
    close("settled state", np.append(history.x[-1], history.v[-1]), orbit.state, abs=1e-9)
    e = history.energy
    close("energy, J", e["input"], e["dissipated"] + e["stored"], rel=1e-9)
    basins = ff.basins(
        machine, omega=120.0,
        displacement={"relative": [-3e-3, 3e-3]}, velocity={"relative": [-1.0, 1.0]},
    )  # fmt: skip
    assert [round(o.amplitude("relative") / orbit.amplitude("relative"), 8)
            for o in basins.orbits] == [1.0]  # fmt: skip
    run = ff.start_up(machine, ff.SpeedProfile((0.0, 5.0, 8.0), (0.0, 120.0, 120.0)))
    e, lost = run.history.energy, run.history.works["dissipated"]
    close("energy of the run, J", e["input"], e["dissipated"] + e["stored"], rel=1e-6)
    assert np.diff(lost).min() >= -1e-12 * lost[-1]
    last = run.history.displacement("relative")[run.history.t > 7.9]
    close("after start-up", np.ptp(last) / 2.0, orbit.amplitude("relative"), rel=1e-3)


@pytest.mark.parametrize("law", NEW)
def test_series_refuse_the_laws(screen, law) -> None:
    """A series holds no parts of k p + c p'; the smooth law is the paper's."""
    machine = screen.replace(stop_law=law)
    with pytest.raises(ff.errors.InputError, match="it has no series: give PiecewiseExact"):
        ff.frequency_response(machine, (60.0, 120.0), ff.HarmonicBalance(5))
    with pytest.raises(ff.errors.InputError, match="only the paper's law"):
        ff.frequency_response(machine, (60.0, 120.0), ff.SampledHarmonicBalance(5))
