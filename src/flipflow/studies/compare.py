"""Machines side by side: which inputs differ, and how each result changes."""

from __future__ import annotations

import dataclasses
import importlib
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain

from flipflow import __version__
from flipflow.errors import InputError
from flipflow.model.arguments import checked_monitor, members_of
from flipflow.model.drive import DRIVE_FIELDS, Drive
from flipflow.model.fields import FIELDS, Field
from flipflow.model.limits import LIMIT_FIELDS, PASSAGES, PASSING_FIELDS, Limits, limit_bounds
from flipflow.model.monitor import Monitor
from flipflow.model.numerals import case_words
from flipflow.model.project import Document, Project
from flipflow.model.quantities import QUANTITIES, quantities_of
from flipflow.model.screen import FlipFlowScreen, Load
from flipflow.model.starter import STARTS
from flipflow.results.result import Frozen, Result
from flipflow.studies.assessment import Assessment, CaseAssessment, assess, relative_margin
from flipflow.studies.start_and_blows import CaseRuns

# The layer above reads files; `plot` and `save` are bound as late.
READER = "flipflow.io.project"
REMEDY = "give a list of at least two projects, screens or paths of machine files"
LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
ROUNDING = 1e-9  # of a value: what the solution of one motion leaves open
UNITS = 1e-14  # of a value: what writing it in another unit leaves open
EMPTY = "empty machine"
REGION = (
    ("omega_cs", "contact begins (w_cs)"),
    ("omega_lb", "jump when the speed falls (w_lb)"),
    ("omega_ub", "jump when the speed rises (w_ub)"),
    ("omega_ea", "equal amplitudes (w_ea)"),
    ("omega_ar", "antiresonance of the main frame (w_ar)"),
    ("lower", "operating region from"),
    ("upper", "operating region to"),
)
LOAD_UNITS: Mapping[str, tuple[str, str]] = {
    "main_mass": ("kg", "kg"), "floating_mass": ("kg", "kg"), "temperature": ("degC", "degC"),
}  # fmt: skip
# What the machine file calls what a load holds under another name.
LOAD_WORDS: Mapping[str, str] = {
    "stiffness_factor": "shear_stiffness_factor", "damping_factor": "shear_damping_factor",
    "main_mass": "material on the main frame", "floating_mass": "material on the floating frame",
}  # fmt: skip

# Places in the machine file of what is no field of its tables.
SCREEN_WORDS: Mapping[str, str] = {
    "stop_law": "stops.law", "clearance_measured": "stops.clearance_measured",
    "rotation": "exciter.rotation", "temperature_factor": "shear_springs.temperature_factor",
    "stop_temperature_factor": "stops.temperature_factor",
}  # fmt: skip
SWITCH_OVER: Mapping[str, str] = {"speed": "switch_over_speed", "time": "switch_over_time"}

Given = float | str | None
Input = tuple[str, tuple[str, str, Given]]
Flat = dict[str, tuple[str, str, Given]]


@dataclass(frozen=True)
class InputDifference:
    """An input in which machines differ.

    Parameters
    ----------
    key
        Its place in the machine file.
    unit, shown_unit
        SI unit, and the unit it is written in.
    values
        Of each machine, SI or a word; None where it is not given.
    """

    key: str
    unit: str
    shown_unit: str
    values: tuple[Given, ...]


@dataclass(frozen=True)
class ResultChange:
    """One result of every machine.

    Parameters
    ----------
    name, label
        Key and words. A margin is "margin of" a limit, as a share of it.
    case
        The load case; the empty machine for characteristic speeds.
    unit, shown_unit
        SI unit, and the unit to show.
    values
        Of each machine, SI; None where it has none.
    """

    name: str
    label: str
    case: str
    unit: str
    shown_unit: str
    values: tuple[float | None, ...]

    def change(self, of: int = 1, against: int = 0) -> float | None:
        """Value of one machine less that of another, SI; None where either has none.

        It changes its sign where the machines are swapped.
        """
        one, other = self.values[of], self.values[against]
        if one is None or other is None:
            return None
        return 0.0 if one == other else one - other

    @property
    def changes(self) -> bool:
        """Whether the machines differ in it by more than rounding."""
        first, *others = self.values
        return any(not _alike(first, other) for other in others)


