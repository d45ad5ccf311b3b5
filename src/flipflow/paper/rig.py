"""The test rig of Section 5: its points as published, and the bundled rig that has them."""

from __future__ import annotations

import math

from flipflow.io.project import load_project
from flipflow.model.project import Project

RIG = "rig-lin2024"
# (rad/s, mm) before and after each jump; the speed was changed in steps of 30 rpm.
BEFORE_UP, AFTER_UP = (120.17, 2.85), (123.31, 0.54)
BEFORE_DOWN, AFTER_DOWN = (95.03, 1.97), (91.89, 2.52)
STEP = math.pi
POINT_A, POINT_B = 2.6, 1.25
AT_A = 12.0


def rig() -> Project:
    """The bundled rig, identified from these points."""
    return load_project(RIG)
