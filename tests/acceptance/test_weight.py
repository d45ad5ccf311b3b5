"""The weight of the floating frame shifts the gaps: row 34 of the trusted values, by two routes."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

import flipflow as ff
from judge import close

pytestmark = pytest.mark.numerical
RPM = 30.0 / math.pi
G, ANGLE = 9.80665, math.radians(15.0)


@pytest.fixture(scope="module")
def drawn() -> ff.FlipFlowScreen:
    return ff.load("ffs0827").replace(clearance_measured="drawn")


def hanging(screen: ff.FlipFlowScreen) -> ff.MechanicalSystem:
    """The same machine with its weight as a constant force, from unstressed springs."""
    bare = screen.replace(clearance_measured="standing").system()
    weight = -G * math.sin(ANGLE) * np.array([screen.main_mass, screen.floating_mass])
    return ff.MechanicalSystem(
        bare.M, bare.C, bare.K, bare.springs, bare.excitation, bare.coordinates, weight
    )


def test_row_34(drawn) -> None:
    """The weight of the floating frame on a deck of 15 degrees shifts the gaps."""
    close("shift", drawn.gap_shift, 0.29142e-3, abs=1e-8)
    branch = ff.frequency_response(drawn, (60.0, 100.0))
    begins = {p.side: p.omega * RPM for p in branch.special_points if p.kind == "contact begin"}
    close("contact begins", [begins[1], begins[-1]], [764.83, 807.57], abs=0.01)
    doubled = [p.omega * RPM for p in branch.special_points if p.kind == "period doubling"]
    close("period doubling", doubled, [774.14, 787.90], abs=0.01)
    force = branch.orbits_at(850.0 / RPM)[0].stop_force()
    close("stop forces", [force.max(), force.min()], [9670.0, -4420.0], abs=10.0)


def test_shifted_gaps_are_a_constant_force(drawn) -> None:
    """Gaps from where the machine hangs, or a constant force from where it is unstressed."""
    system = hanging(drawn)
    rest = system.static_position()
    close("rest", rest @ [1.0, -1.0], drawn.gap_shift, rel=1e-12)
    ours, theirs = (ff.frequency_response(m, (60.0, 100.0)) for m in (drawn, system))
    for speed in (78.0, 82.0, 95.0):
        mine, its = (b.orbits_at(speed)[0] for b in (ours, theirs))
        t = np.linspace(0.0, mine.period, 50)
        for which in ("main", "floating"):
            offset = system.coordinate(which) @ rest
            close("motion", its.displacement(which, t) - offset, mine.displacement(which, t),
                  abs=1e-11)  # fmt: skip


def test_standing_gaps_shift_by_what_is_carried() -> None:
    """The empty machine is even; what is carried hangs on the shear springs either way."""
    screen = ff.load("ffs0827")
    assert screen.gap_shift == 0.0
    assert screen.system().symmetric
    load = ff.Load(floating_mass=32.4, stiffness_factor=1.3)
    extra = 32.4 * G * math.sin(ANGLE) / (1.3 * 2.7e6)
    close("standing", screen.loaded(load).gap_shift, extra, rel=1e-12)
    drawn = screen.replace(clearance_measured="drawn")
    close("drawn", drawn.loaded(load).gap_shift, drawn.gap_shift + extra, rel=1e-12)
    assert screen.loaded(ff.Load(stiffness_factor=1.3)).system().symmetric
    level = screen.replace(deck_angle=None)
    assert level.loaded(load).gap_shift == 0.0
    assert not level.weight_considered


def test_contact_closed_at_rest() -> None:
    """Where the weight alone closes the gap the machine runs on its stop."""
    screen = ff.load("ffs0827").replace(clearance_measured="drawn", clearance=0.2e-3)
    assert screen.stop().gaps[0] < 0.0
    branch = ff.frequency_response(screen, (20.0, 120.0))
    assert branch.complete, branch.status


def test_a_stop_that_pulls_is_no_touch_of_the_other() -> None:
    """The damper of one stop pulls before it lets go; the other one is never touched."""
    screen = ff.load("ffs0827").replace(clearance_minus=9e-3, stop_damping=30e3)
    project = dataclasses.replace(
        ff.load_project("ffs0827"), screen=screen, load_cases=(ff.Load(),), speed=85.0
    )
    (case,) = ff.assess(project).cases
    assert case.orbit is not None
    assert {one.side for one in case.orbit.contact_intervals} == {1}
    assert case.orbit.stop_force().min() < -1e3
    assert case.gaps.force_minus == 0.0
    close("other side", case.gaps.force_plus, case.orbit.stop_force_peak(), rel=1e-12)
