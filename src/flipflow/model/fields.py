"""One table of fields: it feeds the machine file, its schema and template, checks and reports.

Values are SI inside; ``unit`` is the SI unit of the value and ``file_unit`` the one an engineer
writes. ``bounds`` are what physics allows, ``plausible`` what a flip-flow screen can look like:
outside the first a value is refused, outside the second it is questioned.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import EllipsisType

import numpy as np
from numpy.typing import NDArray

from flipflow.errors import InputError
from flipflow.model.arguments import LARGEST, TOO_LARGE, real


@dataclass(frozen=True)
class Field:
    """One scalar of a flip-flow screen.

    Parameters
    ----------
    name
        Keyword of :class:`~flipflow.FlipFlowScreen`.
    symbol
        Symbol of the literature, ASCII.
    unit, file_unit
        SI unit, and the unit an engineer writes in a machine file.
    key
        Place in the machine file, ``section.key``.
    sentence
        What it is, for people.
    lower, upper
        What physics allows. ``lower_open`` excludes the lower bound itself.
    plausible
        Range of machines that exist; None where any value may occur.
    default
        Value where the field is left out; ``...`` when it must be given.
    example
        Value of a generic screen as an engineer writes it; the template is made of these.
    count
        Name of the field that counts the pieces this total is made of, where there is one.
    whole
        Whether only whole numbers make sense.
    infinite
        Whether infinity is a value.
    """

    name: str
    symbol: str
    unit: str
    file_unit: str
    key: str
    sentence: str
    lower: float = 0.0
    upper: float = math.inf
    lower_open: bool = False
    plausible: tuple[float, float] | None = None
    default: float | EllipsisType | None = ...
    example: str | float | tuple[str, str] = ""
    count: str | None = None
    whole: bool = False
    infinite: bool = False

    def allows(self, values: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Where physics allows finite values of the field, in their shape."""
        low = values > self.lower if self.lower_open else values >= self.lower
        whole = values == np.rint(values) if self.whole else np.full(values.shape, True)
        return np.asarray(low & (values <= self.upper) & np.isfinite(values) & whole)

    @property
    def required(self) -> bool:
        """Whether the field must be given."""
        return self.default is ...

    def check(self, value: object, *, label: str | None = None) -> float | None:
        """Return ``value`` as float, or raise :class:`InputError` when physics forbids it."""
        field = label or self.name
        if value is None and not self.required:
            return None
        number = real(value)
        if number is None:
            raise InputError(field, value, f"a number in {self.unit or 'plain units'} belongs here")
        too_low = number <= self.lower if self.lower_open else number < self.lower
        if math.isnan(number) or too_low or number > self.upper:
            raise InputError(field, value, f"give {self._allowed()}")
        if math.isinf(number) and not self.infinite:
            raise InputError(field, value, "give a finite number")
        if LARGEST < abs(number) < math.inf:
            raise InputError(field, value, TOO_LARGE)
        if self.whole and not number.is_integer():
            raise InputError(field, value, "give a whole number")
        return number

    def is_plausible(self, value: float | None) -> bool:
        """Whether ``value`` (SI) lies in the range of machines that exist."""
        if value is None or self.plausible is None or value == self.default:
            return True
        if self.infinite and math.isinf(value):
            return True
        low, high = self.plausible
        return low <= value <= high

    def _allowed(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        if self.upper < math.inf:
            return f"a number between {self.lower:g} and {self.upper:g}{unit}"
        return f"a number {'above' if self.lower_open else 'of at least'} {self.lower:g}{unit}"


# A table reads as a table: one line for the names, one for the sentence, one for the numbers.
# fmt: off
FIELDS: tuple[Field, ...] = (
    Field(
        "main_mass", "m1", "kg", "kg", "frames.main_mass",
        "Mass of the main frame, the unbalance mass included.",
        lower_open=True, plausible=(10.0, 50e3),
        example="1000 kg",
    ),
    Field(
        "floating_mass", "m2", "kg", "kg", "frames.floating_mass",
        "Mass of the floating frame, which the shear springs carry.",
        lower_open=True, plausible=(2.0, 30e3),
        example="350 kg",
    ),
    Field(
        "eccentric_moment", "m0r", "kg m", "kg mm", "exciter.eccentric_moment",
        "Unbalance mass times its radius; the exciting force is this times the speed squared.",
        plausible=(1e-3, 200.0),
        example="4500 kg mm",
    ),
    Field(
        "isolation_stiffness", "k1", "N/m", "kN/m", "isolation.stiffness",
        "Stiffness of all isolation springs together, along the screen surface.",
        lower_open=True, plausible=(1e3, 50e6),
        example="700 kN/m", count="isolation_pieces",
    ),
    Field(
        "isolation_damping", "c1", "N s/m", "kN s/m", "isolation.damping",
        "Viscous damping of all isolation springs together, along the screen surface.",
        plausible=(0.0, 2e6),
        example="10 kN s/m", count="isolation_pieces",
    ),
    Field(
        "shear_stiffness", "k2", "N/m", "kN/m", "shear_springs.stiffness",
        "Dynamic shear stiffness of all shear springs together.",
        lower_open=True, plausible=(1e4, 500e6),
        example="3000 kN/m", count="shear_pieces",
    ),
    Field(
        "shear_damping", "c2", "N s/m", "kN s/m", "shear_springs.damping",
        "Viscous damping of all shear springs together.",
        plausible=(0.0, 2e6),
        example="3 kN s/m", count="shear_pieces",
    ),
    Field(
        "stop_stiffness", "k3", "N/m", "kN/m", "stops.stiffness",
        "Stiffness of the stop springs of one side, engaged.",
        default=0.0, plausible=(1e4, 5e9),
        example="9000 kN/m", count="stop_pieces",
    ),
    Field(
        "stop_damping", "c3", "N s/m", "kN s/m", "stops.damping",
        "Viscous damping of the stop springs of one side, engaged.",
        default=0.0, plausible=(0.0, 2e6),
        example="3 kN s/m", count="stop_pieces",
    ),
    Field(
        "clearance", "e", "m", "mm", "stops.clearance",
        'Gap per side before a stop is touched; "inf" means no stop.',
        default=math.inf, plausible=(0.0, 0.1),
        example="6 mm", infinite=True,
    ),
    Field(
        "clearance_minus", "e_minus", "m", "mm", "stops.clearance_minus",
        "Gap of the other side where it differs; left out, both sides are equal.",
        default=None, plausible=(0.0, 0.1),
        example="6 mm", infinite=True,
    ),
    Field(
        "normal_stiffness", "k1n", "N/m", "kN/m", "isolation.normal_stiffness",
        "Stiffness of all isolation springs together, normal to the screen surface.",
        lower_open=True, default=None, plausible=(1e3, 50e6),
        example="700 kN/m", count="isolation_pieces",
    ),
    Field(
        "normal_damping", "c1n", "N s/m", "kN s/m", "isolation.normal_damping",
        "Viscous damping of all isolation springs together, normal to the screen surface.",
        default=None, plausible=(0.0, 2e6),
        example="10 kN s/m", count="isolation_pieces",
    ),
    Field(
        "deck_angle", "alpha", "rad", "deg", "frames.deck_angle",
        "Inclination of the screen surface to the horizontal.",
        lower=-math.pi / 2, upper=math.pi / 2, default=None, plausible=(0.0, math.radians(45.0)),
        example="15 deg",
    ),
    Field(
        "deck_area", "A", "m^2", "m^2", "frames.deck_area",
        "Area of the screen surface, for load cases given per area.",
        lower_open=True, default=None, plausible=(0.05, 100.0),
        example="2.5 m^2",
    ),
    Field(
        "shear_height", "h2", "m", "mm", "shear_springs.height",
        "Rubber height of a shear spring; relative amplitude over height is its shear strain.",
        lower_open=True, default=None, plausible=(5e-3, 0.5),
        example="50 mm",
    ),
    Field(
        "shear_pieces", "n2", "", "", "shear_springs.pieces",
        "Number of shear springs.",
        lower=1.0, default=None, plausible=(1.0, 500.0),
        example=12, whole=True,
    ),
    Field(
        "shear_conductance", "G2", "W/K", "W/K", "shear_springs.conductance",
        "Heat that one shear spring gives off for each kelvin it is warmer than the air.",
        lower_open=True, default=None, plausible=(0.05, 100.0),
        example="1.5 W/K",
    ),
    Field(
        "stop_pieces", "n3", "", "", "stops.pieces_per_side",
        "Number of stop springs on each side.",
        lower=1.0, default=None, plausible=(1.0, 200.0),
        example=4, whole=True,
    ),
    Field(
        "supports", "n1", "", "", "isolation.supports",
        "Number of supports, the points at which the isolation loads the foundation.",
        lower=1.0, default=None, plausible=(1.0, 100.0),
        example=4, whole=True,
    ),
    Field(
        "isolation_pieces", "n1p", "", "", "isolation.pieces",
        "Number of isolation springs, a multiple of the supports; left out, one at each support.",
        lower=1.0, default=None, plausible=(1.0, 200.0),
        example=8, whole=True,
    ),
    Field(
        "load_centre", "s_c", "", "%", "isolation.load_centre",
        "Where the centre of gravity lies between the lowest supports, 0 %, and the highest, "
        "100 %; left out, all carry alike.",
        upper=1.0, default=None, plausible=(0.2, 0.8),
        example="50 %",
    ),
    Field(
        "bearings", "nb", "", "", "exciter.bearings",
        "Number of exciter bearings that share the unbalance force.",
        lower=1.0, default=None, plausible=(1.0, 32.0),
        example=2, whole=True,
    ),
    Field(
        "rotating_mass", "mr", "kg", "kg", "exciter.rotating_mass",
        "Mass that the exciter bearings carry, unbalances and shaft; the frame moves it, too.",
        default=None, plausible=(0.5, 5e3),
        example="45 kg",
    ),
    Field(
        "bearing_rating", "C", "N", "kN", "exciter.bearing_rating",
        "Basic dynamic load rating of one exciter bearing, from its catalogue.",
        lower_open=True, default=None, plausible=(5e3, 10e6),
        example="350 kN",
    ),
    Field(
        "bearing_load_factor", "fz", "", "", "exciter.bearing_load_factor",
        "Factor on the load of a bearing in a vibrating machine; left out, 1.2.",
        lower_open=True, default=1.2, plausible=(1.0, 3.0),
        example=1.2,
    ),
    Field(
        "bearing_life_exponent", "p", "", "", "exciter.bearing_life_exponent",
        "Exponent of the rated life: 10/3 for rollers, 3 for balls; left out, 10/3.",
        lower_open=True, default=10.0 / 3.0, plausible=(3.0, 3.4),
        example=3.3333,
    ),
)
# fmt: on

FIELD: Mapping[str, Field] = {field.name: field for field in FIELDS}


def symbol_of(name: str) -> str:
    """Symbol of a field of a screen; the name of anything else."""
    return FIELD[name].symbol if name in FIELD else name


# Fields in the equations of motion along the surface.
MOTION_FIELDS = (
    "main_mass", "floating_mass", "eccentric_moment", "isolation_stiffness", "isolation_damping",
    "shear_stiffness", "shear_damping", "stop_stiffness", "stop_damping", "clearance",
    "clearance_minus",
)  # fmt: skip
