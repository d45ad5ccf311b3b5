"""The layout of a machine file: every section and key, from the table of fields.

Parser, schema and template walk over the same entries, so none can know a key the others miss.
"""

from __future__ import annotations

import difflib
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from flipflow.errors import InputError
from flipflow.model.contact_law import ContactLaw
from flipflow.model.drive import DRIVE_FIELDS
from flipflow.model.fields import FIELD, FIELDS, Field
from flipflow.model.limits import LIMIT_FIELDS, PASSING_FIELDS
from flipflow.model.quantities import needing
from flipflow.model.screen import Measured, Rotation, TemperatureOf
from flipflow.model.starter import STARTS

FORMAT = 1
MOST_LISTED = 30  # names that a sentence lists

Kind = Literal[
    "quantity", "each", "interval", "choice", "text", "temperatures", "torques", "material", "split"
]


@dataclass(frozen=True)
class Entry:
    """One key of a machine file.

    Parameters
    ----------
    section, key
        Where it stands.
    kind
        How its value is read: "quantity", "each" (one piece of a total), "interval", and so on.
    sentence
        What it is, for people.
    example
        What a file may hold there.
    field
        The field of the table behind it, if it is a number.
    choices
        The words it may be, for "choice".
    """

    section: str
    key: str
    kind: Kind
    sentence: str
    example: object
    field: Field | None = None
    choices: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """``section.key``, as errors and sources name it."""
        return f"{self.section}.{self.key}"


SECTION_SENTENCES: Mapping[str, str] = {
    "document": "Title block of the report; every key may stay empty.",
    "frames": "Main frame and floating frame.",
    "exciter": "Exciter, fixed to the main frame.",
    "isolation": "Isolation springs between main frame and foundation.",
    "shear_springs": "Shear springs between main frame and floating frame.",
    "stops": "Stop springs, touched beyond a gap; leave the section out for a machine without.",
    "operation": "How the machine is run.",
    "drive": "Motor and shaft, for starts; leave the section out and a drive is assumed.",
    "limits": "What the machine may do; a limit left out is not checked.",
    "limits.start": "What it may do while it starts; left out, the running limit is compared.",
    "limits.stop": "What it may do while it comes to a stop, the motor switched off.",
    "load_cases": "Loads and weather the machine must bear; the empty machine should be one.",
    "sources": 'Where values come from: "section.key" = "drawing 4711, sheet 2".',
}

_DOCUMENT = (
    ("name", "Name of the machine.", "My screen"),
    ("project", "Project it belongs to.", ""),
    ("customer", "Who it is for.", ""),
    ("drawing", "Number of its drawing.", ""),
    ("revision", "Revision of this file.", "A"),
    ("prepared_by", "Who wrote this file.", ""),
    ("checked_by", "Who checked it.", ""),
)

SPEED = Field(
    "speed", "omega", "rad/s", "rpm", "operation.speed",
    "Shaft speed the machine is run at.",
    lower_open=True, default=None, plausible=(2.0 * math.pi, 100.0 * math.pi), example="850 rpm",
)  # fmt: skip

# fmt: off
LOAD_FIELDS: tuple[Field, ...] = (
    Field(
        "stiffness_factor", "", "", "", "load_cases.shear_stiffness_factor",
        "Factor on the stiffness of the shear springs under this load.",
        lower_open=True, default=1.0, plausible=(0.2, 5.0), example=1.1,
    ),
    Field(
        "damping_factor", "", "", "", "load_cases.shear_damping_factor",
        "Factor on the damping of the shear springs under this load.",
        lower_open=True, default=1.0, plausible=(0.1, 10.0), example=1.0,
    ),
    Field(
        "stop_stiffness_factor", "", "", "", "load_cases.stop_stiffness_factor",
        "Factor on the stiffness of the stop springs under this load.",
        lower_open=True, default=1.0, plausible=(0.2, 5.0), example=1.1,
    ),
    Field(
        "stop_damping_factor", "", "", "", "load_cases.stop_damping_factor",
        "Factor on the damping of the stop springs under this load.",
        lower_open=True, default=1.0, plausible=(0.1, 10.0), example=1.0,
    ),
    Field(
        "temperature", "T", "degC", "degC", "load_cases.temperature",
        "Temperature of the rubber; needs shear_springs.temperature_factor.",
        lower=-273.15, default=None, plausible=(-60.0, 120.0), example="50 degC",
    ),
)
# fmt: on

MATERIAL = Field(
    "material", "", "kg", "kg", "load_cases.material",
    'Carried material, a mass ("60 kg") or a mass per deck area ("30 kg/m^2").',
    default=None, plausible=(0.0, 20e3), example="30 kg/m^2",
)  # fmt: skip
MATERIAL_PER_AREA = Field(
    "material", "", "kg/m^2", "kg/m^2", "load_cases.material", MATERIAL.sentence,
    default=None, plausible=(0.0, 1e3), example="30 kg/m^2",
)  # fmt: skip


def unchecked_without(field: Field) -> str:
    """What is not checked where a field is left out, in words; empty where nothing needs it."""
    if field is SPEED:
        return "the verdict at the operating speed"
    return ", ".join(quantity.label for quantity in needing(field.name))


def entry_of(field: Field) -> Entry:
    """Return the entry that holds ``field`` in a machine file."""
    section, _, key = field.key.rpartition(".")
    kind: Kind = "interval" if isinstance(field.example, tuple) else "quantity"
    example = list(field.example) if isinstance(field.example, tuple) else field.example
    return Entry(section, key, kind, field.sentence, example, field)


