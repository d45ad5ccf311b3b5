"""How a machine's arrays change with its parameters: exact differences of ``.system()``."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from flipflow.compiled.arrays import Real
from flipflow.dynamics.assembly import machine_parts, with_springs
from flipflow.dynamics.machine_series import EXACT, MachineSeries, machine_series
from flipflow.dynamics.parameter_tangent import Columns, touched
from flipflow.errors import InputError
from flipflow.model.system import MechanicalSystem

WIDTH = 1.0 / 16.0  # half the interval over which a parameter is looked at, as a share of it
TWO_SIDES = 1e-6  # share of an array to which the slopes to both sides must agree
SMOOTH = "the machine has a kink or a jump at this value and no derivative; move it a little"


@dataclass(frozen=True)
class Named:
    """A parameter of a machine: its name and value, and the system for other values."""

    name: str
    value: float
    at: Callable[[float], MechanicalSystem]


@dataclass(frozen=True, eq=False)
class MachineColumns:
    """Derivatives of a machine's arrays with respect to P parameters.

    Parameters
    ----------
    parts
        Those of M, C, K, forces, stops and gaps, each (P, ...), by the names of
        :class:`~flipflow.dynamics.machine_series.MachineSeries`.
    solved
        The same, solved with M as kernels take them.
    """

    parts: Mapping[str, Real]
    solved: Columns

    @property
    def keeps_mirror(self) -> bool:
        """Whether a machine that is its own mirror image stays so with every parameter."""
        return keeps_mirror(self.parts)


def keeps_mirror(parts: Mapping[str, Real]) -> bool:
    """Whether changes of a machine's parts leave it its own mirror image."""
    gap = parts["gap"]
    even = np.allclose(gap[..., 0], gap[..., 1], rtol=1e-9, atol=0.0)
    return even and not parts["static"].any()


def machine_columns(system: MechanicalSystem, parameters: Sequence[Named]) -> MachineColumns:
    """Derivatives with respect to parameters, exact for fields that enter polynomially.

    Parameters
    ----------
    system
        The machine as it was given.
    parameters
        What it is differentiated with respect to.

    Raises
    ------
    InputError
        Where the machine changes its kind at a parameter's value, and has no derivative.
    """
    kept = system.opening
    own = machine_parts(with_springs(system, kept))
    rows = [_slopes(system, kept, own, one) for one in parameters]
    parts = {
        name: np.array([row[name] for row in rows]).reshape(len(rows), *array.shape)
        for name, array in own.items()
    }
    return MachineColumns(parts, solved_columns(own["inertia"], parts))


def solved_columns(M: Real, parts: Mapping[str, Real]) -> Columns:
    """Solve with M what carries an index of its degrees of freedom.

    M is (N, N), or (L, N, N) of L machines; then all but "touches" have a leading axis, too.
    """
    forces = parts["force"].shape[1] // 2
    n = M.shape[-1]
    carried = {name: parts[name] for name in ("direction", "force", "static")}
    carried |= {name: parts[name].swapaxes(1, 2) for name in ("inertia", "damping", "stiffness")}
    right = np.concatenate([one.reshape(-1, n) for one in carried.values()])
    left = np.linalg.solve(M, right.T).swapaxes(-1, -2)
    leading = M.shape[:-2]
    solved, begin = {}, 0
    for name, one in carried.items():
        rows = one.size // n
        solved[name] = left[..., begin : begin + rows, :].reshape(*leading, *one.shape)
        begin += rows

    def kernel_ready(array: Any) -> Any:
        return np.ascontiguousarray(array)

    def every(array: Real) -> Real:
        return np.array(np.broadcast_to(array, (*leading, *array.shape)), order="C")

    push = solved["force"][..., :forces, :] + 1j * solved["force"][..., forces:, :]
    return Columns(
        inertia=kernel_ready(solved["inertia"].swapaxes(-1, -2)),
        damping=kernel_ready(solved["damping"].swapaxes(-1, -2)),
        stiffness=kernel_ready(solved["stiffness"].swapaxes(-1, -2)),
        direction=every(parts["direction"]),
        reach=kernel_ready(solved["direction"]),
        static=kernel_ready(solved["static"][..., 0, :]),
        push=kernel_ready(push),
        stop_stiffness=every(parts["stop"][:, 0]),
        stop_damping=every(parts["stop"][:, 1]),
        gap=every(parts["gap"]),
        touches=touched(parts),
    )


