"""A public case, example 03 of the code NLvib, through the same solvers as the screen.

Two masses of 1, springs none, 1, 1 and dampers 0.03 times the springs, a stop of stiffness 100
on mass 1 beyond x1 = 1, force 0.1 cos(w t) on mass 2. Shooting is exact and checked by
event-located DOP853; harmonic balance of order 21 is checked against it.
"""

from __future__ import annotations

import numpy as np
import pytest

import flipflow as ff
from judge import close
from reference import integrate

pytestmark = pytest.mark.numerical
INTERVAL = (0.5, 0.8)
SPEEDS = (0.55, 0.6, 0.635, 0.66, 0.7, 0.72, 0.735, 0.75, 0.755, 0.78)


@pytest.fixture(scope="module")
def chain() -> ff.MechanicalSystem:
    K = np.array([[1.0, -1.0], [-1.0, 2.0]])
    stop = ff.ClearanceSpring([1.0, 0.0], 100.0, 0.0, 1.0, np.inf)
    return ff.MechanicalSystem(np.eye(2), 0.03 * K, K, (stop,), ff.HarmonicForce([0.0, 0.1]))


@pytest.fixture(scope="module")
def shooting(chain):
    return ff.frequency_response(chain, INTERVAL)


@pytest.fixture(scope="module")
def balance(chain):
    return ff.frequency_response(chain, INTERVAL, ff.HarmonicBalance(21))


def omegas(branch, kind: str) -> list[float]:
    return [point.omega for point in branch.points_of(kind)]


def test_kinds_of_special_points(shooting, balance) -> None:
    """Turning points, period doubling and Neimark-Sacker points appear, by both methods."""
    for branch in (shooting, balance):
        assert branch.status.complete, branch.status.value
        assert branch.notes == ()
        found = {point.kind for point in branch.special_points}
        assert {"fold", "period doubling", "Neimark-Sacker"} <= found, found


def test_where_motions_change(shooting) -> None:
    """What changes at which speed, in rad/s.

    0.635 is stable, 0.600 beyond a Neimark-Sacker point; the upper branch doubles its period
    between 0.73 and 0.74 and ends between 0.75 and 0.76.
    """
    upper = {w: shooting.orbits_at(w)[0] for w in (0.6, 0.635, 0.73, 0.74)}
    assert upper[0.635].stability == "stable"
    assert upper[0.6].stability == "unstable"
    largest = upper[0.6].multipliers[0]
    assert abs(largest.imag) > 1e-3, f"multiplier {largest} at 0.6, expected a complex pair"
    assert any(0.6 < w < 0.635 for w in omegas(shooting, "Neimark-Sacker"))
    assert upper[0.73].stability == "stable"
    assert upper[0.74].stability == "unstable"
    first = omegas(shooting, "period doubling")[0]
    assert 0.73 < first < 0.74, f"period doubling at {first}, expected in (0.73, 0.74)"
    end = max(omegas(shooting, "fold"))
    assert 0.75 < end < 0.76, f"upper branch ends at {end}, expected in (0.75, 0.76)"


def test_no_motion_of_one_period_is_stable_at_0_600(chain, shooting) -> None:
    """At 0.600 DOP853 does not come to rest in period one, at 0.635 it does.

    120 turns from the motion itself, slightly pushed; the distance between successive turns.
    """
    reference = integrate.Machine.of(chain)
    for omega, periodic in ((0.6, False), (0.635, True)):
        turn = 2.0 * np.pi / omega
        start = shooting.orbits_at(omega)[0].state + np.array([1e-3, 0.0, 0.0, 0.0])
        before = integrate.flow(reference, start, omega, 0.0, 120.0 * turn, 1e-9).final
        after = integrate.flow(reference, before, omega, 0.0, turn, 1e-9).final
        moved = np.abs(after - before).max()
        assert (moved < 1e-4) == periodic, f"moved by {moved} in a turn at {omega}"


@pytest.mark.parametrize("omega", SPEEDS)
def test_shooting_is_exact(chain, shooting, omega: float) -> None:
    """DOP853 started on each motion, stable or not, comes back to 1e-8 of its amplitude."""
    reference = integrate.Machine.of(chain)
    for orbit in shooting.orbits_at(omega):
        end = integrate.flow(reference, orbit.state, omega, 0.0, orbit.period).final
        close(f"state after a turn at {omega}", end, orbit.state, abs=1e-8)


@pytest.mark.parametrize("omega", SPEEDS)
def test_harmonic_balance_agrees_with_shooting(shooting, balance, omega: float) -> None:
    """As many motions, amplitudes within the stated error and within 2e-3 of their size.

    The stop is a hundred times stiffer than the spring; a touch lasts a thirtieth of the turn,
    which 21 harmonics resolve to some thousandths.
    """
    exact, series = shooting.orbits_at(omega), balance.orbits_at(omega)
    assert len(exact) == len(series)
    for one, other in zip(exact, series, strict=True):
        for which in (0, 1):
            got, expected = other.amplitude(which), one.amplitude(which)
            close(f"x{which + 1} at {omega}", got, expected, rel=2e-3, abs=1e-9)
            close("within the stated error", got, expected, abs=3.0 * other.error + 1e-9)


@pytest.mark.parametrize("omega", SPEEDS)
def test_no_wrong_word_of_stability(shooting, balance, omega: float) -> None:
    """Where harmonic balance says "stable" or "unstable", shooting says the same.

    "undetermined" is an honest answer of a truncated series; a wrong word is not.
    """
    exact, series = shooting.orbits_at(omega), balance.orbits_at(omega)
    for one, other in zip(exact, series, strict=True):
        assert other.stability in (one.stability, "undetermined"), (
            f"at {omega}, amplitude {one.amplitude(0):.5f}: harmonic balance says "
            f"{other.stability} (|mu| {abs(other.multipliers[0]):.4f}), shooting {one.stability} "
            f"(|mu| {abs(one.multipliers[0]):.4f})"
        )


def test_special_points_of_both_methods(shooting, balance) -> None:
    """Folds and contact to 1e-4 rad/s; loss of stability to 1e-2, for the touch is short."""
    for kind, tolerance in (
        ("fold", 1e-4), ("contact begin", 1e-8), ("contact end", 1e-4),
        ("Neimark-Sacker", 1e-2), ("period doubling", 1e-2),
    ):  # fmt: skip
        close(kind, omegas(balance, kind), omegas(shooting, kind), abs=tolerance)
