"""The flip-flow screen: two frames, shear springs between them, stops beyond a clearance."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal, Self, get_args

import numpy as np
from numpy.typing import NDArray

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
from flipflow.model.constants import GRAVITY
from flipflow.model.contact_law import ContactLaw
from flipflow.model.elements import ClearanceSpring
from flipflow.model.excitation import Unbalance
from flipflow.model.fields import FIELDS
from flipflow.model.system import MechanicalSystem

Measured = Literal["standing", "drawn"]
Rotation = Literal["with-flow", "counter-flow"]
TemperatureOf = Literal["rubber", "air"]
_FACTORS = ("stiffness_factor", "damping_factor", "stop_stiffness_factor", "stop_damping_factor")
# Fields that a load changes.
LOADED = (
    "main_mass", "floating_mass", "shear_stiffness", "shear_damping", "stop_stiffness",
    "stop_damping",
)  # fmt: skip
DEGREES = "give a finite number of degrees Celsius, or None"
AIR = (
    "no speed is known here at which the rubber's own work warms it; give the rubber's "
    "temperature, or take the load from ff.assess(project).cases"
)


@dataclass(frozen=True, kw_only=True)
class Load:
    """What a load or the weather does to a screen.

    Parameters
    ----------
    stiffness_factor, damping_factor
        Factors on the shear spring's stiffness and damping.
    stop_stiffness_factor, stop_damping_factor
        Factors on the stop springs' stiffness and damping.
    main_mass, floating_mass
        Carried material in kg that joins each frame; the unbalance does not change.
    temperature
        Temperature of the rubber in degrees Celsius; needs the screen's temperature table.
    temperature_of
        ``"rubber"``, or ``"air"``: the shear springs are then as much warmer as their work at a
        speed keeps them, where their conductance is known. What is asked at a speed
        (:func:`flipflow.assess`, :func:`flipflow.study`, :func:`flipflow.design`,
        :func:`flipflow.design_map`) finds that temperature; what knows no speed refuses the load.
    name
        What the case is called in reports.
    """

    stiffness_factor: float = 1.0
    damping_factor: float = 1.0
    stop_stiffness_factor: float = 1.0
    stop_damping_factor: float = 1.0
    main_mass: float = 0.0
    floating_mass: float = 0.0
    temperature: float | None = None
    temperature_of: TemperatureOf = "rubber"
    name: str = ""

    def __post_init__(self) -> None:
        for name in _FACTORS:
            object.__setattr__(self, name, checked_positive(name, getattr(self, name)))
        for name in ("main_mass", "floating_mass"):
            object.__setattr__(self, name, checked_at_least_zero(name, getattr(self, name), "kg"))
        if self.temperature is not None:
            degrees = checked_number("temperature", self.temperature, DEGREES)
            object.__setattr__(self, "temperature", degrees)
        checked_word("temperature_of", self.temperature_of, get_args(TemperatureOf))
        checked_text("name", self.name)


@dataclass(frozen=True)
class WarmedLoad:
    """A load case with the temperature of the rubber.

    Parameters
    ----------
    load
        The load as a screen takes it, its temperature within the springs' table.
    rubber
        Where the case gives the air's temperature: that at which the rubber settles, in degrees
        Celsius; None where that is not known.
    note
        A sentence where the temperature is not known, or beyond the table.
    """

    load: Load
    rubber: float | None = None
    note: str = ""


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
    stop_temperature_factor
        The same for the stop springs; none: temperature does not change them.
    rotation
        ``"with-flow"``: the top of the unbalance moves down the slope, as the material does;
        ``"counter-flow"``: up the slope.
    clearance_measured
        ``"standing"``: the gaps as measured on the standing, empty machine; ``"drawn"``: with
        unstressed springs. With a ``deck_angle`` the weight of the floating frame, and of what it
        carries, shifts them: see :attr:`gap_shift`.
    measured_shift
        The shift in m of a machine under a load, which :meth:`loaded` sets; None: this machine is
        the one on which the gaps were measured.
    deck_angle, deck_area, shear_height, shear_pieces, stop_pieces, supports, bearings
        What some checks need, in SI; None leaves those checks out.
    isolation_pieces
        Number of isolation springs, a multiple of the supports; None: one at each support.
    load_centre
        Where the centre of gravity lies between the lowest supports, 0, and the highest, 1.
    rotating_mass, bearing_rating, bearing_load_factor, bearing_life_exponent
        What load and life of the exciter bearings need, in SI.
    shear_conductance
        Heat in W/K that one shear spring gives off.

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
    clearance_measured: Measured = "standing"
    measured_shift: float | None = None
    rotation: Rotation = "with-flow"
    stop_temperature_factor: tuple[tuple[float, float], ...] = ()
    isolation_pieces: float | None = None
    load_centre: float | None = None
    rotating_mass: float | None = None
    bearing_rating: float | None = None
    bearing_load_factor: float = 1.2
    bearing_life_exponent: float = 10.0 / 3.0
    shear_conductance: float | None = None

    def __post_init__(self) -> None:
        for field in FIELDS:
            object.__setattr__(self, field.name, field.check(getattr(self, field.name)))
        checked_word("stop_law", self.stop_law, get_args(ContactLaw))
        checked_word("clearance_measured", self.clearance_measured, get_args(Measured))
        if self.measured_shift is not None:
            remedy = "give a finite number of m, or None"
            shift = checked_number("measured_shift", self.measured_shift, remedy)
            object.__setattr__(self, "measured_shift", shift)
        checked_word("rotation", self.rotation, get_args(Rotation))
        for name in ("temperature_factor", "stop_temperature_factor"):
            object.__setattr__(self, name, _checked_table(name, getattr(self, name)))
        if self.isolation_pieces and self.supports and self.isolation_pieces % self.supports:
            remedy = f"give a multiple of the {self.supports:g} supports"
            raise InputError("isolation_pieces", self.isolation_pieces, remedy)

    def replace(self, **changes: object) -> Self:
        """Return a new screen with some fields changed; unknown names raise InputError."""
        known = {field.name for field in dataclasses.fields(self)}
        for name, value in changes.items():
            if name not in known:
                raise InputError(name, value, f"choose one of {', '.join(sorted(known))}")
        return dataclasses.replace(self, **changes)  # type: ignore[arg-type]

    def loaded(self, load: Load) -> Self:
        """Return the screen as it is under ``load``: softer or stiffer, heavier, warmer.

        What the floating frame carries hangs on the shear springs of the load case. The weight
        that hung there before stays where it was measured: the factors are dynamic ones.

        Raises
        ------
        InputError
            For a load that gives the air's temperature, for that of the rubber depends on the
            speed: ``ff.assess(project).cases`` hold the screen as it is under each load.
        """
        checked_kind("load", load, Load, "give an ff.Load, such as ff.Load(stiffness_factor=1.1)")
        return self.replace(
            **loaded_values(self, load, {name: getattr(self, name) for name in LOADED}),
            measured_shift=self._shift_under(load),
        )

    @property
    def gap_shift(self) -> float:
        """How far in m the weight on the shear springs shifts the rest between the stops.

        A floating frame that hangs down the slope by s = m2 g sin(alpha) / k2 comes that much
        nearer to the stop on the plus side, x1 - xf > 0, and leaves that on the minus side: x
        points up the slope. On the standing machine on which the gaps were measured it is zero.
        """
        if self.measured_shift is not None:
            return self.measured_shift
        drawn = self.clearance_measured == "drawn"
        return self._sag(self.floating_mass, self.shear_stiffness) if drawn else 0.0

    @property
    def weight_considered(self) -> bool:
        """Whether it is known what the weight does to the gaps."""
        return self.deck_angle is not None

    def _shift_under(self, load: Load) -> float | None:
        """The shift under a load; None where the machine still stands as it was measured."""
        springs = loaded_values(self, load, {"shear_stiffness": self.shear_stiffness})
        shift = self.gap_shift + self._sag(load.floating_mass, springs["shear_stiffness"])
        measured = self.measured_shift is None and self.clearance_measured == "standing"
        return None if measured and shift == 0.0 else shift

    def _sag(self, mass: float, stiffness: float) -> float:
        """How far a mass on the floating frame hangs down the slope, in m."""
        return mass * GRAVITY * math.sin(self.deck_angle or 0.0) / stiffness

    def temperature_stiffness_factor(self, temperature: float | None) -> float:
        """Factor on k2 at a temperature in degrees Celsius, linear between the table's rows."""
        if temperature is None:
            return 1.0
        if not self.temperature_factor:
            raise InputError(
                "temperature", temperature, "add shear_springs.temperature_factor to the machine"
            )
        return _factor_at(self.temperature_factor, temperature, "springs'")

    def stop_temperature_stiffness_factor(self, temperature: float | None) -> float:
        """Factor on k3 at a temperature in degrees Celsius; 1 without a table of the stops."""
        if temperature is None or not self.stop_temperature_factor:
            return 1.0
        return _factor_at(self.stop_temperature_factor, temperature, "stops'")

    @property
    def normal_sense(self) -> float:
        """+1 where the unbalance turns from up the slope to upwards (with-flow), else -1.

        Motion and force normal to the surface change their sign with it, and nothing else does.
        """
        return 1.0 if self.rotation == "with-flow" else -1.0

    @property
    def has_stop(self) -> bool:
        """Whether a stop spring can ever act."""
        return self.stop().acts

    def stop(self) -> ClearanceSpring:
        """The stop springs as one clearance spring on the relative motion x1 - xf.

        Its gaps count from where the machine hangs under its weight, without contact.
        """
        minus = self.clearance if self.clearance_minus is None else self.clearance_minus
        return ClearanceSpring(
            (1.0, -1.0),
            self.stop_stiffness,
            self.stop_damping,
            self.clearance - self.gap_shift,
            minus + self.gap_shift,
            self.stop_law,
        )

    def system(self) -> MechanicalSystem:
        """Return the equations of motion in (x1, xf), absolute, along the screen surface.

        They count from where the machine hangs under its weight, without contact.
        """
        return _equations(self)


