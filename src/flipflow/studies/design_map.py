"""Which gap and which stop: operating region, amplitude and steadiness over both."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from flipflow import __version__
from flipflow.compiled.arrays import Real
from flipflow.continuation.bifurcation_curve import BifurcationCurve
from flipflow.continuation.branch import Branch, SpecialPoint
from flipflow.continuation.continue_bifurcation import continue_bifurcation
from flipflow.continuation.special_points import CONTACT_BEGIN
from flipflow.errors import InputError
from flipflow.model.arguments import (
    checked_kind,
    checked_monitor,
    checked_numbers,
    checked_speed,
)
from flipflow.model.monitor import Monitor
from flipflow.model.screen import FlipFlowScreen, Load, as_cool_as_air, of_air
from flipflow.results.result import Frozen, Result
from flipflow.studies.landmarks import Landmarks, Response, analysed_range, landmarks
from flipflow.studies.loading import amplitude_from_below
from flipflow.studies.rubber_temperature import air_notes, warmed_load, warming_known

GAP, STIFFNESS, OMEGA = "clearance", "stop_stiffness", "omega"
CURVES_SHARE = 0.8  # of the work is done where the curves are followed


@dataclass(frozen=True, eq=False)
class DesignMap(Frozen, Result):
    """Gap against stop stiffness: what a screen does with each pair, returned by ``design_map``.

    Arrays (m, n) have a row for each stiffness and a column for each gap; NaN where there is none.

    Parameters
    ----------
    screen
        The machine whose gap and stop are varied.
    omega
        Working speed in rad/s.
    load
        The load under which steadiness is told; None without one.
    clearance, stop_stiffness
        Gaps in m, (n,), and stiffnesses in N/m, (m,), rising.
    omega_cs, omega_lb, omega_ub
        Where contact begins, and both folds, in rad/s, (m, n).
    width
        Width of the operating region in rad/s, (m, n).
    amplitude
        Relative amplitude in m at working speed, as the speed rises slowly, (m, n).
    steadiness
        The same of the loaded machine as a share of it, (m, n): 1 where the load changes nothing;
        NaN, too, where the temperature of its rubber does not settle.
    curves
        Where contact begins over gap and speed, once for all stiffnesses, unless both gaps differ:
        the stop touched last then begins at another speed for each. And for each stiffness that has
        folds, the folds over gap and speed, through the cusp where they are born.
    version
        Version of flipflow.
    notes
        How warm the rubber is taken to be, where the load gives the air's temperature.
    """

    screen: FlipFlowScreen
    omega: float
    load: Load | None
    clearance: Real
    stop_stiffness: Real
    omega_cs: Real
    omega_lb: Real
    omega_ub: Real
    width: Real
    amplitude: Real
    steadiness: Real
    curves: tuple[BifurcationCurve, ...]
    version: str
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        m, n = self.omega_cs.shape
        cusps = sum(len(curve.points_of("cusp")) for curve in self.curves)
        return f"DesignMap({n} gaps, {m} stiffnesses, {self.omega:.6g} rad/s, {cusps} cusps)"


def design_map(
    screen: FlipFlowScreen,
    omega: float,
    clearance: ArrayLike,
    stop_stiffness: ArrayLike,
    *,
    load: Load | None = None,
    monitor: Monitor | None = None,
) -> DesignMap:
    """Operating region, amplitude and steadiness of a screen over gap and stop stiffness.

    Every pair is analysed by its own response; where contact begins and where the machine jumps is
    also followed over the gap as curves.

    Parameters
    ----------
    screen
        The machine.
    omega
        Working speed in rad/s.
    clearance, stop_stiffness
        Gaps in m and stiffnesses in N/m, at least two each.
    load
        Load under which the amplitude is compared with that of the empty machine. It doubles the
        time; with the air's temperature, at which the rubber of each pair settles first, it takes
        several times as long.
    monitor
        Called with a sentence and the share done; raise from it to cancel.

    Returns
    -------
    DesignMap
        Its figure draws the curves, the amplitude and its share under load.

    Raises
    ------
    InputError
        For values that are not above zero, a machine without a finite gap, and a load that the
        screen has no data for.
    """
    checked_kind("screen", screen, FlipFlowScreen, "give a screen, such as ff.load(...)")
    omega, say = checked_speed(omega), checked_monitor(monitor)
    if load is not None:
        checked_kind("load", load, Load, "give a flipflow.Load, or None")
        screen.loaded(as_cool_as_air(load))
    gaps, stops = _values(GAP, clearance), _values(STIFFNESS, stop_stiffness)
    rows: list[list[tuple[float, ...]]] = []
    starts: list[SpecialPoint] = []
    begins: SpecialPoint | None = None
    for j, stiffness in enumerate(stops):
        row, fold = [], None
        for k, gap in enumerate(gaps):
            done = (j * gaps.size + k) / (stops.size * gaps.size)
            say(f"stop of {stiffness:.4g} N/m, gap of {gap:.4g} m", CURVES_SHARE * done)
            one = screen.replace(clearance=float(gap), stop_stiffness=float(stiffness))
            branch = Response(one, analysed_range(one, omega)).branch
            marks = landmarks(one, branch)
            row.append(_cell(one, branch, marks, omega, load))
            fold = fold or _at(branch.folds, marks.omega_lb)
            begins = begins or _at(branch.points_of(CONTACT_BEGIN), marks.omega_cs)
        rows.append(row)
        starts += [fold] if fold else []
    starts = [begins, *starts] if begins and _begins_once(screen) else starts
    cs, lb, ub, width, amplitude, steadiness = np.moveaxis(np.array(rows), 2, 0).copy()
    return DesignMap(
        screen, omega, load, gaps, stops, cs, lb, ub, width, amplitude, steadiness,
        curves=tuple(_curve(point, gaps, say, k / len(starts)) for k, point in enumerate(starts)),
        version=__version__, notes=tuple(air_notes(screen, () if load is None else (load,))),
    )  # fmt: skip


def _values(name: str, given: ArrayLike) -> Real:
    remedy = "give at least two different values above 0"
    row = np.unique(checked_numbers(name, given, remedy))
    if row.size < 2 or row[0] <= 0.0:
        raise InputError(name, given, remedy)
    return row


def _begins_once(screen: FlipFlowScreen) -> bool:
    """Whether contact begins at one speed whatever the stops: both at once, or one alone."""
    minus = screen.clearance_minus
    return minus == math.inf or (minus is None and screen.gap_shift == 0.0)


def _at(points: tuple[SpecialPoint, ...], omega: float | None) -> SpecialPoint | None:
    """The point at a landmark."""
    return next((point for point in points if point.omega == omega), None)


def _cell(
    one: FlipFlowScreen, branch: Branch, marks: Landmarks, omega: float, load: Load | None
) -> tuple[float, ...]:
    amplitude, share = amplitude_from_below(branch, omega, "relative"), math.nan
    loaded = None if load is None else _at_work(one, load, omega)
    if loaded is not None:
        under = Response(loaded, analysed_range(loaded, omega)).branch
        share = amplitude_from_below(under, omega, "relative") / amplitude
    known = (marks.omega_cs, marks.omega_lb, marks.omega_ub)
    speeds = (math.nan if speed is None else speed for speed in known)
    return (*speeds, marks.upper - marks.lower, amplitude, share)


def _at_work(one: FlipFlowScreen, load: Load, omega: float) -> FlipFlowScreen | None:
    """The screen under the load; None where the temperature of its rubber does not settle."""
    warmed = warmed_load(one, load, omega)
    lost = of_air(load) and warming_known(one) and warmed.rubber is None
    return None if lost else one.loaded(warmed.load)


def _curve(point: SpecialPoint, gaps: Real, say: Monitor, share: float) -> BifurcationCurve:
    """The curve of a point over gap and speed."""
    machine = point.orbit.machine
    say("curves over the gap", CURVES_SHARE + (1.0 - CURVES_SHARE) * share)
    low, high = analysed_range(machine)
    limits = (float(gaps[0]), float(gaps[-1])), (low, high)
    return continue_bifurcation(point, (GAP, OMEGA), limits)
