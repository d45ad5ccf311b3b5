"""Lyapunov exponents as they come to rest over the periods followed."""

from __future__ import annotations

import math

import numpy as np

from flipflow.model.screen import unit_in
from flipflow.plotting.figure import Figure
from flipflow.plotting.palette import case_colour, case_symbol
from flipflow.plotting.panels import Axis, Line, Panel, Trace
from flipflow.plotting.scales import MINUS
from flipflow.studies.lyapunov import LyapunovExponents

MOST_SHOWN = 6  # exponents that are drawn


def lyapunov_figure(result: LyapunovExponents) -> Figure:
    """Means up to each batch of forcing periods, with the standard error at the end."""
    batches, shown = result.batches.shape[0], min(result.exponents.size, MOST_SHOWN)
    count = np.arange(1.0, batches + 1.0)
    periods = count * result.periods / batches
    means = np.cumsum(result.batches, axis=0) / count[:, None]
    traces, unit = [], unit_in(result.machine, "1/s")
    for k in range(shown):
        name = _with_error(result.exponents[k], result.standard_error[k])
        traces.append(
            Trace(f"{name}{unit}", periods, means[:, k], "stable", case_colour(k), case_symbol(k),
                  bold=k == 0)
        )  # fmt: skip
    panel = Panel(
        Axis("forcing periods", ""), Axis("Lyapunov exponents", "1/s"), tuple(traces),
        lines=(Line("y", 0.0),),
    )  # fmt: skip
    caption = (
        f"Mean rates at which neighbouring motions part, up to each number of periods. The motion "
        f"is {result.word}. Above 0 neighbours part: chaos. All below 0: the motion comes to one "
        "that repeats. The legend gives the final values with their standard errors."
    )
    return Figure("Lyapunov exponents", caption, (panel,), height=340)


def _with_error(value: float, error: float) -> str:
    """A value and its standard error, to the second digit of the error."""
    if not (math.isfinite(value) and math.isfinite(error) and error > 0.0):
        return f"{value:.4g}"
    decimals = max(1 - math.floor(math.log10(error)), 0)
    return f"{value:.{decimals}f} ± {error:.{decimals}f}".replace("-", MINUS)