@lru_cache(64)
def _equations(screen: FlipFlowScreen) -> MechanicalSystem:
    """They are asked for at every motion of a screen, and making them takes long."""
    m1, m2 = screen.main_mass, screen.floating_mass
    c1, c2 = screen.isolation_damping, screen.shear_damping
    k1, k2 = screen.isolation_stiffness, screen.shear_stiffness
    stop = screen.stop()
    return MechanicalSystem(
        M=[[m1, 0.0], [0.0, m2]],
        C=[[c1 + c2, -c2], [-c2, c2]],
        K=[[k1 + k2, -k2], [-k2, k2]],
        springs=(stop,) if stop.acts else (),
        excitation=Unbalance([screen.eccentric_moment, 0.0]),
        coordinates={"main": (1.0, 0.0), "floating": (0.0, 1.0), "relative": (1.0, -1.0)},
    )


def of_air(load: Load) -> bool:
    """Whether the rubber is warmer than the temperature that a load gives."""
    return load.temperature is not None and load.temperature_of == "air"


def refuse_air(load: Load) -> None:
    """See that a load does not leave the temperature of the rubber to the speed."""
    if of_air(load):
        raise InputError("temperature_of", load.temperature_of, AIR)


def as_cool_as_air(load: Load) -> Load:
    """The load with the rubber as warm as the temperature it gives, whosever that is."""
    return dataclasses.replace(load, temperature_of="rubber")


