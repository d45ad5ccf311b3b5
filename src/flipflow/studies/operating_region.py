"""Where a screen may run: the paper's region, and the window in which all limits are met."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
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
from flipflow.errors import InputError
from flipflow.model.arguments import checked_all, checked_interval, checked_monitor
from flipflow.model.limits import Limits
from flipflow.model.monitor import Monitor
from flipflow.model.screen import FlipFlowScreen, Load
from flipflow.periodic.options import Method, checked_method
from flipflow.studies.feasible import Bound, CaseWindow, Intervals, case_window, common_window
from flipflow.studies.quantities import QUANTITIES

LOWEST_SHARE, HIGHEST_SHARE = 0.22, 1.155
MAIN_SHARE = 0.25  # of the peak: folds of smaller motions are not those of the main resonance
CONTACT_WORDS, EQUAL_WORDS = "contact begins (w_cs)", "equal amplitudes (w_ea)"
JUMP_WORDS = "jump when the speed falls (w_lb)"
ANTIRESONANCE_WORDS = "antiresonance of the main frame (w_ar)"
PEAK_WORDS = "peak of the relative amplitude"


@dataclass(frozen=True, eq=False)
class OperatingRegion:
    """Characteristic frequencies of a screen and where it may run; all in rad/s.

    Parameters
    ----------
    screen
        The empty machine.
    branch
        Its motions over :func:`analysed_range`.
    omega_ea, omega_ar
        w_ea and w_ar: equal amplitudes, antiresonance of the main frame.
    omega_cs
        w_cs: contact begins, the last rising one before the main peak; None if it never does.
        With unequal gaps this is the side touched last: from there on both stops work.
        :attr:`contact_speeds` holds both sides.
    omega_lb, omega_ub
        The two saddle-nodes of the main resonance; None without folds.
    lower, upper
        The paper's operating region: [w_cs, w_lb] with a stop that is reached (without folds up
        to the peak of the relative amplitude), else [w_ea, w_ar].
    feasible
        Intervals of that region in which every limit is met in every load case.
    binding
        What ends each of them below and above.
    cases
        Per load case, the intervals of each limit by itself.
    branches
        Per load case, the motions.
    notes
        What was not checked, and why.
    """

    screen: FlipFlowScreen
    branch: Branch
    omega_ea: float | None
    omega_ar: float | None
    omega_cs: float | None
    omega_lb: float | None
    omega_ub: float | None
    lower: float
    upper: float
    feasible: Intervals
    binding: tuple[tuple[Bound, Bound], ...]
    cases: tuple[CaseWindow, ...]
    branches: tuple[Branch, ...]
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        ends = f"{self.lower:.6g} to {self.upper:.6g} rad/s"
        allowed = f"{len(self.feasible)} allowed intervals over {len(self.cases)} load cases"
        return f"OperatingRegion({ends}, {allowed})"

    @property
    def contact_speeds(self) -> Mapping[int, float]:
        """Where each side's contact begins, rad/s, by side: +1, -1.

        The last rising one up to ``omega_cs``. With equal gaps both sides begin together and only
        +1 is there; a side that is not touched up to ``omega_cs`` is left out.
        """
        begins = self.branch.points_of(CONTACT_BEGIN)
        last = max((p.position for p in begins if p.omega == self.omega_cs), default=-1.0)
        return {p.side: p.omega for p in begins if p.position <= last}

    @property
    def ends(self) -> tuple[str, str]:
        """Words for what ends the region below and above."""
        below = {self.omega_cs: CONTACT_WORDS, self.omega_ea: EQUAL_WORDS}
        above = {self.omega_lb: JUMP_WORDS, self.omega_ar: ANTIRESONANCE_WORDS}
        highest = float(self.branch.omega.max())
        return (
            below.get(self.lower, "lowest speed analysed"),
            above.get(
                self.upper, "highest speed analysed" if self.upper == highest else PEAK_WORDS
            ),
        )


def operating_region(
    screen: FlipFlowScreen,
    limits: Limits | None = None,
    load_cases: Sequence[Load] = (),
    monitor: Monitor | None = None,
    *,
    omega: tuple[float, float] | None = None,
    method: Method | None = None,
) -> OperatingRegion:
    """The operating region of a screen and its feasible window over all load cases.

    Parameters
    ----------
    screen
        The empty machine.
    limits
        What it may do; None or a limit at None does not narrow the window.
    load_cases
        Loads under which the limits must hold; the empty machine where none is given.
    monitor
        Called with a sentence and the share done, 0 to 1.
    omega
        Frequencies (low, high) in rad/s to analyse; None: from well below the first natural
        frequency to well above the last with all stops engaged.
    method
        :class:`~flipflow.PiecewiseExact` (default) or :class:`~flipflow.HarmonicBalance`.

    Raises
    ------
    InputError
        For anything but a screen, whose frames the region speaks of, limits and loads, and for a
        bad interval.
    """
    if not isinstance(screen, FlipFlowScreen):
        raise InputError("screen", type(screen).__name__, "give a FlipFlowScreen")
    if limits is not None and not isinstance(limits, Limits):
        raise InputError("limits", limits, "give an ff.Limits, or None for no limits")
    remedy = "give a list of ff.Load, such as [ff.Load()]"
    loads = checked_all("load_cases", load_cases, Load, remedy) or (Load(name="empty"),)
    say, method = checked_monitor(monitor), checked_method(method)
    span = analysed_range(screen) if omega is None else checked_interval("omega", omega)
    say("empty machine", 0.0)
    branch = frequency_response(screen, span, method)
    wanted = limits or Limits()
    window = wanted.speed if wanted.speed is not None else span
    within = (max(window[0], span[0]), min(window[1], span[1]))
    cases, branches = [], []
    for k, load in enumerate(loads):
        say(load.name or f"load case {k + 1}", (k + 1) / (len(loads) + 1))
        loaded = screen.loaded(load)
        own = branch if loaded == screen else frequency_response(loaded, span, method)
        branches.append(own)
        cases.append(case_window(loaded, load, own, wanted, within))
    marks = landmarks(screen, branch)
    feasible, binding = common_window((marks.lower, marks.upper), tuple(cases))
    notes = [*_unchecked_notes(cases)]
    if within[0] >= within[1]:
        notes.append("The limit on speed lies outside the speeds analysed.")
    named = zip(
        ("empty", *(case.name for case in cases)), (branch, *branches),
        ((), *(case.notes for case in cases)), strict=True,
    )  # fmt: skip
    unfinished = dict.fromkeys(
        f"Case {name}: {text}"
        for name, one, own_notes in named
        for text in (*one.notes, *own_notes, *([] if one.complete else [one.status.value]))
    )
    return OperatingRegion(
        screen, branch, marks.omega_ea, marks.omega_ar, marks.omega_cs, marks.omega_lb,
        marks.omega_ub, marks.lower, marks.upper, feasible, binding,
        tuple(cases), tuple(branches), (*notes, *unfinished, *marks.notes),
    )  # fmt: skip


def _unchecked_notes(cases: Sequence[CaseWindow]) -> Iterator[str]:
    """A sentence for each reason why limits are not checked, which names them all."""
    reasons: dict[str, dict[str, None]] = {}
    for case in cases:
        for name, why in case.unchecked.items():
            reasons.setdefault(why, {})[QUANTITIES[name].label] = None
    for why, labels in reasons.items():
        *others, last = labels
        named = f"limits on {', '.join(others)} and {last} are" if others else f"limit on {last} is"
        yield f"The {named} not checked: {why}."


def analysed_range(screen: FlipFlowScreen, speed: float | None = None) -> tuple[float, float]:
    """From well below the first natural frequency to well above the last with stops engaged.

    A working speed in rad/s that lies outside widens the range.
    """
    low = LOWEST_SHARE * float(linear_response(screen, 1.0).natural_frequencies[0])
    high = HIGHEST_SHARE * float(bonded_natural_frequencies(screen)[-1])
    if speed is None:
        return low, high
    return min(low, 0.9 * speed), max(high, 1.1 * speed)


@dataclass(frozen=True)
class Landmarks:
    """Characteristic frequencies of a screen and its operating region, all in rad/s.

    Parameters
    ----------
    omega_ea, omega_ar, omega_cs, omega_lb, omega_ub
        As in :class:`OperatingRegion`.
    lower, upper
        The paper's operating region.
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


