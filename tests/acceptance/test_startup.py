"""Start and coast-down: through the resonance or captured by it, and the books of the energy."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import replace

import numpy as np
import pytest

import flipflow as ff
from flipflow.cli.main import main
from flipflow.dynamics.normal import normal_motion
from flipflow.errors import Cancelled, InputError
from flipflow.model.drive import assumed_drive

pytestmark = pytest.mark.numerical
RPM = np.pi / 30.0
WORKING = 850.0 * RPM
W01 = 22.493898  # rad/s, K v = w^2 M v of the machine without contact


def drive_of(screen, power):
    return assumed_drive(screen.eccentric_moment, WORKING, power)


@pytest.fixture(scope="module")
def start(screen):
    """FFS0827 under a motor of 5.5 kW."""
    return ff.start_up(screen, drive_of(screen, 5500.0), speed=WORKING)


def test_a_plausible_motor_passes_the_resonance_and_reaches_speed(start):
    assert start.outcome == "reached"
    assert start.first_frequency == pytest.approx(W01, abs=1e-6)
    assert 0.0 < start.passing < start.time_to_speed < 2.0
    assert start.final_speed == pytest.approx(WORKING, rel=1e-3)
    assert start.final_speed < start.drive.synchronous_speed
    assert "reaches 850 rpm" in start.verdict


def test_peaks_on_the_way_exceed_those_of_running(start):
    """The main frame and the foundation peak near the resonance, far below working speed."""
    for name in ("main_amplitude", "foundation_force"):
        assert W01 < start.peaks[name].omega < 0.6 * WORKING
    last = start.history.t > start.duration - 0.5
    running = np.ptp(start.history.displacement("main")[last]) / 2.0
    assert start.peaks["main_amplitude"].value > 3.0 * running


def by_kloss(screen, power):
    """The drive, its motor by Kloss' formula from standstill on."""
    drive = drive_of(screen, power)
    motor = replace(drive.motor, starting_ratio=None, pull_up_ratio=None)
    return replace(drive, motor=motor)


def test_a_weaker_motor_is_captured(screen):
    weightless = screen.replace(deck_angle=None)
    run = ff.start_up(weightless, by_kloss(screen, 1500.0), speed=WORKING)
    assert run.outcome == "captured"
    name, omega = run.near
    assert name == "w01"
    assert omega == pytest.approx(W01, abs=1e-6)
    assert run.final_speed == pytest.approx(omega, rel=0.05)
    assert run.verdict.startswith("captured at 21")
    assert run.verdict.endswith("near the natural frequency w01 = 215 rpm")
    assert run.passing is None


@pytest.mark.parametrize("power", [5500.0, 1500.0])
def test_power_balance_of_steady_running(screen, power):
    """Motor power = friction + dampers in the mean; the motor's by its curve at the mean speed."""
    run = ff.start_up(screen, drive_of(screen, power), speed=WORKING)
    assert run.power["motor"] == pytest.approx(
        run.power["friction"] + run.power["dampers"], rel=1e-4
    )
    curve = float(run.drive.torque(run.final_speed)) * run.final_speed
    # The speed ripples within a turn, and the curve is bent: second order in the ripple.
    assert run.power["motor"] == pytest.approx(curve, rel=0.02)


def test_dampers_take_what_the_exact_orbit_says(screen, start):
    """The mean of the simulation against the periodic motion at constant speed, both directions."""
    omega = start.final_speed
    orbit = ff.periodic_orbits(screen, omega)[0]
    expected = orbit.input_power() + normal_motion(screen, omega).power
    # The shaft's speed ripples by half a per cent within a turn, which the orbit does not know.
    assert start.power["dampers"] == pytest.approx(expected, rel=2e-3)
    friction = float(start.drive.friction_torque(omega)) * omega
    assert start.power["friction"] == pytest.approx(friction, rel=1e-3)


def test_energy_over_the_whole_start(start):
    """Motor's work = friction and dampers + what masses, springs and shaft hold at the end."""
    energy = start.history.energy
    assert energy["input"] == pytest.approx(energy["dissipated"] + energy["stored"], rel=1e-6)
    shaft = 0.5 * start.drive.inertia * start.final_speed**2
    assert energy["stored"] == pytest.approx(shaft, rel=0.1)


