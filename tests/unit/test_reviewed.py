"""Cases in which a reader once found a wrong answer."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

import flipflow as ff
from flipflow.batch.variants import batches
from flipflow.errors import Cancelled, IncompleteError, InputError
from flipflow.io.derived import derive
from flipflow.io.source import bundled_text
from flipflow.io.study_file import read_study_file
from flipflow.io.vary import read_vary
from flipflow.report.registry import blocks_of
from flipflow.studies.assessment import assess_case, energy_balance, input_hash, verdict
from flipflow.studies.drive_check import power_that_passes
from flipflow.studies.loading import amplitudes_from_below
from flipflow.studies.quantity_values import Working
from judge import close

pytestmark = pytest.mark.numerical


def test_bonded_stop_carries_its_force(screen):
    """With no gap the stop is a spring that always acts: H = k3 x2 + c3 x2'."""
    orbit = ff.periodic_orbits(screen.replace(clearance=0.0), omega=120.0)[0]
    size = abs(screen.stop_stiffness + 120j * screen.stop_damping)
    assert orbit.stop_force_peak() == pytest.approx(size * orbit.amplitude("relative"), rel=1e-6)
    assert orbit.touches


def test_stop_force_repeats_with_the_period(screen):
    orbit = ff.periodic_orbits(screen, omega=120.0)[0]
    t = np.linspace(0.0, orbit.period, 50)
    np.testing.assert_allclose(
        orbit.stop_force(0, t + orbit.period), orbit.stop_force(0, t), rtol=1e-6, atol=1e-3
    )


def test_springs_are_counted_as_given():
    """A spring without gap before one with a gap keeps its number."""
    springs = [ff.ClearanceSpring([1.0], 0.5, 0.0, 0.0), ff.ClearanceSpring([1.0], 3.0, 0.0, 0.5)]
    system = ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], springs, ff.HarmonicForce([1.0]))
    orbit = ff.frequency_response(system, (0.1, 1.0)).orbits_at(0.5)[0]
    x = orbit.displacement(0)
    np.testing.assert_allclose(orbit.stop_force(0), 0.5 * x, atol=1e-12)
    beyond = np.where(np.abs(x) > 0.5, x - np.sign(x) * 0.5, 0.0)
    np.testing.assert_allclose(orbit.stop_force(1), 3.0 * beyond, atol=1e-9)
    touched = np.abs(x) > 0.5
    assert {touch.spring for touch in orbit.contact_intervals} == {1}
    assert orbit.contact_share(0) == 1.0
    assert orbit.contact_share(1) == pytest.approx(touched[:-1].mean(), abs=0.01)
    square = orbit.velocity(0) ** 2
    assert orbit.mean_square_velocity(0, 0) == pytest.approx(square[:-1].mean(), rel=1e-6)
    part = np.where(touched, square, 0.0)[:-1].mean()
    assert orbit.mean_square_velocity(0, 1) == pytest.approx(part, rel=0.02)
    for asked in (
        orbit.stop_force,
        orbit.contact_share,
        lambda k: orbit.mean_square_velocity(0, k),
    ):
        with pytest.raises(InputError, match="2 springs"):
            asked(2)


def test_a_file_holds_the_force_of_every_spring(tmp_path):
    """A spring without gap stands in the file of a motion, too."""
    springs = [ff.ClearanceSpring([1.0], 0.5, 0.0, 0.0), ff.ClearanceSpring([1.0], 3.0, 0.0, 0.5)]
    system = ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], springs, ff.HarmonicForce([1.0]))
    orbit = ff.frequency_response(system, (0.1, 1.0)).orbits_at(0.5)[0]
    ff.save(orbit, tmp_path / "orbit.json")
    document = json.loads((tmp_path / "orbit.json").read_text())
    assert len(document["stop_force"]) == 2
    np.testing.assert_allclose(document["stop_force"][1], orbit.stop_force(1))
    assert {touch["spring"] for touch in document["contacts"]} == {1}
    assert ff.figure(orbit).panels


