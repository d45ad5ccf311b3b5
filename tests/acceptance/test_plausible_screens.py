"""Plausible screens get an answer, and event-located integration confirms it.

Sized-down twin of benchmarks/plausible_screens.py.
"""

from __future__ import annotations

import pytest

import flipflow as ff
from judge import close
from reference import integrate

pytestmark = [pytest.mark.numerical, pytest.mark.slow]
SEED, SCREENS = 1508, 6  # one of each kind
RPM = 0.10471975511965977


@pytest.fixture(scope="module")
def draws(script):
    return script("plausible_draw")


@pytest.fixture(scope="module")
def once_refused():
    """A screen of 630 rpm that once had no motion at working speed, and 609.5 to 609.7 rpm."""
    return ff.FlipFlowScreen(
        main_mass=930.0, floating_mass=190.0, eccentric_moment=0.74,
        isolation_stiffness=410e3, isolation_damping=42e3,
        shear_stiffness=850e3, shear_damping=580.0,
        clearance=2.3e-3, stop_stiffness=3e6, stop_damping=23e3,
    )  # fmt: skip


@pytest.mark.parametrize("method", [None, ff.HarmonicBalance(7)])
def test_a_screen_that_was_refused_has_its_speeds_and_its_motion(once_refused, method):
    region = ff.operating_region(once_refused, method=method)
    assert region.branch.complete
    ((low, high),) = region.feasible
    close("allowed speeds in rpm", [low / RPM, high / RPM], [609.5, 825.7], abs=0.1)
    (orbit,) = region.branch.orbits_at(630.0 * RPM)
    assert orbit.stable
    close("amplitude", orbit.amplitude("relative"), 2.416e-3, abs=1e-6)
    (found,) = ff.periodic_orbits(once_refused, 630.0 * RPM)
    close("the motion a search finds", found.amplitude("relative"), 2.416e-3, abs=1e-6)


def test_the_machine_runs_into_that_motion(once_refused):
    """From rest, by scipy alone."""
    machine, omega = integrate.Machine.of(once_refused.system()), 630.0 * RPM
    turn = 2.0 * 3.141592653589793 / omega
    z = integrate.flow(machine, [0.0] * 4, omega, 0.0, 60 * turn, rtol=1e-9).final
    run = integrate.flow(machine, z, omega, 0.0, turn)
    got = integrate.amplitude(run, once_refused.system().coordinate("relative"), 0.0, turn)
    close("amplitude", got, 2.416e-3, abs=2e-6)


@pytest.mark.parametrize("number", range(SCREENS))
def test_what_is_told_of_a_plausible_screen_is_so(draws, number):
    record = draws.examine(SEED, number)
    assert draws.wrong(record) == [], record
