"""Derivatives of motions, quantities, multipliers and special points: against differences.

Differences are those of whole motions, solved anew for machines beside the one at hand, by a
formula of fourth order. A derivative is asked for to 1e-7 of itself, and to 1e-8 of the largest
among the parameters, each taken in shares of its own value.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import get_args

import numpy as np
import pytest

import flipflow as ff
from flipflow.errors import IncompleteError
from flipflow.model.contact_law import ContactLaw
from flipflow.model.fields import MOTION_FIELDS
from flipflow.model.parameters import parameter_names, value_of, with_values
from flipflow.model.quantities import quantities_for
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.orbit import Orbit
from flipflow.studies.quantity_values import Working

pytestmark = [pytest.mark.numerical, pytest.mark.usefixtures("slopes_once")]
LAWS = get_args(ContactLaw)
STEP = 2e-5  # of a difference, as a share of the parameter
WIDE_STEP = 2e-4  # where rounding of what is read exceeds what lies beyond fourth order
SHARE, FLOOR = 1e-7, 1e-8
WEIGHTS = ((2, -1.0 / 12.0), (1, 2.0 / 3.0), (-1, -2.0 / 3.0), (-2, 1.0 / 12.0))
FIELDS = [*MOTION_FIELDS, "omega"]
REST = {
    "normal_stiffness": 630e3, "normal_damping": 9.8e3, "deck_angle": 0.3, "shear_height": 0.05,
    "shear_pieces": 12, "shear_conductance": 1.5, "stop_pieces": 4, "supports": 4, "bearings": 2,
    "rotating_mass": 45.0, "bearing_rating": 350e3, "clearance_measured": "drawn",
}  # fmt: skip
OF_QUANTITIES = [
    *FIELDS, "normal_stiffness", "normal_damping", "deck_angle", "shear_height",
    "shear_conductance", "rotating_mass", "bearing_rating", "bearing_load_factor",
    "bearing_life_exponent",
]  # fmt: skip
READINGS = ("amplitude", "mean", "phase", "mean_square_velocity")


@pytest.fixture(scope="module")
def leaning(screen) -> ff.FlipFlowScreen:
    """FFS0827 with unequal gaps, and a damping with which the laws differ."""
    return screen.replace(clearance_minus=5.5e-3, stop_damping=20e3)


def size_of(orbit: Orbit, name: str) -> float:
    return abs(orbit.omega if name == "omega" else float(value_of(orbit.machine, name)))


def beside(orbit: Orbit, name: str, share: float) -> Orbit:
    """The motion of a machine with another value of one parameter, or at another speed."""
    machine, omega, size = orbit.machine, orbit.omega, size_of(orbit, name)
    if name == "omega":
        omega += share * size
    else:
        machine = with_values(machine, {name: value_of(machine, name) + share * size})
    solver = ExactSolver(machine.system(), half_turn=False, turns=orbit.periods)
    point = solver.solve(orbit.state, omega)
    assert point is not None, f"no motion beside with {name}"
    return Orbit(machine, point)


def differences(orbit: Orbit, names, readings, step: float = STEP) -> list[np.ndarray]:
    """Derivatives of several readings, the parameters last, each in shares of its own value."""
    found = [[] for _ in readings]
    for name in names:
        moved = [(beside(orbit, name, at * step), weight / step) for at, weight in WEIGHTS]
        for column, read in zip(found, readings, strict=True):
            column.append(sum(weight * np.asarray(read(one)) for one, weight in moved))
    return [np.stack(column, axis=-1) for column in found]


def multipliers_like(orbit: Orbit):
    """Multipliers in the order of those of an orbit beside."""

    def read(other: Orbit) -> np.ndarray:
        left = list(other.multipliers)
        return np.array([left.pop(int(np.abs(np.array(left) - mu).argmin()))
                         for mu in orbit.multipliers])  # fmt: skip

    return read


def judge(what: str, orbit: Orbit, names, got: np.ndarray, expected: np.ndarray) -> None:
    """Derivatives with the parameters last against differences in shares of the parameters."""
    got = got * np.array([size_of(orbit, name) for name in names])
    off = np.abs(got - expected).reshape(-1, len(names)).max(axis=0)
    size = np.abs(expected).reshape(-1, len(names)).max(axis=0)
    bad = off > SHARE * size + FLOOR * size.max()
    assert not bad.any(), (
        f"{what}: {[names[k] for k in np.flatnonzero(bad)]}, off {off[bad]} of {size[bad]}"
    )


def check(orbit: Orbit, names=None) -> None:
    """State and multipliers, with respect to all parameters or some."""
    names = [*parameter_names(orbit.machine), "omega"] if names is None else names
    scale = np.repeat([1.0, orbit.omega], orbit.system.size)
    readings = (lambda one: one.state / scale), multipliers_like(orbit)
    state, multipliers = differences(orbit, names, readings)
    got = orbit.sensitivity("state", names) / scale[:, None]
    judge("state", orbit, names, got, state)
    judge("multipliers", orbit, names, orbit.sensitivity("multipliers", names), multipliers)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("omega", [120.0, 203.0])
def test_every_field_of_an_asymmetric_screen(leaning, law, omega) -> None:
    """At 203 rad/s on all motions between the folds, the unstable one too."""
    for orbit in ff.periodic_orbits(leaning.replace(stop_law=law), omega):
        check(orbit, FIELDS)


def symmetric(machine, omega: float) -> Orbit:
    """The motion that is its own mirror image, solved over half a turn."""
    (orbit,) = ff.frequency_response(machine, (0.9 * omega, 1.1 * omega)).orbits_at(omega)
    assert orbit.point.formulation.half_turn
    return orbit


@pytest.mark.parametrize("law", LAWS)
def test_every_field_of_a_symmetric_screen(screen, law) -> None:
    """Half a turn tells what keeps the symmetry; deck angle and a drawn gap break it."""
    machine = screen.replace(stop_law=law, stop_damping=20e3, deck_angle=None)
    orbit = symmetric(machine, 120.0)
    check(orbit, [name for name in FIELDS if name != "clearance_minus"])
    drawn = machine.replace(deck_angle=0.0, clearance_measured="drawn")
    orbit = symmetric(drawn, 120.0)
    step = 1e-5
    ahead, behind = (
        ExactSolver(drawn.replace(deck_angle=angle).system(), half_turn=False)
        .solve(orbit.state, 120.0).u
        for angle in (step, -step)
    )  # fmt: skip
    (got,) = orbit.sensitivity("state", ["deck_angle"]).T
    expected = (ahead - behind) / (2.0 * step)
    scale = np.array([1.0, 1.0, 120.0, 120.0])
    assert np.abs((got - expected) / scale).max() < SHARE * np.abs(expected / scale).max()


def test_motions_of_three_periods(screen) -> None:
    """At 450 rad/s, stable and unstable."""
    several = [one for one in ff.periodic_orbits(screen, 450.0, 3) if one.periods == 3]
    assert len(several) >= 2
    for orbit in several:
        check(orbit, [name for name in FIELDS if name != "clearance_minus"])


@dataclass(frozen=True)
class Rotor:
    """Two coupled masses between two stops: every kind of force, every place of a parameter."""

    mass: float = 1.0
    other_mass: float = 2.3
    coupling: float = 0.2
    spring: float = 1.0
    cross: float = 0.6
    damper: float = 0.05
    other_damper: float = 0.07
    gyroscopic: float = 0.08
    stop: float = 9.0
    stop_damper: float = 0.25
    gap: float = 0.6
    other_gap: float = 0.45
    turned: float = 0.5
    force: float = 1.4
    base: float = 0.1
    weight: float = 0.12
    law: str = "paper"

    def system(self) -> ff.MechanicalSystem:  # noqa: D102  of every machine
        springs = (
            ff.ClearanceSpring(
                [math.cos(self.turned), math.sin(self.turned)], self.stop, self.stop_damper,
                self.gap, 1.2 * self.gap, self.law,
            ),
            ff.ClearanceSpring(
                [1.0, -self.turned**2], 0.5 * self.stop, 2.0 * self.stop_damper, self.other_gap,
                math.inf, self.law,
            ),
        )  # fmt: skip
        excitation = (
            ff.HarmonicForce([self.force, 0.2j * self.force]),
            ff.MovingBase(self.base * (1 + 0.3j), [0.0, self.cross], [0.0, self.damper], order=2),
            ff.Unbalance([0.0, 0.1 * self.force * self.mass]),
        )
        g, k = self.gyroscopic, self.cross
        return ff.MechanicalSystem(
            [[self.mass, self.coupling], [self.coupling, self.other_mass]],
            [[self.damper, g], [-g, self.other_damper]],
            [[self.spring + k, -0.8 * k], [-0.7 * k, k]],
            springs, excitation, static_force=[self.weight, -0.3 * self.weight],
        )  # fmt: skip


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("omega", [0.9, 1.3])
def test_a_motion_against_two_stops(law, omega) -> None:
    """Masses, gyroscopic and moving-base terms, a direction, a constant force."""
    orbit = ff.periodic_orbits(Rotor(law=law), omega)[0]
    assert {touch.spring for touch in orbit.contact_intervals} == {0, 1}
    check(orbit)


def random_machine(seed: int) -> ff.MechanicalSystem:
    """Two to four masses, one to three stops of all laws, some preloaded or one-sided."""
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(2, 5)), int(rng.integers(1, 4))
    shape = rng.normal(size=(3, n, n))
    M, C, K = (np.eye(n) + 0.15 * one @ one.T for one in shape)
    springs = [
        ff.ClearanceSpring(
            rng.normal(size=n), rng.uniform(2.0, 10.0), rng.uniform(0.1, 0.4),
            rng.uniform(0.2, 0.6), (rng.uniform(0.2, 0.6), math.inf)[int(rng.integers(2))],
            LAWS[int(rng.integers(4))],
        )
        for _ in range(m)
    ]  # fmt: skip
    force = ff.HarmonicForce(rng.normal(size=n) + 1j * rng.normal(size=n))
    return ff.MechanicalSystem(
        M, 0.15 * C, K, springs, force, static_force=0.1 * rng.normal(size=n)
    )


@pytest.mark.parametrize("seed", range(12))
def test_random_machines(seed) -> None:
    """Plain systems: springs, gaps, the forcing, the speed."""
    machine = random_machine(seed)
    orbit = ff.periodic_orbits(machine, 1.1)[0]
    names = [
        name
        for name in (*parameter_names(machine), "omega")
        if name == "omega" or math.isfinite(value_of(machine, name))
    ]
    assert orbit.contact_intervals
    check(orbit, names)


@pytest.mark.parametrize(
    ("law", "omega"), [*((law, 120.0) for law in LAWS), ("paper", 60.0), ("paper", 201.0)]
)
def test_every_quantity(leaning, law, omega) -> None:
    """The table of a screen and all readings of an orbit; with and without contact."""
    machine = leaning.replace(**REST, stop_law=law)
    orbit = ff.periodic_orbits(machine, omega)[0]
    table = [q for q in quantities_for(machine).values() if q.of == "motion" and not q.of_folds]
    reads = {q.name: (lambda one, q=q: Working(one.machine, one).value_of(q)) for q in table}
    for part in READINGS:
        for which in ("main", "floating", "relative"):
            reads[part, which] = lambda one, part=part, which=which: getattr(one, part)(which)
    reads["contact_share", 0] = Orbit.contact_share
    reads["stop_force_peak", 0] = Orbit.stop_force_peak
    expected = differences(orbit, OF_QUANTITIES, list(reads.values()), WIDE_STEP)
    for (what, read), slope in zip(reads.items(), expected, strict=True):
        got = orbit.sensitivity(what, OF_QUANTITIES)
        sizes = np.array([size_of(orbit, name) for name in OF_QUANTITIES])
        off, size = np.abs(got * sizes - slope), max(np.abs(slope).max(), abs(float(read(orbit))))
        # A mean is what is left of two extremes of the motion's size.
        of_mean = "relative" if what == "relative_offset" else what[0] == "mean" and what[1]
        floor = FLOOR * max(size, orbit.amplitude(of_mean) if of_mean else 0.0)
        assert np.all(off <= SHARE * np.abs(slope) + floor), f"{what}: {got * sizes} {slope}"


def test_quantities_of_a_motion_solved_over_half_a_turn(screen) -> None:
    """They are read over the whole of it."""
    orbit = symmetric(screen, 120.0)
    names = ["main_mass", "clearance", "stop_damping", "omega"]
    reads = {
        "main_amplitude": lambda one: one.amplitude("main"),
        "relative_phase": lambda one: one.phase("relative"),
        "stop_force": Orbit.stop_force_peak,
        ("contact_share", 0): Orbit.contact_share,
    }
    slopes = differences(orbit, names, list(reads.values()))
    for what, slope in zip(reads, slopes, strict=True):
        judge(str(what), orbit, names, orbit.sensitivity(what, names), slope)


def test_quantities_of_any_machine() -> None:
    """Names of the table for a plain machine, and a stop without gap."""
    machine = Rotor()
    orbit = ff.periodic_orbits(machine, 0.9)[0]
    names = [*parameter_names(machine), "omega"]
    reads = {
        "dissipated_power": Orbit.input_power,
        "amplitude[0]": lambda one: one.amplitude(0),
        "phase[1]": lambda one: one.phase(1),
        "stop_force": lambda one: max(one.stop_force_peak(j) for j in range(2)),
        ("stop_force_peak", 1): lambda one: one.stop_force_peak(1),
        ("contact_share", 1): lambda one: one.contact_share(1),
    }
    for (what, _), slope in zip(
        reads.items(), differences(orbit, names, list(reads.values())), strict=True
    ):
        judge(str(what), orbit, names, orbit.sensitivity(what, names), slope)


def test_a_stop_without_gap() -> None:
    """It stands in the matrices; its force knows its stiffness besides."""
    K, C = [[2.0, -1.0], [-1.0, 2.0]], [[0.1, 0.0], [0.0, 0.1]]
    springs = (
        ff.ClearanceSpring([1.0, 0.0], 1.5, 0.05, 0.0),
        ff.ClearanceSpring([0.0, 1.0], 3.0, 0.1, 0.4),
    )
    machine = ff.MechanicalSystem(np.eye(2), C, K, springs, ff.HarmonicForce([1.0, 0.3]))
    orbit = ff.periodic_orbits(machine, 1.2)[0]
    names = ["springs[0].stiffness", "springs[0].damping", "springs[1].clearance", "forcing"]
    check(orbit, names)
    (slope,) = differences(orbit, names, [lambda one: one.stop_force_peak(0)])
    judge("force", orbit, names, orbit.sensitivity(("stop_force_peak", 0), names), slope)
    assert not orbit.sensitivity(("contact_share", 0), names).any()
    with pytest.raises(ff.InputError, match="kink"):
        orbit.sensitivity("state", ["springs[0].clearance"])


@dataclass(frozen=True)
class Held:
    """A mass that only its stops hold, pressed on one of them, critically damped in contact."""

    mass: float = 1.0
    damper: float = 0.3
    stop: float = 4.0
    stop_damper: float = 3.7
    gap: float = 0.3
    weight: float = 0.25
    force: float = 0.8

    def system(self) -> ff.MechanicalSystem:  # noqa: D102  of every machine
        spring = ff.ClearanceSpring([1.0], self.stop, self.stop_damper, self.gap)
        return ff.MechanicalSystem(
            [[self.mass]], [[self.damper]], [[0.0]], [spring], ff.HarmonicForce([self.force]),
            static_force=[self.weight],
        )  # fmt: skip


@pytest.mark.parametrize("stop_damper", [3.6, 3.7 + 1e-6])
def test_nearly_equal_rates_and_a_machine_that_nothing_holds(stop_damper) -> None:
    """Quotients of nearly equal rates, rests of a machine that drifts: nothing is divided by."""
    orbit = ff.periodic_orbits(Held(stop_damper=stop_damper), 1.0)[0]
    assert orbit.contact_intervals
    check(orbit)


def test_exactly_critical_damping() -> None:
    """There the basis of modes keeps half of the digits: 1e-6."""
    orbit = ff.periodic_orbits(Held(), 1.0)[0]
    names = parameter_names(orbit.machine)
    (expected,) = differences(orbit, names, [lambda one: one.state])
    got = orbit.sensitivity("state", names) * [size_of(orbit, name) for name in names]
    assert np.abs(got - expected).max() < 1e-6 * np.abs(expected).max()


def special(machine, span, kind: str):
    return ff.frequency_response(machine, span).points_of(kind)


def judge_points(machine, span, kind: str, names, count: int, step: float = 1e-5) -> None:
    """Frequencies of special points against those of machines beside; 1e-7 of the largest."""
    points = special(machine, span, kind)
    assert len(points) == count
    sizes = np.array([abs(float(value_of(machine, name))) for name in names])
    expected = []
    for name, size in zip(names, sizes, strict=True):
        ahead, behind = (
            special(with_values(machine, {name: value_of(machine, name) + h}), span, kind)
            for h in (step * size, -step * size)
        )
        expected.append([(a.omega - b.omega) / (2.0 * step)
                         for a, b in zip(ahead, behind, strict=True)])  # fmt: skip
    for point, slope in zip(points, np.transpose(expected), strict=True):
        off = np.abs(point.sensitivity(names) * sizes - slope)
        assert np.all(off <= 3.0 * SHARE * np.abs(slope).max()), f"{point}: {off}, {slope}"


POINT_FIELDS = ["main_mass", "shear_stiffness", "shear_damping", "stop_stiffness", "clearance"]


@pytest.mark.parametrize(("kind", "count"), [("fold", 2), ("contact begin", 1), ("contact end", 1)])
def test_folds_and_contacts_of_the_screen(screen, kind, count) -> None:
    judge_points(screen, (60.0, 230.0), kind, POINT_FIELDS, count)


@pytest.mark.parametrize(("kind", "count"), [("fold", 2), ("period doubling", 4)])
def test_folds_and_doublings_of_a_leaning_screen(screen, kind, count) -> None:
    machine = screen.replace(clearance_minus=5.7e-3)
    judge_points(machine, (60.0, 245.0), kind, [*POINT_FIELDS, "clearance_minus"], count)


def test_loss_of_symmetry(screen) -> None:
    machine = screen.replace(clearance=2e-3)
    found = special(machine, (40.0, 70.0), "symmetry breaking")
    judge_points(machine, (40.0, 70.0), "symmetry breaking", POINT_FIELDS, len(found))
    drawn = machine.replace(deck_angle=0.0, clearance_measured="drawn")
    point = special(drawn, (40.0, 70.0), "symmetry breaking")[0]
    with pytest.raises(IncompleteError, match="loses a symmetry"):
        point.sensitivity(["deck_angle"])


@dataclass(frozen=True)
class Chain:
    """Row 24: two masses, a one-sided stop on the first."""

    stop: float = 100.0
    gap: float = 1.0
    damping: float = 0.03
    force: float = 0.1
    spring: float = 1.0

    def system(self) -> ff.MechanicalSystem:  # noqa: D102  of every machine
        k = self.spring
        K = np.array([[k, -k], [-k, 2.0 * k]])
        stop = ff.ClearanceSpring([1.0, 0.0], self.stop, 0.0, self.gap, math.inf)
        force = ff.HarmonicForce([0.0, self.force])
        return ff.MechanicalSystem(np.eye(2), self.damping * K, K, [stop], force)


def test_neimark_sacker_and_doublings_of_the_chain() -> None:
    """The points of row 30, by what a small change of the machine makes of them."""
    names = [field.name for field in dataclasses.fields(Chain)]
    for kind, near in (("Neimark-Sacker", 0.618606873), ("period doubling", 0.738783030)):
        found = {}
        for share in (0.0, 1e-5, -1e-5):
            for name in names if share else names[:1]:
                machine = dataclasses.replace(
                    Chain(), **{name: getattr(Chain(), name) * (1 + share)}
                )
                points = special(machine, (near - 0.01, near + 0.01), kind)
                found[share, name] = min(points, key=lambda one: abs(one.omega - near))
        sizes = np.array([getattr(Chain(), name) for name in names])
        got = found[0.0, names[0]].sensitivity(names) * sizes
        expected = np.array(
            [(found[1e-5, name].omega - found[-1e-5, name].omega) / 2e-5 for name in names]
        )
        assert np.all(np.abs(got - expected) <= 1e-6 * np.abs(expected).max()), (got, expected)


def test_at_grazing_a_kick_has_two_sides_and_the_papers_law_has_one(leaning) -> None:
    for law, smooth in (("paper", True), ("compression-only", False), ("undamped-rebound", False)):
        machine = leaning.replace(stop_law=law)
        point = special(machine, (60.0, 100.0), "contact begin")[0]
        if smooth:
            got = point.orbit.sensitivity("state", ["clearance", "main_mass", "omega"])
            apart = machine.replace(clearance=math.inf, clearance_minus=math.inf)
            free = ff.periodic_orbits(apart, point.omega)[0]
            expected = free.sensitivity("state", ["main_mass", "omega"])
            assert np.abs(got[:, 1:] - expected).max() < 1e-6 * np.abs(expected).max()
        else:
            with pytest.raises(IncompleteError, match="grazes stop 0"):
                point.orbit.sensitivity("state", ["clearance"])
        rough = ("multipliers", "largest_multiplier", "contact_share", "stop_approach_speed")
        for asked in (*rough, ("contact_share", 0)):
            with pytest.raises(IncompleteError, match="grazes stop 0"):
                point.orbit.sensitivity(asked, ["clearance"])


def test_at_a_fold_the_motion_moves_infinitely_fast(screen) -> None:
    fold = special(screen, (190.0, 220.0), "fold")[0]
    with pytest.raises(IncompleteError, match="fold"):
        fold.orbit.sensitivity("state", ["clearance"])


def test_two_peaks_of_one_height(screen) -> None:
    """One side's force rises where its own gap narrows, that of the other side does not."""
    (orbit,) = ff.periodic_orbits(screen.system(), 120.0)
    with pytest.raises(IncompleteError, match="as high"):
        orbit.sensitivity("stop_force", ["springs[0].clearance_minus"])
    both = orbit.sensitivity("stop_force", ["springs[0].clearance"])
    assert both[0] == pytest.approx(
        ff.periodic_orbits(screen, 120.0)[0].sensitivity("stop_force", ["clearance"])[0], rel=1e-9
    )