def loaded_values(
    screen: FlipFlowScreen,
    load: Load,
    values: Mapping[str, Any],
    rubber: NDArray[Any] | None = None,
) -> dict[str, Any]:
    """Values of fields of a screen, numbers or arrays in SI, as they are under a load.

    ``rubber`` is the temperature of the rubber beside each value of an array, where the load does
    not give it; beyond the ends of a table the stiffness stays.
    """
    if rubber is None:
        refuse_air(load)
        shear = screen.temperature_stiffness_factor(load.temperature)
        stop = screen.stop_temperature_stiffness_factor(load.temperature)
    else:
        shear = _factors_at(screen.temperature_factor, rubber)
        stop = _factors_at(screen.stop_temperature_factor, rubber)
    carried = {"main_mass": load.main_mass, "floating_mass": load.floating_mass}
    factors = {
        "shear_stiffness": load.stiffness_factor * shear,
        "shear_damping": load.damping_factor,
        "stop_stiffness": load.stop_stiffness_factor * stop,
        "stop_damping": load.stop_damping_factor,
    }
    changed = {name: values[name] + mass for name, mass in carried.items() if name in values}
    changed |= {name: values[name] * f for name, f in factors.items() if name in values}
    return dict(values) | changed


def loaded_columns(
    screen: FlipFlowScreen,
    load: Load,
    columns: Mapping[str, NDArray[Any]],
    rubber: NDArray[Any] | None = None,
) -> dict[str, NDArray[Any]]:
    """Columns of values of many screens as they are under a load, beside ``screen.loaded(load)``.

    Where a varied field moves the rest between the stops, a column of ``measured_shift`` is added.
    ``rubber`` is as of :func:`loaded_values`.
    """
    found = loaded_values(screen, load, columns, rubber)
    moving = {"floating_mass", "shear_stiffness", "deck_angle"} & set(columns)
    drawn = screen.measured_shift is None and screen.clearance_measured == "drawn"
    if not moving or not (drawn or load.floating_mass):
        return found

    def column(name: str) -> NDArray[Any]:
        own = columns.get(name, getattr(screen, name))
        values = np.asarray(own, complex if np.iscomplexobj(own) else float)
        return np.where(np.isnan(values), 0.0, values)  # a deck whose angle is not known is flat

    fall, stiffness = GRAVITY * np.sin(column("deck_angle")), column("shear_stiffness")
    under = loaded_values(screen, load, {"shear_stiffness": stiffness}, rubber)
    springs = under["shear_stiffness"]
    before = column("floating_mass") * fall / stiffness if drawn else screen.gap_shift
    shift = np.asarray(before + load.floating_mass * fall / springs)
    rows = len(next(iter(columns.values())))
    return found | {"measured_shift": np.broadcast_to(shift, (rows,)).copy()}