def test_coast_down_passes_the_resonance(screen):
    run = ff.coast_down(screen, WORKING, drive_of(screen, 5500.0))
    assert run.outcome == "stopped"
    assert run.history.omega[0] == pytest.approx(WORKING)
    assert run.final_speed < 0.05 * WORKING
    assert run.passing > 0.0
    assert run.peaks["main_amplitude"].omega < 1.2 * W01
    energy = run.history.energy
    assert energy["input"] == 0.0
    assert -energy["stored"] == pytest.approx(energy["dissipated"], rel=1e-6)


def test_coast_down_begins_with_the_settled_motion(screen):
    run = ff.coast_down(screen, 120.0, drive_of(screen, 5500.0))
    orbit = ff.periodic_orbits(screen, 120.0)[0]
    for k in (0, 1):
        assert run.history.x[0, k] == pytest.approx(float(orbit.displacement(k, 0.0)), abs=1e-8)


def greatest_half_turn(history):
    """The greatest half way from peak to peak of the relative motion in one turn, row by row."""
    x, turned = history.displacement("relative"), np.maximum.accumulate(history.angle)
    first = np.searchsorted(turned, turned - 2.0 * math.pi)
    return max(np.ptp(x[begin : k + 1]) for k, begin in enumerate(first)) / 2.0


@pytest.mark.parametrize(
    "drawn", [(91020, 28), (91021, 226), (91021, 298), (91020, 226), (91021, 85)]
)
@pytest.mark.parametrize("way", ["start_up", "coast_down"])
def test_amplitude_on_the_way_is_from_peak_to_peak_of_a_turn(script, drawn, way):
    """With more than two turning points a turn it was the way between neighbours, .70 of it."""
    _, machine, speed = script("plausible_draw").draw(*drawn)
    found = getattr(ff, way)(machine, speed=speed)
    told = found.peaks["relative_amplitude"].value
    assert told == pytest.approx(greatest_half_turn(found.history), rel=1e-3)


def test_a_start_that_ends_on_a_motion_reaches_its_amplitude(script):
    """Limits on the start said pass where the motion that it ends on broke them."""
    _, machine, speed = script("plausible_draw").draw(91020, 28)
    start = ff.start_up(machine, speed=speed, duration=30.0)
    orbit = next(o for o in ff.periodic_orbits(machine, start.final_speed) if o.stable)
    told = start.peaks["relative_amplitude"].value
    assert told == pytest.approx(orbit.amplitude("relative"), rel=1e-3)
    glide = ff.ramp(machine, (50.0, 55.0), 0.2)
    below = glide.branch.orbit_from_below(52.0)
    reached = np.interp(52.0, *glide.amplitude("relative"))
    assert reached == pytest.approx(below.amplitude("relative"), rel=1e-3)


def test_a_steady_end_that_repeats_after_two_turns_is_read_over_both(screen):
    uneven = screen.replace(clearance=0.0, clearance_minus=6e-3)
    run = ff.start_up(uneven, drive_of(screen, 5500.0), speed=110.849, duration=10.0)
    (orbit,) = (o for o in ff.periodic_orbits(uneven, run.final_speed, 2) if o.stable)
    assert (run.outcome, orbit.periods) == ("reached", 2)
    assert run.peaks["relative_amplitude"].value > 0.998 * orbit.amplitude("relative")


def test_coast_down_counts_the_way_from_its_start():
    """The first half swing, the greatest, was none; the value by an own integration."""
    machine = ff.FlipFlowScreen(
        main_mass=353.58361918365875, floating_mass=50.20006900374477,
        eccentric_moment=1.6659727980465884, isolation_stiffness=137699.1979060428,
        isolation_damping=4087.516266708944, shear_stiffness=235367.9446878344,
        shear_damping=67.64688904604856, stop_stiffness=311179.2778111227,
        stop_damping=248.15009118323897, clearance=0.0022816167225466434,
        normal_stiffness=194248.4943917849, normal_damping=2821.752840414696,
    )  # fmt: skip
    drive = ff.Drive(inertia=0.12 * machine.eccentric_moment, friction=1.0)
    run = ff.coast_down(machine, 73.61798784912081, drive, duration=120.0)
    assert run.peaks["relative_amplitude"].value == pytest.approx(6.741e-3, abs=1e-6)