@dataclass(frozen=True, eq=False)
class Comparison(Frozen, Result):
    """Machines compared.

    Parameters
    ----------
    names
        What each is called here, all different.
    assessments
        Each machine judged at its own working speed, against its own limits.
    version
        The version that compared them.
    """

    names: tuple[str, ...]
    assessments: tuple[Assessment, ...]
    version: str = __version__

    def __repr__(self) -> str:
        changed = sum(row.changes for row in self.results)
        return (
            f"Comparison({', '.join(self.names)}: {len(self.inputs)} inputs differ, {changed} of "
            f"{len(self.results)} results change)"
        )

    @cached_property
    def inputs(self) -> tuple[InputDifference, ...]:
        """The inputs that differ, in the order of the machine file."""
        flat = [_inputs_of(one.project) for one in self.assessments]
        keys = dict.fromkeys(key for inputs in flat for key in inputs)
        return tuple(_differences(keys, flat))

    @cached_property
    def results(self) -> tuple[ResultChange, ...]:
        """Characteristic speeds, then case by case quantities, margins, starts, stops, blows."""
        flat = [_results_of(one) for one in self.assessments]
        rows = []
        for key in dict.fromkeys(key for results in flat for key in results):
            head = next(results[key][0] for results in flat if key in results)
            values = tuple(results[key][1] if key in results else None for results in flat)
            rows.append(ResultChange(key[1], head[0], key[0], head[1], head[2], values))
        return tuple(sorted(rows, key=lambda row: self._order.index(row.case)))

    @cached_property
    def _order(self) -> list[str]:
        """Load cases in the order of the files, the empty machine's speeds first."""
        names = (case.name for one in self.assessments for case in one.cases)
        return list(dict.fromkeys((EMPTY, *names)))

    def result(self, name: str, case: str = EMPTY) -> ResultChange:
        """One result by its name and load case.

        Raises
        ------
        InputError
            For a name that no machine has a result of in that case.
        """
        for row in self.results:
            if (row.name, row.case) == (name, case):
                return row
        known = ", ".join(dict.fromkeys(row.name for row in self.results if row.case == case))
        what = f"choose one of {known}" if known else f"give a case of {', '.join(self._order)}"
        raise InputError("result", f"{name}, {case_words(case)}", what)


def compare(
    machines: Sequence[Project | FlipFlowScreen | str | os.PathLike[str]],
    *,
    omega: float | None = None,
    monitor: Monitor | None = None,
) -> Comparison:
    """Compare machines: which inputs differ, and how each result changes.

    Parameters
    ----------
    machines
        At least two: projects, screens, paths of machine files or bundled names. The first is
        what the others are compared with.
    omega
        Speed in rad/s at which all are looked at; None: each at its own working speed.
    monitor
        Called with a sentence and the share done, 0 to 1.

    Raises
    ------
    InputError
        For fewer than two machines, and for what is none.
    """
    given = members_of(machines)
    if given is None or isinstance(machines, (str, os.PathLike)) or len(given) < 2:
        raise InputError("machines", machines, REMEDY)
    say = checked_monitor(monitor)
    projects = [_project(one) for one in given]
    if omega is not None:
        projects = [replace(project, speed=omega) for project in projects]
    names = distinct_names(projects)
    found = []
    for k, (name, project) in enumerate(zip(names, projects, strict=True)):

        def during(sentence: str, share: float, k: int = k, name: str = name) -> None:
            say(f"{name}, {sentence}", (k + share) / len(projects))

        found.append(assess(project, monitor=during))
    return Comparison(names, tuple(found))


def distinct_names(projects: Sequence[Project]) -> tuple[str, ...]:
    """What each machine is called; a letter tells those of one name apart."""
    names = [project.document.name or project.name for project in projects]
    if len(set(names)) == len(names):
        return tuple(names)
    stems = [project.name for project in projects]
    if len(set(stems)) == len(stems):
        return tuple(stems)
    return tuple(f"{name} ({letter(k)})" for k, name in enumerate(names))