def test_branch_that_starts_between_the_folds_comes_from_below(screen):
    """e = 8 mm at 180 rad/s: the linear motion fits the gap, but is not the one reached."""
    wide = screen.replace(clearance=8e-3)
    part = ff.frequency_response(wide, (180.0, 250.0))
    whole = ff.frequency_response(wide, (5.0, 250.0))
    reached = whole.orbit_from_below(180.0)
    assert part.amplitude("relative")[0] == pytest.approx(reached.amplitude("relative"), rel=1e-9)


def test_upper_motion_is_followed_up_to_the_fold_itself(exact):
    fold = exact.folds[0].omega
    assert exact.orbit_from_below(fold - 1e-3).amplitude("relative") > 0.02
    assert exact.orbit_from_below(fold + 1e-3).amplitude("relative") < 0.01


def test_region_that_starts_in_contact_says_so(screen):
    region = ff.operating_region(screen, omega=(100.0, 180.0))
    assert region.lower == 100.0
    assert any("below the speeds analysed" in note for note in region.notes)


@pytest.mark.parametrize("minus", [6e-3, math.inf])
def test_region_ends_at_the_main_resonance_not_at_a_small_one(screen, minus):
    """Without gap on one side two folds stand at 50.5 and 50.7 rad/s, far below the main peak."""
    region = ff.operating_region(screen.replace(clearance=0.0, clearance_minus=minus))
    assert [fold.omega for fold in region.branch.folds] == pytest.approx([50.707295, 50.533177])
    assert (region.omega_lb, region.omega_ub) == (None, None)
    assert region.upper == region.branch.peak("relative").omega
    assert region.lower < region.upper


def test_stop_that_is_met_at_the_first_resonance_alone(screen):
    """Isolation almost undamped, shear springs heavily: the stop is not part of the region."""
    quiet = screen.replace(isolation_damping=100.0, shear_damping=25e3, clearance=8e-3)
    region = ff.operating_region(quiet)
    assert region.branch.points_of("contact begin")
    assert region.omega_cs is None
    assert (region.lower, region.upper) == (region.omega_ea, region.omega_ar)
    assert any("not reached at the main resonance" in note for note in region.notes)


def test_speed_without_a_stable_motion_is_not_called_out_of_range(screen):
    """Past a fold onto unstable motions only, the speed lies well within those analysed."""
    restless = screen.replace(
        main_mass=1273.7243, floating_mass=224.77805, isolation_damping=2926.2439,
        shear_damping=2719.1742, stop_stiffness=29106997.0, stop_damping=1085.9144,
        clearance=0.0, clearance_minus=8.930106862626047e-3,
    )  # fmt: skip
    region = ff.operating_region(restless)
    for omega, why in ((420.0, "meets no stable motion in empty"), (900.0, "do not hold it")):
        case = assess_case(restless, ff.Load(), region.branch, omega)
        assert why in verdict(omega, (), (case,), region)


@pytest.mark.parametrize("minus", [6e-3, 3e-3, math.inf])
def test_a_clipped_stop_takes_what_it_still_holds_when_it_lets_go(screen, minus):
    """Input = isolation + shear springs + stop, for the compression-only law, too."""
    clipped = screen.replace(stop_law="compression-only", stop_damping=2e4, clearance_minus=minus)
    orbit = ff.periodic_orbits(clipped, 140.568)[0]
    powers = energy_balance(Working(clipped, orbit))
    taken = powers["isolation"] + powers["shear"] + powers["stop"]
    assert taken == pytest.approx(powers["input"], rel=1e-9)


def test_five_stops_prepare_configurations_as_they_are_met():
    """3^5 configurations are not prepared at once; the branch still completes."""
    n = 5
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    stops = [ff.ClearanceSpring(np.eye(n)[i], 3.0, 0.05, 0.4 + 0.1 * i) for i in range(n)]
    system = ff.MechanicalSystem(
        np.eye(n), 0.4 * K, K, stops, ff.HarmonicForce([1.0] + [0.0] * (n - 1))
    )
    branch = ff.frequency_response(system, (0.2, 1.2), ff.PiecewiseExact(60))
    assert branch.complete
    assert {touch.spring for touch in branch.orbit(40).contact_intervals} >= {0, 1}


