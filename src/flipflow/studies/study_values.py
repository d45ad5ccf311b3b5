"""What a study asks of many machines at once: quantities at frequencies, or why there is none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flipflow.batch.reasons import (
    FOUND,
    INCOMPLETE,
    NO_MOTION,
    REFUSED,
)
from flipflow.errors import IncompleteError, InputError
from flipflow.model.fields import FIELD
from flipflow.model.parameters import with_values
from flipflow.model.quantities import BranchWord, Quantity, quantity_named
from flipflow.model.sampling import Columns
from flipflow.model.screen import FlipFlowScreen, Load, loaded_columns
from flipflow.model.system import Machine
from flipflow.studies.landmarks import RESPONSE_VALUES, Response, analysed_range
from flipflow.studies.lane_values import (
    jump_distance,
    lane_values,
    on_lanes,
    one_motion,
    slope_key,
    with_own,
)
from flipflow.studies.quantity_values import number_or_nan
from flipflow.studies.sensitivity_samples import (
    STOP_FIELDS,
    Question,
    closed_form_values,
    workings,
)
from flipflow.studies.tilted_motion import TILT

Real = NDArray[np.float64]
Reasons = NDArray[np.int8]
Values = tuple[dict[str, Real], Reasons]


def evaluate(
    machine: Machine,
    columns: Columns,
    quantities: Sequence[str],
    omega: Real,
    branch: BranchWord,
    threads: int = 1,
    names: Sequence[str] = (),
) -> Values:
    """Quantities of L machines at F frequencies.

    The values of a row depend on the row, on the machine itself, whose motions are first guesses,
    and on the frequencies: on no other row.

    Parameters
    ----------
    machine
        The machine whose parameters the columns replace.
    columns
        Values of parameters, SI, (L,) each.
    quantities
        Names of quantities of a motion and of a whole response.
    omega
        Frequencies in rad/s, (F,).
    branch
        Which motion is meant where several exist.
    threads
        Threads that motions at single frequencies are solved on.
    names
        P parameters with respect to which the quantities are differentiated, which must then be
        such that lanes tell them.

    Returns
    -------
    tuple
        Values (L, F) by quantity, those of a response the same at every frequency; derivatives
        (L, F, P) under :func:`~flipflow.studies.lane_values.slope_key` of it; and the reason
        of each motion, (L, F), a key of :data:`flipflow.batch.reasons.REASONS`.
    """
    asked = [quantity_named(name, machine) for name in quantities]
    rows = len(next(iter(columns.values())))
    values = {one.name: np.full((rows, omega.size), np.nan) for one in asked}
    reasons = np.full((rows, omega.size), FOUND, np.int8)
    span = _span(machine, omega)
    question = Question(machine, asked[0], omega, span, branch)
    if not names and all(
        replace(question, quantity=one).in_closed_form(tuple(columns)) for one in asked
    ):
        for one in asked:
            values[one.name] = closed_form_values(replace(question, quantity=one), columns, omega)
        reasons[~np.all(_fine(columns), axis=0)] = REFUSED
        return values, reasons
    told = [one for one in asked if on_lanes(machine, one)]
    if told:
        found, why = lane_values(machine, columns, told, omega, span, branch, threads, names=names)
        values |= found
        reasons[:] = why
    asked = [one for one in asked if one not in told]
    if not asked:
        return values, reasons
    needing = next((one for one in asked if one.of_folds), asked[0])
    question = replace(question, quantity=needing)
    for k, row in enumerate(zip(*(column.tolist() for column in columns.values()), strict=True)):
        own = {one.name: values[one.name][k] for one in asked}
        _fill(question, asked, dict(zip(columns, row, strict=True)), own, reasons[k])
    return values, reasons


def evaluate_loaded(
    machine: Machine,
    columns: Columns,
    load: Load | None,
    quantities: Sequence[str],
    omega: Real,
    branch: BranchWord,
    threads: int = 1,
    names: Sequence[str] = (),
) -> Values:
    """As :func:`evaluate`, of the machines under a load; the columns hold what they are without."""
    if load is None or not isinstance(machine, FlipFlowScreen):
        return evaluate(machine, columns, quantities, omega, branch, threads, names)
    columns = with_own(machine, columns, names)
    loaded = _loaded(machine, load, columns)
    moved = _moved_by(machine, load, columns, names)
    values, reasons = evaluate(
        machine.loaded(load), loaded, quantities, omega, branch, threads, tuple(moved)
    )
    if names:
        changes = np.stack(list(moved.values()))[:, :, None]  # (loaded fields, rows, 1, P)
        for key in map(slope_key, quantities):
            terms = changes * np.moveaxis(values[key], 2, 0)[..., None]
            # What a parameter does not move may have no derivative.
            values[key] = np.where(changes != 0.0, terms, 0.0).sum(axis=0)
    # A mass below zero stays impossible with material on it.
    fine = _fine({name: column for name, column in columns.items() if name in FIELD})
    refused = ~np.all(fine, axis=0) if fine else np.zeros(len(reasons), bool)
    reasons[refused] = REFUSED
    for table in values.values():
        table[refused] = np.nan
    return values, reasons


def jump_distance_loaded(
    screen: FlipFlowScreen, columns: Columns, load: Load, omega: Real, most: float, threads: int
) -> Real:
    """Distances (L, F) of :func:`~flipflow.studies.lane_values.jump_distance` under a load."""
    loaded, machine = _loaded(screen, load, columns), screen.loaded(load)
    span = _span(machine, omega)
    told = [jump_distance(machine, loaded, at, most, span, threads) for at in omega.tolist()]
    return np.stack(told, axis=1)


def one_motion_loaded(
    screen: FlipFlowScreen, columns: Columns, load: Load, omega: Real, threads: int
) -> NDArray[np.bool_]:
    """:func:`~flipflow.studies.lane_values.one_motion` under a load."""
    loaded, machine = _loaded(screen, load, columns), screen.loaded(load)
    return one_motion(machine, loaded, omega, _span(machine, omega), threads)


def _span(machine: Machine, omega: Real) -> tuple[float, float]:
    """The range analysed, widened to hold the frequencies."""
    low, high = analysed_range(machine)
    return min(low, 0.9 * float(omega.min())), max(high, 1.1 * float(omega.max()))


def _loaded(screen: FlipFlowScreen, load: Load, columns: Columns) -> Columns:
    """The columns of screens as they are under a load."""
    loaded = loaded_columns(screen, load, columns)
    if not screen.has_stop and not STOP_FIELDS & set(columns):
        loaded.pop("measured_shift", None)
    return loaded


def _moved_by(
    screen: FlipFlowScreen, load: Load, columns: Columns, names: Sequence[str]
) -> dict[str, Real]:
    """Derivatives of fields under a load with respect to fields without it, (rows, P) each.

    By complex steps through the formulas of loads.
    """
    moved: dict[str, Real] = {}
    for p, name in enumerate(names):
        tilted = dict(columns) | {name: columns[name] + 1j * TILT}
        for own, column in _loaded(screen, load, tilted).items():
            if np.iscomplexobj(column):
                moved.setdefault(own, np.zeros((column.size, len(names))))
                moved[own][:, p] = column.imag / TILT
    return moved


def _fine(columns: Columns) -> list[NDArray[np.bool_]]:
    """Where physics allows the values of each field."""
    return [FIELD[name].allows(np.asarray(column, float)) for name, column in columns.items()]


def _fill(
    question: Question,
    asked: Sequence[Quantity],
    row: Mapping[str, object],
    own: Mapping[str, Real],
    reasons: Reasons,
) -> None:
    """The values of one machine; nothing of a machine whose response cannot be followed."""
    try:
        machine = with_values(question.machine, row)
        _measure(question, asked, machine, own, reasons)
    except (InputError, IncompleteError) as error:
        reasons[:] = REFUSED if isinstance(error, InputError) else INCOMPLETE
        for table in own.values():
            table[:] = np.nan


def _measure(
    question: Question,
    asked: Sequence[Quantity],
    machine: Machine,
    own: Mapping[str, Real],
    reasons: Reasons,
) -> None:
    whole = [one for one in asked if one.of == "response"]
    response = Response(machine, question.span)
    for one in whole:
        own[one.name][:] = number_or_nan(RESPONSE_VALUES[one.name](response))
    motion = [one for one in asked if one.of == "motion"]
    if not motion:
        return
    for j, working in enumerate(workings(question, machine, response if whole else None)):
        if working is None:
            reasons[j] = NO_MOTION
            continue
        for one in motion:
            own[one.name][j] = number_or_nan(working.value_of(one))
