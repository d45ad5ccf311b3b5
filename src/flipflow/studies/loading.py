"""How much a load changes the relative amplitude over the operating region, stop or no stop."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from flipflow.compiled.arrays import Real
from flipflow.continuation.branch import Branch
from flipflow.continuation.frequency_response import frequency_response
from flipflow.errors import IncompleteError, InputError
from flipflow.model.arguments import checked_interval
from flipflow.model.screen import FlipFlowScreen, Load
from flipflow.model.system import Coordinate
from flipflow.periodic.options import Method, checked_method
from flipflow.results.result import Result
from flipflow.studies.landmarks import Landmarks, analysed_range, within_speeds

Start = Literal["unloaded", "loaded"]
UNSTABLE = (
    "At {} of {} speeds of the region the motion followed is unstable: the machine leans to one "
    "side, or takes several turns. They are left out."
)
SAMPLES = 121  # speeds over the operating region at which amplitudes are compared


@dataclass(frozen=True)
class Change:
    """Relative amplitude in m at one speed in rad/s, unloaded and loaded."""

    omega: float
    unloaded: float
    loaded: float

    @property
    def change(self) -> float:
        """Loaded minus unloaded in m; negative for a reduction."""
        return self.loaded - self.unloaded

    @property
    def share(self) -> float:
        """Change as a share of the unloaded amplitude; NaN where that is zero."""
        return self.change / self.unloaded if self.unloaded else math.nan


@dataclass(frozen=True)
class StraightLine:
    """Change over the region as intercept + slope (omega - lower): m, and m per rad/s."""

    intercept: float
    slope: float


@dataclass(frozen=True, eq=False)
class RegionChange:
    """Change of the relative amplitude over one operating region, as the speed rises slowly.

    Parameters
    ----------
    start
        Whose lower end the region has: that of the "unloaded" machine or of the "loaded" one.
        The upper end is the unloaded machine's.
    omega
        Speeds in rad/s, (n,), both ends of the region included.
    unloaded, loaded
        Relative amplitude in m, (n,), each solved for; NaN where no stable motion was found.
    least, greatest
        Where the change is least and greatest in size, searched between the speeds.
    """

    start: Start
    omega: Real
    unloaded: Real
    loaded: Real
    least: Change
    greatest: Change

    @property
    def lower(self) -> float:
        """Lower end of the region in rad/s."""
        return float(self.omega[0])

    @property
    def upper(self) -> float:
        """Upper end of the region in rad/s."""
        return float(self.omega[-1])

    @property
    def change(self) -> Real:
        """Loaded minus unloaded in m, (n,)."""
        return np.asarray(self.loaded - self.unloaded)

    @property
    def share(self) -> Real:
        """Change as a share of the unloaded amplitude, (n,)."""
        return np.asarray(self.change / self.unloaded)

    @property
    def at_lower(self) -> Change:
        """The lower end of the region."""
        return Change(self.lower, float(self.unloaded[0]), float(self.loaded[0]))

    @property
    def at_upper(self) -> Change:
        """The upper end of the region."""
        return Change(self.upper, float(self.unloaded[-1]), float(self.loaded[-1]))

    @property
    def line_through_ends(self) -> StraightLine:
        """The paper's line: intercept the change at the lower end, slope change per bandwidth."""
        first, last = self.at_lower.change, self.at_upper.change
        return StraightLine(first, (last - first) / (self.upper - self.lower))

    @property
    def line_of_least_squares(self) -> StraightLine:
        """The line that fits all speeds best."""
        known = np.isfinite(self.change)
        slope, intercept = np.polyfit(self.omega[known] - self.lower, self.change[known], 1)
        return StraightLine(float(intercept), float(slope))


