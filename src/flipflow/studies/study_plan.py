"""What a study is to compute: its inputs as a document, its chunks, and how two plans differ."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from flipflow import __version__
from flipflow.batch.chunk_store import ChunkStore, Layout, Variable
from flipflow.batch.reasons import NOT_COMPUTED
from flipflow.compiled.arrays import Real
from flipflow.errors import InputError, StoreError
from flipflow.model.arguments import (
    checked_all,
    checked_speeds,
    checked_text,
    checked_word,
    members_of,
)
from flipflow.model.fields import FIELD
from flipflow.model.numerals import case_words
from flipflow.model.parameters import differentiable, value_of
from flipflow.model.quantities import BranchWord, Quantity, missing_words, quantity_named
from flipflow.model.sampling import Columns, Design, Sample, design_of, digest_of
from flipflow.model.screen import FlipFlowScreen, Load, as_cool_as_air, of_air
from flipflow.model.system import Machine, system_of
from flipflow.model.vary import Choice, Distribution, Variation, Vary
from flipflow.studies.documents import CODEC
from flipflow.studies.lane_values import on_lanes, slope_key
from flipflow.studies.study_values import evaluate_loaded

Arrays = dict[str, NDArray[Any]]
SCHEMA = "flipflow/study-store/1"
REASON = "reason"
UNLOADED = "empty"
NOMINAL, LOW, HIGH = "nominal", "low", "high"
ROWS = "sample", "case", "omega"
PARAMETER = "parameter"
PARAMETER_UNIT = "parameter_unit"
RESERVED = (
    *ROWS,
    "field",
    PARAMETER,
    PARAMETER_UNIT,
    REASON,
)  # names that no parameter of a machine can have
# Machines, each under each load, of a chunk: seconds of work, so that little is lost with it.
CHUNK_MACHINES = 64
MOST_CHUNKS = 2048  # of a study: each is a file of every quantity


@dataclass(frozen=True, eq=False)
class Plan:
    """All that decides what a study finds.

    Parameters
    ----------
    machine
        The machine whose fields vary.
    design
        Its variants.
    loads
        Load cases; none for a machine that takes no load.
    quantities
        Names of what is asked.
    omega
        Frequencies in rad/s, (F,); one that is NaN where only whole responses are asked for.
    branch
        Which motion is meant.
    derivatives
        Parameters with respect to which the quantities are differentiated.
    """

    machine: Machine
    design: Design
    loads: tuple[Load, ...]
    quantities: tuple[str, ...]
    omega: Real
    branch: BranchWord
    derivatives: tuple[str, ...] = ()

    @property
    def cases(self) -> tuple[str, ...]:
        """Names of the load cases."""
        return tuple(load.name or UNLOADED for load in self.loads) or (UNLOADED,)

    @property
    def rows(self) -> int:
        """Machines of a chunk; the number of workers has no part in it."""
        wished = -(-CHUNK_MACHINES // len(self.cases))
        return min(max(wished, -(-self.design.size // MOST_CHUNKS)), self.design.size)

    @cached_property
    def asked(self) -> Mapping[str, Quantity]:
        """The quantities by name."""
        return {name: quantity_named(name, self.machine) for name in self.quantities}

    @cached_property
    def manifest(self) -> Mapping[str, Any]:
        """The inputs as JSON types: equal manifests give equal stores, bit for bit."""
        design = self.design
        listed = design.sampling == "list"
        differentiated = {"derivatives": list(self.derivatives)} if self.derivatives else {}
        return differentiated | {
            "schema": SCHEMA,
            "flipflow": __version__,
            "machine": CODEC.form(Machine).write(self.machine),
            "own": {one.name: CODEC.form(object).write(self._own(one)) for one in design.varied},
            "vary": {
                one.name: "values" if listed else CODEC.form(Distribution).write(one.distribution)
                for one in design.varied
            },
            "sampling": design.sampling,
            "sample": CODEC.form(Sample | None).write(design.sample),
            "machines": design.size,
            "values": design.digest,
            "load_cases": CODEC.form(tuple[Load, ...]).write(self.loads),
            "quantities": list(self.quantities),
            "omega": CODEC.form(Real).write(self.omega),
            "branch": self.branch,
            "chunk": self.rows,
        }

    def layout(self, reference: Arrays) -> Layout:
        """The store of this study; ``reference`` is what :meth:`references` found."""
        size, cases = self.design.size, len(self.cases)
        shape = dict(zip(ROWS, (size, cases, self.omega.size), strict=True))
        shape[PARAMETER] = len(self.derivatives)
        fixed = {
            name: Variable(("sample",), _plain(column), unit_of(self.machine, name))
            for name, column in self.design.columns.items()
        }
        fixed |= {
            "case": Variable(("case",), np.array(self.cases)),
            "omega": Variable(("omega",), self.omega, "rad/s"),
            "field": Variable(("field",), np.array(list(self.design.columns))),
        }
        for name, values in reference.items():
            what, _, quantity = name.partition("_")
            dims = self.dims(quantity)[1:]
            dims = dims if what == NOMINAL else ("field", *dims)
            fixed[name] = Variable(dims, values, self.asked[quantity].unit)
        growing = {
            name: Variable(self.dims(name), np.array(np.nan), one.unit)
            for name, one in self.asked.items()
        }
        if self.derivatives:
            fixed[PARAMETER] = Variable((PARAMETER,), np.array(self.derivatives))
            units = units_of_parameters(self.machine, self.derivatives)
            fixed[PARAMETER_UNIT] = Variable((PARAMETER,), units)
            for name, one in self.asked.items():
                told = unit_of_slope(self.machine, one)
                growing[slope_key(name)] = Variable((*ROWS, PARAMETER), np.array(np.nan), told)
        growing[REASON] = Variable(ROWS, np.array(NOT_COMPUTED, np.int8))
        return Layout(self.manifest, fixed, growing, shape, self.rows)

    def dims(self, quantity: str) -> tuple[str, ...]:
        """Dimensions of a quantity: of a whole response it has no frequency."""
        return ROWS if self.asked[quantity].of == "motion" else ROWS[:2]

    def chunk(self, index: int) -> tuple[Any, ...]:
        """What :func:`chunk_values` takes to compute a chunk."""
        part = slice(index * self.rows, (index + 1) * self.rows)
        columns = {name: column[part] for name, column in self.design.columns.items()}
        return *self._task(columns), self.derivatives

    def references(self) -> tuple[Any, ...]:
        """The same for the machine itself and, one field at a time, both ends of its range."""
        count = len(self.design.varied)
        columns: dict[str, NDArray[Any]] = {}
        for i, one in enumerate(self.design.varied):
            column = np.full(2 * count + 1, self._own(one), dtype=object)
            column[1 + i], column[1 + count + i] = one.distribution.ends
            numeric = all(isinstance(value, float) for value in column)
            columns[one.name] = column.astype(float) if numeric else column
        return self._task(columns)

    def read_references(self, found: Arrays) -> Arrays:
        """Nominal values, and those at both ends of each field's range."""
        count = len(self.design.varied)
        read: Arrays = {}
        for name in self.quantities:
            table = found[name]
            read[f"{NOMINAL}_{name}"] = table[0]
            read[f"{LOW}_{name}"], read[f"{HIGH}_{name}"] = table[1 : 1 + count], table[1 + count :]
        return read

    def _own(self, one: Variation) -> object:
        return value_of(self.machine, one.name)

    def _task(self, columns: Columns) -> tuple[Any, ...]:
        return self.machine, columns, self.loads, self.quantities, self.omega, self.branch


