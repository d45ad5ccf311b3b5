"""Many machines at once: quantities over a grid, a list or a sample, under every load case."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow import __version__
from flipflow.batch.chunk_store import (
    DAMAGED,
    FINISHED,
    MISSING,
    ChunkState,
    ChunkStore,
    create_store,
)
from flipflow.batch.reasons import FOUND, NOT_COMPUTED, REASONS
from flipflow.batch.run_chunks import executor_or_threads, run_chunks
from flipflow.batch.side_by_side import processors
from flipflow.compiled.arrays import Real
from flipflow.errors import InputError, StoreError
from flipflow.model.arguments import checked_count, checked_monitor, checked_path
from flipflow.model.monitor import Monitor
from flipflow.model.parameters import value_of
from flipflow.model.quantities import BranchWord
from flipflow.model.sampling import Sample
from flipflow.model.screen import FlipFlowScreen, Load
from flipflow.model.system import Machine
from flipflow.model.vary import Choice, Distribution, Vary
from flipflow.results.result import Result
from flipflow.studies.lane_values import slope_key
from flipflow.studies.rubber_temperature import air_notes
from flipflow.studies.study_plan import (
    HIGH,
    LOW,
    NOMINAL,
    REASON,
    Arrays,
    Plan,
    chunk_values,
    plan_from,
    plan_of,
    refuse_other,
    refuse_other_study,
)

Words = NDArray[np.str_]
MOST_NAMED = 4  # damaged chunks that a sentence names
BEGIN = "study"


@dataclass(frozen=True, eq=False)
class Study(Result):
    """Quantities of S machines under C load cases at F frequencies: what a study found.

    Values of a motion's quantity are (S, C, F), those of a whole response (S, C); NaN where there
    is none.

    Parameters
    ----------
    machine
        The machine whose fields vary.
    names, distributions
        The fields in the order given, and how each varies.
    sampling
        ``"grid"``, ``"list"``, or the method of a sample.
    sample
        How the machines were drawn; None for a grid and a list.
    columns
        Values of each field, SI, (S,) each.
    load_cases
        The loads; none for a machine that takes none.
    cases
        Their names, (C,).
    omega
        Frequencies in rad/s, (F,).
    branch
        Which motion is meant where several exist.
    values
        Each quantity in SI.
    reason
        Why a motion has no values, (S, C, F): a key of ``REASONS``; 0 where it was found.
    nominal
        Each quantity of the machine itself, (C, F) or (C,).
    at_low, at_high
        With one field at the low or the high end of its range, (D, C, F) or (D, C).
    notes
        A sentence for each thing to keep in mind.
    version
        Version of flipflow.
    parameters
        With respect to which the quantities were differentiated, (P,).
    derivatives
        Derivatives of each quantity, SI, (S, C, F, P); NaN where there is none, and where it has
        another one to each side.
    """

    machine: Machine
    names: tuple[str, ...]
    distributions: tuple[Distribution, ...]
    sampling: str
    sample: Sample | None
    columns: Mapping[str, Real | Words]
    load_cases: tuple[Load, ...]
    cases: tuple[str, ...]
    omega: Real
    branch: str
    values: Mapping[str, Real]
    reason: NDArray[np.int8]
    nominal: Mapping[str, Real]
    at_low: Mapping[str, Real]
    at_high: Mapping[str, Real]
    notes: tuple[str, ...]
    version: str
    parameters: tuple[str, ...] = ()
    derivatives: Mapping[str, Real] = field(default_factory=dict)

    def __repr__(self) -> str:
        whole = "" if self.complete else ", not complete"
        return (
            f"Study({', '.join(self.quantities)} on {', '.join(self.names)}; {self.size} machines, "
            f"{len(self.cases)} load cases, {self.omega.size} frequencies{whole})"
        )

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names of what was asked."""
        return tuple(self.values)

    @property
    def size(self) -> int:
        """Number of machines S."""
        return int(self.reason.shape[0])

    @property
    def complete(self) -> bool:
        """Whether every machine was looked at."""
        return not bool((self.reason == NOT_COMPUTED).any())

    @property
    def failed(self) -> float:
        """Share of the motions looked at that have no values."""
        looked = self.reason != NOT_COMPUTED
        return float((self.reason[looked] != FOUND).mean()) if looked.any() else 0.0

    @property
    def reasons(self) -> Mapping[str, int]:
        """How many motions have no values, by the reason in words."""
        found = {REASONS[code]: int((self.reason == code).sum()) for code in REASONS if code}
        return {words: count for words, count in found.items() if count}

    @property
    def grid_shape(self) -> tuple[int, ...]:
        """Number of values of each field of a grid; of others (S,)."""
        if self.sampling != "grid":
            return (self.size,)
        return tuple(len(one.values) for one in self.distributions if isinstance(one, Choice))


