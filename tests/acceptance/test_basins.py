"""Which motion the machine settles on, and what throws it from one onto another."""

from __future__ import annotations

import json
import os
import signal
import sys

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flipflow as ff
from flipflow.cli.main import main
from flipflow.cli.progress import stoppable
from flipflow.errors import Cancelled, InputError
from flipflow.methods.exact import ExactSolver

OMEGA = 203.0
X = np.linspace(-0.08, 0.08, 41)
V = np.linspace(-16.0, 16.0, 41)
BRUTE_TURNS = 400


@pytest.fixture(scope="module")
def found(screen):
    return ff.basins(screen, omega=OMEGA, displacement={"relative": X}, velocity={"relative": V})


@pytest.fixture(scope="module")
def risk(screen):
    return ff.jump_risk(screen, OMEGA)


def settled_on(solver, z, omega, orbits, turns=BRUTE_TURNS):
    """Index of the orbit that hundreds of turns of the exact flow end on."""
    end = solver.settled(z, omega, turns)
    scale = np.repeat([1.0, omega], end.size // 2)
    away = [np.abs((end - orbit.state) / scale).max() for orbit in orbits]
    assert min(away) < 1e-7, away
    return int(np.argmin(away))


def test_two_stable_motions_coexist_between_the_folds(found):
    """Between the folds (rows 7 and 20) there are exactly two: about 40 mm, and the small one."""
    assert len(found.orbits) == 2
    large, small = (orbit.amplitude("relative") for orbit in found.orbits)
    assert large == pytest.approx(39.2e-3, abs=0.1e-3)
    assert small == pytest.approx(6.89e-3, abs=0.01e-3)
    assert all(orbit.stable for orbit in found.orbits)
    assert found.complete


def test_labels_agree_with_brute_force_on_random_cells(screen, found):
    solver = ExactSolver(screen.system(), half_turn=False)
    rng = np.random.default_rng(5)
    cells = rng.integers(0, X.size, (150, 2))
    of_small = np.argwhere(found.labels == 1)
    cells = np.concatenate([cells, of_small[rng.integers(0, len(of_small), 50)]])
    for i, j in cells:
        z = np.array([0.0, -X[i], 0.0, -V[j]])
        assert settled_on(solver, z, OMEGA, found.orbits) == found.labels[i, j], (X[i], V[j])


def test_shares_count_cells_and_carry_their_confidence(found):
    np.testing.assert_allclose(found.shares, [np.mean(found.labels == k) for k in (0, 1)])
    assert found.shares.sum() == pytest.approx(1.0)
    low, high = found.share_intervals.T
    assert np.all((low < found.shares) & (found.shares < high))
    n, p, z = found.labels.size, found.shares[1], 1.959964
    # Wilson's interval holds the p0 for which |p - p0| <= z sqrt(p0 (1 - p0) / n).
    for end in (low[1], high[1]):
        assert abs(p - end) == pytest.approx(z * np.sqrt(end * (1 - end) / n), rel=1e-6)


def test_result_does_not_depend_on_threads_or_chunks(screen, found):
    part = ff.basins(screen, OMEGA, {"relative": X[::4]}, {"relative": V[::4]}, threads=1)
    np.testing.assert_array_equal(part.labels, found.labels[::4, ::4])


def test_mirrored_motions_are_distinct():
    """e = 2 mm at 57.7 rad/s (row 25): a motion and its mirror, whose basins mirror each other."""
    screen = ff.load("ffs0827").replace(clearance=2e-3)
    x = np.linspace(-5e-3, 5e-3, 11)
    here = ff.basins(screen, 57.7, {"relative": x}, {"relative": [0.0]})
    assert len(here.orbits) == 2
    one, other = here.orbits
    assert one.mean("relative") == pytest.approx(-other.mean("relative"), abs=1e-9)
    solver = ExactSolver(screen.system(), half_turn=False)
    for i, label in enumerate(here.labels[:, 0]):
        z = np.array([0.0, -x[i], 0.0, 0.0])
        assert settled_on(solver, z, 57.7, here.orbits, 4000) == label


def oscillator():
    """A bilinear oscillator with a motion of two periods."""
    stop = ff.ClearanceSpring([1.0], 36.0, 0.0, 0.0, np.inf)
    return ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], [stop], ff.HarmonicForce([1.0]))


def test_motions_of_several_periods_are_found_by_the_lanes():
    system = oscillator()
    omega = 3.0
    here = ff.basins(system, omega, {0: np.linspace(-2, 2, 9)}, {0: np.linspace(-2, 2, 9)})
    assert any(orbit.periods > 1 for orbit in here.orbits)
    solver = ExactSolver(system, half_turn=False)
    for (i, j), label in np.ndenumerate(here.labels):
        assert label >= 0
        orbit = here.orbits[label]
        t = 2.0 * np.pi / omega * np.arange(orbit.periods)
        states = np.stack([orbit.displacement(0, t), orbit.velocity(0, t)], axis=1)
        end = solver.settled(np.array([here.axes[0].values[i], here.axes[1].values[j]]), omega, 600)
        assert np.abs(states - end).max(axis=1).min() < 1e-7


