"""Figure 8: what a load does to the relative amplitude, with stop and without."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from flipflow.model.screen import FlipFlowScreen, Load
from flipflow.paper.claims import Claim, Evaluation, Number, Part, agrees, decide, runs, undecided
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
    LoadedMachine,
    Loading,
    RegionChange,
    loading,
    relative_from_below,
)
from flipflow.studies.response_family import ResponseFamily, response_family

TITLE = "Relative amplitude under load, with stop and without"
LOAD = Load(stiffness_factor=1.3, name="k2 x 1.3")
STIFFER = (1.0, 1.1, 1.2, 1.3)
WARMER = (0.7, 0.8, 0.9)
PAST_CONTACT = 1.5
ALMOST_EQUAL, FAR_SMALLER = 0.25, 0.5
NO_STOP = "a stop that is reached"
SAID = (
    "Loaded minus empty relative amplitude, exact, as the speed rises slowly. Small: share of the "
    "empty machine's amplitude, and the speed. Least and greatest are in size; 0 where the change "
    "has both signs. A region starts where that of the unloaded or of the loaded machine does, and "
    "ends where that of the unloaded one ends."
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
        (word, name, region)
        for word, one in (("k2 x 1.3", data.loading), *_warm(data))
        for name, region in _regions(one)
    ]
    head = (Column("Load"), Column("Machine"), Column("Region starts as"))
    changes = (
        *head, Column("Speeds", "rad/s"), Column("Lower end", "mm", numeric=True),
        Column("Upper end", "mm", numeric=True), Column("Least", "mm", numeric=True),
        Column("Greatest", "mm", numeric=True),
    )  # fmt: skip
    lines = (
        *head, Column("Ends: intercept", "mm", numeric=True),
        Column("slope", "mm per rad/s", numeric=True),
        Column("Fit: intercept", "mm", numeric=True),
        Column("slope", "mm per rad/s", numeric=True),
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


def _row(word: str, name: str, region: RegionChange) -> tuple[Cell, ...]:
    return (
        *cells(word, name, region.start, f"{region.lower:.4g} to {region.upper:.4g}"),
        *(_changed(c) for c in (region.at_lower, region.at_upper, region.least, region.greatest)),
    )


def _line_row(word: str, name: str, region: RegionChange) -> tuple[Cell, ...]:
    lines = (region.line_through_ends, region.line_of_least_squares)
    numbers = [MM * one for line in lines for one in (line.intercept, line.slope)]
    return (*cells(word, name, region.start), *cells(*map(number, numbers)))


def _changed(change: Change) -> Cell:
    shown = f"{round(MM * change.change, 3) + 0.0:.3f}"
    return Cell(shown, f"{100.0 * change.share:.1f} % at {change.omega:.4g}")


def _numbers(name: str, change: Change) -> dict[str, Number]:
    return {
        name: Number(MM * change.change, "mm"),
        f"{name}, share": Number(100.0 * change.share, "%"),
        f"{name}, at": Number(change.omega, "rad/s"),
    }


def with_stop(data: Loads) -> Evaluation:
    """M1: the paper's least 1.1 mm (15 %) at the start and greatest 5.5 mm (14 %) at w_lb."""
    machine = data.loading.with_stop
    if machine is None or machine.unloaded_marks.omega_lb is None:
        return undecided("a stop that is reached, and a fold")
    whole, late = machine.region, machine.from_loaded
    numbers = _numbers("unloaded start", whole.at_lower)
    start = None
    if late is not None:
        start = _at(machine, late.lower + PAST_CONTACT)
        numbers |= _numbers("loaded start", late.at_lower)
        numbers |= _numbers("1.5 rad/s past the loaded start", start)
    numbers |= _numbers("w_lb", whole.at_upper)
    numbers |= _numbers("least in the region", whole.least)
    numbers |= _numbers("greatest in the region", whole.greatest)
    numbers |= _by_balance(data)
    parts = [
        Part("1.1 mm (15 %) at the unloaded machine's contact", _is(whole.at_lower, 1.1, 15.0)),
        Part(
            "1.1 mm (15 %) 1.5 rad/s past the loaded machine's contact",
            None if start is None else _is(start, 1.1, 15.0),
        ),
        Part("5.5 mm (14 %) at w_lb", _is(whole.at_upper, 5.5, 14.0)),
        Part("the start has the least reduction", whole.least.omega == whole.lower),
        Part("w_lb has the greatest reduction", whole.greatest.omega == whole.upper),
    ]
    return decide(parts, numbers)


def _by_balance(data: Loads) -> dict[str, Number]:
    """The same by the paper's third-order harmonic balance."""
    machine = data.balance.with_stop
    if machine is None or machine.from_loaded is None:
        return {}
    start = _at(machine, machine.from_loaded.lower + PAST_CONTACT)
    return (
        _numbers("1.5 rad/s past the loaded start, H = 3", start)
        | _numbers("w_lb, H = 3", machine.region.at_upper)
        | _numbers("greatest in the region, H = 3", machine.region.greatest)
    )


