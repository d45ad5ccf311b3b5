"""Machines that others have published, held against computations that share nothing with ours.

Event-located DOP853 of ``tests/reference``, closed forms, and figures in print.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import eigh

import flipflow as ff
from flipflow.studies.periodic_orbits import MOST_PERIODS
from judge import close
from reference import integrate

pytestmark = pytest.mark.numerical


def one_mass(
    stiffness: float, gap: float, damping: float, force: ff.Unbalance | ff.HarmonicForce
) -> ff.MechanicalSystem:
    """A mass of 1 on a spring of 1, and an undamped stop on one side."""
    stop = ff.ClearanceSpring([1.0], stiffness, 0.0, gap, math.inf)
    return ff.MechanicalSystem([[1.0]], [[damping]], [[1.0]], (stop,), force)


def returns(orbit: ff.Orbit, share: float = 1e-8) -> None:
    """DOP853 started on a motion is back after its period, to a share of its size."""
    reference = integrate.Machine.of(orbit.system)
    path = integrate.flow(reference, orbit.state, orbit.omega, 0.0, orbit.period)
    n = orbit.system.size
    size = np.abs(path(np.linspace(0.0, orbit.period, 201))[:, :n]).max()
    weight = np.repeat([1.0, 1.0 / orbit.omega], n)
    what = f"{orbit.periods} periods at {orbit.omega}"
    close(what, path.final * weight, orbit.state * weight, abs=share * size)


def largest_multiplier(orbit: ff.Orbit, step: float = 1e-6) -> complex:
    """Of largest modulus, from differences of DOP853 over the motion's period."""
    reference = integrate.Machine.of(orbit.system)

    def after(z: np.ndarray) -> np.ndarray:
        return integrate.flow(reference, z, orbit.omega, 0.0, orbit.period).final

    steps = step * np.eye(orbit.state.size)
    z = orbit.state
    columns = [(after(z + h) - after(z - h)) / (2.0 * step) for h in steps]
    values = np.linalg.eigvals(np.transpose(columns))
    return complex(values[np.abs(values).argmax()])


# Krack and Gross, Harmonic Balance for Nonlinear Vibration Problems (2019), and their code NLvib,
# EXAMPLES/03_twoDOFoscillator_unilateralSpring.


@pytest.fixture(scope="module")
def nlvib() -> ff.MechanicalSystem:
    K = np.array([[1.0, -1.0], [-1.0, 2.0]])
    stop = ff.ClearanceSpring([1.0, 0.0], 100.0, 0.0, 1.0, math.inf)
    return ff.MechanicalSystem(np.eye(2), 0.03 * K, K, (stop,), ff.HarmonicForce([0.0, 0.1]))


@pytest.fixture(scope="module")
def nlvib_branch(nlvib) -> ff.Branch:
    return ff.frequency_response(nlvib, (0.5, 0.8))


def test_nlvib_points_where_motions_change(nlvib_branch) -> None:
    """To 1e-6 rad/s; DOP853 finds there the multiplier -1, and a pair on the unit circle."""
    first, second = nlvib_branch.points_of("period doubling")[:2]
    torus = nlvib_branch.points_of("Neimark-Sacker")[-1]
    close("period doubling", first.omega, 0.738783030, abs=1e-7)
    close("the second", second.omega, 0.755586, abs=1e-6)
    close("Neimark-Sacker", torus.omega, 0.618606873, abs=1e-8)
    close("multiplier", largest_multiplier(first.orbit), -1.0 + 0j, abs=1e-5)
    close("modulus", abs(largest_multiplier(torus.orbit)), 1.0, abs=1e-5)


@pytest.mark.parametrize(
    ("method", "rms", "figure"),
    [(None, 1.0119, 0.9795), (ff.HarmonicBalance(21), 1.0130, 0.9804)],
    ids=["exact", "H21"],
)
def test_nlvib_size_at_the_peak(nlvib, nlvib_branch, method, rms, figure) -> None:
    """Root mean square of x1 near 0.754, and NLvib's own measure sqrt((a0^2 + sum a^2 + b^2) / 2).

    They differ by the mean, which NLvib counts half.
    """
    branch = nlvib_branch if method is None else ff.frequency_response(nlvib, (0.5, 0.8), method)
    near = [branch.orbit(i) for i in np.flatnonzero(np.abs(branch.omega - 0.754) < 3e-3)]
    waves = [one.displacement(0)[:-1] for one in near]
    square, mean = max((float(np.mean(x**2)), float(np.mean(x))) for x in waves)
    close("rms", math.sqrt(square), rms, abs=2e-4)
    close("NLvib's figure", math.sqrt(square - mean**2 / 2.0), figure, abs=2e-4)


