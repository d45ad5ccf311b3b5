"""Figure 7: response of the machine with stop: harmonic balance, exact, Runge-Kutta sweeps."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Real
from flipflow.continuation.branch import Branch
from flipflow.continuation.frequency_response import frequency_response
from flipflow.dynamics.linear_response import linear_response
from flipflow.model.screen import FlipFlowScreen
from flipflow.paper.claims import (
    AGREEMENT,
    Claim,
    Evaluation,
    Name,
    Number,
    Part,
    decide,
    undecided,
)
from flipflow.paper.figure import PaperFigure
from flipflow.paper.runge_kutta import SteppedSweep, stepped_sweep
from flipflow.paper.thrown import Thrown, thrown, thrown_panel, thrown_to_the_lower
from flipflow.periodic.options import HarmonicBalance
from flipflow.periodic.orbit import Orbit
from flipflow.plotting.family import BALANCE, beneath_traces, branch_traces, speed_axis_in_radians
from flipflow.plotting.figure import Figure
from flipflow.plotting.panels import Axis, Band, Line, Panel, Trace
from flipflow.plotting.response import LABELS
from flipflow.plotting.scales import MM
from flipflow.studies.landmarks import Landmarks, analysed_range, landmarks
from flipflow.transient.sweep import Jump, Sweep, sweep

TITLE = "Amplitude over frequency of the machine with stop"
SAMPLES = 60
SAME = 1e-6
STEPS = 247
EVERY, BESIDE_FOLDS = 4, 3.0
INSIDE = 9
NO_FOLDS = "two folds"
CAPTION = (
    "Half the peak-to-peak motion. Solid: stable; dashed: unstable; crosses: folds, where the "
    f"amplitude jumps. Wide and pale beneath: {BALANCE}. Symbols: sweeps by the classical "
    "Runge-Kutta method in fixed steps of a fortieth of a turn or less. Green: the paper's "
    "operating region."
)
BLOW = (
    " Last: a blow throws the upper motion to the lower; shaded, from the least to the greatest "
    "relative displacement of each turn."
)


@dataclass(frozen=True, eq=False)
class Responses:
    """Branches, sweeps and region.

    Parameters
    ----------
    screen
        The machine.
    exact, balance
        The exact branch, and the paper's approximation of it.
    marks
        Its characteristic frequencies.
    settled
        Sweeps with rising and with falling speed, settled exactly.
    stepped
        The same by Runge-Kutta, at some of the speeds: ``rows`` of the rising sweep.
    thrown
        What a blow does between the folds; None without folds.
    """

    screen: FlipFlowScreen
    exact: Branch
    balance: Branch
    marks: Landmarks
    settled: tuple[Sweep, Sweep]
    stepped: tuple[SteppedSweep, SteppedSweep]
    rows: NDArray[np.intp]
    thrown: Thrown | None

    def settled_rows(self, way: int, which: str) -> Real:
        """Amplitude of a sweep settled exactly (0 rising, 1 falling) where Runge-Kutta went."""
        turned = 1 - 2 * way
        return self.settled[way].amplitude(which)[::turned][self.rows][::turned]


def compute(screen: FlipFlowScreen) -> Responses:
    """Both methods and both sweeps over the whole range."""
    low, high = analysed_range(screen)
    exact = frequency_response(screen, (low, high))
    balance = frequency_response(screen, (low, high), HarmonicBalance(3))
    marks = landmarks(screen, exact)
    omega = np.linspace(low, high, STEPS)
    rows = _rows(omega, marks)
    system = screen.system()
    blow = None
    if marks.omega_lb is not None and marks.omega_ub is not None:
        blow = thrown(screen, exact, _middle(marks.omega_lb, marks.omega_ub))
    return Responses(
        screen, exact, balance, marks, (sweep(screen, omega), sweep(screen, omega[::-1])),
        (stepped_sweep(system, omega[rows]), stepped_sweep(system, omega[rows][::-1])), rows, blow,
    )  # fmt: skip


def _rows(omega: Real, marks: Landmarks) -> NDArray[np.intp]:
    """Every fourth speed, and all from a little below the folds to a little above them."""
    taken = np.arange(omega.size) % EVERY == 0
    if marks.omega_lb is not None and marks.omega_ub is not None:
        taken |= (omega > marks.omega_lb - BESIDE_FOLDS) & (omega < marks.omega_ub + BESIDE_FOLDS)
    return np.flatnonzero(taken)


def _middle(low: float, high: float) -> float:
    """Between the folds, in whole rad/s where one lies between them."""
    middle = (low + high) / 2.0
    return float(round(middle)) if low < round(middle) < high else middle


def draw(data: Responses) -> Figure:
    """Main frame and relative motion, a panel each, and the blow."""
    panels = [_panel(data, which) for which in ("main", "relative")]
    if data.thrown is None:
        return Figure(TITLE, CAPTION, tuple(panels), height=500)
    panels.append(thrown_panel(data.thrown))
    return Figure(TITLE, CAPTION + BLOW, tuple(panels), height=720)


def _panel(data: Responses, which: str) -> Panel:
    first = which == "main"
    traces = (
        *beneath_traces(BALANCE, data.balance, which, legend=first),
        *branch_traces("exact", data.exact, which, 0, legend=first, bold=True),
        *_swept(data.stepped, which, legend=first),
    )
    marks = data.marks
    named = (("w_cs", marks.omega_cs), ("w_lb", marks.omega_lb), ("w_ub", marks.omega_ub))
    lines = tuple(Line("x", at, f"{name} {at:.5g}", "mark") for name, at in named if at is not None)
    top = max(float(trace.y.max()) for trace in traces)
    return Panel(
        speed_axis_in_radians(0.0, float(data.exact.omega.max())),
        Axis("amplitude", "mm", (0.0, 1.06 * top)), traces,
        bands=(Band("x", marks.lower, marks.upper),), lines=lines, title=LABELS[which],
    )  # fmt: skip


def _swept(
    stepped: tuple[SteppedSweep, SteppedSweep], which: str, *, legend: bool
) -> Iterator[Trace]:
    kinds = (("rising", "case 1", "circle-open"), ("falling", "case 2", "cross"))
    for one, (way, colour, symbol) in zip(stepped, kinds, strict=True):
        yield Trace(f"Runge-Kutta, speed {way}", one.omega, one.amplitude(which) * MM, "point",
                    colour, symbol=symbol, legend=legend)  # fmt: skip


def sweeps_agree(data: Responses) -> Evaluation:
    """N1: Runge-Kutta against third-order balance along both sweeps, and the jumps' speeds."""
    parts: list[Part] = []
    numbers: dict[Name, Number] = {}
    folds = [fold.omega for fold in data.balance.folds]
    ends = max(folds, default=None), min(folds, default=None)
    for way, (name, one, fold) in enumerate(
        zip(("rising", "falling"), data.stepped, ends, strict=True)
    ):
        same = True
        for which in ("main", "relative"):
            off = _difference(one, data.balance, which)
            k = int(np.nanargmax(off))
            label = f"{LABELS[which]}, speed {name}"
            parts.append(Part(f"{label}: within 2 %", bool(off[k] < AGREEMENT)))
            numbers["greatest difference", label] = Number(100.0 * float(off[k]), "%")
            numbers["at", label] = Number(float(one.omega[k]), "rad/s")
            exact = np.abs(one.amplitude(which) / data.settled_rows(way, which) - 1.0).max()
            same = same and bool(exact < AGREEMENT)
            numbers["Runge-Kutta against exact sweep", label] = Number(100.0 * exact, "%")
        # Runge-Kutta takes every speed around the folds, so it jumps where the exact sweep does.
        jumps = data.settled[way].jumps if same else ()
        parts.append(Part(f"speed {name}: jump at the fold of the balance", _only(jumps, fold)))
        numbers |= _jump_numbers(jumps, fold, name)
    return decide(parts, numbers)