def landmarks(screen: FlipFlowScreen, branch: Branch) -> Landmarks:
    """Read w_ea, w_ar, w_cs, w_lb, w_ub and the region between them off a screen's branch.

    Raises
    ------
    IncompleteError
        When the branch has no points.
    """
    ea, ar = equal_amplitude_frequency(screen), antiresonance_frequency(screen)
    works = screen.has_stop and not screen.stop().bonded
    peak = _main_peak(branch, ar)
    touched = peak.orbit.touches and works
    begins = [p.omega for p in branch.points_of(CONTACT_BEGIN) if p.position < peak.position]
    cs = begins[-1] if begins and touched else None
    lb, ub = _main_folds(branch, peak)
    span = (float(branch.omega.min()), float(branch.omega.max()))
    upper = peak.omega if lb is None else lb
    if cs is not None:
        return Landmarks(ea, ar, cs, lb, ub, cs, upper)
    if touched:
        note = "Contact begins below the speeds analysed: the region starts with them."
        return Landmarks(ea, ar, cs, lb, ub, span[0], upper, (note,))
    notes = tuple(_untouched_notes(branch)) if works else ()
    lower, upper = ea or span[0], ar or span[1]
    if lower >= upper:
        notes += ("Equal amplitudes come above the antiresonance: the region is empty.",)
    return Landmarks(ea, ar, cs, lb, ub, lower, upper, notes)


def _untouched_notes(branch: Branch) -> Iterator[str]:
    """What to say of a stop that is not reached where it shall work."""
    if np.any(branch.traced.signature != 0):
        yield (
            "The stop is not reached at the main resonance, only elsewhere: the region is that of "
            "a screen without stop."
        )
    else:
        yield "The stop is not reached at any speed analysed."


def _main_peak(branch: Branch, antiresonance: float | None) -> SpecialPoint:
    """The largest relative motion above the antiresonance, which parts the two resonances."""
    peak = branch.peak("relative")
    if antiresonance is None or peak.omega >= antiresonance:
        return peak
    higher = [one for one in branch.peaks("relative") if one.omega >= antiresonance]
    return max(higher, key=lambda one: one.amplitude("relative"), default=peak)


def _main_folds(branch: Branch, peak: SpecialPoint) -> tuple[float | None, float | None]:
    """(w_lb, w_ub): the first two folds on the way down from the main peak.

    A fold beyond a trough belongs to another resonance, as do those before the peak.
    """
    size = branch.amplitude("relative")
    for first, second in pairwise(branch.folds):
        # A peak and the fold beside it may stand in one step of the branch.
        if first.position <= peak.position - 1.0:
            continue
        way = size[math.ceil(peak.position) : math.floor(first.position) + 1]
        if np.any(way < first.amplitude("relative")):
            break
        return min(first.omega, second.omega), max(first.omega, second.omega)
    return None, None
