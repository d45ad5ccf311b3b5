"""Variants of one machine, as arrays with a leading axis.

Nearly every parameter of a machine enters its masses, dampings, stiffnesses, gaps and forces
linearly. Where all of them do so together, the arrays of any number of variants are sums, and none
is assembled by itself. Whether they do is seen about the machine itself, so that the arrays of a
variant depend on no other. Where they do not, where words vary, as that of a stop's law, and where
a sum is no machine, each variant is assembled by its ``system()``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
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
from flipflow.model.sampling import Columns
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.system import Machine, MechanicalSystem
from flipflow.periodic.solver import characteristic_length

Bool = NDArray[np.bool_]
Shapes = dict[str, tuple[int, ...]]
Own = FlipFlowScreen | MechanicalSystem
_Alone = tuple[int, MechanicalSystem, MachineArrays, Real, Real]  # row, system, inertia, bonded
EXACT = 1e-12  # deviation of a sum, as a share of the largest number of its array
# Changes of a parameter, as shares of its value, over which its share in the sums is read: what is
# linear is so over any, and a wide one loses no digits.
WIDTHS = (0.5, -0.5)


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
    bonded
        Springs that always act, which stand in stiffness and damping: k d and c d of each,
        (L, B, 2, N).
    inertia
        Their mass matrices, (L, N, N).
    length
        What is short, in m: of the machine of which they are variants, so that none hangs on
        another.
    slopes
        What each parameter adds to the parts of
        :func:`~flipflow.dynamics.assembly.machine_parts`, where all of them are sums; else None.
    """

    rows: Int
    system: MechanicalSystem
    arrays: MachineArrays
    bonded: Real
    inertia: Real
    length: float
    slopes: Mapping[str, Mapping[str, Real]] | None = None


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
    length = characteristic_length(machine.system().with_bonded())
    found, left = [], allowed.copy()
    # What a user's own class refuses only its ``system()`` tells.
    if isinstance(machine, Own):
        at_once = _sums(machine, columns, np.flatnonzero(allowed), length)
        if at_once is not None:
            found.append(at_once)
            left[at_once.rows] = False
    by_themselves, refused = _one_by_one(machine, columns, left, length)
    allowed[refused] = False
    return [*found, *by_themselves], allowed


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


def _one_by_one(
    machine: Machine, columns: Columns, asked: Bool, length: float
) -> tuple[list[Batch], list[int]]:
    """Each variant assembled by its ``system()``, and the rows of those that it refuses."""
    found: dict[tuple[Any, ...], list[_Alone]] = {}
    refused = []
    for row in np.flatnonzero(asked).tolist():
        try:
            whole = variant(machine, columns, row).system()
            system = whole.with_bonded()
            arrays = machine_arrays(system)
        except InputError:
            refused.append(row)
            continue
        bonded = bonded_terms(whole)
        shared = arrays.stops.law, arrays.power, arrays.wave, arrays.order
        key = (arrays.push.shape, bonded.shape, *(tuple(one.tolist()) for one in shared))
        found.setdefault(key, []).append((row, system, arrays, whole.M, bonded))
    return [
        Batch(
            rows=np.array([row for row, *_ in alike], np.int64),
            system=alike[0][1],
            arrays=stacked([arrays for _, _, arrays, *_ in alike]),
            bonded=np.array([bonded for *_, bonded in alike]),
            inertia=np.array([inertia for *_, inertia, _ in alike]),
            length=length,
        )
        for alike in found.values()
    ], refused


def bonded_terms(system: MechanicalSystem) -> Real:
    """k d and c d of the springs that always act, (B, 2, N)."""
    terms = [
        np.outer((spring.stiffness, spring.damping), spring.direction)
        for spring in system.springs
        if spring.bonded
    ]
    return np.array(terms).reshape(-1, 2, system.size)


def _sums(machine: Own, columns: Columns, rows: Int, length: float) -> Batch | None:
    """The variants of some rows as sums over their parameters, those that are machines.

    None where variants are no sums, and where none is a machine.
    """
    if rows.size == 0 or any(column.dtype.kind != "f" for column in columns.values()):
        return None
    try:
        linear = _linear(_with_own(machine, columns), tuple(columns))
    except InputError:
        return None
    if linear is None:
        return None
    total = np.repeat(linear.middle[None], rows.size, axis=0)
    for name, column in columns.items():
        total += (column[rows, None] - linear.own[name]) * linear.slopes[name]
    parts = dict(zip(linear.shapes, _split(total, linear.shapes), strict=True))
    sound = _sound(parts)
    if not sound.any():
        return None
    kept = {name: part[sound] for name, part in parts.items()}
    none = np.zeros((np.count_nonzero(sound), 0, 2, linear.system.size))
    slopes = {
        name: dict(zip(linear.shapes, _split(slope, linear.shapes), strict=True))
        for name, slope in linear.slopes.items()
    }
    arrays = _assembled(linear.system, kept)
    return Batch(rows[sound], linear.system, arrays, none, kept["inertia"], length, slopes)


