"""Where machines rest, and machines that nothing holds while they touch no stop."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import flipflow as ff
from judge import close

pytestmark = pytest.mark.numerical


def chain(rng, n):
    """Masses in a row, the first one tied to the ground: M, K."""
    k = 10.0 ** rng.uniform(3.0, 7.0, n)
    K = np.diag(np.append(k[:-1] + k[1:], k[-1]))
    K -= np.diag(k[1:], 1) + np.diag(k[1:], -1)
    return np.diag(rng.uniform(1.0, 100.0, n)), K


@pytest.mark.parametrize("seed", range(8))
def test_forces_that_balance_each_other_leave_the_rest_in_place(seed):
    """Rows that are zero but for rounding were told to be held by nothing."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 7))
    M, K = chain(rng, n)
    pair = np.zeros(n)
    pair[-2:] = 500.0, -500.0
    force = ff.Unbalance(np.eye(n)[0])
    system = ff.MechanicalSystem(M, 1e-3 * K, K, (), force, static_force=pair)
    assert np.abs(K @ system.static_position() - pair).max() < 1e-9 * 500.0
    gap = -(10.0 ** rng.uniform(-5.0, -2.0))
    stop = ff.ClearanceSpring(np.sign(pair), 10.0 ** rng.uniform(3.0, 8.0), 100.0, gap, math.inf)
    preloaded = ff.MechanicalSystem(M, 1e-3 * K, K, (stop,), force)
    x = preloaded.static_position()
    push = stop.stiffness * (stop.direction @ x - gap)
    assert push > 0.0
    assert np.abs(K @ x + stop.direction * push).max() < 1e-9 * stop.stiffness * abs(gap)
    assert ff.simulate(preloaded, 50.0, 3).x.shape[1] == n


@pytest.fixture(scope="module")
def floating():
    """Two masses that nothing ties to the ground but drag, within a gap of 50 mm."""
    K = np.array([[1e5, -1e5], [-1e5, 1e5]])
    M = np.diag([100.0, 80.0])
    stop = ff.ClearanceSpring([1, 0], 3e5, 200.0, 0.05)
    return ff.MechanicalSystem(M, 1e-3 * K + M, K, (stop,), ff.Unbalance([0.0, 0.5]))


def test_a_machine_that_floats_settles_where_it_floats(floating):
    """It repeats to rounding; "periodic" and "not settled" stood side by side."""
    swept = ff.sweep(floating, [55.0, 60.0, 65.0])
    assert swept.settled.all()
    assert swept.periods.tolist() == [1, 1, 1]
    assert swept.jumps == ()
    x = np.linalg.solve(
        floating.K + 1j * 60.0 * floating.C - 3600.0 * floating.M, [0.0, 0.5 * 3600.0]
    )
    close("amplitude", swept.amplitude(0)[1], abs(x[0]), rel=1e-9)
    assert ff.simulate(floating, 60.0, 400).settled
    assert ff.periodic_orbits(floating, 60.0) == ()
    (note, _) = ff.basins(floating, 60.0, {0: [0.0, 0.01]}, most_turns=200).notes
    assert note.endswith("or nothing holds it where it floats.")


def test_an_unstable_motion_is_not_settled_on(floating):
    """It repeats for some turns, too."""
    screen = ff.load("ffs0827")
    (orbit,) = (one for one in ff.periodic_orbits(screen, 203.0) if not one.stable)
    swept = ff.sweep(screen, [203.0], initial=orbit)
    assert swept.settled.all()
    assert swept.orbits[0].stable
    tied = replace(floating, K=floating.K + np.diag([1e3, 0.0]))
    assert ff.sweep(tied, [60.0]).orbits[0].stable
