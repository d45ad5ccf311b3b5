"""Figure 8: what a load does to the relative amplitude, with stop and without."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from flipflow.model.screen import FlipFlowScreen, Load
from flipflow.paper.claims import (
    Claim,
    Evaluation,
    Name,
    Number,
    Part,
    Verdict,
    agrees,
    decide,
    runs,
    undecided,
)
from flipflow.paper.figure import PaperFigure
from flipflow.paper.trends import SECOND, SECOND_PEAK, UP, Trend
from flipflow.periodic.options import HarmonicBalance
from flipflow.plotting.figure import Figure
from flipflow.plotting.loading import loading_figure
from flipflow.plotting.scales import MM
from flipflow.report.blocks import Cell, Column, Table, cells
from flipflow.report.numbers import number
from flipflow.studies.loading import (
    Change,
    Loading,
    RegionChange,
    change_at,
    loading,
)
from flipflow.studies.response_family import ResponseFamily, response_family

TITLE = "Relative amplitude under load, with stop and without"
LOAD = Load(stiffness_factor=1.3, name="k2 x 1.3")
STIFFER = (1.0, 1.1, 1.2, 1.3)
WARMER = (0.7, 0.8, 0.9)
ALMOST_EQUAL, FAR_SMALLER = 0.25, 0.5
NO_STOP = "a stop that is reached"
SAID = (
    "Loaded minus empty relative amplitude, exact, as the speed rises slowly. Small: share of the "
    "empty machine's amplitude, and the speed. Least and greatest are in size; 0 where the change "
    "has both signs. A region starts where that of the unloaded or of the loaded machine does. It "
    "ends where that of the unloaded one ends: beyond, the empty machine may have jumped."
)


@dataclass(frozen=True, eq=False)
class Loads:
    """The paper's load, smaller ones, and warmth, which softens the shear springs."""

    loading: Loading
    balance: Loading
    stiffer: ResponseFamily
    warm: Mapping[float, Loading]


def compute(screen: FlipFlowScreen) -> Loads:
    """Exactly, over the whole range of speed."""
    k2 = screen.shear_stiffness
    stiffer = response_family(screen, {"shear_stiffness": [f * k2 for f in STIFFER]})
    warm = {f: loading(screen, Load(stiffness_factor=f)) for f in WARMER}
    balance = loading(screen, LOAD, method=HarmonicBalance(3))
    return Loads(loading(screen, LOAD), balance, stiffer, warm)


def draw(data: Loads) -> Figure:
    """Both machines, empty and loaded; harmonic balance beneath."""
    return loading_figure(data.loading, TITLE, data.balance)


def tables(data: Loads) -> tuple[Table, ...]:
    """Changes at the ends of each region, least, greatest; and the straight lines."""
    found = [
        (f"{word}, {name}", region)
        for word, one in (("k2 x 1.3", data.loading), *_warm(data))
        for name, region in _regions(one)
    ]
    head = Column("Load, machine, region in rad/s")
    changes = (
        head, Column("Lower end", "mm", numeric=True), Column("Upper end", "mm", numeric=True),
        Column("Least", "mm", numeric=True), Column("Greatest", "mm", numeric=True),
    )  # fmt: skip
    lines = (
        head, Column("Ends: intercept", "mm", numeric=True),
        Column("slope", "mm s/rad", numeric=True), Column("Fit: intercept", "mm", numeric=True),
        Column("slope", "mm s/rad", numeric=True),
    )  # fmt: skip
    return (
        Table("Change of the relative amplitude", changes, tuple(_row(*o) for o in found), SAID),
        Table("Straight lines of the change", lines, tuple(_line_row(*o) for o in found)),
    )


def _warm(data: Loads) -> Iterator[tuple[str, Loading]]:
    yield from ((f"k2 x {factor:g}", one) for factor, one in data.warm.items())


def _regions(one: Loading) -> Iterator[tuple[str, RegionChange]]:
    for name, machine in (("with stop", one.with_stop), ("without", one.without_stop)):
        if machine is None:
            continue
        yield name, machine.region
        if machine.from_loaded is not None:
            yield name, machine.from_loaded


def _row(word: str, region: RegionChange) -> tuple[Cell, ...]:
    four = (region.at_lower, region.at_upper, region.least, region.greatest)
    return (_head(word, region), *(_changed(change) for change in four))


def _line_row(word: str, region: RegionChange) -> tuple[Cell, ...]:
    lines = (region.line_through_ends, region.line_of_least_squares)
    numbers = [MM * one for line in lines for one in (line.intercept, line.slope)]
    return (_head(word, region), *cells(*map(number, numbers)))


def _head(word: str, region: RegionChange) -> Cell:
    return Cell(word, f"{region.start}, {region.lower:.4g} to {region.upper:.4g}")


