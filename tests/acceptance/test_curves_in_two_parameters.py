"""Curves of special points in two parameters, each against another route to the same point.

benchmarks/curves.py compares every point of these curves, here some of them are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

import flipflow as ff
from flipflow.continuation.bifurcation_curve import BifurcationCurve
from judge import close
from reference import two_event

pytestmark = pytest.mark.numerical
RPM = 30.0 / math.pi
K2 = 2.7e6
SPEEDS = (120.0, 260.0)
OVER = {
    "clearance": (2e-3, 9e-3),
    "stop_stiffness": (K2, 5.0 * K2),
    "shear_stiffness": (1.8e6, 4.5e6),
}
CUSPS = {"clearance": (5.3021e-3, 210.416), "stop_stiffness": (5.8231e6, 185.618)}
STIFFNESS, K_BOUNDS = "springs[0].stiffness", (10.0, 200.0)
ANGLES = math.radians(4.0), math.radians(25.0)
K = np.array([[1.0, -1.0], [-1.0, 2.0]])


def chain(stiffness: float = 100.0) -> ff.MechanicalSystem:
    """The public case of row 24."""
    stop = ff.ClearanceSpring([1.0, 0.0], stiffness, 0.0, 1.0, np.inf)
    return ff.MechanicalSystem(np.eye(2), 0.03 * K, K, (stop,), ff.HarmonicForce([0.0, 0.1]))


def spread(curve: BifurcationCurve, count: int) -> list[int]:
    """Points all along a curve, without its ends."""
    return np.linspace(0, len(curve.orbits) - 1, count + 2).astype(int)[1:-1].tolist()


def nearest(points, omega: float) -> float:
    return min((point.omega for point in points), key=lambda found: abs(found - omega))


@pytest.fixture(scope="module")
def folds(exact) -> dict[str, BifurcationCurve]:
    return {
        field: ff.continue_bifurcation(exact.folds[0], (field, "omega"), (bounds, SPEEDS))
        for field, bounds in OVER.items()
    }


@pytest.fixture(scope="module")
def of_chain() -> ff.Branch:
    return ff.frequency_response(chain(), (0.5, 0.8))


@pytest.fixture(scope="module")
def doubling(of_chain) -> BifurcationCurve:
    first = of_chain.points_of("period doubling")[0]
    return ff.continue_bifurcation(first, (STIFFNESS, "omega"), (K_BOUNDS, (0.5, 0.9)))


@pytest.fixture(scope="module")
def drawn() -> ff.FlipFlowScreen:
    return ff.load("ffs0827").replace(clearance_measured="drawn")


@pytest.fixture(scope="module")
def of_weight(drawn) -> BifurcationCurve:
    branch = ff.frequency_response(drawn, (60.0, 100.0))
    first = branch.points_of("period doubling")[0]
    return ff.continue_bifurcation(first, ("deck_angle", "omega"), (ANGLES, (60.0, 100.0)))


@pytest.mark.parametrize("field", ["clearance", "stop_stiffness"])
def test_fold_curves_are_folds_of_single_curves(screen, folds, field: str) -> None:
    """Both folds of the nominal machine lie on one curve; 1e-6 rad/s against branches."""
    curve = folds[field]
    assert curve.complete
    for i in [0, *spread(curve, 4), -1]:
        machine = screen.replace(**{field: float(curve.along(field)[i])})
        over_omega = ff.frequency_response(machine, (5.0, 300.0)).folds
        close(f"{field} {i}", curve.omega[i], nearest(over_omega, curve.omega[i]), abs=1e-6)


@pytest.mark.parametrize("field", OVER)
def test_cusps_by_two_routes(screen, folds, field: str) -> None:
    """On the curve, and where f = f_s = f_ss = 0 of the scalar problem; rows of known values."""
    (cusp,) = folds[field].points_of("cusp")
    value, omega = cusp.values
    if field in CUSPS:
        close("value and speed", [value, omega], CUSPS[field], rel=1e-3)
    share = round(cusp.orbit.contact_share(), 2)
    found = two_event.cusp(screen, field, 1.001 * value, share, 1.001 * omega)
    close("by the other route", [value, omega], found, rel=1e-5)


def test_period_doublings_of_the_chain(doubling) -> None:
    """Ten stiffnesses, each against the branch over frequency; row 30 at 100."""
    assert doubling.complete
    first = ff.continue_bifurcation(
        ff.frequency_response(chain(), (0.5, 0.8)).points_of("period doubling")[0],
        (STIFFNESS, "omega"), ((100.0, 200.0), (0.5, 0.9)),
    )  # fmt: skip
    ends = sorted(first.omega[first.along(STIFFNESS) == 100.0])
    close("row 30", ends[0], 0.738783030, abs=1e-7)
    for i in spread(doubling, 10):
        stiffness, omega = doubling.values[i]
        alone = ff.frequency_response(chain(stiffness), (0.5, 0.9)).points_of("period doubling")
        close(f"at {stiffness}", omega, nearest(alone, omega), abs=1e-7)


def test_neimark_sacker_points_of_the_chain(of_chain) -> None:
    """The same of a pair of multipliers; the pair passes a quarter of a turn on the way."""
    second = of_chain.points_of("Neimark-Sacker")[1]
    close("row 30", second.omega, 0.618606873, abs=2e-9)
    curve = ff.continue_bifurcation(second, (STIFFNESS, "omega"), (K_BOUNDS, (0.5, 0.9)))
    assert curve.complete
    for i in spread(curve, 10):
        stiffness, omega = curve.values[i]
        alone = ff.frequency_response(chain(stiffness), (0.5, 0.9)).points_of("Neimark-Sacker")
        close(f"at {stiffness}", omega, nearest(alone, omega), abs=1e-7)
        pair = curve.multipliers[i][np.abs(np.abs(curve.multipliers[i]) - 1.0).argsort()[:2]]
        close("pair", np.abs(pair), [1.0, 1.0], abs=1e-9)
    (quarter,) = curve.points_of("1:4 resonance")
    angle = np.abs(np.angle(quarter.orbit.multipliers[0]))
    close("angle", angle, math.pi / 2.0, abs=1e-6)


def test_where_two_curves_meet(of_chain, doubling) -> None:
    """A fold that is a period doubling: the same point on either curve."""
    (fold,) = (point for point in of_chain.folds if point.omega > 0.7)
    curve = ff.continue_bifurcation(fold, (STIFFNESS, "omega"), (K_BOUNDS, (0.5, 0.9)))
    (on_fold,), (on_doubling,) = (
        one.points_of("fold and period doubling") for one in (curve, doubling)
    )
    close("where", on_fold.values, on_doubling.values, rel=1e-6)
    for critical in (1.0, -1.0):
        off = np.abs(on_fold.orbit.multipliers - critical).min()
        close("multiplier", off, 0.0, abs=1e-5)


def test_the_doubling_by_weight_over_the_deck_angle(drawn, of_weight) -> None:
    """Row 34 at 15 degrees; no steeper than the turning point no doubling."""
    assert of_weight.complete
    for i in spread(of_weight, 5):
        angle, omega = of_weight.values[i]
        branch = ff.frequency_response(drawn.replace(deck_angle=float(angle)), (60.0, 100.0))
        alone = branch.points_of("period doubling")
        close(f"at {math.degrees(angle)}", omega, nearest(alone, omega), abs=1e-6)
    narrow = ff.continue_bifurcation(
        ff.frequency_response(drawn, (60.0, 100.0)).points_of("period doubling")[1],
        ("deck_angle", "omega"), ((ANGLES[0], math.radians(15.0)), (60.0, 100.0)),
    )  # fmt: skip
    ends = np.sort(narrow.omega[[0, -1]]) * RPM
    close("row 34", ends, [774.14, 787.90], abs=0.01)
    least = min(point.values[0] for point in of_weight.points_of("turning point"))
    for share, count in ((0.999, 0), (1.001, 2)):
        tilted = drawn.replace(deck_angle=share * least)
        branch = ff.frequency_response(tilted, (60.0, 100.0))
        assert len(branch.points_of("period doubling")) == count


def hard(forcing: float, stiffness: float) -> ff.MechanicalSystem:
    """One mass before a stop without damping."""
    stop = ff.ClearanceSpring([1.0], stiffness, 0.0, 1.0, math.inf)
    return ff.MechanicalSystem([[1.0]], [[0.06]], [[1.0]], (stop,), ff.HarmonicForce([forcing]))


def free_motion(stiffness: float, omega: float) -> ff.Orbit:
    """Its motion without contact."""
    found = ff.periodic_orbits(hard(0.5, stiffness), omega)
    return min(found, key=lambda orbit: orbit.amplitude(0))


@pytest.mark.parametrize(("omega", "limit"), [(1.3, 0.68), (1.6, 7.6)])
def test_depth_at_the_fold_of_a_hard_stop(omega: float, limit: float) -> None:
    """In the limit of stiffness the depth times k^2 is m^2 a / (8 G^2); two fields vary.

    Just beyond grazing the kick of the stop throws the mass back before it is deep: G < 0.
    """
    over_forcing = ff.continue_orbit(free_motion(100.0, omega), "forcing", (0.5, 8.0))
    fold = over_forcing.folds[0]
    names = STIFFNESS, "forcing"
    curve = ff.continue_bifurcation(fold, names, ((100.0, 1e4), (0.5, 8.0)))
    assert curve.complete
    A = np.array([[0.0, 1.0], [-1.0, -0.06]])
    values, vectors = np.linalg.eig(A * 2.0 * math.pi / omega)
    M0 = (vectors * np.exp(values) @ np.linalg.inv(vectors)).real
    G = np.linalg.inv(np.eye(2) - M0)[0, 1]
    assert G < 0.0
    law = omega**2 / (8.0 * G**2)
    end = int(np.argmax(curve.along(STIFFNESS)))
    stiffness = curve.along(STIFFNESS)[end]
    assert stiffness == 1e4
    depth = curve.orbit(end).stop_force_peak() / stiffness
    close("the law", depth * stiffness**2, law, rel=0.01)
    close("its value", law, limit, rel=0.01)
    factor = curve.along("forcing") * fold.value  # the curve counts from the fold's own machine
    for hardness in (150.0, 250.0, 350.0):
        i = int(np.abs(curve.along(STIFFNESS) - hardness).argmin())
        alone = ff.continue_orbit(free_motion(float(curve.along(STIFFNESS)[i]), omega),
                                  "forcing", (0.5, 8.0)).folds[0]  # fmt: skip
        close("fold over the forcing", factor[i], alone.value, rel=1e-7)


def test_grazing_is_where_the_linear_motion_meets_the_gap(screen, exact) -> None:
    """Contact begins where the amplitude without contact is the gap."""
    begin = exact.points_of("contact begin")[0]
    curve = ff.continue_bifurcation(begin, ("clearance", "omega"), ((2e-3, 9e-3), (40.0, 120.0)))
    assert curve.kind == "grazing"
    assert curve.complete
    linear = ff.linear_response(screen, curve.omega)
    close("amplitude", linear.amplitude("relative"), curve.along("clearance"), rel=1e-9)


def test_the_loss_of_symmetry_over_the_gap(response) -> None:
    """Rows 25 and 28: windows at gaps of 2 and 3 mm; none from 4 mm on."""
    point = response(None, (50.0, 65.0), clearance=2e-3).points_of("symmetry breaking")[0]
    curve = ff.continue_bifurcation(point, ("clearance", "omega"), ((2e-3, 5e-3), (40.0, 110.0)))
    assert curve.complete
    close("at 2 mm", np.sort(curve.omega[[0, -1]]), [56.9837, 58.4409], abs=1e-3)
    close("both ends", curve.along("clearance")[[0, -1]], [2e-3, 2e-3], abs=0.0)
    widest = max(point.values[0] for point in curve.points_of("turning point"))
    assert 3e-3 < widest < 4e-3
    for i in spread(curve, 3):
        gap, omega = curve.values[i]
        alone = response(None, (40.0, 110.0), clearance=float(gap))
        close(f"at {gap}", omega, nearest(alone.points_of("symmetry breaking"), omega), abs=1e-6)


def test_a_fold_hardly_beyond_a_grazing_is_followed(of_chain) -> None:
    """The chain's lower fold, a ten-thousandth of a percent of the gap deep; 1e-10 rad/s.

    At a stiffness of 100 its branch passes fold and grazing in one step and takes one for the
    other; at 30 and 60 both stand apart.
    """
    fold = min(of_chain.folds, key=lambda point: point.omega)
    for bounds in ((30.0, 100.0), (60.0, 100.0)):
        curve = ff.continue_bifurcation(fold, (STIFFNESS, "omega"), (bounds, (0.5, 0.9)))
        assert curve.complete
        assert curve.notes == ()
        close("multiplier", np.abs(curve.multipliers - 1.0).min(axis=1),
              np.zeros(len(curve.orbits)), abs=1e-5)  # fmt: skip
        alone = ff.frequency_response(chain(bounds[0]), (0.5, 0.8)).folds
        (end,) = curve.omega[curve.along(STIFFNESS) == bounds[0]]
        close("fold", end, min(point.omega for point in alone), abs=1e-10)
    branch = ff.continue_fold(fold, STIFFNESS, (60.0, 100.0))
    close("over the field", branch.omega[branch.values == 60.0], [end], abs=1e-12)


def test_a_fold_at_a_corner_is_a_grazing() -> None:
    """Under a law that pushes at once the branch turns back where contact begins.

    The curve is that of the linear motion which just reaches the gap, whatever the stiffness.
    """
    stop = ff.ClearanceSpring([1.0], 20.0, 2.0, 1.0, math.inf, law="compression-only")
    machine = ff.MechanicalSystem([[1.0]], [[0.06]], [[1.0]], (stop,), ff.HarmonicForce([0.5]))
    (free,) = (o for o in ff.periodic_orbits(machine, 1.3) if o.amplitude(0) < 1.0)
    fold = ff.continue_orbit(free, "forcing", (0.5, 3.0)).folds[0]
    curve = ff.continue_bifurcation(fold, (STIFFNESS, "forcing"), ((10.0, 40.0), (0.5, 3.0)))
    assert curve.complete
    assert "grazing" in curve.notes[0]
    reach = ff.linear_response(machine, 1.3).amplitude(0)[0]
    factor = curve.along("forcing") * fold.value
    close("forcing", factor, np.full(len(curve.orbits), 1.0 / reach), rel=1e-9)


def test_bounds_of_both_parameters_are_met(exact) -> None:
    """The curve ends on whichever is met first, to the last digit, in either order of names."""
    bounds = {"clearance": (5.5e-3, 7e-3), "omega": (190.0, 207.5)}
    ends = []
    for names in (("clearance", "omega"), ("omega", "clearance")):
        limits = tuple(bounds[name] for name in names)
        curve = ff.continue_bifurcation(exact.folds[0], names, limits)
        assert curve.complete
        ends.append(sorted(zip(curve.omega[[0, -1]], curve.along("clearance")[[0, -1]],
                               strict=True)))  # fmt: skip
        for omega, gap in ends[-1]:
            assert omega in bounds["omega"] or gap in bounds["clearance"]
        assert any(omega in bounds["omega"] for omega, _ in ends[-1])
        close("omega", curve.along("omega"), curve.omega, abs=0.0)
    close("the same curve", ends[0], ends[1], rel=1e-12)


def test_bad_input(exact, of_chain) -> None:
    fold, bounds = exact.folds[0], ((5e-3, 7e-3), (150.0, 250.0))
    for point, names, limits in (
        (fold, ("clearance", "clearance"), bounds), (fold, ("clearance",), bounds),
        (fold, ("clearance", "colour"), bounds), (fold, ("clearance", "omega"), bounds[:1]),
        (fold, ("clearance", "omega"), ((7e-3, 8e-3), bounds[1])),
        (fold, ("clearance", "omega"), (bounds[0], (-1.0, 250.0))),
        (fold, ("clearance_minus", "omega"), bounds), (exact.peak("main"), ("clearance", "omega"),
        bounds), (of_chain.folds[0], ("clearance", "omega"), bounds), (fold.orbit,
        ("clearance", "omega"), bounds),
    ):  # fmt: skip
        with pytest.raises(ff.InputError):
            ff.continue_bifurcation(point, names, limits)


@dataclass(frozen=True)
class DampedStop:
    """One mass before a damped stop on one side: a third contact ends its curve of folds."""

    gap: float = 0.4

    def system(self) -> ff.MechanicalSystem:
        """The machine."""
        stop = ff.ClearanceSpring([1.0], 30.0, 1.0, self.gap, np.inf)
        return ff.MechanicalSystem([[1.0]], [[0.06]], [[1.0]], (stop,), ff.HarmonicForce([0.5]))


def test_a_curve_that_meets_a_grazing_ends_there_and_says_so():
    fold = ff.frequency_response(DampedStop(), (0.4, 1.0)).folds[0]
    curve = ff.continue_fold(fold, "gap", (0.2, 0.6))
    assert curve.status is ff.BranchStatus.MEETS_GRAZING
    assert curve.status.complete
    for k in (0, -1):
        gap, orbit = curve.values[k], curve.orbits[k]
        x = orbit.displacement(0, np.linspace(0.0, orbit.period, 20_001))
        tops = x[1:-1][(x[1:-1] > x[:-2]) & (x[1:-1] >= x[2:])]
        lasting = (c for c in orbit.contact_intervals if c.end - c.start > 1e-4 * orbit.period)
        assert len(list(lasting)) == 2
        # The third summit hardly touches, or hardly not: rounding chooses the last step's end.
        assert np.sort(np.abs(tops - gap))[0] < 1e-4 * gap
        assert tops.max() > gap


def leaning(forcing: float = 1.0) -> ff.MechanicalSystem:
    """Two masses, the outer one between damped stops and pulled to one side."""
    stop = ff.ClearanceSpring([-1.0, 1.0], 79.0, 1.62, 1.776, 2.471)
    return ff.MechanicalSystem(
        np.diag([2.5, 1.45]), [[2.46, -0.273], [-0.273, 0.273]], [[3.42, -0.379], [-0.379, 0.379]],
        (stop,), ff.HarmonicForce([0.0, forcing * np.exp(-1.643j)]), static_force=[0.116, -0.689],
    )  # fmt: skip


def test_a_fold_hardly_beyond_a_grazing_of_a_lower_summit_is_followed() -> None:
    """A summit that is not the highest of its turn touches by a millionth; single branches.

    The curve passes a cusp and then runs along that grazing, of motions on a detached branch.
    """
    fold = max(ff.frequency_response(leaning(), (0.55, 0.75)).folds, key=lambda one: one.omega)
    curve = ff.continue_fold(fold, "forcing", (0.9, 1.2))
    assert curve.status is ff.BranchStatus.FOLLOWED
    assert len(curve.orbits) < 600
    assert [point.kind for point in curve.special_points] == ["cusp"]
    lower = int(np.argmin(curve.omega[[0, -1]])) * (len(curve.orbits) - 1)
    for i in (lower, abs(lower - 20)):
        omega, value = float(curve.omega[i]), float(curve.values[i])
        beside = ff.periodic_orbits(leaning(value), (1.0 + 2e-5) * omega)
        size = curve.orbits[i].amplitude(0)
        stable = min((o for o in beside if o.stable), key=lambda o: abs(o.amplitude(0) - size))
        alone = ff.continue_orbit(stable, "omega", (0.97 * omega, 1.03 * omega))
        close("fold", omega, nearest(alone.folds, omega), abs=1e-10)
        t = np.linspace(0.0, curve.orbits[i].period, 20_001)
        y = curve.orbits[i].displacement(1, t) - curve.orbits[i].displacement(0, t)
        summits = np.concatenate([tops(y) - 1.776, tops(-y) - 2.471])
        assert 0.0 < summits[summits > 0.0].min() < 1e-5 < summits.max()


def tops(y: np.ndarray) -> np.ndarray:
    """Summits of samples."""
    return y[1:-1][(y[1:-1] > y[:-2]) & (y[1:-1] >= y[2:])]


def test_a_curve_that_meets_a_valley_within_a_contact_goes_on() -> None:
    """Three masses: within the outer one's contact a valley comes back to the gap."""
    K = np.array([[3.6, -1.37, 0.0], [-1.37, 3.6, -2.23], [0.0, -2.23, 2.23]])
    stops = (
        ff.ClearanceSpring([0.0, 1.0, 0.0], 9.55, 4.72, 0.719, math.inf),
        ff.ClearanceSpring([1.0, 0.0, 0.0], 180.9, 0.0, 0.224, math.inf),
        ff.ClearanceSpring([0.0, 0.0, 1.0], 27.16, 0.164, 0.969),
    )

    def folds(forcing: float) -> tuple[ff.SpecialPoint, ...]:
        force = ff.HarmonicForce(forcing * np.array([-0.642 + 0.767j, 0.0, 0.0]))
        machine = ff.MechanicalSystem(np.diag([3.2, 3.26, 0.304]), 0.362 * K, K, stops, force)
        return ff.frequency_response(machine, (0.5, 0.7)).folds

    fold = min(folds(1.0), key=lambda one: abs(one.omega - 0.5957))
    curve = ff.continue_fold(fold, "forcing", (0.7, 1.3))
    assert curve.status is ff.BranchStatus.FOLLOWED
    # It turns back at the corner, too: rounding chooses whether a point of the curve stands there.
    assert [point.kind for point in curve.special_points].count("cusp") == 1
    close("ends", np.sort(curve.values[[0, -1]]), [0.7, 1.3], rel=1e-12)
    for i in np.linspace(0, len(curve.orbits) - 1, 5).astype(int):
        alone = nearest(folds(float(curve.values[i])), float(curve.omega[i]))
        close("fold", curve.omega[i], alone, rel=1e-9)


