"""Motion in time at constant speed: against DOP853, with disturbances, with its energies."""

from __future__ import annotations

import math
from dataclasses import replace
from importlib import resources
from typing import get_args

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flipflow as ff
from flipflow.model.contact_law import ContactLaw
from reference import integrate

pytestmark = pytest.mark.numerical
TURN = 2.0 * math.pi / 120.0
BLOWS = (
    ff.Impulse(10.3 * TURN, "main", 200.0),
    ff.LoadStep(20.21 * TURN, ff.Load(stiffness_factor=1.3, main_mass=30.0)),
    ff.Lump(30.77 * TURN, "floating", 15.0, velocity=1.0),
    ff.Impulse(41.1 * TURN, "relative", -50.0),
)


@pytest.fixture(scope="module")
def screen() -> ff.FlipFlowScreen:
    return ff.load("ffs0827")


def reference_run(screen, periods: float, blows=()) -> np.ndarray:
    """State after ``periods`` by event-located DOP853, disturbances worked out by hand.

    What is carried hangs on the springs: a constant force that holds the machine where it sinks to.
    """
    z, t, end, sunk = np.zeros(4), 0.0, periods * TURN, np.zeros(2)
    fall = 9.80665 * math.sin(screen.deck_angle)
    for blow in (*blows, None):
        until = end if blow is None else blow.t
        system = screen.system()
        machine = replace(integrate.Machine.of(system), static=system.K @ sunk)
        z = integrate.flow(machine, z, 120.0, t, until).final
        t = until
        m1, m2 = screen.main_mass, screen.floating_mass
        if isinstance(blow, ff.Impulse):
            share = {"main": (1.0, 0.0), "relative": (1.0, -1.0)}[blow.which]
            z = z + blow.impulse * np.array([0.0, 0.0, share[0] / m1, share[1] / m2])
        elif isinstance(blow, ff.LoadStep):
            screen = screen.loaded(blow.load)
            carried = np.array([blow.load.main_mass, blow.load.floating_mass])
            sunk = sunk - fall * np.linalg.solve(screen.system().K, carried)
        elif isinstance(blow, ff.Lump):
            z[3] = (m2 * z[3] + blow.mass * blow.velocity) / (m2 + blow.mass)
            screen = screen.replace(floating_mass=m2 + blow.mass)
            sunk = sunk - fall * np.linalg.solve(screen.system().K, np.array([0.0, blow.mass]))
    return z


@pytest.mark.parametrize("blows", [(), BLOWS], ids=["undisturbed", "disturbed"])
def test_simulation_agrees_with_dop853_over_70_periods(screen, blows) -> None:
    """DOP853 with events at 1e-11, to 1e-9 m over 70 periods."""
    history = ff.simulate(screen, 120.0, 70, disturbances=blows)
    z = reference_run(screen, 70.0, blows)
    assert np.abs(history.x[-1] - z[:2]).max() < 1e-9
    assert np.abs(history.v[-1] - z[2:]).max() < 1e-9 * 120.0


@pytest.mark.parametrize("law", get_args(ContactLaw))
@pytest.mark.parametrize("blows", [(), BLOWS], ids=["undisturbed", "disturbed"])
def test_energy_balances(screen, law, blows) -> None:
    """Energy balances to 1e-9 with impulses and load steps in it."""
    history = ff.simulate(screen.replace(stop_law=law), 120.0, 70, disturbances=blows)
    e = history.energy
    gained = e["input"] + e["impulses"] + e["loads"]
    assert abs(gained - e["dissipated"] - e["stored"]) < 1e-9 * e["input"], dict(e)
    assert (e["impulses"] != 0.0) == bool(blows)


def test_energy_balances_where_a_blow_makes_a_clipped_stop_take_hold() -> None:
    """Compressed by 0.1 m, but moving out too fast to be pushed; the blow turns it round."""
    stop = ff.ClearanceSpring([1.0], 100.0, 50.0, 0.1, math.inf, "compression-only")
    system = ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], (stop,), ff.HarmonicForce([0.1]))
    blow = ff.Impulse(1e-3, 0, 2.0)
    run = ff.simulate(system, 1.0, 1, (0.2, -1.0), (blow,), t=[0.0, 0.5e-3, 2e-3, 6.0])
    assert run.stop_force()[:2] == pytest.approx([0.0, 0.0])
    assert run.stop_force()[2] > 50.0
    energy = run.energy
    given = energy["input"] + energy["impulses"] + energy["loads"]
    assert given == pytest.approx(energy["dissipated"] + energy["stored"], abs=1e-9)


