"""Which motion the machine settles on, from where."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import flipflow as ff
from flipflow.errors import Cancelled, InputError
from flipflow.periodic.exact_solver import ExactSolver
from settling import settled_on

pytestmark = pytest.mark.numerical
OMEGA = 203.0
X = np.linspace(-0.08, 0.08, 41)
V = np.linspace(-16.0, 16.0, 41)


@pytest.fixture(scope="module")
def found(screen):
    return ff.basins(screen, omega=OMEGA, displacement={"relative": X}, velocity={"relative": V})


def test_two_stable_motions_coexist_between_the_folds(found):
    """Between the folds there are exactly two: about 40 mm, and the small one."""
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
    """e = 2 mm at 57.7 rad/s: a motion and its mirror, whose basins mirror each other."""
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


def test_slow_motions_are_caught_from_afar(screen):
    """Multipliers of modulus 0.9969: one turn takes 0.3 % of the distance away."""
    hard = screen.replace(stop_stiffness=8e8, stop_damping=5e4)
    omega, x = 89.0118, np.linspace(-0.03, 0.03, 24)
    here = ff.basins(hard, omega, {"relative": x}, most_turns=2000)
    assert len(here.orbits) == 2
    assert np.all(here.labels >= 0), here.notes
    solver = ExactSolver(hard.system(), half_turn=False)
    for i, label in enumerate(here.labels):
        z = np.array([0.0, -x[i], 0.0, 0.0])
        assert settled_on(solver, z, omega, here.orbits, 6000) == label


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
    assert any(note.startswith("1 cells") for note in here.notes)


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


def unforced(stiffness, gaps, law="paper"):
    stop = ff.ClearanceSpring([1.0], 30.0, 1.0, *gaps, law)
    return ff.MechanicalSystem([[1.0]], [[0.2]], [[stiffness]], (stop,), ff.HarmonicForce([0.0]))


@pytest.mark.parametrize("law", ["paper", "compression-only", "undamped-rebound", "elasto-gap"])
@pytest.mark.parametrize("gaps", [(0.4, np.inf), (0.4, 0.4), (0.0, np.inf), (0.0, 0.2)])
def test_without_force_every_state_comes_to_rest(law, gaps):
    """Rest may stand at a gap of zero, where its map is another on each side."""
    found = ff.basins(unforced(1.0, gaps, law), 1.7, {0: np.linspace(-1.0, 1.0, 7)})
    (rest,) = found.orbits
    assert rest.stable
    assert np.abs(rest.state).max() < 1e-9
    np.testing.assert_array_equal(found.labels, 0)
    assert found.notes == ()


@pytest.mark.parametrize("law", ["paper", "compression-only", "undamped-rebound", "elasto-gap"])
def test_each_rest_against_a_stop_has_its_own_basin(law):
    """A spring that pushes away from the middle is held on either side: 30 (x - 0.4) = x."""
    machine, omega = unforced(-1.0, (0.4, 0.2), law), 1.7
    x = np.array([-0.9, -0.3, -0.02, 0.02, 0.3, 0.7])
    found = ff.basins(machine, omega, {0: x}, {0: np.array([-0.4, 0.3])})
    rests = np.array([orbit.state[0] for orbit in found.orbits])
    assert sorted(rests) == pytest.approx([-0.2 * 30.0 / 29.0, 0.4 * 30.0 / 29.0], abs=1e-9)
    for (i, j), label in np.ndenumerate(found.labels):
        start = [x[i], found.axes[1].values[j]]
        end = ff.simulate(machine, omega, 60, initial=start).displacement(0)[-1]
        assert rests[label] == pytest.approx(end, abs=1e-4)
    assert set(found.labels.ravel()) == {0, 1}


def test_cells_of_another_shape_are_refused(screen):
    """What a damaged file may hold."""
    found = ff.basins(screen, OMEGA, {"relative": X[:3]}, {"relative": V[:3]})
    for name in ("labels", "turns"):
        with pytest.raises(InputError, match=rf"{name} = .*give one a cell, \(3, 3\)"):
            dataclasses.replace(found, **{name: getattr(found, name)[:1]})
