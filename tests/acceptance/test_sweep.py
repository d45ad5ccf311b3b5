"""Stepped sweeps: settled by the motion approached, jumps within one step of the exact folds."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

import flipflow as ff
from flipflow.errors import Cancelled
from flipflow.plotting.sweep import sweep_figure
from judge import close

pytestmark = pytest.mark.numerical
FOLD_UP, FOLD_DOWN = 206.405559, 198.649272  # rad/s, reference values


@pytest.fixture(scope="module")
def screen() -> ff.FlipFlowScreen:
    return ff.load("ffs0827")


@pytest.fixture(scope="module")
def branch(screen):
    return ff.frequency_response(screen, (130.0, 250.0))


@pytest.mark.parametrize("step", [0.01, 0.05, 0.3, 2.0])
@pytest.mark.parametrize("rising", [True, False], ids=["up", "down"])
def test_sweeps_jump_within_one_step_of_the_exact_folds(screen, branch, step, rising) -> None:
    """Steps from 0.01 to 2 rad/s, both directions, 30 steps across the fold."""
    fold = FOLD_UP if rising else FOLD_DOWN
    sign = 1.0 if rising else -1.0
    speeds = fold + sign * step * (np.arange(30) - 20.3)
    start = next(orbit for orbit in branch.orbits_at(speeds[0]) if orbit.stable)
    if not rising:
        start = [orbit for orbit in branch.orbits_at(speeds[0]) if orbit.stable][-1]
    swept = ff.sweep(screen, speeds, initial=start)
    assert len(swept.jumps) == 1, swept.jumps
    jump = swept.jumps[0]
    assert sign * (fold - jump.omega_before) >= 0.0, f"jumped before the fold: {jump}"
    assert abs(jump.omega_after - fold) <= step * (1.0 + 1e-9), f"jumped late: {jump}"
    assert swept.settled.all(), swept.distance.max()


def test_swept_amplitudes_are_those_of_exact_orbits(screen, branch) -> None:
    """Away from the jumps amplitudes agree with exact orbits to 1e-6."""
    speeds = np.arange(150.0, 222.0, 4.0)
    for order in (speeds, speeds[::-1]):
        swept = ff.sweep(screen, order)
        for omega, amplitude in zip(order, swept.amplitude("relative"), strict=True):
            exact = [o.amplitude("relative") for o in branch.orbits_at(float(omega)) if o.stable]
            nearest = min(exact, key=lambda one: abs(one - amplitude))
            assert abs(amplitude / nearest - 1.0) < 1e-6, f"{omega}: {amplitude} against {nearest}"


def test_up_and_down_differ_only_between_the_folds(screen) -> None:
    """Two stable motions only between the folds."""
    speeds = np.arange(190.0, 215.0, 1.0)
    up = ff.sweep(screen, speeds).amplitude("relative")
    down = ff.sweep(screen, speeds[::-1]).amplitude("relative")[::-1]
    differ = speeds[np.abs(up - down) > 1e-6]
    assert differ.min() == 199.0
    assert differ.max() == 206.0


def test_a_motion_that_never_settles_is_marked(screen) -> None:
    """Too few turns just past the fold: the motion lingers, and is not called settled."""
    near = ff.frequency_response(screen, (200.0, 230.0)).orbits_at(206.4)[0]
    swept = ff.sweep(screen, [206.42], initial=near, most_turns=60)
    assert not swept.settled[0]
    assert swept.periods[0] == 0
    assert swept.turns[0] == 60
    longer = ff.sweep(screen, [206.42], initial=near)
    assert longer.settled[0]
    assert longer.amplitude("relative")[0] < 0.5 * near.amplitude("relative")


@pytest.mark.parametrize(
    ("omega", "options", "field"),
    [
        ([], {}, "omega"),
        ([100.0, float("nan")], {}, "omega"),
        ([100.0, -1.0], {}, "omega"),
        (["fast"], {}, "omega"),
        ([100.0], {"initial": "standing"}, "initial"),
        ([100.0], {"initial": [0.0, 0.0]}, "initial"),
        ([100.0], {"max_periods": 0}, "max_periods"),
        ([100.0], {"most_turns": 1.5}, "most_turns"),
    ],
)
def test_bad_sweeps_are_refused(screen, omega, options, field) -> None:
    with pytest.raises(ff.InputError, match=field):
        ff.sweep(screen, omega, **options)


def test_without_damping_nothing_settles(screen) -> None:
    """Bad input: no damping."""
    bare = screen.replace(isolation_damping=0.0, shear_damping=0.0)
    with pytest.raises(ff.InputError, match="damping"):
        ff.sweep(bare, [100.0])


def test_a_gliding_speed_jumps_late_by_the_two_thirds_power_of_its_rate(screen) -> None:
    """Passing a saddle-node at rate r loses the motion about r^(2/3) late (Jung et al. 1990)."""
    rates = (0.5, 2.0, 8.0)
    late = []
    for rate in rates:
        glide = ff.ramp(screen, (195.0, 218.0), rate)
        assert [jump.fold for jump in glide.jumps] == pytest.approx([FOLD_UP], abs=1e-5)
        late.append(glide.jumps[0].late)
    power = np.polyfit(np.log(rates), np.log(late), 1)[0]
    assert power == pytest.approx(2.0 / 3.0, abs=0.08), late


def test_a_falling_speed_jumps_late_beyond_the_other_fold(screen) -> None:
    glide = ff.ramp(screen, (215.0, 190.0), 2.0)
    assert [jump.fold for jump in glide.jumps] == pytest.approx([FOLD_DOWN], abs=1e-5)
    assert glide.jumps[0].omega < FOLD_DOWN


def test_a_ramp_that_begins_not_far_above_the_folds(screen):
    """Light damping: folds at 200.1 and 214.1 rad/s; 240 is reached from below only past both."""
    light = screen.replace(isolation_damping=3000.0, shear_damping=600.0, stop_damping=600.0)
    glide = ff.ramp(light, (240.0, 245.0), 5.0)
    (orbit,) = ff.periodic_orbits(light, 240.0)
    assert glide.history.x[0] == pytest.approx(orbit.state[:2], abs=1e-9)
    assert glide.jumps == ()


def test_a_ramp_begins_with_a_motion_that_leans_where_the_symmetric_one_is_unstable(screen):
    """e = 2 mm at 57.7 rad/s."""
    narrow = screen.replace(clearance=2e-3)
    glide = ff.ramp(narrow, (57.7, 57.8), 0.1)
    leaning = [orbit for orbit in ff.periodic_orbits(narrow, 57.7) if orbit.stable]
    assert len(leaning) == 2
    away = [np.abs(glide.history.x[0] - orbit.state[:2]).max() for orbit in leaning]
    assert min(away) < 1e-9


@pytest.mark.parametrize(
    ("omega", "rate", "field"),
    [((100.0, 200.0), 0.0, "rate"), ((100.0, 200.0), math.nan, "rate"), ((0.0, 9.0), 1.0, "omega")],
)
def test_bad_glides_are_refused(screen, omega, rate, field) -> None:
    with pytest.raises(ff.InputError, match=field):
        ff.ramp(screen, omega, rate)


def test_a_cancelled_sweep_keeps_the_speeds_it_has_passed(screen, tmp_path):
    def stop(_sentence, share):
        if share > 0.5:
            raise Cancelled("stopped")

    omega = np.linspace(80.0, 90.0, 5)
    found = ff.sweep(screen, omega, monitor=stop)
    assert not found.complete
    np.testing.assert_array_equal(found.omega, omega[:3])
    ff.save(found, tmp_path / "sweep.json")
    again = ff.open_result(tmp_path / "sweep.json")
    assert not again.complete
    np.testing.assert_array_equal(again.omega, omega[:3])
    whole = ff.sweep(screen, omega)
    assert whole.complete
    np.testing.assert_array_equal(found.amplitude("main"), whole.amplitude("main")[:3])


def test_a_glide_that_ends_in_chaos_has_jumped():
    screen = ff.FlipFlowScreen(
        main_mass=492.3697878296305, floating_mass=256.99200310348476,
        eccentric_moment=2.098880491781376, isolation_stiffness=165118.24244853383,
        isolation_damping=2325.4215666204746, shear_stiffness=2829512.36825727,
        shear_damping=4937.930155228843, stop_stiffness=41342708.252715796,
        stop_damping=41342.7082527158, clearance=0.00440841022657993, clearance_minus=0.01,
        stop_law="elasto-gap",
    )  # fmt: skip
    glide = ff.ramp(screen, (340.0, 367.0), 2.5)
    (jump,) = glide.jumps
    close("fold", jump.fold, 346.27035536787855, rel=1e-9)
    assert 0.3 < jump.late < 4.0
    speed, size = glide.amplitude("relative")
    before, after = size[speed < jump.fold][-20:], size[speed > jump.omega + 5.0]
    assert np.median(after) < 0.8 * before.min()


@pytest.mark.parametrize("rate", [1.0, 4.0, 60.0])
def test_a_glide_jumps_where_its_motion_is_stable_no_more(rate):
    """The period doubles at 205.7 rad/s; the fold at 168.7 is met with the large motion."""
    screen = ff.FlipFlowScreen(
        main_mass=14212.123808315207, floating_mass=3026.541132735635,
        eccentric_moment=47.264710186366976, isolation_stiffness=1102300.4014089599,
        isolation_damping=30337.559460684268, shear_stiffness=13435407.72120578,
        shear_damping=12641.92385720453, stop_stiffness=252385147.01581198,
        stop_damping=518071.01059662254, clearance=0.004126007171921958,
        normal_stiffness=1191608.3811889258, normal_damping=14088.009063155085,
        deck_angle=0.14654505410589155, clearance_measured="drawn",
    )  # fmt: skip
    glide = ff.ramp(screen, (212.0, 140.0), rate)
    assert min(fold.omega for fold in glide.branch.folds) == pytest.approx(168.72, abs=0.01)
    (jump,) = glide.jumps
    assert jump.fold == pytest.approx(205.65, abs=0.01)
    speed, size = glide.amplitude("relative")
    first = speed[np.argmax(size > 6e-3)]
    assert abs(jump.omega - first) < 0.5 + 0.05 * rate, "within a turn"


def test_a_glide_from_right_before_a_fold_jumps(screen):
    (jump,) = ff.ramp(screen, (206.3, 240.0), 20.0).jumps
    assert jump.fold == pytest.approx(FOLD_UP, abs=1e-5)


@pytest.mark.parametrize("rate", [1.0, 2.0, 4.0])
@pytest.mark.parametrize("end", [160.0, 250.0])
def test_chaos_of_the_same_amplitude_is_no_jump(screen, rate, end):
    """Swings of 1.5, 0.6 and 0.6 mm in turn up to the fold at 137.2 rad/s, and irregular ones."""
    hard = screen.replace(
        isolation_damping=2466.0, shear_damping=651.0, stop_damping=651.0, clearance=1e-3,
        stop_stiffness=150e6,
    )  # fmt: skip
    assert ff.ramp(hard, (120.0, end), rate).jumps == ()


def test_a_glide_of_less_than_a_turn_has_no_amplitude_and_is_drawn(screen):
    glide = ff.ramp(screen, (100.0, 100.01), 1000.0)
    speed, size = glide.amplitude("relative")
    assert speed.size == size.size == 0
    assert glide.jumps == ()
    assert ff.figure(glide).panels


def test_a_glide_that_goes_over_into_two_turns_does_not_jump():
    stop = ff.ClearanceSpring([1.0], 40.0, 0.06, 0.23, math.inf)
    system = ff.MechanicalSystem([[1.0]], [[0.2357]], [[1.0]], [stop], ff.HarmonicForce([0.5]))
    assert ff.ramp(system, (0.39, 0.397), 1e-5).jumps == ()


def test_an_amplitude_that_no_turn_tells_is_not_a_number(tmp_path):
    """A mode that grows to infinity within a few turns."""
    machine = ff.MechanicalSystem([[1.0]], [[-0.2]], [[1.0]], (), ff.HarmonicForce([1.0]))
    found = ff.sweep(machine, [0.7])
    assert found.words == ("undecided",)
    for value in (found.amplitude(0), *found.extremes(0)):
        assert np.isnan(value).all()
    for ending in ("html", "svg"):
        assert ff.figure(found).write(tmp_path / f"sweep.{ending}").stat().st_size > 1000


def test_the_greatest_amplitude_is_one_that_is_known(command, tmp_path):
    """A gap of 1 um and a hard stop: at 200 rpm a turn has more contacts than are recorded."""
    text = (Path(ff.__file__).parent / "io/machines/ffs0827.toml").read_text(encoding="utf-8")
    before, stops, after = re.split(r"(?s)(\[stops\].*?)(?=\n\[)", text, maxsplit=1)
    for name, value in (("stiffness", "1e11 kN/m"), ("damping", "0.01 kN s/m"),
                        ("clearance", "0.001 mm")):  # fmt: skip
        stops = re.sub(rf"(?m)^{name} = .*", f'{name} = "{value}"', stops)
    (tmp_path / "hard.toml").write_text(before + stops + after, encoding="utf-8")
    speeds = "--speeds", "200 rpm", "850 rpm", "--steps", "2"
    code, out, err = command("sweep", tmp_path / "hard.toml", *speeds, "--force")
    assert code == 0, err
    assert re.search(r"greatest relative amplitude 0\.001\d* mm at 850 rpm", out), out


def test_a_sweep_is_drawn_where_no_branch_was_found(screen):
    """The command ended with the branch's failure, and the sweep that had ended was lost."""
    hard = screen.replace(
        stop_stiffness=1e14, stop_damping=1e4, clearance=1e-6, stop_law="elasto-gap"
    )
    branch = ff.frequency_response(hard, (20.9, 89.0))
    assert branch.omega.size == 0
    figure = sweep_figure((ff.sweep(hard, np.array([20.9, 30.0])),), branch)
    assert branch.status.value in figure.caption