@pytest.mark.parametrize(("field", "bounds"), [("forcing", (0.5, 2.0)),
                                               ("springs[0].stiffness", (19.0, 75.0))])  # fmt: skip
def test_a_curve_that_meets_a_moment_without_contact_ends_there(field, bounds) -> None:
    """Two masses: the stop opens for a moment, or the way out of it just comes back to the gap."""
    K = np.array([[3.166, -1.5255], [-1.5255, 1.5255]])
    stop = ff.ClearanceSpring([1.0, 0.0], 37.63, 3.383, 2.2187, math.inf, law="compression-only")
    machine = ff.MechanicalSystem(
        np.diag([2.288, 2.823]), 0.043485 * K, K, (stop,), ff.HarmonicForce([-0.473 + 0.881j, 0.0])
    )
    folds = ff.frequency_response(machine, (0.3, 0.6)).folds
    curve = ff.continue_fold(max(folds, key=lambda one: one.omega), field, bounds)
    assert curve.status is ff.BranchStatus.MEETS_GRAZING
    for value, orbit in zip(
        curve.values[[0, -1]], (curve.orbits[0], curve.orbits[-1]), strict=True
    ):
        if value not in bounds:
            y = orbit.displacement(0, np.linspace(0.0, orbit.period, 200_001)) - 2.2187
            assert np.abs([*tops(y), *tops(-y)]).min() < 1e-7


