"""Small valid calls of every public name, and arguments of every kind to spoil them with.

Each call is made with one argument replaced. What comes back has to be an error of flipflow, or a
result of the type that is documented; anything else is a finding. Shared by
``acceptance/test_odd_arguments.py`` and ``benchmarks/every_odd_argument.py``.
"""

from __future__ import annotations

import atexit
import contextlib
import datetime as dt
import itertools
import math
import shutil
import tempfile
import warnings
import zlib
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from decimal import Decimal
from fractions import Fraction
from functools import cache
from pathlib import Path
from types import NoneType

import numpy as np

import flipflow as ff
from flipflow.continuation.bifurcation_curve import BifurcationCurve
from flipflow.continuation.branch import Branch, SpecialPoint
from flipflow.continuation.field_branch import FieldBranch
from flipflow.dynamics.linear_response import LinearResponse
from flipflow.errors import FlipflowError
from flipflow.model.arguments import members_of, real
from flipflow.model.project import Document
from flipflow.paper.reproduce import Reproduction
from flipflow.periodic.orbit import Orbit
from flipflow.plotting.figure import Figure
from flipflow.studies.assessment import Assessment
from flipflow.studies.basins import Basins, GridAxis
from flipflow.studies.bifurcation_diagram import BifurcationDiagram
from flipflow.studies.design_map import DesignMap
from flipflow.studies.foundation_loads import Components, FoundationLoads
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
from flipflow.transient.run_up import RunUp
from flipflow.transient.sweep import Sweep
from flipflow.transient.time_stepping import RungeKutta

OMEGA = 100.0
FEW = ff.PiecewiseExact(points=10)


@dataclass(frozen=True)
class Call:
    """A valid call by keywords, what it may return, and which valid arguments cost too much."""

    name: str
    function: Callable[..., object]
    arguments: Mapping[str, object]
    returns: tuple[type, ...]
    dear: Mapping[str, Callable[[object], bool]] = field(default_factory=dict)

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True)
class Finding:
    """A call that ended otherwise than it should."""

    call: str
    argument: str
    value: str
    ended: str

    def __str__(self) -> str:
        return f"{self.call}({self.argument}={self.value}): {self.ended}"


class Unshown:
    """It cannot even be shown."""

    def __repr__(self) -> str:
        raise RuntimeError("no words for it")


def told(*_words: object) -> None:
    """Takes whatever it is told."""


@cache
def folder() -> Path:
    """Where calls may write."""
    made = tempfile.mkdtemp(prefix="odd-arguments-")
    atexit.register(shutil.rmtree, made, ignore_errors=True)
    return Path(made)


@cache
def tiny() -> ff.MechanicalSystem:
    """One mass of 1 kg with a stop; its natural frequency is 100 rad/s."""
    spring = ff.ClearanceSpring([1.0], 2e4, 10.0, 1e-3)
    return ff.MechanicalSystem(
        [[1.0]], [[40.0]], [[1e4]], (spring,), ff.Unbalance([1e-3]), {"main": [1.0]}
    )


@cache
def screen() -> ff.FlipFlowScreen:
    """The paper's machine."""
    return ff.load("ffs0827")


@cache
def plain() -> ff.FlipFlowScreen:
    """The same without stop: closed form."""
    return ff.load("ffs0827-linear")


@cache
def stored() -> Path:
    """The store of a study."""
    path = folder() / "study.zarr"
    vary, sample = {"main_mass": (900.0, 920.0)}, ff.Sample(n=4)
    ff.study(plain(), vary, "relative_amplitude", OMEGA, sampling=sample, store=path)
    return path


@cache
def running() -> Orbit:
    """A motion of the machine without stop."""
    return ff.frequency_response(plain(), (80.0, 90.0), FEW).orbits_at(85.0)[0]


@cache
def tiny_branch() -> Branch:
    """The tiny machine's response."""
    return ff.frequency_response(tiny(), (80.0, 120.0), FEW)


