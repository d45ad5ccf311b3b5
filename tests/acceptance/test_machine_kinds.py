"""What a machine may be: constant forces, preloads, several excitations, any C and K, free motions.

Motions are held against event-located integration by DOP853, from the same state.
"""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
import scipy.sparse
from scipy.optimize import minimize

import flipflow as ff
from judge import close
from reference import integrate

pytestmark = pytest.mark.numerical
LAWS = ("paper", "compression-only", "undamped-rebound", "elasto-gap")
SHARE = 1e-8  # of the motion's size, within which it is DOP853's
ONE_SIDED = math.inf


def check_turn(machine: ff.MechanicalSystem, orbit: ff.Orbit) -> None:
    """One period from the orbit's state, and back."""
    path = integrate.flow(
        integrate.Machine.of(machine), orbit.state, orbit.omega, 0.0, orbit.period
    )
    t = np.linspace(0.0, orbit.period, 61)
    x = np.stack([orbit.displacement(i, t) for i in range(machine.size)], axis=1)
    size = np.abs(x).max()
    close("displacements", x, path(t)[:, : machine.size], abs=SHARE * size)
    close("back", path.final[: machine.size], orbit.state[: machine.size], abs=SHARE * size)


def chain(seed: int, law: str) -> tuple[ff.MechanicalSystem, float]:
    """A machine of 1 to 4 masses with every kind of force and coupling, and a speed."""
    rng = np.random.default_rng([10, seed])
    n = int(rng.integers(1, 5))
    L = np.tril(rng.normal(size=(n, n)), -1) * 0.3 + np.eye(n)
    M, K = L @ np.diag(10.0 ** rng.uniform(-0.5, 0.5, n)) @ L.T, L @ L.T * 3.0
    turn = rng.normal(size=(n, n))
    C, K = 0.1 * K + 0.3 * (turn - turn.T), K + 0.2 * (turn - turn.T)
    stops = []
    for _ in range(int(rng.integers(1, 4))):
        d = np.round(rng.normal(size=n), 2)
        d[int(rng.integers(n))] += 1.0
        gap = rng.choice([-0.2, 0.1, 0.3])
        minus = rng.choice([0.25, 0.4, math.inf])
        k, c = 10.0 ** rng.uniform(0.5, 2.0), rng.uniform(0.0, 1.0)
        stops.append(ff.ClearanceSpring(d, k, c, gap, minus, law=law))
    phase = np.exp(2j * np.pi * rng.uniform(size=(3, n)))
    forces = (
        ff.HarmonicForce(0.5 * phase[0]),
        ff.Unbalance(0.1 * phase[1], order=int(rng.integers(1, 4))),
        ff.MovingBase(0.3 * phase[2, 0], rng.uniform(0, 1, n), rng.uniform(0, 0.1, n), order=2),
    )[: int(rng.integers(1, 4))]
    static = rng.normal(size=n) if rng.uniform() < 0.7 else None
    return ff.MechanicalSystem(M, C, K, stops, forces, static_force=static), rng.uniform(0.5, 2.5)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("seed", range(6))
def test_motions_through_time(seed: int, law: str) -> None:
    """From rest, and with the balance of energies, whatever the machine."""
    machine, omega = chain(seed, law)
    history = ff.simulate(machine, omega=omega, periods=2)
    z = np.concatenate([machine.static_position(), np.zeros(machine.size)])
    path = integrate.flow(integrate.Machine.of(machine), z, omega, 0.0, 4.0 * np.pi / omega)
    states = np.concatenate([history.x, history.v / omega], axis=1)
    expected = path(history.t) / np.repeat([1.0, omega], machine.size)
    close("states", states, expected, abs=1e-7 * np.abs(states).max())
    energy = history.energy
    close("energies", energy["input"] - energy["dissipated"], energy["stored"], abs=1e-9)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("seed", range(1, 4))
def test_periodic_motions(seed: int, law: str) -> None:
    machine, omega = chain(seed, law)
    found = ff.periodic_orbits(machine, omega=omega)
    assert found
    for orbit in found[:3]:
        check_turn(machine, orbit)


