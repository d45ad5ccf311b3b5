"""Figure 7: response of the machine with stop: harmonic balance, exact, Runge-Kutta sweeps."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flipflow.analyses.frequency_response import frequency_response
from flipflow.analyses.linear import linear_response
from flipflow.analyses.operating_region import Landmarks, analysed_range, landmarks
from flipflow.analyses.sweep import sweep
from flipflow.figures.family import BALANCE, beneath_traces, branch_traces, speed_axis_in_radians
from flipflow.figures.parts import Axis, Band, Figure, Line, Panel, Trace
from flipflow.figures.response import LABELS
from flipflow.figures.scales import MM
from flipflow.methods.options import HarmonicBalance
from flipflow.model.screen import FlipFlowScreen
from flipflow.paper.claims import AGREEMENT, Claim, Evaluation, Number, Part, decide, undecided
from flipflow.paper.figure import PaperFigure
from flipflow.paper.runge_kutta import SteppedSweep, stepped_sweep
from flipflow.paper.thrown import Thrown, thrown, thrown_panel, thrown_to_the_lower
from flipflow.results.branch import Branch
from flipflow.results.orbit import Orbit
from flipflow.results.sweep import Sweep

Real = NDArray[np.float64]
TITLE = "Amplitude over frequency of the machine with stop"
SAMPLES = 60
SAME = 1e-6
STEPS = 247
EVERY = 2
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
        The same by Runge-Kutta, at every other speed.
    thrown
        What a blow does between the folds; None without folds.
    """

    screen: FlipFlowScreen
    exact: Branch
    balance: Branch
    marks: Landmarks
    settled: tuple[Sweep, Sweep]
    stepped: tuple[SteppedSweep, SteppedSweep]
    thrown: Thrown | None


def compute(screen: FlipFlowScreen) -> Responses:
    """Both methods and both sweeps over the whole range."""
    low, high = analysed_range(screen)
    exact = frequency_response(screen, (low, high))
    balance = frequency_response(screen, (low, high), HarmonicBalance(3))
    marks = landmarks(screen, exact)
    omega = np.linspace(low, high, STEPS)
    rising, falling = omega[::EVERY], omega[::EVERY][::-1]
    system = screen.system()
    blow = None
    if marks.omega_lb is not None and marks.omega_ub is not None:
        blow = thrown(screen, exact, _middle(marks.omega_lb, marks.omega_ub))
    return Responses(
        screen, exact, balance, marks, (sweep(screen, omega), sweep(screen, omega[::-1])),
        (stepped_sweep(system, rising), stepped_sweep(system, falling)), blow,
    )  # fmt: skip


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
    numbers: dict[str, Number] = {}
    folds = [fold.omega for fold in data.balance.folds]
    for name, one, settled, fold in zip(
        ("rising", "falling"), data.stepped, data.settled,
        (max(folds, default=None), min(folds, default=None)), strict=True,
    ):  # fmt: skip
        for which in ("main", "relative"):
            off = _difference(one, data.balance, which)
            k = int(np.nanargmax(off))
            label = f"{LABELS[which]}, speed {name}"
            parts.append(Part(f"{label}: within 2 %", bool(off[k] < AGREEMENT)))
            numbers[f"greatest difference, {label}"] = Number(100.0 * float(off[k]), "%")
            numbers[f"at, {label}"] = Number(float(one.omega[k]), "rad/s")
            exact = np.abs(one.amplitude(which) / settled.amplitude(which)[::EVERY] - 1.0).max()
            numbers[f"Runge-Kutta against exact sweep, {label}"] = Number(100.0 * exact, "%")
        parts.append(Part(f"jump with speed {name} at the fold", _jumps_at(one, fold)))
        numbers |= _jump_numbers(one, settled, fold, name)
    return decide(parts, numbers)


def _difference(one: SteppedSweep, branch: Branch, which: str) -> Real:
    """From the nearest stable motion of a branch, relative; NaN where there is none."""
    off = np.full(one.omega.size, np.nan)
    for k, (omega, found) in enumerate(zip(one.omega, one.amplitude(which), strict=True)):
        stable = [o.amplitude(which) for o in branch.orbits_at(float(omega)) if o.stable]
        off[k] = min((abs(found / a - 1.0) for a in stable), default=math.nan)
    return off


def _jumps_at(one: SteppedSweep, fold: float | None) -> bool:
    """Whether the sweep jumps in the step that holds the fold, or nowhere where there is none."""
    if one.jump is None or fold is None:
        return one.jump is None and fold is None
    return min(one.jump) <= fold <= max(one.jump)


def _jump_numbers(
    one: SteppedSweep, settled: Sweep, fold: float | None, name: str
) -> dict[str, Number]:
    before, after = one.jump or (None, None)
    numbers = {
        f"fold by balance, speed {name}": Number(fold, "rad/s"),
        f"Runge-Kutta before the jump, speed {name}": Number(before, "rad/s"),
        f"after, speed {name}": Number(after, "rad/s"),
    }
    for jump in settled.jumps:
        numbers[f"exact sweep before its jump, speed {name}"] = Number(jump.omega_before, "rad/s")
        numbers[f"exact sweep after, speed {name}"] = Number(jump.omega_after, "rad/s")
    return numbers


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
    numbers = {
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
    parts, numbers = [], {"w_cs": Number(data.marks.omega_cs, "rad/s")}
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