def _changed(change: Change) -> Cell:
    shown = f"{round(MM * change.change, 3) + 0.0:.3f}"
    return Cell(shown, f"{100.0 * change.share:.1f} % at {change.omega:.4g}")


def _reduced(name: str, change: Change) -> dict[Name, Number]:
    """A row of a table: how much less, its share, and the speed."""
    return {
        (name, "reduction"): Number(-MM * change.change, "mm"),
        (name, "share"): Number(-100.0 * change.share, "%"),
        (name, "at"): Number(change.omega, "rad/s"),
    }


def with_stop(data: Loads) -> Evaluation:
    """M1: least 1.1 mm (15 %) and greatest 5.5 mm (14 %) within the region; w_lb stands beside."""
    machine = data.loading.with_stop
    if machine is None or machine.unloaded_marks.omega_lb is None:
        return undecided("a stop that is reached, and a fold")
    parts: list[Part] = []
    numbers: dict[Name, Number] = {}
    for name, region in (
        ("region of the unloaded machine", machine.region),
        ("region of the loaded machine", machine.from_loaded),
    ):
        if region is not None:
            parts += _within(f", {name}", region, (1.1, 15.0), (5.5, 14.0))
            numbers |= _reduced(f"least, {name}", region.least)
            numbers |= _reduced(f"greatest, {name}", region.greatest)
    numbers |= _reduced("at w_lb", machine.region.at_upper)
    late = machine.from_loaded
    if late is not None:
        numbers |= _reduced("where the loaded machine's contact begins", late.at_lower)
    balance = data.balance.with_stop
    if balance is not None:
        numbers |= _reduced("least, third-order balance", balance.region.least)
        numbers |= _reduced("greatest, third-order balance", balance.region.greatest)
        numbers |= _reduced("at w_lb, third-order balance", balance.region.at_upper)
    found = decide(parts, numbers)
    if found.verdict is Verdict.HOLDS:
        return found
    words = ", ".join(
        f"{name} {-MM * change.change:.2f} mm ({-100.0 * change.share:.1f} %)"
        for name, change in (
            ("least", machine.region.least),
            ("greatest", machine.region.greatest),
            ("at w_lb", machine.region.at_upper),
        )
    )
    return replace(found, note=f"Computed: {words}.")


def without_stop(data: Loads) -> Evaluation:
    """M2: least 1.0 mm (33 %) and greatest 6.0 mm (49 %) within [w_ea, w_ar]."""
    machine = data.loading.without_stop
    region = machine.region
    # The paper names its region in whole rad/s, 66 to 93.
    start, end = (
        change_at(machine.unloaded, machine.loaded, float(math.floor(w)))
        for w in (region.lower, region.upper)
    )
    numbers = _reduced("least", region.least) | _reduced("greatest", region.greatest)
    numbers |= _reduced("lower end in whole rad/s", start) | _reduced("upper end", end)
    return decide(list(_within("", region, (1.0, 33.0), (6.0, 49.0))), numbers)


def _within(
    where: str, region: RegionChange, least: tuple[float, float], greatest: tuple[float, float]
) -> Iterator[Part]:
    """The least and the greatest reduction of a region against mm and % of the paper."""
    pairs = (("least", region.least, least), ("greatest", region.greatest, greatest))
    for word, change, (amount, share) in pairs:
        yield Part(f"{word} {amount} mm{where}", agrees(-MM * change.change, amount, 1))
        yield Part(f"{word}, {share:.0f} %{where}", agrees(-100.0 * change.share, share, 0))


def peak_moves(data: Loads) -> Evaluation:
    """M3: both trends over k2 x 1.0 ... 1.3."""
    labels = [f"k2 x {factor:g}" for factor in STIFFER]
    found = [Trend(q, UP).evaluate(data.stiffer, labels) for q in (SECOND, SECOND_PEAK)]
    numbers = {**found[0].numbers, **found[1].numbers}
    parts = [
        Part(f"{quantity.name}, {part.what}", part.answer)
        for quantity in (SECOND, SECOND_PEAK)
        for part in _rises(quantity.along(data.stiffer).tolist(), labels)
    ]
    return decide(parts, numbers)