@pytest.mark.parametrize("names", [("eccentric_moment", "stop_stiffness"),
                                   ("stop_stiffness", "eccentric_moment")])  # fmt: skip
def test_either_parameter_may_stand_first(screen, exact, names) -> None:
    """Before a contact the stop's stiffness moves nothing: the curve is a line beside it."""
    point = exact.points_of("contact begin")[-1]
    bounds = [(0.5 * getattr(screen, name), 2.0 * getattr(screen, name)) for name in names]
    curve = ff.continue_bifurcation(point, names, bounds)
    assert curve.status is ff.BranchStatus.FOLLOWED
    values = curve.values[:, names.index("eccentric_moment")]
    close("moment", values, np.full(values.size, screen.eccentric_moment), rel=1e-9)
    assert np.ptp(curve.values[:, names.index("stop_stiffness")]) == pytest.approx(
        1.5 * screen.stop_stiffness
    )


@dataclass(frozen=True)
class TwoStops:
    """One mass between two stops, of which the one that is met has equal gaps."""

    mass: float = 1.0

    def system(self) -> ff.MechanicalSystem:
        """The machine."""
        far = ff.ClearanceSpring([1.0], 1.5, 0.87, 61.0, 63.3)
        near = ff.ClearanceSpring([1.0], 9.45, 0.0, 41.07, law="undamped-rebound")
        return ff.MechanicalSystem(
            [[self.mass]], [[0.0245]], [[4.04]], [far, near], ff.Unbalance([1.0])
        )