def test_gravity_is_left_out_and_said(screen):
    """m0r g = 40.9 N m; with J = 0.9 kg m^2 the shaft swings below 2 sqrt(40.9 / 0.9) = 13.5."""
    drive = replace(drive_of(screen, 5500.0), inertia=0.9)
    weighed, screen = screen, screen.replace(deck_angle=None)
    assert not any("Gravity" in note for note in ff.start_up(weighed, drive).notes)
    up = ff.start_up(screen, drive, speed=WORKING)
    down = ff.coast_down(screen, WORKING, drive)
    weak = ff.start_up(screen, drive_of(screen, 500.0), speed=WORKING)
    given = ff.start_up(screen, ff.SpeedProfile((0.0, 1.0), (0.0, 20.0)))
    said = [" ".join(run.notes) for run in (up, down, weak, given)]
    assert all("Weight not considered" in notes for notes in said[:3])
    assert all("gravity on the unbalance, up to 40.9 N m" in notes for notes in said[:3])
    assert "below about 129 rpm, the shaft would swing" in said[1]
    assert "may not lift the unbalance" in said[2]
    assert "Weight" not in said[3]


@pytest.fixture(scope="module")
def restless(screen):
    """No gap on one side, 8.93 mm on the other: at 420 rad/s every motion found is unstable."""
    return screen.replace(
        main_mass=1273.7243, floating_mass=224.77805, isolation_damping=2926.2439,
        shear_damping=2719.1742, stop_stiffness=29106997.0, stop_damping=1085.9144,
        clearance=0.0, clearance_minus=8.930106862626047e-3,
    )  # fmt: skip


def test_a_motion_that_never_settles_is_said(screen, restless):
    run = ff.coast_down(restless, 420.0, drive_of(screen, 50e3))
    assert any("had not settled after 2000 turns" in note for note in run.notes)
    assumed = ff.start_up(restless, speed=420.0, duration=1.0)
    assert any("had not settled after 2000 turns" in note for note in assumed.notes)


def test_a_motion_of_two_turns_has_settled(screen):
    """One side without gap, 6 mm on the other: period doubled between 104.5 and 120.8 rad/s."""
    doubled = screen.replace(clearance=0.0, clearance_minus=6e-3)
    run = ff.coast_down(doubled, 110.849, drive_of(screen, 5500.0))
    (orbit,) = (o for o in ff.periodic_orbits(doubled, 110.849, 2) if o.stable)
    assert orbit.periods == 2
    assert not any("settled" in note for note in run.notes)
    period = 2.0 * np.pi / 110.849
    phases = [orbit.displacement("relative", k * period) for k in (0, 1)]
    begin = run.history.displacement("relative")[0]
    assert min(abs(begin - phase) for phase in phases) < 1e-7


def test_slow_profile_follows_the_branch(screen):
    """Very slowly, the motion is at every speed that of constant speed; known at 100 rad/s."""
    run = ff.start_up(screen, ff.SpeedProfile((0.0, 10.0, 60.0), (90.0, 90.0, 100.0)))
    last = run.history.t > run.duration - 2.0 * np.pi / 100.0
    x = run.history.displacement("relative")[last]
    assert run.outcome == "followed"
    assert np.ptp(x) / 2.0 == pytest.approx(7.888703398e-3, rel=5e-3)
    assert run.history.torque is None
    assert run.final_speed == pytest.approx(100.0, rel=1e-12)


def test_a_drive_is_assumed_and_said(screen):
    run = ff.start_up(screen, speed=WORKING)
    assert run.outcome == "reached"
    assert any("four times what the dampers take" in note for note in run.notes)
    with pytest.raises(InputError, match="speed"):
        ff.start_up(screen)


def test_any_machine_starts(screen):
    """A plain system has no normal direction; the screen without its data says so."""
    drive = drive_of(screen, 5500.0)
    plain = ff.start_up(screen.system(), drive)
    bare = ff.start_up(screen.replace(normal_stiffness=None, deck_angle=None), drive)
    assert plain.outcome == bare.outcome == "reached"
    assert plain.history.normal is None
    assert plain.history.x == pytest.approx(bare.history.x)
    assert any("Normal direction not checked" in note for note in bare.notes)


def test_a_machine_that_nothing_holds(screen):
    """No spring to the ground: no natural frequency can hold it, and none is named."""
    system = ff.MechanicalSystem([[1000.0]], [[5e3]], [[0.0]], (), ff.Unbalance([4.0]))
    run = ff.start_up(system, drive_of(screen, 5500.0))
    assert run.outcome == "reached"
    assert run.first_frequency == 0.0
    assert run.passing is None