def chunk_values(
    machine: Machine,
    columns: Columns,
    loads: tuple[Load, ...],
    quantities: tuple[str, ...],
    omega: Real,
    branch: BranchWord,
    derivatives: tuple[str, ...] = (),
) -> Arrays:
    """Quantities and reasons of some machines under every load, (rows, C, F) or (rows, C) each.

    Derivatives are (rows, C, F, P).
    """
    found = [
        evaluate_loaded(machine, columns, load, quantities, omega, branch, names=derivatives)
        for load in loads or (None,)
    ]
    arrays: Arrays = {}
    for name in quantities:
        table = np.stack([values[name] for values, _ in found], axis=1)
        whole = quantity_named(name, machine).of == "response"
        arrays[name] = table[:, :, 0] if whole else table
        if derivatives:
            key = slope_key(name)
            arrays[key] = np.stack([values[key] for values, _ in found], axis=1)
    arrays[REASON] = np.stack([reasons for _, reasons in found], axis=1)
    return arrays


def plan_of(
    machine: Machine,
    vary: Vary,
    quantities: object,
    omega: object,
    load_cases: object,
    sampling: object,
    branch: object,
    derivatives: object,
) -> Plan:
    """The plan of a study, its arguments checked.

    Raises
    ------
    InputError
        For what :func:`flipflow.study` names.
    """
    system_of(machine)
    design = design_of(machine, vary, sampling)
    for name in design.columns:
        if name in RESERVED:
            remedy = f"arrays of a study are called {', '.join(RESERVED)}; name the field otherwise"
            raise InputError("vary", name, remedy)
    asked = _asked(quantities, machine)
    checked_word("branch", branch, get_args(BranchWord))
    frequencies = np.array([np.nan])
    if omega is not None or any(one.of == "motion" for one in asked):
        remedy = "give the frequencies at which the quantities are meant, one or (n_omega,)"
        frequencies = checked_speeds(omega, remedy)
    loads = _loads(load_cases, machine)
    _refuse_air(loads, asked, frequencies)
    return Plan(
        machine, design, loads, tuple(one.name for one in asked), frequencies,
        branch,  # type: ignore[arg-type]
        _differentiated(derivatives, machine, asked),
    )  # fmt: skip


