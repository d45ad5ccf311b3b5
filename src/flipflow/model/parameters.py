"""Parameters of any machine: fields of a frozen dataclass, and places in a plain system.

A machine is whatever has ``.system()``. Of a screen, or of any other frozen dataclass, a parameter
is a field that holds a number. Of a plain :class:`~flipflow.MechanicalSystem` it is a path:
``"springs[0].clearance"``, or ``"forcing"``, a factor on the excitation.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar, cast

from flipflow.errors import InputError
from flipflow.model.arguments import checked_text
from flipflow.model.elements import ClearanceSpring
from flipflow.model.excitation import scaled
from flipflow.model.fields import FIELD, MOTION_FIELDS
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.system import Machine, MechanicalSystem

OF_SPRING = ("stiffness", "damping", "clearance", "clearance_minus")
PATH = re.compile(rf"springs\[([0-9]+)\]\.({'|'.join(OF_SPRING)})")
FORCING = "forcing"
FINITE = "give the machine a finite value of it first"
OF_WEIGHT = ("deck_angle",)  # fields of a screen that move its gaps by what hangs on the springs
Kind = TypeVar("Kind", bound=Machine)
COUNTS = (int, "int")  # fields of this type are counted, and have no values between


@dataclass(frozen=True)
class Parameter:
    """A number of a machine, and the machine with another one in its place."""

    name: str
    value: float
    at: Callable[[float], Machine]


def parameter_of(
    machine: Machine, name: object, field: str = "field", besides: tuple[str, ...] = ("omega",)
) -> Parameter:
    """The parameter of a machine along which motions are followed, by its name.

    Raises
    ------
    InputError
        For a name that the machine does not have, with those it has and those ``besides``; for a
        value that is not finite. ``field`` is what the user calls the name.
    """
    found = named_parameter(machine, name, field, besides)
    if not math.isfinite(found.value):
        raise InputError(found.name, found.value, FINITE)
    return found


def differentiable(
    machine: Machine, name: object, field: str = "field", besides: tuple[str, ...] = ("omega",)
) -> Parameter:
    """The parameter of a machine with respect to which a motion is differentiated, by its name.

    Of a screen any field that holds a number and no count will do, those of quantities, too.

    Raises
    ------
    InputError
        As of :func:`parameter_of`.
    """
    known = FIELD.get(name) if isinstance(name, str) else None
    if isinstance(machine, FlipFlowScreen) and known is not None and not known.whole:
        found = _of_fields(machine, known.name)
        if not math.isfinite(found.value):
            raise InputError(known.name, getattr(machine, known.name), FINITE)
        return found
    return parameter_of(machine, name, field, besides)


def named_parameter(
    machine: Machine, name: object, field: str, besides: tuple[str, ...] = ()
) -> Parameter:
    """The parameter of a machine by its name, whatever its value.

    Raises
    ------
    InputError
        For a name that the machine does not have, with those it has and those ``besides``;
        ``field`` is what the user calls the name.
    """
    checked_text(field, name)
    known = parameter_names(machine)
    if name not in known:
        raise InputError(field, name, _choice((*besides, *known)))
    if isinstance(machine, MechanicalSystem):
        return _of_system(machine, str(name))
    return _of_fields(machine, str(name))


def parameter_names(machine: Machine) -> tuple[str, ...]:
    """The names of all parameters of a machine that change its motion."""
    if isinstance(machine, MechanicalSystem):
        springs = range(len(machine.springs))
        return (FORCING, *(f"springs[{j}].{part}" for j in springs for part in OF_SPRING))
    if isinstance(machine, FlipFlowScreen):
        return (*MOTION_FIELDS, *OF_WEIGHT)
    if not dataclasses.is_dataclass(machine):
        return ()
    return tuple(
        field.name
        for field in dataclasses.fields(machine)
        if field.init and field.type not in COUNTS and _is_number(getattr(machine, field.name))
    )


def with_values(machine: Kind, values: Mapping[str, Any]) -> Kind:
    """The machine with other values of some parameters; of a screen, of any of its fields.

    Raises
    ------
    InputError
        For a value that the machine does not take: what its class raises is told in a sentence.
    """
    if isinstance(machine, FlipFlowScreen):
        return machine.replace(**values)
    try:
        changed = cast("Kind", _with_values(machine, values))
        changed.system()
    except InputError:
        raise
    except (ValueError, ArithmeticError) as error:
        given = next(iter(values.values())) if len(values) == 1 else dict(values)
        raise InputError(", ".join(values), given, f"the machine refuses it, {error}") from None
    return changed


def value_of(machine: Machine, name: str) -> object:
    """The machine's own value of a parameter; of a screen, of any of its fields."""
    if isinstance(machine, FlipFlowScreen):
        return getattr(machine, name)
    return named_parameter(machine, name, "field").value


def _with_values(machine: Machine, values: Mapping[str, Any]) -> Machine:
    if not isinstance(machine, MechanicalSystem):
        return dataclasses.replace(machine, **values)  # type: ignore[type-var]
    changed: Machine = machine
    # A clearance moves both sides of equal gaps, so that it comes before that of one side.
    for name in sorted(values):
        changed = named_parameter(changed, name, "field").at(values[name])
    return changed


def _choice(names: tuple[str, ...]) -> str:
    if not names:
        return "this machine has no parameters; give a frozen dataclass with fields of numbers"
    return f"choose one of {', '.join(map(repr, names))}"


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _of_fields(machine: Machine, name: str) -> Parameter:
    """A field of a dataclass."""

    def at(value: float) -> Machine:
        return dataclasses.replace(machine, **{name: value})  # type: ignore[type-var]

    own = getattr(machine, name)
    return Parameter(name, math.nan if own is None else float(own), at)


def _of_system(machine: MechanicalSystem, name: str) -> Parameter:
    """A place in a plain system."""
    if name == FORCING:
        return Parameter(name, 1.0, lambda value: _forced(machine, value))
    path = cast("re.Match[str]", PATH.fullmatch(name))
    j, part = int(path[1]), path[2]

    def at(value: float) -> Machine:
        springs = list(machine.springs)
        springs[j] = _changed(springs[j], part, value)
        return dataclasses.replace(machine, springs=tuple(springs))

    return Parameter(name, float(getattr(machine.springs[j], part)), at)


def _changed(spring: ClearanceSpring, part: str, value: float) -> ClearanceSpring:
    """The spring with another value; equal gaps stay equal where the clearance is changed."""
    changes: dict[str, Any] = {part: value}
    if part == "clearance" and spring.symmetric:
        changes["clearance_minus"] = value
    return dataclasses.replace(spring, **changes)


def _forced(machine: MechanicalSystem, factor: float) -> MechanicalSystem:
    """The system with its excitation times a factor."""
    excitation = tuple(scaled(one, factor) for one in machine.excitations)
    return dataclasses.replace(machine, excitation=excitation)