@pytest.mark.parametrize("seed", range(4))
def test_branches_and_series_agree(seed: int) -> None:
    """The exact branch at a speed, and harmonic balance with many harmonics, paper's law."""
    machine, _ = chain(seed, "paper")
    branch = ff.frequency_response(machine, (2.0, 6.0))
    assert branch.complete, branch.status
    series = ff.frequency_response(machine, (2.0, 6.0), ff.HarmonicBalance(harmonics=31))
    for speed in (3.1, 5.3):
        exact, near = (min(o.amplitude(0) for o in b.orbits_at(speed)) for b in (branch, series))
        close(f"amplitude at {speed}", near, exact, rel=2e-3)


@pytest.mark.parametrize("seed", range(12))
def test_static_position(seed: int) -> None:
    """The least potential energy, for symmetric K; a machine stays where it rests."""
    rng = np.random.default_rng([11, seed])
    n = int(rng.integers(1, 5))
    L = rng.normal(size=(n, n))
    K = L @ L.T + 0.3 * np.eye(n)
    stops = [
        ff.ClearanceSpring(rng.normal(size=n), 10.0 ** rng.uniform(0, 2), 0.1, gap, minus)
        for gap, minus in ((-0.3, math.inf), (0.1, 0.2), (0.3, 0.05))
    ]
    machine = ff.MechanicalSystem(
        np.eye(n), 0.2 * K, K, stops, ff.HarmonicForce(np.zeros(n)), static_force=rng.normal(size=n)
    )
    x = machine.static_position()

    def energy(x: np.ndarray) -> float:
        held = 0.5 * x @ K @ x - machine.static_force @ x
        for stop in stops:
            y = stop.direction @ x
            held += 0.5 * stop.stiffness * max(y - stop.gaps[0], -stop.gaps[1] - y, 0.0) ** 2
        return float(held)

    close("position", x, minimize(energy, np.zeros(n), tol=1e-14).x, abs=1e-5)
    assert all(energy(x) <= energy(x + 1e-4 * step) for step in rng.normal(size=(50, n)))
    history = ff.simulate(machine, omega=1.0, periods=3)
    close("stays", history.x, np.tile(x, (history.t.size, 1)), abs=1e-12)


@pytest.mark.parametrize("law", LAWS)
def test_contact_closed_at_rest(law: str) -> None:
    """A constant force holds the stop shut: at low force the motion is that of one linear machine.

    x = x_0 + Re(X exp(i w t)), X = F / (k_1 + k - w^2 m + i w (c_1 + c)): closed form.
    """
    stop = ff.ClearanceSpring([1.0], 5.0, 0.2, 0.3, ONE_SIDED, law=law)
    machine = ff.MechanicalSystem(
        [[1.0]], [[0.1]], [[1.0]], [stop], ff.HarmonicForce([0.05]), static_force=[1.0]
    )
    close("rest", machine.static_position(), [2.5 / 6.0], rel=1e-12)
    branch = ff.frequency_response(machine, (0.2, 1.5))
    assert branch.complete
    if law in ("paper", "compression-only"):
        X = 0.05 / (6.0 - branch.omega**2 + 0.3j * branch.omega)
        close("amplitude", branch.amplitude(0), np.abs(X), rel=1e-9)
    check_turn(machine, branch.orbits_at(1.2)[0])


@pytest.mark.parametrize("law", LAWS)
def test_preloaded_stop(law: str) -> None:
    """A stop with a negative gap pushes at rest already, and lets go where it is unstressed."""
    stop = ff.ClearanceSpring([1.0], 5.0, 0.2, -0.3, ONE_SIDED, law=law)
    machine = ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], [stop], ff.HarmonicForce([0.5]))
    close("rest", machine.static_position(), [-0.25], rel=1e-12)
    branch = ff.frequency_response(machine, (0.3, 4.0))
    assert branch.complete, branch.status
    for speed in (0.8, 1.7, 3.0):
        check_turn(machine, branch.orbits_at(speed)[0])


def test_both_sides_preloaded_are_two_springs() -> None:
    with pytest.raises(ff.InputError, match=r"clearance.*one spring for each of two"):
        ff.ClearanceSpring([1.0], 5.0, 0.2, -0.3)
    two = [ff.ClearanceSpring([s], 5.0, 0.2, -0.3, ONE_SIDED) for s in (1.0, -1.0)]
    machine = ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], two, ff.HarmonicForce([0.5]))
    close("held by both", machine.static_position(), [0.0], abs=1e-15)
    check_turn(machine, ff.periodic_orbits(machine, omega=1.7)[0])


