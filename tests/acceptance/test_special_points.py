"""Special points of random machines: none false, none stepped over, each branch to its end.

The machines are those of benchmarks/random_machines.py, by number of seed 0; the whole run is in
benchmarks/README.md.
"""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import flipflow as ff

pytestmark = pytest.mark.numerical
SEED = 0
SPEC = importlib.util.spec_from_file_location(
    "machine_draw", Path(__file__).parents[2] / "benchmarks" / "machine_draw.py"
)
PAIRS = {220: (25.99218, 26.00436), 283: (29.97380, 29.99874), 934: (31.79510, 31.79870)}
FALSE = {143: (15.1200, 15.1204), 898: (14.8523, 14.8525)}


@pytest.fixture(scope="module")
def drawn():
    draw = importlib.util.module_from_spec(SPEC)
    SPEC.loader.exec_module(draw)

    def of(number, method=None):
        screen = draw.draw(SEED, number)
        return ff.frequency_response(screen, draw.speeds(screen), method)

    return of


def kinds_between(branch, kind, low, high):
    return [point.omega for point in branch.points_of(kind) if low < point.omega < high]


@pytest.mark.parametrize("number", PAIRS)
def test_pair_of_symmetry_breakings_within_one_step_is_found(drawn, number):
    """The series, which takes other steps, has the same pair, to its own error."""
    low, high = PAIRS[number]
    exact = kinds_between(drawn(number), "symmetry breaking", low - 5e-3, high + 5e-3)
    series = drawn(number, ff.HarmonicBalance(25))
    same = kinds_between(series, "symmetry breaking", low - 5e-3, high + 5e-3)
    assert len(exact) == len(same) == 2
    assert exact == pytest.approx(same, abs=2e-3)
    assert exact == pytest.approx(PAIRS[number], abs=2e-3)


@pytest.mark.parametrize("number", FALSE)
def test_symmetry_breaking_of_the_series_alone_is_a_note(drawn, number):
    low, high = FALSE[number]
    series = drawn(number, ff.HarmonicBalance(25))
    for branch in (series, drawn(number)):
        assert branch.complete
        assert not kinds_between(branch, "symmetry breaking", low, high)
    said = [note for note in series.notes if note.startswith("symmetry breaking of the series")]
    assert len(said) == 1
    assert "raise the harmonics" in said[0]
    said_at = [float(word) for word in re.findall(r"\d+\.\d+", said[0])]
    assert any(low < omega < high for omega in said_at)


@pytest.mark.parametrize("harmonics", [1, 3])
def test_folds_of_a_short_series_are_kept(screen, harmonics):
    branch = ff.frequency_response(screen, (5, 250), ff.HarmonicBalance(harmonics))
    expected = {1: (206.453, 198.002), 3: (206.415, 198.661)}[harmonics]
    assert [fold.omega for fold in branch.folds] == pytest.approx(expected, abs=2e-3)
    assert branch.notes == ()


def test_branch_with_folds_sharper_than_its_steps_reaches_the_end(drawn):
    """Just past a new contact the branch turns within a billionth of its length."""
    branch = drawn(840)
    assert branch.complete, branch.status.value
    assert len(branch.folds) % 2 == 0
    rises = np.sign(np.diff(branch.omega))
    assert np.count_nonzero(rises[1:] != rises[:-1]) == len(branch.folds)


@pytest.mark.parametrize("interval", [(0.1, 3.0), (0.1, 2.0), (0.2, 3.0), (0.1, 1.0), (0.2, 0.32)])
def test_two_folds_that_stand_close_are_both_kept(interval):
    """A bilinear oscillator without gap: two folds 2e-5 rad/s apart in its fourth superharmonic.

    Between those of the series there is no exact motion, and whether a point of the branch lies
    there depends on the steps, which the interval sets.
    """
    stop = ff.ClearanceSpring([1.0], 3.0, 0.0, 0.0, np.inf)
    bilinear = ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], (stop,), ff.HarmonicForce([1.0]))
    exact = ff.frequency_response(bilinear, interval)
    series = ff.frequency_response(bilinear, interval, ff.HarmonicBalance(25))
    assert exact.complete
    assert series.complete
    close = [fold.omega for fold in exact.folds if fold.omega < 0.3]
    assert close == pytest.approx([0.2450662, 0.2450452], abs=1e-6)
    shown = [fold.omega for fold in series.folds]
    assert shown == pytest.approx([fold.omega for fold in exact.folds], abs=5e-5)
    assert not [note for note in series.notes if note.startswith("fold of the series")]


def test_a_fold_at_a_corner_stands_where_the_motion_without_contact_grazes():
    """There Newton's method finds the motion on the other side of the corner again and again."""
    K = np.array([[0.943, -0.566, 0.0], [-0.566, 2.996, -2.43], [0.0, -2.43, 2.43]])
    d = np.array([-1.0, 0.0, 1.0])
    stop = ff.ClearanceSpring(d, 277.0, 2.747, 2.9735, np.inf, law="undamped-rebound")
    M, force = np.diag([2.434, 0.725, 1.562]), np.array([1.078, 0.1, 0.1])
    machine = ff.MechanicalSystem(M, 0.1932 * K, K, (stop,), ff.Unbalance(force))

    def room(omega):
        x = np.linalg.solve(K - omega**2 * M + 0.1932j * omega * K, omega**2 * force)
        return 2.9735 - abs(d @ x)

    grazing = brentq(room, 0.74, 0.75, xtol=1e-14)
    branch = ff.frequency_response(machine, (0.7, 0.9))
    (end,), fold = branch.points_of("contact end"), branch.folds[-1]
    assert [end.omega, fold.omega] == pytest.approx([grazing, grazing], abs=1e-10)


@pytest.mark.parametrize("force", [0.6, 0.9])
def test_where_a_contact_that_hardly_lasts_ends(force) -> None:
    """Samples within it are as high as its summit; without contact the amplitude is the gap."""
    stop = ff.ClearanceSpring([1.0], 80.0, 8.0, 1.0, law="compression-only")
    machine = ff.MechanicalSystem([[1.0]], [[0.2]], [[1.0]], [stop], ff.HarmonicForce([force]))
    (point,) = ff.frequency_response(machine, (0.2, 4.0)).points_of("contact end")
    # force^2 = (1 - w^2)^2 + (0.2 w)^2
    w = point.omega
    slope = 2.0 * force**2 / (-4.0 * w * (1.0 - w**2) + 0.08 * w)
    assert point.sensitivity(["forcing"]) == pytest.approx([slope], rel=1e-7)
