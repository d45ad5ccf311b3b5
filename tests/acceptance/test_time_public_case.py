"""A two-mass chain in time: period-doubled, quasi-periodic and coexisting motions by brute force.

The brute force is a stroboscopic run of our own with nothing but DOP853 with events (at a few
frequencies) or the exact flow turn by turn (at all): no settling criterion, no shooting.
"""

from __future__ import annotations

import numpy as np
import pytest

import flipflow as ff
from flipflow.periodic.exact_solver import ExactSolver
from reference import integrate

pytestmark = pytest.mark.numerical
SPEEDS = np.round(np.arange(0.5, 0.8001, 0.01), 3)
TURNS, WATCHED, REPEAT = 1500, 60, 1e-7
# Here several motions are stable, or some repeat after more than six turns or never, and a run
# comes from one that does not repeat: rounding decides where it ends. Elsewhere it comes from one
# that repeats, or there is only one.
DECIDED_BY_ROUNDING = (0.59, 0.6, 0.61, 0.62)
MAY_NOT_SETTLE = (0.59, 0.6, 0.61)
STARTS = 24
BAND = 0.02


@pytest.fixture(scope="module")
def chain() -> ff.MechanicalSystem:
    K = np.array([[1.0, -1.0], [-1.0, 2.0]])
    stop = ff.ClearanceSpring([1.0, 0.0], 100.0, 0.0, 1.0, np.inf)
    return ff.MechanicalSystem(np.eye(2), 0.03 * K, K, (stop,), ff.HarmonicForce([0.0, 0.1]))


class Stroboscope:
    """Where hundreds of turns of the exact flow end, watched over the last of them."""

    def __init__(self, chain) -> None:
        self.solver = ExactSolver(chain, half_turn=False)

    def run(self, z, omega) -> tuple[np.ndarray, tuple[int, float, float]]:
        """Last state; period (0: none up to 12), least and greatest x1 over the last turns."""
        states = self.solver.section(z, float(omega), TURNS)
        last = states[-WATCHED:]
        gaps = [np.abs(last[:-n] - last[n:]).max() for n in range(1, 13)]
        period = next((n for n, gap in enumerate(gaps, 1) if gap < REPEAT), 0)
        every = np.full(WATCHED, float(omega))
        low, high, _ = self.solver.extremes(last, every, np.array([[1.0, 0.0]]))
        return states[-1], (period, float(low.min()), float(high.max()))

    def from_anywhere(self, omega) -> list[tuple[int, float, float]]:
        """What rest and random states end on."""
        states = np.random.default_rng(0).uniform(-1.0, 1.0, (STARTS, 4)) * [1.0, 2.0, 0.8, 1.5]
        return [self.run(z, omega)[1] for z in (np.zeros(4), *states)]


def same(one, other) -> bool:
    """Periodic: the same period and range. Not periodic: two runs see the same band only."""
    away = np.abs(np.subtract(one, other)[1:]).max()
    return away < BAND if other[0] == 0 else one[0] == other[0] and away < 1e-6


@pytest.mark.parametrize("direction", [1, -1], ids=["up", "down"])
def test_sweeps_agree_with_brute_force_frequency_by_frequency(chain, direction) -> None:
    """Both sweeps, from 0.5 to 0.8, against a stroboscopic run.

    At four frequencies, where rounding decides which motion is reached, the run goes on from the
    end of the sweep's own, and finds that it stays on the motion that the sweep has named.
    """
    speeds = SPEEDS[::direction]
    swept = ff.sweep(chain, speeds, most_turns=TURNS)
    ranges = zip(swept.periods, *swept.extremes(0), strict=True)
    brute, z = Stroboscope(chain), np.zeros(4)
    for omega, row, found in zip(speeds, swept.rows, ranges, strict=True):
        start = row.state if omega in DECIDED_BY_ROUNDING else z
        z, ended = brute.run(start, omega)
        assert same(ended, found), f"{omega}: {found} against {ended}"
        assert row.settled or omega in MAY_NOT_SETTLE, omega


def test_where_rounding_decides_several_motions_are_stable(chain) -> None:
    """At 0.62 a motion of one period and one of four, as a random start takes it."""
    ends = Stroboscope(chain).from_anywhere(0.62)
    assert {period for period, _, _ in ends} == {1, 4}
    one, four = (next(end for end in ends if end[0] == period) for period in (1, 4))
    assert all(same(end, one) or same(end, four) for end in ends)


def test_kinds_of_motion_are_found_in_the_sweeps(chain) -> None:
    """Period-doubled, quasi-periodic and coexisting motions."""
    up = ff.sweep(chain, SPEEDS, most_turns=TURNS)
    down = ff.sweep(chain, SPEEDS[::-1], most_turns=TURNS)
    assert 2 in up.periods[np.isclose(SPEEDS, 0.74)]
    coexist = np.abs(up.amplitude(0) - down.amplitude(0)[::-1]) > 1e-3
    assert coexist.any()
    assert len(up.jumps) + len(down.jumps) >= 2
    quasi = ff.sweep(chain, [0.635, 0.62, 0.61, 0.605], most_turns=3000)
    assert quasi.periods[0] == 1
    assert 0 in quasi.periods[1:] or quasi.periods[-1] > 4, quasi.periods


@pytest.mark.parametrize("omega", [0.6, 0.74, 0.745])
def test_periodic_orbits_close_under_dop853(chain, omega) -> None:
    """Every motion found returns to itself after its periods by an independent integration."""
    machine = integrate.Machine.of(chain)
    orbits = ff.periodic_orbits(chain, omega, 6)
    assert any(orbit.periods > 1 for orbit in orbits)
    for orbit in orbits:
        duration = orbit.periods * 2.0 * np.pi / omega
        back = integrate.flow(machine, orbit.state, omega, 0.0, duration).final
        grown = max(abs(orbit.multipliers).max(), 1.0)
        assert np.abs(back - orbit.state).max() < 1e-8 * grown, orbit
