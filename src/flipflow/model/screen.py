"""The flip-flow screen: two frames, shear springs between them, stops beyond a clearance."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Self, get_args

import numpy as np

from flipflow.errors import InputError
from flipflow.model.arguments import (
    checked_at_least_zero,
    checked_kind,
    checked_number,
    checked_numbers,
    checked_positive,
    checked_text,
    checked_word,
)
from flipflow.model.contact_law import ContactLaw
from flipflow.model.elements import ClearanceSpring
from flipflow.model.excitation import Unbalance
from flipflow.model.fields import FIELDS
from flipflow.model.system import MechanicalSystem

DEGREES = "give a finite number of degrees Celsius, or None"


@dataclass(frozen=True, kw_only=True)
class Load:
    """What a load or the weather does to a screen.

    Parameters
    ----------
    stiffness_factor, damping_factor
        Factors on the shear spring's stiffness and damping.
    main_mass, floating_mass
        Carried material in kg that joins each frame; the unbalance does not change.
    temperature
        Temperature of the shear springs in degrees Celsius; needs the screen's temperature table.
    name
        What the case is called in reports.
    """

    stiffness_factor: float = 1.0
    damping_factor: float = 1.0
    main_mass: float = 0.0
    floating_mass: float = 0.0
    temperature: float | None = None
    name: str = ""

    def __post_init__(self) -> None:
        for name in ("stiffness_factor", "damping_factor"):
            object.__setattr__(self, name, checked_positive(name, getattr(self, name)))
        for name in ("main_mass", "floating_mass"):
            object.__setattr__(self, name, checked_at_least_zero(name, getattr(self, name), "kg"))
        if self.temperature is not None:
            degrees = checked_number("temperature", self.temperature, DEGREES)
            object.__setattr__(self, "temperature", degrees)
        checked_text("name", self.name)


@dataclass(frozen=True, kw_only=True)
class FlipFlowScreen:
    """A flip-flow vibrating screen, SI units. Frozen: :meth:`replace` makes a new one.

    Parameters
    ----------
    main_mass, floating_mass
        m1 (unbalance mass included) and m2 in kg.
    eccentric_moment
        m0 r in kg m.
    isolation_stiffness, isolation_damping
        k1 in N/m and c1 in N s/m along the screen surface.
    shear_stiffness, shear_damping
        k2 in N/m and c2 in N s/m, all shear springs together.
    stop_stiffness, stop_damping
        k3 in N/m and c3 in N s/m of one engaged side.
    clearance, clearance_minus
        Gap per side e+ and, where it differs, e- in m; infinite means no stop on that side.
    stop_law
        ``"paper"``, ``"compression-only"``, ``"undamped-rebound"`` or ``"elasto-gap"``; see
        :class:`~flipflow.ClearanceSpring`.
    normal_stiffness, normal_damping
        k1n in N/m and c1n in N s/m normal to the surface; None leaves that direction unchecked.
    temperature_factor
        Pairs (degrees Celsius, factor on the shear stiffness), rising in temperature.
    deck_angle, deck_area, shear_height, shear_pieces, stop_pieces, supports, bearings
        What some checks need, in SI; None leaves those checks out.

    Raises
    ------
    InputError
        For a value that physics forbids; the sentence names field, value and remedy.
    """

    main_mass: float
    floating_mass: float
    eccentric_moment: float
    isolation_stiffness: float
    isolation_damping: float
    shear_stiffness: float
    shear_damping: float
    stop_stiffness: float = 0.0
    stop_damping: float = 0.0
    clearance: float = math.inf
    clearance_minus: float | None = None
    stop_law: ContactLaw = "paper"
    normal_stiffness: float | None = None
    normal_damping: float | None = None
    temperature_factor: tuple[tuple[float, float], ...] = ()
    deck_angle: float | None = None
    deck_area: float | None = None
    shear_height: float | None = None
    shear_pieces: float | None = None
    stop_pieces: float | None = None
    supports: float | None = None
    bearings: float | None = None

    def __post_init__(self) -> None:
        for field in FIELDS:
            object.__setattr__(self, field.name, field.check(getattr(self, field.name)))
        checked_word("stop_law", self.stop_law, get_args(ContactLaw))
        object.__setattr__(self, "temperature_factor", _checked_table(self.temperature_factor))

    def replace(self, **changes: object) -> Self:
        """Return a new screen with some fields changed; unknown names raise InputError."""
        known = {field.name for field in dataclasses.fields(self)}
        for name, value in changes.items():
            if name not in known:
                raise InputError(name, value, f"choose one of {', '.join(sorted(known))}")
        return dataclasses.replace(self, **changes)  # type: ignore[arg-type]

    def loaded(self, load: Load) -> Self:
        """Return the screen as it is under ``load``: softer or stiffer, heavier, warmer."""
        checked_kind("load", load, Load, "give an ff.Load, such as ff.Load(stiffness_factor=1.1)")
        factor = load.stiffness_factor * self.temperature_stiffness_factor(load.temperature)
        return self.replace(
            main_mass=self.main_mass + load.main_mass,
            floating_mass=self.floating_mass + load.floating_mass,
            shear_stiffness=self.shear_stiffness * factor,
            shear_damping=self.shear_damping * load.damping_factor,
        )

    def temperature_stiffness_factor(self, temperature: float | None) -> float:
        """Factor on k2 at a temperature in degrees Celsius, linear between the table's rows."""
        if temperature is None:
            return 1.0
        if not self.temperature_factor:
            raise InputError(
                "temperature", temperature, "add shear_springs.temperature_factor to the machine"
            )
        degrees, factors = zip(*self.temperature_factor, strict=True)
        if not degrees[0] <= checked_number("temperature", temperature, DEGREES) <= degrees[-1]:
            raise InputError(
                "temperature",
                temperature,
                f"stay within the springs' table, {degrees[0]:g} to {degrees[-1]:g} degC",
            )
        return float(np.interp(temperature, degrees, factors))

    @property
    def has_stop(self) -> bool:
        """Whether a stop spring can ever act."""
        return self.stop().acts

    def stop(self) -> ClearanceSpring:
        """The stop springs as one clearance spring on the relative motion x1 - xf."""
        return ClearanceSpring(
            (1.0, -1.0),
            self.stop_stiffness,
            self.stop_damping,
            self.clearance,
            self.clearance_minus,
            self.stop_law,
        )

    def system(self) -> MechanicalSystem:
        """Return the equations of motion in (x1, xf), absolute, along the screen surface."""
        m1, m2 = self.main_mass, self.floating_mass
        c1, c2 = self.isolation_damping, self.shear_damping
        k1, k2 = self.isolation_stiffness, self.shear_stiffness
        stop = self.stop()
        return MechanicalSystem(
            M=[[m1, 0.0], [0.0, m2]],
            C=[[c1 + c2, -c2], [-c2, c2]],
            K=[[k1 + k2, -k2], [-k2, k2]],
            springs=(stop,) if stop.acts else (),
            excitation=Unbalance([self.eccentric_moment, 0.0]),
            coordinates={"main": (1.0, 0.0), "floating": (0.0, 1.0), "relative": (1.0, -1.0)},
        )


def _checked_table(rows: object) -> tuple[tuple[float, float], ...]:
    """Pairs (degrees Celsius, factor), rising in temperature; none is a table, too."""
    name, remedy = "temperature_factor", "give pairs (degrees Celsius, factor above 0)"
    table = checked_numbers(name, rows, remedy)
    if table.size == 0:
        return ()
    if table.ndim != 2 or table.shape[1] != 2:
        raise InputError(name, rows, remedy)
    if (np.diff(table[:, 0]) <= 0.0).any():
        raise InputError(name, rows, "list temperatures in rising order")
    if (table[:, 1] <= 0.0).any():
        raise InputError(name, rows, "give factors above 0")
    return tuple((float(degrees), float(factor)) for degrees, factor in table)
