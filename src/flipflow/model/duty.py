"""A duty: what a machine is to do, under which loads and scatter, and what may be chosen for it."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.errors import InputError
from flipflow.model.arguments import (
    checked_all,
    checked_count,
    checked_interval,
    checked_kind,
    checked_mapping,
    checked_number,
    checked_pair,
    checked_positive,
    checked_speed,
    checked_text,
    checked_word,
    members_of,
)
from flipflow.model.fields import FIELD
from flipflow.model.limits import Limits
from flipflow.model.project import Project
from flipflow.model.screen import Load
from flipflow.model.vary import LAW, Choice, Distribution, Interval, Variation, variations

Objective = Literal["steadiness", "acceleration", "stop force", "foundation force", "power"]
OBJECTIVES: tuple[Objective, ...] = get_args(Objective)
LEAST_GAP = 1e-3  # m: beneath it rubber that creeps or grows in the heat closes a gap by itself
LEAST_SHARE = 0.3  # of the machine's own shear stiffness: beneath it the stops carry the frame
MOST_SCATTER = 0.5
MOST_PIECES = 1000


@dataclass(frozen=True, kw_only=True)
class SpringType:
    """A shear spring of a catalogue.

    Parameters
    ----------
    name
        What the maker calls it.
    stiffness
        Dynamic stiffness of one in N/m.
    loss_factor
        Share of the stiffness that its damping is at the working speed: c = loss k / omega.
    height
        Rubber height in m; None where the catalogue does not tell.
    strain, force
        Greatest strain, a ratio, and greatest dynamic force in N of one; None: not limited.
    price
        Of one, in the catalogue's money; None where it is not told.
    """

    name: str
    stiffness: float
    loss_factor: float
    height: float | None = None
    strain: float | None = None
    force: float | None = None
    price: float | None = None

    def __post_init__(self) -> None:
        checked_text("name", self.name)
        for name in ("stiffness", "loss_factor", "height", "strain", "force"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, checked_positive(name, value))
        if self.price is not None:
            object.__setattr__(self, "price", checked_number("price", self.price))


@dataclass(frozen=True, kw_only=True)
class Duty:
    """What is asked of a machine.

    Parameters
    ----------
    project
        The machine to begin with, its load cases, limits and drive.
    target, tolerance
        Relative amplitude in m, and how far it may lie from it in any case.
    speed
        (least, greatest) working speed in rad/s; equal for one speed.
    free
        Fields that may be chosen: an interval (low, high), or ``ff.Choice`` of values.
    load_cases
        The loads; those of the machine file where none are given. Under one that gives the air's
        temperature, each candidate's rubber is as warm as its own work keeps it.
    temperatures
        Temperatures of the rubber in degrees Celsius with which every load case is combined.
    scatter
        By field, the share of its value within which built parts lie: 0.15 is +-15 %.
    limits
        What the machine may do; those of the machine file where none are given.
    catalogue, pieces
        Shear springs to choose from, and how many of them (from, to).
    prefer
        What comes first among machines that do the duty, most important first.
    seed
        Of the search.
    name
        What reports call it.

    Raises
    ------
    InputError
        For a duty that contradicts itself.
    """

    project: Project
    target: float
    tolerance: float
    speed: tuple[float, float]
    free: Mapping[str, Distribution | tuple[float, float]]
    load_cases: tuple[Load, ...] = ()
    temperatures: tuple[float, ...] = ()
    scatter: Mapping[str, float] = field(default_factory=dict)
    limits: Limits | None = None
    catalogue: tuple[SpringType, ...] = ()
    pieces: tuple[int, int] = (4, 40)
    prefer: tuple[Objective, ...] = OBJECTIVES
    seed: int = 0
    name: str = "duty"

    def __post_init__(self) -> None:
        checked_kind("project", self.project, Project, 'give ff.load_project("machine.toml")')
        for name in ("target", "tolerance"):
            object.__setattr__(self, name, checked_positive(name, getattr(self, name), "m"))
        object.__setattr__(self, "speed", self._checked_speed())
        checked_mapping("free", self.free, 'give {"clearance": (2e-3, 9e-3)}')
        loads = checked_all("load_cases", self.load_cases, Load, "give a tuple of ff.Load")
        object.__setattr__(self, "load_cases", loads or self.project.load_cases)
        self._take_temperatures()
        checked_kind("limits", self.limits, (Limits, type(None)), "give an ff.Limits")
        springs = checked_all("catalogue", self.catalogue, SpringType, "give ff.SpringType entries")
        object.__setattr__(self, "catalogue", springs)
        self._take_preference()
        checked_text("name", self.name)
        object.__setattr__(self, "seed", checked_count("seed", self.seed, 2**31 - 1, least=0))
        self._check_scatter()
        self._check_free()

    def _checked_speed(self) -> tuple[float, float]:
        low, high = checked_pair("speed", self.speed, "give (least, greatest) in rad/s")
        if low == high:
            return (checked_speed(low, "speed"),) * 2
        return checked_interval("speed", (low, high))

    def _take_temperatures(self) -> None:
        remedy = "give temperatures in degrees Celsius, (-10.0, 50.0)"
        members = members_of(self.temperatures)
        if members is None:
            raise InputError("temperatures", self.temperatures, remedy)
        degrees = tuple(checked_number("temperatures", one, remedy) for one in members)
        object.__setattr__(self, "temperatures", degrees)
        for load in self.loads if degrees else ():
            self.project.screen.loaded(load)

    def _take_preference(self) -> None:
        members = members_of(self.prefer)
        if not members:
            raise InputError("prefer", self.prefer, f"list some of {', '.join(OBJECTIVES)}")
        words = tuple(checked_word("prefer", one, OBJECTIVES) for one in members)
        object.__setattr__(self, "prefer", words)

    def _check_scatter(self) -> None:
        checked_mapping("scatter", self.scatter, 'give {"shear_stiffness": 0.15}')
        for name, share in self.scatter.items():
            checked_word("scatter", name, tuple(FIELD))
            if not 0.0 < checked_number(f"scatter {name}", share) <= MOST_SCATTER:
                remedy = f"give a share above 0 and up to {MOST_SCATTER:g}, 0.15 for +-15 %"
                raise InputError(f"scatter {name}", share, remedy)

    def _check_free(self) -> None:
        if not self.free and not self.catalogue:
            raise InputError("free", self.free, "say what may be chosen, clearance for example")
        if self.catalogue and "shear_stiffness" in self.free:
            remedy = "the catalogue gives the shear springs; leave it out of what is free"
            raise InputError("free", "shear_stiffness", remedy)
        if self.catalogue:
            self._take_pieces()
        for one in self.varied:
            self._check_least(one.name, one.distribution.ends[0])

    def _take_pieces(self) -> None:
        members = members_of(self.pieces) or ()
        if len(members) != 2:
            raise InputError("pieces", self.pieces, "give (from, to), (8, 16) for example")
        low, high = (checked_count("pieces", one, MOST_PIECES) for one in members)
        if low > high:
            raise InputError("pieces", self.pieces, "give (from, to), the lesser first")
        object.__setattr__(self, "pieces", (low, high))

    def _check_least(self, name: str, low: object) -> None:
        """Refuse what makes a machine steady on paper alone."""
        value, least = float(str(low)), LEAST_SHARE * self.project.screen.shear_stiffness
        if name in ("clearance", "clearance_minus") and value < LEAST_GAP:
            least_gap = f"{1e3 * LEAST_GAP:g} mm"
            remedy = f"begin at {least_gap}: creep and heat of the rubber close a lesser gap"
            raise InputError(f"free {name}", low, remedy)
        if name == "shear_stiffness" and value < least:
            remedy = (
                f"begin at {least:.4g} N/m, {LEAST_SHARE:g} of the machine's own: below it the "
                "stops, which wear, carry the frame"
            )
            raise InputError(f"free {name}", low, remedy)

    @property
    def varied(self) -> tuple[Variation, ...]:
        """The free fields, checked against the machine."""
        if not self.free:
            return ()
        found = variations(self.free, self.project.screen)
        for one in found:
            if not isinstance(one.distribution, (Interval, Choice)) or one.name == LAW:
                remedy = "give numbers to choose from, (low, high) or ff.Choice(values)"
                raise InputError(f"free {one.name}", self.free[one.name], remedy)
        return found

    @property
    def bounds(self) -> Limits:
        """What the machine may do; its relative amplitude is what the duty says."""
        limits = self.project.limits if self.limits is None else self.limits
        least = max(self.target - self.tolerance, 0.0)
        return replace(limits, relative_amplitude=(least, self.target + self.tolerance))

    @property
    def loads(self) -> tuple[Load, ...]:
        """Every load case at every temperature."""
        if not self.temperatures:
            return self.load_cases
        return tuple(
            replace(
                load,
                temperature=degrees,
                temperature_of="rubber",
                name=f"{load.name or 'empty'}, {degrees:g} degC",
            )
            for load, degrees in itertools.product(self.load_cases, self.temperatures)
        )

    @property
    def corners(self) -> tuple[Mapping[str, float], ...]:
        """Factors on the scattered fields: the drawing, then every corner of the scatter."""
        ends = [(1.0 - share, 1.0 + share) for share in self.scatter.values()]
        corners = itertools.product(*ends) if ends else ()
        none = dict.fromkeys(self.scatter, 1.0)
        return (none, *(dict(zip(self.scatter, corner, strict=True)) for corner in corners))

    @property
    def ends(self) -> tuple[Mapping[str, float], ...]:
        """Factors with all parts at the least, and at the greatest, of theirs; none: no scatter."""
        return (self.corners[1], self.corners[-1]) if self.scatter else ()

    @property
    def speeds(self) -> Real:
        """Speeds in rad/s at which the duty is judged: one, or both ends and the middle, (F,)."""
        low, high = self.speed
        return np.array([low]) if low == high else np.linspace(low, high, 3)
