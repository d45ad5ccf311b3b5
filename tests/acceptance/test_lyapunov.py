"""What moves, in words: Lyapunov exponents, their standard errors, bifurcation diagrams.

A chaotic motion is another one on another processor; its averages are not. They are compared within
several standard errors.
"""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest

import flipflow as ff
from flipflow.errors import Cancelled, IncompleteError
from flipflow.transient.exponents import generic_frame
from judge import close
from reference import integrate

pytestmark = pytest.mark.numerical
FOLD_UP, FOLD_DOWN, DOUBLING = 206.405559, 198.649272, 0.738783030  # rad/s, reference values
K = np.array([[1.0, -1.0], [-1.0, 2.0]])
ERRORS = 5.0  # standard errors within which two averages agree


@pytest.fixture(scope="module")
def screen() -> ff.FlipFlowScreen:
    return ff.load("ffs0827")


@pytest.fixture(scope="module")
def chain() -> ff.MechanicalSystem:
    """Two masses of 1 kg and a stop without damping on one side, as in NLvib's example 03."""
    return two_masses(0.03, 0.1, ff.ClearanceSpring([1.0, 0.0], 100.0, 0.0, 1.0, np.inf))


def two_masses(damping: float, force: float, stop: ff.ClearanceSpring) -> ff.MechanicalSystem:
    return ff.MechanicalSystem(np.eye(2), damping * K, K, (stop,), ff.HarmonicForce([0.0, force]))


def impact_oscillator(stop_damping: float = 0.0) -> ff.MechanicalSystem:
    """x'' + 0.02 x' + x + 29 (x - 1.26 for x > 1.26) = 0.7 w^2 cos(w t): chaos by grazing."""
    stop = ff.ClearanceSpring([1.0], 29.0, stop_damping, 1.26, np.inf)
    return ff.MechanicalSystem([[1.0]], [[0.02]], [[1.0]], [stop], ff.Unbalance([0.7]))


def hard_screen(screen: ff.FlipFlowScreen) -> ff.FlipFlowScreen:
    """FFS0827 with a quarter of its damping and a hard, close stop."""
    return screen.replace(
        isolation_damping=0.25 * 9866.0, shear_damping=0.25 * 2605.0,
        stop_damping=0.25 * 2605.0, clearance=1e-3, stop_stiffness=150e6,
    )  # fmt: skip


