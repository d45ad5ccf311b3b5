"""A drive that nobody gave, and what is open of one that was given."""

from __future__ import annotations

from dataclasses import replace

from flipflow.errors import InputError
from flipflow.model.drive import Drive, assumed_drive
from flipflow.model.numerals import digits
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.starter import Converter
from flipflow.model.system import Machine
from flipflow.transient.speed_run import MOST_TURNS, steady_power
from flipflow.transient.time_stepping import RungeKutta

POWER_FACTOR = 4.0  # assumed rated power over the power that the dampers take at working speed
NOT_SETTLED = f"had not settled after {MOST_TURNS} turns from rest"


def default_drive(machine: Machine, speed: float | None, method: RungeKutta | None = None) -> Drive:
    """A plausible drive for a screen whose drive is not known; what it assumes stands in it.

    The rated power is four times what the dampers take at working speed: starting asks for more
    than running. The rest is as in :func:`flipflow.model.drive.assumed_drive`.
    """
    if not isinstance(machine, FlipFlowScreen):
        raise InputError("drive", None, "give a Drive or a SpeedProfile for this machine")
    if speed is None:
        raise InputError("speed", None, "give the working speed, or a drive")
    steady, settled = steady_power(machine, speed, method)
    power = POWER_FACTOR * steady
    drive = assumed_drive(machine.eccentric_moment, speed, power)
    rated = f"{digits(power / 1e3)} kW" if power >= 100.0 else f"{power:.3g} W"
    word = f"rated power {rated}, four times what the dampers take at working speed"
    word += "" if settled else f", in the mean over 20 turns of a motion that {NOT_SETTLED}"
    drive = replace(
        drive, assumed=(word, *drive.assumed), assumed_fields=("rated_power", *drive.assumed_fields)
    )
    return _settling(drive, speed, steady)


def fitted_drive(
    machine: Machine, drive: Drive, speed: float, method: RungeKutta | None = None
) -> Drive:
    """The drive with what is open of it chosen: its shaft settles at ``speed`` in rad/s.

    That is an assumed ratio, or the end of a converter's ramp. A motor that has not the torque
    for it keeps the ratio with which it has its rated speed there.
    """
    starter = drive.starter
    ramp = isinstance(starter, Converter) and starter.end_speed is None
    if drive.motor is None or not (drive.open_ratio or ramp):
        return drive
    steady, _ = steady_power(machine, speed, method)
    return _settling(drive, speed, steady)


def _settling(drive: Drive, speed: float, power: float) -> Drive:
    """The drive whose shaft settles at a speed at which the dampers take a power in W."""
    torque = power / speed + float(drive.friction_torque(speed))
    starter = drive.starter
    if isinstance(starter, Converter):
        slope, _ = drive.converter_slope_and_limit(starter)
        end = drive.ratio * (speed + torque / slope)
        given = starter.end_speed or end
        return replace(drive, starter=replace(starter, end_speed=given), open_ratio=False)
    ratio = drive.ratio_for(speed, torque)
    return replace(drive, ratio=ratio or drive.ratio, open_ratio=False)