def letter(k: int) -> str:
    """The letter that stands for a machine."""
    return LETTERS[k] if k < len(LETTERS) else str(k + 1)


def _alike(one: float | None, other: float | None) -> bool:
    if one is None or other is None:
        return one is other
    return math.isclose(one, other, rel_tol=ROUNDING)


def _project(given: object) -> Project:
    """The project of whatever stands for a machine."""
    if isinstance(given, Project):
        return given
    if isinstance(given, FlipFlowScreen):
        return Project(
            screen=given, limits=Limits(), load_cases=(Load(name="empty"),), speed=None,
            document=Document(name="screen"), sources={}, name="screen", path=None, written={},
            sums={}, assumed=(),
        )  # fmt: skip
    if isinstance(given, (str, os.PathLike)):
        read: Project = importlib.import_module(READER).load_project(given)
        return read
    raise InputError("machines", type(given).__name__, REMEDY)


def _differences(keys: Mapping[str, None], flat: Sequence[Flat]) -> Iterator[InputDifference]:
    for key in keys:
        unit, shown_unit, _ = next(inputs[key] for inputs in flat if key in inputs)
        values = tuple(inputs[key][2] if key in inputs else None for inputs in flat)
        if not all(_same(value, values[0]) for value in values):
            yield InputDifference(key, unit, shown_unit, values)


def _same(one: Given, other: Given) -> bool:
    """Whether two inputs are one; 6 mm and 0.6 cm are, whatever the units leave in rounding."""
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=UNITS)
    return one == other


def _inputs_of(project: Project) -> Flat:
    """Every input that decides a result, by its place in the machine file; None is left out."""
    speed = ("operation.speed", ("rad/s", "rpm", project.speed))
    found = chain(
        _screen_inputs(project.screen), (speed,), _drive_inputs(project.drive),
        _limit_inputs(project.limits), _load_inputs(project.load_cases),
    )  # fmt: skip
    return {key: one for key, one in found if one[2] is not None}


def _screen_inputs(screen: FlipFlowScreen) -> Iterator[Input]:
    fields = {field.name: field for field in FIELDS}
    for name, value in _parts(screen):
        table, _, place = name.partition("[")
        if not place:
            yield _input(fields.get(name), SCREEN_WORDS.get(name, name), value)
            continue
        row, column = place.removesuffix("]").split("][")
        of, units = (("temperature", "degC"), ("factor", ""))[int(column)]
        yield f"{SCREEN_WORDS[table]}, {of} {int(row) + 1}", (units, units, value)


def _drive_inputs(drive: Drive | None) -> Iterator[Input]:
    """Those of the drive with what was assumed of it; how the motor is put on, as a word."""
    if drive is None:
        return
    fields = {field.name: field for field in DRIVE_FIELDS}
    yield "drive.start", ("", "", STARTS[type(drive.starter)])
    for name, value in _parts(replace(drive, assumed=(), assumed_fields=())):
        last = name.rpartition(".")[2]
        if name.startswith("starter."):
            last = SWITCH_OVER.get(last, last)
        yield _input(fields.get(last), f"drive.{last}", value)


def _limit_inputs(limits: Limits) -> Iterator[Input]:
    fields = {field.name: field for field in LIMIT_FIELDS}
    fields |= {f"{of}.{one.name}": one for of in PASSAGES for one in PASSING_FIELDS[of]}
    for name, value in _parts(limits):
        field, _, end = name.partition("[")
        words = {"0]": ", least", "1]": ", most"}.get(end, "")
        key, one = _input(fields.get(field), f"limits.{field}", value)
        yield f"{key}{words}", one


def _load_inputs(loads: Sequence[Load]) -> Iterator[Input]:
    for load in loads:
        yield f"load case {load.name}", ("", "", "given")
        for name, value in _parts(load):
            if name != "name":
                units = LOAD_UNITS.get(name, ("", ""))
                yield f"load case {load.name}, {LOAD_WORDS.get(name, name)}", (*units, value)