def _factor_at(table: tuple[tuple[float, float], ...], temperature: float, whose: str) -> float:
    """Factor at a temperature in degrees Celsius, linear between the rows of a table."""
    degrees, factors = zip(*table, strict=True)
    if not degrees[0] <= checked_number("temperature", temperature, DEGREES) <= degrees[-1]:
        raise InputError(
            "temperature",
            temperature,
            f"stay within the {whose} table, {degrees[0]:g} to {degrees[-1]:g} degC",
        )
    return float(np.interp(temperature, degrees, factors))


def _factors_at(table: tuple[tuple[float, float], ...], rubber: NDArray[Any]) -> Any:
    """Factors at temperatures, with their slope along an imaginary part; 1 without a table."""
    if not table:
        return 1.0
    degrees, factors = map(np.array, zip(*table, strict=True))
    found = np.interp(rubber.real, degrees, factors)
    if not np.iscomplexobj(rubber):
        return found
    slopes = np.concatenate([[0.0], np.diff(factors) / np.diff(degrees), [0.0]])
    return found + 1j * rubber.imag * slopes[np.searchsorted(degrees, rubber.real)]


def is_screen(machine: object) -> bool:
    """Whether a machine is a screen, or the system of one, whose units are SI."""
    if isinstance(machine, MechanicalSystem):
        return {"main", "floating", "relative"} <= set(machine.coordinates)
    return isinstance(machine, FlipFlowScreen)


def unit_in(machine: object, unit: str) -> str:
    """A unit as it is written behind a number of a machine, whose user's own are not told."""
    return f" {unit}" if is_screen(machine) else ""


def _checked_table(name: str, rows: object) -> tuple[tuple[float, float], ...]:
    """Pairs (degrees Celsius, factor), rising in temperature; none is a table, too."""
    remedy = "give pairs (degrees Celsius, factor above 0)"
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
