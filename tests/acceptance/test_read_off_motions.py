"""What is read off exact motions says the same as the motions themselves, whoever reads it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import flipflow as ff
from flipflow.studies.lane_values import jump_distance
from judge import close

DOUBLING = 0.3934539  # where a motion of one period becomes one of two, rad/s


def summits(history: ff.History, which: str) -> np.ndarray:
    """Half the way from each summit to the next, of samples alone."""
    x = history.displacement(which)
    x = x[np.concatenate([[True], np.diff(x) != 0.0])]
    tops = np.flatnonzero(np.diff(np.sign(np.diff(x))) != 0) + 1
    return np.abs(np.diff(x[tops])) / 2.0


@pytest.mark.parametrize("law", ["paper", "compression-only", "undamped-rebound", "elasto-gap"])
def test_a_start_swings_as_far_as_its_history(law: str) -> None:
    """The summit in contact is an event of the law of undamped rebound, with velocity exactly 0."""
    screen = ff.load("ffs0827").replace(
        stop_law=law, clearance_minus=math.inf, clearance=1e-3, stop_damping=5e3
    )
    start = ff.start_up(screen, ff.SpeedProfile(times=(0, 1, 1.3), speeds=(0, 85.0, 85.0)))
    farthest = summits(start.history, "relative").max()
    close("peak", start.peaks["relative_amplitude"].value, farthest, rel=2e-3)


def test_a_glide_jumps_late_under_undamped_rebound_too() -> None:
    screen = ff.load("ffs0827").replace(stop_law="undamped-rebound")
    glide = ff.ramp(screen, (190.0, 240.0), rate=20.0)
    (jump,) = glide.jumps
    history = glide.history
    large = np.abs(history.displacement("relative")) > 0.02
    last = history.omega[large].max()
    assert jump.omega - jump.fold > 5.0
    assert abs(jump.omega - last) < 1.0


def test_a_power_asked_for_too_loses_no_machine() -> None:
    """The even motion is unstable here; those that lean are found whatever is asked."""
    omega = 1.6
    stops = [
        ff.ClearanceSpring([1.0], 10.0, 0.5, 0.3),
        ff.ClearanceSpring([2.0], 5.0, 0.5, 0.6, law="elasto-gap"),
    ]
    system = ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], stops, ff.HarmonicForce([2.0]))
    study = ff.study(
        system, {"forcing": (0.9, 1.1)}, ("stop_force", "dissipated_power"), omega=omega,
        sampling=ff.Sample(n=8),
    )  # fmt: skip
    assert study.reasons == {}
    power = ff.sensitivity(system, {"forcing": (0.999, 1.001)}, "dissipated_power", omega, n=8)
    assert power.failed == 0.0
    stable = [orbit for orbit in ff.periodic_orbits(system, omega) if orbit.stable]
    known = {round(orbit.input_power(), 9) for orbit in stable}
    alone = ff.study(system, {"forcing": np.array([1.0, 1.0])}, "dissipated_power", omega=omega)
    assert round(float(alone.values["dissipated_power"].ravel()[0]), 9) in known


def test_a_motion_is_found_whatever_other_speeds_are_asked() -> None:
    """From rest this machine settles into a motion of several turns, beside one of a single."""
    spring = ff.ClearanceSpring
    machine = ff.MechanicalSystem(
        [[1.476, 0.141], [0.141, 1.033]],
        [[0.319, -0.007], [-0.007, 0.468]],
        [[1.879, -0.058], [-0.058, 3.225]],
        [
            spring([-1, 0], 17.53, 0, 0.696, law="elasto-gap"),
            spring([-0.303, 0.953], 1.83, 0.979, 0.281, 0.399, "undamped-rebound"),
            spring([-0.941, -0.339], 3.87, 0, 0.683, 0.244, "undamped-rebound"),
        ],
        (
            ff.HarmonicForce([-0.187 + 1.208j, 0.110 + 0.304j], 1),
            ff.MovingBase(0.662 - 0.071j, [0.336, 0.817], [0.064, 0.027], 2),
            ff.HarmonicForce([-1.003 - 1.031j, 0.142 + 0.180j], 3),
        ),
        static_force=[-0.317, 1.124],
    )
    w = 0.8519
    alone = ff.study(machine, {"forcing": np.array([1.0, 1.0])}, "amplitude[0]", omega=[w])
    both = ff.study(machine, {"forcing": np.array([1.0, 1.0])}, "amplitude[0]", omega=[0.5 * w, w])
    twice = ff.study(machine, {"forcing": np.array([1.0, 1.0])}, "amplitude[0]", omega=[w, w])
    told = [study.values["amplitude[0]"][0, 0, -1] for study in (alone, both, twice)]
    stable = [o for o in ff.periodic_orbits(machine, w) if o.stable and o.periods == 1]
    close("amplitude", told, [stable[0].amplitude(0)] * 3, rel=1e-9)


@pytest.mark.parametrize("width", [2e-3, 1e-2])
@pytest.mark.parametrize("count", [4, 8, 24])
def test_a_smooth_change_of_period_is_no_jump(width: float, count: int) -> None:
    """Neither on the way in nor on the way out, where the branch of two periods turns back."""
    stop = ff.ClearanceSpring([1.0], 40.0, 0.06, 0.23, math.inf)
    system = ff.MechanicalSystem([[1.0]], [[0.2357]], [[1.0]], [stop], ff.HarmonicForce([0.5]))
    speeds = np.linspace(DOUBLING - width, DOUBLING + width, count)
    up = ff.sweep(system, speeds)
    down = ff.sweep(system, speeds[::-1], initial=up.rows[-1].state)
    assert set(up.periods) == set(down.periods) == {1, 2}
    assert up.jumps == down.jumps == ()
    diagram = ff.bifurcation_diagram(system, "omega", speeds)
    assert diagram.up.jumps == diagram.down.jumps == ()


def test_a_smooth_change_of_period_is_no_jump_of_a_design() -> None:
    """The nearest jump is a fold, as the margin to the jump has it."""
    stop = ff.ClearanceSpring([1.0], 31.0, 0.47, 0.12, math.inf)
    system = ff.MechanicalSystem([[1.0]], [[0.2742]], [[1.0]], [stop], ff.HarmonicForce([0.5]))
    branch = ff.frequency_response(system, (0.3, 6.0))
    doubling = max(one.omega for one in branch.points_of("period doubling"))
    assert min(abs(doubling / fold.omega - 1.0) for fold in branch.folds) > 0.2
    for share in (-0.01, 0.01):
        omega = doubling * (1.0 + share)
        far = jump_distance(system, {"forcing": np.ones(1)}, omega, 0.05, (0.3, 6.0))
        close("distance", far, [0.05])


def test_a_simulation_tells_the_greatest_force_between_its_times() -> None:
    """Under the paper's law the force begins with a jump, which times of a grid pass by."""
    screen = ff.load("ffs0827").replace(stop_damping=1e5)
    history = ff.simulate(screen, 120.0, 200)
    last = history.t > history.t[-1] - 2.0 * math.pi / 120.0
    (orbit,) = (one for one in ff.periodic_orbits(screen, 120.0) if one.stable)
    close("peak", history.peak[last].max(), orbit.stop_force_peak(), rel=1e-8)
    assert np.all(history.peak >= np.abs(history.force))


