"""How the response changes with one parameter of a machine: curves, peaks, region."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from flipflow.compiled.arrays import Real
from flipflow.continuation.branch import Branch, SpecialPoint
from flipflow.continuation.frequency_response import frequency_response
from flipflow.errors import IncompleteError, InputError
from flipflow.model.arguments import checked_interval, checked_reals, checked_word, refuse_pair
from flipflow.model.fields import FIELD
from flipflow.model.parameters import named_parameter, with_values
from flipflow.model.quantities import leading_coordinate
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.system import Coordinate, Machine, system_of
from flipflow.periodic.options import Method
from flipflow.results.result import Frozen, Result
from flipflow.studies.landmarks import Landmarks, analysed_range, landmarks
from flipflow.studies.loading import amplitude_from_below, amplitudes_from_below

FREQUENCIES = 9  # equally spaced speeds of the common region at which members are compared


@dataclass(frozen=True, eq=False)
class Member(Frozen):
    """One machine of a family.

    Parameters
    ----------
    value
        The field's value, SI.
    machine
        The machine with this value.
    branch
        Motions over speed, with their special points.
    marks
        Characteristic frequencies and operating region; None for a failed row.
    failure
        Why the row failed; empty where it did not.
    """

    value: float
    machine: Machine
    branch: Branch
    marks: Landmarks | None
    failure: str = ""

    @property
    def screen(self) -> Machine:
        """The machine, by the name it has where it is a screen."""
        return self.machine

    @cached_property
    def main_peaks(self) -> tuple[SpecialPoint, ...]:
        """Resonances of the driven mass, rising in speed; of a screen w01 and w02.

        That is the main frame of a screen, the leading coordinate of any other machine.
        """
        return () if self.failure else self.branch.peaks(self._driven)

    @cached_property
    def relative_peak(self) -> SpecialPoint | None:
        """The largest motion of the leading coordinate, the relative one of a screen."""
        return None if self.failure else self.branch.peak(self._leading)

    @cached_property
    def antiresonance(self) -> SpecialPoint | None:
        """Where the driven mass moves least between its first and its last resonance."""
        if len(self.main_peaks) < 2:
            return None
        first, last = self.main_peaks[0].position, self.main_peaks[-1].position
        feet = [t for t in self.branch.troughs(self._driven) if first < t.position < last]
        return min(feet, key=lambda t: t.amplitude(self._driven), default=None)

    def relative_amplitude(self, omega: float) -> float:
        """Amplitude in m of the leading coordinate as the speed rises slowly.

        NaN without a motion, and where it is unstable.
        """
        return math.nan if self.failure else amplitude_from_below(self.branch, omega, self._leading)

    @property
    def _leading(self) -> Coordinate:
        return leading_coordinate(self.branch.system)

    @property
    def _driven(self) -> Coordinate:
        return "main" if isinstance(self.machine, FlipFlowScreen) else self._leading

    @property
    def zone(self) -> float:
        """Width in rad/s of the zone of several solutions, w_ub - w_lb.

        0 without folds; NaN for a failed row.
        """
        if self.marks is None:
            return math.nan
        if self.marks.omega_lb is None or self.marks.omega_ub is None:
            return 0.0
        return self.marks.omega_ub - self.marks.omega_lb


@dataclass(frozen=True, eq=False)
class ResponseFamily(Frozen, Result):
    """Responses of machines that differ in one field; returned by ``response_family``.

    Parameters
    ----------
    machine
        The machine they come from.
    field
        Name of the field.
    members
        One for each value, in the order given.
    """

    machine: Machine
    field: str
    members: tuple[Member, ...]

    def __repr__(self) -> str:
        span = f"{self.values.min():.6g} to {self.values.max():.6g}"
        return f"ResponseFamily({self.field}: {len(self.members)} values, {span})"

    @property
    def screen(self) -> Machine:
        """The machine, by the name it has where it is a screen."""
        return self.machine

    @property
    def values(self) -> Real:
        """The field's values, SI, (n,)."""
        return np.array([member.value for member in self.members])

    @cached_property
    def common_region(self) -> tuple[float, float] | None:
        """Speeds in rad/s in the operating region of every member that did not fail, or None."""
        marks = [member.marks for member in self.members if member.marks is not None]
        if not marks:
            return None
        low, high = max(one.lower for one in marks), min(one.upper for one in marks)
        return (low, high) if low < high else None

    @cached_property
    def common_frequencies(self) -> Real:
        """Equally spaced speeds of the common region in rad/s, ends included, (n_omega,)."""
        if self.common_region is None:
            return np.zeros(0)
        return np.linspace(*self.common_region, FREQUENCIES)

    @cached_property
    def relative_amplitude(self) -> Real:
        """Relative amplitude in m at the common frequencies, (n, n_omega); NaN where not known.

        Of a machine that is no screen, the amplitude of its leading coordinate.
        """
        speeds = self.common_frequencies
        return np.array(
            [
                np.full(speeds.size, np.nan)
                if member.failure
                else amplitudes_from_below(
                    member.branch, speeds, leading_coordinate(member.branch.system)
                )
                for member in self.members
            ]
        )

    def table(self) -> dict[str, list[float | str | None]]:
        """Peaks, folds, region and amplitude against the field, SI, one entry for each member.

        Columns: the field; ``first_peak_omega``, ``first_peak_main``, ``second_peak_omega``,
        ``second_peak_main`` of the main frame; ``relative_peak_omega``, ``relative_peak``;
        ``omega_cs``, ``omega_lb``, ``omega_ub``, ``zone``; ``lower``, ``upper`` of the operating
        region; ``relative_at_lower``, ``relative_at_middle``, ``relative_at_upper`` at the ends
        and the middle of the common region; ``failure``.

        Of a machine that is no screen ``peak_frequency`` and ``peak_amplitude`` of the leading
        coordinate stand for all peaks, and ``amplitude_at_lower`` and so on for the last ones.
        """
        rows = [self._row(k, member) for k, member in enumerate(self.members)]
        return {name: [row[name] for row in rows] for name in rows[0]}

    def _row(self, k: int, member: Member) -> dict[str, float | str | None]:
        marks, of_screen = member.marks, isinstance(self.machine, FlipFlowScreen)
        names = ("omega_cs", "omega_lb", "omega_ub", "lower", "upper")
        row: dict[str, float | str | None] = {self.field: member.value}
        row |= _peaks_of_screen(member) if of_screen else _peak_of_machine(member)
        row |= {name: None if marks is None else getattr(marks, name) for name in names}
        row["zone"] = member.zone
        what = "relative" if of_screen else "amplitude"
        for place, at in (("lower", 0), ("middle", FREQUENCIES // 2), ("upper", -1)):
            known = self.common_frequencies.size > 0
            row[f"{what}_at_{place}"] = float(self.relative_amplitude[k, at]) if known else None
        return row | {"failure": member.failure}


def _peaks_of_screen(member: Member) -> dict[str, float | str | None]:
    peaks, top = member.main_peaks, member.relative_peak
    first = peaks[0] if len(peaks) > 1 else None
    last = peaks[-1] if len(peaks) > 1 else None
    return {
        "first_peak_omega": None if first is None else first.omega,
        "first_peak_main": None if first is None else first.amplitude("main"),
        "second_peak_omega": None if last is None else last.omega,
        "second_peak_main": None if last is None else last.amplitude("main"),
        "relative_peak_omega": None if top is None else top.omega,
        "relative_peak": None if top is None else top.amplitude("relative"),
    }


def _peak_of_machine(member: Member) -> dict[str, float | str | None]:
    top = member.relative_peak
    if top is None:
        return {"peak_frequency": None, "peak_amplitude": None}
    which = leading_coordinate(member.branch.system)
    return {"peak_frequency": top.omega, "peak_amplitude": top.amplitude(which)}


def response_family(
    screen: Machine,
    vary: Mapping[str, ArrayLike],
    *,
    omega: tuple[float, float] | None = None,
    method: Method | None = None,
) -> ResponseFamily:
    """Follow the response over speed for several values of one field.

    Parameters
    ----------
    screen
        The machine whose other fields are kept: a screen, any frozen dataclass with
        ``.system()``, or a :class:`~flipflow.MechanicalSystem`.
    vary
        One field and its values, SI: ``{"clearance": [2e-3, 4e-3]}``; a place in a plain system,
        ``{"springs[0].clearance": [2e-3, 4e-3]}``, or ``"forcing"``, a factor on its excitation.
    omega
        Speeds (low, high) in rad/s; None: wide enough for every member.
    method
        :class:`~flipflow.PiecewiseExact` (default) or :class:`~flipflow.HarmonicBalance`.

    Returns
    -------
    ResponseFamily
        One member for each value; one whose branch could not be finished is marked as failed.

    Raises
    ------
    InputError
        For what is no machine, for other than one of its fields, which are told then, and for a
        value that physics forbids.
    """
    system_of(screen)
    field, values = _one_field(vary, screen)
    machines = [with_values(screen, {field: float(value)}) for value in values]
    spans = [analysed_range(one) for one in machines]
    wide = (min(low for low, _ in spans), max(high for _, high in spans))
    interval = wide if omega is None else checked_interval("omega", omega)
    members = tuple(
        _member(float(value), one, frequency_response(one, interval, method))
        for value, one in zip(values, machines, strict=True)
    )
    return ResponseFamily(screen, field, members)


def _one_field(vary: Mapping[str, ArrayLike], machine: Machine) -> tuple[str, Real]:
    if not isinstance(vary, Mapping) or len(vary) != 1:
        remedy = 'name one field and its values, as {"clearance": [5e-3, 6e-3]}'
        raise InputError("vary", vary, remedy)
    ((field, values),) = vary.items()
    if isinstance(machine, FlipFlowScreen):
        checked_word("vary", field, FIELD)
    else:
        named_parameter(machine, field, "vary")
    name = f"vary[{field!r}]"
    refuse_pair(name, values)
    array = np.atleast_1d(checked_reals(name, values, "give numbers in SI"))
    if array.ndim != 1 or array.size == 0:
        raise InputError(name, values, "give a list of values")
    return field, array


def _member(value: float, machine: Machine, branch: Branch) -> Member:
    if not branch.complete:
        return Member(value, machine, branch, None, branch.status.value)
    try:
        return Member(value, machine, branch, landmarks(machine, branch))
    except IncompleteError as error:
        return Member(value, machine, branch, None, str(error))
