"""One quantity of many machines: in closed form where no stop acts, else motion by motion."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from flipflow.batch.side_by_side import Tell, processors, side_by_side
from flipflow.batch.variants import plain
from flipflow.compiled.arrays import Real
from flipflow.continuation.branch import Branch
from flipflow.errors import IncompleteError, InputError
from flipflow.model.arguments import (
    checked_count,
    checked_interval,
    checked_speeds,
    checked_word,
)
from flipflow.model.fields import FIELD
from flipflow.model.parameters import value_of, with_values
from flipflow.model.quantities import (
    BranchWord,
    Quantity,
    leading_coordinate,
    missing_words,
    quantity_named,
)
from flipflow.model.sampling import Columns
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.system import Machine, system_of
from flipflow.periodic.stability import UNSTABLE
from flipflow.studies.feasible import working_motion
from flipflow.studies.landmarks import RESPONSE_VALUES, Response, analysed_range
from flipflow.studies.lane_values import lane_values, of_one_motion
from flipflow.studies.quantity_values import (
    MOTION_VALUES,
    ContactFree,
    Working,
    fields_of_rows,
    number_or_nan,
)

STOP_FIELDS = {"stop_stiffness", "stop_damping", "clearance", "clearance_minus", "stop_law"}
CHUNK_ROWS = 16  # samples that one task of a thread evaluates
# Complex numbers in a chunk of the closed form: its temporaries stay in the cache.
CHUNK_VALUES = 12_000


@dataclass(frozen=True, eq=False)
class Question:
    """What is asked of every sample.

    Parameters
    ----------
    machine
        The machine whose parameters are changed.
    quantity
        What is read off.
    omega
        Frequencies in rad/s, (K,); K = 1 for a quantity of the whole response.
    span
        Frequencies analysed where the whole response is needed, rad/s.
    branch
        Which motion is meant.
    """

    machine: Machine
    quantity: Quantity
    omega: Real
    span: tuple[float, float]
    branch: BranchWord

    def in_closed_form(self, names: Sequence[str]) -> bool:
        """Whether samples are screens that touch no stop, so that every motion has a formula."""
        if not isinstance(self.machine, FlipFlowScreen):
            return False
        free = not self.machine.has_stop and not STOP_FIELDS & set(names)
        return free and self.quantity.of == "motion"


def question_of(machine: Machine, name: str, omega: object, branch: BranchWord) -> Question:
    """What is asked of every sample, checked."""
    system_of(machine)
    quantity = quantity_named(name, machine)
    checked_word("branch", branch, get_args(BranchWord))
    span = analysed_range(machine)
    if quantity.of == "response":
        wanted = span if omega is None else checked_interval("omega", omega)
        return Question(machine, quantity, np.array([np.nan]), wanted, branch)
    _require_data(machine, quantity)
    frequencies = _frequencies(omega, name)
    low, high = float(frequencies.min()), float(frequencies.max())
    wide = min(span[0], 0.9 * low), max(span[1], 1.1 * high)
    return Question(machine, quantity, frequencies, wide, branch)


def nominal_values(question: Question, names: Sequence[str]) -> Real:
    """The quantity of the machine itself, (1, K), as it is found of samples that vary ``names``."""
    own = {names[0]: np.array([value_of(question.machine, names[0])])}
    if question.in_closed_form(names):
        return closed_form_values(question, own, question.omega)
    if of_one_motion(question.quantity):
        return motion_values(question, own, 1, lambda _: None)
    try:
        values = [list(values_of(question, question.machine))]
    except IncompleteError:
        values = [[None] * question.omega.size]
    return np.array(values, dtype=float)


def _require_data(machine: Machine, quantity: Quantity) -> None:
    absent = quantity.missing(machine)
    if absent:
        raise InputError("quantity", quantity.name, missing_words(absent))


def _frequencies(omega: object, name: str) -> Real:
    """Frequencies in rad/s, (K,)."""
    remedy = f"give frequencies above 0 rad/s at which {name} is meant, one or (n_omega,)"
    return checked_speeds(omega, remedy)


def nearest_turn(question: Question, values: Real, nominal: Real) -> Real:
    """Angles within half a turn of the machine's own, so that +pi and -pi are no distance."""
    if question.quantity.unit != "rad":
        return values
    about = np.where(np.isfinite(nominal), nominal, 0.0)
    return np.asarray(about + np.angle(np.exp(1j * (values - about))))