def test_each_peak_is_that_since_the_time_before() -> None:
    """One contact lasts through many times, or begins before the first of them."""
    stop = ff.ClearanceSpring([1.0], 10.0, 0.5, 0.3, math.inf)
    push = ff.HarmonicForce([0.5], order=3)
    system = ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], [stop], push, static_force=[5.0])
    turn = 2.0 * math.pi
    t = np.linspace(30.0 * turn, 32.0 * turn, 7)
    coarse = ff.simulate(system, 1.0, 32, t=t)
    fine = np.linspace(t[0], t[-1], 6 * 400 + 1)
    force = np.abs(ff.simulate(system, 1.0, 32, t=fine).force[:, 0])
    most = [force[k * 400 : (k + 1) * 400 + 1].max() for k in range(6)]
    close("peaks", coarse.peak[1:, 0], most, rel=1e-4)
    close("first", coarse.peak[0, 0], force[0], rel=1e-9)


def test_a_worst_case_beside_machines_without_a_value_says_what_may_be_missing() -> None:
    screen = ff.load("ffs0827").replace(
        main_mass=2018.91, floating_mass=713.58, eccentric_moment=4.78993,
        isolation_stiffness=287217.0, isolation_damping=4885.46, shear_stiffness=5832098.0,
        shear_damping=6706.78, stop_stiffness=20711297.0, stop_damping=2147.28,
        clearance=3.212745e-3, clearance_minus=2.548732e-3, stop_law="compression-only",
    )  # fmt: skip
    names = "clearance", "shear_stiffness", "floating_mass", "stop_stiffness"
    box = {name: (0.9 * getattr(screen, name), 1.1 * getattr(screen, name)) for name in names}
    worst = ff.worst_case(screen, box, "relative_amplitude", 70.967286)
    sample = ff.study(
        screen, box, "relative_amplitude", omega=70.967286, sampling=ff.Sample(n=1024)
    )
    assert np.isfinite(worst.error[0])
    assert worst.greatest[0] + worst.error[0] >= np.nanmax(sample.values["relative_amplitude"])


