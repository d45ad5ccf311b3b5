"""What tolerances cost, drawn: the share of machines that pass against their width."""

from __future__ import annotations

import numpy as np

from flipflow.model.arguments import checked_index
from flipflow.model.fields import symbol_of
from flipflow.plotting.figure import Figure
from flipflow.plotting.panels import Axis, Bar, Line, Panel, Trace, rows_axis
from flipflow.plotting.study import speed_in_words
from flipflow.studies.tolerance import Tolerance, limits_in_words, stands_out


def tolerance_figure(found: Tolerance, at: int = 0) -> Figure:
    """The share that passes against the width of all tolerances, and with each of them halved.

    Parameters
    ----------
    found
        What :func:`flipflow.tolerance` returns.
    at
        Index of the frequency.
    """
    checked_index("at", at, found.omega.size, "give the index of a frequency of the study")
    known = np.isfinite(found.scaled[:, at])
    factors, share = found.factors[known], 100.0 * found.scaled[known, at]
    low, high = (100.0 * found.scaled_interval[known, at, k] for k in (0, 1))
    if not known.any():
        interval = 100.0 * found.share_interval[at]
        factors, share = np.ones(1), 100.0 * found.share[at : at + 1]
        low, high = interval[:1], interval[1:]
    band = Trace("95 % confidence", factors, high, "case band", "case band", lower=low)
    met = limits_in_words(found.limits, found.checked)
    alone = factors.size == 1  # a list of machines, or too few of them to be weighted
    if alone:
        ends = np.concatenate([low, high])
        band = Trace("95 % confidence", np.repeat(factors, 2), ends, colour="gap", bold=True)
    line = Trace(
        f"share that meets {met}", factors, share, colour="relative", bold=True,
        symbol="circle" if alone else None,
    )  # fmt: skip
    above = Panel(
        Axis("all tolerances times", ""), Axis("machines that pass", "%", (0.0, 102.0)),
        (band, line), lines=() if alone else (Line("x", 1.0, "as given", "mark"),),
    )  # fmt: skip
    rows = [i for i in range(len(found.names)) if np.isfinite(found.halved[i, at])]
    order = sorted(rows, key=lambda i: -found.gain[i, at])
    panels: tuple[Panel, ...] = (above,)
    if order:
        panels += (_halved_panel(found, at, order),)
    caption = (
        f"{'Above: the' if order else 'The'} share of built machines that meet {met} in every "
        "load case, against a factor on all tolerances."
    )
    if order:
        caption += (
            " Below: the same with one tolerance alone half as wide; a bar to the right is what "
            f"that would gain.{_noise_words(found, at, order)}"
        )
    if alone:
        caption += " Other factors need machines drawn at random, and more of them."
    title = f"What tolerances cost{speed_in_words(found, found.omega[at])}"
    return Figure(title, caption, panels, height=300 + 60 + 30 * len(order))


def _halved_panel(found: Tolerance, at: int, order: list[int]) -> Panel:
    """The share with the tolerance of one field halved, a bar for each field."""
    bars = tuple(_bar(found, i, at, float(len(order) - 1 - k)) for k, i in enumerate(order))
    reach = [bar.low for bar in bars] + [bar.high for bar in bars]
    margin = max(0.25 * (max(reach) - min(reach)), 2.0)
    return Panel(
        Axis("machines that pass with one tolerance halved", "%",
             (max(min(reach) - margin, 0.0), max(reach) + margin)),
        rows_axis([symbol_of(found.names[i]) for i in order]), bars=bars,
        lines=(Line("x", 100.0 * found.share[at], "as given", "mark", "solid"),),
    )  # fmt: skip


def _noise_words(found: Tolerance, at: int, order: list[int]) -> str:
    """What grey bars are, where there are some."""
    if bool(stands_out(found)[order, at].all()):
        return ""
    return (
        " Grey: the change lies within the 95 % confidence interval, so that it may be chance; "
        "more machines would tell."
    )


def _bar(found: Tolerance, field: int, at: int, height: float) -> Bar:
    """From the share as given to that with the tolerance of one field halved."""
    low, high = sorted(100.0 * share for share in (found.share[at], found.halved[field, at]))
    colour = "allowed" if found.gain[field, at] >= 0.0 else "limit"
    if not stands_out(found)[field, at]:
        colour = "mark"
    words = f"{100.0 * found.halved[field, at]:.1f} %"
    return Bar("", height, low, high, 0.5, colour, text=words)