def plan_from(store: ChunkStore) -> Plan:
    """The plan that a store was made by.

    Raises
    ------
    StoreError
        For a store of a later version, and for one whose values are not those it was made with.
    """
    known = store.manifest
    if str(known.get("schema")).startswith("flipflow/design"):
        told = "holds the search of a design, and no study; flipflow design goes on with it"
        raise StoreError(f"{store.folder} {told}.")
    if known.get("schema") != SCHEMA:
        raise StoreError(f"{store.folder} holds {known.get('schema')!r}; update flipflow.")
    machine = CODEC.form(Machine).read(known["machine"])
    columns = {name: store.read(name) for name in known["vary"]}
    columns = {name: _plain(column) for name, column in columns.items()}
    if digest_of(columns) != known["values"]:
        raise StoreError(f"{store.folder} is damaged: its machines are not those it began with.")
    read = CODEC.form(Distribution).read
    varied = tuple(
        Variation(name, Choice(tuple(np.sort(columns[name]).tolist())))
        if written == "values"
        else Variation(name, read(written))
        for name, written in known["vary"].items()
    )
    sample = CODEC.form(Sample | None).read(known["sample"])
    loads = CODEC.form(tuple[Load, ...]).read(known["load_cases"])
    omega = CODEC.form(Real).read(known["omega"])
    design = Design(varied, known["sampling"], sample, columns)
    return Plan(
        machine, design, loads, tuple(known["quantities"]), omega, known["branch"],
        tuple(known.get("derivatives", ())),
    )  # fmt: skip


def refuse_other(
    kept: Mapping[str, Any], now: Mapping[str, Any], folder: object, what: str = "study"
) -> None:
    """See that a store is one of these inputs.

    Raises
    ------
    StoreError
        Where it is one of others; the sentence names the first that differ.
    """
    found = list(_differences(kept, now, ""))
    if found:
        more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        raise StoreError(
            f"{folder} holds a {what} of other inputs: {found[0]}{more}; name another folder."
        )


def refuse_other_study(store: ChunkStore, plan: Plan) -> None:
    """See that a store is one of a plan.

    Raises
    ------
    StoreError
        As :func:`refuse_other`; of a list the values that differ are named, not their digest.
    """
    kept, now = dict(store.manifest), dict(plan.manifest)
    if kept.get("sampling") == now["sampling"] == "list":
        there = {name: store.read(name) for name in kept["vary"]}
        refuse_other(kept | _machines(there), now | _machines(plan.design.columns), store.folder)
    refuse_other(kept, now, store.folder)


def _machines(columns: Columns) -> dict[str, Any]:
    """The machines of a list as a document tells them."""
    return {"fields": list(columns), "values": {k: v.tolist() for k, v in columns.items()}}


def _differences(kept: object, now: object, path: str) -> Iterator[str]:
    if isinstance(kept, Mapping) and isinstance(now, Mapping):
        for name in dict.fromkeys((*kept, *now)):
            within = f"{path}.{name}" if path else str(name)
            yield from _differences(kept.get(name, "none"), now.get(name, "none"), within)
    elif isinstance(kept, list) and isinstance(now, list):
        if len(kept) != len(now):
            yield f"length of {path} is {len(kept)} there and {len(now)} here"
        for k, (one, other) in enumerate(zip(kept, now, strict=False)):
            yield from _differences(one, other, f"{path}[{k}]")
    elif kept != now:
        yield f"{path} is {_brief(kept)} there and {_brief(now)} here"