def test_motion_of_three_periods_beside_one_that_newton_reaches_first(screen):
    """FFS0827 at 446 rad/s: from every start Newton over one turn also finds the common motion."""
    x = np.linspace(-0.02, 0.02, 7)
    here = ff.basins(screen, 446.0, {"relative": x}, {"relative": 446.0 * x})
    assert sorted(orbit.periods for orbit in here.orbits) == [1, 3]
    assert here.unsettled == 0.0
    assert here.shares.min() > 0.3


@pytest.mark.parametrize(
    ("given", "state"),
    [
        ({"relative": 0.01}, (0.0, -0.01)),
        ({"main": 0.01}, (0.01, 0.0)),
        ({"floating": 0.01}, (0.0, 0.01)),
        ({1: 0.01}, (0.0, 0.01)),
        ({"floating": 0.002, "relative": 0.01}, (0.012, 0.002)),
    ],
)
def test_coordinates_not_given_are_zero(screen, given, state):
    here = ff.basins(screen, OMEGA, displacement={"main": state[0], "floating": state[1]})
    same = ff.basins(screen, OMEGA, displacement=given)
    assert same.turns.ravel() == here.turns.ravel()
    assert same.labels.ravel() == here.labels.ravel()


def test_window_in_which_nothing_settles_is_marked(screen):
    here = ff.basins(screen, OMEGA, {"relative": [0.3, 0.5]}, {"relative": [40.0]}, most_turns=2)
    assert np.all(here.labels == -1)
    assert np.all(here.shares == 0.0)
    assert here.unsettled == 1.0
    assert "2 cells did not settle within 2 turns" in here.notes[0]


def test_absurd_states_end_without_a_motion_or_with_the_right_one(screen):
    here = ff.basins(screen, OMEGA, {"relative": [1e300, 1e3, 0.0]})
    assert here.labels[0] == -1
    assert here.labels[1] >= 0
    assert any("1 cells ended early" in note for note in here.notes)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"displacement": {"relative": []}}, "at least one value"),
        ({"displacement": {"relative": [0.0, np.nan]}}, "finite"),
        ({"displacement": {"relative": [[0.0]]}}, "row"),
        ({"displacement": {"sideways": [0.0]}}, "choose one of"),
        ({"displacement": {5: [0.0]}}, "index"),
        ({"displacement": {"relative": ["wide"]}}, "numbers"),
        ({"displacement": [0.0]}, "coordinates with their values"),
        ({"displacement": {"main": [0], "floating": [0], "relative": [0]}}, "leave one out"),
        ({}, "at least one coordinate"),
        ({"displacement": {"main": np.zeros(3000), "floating": np.zeros(3000)}}, "at most"),
        ({"displacement": {"main": [0.0]}, "most_turns": 0}, "whole number"),
        ({"displacement": {"main": [0.0]}, "threads": -1}, "whole number"),
        ({"displacement": {"main": [0.0]}, "omega": np.nan}, "finite frequency"),
    ],
)
def test_bad_windows_are_refused_with_a_sentence(screen, changes, words):
    with pytest.raises(InputError, match=words):
        ff.basins(screen, **{"omega": OMEGA, **changes})


def test_cancelled_run_keeps_the_cells_it_has_finished(screen, found):
    def stop(sentence, share):
        if sentence == "cells" and share > 0.5:
            raise Cancelled("enough")

    part = ff.basins(screen, OMEGA, {"relative": X}, {"relative": V}, monitor=stop, threads=2)
    ran = part.turns >= 0
    assert 0.4 < ran.mean() < 1.0
    assert not part.complete
    np.testing.assert_array_equal(part.labels[ran], found.labels[ran])
    assert np.all(part.labels[~ran] == -1)
    assert part.shares.sum() == pytest.approx(1.0)
    assert "Cancelled" in part.notes[-1]


def test_basins_open_as_they_were_saved(tmp_path, found):
    ff.save(found, tmp_path / "basins.json")
    again = ff.open_result(tmp_path / "basins.json")
    np.testing.assert_array_equal(again.labels, found.labels)
    np.testing.assert_array_equal(again.turns, found.turns)
    np.testing.assert_allclose(again.shares, found.shares)
    for here, there in zip(again.orbits, found.orbits, strict=True):
        assert here.amplitude("relative") == pytest.approx(there.amplitude("relative"), rel=1e-12)
        assert here.stable


