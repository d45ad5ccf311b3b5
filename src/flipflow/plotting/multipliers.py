"""Multipliers along a branch: their sizes over the parameter, and their way in the plane."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment

from flipflow.compiled.arrays import Complex
from flipflow.continuation.branch import Branch
from flipflow.continuation.field_branch import FieldBranch
from flipflow.plotting.branches import field_axis
from flipflow.plotting.figure import Figure
from flipflow.plotting.palette import case_colour, case_symbol
from flipflow.plotting.panels import Axis, Line, Panel, Trace
from flipflow.plotting.response import speed_axis
from flipflow.plotting.scales import RPM

MOST_SHOWN = 6
WIDEST = 1.6  # of the plane around the unit circle
CIRCLE = np.exp(2j * np.pi * np.linspace(0.0, 1.0, 181))


def multipliers_figure(branch: Branch | FieldBranch) -> Figure:
    """|mu| of each multiplier over the parameter, and mu beside the unit circle."""
    if isinstance(branch, Branch):
        x, axis = branch.omega * RPM, speed_axis(branch.omega)
    else:
        axis, scale = field_axis(branch.field, branch.values)
        x = branch.values * scale
    tracked = tracked_multipliers(branch.multipliers)
    largest = np.nanmax(np.abs(tracked), axis=0, initial=0.0)
    tracked = tracked[:, np.sort(np.argsort(-largest, kind="stable")[:MOST_SHOWN])]
    sizes, ways = [], [Trace("unit circle", CIRCLE.real, CIRCLE.imag, colour="gap")]
    for k, mu in enumerate(tracked.T):
        name, colour = f"multiplier {k + 1}", case_colour(k)
        sizes.append(Trace(name, x, np.abs(mu), colour=colour, symbol=case_symbol(k)))
        ways.append(Trace(name, mu.real, mu.imag, colour=colour, legend=False))
    ends = 1.05 * max(1.0, float(np.abs(tracked).max(initial=1.0)))
    left = Panel(axis, Axis("|multiplier|", "", (0.0, ends)), tuple(sizes), lines=(Line("y", 1.0),))
    wide = min(ends, WIDEST)
    right = Panel(
        Axis("real part", "", (-wide, wide)), Axis("imaginary part", "", (-wide, wide)),
        tuple(ways), equal=True,
    )  # fmt: skip
    caption = (
        "Factors by which small disturbances grow over a period; each line is one multiplier, "
        "followed along the branch. Below 1 the motion returns."
        + (f" The {MOST_SHOWN} that grow largest." if largest.size > MOST_SHOWN else "")
        + (f" The plane ends at {WIDEST}." if ends > WIDEST else "")
    )
    return Figure("Multipliers", caption, (left, right), 2, 320, (0.6, 0.4))


def tracked_multipliers(multipliers: Complex) -> Complex:
    """Rows (n, 2 N) reordered so that each column is one multiplier along the branch."""
    tracked = np.array(multipliers)
    for p in range(1, tracked.shape[0]):
        away = np.abs(tracked[p - 1][:, None] - multipliers[p][None, :])
        if np.isfinite(away).all():
            tracked[p] = multipliers[p][linear_sum_assignment(away)[1]]
    return tracked