def test_frequency_outside_the_branch_is_refused(screen):
    branch = ff.frequency_response(screen, (100.0, 120.0))
    with pytest.raises(InputError, match="the branch runs from 100 to 120"):
        branch.orbits_at(130.0)


def test_what_is_no_machine_is_refused_with_a_sentence(screen):
    with pytest.raises(InputError, match=r"of a project, its \.screen"):
        ff.frequency_response(ff.load_project("ffs0827"), (5.0, 250.0))
    with pytest.raises(InputError, match="PiecewiseExact"):
        ff.frequency_response(screen, (5.0, 250.0), "HB")


def test_high_orders_of_unequal_gaps_fit_the_memory(screen):
    lean = screen.replace(clearance=6e-3, clearance_minus=math.inf)
    branch = ff.frequency_response(lean, (100.0, 101.0), ff.HarmonicBalance(120, points=3))
    assert branch.complete


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda s: ff.loading(s, ff.Load(), omega=(5.0, 20.0)), "omega = .*operating region is"),
        (lambda s: ff.loading(s, ff.Load(), omega=(205.0, 230.0)), "omega = .*operating region is"),
        (lambda s: ff.loading(s, 1.1), "load = .*ff.Load"),
        (lambda s: ff.response_family(s, {"clearance": ["a"]}), "clearance.*numbers"),
        (lambda s: ff.response_family(s, [1.0]), "vary = .*one field"),
    ],
)
def test_loading_and_family_refuse_with_a_sentence(screen, call, words):
    """Speeds beside the operating region once ended in an error of numpy."""
    with pytest.raises(InputError, match=words):
        call(screen)


def test_small_folds_at_first_contact_are_not_those_of_the_main_resonance(screen):
    """e = 1 mm: two folds 0.07 rad/s apart where contact begins; the region goes on to the peak."""
    small = screen.replace(clearance=1e-3)
    region = ff.operating_region(small)
    assert len(region.branch.folds) == 2
    assert region.omega_lb is None
    assert region.omega_ub is None
    assert region.lower == region.omega_cs
    assert region.upper == region.branch.peak("relative").omega
    found = ff.loading(small, ff.Load(stiffness_factor=1.1)).with_stop
    left_out = np.isnan(found.region.change)
    # Between its two losses of symmetry the machine leans.
    leans = [p.omega for p in found.unloaded.special_points if p.kind == "symmetry breaking"]
    assert not left_out[found.region.omega > 1.05 * max(leans)].any()
    assert any("the motion followed is unstable" in one for one in found.notes) == left_out.any()


def test_a_machine_without_an_operating_region_says_so(screen):
    """So much damping that both frames swing alike only above the antiresonance."""
    bare = screen.replace(clearance=math.inf, shear_damping=35e3)
    with pytest.raises(IncompleteError, match="no operating region"):
        ff.loading(bare, ff.Load(stiffness_factor=1.1))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda s: ff.simulate(s, [100.0, 120.0]), "omega = .*finite frequency"),
        (lambda s: ff.poincare_section(s, [100.0, 120.0]), "omega = .*finite frequency"),
        (lambda s: ff.poincare_section(s, 100.0, skip=-1), "skip = -1: .*from 0"),
        (lambda s: ff.poincare_section(s, 100.0, skip="a"), "skip = 'a': .*from 0"),
        (lambda s: ff.sweep(s, [100.0], initial=["x"] * 4), "initial = .*4 finite numbers"),
        (lambda s: ff.periodic_orbits(s, 100.0, rng="a"), "rng = 'a'"),
        (lambda s: ff.jump_risk(s, 100.0, rng=-1), "rng = -1"),
        (lambda s: ff.basins(s, 100.0, {"relative": [0.0]}, most_turns="a"), "most_turns = 'a'"),
        (lambda s: ff.ramp(s, 100.0, 1.0), "omega = 100.0: .*two different"),
        (lambda s: ff.ramp(s, (100.0, 100.0), 1.0), "omega = .*two different"),
        (lambda s: ff.ramp(s, (100.0, 110.0), "fast"), "rate = 'fast'"),
        (lambda s: ff.linear_response(s, "fast"), "omega = 'fast'"),
        (lambda s: ff.operating_region(s, limits=3), "limits = 3"),
        (lambda s: ff.operating_region(s, load_cases=ff.Load()), "load_cases = .*a list"),
        (ff.assess, "project = 'FlipFlowScreen'"),
    ],
)
def test_bad_arguments_are_refused_with_what_was_given(screen, call, words):
    """The first of several speeds was once taken for all of them."""
    with pytest.raises(InputError, match=words):
        call(screen)


