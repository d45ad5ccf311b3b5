"""One table of quantities: what each is, what it needs, and which limit a file may set on it.

It feeds limits, sensitivities, reports and ``flipflow check``. Here a quantity is declared;
:mod:`flipflow.studies.quantity_values` evaluates those of a motion,
:mod:`flipflow.studies.landmarks` those of a whole response. They meet by name.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

from flipflow.errors import InputError
from flipflow.model.constants import GRAVITY
from flipflow.model.fields import FIELD
from flipflow.model.screen import FlipFlowScreen, is_screen
from flipflow.model.system import Coordinate, Machine, MechanicalSystem

Direction = Literal["at most", "at least", "between"]
Subject = Literal["motion", "response", "operation"]
Part = Literal["amplitude", "phase"]
BranchWord = Literal["from-below", "upper", "lower"]
"""Which motion a quantity is read off where several exist at one speed."""


@dataclass(frozen=True)
class Limit:
    """The limit that a machine file may set on a quantity.

    Parameters
    ----------
    direction
        Which side is allowed; "between" has two ends, (least, greatest).
    sentence
        What it limits, for people.
    example
        Value for a generic screen as an engineer writes it.
    plausible
        Range of limits that exist, SI.
    upper
        What physics allows at most, SI.
    """

    direction: Direction
    sentence: str
    example: str | tuple[str, str]
    plausible: tuple[float, float]
    upper: float = float("inf")


@dataclass(frozen=True)
class Quantity:
    """One number that says how a machine works.

    Parameters
    ----------
    name, label, symbol
        Key, words for people, symbol.
    unit, shown_unit
        SI unit, and the unit it is shown and written in.
    sentence
        What it is.
    of
        What it is read off: one "motion", the whole "response" over speed, or the "operation",
        which the file gives itself.
    needs
        Fields of the screen without which it has no value.
    of_stops
        Whether it says nothing of a machine without stops.
    of_folds
        Whether the folds of the motion's branch must be known, too.
    elsewhere
        Its label for a machine that is no screen; empty where screens alone have it.
    coordinate, part
        Of a machine's coordinate, that coordinate and what is read off it.
    limit
        The limit that may be set on it; None where there is none.
    passing
        The limit that may be set on it while the machine starts and stops.
    """

    name: str
    label: str
    symbol: str
    unit: str
    shown_unit: str
    sentence: str
    of: Subject = "motion"
    needs: tuple[str, ...] = ()
    of_stops: bool = False
    of_folds: bool = False
    elsewhere: str = ""
    coordinate: Coordinate | None = None
    part: Part | None = None
    limit: Limit | None = None
    passing: Limit | None = None

    def missing(self, machine: Machine) -> tuple[str, ...]:
        """Fields that it needs and a screen does not have, in the order of the alphabet."""
        if not isinstance(machine, FlipFlowScreen):
            return ()
        return tuple(sorted(name for name in self.needs if getattr(machine, name) is None))


_NORMAL = ("normal_stiffness", "normal_damping")
_G = (0.5 * GRAVITY, 100.0 * GRAVITY)

# A table reads as a table: names, sentence, what belongs to it, limit.
# fmt: off
_ALL = (
    Quantity(
        "relative_amplitude", "relative amplitude", "|x2|", "m", "mm",
        "Half the peak-to-peak motion between the frames; it tightens and slackens the panels.",
        limit=Limit(
            "between", "Least and greatest relative amplitude, half peak to peak.",
            ("4 mm", "8 mm"), (0.0, 0.1),
        ),
        passing=Limit(
            "at most", "Greatest relative amplitude on the way.", "15 mm", (1e-3, 0.2),
        ),
    ),
    Quantity(
        "stroke", "stroke", "2|x2|", "m", "mm",
        "Full travel between the frames, twice the relative amplitude.",
    ),
    Quantity(
        "main_amplitude", "main frame amplitude", "|x1|", "m", "mm",
        "Half the peak-to-peak motion of the main frame along the surface.",
        passing=Limit(
            "at most", "Greatest displacement of the main frame on the way, in any direction.",
            "25 mm", (1e-3, 0.3),
        ),
    ),
    Quantity(
        "floating_amplitude", "floating frame amplitude", "|xf|", "m", "mm",
        "Half the peak-to-peak motion of the floating frame along the surface.",
    ),
    Quantity(
        "relative_offset", "offset of the relative motion", "|x2|mid", "m", "mm",
        "How far the middle of the motion between the frames lies from where they hang at rest, to "
        "either side.",
    ),
    Quantity(
        "relative_phase", "relative phase", "phi2", "rad", "deg",
        "First harmonic of the relative motion against the unbalance force; positive: it leads.",
    ),
    Quantity(
        "main_frame_acceleration", "main frame acceleration", "a1", "m/s^2", "g",
        "Greatest acceleration of the main frame over a turn, in any direction.",
        needs=_NORMAL,
        limit=Limit(
            "at most", "Greatest acceleration of the main frame, peak, in any direction.",
            "4 g", _G,
        ),
    ),
    Quantity(
        "floating_frame_acceleration", "floating frame acceleration", "af", "m/s^2", "g",
        "Greatest acceleration of the floating frame over a turn, in any direction.",
        needs=_NORMAL,
        limit=Limit(
            "at most", "Greatest acceleration of the floating frame, peak, in any direction.",
            "10 g", _G,
        ),
    ),
    Quantity(
        "speed", "speed", "omega", "rad/s", "rpm",
        "Speed of the shaft.",
        of="operation",
        limit=Limit(
            "between", "Least and greatest shaft speed of the drive.",
            ("600 rpm", "1000 rpm"), (0.0, 320.0),
        ),
    ),
    Quantity(
        "shear_strain", "shear strain", "gamma", "", "%",
        "Greatest relative displacement over the rubber height of the shear springs.",
        needs=("shear_height",),
        limit=Limit(
            "at most", "Greatest relative amplitude over the rubber height of a shear spring.",
            "20 %", (0.005, 3.0),
        ),
        passing=Limit(
            "at most", "Greatest relative amplitude over the rubber height on the way.",
            "30 %", (0.005, 3.0),
        ),
    ),
    Quantity(
        "shear_piece_force", "force per shear spring", "F2/n2", "N", "kN",
        "Greatest dynamic force of one shear spring, k2 x2 + c2 x2' shared by all.",
        needs=("shear_pieces",),
    ),
    Quantity(
        "shear_piece_power", "power per shear spring", "P2/n2", "W", "W",
        "Mean power that one shear spring turns into heat.",
        needs=("shear_pieces",),
    ),
    Quantity(
        "shear_temperature_rise", "temperature rise of a shear spring", "dT2", "K", "K",
        "How much warmer than the air a shear spring is in the mean: its power over conductance.",
        needs=("shear_pieces", "shear_conductance"),
    ),
    Quantity(
        "stop_force", "stop force", "H", "N", "kN",
        "Greatest force on the stop springs of one side together.",
        of_stops=True, elsewhere="stop force",
        limit=Limit(
            "at most", "Greatest force on the stop springs of one side together, peak.",
            "15 kN", (100.0, 10e6),
        ),
        passing=Limit(
            "at most", "Greatest force on the stop springs of one side on the way, peak.",
            "30 kN", (100.0, 10e6),
        ),
    ),
    Quantity(
        "stop_piece_force", "force per stop spring", "H/n3", "N", "kN",
        "The stop force shared by the stop springs of one side.",
        needs=("stop_pieces",), of_stops=True,
    ),
    Quantity(
        "stop_approach_speed", "approach speed of the stops", "x2' at contact", "m/s", "m/s",
        "Greatest relative speed with which a stop is met; 0 where none is.",
        of_stops=True,
    ),
    Quantity(
        "contact_share", "share of the turn in contact", "tc/T", "", "%",
        "Share of the turn during which a stop pushes or pulls; of several the longest.",
        of_stops=True, elsewhere="share of the turn in contact",
    ),
    Quantity(
        "foundation_force", "foundation force", "F1", "N", "kN",
        "Greatest dynamic force of all isolation springs on the foundation, in any direction.",
        needs=_NORMAL,
        limit=Limit(
            "at most", "Greatest dynamic force on the foundation, peak, in any direction.",
            "8 kN", (50.0, 5e6),
        ),
        passing=Limit(
            "at most", "Greatest dynamic force on the foundation on the way, in any direction.",
            "20 kN", (50.0, 5e6),
        ),
    ),
    Quantity(
        "support_force", "force per support", "F1/n1", "N", "kN",
        "The dynamic foundation force shared by the supports.",
        needs=(*_NORMAL, "supports"),
    ),
    Quantity(
        "exciter_force", "exciter force", "m0r w^2", "N", "kN",
        "Centrifugal force of the unbalance.",
    ),
    Quantity(
        "bearing_force", "force per exciter bearing", "m0r w^2/nb", "N", "kN",
        "The exciter force shared by the bearings.",
        needs=("bearings",),
    ),
    Quantity(
        "bearing_load", "load per exciter bearing", "F/nb", "N", "kN",
        "Greatest load over a turn: the exciter force less what the frame's motion takes of it.",
        needs=(*_NORMAL, "rotating_mass", "bearings"),
    ),
    Quantity(
        "bearing_life", "rated life of an exciter bearing", "L10h", "s", "h",
        "Hours that nine of ten bearings reach: 1e6 / (60 n) (C / (fz F))^p.",
        needs=(*_NORMAL, "rotating_mass", "bearings", "bearing_rating"),
    ),
    Quantity(
        "dissipated_power", "dissipated power", "P", "W", "kW",
        "Mean power that all dampers turn into heat; the motor must be larger.",
        needs=_NORMAL, elsewhere="dissipated power",
        limit=Limit(
            "at most", "Greatest power that the dampers turn into heat, mean over a turn.",
            "2 kW", (20.0, 1e6),
        ),
    ),
    Quantity(
        "jump_margin", "margin to the jump", "s", "", "%",
        "Distance of the speed from the nearest jump speed, as a share of the jump speed.",
        of_stops=True, of_folds=True, elsewhere="margin to the jump",
        limit=Limit(
            "at least", "Least distance of the speed from the jump, as a share of the jump speed.",
            "20 %", (0.0, 0.9), upper=1.0,
        ),
    ),
    Quantity(
        "largest_multiplier", "largest multiplier", "|mu|", "", "",
        "What a period leaves of a small disturbance: size of the largest Floquet multiplier.",
        elsewhere="largest multiplier",
    ),
    Quantity(
        "throw_number", "throw number", "Kv", "", "",
        "Greatest acceleration normal to the deck over gravity's share; beyond 1 material flies.",
        needs=(*_NORMAL, "deck_angle"),
    ),
    Quantity(
        "peak_amplitude", "peak relative amplitude", "max |x2|", "m", "mm",
        "Largest relative amplitude over speed.",
        of="response", elsewhere="peak amplitude",
    ),
    Quantity(
        "peak_frequency", "speed of the peak", "w_peak", "rad/s", "rpm",
        "Speed of the largest relative amplitude.",
        of="response", elsewhere="speed of the peak",
    ),
    Quantity(
        "omega_ea", "speed of equal amplitudes", "w_ea", "rad/s", "rpm",
        "Speed at which main and relative amplitude are equal without contact.",
        of="response",
    ),
    Quantity(
        "omega_ar", "antiresonance of the main frame", "w_ar", "rad/s", "rpm",
        "Speed at which the main frame stands nearly still without contact.",
        of="response",
    ),
    Quantity(
        "omega_cs", "speed at which contact begins", "w_cs", "rad/s", "rpm",
        "Speed at which the stop is first touched, the last rising one before the main peak.",
        of="response", elsewhere="speed at which contact begins",
    ),
    Quantity(
        "omega_lb", "lower jump speed", "w_lb", "rad/s", "rpm",
        "The lower of the two folds: the amplitude jumps here when the speed falls.",
        of="response", elsewhere="lower jump speed",
    ),
    Quantity(
        "omega_ub", "upper jump speed", "w_ub", "rad/s", "rpm",
        "The higher of the two folds: the amplitude jumps here when the speed rises.",
        of="response", elsewhere="upper jump speed",
    ),
)

# What is read off a coordinate: unit, shown unit, symbol, sentence.
_READ: Mapping[Part, tuple[str, str, str, str]] = {
    "amplitude": ("m", "mm", "|{}|", "Half the peak-to-peak motion of the coordinate."),
    "phase": (
        "rad", "deg", "phi({})",
        "First harmonic of the coordinate against the exciting force; positive: it leads.",
    ),
}
# fmt: on

QUANTITIES: Mapping[str, Quantity] = {one.name: one for one in _ALL}


def quantities_of(subject: Subject) -> tuple[Quantity, ...]:
    """The quantities that are read off one subject, in the order of the table."""
    return tuple(one for one in QUANTITIES.values() if one.of == subject)


def quantities_for(machine: Machine) -> Mapping[str, Quantity]:
    """The quantities of a motion or of a whole response that a machine has, by name.

    A screen has those of the table. Any other machine has those of the table that every machine
    has, and amplitude and phase of each of its coordinates: ``"left_amplitude"`` of one that is
    named "left", ``"amplitude[0]"`` of the first degree of freedom. Its own units are not known:
    angles and shares alone have one there.
    """
    table = (*quantities_of("motion"), *quantities_of("response"))
    if isinstance(machine, FlipFlowScreen):
        return {one.name: one for one in table}
    system = machine.system()
    coordinates = (*system.coordinates, *range(system.size))
    own = [_of_coordinate(which, part) for which in coordinates for part in _READ]
    shared = [replace(one, label=one.elsewhere) for one in table if one.elsewhere]
    told = (*own, *shared)
    if not is_screen(machine):
        told = tuple(
            one if one.unit in ("", "rad") else replace(one, unit="", shown_unit="") for one in told
        )
    return {one.name: one for one in told}


def quantity_named(name: object, machine: Machine) -> Quantity:
    """A quantity of a motion or of a whole response, as a machine has it.

    Raises
    ------
    InputError
        For a name that the machine does not have, with those it has.
    """
    known = quantities_for(machine)
    if not isinstance(name, str) or name not in known:
        raise InputError("quantity", name, f"choose one of {', '.join(known)}")
    return known[name]


def leading_coordinate(system: MechanicalSystem) -> Coordinate:
    """The coordinate by which motions of a machine are compared: the relative one of a screen.

    Any other machine has its coordinate "relative", else the first that is named, else the first
    degree of freedom.
    """
    return "relative" if "relative" in system.coordinates else system.named[0]


def _of_coordinate(which: Coordinate, part: Part) -> Quantity:
    """Amplitude or phase of one coordinate."""
    unit, shown_unit, symbol, sentence = _READ[part]
    named = isinstance(which, str)
    words = which if isinstance(which, str) else f"x[{which}]"
    return Quantity(
        f"{which}_{part}" if named else f"{part}[{which}]", f"{part} of {words}",
        symbol.format(words), unit, shown_unit, sentence, coordinate=which, part=part,
    )  # fmt: skip


def needing(field: str) -> tuple[Quantity, ...]:
    """The quantities that have no value where a field of the screen is left out."""
    return tuple(one for one in QUANTITIES.values() if field in one.needs)


def missing_words(fields: tuple[str, ...]) -> str:
    """Where in the machine file missing fields belong, in words."""
    return "missing in the machine file: " + ", ".join(FIELD[name].key for name in fields)
