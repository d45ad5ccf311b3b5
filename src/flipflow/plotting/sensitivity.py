"""Sensitivities drawn: Sobol indices over frequency or as bars, and the tornado chart."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.errors import InputError
from flipflow.model.fields import symbol_of
from flipflow.model.quantities import quantity_named
from flipflow.plotting.figure import Figure
from flipflow.plotting.palette import CASES, HATCHES, case_colour, case_symbol
from flipflow.plotting.panels import Axis, Bar, Line, Panel, Trace, rows_axis
from flipflow.plotting.scales import HZ, MINUS, RPM, SHOWN
from flipflow.plotting.units import speed_of
from flipflow.studies.sensitivity import OneAtATime, Sensitivity

INDEX_AXIS = (-0.05, 1.05)
ROUNDING = 1e-12  # of a value


def sensitivity_figure(result: Sensitivity) -> Figure:
    """Sobol indices: lines over frequency, or bars beside the tornado chart at one frequency.

    Parameters
    ----------
    result
        What :func:`flipflow.sensitivity` returns.
    """
    if result.over_frequency:
        return _over_frequency(result)
    indices, changes = _index_panel(result), _tornado_panel(result, None)
    caption = (
        "Above: share of the variance that a field explains by itself (first order) and with all "
        f"it does together with others (total), with 95 % confidence. Below: {_one_at_a_time()}"
    )
    rows = len(result.names)
    return Figure(_title(result, None), caption, (indices, changes), height=230 + 64 * rows)


def tornado_figure(result: Sensitivity | OneAtATime, omega: float | None = None) -> Figure:
    """Signed change of the quantity with each field at the low and the high end of its range.

    Parameters
    ----------
    result
        What :func:`flipflow.sensitivity` returns.
    omega
        Where the result is one over frequency, one of its frequencies in rad/s; the nearest is
        taken.

    Raises
    ------
    InputError
        For a frequency outside those of the result, and where none is given and there are several.
    """
    at = _place(result, omega)
    panel = _tornado_panel(result, at)
    caption = _one_at_a_time().capitalize()
    return Figure(_title(result, at), caption, (panel,), height=90 + 26 * len(result.names))


def index_order(result: Sensitivity) -> list[int]:
    """Fields by their largest total index, falling."""
    total = np.atleast_2d(np.nan_to_num(result.total))
    return [int(i) for i in np.argsort(-total.max(axis=0), kind="stable")]


def changes(result: Sensitivity | OneAtATime, at: int | None) -> tuple[Real, Real]:
    """Change at the low and the high end of each field, (D,) each, in the quantity's shown unit."""
    scale = SHOWN[quantity_named(result.quantity, result.machine).shown_unit]
    pick = slice(None) if at is None else at
    nominal = np.asarray(result.nominal)[() if at is None else at]
    low, high = (end[pick] - nominal for end in (result.at_low, result.at_high))
    # What is nothing but rounding is no change, and has no sign.
    least = ROUNDING * np.abs(nominal)
    low, high = (
        np.where(np.isfinite(end) & (np.abs(end) <= least), 0.0, end) for end in (low, high)
    )
    return low * scale, high * scale


def _over_frequency(result: Sensitivity) -> Figure:
    panels = (
        _lines(result, result.total, result.total_confidence, "total index"),
        _lines(result, result.first_order, result.first_order_confidence, "first-order index"),
    )
    caption = (
        "Share of the variance of the quantity that goes with each field: with all it does "
        "together with others (total), and by itself (first order). Shaded: 95 % confidence."
    )
    return Figure(_title(result, None), caption, panels, height=660)


def _lines(result: Sensitivity, index: Real, width: Real, label: str) -> Panel:
    omega = np.asarray(result.omega)
    order = np.argsort(omega)
    x = omega[order] * RPM
    areas, lines = [], []
    for rank, i in enumerate(index_order(result)):
        y, half = index[order, i], width[order, i]
        name = symbol_of(result.names[i])
        areas.append(
            Trace(f"{name}, 95 %", x, y + half, "case band", "case band", legend=False,
                  lower=y - half)
        )  # fmt: skip
        lines.append(
            Trace(name, x, y, colour=case_colour(rank), symbol=case_symbol(rank), bold=rank == 0,
                  dash="dash" if rank >= CASES else "", x_also=(("Hz", omega[order] * HZ),))
        )  # fmt: skip
    return Panel(
        Axis("shaft speed", "rpm", (float(x.min()), float(x.max()))),
        Axis(label, "", INDEX_AXIS), traces=(*areas, *lines),
    )  # fmt: skip


