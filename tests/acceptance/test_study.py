"""A study: which machines, what is found, under which loads; each row depends on itself alone."""

from __future__ import annotations

import queue
import threading
import time
from concurrent.futures import Executor, Future
from dataclasses import dataclass

import numpy as np
import pytest
from scipy import stats

import flipflow as ff
from flipflow.model.sampling import design_of
from flipflow.model.screen import loaded_columns
from flipflow.studies.study_values import evaluate

pytestmark = pytest.mark.numerical
OMEGA = 110.0
FIELDS = {"clearance": (5e-3, 7e-3), "shear_stiffness": ff.Normal(2.7e6, 9e4)}


@pytest.fixture(scope="module")
def linear():
    return ff.load("ffs0827-linear")


def by_hand(machine, omega, quantity, **changes):
    """A quantity by the single analysis."""
    changed = machine.replace(**changes)
    branch = ff.frequency_response(changed, (60.0, omega))
    return branch.orbit_from_below(omega).amplitude(quantity)


@pytest.mark.parametrize("kind", [ff.Choice, list])
def test_a_grid_is_every_combination(screen, kind):
    gaps, words = np.array([5e-3, 6e-3, 7e-3]), ("paper", "compression-only")
    found = ff.study(
        screen, {"clearance": gaps, "stop_law": kind(words)},
        ("relative_amplitude", "stop_force"), OMEGA,
    )  # fmt: skip
    assert found.sampling == "grid"
    assert found.grid_shape == (3, 2)
    np.testing.assert_array_equal(found.columns["clearance"], np.repeat(gaps, 2))
    assert list(found.columns["stop_law"]) == list(words) * 3
    for k in range(6):
        amplitude = by_hand(
            screen, OMEGA, "relative",
            clearance=found.columns["clearance"][k], stop_law=str(found.columns["stop_law"][k]),
        )  # fmt: skip
        assert found.values["relative_amplitude"][k, 0, 0] == pytest.approx(amplitude, rel=1e-8)
    assert found.nominal["relative_amplitude"].shape == (1, 1)
    low = by_hand(screen, OMEGA, "relative", clearance=5e-3)
    assert found.at_low["relative_amplitude"][0, 0, 0] == pytest.approx(low, rel=1e-8)
    assert found.failed == 0.0


def test_a_tuple_is_an_interval_and_a_list_holds_values(linear):
    values = [930.0, 900.0]
    listed, array = (
        ff.study(linear, {"main_mass": one}, "stroke", 89.0) for one in (values, np.array(values))
    )
    assert (listed.sampling, listed.size) == ("grid", 2)
    np.testing.assert_array_equal(listed.values["stroke"], array.values["stroke"])
    drawn = ff.study(linear, {"main_mass": (900.0, 930.0)}, "stroke", 89.0, sampling=ff.Sample(n=4))
    assert drawn.size == 4
    rows = ff.study(linear, {"main_mass": values}, "stroke", 89.0, sampling="list")
    assert rows.columns["main_mass"].tolist() == values


def test_a_list_is_taken_row_by_row(linear):
    masses, springs = np.array([950.0, 900.0, 920.0]), np.array([2.5e6, 2.9e6, 2.7e6])
    found = ff.study(
        linear, {"main_mass": masses, "shear_stiffness": springs}, "relative_amplitude",
        [60.0, 89.0], sampling="list",
    )  # fmt: skip
    np.testing.assert_array_equal(found.columns["main_mass"], masses)
    np.testing.assert_array_equal(found.columns["shear_stiffness"], springs)
    for k in range(3):
        own = linear.replace(main_mass=masses[k], shear_stiffness=springs[k])
        expected = ff.linear_response(own, [60.0, 89.0]).amplitude("relative")
        np.testing.assert_allclose(found.values["relative_amplitude"][k, 0], expected, rtol=1e-10)