def test_a_moving_base_is_a_heavy_mass_that_moves() -> None:
    """(k + i w c) X against a mass of 1e9 that a force moves by X."""
    X, k, c, w = 0.3 - 0.1j, 2.0, 0.15, 1.3
    stop = ff.ClearanceSpring([1.0], 20.0, 0.3, 0.4)
    moved = ff.MechanicalSystem(
        [[1.0]], [[c + 0.1]], [[k + 1.0]], [stop], ff.MovingBase(X, [k], [c])
    )
    heavy = 1e9
    both = ff.MechanicalSystem(
        np.diag([1.0, heavy]),
        [[c + 0.1, -c], [-c, c]],
        [[k + 1.0, -k], [-k, k + 1e-3 * heavy]],
        [ff.ClearanceSpring([1.0, 0.0], 20.0, 0.3, 0.4)],
        ff.HarmonicForce([0.0, heavy * (1e-3 - w**2) * X]),
    )
    orbit = ff.periodic_orbits(moved, omega=w)[0]
    state = np.array([orbit.state[0], X.real, orbit.state[1], (1j * w * X).real])
    history = ff.simulate(both, omega=w, periods=1, initial=state)
    close("motion", history.displacement(0), orbit.displacement(0, history.t), abs=1e-7)


def test_two_frequencies_break_the_mirror_image() -> None:
    """An even multiple of omega and a constant force each tell one side from the other."""
    stop = ff.ClearanceSpring([1.0], 20.0, 0.3, 0.4)

    def machine(**forces):
        return ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], [stop], **forces)

    once, twice = ff.HarmonicForce([0.5]), ff.HarmonicForce([0.2], order=2)
    thrice = ff.HarmonicForce([0.2], order=3)
    assert machine(excitation=(once, thrice)).symmetric
    assert not machine(excitation=(once, twice)).symmetric
    assert not machine(excitation=once, static_force=[0.1]).symmetric
    for given in ((once, thrice), (once, twice)):
        branch = ff.frequency_response(machine(excitation=given), (0.7, 3.0))
        assert branch.complete, branch.status
        check_turn(machine(excitation=given), branch.orbits_at(1.5)[0])
    with pytest.raises(ff.InputError, match=r"harmonics.*3 omega"):
        ff.frequency_response(
            machine(excitation=thrice), (0.5, 3.0), ff.HarmonicBalance(harmonics=1)
        )


def gear_pair(**changes) -> ff.MechanicalSystem:
    """Relative motion of two gears in their backlash of 2, under a mean torque (Kahraman, 1990)."""
    values = {"C": [[0.1]], "K": [[0.0]], "static_force": [0.1]} | changes
    stop = ff.ClearanceSpring([1.0], 1.0, 0.0, 1.0)
    return ff.MechanicalSystem(
        [[1.0]], values["C"], values["K"], [stop], ff.HarmonicForce([0.5]),
        static_force=values["static_force"],
    )  # fmt: skip


def test_a_gear_pair_with_mean_torque() -> None:
    """Nothing holds it inside its backlash; there it drifts under the torque."""
    pair = gear_pair()
    close("rest", pair.static_position(), [1.1], rel=1e-12)
    branch = ff.frequency_response(pair, (0.3, 3.0))
    assert branch.complete, branch.status
    for omega in (0.5, 0.9, 1.5, 2.5):
        for orbit in ff.periodic_orbits(pair, omega=omega, max_periods=2):
            check_turn(pair, orbit)
    close(
        "far above",
        ff.periodic_orbits(pair, omega=2.5)[0].amplitude(0),
        0.5 / math.hypot(1.0 - 2.5**2, 0.25),
        rel=1e-9,
    )


