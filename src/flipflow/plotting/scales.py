"""From SI to the units engineers read, for axes."""

from __future__ import annotations

import math
from collections.abc import Mapping

from flipflow.model import constants

RPM = constants.RPM
HZ = 0.5 / math.pi
MM = 1e3
KN = 1e-3
DEGREES = 180.0 / math.pi
MINUS = "\N{MINUS SIGN}"  # as matplotlib writes it

# What one of the SI unit of a quantity is in the unit that it is shown in.
SHOWN: Mapping[str, float] = {
    "mm": MM, "rpm": RPM, "kN": KN, "kW": 1e-3, "deg": DEGREES, "g": 1.0 / constants.GRAVITY,
    "%": 100.0, "h": 1.0 / 3600.0, **dict.fromkeys(("", "N", "W", "K", "m/s", "rad"), 1.0),
}  # fmt: skip
SPEEDS = {"rpm": RPM, "Hz": HZ, "rad/s": 1.0}