def test_both_sides_that_graze_all_along_are_no_second_grazing() -> None:
    point = ff.frequency_response(TwoStops(), (0.711, 3.1)).points_of("contact end")[-1]
    curve = ff.continue_bifurcation(point, ("omega", "mass"), ((0.42, 4.03), (0.4, 2.0)))
    assert curve.status is ff.BranchStatus.FOLLOWED
    assert not curve.points_of("two grazings")
    assert not curve.notes


def test_a_fold_that_meets_that_without_a_touch_turns_back_there() -> None:
    """At 3.437 mm a fold with the second side's touch meets the one without; single branches."""
    screen = ff.FlipFlowScreen(
        main_mass=514.5, floating_mass=167.6, eccentric_moment=0.9312, isolation_stiffness=377.2e3,
        isolation_damping=1711.0, shear_stiffness=515.4e3, shear_damping=1276.4,
        stop_stiffness=9.86e6, stop_damping=2692.0, clearance=2.08e-3, clearance_minus=10.41e-3,
    )  # fmt: skip

    def folds(gap: float) -> tuple[ff.SpecialPoint, ...]:
        return ff.frequency_response(screen.replace(clearance=gap), (20.0, 300.0)).folds

    curve = ff.continue_fold(folds(2.08e-3)[-1], "clearance", (2.08e-3, 5.55e-3))
    assert curve.status is ff.BranchStatus.FOLLOWED
    assert curve.values.size < 1000
    turn = int(np.argmax(curve.values * (curve.values < 4e-3) * (curve.omega > 100.0)))
    meets, speed = float(curve.values[turn]), float(curve.omega[turn])
    close("where they meet", meets, 3.4374e-3, rel=1e-4)
    for gap, count in ((0.99 * meets, 2), (1.01 * meets, 0)):
        assert sum(abs(fold.omega - speed) < 0.5 for fold in folds(gap)) == count, gap
    for i in np.linspace(0, curve.values.size - 1, 7).astype(int):
        alone = nearest(folds(float(curve.values[i])), float(curve.omega[i]))
        close("fold", curve.omega[i], alone, rel=1e-9)