def test_the_order_of_names_is_that_of_the_answer(screen) -> None:
    (orbit,) = ff.periodic_orbits(screen, 120.0)
    names = ["omega", "clearance", "main_mass"]
    got = orbit.sensitivity("relative_amplitude", names)
    each = [orbit.sensitivity("relative_amplitude", [name])[0] for name in names]
    assert got.tolist() == pytest.approx(each, rel=1e-12)
    assert got.shape == (3,)
    assert orbit.sensitivity("state", names).shape == (4, 3)
    assert orbit.sensitivity("multipliers", names).shape == (4, 3)


@pytest.mark.parametrize(
    ("quantity", "names", "word"),
    [
        ("nothing", ["clearance"], "quantity"),
        ("jump_margin", ["clearance"], "quantity"),
        ("omega_lb", ["clearance"], "quantity"),
        ("throw_number", ["clearance"], "missing in"),
        (("amplitude", "sideways"), ["clearance"], "coordinate"),
        (("contact_share", 3), ["clearance"], "spring"),
        ("state", ["nothing"], "field"),
        ("state", [], "names"),
        ("state", "clearance", "names"),
        ("state", ["clearance_minus"], "finite value"),
        ("state", ["stop_pieces"], "field"),
    ],
)
def test_what_cannot_be_asked(screen, quantity, names, word) -> None:
    (orbit,) = ff.periodic_orbits(screen.replace(deck_angle=None), 120.0)
    with pytest.raises(ff.InputError, match=word):
        orbit.sensitivity(quantity, names)