@dataclass(frozen=True, eq=False)
class _Linear:
    """A machine's numbers in one row, and what each parameter adds to them."""

    system: MechanicalSystem
    shapes: Shapes
    middle: Real
    own: Mapping[str, float]
    slopes: Mapping[str, Real]


@lru_cache(maxsize=32)  # a search asks of the same few machines a thousand times
def _linear(machine: Own, names: tuple[str, ...]) -> _Linear | None:
    """How a machine depends on parameters; None where it is no sum over them.

    Raises
    ------
    InputError
        Where the machine takes no other values in any direction, or not all of them together.
    """
    own = {name: value_of(machine, name) for name in names}
    middle = _flat(machine)
    if middle is None or not all(isinstance(v, float) and math.isfinite(v) for v in own.values()):
        return None
    values, shapes, system = middle
    numbers = {name: float(str(value)) for name, value in own.items()}
    slopes, ends = {}, {}
    for name, value in numbers.items():
        if isinstance(machine, FlipFlowScreen) and name in FIELD and FIELD[name].whole:
            slopes[name] = np.zeros_like(values)  # pieces, of which no total is made here
            continue
        found = _slope(machine, name, value, values, shapes)
        if found is None:
            return None
        slopes[name], ends[name] = found
    together = _flat(with_values(machine, ends))
    total = values + sum((ends[name] - numbers[name]) * slopes[name] for name in ends)
    if together is None or not _same(total, together[0], shapes):
        return None
    return _Linear(system, shapes, values, numbers, slopes)


def _with_own(machine: Own, columns: Columns) -> Own:
    """The machine with a value of its own of each parameter, of which it may have none."""
    none = {
        name: 0.0 if name not in FIELD or FIELD[name].allows(np.zeros(1))[0] else 1.0
        for name in columns
        if value_of(machine, name) is None
    }
    return with_values(machine, none) if none else machine


def variant(machine: Machine, columns: Columns, row: int) -> Machine:
    """The variant of one row."""
    return with_values(machine, {name: plain(column[row]) for name, column in columns.items()})


def plain(value: Any) -> object:
    """A number of an array as one of Python."""
    return value.item() if isinstance(value, np.generic) else value


def _flat(machine: Machine) -> tuple[Real, Shapes, MechanicalSystem] | None:
    """All numbers of a machine in one row; None where a stop has no gap at all."""
    system = machine.system()
    if not all(spring.opens for spring in system.springs):
        return None
    parts = machine_parts(system)
    flat = np.concatenate([part.ravel() for part in parts.values()])
    return flat, {name: part.shape for name, part in parts.items()}, system


def _slope(
    machine: Machine, name: str, value: float, middle: Real, shapes: Shapes
) -> tuple[Real, float] | None:
    """What one parameter adds to every number, and the value at which that was read.

    None where it does not do so linearly.
    """
    for share in WIDTHS:
        width = share * (abs(value) or 1.0)
        try:
            half, whole = (
                _flat(with_values(machine, {name: value + part * width})) for part in (0.5, 1.0)
            )
        except InputError:
            continue
        if half is None or whole is None or whole[0].shape != middle.shape:
            return None
        with np.errstate(invalid="ignore"):
            slope = np.where(np.isinf(middle), 0.0, (whole[0] - middle) / width)
        straight = _same(middle + 0.5 * width * slope, half[0], shapes)
        return (slope, value + width) if straight else None
    raise InputError(name, value, "the machine takes no other value")


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


def _sound(parts: Mapping[str, Real]) -> Bool:
    """Which sums are machines that would be taken as they are, stops with a gap each."""
    gap, stop = parts["gap"], parts["stop"]
    sound = np.linalg.eigvalsh(parts["inertia"])[:, 0] > 0.0
    sound &= (stop >= 0.0).all(axis=(1, 2)) & (gap.sum(axis=2) > 0.0).all(axis=1)
    acting = (stop.sum(axis=1) > 0.0).all(axis=1)
    return np.asarray(sound & acting & parts["damping"].any(axis=(1, 2)))


def _assembled(system: MechanicalSystem, parts: Mapping[str, Real]) -> MachineArrays:
    """Machines solved for their accelerations."""
    gap, stop = parts["gap"], parts["stop"]
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