def test_no_turn_where_a_parameter_has_no_part() -> None:
    """A stop that is not touched moves no fold, whose speed then stands still but for rounding."""
    first = ff.ClearanceSpring([1.0, 0.0], 100.0, 1.0, 1.0, np.inf)
    other = ff.ClearanceSpring([1.0, 0.0], 100.0, 1.0, np.inf, 1.6)
    machine = ff.MechanicalSystem(
        np.eye(2), 0.03 * K, K, (first, other), ff.HarmonicForce([0.0, 0.1])
    )
    fold = min(ff.frequency_response(machine, (0.5, 0.8)).folds, key=lambda one: one.omega)
    gap = "springs[1].clearance_minus"
    curve = ff.continue_bifurcation(fold, (gap, "omega"), ((0.7, 4.0), (0.4, 0.9)))
    touched = curve.along(gap) < 1.0 + 1e-6
    assert touched.any()
    close("speed", np.ptp(curve.omega[~touched]), 0.0, abs=1e-12)
    turns = [one.values[0] for one in curve.points_of("turning point")]
    assert all(value < 1.0 + 1e-6 for value in turns), turns


BESIDE = {
    "an equal stop": ff.ClearanceSpring([1.0], 3.0, 0.2, 2.0),
    "a stop on one side, far off": ff.ClearanceSpring([1.0], 5.0, 0.3, 50.0, np.inf),
}