def test_what_has_no_derivative(screen) -> None:
    rough = ff.frequency_response(screen, (100.0, 121.0), ff.HarmonicBalance(3))
    with pytest.raises(ff.InputError, match="exact motions"):
        rough.orbit(0).sensitivity("state", ["clearance"])
    undamped = screen.replace(stop_damping=0.0, stop_law="undamped-rebound")
    (orbit,) = ff.periodic_orbits(undamped, 120.0)
    orbit.sensitivity("state", ["clearance"])
    with pytest.raises(ff.InputError, match="damping"):
        orbit.sensitivity("state", ["stop_damping"])
    fold = special(screen, (190.0, 220.0), "fold")[0]
    with pytest.raises(ff.InputError, match="omega"):
        fold.sensitivity(["omega"])


@pytest.mark.parametrize("clearance", [0.6, 3.0])
def test_the_phase_of_the_force_changes_no_derivative(clearance):
    """Also where a summit stands at the end of the period, beside its own other end."""
    stop = (ff.ClearanceSpring([1.0], 3.0, 0.2, clearance),)
    names = ["springs[0].stiffness", "forcing", "omega"]

    def machine(phase):
        force = ff.HarmonicForce([0.5 * np.exp(1j * phase)])
        return ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], stop, force)

    first = ff.periodic_orbits(machine(0.0), 1.3)[0]
    wanted = first.sensitivity(("amplitude", 0), names)
    top = first.t[np.argmax(first.displacement(0))] * first.omega
    for phase in top + np.linspace(-0.02, 0.02, 20):
        found = ff.periodic_orbits(machine(phase), 1.3)[0]
        assert found.sensitivity(("amplitude", 0), names) == pytest.approx(wanted, rel=1e-9)