def test_a_stop_without_gap_counts_where_both_frames_swing_alike(screen):
    """The closed forms of w_ea, w_ar, w01 and w02 hold a bonded stop wherever they stand."""
    bonded = screen.replace(clearance=0.0, isolation_damping=1.0, shear_damping=1.0, stop_damping=0)
    response = ff.linear_response(bonded, 100.0)
    at_ea = ff.linear_response(bonded, response.omega_ea)
    assert at_ea.amplitude("main") == pytest.approx(at_ea.amplitude("relative"), rel=1e-6)
    at_ar = ff.linear_response(bonded, response.omega_ar)
    assert at_ar.amplitude("main") < 1e-3 * at_ar.amplitude("relative")
    region = ff.operating_region(bonded)
    derived = derive(bonded)
    assert (region.omega_ea, region.omega_ar) == (response.omega_ea, response.omega_ar)
    assert (derived.omega_ea, derived.omega_ar) == (response.omega_ea, response.omega_ar)
    np.testing.assert_allclose(derived.natural_frequencies, response.natural_frequencies)


def test_the_digest_of_the_input_holds_the_drive():
    """The drive decides how the machine starts, which the assessment tells."""
    project = ff.load_project("ffs0827")
    driven = replace(project, drive=ff.Drive(inertia=1.0))
    stiffer = replace(project, drive=ff.Drive(inertia=2.0))
    assert len({input_hash(one) for one in (project, driven, stiffer)}) == 3


@pytest.mark.parametrize("times", [3e3, 1e4, 3e4])
def test_means_hold_behind_a_stop_whose_motion_decays_at_once(screen, times):
    """A decay of a thousandth of the turn lies between the nodes of an even rule."""
    machine = screen.replace(stop_damping=times * screen.stop_damping)
    orbit = ff.frequency_response(machine, (40.0, 200.0)).orbits_at(150.0)[0]
    assert orbit.touches
    dampers = machine.isolation_damping * orbit.mean_square_velocity("main")
    dampers += machine.shear_damping * orbit.mean_square_velocity("relative")
    close("what comes in", orbit.input_power(), dampers + orbit.stop_power(), rel=1e-11)


def raising_once(at):
    """A monitor that raises Cancelled once, at a call, and says no more."""
    calls = []

    def monitor(_sentence, _share):
        calls.append(None)
        if len(calls) == at:
            raise Cancelled("stopped")

    return monitor


@pytest.mark.parametrize("at", [5, 40, 300])
def test_a_cancelled_jump_risk_is_no_answer(screen, at):
    with pytest.raises(Cancelled):
        ff.jump_risk(screen, 203.0, monitor=raising_once(at))


def test_a_diagram_that_is_cancelled_at_its_turn_is_not_complete(screen):
    found = ff.bifurcation_diagram(screen, "omega", [90.0, 100.0], monitor=raising_once(2))
    assert found.up.values.size == 2
    assert found.down.values.size == 0
    assert not found.complete