def each_of(field: Field) -> Entry | None:
    """Return the entry for one piece of ``field``, where the field counts pieces."""
    if field.count is None:
        return None
    section, key = field.key.split(".")
    count = FIELD[field.count].key
    sentence = f"The same for one piece, instead of the total; needs {count}."
    return Entry(section, f"{key}_each", "each", sentence, "", field)


def _machine_entries() -> Iterable[Entry]:
    for field in FIELDS:
        yield entry_of(field)
        each = each_of(field)
        if each is not None:
            yield each
    yield Entry(
        "exciter", "type", "choice",
        "How the unbalance moves.", "circular", choices=("circular",),
    )  # fmt: skip
    yield Entry(
        "exciter", "rotation", "choice",
        "Whether the top of the unbalance moves down the slope, with the material, or up.",
        "with-flow", choices=get_args(Rotation),
    )  # fmt: skip
    yield Entry(
        "stops", "law", "choice",
        "Force law: the paper's, no pull, no damping outwards, damping within the spring's force.",
        "paper", choices=get_args(ContactLaw),
    )  # fmt: skip
    yield Entry(
        "stops", "clearance_measured", "choice",
        "Gaps as measured on the standing, empty machine, or as drawn with unstressed springs.",
        "standing", choices=get_args(Measured),
    )  # fmt: skip
    yield Entry(
        "shear_springs", "temperature_factor", "temperatures",
        "Factor on the stiffness over the temperature of the rubber.",
        [["-10 degC", 1.15], ["20 degC", 1.0], ["50 degC", 0.85]],
    )  # fmt: skip
    yield Entry(
        "stops", "temperature_factor", "temperatures",
        "Factor on the stiffness of the stop springs over their temperature.",
        [["-10 degC", 1.1], ["20 degC", 1.0], ["50 degC", 0.9]],
    )  # fmt: skip


def _load_entries() -> Iterable[Entry]:
    yield Entry("load_cases", "name", "text", "What the case is called in reports.", "full")
    yield from map(entry_of, LOAD_FIELDS)
    yield Entry(
        "load_cases", "temperature_of", "choice",
        "Whose temperature it is: the rubber's, or the air's, which springs at work are above.",
        "rubber", choices=get_args(TemperatureOf),
    )  # fmt: skip
    yield Entry("load_cases", "material", "material", MATERIAL.sentence, MATERIAL.example, MATERIAL)
    yield Entry(
        "load_cases", "split_main_floating", "split",
        "Shares of the material that main and floating frame carry.", [0.5, 0.5],
    )  # fmt: skip


START = Entry(
    "drive", "start", "choice", "How the motor is put on the mains.", "direct",
    choices=tuple(STARTS.values()),
)  # fmt: skip
TORQUE_TABLE = Entry(
    "drive", "torque_table", "torques",
    "Speed of the motor and its torque, as a share of the rated torque or in N m, from standstill "
    "on; instead of torque ratios and slip.",
    [["0 rpm", 2.0], ["300 rpm", 1.7], ["1200 rpm", 2.6], ["1440 rpm", 1.0]],
)  # fmt: skip


def _by_section() -> Mapping[str, tuple[Entry, ...]]:
    document = (Entry("document", key, "text", text, show) for key, text, show in _DOCUMENT)
    entries = (
        *document,
        *_machine_entries(),
        entry_of(SPEED),
        *map(entry_of, DRIVE_FIELDS),
        TORQUE_TABLE,
        START,
        *map(entry_of, LIMIT_FIELDS),
        *(entry_of(field) for fields in PASSING_FIELDS.values() for field in fields),
        *_load_entries(),
    )
    return {
        section: tuple(entry for entry in entries if entry.section == section)
        for section in SECTION_SENTENCES
    }


SECTIONS: Mapping[str, tuple[Entry, ...]] = _by_section()


# Keys by the names that their values have in Python, where these are others.
NAMED_IN_PYTHON = {
    entry.field.name: entry.key
    for entries in SECTIONS.values()
    for entry in entries
    if entry.field is not None and entry.kind != "each"
}


def sections_within(section: str) -> tuple[str, ...]:
    """Keys under which other sections stand within one, as "start" within "limits"."""
    return tuple(name[len(section) + 1 :] for name in SECTIONS if name.startswith(f"{section}."))


def refuse_unknown(table: Mapping[str, object], known: Iterable[str], *, place: str) -> None:
    """Raise InputError for the first key that is not known, with the nearest that is.

    ``place`` stands before the key in the sentence; it is empty for the sections themselves.
    """
    known = tuple(known)
    for key, value in table.items():
        if key not in known:
            own = [NAMED_IN_PYTHON[key]] if NAMED_IN_PYTHON.get(key) in known else []
            near = own or difflib.get_close_matches(key, known, n=1, cutoff=0.5)
            hint = f"did you mean {near[0]!r}" if near else f"choose one of {_listed(known)}"
            label, shown = (place + key, value) if place else ("section", f"[{key}]")
            raise InputError(label, shown, f"this name is not known, {hint}")


def _listed(names: Sequence[str]) -> str:
    """Names, of very many the first ones."""
    if len(names) <= MOST_LISTED:
        return ", ".join(names)
    return f"{', '.join(names[:MOST_LISTED])} and {len(names) - MOST_LISTED} more"


def toml(value: object) -> str:
    """A value as a file has it: TOML writes text, numbers and lists as JSON does."""
    return json.dumps(value, ensure_ascii=False)