def random_machine(seed: int) -> tuple[ff.MechanicalSystem, float]:
    """One to three masses, one or two stops, and a speed at which they are touched."""
    rng = np.random.default_rng(seed)
    n = 1 + seed % 3
    root = rng.normal(size=(3, n, n))
    M, C, stiffness = (one @ one.T + np.eye(n) for one in root)
    stops = [
        ff.ClearanceSpring(
            rng.normal(size=n), rng.uniform(5.0, 50.0), rng.uniform(0.1, 2.0), 0.01,
            rng.choice([0.01, 0.02, math.inf]),
        )
        for _ in range(1 + seed // 3 % 2)
    ]  # fmt: skip
    force = ff.Unbalance(rng.normal(size=n))
    machine = ff.MechanicalSystem(M, 0.05 * C, stiffness, stops, force)
    return machine, float(rng.uniform(0.8, 2.0))


def sum_by_contact(machine, share) -> float:
    """-tr M^-1 C - sum c_j s_j d_j^T M^-1 d_j in 1/s."""
    system = machine.system()
    inverse = np.linalg.inv(system.M)
    stops = zip(system.springs, share, strict=True)
    lost = sum(s.damping * part * s.direction @ inverse @ s.direction for s, part in stops)
    return float(-np.trace(inverse @ system.C) - lost)


@pytest.mark.parametrize("omega", [100.0, 203.0, 446.0])
def test_exponents_of_ffs0827_add_up_to_its_damping(screen, omega):
    found = ff.lyapunov_exponents(screen, omega, periods=512)
    close("sum", found.exponents.sum(), sum_by_contact(screen, found.contact_share), rel=1e-9)


@pytest.mark.parametrize("seed", range(12))
def test_exponents_of_random_machines_add_up_to_their_damping(seed):
    machine, omega = random_machine(seed)
    found = ff.lyapunov_exponents(machine, omega, periods=512)
    assert found.exponents.shape == (2 * machine.size,)
    assert (found.contact_share > 0.0).any()
    close("sum", found.exponents.sum(), sum_by_contact(machine, found.contact_share), rel=1e-9)


def test_exponents_of_a_chaotic_motion_add_up_to_its_damping(screen):
    machine = hard_screen(screen)
    found = ff.lyapunov_exponents(machine, 160.0)
    assert found.word == "chaotic"
    close("sum", found.exponents.sum(), sum_by_contact(machine, found.contact_share), rel=1e-9)


def test_contact_share_and_exponents_of_a_periodic_motion(screen):
    """They are those of the orbit: its contacts, and ln |mu| / T of its multipliers."""
    (orbit,) = ff.periodic_orbits(screen, 150.0)
    found = ff.lyapunov_exponents(screen, 150.0, initial=orbit, periods=8192)
    assert found.word == "periodic"
    touched = sum(touch.end - touch.start for touch in orbit.contact_intervals)
    close("share", found.contact_share, [touched / orbit.period], rel=1e-9)
    rates = np.sort(np.log(np.abs(orbit.multipliers)) / orbit.period)[::-1]
    # A pair turns as it shrinks: its two exponents share what a part of a turn adds.
    close("exponents", found.exponents, rates, rel=2e-3)


def test_springs_that_always_act_and_never_act_have_their_shares():
    springs = [
        ff.ClearanceSpring([1.0], 1.0, 0.2, 0.0, 0.0),
        ff.ClearanceSpring([1.0], 5.0, 0.1, 0.5),
        ff.ClearanceSpring([1.0], 5.0, 0.1, math.inf),
    ]
    machine = ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], springs, ff.HarmonicForce([1.0]))
    found = ff.lyapunov_exponents(machine, 1.2, periods=128)
    assert found.contact_share[0] == 1.0
    assert 0.0 < found.contact_share[1] < 1.0
    assert found.contact_share[2] == 0.0
    close("sum", found.exponents.sum(), sum_by_contact(machine, found.contact_share), rel=1e-9)


@pytest.mark.parametrize("damping", [0.02, 1.0, 30.0])
def test_exponents_of_a_linear_machine_are_real_parts_of_its_eigenvalues(damping):
    """Far overdamped too, where directions shrink by e^-1000 relative to others in a period."""
    rng = np.random.default_rng(7)
    root = rng.normal(size=(3, 3))
    stiffness, C = root @ root.T + np.eye(3), damping * np.diag([1.0, 2.0, 4.0])
    machine = ff.MechanicalSystem(np.eye(3), C, stiffness, (), ff.HarmonicForce([1.0, 0, 0]))
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-stiffness, -C]])
    real = np.sort(np.linalg.eigvals(A).real)[::-1]
    found = ff.lyapunov_exponents(machine, 0.7, periods=4096)
    # What a part of a turn of a pair adds is at most some units over the whole time.
    whole = 4096 * 2.0 * math.pi / 0.7
    close("exponents", found.exponents, real, abs=3.0 / whole)
    close("sum", found.exponents.sum(), -np.trace(C), rel=1e-9)
    assert found.word == "periodic"


def test_the_public_chain_in_words(chain):
    """0.635 rad/s is periodic; beyond the Neimark-Sacker point at 0.6186 the torus has broken up.

    At 0.610 every start tried ends on the chaotic motion, and at 0.612 as well. At 0.600 a weakly
    stable motion of six periods coexists with it.
    """
    assert ff.lyapunov_exponents(chain, 0.635).word == "periodic"
    (beyond,) = ff.frequency_response(chain, (0.5, 0.63)).orbits_at(0.6)
    assert beyond.stability == "unstable"
    for omega in (0.61, 0.612):
        found = ff.lyapunov_exponents(chain, omega)
        assert found.word == "chaotic", found
        assert found.exponents[1] < 0.0
    assert ff.lyapunov_exponents(chain, 0.6).word in ("chaotic", "periodic")