def test_settles_on_the_exact_orbit(screen) -> None:
    history = ff.simulate(screen, 120.0, 200)
    exact = ff.frequency_response(screen, (100.0, 130.0)).orbits_at(120.0)[0]
    assert history.settled
    assert history.distance < 1e-12
    assert np.abs(np.concatenate([history.x[-1], history.v[-1]]) - exact.state).max() < 1e-9


def test_not_settled_says_how_far(screen) -> None:
    history = ff.simulate(screen, 120.0, 20)
    assert history.settled is False
    exact = ff.frequency_response(screen, (100.0, 130.0)).orbits_at(120.0)[0]
    gap = np.concatenate([history.x[-1], history.v[-1] / 120.0])
    gap -= np.concatenate([exact.state[:2], exact.state[2:] / 120.0])
    assert history.distance == pytest.approx(np.abs(gap).max(), rel=1e-9)


def test_a_motion_of_two_turns_is_read_over_both(screen, command, tmp_path) -> None:
    """Read over the last turn it was told another amplitude than the list of motions has."""
    uneven, speed = screen.replace(clearance=0.0, clearance_minus=6e-3), 110.849
    history = ff.simulate(uneven, speed, 400)
    assert (history.settled, history.repeats_after) == (True, 2)
    orbit = next(o for o in ff.periodic_orbits(uneven, speed, 2) if o.stable)
    text = (resources.files("flipflow") / "io" / "machines" / "ffs0827.toml").read_text()
    file = tmp_path / "uneven.toml"
    gaps = 'clearance = "0 mm"\nclearance_minus = "6 mm"'
    file.write_text(text.replace('clearance = "6 mm"', gaps))
    code, out, _ = command("simulate", file, "--speed", f"{speed} rad/s", "--periods", 400)
    assert code == 0
    assert "which repeats after 2 turns" in out
    assert "last 2 turns" in out
    line = next(line for line in out.splitlines() if line.split()[:1] == ["relative"])
    assert float(line.split()[1]) == pytest.approx(1e3 * orbit.amplitude("relative"), abs=1e-3)
    assert ff.simulate(screen, 120.0, 20).repeats_after == 1


def test_times_asked_for_do_not_change_the_motion(screen) -> None:
    every = ff.simulate(screen, 150.0, 10)
    t = np.sort(np.random.default_rng(1).uniform(0.0, 10 * 2 * math.pi / 150.0, 50))
    some = ff.simulate(screen, 150.0, 10, t=t)
    x = np.array([np.interp(t, every.t, every.x[:, k]) for k in range(2)]).T
    assert np.abs(some.x - x).max() < 1e-4
    derivative = np.gradient(every.x[:, 0], every.t)
    assert np.abs(derivative - every.v[:, 0]).max() < 0.05


def test_contact_forces_act_beyond_the_gap_only(screen) -> None:
    history = ff.simulate(screen, 150.0, 40)
    y = history.displacement("relative")
    force = history.stop_force()
    assert (force[np.abs(y) < 6e-3] == 0.0).all()
    assert (force[np.abs(y) > 6.001e-3] != 0.0).all()
    assert history.events
    touched = history.events[-1]
    k = int(np.searchsorted(history.t, touched.t))
    assert abs(abs(np.interp(touched.t, history.t, y)) - 6e-3) < 2e-5, (k, touched)


def test_normal_direction_reaches_its_closed_form(screen) -> None:
    """y of (m1 + m2) y'' + c1n y' + k1n y = m0r w^2 sin(w t), after the start has died out."""
    history = ff.simulate(screen, 90.0, 400)
    m, k, c = 1226.0, 630e3, 9866.0
    Y = -1j * 4.16825 * 90.0**2 / (k - m * 90.0**2 + 1j * c * 90.0)
    assert history.normal[-1, 0] == pytest.approx(Y.real, rel=1e-9)
    assert history.normal[-1, 1] == pytest.approx((1j * 90.0 * Y).real, rel=1e-9)


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"omega": -5.0}, "omega"),
        ({"periods": 0}, "periods"),
        ({"periods": 10**9}, "periods"),
        ({"initial": "asleep"}, "initial"),
        ({"t": [2.0, 1.0]}, "t"),
        ({"t": [0.0, 1e9]}, "t"),
        ({"disturbances": (ff.Impulse(1e6, "main", 1.0),)}, "disturbances"),
    ],
)
def test_bad_simulations_are_refused(screen, arguments, field) -> None:
    given = {"omega": 120.0, "periods": 10} | arguments
    with pytest.raises(ff.InputError, match=field):
        ff.simulate(screen, **given)


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: ff.Impulse(1.0, "main", 1e12), "impulse"),
        (lambda: ff.Impulse(-1.0, "main", 1.0), "t"),
        (lambda: ff.Lump(1.0, "deck", 1.0), "frame"),
        (lambda: ff.Lump(1.0, "main", 0.0), "mass"),
        (lambda: ff.Lump(1.0, "main", 1.0, velocity=math.inf), "velocity"),
    ],
)
def test_absurd_disturbances_are_refused(make, field) -> None:
    with pytest.raises(ff.InputError, match=field):
        make()


