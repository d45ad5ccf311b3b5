"""What a machine file says, in SI, what follows from it, and what it leaves open."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from flipflow.io.derived import Derived, derive
from flipflow.io.layout import SECTIONS, SPEED, Entry, unchecked_without
from flipflow.io.units import in_unit
from flipflow.io.values import read_interval, read_number
from flipflow.model.fields import FIELD, FIELDS
from flipflow.model.limits import LIMIT_FIELDS
from flipflow.model.project import Project
from flipflow.model.quantities import QUANTITIES, needing
from flipflow.model.screen import WarmedLoad, of_air


@dataclass(frozen=True)
class Value:
    """One value of the file: as written, in SI (least and greatest for an interval), its source."""

    key: str
    symbol: str
    written: str
    si: tuple[float, ...]
    unit: str
    source: str


@dataclass(frozen=True)
class Speed:
    """A speed that follows from the values, rad/s first."""

    name: str
    meaning: str
    rad_s: float
    hz: float
    rpm: float


@dataclass(frozen=True)
class Case:
    """What a load case does to the machine at work.

    ``temperature`` is the one that the file gives; where it is the air's, ``rubber`` is that at
    which the rubber settles at working speed, None where it is not known.
    """

    name: str
    stiffness_factor: float
    damping_factor: float
    main_mass: float
    floating_mass: float
    temperature: float | None
    source: str
    stop_stiffness_factor: float = 1.0
    stop_damping_factor: float = 1.0
    temperature_of: str = "rubber"
    rubber: float | None = None


@dataclass(frozen=True)
class Gap:
    """What is missing, and what cannot be checked because of it."""

    missing: str
    disables: str


@dataclass(frozen=True)
class Check:
    """The outcome of :func:`check_project`; every part is plain data."""

    name: str
    values: tuple[Value, ...]
    sums: Mapping[str, str]
    speeds: tuple[Speed, ...]
    static_amplitude: float
    damping_ratios: Mapping[str, float]
    load_cases: tuple[Case, ...]
    assumed: tuple[str, ...]
    missing: tuple[Gap, ...]
    warnings: tuple[str, ...]
    notes: tuple[str, ...] = ()


def check_project(project: Project, warmed: Sequence[WarmedLoad] | None = None) -> Check:
    """Collect what a machine file says and leaves open.

    Parameters
    ----------
    project
        A loaded machine file.
    warmed
        Its load cases with the temperature of the rubber; None: it is found at working speed.

    Returns
    -------
    Check
        Values as written and in SI, sums of pieces, derived speeds, load cases, what was assumed
        and what is missing.
    """
    derived = derive(project.screen)
    loads = _warmed(project) if warmed is None else warmed
    return Check(
        name=project.document.name,
        values=tuple(_values(project)),
        sums=dict(project.sums),
        speeds=tuple(_speeds(project, derived)),
        static_amplitude=derived.static_amplitude,
        damping_ratios=derived.damping_ratios,
        load_cases=tuple(_cases(project, loads)),
        assumed=project.assumed,
        missing=tuple(_missing(project)),
        warnings=project.warnings,
        notes=tuple(one.note for one in loads if one.note),
    )


def _values(project: Project) -> Iterator[Value]:
    for section, entries in SECTIONS.items():
        for entry in entries:
            if entry.label in project.written:
                source = project.sources.get(entry.label, project.sources.get(section, ""))
                yield _value(entry, project.written[entry.label], source)


def _value(entry: Entry, written: object, source: str) -> Value:
    field = entry.field
    if field is None:
        return Value(entry.label, "", _shown(written), (), "", source)
    if entry.kind == "interval":
        si: tuple[float, ...] = read_interval(written, field)
    else:
        si = (read_number(written, field),)
    symbol = f"{field.symbol} each" if entry.kind == "each" else field.symbol
    return Value(entry.label, symbol, _shown(written), si, field.unit, source)


def _shown(written: object) -> str:
    if not isinstance(written, list):
        return str(written)
    if written and isinstance(written[0], list):
        return ", ".join(f"{factor} at {temperature}" for temperature, factor in written)
    return " to ".join(map(str, written))


def _speeds(project: Project, derived: Derived) -> Iterator[Speed]:
    low, high = derived.natural_frequencies
    rows = (
        ("w01", "first natural frequency", low),
        ("w02", "second natural frequency", high),
        ("w_ea", "both frames swing alike", derived.omega_ea),
        ("w_ar", "antiresonance of the main frame", derived.omega_ar),
        (SPEED.symbol, "operating speed", project.speed),
    )
    for name, meaning, omega in rows:
        if omega is not None:
            hz, rpm = (in_unit(omega, unit, "rad/s") for unit in ("Hz", "rpm"))
            yield Speed(name, meaning, omega, hz, rpm)


def _warmed(project: Project) -> Sequence[WarmedLoad]:
    if not any(map(of_air, project.load_cases)):
        return [WarmedLoad(load) for load in project.load_cases]
    from flipflow.studies.rubber_temperature import warmed_load  # noqa: PLC0415  slow to import

    return [warmed_load(project.screen, load, project.speed) for load in project.load_cases]


def _cases(project: Project, loads: Sequence[WarmedLoad]) -> Iterator[Case]:
    screen, sources = project.screen, project.sources
    for load, warmed in zip(project.load_cases, loads, strict=True):
        held = warmed.load.temperature
        yield Case(
            name=load.name,
            stiffness_factor=load.stiffness_factor * screen.temperature_stiffness_factor(held),
            damping_factor=load.damping_factor,
            main_mass=load.main_mass,
            floating_mass=load.floating_mass,
            temperature=load.temperature,
            source=sources.get(f"load_cases.{load.name}", sources.get("load_cases", "")),
            stop_stiffness_factor=load.stop_stiffness_factor
            * screen.stop_temperature_stiffness_factor(held),
            stop_damping_factor=load.stop_damping_factor,
            temperature_of=load.temperature_of,
            rubber=warmed.rubber,
        )


def _missing(project: Project) -> Iterator[Gap]:
    """What is left out and what falls away with it; what only stops need, where there are any."""
    screen = project.screen
    for field in FIELDS:
        idle = not screen.has_stop and all(one.of_stops for one in needing(field.name))
        if getattr(screen, field.name) is None and not idle and (lost := unchecked_without(field)):
            yield Gap(field.key, lost)
    if project.speed is None:
        yield Gap(SPEED.key, unchecked_without(SPEED))
    for limit in LIMIT_FIELDS:
        quantity = QUANTITIES[limit.name]
        if getattr(project.limits, limit.name) is None:
            if screen.has_stop or not quantity.of_stops:
                yield Gap(limit.key, "this limit")
        elif lacking := [FIELD[name].key for name in quantity.missing(screen)]:
            yield Gap(", ".join(lacking), limit.key)
    dampers = (screen.isolation_damping, screen.shear_damping)
    if math.isclose(sum(dampers), 0.0):
        yield Gap("isolation.damping, shear_springs.damping", "steady states: nothing settles")