@dataclass(frozen=True, eq=False)
class LoadedMachine:
    """One machine, with stop or without, empty and under the load.

    Parameters
    ----------
    unloaded, loaded
        Motions over speed.
    unloaded_marks, loaded_marks
        Characteristic frequencies and operating region of both.
    region
        Change over the unloaded machine's region.
    from_loaded
        The same from where the loaded machine's region starts; None where nothing is left.
    """

    unloaded: Branch
    loaded: Branch
    unloaded_marks: Landmarks
    loaded_marks: Landmarks
    region: RegionChange
    from_loaded: RegionChange | None

    @property
    def notes(self) -> tuple[str, ...]:
        """What could not be settled."""
        sentences = []
        for name, branch, marks in (
            ("empty", self.unloaded, self.unloaded_marks),
            ("loaded", self.loaded, self.loaded_marks),
        ):
            unfinished = () if branch.complete else (branch.status.value,)
            amplitude = self.region.unloaded if branch is self.unloaded else self.region.loaded
            omega, ends = self.region.omega, (branch.omega.min(), branch.omega.max())
            followed = (omega >= ends[0]) & (omega <= ends[1])
            lost = int(np.isnan(amplitude[followed]).sum())
            unstable = (UNSTABLE.format(lost, amplitude.size),) if lost and branch.complete else ()
            texts = (*branch.notes, *marks.notes, *unfinished, *unstable)
            sentences += [f"{name}: {text}" for text in texts]
        return tuple(sentences)


@dataclass(frozen=True, eq=False)
class Loading(Result):
    """What a load does to a screen; returned by :func:`flipflow.loading`.

    Parameters
    ----------
    screen, load
        The empty machine and its load.
    with_stop
        The machine as it is; None for a machine without stop.
    without_stop
        The same machine with its stops taken out.
    """

    screen: FlipFlowScreen
    load: Load
    with_stop: LoadedMachine | None
    without_stop: LoadedMachine

    def __repr__(self) -> str:
        stop = "without stop" if self.with_stop is None else "with and without stop"
        return f"Loading({self.load.name or 'load'}, {stop})"


def loading(
    screen: FlipFlowScreen,
    load: Load,
    *,
    omega: tuple[float, float] | None = None,
    method: Method | None = None,
) -> Loading:
    """Compare the empty and the loaded machine over the operating region, with and without stop.

    The region of the machine with stop is [w_cs, w_lb], without [w_ea, w_ar]. A load moves the
    lower end; the change is therefore given over the region of the empty machine and also from
    where the region of the loaded one begins. Amplitudes are those met as the speed rises slowly.

    Parameters
    ----------
    screen
        The empty machine.
    load
        Factors on the shear springs, carried masses, temperature.
    omega
        Speeds (low, high) in rad/s that are followed; None: wide enough for both.
    method
        :class:`~flipflow.PiecewiseExact` (default) or :class:`~flipflow.HarmonicBalance`.

    Raises
    ------
    InputError
        For anything but a screen and a load, an interval beside the operating region, or a load
        that the screen has no data for, or that gives the air's temperature: it depends on the
        speed how much warmer the rubber is.
    IncompleteError
        When no branch could be started, none reaches the operating region, or there is none.
    """
    if not isinstance(screen, FlipFlowScreen):
        raise InputError("screen", type(screen).__name__, "give a FlipFlowScreen")
    if not isinstance(load, Load):
        raise InputError("load", load, "give an ff.Load, such as ff.Load(stiffness_factor=1.1)")
    method = checked_method(method)
    omega = None if omega is None else checked_interval("omega", omega)
    bare = screen.replace(clearance=math.inf, clearance_minus=None)
    stopped = _compared(screen, load, omega, method) if screen.has_stop else None
    return Loading(screen, load, stopped, _compared(bare, load, omega, method))


def _compared(
    screen: FlipFlowScreen,
    load: Load,
    omega: tuple[float, float] | None,
    method: Method | None,
) -> LoadedMachine:
    heavy = screen.loaded(load)
    spans = [analysed_range(one) for one in (screen, heavy)]
    wide = (min(low for low, _ in spans), max(high for _, high in spans))
    branches = [frequency_response(one, omega or wide, method) for one in (screen, heavy)]
    unloaded, loaded = branches
    marks, heavy_marks = within_speeds(screen, unloaded), within_speeds(heavy, loaded)
    if omega is not None and not (omega[0] < marks.upper and marks.lower < omega[1]):
        stop = "" if screen.has_stop else " without stop"
        ends = f"{marks.lower:.6g} to {marks.upper:.6g} rad/s"
        remedy = f"the operating region{stop} is {ends}; give speeds around it"
        raise InputError("omega", omega, remedy)
    late = None
    if heavy_marks.lower < marks.upper:
        late = _region(unloaded, loaded, (heavy_marks.lower, marks.upper), "loaded")
    region = _region(unloaded, loaded, (marks.lower, marks.upper), "unloaded")
    return LoadedMachine(unloaded, loaded, marks, heavy_marks, region, late)