def study(
    machine: Machine,
    vary: Vary,
    quantities: str | tuple[str, ...] | list[str],
    omega: ArrayLike | None = None,
    *,
    load_cases: tuple[Load, ...] | list[Load] = (),
    sampling: str | Sample | None = None,
    branch: BranchWord = "from-below",
    derivatives: tuple[str, ...] | list[str] = (),
    store: str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    threads: int | None = None,
    monitor: Monitor | None = None,
) -> Study:
    """Quantities of many variants of a machine, under every load case, at every frequency.

    The work is cut into chunks. A chunk depends on the inputs and its place alone: no motion of
    one starts from one of another, and neither the number nor the kind of workers changes a bit
    of what is found. With ``store`` every finished chunk is on the disk; a study that was stopped,
    by whatever, goes on when it is called again with the same inputs, and what was damaged since
    is computed again.

    Parameters
    ----------
    machine
        The machine whose fields vary: a screen, any frozen dataclass with ``.system()``, or a
        :class:`~flipflow.MechanicalSystem`.
    vary
        Its fields with an interval as a tuple (low, high), an array or a list of values,
        :class:`~flipflow.Normal` or :class:`~flipflow.Choice`; SI.
    quantities
        One or several, as :func:`~flipflow.sensitivity` takes them.
    omega
        Frequencies in rad/s, one or (F,); may be left out where only quantities of a whole
        response are asked for.
    load_cases
        Loads that every machine must bear; none: as it is, "empty". Under one that gives the
        air's temperature, each machine's rubber is as warm as its own work keeps it at each
        frequency.
    sampling
        ``"grid"``: every combination of values; ``"list"``: the k-th values of all arrays
        together; :class:`~flipflow.Sample`: draws from the distributions. None: a grid where
        every field has values of its own, else ``ff.Sample()``.
    branch
        The motion that is meant where several exist, as for :func:`~flipflow.sensitivity`.
    derivatives
        Parameters with respect to which the quantities, all of a motion, are differentiated too,
        exactly, as :meth:`flipflow.Orbit.sensitivity` does.
    store
        A folder, made where it is not there: a zarr store that grows as the study runs.
    executor
        Where chunks are computed: an executor of ``concurrent.futures``, or
        ``client.get_executor()`` of dask; None: threads of this process.
    threads
        Number of these threads; None: one for each processor.
    monitor
        Called with a sentence and the share done, 0 to 1. What it raises ends the work; finished
        chunks stay in the store.

    Returns
    -------
    Study
        Values with a reason for each motion that has none.

    Raises
    ------
    InputError
        For an unknown field or quantity, a range that physics forbids, loads of a machine that
        takes none, a grid of an interval, and derivatives of a quantity that is not of a motion;
        for the air's temperature with a quantity of a whole response at other than one frequency.
    IncompleteError
        When the workers are gone; finished chunks stay in the store.
    StoreError
        When the store cannot be written, another run writes to it, or it is one of other inputs.
    MissingExtra
        For a store where zarr is not installed.
    """
    plan = plan_of(machine, vary, quantities, omega, load_cases, sampling, branch, derivatives)
    count = checked_count("threads", processors() if threads is None else threads, 256)
    tell = checked_monitor(monitor)
    with executor_or_threads(executor, count) as pool:
        if store is None:
            return _in_memory(plan, pool, tell)
        folder = checked_path("store", store)
        if folder.exists():
            kept = ChunkStore(folder)
            refuse_other_study(kept, plan)
        else:
            create_store(folder, plan.layout(_references(plan, pool, tell)))
            kept = ChunkStore(folder)
        return _filled(kept, plan, pool, tell)


