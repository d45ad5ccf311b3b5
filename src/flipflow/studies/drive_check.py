"""The drive against the machine, before anything is run: speeds, torque at rest, power."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.optimize import brentq

from flipflow.compiled.arrays import Real
from flipflow.dynamics.linear_response import linear_response
from flipflow.dynamics.normal import normal_amplitude, normal_direction
from flipflow.model.drive import Drive
from flipflow.model.numerals import case_words, rpm
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.starter import Converter
from flipflow.transient.run_up import AT_SPEED
from flipflow.transient.speed_run import unbalance_weight

Interval = tuple[float, float]
Subject = Literal["speed", "torque at rest", "power", "resonance"]
ELSEWHERE = 0.01  # of the working speed: farther away a drive settles at another speed
SWING = 0.724611  # largest (1 - cos a) / a: a torque, over m0r g, that swings the unbalance over
AROUND = (0.7, 1.3)  # speeds over the natural frequency among which its torque is largest
SPEEDS = 121
ON_THE_WAY = {
    "speed": ("synchronous_speed", "ratio", "torque_limit"),
    "torque at rest": (
        "rated_power", "synchronous_speed", "ratio", "starting_ratio", "pull_up_ratio",
        "breakdown_ratio", "breakdown_slip", "friction", "torque_limit",
    ),
    "power": ("rated_power",),
}  # fmt: skip


@dataclass(frozen=True)
class Finding:
    """What is wrong with a drive, and what would do.

    Parameters
    ----------
    subject
        "speed", "torque at rest", "power" or "resonance".
    state
        "fail"; "attention" where it rests on assumed values, or does not keep the machine from
        running.
    sentence
        What is wrong, with a remedy solved from the balance of torques.
    """

    subject: Subject
    state: Literal["attention", "fail"]
    sentence: str


@dataclass(frozen=True, eq=False)
class Demand:
    """What a machine asks of its drive.

    Parameters
    ----------
    screen
        The machine, as its first load case has it.
    speed
        Working speed in rad/s.
    allowed
        Speed intervals in rad/s in which every limit is met in every case.
    powers
        Mean power of the dampers at working speed in W, by load case.
    power_at
        The same of the first load case at any speed in rad/s; None where no motion is known.
    """

    screen: FlipFlowScreen
    speed: float
    allowed: tuple[Interval, ...]
    powers: Mapping[str, float]
    power_at: Callable[[float], float | None]

    def torque(self, drive: Drive, speed: float) -> float | None:
        """Torque at the shaft in N m that dampers and friction take at a speed in rad/s."""
        power = self.power_at(speed)
        return None if power is None else power / speed + float(drive.friction_torque(speed))


def drive_findings(drive: Drive, demand: Demand) -> tuple[Finding, ...]:
    """What is wrong with a drive, the gravest first; nothing is run for it."""
    checks = (_speed(drive, demand), _at_rest(drive, demand), _power(drive, demand))
    found = [one for one in checks if one is not None]
    return tuple(sorted(found, key=lambda one: one.state != "fail"))


def settled_speed(drive: Drive, demand: Demand) -> float | None:
    """Speed in rad/s at which the motor's torque is that of dampers and friction."""
    end, motor = drive.end_speed, drive.motor
    if end is None or motor is None:
        return None
    known = demand.torque(drive, demand.speed)

    def excess(speed: float) -> float:
        asked = demand.torque(drive, speed)
        return float(drive.torque(speed)) - (known or 0.0 if asked is None else asked)

    weakest = motor.breakdown_speed / drive.ratio
    low = 0.5 * end if isinstance(drive.starter, Converter) else weakest
    if excess(low) <= 0.0 or excess(end) >= 0.0:
        return None
    return float(brentq(excess, low, end, xtol=1e-6 * end))


def power_that_passes(drive: Drive, screen: FlipFlowScreen, omega: float) -> float | None:
    """Rated power in W with which the drive passes a natural frequency however slowly.

    There the torque of dampers and friction, of the machine that touches no stop, is largest.
    """
    motor = drive.motor
    if motor is None or omega <= 0.0:
        return None
    speeds = omega * np.linspace(*AROUND, SPEEDS)
    asked = free_power(screen, speeds) / speeds
    given, rubbed = drive.torque(speeds), drive.friction_torque(speeds)
    # Friction that was assumed as a share of the rated torque grows with the motor.
    if "friction" in drive.assumed_fields:
        given, rubbed = given - rubbed, np.zeros(speeds.size)
    if (given <= 0.0).any():
        return None
    share = (asked + rubbed) / given
    most = float(share.max())
    return motor.power * most if math.isfinite(most) and most > 0.0 else None


def free_power(screen: FlipFlowScreen, omega: Real) -> Real:
    """Mean power in W that the dampers take without contact, both directions where known."""
    found = linear_response(screen, omega)
    along = screen.isolation_damping * found.amplitude("main") ** 2
    between = screen.shear_damping * found.amplitude("relative") ** 2
    power = 0.5 * omega**2 * (along + between)
    one = normal_direction(screen)
    if one is not None:
        Y = normal_amplitude(one.mass, one.damping, one.stiffness, screen.eccentric_moment, omega)
        power = power + 0.5 * one.damping * (omega * np.abs(Y)) ** 2
    return np.asarray(power)