def _input(field: Field | None, otherwise: str, value: Given) -> Input:
    """An input by its field's key and units; by another key where it has none."""
    if field is None:
        return otherwise, ("", "", value)
    return field.key, (field.unit, field.file_unit, value)


def _parts(value: object, name: str = "") -> Iterator[tuple[str, Given]]:
    """Numbers and words of a dataclass by name, those of others in it as ``a.b`` or ``a[0]``."""
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from _parts(getattr(value, field.name), f"{name}.{field.name}".lstrip("."))
    elif isinstance(value, (tuple, list)):
        for k, one in enumerate(value):
            yield from _parts(one, f"{name}[{k}]")
    elif value is None or isinstance(value, (float, str)):
        yield name, value
    elif isinstance(value, bool):
        yield name, str(value).lower()
    elif isinstance(value, int):
        yield name, float(value)
    else:
        yield name, str(value)


Head = tuple[str, str, str]
Results = dict[tuple[str, str], tuple[Head, float | None]]


def _results_of(found: Assessment) -> Results:
    """Results by load case and name: words, unit, unit to show, and the value."""
    region = found.region
    speed = ("rad/s", "rpm")
    rows: Results = {}
    for name, label in REGION:
        rows[EMPTY, name] = ((label, *speed), getattr(region, name))
    ends = (region.feasible[0][0], region.feasible[-1][1]) if region.feasible else (None, None)
    for word, end in zip(("from", "to"), ends, strict=True):
        rows[EMPTY, f"allowed_{word}"] = ((f"allowed speed range {word}", *speed), end)
    for case in found.cases:
        rows |= {(case.name, name): one for name, one in _case_results(found, case)}
    for runs in found.transients.cases if found.transients else ():
        rows |= {(runs.case, name): one for name, one in _run_results(runs)}
    return rows


def _run_results(runs: CaseRuns) -> Iterator[tuple[str, tuple[Head, float | None]]]:
    """Start, coast-down and least blows of a load case."""
    if runs.start is not None:
        reached = "speed that the start reaches", "rad/s", "rpm"
        turns = runs.start.outcome != "not started"
        yield "start_speed", (reached, runs.start.final_speed if turns else 0.0)
        yield "start_time", (("time to working speed", "s", "s"), runs.start.time_to_speed)
    if runs.coast_down is not None:
        yield "stop_time", (("duration of the coast-down", "s", "s"), runs.coast_down.duration)
    if runs.jump is not None:
        blow, lump = ("least blow that throws the motion", "least lump that throws the motion")
        yield "least_impulse", ((blow, "kg m/s", "kg m/s"), _if_any(runs.jump.impulse))
        yield "least_lump", ((lump, "kg", "kg"), _if_any(runs.jump.lump))
    for passage in PASSAGES:
        for name, peak in runs.peaks_of(passage).items():
            one = QUANTITIES[name]
            head = f"{one.label}, {passage}", one.unit, one.shown_unit
            yield f"{passage}.{name}", (head, peak.value)


def _if_any(size: float) -> float | None:
    return size if math.isfinite(size) else None


def _case_results(
    found: Assessment, case: CaseAssessment
) -> Iterator[tuple[str, tuple[Head, float | None]]]:
    for one in quantities_of("motion"):
        value = case.values.get(one.name)
        yield one.name, ((one.label, one.unit, one.shown_unit), value)
    for k, fold in enumerate(sorted(point.omega for point in case.branch.folds), start=1):
        yield f"fold_{k}", ((f"jump speed {k} (fold)", "rad/s", "rpm"), fold)
    for name in found.project.limits.given:
        quantity = QUANTITIES[name]
        value = found.omega if quantity.of == "operation" else case.values.get(name)
        margin = None
        if value is not None and not math.isnan(value):
            margin = relative_margin(value, *limit_bounds(found.project.limits, name))
        yield f"margin of {name}", ((f"{quantity.label}: margin", "", "%"), margin)