def test_a_quasi_periodic_motion():
    """On a torus the largest exponent is 0; a long run shows it to be smaller than its error."""
    stop = ff.ClearanceSpring([1.0, 0.0], 30.0, 1.0, 1.0, np.inf)
    machine = two_masses(0.027, 0.13, stop)
    found = ff.lyapunov_exponents(machine, 0.6, periods=16384)
    assert found.word == "quasi-periodic", found
    assert abs(found.exponents[0]) < 4.0 * found.standard_error[0]
    assert found.exponents[1] < -100.0 * found.standard_error[0]
    section = ff.poincare_section(machine, 0.6, 100, skip=3000)
    assert (section.word, section.periods) == ("quasi-periodic", 0)
    swept = ff.sweep(machine, [0.6], most_turns=3000)
    assert swept.words == ("quasi-periodic",)


def test_a_motion_that_only_leaves_an_unstable_one_is_not_chaotic():
    """Its damper drives it, and those of the stops hold it: a torus far from where it starts."""
    omega = 0.9
    stop = ff.ClearanceSpring([1.0], 1.0, 0.5, 1.0)
    machine = ff.MechanicalSystem([[1.0]], [[-1e-3]], [[1.0]], [stop], ff.HarmonicForce([0.1]))
    X = 0.1 / (1.0 - omega**2 - 1e-3j * omega)
    near = np.array([X.real + 1e-6, -omega * X.imag])
    leaving = ff.lyapunov_exponents(machine, omega, initial=near, periods=1024, skip=64)
    close("driven", leaving.exponents[0], 5e-4, rel=0.05)
    assert leaving.exponents[0] > 4.0 * leaving.standard_error[0]
    assert leaving.word == "undecided"
    assert ff.sweep(machine, [omega], initial=near, most_turns=300).words == ("undecided",)
    away = ff.lyapunov_exponents(machine, omega, initial=leaving.state, periods=8192, skip=4096)
    assert away.word == "quasi-periodic"
    assert abs(away.state[0]) > 0.1


def test_what_passes_by_a_fold_is_not_chaotic(screen):
    """FFS0827 takes thousands of turns where its large motion has just ceased to exist."""
    branch = ff.frequency_response(screen, (150.0, 250.0))
    fold = max(point.omega for point in branch.folds)
    upper = max(branch.orbits_at(fold - 1e-3), key=lambda orbit: orbit.amplitude("relative"))
    speeds = fold + np.array([-1e-5, -1e-7, 1e-7, 1e-5])
    passing = ff.sweep(screen, speeds, initial=upper)
    assert not passing.settled.any()
    assert passing.words[-1] == "undecided"


def test_a_mode_that_grows_beyond_all_bounds_is_not_chaotic():
    """One that a force shakes, and one that no force shakes, which begins with a push."""
    stop = ff.ClearanceSpring([1.0, 0.0], 29.0, 0.1, 1.0, np.inf)
    for force, push in ((0.0, 1e-3), (0.3, 0.0)):
        machine = ff.MechanicalSystem(
            np.eye(2), np.diag([0.1, -1e-3]), np.diag([1.0, 2.0]), [stop],
            ff.HarmonicForce([0.5, force]),
        )  # fmt: skip
        initial = np.array([0.0, push, 0.0, 0.0])
        assert ff.sweep(machine, [0.9], initial=initial).words == ("undecided",)


