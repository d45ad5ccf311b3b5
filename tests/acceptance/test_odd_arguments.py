"""Odd arguments of the public face end in a sentence, or work as documented."""

from __future__ import annotations

import copy
import inspect
import itertools
import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import flipflow as ff
from flipflow import errors
from flipflow.results.result import Result
from judge import close
from odd_arguments import (
    Call,
    classes,
    doubled,
    ending,
    findings,
    folded,
    functions,
    methods,
    orbit,
    screen,
    tiny,
)

SEED, DRAWS = 9, 6
KINDS = {"functions": functions, "classes": classes, "methods": methods}
ERRORS = (
    errors.FlipflowError("a sentence"),
    errors.InputError("field", np.arange(3.0), "a remedy"),
    errors.InputError("field", lambda: None, "a remedy"),
    errors.IncompleteError("a sentence"),
    errors.StoreError("a sentence"),
    errors.Cancelled("a sentence"),
    errors.MissingExtra("a sentence"),
    errors.SampledContactWarning("a sentence"),
)


@pytest.mark.parametrize("kind", KINDS)
def test_valid_calls_are_valid(kind):
    ended = {call.name: ending(call, call.arguments) for call in KINDS[kind]()}
    assert {name: words for name, words in ended.items() if words} == {}


@pytest.mark.parametrize("kind", KINDS)
def test_odd_arguments(kind):
    """Each place of each call with a few odd arguments.

    Dear calls have fewer draws, so that this stays a matter of seconds; all of them:
    benchmarks/every_odd_argument.py.
    """
    print(f"seed {SEED}")  # noqa: T201  shown where it fails
    found = [
        finding
        for call in KINDS[kind]()
        for finding in findings(call, SEED, 2 if call.name in SLOW else DRAWS)
    ]
    assert not found, "\n".join(map(str, found))


SLOW = {
    "basins",
    "design_map",
    "jump_risk",
    "continue_bifurcation",
    "continue_fold",
    "periodic_orbits",
    "coast_down",
}


def test_every_public_name_is_called():
    known = {call.name for listed in (functions, classes) for call in listed()}
    public = {name for name in ff.__all__ if callable(getattr(ff, name))}
    # Errors are raised and results returned; a Machine is a protocol, a status an enumeration.
    kinds = {name: getattr(ff, name) for name in public if inspect.isclass(getattr(ff, name))}
    results = {name for name, kind in kinds.items() if issubclass(kind, Result)}
    raised = {name for name, kind in kinds.items() if issubclass(kind, Exception)}
    # A comparison analyses machines whole, too slow to spoil each argument: test_compare does.
    others = {"Machine", "BranchStatus", "SpecialPoint", "Trial", "Figure", "compare"}
    assert public - known == results | raised | others


def test_every_argument_is_spoilt():
    for call in (*functions(), *classes()):
        assert set(inspect.signature(call.function).parameters) == set(call.arguments), call.name


def test_the_harness_sees_what_is_wrong():
    """A function that checks nothing has findings."""

    def doubled_of(omega):
        return 2.0 * float(omega)

    bare = Call("bare", doubled_of, {"omega": 1.0}, (float,))
    ended = {finding.value: finding.ended for finding in findings(bare, SEED, None)}
    assert ended["{}"].startswith("TypeError")
    assert ended["'main'"].startswith("ValueError")
    assert ended["10**400"].startswith("OverflowError")
    wrong = Call("wrong", str, {"object": 1.0}, (float,))
    assert {f.ended for f in findings(wrong, SEED, 3)} == {"returned a str"}


def test_what_a_call_writes_stands_in_a_folder_of_its_own(tmp_path, monkeypatch):
    """A word may be taken for the name of a file."""
    monkeypatch.chdir(tmp_path)
    writing = Call("writing", lambda path: Path(path).touch(), {"path": "own"}, (type(None),))
    list(findings(writing, SEED, None))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: ff.frequency_response(tiny(), (80.0, 120.0), False), "method = False"),
        (lambda: ff.linear_response(tiny(), "203"), "omega = '203'"),
        (lambda: ff.linear_response(tiny(), [True, 2.0]), "omega = [True, 2.0]"),
        (lambda: ff.operating_region(screen(), load_cases=""), "load_cases = ''"),
        (lambda: ff.simulate(tiny(), 100.0, 2, monitor=True), "monitor = True"),
        (lambda: ff.simulate(tiny(), 100.0, 2, monitor=lambda: None), "a sentence and the share"),
        (lambda: ff.simulate(orbit(), 100.0, 2), "machine = 'Orbit'"),
        (lambda: ff.simulate(ff.FlipFlowScreen, 100.0, 2), "give a FlipFlowScreen"),
        (lambda: tiny().coordinate(None), "coordinate = None"),
        (lambda: orbit().peak(0), "give a function of (t, x, v, a)"),
        (lambda: orbit().peak(lambda *_: 0.0), "one number for each time"),
        (lambda: ff.MechanicalSystem([[1]], [[1]], [[1]], (), []), "give ff.Unbalance"),
        (lambda: ff.Load(temperature="50"), "temperature = '50'"),
        (lambda: ff.LoadStep(0, "x"), "load = 'x'"),
        (lambda: ff.Drive(inertia=1.0, motor="x"), "motor = 'x'"),
        (lambda: ff.linear_response(tiny(), np.zeros(10**6)), "omega = "),
        (lambda: ff.loading(screen(), ff.Load(), omega={}), "omega = {}"),
        (lambda: ff.Choice(itertools.count(1)), "give at least two values"),
        (lambda: ff.ramp(tiny(), (95.0, 105.0), 1e-9), "give a rate between"),
    ],
)
def test_the_sentence(call, told):
    with pytest.raises(ff.InputError) as caught:
        call()
    sentence = str(caught.value)
    assert told in sentence
    assert len(sentence) < 250