def test_turns_of_a_basin_are_those_until_a_state_is_caught() -> None:
    """The motion of three periods is found only when states have run all their turns."""
    screen, x = ff.load("ffs0827"), np.linspace(-0.02, 0.02, 9)
    found = ff.basins(screen, 446.0, {"relative": x}, {"relative": 446.0 * x})
    assert (found.labels >= 0).all()
    assert found.turns.max() < 200


@pytest.mark.parametrize("order", [2, 3])
def test_what_nothing_excites_once_a_turn_has_no_phase(order: int) -> None:
    stop = ff.ClearanceSpring([1.0], 5.0, 0.2, 0.3)
    system = ff.MechanicalSystem(
        [[1.0]], [[0.1]], [[1.0]], [stop], ff.HarmonicForce([0.5], order=order)
    )
    branch = ff.frequency_response(system, (0.2, 0.5))
    orbit = branch.orbits_at(0.35)[0]
    assert math.isnan(orbit.phase(0))
    assert np.isnan(branch.phase(0)).all()
    assert np.isnan(orbit.sensitivity(("phase", 0), ["forcing"])).all()
    study = ff.study(system, {"forcing": np.array([1.0, 1.0])}, "phase[0]", omega=0.35)
    assert np.isnan(study.values["phase[0]"]).all()


def test_a_coordinate_may_have_a_unit_of_its_own(screen):
    """With 0.1 um beside metres every motion was told to stand at a fold."""
    system = screen.system()
    unit = np.diag([1.0, 1e-7])
    (spring,), force = system.springs, system.excitation
    other = ff.MechanicalSystem(
        unit @ system.M @ unit, unit @ system.C @ unit, unit @ system.K @ unit,
        (replace(spring, direction=unit @ spring.direction),),
        ff.Unbalance(unit @ force.vector), {"relative": unit @ system.coordinates["relative"]},
    )  # fmt: skip
    names = ["springs[0].clearance", "springs[0].stiffness", "forcing", "omega"]
    branches = [ff.frequency_response(one, (100.0, 215.0)) for one in (system, other)]
    plain, mixed = (
        branch.orbits_at(120.0)[0].sensitivity("relative_amplitude", names) for branch in branches
    )
    for name, got, expected in zip(names, mixed, plain, strict=True):
        close(f"slope of {name}", got, expected, rel=1e-6)
    plain, mixed = (branch.folds[0].sensitivity(names[:3]) for branch in branches)
    for name, got, expected in zip(names, mixed, plain, strict=False):
        close(f"slope of a fold, {name}", got, expected, rel=1e-6)


@pytest.mark.parametrize("share", [1e-3, 1e-5, 1e-7, 0.0])
def test_from_below_it_is_the_stable_motion_up_to_the_fold_itself(share: float) -> None:
    """The motion on the other side of the fold is as near to the branch's points as this one."""
    branch = ff.frequency_response(ff.load("ffs0827"), (150.0, 250.0))
    fold = branch.folds[0]
    motion = branch.orbit_from_below(fold.omega * (1.0 - share))
    assert motion is not None
    assert motion.stability == ("stable" if share else fold.orbit.stability)
    # The amplitude rises above that of the fold by the root of the distance.
    above = motion.amplitude("relative") - fold.amplitude("relative")
    close("above the fold", above, 0.1205 * math.sqrt(share), rel=0.02)
    largest = max(one.amplitude("relative") for one in branch.orbits_at(motion.omega))
    close("of all", motion.amplitude("relative"), largest, rel=1e-9)


@pytest.mark.parametrize("share", [1e-6, 3e-7, 1e-7])
def test_motions_beside_a_fold_at_a_sharp_corner(share: float) -> None:
    """Contact ends there, and the unstable motion meets the fold at an angle."""
    screen = ff.FlipFlowScreen(
        main_mass=220.63729131589594, floating_mass=23.666034101000168,
        eccentric_moment=0.7402535932229624, isolation_stiffness=111174.94186199032,
        isolation_damping=2013.1879506771068, shear_stiffness=471945.33918355516,
        shear_damping=149.3413691881396, stop_stiffness=5056372.526790134,
        stop_damping=3842.9063807647776, clearance=0.005754351282226189,
        stop_law="undamped-rebound", normal_stiffness=125613.39803766452,
        normal_damping=2699.829412557526, deck_angle=0.18775816119542021,
        clearance_measured="drawn",
    )  # fmt: skip
    branch = ff.frequency_response(screen, (4.687830483745367, 587.4650336674362))
    lower = min(branch.folds, key=lambda fold: fold.omega)
    assert lower.position % 1.0 != 0.0
    found = branch.orbits_at(lower.omega * (1.0 + share))
    assert [one.stability for one in found] == ["stable", "unstable", "stable"]
    large, middle, small = (one.amplitude("relative") for one in found)
    assert small < lower.amplitude("relative") < middle
    close("large", large, 8.530016e-3, rel=1e-5)