# code_aster, test SDND101: a mass that strikes an undamped stop without gap.


def test_code_aster_impact() -> None:
    """m 100, k 1e4, stop 1e6, v0 = 1: two half waves, in closed form."""
    stop = ff.ClearanceSpring([1.0], 1e6, 0.0, 0.0, math.inf)
    force = ff.HarmonicForce([0.0])
    machine = ff.MechanicalSystem([[100.0]], [[0.0]], [[1e4]], (stop,), force)
    held, free = math.sqrt(1.01e6 / 100.0), math.sqrt(1e4 / 100.0)
    release, second = math.pi / held, math.pi / held + math.pi / free
    t = np.array([0.0, release / 2.0, release, second])
    history = ff.simulate(machine, 10.0, 1, [0.0, 1.0], t=t)
    close("events", [one.t for one in history.events[:2]], [release, second], abs=1e-12)
    close("in print", [release, second], [0.031260, 0.345419], rel=1e-5)
    close("force", history.stop_force()[1], 1e6 / held, rel=1e-12)
    close("in print", history.stop_force()[1], 9950.37, rel=1e-6)


# The soft-impact oscillator of Ing, Pavlovskaia, Wiercigroch and others:
# x'' + 2 (.01) x' + x + 29 (x - 1.26)+ = .7 w^2 cos(w t).
# What the brute force of benchmarks/cases.py prints: periods, and a state at phase 0.
SOFT = {
    0.72: {1: (0.752815, 0.016207), 2: (0.214908, 1.040057), 6: (0.091900, 1.077350),
           8: (0.051761, 0.913079)},
    0.74: {1: (0.846397, 0.020490), 2: (0.466733, -1.360429)},
    0.8: {1: (1.241991, 0.044160), 5: (0.917164, 0.777061)},
    0.81: {2: (1.158119, 0.043713), 5: (0.519940, 0.059999)},
    0.82: {2: (1.335523, 0.105326), 5: (0.381804, 0.069415)},
    0.8528: {2: (1.042145, 0.053247), 5: (1.232592, -0.519242)},
    0.86: {2: (1.421547, 0.152731), 5: (1.450007, -0.669274)},
    1.0: {1: (1.473179, 0.283840), 3: (0.828200, -2.091436)},
    1.1: {1: (1.582692, 0.420471), 4: (0.353798, 0.389491)},
}  # fmt: skip
TOLD = 2e-6  # rounding of the table


def soft_impact() -> ff.MechanicalSystem:
    return one_mass(29.0, 1.26, 2.0 * 0.01, ff.Unbalance([0.7]))


@pytest.mark.parametrize("omega", SOFT)
def test_soft_impact_attractors(omega: float) -> None:
    """Every attractor of the brute-force run is listed, stable, and a motion of DOP853."""
    machine, table = soft_impact(), SOFT[omega]
    sought = [p for p in table if p <= MOST_PERIODS]
    found = [o for o in ff.periodic_orbits(machine, omega, max(sought)) if o.stable]
    for periods in sought:
        listed = [o for o in found if o.periods == periods]
        states = [s for o in listed for s in _turn_by_turn(machine, omega, o.state, periods, 0)]
        away = min((np.abs(s - table[periods]).max() for s in states), default=math.inf)
        assert away < TOLD, f"{periods} periods at {omega}: {away} from {found}"
        for orbit in listed:
            returns(orbit)