@cache
def folded() -> Branch:
    """A response with both folds."""
    return ff.frequency_response(screen(), (190.0, 210.0), ff.PiecewiseExact(points=40))


@cache
def orbit() -> Orbit:
    """A motion of the tiny machine."""
    return tiny_branch().orbit(0)


@cache
def doubled() -> SpecialPoint:
    """A loss of symmetry: just above contact a small gap breaks it."""
    narrow = screen().replace(clearance=2e-3)
    branch = ff.frequency_response(narrow, (56.0, 60.0), ff.PiecewiseExact(points=60))
    return branch.points_of("symmetry breaking")[0]


@cache
def history() -> History:
    """Three turns from rest."""
    return ff.simulate(tiny(), OMEGA, 3)


def odd(name: str) -> object:
    """An argument by its name; iterators are made anew."""
    if name == "count":
        return itertools.count(1)
    if name == "generator":
        return (x for x in (1.0, 2.0))
    return kinds()[name]


@cache
def kinds() -> dict[str, object]:
    """Arguments of every kind by name."""
    endless: list[object] = []
    endless.append(endless)
    return {
        "None": None, "True": True, "np.True_": np.True_, "'203'": "203", "''": "",
        "'main'": "main", "'relative'": "relative", "a word": "word\0", "b'x'": b"x",
        "bytearray": bytearray(b"12"), "{}": {}, "{'a': 1}": {"a": 1}, "{1: 2}": {1: 2},
        "[]": [], "()": (), "set": {1.0, 2.0}, "[1, 2]": [1, 2], "(2.0, 1.0)": (2.0, 1.0),
        "[True, 2.0]": [True, 2.0], "['1', '2']": ["1", "2"], "ragged": [[1.0, 2.0], [3.0]],
        "[None]": [None], "(None, None)": (None, None), "endless list": endless,
        "nan": math.nan, "inf": math.inf, "-inf": -math.inf, "-1": -1, "0": 0, "1": 1,
        "2.5": 2.5, "-0.0": -0.0, "1e308": 1e308, "-1e308": -1e308, "5e-324": 5e-324,
        "10**400": 10**400, "-10**5000": -(10**5000), "1j": 1j, "complex nan": complex(math.nan),
        "Fraction": Fraction(1, 3), "Decimal": Decimal("1.5"), "np.float64": np.float64(2.0),
        "np.int64": np.int64(2), "np.uint8": np.uint8(1), "np.float32 nan": np.float32(np.nan),
        "np.longdouble": np.longdouble(3.0), "0-d": np.array(2.0), "0-d int": np.array(2),
        "0-d bool": np.array(True), "0-d text": np.array("2"), "array": np.array([1.0, 2.0]),
        "empty array": np.array([]), "(2, 2)": np.zeros((2, 2)), "(0, 3)": np.zeros((0, 3)),
        "texts": np.array(["a", "b"]), "booleans": np.array([True, False]),
        "objects": np.array([1, "x"], object), "object array": np.array([object()]),
        "array of None": np.array(None), "complex array": np.array([1.0 + 2.0j]),
        "datetime64": np.datetime64("2020-01-01"), "dates": np.array(["2020"], "M8[D]"),
        "masked": np.ma.masked, "a million": np.zeros(10**6), "long list": list(range(10**5)),
        "range": range(3), "deque": deque([1.0, 2.0]), "count": None, "generator": None,
        "lambda": lambda: None, "told": told,
        "len": len, "int": int, "dict": dict, "object": object(),
        "unshown": Unshown(), "datetime": dt.datetime(2020, 1, 1, tzinfo=dt.UTC),
        "Path": folder() / "nowhere.json", "slice": slice(0, 2), "...": ..., "module": ff,
        "error": ValueError("x"), "memoryview": memoryview(b"12"),
        "Orbit": orbit(), "Branch": tiny_branch(), "History": history(), "system": tiny(),
        "screen": screen(), "FlipFlowScreen": ff.FlipFlowScreen, "Load": ff.Load(),
        "[Load]": [ff.Load()], "Limits": ff.Limits(), "Motor": motor(), "Drive": drive(),
        "profile": profile(), "method": FEW, "HarmonicBalance": ff.HarmonicBalance,
        "Normal": ff.Normal(1.0, 0.1), "Generator": np.random.default_rng(1),
        "spring": ff.ClearanceSpring([1.0], 1.0), "fold": folded().folds[0],
    }  # fmt: skip


