"""Numbers of nature and of units."""

from __future__ import annotations

import math

GRAVITY = 9.80665  # standard gravity, m/s^2
RPM = 30.0 / math.pi  # revolutions a minute in one rad/s
