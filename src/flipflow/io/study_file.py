"""Study files: which machine, what varies, what is asked, under which loads, at which speeds."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.errors import InputError, as_written
from flipflow.io.layout import SPEED, refuse_unknown
from flipflow.io.project import check_format, load_project, refuse_other_files
from flipflow.io.source import Source, bundled_names, read_source
from flipflow.io.units import parse_quantity
from flipflow.io.values import LEFT_OUT, Table, read_number
from flipflow.io.vary import EXAMPLE, REVERSED, field_named, read_vary
from flipflow.model.fields import FIELD
from flipflow.model.project import Project
from flipflow.model.quantities import QUANTITIES, BranchWord
from flipflow.model.sampling import Drawn, Listed, Sample
from flipflow.model.screen import Load
from flipflow.model.vary import LAW, Choice, Normal
from flipflow.studies.tolerance import FOLDS

SECTIONS = ("format", "machine", "vary", "study")
STUDY = (
    "quantities", "speed", "speeds", "load_cases", "sampling", "samples", "seed", "branch",
    "correlation", "derivatives",
)  # fmt: skip
RANGE = ("from", "to", "values")
IN_FILE = (
    'write for example "5.4 mm..6.6 mm", "+-5 %", "+-0.5 mm", "310 kg +/- 4 kg" or a list of at '
    "least two values"
)
MOST_VALUES = 10_000  # of one field
# What a machine is asked for where the file does not say.
USUAL = ("relative_amplitude",)


@dataclass(frozen=True, eq=False)
class StudyFile:
    """What a study file says, in SI.

    Parameters
    ----------
    project
        The machine with its limits and load cases.
    vary
        Fields and how each varies, as :func:`flipflow.study` takes them.
    quantities
        What is asked.
    omega
        Frequencies in rad/s, (F,).
    load_cases
        The loads.
    sampling
        ``"grid"``, ``"list"`` or a :class:`~flipflow.Sample`.
    branch
        Which motion is meant.
    derivatives
        Fields with respect to which quantities are differentiated.
    name
        The file's stem.
    """

    project: Project
    vary: Mapping[str, object]
    quantities: tuple[str, ...]
    omega: Real
    load_cases: tuple[Load, ...]
    sampling: str | Sample | None
    branch: BranchWord
    derivatives: tuple[str, ...]
    name: str


def read_study_file(path: str | os.PathLike[str], *, force: bool = False) -> StudyFile:
    """Read a study file and the machine file that it names.

    Raises
    ------
    InputError
        For a file that cannot be read, and a value in it that is wrong or missing.
    """
    source, project = read_with_machine(path, "study", SECTIONS, force=force)
    table = section_of(source.tables, "study")
    refuse_unknown(table, STUDY, place="study.")
    vary = {
        name: given
        for key, written in flat_keys(section_of(source.tables, "vary")).items()
        for name, given in varied_field(key, written, project).items()
    }
    if not vary:
        raise InputError("vary", LEFT_OUT, 'say what varies, clearance = "5.4 mm..6.6 mm"')
    return StudyFile(
        project=project,
        vary=vary,
        quantities=_quantities(table, project),
        omega=_speeds(table, project),
        load_cases=chosen_cases(table, project),
        sampling=_sampling(table, vary),
        branch=_word(table, "branch", get_args(BranchWord), "from-below"),
        derivatives=_derivatives(table),
        name=source.name,
    )


def read_with_machine(
    path: str | os.PathLike[str], kind: str, sections: Iterable[str], *, force: bool
) -> tuple[Source, Project]:
    """Read a file of a kind, "study" or "duty", and the machine file that it names."""
    source = read_source(path)
    refuse_other_files(source.tables, kind)
    refuse_unknown(source.tables, sections, place="")
    check_format(source.tables)
    return source, load_project(_machine_file(source.tables, source.path), force=force)


def _machine_file(tables: Table, path: Path | None) -> str | Path:
    """The machine's bundled name, or its file beside the study's."""
    written = tables.get("machine", LEFT_OUT)
    if not isinstance(written, str):
        raise InputError("machine", written, 'name a machine file, machine = "screen.toml"')
    if written in bundled_names() or path is None:
        return written
    return path.parent / written


def section_of(tables: Table, name: str) -> Mapping[str, Any]:
    """A section; empty where there is none."""
    table = tables.get(name, {})
    if not isinstance(table, dict):
        raise InputError(name, table, f"write it as a section, [{name}] on a line of its own")
    return table


def flat_keys(table: Mapping[str, Any], within: str = "") -> dict[str, Any]:
    """Keys as they are written; TOML reads ``stops.clearance`` as a table in a table."""
    flat: dict[str, Any] = {}
    for key, value in table.items():
        nested = isinstance(value, dict) and not set(RANGE) & set(value)
        flat |= flat_keys(value, f"{within}{key}.") if nested else {f"{within}{key}": value}
    return flat


def varied_field(
    key: str, written: object, project: Project, section: str = "vary"
) -> dict[str, object]:
    """A field and how it varies; ``section`` of the file is where it stands."""
    label = f"{section}.{key}"
    try:
        if isinstance(written, str):
            return read_vary([f"{key}={written}"], project.screen)
        if key in (LAW, "stops.law", "law"):
            return {LAW: Choice(tuple(_list(label, written)))}
        field = field_named(key, key)
    except InputError as error:
        remedy = IN_FILE if error.remedy == EXAMPLE else error.remedy
        raise InputError(label, written, remedy) from None
    if isinstance(written, dict):
        refuse_unknown(written, RANGE, place=f"{label}.")
        low, high = (_number(label, written.get(end, LEFT_OUT), field.name) for end in RANGE[:2])
        return {field.name: _evenly(low, high, written, label)}
    numbers = [_number(label, one, field.name) for one in _list(label, written)]
    return {field.name: np.array(numbers)}


def _evenly(low: float, high: float, written: Mapping[str, Any], label: str) -> Real:
    """Values evenly over a range that is written ``{from = ..., to = ..., values = ...}``."""
    if not low < high:
        ends = {end: written[end] for end in RANGE[:2]}
        raise InputError(label, ends, REVERSED)
    count = whole_number(written.get("values", LEFT_OUT), f"{label}.values", 2, MOST_VALUES)
    return np.linspace(low, high, count)


def _number(label: str, written: object, name: str) -> float:
    field = FIELD[name]
    return parse_quantity(written, field.unit, field=label, example=str(field.example))


def _list(label: str, written: object) -> list[Any]:
    if not isinstance(written, list) or len(written) < 2:
        raise InputError(label, written, IN_FILE)
    return written


def whole_number(written: object, label: str, least: int, most: int) -> int:
    """A whole number as a file has it."""
    fine = isinstance(written, int) and not isinstance(written, bool)
    if not fine or not least <= int(str(written)) <= most:
        raise InputError(label, written, f"give a whole number from {least} to {most}")
    return int(str(written))


def _word(table: Table, key: str, words: tuple[str, ...], default: str) -> Any:
    written = table.get(key, default)
    if written not in words:
        raise InputError(f"study.{key}", written, f"choose one of {', '.join(words)}")
    return written


def _quantities(table: Table, project: Project) -> tuple[str, ...]:
    """What the file asks for; else all that is limited, and the jump speeds."""
    if "quantities" in table:
        written = table["quantities"]
        if not isinstance(written, list) or not all(isinstance(one, str) for one in written):
            remedy = 'give a list of names, ["relative_amplitude", "omega_lb"]'
            raise InputError("study.quantities", written, remedy)
        return tuple(written)
    screen = project.screen
    limited = tuple(
        name
        for name in project.limits.given
        if QUANTITIES[name].of == "motion" and not QUANTITIES[name].missing(screen)
    )
    return (limited or USUAL) + (FOLDS if screen.has_stop else ())


def _derivatives(table: Table) -> tuple[str, ...]:
    """Fields with respect to which quantities are differentiated."""
    written = table.get("derivatives", [])
    if not isinstance(written, list) or not all(isinstance(one, str) for one in written):
        remedy = 'give a list of fields, ["clearance", "shear_stiffness"]'
        raise InputError("study.derivatives", written, remedy)
    return tuple(field_of(one, "study.derivatives", one) for one in written)


def field_of(key: str, label: str, written: object) -> str:
    """Name of a field by one of its words."""
    with as_written(label, written):
        return field_named(key, key).name


def _speeds(table: Table, project: Project) -> Real:
    """Speeds of the file, else that of the machine's, rad/s."""
    if "speed" in table and "speeds" in table:
        raise InputError("study.speed", table["speed"], "speeds is given, too, leave one out")
    if "speeds" in table:
        written, label = table["speeds"], "study.speeds"
        if isinstance(written, dict):
            refuse_unknown(written, RANGE, place=f"{label}.")
            low, high = (
                read_number(written.get(end, LEFT_OUT), SPEED, label=label) for end in RANGE[:2]
            )
            return _evenly(low, high, written, label)
        if not isinstance(written, list) or not written:
            remedy = (
                'give a list, ["600 rpm", "850 rpm"], or {from = "9 Hz", to = "16 Hz", values = 8}'
            )
            raise InputError(label, written, remedy)
        return np.array([read_number(one, SPEED, label=label) for one in written])
    if "speed" in table:
        return np.array([read_number(table["speed"], SPEED, label="study.speed")])
    if project.speed is None:
        remedy = 'give one, speed = "850 rpm", here or in the machine file'
        raise InputError("study.speed", LEFT_OUT, remedy)
    return np.array([project.speed])