def motor() -> ff.Motor:
    """A small motor."""
    return ff.Motor(synchronous_speed=150.0, rated_power=100.0)


def drive() -> ff.Drive:
    """A small drive."""
    return ff.Drive(inertia=0.01, motor=motor())


def profile() -> ff.SpeedProfile:
    """Three turns down from 100 rad/s."""
    return ff.SpeedProfile((0.0, 0.2), (OMEGA, 90.0))


def project() -> ff.Project:
    """A machine file without speed: nothing is run over time."""
    return replace(ff.load_project("ffs0827-linear"), speed=None, load_cases=(ff.Load(),))


@cache
def duty() -> ff.Duty:
    """A duty of one field on the machine without stops."""
    return ff.Duty(
        project=project(), target=2e-3, tolerance=1e-3, speed=(OMEGA, OMEGA),
        free={"eccentric_moment": (3.0, 5.0)},
    )  # fmt: skip


@cache
def duty_file() -> Path:
    """The same as a file."""
    place = folder() / "duty.toml"
    place.write_text(
        'machine = "ffs0827-linear"\n[duty]\nrelative_amplitude = "2 mm"\ntolerance = "1 mm"\n'
        '[free]\neccentric_moment = "3 kg m..5 kg m"\n'
    )
    return place


@cache
def functions() -> tuple[Call, ...]:
    """Functions of the public face."""
    narrow, around = (80.0, 82.0), (95.0, 105.0)
    whole = {"omega": lambda value: value is None}
    near = {"omega": (60.0, 100.0), "method": FEW}
    ff.save(orbit(), folder() / "kept.json")
    return (
        Call("assess", ff.assess, {"project": project(), "monitor": None, **near},
             (Assessment,), whole),
        Call("basins", ff.basins,
             {"machine": tiny(), "omega": OMEGA, "displacement": {"main": [0.0, 1e-3]},
              "velocity": {"main": 0.0}, "most_turns": 50, "rng": 0, "threads": 1,
              "monitor": None}, (Basins,)),
        Call("bifurcation_diagram", ff.bifurcation_diagram,
             {"machine": tiny(), "parameter": "omega", "values": [99.0, OMEGA], "omega": None,
              "initial": "rest", "points": 3, "max_periods": 1, "most_turns": 50,
              "monitor": None}, (BifurcationDiagram,)),
        Call("coast_down", ff.coast_down,
             {"machine": tiny(), "speed": OMEGA, "drive": profile(), "duration": 0.1,
              "method": None, "monitor": None}, (RunUp,)),
        Call("continue_bifurcation", ff.continue_bifurcation,
             {"point": folded().folds[0], "parameters": ("clearance", "omega"),
              "bounds": ((5.9e-3, 6.1e-3), (190.0, 215.0)), "monitor": None},
             (BifurcationCurve,)),
        Call("continue_fold", ff.continue_fold,
             {"fold": folded().folds[0], "field": "clearance", "interval": (5.9e-3, 6.1e-3),
              "monitor": None}, (FieldBranch,)),
        Call("continue_orbit", ff.continue_orbit,
             {"orbit": orbit(), "field": "omega", "interval": narrow, "monitor": None},
             (Branch, FieldBranch)),
        Call("design_map", ff.design_map,
             {"screen": plain(), "omega": OMEGA, "clearance": [5e-3, 6e-3],
              "stop_stiffness": [7e6, 8e6], "load": ff.Load(), "monitor": None}, (DesignMap,)),
        Call("foundation_loads", ff.foundation_loads,
             {"motions": {"empty": running()}, "runs": None}, (FoundationLoads,)),
        Call("figure", ff.figure,
             {"result": tiny_branch(), "coordinate": 0, "units": "SI", "width": 84.0,
              "multipliers": False}, (Figure,)),
        Call("frequency_response", ff.frequency_response,
             {"machine": tiny(), "omega": narrow, "method": FEW}, (Branch,)),
        Call("jump_risk", ff.jump_risk,
             {"machine": tiny(), "motion": OMEGA, "largest_impulse": 1e-2, "rng": 0,
              "threads": 1, "monitor": None}, (JumpRisk,)),
        Call("linear_response", ff.linear_response, {"machine": tiny(), "omega": [OMEGA]},
             (LinearResponse,)),
        Call("load", ff.load, {"name_or_path": "ffs0827", "force": False}, (ff.FlipFlowScreen,)),
        Call("load_project", ff.load_project, {"name_or_path": "ffs0827", "force": False},
             (ff.Project,)),
        Call("loading", ff.loading,
             {"screen": plain(), "load": ff.Load(stiffness_factor=1.1), **near}, (Loading,), whole),
        Call("lyapunov_exponents", ff.lyapunov_exponents,
             {"machine": tiny(), "omega": OMEGA, "initial": "rest", "periods": 32, "skip": 2,
              "monitor": None}, (LyapunovExponents,)),
        Call("open_result", ff.open_result, {"path": folder() / "kept.json"}, (Orbit,)),
        Call("operating_region", ff.operating_region,
             {"screen": plain(), "limits": ff.Limits(), "load_cases": [ff.Load()],
              "monitor": None, **near}, (OperatingRegion,), whole),
        Call("periodic_orbits", ff.periodic_orbits,
             {"machine": tiny(), "omega": OMEGA, "max_periods": 1, "rng": 0, "monitor": None},
             (tuple,)),
        Call("poincare_section", ff.poincare_section,
             {"machine": tiny(), "omega": OMEGA, "turns": 3, "initial": "rest", "skip": 2},
             (Section,)),
        Call("ramp", ff.ramp,
             {"machine": tiny(), "omega": around, "rate": 100.0, "monitor": None}, (Ramp,)),
        Call("reproduce", ff.reproduce,
             {"screen": plain(), "figures": ["figure-01"], "monitor": None}, (Reproduction,),
             {"figures": lambda value: members_of(value) == ()}),
        Call("response_family", ff.response_family,
             {"screen": plain(), "vary": {"clearance": [math.inf]}, **near},
             (ResponseFamily,), whole),
        Call("save", ff.save, {"result": orbit(), "path": folder() / "again.json"}, (NoneType,)),
        Call("sensitivity", ff.sensitivity,
             {"machine": plain(), "vary": {"main_mass": (900.0, 920.0)},
              "quantity": "relative_amplitude", "omega": OMEGA, "n": 8, "rng": 0, "threads": 1,
              "monitor": None, "branch": "from-below"}, (Sensitivity,)),
        Call("simulate", ff.simulate,
             {"machine": tiny(), "omega": OMEGA, "periods": 2, "initial": "rest",
              "disturbances": (), "t": None, "monitor": None}, (History,)),
        Call("spectrum", ff.spectrum, {"motion": history(), "which": "main", "periods": 1},
             (Spectrum,)),
        Call("start_up", ff.start_up,
             {"machine": tiny(), "drive": drive(), "speed": None, "duration": 0.05,
              "angle": None, "method": None, "monitor": None}, (RunUp,)),
        Call("sweep", ff.sweep,
             {"machine": tiny(), "omega": [99.0, OMEGA], "initial": "rest", "max_periods": 1,
              "most_turns": 50, "monitor": None}, (Sweep,)),
        Call("study", ff.study,
             {"machine": plain(), "vary": {"main_mass": (900.0, 920.0)},
              "quantities": "relative_amplitude", "omega": OMEGA, "load_cases": (),
              "sampling": ff.Sample(n=4), "branch": "from-below",
              "derivatives": ("clearance",), "store": None,
              "executor": None, "threads": 1, "monitor": None}, (Study,)),
        Call("open_study", ff.open_study, {"path": stored()}, (Study,)),
        Call("design", ff.design,
             {"duty": duty(), "generations": 1, "store": None, "executor": None, "monitor": None},
             (ff.Proposal,), {"generations": lambda n: n is None or (real(n) or 0.0) > 3.0}),
        Call("load_duty", ff.load_duty, {"path": duty_file(), "force": False}, (ff.Duty,)),
        Call("tolerance", ff.tolerance,
             {"study": ff.open_study(stored()), "limits": ff.Limits(relative_amplitude=(0.0, 1.0))},
             (Tolerance,)),
        Call("worst_case", ff.worst_case,
             {"machine": plain(), "vary": {"main_mass": (900.0, 920.0)},
              "quantity": "relative_amplitude", "omega": OMEGA, "branch": "from-below",
              "threads": 1, "monitor": None}, (WorstCase,)),
        Call("switch_branch", ff.switch_branch,
             {"point": doubled(), "interval": (doubled().omega - 0.1, doubled().omega + 0.1),
              "monitor": None}, (Branch,)),
    )  # fmt: skip