def _state(drive: Drive, subject: Subject) -> Literal["attention", "fail"]:
    """Fail on given values, attention on assumed ones."""
    assumed = set(ON_THE_WAY[subject]) & set(drive.assumed_fields)
    return "attention" if assumed else "fail"


def _speed(drive: Drive, demand: Demand) -> Finding | None:
    end, speed = drive.end_speed, demand.speed
    if end is None or drive.motor is None:
        return None
    settled = settled_speed(drive, demand)
    if end <= speed:
        near = settled is not None and settled >= AT_SPEED * speed
        runs = near and not _beyond(settled or 0.0, demand.allowed)
        told = f"the synchronous speed of the shaft is {_rpm(end)}; {_remedy(drive, demand)}."
        return Finding("speed", "attention" if runs else _state(drive, "speed"), told)
    if settled is None:
        return None
    beyond = _beyond(settled, demand.allowed)
    # A working speed that is not allowed is no fault of the drive that keeps it.
    kept = not beyond or _beyond(speed, demand.allowed)
    if abs(settled / speed - 1.0) <= ELSEWHERE and kept:
        return None
    told = f"the drive settles at {_rpm(settled)}{beyond}; {_remedy(drive, demand)}"
    return Finding("speed", _state(drive, "speed") if beyond else "attention", f"{told}.")


def _remedy(drive: Drive, demand: Demand) -> str:
    """The ratio with which the shaft settles at working speed, or the end of a ramp."""
    wanted, motor = _rpm(demand.speed), drive.motor
    torque = demand.torque(drive, demand.speed) or 0.0
    if motor is None:
        return ""
    if isinstance(drive.starter, Converter):
        slope, _ = drive.converter_slope_and_limit(drive.starter)
        field = drive.ratio * (demand.speed + torque / slope)
        return f"{wanted} needs a field of {_rpm(field)} at the motor"
    ratio = drive.ratio_for(demand.speed, torque)
    if ratio is None:
        most = motor.rated_speed / demand.speed
        return f"{wanted} needs a stronger motor, and a ratio of {most:.4g}"
    below = (drive.end_speed or 0.0) <= demand.speed
    return f"{wanted} needs a ratio of {'at most ' if below else ''}{_down(ratio)}"


def _beyond(speed: float, allowed: tuple[Interval, ...]) -> str:
    """Where a speed lies outside of what is allowed, in words; empty where it may run."""
    if any(low <= speed <= high for low, high in allowed):
        return ""
    if not allowed:
        return ", and no speed is allowed"
    ends = [end for interval in allowed for end in interval]
    nearest = min(ends, key=lambda end: abs(end - speed))
    return f", {'above' if speed > nearest else 'below'} the allowed {_rpm(nearest)}"


def _at_rest(drive: Drive, demand: Demand) -> Finding | None:
    """The torque at rest against what lifts the unbalance and overcomes friction over a turn."""
    weight, at_rest = abs(unbalance_weight(demand.screen).torque), drive.torque_at_rest
    asked = weight + drive.friction
    if drive.motor is None or at_rest > asked:
        return None
    lift = f"lifting the unbalance takes {weight:.3g} N m, friction {drive.friction:.3g} N m"
    told = f"the torque at rest is {at_rest:.3g} N m at the shaft; {lift} over a turn"
    grows = "friction" in drive.assumed_fields
    spare = at_rest - (drive.friction if grows else 0.0)
    remedy = "it needs more torque at standstill, by another motor or another way of starting"
    if spare > 0.0:
        factor = (weight if grows else asked) / spare
        remedy = f"{power_words(factor * drive.motor.power)} of rated power lift it however slowly"
    swings = at_rest > SWING * weight + drive.friction
    if swings:
        told += ", so that it must swing over"
    state = "attention" if swings else _state(drive, "torque at rest")
    return Finding("torque at rest", state, f"{told}; {remedy}.")


def _power(drive: Drive, demand: Demand) -> Finding | None:
    if drive.motor is None or not demand.powers:
        return None
    case = max(demand.powers, key=lambda name: demand.powers[name])
    rubbed = float(drive.friction_torque(demand.speed)) * demand.speed
    asked = demand.powers[case] + rubbed
    if asked <= drive.motor.power * (1.0 + 1e-9):
        return None
    told = (
        f"the machine takes {power_words(asked)} at {_rpm(demand.speed)} ({case_words(case)}), "
        f"more than the rated power of {_watts(drive.motor.power)}; "
        "it needs a motor of at least that"
    )
    return Finding("power", _state(drive, "power"), f"{told}.")


def power_words(watts: float) -> str:
    """A power that suffices: three digits, rounded up."""
    step = 10.0 ** (math.floor(math.log10(watts)) - 2)
    return _watts(math.ceil(watts / step - 1e-9) * step)


def _watts(watts: float) -> str:
    return f"{watts / 1e3:.3g} kW" if 100.0 <= watts < 999.5e3 else f"{watts:.3g} W"


def _down(ratio: float) -> str:
    """A ratio of four digits, rounded down: with it the speed is reached."""
    step = 10.0 ** (math.floor(math.log10(ratio)) - 3)
    return f"{math.floor(ratio / step + 1e-9) * step:.4g}"


def _rpm(omega: float) -> str:
    return f"{rpm(omega)} rpm"