def test_cancelling(screen):
    def stop(_sentence, _share):
        raise Cancelled("stopped")

    with pytest.raises(Cancelled):
        ff.start_up(screen, drive_of(screen, 1500.0), monitor=stop)


def test_history_reads_like_an_orbit(start):
    history = start.history
    x2 = history.displacement("relative")
    assert np.array_equal(x2, history.displacement("main") - history.displacement("floating"))
    assert np.all(np.diff(history.t) >= 0.0)
    assert np.abs(history.stop_force()[np.abs(x2) < 5.9e-3]).max() == 0.0
    assert history.motor_power == pytest.approx(history.torque * history.omega)
    assert len(history.events) == history.counters["events"]
    assert history.normal_displacement.shape == history.t.shape


@pytest.mark.parametrize(
    ("friction", "duration", "outcome"), [(0.0, 0.05, "unfinished"), (40.0, 5.0, "not started")]
)
def test_a_shaft_that_had_no_time_is_not_one_that_is_stuck(screen, friction, duration, outcome):
    motor = ff.Motor(synchronous_speed=157.0, rated_power=5500.0)
    drive = ff.Drive(inertia=0.9, motor=motor, friction=friction)
    run = ff.start_up(screen, drive, duration=duration)
    assert (float(drive.torque(0.0)) < friction) == (outcome == "not started")
    assert run.outcome == outcome
    assert run.final_speed < 0.02 * run.speed


@pytest.mark.parametrize("drive", [3.0, "5.5 kW"])
def test_what_is_no_drive_is_refused(screen, drive):
    for call in (ff.start_up, lambda s, d: ff.coast_down(s, WORKING, d)):
        with pytest.raises(InputError, match="drive = "):
            call(screen, drive)


@pytest.mark.parametrize("change", [
    {"speed": -1.0}, {"speed": math.inf}, {"duration": 0.0}, {"duration": math.nan},
    {"duration": 1e9}, {"speed": "fast"}, {"duration": "long"}, {"method": 3},
])  # fmt: skip
def test_bad_arguments(screen, change):
    with pytest.raises(InputError, match=next(iter(change))):
        ff.start_up(screen, drive_of(screen, 5500.0), **{"speed": WORKING, **change})


def test_figure_and_file(start, tmp_path):
    assert len(ff.figure(start).panels) == 3
    ff.save(start, tmp_path / "start.json")
    document = json.loads((tmp_path / "start.json").read_text())
    assert document["schema"] == "flipflow/run-up/1"
    assert document["outcome"] == "reached"
    again = ff.open_result(tmp_path / "start.json")
    assert again.verdict == start.verdict
    np.testing.assert_array_equal(again.history.x, start.history.x)


def run(monkeypatch, capsys, *words):
    monkeypatch.setattr(sys, "argv", ["flipflow", "startup", *map(str, words)])
    try:
        main()
        code = 0
    except SystemExit as ended:
        code = ended.code or 0
    told = capsys.readouterr()
    assert "Traceback" not in told.err
    return code, told.out, told.err


def test_command_line(monkeypatch, capsys, tmp_path):
    code, out, _ = run(
        monkeypatch, capsys, "ffs0827", "-o", tmp_path / "out", "--json", tmp_path / "a.json"
    )
    assert code == 0
    lines = out.splitlines()
    assert lines[0].startswith("FFS0827: reaches 850 rpm in ")
    assert max(map(len, lines)) <= 80
    assert "Switched off, it comes down from" in out
    assert "passed in" in out
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["coast_down.html", "start.html"]
    document = json.loads((tmp_path / "a.json").read_text())
    assert document["schema"] == "flipflow/startup/1"
    assert set(document) == {"schema", "name", "start", "coast_down"}


def test_command_line_tells_a_stop_that_is_not_met(monkeypatch, capsys):
    code, out, _ = run(monkeypatch, capsys, "ffs0827", "--case", "full, stiffening")
    assert code == 0
    stops = [line.split() for line in out.splitlines() if "on the stops" in line]
    assert [line[-2:] == ["not", "reached"] for line in stops] == [True, True]


def test_command_line_motor_too_weak_is_an_answer(monkeypatch, capsys):
    code, out, _ = run(monkeypatch, capsys, "ffs0827", "--motor-power", "1 kW")
    assert code == 0
    assert "FFS0827: does not start" in out
    assert "Switched off" not in out


