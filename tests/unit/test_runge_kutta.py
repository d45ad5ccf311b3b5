"""Event-located Runge-Kutta: tableaux, order across contacts, the shaft's equation."""

from __future__ import annotations

import dataclasses
import itertools
import math
from fractions import Fraction
from types import SimpleNamespace
from typing import get_args

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flipflow as ff
from flipflow.dynamics.normal import NormalDirection
from flipflow.errors import InputError
from flipflow.model.contact_law import ContactLaw
from flipflow.model.drive import Drive, Motor, SpeedProfile
from flipflow.model.elements import ClearanceSpring
from flipflow.model.excitation import HarmonicForce, Unbalance
from flipflow.model.system import MechanicalSystem
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.transient.run_up import top_between_steps
from flipflow.transient.tableaux import DORMAND_PRINCE, RK4
from flipflow.transient.time_stepping import RungeKutta, Stepper
from judge import close

pytestmark = pytest.mark.numerical
OMEGA = 120.0
TURN = 2.0 * np.pi / OMEGA


def trees(order):
    """Elementary weights of all rooted trees of an order, each with its density."""
    if order == 1:
        return [(lambda _a, u: u, 1)]
    found = []
    for parts in partitions(order - 1):
        for branches in choices(parts):
            density = order * math.prod(d for _, d in branches)

            def weight(a, u, branches=branches):
                value = u
                for one, _ in branches:
                    inner = apply(a, one(a, u))
                    value = [x * y for x, y in zip(value, inner, strict=True)]
                return value

            found.append((weight, density))
    return found


def partitions(total, largest=None):
    if total == 0:
        yield ()
    for part in range(min(total, largest or total), 0, -1):
        for rest in partitions(total - part, part):
            yield (part, *rest)


def choices(parts):
    """All ways to take one tree of each order; a tree taken twice in another order is harmless."""
    if not parts:
        return [()]
    return [(one, *rest) for one in trees(parts[0]) for rest in choices(parts[1:])]


def apply(a, values):
    return [sum(x * y for x, y in zip(row, values, strict=False)) for row in a]


@pytest.mark.parametrize(
    ("tableau", "nodes"), [(RK4, "0 1/2 1/2 1"), (DORMAND_PRINCE, "0 1/5 3/10 4/5 8/9 1")]
)
def test_tableau_rows_sum_to_the_nodes_of_the_papers(tableau, nodes):
    assert [sum(row, Fraction(0)) for row in tableau.a] == [*map(Fraction, nodes.split())]
    assert sum(tableau.b) == 1


@pytest.mark.parametrize("tableau", [RK4, DORMAND_PRINCE])
def test_tableau_meets_every_order_condition(tableau):
    """b . weight(tree) = 1 / density for every rooted tree up to the order: 8 and 17 of them."""
    ones = [Fraction(1)] * len(tableau.b)
    for order in range(1, tableau.order + 1):
        for weight, density in trees(order):
            value = sum(b * w for b, w in zip(tableau.b, weight(tableau.a, ones), strict=True))
            assert value == Fraction(1, density)
    beyond = [
        sum(b * w for b, w in zip(tableau.b, weight(tableau.a, ones), strict=True)) - 1 / density
        for weight, density in trees(tableau.order + 1)
    ]
    assert any(abs(value) > 1e-6 for value in beyond)


def test_error_weights_are_of_order_four():
    """The pair's difference vanishes for every tree up to order 4, and not for all of order 5."""
    rows = (*DORMAND_PRINCE.a, DORMAND_PRINCE.b)
    ones = [Fraction(1)] * 7

    def differences(order):
        for weight, _ in trees(order):
            weights = weight(rows, ones)
            yield sum(e * w for e, w in zip(DORMAND_PRINCE.error, weights, strict=True))

    assert all(value == 0 for order in range(1, 5) for value in differences(order))
    assert any(value != 0 for value in differences(5))


