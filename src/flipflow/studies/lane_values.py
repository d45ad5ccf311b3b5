"""Quantities of many variants of a machine at many frequencies, read off lanes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flipflow.batch.lane_columns import lane_columns
from flipflow.batch.lane_kernels import Found
from flipflow.batch.lane_readings import Readings
from flipflow.batch.reasons import FOUND, NOT_COMPUTED, REFUSED, UNSTABLE
from flipflow.batch.side_by_side import Tell
from flipflow.batch.solutions import solve_lanes, solve_slopes
from flipflow.batch.variants import Batch, batches, variant
from flipflow.compiled.arrays import Int, Real
from flipflow.continuation.frequency_response import formulation_of
from flipflow.model.parameters import value_of
from flipflow.model.quantities import BranchWord, Quantity
from flipflow.model.sampling import Columns
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.system import Machine
from flipflow.periodic.options import PiecewiseExact
from flipflow.periodic.orbit import Orbit
from flipflow.studies.lane_quantities import LaneMotions, LanePlan
from flipflow.studies.quantity_values import Working, fields_of_rows, number_or_nan
from flipflow.studies.tilted_lanes import TiltedLanes

ABOVE = 1.001  # least factor on the highest frequency at which one that falls begins


def of_one_motion(quantity: Quantity) -> bool:
    """Whether a quantity is that of a motion by itself, whatever other motions there are."""
    return quantity.of == "motion" and not quantity.of_folds


def on_lanes(machine: Machine, quantity: Quantity) -> bool:
    """Whether lanes tell a quantity of a machine, and its derivatives."""
    if not of_one_motion(quantity):
        return False
    return isinstance(machine, FlipFlowScreen) or quantity.name != "dissipated_power"


def lane_values(
    machine: Machine,
    columns: Columns,
    quantities: Sequence[Quantity],
    omega: Real,
    span: tuple[float, float],
    branch: BranchWord,
    threads: int = 1,
    tell: Tell | None = None,
    names: Sequence[str] = (),
) -> tuple[dict[str, Real], Int]:
    """Quantities (S, K) by name of S variants at K frequencies, and why one has none, (S, K).

    Beside them stand, under :func:`slope_key` of a quantity's name, its derivatives with respect
    to the P parameters of ``names``, (S, K, P), where there are any.

    Parameters
    ----------
    machine
        The machine whose parameters are changed.
    columns
        Values by parameter, SI, (S,) each.
    quantities
        Quantities for which :func:`of_one_motion` holds, and :func:`on_lanes` where ``names`` are
        given. What lanes do not tell is read off each of their motions by itself.
    omega
        Frequencies in rad/s, (K,), in any order.
    span
        Frequencies analysed: an upper or a lower motion is one reached from its ends.
    branch
        Which motion is meant where several exist.
    threads, tell
        As of :func:`~flipflow.batch.solutions.solve_lanes`.
    names
        Parameters with respect to which quantities are differentiated.

    Returns
    -------
    tuple
        Values, NaN where there is none; reasons of :mod:`flipflow.batch.reasons`.
    """
    rows = len(next(iter(columns.values())))
    columns = with_own(machine, columns, names)
    values = {one.name: np.full((rows, omega.size), np.nan) for one in quantities}
    if names:
        slopes = (rows, omega.size, len(names))
        values |= {slope_key(name): np.full(slopes, np.nan) for name in values}
    reason = np.full((rows, omega.size), NOT_COMPUTED)
    groups, allowed = batches(machine, columns)
    reason[~allowed] = REFUSED
    for batch in groups:
        question = _Question(
            machine, columns, tuple(quantities), batch, threads, tell, tuple(names)
        )
        found, why = question.rising(omega)
        if branch != "from-below":
            other, why_other = question.falling(omega, span[1])
            found, why = _outermost(found, why, other, why_other, branch)
        reason[batch.rows] = why
        for name, table in values.items():
            table[batch.rows] = np.where(_beside(why == FOUND, table), found[name], np.nan)
    return values, reason


def with_own(machine: Machine, columns: Columns, names: Sequence[str]) -> dict[str, NDArray[Any]]:
    """The columns, with the machine's own values of what does not vary of some parameters."""
    rows = len(next(iter(columns.values())))
    missing = [name for name in names if name not in columns]
    return dict(columns) | {name: np.full(rows, value_of(machine, name)) for name in missing}