@pytest.mark.parametrize("method", ["sobol", "latin-hypercube", "monte-carlo"])
def test_samples_have_their_distributions(screen, method):
    """Of 4096 draws a Kolmogorov distance of 0.03 has a chance of 1e-3; better spread ones less."""
    vary = {**FIELDS, "stop_law": ff.Choice(("paper", "compression-only"))}
    sample = ff.Sample(n=4096, method=method, seed=7)
    columns = design_of(screen, vary, sample).columns
    gaps = stats.kstest(columns["clearance"], stats.uniform(5e-3, 2e-3).cdf).statistic
    springs = stats.kstest(columns["shear_stiffness"], stats.norm(2.7e6, 9e4).cdf).statistic
    assert max(gaps, springs) < 0.03
    assert abs((columns["stop_law"] == "paper").mean() - 0.5) < 0.03
    again = design_of(screen, vary, sample)
    other = design_of(screen, vary, ff.Sample(n=4096, method=method, seed=8))
    assert again.digest == design_of(screen, vary, sample).digest != other.digest


def test_a_latin_hypercube_has_one_in_each_share(screen):
    sample = ff.Sample(n=100, method="latin-hypercube")
    gaps = design_of(screen, FIELDS, sample).columns["clearance"]
    places = np.floor((gaps - 5e-3) / 2e-3 * 100.0).astype(int)
    assert sorted(places) == list(range(100))


def test_normal_fields_vary_together_as_their_covariance_says(screen):
    k2, k3 = ff.Normal(2.7e6, 9e4), ff.Normal(8.1e6, 3e5)
    covariance = [[8.1e9, 0.0, 0.8 * 9e4 * 3e5], [0.0, 0.0, 0.0], [0.8 * 9e4 * 3e5, 0.0, 9e10]]
    vary = {"shear_stiffness": k2, "clearance": (5e-3, 7e-3), "stop_stiffness": k3}
    sample = ff.Sample(n=8192, covariance=covariance)
    columns = design_of(screen, vary, sample).columns
    found = np.corrcoef(list(columns.values()))
    np.testing.assert_allclose(found, [[1, 0, 0.8], [0, 1, 0], [0.8, 0, 1]], atol=0.02)
    assert columns["stop_stiffness"].std() == pytest.approx(3e5, rel=0.02)
    assert columns["clearance"].max() < 7e-3


class Backwards(Executor):
    """An executor of one thread that takes the task that came last."""

    def __init__(self):
        self._tasks = queue.LifoQueue()
        threading.Thread(target=self._run, daemon=True).start()

    def submit(self, work, /, *arguments):
        """Take a task."""
        future = Future()
        self._tasks.put((id(future), future, work, arguments))
        return future

    def _run(self):
        while True:
            time.sleep(0.05)
            _, future, work, arguments = self._tasks.get()
            future.set_result(work(*arguments))


def test_workers_and_their_number_change_no_bit(screen):
    asked = screen, FIELDS, ("relative_amplitude", "jump_margin"), OMEGA
    sample = ff.Sample(n=130)
    one, two, other = (
        ff.study(*asked, sampling=sample, **where)
        for where in ({"threads": 1}, {"threads": 3}, {"executor": Backwards()})
    )
    for name in one.values:
        np.testing.assert_array_equal(one.values[name], two.values[name])
        np.testing.assert_array_equal(one.values[name], other.values[name])


def test_a_row_is_the_same_alone_and_among_others(screen):
    columns = design_of(screen, FIELDS, ff.Sample(n=16)).columns
    omega = np.array([89.0, OMEGA])
    asked = ("relative_amplitude", "omega_ub")
    whole, reasons = evaluate(screen, columns, asked, omega, "from-below")
    for k in (0, 7, 15):
        row = {name: column[k : k + 1] for name, column in columns.items()}
        alone, reason = evaluate(screen, row, asked, omega, "from-below")
        for name in asked:
            np.testing.assert_array_equal(alone[name][0], whole[name][k])
        np.testing.assert_array_equal(reason[0], reasons[k])


LOADS = [
    ff.Load(name="empty"),
    ff.Load(name="full", stiffness_factor=1.3, main_mass=20.0, floating_mass=40.0),
    ff.Load(name="hot", temperature=44.0, stop_stiffness_factor=0.9, damping_factor=1.1),
]