@pytest.fixture(scope="module", params=get_args(ContactLaw))
def shaken(request, screen):
    """A motion with contacts that is not periodic, and where the exact flow takes it in 2 turns."""
    system = screen.replace(stop_law=request.param).system()
    solver = ExactSolver(system, half_turn=False)
    start = solver.settled(np.zeros(4), OMEGA, 300) + np.array([1e-3, 0.0, 0.1, 0.0])
    return system, start, solver.settled(start.copy(), OMEGA, 2)


def missed(system, start, end, method):
    """Distance in m from the exact end, velocities over omega; and the events met."""
    profile = SpeedProfile((0.0, 1.0), (OMEGA, OMEGA))
    stepper = Stepper(system, profile, start, method=method, fastest=OMEGA)
    for _ in stepper.run(2.0 * TURN):
        pass
    error = np.abs((stepper.walk.s[:4] - end) / [1.0, 1.0, OMEGA, OMEGA]).max()
    return error, stepper.counters


@pytest.mark.parametrize(("formula", "least", "counts"), [
    ("rk4", 3.7, (100, 200, 400, 800)),
    ("dopri5", 4.7, (25, 50, 100, 200)),
])  # fmt: skip
def test_order_across_contacts(shaken, formula, least, counts):
    """The observed order of RK4 is at least 3.7; of the 5(4) pair likewise 4.7."""
    errors = [missed(*shaken, RungeKutta(formula, step=TURN / n))[0] for n in counts]
    slope = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert slope >= least, (slope, errors)


def test_tolerance_steers_the_error(shaken):
    errors = []
    for tolerance in (1e-6, 1e-8, 1e-10, 1e-12):
        error, counters = missed(*shaken, RungeKutta(tolerance=tolerance))
        assert error < 1e-1 * tolerance
        assert counters["events"] >= 8
        errors.append(error)
    assert all(b < 0.1 * a for a, b in itertools.pairwise(errors))


def test_a_touch_within_one_step_is_not_missed():
    """A mass on a weak spring touches a stiff stop: no end of a step lies within the touch.

    From x = 0 at unit speed the free motion tops at 1: beyond a gap 0.05 % below for 0.06 s.
    """
    stop = ClearanceSpring([1.0], 1e3, 0.0, 0.9995, np.inf)
    system = MechanicalSystem([[1.0]], [[1e-9]], [[1.0]], [stop], HarmonicForce([1e-12]))
    profile = SpeedProfile((0.0, 1.0), (1.0, 1.0))
    for step in (0.25, 0.3, 0.35, 0.45):
        stepper = Stepper(
            system, profile, np.array([0.0, 1.0]), fastest=1.0, method=RungeKutta("rk4", step=step)
        )
        for _ in stepper.run(np.pi):
            pass
        assert stepper.counters["events"] == 2, step


def test_sliding_speed_against_an_independent_integration(screen):
    """No contact; force m0r (phi'^2 cos phi + phi'' sin phi) written out, by DOP853."""
    free = screen.replace(clearance=math.inf)
    system, rate = free.system(), 7.0
    m0r = screen.eccentric_moment

    def slope(t, z):
        phi, speed = 0.5 * rate * t * t, rate * t
        force = m0r * (speed**2 * math.cos(phi) + rate * math.sin(phi))
        a = np.linalg.solve(system.M, [force, 0.0] - system.C @ z[2:] - system.K @ z[:2])
        return [*z[2:], *a]

    there = solve_ivp(slope, (0.0, 6.0), np.zeros(4), method="DOP853", rtol=1e-11, atol=1e-14)
    profile = SpeedProfile((0.0, 6.0), (0.0, 6.0 * rate))
    stepper = Stepper(
        system, profile, np.zeros(4), method=RungeKutta(tolerance=1e-11), fastest=6.0 * rate
    )
    for _ in stepper.run(6.0):
        pass
    assert stepper.walk.s[4] == pytest.approx(0.5 * rate * 36.0, rel=1e-12)
    assert np.abs(stepper.walk.s[:2] - there.y[:2, -1]).max() < 1e-10


