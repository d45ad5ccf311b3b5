"""Quantities of a working machine: one registry behind limits, tables and reports.

Each is read off one motion of the machine (a :class:`Working`). Acceleration and foundation force
are judged on both directions together; without the normal direction's data they are None.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from flipflow.dynamics.normal import NormalMotion, normal_motion
from flipflow.model.constants import GRAVITY
from flipflow.model.screen import FlipFlowScreen
from flipflow.periodic.orbit import Orbit

Real = NDArray[np.float64]
Subject = TypeVar("Subject")


class _States(NamedTuple):
    """Displacement, velocity and acceleration, (K, N) each."""

    x: Real
    v: Real
    a: Real


@dataclass(frozen=True, eq=False)
class Working:
    """A screen in one periodic motion.

    Parameters
    ----------
    screen
        The screen as loaded.
    orbit
        Its motion along the surface.
    jumps
        Frequencies in rad/s of the folds of its branch.
    """

    screen: FlipFlowScreen
    orbit: Orbit
    jumps: tuple[float, ...] = ()

    @property
    def omega(self) -> float:
        """Frequency in rad/s."""
        return self.orbit.omega

    @cached_property
    def normal(self) -> NormalMotion | None:
        """Motion normal to the surface, None where its data are missing."""
        return normal_motion(self.screen, self.omega)

    def peak_with_normal(
        self,
        along: Callable[[_States], Real],
        across: Callable[[NormalMotion, Real], Real],
    ) -> float | None:
        """Peak over the turn of the vector (along the surface, normal to it)."""
        normal = self.normal
        if normal is None:
            return None
        return self.orbit.peak(
            lambda t, x, v, a: np.hypot(along(_States(x, v, a)), across(normal, t))
        )


@dataclass(frozen=True)
class Quantity(Generic[Subject]):
    """One number that says how a machine works, read off one of its motions.

    Parameters
    ----------
    name, label, symbol
        Key, words for people, symbol.
    unit, shown_unit
        SI unit and the unit it is shown in.
    sentence
        What it is.
    evaluate
        Its value in SI for a :class:`Working`, None where data are missing or there is none.
    needs
        Fields of the screen without which it is None.
    """

    name: str
    label: str
    symbol: str
    unit: str
    shown_unit: str
    sentence: str
    evaluate: Callable[[Subject], float | None]
    needs: tuple[str, ...] = ()


def _main_acceleration(w: Working) -> float | None:
    return w.peak_with_normal(lambda s: s.a[:, 0], NormalMotion.acceleration)


def _floating_acceleration(w: Working) -> float | None:
    return w.peak_with_normal(lambda s: s.a[:, 1], NormalMotion.acceleration)


def _foundation_force(w: Working) -> float | None:
    k, c = w.screen.isolation_stiffness, w.screen.isolation_damping
    return w.peak_with_normal(
        lambda s: k * s.x[:, 0] + c * s.v[:, 0], NormalMotion.foundation_force
    )


def _stop_force(w: Working) -> float:
    return w.orbit.stop_force_peak() if w.screen.has_stop else 0.0


def _dissipated_power(w: Working) -> float | None:
    return None if w.normal is None else w.orbit.input_power() + w.normal.power


def _shear_strain(w: Working) -> float | None:
    height = w.screen.shear_height
    if height is None:
        return None
    reach = w.orbit.amplitude("relative") + abs(w.orbit.mean("relative"))
    return reach / height


def _jump_margin(w: Working) -> float:
    if not w.jumps:
        return math.inf
    zones = zip(w.jumps[::2], w.jumps[1::2], strict=False)
    if any(min(zone) <= w.omega <= max(zone) for zone in zones):
        return 0.0
    return min(abs(w.omega - jump) / jump for jump in w.jumps)


def _throw_number(w: Working) -> float | None:
    if w.normal is None or w.screen.deck_angle is None:
        return None
    return w.omega**2 * w.normal.amplitude / (GRAVITY * math.cos(w.screen.deck_angle))


def _share(value: float | None, pieces: float | None) -> float | None:
    return None if value is None or pieces is None else value / pieces


def _exciter_force(w: Working) -> float:
    return w.screen.eccentric_moment * w.omega**2


_NORMAL = ("normal_stiffness", "normal_damping")

_ALL: tuple[Quantity[Working], ...] = (
    Quantity(
        "relative_amplitude", "relative amplitude", "|x2|", "m", "mm",
        "Half the peak-to-peak motion between the frames; it tightens and slackens the panels.",
        lambda w: w.orbit.amplitude("relative"),
    ),
    Quantity(
        "stroke", "stroke", "2|x2|", "m", "mm",
        "Full travel between the frames, twice the relative amplitude.",
        lambda w: 2.0 * w.orbit.amplitude("relative"),
    ),
    Quantity(
        "main_amplitude", "main frame amplitude", "|x1|", "m", "mm",
        "Half the peak-to-peak motion of the main frame along the surface.",
        lambda w: w.orbit.amplitude("main"),
    ),
    Quantity(
        "floating_amplitude", "floating frame amplitude", "|xf|", "m", "mm",
        "Half the peak-to-peak motion of the floating frame along the surface.",
        lambda w: w.orbit.amplitude("floating"),
    ),
    Quantity(
        "relative_phase", "relative phase", "phi2", "rad", "deg",
        "First harmonic of the relative motion against the unbalance force; positive: it leads.",
        lambda w: w.orbit.phase("relative"),
    ),
    Quantity(
        "main_frame_acceleration", "main frame acceleration", "a1", "m/s^2", "g",
        "Greatest acceleration of the main frame over a turn, in any direction.",
        _main_acceleration, _NORMAL,
    ),
    Quantity(
        "floating_frame_acceleration", "floating frame acceleration", "af", "m/s^2", "g",
        "Greatest acceleration of the floating frame over a turn, in any direction.",
        _floating_acceleration, _NORMAL,
    ),
    Quantity(
        "stop_force", "stop force", "H", "N", "kN",
        "Greatest force on the stop springs of one side together.",
        _stop_force,
    ),
    Quantity(
        "stop_piece_force", "force per stop spring", "H/n3", "N", "kN",
        "The stop force shared by the stop springs of one side.",
        lambda w: _share(_stop_force(w), w.screen.stop_pieces), ("stop_pieces",),
    ),
    Quantity(
        "shear_strain", "shear strain", "gamma", "", "%",
        "Greatest relative displacement over the rubber height of the shear springs.",
        _shear_strain, ("shear_height",),
    ),
    Quantity(
        "foundation_force", "foundation force", "F1", "N", "kN",
        "Greatest dynamic force of all isolation springs on the foundation, in any direction.",
        _foundation_force, _NORMAL,
    ),
    Quantity(
        "support_force", "force per support", "F1/n1", "N", "kN",
        "The dynamic foundation force shared by the supports.",
        lambda w: _share(_foundation_force(w), w.screen.supports), (*_NORMAL, "supports"),
    ),
    Quantity(
        "exciter_force", "exciter force", "m0r w^2", "N", "kN",
        "Centrifugal force of the unbalance.",
        _exciter_force,
    ),
    Quantity(
        "bearing_force", "force per exciter bearing", "m0r w^2/nb", "N", "kN",
        "The exciter force shared by the bearings.",
        lambda w: _share(_exciter_force(w), w.screen.bearings), ("bearings",),
    ),
    Quantity(
        "dissipated_power", "dissipated power", "P", "W", "kW",
        "Mean power that all dampers turn into heat; the motor must be larger.",
        _dissipated_power, _NORMAL,
    ),
    Quantity(
        "jump_margin", "margin to the jump", "", "", "%",
        "Distance of the speed from the nearest jump speed, as a share of the jump speed.",
        _jump_margin,
    ),
    Quantity(
        "throw_number", "throw number", "Kv", "", "",
        "Greatest acceleration normal to the deck over gravity's share; beyond 1 material flies.",
        _throw_number, (*_NORMAL, "deck_angle"),
    ),
)  # fmt: skip

QUANTITIES: Mapping[str, Quantity[Working]] = {quantity.name: quantity for quantity in _ALL}