def stop_columns(system: MechanicalSystem, parameters: Sequence[Named]) -> dict[str, Real]:
    """Derivatives of "stop", "gap" and "direction" of every spring that acts, (P, ...) each.

    Springs without gap are among them, which the columns of a machine know as its matrices.
    """
    acting = [j for j, spring in enumerate(system.springs) if spring.acts]
    own = machine_parts(with_springs(system, acting))
    rows = [_slopes(system, acting, own, one) for one in parameters]
    return {
        name: np.array([row[name] for row in rows]).reshape(len(rows), *own[name].shape)
        for name in ("stop", "gap", "direction")
    }


def _slopes(
    system: MechanicalSystem, kept: Sequence[int], own: dict[str, Real], one: Named
) -> dict[str, Real]:
    """Derivatives of all parts with respect to one parameter; ``own`` are the machine's own."""
    width = WIDTH * abs(one.value) or 1.0

    def at(value: float) -> dict[str, Real]:
        return _parts_at(system, kept, one, value)

    sides: list[dict[str, Real]] = []
    for low, high in ((-width, width), (0.0, width), (-width, 0.0)):
        try:
            if low < 0.0 < high:
                quadratic = _quadratic_slope(at, own, one.value, width)
                if quadratic is not None:
                    return quadratic
            series = machine_series(lambda v, _: at(v), one.value + low, one.value + high)
        except (ArithmeticError, ValueError):  # the machine does not take a value on that side
            continue
        if series is not None and low < 0.0 < high:
            return _slope_of(series, one.value)
        sides += [] if series is None else [_slope_of(series, one.value)]
    if not sides or not _agree(own, sides, width):
        raise InputError(one.name, one.value, SMOOTH)
    return sides[0]


def _agree(own: dict[str, Real], sides: list[dict[str, Real]], width: float) -> bool:
    """Whether derivatives to both sides are the same; where there is one, a kink lies beside."""
    for name, array in own.items():
        size = np.abs(array[np.isfinite(array)]).max(initial=0.0)
        apart = np.abs(sides[0][name] - sides[-1][name]).max(initial=0.0) * width
        if apart > TWO_SIDES * max(size, np.abs(sides[0][name]).max(initial=0.0) * width):
            return False
    return True


def _quadratic_slope(
    at: Callable[[float], dict[str, Real]], own: dict[str, Real], value: float, width: float
) -> dict[str, Real] | None:
    """Central differences, exact where every part is quadratic; None where one is not."""
    far, near = ([at(value + share * width) for share in (-s, s)] for s in (1.0, 0.5))
    found = {}
    for name, middle in own.items():
        finite = np.isfinite(middle)
        here = np.where(finite, middle, 0.0)
        wide, close = ([np.where(finite, one[name], 0.0) for one in pair] for pair in (far, near))
        slope, again = (wide[1] - wide[0]) / 2.0, close[1] - close[0]
        bend, half_bend = (pair[1] - 2.0 * here + pair[0] for pair in (wide, close))
        off = max(np.abs(slope - again).max(initial=0.0),
                  np.abs(bend - 4.0 * half_bend).max(initial=0.0))  # fmt: skip
        if off > EXACT * np.abs(here).max(initial=0.0) + EXACT * np.abs(slope).max(initial=0.0):
            return None
        found[name] = np.asarray(slope / width)
    return found


def _parts_at(
    system: MechanicalSystem, kept: Sequence[int], one: Named, value: float
) -> dict[str, Real]:
    found = one.at(value)
    if _kind(found) != _kind(system):
        raise InputError(one.name, value, SMOOTH)
    return machine_parts(with_springs(found, kept))


def _kind(system: MechanicalSystem) -> object:
    """What must not change under a derivative."""
    springs = [(one.law, one.opens, one.bonded) for one in system.springs]
    terms = [(one.order, power) for one in system.excitations for power, _ in one.terms]
    return system.size, springs, terms


def _slope_of(series: MachineSeries, value: float) -> dict[str, Real]:
    """Derivatives of a series' arrays at a value."""
    width = series.high - series.low
    x = (2.0 * value - series.low - series.high) / width
    found = {}
    for name in MachineSeries._fields[4:]:
        terms = getattr(series, name)[:, 0]
        slope = chebyshev.chebder(terms, scl=2.0 / width, axis=0)
        found[name] = np.asarray(chebyshev.chebval(x, slope))
    return found