@pytest.mark.parametrize("omega", SOFT)
def test_soft_impact_ends_nowhere_else(omega: float) -> None:
    """A dozen runs of our own flow end on attractors of the table; one has eight periods."""
    machine, rng = soft_impact(), np.random.default_rng(1)
    known = [
        state
        for periods, start in SOFT[omega].items()
        for state in _turn_by_turn(machine, omega, np.array(start), periods, 200 * periods)
    ]
    for start in rng.uniform([-4.0, -4.0], [1.7, 4.0], (12, 2)):
        (end,) = _turn_by_turn(machine, omega, start, 1, 3000)
        away = min(np.abs(end - state).max() for state in known)
        assert away < TOLD, f"from {start} at {omega}: {away} from the attractors of the table"


def _turn_by_turn(
    machine: ff.MechanicalSystem, omega: float, z: np.ndarray, turns: int, skip: int
) -> np.ndarray:
    return ff.poincare_section(machine, omega, turns, initial=z, skip=skip).states


def test_soft_impact_small_closed_branch() -> None:
    """The family of six periods lives between two folds, and a wide interval sees it close."""
    machine = soft_impact()
    orbits = ff.periodic_orbits(machine, 0.72, 6)
    (orbit,) = (one for one in orbits if one.periods == 6 and one.stable)
    branch = ff.continue_orbit(orbit, "omega", (0.1, 5.0))
    assert "closed" in branch.status.value
    assert branch.omega.size < 200
    folds = sorted(fold.omega for fold in branch.folds)
    close("folds", folds, [0.716864, 0.721835], abs=1e-6)
    for fold in branch.folds:
        returns(fold.orbit)


# Shaw and Holmes, A periodically forced piecewise linear oscillator, J. Sound Vib. 90 (1983)
# 129-155: the bilinear oscillator, a stop that begins at rest.


def bilinear(damping: float = 0.1, force: float = 1.0) -> ff.MechanicalSystem:
    """Frequencies 1 and 2 on the two sides."""
    return one_mass(3.0, 0.0, damping, ff.HarmonicForce([force]))


@pytest.fixture(scope="module")
def bilinear_branch() -> ff.Branch:
    return ff.frequency_response(bilinear(), (0.3, 4.0))


@pytest.mark.parametrize("speed", [1e-3, 1.0, 50.0])
def test_bilinear_frequency(speed: float) -> None:
    """Free and undamped, 2 w1 w2 / (w1 + w2) at whatever amplitude (Shaw and Holmes)."""
    history = ff.simulate(bilinear(0.0, 0.0), 1.0, 3, [0.0, speed])
    entries = [one.t for one in history.events][1::2]
    close("between contacts", np.diff(entries), [1.5 * math.pi, 1.5 * math.pi], rel=1e-12)


def test_bilinear_response(bilinear_branch) -> None:
    """As the force, so the motion, at whatever speed; the peak stands near that frequency."""
    assert bilinear_branch.status.complete, bilinear_branch.status.value
    other = ff.frequency_response(bilinear(force=20.0), (0.3, 4.0))
    ours, theirs = bilinear_branch.special_points, other.special_points
    assert [one.kind for one in ours] == [one.kind for one in theirs]
    close("speeds", [o.omega for o in theirs], [o.omega for o in ours], rel=1e-8)
    close(
        "sizes", [o.amplitude(0) for o in theirs], [20.0 * o.amplitude(0) for o in ours], rel=1e-7
    )
    close("resonance", bilinear_branch.peak(0).omega, 4.0 / 3.0, rel=2e-3)


@pytest.mark.parametrize("omega", [0.456, 0.85, 4.0 / 3.0, 8.0 / 3.0])
def test_bilinear_motions(bilinear_branch, omega: float) -> None:
    """Between folds three; within a period doubling, an unstable one and one of two periods."""
    found = ff.periodic_orbits(bilinear(), omega, 2)
    for orbit in found:
        returns(orbit)
        size = abs(largest_multiplier(orbit))
        assert orbit.stable == (size < 1.0), f"{orbit}: {size}"
    words = sorted((orbit.periods, orbit.stability) for orbit in found)
    one, two = (1, "stable"), (2, "stable")
    expected = {0.456: [one, one, (1, "unstable")], 4.0 / 3.0: [one]}
    assert words == expected.get(omega, [(1, "unstable"), two])
    for orbit in bilinear_branch.orbits_at(omega):
        assert any(np.allclose(orbit.state, other.state, rtol=1e-7) for other in found)


