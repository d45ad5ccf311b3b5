"""Parameters of any machine: fields of a dataclass, and places in a plain system."""

from __future__ import annotations

import io
import math
from dataclasses import dataclass

import numpy as np
import pytest
from rich.console import Console

import flipflow as ff
from flipflow.errors import InputError
from flipflow.report import summary
from judge import close

pytestmark = pytest.mark.numerical


@dataclass(frozen=True)
class Rig:
    """A mass on a spring against one stop."""

    mass: float = 1.0
    gap: float = 0.4
    name: str = "rig"

    def system(self) -> ff.MechanicalSystem:  # noqa: D102
        stop = ff.ClearanceSpring([1.0], 30.0, 1.0, self.gap, math.inf)
        force = ff.HarmonicForce([0.5])
        return ff.MechanicalSystem([[self.mass]], [[0.06]], [[1.0]], (stop,), force)


def upper(machine, omega: float, interval):
    found = ff.frequency_response(machine, interval).orbits_at(omega)
    return max(found, key=lambda orbit: orbit.amplitude(0))


def test_a_field_of_a_dataclass_is_followed() -> None:
    """Each point is a motion of the machine of its value, found there by itself."""
    orbit = upper(Rig(), 1.4, (0.9, 2.5))
    branch = ff.continue_orbit(orbit, "gap", (0.2, 0.6))
    assert branch.complete
    for i in (0, branch.values.size // 2, -1):
        alone = ff.frequency_response(Rig(gap=float(branch.values[i])), (0.9, 2.5)).orbits_at(1.4)
        sizes = np.array([one.amplitude(0) for one in alone])
        assert np.abs(sizes - branch.amplitude(0)[i]).min() < 1e-9


def test_a_fold_is_followed_over_the_mass() -> None:
    branch = ff.frequency_response(Rig(), (0.9, 2.5))
    fold = max(branch.folds, key=lambda one: one.omega)
    curve = ff.continue_fold(fold, "mass", (0.7, 1.4))
    assert curve.complete
    heavy = ff.frequency_response(Rig(mass=1.4), (0.5, 2.5))
    ends = [omega for omega, v in zip(curve.omega, curve.values, strict=True) if v == 1.4]
    assert np.abs(np.array([f.omega for f in heavy.folds])[:, None] - ends).min() < 1e-7


@pytest.mark.parametrize(
    ("path", "bounds", "changed"),
    [
        ("springs[0].clearance", (4e-3, 7e-3), {"clearance": 7e-3}),
        ("springs[0].stiffness", (6e6, 9e6), {"stop_stiffness": 9e6}),
        ("springs[0].damping", (1e3, 4e3), {"stop_damping": 4e3}),
        ("forcing", (0.8, 1.1), {"eccentric_moment": 1.1 * 4.16825}),
    ],
)
def test_places_in_a_plain_system(path: str, bounds, changed) -> None:
    """As the screen's own fields do; the clearance of equal gaps moves both sides."""
    screen = ff.load("ffs0827")
    plain = screen.system()
    orbit = upper(plain, 195.0, (5.0, 250.0))
    branch = ff.continue_orbit(orbit, path, bounds)
    assert branch.complete
    assert branch.values[-1] == bounds[1]
    alone = ff.frequency_response(screen.replace(**changed), (5.0, 250.0)).orbits_at(195.0)
    sizes = np.array([one.amplitude("main") for one in alone])
    assert np.abs(sizes - branch.amplitude(0)[-1]).min() < 1e-9
    close("one way back", branch.orbit(-1).omega, 195.0)


def test_a_saved_branch_over_a_place_opens_again(tmp_path) -> None:
    orbit = upper(ff.load("ffs0827").system(), 195.0, (5.0, 250.0))
    branch = ff.continue_orbit(orbit, "springs[0].clearance", (5.5e-3, 6.5e-3))
    ff.save(branch, tmp_path / "branch.json")
    again = ff.open_result(tmp_path / "branch.json")
    close("amplitudes", again.amplitude(0), branch.amplitude(0), abs=1e-15)


def test_a_branch_of_a_machine_that_no_file_holds_keeps_that_of_each_motion(tmp_path) -> None:
    branch = ff.continue_orbit(upper(Rig(), 1.4, (0.9, 2.5)), "gap", (0.35, 0.45))
    ff.save(branch, tmp_path / "branch.json")
    opened = ff.open_result(tmp_path / "branch.json")
    assert opened.field == "gap"
    np.testing.assert_array_equal(opened.values, branch.values)
    for one, other in zip(opened.orbits, branch.orbits, strict=True):
        assert one.amplitude(0) == other.amplitude(0)
        assert one.system.springs[0].gaps == other.system.springs[0].gaps


@pytest.mark.parametrize(
    ("machine", "field"),
    [
        (Rig(), "name"), (Rig(), "height"), (Rig().system(), "springs[1].clearance"),
        (Rig().system(), "clearance"), (Rig().system(), "springs[0].clearance_minus"),
    ],
)  # fmt: skip
def test_what_is_no_parameter_is_refused(machine, field: str) -> None:
    orbit = upper(machine, 1.4, (0.9, 2.5))
    with pytest.raises(InputError):
        ff.continue_orbit(orbit, field, (0.1, 1.0))


def test_folds_of_leaning_motions_are_followed() -> None:
    """They are no motions of which others branch off."""
    narrow = ff.load("ffs0827").replace(clearance=1e-3)
    branch = ff.frequency_response(narrow, (50.0, 100.0))
    (leaning, *_) = branch.points_of("symmetry breaking")
    child = ff.switch_branch(leaning, (40.0, 110.0))
    curve = ff.continue_fold(child.folds[0], "clearance", (0.9e-3, 1.1e-3))
    assert np.abs(curve.multipliers - 1.0).min(axis=1).max() < 1e-6


@pytest.mark.parametrize(
    ("changes", "field", "bounds"),
    [
        ({"clearance": math.inf}, "main_mass", (800.0, 1000.0)),
        ({"clearance": 0.0}, "main_mass", (800.0, 1000.0)),
        ({"clearance": 0.0}, "clearance", (0.0, 6e-3)),
        ({"stop_law": "elasto-gap"}, "stop_damping", (0.0, 5000.0)),
    ],
)
def test_machines_without_a_stop_and_ends_at_zero(changes, field: str, bounds) -> None:
    machine = ff.load("ffs0827").replace(**changes)
    orbit = ff.frequency_response(machine, (5.0, 150.0)).orbits_at(120.0)[0]
    branch = ff.continue_orbit(orbit, field, bounds)
    assert branch.complete, branch.status
    assert (branch.values.min(), branch.values.max()) == bounds
    for i in (0, -1):
        alone = ff.frequency_response(branch.orbit(i).machine, (5.0, 150.0)).orbits_at(120.0)
        sizes = np.array([one.amplitude("main") for one in alone])
        assert np.abs(sizes - branch.amplitude("main")[i]).min() < 1e-9


@dataclass(frozen=True)
class Chain:
    """Masses in a row between two walls; the last meets a stop."""

    gap: float = 0.4
    stiffness: float = 1.0
    force: float = 0.1
    masses: int = 3
    name: str = "chain"

    def __post_init__(self) -> None:
        if self.stiffness > 10.0:
            raise ValueError("springs as stiff are not made")

    def system(self) -> ff.MechanicalSystem:  # noqa: D102
        unit = np.eye(self.masses)
        shape = 2.0 * unit - np.eye(self.masses, k=1) - np.eye(self.masses, k=-1)
        stop = ff.ClearanceSpring(unit[-1], 30.0, 1.0, self.gap, math.inf)
        force = ff.HarmonicForce(self.force * unit[0])
        return ff.MechanicalSystem(unit, 0.06 * shape, self.stiffness * shape, (stop,), force)


@dataclass(frozen=True)
class Free:
    """A mass on a spring without stop; its coordinate has a name."""

    force: float = 1.0
    stiffness: float = 1.0

    def system(self) -> ff.MechanicalSystem:  # noqa: D102
        force, named = ff.HarmonicForce([self.force]), {"body": [1.0]}
        return ff.MechanicalSystem([[1.0]], [[DAMPING]], [[self.stiffness]], (), force, named)


DAMPING = 0.06
SPAN = (0.2, 2.5)
OF_ANY = (
    "stop_force", "contact_share", "dissipated_power", "jump_margin", "largest_multiplier",
    "peak_amplitude", "peak_frequency", "omega_cs", "omega_lb", "omega_ub",
)  # fmt: skip


@pytest.mark.parametrize(
    ("machine", "name", "values", "at"),
    [
        (Chain(), "gap", [0.35, 0.5], lambda v: Chain(gap=v)),
        (Chain().system(), "springs[0].clearance", [0.35, 0.5], lambda v: Chain(gap=v)),
        (Chain().system(), "forcing", [0.9, 1.2], lambda v: Chain(force=0.1 * v)),
    ],
    ids=["field", "clearance", "forcing"],
)
def test_a_family_over_any_parameter_is_a_loop(machine, name: str, values, at) -> None:
    """Each member's peak, contact and folds are those of its machine analysed by itself."""
    family = ff.response_family(machine, {name: values}, omega=SPAN)
    assert repr(family) == f"ResponseFamily({name}: 2 values, {values[0]} to {values[1]})"
    table = family.table()
    assert table[name] == values
    assert table["failure"] == ["", ""]
    for k, value in enumerate(values):
        branch = ff.frequency_response(at(value), SPAN)
        close("peak", table["peak_frequency"][k], branch.peak(0).omega, abs=1e-7)
        close("its size", table["peak_amplitude"][k], branch.peak(0).amplitude(0), abs=1e-9)
        begin = branch.points_of("contact begin")[0].omega
        close("contact", table["omega_cs"][k], begin, abs=1e-9)
        close("lower fold", table["omega_lb"][k], branch.folds[1].omega, abs=1e-9)
        close("upper fold", table["omega_ub"][k], branch.folds[0].omega, abs=1e-9)
        middle = 0.5 * sum(family.common_region)
        known = branch.orbit_from_below(middle).amplitude(0)
        close("amplitude", family.members[k].relative_amplitude(middle), known, abs=1e-9)


def test_a_family_is_drawn_and_opens_again(tmp_path) -> None:
    family = ff.response_family(Chain(), {"gap": [0.4, 0.5]})
    drawn = ff.figure(family)
    assert [panel.title for panel in drawn.panels] == ["x[0]", "x[1]", "x[2]"]
    assert {t.name for t in drawn.panels[0].traces if t.legend} == {
        "gap = 0.4", "gap = 0.5", "unstable", "fold",
    }  # fmt: skip
    ff.save(family, tmp_path / "family.json")
    again = ff.open_result(tmp_path / "family.json")
    assert again.table() == family.table()
    assert repr(again) == repr(family)
    assert ff.figure(again).title == drawn.title == "Response over gap"


def test_indices_of_a_linear_machine_are_those_of_the_closed_form() -> None:
    r"""|X| = F g(k), g = 1 / |k - w^2 + i w c|: V_F, V_k over squared means, and their product."""
    omega, vary = 0.7, {"force": (0.8, 1.2), "stiffness": (0.9, 1.1)}
    result = ff.sensitivity(Free(), vary, "body_amplitude", omega=omega, n=1024, rng=7)
    nodes, weights = np.polynomial.legendre.leggauss(30)
    g = 1.0 / np.abs(1.0 + 0.1 * nodes - omega**2 + 1j * omega * DAMPING)
    parts = np.array([0.4**2 / 12.0, weights @ g**2 / 2.0 / (weights @ g / 2.0) ** 2 - 1.0])
    both = parts.prod()
    first, total = parts / (parts.sum() + both), (parts + both) / (parts.sum() + both)
    assert np.all(np.abs(result.first_order - first) <= result.first_order_confidence)
    assert np.all(np.abs(result.total - total) <= result.total_confidence)
    assert result.total_confidence.max() < 0.05
    mean = weights @ g / 2.0
    assert result.mean == pytest.approx(mean, rel=5e-3)
    low = 0.8 / abs(1.0 - omega**2 + 1j * omega * DAMPING)
    close("force at its low end", result.at_low[0], low, abs=1e-9)


@pytest.mark.parametrize("seed", [0, 1])
def test_samples_are_machines_of_their_values(seed: int) -> None:
    """Variance over drawn gaps as that of a loop over as many machines drawn anew."""
    ends = (0.3, 0.5)
    result = ff.sensitivity(Chain(), {"gap": ends}, "stop_force", omega=0.75, n=64, rng=seed)
    gaps = np.random.default_rng(seed).uniform(*ends, 64)
    forces = [
        ff.frequency_response(Chain(gap=float(gap)), (0.3, 0.8))
        .orbit_from_below(0.75)
        .stop_force_peak()
        for gap in gaps
    ]
    spread = np.std(forces) / math.sqrt(len(forces))
    assert abs(result.mean - np.mean(forces)) < 4.0 * spread
    assert result.failed == 0.0
    for end, value in zip(ends, (result.at_low[0], result.at_high[0]), strict=True):
        alone = ff.frequency_response(Chain(gap=end), (0.3, 0.8)).orbit_from_below(0.75)
        close("at an end", value, alone.stop_force_peak(), abs=1e-8)


@pytest.mark.parametrize("name", OF_ANY)
def test_every_machine_has_these_quantities(name: str) -> None:
    """At the ends of the gap, by hand; a dataclass and its plain system say the same."""
    omega = 0.75 if name in OF_ANY[:5] else SPAN
    ends = {}
    for machine, field in ((Chain(), "gap"), (Chain().system(), "springs[0].clearance")):
        result = ff.sensitivity(machine, {field: (0.35, 0.45)}, name, omega=omega, n=2)
        ends[field] = (result.at_low[0], result.at_high[0])
        assert field in repr(result)
    np.testing.assert_allclose(ends["gap"], ends["springs[0].clearance"], rtol=1e-6)
    for gap, value in zip((0.35, 0.45), ends["gap"], strict=True):
        assert value == pytest.approx(by_hand(Chain(gap=gap), name), rel=1e-6)


def by_hand(machine, name: str) -> float:
    branch = ff.frequency_response(machine, SPAN)
    orbit = branch.orbit_from_below(0.75)
    upper, lower = (fold.omega for fold in branch.folds)
    peak = branch.peak(0)
    return {
        "stop_force": orbit.stop_force_peak(),
        "contact_share": sum(one.end - one.start for one in orbit.contact_intervals) / orbit.period,
        "dissipated_power": orbit.input_power(),
        "largest_multiplier": max(map(abs, orbit.multipliers)),
        "jump_margin": min(abs(0.75 - fold) / fold for fold in (upper, lower)),
        "peak_amplitude": peak.amplitude(0),
        "peak_frequency": peak.omega,
        "omega_cs": branch.points_of("contact begin")[0].omega,
        "omega_lb": lower,
        "omega_ub": upper,
    }[name]


@pytest.mark.parametrize(("which", "name"), [(0, "amplitude[0]"), (2, "amplitude[2]")])
def test_amplitude_and_phase_of_every_coordinate(which: int, name: str) -> None:
    orbit = ff.frequency_response(Chain(), (0.3, 0.8)).orbit_from_below(0.75)
    vary = {"force": (0.05, 0.15)}
    result = ff.sensitivity(Chain(), vary, name, omega=0.75, n=2)
    close("amplitude", result.nominal, orbit.amplitude(which), abs=1e-9)
    result = ff.sensitivity(Chain(), vary, name.replace("amplitude", "phase"), omega=0.75, n=2)
    close("phase", result.nominal, orbit.phase(which), abs=1e-8)


def test_names_of_coordinates_name_their_quantities() -> None:
    """As a screen's: its plain system answers with the screen's own numbers."""
    screen = ff.load("ffs0827")
    vary = {"springs[0].clearance": (5.5e-3, 6.5e-3)}
    for name in ("relative_amplitude", "main_amplitude", "relative_phase", "omega_ub"):
        omega = (5.0, 250.0) if name == "omega_ub" else 120.0
        plain = ff.sensitivity(screen.system(), vary, name, omega=omega, n=2)
        own = ff.sensitivity(screen, {"clearance": (5.5e-3, 6.5e-3)}, name, omega=omega, n=2)
        np.testing.assert_allclose(plain.at_low, own.at_low, rtol=1e-7)
        np.testing.assert_allclose(plain.total, own.total, rtol=1e-4)


def test_branch_words_choose_among_motions_of_any_machine() -> None:
    upper_fold, lower_fold = (f.omega for f in ff.frequency_response(Chain(), SPAN).folds)
    between = 0.5 * (upper_fold + lower_fold)
    sizes = {
        word: ff.sensitivity(
            Chain(), {"gap": (0.399, 0.401)}, "amplitude[0]", between, n=2, branch=word
        ).nominal
        for word in ("from-below", "upper", "lower")
    }
    assert sizes["from-below"] == pytest.approx(sizes["upper"], rel=1e-9)
    assert sizes["lower"] < 0.9 * sizes["upper"]


def test_a_sensitivity_is_drawn_told_and_opens_again(tmp_path) -> None:
    result = ff.sensitivity(Chain(), {"gap": (0.36, 0.44)}, "amplitude[2]", omega=0.75, n=4)
    drawn = ff.figure(result)
    assert "amplitude of x[2]" in drawn.title
    assert [text for _, text in drawn.panels[1].y.ticks] == ["gap \N{MINUS SIGN}10 to +10 %"]
    ff.save(result, tmp_path / "sensitivity.json")
    again = ff.open_result(tmp_path / "sensitivity.json")
    np.testing.assert_array_equal(again.total, result.total)
    assert again.own == result.own == (0.4,)
    assert ff.figure(again).panels[1].y.ticks == drawn.panels[1].y.ticks
    console = Console(width=80, record=True, file=io.StringIO())
    summary(again, console)
    assert "amplitude of x[2]" in console.export_text()


def test_jump_risk_of_a_dataclass_is_that_of_its_system(tmp_path) -> None:
    """Of either machine the same blow throws it; it is hit anew through time."""
    upper_fold, lower_fold = (f.omega for f in ff.frequency_response(Rig(), (0.9, 2.5)).folds)
    omega = lower_fold + 0.8 * (upper_fold - lower_fold)
    found = [ff.jump_risk(machine, omega) for machine in (Rig(), Rig().system())]
    assert found[0].others
    assert found[0].impulse == pytest.approx(found[1].impulse, rel=1e-9)
    throw = found[0].worst_impulse
    for factor, thrown in ((0.98, False), (1.02, True)):
        blow = ff.Impulse(throw.phase / omega, throw.frame, factor * throw.impulse)
        start = found[0].orbit
        h = ff.simulate(Rig(), omega, 400, initial=start, disturbances=(blow,))
        size = 0.5 * np.ptp(h.displacement(0)[h.t > h.t[-1] - 4.0 * np.pi / omega])
        same = abs(size - start.amplitude(0)) < 1e-3 * start.amplitude(0)
        assert same != thrown
    risk = ff.jump_risk(Rig(gap=0.5), omega)
    assert risk.impulse != pytest.approx(found[0].impulse, rel=1e-3)
    ff.save(found[0], tmp_path / "risk.json")
    assert repr(ff.open_result(tmp_path / "risk.json")) == repr(found[0])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: ff.response_family(Chain(), {"height": [1.0]}), "'gap', 'stiffness', 'force'"),
        (lambda: ff.response_family(Chain(), {"masses": [3, 4]}), "'gap', 'stiffness', 'force'"),
        (lambda: ff.response_family(Chain(), {"name": [3, 4]}), "'gap', 'stiffness', 'force'"),
        (lambda: ff.response_family(Chain().system(), {"gap": [1.0]}), "'springs[0].clearance'"),
        (
            lambda: ff.response_family(Chain().system(), {"springs[1].clearance": [1.0]}),
            "'forcing', 'springs[0].stiffness'",
        ),
        (lambda: ff.response_family(Chain(), {"gap": [0.4, math.nan]}), "give a gap in m"),
        (lambda: ff.response_family(Chain(), {"stiffness": [11.0]}), "as stiff are not made"),
        (lambda: ff.response_family("chain", {"gap": [0.4]}), "MechanicalSystem"),
        (lambda: asked({"height": (1.0, 2.0)}), "'gap', 'stiffness', 'force'"),
        (lambda: asked({"stiffness": (1.0, 20.0)}), "as stiff are not made"),
        (lambda: asked({"gap": ff.Choice(("a", "b"))}), "give numbers"),
        (lambda: asked({"gap": 0.4}), "ff.Normal"),
        (lambda: asked({"gap": (0.4, 0.5)}, "stroke"), "amplitude[2]"),
        (lambda: asked({"gap": (0.4, 0.5)}, "relative_amplitude"), ", ".join(OF_ANY)),
        (lambda: asked({"gap": (0.4, 0.5)}, "amplitude[3]"), "amplitude[2]"),
        (lambda: ff.sensitivity(Bare(), {"gap": (0.4, 0.5)}, "peak_amplitude"), "no parameters"),
    ],
)
def test_bad_input_is_one_sentence_that_names_what_there_is(call, words: str) -> None:
    with pytest.raises(InputError) as caught:
        call()
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def asked(vary, quantity: str = "stop_force"):
    return ff.sensitivity(Chain(), vary, quantity, omega=0.75, n=2)


class Bare:
    """A machine that is no dataclass."""

    def system(self) -> ff.MechanicalSystem:  # noqa: D102
        return Chain().system()


def test_a_value_that_a_machine_refuses_is_a_failed_sample() -> None:
    vary = {"stiffness": ff.Normal(9.5, 1.0)}
    result = ff.sensitivity(Chain(stiffness=9.5), vary, "amplitude[0]", omega=0.75, n=64)
    assert 0.1 < result.failed < 1.0


def test_one_side_of_equal_gaps_beside_both() -> None:
    """Both sides are asked for: the side that is named alone keeps its own value."""
    plain = ff.load("ffs0827").system()
    vary = {
        "springs[0].clearance_minus": ff.Choice((6e-3, 7e-3)),
        "springs[0].clearance": ff.Choice((5e-3, 8e-3)),
    }
    result = ff.sensitivity(plain, vary, "relative_amplitude", omega=120.0, n=4)
    screen = ff.load("ffs0827").replace(clearance=8e-3, clearance_minus=6e-3)
    alone = ff.frequency_response(screen, (100.0, 130.0)).orbit_from_below(120.0)
    close("minus at 6 mm", result.at_high[1], alone.amplitude("relative"), abs=1e-9)