def test_a_search_over_independent_parts_tells_how_far_it_is_and_can_be_cancelled():
    springs = [ff.ClearanceSpring(d, 5.0, 0.1, 1.0) for d in ([1.0, 0.0], [0.0, 1.0])]
    machine = ff.MechanicalSystem(
        np.eye(2), 0.2 * np.eye(2), np.eye(2), springs, ff.HarmonicForce([0.5, 0.5])
    )
    told = []
    ff.periodic_orbits(machine, omega=0.8, monitor=lambda _, share: told.append(share))
    assert told == sorted(told)
    assert told[-1] == 1.0
    with pytest.raises(Cancelled):
        ff.periodic_orbits(machine, omega=0.8, monitor=raising_once(2))


def test_a_solver_that_was_interrupted_is_not_used_again(exact):
    formulation = exact.orbit(0).point.formulation
    with pytest.raises(KeyboardInterrupt), formulation.lent() as interrupted:
        raise KeyboardInterrupt
    with formulation.lent() as other:
        assert other is not interrupted
    with formulation.lent() as again:
        assert again is other


def test_a_list_in_which_one_field_never_changes_is_opened_again(screen, tmp_path):
    vary = {"clearance": [6e-3] * 3, "shear_stiffness": [2.8e6, 2.6e6, 2.7e6]}
    asked = (screen, vary, "relative_amplitude", 120.0)
    found = ff.study(*asked, sampling="list", store=tmp_path / "store")
    again = ff.open_study(tmp_path / "store")
    np.testing.assert_array_equal(
        again.values["relative_amplitude"], found.values["relative_amplitude"]
    )
    assert again.distributions == found.distributions


def test_a_grid_with_a_value_given_twice_is_drawn(screen):
    vary = {"clearance": [6e-3, 6e-3, 7e-3], "shear_stiffness": [2.6e6, 2.7e6]}
    found = ff.study(screen, vary, "relative_amplitude", 120.0)
    assert found.grid_shape == (3, 2)
    figure = ff.figure(found)
    once = ff.study(screen, {**vary, "clearance": [6e-3, 7e-3]}, "relative_amplitude", 120.0)
    for panel, same in zip(figure.panels, ff.figure(once).panels, strict=True):
        for trace, other in zip(panel.traces, same.traces, strict=True):
            np.testing.assert_array_equal(trace.x, other.x)
            np.testing.assert_array_equal(trace.y, other.y)


def test_carried_weight_hangs_on_the_normal_springs(screen):
    machine = screen.replace(normal_stiffness=1.2e6, normal_damping=2e4, deck_angle=0.26)
    step = ff.LoadStep(1.0, ff.Load(main_mass=300.0))
    history = ff.simulate(machine, 120.0, 100, disturbances=[step])
    turn = np.flatnonzero(history.t >= history.t[-1] - 2.0 * math.pi / 120.0 * (1.0 + 1e-9))[1:]
    sunk = -300.0 * 9.80665 * math.cos(0.26) / 1.2e6
    close("normal", history.normal_displacement[turn].mean(), sunk, rel=1e-6)


@pytest.mark.parametrize(("dip", "passes"), [(0.06, True), (0.045, False), (0.03, False)])
def test_no_motor_passes_where_its_torque_dips_below_its_own_friction(screen, dip, passes):
    """Friction assumed as a share of the rated torque grows with the motor."""
    rows = ((0.0, 1.5), (20.0, 1.5), (24.0, dip), (28.0, 1.5), (140.0, 2.2), (157.08, 0.0))
    motor = ff.Motor(rated_power=15e3, synchronous_speed=157.08, torque_table=rows)
    drive = ff.Drive(
        inertia=1.0, motor=motor, ratio=1.0, friction=0.05 * motor.rated_torque,
        assumed_fields=("friction",),
    )  # fmt: skip
    assert (power_that_passes(drive, screen, 24.0) is not None) == passes