def slope_key(name: str) -> str:
    """Under which the derivatives of a quantity stand among values."""
    return f"d_{name}"


Answer = tuple[dict[str, Real], Int]
# Names of the leading amplitude and of the jumps of the path, beside those of the quantities.
SIZE, JUMPS = "", "jumps"
RINGS = 8  # parts of a distance within which jumps are looked for
ONE_MOTION = 1e-6  # share within which two amplitudes are of one motion


def jump_distance(
    machine: Machine,
    columns: Columns,
    omega: float,
    most: float,
    span: tuple[float, float],
    threads: int = 1,
) -> Real:
    """Distance |omega - jump| / jump of S variants from their nearest jump, (S,), at most ``most``.

    Lanes rise and fall through rings around omega. Where they jump, part or meet is a jump; where
    a motion begins to lean, or gives way to one of more periods, it goes on, and is none.
    Distances are rounded down to a ring's edge, and 0 where two motions or none stand at omega. A
    jump and the one back may be missed where they lie within one ring.

    Parameters
    ----------
    machine, columns, span, threads
        As of :func:`lane_values`.
    omega
        Frequency in rad/s.
    most
        Distance beyond which none counts, below 1.
    """
    steps = most * np.arange(RINGS, 0, -1) / RINGS
    speeds = omega / np.concatenate([1.0 + steps, [1.0], 1.0 - steps[::-1]])
    inner = np.concatenate([steps[1:], [0.0, 0.0], steps[:0:-1]])  # edge of each ring, (2 RINGS,)
    rows = len(next(iter(columns.values())))
    nearest = np.full(rows, np.nan)
    for batch in batches(machine, columns)[0]:
        question = _Question(machine, columns, (), batch, threads, None)
        up, down, same = question.both_ways(speeds, span[1], (FOUND, UNSTABLE))
        told = (up[JUMPS], down[JUMPS], same.astype(float))
        jumped = np.any([np.diff(one, axis=1) != 0.0 for one in told], axis=0)
        near = np.where(jumped, inner, most).min(axis=1)
        nearest[batch.rows] = np.where(same[:, RINGS], near, 0.0)
    return nearest


def one_motion(
    machine: Machine, columns: Columns, omega: Real, span: tuple[float, float], threads: int = 1
) -> NDArray[np.bool_]:
    """Whether S variants come to the same motion at frequencies (K,) from below and above, (S, K).

    Parameters are those of :func:`lane_values`.
    """
    rows = len(next(iter(columns.values())))
    alone = np.zeros((rows, omega.size), bool)
    for batch in batches(machine, columns)[0]:
        question = _Question(machine, columns, (), batch, threads, None)
        alone[batch.rows] = question.both_ways(omega, span[1])[2]
    return alone


