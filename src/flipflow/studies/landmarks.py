"""Landmarks of a machine's response over speed: what is asked of the response as a whole."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from flipflow.continuation.branch import Branch, SpecialPoint
from flipflow.continuation.frequency_response import frequency_response
from flipflow.continuation.special_points import CONTACT_BEGIN
from flipflow.dynamics.linear_response import (
    antiresonance_frequency,
    bonded_natural_frequencies,
    equal_amplitude_frequency,
    linear_response,
)
from flipflow.errors import IncompleteError
from flipflow.model.quantities import leading_coordinate
from flipflow.model.system import Machine
from flipflow.results.result import Frozen

LOWEST_SHARE = 0.22  # lower end of the range over the first natural frequency
HIGHEST_SHARE = 1.155  # upper end over the highest natural frequency with all stops engaged


BEGINS_TOUCHED = "Contact begins below the speeds analysed: the region starts with them."
ENDS_TOUCHED = (
    "The stop is still touched at the highest speed analysed: if the machine jumps beyond it, the "
    "region ends at a lower speed, that of the jump as the speed falls."
)


def analysed_range(machine: Machine, speed: float | None = None) -> tuple[float, float]:
    """From well below the first natural frequency to well above the last with stops engaged.

    A working speed in rad/s that lies outside widens the range.
    """
    low = LOWEST_SHARE * float(linear_response(machine, 1.0).natural_frequencies[0])
    high = HIGHEST_SHARE * float(bonded_natural_frequencies(machine)[-1])
    if speed is None:
        return low, high
    return min(low, 0.9 * speed), max(high, 1.1 * speed)


def contact_speeds(branch: Branch, omega_cs: float | None) -> dict[int, float]:
    """Where each side's contact begins, rad/s, by side: the last rising one up to ``omega_cs``."""
    begins = branch.points_of(CONTACT_BEGIN)
    last = max((point.position for point in begins if point.omega == omega_cs), default=-1.0)
    return {point.side: point.omega for point in begins if point.position <= last}


@dataclass(frozen=True)
class Landmarks:
    """Characteristic frequencies of a machine and its operating region, all in rad/s.

    Parameters
    ----------
    omega_ea, omega_ar
        w_ea and w_ar: equal amplitudes, antiresonance of the main frame; None for a machine that
        is no screen.
    omega_cs
        w_cs: contact begins, the last rising one before the main peak; None if it never does.
    omega_lb, omega_ub
        The two saddle-nodes of the main resonance; None without folds.
    lower, upper
        The paper's operating region: [w_cs, w_lb] with a stop that is reached (without folds up
        to the peak of the relative amplitude), else [w_ea, w_ar]; all speeds analysed where a
        machine that is no screen reaches no stop.
    notes
        What is to be kept in mind.
    """

    omega_ea: float | None
    omega_ar: float | None
    omega_cs: float | None
    omega_lb: float | None
    omega_ub: float | None
    lower: float
    upper: float
    notes: tuple[str, ...] = ()


def landmarks(machine: Machine, branch: Branch) -> Landmarks:
    """Read w_ea, w_ar, w_cs, w_lb, w_ub and the region between them off a machine's branch.

    Of a machine that is no screen the leading coordinate stands for the relative motion.

    Raises
    ------
    IncompleteError
        When the branch has no points.
    """
    ea, ar = equal_amplitude_frequency(machine), antiresonance_frequency(machine)
    works = bool(machine.system().opening)
    peak = _main_peak(branch, ar)
    touched = peak.orbit.touches and works
    begins = [p.omega for p in branch.points_of(CONTACT_BEGIN) if p.position < peak.position]
    cs = begins[-1] if begins and touched else None
    lb, ub = _main_folds(branch, peak)
    span = (float(branch.omega.min()), float(branch.omega.max()))
    upper = peak.omega if lb is None else lb
    if touched:
        lowest = span[0] if cs is None else cs
        return Landmarks(ea, ar, cs, lb, ub, lowest, upper, (BEGINS_TOUCHED,) if cs is None else ())
    notes = tuple(_untouched_notes(branch)) if works else ()
    lower, upper = ea or span[0], ar or span[1]
    if lower >= upper:
        notes += ("Equal amplitudes come above the antiresonance: the region is empty.",)
    return Landmarks(ea, ar, cs, lb, ub, lower, upper, notes)


