"""Variants of one machine, as arrays with a leading axis.

Nearly every parameter of a machine enters its masses, dampings, stiffnesses, gaps and forces
linearly. Where all of them do so together, the arrays of any number of variants are sums, and none
is assembled by itself. Whether they do is seen on rows of their own; where they do not, and where
words vary, as that of a stop's law, each variant is assembled by its ``system()``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Int, Real
from flipflow.dynamics.assembly import machine_arrays, machine_parts
from flipflow.dynamics.equation_of_motion import MachineArrays
from flipflow.dynamics.law import Stops
from flipflow.errors import InputError
from flipflow.model.fields import FIELD
from flipflow.model.parameters import value_of, with_values
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.system import Machine, MechanicalSystem

Columns = Mapping[str, NDArray[Any]]
Bool = NDArray[np.bool_]
TRIED = 4  # rows on which sums are held against machines assembled by themselves
EXACT = 1e-12  # deviation of a sum, as a share of the largest number of its array
SLOPE = 1e-3  # relative change of a parameter over which its share in the sums is read


@dataclass(frozen=True, eq=False)
class Batch:
    """Machines of one kind: as many coordinates and stops each, of the same laws.

    Parameters
    ----------
    rows
        Rows of the columns from which they come, (L,).
    system
        One of them.
    arrays
        All of them, each array with a leading axis but for the kinds of laws and excitations.
    """

    rows: Int
    system: MechanicalSystem
    arrays: MachineArrays


def batches(machine: Machine, columns: Columns) -> tuple[list[Batch], Bool]:
    """Variants of a machine in batches, and which rows physics allows, (S,).

    Parameters
    ----------
    machine
        The machine whose parameters are changed.
    columns
        Values by parameter, (S,) each.
    """
    rows = len(next(iter(columns.values())))
    allowed = np.full(rows, True)
    for name, column in columns.items():
        if column.dtype.kind == "f" and name in FIELD and isinstance(machine, FlipFlowScreen):
            allowed &= FIELD[name].allows(column)
    # What a user's own class refuses only its ``system()`` tells.
    if isinstance(machine, (FlipFlowScreen, MechanicalSystem)):
        at_once = _sums(machine, columns, allowed)
        if at_once is not None:
            return [at_once], allowed
    return _one_by_one(machine, columns, allowed), allowed


def stacked(machines: list[MachineArrays]) -> MachineArrays:
    """Machines of one kind as one batch."""
    first = machines[0]
    alike = {"power", "wave", "order", "stops"}
    joined = {
        name: np.array([getattr(one, name) for one in machines])
        for name in MachineArrays._fields
        if name not in alike
    }
    stops = (
        np.array([getattr(one.stops, name) for one in machines])
        for name in ("stiffness", "damping", "gap")
    )
    return first._replace(**joined, stops=Stops(first.stops.law, *stops))


def _one_by_one(machine: Machine, columns: Columns, allowed: Bool) -> list[Batch]:
    """Each variant assembled by its ``system()``; what it refuses is struck from ``allowed``."""
    found: dict[tuple[Any, ...], tuple[list[int], list[MachineArrays], MechanicalSystem]] = {}
    for row in np.flatnonzero(allowed).tolist():
        try:
            system = _row(machine, columns, row).system().with_bonded()
            arrays = machine_arrays(system)
        except InputError:
            allowed[row] = False
            continue
        shared = arrays.stops.law, arrays.power, arrays.wave, arrays.order
        key = (arrays.push.shape, *(tuple(one.tolist()) for one in shared))
        rows, machines, _ = found.setdefault(key, ([], [], system))
        rows.append(row)
        machines.append(arrays)
    return [
        Batch(np.array(rows, np.int64), system, stacked(machines))
        for rows, machines, system in found.values()
    ]


def _sums(machine: Machine, columns: Columns, allowed: Bool) -> Batch | None:
    """All allowed variants as sums over their parameters; None where they are no sums."""
    rows = np.flatnonzero(allowed)
    machine = _with_own(machine, columns, rows)
    own = {name: value_of(machine, name) for name in columns}
    numbers = [isinstance(value, float) and math.isfinite(value) for value in own.values()]
    words = any(column.dtype.kind != "f" for column in columns.values())
    middle = _flat(machine)
    if words or not all(numbers) or rows.size <= TRIED + len(columns) or middle is None:
        return None
    values, shapes, system = middle
    total = np.repeat(values[None], rows.size, axis=0)
    for name, column in columns.items():
        slope = _slope(machine, name, float(own[name]), values)  # type: ignore[arg-type]
        if slope is None:
            return None
        total += (column[rows, None] - own[name]) * slope
    tried = np.linspace(0, rows.size - 1, TRIED).astype(int)
    for k in tried.tolist():
        apart = _flat(_row(machine, columns, int(rows[k])))
        if apart is None or not _same(total[k], apart[0], shapes):
            return None
    arrays = _assembled(system, total, shapes)
    return None if arrays is None else Batch(rows, system, arrays)


def _with_own(machine: Machine, columns: Columns, rows: Int) -> Machine:
    """The machine, with the first value of each column where it has none of its own."""
    none = [name for name in columns if value_of(machine, name) is None] if rows.size else []
    return with_values(machine, {name: columns[name][rows[0]].item() for name in none})


def _row(machine: Machine, columns: Columns, row: int) -> Machine:
    """The variant of one row."""
    given = {name: column[row] for name, column in columns.items()}
    plain = {
        name: one.item() if isinstance(one, np.generic) else one for name, one in given.items()
    }
    return with_values(machine, plain)


Shapes = dict[str, tuple[int, ...]]


def _flat(machine: Machine) -> tuple[Real, Shapes, MechanicalSystem] | None:
    """All numbers of a machine in one row; None where a stop has no gap at all."""
    system = machine.system()
    if any(not spring.acts or spring.bonded for spring in system.springs):
        return None
    parts = machine_parts(system)
    flat = np.concatenate([part.ravel() for part in parts.values()])
    return flat, {name: part.shape for name, part in parts.items()}, system


def _slope(machine: Machine, name: str, value: float, middle: Real) -> Real | None:
    """What one parameter adds to every number, each side of its value alike."""
    if isinstance(machine, FlipFlowScreen) and name in FIELD and FIELD[name].whole:
        return np.zeros_like(middle)  # numbers of pieces, of which no total is made here
    step = SLOPE * abs(value) if value != 0.0 else SLOPE
    sides = [_flat(with_values(machine, {name: value + way * step})) for way in (1.0, -1.0)]
    if sides[0] is None or sides[1] is None or sides[0][0].shape != middle.shape:
        return None
    with np.errstate(invalid="ignore"):
        slope = (sides[0][0] - sides[1][0]) / (2.0 * step)
    return np.where(np.isinf(middle), 0.0, slope)


def _same(one: Real, other: Real, shapes: Shapes) -> bool:
    """Whether two machines have the same numbers but for rounding."""
    if one.shape != other.shape:
        return False
    for a, b in zip(_split(one, shapes), _split(other, shapes), strict=True):
        finite = np.isfinite(b)
        off = np.abs(a[finite] - b[finite])
        if (a[~finite] != b[~finite]).any() or (
            off > EXACT * np.abs(b[finite]).max(initial=0.0)
        ).any():
            return False
    return True


def _split(flat: Real, shapes: Shapes) -> Iterator[Real]:
    """The arrays of a row, or of rows."""
    begin = 0
    for shape in shapes.values():
        end = begin + math.prod(shape)
        yield flat[..., begin:end].reshape(*flat.shape[:-1], *shape)
        begin = end


def _assembled(system: MechanicalSystem, total: Real, shapes: Shapes) -> MachineArrays | None:
    """Machines solved for their accelerations; None where one would be refused by itself."""
    parts = dict(zip(shapes, _split(total, shapes), strict=True))
    gap, stop = parts["gap"], parts["stop"]
    sound = np.linalg.eigvalsh(parts["inertia"])[:, 0] > 0.0
    sound &= (stop >= 0.0).all(axis=(1, 2)) & (gap.sum(axis=2) > 0.0).all(axis=1)
    if not sound.all():
        return None
    first = machine_arrays(system)
    right = np.concatenate(
        [
            parts["stiffness"],
            parts["damping"],
            *(np.swapaxes(parts[name], 1, 2) for name in ("direction", "force", "static")),
        ],
        axis=2,
    )
    solved = np.linalg.solve(parts["inertia"], right)
    n, (m, forces) = system.size, (len(system.springs), first.push.shape[0])
    ends = np.cumsum([n, n, m, forces, forces])
    K, C, reach, real, imag, static = np.split(solved, ends, axis=2)
    return first._replace(
        stiffness=np.ascontiguousarray(K),
        damping=np.ascontiguousarray(C),
        direction=np.ascontiguousarray(parts["direction"]),
        reach=np.ascontiguousarray(np.swapaxes(reach, 1, 2)),
        static=np.ascontiguousarray(static[:, :, 0]),
        push=np.ascontiguousarray(np.swapaxes(real + 1j * imag, 1, 2)),
        stops=Stops(
            first.stops.law,
            np.ascontiguousarray(stop[:, 0]),
            np.ascontiguousarray(stop[:, 1]),
            np.ascontiguousarray(gap),
        ),
    )