def test_figure_shows_cells_and_motions(tmp_path, found):
    figure = ff.figure(found)
    (panel,) = figure.panels
    assert panel.cells[0].kind.shape == (V.size, X.size)
    assert panel.cells[0].kind[3, 7] == found.labels[7, 3] + 1
    assert [trace.name for trace in panel.traces] == [
        f"39.2 mm relative: {100 * found.shares[0]:.3g} %",
        f"6.89 mm relative: {100 * found.shares[1]:.3g} %",
    ]
    for ending in ("html", "svg", "png"):
        assert figure.write(tmp_path / f"basins.{ending}").stat().st_size > 1000


def after_blow(screen, throw, orbit, factor):
    """Brute force: where the machine settles after ``factor`` times a blow."""
    system = screen.system()
    mass = {"main": screen.main_mass, "floating": screen.floating_mass}[throw.frame]
    k = {"main": 0, "floating": 1}[throw.frame]
    t = throw.phase / orbit.omega
    x = np.array([orbit.displacement(i, t) for i in (0, 1)], float)
    v = np.array([orbit.velocity(i, t) for i in (0, 1)], float)
    if throw.lump is None:
        v[k] += factor * throw.impulse / mass
    else:
        v[k] *= mass / (mass + factor * throw.lump)
    return rk_to_end_of_turn(system, np.concatenate([x, v]), t, orbit.omega)


def rk_to_end_of_turn(system, z, t, omega):
    """The state at the end of the turn, by the reference integrator of the tests."""
    (spring,) = system.springs
    M, C, K = system.M, system.C, system.K
    edges = np.array([spring.gaps[0], -spring.gaps[1]])

    def rate(time, state, side):
        x, v = state[:2], state[2:]
        y, w = spring.direction @ x, spring.direction @ v
        H = spring.stiffness * (y - edges[side]) + spring.damping * w if side is not None else 0.0
        F = system.excitation.vector * omega**2 * np.exp(1j * omega * time)
        return np.concatenate(
            [v, np.linalg.solve(M, F.real - C @ v - K @ x - spring.direction * H)]
        )

    def gap(sign):
        def event(_time, state, _side):
            return sign * (spring.direction @ state[:2]) - spring.gaps[0]

        event.terminal = True
        return event

    end = 2.0 * np.pi / omega
    while t < end:
        y, w = spring.direction @ z[:2], spring.direction @ z[2:]
        side = next(
            (
                s
                for s, sign in enumerate((1, -1))
                if sign * y > spring.gaps[0] - 1e-12
                and (sign * y > spring.gaps[0] + 1e-12 or sign * w > 0)
            ),
            None,
        )
        events = [gap(1), gap(-1)]
        for event, sign in zip(events, (1, -1), strict=True):
            event.direction = -1.0 if side is not None and (1, -1)[side] == sign else 1.0
        done = solve_ivp(
            rate, (t, end), z, "DOP853", rtol=1e-11, atol=1e-13, events=events, args=(side,)
        )
        t, z = done.t[-1], done.y[:, -1]
    return z


@pytest.mark.parametrize("kind", ["impulse", "lump"])
def test_least_blow_is_least_within_one_per_cent(screen, kind):
    """1 % more throws the motion out, 1 % less does not; by another integrator and long runs."""
    omega = 206.0 if kind == "lump" else OMEGA
    risk = ff.jump_risk(screen, omega)
    throw = risk.worst_impulse if kind == "impulse" else risk.worst_lump
    assert throw.sharp
    orbits = (risk.orbit, *risk.others)
    solver = ExactSolver(screen.system(), half_turn=False)
    ends = [
        settled_on(solver, after_blow(screen, throw, risk.orbit, factor), omega, orbits, 1200)
        for factor in (0.99, 1.01)
    ]
    assert ends == [0, 1]
    assert throw.lands.amplitude("relative") == pytest.approx(
        orbits[1].amplitude("relative"), rel=1e-9
    )


def test_least_impulse_is_least_over_frames_and_moments(screen, risk):
    """No smaller one among 400 random blows throws the motion out."""
    assert risk.impulse == min(throw.size for throw in risk.impulses)
    assert risk.impulse <= min(values.min() for values in risk.thresholds.values())
    rng = np.random.default_rng(2)
    solver = ExactSolver(screen.system(), half_turn=False)
    orbit, orbits = risk.orbit, (risk.orbit, *risk.others)
    masses = np.array([screen.main_mass, screen.floating_mass])
    for k, share in zip(rng.integers(0, 2, 400), rng.uniform(-0.97, 0.97, 400), strict=True):
        # At phase 0, where the stroboscopic solver starts; the moments have their own tests.
        z = orbit.state.copy()
        z[2 + k] += share * risk.impulse / masses[k]
        assert settled_on(solver, z, OMEGA, orbits) == 0