@pytest.mark.parametrize("share", [0.1, 0.3, 0.5, 0.7, 0.9])
@pytest.mark.parametrize("gap", [5.302734375e-3, 5.3022e-3])
def test_from_below_where_both_folds_lie_within_a_step(gap: float, share: float) -> None:
    """The jump is then by a few thousandths of the amplitude."""
    branch = ff.frequency_response(ff.load("ffs0827").replace(clearance=gap), (150.0, 250.0))
    upper, lower = branch.folds
    assert upper.omega > lower.omega
    assert lower.position - upper.position < 1.0
    omega = lower.omega + share * (upper.omega - lower.omega)
    largest = max(one.amplitude("relative") for one in branch.orbits_at(omega))
    motion = branch.orbit_from_below(omega)
    assert motion is not None
    assert motion.amplitude("relative") > upper.amplitude("relative")
    close("from below", motion.amplitude("relative"), largest, rel=1e-9)


def test_a_branch_of_one_point_has_that_motion() -> None:
    branch = ff.frequency_response(ff.load("ffs0827"), (150.0, 250.0), ff.PiecewiseExact(points=2))
    one = replace(branch, traced=branch.traced.first(1), special_points=())
    assert len(one.orbits_at(float(one.omega[0]))) == 1


def test_a_load_whose_effect_changes_its_sign_where_the_loaded_machine_jumps() -> None:
    """At 207.3 rad/s, from 0.05 mm more to 11.6 mm less."""
    screen = ff.FlipFlowScreen(
        main_mass=4799.282216382459, floating_mass=2066.8533654571906,
        eccentric_moment=18.67527525735126, isolation_stiffness=2461863.9181131846,
        isolation_damping=43714.678362508166, shear_stiffness=33908528.963748366,
        shear_damping=18439.23823803065, stop_stiffness=518308350.66615033,
        stop_damping=487009.35461238853, clearance=0.008409863147571226,
        clearance_minus=0.02081781131337687, stop_law="elasto-gap",
        normal_stiffness=3385706.8216896914, normal_damping=32747.600687306836,
        deck_angle=0.32276572987950175, clearance_measured="drawn",
    )  # fmt: skip
    load = ff.Load(
        stiffness_factor=1.0130480837272404, damping_factor=1.0594368661872804,
        stop_stiffness_factor=1.0095896414159848, main_mass=1123.8378362624583,
        floating_mass=347.1767005358374,
    )  # fmt: skip
    stopped = ff.loading(screen, load).with_stop
    assert stopped is not None
    fold = next(one for one in stopped.loaded.folds if abs(one.omega - 207.278) < 1e-3)
    before, after = (
        stopped.loaded.orbit_from_below(fold.omega * (1.0 + side)).amplitude("relative")
        for side in (-1e-9, 1e-9)
    )
    of_empty = stopped.unloaded.orbit_from_below(fold.omega).amplitude("relative")
    close("before", before - of_empty, 0.05e-3, rel=0.1)
    close("after", after - of_empty, -11.56e-3, rel=0.01)
    assert abs(stopped.region.least.change) <= np.nanmin(np.abs(stopped.region.change))


@pytest.mark.parametrize("highest", [150.0, 200.0, 204.0, 206.4])
def test_a_region_that_the_speeds_analysed_may_cut_says_so(highest: float) -> None:
    """The machine jumps at 206.41 rad/s, and at 198.65 as the speed falls."""
    screen, load = ff.load("ffs0827"), ff.Load(main_mass=10.0)
    cut = ff.operating_region(screen, omega=(60.0, highest))
    assert any("still touched at the highest speed" in note for note in cut.notes)
    stopped = ff.loading(screen, load, omega=(60.0, highest)).with_stop
    assert stopped is not None
    assert "empty" in [note.partition(":")[0] for note in stopped.notes]


def test_a_region_that_is_not_cut_says_nothing() -> None:
    screen, load = ff.load("ffs0827"), ff.Load(main_mass=10.0)
    assert ff.loading(screen, load, omega=(60.0, 250.0)).with_stop.notes == ()
    with pytest.raises(ff.InputError, match="the operating region without stop is 66"):
        ff.loading(screen, load, omega=(95.0, 250.0))