@dataclass(frozen=True, eq=False)
class _Question:
    """What is asked of one batch."""

    machine: Machine
    columns: Columns
    quantities: tuple[Quantity, ...]
    batch: Batch
    threads: int
    tell: Tell | None
    names: tuple[str, ...] = ()

    def rising(self, omega: Real) -> Answer:
        """Values and reasons at frequencies as they are reached while the speed rises."""
        order = np.argsort(omega, kind="stable")
        return _in_order(*self._solved(omega[order]), np.argsort(order, kind="stable"))

    def falling(self, omega: Real, top: float) -> Answer:
        """Values and reasons at frequencies as they are reached while the speed falls."""
        order = np.argsort(-omega, kind="stable")
        begin = max(top, ABOVE * float(omega.max()))
        solved = self._solved(np.concatenate([[begin], omega[order]]))
        return _in_order(*solved, 1 + np.argsort(order, kind="stable"))

    def both_ways(
        self, omega: Real, top: float, reasons: Sequence[int] = (FOUND,)
    ) -> tuple[dict[str, Real], dict[str, Real], NDArray[np.bool_]]:
        """Values from below and from above, and where both are of one motion, (L, K).

        Motions count that have one of ``reasons``.
        """
        (up, why), (down, why_down) = self.rising(omega), self.falling(omega, top)
        same = np.abs(up[SIZE] - down[SIZE]) <= ONE_MOTION * np.maximum(up[SIZE], down[SIZE])
        return up, down, same & np.isin(why, reasons) & np.isin(why_down, reasons)

    def _solved(self, omega: Real) -> Answer:
        rows = self.batch.rows
        own = {name: column[rows] for name, column in self.columns.items()}
        of_screen = isinstance(self.machine, FlipFlowScreen)
        fields = fields_of_rows(self.machine, own) if of_screen else {}
        told_by_lanes = tuple(one for one in self.quantities if on_lanes(self.machine, one))
        plan = LanePlan(self.machine, self.batch, fields, omega, told_by_lanes)
        found, read = solve_lanes(self.batch, omega, plan.asked, self.threads, self.tell)
        told = LaneMotions(plan, read, found.multiplier)
        values = {one.name: told.value(one) for one in told_by_lanes}
        others = [one for one in self.quantities if one not in told_by_lanes]
        if others:
            values |= self._read_singly(found, omega, others)
        if self.names:
            values |= self._slopes(plan, found, read)
        of_path = {
            SIZE: told.amplitude(plan.leading),
            JUMPS: found.jumps.astype(float),
        }
        return values | of_path, found.reason

    def _read_singly(
        self, found: Found, omega: Real, quantities: Sequence[Quantity]
    ) -> dict[str, Real]:
        """Quantities (L, K) read off the orbit of each motion that was found."""
        values = {one.name: np.full(found.reason.shape, np.nan) for one in quantities}
        motions = np.argwhere(found.reason == FOUND).tolist()
        for done, (lane, k) in enumerate(motions):
            if self.tell is not None:
                self.tell(done / len(motions))
            machine = variant(self.machine, self.columns, self.batch.rows[lane])
            motion = formulation_of(machine.system(), PiecewiseExact(), half_turn=False)
            point = motion.solver().solve(found.state[lane, k], float(omega[k]))
            if point is not None:
                working = Working(machine, Orbit(machine, point))
                for one in quantities:
                    values[one.name][lane, k] = number_or_nan(working.value_of(one))
        return values

    def _slopes(self, plan: LanePlan, found: Found, read: Readings) -> dict[str, Real]:
        """Derivatives of the quantities with respect to the parameters asked for, (L, K, P)."""
        changes = lane_columns(self.machine, self.columns, self.batch, self.names)
        wanted = plan.slopes_wanted(self.names, changes)
        slopes = solve_slopes(
            self.batch, changes.solved, plan.omega, plan.asked, wanted, found, self.threads
        )
        tilted = TiltedLanes(plan, self.names, read, found.multiplier, slopes)
        tables = {slope_key(one.name): tilted.slope(one) for one in self.quantities}
        for table in tables.values():
            table[np.broadcast_to(~changes.known[:, None], table.shape)] = np.nan
        return tables


def _in_order(values: dict[str, Real], why: Int, order: Int) -> Answer:
    return {name: one[:, order] for name, one in values.items()}, why[:, order]


def _outermost(
    one: dict[str, Real], why: Int, two: dict[str, Real], why_two: Int, branch: BranchWord
) -> Answer:
    """Of two motions the one of larger or of smaller leading amplitude; the one there is."""
    first = np.where(why == FOUND, one[SIZE], np.nan)
    second = np.where(why_two == FOUND, two[SIZE], np.nan)
    take = second > first if branch == "upper" else second < first
    take |= np.isnan(first) & ~np.isnan(second)
    chosen = {name: np.where(_beside(take, one[name]), two[name], one[name]) for name in one}
    return chosen, np.where(take, why_two, why)


def _beside(choice: NDArray[np.bool_], table: Real) -> NDArray[np.bool_]:
    """A choice (L, K) for a table (L, K, ...)."""
    return choice.reshape(*choice.shape, *(1,) * (table.ndim - choice.ndim))
