"""Any periodic motion followed over frequency or over a field, and branches switched to.

Cusps, the two-mass chain and leaning motions have reference values (see tests/reference). The
rest is judged by other routes: the branch from below, the folds of a machine made with the value
found, and DOP853 that knows nothing of kernels.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import flipflow as ff
from flipflow.errors import InputError
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.orbit import Orbit
from judge import close, kinds, minmax
from reference import integrate

pytestmark = pytest.mark.numerical
WINDOW_2MM = (56.9837, 58.4409)
LEANING_2MM = (2.024274e-3, -2.130097e-3)
CUSPS = {"stop_stiffness": (5.8231e6, 185.618), "clearance": (5.3021e-3, 210.416)}
INTERVALS = {"stop_stiffness": (4e6, 1e7), "clearance": (2e-3, 9e-3)}


@pytest.fixture(scope="module")
def leaning(response):
    """Branches of leaning motions at e = 2 mm, switched to at either end of the window."""
    symmetric = response(None, (50.0, 65.0), clearance=2e-3)
    points = symmetric.points_of("symmetry breaking")
    return [ff.switch_branch(point, (50.0, 65.0)) for point in points]


@pytest.fixture(scope="module")
def chain() -> ff.MechanicalSystem:
    K = np.array([[1.0, -1.0], [-1.0, 2.0]])
    stop = ff.ClearanceSpring([1.0, 0.0], 100.0, 0.0, 1.0, np.inf)
    return ff.MechanicalSystem(np.eye(2), 0.03 * K, K, (stop,), ff.HarmonicForce([0.0, 0.1]))


@pytest.fixture(scope="module")
def doubled(chain):
    """The branch of two periods, switched to at the first period doubling of the two-mass chain."""
    one = ff.frequency_response(chain, (0.5, 0.8))
    return ff.switch_branch(one.points_of("period doubling")[0], (0.5, 0.8))


@pytest.fixture(scope="module")
def subharmonic(screen) -> Orbit:
    """A stable motion of three periods at 440 rad/s, found by settling from random states."""
    omega, rng = 440.0, np.random.default_rng(1)
    one = ExactSolver(screen.system(), half_turn=False)
    three = ExactSolver(screen.system(), half_turn=False, turns=3)
    scale = np.array([0.05, 0.1, 0.05 * omega, 0.1 * omega])
    for _ in range(100):
        settled = one.settled(rng.uniform(-1.0, 1.0, 4) * scale, omega, 300)
        point = three.solve(settled, omega)
        if point is None:
            continue
        moved = np.abs(one.settled(point.u, omega, 1) - point.u) / [1.0, 1.0, omega, omega]
        if moved.max() > 1e-3:
            return Orbit(screen, point)
    pytest.fail("no motion of three periods at 440 rad/s")


def test_leaning_motions_are_switched_to(leaning) -> None:
    """From either end of the window without symmetry to the other; 1e-3 rad/s, 1e-4 mm."""
    for branch, (first, last) in zip(leaning, (WINDOW_2MM, WINDOW_2MM[::-1]), strict=True):
        assert branch.status.complete, branch.status.value
        ends = [point.omega for point in branch.points_of("symmetry breaking")]
        close("window", ends, [first, last], abs=1e-3)
        assert set(branch.stability) == {"stable"}
        (orbit,) = branch.orbits_at(57.7)
        assert orbit.stable
        most, least = (1e3 * x for x in LEANING_2MM)
        expected = min(
            [(least, most), (-most, -least)], key=lambda r: abs(r[0] - 1e3 * minmax(orbit)[0])
        )
        close("range at 57.7, mm", 1e3 * np.array(minmax(orbit)), expected, abs=1e-4)


def test_a_leaning_motion_is_followed_to_both_ends_of_the_window(leaning) -> None:
    """From its middle the branch ends where it meets the symmetric motions, on both sides."""
    (orbit,) = leaning[0].orbits_at(57.7)
    branch = ff.continue_orbit(orbit, "omega", (50.0, 65.0))
    assert branch.status.complete
    close("ends", [branch.special_points[0].omega, branch.special_points[-1].omega], WINDOW_2MM,
          abs=1e-3)  # fmt: skip
    close("points reach them", branch.omega[[0, -1]], WINDOW_2MM, abs=2e-3)


def test_period_two_is_switched_to(doubled) -> None:
    """It begins between 0.73 and 0.74 rad/s, has a fold of its own and ends in 0.7556."""
    assert doubled.periods == 2
    assert doubled.status.complete
    assert kinds(doubled) == ["period doubling", "fold", "period doubling"]
    assert 0.73 < doubled.special_points[0].omega < 0.74
    fold = doubled.folds[0].omega
    before, after = doubled.orbits_at(fold - 1e-5)
    assert (before.stability, after.stability) == ("stable", "unstable")
    with pytest.raises(InputError):
        doubled.orbits_at(fold + 1e-5)


@pytest.mark.parametrize("omega", [0.742, 0.748, 0.7545])
def test_period_two_is_what_the_machine_does(chain, doubled, omega: float) -> None:
    """DOP853 from the motion pushed by 1e-4, until a thousandth of that is left by its multiplier.

    It comes back, after two turns and not one.
    """
    orbit = doubled.orbits_at(omega)[0]
    assert orbit.stable
    assert orbit.periods == 2
    machine, turn = integrate.Machine.of(chain), 2.0 * np.pi / omega
    pushed = orbit.state + np.array([1e-4, 0.0, 0.0, 0.0])
    times = math.ceil(math.log(1e-3) / math.log(np.abs(orbit.multipliers).max()))
    settled = integrate.flow(machine, pushed, omega, 0.0, 2.0 * times * turn, 1e-10).final
    close("comes back", settled, orbit.state, abs=1e-6)
    once = integrate.flow(machine, orbit.state, omega, 0.0, turn).final
    twice = integrate.flow(machine, orbit.state, omega, 0.0, 2.0 * turn).final
    close("after two turns", twice, orbit.state, abs=1e-8)
    assert np.abs(once - orbit.state).max() > 1e-3


def test_every_motion_at_203_leads_to_the_whole_branch(exact) -> None:
    """Both folds to 1e-9, amplitudes to 1e-12, words the same, from each of the three motions."""
    speeds = (100.0, 199.0, 203.0, 206.0, 220.0)
    for orbit in exact.orbits_at(203.0):
        branch = ff.continue_orbit(orbit, "omega", (5.0, 250.0))
        assert branch.status.complete
        assert kinds(branch) == kinds(exact)
        close("special points", [p.omega for p in branch.special_points],
              [p.omega for p in exact.special_points], abs=1e-9)  # fmt: skip
        for omega in speeds:
            pairs = zip(*map(by_size, (branch, exact), (omega, omega)), strict=True)
            for one, other in pairs:
                close("amplitude", one.amplitude("relative"), other.amplitude("relative"), rel=1e-9)
                assert one.stability == other.stability


def by_size(branch, omega: float) -> list[Orbit]:
    return sorted(branch.orbits_at(omega), key=lambda orbit: orbit.amplitude("relative"))


def test_harmonic_balance_is_followed_as_such(response) -> None:
    branch = response(ff.HarmonicBalance(3))
    orbit = branch.orbits_at(203.0)[1]
    again = ff.continue_orbit(orbit, "omega", (150.0, 250.0))
    assert again.method == ff.HarmonicBalance(3)
    close("folds", [f.omega for f in again.folds], [f.omega for f in branch.folds], abs=1e-8)


def test_folds_over_the_clearance_are_folds_over_omega(screen, exact) -> None:
    """The machine made with the clearance found has a fold at 203 rad/s; 1e-6."""
    largest = by_size(exact, 203.0)[-1]
    branch = ff.continue_orbit(largest, "clearance", (2e-3, 9e-3))
    assert branch.status.complete, branch.status.value
    close("ends", branch.values[[0, -1]], (2e-3, 9e-3), abs=0.0)
    assert len(branch.folds) == 2
    for fold in branch.folds:
        machine = screen.replace(clearance=fold.value)
        over_omega = [f.omega for f in ff.frequency_response(machine, (150.0, 250.0)).folds]
        nearest = min(over_omega, key=lambda omega: abs(omega - 203.0))
        close(f"fold at e = {fold.value}", nearest, 203.0, abs=1e-6)


def test_points_over_a_field_are_motions_of_their_machines(screen, exact) -> None:
    """Amplitude and stability as the machine of that value gives them by itself."""
    branch = ff.continue_orbit(by_size(exact, 203.0)[-1], "eccentric_moment", (3.0, 5.0))
    for i in (0, len(branch.orbits) // 2, -1):
        value = float(branch.values[i])
        alone = ff.frequency_response(screen.replace(eccentric_moment=value), (5.0, 250.0))
        sizes = [o.amplitude("relative") for o in alone.orbits_at(203.0)]
        nearest = int(np.abs(np.array(sizes) - branch.amplitude("relative")[i]).argmin())
        close("amplitude", branch.amplitude("relative")[i], sizes[nearest], rel=1e-9)
        assert branch.stability[i] == alone.orbits_at(203.0)[nearest].stability


def test_leaning_motions_over_the_clearance(leaning, response) -> None:
    """At 57.7 rad/s they live between two clearances whose window ends at 57.7; 1e-6 rad/s."""
    (orbit,) = leaning[0].orbits_at(57.7)
    branch = ff.continue_orbit(orbit, "clearance", (1.5e-3, 2.5e-3))
    assert branch.status.complete
    ends = branch.points_of("symmetry breaking")
    assert len(ends) == 2
    for end in ends:
        found = response(None, (50.0, 65.0), clearance=end.value).points_of("symmetry breaking")
        nearest = min((p.omega for p in found), key=lambda omega: abs(omega - 57.7))
        close("window's end", nearest, 57.7, abs=1e-6)


@pytest.mark.parametrize("field", ["clearance", "stop_stiffness"])
def test_fold_curves_meet_in_the_cusp(exact, field: str) -> None:
    """From either fold through the cusp to the other; 1e-3 of the value."""
    ends = []
    for fold in exact.folds:
        curve = ff.continue_fold(fold, field, INTERVALS[field])
        assert curve.status.complete, curve.status.value
        (cusp,) = curve.points_of("cusp")
        value, omega = CUSPS[field]
        close("cusp", cusp.value, value, rel=1e-3)
        close("its speed", cusp.omega, omega, rel=1e-3)
        close("both ends at the upper value", curve.values[[0, -1]], 2 * [INTERVALS[field][1]],
              abs=0.0)  # fmt: skip
        ends.append(sorted(curve.omega[[0, -1]]))
    close("the same curve from both folds", ends[0], ends[1], abs=1e-6)


def test_folds_lie_on_the_fold_curve(exact) -> None:
    """Reference values: at e = 8 mm folds at 198.64747 and 164.12941 rad/s, 1e-4."""
    curve = ff.continue_fold(exact.folds[0], "clearance", (2e-3, 8e-3))
    close("folds", sorted(curve.omega[[0, -1]]), [164.12941, 198.64747], abs=1e-4)


def test_detached_branch_of_three_periods(screen, subharmonic) -> None:
    """FFS0827 between 350 and 541 rad/s: closed, with two folds of its own, 1e-3 rad/s.

    The folds are this package's own finding; DOP853 returns to the motions beside them.
    """
    branch = ff.continue_orbit(subharmonic, "omega", (300.0, 600.0))
    assert branch.periods == 3
    assert branch.status is branch.status.CLOSED
    assert kinds(branch) == ["fold", "fold"]
    low, high = sorted(fold.omega for fold in branch.folds)
    close("folds", [low, high], [350.033, 541.186], abs=1e-3)
    machine = integrate.Machine.of(screen.system())
    for omega in (low + 1.0, 440.0, high - 1.0):
        orbits = branch.orbits_at(omega)
        assert sorted(orbit.stability for orbit in orbits) == ["stable", "unstable"]
        for orbit in orbits:
            end = integrate.flow(machine, orbit.state, omega, 0.0, orbit.period).final
            close("DOP853 after three turns", end[:2], orbit.state[:2], abs=1e-9)
    for orbit in branch.orbits_at(low + 0.01):
        again = ff.continue_orbit(orbit, "omega", (300.0, 600.0))
        assert kinds(again) == ["fold", "fold"], "closed by the strand beside the first motion"
    inside = ff.continue_orbit(subharmonic, "omega", (350.0, 541.0))
    assert inside.status.complete
    close("its fold", inside.folds[0].omega, low, abs=1e-8)


def test_saved_branches_open_again(tmp_path, doubled, subharmonic, leaning) -> None:
    detached = ff.continue_orbit(subharmonic, "omega", (300.0, 600.0))
    for branch in (doubled, detached, leaning[0]):
        ff.save(branch, tmp_path / "branch.json")
        again = ff.open_result(tmp_path / "branch.json")
        which = branch.system.named[-1]
        assert again.periods == branch.periods
        close("amplitude", again.amplitude(which), branch.amplitude(which), rel=1e-12)
        for one, other in zip(again.special_points, branch.special_points, strict=True):
            assert (one.kind, one.orbit.periods) == (other.kind, other.orbit.periods)
            close("multipliers", one.orbit.multipliers, other.orbit.multipliers, abs=1e-9)


def test_figures(tmp_path, exact, leaning, subharmonic) -> None:
    """Periods stand in the legend; a branch over a field has a figure and a document."""
    detached = ff.continue_orbit(subharmonic, "omega", (300.0, 600.0))
    figure = ff.figure([exact, detached])
    names = [trace.name for trace in figure.panels[0].traces if trace.legend]
    assert any(name.startswith("1 period,") for name in names)
    assert "3 periods, closed" in names
    colours = {t.colour for t in figure.panels[0].traces if t.name.startswith("3 periods")}
    assert colours.isdisjoint({t.colour for t in figure.panels[0].traces if "1 period" in t.name})
    figure.write(tmp_path / "branches.svg")
    curve = ff.continue_orbit(leaning[0].orbits_at(57.7)[0], "clearance", (1.5e-3, 2.5e-3))
    ff.figure(curve).write(tmp_path / "clearance.svg")
    ff.save(curve, tmp_path / "clearance.json")
    again = ff.open_result(tmp_path / "clearance.json")
    assert again.field == "clearance"
    np.testing.assert_array_equal(again.values, curve.values)
    assert again.stability.tolist() == curve.stability.tolist()


def test_bad_input(exact, leaning, chain) -> None:
    orbit = exact.orbits_at(203.0)[0]
    for field, interval in (
        ("omega", (300.0, 400.0)), ("omega", (250.0, 150.0)), ("clearance", (7e-3, 9e-3)),
        ("clearance", (9e-3, 2e-3)), ("clearance", (-1e-3, 9e-3)),
        ("clearance_minus", (1e-3, 9e-3)),
        ("colour", (0.0, 1.0)), ("clearance", None),
    ):  # fmt: skip
        with pytest.raises(InputError):
            ff.continue_orbit(orbit, field, interval)
    with pytest.raises(InputError):
        ff.switch_branch(exact.folds[0], (150.0, 250.0))
    with pytest.raises(InputError):
        ff.switch_branch(leaning[0].special_points[0], (60.0, 70.0))
    with pytest.raises(InputError):
        ff.continue_fold(leaning[0].special_points[0], "clearance", (1e-3, 3e-3))
    system_orbit = ff.frequency_response(chain, (0.5, 0.55)).orbit(0)
    with pytest.raises(InputError):
        ff.continue_orbit(system_orbit, "clearance", (0.5, 2.0))


def test_a_bridge_of_doubled_motions_is_found_from_either_end() -> None:
    """Near its lower end the doubled motion bends away within a ten-thousandth of the motion."""
    stops = (
        ff.ClearanceSpring([1.0], 30.8, 2.97, 2.894, np.inf),
        ff.ClearanceSpring([1.0], 40.8, 4.9, 1.042, 0.973),
    )
    machine = ff.MechanicalSystem([[0.817]], [[0.065]], [[0.277]], stops, ff.Unbalance([0.414]))
    ends = ff.frequency_response(machine, (0.4, 0.6)).points_of("period doubling")
    up, down = (ff.switch_branch(end, (0.4, 0.6)) for end in ends)
    assert up.complete
    assert down.complete
    assert up.special_points[-1].omega == pytest.approx(ends[1].omega, abs=1e-9)
    assert down.special_points[-1].omega == pytest.approx(ends[0].omega, abs=1e-9)
    ours, theirs = (sorted(point.omega for point in one.special_points) for one in (up, down))
    close("the same special points", ours, theirs, abs=1e-8)
    found = [o for o in ff.periodic_orbits(machine, 0.485, max_periods=2) if o.periods == 2]
    for branch in (up, down):
        (on,) = branch.orbits_at(0.485)
        apart = min(abs(on.amplitude(0) - other.amplitude(0)) for other in found)
        close("amplitude by a search", apart, 0.0, abs=1e-8)


def test_bridges_of_motions_that_are_small_beside_their_gaps_are_found_from_either_end() -> None:
    """The way beside the parent is a share of the gap, thirty times the motion."""
    stops = (
        ff.ClearanceSpring([1.0], 46.23, 0.0, 0.0, 0.8216),
        ff.ClearanceSpring([1.0], 1.539, 0.3213, 0.0),
    )
    force = ff.HarmonicForce([0.4304])
    machine = ff.MechanicalSystem([[1.812]], [[0.08658]], [[1.325]], stops, force)
    ends = ff.frequency_response(machine, (0.4, 1.6)).points_of("period doubling")
    assert len(ends) == 4
    for one, other in (ends[:2], ends[1::-1], ends[2:], ends[:1:-1]):
        branch = ff.switch_branch(one, (0.4, 1.6))
        assert branch.complete
        close("the other end", branch.special_points[-1].omega, other.omega, abs=1e-8)


def test_doubled_motions_that_end_at_a_corner_are_cut_there() -> None:
    """Under a law that pushes at once they end where the motion of one period begins to touch."""
    stop = ff.ClearanceSpring([1.0], 262.0, 9.1, 7.05, law="undamped-rebound")
    machine = ff.MechanicalSystem(
        [[1.077]], [[0.162]], [[0.636]], (stop,), ff.HarmonicForce([1.0]), static_force=[1.02]
    )
    doubling = ff.frequency_response(machine, (0.5, 0.85)).points_of("period doubling")[-1]
    branch = ff.switch_branch(doubling, (0.5, 0.85))
    assert branch.complete
    assert branch.omega.size < 300

    def room(omega: float) -> float:
        """Gap that the motion without contact leaves."""
        return 7.05 - 1.02 / 0.636 - abs(1.0 / (0.636 - 1.077 * omega**2 + 0.162j * omega))

    close("end", branch.omega[-1], brentq(room, 0.6, 0.7), abs=1e-6)


def test_a_branch_point_at_which_no_motion_is_solved_for_keeps_the_branch():
    """The nearest motion stands for it, with the parameter's value."""
    M = np.diag([1.4174600013204364, 1.1454834748344422, 1.0893036332777184, 0.5553159144999489])
    C, K = (
        np.diag(one) + np.diag(beside, 1) + np.diag(beside, -1)
        for one, beside in (
            ([0.1762877413203289, 0.1456117756622435, 0.07144405688839077, 0.020002863765821388],
             [-0.08805562497910742, -0.04610131593479168, -0.0144497046208219]),
            ([4.052828532678113, 3.3539235228474773, 1.5137755138903395, 0.3612426155205475],
             [-2.2013906244776855, -1.152532898369792, -0.3612426155205475]),
        )
    )  # fmt: skip
    stops = (
        ff.ClearanceSpring([1, -1, 0, 0], 1.4978880389357119, 0.16033456524986658,
                           1.1858833105792475, 1.225743760857352),
        ff.ClearanceSpring([-1, 0, 0, 1], 15.723068349759481, 0.2524554944204484,
                           0.6559009546223957, law="elasto-gap"),
    )  # fmt: skip
    system = ff.MechanicalSystem(M, C, K, stops, ff.HarmonicForce([1, 0, 0, 0]))
    kinds = set()
    for orbit in ff.periodic_orbits(system, 0.7119863585171984):
        branch = ff.continue_orbit(orbit, "forcing", (0.4, 1.0))
        for point in branch.special_points:
            kinds.add(point.kind)
            assert 0.4 <= point.value <= 1.0
            assert point.orbit.omega == 0.7119863585171984
    assert "branch point" in kinds