def _brief(value: object) -> str:
    text = str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _asked(quantities: object, machine: Machine) -> Sequence[Quantity]:
    names = (quantities,) if isinstance(quantities, str) else members_of(quantities)
    remedy = 'name at least one, such as ("relative_amplitude", "omega_lb")'
    if not names:
        raise InputError("quantities", quantities, remedy)
    asked = [quantity_named(name, machine) for name in names]
    for k, one in enumerate(asked):
        if one.name in {other.name for other in asked[:k]}:
            raise InputError("quantities", one.name, "it is named twice, name each once")
        absent = one.missing(machine)
        if absent:
            raise InputError("quantities", one.name, missing_words(absent))
    return asked


def _differentiated(
    derivatives: object, machine: Machine, asked: Sequence[Quantity]
) -> tuple[str, ...]:
    """Names of parameters with respect to which quantities are differentiated."""
    names = members_of(derivatives)
    if names is None or isinstance(derivatives, str):
        remedy = 'give names of parameters in a list, such as ["clearance"]'
        raise InputError("derivatives", derivatives, remedy)
    for k, name in enumerate(names):
        if checked_text("derivatives", name) in names[:k]:
            raise InputError("derivatives", name, "it is named twice, name each once")
        differentiable(machine, name, "derivatives", besides=())
    keys = {slope_key(one.name): one.name for one in asked}
    for one in asked if names else ():
        if not on_lanes(machine, one):
            remedy = (
                "many machines at once do not tell how it moves; name quantities without it, and "
                "ask an orbit or a fold for it"
            )
            raise InputError("derivatives", one.name, remedy)
        if one.name in keys:
            remedy = f"that is what the derivatives of {keys[one.name]} are called, leave one out"
            raise InputError("quantities", one.name, remedy)
    return tuple(names)


def _loads(load_cases: object, machine: Machine) -> tuple[Load, ...]:
    loads = checked_all("load_cases", load_cases, Load, "give ff.Load, one for each case")
    if not isinstance(machine, FlipFlowScreen):
        if loads:
            remedy = "only a screen takes loads; leave them out, or vary its parameters"
            raise InputError("load_cases", load_cases, remedy)
        return ()
    names = [load.name or UNLOADED for load in loads]
    for k, load in enumerate(loads):
        if names[k] in names[:k]:
            raise InputError("load_cases", load.name, "another case has this name, give each one")
        machine.loaded(as_cool_as_air(load))
    return loads or (Load(name=UNLOADED),)


def _refuse_air(loads: tuple[Load, ...], asked: Sequence[Quantity], omega: Real) -> None:
    """See that it is known at which speed the rubber gets warm, for what belongs to no speed."""
    airy = next((load for load in loads if of_air(load)), None)
    whole = next((one for one in asked if one.of == "response"), None)
    if airy is None or whole is None or (omega.size == 1 and np.isfinite(omega[0])):
        return
    remedy = (
        f"ask for {whole.name} at one speed, the working speed: the rubber gets as warm as its "
        "work there keeps it"
    )
    raise InputError(f"temperature_of of {case_words(airy.name)}", airy.temperature_of, remedy)


def unit_of(machine: Machine, name: str) -> str:
    """SI unit of a field of a screen; of any other machine none is known."""
    known = isinstance(machine, FlipFlowScreen) and name in FIELD
    return FIELD[name].unit if known else ""


def units_of_parameters(machine: Machine, names: Sequence[str]) -> NDArray[np.str_]:
    """SI units of what quantities are differentiated with respect to, (P,)."""
    return np.array([unit_of(machine, name) for name in names], str)


def unit_of_slope(machine: Machine, quantity: Quantity) -> str:
    """Unit of the derivatives of a quantity: so much for one unit of the parameter."""
    if not isinstance(machine, FlipFlowScreen):
        return ""
    return f"{quantity.unit} per {PARAMETER_UNIT}".lstrip()


def _plain(column: NDArray[Any]) -> NDArray[Any]:
    """Numbers as float, words as text of fixed width."""
    numeric = column.dtype.kind in "fiu"
    return np.asarray(column, float) if numeric else np.array(list(map(str, column)))