def _index_panel(result: Sensitivity) -> Panel:
    order = index_order(result)
    bars: list[Bar] = []
    for rank, i in enumerate(order):
        y = float(len(order) - 1 - rank)
        pairs = (
            ("total", 0.19, "case 0", "", result.total, result.total_confidence),
            ("first order", -0.19, "case 1", HATCHES[1], result.first_order,
             result.first_order_confidence),
        )  # fmt: skip
        for name, shift, colour, hatch, index, width in pairs:
            if np.isfinite(index[i]):
                text = f"{index[i]:.3f} ± {width[i]:.3f}"
                low, high = sorted((0.0, float(index[i])))
                bars.append(Bar(name, y + shift, low, high, 0.34, colour, hatch, rank == 0, text))
    return Panel(
        Axis("Sobol index", "", (min(INDEX_AXIS[0], *(bar.low for bar in bars), 0.0), 1.25)),
        rows_axis([_row(result, i) for i in order]), bars=tuple(bars),
    )  # fmt: skip


def _tornado_panel(result: Sensitivity | OneAtATime, at: int | None) -> Panel:
    quantity = quantity_named(result.quantity, result.machine)
    ends = np.stack(changes(result, at))
    order = [int(i) for i in np.argsort(-np.nan_to_num(np.abs(ends)).max(axis=0), kind="stable")]
    bars = list(_tornado_bars(ends, order))
    reach = max((max(-bar.low, bar.high) for bar in bars), default=0.0) or 1.0
    return Panel(
        Axis(f"change of {quantity.label}", quantity.shown_unit, (-1.25 * reach, 1.25 * reach)),
        rows_axis([_row(result, i) for i in order]), bars=tuple(bars),
        lines=(Line("x", 0.0, "", "mark", "solid"),),
    )  # fmt: skip


def _tornado_bars(ends: Real, order: list[int]) -> Iterator[Bar]:
    words = ("field at its low end", "field at its high end")
    for rank, i in enumerate(order):
        y = float(len(order) - 1 - rank)
        for k, change in enumerate(ends[:, i].tolist()):
            if np.isfinite(change):
                low, high = sorted((0.0, change))
                yield Bar(words[k], y + 0.19 - 0.38 * k, low, high, 0.34, f"case {3 - k}",
                          HATCHES[k], rank == 0)  # fmt: skip


def _row(result: Sensitivity | OneAtATime, i: int) -> str:
    """The field, and how far its ends lie from the machine's own value."""
    nominal, name = result.own[i], symbol_of(result.names[i])
    ends = result.ends[i]
    if not isinstance(nominal, float) or not np.isfinite(nominal) or nominal == 0.0:
        return name
    low, high = (100.0 * (float(end) / nominal - 1.0) for end in ends)  # type: ignore[arg-type]
    return f"{name} {low:+.3g} to {high:+.3g} %".replace("-", MINUS)


def _title(result: Sensitivity | OneAtATime, at: int | None) -> str:
    label = quantity_named(result.quantity, result.machine).label
    if isinstance(result.omega, float):
        return f"Sensitivity of {label} at {speed_of(result, result.omega)}"
    if at is None:
        return f"Sensitivity of {label}"
    return f"Sensitivity of {label} at {speed_of(result, np.asarray(result.omega)[at])}"


def _one_at_a_time() -> str:
    return "change of the quantity when one field alone moves to the low or high end of its range."


def _place(result: Sensitivity | OneAtATime, omega: float | None) -> int | None:
    """Index of the frequency; None where there is but one."""
    if not result.over_frequency:
        return None
    known = np.asarray(result.omega)
    low, high = float(known.min()), float(known.max())
    if omega is None or not low <= omega <= high:
        raise InputError("omega", omega, f"give a frequency from {low:.6g} to {high:.6g} rad/s")
    return int(np.abs(known - omega).argmin())