def test_two_gears_and_a_shaft() -> None:
    """Two free rotations, one held by a shaft, the other by the teeth alone."""
    mesh = ff.ClearanceSpring([1.0, -1.0], 30.0, 0.3, 0.1)
    pair = ff.MechanicalSystem(
        np.diag([1.0, 2.0]), [[0.2, -0.1], [-0.1, 0.3]], [[0.0, 0.0], [0.0, 3.0]], [mesh],
        ff.HarmonicForce([0.5, 0.0]), static_force=[0.4, 0.0],
    )  # fmt: skip
    history = ff.simulate(pair, omega=2.0, periods=3, initial=[0.0, 0.0, 0.1, 0.0])
    path = integrate.flow(
        integrate.Machine.of(pair), np.array([0.0, 0.0, 0.1, 0.0]), 2.0, 0.0, 3.0 * np.pi
    )
    close("motion", history.x, path(history.t)[:, :2], abs=1e-8)
    for orbit in ff.periodic_orbits(pair, omega=2.0):
        check_turn(pair, orbit)


def test_only_what_nothing_ever_holds_is_refused() -> None:
    loose = ff.MechanicalSystem(
        np.eye(2), 0.1 * np.eye(2), np.zeros((2, 2)), [ff.ClearanceSpring([1.0, -1.0], 1.0)],
        ff.HarmonicForce([1.0, 0.0]),
    )  # fmt: skip
    with pytest.raises(ff.InputError, match=r"K = 'singular': nothing ever holds the machine"):
        ff.periodic_orbits(loose, omega=1.0)
    with pytest.raises(ff.InputError, match=r"C = 'singular'.*needs damping"):
        ff.simulate(gear_pair(C=[[0.0]]), omega=1.0)
    with pytest.raises(ff.InputError, match=r"static_force.*nothing holds"):
        ff.MechanicalSystem(
            [[1.0]], [[0.1]], [[0.0]], (), ff.HarmonicForce([1.0]), static_force=[1.0]
        ).static_position()
    with pytest.raises(ff.InputError, match=r"singular K.*PiecewiseExact"):
        ff.frequency_response(gear_pair(), (0.5, 1.0), ff.HarmonicBalance(harmonics=5))


def test_matrices_symmetric_to_rounding_and_sparse() -> None:
    """P.T @ M @ P, and scipy's sparse matrices, are what they mean."""
    rng = np.random.default_rng(3)
    P, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    M, K = np.diag([1.0, 2.0, 3.0]), np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 2]])
    stop = ff.ClearanceSpring(P.T @ [1.0, 0, 0], 20.0, 0.3, 0.4)
    turned = ff.MechanicalSystem(
        P.T @ M @ P, 0.05 * P.T @ K @ P, P.T @ K @ P, [stop], ff.HarmonicForce(P.T @ [0, 0, 0.5])
    )
    plain = ff.MechanicalSystem(
        scipy.sparse.csr_array(M), scipy.sparse.coo_matrix(0.05 * K), scipy.sparse.csc_matrix(K),
        [ff.ClearanceSpring([1.0, 0, 0], 20.0, 0.3, 0.4)], ff.HarmonicForce([0, 0, 0.5]),
    )  # fmt: skip
    assert np.array_equal(turned.M, turned.M.T)
    ours, expected = (ff.periodic_orbits(m, omega=0.6) for m in (turned, plain))
    assert len(ours) == len(expected)
    close(
        "amplitudes",
        [np.ptp(o.displacement(0) * P[0, 0] + o.displacement(1) * P[0, 1]
                + o.displacement(2) * P[0, 2]) for o in ours],
        [np.ptp(o.displacement(0)) for o in expected],
        rel=1e-9,
    )  # fmt: skip
    with pytest.raises(ff.InputError, match="M = 'not symmetric'"):
        ff.MechanicalSystem([[1.0, 0.1], [0.0, 1.0]], K[:2, :2], K[:2, :2], (), stop_force())


def stop_force() -> ff.HarmonicForce:
    return ff.HarmonicForce([1.0, 0.0])


def test_a_rotor_with_gyroscopic_and_cross_coupled_terms() -> None:
    """C and K that are not symmetric: whirl against four stops, its own motion by DOP853."""
    rotor = ff.MechanicalSystem(
        np.eye(2), [[0.1, 0.5], [-0.5, 0.1]], [[1.0, 0.05], [-0.05, 1.0]],
        [ff.ClearanceSpring(d, 20.0, 0.3, 0.5) for d in ((1.0, 0.0), (0.0, 1.0))],
        ff.Unbalance([0.3, -0.3j]),
    )  # fmt: skip
    branch = ff.frequency_response(rotor, (0.2, 4.0))
    assert branch.complete, branch.status
    for speed in (0.8, 1.5, 3.0):
        check_turn(rotor, branch.orbits_at(speed)[0])