def _region(
    unloaded: Branch, loaded: Branch, ends: tuple[float, float], start: Start
) -> RegionChange:
    if not ends[0] < ends[1]:
        words = f"it would begin at {ends[0]:.6g} and end at {ends[1]:.6g} rad/s"
        raise IncompleteError(f"The machine has no operating region: {words}.")
    omega = np.linspace(*ends, SAMPLES)
    before, after = (
        amplitudes_from_below(branch, omega, "relative") for branch in (unloaded, loaded)
    )
    change = after - before
    if not np.isfinite(change).any():
        why = " ".join(one.status.value for one in (unloaded, loaded) if not one.complete)
        raise IncompleteError(
            "No motion of both the empty and the loaded machine is known in the operating region, "
            f"{ends[0]:.6g} to {ends[1]:.6g} rad/s. {why}".strip()
        )
    at = partial(change_at, unloaded, loaded)
    zeros = _zeros(at, omega, change)
    least = min((_refined(at, omega, change, 1.0), *zeros), key=lambda one: abs(one.change))
    greatest = _refined(at, omega, change, -1.0)
    return RegionChange(start, omega, before, after, least, greatest)


def _zeros(at: Callable[[float], Change], omega: Real, change: Real) -> Iterator[Change]:
    """Where the change passes zero between two samples, or changes its sign by a jump.

    Not where one of the machines has no motion on the way.
    """

    def height(w: float) -> float:
        found = at(w).change
        if math.isnan(found):
            raise IncompleteError(f"one of the machines has no motion at {w:.6g} rad/s")
        return found

    for k in np.flatnonzero(change[:-1] * change[1:] < 0.0):
        with suppress(IncompleteError):
            yield at(float(brentq(height, omega[k], omega[k + 1], xtol=1e-9)))


def _refined(at: Callable[[float], Change], omega: Real, change: Real, sign: float) -> Change:
    """The least (sign 1) or greatest (-1) change around the sample that has it."""
    size = np.abs(change)
    index = int(np.nanargmin(size) if sign > 0.0 else np.nanargmax(size))
    low, high = omega[max(index - 1, 0)], omega[min(index + 1, omega.size - 1)]
    best = minimize_scalar(
        lambda w: sign * abs(at(float(w)).change), bounds=(low, high), method="bounded",
        options={"xatol": 1e-6},
    )  # fmt: skip
    sampled = at(float(omega[index]))
    between = at(float(best.x))
    inside = sign * abs(between.change) < sign * float(size[index])
    return between if inside else sampled


def change_at(unloaded: Branch, loaded: Branch, omega: float) -> Change:
    """Relative amplitudes of both at a speed in rad/s as it rises; NaN without a stable motion."""
    pair = (amplitude_from_below(branch, omega, "relative") for branch in (unloaded, loaded))
    return Change(omega, *pair)


def amplitude_from_below(branch: Branch, omega: float, which: Coordinate) -> float:
    """Amplitude of a coordinate in m at a speed as it rises slowly.

    NaN without a motion, and where it is unstable: the machine moves in another way there, to one
    side or over several turns.
    """
    return float(amplitudes_from_below(branch, np.array([omega]), which)[0])


def amplitudes_from_below(branch: Branch, omega: Real, which: Coordinate) -> Real:
    """The same at several speeds, (n,)."""
    amplitudes = np.full(omega.size, np.nan)
    found = [branch.orbit_from_below(w) for w in omega.tolist()]
    known = [k for k, orbit in enumerate(found) if orbit is not None and orbit.stable]
    if known:
        u = np.array([orbit.point.u for orbit in found if orbit is not None and orbit.stable])
        with branch.formulation.lent() as solver:
            low, high, _ = solver.extremes(u, omega[known], branch.system.coordinate(which)[None])
        amplitudes[known] = 0.5 * (high - low)[:, 0]
    return amplitudes
