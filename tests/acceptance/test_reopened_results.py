"""Every result that a public function returns is saved, and opens as what it was."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import json
import math
import typing
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

import flipflow as ff
from flipflow.continuation.bifurcation_curve import BifurcationCurve
from flipflow.continuation.branch import Branch
from flipflow.continuation.field_branch import FieldBranch
from flipflow.dynamics.linear_response import LinearResponse
from flipflow.errors import InputError, StoreError
from flipflow.io.read_off import read_off
from flipflow.paper.claims import Claim
from flipflow.paper.reproduce import Reproduction
from flipflow.periodic.orbit import Orbit
from flipflow.periodic.solver import Point, Traced
from flipflow.plotting.figure import Figure
from flipflow.studies.assessment import Assessment
from flipflow.studies.basins import Basins
from flipflow.studies.bifurcation_diagram import BifurcationDiagram
from flipflow.studies.compare import Comparison
from flipflow.studies.design import Proposal
from flipflow.studies.design_map import DesignMap
from flipflow.studies.foundation_loads import FoundationLoads
from flipflow.studies.jump_risk import JumpRisk
from flipflow.studies.loading import Loading
from flipflow.studies.lyapunov import LyapunovExponents
from flipflow.studies.operating_region import OperatingRegion
from flipflow.studies.poincare import Section, Spectrum
from flipflow.studies.ramp import Ramp
from flipflow.studies.response_family import ResponseFamily
from flipflow.studies.sensitivity import Sensitivity
from flipflow.studies.study import Study
from flipflow.studies.tolerance import Tolerance
from flipflow.studies.worst_case import WorstCase
from flipflow.transient.history import History
from flipflow.transient.run_up import Peak, RunUp
from flipflow.transient.sweep import Sweep

SMALL = Path(__file__).parents[1] / "machines" / "small.toml"
NOT_RESULTS = {ff.FlipFlowScreen, ff.Project, ff.Duty, Figure}
DRIVE = ff.Drive(inertia=0.9, motor=ff.Motor(synchronous_speed=157.0, rated_power=5500.0))


@functools.cache
def screen() -> ff.FlipFlowScreen:
    return ff.load("ffs0827")


@functools.cache
def bistable() -> ff.MechanicalSystem:
    """One mass between hard stops: a small machine with two motions at 1.2 rad/s."""
    stop = ff.ClearanceSpring([1.0], 20.0, 0.0, 1.0)
    return ff.MechanicalSystem([[1.0]], [[0.05]], [[1.0]], [stop], ff.HarmonicForce([0.2j]))


@functools.cache
def chain() -> ff.MechanicalSystem:
    """Two masses without named coordinates, a stop on one side only."""
    stop = ff.ClearanceSpring([1.0, -1.0], 5.0, 0.1, 0.3, math.inf)
    return ff.MechanicalSystem(
        np.eye(2), [[0.1, -0.02], [-0.02, 0.05]], [[2.0, -1.0], [-1.0, 1.0]], [stop],
        ff.Unbalance([0.3, 0.1j]),
    )  # fmt: skip


@functools.cache
def response() -> Branch:
    return ff.frequency_response(screen(), (190.0, 210.0))


@functools.cache
def risk() -> JumpRisk:
    return ff.jump_risk(bistable(), 1.2)


def assessed() -> Assessment:
    project = ff.load_project("ffs0827")
    return ff.assess(dataclasses.replace(project, load_cases=project.load_cases[:2]))


def proposed() -> Proposal:
    """A machine from a catalogue, whose fields are an interval and a choice."""
    springs = (
        ff.SpringType(name="soft", stiffness=1.5e5, loss_factor=0.1, strain=0.3, price=40.0),
        ff.SpringType(name="hard", stiffness=2.5e5, loss_factor=0.1, height=0.05),
    )
    project = ff.load_project("ffs0827")
    duty = ff.Duty(
        project=dataclasses.replace(project, load_cases=project.load_cases[:1]),
        target=7e-3,
        tolerance=2e-3,
        speed=(83.8, 83.8),
        free={"clearance": (2e-3, 9e-3), "eccentric_moment": ff.Choice((3.0, 5.0))},
        scatter={"shear_stiffness": 0.1},
        catalogue=springs,
        pieces=(8, 12),
    )
    with pytest.MonkeyPatch.context() as few_built:
        few_built.setattr("flipflow.studies.candidates.BUILT", 64)
        return ff.design(duty, generations=2)


def studied() -> Study:
    """A few machines under two loads, whose normal fields vary together."""
    vary = {"main_mass": ff.Normal(916.0, 2.0), "floating_mass": ff.Normal(310.0, 1.0)}
    sample = ff.Sample(n=4, covariance=[[4.0, 1.0], [1.0, 1.0]])
    loads = [ff.Load(name="empty"), ff.Load(name="full", floating_mass=30.0)]
    asked = ("relative_amplitude", "omega_lb", "omega_ub")
    return ff.study(screen(), vary, asked, 120.0, sampling=sample, load_cases=loads)


MADE: dict[type, list[Callable[[], object]]] = {
    Branch: [
        response,
        lambda: ff.frequency_response(screen(), (195.0, 205.0), ff.HarmonicBalance(3)),
        lambda: ff.frequency_response(chain(), (0.3, 0.9)),
    ],
    FieldBranch: [
        lambda: ff.continue_orbit(response().orbit(3), "clearance", (5.9e-3, 6.1e-3)),
        lambda: ff.continue_fold(response().folds[0], "clearance", (5.8e-3, 6.2e-3)),
    ],
    BifurcationCurve: [
        lambda: ff.continue_bifurcation(
            response().folds[0], ("clearance", "omega"), ((5.8e-3, 6.2e-3), (190.0, 215.0))
        ),
        lambda: ff.continue_bifurcation(
            response().folds[0],
            ("stop_stiffness", "clearance"),
            ((8e6, 8.2e6), (5.8e-3, 6.2e-3)),
        ),
    ],
    Orbit: [
        lambda: response().orbits_at(203.0)[0],
        lambda: ff.frequency_response(chain(), (0.3, 0.9), ff.HarmonicBalance(3)).orbit(40),
    ],
    tuple: [lambda: ff.periodic_orbits(bistable(), 1.2), lambda: ()],
    Basins: [
        lambda: ff.basins(bistable(), 1.2, {0: np.linspace(-2.0, 2.0, 4)}, {0: [0.0, 1.0]}),
    ],
    JumpRisk: [risk],
    History: [
        lambda: ff.simulate(screen(), 120.0, 3, disturbances=[ff.Impulse(0.05, "main", 50.0)]),
        lambda: ff.simulate(chain(), 0.8, 2),
    ],
    RunUp: [
        lambda: ff.start_up(screen(), DRIVE, duration=0.5),
        lambda: ff.coast_down(screen(), 80.0, ff.SpeedProfile((0.0, 0.4), (80.0, 60.0))),
    ],
    Comparison: [lambda: ff.compare([SMALL, SMALL])],
    FoundationLoads: [
        lambda: ff.foundation_loads(
            {"empty": response().orbits_at(203.0)[0]},
            {"start": ff.start_up(screen(), DRIVE, duration=0.5)},
        )
    ],
    Sweep: [
        lambda: ff.sweep(screen(), np.linspace(198.0, 207.0, 4)),
        lambda: ff.sweep(chain(), [0.7, 0.9], most_turns=3),
    ],
    Ramp: [lambda: ff.ramp(screen(), (204.0, 208.0), 8.0)],
    Section: [lambda: ff.poincare_section(chain(), 0.8, 7, skip=3)],
    LyapunovExponents: [
        lambda: ff.lyapunov_exponents(screen(), 120.0, periods=64, skip=10),
        lambda: ff.lyapunov_exponents(chain(), 0.8, periods=64, skip=0),
    ],
    BifurcationDiagram: [
        lambda: ff.bifurcation_diagram(screen(), "omega", [198.0, 203.0, 207.0]),
        lambda: ff.bifurcation_diagram(screen(), "clearance", [5e-3, 6e-3], omega=203.0),
        lambda: ff.bifurcation_diagram(chain(), "forcing", [1.0, 1.1], omega=0.8, most_turns=3),
    ],
    Spectrum: [lambda: ff.spectrum(response().orbit(0), "relative")],
    LinearResponse: [lambda: ff.linear_response(screen(), [10.0, 20.0])],
    OperatingRegion: [
        lambda: ff.operating_region(
            screen(),
            ff.Limits(jump_margin=0.1, speed=(80.0, 180.0)),
            [ff.Load(main_mass=50.0)],
            omega=(80.0, 230.0),
        )
    ],
    Loading: [lambda: ff.loading(screen(), ff.Load(stiffness_factor=1.1, name="wet"))],
    DesignMap: [lambda: ff.design_map(screen(), 120.0, [5e-3, 7e-3], [6e6, 9e6])],
    ResponseFamily: [
        lambda: ff.response_family(screen(), {"clearance": [5e-3, 6e-3]}, omega=(80.0, 230.0))
    ],
    Sensitivity: [
        lambda: ff.sensitivity(screen(), {"clearance": (5e-3, 7e-3)}, "stroke", 120.0, n=2),
        lambda: ff.sensitivity(
            screen(), {"clearance": ff.Choice((5e-3, 6e-3))}, "omega_ub", (80.0, 230.0), n=2
        ),
    ],
    Study: [
        studied,
        lambda: ff.study(
            screen(),
            {"clearance": np.array([5e-3, 6e-3]), "stop_law": ff.Choice(("paper", "elasto-gap"))},
            "stroke",
            120.0,
        ),
        lambda: ff.study(
            chain(), {"forcing": (0.9, 1.1)}, "stop_force", 0.8, sampling=ff.Sample(n=4)
        ),
    ],
    Tolerance: [lambda: ff.tolerance(studied(), ff.Limits(relative_amplitude=(5e-3, 9e-3)))],
    WorstCase: [
        lambda: ff.worst_case(screen(), {"clearance": (5e-3, 7e-3)}, "stroke", [85.0, 120.0]),
        lambda: ff.worst_case(chain(), {"forcing": (0.9, 1.1)}, "stop_force", 0.8),
    ],
    Proposal: [proposed],
    Assessment: [assessed],
    Reproduction: [lambda: ff.reproduce(figures=("1", "3", "5"))],
}
CASES = [
    pytest.param(make, id=f"{kind.__name__}-{k}")
    for kind, makers in MADE.items()
    for k, make in enumerate(makers)
]


def through_a_file(result: object, folder: Path) -> typing.Any:
    ff.save(result, folder / "result.json")
    return ff.open_result(folder / "result.json")


@pytest.mark.parametrize("make", CASES)
def test_a_saved_result_opens_as_what_it_was(tmp_path, make):
    result = make()
    again = through_a_file(result, tmp_path)
    assert_same(again, result, type(result).__name__)
    document = json.loads((tmp_path / "result.json").read_text())
    assert document["schema"].startswith("flipflow/")
    assert repr(again) == repr(result)
    assert len(repr(result)) < 250, "what a prompt shows is a line, not the arrays"


def test_every_result_of_the_public_face_is_tried():
    """A new function whose result is not among the cases fails here."""
    functions = (getattr(ff, name) for name in ff.__all__)
    returned = {
        typing.get_origin(kind) or kind
        for function in functions
        if inspect.isfunction(function)
        for kind in members(typing.get_type_hints(function).get("return"))
    }
    assert {kind for kind in returned - NOT_RESULTS if inspect.isclass(kind)} <= set(MADE)


def members(hint: object) -> tuple[object, ...]:
    """The parts of a union, or the hint alone; nothing of None and Any."""
    if hint in (None, type(None), typing.Any):
        return ()
    if typing.get_origin(hint) in (typing.Union, type(int | str)):
        return typing.get_args(hint)
    return (hint,)


def assert_same(one: typing.Any, other: typing.Any, where: str) -> None:
    """The same type, and equal in every field, arrays to the last bit, NaN where NaN was."""
    if isinstance(other, np.generic):
        other = other.item()
    assert isinstance(other, Mapping) or type(one) is type(other), where
    for name, (here, there) in parts(one, other, where).items():
        assert_same(here, there, f"{where}{name}")


def parts(one: typing.Any, other: typing.Any, where: str) -> dict[str, tuple[object, object]]:
    """What is compared further of two values; values without parts are compared here."""
    if isinstance(other, Mapping):
        assert dict(one).keys() == dict(other).keys(), where
        return {f"[{key!r}]": (one[key], other[key]) for key in other}
    if isinstance(other, tuple):
        assert len(one) == len(other), where
        return {f"[{k}]": pair for k, pair in enumerate(zip(one, other, strict=True))}
    if dataclasses.is_dataclass(other) and type(other) is not Claim:
        return {f".{name}": (getattr(one, name), getattr(other, name)) for name in told_by(other)}
    np.testing.assert_array_equal(one, other, err_msg=where)
    return {}


def told_by(result: object) -> list[str]:
    """What is compared: the fields, and of points what is read off them."""
    if isinstance(result, Point):
        return ["formulation", "u", "omega", "return_map"]
    # The depths at the gaps serve the search for special points alone, and are not kept.
    left_out = {"record"} if isinstance(result, Traced) else {"word"}
    followed = ["u", "omega", "tangent", "signature"]
    also = {
        Traced: followed,
        Orbit: ["stability", "error"],
        Branch: ["error"],
        Sweep: ["periods", "distance"],
    }
    names = [field.name for field in dataclasses.fields(result)]
    return [name for name in names if name not in left_out] + also.get(type(result), [])


@pytest.mark.parametrize("make", [MADE[Branch][0], MADE[Sweep][0], MADE[FieldBranch][0]])
def test_what_is_read_off_an_opened_result_is_the_same(tmp_path, make):
    result = make()
    again = through_a_file(result, tmp_path)
    for which in ("main", "floating", "relative"):
        np.testing.assert_allclose(again.amplitude(which), result.amplitude(which), rtol=1e-12)
    assert len(ff.figure(again).panels) == len(ff.figure(result).panels)


def test_a_run_that_grew_beyond_all_bounds_is_saved(tmp_path):
    """NaN and infinity are kept apart from what is not known."""
    run = MADE[RunUp][0]()
    x = run.history.x.copy()
    x[-1] = math.nan
    bad = dataclasses.replace(
        run,
        final_speed=math.nan,
        peaks={"main_amplitude": Peak(math.nan, math.inf, 0.1)},
        near=None,
        history=dataclasses.replace(run.history, x=x, energy={"input": -math.inf}),
    )
    again = through_a_file(bad, tmp_path)
    assert_same(again, bad, "RunUp")
    assert "NaN" not in (tmp_path / "result.json").read_text()


def test_an_infinite_lump_is_not_a_plain_impulse(tmp_path):
    assert risk().impulses
    heavy = dataclasses.replace(risk().impulses[0], lump=math.inf)
    again = through_a_file(dataclasses.replace(risk(), lumps=(heavy,)), tmp_path)
    assert again.lumps[0].lump == math.inf
    assert again.impulses[0].lump is None


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("hello", "cannot be read"),
        ("[1, 2]", "is not a result of flipflow"),
        ('{"schema": "flipflow/branch/99"}', r"flipflow/branch/99.*update flipflow"),
        ('{"schema": "flipflow/sweeps/1", "up": {}}', "is damaged: name is missing"),
        ('{"schema": 3}', "is not a result of flipflow"),
        ('{"schema": "flipflow/branch/1"}', "is damaged"),
        ('{"schema": "flipflow/branch/1", "machine": [], "method": 3}', "is damaged"),
        ('{"schema": "flipflow/loading/1", "screen": {"kind": "screen"}}', "is damaged"),
        ('{"schema": "flipflow/spectrum/1", "frequencies": {"a": 1}}', "is damaged"),
    ],
)
def test_a_file_that_is_no_result_says_so(tmp_path, content, words):
    (tmp_path / "file.json").write_text(content)
    with pytest.raises(StoreError, match=words) as raised:
        ff.open_result(tmp_path / "file.json")
    assert str(tmp_path) in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_summary_of_the_command_line_says_what_opens_again(tmp_path):
    assessment = ff.assess(ff.load_project(SMALL))
    for name, document in (
        ("assessment", {"schema": "flipflow/assessment/1", **read_off(assessment)}),
        ("claims", ff.reproduce(figures=("1",)).document()),
    ):
        (tmp_path / f"{name}.json").write_text(json.dumps(document))
        with pytest.raises(StoreError, match=r"summary.*ff\.save"):
            ff.open_result(tmp_path / f"{name}.json")


@pytest.mark.parametrize("value", [3, "text", (1, 2), None])
def test_what_is_no_result_is_not_saved(tmp_path, value):
    with pytest.raises(InputError, match="result = "):
        ff.save(value, tmp_path / "x.json")
    assert not (tmp_path / "x.json").exists()