# States at t = 0 of motions of three periods, all unstable: a search finds them or not.
OF_THREE_PERIODS = (
    (0.0776933, -0.3737119, 0.1996758, 0.5213726, 1.4718805, -2.268271, 0.3937275, 0.6397192),
    (0.0691937, -0.3831653, 0.1927975, 0.5325574, 1.4725124, -2.2561468, 0.3881319, 0.6463147),
    (0.0741349, -0.3722761, 0.1792921, 0.5353566, 1.4819046, -2.2360786, 0.4045111, 0.6411217),
    (0.0842347, -0.3577915, 0.180384, 0.5249294, 1.4843367, -2.2390509, 0.4209314, 0.6329924),
)


def test_a_summit_just_beyond_a_change_of_contact():
    """Rounding decides which of two samples of one moment, before and after it, is higher."""
    machine, omega = random_machine(50029), 1.0706425372248596
    names = ["forcing", "omega"]
    solver = ExactSolver(machine, half_turn=False, turns=3)
    points = [solver.solve(np.array(state), omega) for state in OF_THREE_PERIODS]
    assert None not in points
    for point in points:
        orbit = Orbit(machine, point)
        turns = orbit.displacement(0, 2.0 * np.pi / omega * np.arange(3))
        assert np.abs(np.diff(turns)).min() > 1e-3
        (slope,) = differences(orbit, names, [lambda one: one.amplitude(0)], 1e-6)
        sizes = np.array([size_of(orbit, name) for name in names])
        assert orbit.sensitivity(("amplitude", 0), names) * sizes == pytest.approx(slope, rel=1e-5)


def test_a_doubling_at_a_corner_has_no_derivative() -> None:
    """A second touch grazes where multipliers jump past -1: none is -1 there."""
    stop = ff.ClearanceSpring(
        [1.0], 54.85865544985291, 11.329126241209119, -1.703876198104961, np.inf,
        law="undamped-rebound",
    )  # fmt: skip
    third = ff.HarmonicForce([0.27177148 - 0.35301084j], order=3)
    forces = (ff.Unbalance([0.51045998 - 0.85990151j]), third)
    machine = ff.MechanicalSystem([[0.73484506]], [[0.10501086]], [[0.61707898]], [stop], forces)
    points = ff.frequency_response(machine, (0.32, 2.02)).points_of("period doubling")
    smooth = [p for p in points if np.abs(p.orbit.multipliers + 1.0).min() < 1e-6]
    corners = [p for p in points if np.abs(p.orbit.multipliers + 1.0).min() > 0.1]
    assert smooth
    assert corners
    assert np.isfinite(smooth[0].sensitivity(["forcing"])).all()
    with pytest.raises(ff.IncompleteError, match=r"no multiplier is -1"):
        corners[0].sensitivity(["forcing"])