def within_speeds(machine: Machine, branch: Branch) -> Landmarks:
    """Landmarks of a branch over speeds that somebody chose, which may cut the region."""
    marks, last = landmarks(machine, branch), int(np.argmax(branch.omega))
    early = float(branch.omega[last]) < analysed_range(machine)[1]
    if not early or marks.omega_lb is not None or branch.traced.signature[last] == 0:
        return marks
    return replace(marks, notes=(*marks.notes, ENDS_TOUCHED))


def _untouched_notes(branch: Branch) -> Iterator[str]:
    """What to say of a stop that is not reached where it shall work."""
    if np.any(branch.traced.signature != 0):
        yield (
            "The stop is not reached at the main resonance, only elsewhere: the region is that of "
            "a machine without stop."
        )
    else:
        yield "The stop is not reached at any speed analysed."


def _main_peak(branch: Branch, antiresonance: float | None) -> SpecialPoint:
    """The largest relative motion above the antiresonance, which parts the two resonances."""
    which = leading_coordinate(branch.system)
    peak = branch.peak(which)
    if antiresonance is None or peak.omega >= antiresonance:
        return peak
    higher = [one for one in branch.peaks(which) if one.omega >= antiresonance]
    return max(higher, key=lambda one: one.amplitude(which), default=peak)


def _main_folds(branch: Branch, peak: SpecialPoint) -> tuple[float | None, float | None]:
    """(w_lb, w_ub): the first two folds on the way down from the main peak.

    A fold beyond a trough belongs to another resonance, as do those before the peak.
    """
    which = leading_coordinate(branch.system)
    size = branch.amplitude(which)
    for first, second in pairwise(branch.folds):
        # A peak and the fold beside it may stand in one step of the branch.
        if first.position <= peak.position - 1.0:
            continue
        way = size[math.ceil(peak.position) : math.floor(first.position) + 1]
        if np.any(way < first.amplitude(which)):
            break
        return min(first.omega, second.omega), max(first.omega, second.omega)
    return None, None


@dataclass(frozen=True, eq=False)
class Response(Frozen):
    """A machine over an interval of speed; its branch is followed when first asked for.

    Parameters
    ----------
    machine
        The machine; a screen as loaded.
    span
        The interval (low, high) in rad/s.
    """

    machine: Machine
    span: tuple[float, float]

    @cached_property
    def branch(self) -> Branch:
        """Its motions over the interval.

        Raises
        ------
        IncompleteError
            When the branch could not be followed to the end of the interval.
        """
        branch = frequency_response(self.machine, self.span)
        if not branch.complete:
            raise IncompleteError(branch.status.value)
        return branch

    @cached_property
    def peak(self) -> SpecialPoint:
        """The motion of the largest amplitude of the leading coordinate."""
        return self.branch.peak(leading_coordinate(self.branch.system))

    @cached_property
    def marks(self) -> Landmarks:
        """The landmarks of the branch."""
        return landmarks(self.machine, self.branch)


RESPONSE_VALUES: Mapping[str, Callable[[Response], float | None]] = {
    "peak_amplitude": lambda r: r.peak.amplitude(leading_coordinate(r.branch.system)),
    "peak_frequency": lambda r: r.peak.omega,
    "omega_ea": lambda r: equal_amplitude_frequency(r.machine),
    "omega_ar": lambda r: antiresonance_frequency(r.machine),
    "omega_cs": lambda r: r.marks.omega_cs,
    "omega_lb": lambda r: r.marks.omega_lb,
    "omega_ub": lambda r: r.marks.omega_ub,
}
"""The quantities of a whole response, SI; None where the response has none."""