@cache
def classes() -> tuple[Call, ...]:
    """Classes of the public face."""
    made = {
        ff.HarmonicBalance: {"harmonics": 3, "points": 300},
        ff.PiecewiseExact: {"points": 300},
        ff.SampledHarmonicBalance: {
            "harmonics": 3, "samples": 256, "sharpness": 1e6, "points": 300,
        },
        ff.RungeKutta: {"formula": "dopri5", "tolerance": 1e-8, "step": None},
        ff.Duty: {name: getattr(duty(), name) for name in ff.Duty.__dataclass_fields__},
        ff.SpringType: {
            "name": "A", "stiffness": 2e5, "loss_factor": 0.1, "height": 0.05, "strain": None,
            "force": None, "price": 10.0,
        },
        ff.Sample: {"n": 8, "method": "sobol", "seed": 0, "covariance": None},
        ff.Choice: {"values": (1.0, 2.0)},
        ff.Normal: {"mean": 1.0, "std": 0.1},
        ff.ClearanceSpring: {
            "direction": [1.0], "stiffness": 1.0, "damping": 0.0, "clearance": 1.0,
            "clearance_minus": None, "law": "paper",
        },
        ff.HarmonicForce: {"vector": [1.0], "order": 2},
        ff.Unbalance: {"vector": [1.0], "order": 2},
        ff.MovingBase: {
            "displacement": 0.1, "stiffness": [1.0], "damping": [0.1], "order": 2,
        },
        ff.MechanicalSystem: {
            "M": [[1.0]], "C": [[1.0]], "K": [[1.0]], "springs": (),
            "excitation": ff.Unbalance([1.0]), "coordinates": {"main": [1.0]},
            "static_force": [0.1],
        },
        ff.FlipFlowScreen: {
            **{name: getattr(screen(), name) for name in ff.FlipFlowScreen.__dataclass_fields__}
        },
        ff.Impulse: {"t": 0.1, "which": "main", "impulse": 1.0},
        ff.LoadStep: {"t": 0.1, "load": ff.Load()},
        ff.Lump: {"t": 0.1, "frame": "main", "mass": 1.0, "velocity": 0.0},
        ff.Load: {
            "stiffness_factor": 1.0, "damping_factor": 1.0, "stop_stiffness_factor": 1.0,
            "stop_damping_factor": 1.0, "main_mass": 0.0, "floating_mass": 0.0,
            "temperature": None, "temperature_of": "rubber", "name": "",
        },
        ff.Motor: {
            "synchronous_speed": 150.0, "rated_power": 100.0, "breakdown_torque": None,
            "breakdown_ratio": 2.5, "breakdown_slip": 0.2, "starting_ratio": 2.0,
            "pull_up_ratio": None, "torque_table": (),
        },
        ff.StarDelta: {"speed": 100.0, "time": None},
        ff.Converter: {"ramp": 15.0, "torque_limit": 1.5, "end_speed": None},
        ff.Drive: {
            "inertia": 1.0, "motor": None, "ratio": 1.0, "friction": 0.0,
            "viscous_friction": 0.0, "assumed": (), "starter": None, "assumed_fields": (),
            "open_ratio": False,
        },
        ff.SpeedProfile: {"times": (0.0, 1.0), "speeds": (0.0, 1.0)},
        ff.Limits: dict.fromkeys(ff.Limits.__dataclass_fields__),
        ff.PassingLimits: dict.fromkeys(ff.PassingLimits.__dataclass_fields__),
        ff.Project: {name: getattr(project(), name) for name in ff.Project.__dataclass_fields__},
        Document: dict.fromkeys(Document.__dataclass_fields__, ""),
        RungeKutta: {"formula": "dopri5", "tolerance": 1e-8, "step": None},
    }  # fmt: skip
    return tuple(Call(kind.__name__, kind, given, (kind,)) for kind, given in made.items())