def straight_lines(data: Loads) -> Evaluation:
    """M4: intercepts about equal, slope with stop far smaller; four ways to draw the line."""
    machine, bare = data.loading.with_stop, data.loading.without_stop
    if machine is None or machine.unloaded_marks.omega_cs is None:
        return undecided(NO_STOP)
    ways = [("region of the unloaded machine", machine.region, bare.region)]
    if machine.from_loaded is not None and bare.from_loaded is not None:
        ways.append(("region of the loaded machine", machine.from_loaded, bare.from_loaded))
    parts: list[Part] = []
    numbers: dict[Name, Number] = {}
    for way, *regions in ways:
        for how in ("ends", "least squares"):
            row = f"{way}, {how}"
            stopped, free = (
                one.line_through_ends if how == "ends" else one.line_of_least_squares
                for one in regions
            )
            for name, line in (("with stop", stopped), ("without stop", free)):
                numbers[row, f"intercept, {name}"] = Number(MM * line.intercept, "mm")
                numbers[row, f"slope, {name}"] = Number(MM * line.slope, "mm s/rad")
            a, b = stopped.intercept, free.intercept
            equal = abs(a - b) < ALMOST_EQUAL * max(abs(a), abs(b))
            parts.append(Part(f"intercepts equal within 25 %, {row}", equal))
            flat = abs(stopped.slope) < FAR_SMALLER * abs(free.slope)
            parts.append(Part(f"slope less than half, {row}", flat))
    return decide(parts, numbers)


def wider_and_higher(data: Loads) -> Evaluation:
    """M5: [w_cs, w_lb] against [w_ea, w_ar] of the empty machine."""
    machine, bare = data.loading.with_stop, data.loading.without_stop.region
    if machine is None or machine.unloaded_marks.omega_cs is None:
        return undecided(NO_STOP)
    stopped = machine.region
    parts = [
        Part("wider", stopped.upper - stopped.lower > bare.upper - bare.lower),
        Part("begins higher", stopped.lower > bare.lower),
        Part("ends higher", stopped.upper > bare.upper),
    ]
    ends = {"with stop": stopped, "without stop": bare}
    numbers: dict[Name, Number] = {}
    for name, region in ends.items():
        numbers["from", name] = Number(region.lower, "rad/s")
        numbers["to", name] = Number(region.upper, "rad/s")
        numbers["width", name] = Number(region.upper - region.lower, "rad/s")
    return decide(parts, numbers)


def heat(data: Loads) -> Evaluation:
    """M6: softer shear springs change the relative amplitude less with stop than without."""
    parts: list[Part] = []
    numbers: dict[Name, Number] = {}
    for factor, one in data.warm.items():
        machine, bare = one.with_stop, one.without_stop.region
        if machine is None or machine.unloaded_marks.omega_cs is None:
            return undecided(NO_STOP)
        stopped = machine.region
        name = f"k2 x {factor:g}"
        for word, region in (("with stop", stopped), ("without stop", bare)):
            worst, slope = region.greatest, MM * region.line_through_ends.slope
            numbers[f"greatest change, {word}", name] = Number(MM * worst.change, "mm")
            numbers[f"its share, {word}", name] = Number(100.0 * worst.share, "%")
            numbers[f"slope through the ends, {word}", name] = Number(slope, "mm s/rad")
        fold = machine.loaded_marks.omega_ub
        numbers["upper jump speed w_ub, with stop", name] = Number(fold, "rad/s")
        numbers["end of the region, with stop", name] = Number(stopped.upper, "rad/s")
        parts += [
            Part(
                f"{name}: smaller greatest change in percent",
                abs(stopped.greatest.share) < abs(bare.greatest.share),
            ),
            Part(
                f"{name}: smaller greatest change in mm",
                abs(stopped.greatest.change) < abs(bare.greatest.change),
            ),
            Part(f"{name}: no jump down in the region", fold is None or fold > stopped.upper),
        ]
    return decide(parts, numbers)


def _rises(values: list[float], labels: list[str]) -> Iterator[Part]:
    steps = itertools.pairwise(values)
    yield from runs(labels, [b > a if math.isfinite(b - a) else None for a, b in steps])


FIGURE = PaperFigure(
    "figure-08", TITLE, compute, draw,
    (
        Claim("M1", "Fig. 8a, 4.2", "with stop, k2 x 1.3 reduces the relative amplitude within the "
              "region by 1.1 mm (15 %) at least and 5.5 mm (14 %) at most", with_stop),
        Claim("M2", "Fig. 8b, 4.2", "without stop, k2 x 1.3 reduces it within its own region by "
              "1.0 mm (33 %) at least and 6.0 mm (49 %) at most", without_stop),
        Claim("M3", "4.2", "as load grows, w02 moves right and its peak grows", peak_moves),
        Claim("M4", "4.2", "straight lines of the change over the region have about equal "
              "intercepts, and with stop a far smaller slope", straight_lines),
        Claim("M5", "4.2", "with stop the operating region is wider and lies higher",
              wider_and_higher),
        Claim("M6", "Abstract", "heat, a softer shear spring, is met in the same way", heat),
    ),
    tables, needs_stop=False,
)  # fmt: skip
