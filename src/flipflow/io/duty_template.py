"""A commented duty file to start from."""

from __future__ import annotations

from flipflow.io.layout import FORMAT
from flipflow.io.source import bundled_names
from flipflow.model.duty import LEAST_GAP, LEAST_SHARE, OBJECTIVES

TEXT = """\
# A duty file of flipflow: what a machine is to do, and what may be chosen for it. As it stands it
# runs on the bundled ffs0827. Quantities stand in quotes with their unit and a decimal point.
format = {format}

# The machine to begin with: a machine file beside this one, or a bundled name: {bundled}.
machine = "ffs0827"

# What the machine is to do.
[duty]
relative_amplitude = "7 mm"  # half the peak-to-peak motion between the frames
tolerance = "0.8 mm"  # how far it may lie from that, whatever the load and the parts
speed = "800 rpm"  # or a range, ["780 rpm", "820 rpm"]
# Load cases of the machine file that count; left out, all. Or [[load_cases]] of this file.
load_cases = ["empty", "full, stiffening"]
# Temperatures of the rubber with which each load case is combined.
# temperatures = ["-10 degC", "50 degC"]
# What comes first, of {objectives}.
prefer = ["steadiness", "stop force"]
seed = 1

# What may be chosen: an interval, or a list of values. Gaps begin at {gap:g} mm and the shear
# stiffness at {share:g} times that of the machine: below, steadiness is bought from rubber that
# creeps and stops that wear.
[free]
shear_stiffness = "1000 kN/m..4000 kN/m"
stop_stiffness = "1000 kN/m..20000 kN/m"
clearance = "2 mm..9 mm"
eccentric_moment = "2000 kg mm..8000 kg mm"
# eccentric_moment = {{ choices = ["4000 kg mm", "4500 kg mm"] }}

# By how much built parts may differ from the drawing.
[scatter]
shear_stiffness = "10 %"
stop_stiffness = "15 %"

# Limits that take the place of the machine file's; those left out stay.
[limits]
shear_strain = "20 %"
stop_force = "40 kN"
foundation_force = "8 kN"

# Shear springs to choose from, in place of shear_stiffness above: a CSV or XLSX file with columns
# name, stiffness (of one), loss_factor, height, strain, force, price.
# [catalogue]
# file = "springs.csv"
# pieces = [8, 16]
"""


def duty_template() -> str:
    """Return a commented duty file.

    Returns
    -------
    str
        TOML that :func:`flipflow.load_duty` reads as it stands.
    """
    return TEXT.format(
        format=FORMAT, bundled=", ".join(bundled_names()), objectives=", ".join(OBJECTIVES),
        gap=1e3 * LEAST_GAP, share=LEAST_SHARE,
    )  # fmt: skip