@pytest.mark.parametrize("law", ["paper", "compression-only", "undamped-rebound", "elasto-gap"])
@pytest.mark.parametrize("beside", BESIDE)
def test_gaps_that_are_grazed_at_once(law, beside) -> None:
    """The curve crept along the corner of the other gap, up to the limit of points."""
    stops = ff.ClearanceSpring([1.0], 5.0, 0.3, 2.0, law=law), BESIDE[beside]
    machine = ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], stops, ff.HarmonicForce([0.5]))
    point = ff.frequency_response(machine, (0.3, 1.6)).points_of("contact begin")[0]
    curve = ff.continue_bifurcation(point, ("forcing", "omega"), ((0.8, 2.0), (0.3, 1.6)))
    assert curve.complete
    assert len(curve.orbits) < 500
    forcing, omega = curve.values.T
    size = 0.5 * forcing / np.abs(1.0 - omega**2 + 0.1j * omega)
    close("amplitude along the curve", size, np.full_like(size, 2.0), rel=1e-10)


def test_gaps_that_are_grazed_at_once_at_the_start_alone() -> None:
    """With a smaller gap on the other side the motion touches there before."""
    stop = ff.ClearanceSpring([1.0], 5.0, 0.3, 2.0)
    machine = ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], (stop,), ff.HarmonicForce([0.5]))
    point = ff.frequency_response(machine, (0.3, 1.6)).points_of("contact begin")[0]
    names, bounds = ("springs[0].clearance_minus", "omega"), ((1.0, 3.0), (0.3, 1.6))
    curve = ff.continue_bifurcation(point, names, bounds)
    assert curve.complete
    other, omega = curve.values.T
    close("ends", sorted(other[[0, -1]]), [1.0, 3.0], rel=1e-9)
    alone = omega[other >= 2.0]
    close("untouched on the other side", alone, np.full_like(alone, point.omega), rel=1e-9)
    assert omega[other < 1.9].min() > point.omega


