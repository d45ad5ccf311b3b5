"""Results as bars: allowed speeds of every limit, and where the power goes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from flipflow.model.numerals import rpm
from flipflow.model.quantities import QUANTITIES
from flipflow.plotting.figure import Figure
from flipflow.plotting.layout import NAME_LETTERS, short_names, within
from flipflow.plotting.palette import CASES, HATCHES, case_colour
from flipflow.plotting.panels import Axis, Band, Bar, Line, Note, Panel, rows_axis
from flipflow.plotting.scales import RPM
from flipflow.studies.assessment import Assessment
from flipflow.studies.feasible import CaseWindow
from flipflow.studies.operating_region import OperatingRegion

TAKERS = {
    "isolation": "isolation (c1)",
    "shear": "shear springs (c2)",
    "stop": "stops (c3)",
    "normal": "isolation, normal direction (c1n)",
}
LEAST_KILOWATTS = 100.0  # W
MOST_BARS, FAR_APART = 50, 20
LIMIT_WORDS = {"stability": "returns after a disturbance", "speed": "speed of the drive"}


def region_figure(region: OperatingRegion, omega: float | None = None) -> Figure:
    """Speeds allowed by each limit in each load case, and by all of them together.

    Parameters
    ----------
    region
        What :func:`flipflow.operating_region` returns.
    omega
        Working speed in rad/s, marked where it is given.

    Returns
    -------
    Figure
        One panel of bars over rpm.
    """
    limits = list(dict.fromkeys(name for case in region.cases for name in case.intervals))
    rows = ["allowed speed range", "operating region", *limits]
    heights = {name: float(len(rows) - 1 - k) for k, name in enumerate(rows)}
    ends = _span(region)
    bars = [
        Bar(rows[0], heights[rows[0]], low * RPM, high * RPM, 0.6, "allowed")
        for low, high in region.feasible
    ]
    # Notes, for lines cross this row and would cross the words of bars.
    words = [
        Note(high * RPM + 0.01 * (ends[1] - ends[0]), heights[rows[0]],
             f"{rpm(low)} to {rpm(high)} rpm")
        for low, high in region.feasible
    ]  # fmt: skip
    if not words:
        words = [Note((ends[0] + ends[1]) / 2.0, heights[rows[0]], "none", "center")]
    lower, upper = max(region.lower * RPM, ends[0]), min(region.upper * RPM, ends[1])
    if lower < upper:
        bars.append(Bar(rows[1], heights[rows[1]], lower, upper, 0.6, "mark"))
    shown = short_names([case.name for case in region.cases])
    for k, case in enumerate(region.cases):
        bars += _case_bars(k, replace(case, name=shown[k]), len(region.cases), heights)
    few = len(region.cases) <= CASES
    if not few:
        bars = [replace(bar, legend=False) for bar in bars]
    lines = tuple(
        Line("x", at * RPM, text, "mark")
        for text, at in _landmarks(region)
        if at is not None and ends[0] <= at * RPM <= ends[1]
    )
    if omega is not None:
        lines += (Line("x", omega * RPM, f"{rpm(omega)} rpm", "speed", "dashdot"),)
    bands = tuple(Band("x", low * RPM, high * RPM) for low, high in region.feasible)
    panel = Panel(
        Axis("shaft speed", "rpm", ends), rows_axis([_word(name) for name in rows]),
        bars=tuple(bars), lines=lines, bands=bands, notes=tuple(words),
    )  # fmt: skip
    order = "" if few else ", one below the other in the order of their table"
    caption = (
        f"Each bar: the speeds at which a limit is met in a load case{order}. The machine may run "
        "where all bars overlap, within the operating region (contact begins at w_cs; equal "
        "amplitudes at w_ea; antiresonance of the main frame at w_ar; jump speeds w_lb and w_ub)."
    )
    return Figure("Allowed speed range", caption, (panel,), height=120 + 28 * len(rows))


def energy_figure(assessment: Assessment) -> Figure | None:
    """Power fed in by the exciter and where it goes, for each load case; the first fifty of many.

    A name longer than a third of the width is cut off: the tables have it whole.
    """
    cases = [case for case in assessment.cases if case.energy][:MOST_BARS]
    if not cases:
        return None
    # Two lines of words where bars are that far apart.
    pitch, lines = (34, 2) if len(cases) <= FAR_APART else (18, 1)
    takers = [name for name in TAKERS if any(case.energy.get(name) for case in cases)]
    totals = [sum(case.energy.get(name, 0.0) for name in takers) for case in cases]
    scale, unit = (1e-3, "kW") if max(totals) >= LEAST_KILOWATTS else (1.0, "W")
    bars: list[Bar] = []
    for k, case in enumerate(cases):
        y = float(len(cases) - 1 - k)
        total = 0.0
        for name in takers:
            power = case.energy.get(name, 0.0) * scale
            hatch = HATCHES[list(TAKERS).index(name)]
            bars.append(
                Bar(TAKERS[name], y, total, total + power, 0.62, name, hatch, legend=k == 0)
            )
            total += power
        bars[-1] = replace(bars[-1], text=f"{total:.3g} {unit}")
    most = max(bar.high for bar in bars)
    panel = Panel(
        Axis("mean power", unit, (0.0, 1.15 * most)),
        rows_axis([within(case.name, NAME_LETTERS, lines) for case in cases], 0.55),
        bars=tuple(bars),
    )
    caption = (
        "Mean power over a turn that each damper turns into heat; together they are what the "
        "exciter feeds in. The motor also needs what bearings, belt and material take."
    )
    return Figure("Energy balance", caption, (panel,), height=120 + pitch * len(cases))


def _case_bars(
    index: int, case: CaseWindow, count: int, heights: dict[str, float]
) -> Iterator[Bar]:
    """Bars of one case, one below the other within the row of each limit."""
    step = 0.76 / count
    first = True
    for name, intervals in case.intervals.items():
        y = heights[name] + 0.38 - step * (index + 0.5)
        for low, high in intervals:
            yield Bar(
                case.name, y, low * RPM, high * RPM, 0.8 * step, case_colour(index),
                HATCHES[index % CASES] if index else "", legend=first,
            )  # fmt: skip
            first = False


def _word(name: str) -> str:
    if name in LIMIT_WORDS:
        return LIMIT_WORDS[name]
    return QUANTITIES[name].label if name in QUANTITIES else name


def _landmarks(region: OperatingRegion) -> tuple[tuple[str, float | None], ...]:
    return (
        ("w_ea", region.omega_ea),
        ("w_ar", region.omega_ar),
        ("w_cs", region.omega_cs),
        ("w_lb", region.omega_lb),
        ("w_ub", region.omega_ub),
    )


def _span(region: OperatingRegion) -> tuple[float, float]:
    """All bars with a margin, rpm."""
    ends = [
        x for case in region.cases for group in case.intervals.values() for i in group for x in i
    ]
    ends += [x for interval in region.feasible for x in interval]
    if not ends:
        ends = [region.lower, region.upper]
    margin = 0.06 * (max(ends) - min(ends))
    return (min(ends) - margin) * RPM, (max(ends) + margin) * RPM