def test_numbers_of_numpy_are_numbers():
    assert (
        ff.HarmonicBalance(np.int64(5)) == ff.HarmonicBalance(np.array(5)) == ff.HarmonicBalance(5)
    )
    assert ff.Load(main_mass=np.array(5.0)) == ff.Load(main_mass=5)
    with pytest.raises(ff.InputError):
        ff.Load(main_mass=np.bool_(1))


def test_a_figure_takes_its_result_by_name():
    assert ff.figure(result=orbit()).title == ff.figure(orbit()).title


def test_a_ramp_without_a_stable_motion_is_no_bad_input(monkeypatch):
    """A numerical failure: the words say what to try."""
    monkeypatch.setattr("flipflow.studies.ramp.attracting_orbits", lambda *_: ())
    monkeypatch.setattr("flipflow.continuation.branch.Branch.orbits_at", lambda *_: ())
    with pytest.raises(errors.IncompleteError, match="begin at another speed"):
        ff.ramp(tiny(), (95.0, 105.0), 100.0)


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_errors_can_be_pickled_and_copied(error):
    error.add_note("a note")
    for again in (
        pickle.loads(pickle.dumps(error)),  # noqa: S301  made here
        copy.deepcopy(error),
        copy.copy(error),
    ):
        assert type(again) is type(error)
        assert str(again) == str(error)
        assert again.__notes__ == ["a note"]
        if isinstance(error, ff.InputError):
            assert (again.field, again.remedy) == (error.field, error.remedy)
            assert str(again.value)


def refused(value: object) -> None:
    """Work for another process."""
    ff.Load(main_mass=value)


def test_an_error_of_a_worker_reaches_the_one_who_waits():
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        with pytest.raises(ff.InputError, match="main_mass = -1") as caught:
            pool.submit(refused, -1).result(timeout=60)
        assert caught.value.value == -1
        with pytest.raises(ff.InputError, match="main_mass = 'x'"):
            pool.submit(refused, "x").result(timeout=60)


def test_a_fold_over_a_wide_interval_closes():
    """From 0 to 250 m about a gap of 6 mm: the two folds of the gap are one closed curve.

    One end is the cusp, whose reference value is known to 1e-3; beyond the other no gap has folds.
    """
    wide = ff.continue_fold(folded().folds[0], "clearance", (0, 250))
    assert wide.complete
    born, gone = sorted(wide.points_of("cusp"), key=lambda point: point.value)
    close("cusp", [born.value, born.omega], [5.3021e-3, 210.416], rel=1e-3)
    assert 6e-3 < gone.value < 0.1


def test_steps_that_lead_nowhere_end(monkeypatch):
    monkeypatch.setattr("flipflow.periodic.solver.POINTS_MOST", 5)
    branch = ff.continue_fold(folded().folds[0], "clearance", (2e-3, 9e-3))
    assert branch.status.name == "POINT_LIMIT"
    assert not branch.complete


FOLLOWED = {
    "orbit over a field": lambda monitor: ff.continue_orbit(
        folded().orbit(0), "clearance", (5.9e-3, 6.1e-3), monitor=monitor
    ),
    "orbit over omega": lambda monitor: ff.continue_orbit(
        orbit(), "omega", (79.0, 81.0), monitor=monitor
    ),
    "fold": lambda monitor: ff.continue_fold(
        folded().folds[0], "clearance", (5.9e-3, 6.1e-3), monitor=monitor
    ),
    "curve": lambda monitor: ff.continue_bifurcation(
        folded().folds[0],
        ("clearance", "omega"),
        ((5.9e-3, 6.1e-3), (190.0, 215.0)),
        monitor=monitor,
    ),
    "branching": lambda monitor: ff.switch_branch(
        doubled(), (doubled().omega - 0.1, doubled().omega + 0.1), monitor=monitor
    ),
}


@pytest.mark.parametrize("name", FOLLOWED)
def test_following_tells_how_far_it_is_and_can_be_cancelled(name):
    heard = []
    FOLLOWED[name](lambda words, share: heard.append((words, share)))
    shares = [share for _, share in heard]
    assert len(shares) > 1
    assert shares == sorted(shares)
    assert 0.0 <= shares[0] < shares[-1] <= 1.0
    assert all(words for words, _ in heard)

    def stop(_words, share):
        if share >= shares[1]:
            raise errors.Cancelled("enough")

    with pytest.raises(errors.Cancelled, match="enough"):
        FOLLOWED[name](stop)


def test_paths_of_files(tmp_path):
    for path in (5, None, b"x.json"):
        with pytest.raises(ff.InputError, match="path"):
            ff.save(orbit(), path)
    with pytest.raises(errors.StoreError, match="path"):
        ff.save(orbit(), "a\0b.json")
    ff.save(result=orbit(), path=Path(tmp_path / "x.json"))
    assert ff.open_result(path=str(tmp_path / "x.json")).omega == orbit().omega
