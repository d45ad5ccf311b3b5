"""What a study asks of many machines at once: quantities at frequencies, or why there is none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flipflow.batch.reasons import (
    FOUND,
    INCOMPLETE,
    NO_MOTION,
    REFUSED,
    UNSETTLED,
)
from flipflow.compiled.arrays import Real
from flipflow.errors import IncompleteError, InputError
from flipflow.model.fields import FIELD
from flipflow.model.parameters import with_values
from flipflow.model.quantities import BranchWord, Quantity, quantity_named
from flipflow.model.sampling import Columns
from flipflow.model.screen import FlipFlowScreen, Load, loaded_columns, of_air
from flipflow.model.system import Machine
from flipflow.studies.landmarks import RESPONSE_VALUES, Response, analysed_range
from flipflow.studies.lane_values import (
    jump_distance,
    lane_values,
    of_one_motion,
    one_motion,
    slope_key,
    with_own,
)
from flipflow.studies.quantity_values import number_or_nan
from flipflow.studies.rubber_temperature import (
    RISE,
    settled,
    table_ends,
    warmed_load,
    warming_known,
)
from flipflow.studies.sensitivity_samples import (
    STOP_FIELDS,
    Question,
    closed_form_values,
    workings,
)
from flipflow.studies.tilted_motion import TILT

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

    The values of a row depend on the row, on the machine itself, whose range of speeds is analysed,
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
    told = [one for one in asked if of_one_motion(one)]
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
    """As :func:`evaluate`, of the machines under a load; the columns hold what they are without.

    Where the load gives the air's temperature, the rubber of each machine is as warm as its own
    work keeps it at each frequency, and derivatives hold what a parameter does to that, too.
    """
    if load is None or not isinstance(machine, FlipFlowScreen):
        return evaluate(machine, columns, quantities, omega, branch, threads, names)
    asked = _Asked(tuple(quantities), branch, threads, tuple(names))
    if not of_air(load):
        return _evaluate_under(_Under(machine, load, columns), asked, omega)
    told = [_evaluate_warm(machine, load, columns, asked, at) for at in np.split(omega, omega.size)]
    values = {key: np.concatenate([one[key] for one, _ in told], axis=1) for key in told[0][0]}
    return values, np.concatenate([why for _, why in told], axis=1)


def jump_distance_loaded(
    screen: FlipFlowScreen, columns: Columns, load: Load, omega: Real, most: float, threads: int
) -> Real:
    """Distances (L, F) of :func:`~flipflow.studies.lane_values.jump_distance` under a load."""
    told = []
    for at in np.split(omega, omega.size):
        under, lost = _at_work(screen, load, columns, at, _Asked(threads=threads))
        span, speed = _span(under.near, omega), float(at[0])
        far = jump_distance(under.near, under.columns, speed, most, span, threads)
        told.append(np.where(lost, np.nan, far))
    return np.stack(told, axis=1)


def one_motion_loaded(
    screen: FlipFlowScreen, columns: Columns, load: Load, omega: Real, threads: int
) -> NDArray[np.bool_]:
    """:func:`~flipflow.studies.lane_values.one_motion` under a load."""
    told = []
    for at in np.split(omega, omega.size) if of_air(load) else [omega]:
        under, lost = _at_work(screen, load, columns, at, _Asked(threads=threads))
        span = _span(under.near, omega)
        alone = one_motion(under.near, under.columns, at, span, threads)
        told.append(alone & ~lost[:, None])
    return np.concatenate(told, axis=1)


@dataclass(frozen=True)
class _Asked:
    """What is asked of machines at a frequency: the parameters of :func:`evaluate`."""

    quantities: tuple[str, ...] = ()
    branch: BranchWord = "from-below"
    threads: int = 1
    names: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Under:
    """Screens under a load.

    Parameters
    ----------
    screen
        The screen whose parameters the columns replace, without the load.
    load
        The load, the rubber as warm as that of this screen.
    own
        Columns of what the screens are without the load.
    rubber
        Temperature of the rubber of each in degrees Celsius, (L,); None: that of the load.
    """

    screen: FlipFlowScreen
    load: Load
    own: Columns
    rubber: Real | None = None

    @cached_property
    def near(self) -> FlipFlowScreen:
        """The screen under the load, whose range of speeds is analysed."""
        return self.screen.loaded(self.load)

    @property
    def columns(self) -> Columns:
        """The columns as they are under the load."""
        return self._loaded(self.own, self.rubber)

    def moved_by(self, names: Sequence[str]) -> dict[str, Real]:
        """Derivatives of fields under the load with respect to fields without it, (L, P) each.

        By complex steps through the formulas of loads. The last of (L, P + 1) is with respect to
        the temperature of the rubber, where each screen has its own.
        """
        steps = [(dict(self.own) | {k: self.own[k] + 1j * TILT}, self.rubber) for k in names]
        if self.rubber is not None:
            low, high = table_ends(self.screen)
            inside = (self.rubber > low) & (self.rubber < high)
            steps.append((dict(self.own), self.rubber + 1j * TILT * inside))
        moved: dict[str, Real] = {}
        for p, step in enumerate(steps):
            for name, column in self._loaded(*step).items():
                if np.iscomplexobj(column):
                    moved.setdefault(name, np.zeros((column.size, len(steps))))
                    moved[name][:, p] = column.imag / TILT
        return moved

    def _loaded(self, own: Columns, rubber: NDArray[Any] | None) -> Columns:
        loaded = loaded_columns(self.screen, self.load, own, rubber)
        if not _with_stops(self.screen, own):
            loaded.pop("measured_shift", None)
        return loaded


def _with_stops(screen: FlipFlowScreen, columns: Columns) -> bool:
    """Whether stops may act in a machine whose parameters the columns replace."""
    return screen.has_stop or not STOP_FIELDS.isdisjoint(columns)


def _at_work(
    screen: FlipFlowScreen, load: Load, columns: Columns, omega: Real, asked: _Asked
) -> tuple[_Under, NDArray[np.bool_]]:
    """Screens under a load at a frequency, (1,), the rubber of each as warm as its work keeps it.

    Also where its temperature does not settle, (L,): there it is that of the air.
    """
    near = warmed_load(screen, load, float(omega[0])).load
    rows = len(next(iter(columns.values())))
    if not of_air(load) or not warming_known(screen):
        return _Under(screen, near, columns), np.zeros(rows, bool)
    warmed = ["shear_stiffness"]
    if screen.stop_temperature_factor and _with_stops(screen, columns):
        warmed.append("stop_stiffness")
    own = with_own(screen, columns, warmed)
    ends = table_ends(screen)
    rise = replace(asked, quantities=(RISE,), names=())

    def warmer(rubber: Real, left: NDArray[np.int64]) -> Real:
        of_left = {name: column[left] for name, column in own.items()}
        under = _Under(screen, near, of_left, np.clip(rubber, *ends))
        return _evaluate_under(under, rise, omega)[0][RISE][:, 0]

    air = np.full(rows, load.temperature, float)
    rubber = settled(air, warmer)
    lost = np.isnan(rubber)
    return _Under(screen, near, own, np.clip(np.where(lost, air, rubber), *ends)), lost


def _evaluate_warm(
    screen: FlipFlowScreen, load: Load, columns: Columns, asked: _Asked, omega: Real
) -> Values:
    """Quantities at a frequency, (1,), of screens of which the air's temperature is known."""
    found, lost = _at_work(screen, load, columns, omega, asked)
    if found.rubber is None or not asked.names:
        values, reasons = _evaluate_under(found, asked, omega)
    else:
        more = replace(asked, quantities=tuple(dict.fromkeys((*asked.quantities, RISE))))
        values, reasons = _evaluate_under(found, more, omega)
        # T = air + rise(p, T), so that dT/dp = rise_p / (1 - rise_T).
        rise = values[slope_key(RISE)]
        with np.errstate(divide="ignore", invalid="ignore"):
            warming = rise[..., :-1] / (1.0 - rise[..., -1:])
        kept = {name: values[name] for name in asked.quantities}
        for key in map(slope_key, asked.quantities):
            of_rubber = values[key][..., -1:]
            through = np.where(of_rubber != 0.0, of_rubber * warming, 0.0)
            kept[key] = values[key][..., :-1] + through
        values = kept
    reasons[lost[:, None] & (reasons == FOUND)] = UNSETTLED
    for table in values.values():
        table[lost] = np.nan
    return values, reasons