@pytest.mark.parametrize("length", [1.0, 1e-8])
def test_the_largest_motion_comes_first_in_any_unit_of_length(screen, length):
    """FFS0827 at 203 rad/s, its lengths in another unit."""
    system = screen.system()
    (spring,) = system.springs
    gaps = {n: length * getattr(spring, n) for n in ("clearance", "clearance_minus")}
    spring = replace(spring, **gaps)
    unbalance = ff.Unbalance([length * screen.eccentric_moment, 0.0])
    machine = ff.MechanicalSystem(system.M, system.C, system.K, [spring], unbalance)
    gap = np.array([[1.0, -1.0]])
    ways = [
        np.ptp(orbit.motion.extremes(gap)[:2]) / length
        for orbit in ff.periodic_orbits(machine, omega=203.0)
    ]
    assert len(ways) == 3
    assert ways == sorted(ways, reverse=True)


def test_a_branch_without_a_first_harmonic_is_drawn_without_a_phase():
    stop = ff.ClearanceSpring([1.0], 3.0, 0.1, 1.0)
    force = ff.HarmonicForce([0.5], order=2)
    machine = ff.MechanicalSystem([[1.0]], [[0.06]], [[1.0]], (stop,), force)
    branch = ff.frequency_response(machine, (0.3, 2.0))
    (panel,) = ff.figure(branch).panels
    drawn = [np.nanmax(trace.y) for trace in panel.traces if np.isfinite(trace.y).any()]
    close("highest", max(drawn), branch.peak(0).amplitude(0), rel=1e-3)


def test_what_moves_in_another_way_has_no_amplitude_from_below():
    """Up to 1.9 rad/s the motion of one turn is unstable at many speeds."""
    stop = ff.ClearanceSpring([1.0], 20.0, 0.05, 0.5)
    machine = ff.MechanicalSystem([[1.0]], [[0.05]], [[1.0]], (stop,), ff.HarmonicForce([5.0]))
    branch = ff.frequency_response(machine, (0.3, 6.0))
    speeds = np.linspace(0.3, 6.0, 400)
    orbits = [branch.orbit_from_below(float(w)) for w in speeds]
    unstable = np.array([orbit is not None and not orbit.stable for orbit in orbits])
    assert unstable.any()
    assert not unstable.all()
    amplitudes = amplitudes_from_below(branch, speeds, 0)
    np.testing.assert_array_equal(np.isnan(amplitudes), unstable)


def test_the_jump_of_a_glide_is_that_of_the_leading_coordinate():
    """The second mass is tied to the ground: what jumps is the first, and the jump is told."""
    stop = ff.ClearanceSpring([1.0, 0.0], 30.0, 0.1, 1.0)
    machine = ff.MechanicalSystem(
        np.eye(2), 0.06 * np.eye(2), np.diag([1.0, 400.0]), (stop,), ff.HarmonicForce([0.5, 0.0])
    )
    found = ff.ramp(machine, (0.5, 6.0), 0.01)
    assert len(found.jumps) == 1


def test_the_name_that_a_value_has_in_python_leads_to_its_key(tmp_path):
    text = bundled_text("ffs0827").replace("shear_stiffness_factor", "stiffness_factor")
    (tmp_path / "mill.toml").write_text(text)
    with pytest.raises(InputError, match="did you mean 'shear_stiffness_factor'"):
        ff.load_project(tmp_path / "mill.toml")


@pytest.mark.parametrize("order", [1, 3])
def test_gravity_on_an_unbalance_of_another_order_is_geared(order):
    machine = ff.MechanicalSystem(
        [[100.0]], [[500.0]], [[4e5]], (), ff.Unbalance([0.2], order=order)
    )
    motor = ff.Motor(rated_power=4e3, synchronous_speed=157.08)
    run = ff.start_up(machine, ff.Drive(inertia=1.0, motor=motor, ratio=1.0))
    (note,) = (one for one in run.notes if "gravity on the unbalance" in one)
    assert f"{order * 0.2 * 9.80665:.3g} N m" in note


def test_a_glide_has_no_spectrum(screen):
    history = ff.ramp(screen, (100.0, 140.0), 50.0).history
    with pytest.raises(InputError, match="constant speed"):
        ff.spectrum(history, "relative")


def test_a_tolerance_in_degrees_may_have_their_sign(screen):
    tilted = screen.replace(deck_angle=0.26)
    close(
        "°",
        read_vary(("deck_angle=+-1 °",), tilted)["deck_angle"],
        read_vary(("deck_angle=+-1 deg",), tilted)["deck_angle"],
        rel=1e-15,
    )