def test_shaft_and_frames_solve_lagranges_equations_together(screen):
    """[M -q; -q^T J] (a, phi'') = (p phi'^2 - C v - K x - d H, T - T_f), written out and solved."""
    motor = Motor(rated_power=3000.0, synchronous_speed=157.0)
    drive = Drive(inertia=0.5, motor=motor, ratio=1.5, friction=3.0, viscous_friction=0.02)
    normal = NormalDirection(1226.0, 630e3, 9866.0, 1.0)
    state = np.array([3e-3, -5e-3, 2e-3, 0.4, -0.3, 0.2])
    angle, speed, m0r = 0.7, 60.0, screen.eccentric_moment
    stepper = Stepper(
        screen.system(), drive, state, angle=angle, speed=speed, normal=normal, fastest=100.0
    )
    found = stepper.walk.rate[0]
    cos, sin = math.cos(angle), math.sin(angle)
    m1, m2 = screen.main_mass, screen.floating_mass
    q = np.array([m0r * sin, 0.0, -m0r * cos])
    H = screen.stop().force(state[0] - state[1], state[3] - state[4])
    shear = screen.shear_stiffness * 8e-3 + screen.shear_damping * 0.7 + float(H)
    forces = [
        m0r * speed**2 * cos - 9866.0 * 0.4 - 630e3 * 3e-3 - shear,
        shear,
        m0r * speed**2 * sin - 9866.0 * 0.2 - 630e3 * 2e-3,
        float(drive.torque(speed)) - float(drive.friction_torque(speed)),
    ]
    A = np.diag([m1, m2, m1 + m2, drive.inertia])
    A[:3, 3] = A[3, :3] = -q
    expected = np.linalg.solve(A, forces)
    assert found[3:6] == pytest.approx(expected[:3], rel=1e-12)
    assert found[7] == pytest.approx(expected[3], rel=1e-12)


def test_phase_of_the_unbalance_turns_the_force():
    """vector i m0r: a quarter of a turn ahead of m0r, at any speed."""

    def end(vector, angle):
        system = MechanicalSystem([[2.0]], [[0.3]], [[50.0]], (), Unbalance([vector]))
        stepper = Stepper(
            system, SpeedProfile((0.0, 3.0), (2.0, 9.0)), np.zeros(2), angle=angle, fastest=9.0
        )
        for _ in stepper.run(3.0):
            pass
        return stepper.walk.s[:2].copy()

    assert end(0.01j, 0.0) == pytest.approx(end(0.01, np.pi / 2.0), rel=1e-9)


def test_clipped_stop_keeps_the_books(screen):
    """Compression-only: what goes in is stored or dissipated, through release and re-entry too."""
    system = screen.replace(stop_law="compression-only", stop_damping=3e4).system()
    profile = SpeedProfile((0.0, 1.0), (0.0, 110.0))
    stepper = Stepper(
        system, profile, np.zeros(4), method=RungeKutta(tolerance=1e-10), fastest=110.0
    )
    parts = [part for part in stepper.run(1.5) if part.t.size]
    last = parts[-1]
    stored = stepper.stored_energy(last.states[-1], last.contacts[-1])
    given, taken = last.states[-1, -3], last.states[-1, -2]
    assert stepper.counters["events"] > 20
    assert given == pytest.approx(taken + stored, rel=1e-7)


@pytest.mark.parametrize(("change", "word"), [
    ({"inertia": -1.0}, "inertia"), ({"inertia": math.inf}, "inertia"), ({"ratio": 0.0}, "ratio"),
    ({"friction": -1.0}, "friction"), ({"viscous_friction": math.nan}, "viscous_friction"),
])  # fmt: skip
def test_bad_drives_are_refused(change, word):
    drive = Drive(inertia=1.0)
    with pytest.raises(InputError, match=word):
        dataclasses.replace(drive, **change)


