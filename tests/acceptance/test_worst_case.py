"""Worst cases within intervals: against corners and random machines, closed forms, branches."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import pytest

import flipflow as ff
from flipflow.errors import InputError
from flipflow.model.parameters import with_values
from flipflow.studies.sensitivity_samples import motion_values, question_of
from flipflow.studies.worst_case import Search
from judge import close

pytestmark = pytest.mark.numerical


@dataclass(frozen=True)
class Oscillator:
    """A mass on a spring and a damper; with a stop where it has a gap."""

    stiffness: float = 1.0
    damping: float = 0.1
    force: float = 0.5
    gap: float = np.inf
    stop: float = 5.0

    def system(self) -> ff.MechanicalSystem:
        """As matrices and springs."""
        stop = ff.ClearanceSpring([1.0], self.stop, 0.2, self.gap)
        force = ff.HarmonicForce([self.force])
        return ff.MechanicalSystem([[1.0]], [[self.damping]], [[self.stiffness]], [stop], force)


def test_a_resonance_inside_the_interval():
    """|x| = F / |k - w^2 + i c w|: greatest at k = w^2, least at the end farther away."""
    omega = np.array([0.9, 0.95, 1.0, 1.06, 1.2])
    vary = {"stiffness": (0.8, 1.15), "damping": (0.08, 0.12), "force": (0.4, 0.5)}
    found = ff.worst_case(Oscillator(), vary, "amplitude[0]", omega)
    k = np.clip(omega**2, 0.8, 1.15)
    greatest = 0.5 / np.hypot(k - omega**2, 0.08 * omega)
    far = np.maximum(np.abs(0.8 - omega**2), np.abs(1.15 - omega**2))
    np.testing.assert_allclose(found.greatest, greatest, rtol=1e-5)
    np.testing.assert_allclose(found.least, 0.4 / np.hypot(far, 0.12 * omega), rtol=1e-12)
    np.testing.assert_allclose(found.greatest_at[:, 0], k, atol=2e-3)
    np.testing.assert_allclose(found.nominal, 0.5 / np.hypot(1.0 - omega**2, 0.1 * omega))


@pytest.mark.parametrize("damping", [0.02, 0.005, 0.001])
def test_a_narrow_resonance_inside_the_interval(damping):
    """Steps are halved as long as that gains something; the error says what may be missing."""
    found = ff.worst_case(
        Oscillator(damping=damping), {"stiffness": (0.8, 1.25)}, "amplitude[0]", 0.97
    )
    exact = 0.5 / (damping * 0.97)
    assert found.greatest[0] == pytest.approx(exact, rel=1e-4)
    assert exact - found.greatest[0] <= found.error[0]


def test_it_begins_at_the_corners_that_single_parameters_point_to():
    """One look at the machine and at both ends of each, one at the corners."""
    machine, vary = Oscillator(), {"stiffness": (0.9, 1.1), "damping": (0.08, 0.12)}
    question = question_of(machine, "amplitude[0]", [0.3, 1.8], "from-below")
    search = Search(question, tuple(vary), np.array(list(vary.values())), 1, lambda *_: None)
    search.look(np.array([[0.5, 0.5], [0.0, 0.5], [1.0, 0.5], [0.5, 0.0], [0.5, 1.0]]))
    corners = np.array(list(search.corners())).tolist()
    # Below the resonance a stiff spring moves least, above it a soft one.
    assert corners == [[1.0, 1.0], [0.0, 1.0], [0.0, 0.0], [1.0, 0.0]]


def test_ends_are_the_ends_to_the_last_bit():
    rng = np.random.default_rng(3)
    for _ in range(20):
        low, high = rng.uniform(0.05, 0.1), rng.uniform(0.11, 0.2)
        found = ff.worst_case(Oscillator(), {"damping": (low, high)}, "amplitude[0]", 1.0)
        assert found.machine_at("least").damping == high
        assert found.machine_at("greatest").damping == low
        assert found.places("least")[0, 0] == 1.0


def test_a_machine_outside_the_box_is_told(screen):
    found = ff.worst_case(screen, {"clearance": (6.1e-3, 6.3e-3)}, "stroke", [80.0, 85.0])
    assert "the machine itself lies outside the interval of clearance" in found.notes


def test_one_speed_twice(screen):
    found = ff.worst_case(screen, {"clearance": (5e-3, 6e-3)}, "stroke", [85.0, 85.0])
    assert found.least[0] == found.least[1]


@pytest.mark.parametrize("branch", ["from-below", "upper", "lower"])
def test_no_corner_and_no_machine_within_exceeds_it(screen, branch):
    names = ("shear_stiffness", "clearance", "stop_stiffness", "main_mass", "floating_mass")
    vary = {name: (0.9 * getattr(screen, name), 1.1 * getattr(screen, name)) for name in names}
    omega = np.linspace(70.0, 230.0, 17)
    found = ff.worst_case(screen, vary, "relative_amplitude", omega, branch=branch)
    ends = np.array(list(itertools.product(*vary.values())))
    low, high = np.array(list(vary.values())).T
    inside = low + np.random.default_rng(0).random((300, low.size)) * (high - low)
    columns = dict(zip(names, np.concatenate([ends, inside]).T, strict=True))
    question = question_of(screen, "relative_amplitude", omega, branch)
    values = motion_values(question, columns, 1, lambda _: None)
    assert (np.nanmax(values, axis=0) <= found.greatest * (1.0 + 1e-9)).all()
    assert (np.nanmin(values, axis=0) >= found.least * (1.0 - 1e-9)).all()


@pytest.mark.parametrize("branch", ["from-below", "upper", "lower"])
def test_the_machine_itself_is_looked_at_on_the_motion_of_its_variants(screen, branch):
    """Where motions lean it had no value."""
    leaning = screen.replace(clearance=2e-3)
    around = {"clearance": (1.9999e-3, 2.0001e-3)}
    case = ff.worst_case(leaning, around, "relative_amplitude", [57.7], branch=branch)
    assert case.least < case.nominal < case.greatest
    close("between", case.nominal, 0.5 * (case.least + case.greatest), rel=1e-6)


def test_machines_that_nobody_chose():
    """One mass, one stop, any interval: a fine grid finds nothing farther out than by its step."""
    rng = np.random.default_rng(20261128)
    for _ in range(6):
        machine = Oscillator(damping=rng.uniform(0.05, 0.3), gap=rng.uniform(0.2, 0.8))
        vary = {
            "gap": tuple(machine.gap * np.array([rng.uniform(0.6, 0.95), rng.uniform(1.05, 1.5)])),
            "stop": tuple(5.0 * np.array([rng.uniform(0.5, 0.9), rng.uniform(1.1, 3.0)])),
        }
        omega = np.array([0.6, 1.0, 1.4, 1.9])
        found = ff.worst_case(machine, vary, "stop_force", omega, branch="upper")
        grid = [np.linspace(*ends, 21) for ends in vary.values()]
        a, b = (one.ravel() for one in np.meshgrid(*grid))
        question = question_of(machine, "stop_force", omega, "upper")
        values = motion_values(question, {"gap": a, "stop": b}, 1, lambda _: None)
        room = 1e-3 * np.nanmax(values, axis=0)
        assert (np.nanmax(values, axis=0) <= found.greatest + room).all()
        assert (np.nanmin(values, axis=0) >= found.least - room).all()


def test_the_machine_named_has_the_value_named(screen):
    """By a branch over speed and what is read off its orbit."""
    vary = {"clearance": (5e-3, 7e-3), "shear_stiffness": (2.5e6, 2.9e6)}
    found = ff.worst_case(screen, vary, "stop_force", [100.0, 150.0])
    for at, omega in enumerate(found.omega):
        for end in ("least", "greatest"):
            branch = ff.frequency_response(found.machine_at(end, at), (60.0, 160.0))
            force = branch.orbit_from_below(omega).stop_force_peak()
            assert getattr(found, end)[at] == pytest.approx(force, rel=1e-8)


def test_how_far_the_jumps_move(screen):
    vary = {"clearance": (5.8e-3, 6.2e-3), "stop_stiffness": (7.8e6, 8.4e6)}
    found = ff.worst_case(screen, vary, "omega_ub", (60.0, 250.0))
    folds = [
        max(
            fold.omega
            for fold in ff.frequency_response(
                with_values(screen, dict(zip(vary, ends, strict=True))), (60.0, 250.0)
            ).folds
        )
        for ends in itertools.product(*vary.values())
    ]
    assert found.greatest[0] == pytest.approx(max(folds), rel=1e-9)
    assert found.least[0] == pytest.approx(min(folds), rel=1e-9)
    assert np.isnan(found.omega).all()


def test_a_parameter_without_effect_stays(screen):
    """Before the stop is reached its stiffness makes no difference."""
    vary = {"stop_stiffness": (7e6, 9e6), "main_mass": (880.0, 950.0)}
    found = ff.worst_case(screen, vary, "relative_amplitude", 65.0)
    assert found.greatest_at[0].tolist() == [screen.stop_stiffness, 880.0]
    assert found.least_at[0].tolist() == [screen.stop_stiffness, 950.0]


def test_what_has_no_value_is_told(screen):
    """Where gaps are wide there is no jump."""
    found = ff.worst_case(screen, {"clearance": (5e-3, 60e-3)}, "omega_lb", (60.0, 250.0))
    (note,) = found.notes
    assert note.startswith("not every machine in the box has such a value: ")
    assert np.isfinite(found.greatest).all()


@pytest.mark.parametrize(
    ("quantity", "gaps"), [("omega_lb", (40e-3, 60e-3)), ("jump_margin", (5e-3, 60e-3))]
)
def test_what_is_not_known_or_infinite_is_drawn_and_told(screen, quantity, gaps, tmp_path):
    omega = 120.0 if quantity == "jump_margin" else (60.0, 250.0)
    found = ff.worst_case(screen, {"clearance": gaps}, quantity, omega)
    if quantity == "jump_margin":
        assert found.greatest[0] == np.inf
        assert 0.0 <= found.least[0] < 1.0
    else:
        assert np.isnan(found.greatest[0])
        assert "no machine that was looked at has a value of omega_lb" in found.notes
    ff.figure(found).write(tmp_path / "found.svg")
    assert found._repr_html_()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ({"vary": {"clearance": ff.Normal(6e-3, 1e-4)}}, r"vary clearance.*interval \(low, high\)"),
        ({"vary": {"stop_law": ff.Choice(("paper", "elasto-gap"))}}, r"vary stop_law.*interval"),
        ({"vary": {}}, "vary"),
        ({"quantity": "weight"}, "quantity"),
        ({"omega": None}, "omega"),
        ({"threads": 0}, "threads"),
    ],
)
def test_bad_input(screen, words, told):
    given = {"vary": {"clearance": (5e-3, 6e-3)}, "quantity": "stroke", "omega": 80.0} | words
    with pytest.raises(InputError, match=told):
        ff.worst_case(screen, **given)


def test_an_index_and_an_end_are_checked(screen):
    found = ff.worst_case(screen, {"clearance": (5e-3, 6e-3)}, "stroke", 80.0)
    with pytest.raises(InputError, match="end = 'most'"):
        found.machine_at("most")
    with pytest.raises(InputError, match="at = 1"):
        found.machine_at("least", 1)


def test_it_tells_how_far_it_is_and_can_be_stopped(screen):
    told = []

    def tell(sentence, share):
        told.append((sentence, share))
        if len(told) > 3:
            raise ff.Cancelled("enough")

    with pytest.raises(ff.Cancelled, match="enough"):
        ff.worst_case(screen, {"clearance": (5e-3, 7e-3)}, "stroke", [85.0, 120.0], monitor=tell)
    assert told[-1][0].startswith("worst case: ")
    assert all(0.0 <= share <= 1.0 for _, share in told)