def _difference(one: SteppedSweep, branch: Branch, which: str) -> Real:
    """From the nearest stable motion of a branch, relative; NaN where there is none."""
    off = np.full(one.omega.size, np.nan)
    for k, (omega, found) in enumerate(zip(one.omega, one.amplitude(which), strict=True)):
        stable = [o.amplitude(which) for o in branch.orbits_at(float(omega)) if o.stable]
        off[k] = min((abs(found / a - 1.0) for a in stable), default=math.nan)
    return off


def _only(jumps: tuple[Jump, ...], fold: float | None) -> bool:
    """Whether the one jump is in the step that holds the fold, or both are missing."""
    steps = [sorted((jump.omega_before, jump.omega_after)) for jump in jumps]
    if fold is None:
        return not steps
    return len(steps) == 1 and steps[0][0] <= fold <= steps[0][1]


def _jump_numbers(jumps: tuple[Jump, ...], fold: float | None, name: str) -> dict[Name, Number]:
    before, after = (jumps[0].omega_before, jumps[0].omega_after) if jumps else (None, None)
    return {
        ("fold by balance", f"speed {name}"): Number(fold, "rad/s"),
        ("before the jump", f"speed {name}"): Number(before, "rad/s"),
        ("after", f"speed {name}"): Number(after, "rad/s"),
    }