def chosen_cases(table: Table, project: Project, section: str = "study") -> tuple[Load, ...]:
    """The load cases that a section of the file names, else all of the machine's."""
    if "load_cases" not in table:
        return project.load_cases
    known = {load.name: load for load in project.load_cases}
    written, label = table["load_cases"], f"{section}.load_cases"
    if not isinstance(written, list) or not written:
        raise InputError(label, written, 'give a list of names, ["empty", "hot"]')
    for one in written:
        if one not in known:
            remedy = f"the machine has no such load case, choose of {', '.join(map(repr, known))}"
            raise InputError(label, one, remedy)
    return tuple(known[one] for one in written)


def _sampling(table: Table, vary: Mapping[str, object]) -> str | Sample | None:
    """How machines are chosen; None where the ranges decide."""
    own = all(isinstance(given, (np.ndarray, Choice)) for given in vary.values())
    usual = "grid" if own else "sobol"
    word = _word(table, "sampling", (*get_args(Listed), *get_args(Drawn)), usual)
    drawn = {key: table[key] for key in ("samples", "seed", "correlation") if key in table}
    if word in get_args(Listed):
        for key, written in drawn.items():
            raise InputError(f"study.{key}", written, f"a {word} draws nothing, leave it out")
        for name, given in vary.items():
            if not isinstance(given, (np.ndarray, Choice)):
                remedy = f"{name} is a range, give a list of values, or {{from, to, values}}"
                raise InputError("study.sampling", word, remedy)
        return str(word)
    n = whole_number(drawn.get("samples", 1024), "study.samples", 2, 2**24)
    seed = whole_number(drawn.get("seed", 0), "study.seed", 0, 2**63 - 1)
    covariance = _covariance(drawn["correlation"], vary) if "correlation" in drawn else None
    return Sample(n=n, method=word, seed=seed, covariance=covariance)


def _covariance(written: object, vary: Mapping[str, object]) -> Any:
    """Covariance of all fields from rows [field, field, correlation]."""
    label = "study.correlation"
    remedy = 'give rows such as ["shear_stiffness", "stop_stiffness", 0.8] of fields "m +/- s"'
    names = list(vary)
    std = [one.std if isinstance(one, Normal) else 0.0 for one in vary.values()]
    covariance = np.diag(np.square(std))
    for row in written if isinstance(written, list) and written else [written]:
        if not isinstance(row, list) or len(row) != 3:
            raise InputError(label, row, remedy)
        value = row[2] if isinstance(row[2], float | int) else np.nan
        if row[0] == row[1] or not -1.0 < value < 1.0:
            raise InputError(label, row, remedy)
        for name in row[:2]:
            if name not in names:
                raise InputError(label, name, f"it does not vary, choose of {', '.join(names)}")
            if not isinstance(vary[name], Normal):
                told = f'{name} is not normal; only fields "m +/- s" vary together'
                raise InputError(label, row, told)
        i, j = (names.index(name) for name in row[:2])
        covariance[i, j] = covariance[j, i] = value * std[i] * std[j]
    return tuple(map(tuple, covariance.tolist()))