def go_on(
    store: str | os.PathLike[str],
    *,
    executor: Executor | None = None,
    threads: int | None = None,
    monitor: Monitor | None = None,
) -> Study:
    """Finish a study from its store alone.

    Raises
    ------
    StoreError
        As :func:`study`; and for a store of another version of flipflow, or of a machine that is
        a class of its user.
    """
    kept = ChunkStore(checked_path("store", store))
    plan = plan_from(kept)
    try:
        for name in plan.design.columns:
            value_of(plan.machine, name)
    except InputError:
        told = "its machine is a class of its user; call ff.study with that machine and this store"
        raise StoreError(f"{kept.folder} cannot go on by itself: {told}.") from None
    refuse_other(kept.manifest, dict(kept.manifest) | {"flipflow": __version__}, kept.folder)
    count = checked_count("threads", processors() if threads is None else threads, 256)
    with executor_or_threads(executor, count) as pool:
        return _filled(kept, plan, pool, checked_monitor(monitor))


def open_study(path: str | os.PathLike[str]) -> Study:
    """Open the store of a study, finished or not.

    Every file is checked. A chunk that is not there yet has no values, and
    the reason "not computed yet".

    Parameters
    ----------
    path
        Folder of the store.

    Raises
    ------
    InputError
        For a folder that is not there.
    StoreError
        For what is no store, and for a damaged one; the sentence names the chunks.
    MissingExtra
        When zarr is not installed.
    """
    kept = ChunkStore(checked_path("path", path))
    plan = plan_from(kept)
    states = list(kept.states())
    damaged = [state for state in states if state.word == DAMAGED]
    if damaged:
        told = f"resume the study, and {'it is' if len(damaged) == 1 else 'they are'} redone"
        raise StoreError(f"{kept.folder} is damaged: {_named(damaged)}; {told}.")
    return _opened(kept, plan, [state.index for state in states if state.word == MISSING], ())


def _references(plan: Plan, pool: Executor, tell: Monitor) -> Arrays:
    """The machine itself, and one field at a time at the ends of its range."""
    tell(f"{BEGIN}: the machine itself and the ends of its ranges", 0.0)
    ((_, found),) = run_chunks(pool, chunk_values, [(0, plan.references())])
    return plan.read_references(found)


