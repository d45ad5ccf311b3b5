"""How the machines of a batch change with parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flipflow.batch.variants import Batch, variant
from flipflow.compiled.arrays import Real
from flipflow.dynamics.machine_columns import (
    Named,
    keeps_mirror,
    machine_columns,
    solved_columns,
    stop_columns,
)
from flipflow.dynamics.parameter_tangent import Columns
from flipflow.errors import InputError
from flipflow.model.contact_law import NUMBER
from flipflow.model.system import Machine, MechanicalSystem


@dataclass(frozen=True, eq=False)
class LaneColumns:
    """Derivatives of the arrays of L machines with respect to P parameters.

    Parameters
    ----------
    solved
        As kernels take them, with a leading axis but for "touches".
    bonded
        Those of what springs that always act add, (L, B, 2, N, P).
    keeps_mirror
        Whether machines that are their own mirror image stay so with every parameter.
    known
        Where a machine has a derivative, (L, P).
    """

    solved: Columns
    bonded: Real
    keeps_mirror: bool
    known: NDArray[np.bool_]


def lane_columns(
    machine: Machine, columns: Mapping[str, NDArray[Any]], batch: Batch, names: Sequence[str]
) -> LaneColumns:
    """Derivatives of the machines of a batch; of what is no sum over its parameters one by one.

    Parameters
    ----------
    machine, columns
        From which :func:`~flipflow.batch.variants.batches` made the batch.
    batch
        Some of the variants.
    names
        Parameters.
    """
    if batch.slopes is None or not set(names) <= set(batch.slopes):
        found = _one_by_one(machine, columns, batch, names)
    else:
        found = _of_sums(batch, batch.slopes, names)
    stops, damping = batch.arrays.stops, found.solved.stop_damping
    # A damper that acts on the way in alone has no derivative at zero damping.
    one_sided = (stops.law == NUMBER["undamped-rebound"]) & (stops.damping == 0.0)
    torn = (one_sided[:, None] & (damping != 0.0)).any(axis=2)
    return replace(found, known=found.known & ~torn)


def _of_sums(
    batch: Batch, slopes: Mapping[str, Mapping[str, Real]], names: Sequence[str]
) -> LaneColumns:
    """Those of machines that are sums over their parameters."""
    rows = [slopes[name] for name in names]
    parts = {part: np.array([row[part] for row in rows]) for part in rows[0]}
    lanes = batch.rows.size
    return LaneColumns(
        solved=solved_columns(batch.inertia, parts),
        bonded=np.zeros((*batch.bonded.shape, len(names))),
        keeps_mirror=keeps_mirror(parts),
        known=np.full((lanes, len(names)), True),
    )


def _one_by_one(
    machine: Machine, columns: Mapping[str, NDArray[Any]], batch: Batch, names: Sequence[str]
) -> LaneColumns:
    found, bonded, known = [], [], []
    for row in batch.rows.tolist():
        system = variant(machine, columns, row).system()
        parameters = [_named(machine, columns, row, name) for name in names]
        try:
            changes, smooth = machine_columns(system, parameters), [True] * len(names)
        except InputError:  # some have a kink there
            parameters, smooth = _without_kinks(system, parameters)
            changes = machine_columns(system, parameters)
        found.append(changes)
        bonded.append(_bonded(system, parameters))
        known.append(smooth)
    joined = {
        name: np.array([getattr(one.solved, name) for one in found])
        for name in Columns._fields
        if name != "touches"
    }
    touches = np.max([one.solved.touches for one in found], axis=0)
    mirrors = all(one.keeps_mirror for one in found)
    return LaneColumns(
        Columns(**joined, touches=touches), np.array(bonded), mirrors, np.array(known)
    )


def _named(machine: Machine, columns: Mapping[str, NDArray[Any]], row: int, name: str) -> Named:
    """A parameter of one variant, counted as its column is."""
    own = float(columns[name][row])

    def at(value: float) -> MechanicalSystem:
        moved = dict(columns) | {name: np.full(row + 1, value)}
        return variant(machine, moved, row).system()

    return Named(name, own, at)


def _without_kinks(
    system: MechanicalSystem, parameters: Sequence[Named]
) -> tuple[list[Named], list[bool]]:
    """Parameters, those with a kink made to change nothing, and which have none."""
    smooth = []
    for one in parameters:
        try:
            machine_columns(system, [one])
        except InputError:
            smooth.append(False)
        else:
            smooth.append(True)
    kept = [
        one if fine else Named(one.name, one.value, lambda _: system)
        for one, fine in zip(parameters, smooth, strict=True)
    ]
    return kept, smooth


def _bonded(system: MechanicalSystem, parameters: Sequence[Named]) -> Real:
    """Derivatives of k d and c d of the springs that always act, (B, 2, N, P)."""
    acting = [spring for spring in system.springs if spring.acts]
    kept = [j for j, spring in enumerate(acting) if spring.bonded]
    terms = np.zeros((len(kept), 2, system.size, len(parameters)))
    if not kept:
        return terms
    changes = stop_columns(system, parameters)
    for b, j in enumerate(kept):
        numbers = np.array([acting[j].stiffness, acting[j].damping])
        terms[b] = np.einsum("pa,n->anp", changes["stop"][:, :, j], acting[j].direction)
        terms[b] += np.einsum("a,pn->anp", numbers, changes["direction"][:, j])
    return terms
