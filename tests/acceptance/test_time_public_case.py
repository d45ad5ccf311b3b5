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

SPEEDS = np.round(np.arange(0.5, 0.8001, 0.01), 3)
TURNS, WATCHED, REPEAT = 1500, 60, 1e-7


@pytest.fixture(scope="module")
def chain() -> ff.MechanicalSystem:
    K = np.array([[1.0, -1.0], [-1.0, 2.0]])
    stop = ff.ClearanceSpring([1.0, 0.0], 100.0, 0.0, 1.0, np.inf)
    return ff.MechanicalSystem(np.eye(2), 0.03 * K, K, (stop,), ff.HarmonicForce([0.0, 0.1]))


def brute_force(chain, speeds) -> list[tuple[int, float, float]]:
    """Period (0: none up to 6), least and greatest x1 over the last turns, speed by speed."""
    solver = ExactSolver(chain, half_turn=False)
    z, found = np.zeros(4), []
    for omega in speeds:
        states = solver.section(z, float(omega), TURNS)
        z = states[-1]
        last = states[-WATCHED:]
        gaps = [np.abs(last[:-n] - last[n:]).max() for n in range(1, 7)]
        period = next((n for n, gap in enumerate(gaps, 1) if gap < REPEAT), 0)
        low, high, _ = solver.extremes(last, np.full(WATCHED, float(omega)), np.array([[1.0, 0.0]]))
        found.append((period, float(low.min()), float(high.max())))
    return found


@pytest.mark.parametrize("direction", [1, -1], ids=["up", "down"])
def test_sweeps_agree_with_brute_force_frequency_by_frequency(chain, direction) -> None:
    """Both sweeps, from 0.5 to 0.8, against a stroboscopic run."""
    speeds = SPEEDS[::direction]
    swept = ff.sweep(chain, speeds, most_turns=TURNS)
    low, high = swept.extremes(0)
    for k, (period, least, most) in enumerate(brute_force(chain, speeds)):
        where = f"{speeds[k]}: period {swept.periods[k]} against {period}"
        if period == 0:
            # Not periodic: two runs see the same band, not the same points of it.
            assert not swept.settled[k] or swept.turns[k] > 100, where
            assert abs(high[k] - most) < 0.02, where
            continue
        assert swept.periods[k] == period, where
        assert abs(high[k] - most) < 1e-6, f"{where}: {high[k]} against {most}"
        assert abs(low[k] - least) < 1e-6, f"{where}: {low[k]} against {least}"


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