@pytest.mark.parametrize("start", [(0.0, 0.0), (0.5, -0.3), (0.3, 1.0)])
def test_two_trajectories_part_as_the_largest_exponent_says(start):
    """The impact oscillator at 0.905: two runs of DOP853 with events, pulled together each turn.

    Over so few turns that rounding has not grown to what is compared.
    """
    machine, omega, apart, turns = impact_oscillator(), 0.905, 1e-7, 32
    found = ff.lyapunov_exponents(machine, omega, initial=start, periods=turns, skip=0)
    reference, turn = integrate.Machine.of(machine), 2.0 * math.pi / omega
    z, growth = np.array(start), 0.0
    other = z + apart * generic_frame(2, omega)[:, 0]
    for _ in range(turns):
        z, other = (
            integrate.flow(reference, one, omega, 0.0, turn, rtol=1e-9).final for one in (z, other)
        )
        away = other - z
        size = math.hypot(away[0], away[1] / omega)
        growth += math.log(size / apart)
        other = z + away * apart / size
    close("largest exponent", growth / (turns * turn), found.exponents[0], rel=1e-4)


def test_standard_errors_cover_what_runs_from_elsewhere_find(screen):
    """Two chaotic runs from different states agree within their errors, whose size is right."""
    machine = hard_screen(screen)
    rng = np.random.default_rng(3)
    runs = [
        ff.lyapunov_exponents(machine, 160.0, initial=1e-3 * rng.normal(size=4) * [1, 1, 160, 160])
        for _ in range(12)
    ]
    largest = np.array([run.exponents[0] for run in runs])
    stated = np.array([run.standard_error[0] for run in runs])
    assert (np.abs(largest - largest.mean()) < ERRORS * stated).all()
    # Of twelve runs the scatter is the true error within a factor of three.
    assert 1.0 / 3.0 < largest.std(ddof=1) / stated.mean() < 3.0


def test_sweeps_and_sections_say_what_moves(chain, screen):
    swept = ff.sweep(chain, [0.635, 0.612], most_turns=1500)
    assert swept.words == ("periodic", "chaotic")
    assert swept.periods.tolist() == [1, 0]
    section = ff.poincare_section(screen, 120.0, 3)
    assert (section.word, section.periods) == ("periodic", 1)
    assert ff.poincare_section(chain, 0.612, 20).word == "chaotic"


def test_the_figure_of_a_sweep_says_what_moves(chain):
    drawn = ff.figure(ff.sweep(chain, [0.612, 0.635], most_turns=500))
    names = [trace.name for trace in drawn.panels[0].traces]
    assert names == ["speed rising, chaotic", "speed rising"]


def test_a_motion_that_settles_too_slowly_is_periodic_all_the_same(chain):
    """Just below the period doubling the multiplier is close to -1: 4000 turns are not enough."""
    near = DOUBLING - 3e-5
    upper = max(ff.periodic_orbits(chain, near - 1e-3), key=lambda orbit: orbit.amplitude(0))
    swept = ff.sweep(chain, [near], initial=upper)
    assert not swept.settled[0]
    assert swept.words == ("periodic",)


def test_old_sweeps_open_and_do_not_claim_to_know(tmp_path, chain):
    swept = ff.sweep(chain, [0.635, 0.612], most_turns=500)
    ff.save(swept, tmp_path / "sweep.json")
    document = json.loads((tmp_path / "sweep.json").read_text())
    assert document.pop("words") == ["periodic", "chaotic"]
    (tmp_path / "old.json").write_text(json.dumps(document))
    assert ff.open_result(tmp_path / "old.json").words == ("periodic", "undecided")


def test_periods_up_to_twelve(chain):
    """The chain's motion of eight periods at 0.615 is found, by the search and by the sweep."""
    swept = ff.sweep(chain, [0.615])
    assert swept.periods.tolist() == [8]
    assert ff.poincare_section(chain, 0.615, 20).periods == 8
    found = ff.periodic_orbits(chain, 0.615, max_periods=12)
    assert any(orbit.periods == 8 and orbit.stable for orbit in found)
    with pytest.raises(ff.InputError, match="from 1 to 12"):
        ff.periodic_orbits(chain, 0.615, max_periods=13)