@pytest.mark.parametrize("measured", ["standing", "drawn"])
def test_a_load_acts_on_every_machine(screen, measured):
    """Columns under a load are the machines under that load; the shift but for rounding."""
    base = screen.replace(clearance_measured=measured)
    vary = {**FIELDS, "floating_mass": (280.0, 330.0), "deck_angle": (0.1, 0.3)}
    columns = design_of(base, vary, ff.Sample(n=8)).columns
    for load in LOADS:
        loaded = loaded_columns(base, load, columns)
        for k in range(8):
            one = base.replace(**{name: float(column[k]) for name, column in columns.items()})
            other = {name: float(column[k]) for name, column in loaded.items()}
            expected, found = one.loaded(load), base.loaded(load).replace(**other)
            assert found.gap_shift == pytest.approx(expected.gap_shift, rel=1e-13, abs=1e-20)
            assert found.replace(measured_shift=0.0) == expected.replace(measured_shift=0.0)


def test_load_cases_of_a_study(screen):
    found = ff.study(screen, {"clearance": np.array([5e-3, 6e-3])}, "relative_amplitude", OMEGA,
                     load_cases=LOADS)  # fmt: skip
    assert found.cases == ("empty", "full", "hot")
    for k, gap in enumerate((5e-3, 6e-3)):
        for c, load in enumerate(LOADS):
            expected = by_hand(screen.replace(clearance=gap).loaded(load), OMEGA, "relative")
            value = found.values["relative_amplitude"][k, c, 0]
            assert value == pytest.approx(expected, rel=1e-8)


def test_what_has_no_value_says_why(screen):
    """A mass below zero is no machine; one that has folds nowhere has no jump speed."""
    wide = ff.study(
        screen, {"floating_mass": ff.Normal(310.0, 400.0)}, "relative_amplitude", OMEGA,
        load_cases=[ff.Load(name="full", floating_mass=30.0)], sampling=ff.Sample(n=16),
    )  # fmt: skip
    heavy = wide.columns["floating_mass"] > 0.0
    assert 0 < heavy.sum() < 16
    np.testing.assert_array_equal(wide.reason[:, 0, 0] == 1, ~heavy)
    assert np.isnan(wide.values["relative_amplitude"][~heavy]).all()
    assert np.isfinite(wide.values["relative_amplitude"][heavy & (wide.reason[:, 0, 0] == 0)]).all()
    assert wide.failed >= (~heavy).mean()
    assert any("physics or the machine forbids" in note for note in wide.notes)
    gaps = ff.study(screen, {"clearance": np.array([3e-3, 6e-3])}, "omega_ub")
    assert np.isnan(gaps.values["omega_ub"][0, 0])
    assert gaps.values["omega_ub"].shape == (2, 1)
    assert (gaps.reason == 0).all()
    assert gaps.notes == ()


@dataclass(frozen=True)
class Block:
    """A mass on a spring that meets a stop."""

    stiffness: float = 1.0
    gap: float = 0.8

    def system(self):
        """Its equations."""
        stop = ff.ClearanceSpring([1.0], 5.0, 0.2, self.gap)
        return ff.MechanicalSystem([[1.0]], [[0.1]], [[self.stiffness]], [stop],
                                   ff.HarmonicForce([0.3]))  # fmt: skip


def test_any_machine(tmp_path):
    pytest.importorskip("zarr")
    vary = {"gap": (0.6, 1.0), "stiffness": ff.Normal(1.0, 0.05)}
    asked = (Block(), vary, ("amplitude[0]", "stop_force"), [0.8, 1.1])
    found = ff.study(*asked, sampling=ff.Sample(n=8), store=tmp_path / "s")
    own = {name: float(column[3]) for name, column in found.columns.items()}
    orbit = ff.frequency_response(Block(**own), (0.2, 1.1)).orbit_from_below(1.1)
    assert found.values["amplitude[0]"][3, 0, 1] == pytest.approx(orbit.amplitude(0), rel=1e-8)
    assert found.cases == ("empty",)
    assert ff.study(*asked, sampling=ff.Sample(n=8), store=tmp_path / "s").complete
    system = Block().system()
    plain = ff.study(system, {"springs[0].clearance": np.array([0.7, 0.8])}, "amplitude[0]", 1.1)
    assert plain.values["amplitude[0]"][1, 0, 0] == pytest.approx(
        found.nominal["amplitude[0]"][0, 1], rel=1e-8
    )