def without_stop(data: Loads) -> Evaluation:
    """M2: 1.0 mm (33 %) to 6.0 mm (49 %), read at whole rad/s as the paper quotes its region."""
    machine = data.loading.without_stop
    region = machine.region
    start, end = (_at(machine, float(math.floor(w))) for w in (region.lower, region.upper))
    parts = [
        Part("least 1.0 mm", agrees(-MM * start.change, 1.0, 1)),
        Part("its rate 33 %", agrees(-100.0 * start.share, 33.0, 0)),
        Part("greatest 6.0 mm", agrees(-MM * end.change, 6.0, 1)),
        Part("its rate 49 %", agrees(-100.0 * end.share, 49.0, 0)),
        Part("the least at the lower end", region.least.omega == region.lower),
        Part("the greatest at the upper end", region.greatest.omega == region.upper),
    ]
    numbers = _numbers("lower end in whole rad/s", start) | _numbers("upper end in whole", end)
    numbers |= _numbers("w_ea", region.at_lower) | _numbers("w_ar", region.at_upper)
    return decide(parts, numbers)


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
    ways = {
        "unloaded start, through the ends": (machine.region, bare.region, True),
        "unloaded start, least squares": (machine.region, bare.region, False),
        # The paper's least values fit the loaded machine with stop, the unloaded one without.
        "the paper's starts, through the ends": (machine.from_loaded, bare.region, True),
        "the paper's starts, least squares": (machine.from_loaded, bare.region, False),
    }
    parts: list[Part] = []
    numbers: dict[str, Number] = {}
    for way, (stopped, free, ends) in ways.items():
        if stopped is None:
            parts.append(Part(way, None))
            continue
        lines = [r.line_through_ends if ends else r.line_of_least_squares for r in (stopped, free)]
        for name, line in zip(("stop", "no stop"), lines, strict=True):
            numbers[f"intercept, {name}, {way}"] = Number(MM * line.intercept, "mm")
            numbers[f"slope, {name}, {way}"] = Number(MM * line.slope, "mm per rad/s")
        a, b = (line.intercept for line in lines)
        equal = abs(a - b) < ALMOST_EQUAL * max(abs(a), abs(b))
        parts.append(Part(f"intercepts equal within 25 %, {way}", equal))
        flat = abs(lines[0].slope) < FAR_SMALLER * abs(lines[1].slope)
        parts.append(Part(f"slope less than half, {way}", flat))
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
    numbers = {
        f"{name}, {end}": Number(getattr(region, end), "rad/s")
        for name, region in ends.items()
        for end in ("lower", "upper")
    }
    return decide(parts, numbers)


def heat(data: Loads) -> Evaluation:
    """M6: softer shear springs change the relative amplitude less with stop than without."""
    parts: list[Part] = []
    numbers: dict[str, Number] = {}
    for factor, one in data.warm.items():
        machine, bare = one.with_stop, one.without_stop.region
        if machine is None or machine.unloaded_marks.omega_cs is None:
            return undecided(NO_STOP)
        stopped = machine.region
        name = f"k2 x {factor:g}"
        for word, region in (("stop", stopped), ("no stop", bare)):
            numbers |= _numbers(f"greatest, {word}, {name}", region.greatest)
            slope = MM * region.line_through_ends.slope
            numbers[f"slope, {word}, {name}"] = Number(slope, "mm per rad/s")
        fold = machine.loaded_marks.omega_ub
        numbers[f"upper jump speed w_ub, {name}"] = Number(fold, "rad/s")
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


def _at(machine: LoadedMachine, omega: float) -> Change:
    """Both amplitudes at one speed as it rises; NaN where a branch does not reach."""
    return Change(
        omega, *(relative_from_below(b, omega) for b in (machine.unloaded, machine.loaded))
    )


def _is(change: Change, millimetres: float, percent: float) -> bool:
    """A reduction by the published amount and rate."""
    amount = agrees(-MM * change.change, millimetres, 1)
    return amount and agrees(-100.0 * change.share, percent, 0)


def _rises(values: list[float], labels: list[str]) -> Iterator[Part]:
    steps = itertools.pairwise(values)
    yield from runs(labels, [b > a if math.isfinite(b - a) else None for a, b in steps])


FIGURE = PaperFigure(
    "figure-08", TITLE, compute, draw,
    (
        Claim("M1", "Fig. 8a, 4.2", "with stop, k2 x 1.3 reduces the relative amplitude by least "
              "1.1 mm (15 %) at the start of the region and most 5.5 mm (14 %) at w_lb", with_stop),
        Claim("M2", "Fig. 8b, 4.2", "without stop, k2 x 1.3 reduces it by 1.0 mm (33 %) to "
              "6.0 mm (49 %) over its own region", without_stop),
        Claim("M3", "4.2", "as load grows, w02 moves right and its peak grows", peak_moves),
        Claim("M4", "4.2", "straight lines of the change over the region have about equal "
              "intercepts, and with stop a far smaller slope", straight_lines),
        Claim("M5", "4.2", "with stop the operating region is wider and lies higher",
              wider_and_higher),
        Claim("M6", "Abstract", "heat, a softer shear spring, is met in the same way", heat),
    ),
    tables, needs_stop=False,
)  # fmt: skip