def test_diagram_of_the_chain_doubles_its_period_in_place(chain):
    """Between the two values around 0.738783, and the points of both turns part from there."""
    step = 2.5e-4
    values = DOUBLING + step * (np.arange(-9, 15) + 0.5)
    upper = max(ff.periodic_orbits(chain, float(values[0])), key=lambda o: o.amplitude(0))
    assert upper.stable
    diagram = ff.bifurcation_diagram(chain, "omega", values, initial=upper, most_turns=40_000)
    for passed in (diagram.up, diagram.down):
        assert set(passed.words) == {"periodic"}
        rising = np.argsort(passed.values)
        periods, at = passed.periods[rising], passed.values[rising]
        assert set(periods.tolist()) == {1, 2}
        assert (np.diff(periods) >= 0).all()
        first = at[periods == 2][0]
        assert first - step <= DOUBLING <= first
        assert passed.jumps == ()
    assert diagram.hysteresis == ()
    value, x = diagram.points(0)
    spread = np.array([np.ptp(x[value == one]) for one in values])
    assert (spread[values < DOUBLING] == 0.0).all()
    # A period doubling opens as a square root.
    opened = spread[values > DOUBLING] ** 2 / (values[values > DOUBLING] - DOUBLING)
    assert opened.max() / opened.min() < 1.5


def test_diagram_of_ffs0827_differs_between_its_folds(screen):
    values = np.arange(195.0, 210.0, 0.5)
    diagram = ff.bifurcation_diagram(screen, "omega", values)
    assert diagram.hysteresis == ((199.0, 206.0),)
    (up,), (down,) = diagram.up.jumps, diagram.down.jumps
    assert up[0] <= FOLD_UP <= up[1]
    assert down[1] <= FOLD_DOWN <= down[0]
    assert diagram.complete


def test_diagram_over_a_field_differs_between_the_folds_of_that_field(screen):
    """The clearances at which FFS0827 jumps at 203 rad/s, by continuation."""
    values = np.arange(5.0e-3, 7.05e-3, 1e-4)
    diagram = ff.bifurcation_diagram(screen, "clearance", values, omega=203.0)
    ((low, high),) = diagram.hysteresis
    upper = ff.periodic_orbits(screen, 203.0)[0]
    branch = ff.continue_orbit(upper, "clearance", (4e-3, 8e-3))
    folds = sorted(point.value for point in branch.points_of("fold"))
    assert low - 1e-4 <= folds[0] <= low
    assert high <= folds[1] <= high + 1e-4
    (jump,) = diagram.up.jumps
    assert jump[0] <= folds[1] <= jump[1]


@pytest.mark.parametrize("parameter", ["forcing", "springs[0].clearance", "springs[0].stiffness"])
def test_diagram_over_a_place_in_a_system(parameter):
    """At its own value it meets what a sweep meets."""
    machine = impact_oscillator(0.1)
    own = {"forcing": 1.0, "springs[0].clearance": 1.26, "springs[0].stiffness": 29.0}[parameter]
    values = own * np.array([0.98, 1.0, 1.02])
    diagram = ff.bifurcation_diagram(machine, parameter, values, omega=1.2)
    assert diagram.omega == 1.2
    assert diagram.up.values.tolist() == diagram.down.values[::-1].tolist() == values.tolist()
    (row,) = ff.sweep(machine, [1.2]).rows
    close("state", diagram.up.states[1][-1], row.state, abs=1e-7)


def test_diagram_of_any_dataclass():
    """Such as a machine of the user's own."""
    from dataclasses import dataclass  # noqa: PLC0415

    @dataclass(frozen=True)
    class Rig:
        gap: float

        def system(self) -> ff.MechanicalSystem:
            stop = ff.ClearanceSpring([1.0], 29.0, 0.1, self.gap, np.inf)
            return ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], [stop], ff.Unbalance([0.7]))

    diagram = ff.bifurcation_diagram(Rig(1.26), "gap", [1.2, 1.3], omega=1.1)
    assert diagram.parameter == "gap"
    assert diagram.up.words == ("periodic", "periodic")