def test_worst_moment_repeats_mirrored_after_half_a_turn(risk):
    """The machine is its own mirror image: +J at theta does what -J does at theta + 180 deg."""
    half = risk.phases.size // 2
    for plus, minus in risk.thresholds.values():
        both = np.isfinite(plus)
        rolled = np.roll(minus, -half)
        np.testing.assert_array_equal(both, np.isfinite(rolled))
        np.testing.assert_allclose(plus[both], rolled[both], rtol=1e-2)


def test_without_another_motion_nothing_jumps(screen):
    risk = ff.jump_risk(screen, 120.0)
    assert risk.worst_impulse is None
    assert risk.impulse == np.inf
    assert risk.lump == np.inf
    assert risk.others == ()
    assert risk.notes == ("No other motion found: it cannot jump.",)


def test_jump_risk_of_a_given_orbit(screen, found):
    """The small motion may be thrown up to the large one."""
    risk = ff.jump_risk(screen, found.orbits[1])
    assert risk.orbit.amplitude("relative") == pytest.approx(6.89e-3, abs=0.01e-3)
    assert 0.0 < risk.impulse < np.inf
    assert risk.worst_impulse.lands.amplitude("relative") > 39e-3


def test_jump_risk_refuses_what_is_absurd(screen):
    for impulse in (-1.0, 0.0, np.nan, np.inf, 1e30, "much", True):
        with pytest.raises(InputError, match="impulse"):
            ff.jump_risk(screen, OMEGA, largest_impulse=impulse)
    unstable = next(o for o in ff.periodic_orbits(screen, OMEGA) if not o.stable)
    with pytest.raises(InputError, match="stable"):
        ff.jump_risk(screen, unstable)
    for omega in (-1.0, np.nan, "fast"):
        with pytest.raises(InputError, match="omega"):
            ff.jump_risk(screen, omega)


def run(monkeypatch, *words):
    monkeypatch.setattr(sys, "argv", ["flipflow", *map(str, words)])
    try:
        main()
    except SystemExit as ended:
        return ended.code or 0
    return 0


def test_command_line(monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    words = ("basins", "ffs0827", "--speed", "203 rad/s", "--cells", 20, "-o", "out")
    assert run(monkeypatch, *words, "--json", "basins.json") == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[0].startswith("1939 rpm (32.31 Hz, 203 rad/s): 2 motions")
    text = " ".join(line.strip() for line in lines)
    assert "39.2 mm" in text
    assert "kg m/s" in text
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "basins.html", "basins.json",
    ]  # fmt: skip
    document = json.loads((tmp_path / "basins.json").read_text())
    assert document["schema"] == "flipflow/basins/1"
    assert document["jump_risk"]["impulse"]["impulse"] > 0


@pytest.mark.parametrize(
    "words",
    [
        ("--speed", "203 kg"),
        ("--speed", "-3 rpm"),
        ("--speed", "203 rad/s", "--cells", "0"),
        ("--speed", "203 rad/s", "--cells", "100000"),
    ],
)
def test_command_line_refuses_with_one_sentence(monkeypatch, tmp_path, capsys, words):
    monkeypatch.chdir(tmp_path)
    assert run(monkeypatch, "basins", "ffs0827", *words) == 2
    assert capsys.readouterr().err.startswith("Error: ")


def test_interrupt_keeps_cells_and_ends_other_stages():
    """Ctrl-C while cells run becomes Cancelled at the next word; elsewhere it ends the program."""
    before = signal.getsignal(signal.SIGINT)
    with stoppable(lambda _sentence, _share: None, "cells") as told:
        told("cells", 0.1)
        os.kill(os.getpid(), signal.SIGINT)
        with pytest.raises(Cancelled):
            told("cells", 0.2)
    with stoppable(lambda _sentence, _share: None, "cells") as told:
        told("motions", 0.0)
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is before


def test_interrupted_command_writes_what_it_has(monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    run_cells = ff.basins

    def interrupted(*given, monitor, **options):
        def told(sentence, share):
            if sentence == "cells" and share > 0.3:
                os.kill(os.getpid(), signal.SIGINT)
            monitor(sentence, share)

        return run_cells(*given, monitor=told, **options)

    monkeypatch.setattr("flipflow.analyses.basins.basins", interrupted)
    assert run(monkeypatch, "basins", "ffs0827", "--speed", "203 rad/s", "-o", "out") == 130
    assert "Stopped by the user" in capsys.readouterr().err
    document = json.loads((tmp_path / "out" / "basins.json").read_text())
    assert not document["complete"]
    assert document["jump_risk"] is None