@cache
def methods() -> tuple[Call, ...]:
    """Methods of the public face that take arguments."""
    one, branch, array = orbit(), tiny_branch(), (np.ndarray,)
    times = {"which": "main", "t": [0.0, 0.1]}
    which = {"which": "main"}
    response = ff.linear_response(tiny(), OMEGA)
    sweep = ff.sweep(tiny(), [OMEGA], most_turns=50)
    diagram = ff.bifurcation_diagram(tiny(), "omega", [OMEGA], most_turns=50)
    section = ff.poincare_section(tiny(), OMEGA, 2, skip=0)
    basins = ff.basins(tiny(), OMEGA, {"main": [0.0]}, most_turns=50)
    ramp = ff.ramp(tiny(), (95.0, 105.0), 100.0)
    over = ff.continue_orbit(folded().orbit(0), "clearance", (5.99e-3, 6.01e-3))
    rows = ((0.0, 1.1), (40.0, 1.0))
    table = ff.load("ffs0827").replace(temperature_factor=rows, stop_temperature_factor=rows)
    loads = ff.foundation_loads({"empty": running()})
    spring = tiny().springs[0]
    motion = one.motion
    listed = [
        *((one, name, times, array) for name in ("displacement", "velocity", "acceleration")),
        *((one, name, which, (float,)) for name in ("amplitude", "mean", "phase")),
        (one, "stop_force", {"spring": 0, "t": None}, array),
        (one, "stop_force_peak", {"spring": 0}, (float,)),
        (one, "contact_share", {"spring": 0}, (float,)),
        (one, "stop_power", {"spring": 0}, (float,)),
        (one, "mean_square_velocity", {"which": 0, "spring": None}, (float,)),
        (one, "peak", {"quantity": lambda _t, x, _v, _a: x[:, 0]}, (float,)),
        (one, "sensitivity", {"quantity": "state", "names": ["springs[0].clearance"]}, array),
        (motion, "derivative", {"t": [0.0, 0.1], "order": 1}, array),
        (motion, "piece_derivative", {"t": [0.0, 0.1], "piece": [0, 1], "order": 1}, array),
        (motion, "piece", {"t": [0.0, 0.1]}, array),
        (motion, "samples", {"least": 256}, (tuple,)),
        *((branch, name, which, array) for name in ("amplitude", "phase")),
        (branch, "peak", which, (SpecialPoint,)),
        *((branch, name, which, (tuple,)) for name in ("peaks", "troughs")),
        (branch, "orbit", {"i": 0}, (Orbit,)),
        (branch, "orbits_at", {"omega": OMEGA}, (tuple,)),
        (branch, "orbit_from_below", {"omega": OMEGA}, (Orbit, NoneType)),
        (branch, "solve_in", {"run": branch.rising_path[0], "omega": OMEGA}, (Orbit, NoneType)),
        (branch, "points_of", {"kind": "fold"}, (tuple,)),
        (over, "orbit", {"i": 0}, (Orbit,)),
        (over, "points_of", {"kind": "fold"}, (tuple,)),
        *((over, name, {"which": "relative"}, array) for name in ("amplitude", "phase")),
        (folded().folds[0], "amplitude", {"which": "relative"}, (float,)),
        (folded().folds[0], "sensitivity", {"names": ["clearance"]}, array),
        *((history(), name, which, array) for name in ("displacement", "velocity", "acceleration")),
        (history(), "stop_force", {"spring": 0}, array),
        (sweep, "amplitude", which, array),
        (sweep, "extremes", which, (tuple,)),
        (diagram, "points", {"which": "main", "direction": "up"}, (tuple,)),
        (ramp, "amplitude", which, (tuple,)),
        *((section, name, which, array) for name in ("displacement", "velocity")),
        *((response, name, which, array) for name in ("amplitude", "phase")),
        (response, "peaks", which, (tuple,)),
        (basins, "axis", {"kind": "displacement", "which": "main"}, (GridAxis, NoneType)),
        (table, "replace", {"main_mass": 900.0}, (ff.FlipFlowScreen,)),
        (table, "loaded", {"load": ff.Load()}, (ff.FlipFlowScreen,)),
        (table, "temperature_stiffness_factor", {"temperature": 20.0}, (float,)),
        (table, "stop_temperature_stiffness_factor", {"temperature": 20.0}, (float,)),
        (loads, "of_support", {"load": loads.cases[0].running}, (Components,)),
        (loads, "static_on", {"support": "S1", "case": loads.cases[0]}, (Components,)),
        (spring, "force", {"gap": [0.0], "rate": [0.0]}, array),
        (tiny(), "coordinate", which, array),
        (motor(), "torque", {"speed": [0.0]}, array),
        *((drive(), name, {"speed": [0.0]}, array) for name in ("torque", "friction_torque")),
        (profile(), "speed", {"t": [0.0]}, array),
        (ff.Choice((1.0, 2.0)), "quantile", {"u": [0.5]}, (np.ndarray, float)),
        (ff.Normal(1.0, 0.1), "quantile", {"u": [0.5]}, array),
        (ff.figure(branch), "write",
         {"path": folder() / "x.html"}, (Path,)),
    ]  # fmt: skip
    return tuple(
        Call(f"{type(owner).__name__}.{name}", getattr(owner, name), given, returns)
        for owner, name, given, returns in listed
    )