def solutions_coexist(data: Responses) -> Evaluation:
    """N2: stable motions between the folds and beside them, and where the sweeps differ."""
    low, high = data.marks.omega_lb, data.marks.omega_ub
    if low is None or high is None or data.thrown is None:
        return undecided(NO_FOLDS)
    inside = np.linspace(low, high, INSIDE + 2)[1:-1]
    beside = np.concatenate([inside - (high - low), inside + (high - low)])
    within, without = (
        [len(_stable(data.exact, w)) for w in speeds.tolist()] for speeds in (inside, beside)
    )
    omega = data.settled[0].omega
    up, down = data.settled[0].amplitude("relative"), data.settled[1].amplitude("relative")[::-1]
    differ = np.abs(up / down - 1.0) > SAME
    between = (omega > low) & (omega < high)
    parts = [
        Part("two stable motions between the folds", set(within) == {2}),
        Part("one beside them", set(without) == {1}),
        Part("sweeps differ there and nowhere else", bool((differ == between).all())),
    ]
    numbers: dict[Name, Number] = {
        "w_lb": Number(low, "rad/s"), "w_ub": Number(high, "rad/s"),
        "fewest stable motions between": Number(min(within)),
        "most beside": Number(max(without)),
        f"stable motions by search at {data.thrown.omega:.6g} rad/s":
            Number(len(data.thrown.basins.orbits)),
        "lowest speed at which sweeps differ": Number(_end(omega[differ], 0), "rad/s"),
        "highest": Number(_end(omega[differ], -1), "rad/s"),
    }  # fmt: skip
    return decide(parts, numbers)


def _stable(branch: Branch, omega: float) -> list[Orbit]:
    return [orbit for orbit in branch.orbits_at(omega) if orbit.stable]


def _end(values: Real, k: int) -> float | None:
    return float(values[k]) if values.size else None


def disturbance_throws(data: Responses) -> Evaluation:
    """N3: basin share and one run."""
    return undecided(NO_FOLDS) if data.thrown is None else thrown_to_the_lower(data.thrown)


def linear_below_contact(data: Responses) -> Evaluation:
    """Relative difference from the linear response below w_cs."""
    if data.marks.omega_cs is None:
        return undecided("a speed at which contact begins")
    low = float(data.exact.omega.min())
    omega = np.linspace(low, data.marks.omega_cs, SAMPLES, endpoint=False)
    linear = linear_response(data.screen, omega)
    parts: list[Part] = []
    numbers: dict[Name, Number] = {"w_cs": Number(data.marks.omega_cs, "rad/s")}
    for which in ("main", "relative"):
        orbits = [data.exact.orbit_from_below(float(w)) for w in omega]
        found = np.array([np.nan if o is None else o.amplitude(which) for o in orbits])
        worst = float(np.abs(found / linear.amplitude(which) - 1.0).max())
        parts.append(Part(LABELS[which], worst < SAME))
        numbers[f"greatest relative difference, {LABELS[which]}"] = Number(worst)
    return decide(parts, numbers)


FIGURE = PaperFigure(
    "figure-07", TITLE, compute, draw,
    (
        Claim("N1", "Fig. 7, 4.1", "third-order harmonic balance agrees with Runge-Kutta sweeps "
              "of rising and falling speed", sweeps_agree),
        Claim("N2", "Fig. 7, 4.1", "between w_lb and w_ub several solutions coexist, and sweeps "
              "of rising and falling speed differ", solutions_coexist),
        Claim("N3", "4.1", "a disturbance may throw the upper motion to the lower",
              disturbance_throws),
        Claim("N4", "4.1", "below w_cs the stop changes nothing", linear_below_contact),
    ),
)  # fmt: skip