def plain_machine(gap=0.4, law="paper"):
    spring = ff.ClearanceSpring([1.0], 20.0, 0.1, gap, law=law)
    return ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], (spring,), ff.HarmonicForce([0.5]))


@pytest.mark.parametrize(
    "vary",
    [{"forcing": [0.8, 1.0, 1.2]}, {"forcing": (0.8, 1.2), "springs[0].clearance": (0.3, 0.5)}],
)
def test_a_study_of_a_machine_in_its_own_units_tells_none(vary):
    """Its numbers stood in figures and tables a thousand times as large, as mm."""
    sampling = {"sampling": ff.Sample(n=8)} if isinstance(vary["forcing"], tuple) else {}
    found = ff.study(plain_machine(), vary, ["amplitude[0]", "stop_force"], 1.2, **sampling)
    notes = [n.text for panel in ff.figure(found).panels for n in panel.notes]
    most = found.values["amplitude[0]"].max()
    assert notes == [] or any(math.isclose(float(text), most, rel_tol=1e-3) for text in notes)
    for told in (repr(ff.figure(found)), *map(repr, blocks_of(found))):
        for unit in (" mm", " kN", " rpm", ", mm", ", kN"):
            assert unit not in told


def test_the_ends_of_a_worst_case_stand_in_the_units_of_its_axis(screen):
    found = ff.worst_case(screen, {"clearance": (4e-3, 6e-3)}, "relative_amplitude", 90.0)
    for units, scale in (("engineering", 1e3), ("SI", 1.0)):
        (bar,) = ff.figure(found, units=units).panels[0].bars
        low, high = map(float, bar.words.split(" to "))
        ends = scale * np.array([found.least[0], found.greatest[0]])
        close(f"ends, {units}", [low, high], ends, rel=1e-3)


def test_true_is_no_format_of_a_study_file(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text('format = true\nmachine = "ffs0827"\n')
    with pytest.raises(InputError, match="format"):
        read_study_file(path)


@dataclass(frozen=True)
class Plain:
    """A machine of which words vary, so that each variant is assembled by itself."""

    gap: float = 0.4
    law: str = "paper"

    def system(self):
        """A mass on a spring and a stop."""
        return plain_machine(self.gap, self.law)


def test_what_a_row_of_a_study_is_told_hangs_on_no_other_row():
    """Rows assembled by themselves took the gap of the first one as the machine's length."""
    columns = {"gap": np.array([0.2, 0.3]), "law": np.array(["elasto-gap"] * 2, object)}
    (together,), _ = batches(Plain(), columns)
    (alone,), _ = batches(Plain(), {name: column[1:] for name, column in columns.items()})
    assert together.length == alone.length == Plain().gap


def test_a_spring_without_stiffness_and_gap_never_has_a_force():
    dead = ff.ClearanceSpring([1.0], 0.0, 0.0, 0.0)
    live = plain_machine()
    machine = replace(live, springs=(dead, *live.springs))
    orbit = ff.periodic_orbits(machine, 1.2)[0]
    assert orbit.contact_share(0) == 0.0 < orbit.contact_share(1)
    assert orbit.stop_force_peak(0) == 0.0
    assert ff.lyapunov_exponents(machine, 1.2, periods=100).contact_share[0] == 0.0


def test_variants_have_the_damping_that_the_machine_itself_lacks():
    """The length of what is short was read off arrays, which need damping."""
    bare = replace(plain_machine(), C=np.zeros((1, 1)))
    (batch,), allowed = batches(Damped(bare), {"damping": np.array([0.1, 0.2])})
    assert allowed.all()
    assert batch.length == 0.4


@dataclass(frozen=True)
class Damped:
    """A machine whose damping varies, from none."""

    bare: ff.MechanicalSystem
    damping: float = 0.0

    def system(self):
        """The machine with its damping."""
        return replace(self.bare, C=np.full((1, 1), self.damping))
