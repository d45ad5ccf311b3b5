"""Parameters of any machine: fields of a frozen dataclass, and places in a plain system.

A machine is whatever has ``.system()``. Of a screen, or of any other frozen dataclass, a parameter
is a field that holds a number. Of a plain :class:`~flipflow.MechanicalSystem` it is a path:
``"springs[0].clearance"``, or ``"forcing"``, a factor on the excitation.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from flipflow.errors import InputError
from flipflow.model.arguments import checked_text
from flipflow.model.elements import ClearanceSpring
from flipflow.model.excitation import scaled
from flipflow.model.fields import MOTION_FIELDS
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.system import Machine, MechanicalSystem

OF_SPRING = ("stiffness", "damping", "clearance", "clearance_minus")
PATH = re.compile(rf"springs\[([0-9]+)\]\.({'|'.join(OF_SPRING)})")
FORCING = "forcing"


@dataclass(frozen=True)
class Parameter:
    """A number of a machine, and the machine with another one in its place."""

    name: str
    value: float
    at: Callable[[float], Machine]


def parameter_of(machine: Machine, name: object) -> Parameter:
    """The parameter of a machine by its name.

    Raises
    ------
    InputError
        For a name that the machine does not have, with those it has; for a value that is not
        finite.
    """
    checked_text("field", name)
    found = _of_fields(machine, str(name))
    if not math.isfinite(found.value):
        raise InputError(found.name, found.value, "give the machine a finite value of it first")
    return found


def _of_fields(machine: Machine, name: str) -> Parameter:
    """A field of a dataclass, or a place in a plain system."""
    if isinstance(machine, MechanicalSystem):
        return _of_system(machine, name)
    names: tuple[str, ...] = ()
    if isinstance(machine, FlipFlowScreen):
        names = MOTION_FIELDS
    elif dataclasses.is_dataclass(machine):
        held = [(field.name, getattr(machine, field.name)) for field in dataclasses.fields(machine)]
        names = tuple(n for n, v in held if isinstance(v, (int, float)) and not isinstance(v, bool))
    if name not in names:
        listed = ", ".join(repr(one) for one in ("omega", *names))
        raise InputError("field", name, f"choose one of {listed}")

    def at(value: float) -> Machine:
        return dataclasses.replace(machine, **{name: value})  # type: ignore[type-var]

    own = getattr(machine, name)
    return Parameter(name, math.nan if own is None else float(own), at)


def _of_system(machine: MechanicalSystem, name: str) -> Parameter:
    """A place in a plain system."""
    path = PATH.fullmatch(name)
    if name == FORCING:
        return Parameter(name, 1.0, lambda value: _forced(machine, value))
    if path is None or int(path[1]) >= len(machine.springs):
        places = [
            f"'springs[{j}].{part}'" for j in range(len(machine.springs)) for part in OF_SPRING
        ]
        listed = ", ".join(["'omega'", "'forcing'", *places])
        raise InputError("field", name, f"choose one of {listed}")
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