def test_loads_need_a_screen(screen) -> None:
    with pytest.raises(ff.InputError, match="screen"):
        ff.simulate(
            screen.system(), 120.0, 10, disturbances=(ff.LoadStep(0.1, ff.Load(main_mass=1.0)),)
        )


def test_without_damping_nothing_settles(screen) -> None:
    """Its motion is that of DOP853, and no periodic motion is said to be near."""
    bare = screen.replace(isolation_damping=0.0, shear_damping=0.0)
    history = ff.simulate(bare, 120.0, 10)
    back = integrate.flow(integrate.Machine.of(bare.system()), np.zeros(4), 120.0, 0.0, 10 * TURN)
    assert np.abs(history.x[-1] - back.final[:2]).max() < 1e-9
    assert history.distance is None
    assert not history.settled


def test_the_document_of_many_turns_is_thinned_and_says_so(command, monkeypatch, tmp_path):
    """What is shown and drawn is of all times; of a document every k-th is kept, k odd."""
    monkeypatch.setattr("flipflow.cli.simulate.MOST_ROWS", 1000)
    code, out, _ = command(
        "simulate", "ffs0827", "--periods", "100", "--json", str(tmp_path / "thin.json")
    )
    assert code == 0
    assert "The document is thinned. Of 12801 calculated times one in 13 is kept." in " ".join(
        out.split()
    )
    thin = ff.open_result(tmp_path / "thin.json")
    whole = ff.simulate(ff.load("ffs0827"), ff.load_project("ffs0827").speed, 100)
    assert thin.notes == ("Of 12801 calculated times one in 13 is kept.",)
    assert thin.t.size <= 1000
    assert thin.t[-1] == whole.t[-1]
    np.testing.assert_array_equal(thin.x[:-1], whole.x[:-1:13])
    assert thin.energy == whole.energy
    assert thin.events == whole.events


def test_a_document_of_usual_length_is_whole(command, tmp_path):
    command("simulate", "ffs0827", "--periods", "20", "--json", str(tmp_path / "whole.json"))
    whole = ff.open_result(tmp_path / "whole.json")
    assert (whole.t.size, whole.notes) == (20 * 128 + 1, ())


def chain_at_a_stop(law: ContactLaw, phase: float, gap: float) -> ff.MechanicalSystem:
    """Five masses in a row, the last one driven, the first one beside a stop."""
    K = 2.0 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1)
    K[4, 4] = 1.0
    stop = ff.ClearanceSpring([1.0, 0.0, 0.0, 0.0, 0.0], 5.0, 0.1, gap, math.inf, law=law)
    force = ff.HarmonicForce([0.0, 0.0, 0.0, 0.0, np.exp(1j * phase)])
    return ff.MechanicalSystem(np.eye(5), 0.05 * K, K, [stop], force)


@pytest.mark.parametrize("law", get_args(ContactLaw))
@pytest.mark.parametrize("phase", [0.0, 0.5 * math.pi, 2.0])
def test_from_rest_at_a_stop_the_first_derivative_that_moves_it_decides(law, phase) -> None:
    """At first y is a tenth power of time, far below rounding: as with a gap of 1e-9 beside it."""
    times = np.linspace(0.0, 30.0, 61)
    at, apart = (
        ff.simulate(chain_at_a_stop(law, phase, gap), 1.3, 7, t=times) for gap in (0.0, 1e-9)
    )
    assert np.abs(at.x - apart.x).max() < 1e-7
    assert ff.sweep(chain_at_a_stop(law, phase, 0.0), [1.3]).words == ("periodic",)


def test_from_rest_at_a_stop_as_dop853_tells() -> None:
    """Steps of 5 ms at most, no events: the force of the paper's law jumps by c v, v nearly 0."""
    machine = chain_at_a_stop("paper", 0.0, 0.0)
    (stop,) = machine.springs

    def slope(t, z):
        x, v = z[:5], z[5:]
        contact = stop.stiffness * x[0] + stop.damping * v[0] if x[0] > 0.0 else 0.0
        force = machine.excitation.vector.real * math.cos(1.3 * t) - machine.C @ v - machine.K @ x
        return np.concatenate([v, force - contact * stop.direction])

    told = ff.simulate(machine, 1.3, 5, t=[0.0, 20.0]).x[-1]
    run = solve_ivp(
        slope, (0.0, 20.0), np.zeros(10), "DOP853", rtol=1e-9, atol=1e-12, max_step=5e-3
    )
    assert np.abs(told - run.y[:5, -1]).max() < 1e-6