def test_a_monitor_hears_of_chunks_and_ends_the_work(linear):
    told = []

    def tell(sentence, share):
        told.append((sentence, share))
        if share >= 0.5:
            raise ff.Cancelled("enough")

    with pytest.raises(ff.Cancelled, match="enough"):
        ff.study(linear, {"main_mass": (900.0, 930.0)}, "relative_amplitude", 89.0,
                 sampling=ff.Sample(n=256), monitor=tell)  # fmt: skip
    assert told[1] == ("study: 0 of 4 chunks", 0.0)
    assert told[-1][0].startswith("study: 2 of 4 chunks, ")
    assert told[-1][0].endswith(" left")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"vary": {"gap": (0.0, 1.0)}}, "vary = 'gap'"),
        ({"vary": {}}, "vary"),
        ({"vary": {"clearance": [6e-3]}}, "= [0.006]: give an array or a list of at least two "),
        ({"vary": {"stop_law": ["paper"]}}, "= ['paper']: give a list or ff.Choice of at least tw"),
        ({"vary": {"clearance": [6e-3, "wide"]}}, "a list of at least two finite numbers"),
        ({"quantities": ()}, "quantities = ()"),
        ({"quantities": ("size",)}, "quantity = 'size'"),
        ({"quantities": ("stroke", "stroke")}, "named twice"),
        ({"omega": None}, "omega = None"),
        ({"omega": -1.0}, "omega = -1.0"),
        ({"sampling": "grid"}, "give an array"),
        ({"sampling": "random"}, 'give "grid", "list" or an ff.Sample'),
        ({"sampling": 100}, "ff.Sample"),
        ({"branch": "middle"}, "branch = 'middle'"),
        ({"load_cases": [1]}, "load_cases"),
        ({"load_cases": [ff.Load(), ff.Load()]}, "another case has this name"),
        ({"load_cases": [ff.Load(temperature=99.0)]}, "temperature"),
        ({"executor": 3}, "executor = 3"),
        ({"threads": 0}, "threads = 0"),
        ({"monitor": 3}, "monitor = 3"),
        ({"vary": {"clearance": np.array([1e-3, 2e-3]), "main_mass": np.array([9.0, 8.0, 7.0])},
          "sampling": "list"}, "as many values of every field"),
        ({"sampling": ff.Sample(covariance=[[1.0]])}, "for each of the 2 fields"),
        ({"sampling": ff.Sample(covariance=[[1.0, 1.0], [1.0, 8.1e9]])}, "only ff.Normal fields"),
        ({"sampling": ff.Sample(covariance=[[0.0, 0.0], [0.0, 1.0]])}, "the deviation of"),
    ],
)  # fmt: skip
def test_bad_input(screen, changes, words):
    given = {"vary": FIELDS, "quantities": "relative_amplitude", "omega": OMEGA} | changes
    with pytest.raises(ff.InputError) as refused:
        ff.study(screen, given.pop("vary"), given.pop("quantities"), given.pop("omega"), **given)
    assert words in str(refused.value)


@pytest.mark.parametrize(
    "words",
    [{"n": 1}, {"n": 2.5}, {"seed": -1}, {"method": "halton"}, {"covariance": [1.0]},
     {"covariance": [[1.0, 0.5], [0.4, 1.0]]}, {"covariance": [[1.0, np.nan], [np.nan, 1.0]]}],
)  # fmt: skip
def test_what_makes_no_sample(words):
    with pytest.raises(ff.InputError):
        ff.Sample(**words)


def test_a_covariance_that_nothing_has_is_refused(screen):
    vary = {"main_mass": ff.Normal(916.0, 1.0), "floating_mass": ff.Normal(310.0, 1.0)}
    with pytest.raises(ff.InputError, match="not positive definite"):
        ff.study(screen, vary, "stroke", OMEGA,
                 sampling=ff.Sample(n=4, covariance=[[1.0, 1.5], [1.5, 1.0]]))  # fmt: skip
