"""How warm the rubber of the shear springs is at work, where a load case gives that of the air."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

from flipflow.continuation.frequency_response import frequency_response
from flipflow.model.load_case import case_words
from flipflow.model.screen import FlipFlowScreen, Load
from flipflow.periodic.options import Method
from flipflow.studies.feasible import working_motion
from flipflow.studies.landmarks import analysed_range

WITHIN = 0.01  # K within which the temperature repeats itself
MOST_STEPS = 30


@dataclass(frozen=True)
class WarmedLoad:
    """A load case with the temperature of the rubber, and a note where that is not known."""

    load: Load
    note: str = ""


def warmed_load(
    screen: FlipFlowScreen,
    load: Load,
    omega: float | None,
    method: Method | None = None,
    span: tuple[float, float] | None = None,
) -> WarmedLoad:
    r"""The load case with the rubber as warm as its work at ``omega`` keeps it.

    The rubber's temperature solves

    .. math:: T = T_{air} + P_2(T) / (n_2 G_2)

    with the power of the shear springs in the motion reached from below, whose stiffness is that at
    T, and the conductance of one spring. The secant method ends where T changes by less than
    0.01 K. Beyond the ends of the springs' table the stiffness stays that at the end. Stop springs
    are taken to be as warm.

    Parameters
    ----------
    screen, load
        The empty machine, and what it bears.
    omega
        Working speed in rad/s.
    method, span
        How motions are found, and over which speeds in rad/s they are followed.
    """
    air = load.temperature
    if air is None or load.temperature_of != "air":
        return WarmedLoad(load)
    pieces, conductance = screen.shear_pieces, screen.shear_conductance
    at_rubber = dataclasses.replace(load, temperature_of="rubber")
    case = case_words(load.name, capital=True)
    if omega is None or pieces is None or conductance is None:
        why = "the working speed" if omega is None else "shear_springs.conductance or pieces"
        note = f"{case}: the rubber is taken to be as warm as the air, for want of {why}."
        return WarmedLoad(at_rubber, note)
    tables = [t for t in (screen.temperature_factor, screen.stop_temperature_factor) if t]
    low, high = max(t[0][0] for t in tables), min(t[-1][0] for t in tables)

    def warmer(rubber: float) -> float | None:
        """What the rubber is warmer than the air, its stiffness being that at a temperature."""
        held = dataclasses.replace(at_rubber, temperature=min(max(rubber, low), high))
        machine = screen.loaded(held)
        branch = frequency_response(machine, span or analysed_range(screen, omega), method)
        working = working_motion(machine, branch, omega)
        return None if working is None else working.shear_power() / (pieces * conductance)

    found = _settled(air, warmer)
    if found is None:
        note = f"{case}: the temperature of the rubber was not found; it is the air's."
        return WarmedLoad(at_rubber, note)
    note = (
        f"{case}: the rubber, {found:.3g} degC, is warmer than the springs' table knows; "
        f"its stiffness is that at {high:g} degC."
    )
    rubber = min(max(found, low), high)
    return WarmedLoad(
        dataclasses.replace(at_rubber, temperature=rubber), note if found > high else ""
    )


def _settled(air: float, warmer: Callable[[float], float | None]) -> float | None:
    """T of T = air + warmer(T) by the secant method; None where it does not settle."""
    before, miss_before = air, warmer(air)
    if miss_before is None:
        return None
    now = air + miss_before
    for _ in range(MOST_STEPS):
        rise = warmer(now)
        if rise is None:
            return None
        miss = air + rise - now
        if abs(miss) < WITHIN:
            return air + rise
        slope = (miss - miss_before) / (now - before)
        before, miss_before = now, miss
        now -= miss / slope if slope < 0.0 else -miss
    return None