def test_a_diagram_keeps_as_many_points_as_asked_of_what_does_not_repeat(chain):
    diagram = ff.bifurcation_diagram(chain, "omega", [0.612], points=200, most_turns=500)
    assert diagram.up.words == ("chaotic",)
    value, x = diagram.points(0, "down")
    assert value.shape == x.shape == (200,)
    assert np.unique(x).size == 200


@pytest.mark.parametrize(
    ("up", "down", "differ"),
    [
        (("undecided", 0), ("quasi-periodic", 0), False),
        (("periodic", 1), ("undecided", 0), False),
        (("periodic", 0), ("periodic", 2), False),  # settles, but not to the end
        (("chaotic", 0), ("chaotic", 0), False),
        (("chaotic", 0), ("quasi-periodic", 0), True),
        (("periodic", 1), ("chaotic", 0), True),
        (("periodic", 1), ("periodic", 2), True),
    ],
)
def test_what_is_not_decided_is_no_second_motion(chain, up, down, differ):
    """No band is shaded in its figure where nothing is known to differ."""
    diagram = ff.bifurcation_diagram(chain, "omega", [0.3])

    def way(passed, found):
        word, periods = found
        return dataclasses.replace(passed, words=(word,), periods=np.array([periods]))

    told = dataclasses.replace(diagram, up=way(diagram.up, up), down=way(diagram.down, down))
    assert told.differ.tolist() == [differ]
    assert len(told.hysteresis) == len(ff.figure(told).panels[0].bands) == int(differ)


def test_a_diagram_tells_what_its_points_belong_to(chain):
    """Word and period stand beside each point; a pass is said in a line."""
    diagram = ff.bifurcation_diagram(chain, "omega", [0.3, 0.612], points=50, most_turns=500)
    frame, data = diagram.to_dataframe(), diagram.to_xarray()
    for way, passed in (("up", diagram.up), ("down", diagram.down)):
        rows = frame[frame["direction"] == way]
        for value, word, periods in zip(passed.values, passed.words, passed.periods, strict=True):
            ours = rows[rows["value"] == value]
            assert set(ours["word"]) == {word}
            assert set(ours["periods"]) == {periods}
            assert len(ours) == (periods or 50)
    assert data["word"].to_numpy().tolist() == frame["word"].tolist()
    assert repr(diagram.up) == "Pass(2 values, 0.3 to 0.612, 1 periodic, 1 chaotic, 1 jumps)"


def test_a_cancelled_diagram_keeps_what_is_finished(screen):
    def stop_after(count):
        def monitor(_sentence, share):
            if share * 8 >= count - 1e-9:
                raise Cancelled

        return monitor

    values = [100.0, 110.0, 120.0, 130.0]
    for count in (2, 4, 6):
        diagram = ff.bifurcation_diagram(screen, "omega", values, monitor=stop_after(count))
        assert not diagram.complete
        assert diagram.up.values.tolist() == values[: min(count, 4)]
        assert diagram.down.values.tolist() == values[::-1][: max(count - 4, 0)] or count == 4
        assert not diagram.differ.any()


def test_exponents_tell_how_far_they_are_and_can_be_stopped(chain):
    told = []
    ff.lyapunov_exponents(chain, 0.61, periods=320, monitor=lambda _s, share: told.append(share))
    assert told[-1] == 1.0
    assert told == sorted(told)

    def monitor(_sentence, share):
        if share > 0.5:
            raise Cancelled

    with pytest.raises(Cancelled):
        ff.lyapunov_exponents(chain, 0.61, periods=320, monitor=monitor)