def closed_form_values(question: Question, columns: Columns, omega: Real) -> Real:
    """The quantity of S samples at frequencies (K,), (S, K); NaN where physics forbids a value."""
    fields = fields_of_rows(question.machine, columns)
    evaluate = MOTION_VALUES[question.quantity.name]
    rows = len(next(iter(columns.values())))
    values = np.empty((rows, omega.size))
    step = max(CHUNK_VALUES // omega.size, 1)
    for begin in range(0, rows, step):
        part = slice(begin, begin + step)
        own = {name: one[part] if one.ndim else one for name, one in fields.items()}
        values[part] = evaluate(ContactFree(own, omega))
    for name, column in columns.items():
        values[~FIELD[name].allows(np.asarray(column, dtype=float))] = np.nan
    return values


def checked_threads(question: Question, threads: object) -> int:
    """Threads as asked for; None: every processor for lanes, which leave the interpreter free."""
    free = processors() if of_one_motion(question.quantity) else 1
    return checked_count("threads", free if threads is None else threads, 256)


def motion_values(question: Question, columns: Columns, threads: int, tell: Tell) -> Real:
    """The quantity of S samples at the frequencies asked, (S, K); NaN where there is none.

    Chunks of samples go to ``threads`` threads; what ``tell`` raises ends the work.
    """
    if of_one_motion(question.quantity):
        asked = (question.quantity,)
        found, _ = lane_values(
            question.machine, columns, asked, question.omega, question.span, question.branch,
            threads, tell,
        )  # fmt: skip
        return found[question.quantity.name]
    names = tuple(columns)
    rows = [tuple(map(plain, row)) for row in zip(*columns.values(), strict=True)]
    values = np.full((len(rows), question.omega.size), np.nan)

    def chunk(part: slice, stop: NDArray[np.int64]) -> None:
        for k in range(part.start, part.stop):
            if stop[0]:
                return
            values[k] = _sample(question, names, rows[k])

    side_by_side(chunk, len(rows), CHUNK_ROWS, threads, tell)
    return values


def _sample(question: Question, names: tuple[str, ...], row: tuple[object, ...]) -> Real:
    try:
        machine = with_values(question.machine, dict(zip(names, row, strict=True)))
        return np.array([number_or_nan(value) for value in values_of(question, machine)])
    except (InputError, IncompleteError):
        return np.full(question.omega.size, np.nan)


def values_of(question: Question, machine: Machine) -> Iterator[float | None]:
    """The quantity of one machine at each frequency, None where there is none.

    Raises
    ------
    InputError
        For a machine without any damping.
    IncompleteError
        When a branch could not be followed.
    """
    quantity = question.quantity
    if quantity.of == "response":
        yield RESPONSE_VALUES[quantity.name](Response(machine, question.span))
        return
    for working in workings(question, machine):
        yield None if working is None else working.value_of(quantity)


def workings(
    question: Question, machine: Machine, response: Response | None = None
) -> Iterator[Working | None]:
    """The motion that is meant at each frequency; of a ``response`` where its branch is known.

    Raises
    ------
    InputError
        For a machine without any damping.
    IncompleteError
        When a branch could not be followed.
    """
    response = response or Response(machine, question.span)
    branch = response.branch
    for omega in question.omega.tolist():
        if question.branch == "from-below":
            yield working_motion(machine, branch, omega)
        else:
            yield _outermost(question, machine, branch, omega)


def _outermost(
    question: Question, machine: Machine, branch: Branch, omega: float
) -> Working | None:
    """The largest or the smallest of the motions that are not unstable."""
    found = [orbit for orbit in branch.orbits_at(omega) if orbit.stability != UNSTABLE]
    if not found:
        return None
    pick = max if question.branch == "upper" else min
    which = leading_coordinate(branch.system)
    orbit = pick(found, key=lambda one: one.amplitude(which))
    return Working(machine, orbit, tuple(fold.omega for fold in branch.folds))