def _evaluate_under(under: _Under, asked: _Asked, omega: Real) -> Values:
    """Quantities of screens under a load whose rubber has the temperature that is given.

    Derivatives are (L, F, P), or (L, F, P + 1) as :meth:`_Under.moved_by` has them.
    """
    quantities, names = asked.quantities, asked.names
    under = replace(under, own=with_own(under.screen, under.own, names))
    moved = under.moved_by(names) if names else {}
    values, reasons = evaluate(
        under.near, under.columns, quantities, omega, asked.branch, asked.threads, tuple(moved)
    )
    if names:
        changes = np.stack(list(moved.values()))[:, :, None]  # (loaded fields, rows, 1, P)
        for key in map(slope_key, quantities):
            terms = changes * np.moveaxis(values[key], 2, 0)[..., None]
            # What a parameter does not move may have no derivative.
            values[key] = np.where(changes != 0.0, terms, 0.0).sum(axis=0)
    # A mass below zero stays impossible with material on it.
    fine = _fine({name: column for name, column in under.own.items() if name in FIELD})
    refused = ~np.all(fine, axis=0) if fine else np.zeros(len(reasons), bool)
    reasons[refused] = REFUSED
    for table in values.values():
        table[refused] = np.nan
    return values, reasons


def _span(machine: Machine, omega: Real) -> tuple[float, float]:
    """The range analysed, widened to hold the frequencies."""
    low, high = analysed_range(machine)
    return min(low, 0.9 * float(omega.min())), max(high, 1.1 * float(omega.max()))


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
    for j, working in enumerate(workings(question, machine, response)):
        if working is None:
            reasons[j] = NO_MOTION
            continue
        for one in motion:
            own[one.name][j] = number_or_nan(working.value_of(one))