def test_bilinear_period_doublings(bilinear_branch) -> None:
    """Two windows, the wide one about twice the natural frequency; multiplier -1 by DOP853."""
    points = bilinear_branch.points_of("period doubling")
    assert len(points) == 4
    assert points[2].omega < 8.0 / 3.0 < points[3].omega
    for point in points:
        close(f"at {point.omega}", largest_multiplier(point.orbit), -1.0 + 0j, abs=1e-5)


# A cantilever of 20 Euler-Bernoulli elements whose tip strikes a stop, as Moon and Shaw (1983)
# drove one; EI = rho A = L = 1, the roots of the continuous beam from any textbook.
ELEMENTS = 20
ROOTS = (1.875104069, 4.694091133, 7.854757438)  # of 1 + cos x cosh x = 0


def beam(*, condensed: bool) -> tuple[ff.MechanicalSystem, np.ndarray]:
    """The machine and its natural frequencies; condensed to deflections, or with rotations."""
    h, n = 1.0 / ELEMENTS, ELEMENTS
    K, M = np.zeros((2, 2 * n + 2, 2 * n + 2))
    k = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]) / h**3
    m = np.array(
        [[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]
    ) * (h / 420.0)  # fmt: skip
    size = np.array([1.0, h, 1.0, h])
    for i in range(0, 2 * n, 2):
        K[i : i + 4, i : i + 4] += k * np.outer(size, size)
        M[i : i + 4, i : i + 4] += m * np.outer(size, size)
    K, M = K[2:, 2:], M[2:, 2:]
    if condensed:
        rotations = -np.linalg.solve(K[1::2, 1::2], K[1::2, ::2])
        T = np.zeros((2 * n, n))
        T[::2], T[1::2] = np.eye(n), rotations
        K, M = T.T @ K @ T, T.T @ M @ T
    K, M = (K + K.T) / 2.0, (M + M.T) / 2.0
    squares, shapes = eigh(K, M)
    natural = np.sqrt(squares)
    C = M @ shapes @ np.diag(2.0 * 0.02 * natural) @ shapes.T @ M
    tip = np.eye(len(K))[len(K) - (1 if condensed else 2)]
    stop = ff.ClearanceSpring(tip, 50.0, 0.0, 0.3, math.inf)
    force = ff.HarmonicForce(0.05 * tip)
    names = {"tip": tip}
    return ff.MechanicalSystem(M, (C + C.T) / 2.0, K, (stop,), force, names), natural


@pytest.fixture(scope="module")
def beam_branch() -> ff.Branch:
    machine, _ = beam(condensed=True)
    return ff.frequency_response(machine, (2.2, 7.0))


@pytest.mark.parametrize("condensed", [True, False])
def test_beam_frequencies(condensed) -> None:
    """The first three, against the roots of the continuous beam."""
    machine, natural = beam(condensed=condensed)
    close("natural", natural[:3], np.square(ROOTS), rel=1e-4)
    mine = ff.linear_response(machine, [1.0]).natural_frequencies
    close("ours", mine, natural, rel=1e-7)


def test_beam_branch(beam_branch) -> None:
    """Through the first resonance, with contact; all 40 coordinates say the same."""
    assert beam_branch.status.complete, beam_branch.status.value
    machine, _ = beam(condensed=False)
    full = ff.frequency_response(machine, (2.2, 7.0))
    assert full.status.complete, full.status.value
    mine, theirs = beam_branch.special_points, full.special_points
    assert [one.kind for one in mine] == ["contact begin", "fold", "fold", "contact end"]
    assert [one.kind for one in mine] == [one.kind for one in theirs]
    close("speeds", [o.omega for o in mine], [o.omega for o in theirs], rel=1e-6)
    close("peak", beam_branch.peak("tip").amplitude("tip"), full.peak("tip").amplitude("tip"),
          rel=1e-5)  # fmt: skip


@pytest.mark.parametrize("omega", [3.5, 3.6, 3.63])
def test_beam_amplitudes(beam_branch, omega: float) -> None:
    """Before, between and near the folds, each motion against DOP853 over a turn."""
    orbits = beam_branch.orbits_at(omega)
    assert any(orbit.touches for orbit in orbits)
    for orbit in orbits:
        reference = integrate.Machine.of(orbit.system)
        path = integrate.flow(reference, orbit.state, omega, 0.0, orbit.period)
        tip = orbit.system.coordinate("tip")
        expected = integrate.amplitude(path, tip, 0.0, orbit.period)
        close("amplitude", orbit.amplitude("tip"), expected, rel=1e-8)
        close("back", path.final[:ELEMENTS], orbit.state[:ELEMENTS], abs=1e-8 * expected)


# A rotor within a polygon of stops, in place of the round stator of von Groll and Ewins, The
# harmonic balance method with arc-length continuation in rotor/stator contact problems.


def rotor(stops: int, *, both_sides: bool = False) -> ff.MechanicalSystem:
    """Stops at the sides of a regular polygon; opposite sides as one spring where asked for."""
    angles = 2.0 * math.pi / stops * np.arange(stops // 2 if both_sides else stops)
    springs = [
        ff.ClearanceSpring([math.cos(a), math.sin(a)], 20.0, 0.0, 1.0,
                           None if both_sides else math.inf)
        for a in angles
    ]  # fmt: skip
    unbalance = ff.Unbalance([0.3, -0.3j])
    return ff.MechanicalSystem(np.eye(2), 0.1 * np.eye(2), np.eye(2), springs, unbalance)


@pytest.fixture(scope="module")
def rotor_branches() -> dict[int, ff.Branch]:
    return {stops: ff.frequency_response(rotor(stops), (0.5, 8.0)) for stops in (4, 5, 6)}


@pytest.mark.parametrize("stops", [4, 5, 6])
def test_rotor_contact(rotor_branches, stops: int) -> None:
    """The free whirl, a circle of radius .3 w^2 / |1 - w^2 + .1 i w|, meets all stops at once."""
    branch = rotor_branches[stops]
    assert branch.status.complete, branch.status.value
    # (.09 - 1) s^2 + (2 - .01) s - 1 = 0 for s = w^2 where that radius is 1.
    begin, end = np.sort(np.sqrt(np.roots([0.09 - 1.0, 2.0 - 0.01, -1.0])))
    for kind, speed in (("contact begin", begin), ("contact end", end)):
        points = branch.points_of(kind)
        close(kind, [one.omega for one in points], np.full(stops, speed), rel=1e-9)
        assert {one.spring for one in points} == set(range(stops))


@pytest.mark.parametrize("stops", [4, 5, 6])
@pytest.mark.parametrize("omega", [1.0, 2.2, 3.0])
def test_rotor_motions(rotor_branches, stops: int, omega: float) -> None:
    """Against DOP853; a motion that the stops are hit in turn is itself, turned and later."""
    for orbit in rotor_branches[stops].orbits_at(omega):
        returns(orbit)
        t = np.linspace(0.0, orbit.period, 40, endpoint=False)
        x = np.array([orbit.displacement(i, t) for i in (0, 1)])
        later = (t + orbit.period / stops) % orbit.period
        c, s = math.cos(2.0 * math.pi / stops), math.sin(2.0 * math.pi / stops)
        turned = np.array([[c, -s], [s, c]]) @ x
        close("turned", [orbit.displacement(i, later) for i in (0, 1)], turned, abs=1e-9)


def test_rotor_where_symmetry_is_lost(rotor_branches) -> None:
    """Six sides as three springs: there another branch crosses where here symmetry is lost."""
    paired = ff.frequency_response(rotor(6, both_sides=True), (0.5, 8.0))
    single = rotor_branches[6]
    lost, crossed = paired.points_of("symmetry breaking"), single.points_of("branch point")
    assert len(lost) == 4
    close("speeds", [o.omega for o in crossed], [o.omega for o in lost], abs=3e-6)
    for kind in ("fold", "contact begin", "contact end"):
        ours, theirs = ({round(o.omega, 8) for o in b.points_of(kind)} for b in (paired, single))
        assert ours == theirs
    for before, after in ((0.885, 0.886), (2.03, 2.05)):
        words = [single.orbits_at(w)[0].stability for w in (before, after)]
        assert sorted(words) == ["stable", "unstable"], words