@pytest.mark.parametrize("values", [
    {"rated_power": 1e3, "breakdown_torque": 10.0}, {}, {"rated_power": -1.0},
    {"rated_power": 1e3, "breakdown_slip": 1.0}, {"rated_power": 1e3, "breakdown_ratio": 1.0},
    {"breakdown_torque": math.inf}, {"rated_power": 1e3, "synchronous_speed": 0.0},
])  # fmt: skip
def test_bad_motors_are_refused(values):
    with pytest.raises(InputError):
        Motor(**{"synchronous_speed": 157.0, **values})


@pytest.mark.parametrize(("times", "speeds"), [
    ((0.0, 1.0, 1.0), (0.0, 1.0, 2.0)), ((1.0, 0.0), (0.0, 1.0)), ((0.0, math.inf), (0.0, 1.0)),
    ((0.0, 1.0), (0.0, -1.0)), ((0.0, 1.0), (0.0, math.nan)), ((0.0,), (1.0,)),
    ((0.0, 1.0), (0.0, 0.0)), ((0.0, 1.0), (1.0,)),
])  # fmt: skip
def test_bad_profiles_are_refused(times, speeds):
    with pytest.raises(InputError):
        SpeedProfile(times, speeds)


def test_motor_curve():
    """Kloss: T_b at s_b, no torque at synchronous speed, rated torque at rated power's speed."""
    motor = Motor(rated_power=5500.0, synchronous_speed=157.08, breakdown_ratio=2.8)
    at_breakdown = motor.synchronous_speed * (1.0 - motor.breakdown_slip)
    assert motor.torque(at_breakdown) == pytest.approx(motor.largest_torque)
    assert motor.torque(motor.synchronous_speed) == 0.0
    assert motor.torque(motor.rated_speed) * motor.rated_speed == pytest.approx(5500.0)
    grid = motor.torque(np.linspace(0.0, motor.synchronous_speed, 1001))
    assert grid.max() <= motor.largest_torque * (1.0 + 1e-12)
    assert motor.power == pytest.approx(5500.0)


def test_inertia_below_the_unbalance_is_refused(screen):
    with pytest.raises(InputError, match="inertia"):
        Stepper(screen.system(), Drive(inertia=0.01), np.zeros(4), fastest=90.0)


def test_a_motor_turns_an_unbalance_only():
    system = MechanicalSystem([[1.0]], [[0.1]], [[1.0]], (), HarmonicForce([1.0]))
    with pytest.raises(InputError, match="SpeedProfile"):
        Stepper(system, Drive(inertia=1.0), np.zeros(2), fastest=1.0)


def test_public_names():
    assert ff.Motor is Motor
    assert ff.Drive is Drive
    assert ff.SpeedProfile is SpeedProfile


@pytest.mark.parametrize("event", [2.05, 2.15, 2.4])
def test_a_peak_beside_an_event_is_the_top_between_steps(event: float) -> None:
    """A force with its top, 1 at 2.1, on either side of an event, where its slope changes."""
    t = np.sort(np.concatenate([np.arange(0.25, 4.0, 0.5), [event, event]]))
    after = np.arange(t.size) > int(np.flatnonzero(t == event)[0])
    side = 1.0 if event < 2.1 else -1.0
    smooth = 1.0 - (t - 2.1) ** 2
    beyond = (after == (side < 0.0)) & (t != event)
    force = np.where(beyond, smooth - 2.0 * np.abs(t - event), smooth)
    found = top_between_steps(SimpleNamespace(t=t, omega=10.0 * t), force)
    close("peak", [found.value, found.t, found.omega], [1.0, 2.1, 21.0], rel=1e-12)


def test_a_peak_is_not_sought_between_rows_that_are_as_one() -> None:
    t, force = np.array([1.0, 1.0 + 2.3e-16, 1.001]), np.array([1.0, 1.0 + 1e-9, 0.999])
    found = top_between_steps(SimpleNamespace(t=t, omega=10.0 * t), force)
    assert found.value == force[1]