def findings(call: Call, seed: int, draws: int | None) -> list[Finding]:
    """What goes wrong with ``draws`` odd arguments in each place; with all where None."""
    rng = np.random.default_rng([seed, zlib.crc32(call.name.encode())])
    names = sorted(kinds())
    found = []
    for argument in call.arguments:
        some = names if draws is None else rng.choice(names, draws, replace=False)
        for name in some:
            value = odd(str(name))
            if call.dear.get(argument, lambda _value: False)(value):
                continue
            ended = ending(call, {**call.arguments, argument: value})
            if ended:
                found.append(Finding(call.name, argument, str(name), ended))
    return found


def ending(call: Call, arguments: Mapping[str, object]) -> str:
    """How a call ended, where that is wrong; empty where it is right."""
    try:
        # An odd argument may be taken for the name of a file or a folder.
        with contextlib.chdir(folder()), warnings.catch_warnings():
            warnings.simplefilter("error")
            result = call.function(**arguments)
    except FlipflowError as error:
        sentence = str(error)
        return "" if len(sentence) < 2000 and "\n" not in sentence else "not one sentence"
    except (Exception, RecursionError) as error:  # noqa: BLE001  whatever it is, it is a finding
        return f"{type(error).__name__}: {error}"
    return "" if isinstance(result, call.returns) else f"returned a {type(result).__name__}"