def test_command_line_profile(monkeypatch, capsys):
    code, out, _ = run(monkeypatch, capsys, "ffs0827", "--profile", "0 s: 0 rpm, 5 s: 850 rpm")
    assert code == 0
    assert "follows the given speed for 5 s" in out


@pytest.mark.parametrize(("words", "told"), [
    (("--profile", "5 s: 0 rpm, 0 s: 850 rpm"), ("--profile", "rise")),
    (("--profile", "0 s: 0 rpm, inf s: 850 rpm"), ("--profile",)),
    (("--profile", "0 s: 0 rpm, 1e999 s: 850 rpm"), ("--profile", "finite")),
    (("--profile", "0 s 0 rpm"), ("--profile", "points such as")),
    (("--motor-power", "1.5 kW", "--inertia", "-1 kg m^2"), ("--inertia", "above 0")),
    (("--inertia", "1 kg m^2"), ("--inertia", "--motor-power")),
    (("--motor-power", "1.5 kW", "--inertia", "0.01 kg m^2"), ("inertia", "(m0r)^2")),
    (("--motor-power", "0 kW"), ("--motor-power", "above 0")),
    (("--motor-power", "5.5 kN"), ("--motor-power", "a force")),
    (("--speed", "inf rpm"), ("--speed",)),
])  # fmt: skip
def test_bad_input_is_one_sentence(monkeypatch, capsys, words, told):
    code, out, err = run(monkeypatch, capsys, "ffs0827", *words)
    assert code == 2
    assert out == ""
    assert len(err.splitlines()) == 1
    assert all(word in err for word in told), err


def test_no_damping_is_refused(monkeypatch, capsys, tmp_path):
    path = machine_file(
        tmp_path, ('"9.866 kN s/m"', '"0 kN s/m"'), ('"2.605 kN s/m"', '"0 kN s/m"')
    )
    code, _, err = run(monkeypatch, capsys, path)
    assert code == 2
    assert "damping" in err


def test_interrupt_ends_with_130(monkeypatch, capsys):
    def interrupted(*_words, **_options):
        raise KeyboardInterrupt

    monkeypatch.setattr("flipflow.transient.startup.run_history", interrupted)
    code, _, err = run(monkeypatch, capsys, "ffs0827", "--motor-power", "1.5 kW")
    assert (code, err) == (130, "Stopped by the user; nothing is written.\n")


def test_drive_section(monkeypatch, capsys, tmp_path):
    section = '[drive]\nrated_power = "1 kW"\ninertia = "0.9 kg m^2"\n\n[limits]'
    path = machine_file(tmp_path, ("[limits]", section))
    project = ff.load_project(path)
    assert project.drive.inertia == 0.9
    assert project.drive.motor.power == pytest.approx(1000.0)
    assert project.drive.rated_speed == pytest.approx(WORKING)
    assert "drive: breakdown slip 0.2" in project.assumed
    assert not any("inertia" in text for text in project.assumed)
    code, out, _ = run(monkeypatch, capsys, path)
    assert code == 0
    assert "does not start" in out
    code, out, _ = run(monkeypatch, capsys, path, "--motor-power", "5.5 kW")
    assert "reaches 850 rpm" in out
    assert ff.load_project("ffs0827").drive is None


@pytest.mark.parametrize(("lines", "told"), [
    ('inertia = "0.9 kg m^2"', ("drive.rated_power", "(left out)")),
    ('rated_power = "1.5 kW"\ninertia = "-1 kg m^2"', ("drive.inertia", "above 0")),
    ('rated_power = "1.5 kW"\ninertia = "9000 kg m^2"', ("drive.inertia", "looks wrong")),
    ('rated_power = "1.5 kW"\nbreakdown_torque_ratio = 0.9', ("breakdown_torque_ratio", "above 1")),
    ('rated_power = "1.5 kW"\nrato = 2', ("drive.rato", "'ratio'")),
])  # fmt: skip
def test_bad_drive_section(tmp_path, lines, told):
    path = machine_file(tmp_path, ("[limits]", f"[drive]\n{lines}\n\n[limits]"))
    with pytest.raises(InputError) as caught:
        ff.load_project(path)
    assert all(word in str(caught.value) for word in told), caught.value


def machine_file(folder, *changes):
    """The bundled machine file with texts replaced."""
    from importlib.resources import files  # noqa: PLC0415

    text = files("flipflow.io").joinpath("machines/ffs0827.toml").read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "machine.toml"
    path.write_text(text, encoding="utf-8")
    return path