@pytest.mark.parametrize(
    ("name", "bounds"), [("springs[0].stiffness", (15.0, 60.0)), ("forcing", (0.8, 1.2))]
)
def test_a_doubling_at_which_multipliers_jump_is_a_grazing(name, bounds) -> None:
    """A law that kicks on entry: no motion has the multiplier -1 where the stop begins to act."""
    stop = ff.ClearanceSpring([1.0], 30.0, 2.0, 1.0, np.inf, law="compression-only")
    machine = ff.MechanicalSystem([[1.0]], [[0.06]], [[1.0]], [stop], ff.HarmonicForce([5.76]))
    branch = ff.frequency_response(machine, (2.2, 4.0))
    point = branch.points_of("period doubling")[-1]
    assert np.abs(point.orbit.multipliers + 1.0).min() > 0.1
    curve = ff.continue_bifurcation(point, (name, "omega"), (bounds, (2.0, 5.0)))
    assert curve.status is ff.BranchStatus.FOLLOWED
    assert curve.special_points == ()
    assert "the curve is that of the grazing" in curve.notes[0]
    # Without contact the amplitude is the gap: F = ((1 - w^2)^2 + (c w)^2)^(1/2).
    force = 5.76 * (curve.along(name) if name == "forcing" else 1.0)
    free = np.hypot(1.0 - curve.omega**2, 0.06 * curve.omega)
    np.testing.assert_allclose(free, force, rtol=1e-9)
