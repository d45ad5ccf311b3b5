"""From SI to the units engineers read, for axes."""

from __future__ import annotations

import math

from flipflow.model import constants

RPM = constants.RPM
HZ = 0.5 / math.pi
MM = 1e3
KN = 1e-3
DEGREES = 180.0 / math.pi
MINUS = "\N{MINUS SIGN}"  # as matplotlib writes it

SPEEDS = {"rpm": RPM, "Hz": HZ, "rad/s": 1.0}