def _in_memory(plan: Plan, pool: Executor, tell: Monitor) -> Study:
    reference = _references(plan, pool, tell)
    count = -(-plan.design.size // plan.rows)
    parts: dict[int, Arrays] = {}
    tasks = ((index, plan.chunk(index)) for index in range(count))
    progress = _Progress(count, 0, tell)
    for index, arrays in run_chunks(pool, chunk_values, tasks):
        parts[index] = arrays
        progress.done()
    names = (*plan.quantities, *_slope_keys(plan), REASON)
    values = {name: np.concatenate([parts[k][name] for k in range(count)]) for name in names}
    return _study(plan, values, reference, ())


def _filled(kept: ChunkStore, plan: Plan, pool: Executor, tell: Monitor) -> Study:
    """Compute what is missing or damaged in a store, and open it."""
    with kept.writing():
        states = list(kept.states())
        damaged = [state for state in states if state.word == DAMAGED]
        missing = [state.index for state in states if state.word != FINISHED]
        tasks = ((index, plan.chunk(index)) for index in missing)
        progress = _Progress(kept.chunks, kept.chunks - len(missing), tell)
        for index, arrays in run_chunks(pool, chunk_values, tasks):
            kept.write(index, arrays)
            progress.done()
        notes = (f"Damaged, and computed again: {_named(damaged)}.",) if damaged else ()
        return _opened(kept, plan, [], notes)


class _Progress:
    """Tells how many chunks are finished, and how long the others will take."""

    def __init__(self, count: int, begun: int, tell: Monitor) -> None:
        self._count, self._begun, self._tell = count, begun, tell
        self._finished, self._since = begun, time.monotonic()
        self._say("")

    def done(self) -> None:
        """One chunk more."""
        self._finished += 1
        passed = time.monotonic() - self._since
        left = passed / (self._finished - self._begun) * (self._count - self._finished)
        self._say(f", {_duration(left)} left" if left else "")

    def _say(self, left: str) -> None:
        told = f"{BEGIN}: {self._finished} of {self._count} chunks{left}"
        self._tell(told, self._finished / self._count)


def _duration(seconds: float) -> str:
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"


def _named(damaged: list[ChunkState]) -> str:
    more = f" and {len(damaged) - MOST_NAMED} more" if len(damaged) > MOST_NAMED else ""
    return ", ".join(map(str, damaged[:MOST_NAMED])) + more


def _opened(kept: ChunkStore, plan: Plan, missing: list[int], notes: tuple[str, ...]) -> Study:
    values = {name: kept.read(name) for name in (*plan.quantities, *_slope_keys(plan), REASON)}
    for index in missing:  # some of its files may be there already
        rows = slice(index * kept.rows, (index + 1) * kept.rows)
        for name, table in values.items():
            table[rows] = NOT_COMPUTED if name == REASON else np.nan
    kinds = [f"{what}_{name}" for what in (NOMINAL, LOW, HIGH) for name in plan.quantities]
    return _study(plan, values, {name: kept.read(name) for name in kinds}, notes)


def _slope_keys(plan: Plan) -> tuple[str, ...]:
    """Names of the arrays of derivatives."""
    return tuple(map(slope_key, plan.quantities)) if plan.derivatives else ()


def _study(plan: Plan, values: Arrays, reference: Arrays, notes: tuple[str, ...]) -> Study:
    def ends(what: str) -> dict[str, Any]:
        return {name: reference[f"{what}_{name}"] for name in plan.quantities}

    design, reason = plan.design, values[REASON]
    return Study(
        machine=plan.machine,
        names=tuple(one.name for one in design.varied),
        distributions=tuple(one.distribution for one in design.varied),
        sampling=design.sampling,
        sample=design.sample,
        columns=design.columns,
        load_cases=plan.loads,
        cases=plan.cases,
        omega=plan.omega,
        branch=plan.branch,
        values={name: values[name] for name in plan.quantities},
        reason=reason,
        nominal=ends(NOMINAL),
        at_low=ends(LOW),
        at_high=ends(HIGH),
        notes=(*notes, *_notes(plan, reason)),
        version=__version__,
        parameters=plan.derivatives,
        derivatives={name: values[slope_key(name)] for name in plan.quantities if plan.derivatives},
    )


def _notes(plan: Plan, reason: NDArray[np.int8]) -> Iterator[str]:
    sample = plan.design.sample
    if isinstance(plan.machine, FlipFlowScreen):
        yield from air_notes(plan.machine, plan.loads)
    if sample is not None and sample.method == "sobol" and sample.n & (sample.n - 1):
        yield f"n = {sample.n} is no power of two: the sample covers the ranges less evenly."
    waiting = (reason == NOT_COMPUTED).any(axis=(1, 2))
    if waiting.any():
        yield f"{int(waiting.sum())} of {waiting.size} machines are not computed yet."
    for code, words in REASONS.items():
        share = float((reason == code).mean())
        if code > FOUND and share > 0.0:
            yield f"{100.0 * share:.3g} % of the motions have no values: {words}."