def test_forces_survive_saving_pickling_and_a_parameter(tmp_path) -> None:
    machine, _ = chain(1, "paper")
    branch = ff.frequency_response(machine, (2.0, 4.0))
    ff.save(branch, tmp_path / "branch.json")
    again = ff.open_result(tmp_path / "branch.json")
    close("amplitudes", again.amplitude(0), branch.amplitude(0), rel=1e-15)
    copy = pickle.loads(pickle.dumps(machine))  # noqa: S301
    close("force", copy.force(2.0), machine.force(2.0), rel=0.0)
    orbit = branch.orbits_at(3.0)[0]
    followed = ff.continue_orbit(orbit, "forcing", (0.5, 1.0))
    assert followed.values[-1] in (0.5, 1.0)
    half = followed.orbit(len(followed.orbits) // 2)
    check_turn(half.machine.system(), half)


def test_speed_profiles_carry_every_kind_of_force() -> None:
    """At constant speed a run by Runge-Kutta is the exact flow's, up to its tolerance."""
    machine, omega = chain(5, "paper")
    exact = ff.simulate(machine, omega=omega, periods=4)
    profile = ff.SpeedProfile((0.0, 8.0 * np.pi / omega), (omega, omega))
    from flipflow.transient.time_stepping import RungeKutta, Stepper  # noqa: PLC0415

    z = np.concatenate([machine.static_position(), np.zeros(machine.size)])
    stepper = Stepper(machine, profile, z, method=RungeKutta(tolerance=1e-11), fastest=3.0 * omega)
    last = [stretch for stretch in stepper.run(8.0 * np.pi / omega) if stretch.t.size][-1]
    close("end", last.states[-1, : machine.size], exact.x[-1], abs=1e-6)


@pytest.mark.parametrize("k", [3.0, 1e6, 37.0])
def test_two_free_masses_are_refused_whatever_the_rounding(k: float) -> None:
    """Their centre of mass is held by nothing, and damped by nothing."""
    links = np.array([[1.0, -1.0], [-1.0, 1.0]])
    loose = ff.MechanicalSystem(
        np.diag([200.0, 100.0]), 777.0 * links, k * links, [ff.ClearanceSpring([1.0, -1.0], k)],
        ff.HarmonicForce([1.0, 0.0]),
    )  # fmt: skip
    with pytest.raises(ff.InputError, match="nothing ever holds the machine"):
        ff.frequency_response(loose, (50.0, 60.0))


def test_energy_of_a_driven_shaft_under_a_constant_force() -> None:
    """Input is dissipated or stored, the constant force's potential among it."""
    machine = ff.MechanicalSystem(
        [[100.0]], [[200.0]], [[1e5]], (), ff.Unbalance([1.0]), static_force=[5e4]
    )
    run = ff.coast_down(machine, 30.0, ff.Drive(inertia=1.0, friction=1.0), duration=0.5)
    energy = run.history.energy
    rest = energy["input"] - energy["dissipated"] - energy["stored"]
    close("balance", rest, 0.0, abs=1e-3)


def test_steps_follow_the_fastest_excitation() -> None:
    """Forty steps to a turn of the highest order, not of the shaft."""
    from flipflow.transient.time_stepping import RungeKutta, Stepper  # noqa: PLC0415

    machine = ff.MechanicalSystem([[1.0]], [[0.2]], [[1.0]], (), ff.HarmonicForce([1.0], order=20))
    profile = ff.SpeedProfile((0.0, 4.0), (3.0, 3.0))
    stepper = Stepper(machine, profile, np.zeros(2), method=RungeKutta("rk4"), fastest=3.0)
    last = [stretch for stretch in stepper.run(4.0) if stretch.t.size][-1]
    exact = ff.simulate(machine, omega=3.0, periods=2, initial=[0.0, 0.0], t=[4.0])
    close("end", last.states[-1, 0], exact.x[-1, 0], abs=1e-6)
