r"""How warm the rubber of the shear springs is at work, where a load case gives that of the air.

The rubber's temperature solves

.. math:: T = T_{air} + P_2(T) / (n_2 G_2)

with the power of the shear springs in a motion, whose stiffness is that at T, and the conductance
of one spring. Beyond the ends of the springs' table the stiffness stays that at the end. Stop
springs are taken to be as warm.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from flipflow.compiled.arrays import Int, Real
from flipflow.continuation.frequency_response import frequency_response
from flipflow.errors import IncompleteError, InputError
from flipflow.model.numerals import case_words
from flipflow.model.quantities import QUANTITIES
from flipflow.model.screen import FlipFlowScreen, Load, WarmedLoad, as_cool_as_air, of_air
from flipflow.periodic.options import Method
from flipflow.studies.feasible import working_motion
from flipflow.studies.landmarks import analysed_range

RISE = "shear_temperature_rise"
NEEDED = "shear_springs.conductance or pieces"
AS_AIR = "the rubber is taken to be as warm as the air"
WITHIN = 0.01  # K within which the temperature repeats itself before the last step
MOST_STEPS = 30
MOST_KEPT = 4096  # cases at speeds of which the temperature is kept, as of one study


def warmed_load(
    screen: FlipFlowScreen,
    load: Load,
    omega: float | None,
    method: Method | None = None,
) -> WarmedLoad:
    """The load case with the rubber as warm as its work at ``omega`` keeps it.

    The motion is the one reached from below.

    Parameters
    ----------
    screen, load
        The empty machine, and what it bears.
    omega
        Working speed in rad/s.
    method
        How motions are found.

    Raises
    ------
    InputError
        For air whose temperature is outside the springs' table, and without such a table.
    """
    if not of_air(load):
        return WarmedLoad(load)
    screen.loaded(as_cool_as_air(load))
    return _warmed(screen, load, omega, method)


def settled_at_work(
    screen: FlipFlowScreen, given: Load, found: Load, rise: float | None
) -> WarmedLoad:
    """A load case that a motion was found in, from what the rubber is warmer than the air in it."""
    if not of_air(given) or rise is None or given.temperature is None or found.temperature is None:
        return WarmedLoad(found)
    rubber = given.temperature + rise
    known = abs(float(np.clip(rubber, *table_ends(screen))) - found.temperature) < 10.0 * WITHIN
    return WarmedLoad(found, rubber if known else None)


@lru_cache(MOST_KEPT)
def _warmed(
    screen: FlipFlowScreen,
    load: Load,
    omega: float | None,
    method: Method | None,
) -> WarmedLoad:
    """Cached: it takes several responses, and every part of a study asks for it."""
    case, cool = case_words(load.name, capital=True), as_cool_as_air(load)
    if omega is None or not warming_known(screen):
        lacking = "the working speed" if omega is None else NEEDED
        return WarmedLoad(cool, note=f"{case}: {AS_AIR}, for want of {lacking}.")
    low, high = table_ends(screen)

    def warmer(rubber: Real, _: Int) -> Real:
        held = replace(cool, temperature=float(np.clip(rubber[0], low, high)))
        machine = screen.loaded(held)
        try:
            branch = frequency_response(machine, analysed_range(screen, omega), method)
        except (InputError, IncompleteError):  # a machine without damping, say
            return np.array([np.nan])
        working = working_motion(machine, branch, omega)
        rise = None if working is None else working.value(RISE)
        return np.array([np.nan if rise is None else rise])

    rubber = float(settled(np.array([cool.temperature], float), warmer)[0])
    if np.isnan(rubber):
        note = f"{case}: the temperature of the rubber was not found; it is the air's."
        return WarmedLoad(cool, note=note)
    note = (
        f"{case}: the rubber, {rubber:.3g} degC, is warmer than the springs' table knows; "
        f"its stiffness is that at {high:g} degC."
    )
    held = replace(cool, temperature=float(np.clip(rubber, low, high)))
    return WarmedLoad(held, rubber, note if rubber > high else "")


def warming_known(screen: FlipFlowScreen) -> bool:
    """Whether the machine's data tell what the rubber is warmer than the air."""
    return not QUANTITIES[RISE].missing(screen)


def air_notes(screen: FlipFlowScreen, loads: Sequence[Load]) -> Iterator[str]:
    """A sentence on the rubber of many machines for each load that gives the air's temperature."""
    for load in filter(of_air, loads):
        case = case_words(load.name, capital=True)
        if not warming_known(screen):
            yield f"{case}: {AS_AIR}, for want of {NEEDED}."
            continue
        low, high = table_ends(screen)
        yield (
            f"{case}: each machine's rubber is as warm as its own work keeps it at each speed. "
            f"The springs' table ends at {low:g} and {high:g} degC; beyond, the stiffness stays."
        )


def table_ends(screen: FlipFlowScreen) -> tuple[float, float]:
    """Temperatures in degrees Celsius between which all tables of a screen know the stiffness."""
    tables = [t for t in (screen.temperature_factor, screen.stop_temperature_factor) if t]
    return max(t[0][0] for t in tables), min(t[-1][0] for t in tables)


def settled(air: Real, warmer: Callable[[Real, Int], Real]) -> Real:
    """T of T = air + warmer(T) in (L,) machines by the secant method; NaN where it does not settle.

    Parameters
    ----------
    air
        Temperature of the air in degrees Celsius, (L,).
    warmer
        From temperatures (l,) and the places (l,) of the machines that have them, what the rubber
        is warmer than the air in K; NaN where there is no motion.
    """
    found = np.full(air.size, np.nan)
    left: Int = np.arange(air.size)
    before, miss_before = air, warmer(air, left)
    now = before + miss_before
    for _ in range(MOST_STEPS):
        known = np.isfinite(now)
        left = left[known]
        before, miss_before, now = (x[known] for x in (before, miss_before, now))
        if not left.size:
            break
        miss = air[left] + warmer(now, left) - now
        change = now - before
        slope = np.divide(miss - miss_before, change, out=np.zeros(left.size), where=change != 0.0)
        after = now - miss / np.where(slope < 0.0, slope, -1.0)
        ended = np.abs(miss) < WITHIN
        found[left[ended]] = after[ended]
        before, miss_before, now = now, miss, np.where(ended, np.nan, after)
    return found