def test_results_have_figures_and_reopen(tmp_path, chain, screen):
    results = (
        ff.lyapunov_exponents(chain, 0.61, periods=320),
        ff.bifurcation_diagram(screen, "omega", [198.0, 203.0]),
        ff.bifurcation_diagram(screen, "clearance", [5e-3, 6e-3], omega=203.0),
        ff.bifurcation_diagram(chain, "forcing", [0.9, 1.0], omega=0.635),
    )
    for k, result in enumerate(results):
        ff.save(result, tmp_path / f"{k}.json")
        again = ff.open_result(tmp_path / f"{k}.json")
        assert repr(again) == repr(result)
        drawn = ff.figure(again)
        assert drawn.caption.endswith(".")
        for ending in ("html", "svg"):
            assert drawn.write(tmp_path / f"{k}.{ending}").stat().st_size > 1000
    up, down = ff.figure(results[1]).panels[0].traces
    assert up.symbol != down.symbol
    assert up.name != down.name


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"omega": 0.0}, "omega"),
        ({"periods": 31}, "periods"),
        ({"periods": 1e9}, "periods"),
        ({"skip": -1}, "skip"),
        ({"initial": "standing"}, "initial"),
        ({"monitor": 3}, "monitor"),
        ({"machine": 3}, "machine"),
    ],
)
def test_bad_input_of_exponents_is_refused(chain, options, field):
    given = {"machine": chain, "omega": 0.6, **options}
    with pytest.raises(ff.InputError, match=field):
        ff.lyapunov_exponents(given.pop("machine"), given.pop("omega"), **given)


@pytest.mark.parametrize(
    ("parameter", "values", "options", "field"),
    [
        ("omega", [], {}, "values"),
        ("omega", [-1.0], {}, "values"),
        ("omega", [[1.0]], {}, "values"),
        ("omega", [math.nan], {}, "values"),
        ("omega", [1.0], {"omega": 1.0}, "omega"),
        ("forcing", [1.0], {}, "omega"),
        ("gap", [1.0], {"omega": 1.0}, "gap"),
        (3, [1.0], {"omega": 1.0}, "parameter"),
        ("springs[0].stiffness", [-1.0], {"omega": 1.0}, "stiffness"),
        ("omega", [1.0], {"points": 0}, "points"),
        ("omega", [1.0], {"max_periods": 13}, "max_periods"),
        ("omega", [1.0], {"most_turns": 0}, "most_turns"),
        ("omega", [1.0], {"initial": [1.0]}, "initial"),
    ],
)
def test_bad_input_of_diagrams_is_refused(chain, parameter, values, options, field):
    with pytest.raises(ff.InputError, match=field):
        ff.bifurcation_diagram(chain, parameter, values, **options)


def test_a_direction_that_is_none_is_refused(chain):
    diagram = ff.bifurcation_diagram(chain, "omega", [0.7])
    with pytest.raises(ff.InputError, match="direction"):
        diagram.points(0, "sideways")


def test_disturbances_that_die_out_beyond_what_can_be_told_are_said_so():
    """A damper of 1e9 s^-1 at 1 rad/s."""
    machine = ff.MechanicalSystem([[1.0]], [[1e9]], [[1.0]], (), ff.HarmonicForce([1.0]))
    with pytest.raises(IncompleteError, match="die out"):
        ff.lyapunov_exponents(machine, 1.0)


def test_exponents_beyond_the_first_of_a_machine_in_plain_modes():
    """All displacements excite a mode in one phase, and the frame never left it."""
    K = 1e5 * (2.0 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1))
    M = 100.0 * np.eye(3)
    stop = ff.ClearanceSpring([1, 0, 0], 2e5, 100.0, 5.0)
    system = ff.MechanicalSystem(M, 0.1 * M + 2e-4 * K, K, (stop,), ff.Unbalance([0.2, 0, 0]))
    found = ff.lyapunov_exponents(system, 100.0)
    (orbit,) = ff.periodic_orbits(system, 100.0)
    expected = np.sort(np.log(np.abs(orbit.multipliers)) / orbit.period)[::-1]
    assert (np.abs(found.exponents - expected) < 4.0 * found.standard_error).all()
    assert found.standard_error.max() < 0.02
