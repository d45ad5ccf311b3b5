"""Figure 3: which parameter matters most to the relative amplitude of the machine without stop."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Real
from flipflow.dynamics.linear_response import linear_response
from flipflow.model.fields import FIELD
from flipflow.model.screen import FlipFlowScreen
from flipflow.paper.claims import (
    WORDS_OF_TIES,
    Claim,
    Evaluation,
    Name,
    Number,
    Part,
    bands,
    decide,
)
from flipflow.paper.figure import PaperFigure
from flipflow.plotting.family import speed_axis_in_radians
from flipflow.plotting.figure import Figure
from flipflow.plotting.palette import CASES, case_colour, case_symbol
from flipflow.plotting.panels import Axis, Line, Panel, Trace
from flipflow.plotting.sensitivity import INDEX_AXIS, index_order
from flipflow.report.blocks import Column, Table, cells
from flipflow.report.numbers import number
from flipflow.studies.sensitivity import Sensitivity, sensitivity

TITLE = "Sobol indices of the relative amplitude of the machine without stop"
PARAMETERS = (
    "main_mass", "floating_mass", "eccentric_moment", "isolation_stiffness", "isolation_damping",
    "shear_stiffness", "shear_damping",
)  # fmt: skip
SPREAD = 0.05
GROUPS, FREQUENCIES = 4096, 200
WHERE = "Fig. 3, 2.2"
CAPTION = (
    "Total indices: share of the variance of the relative amplitude that goes with a parameter and "
    "all it does together with others. Each parameter of Table 1 varies evenly by 5 % to either "
    f"side; {GROUPS} groups of samples at each of {FREQUENCIES} frequencies. Shaded: 95 % "
    "confidence. Two parameters whose shaded intervals overlap are tied: neither leads."
)


@dataclass(frozen=True, eq=False)
class Indices:
    """Total indices over frequency, and the frequencies that divide it."""

    result: Sensitivity
    w01: float
    w02: float
    w_ea: float | None
    w_ar: float | None

    @property
    def omega(self) -> Real:
        """Frequencies in rad/s."""
        return np.asarray(self.result.omega)

    def total(self, name: str) -> Real:
        """Total index of a parameter over frequency."""
        return self.result.total[:, self.result.names.index(name)]

    def has_rank(self, name: str, rank: int) -> list[bool | None]:
        """Where exactly ``rank`` other parameters have a higher total index.

        None where a rival's 95 % interval overlaps the parameter's own, so that the samples do not
        tell which of them is the higher, and with it the rank is open.
        """
        k = self.result.names.index(name)
        total, half = self.result.total, self.result.total_confidence
        above = np.delete(total - half > (total + half)[:, [k]], k, axis=1).sum(axis=1)
        not_below = np.delete(total + half >= (total - half)[:, [k]], k, axis=1).sum(axis=1)
        return [
            True if low == high == rank else None if low <= rank <= high else False
            for low, high in zip(above.tolist(), not_below.tolist(), strict=True)
        ]

    def mean_slopes(self) -> dict[str, Real]:
        """Mean size of each total index's slope in s/rad, by band; empty without the bands."""
        slopes = np.abs(np.gradient(self.result.total, self.omega, axis=0))
        return {name: slopes[inside].mean(axis=0) for name, inside in _bands(self)}


def compute(screen: FlipFlowScreen) -> Indices:
    """Between the natural frequencies, in closed form."""
    bare = screen.replace(clearance=math.inf, clearance_minus=None)
    linear = linear_response(bare, 1.0)
    w01, w02 = (float(w) for w in linear.natural_frequencies)
    ends = ((1.0 - SPREAD), (1.0 + SPREAD))
    present = [name for name in PARAMETERS if getattr(bare, name) > 0.0]
    vary = {name: tuple(end * getattr(bare, name) for end in ends) for name in present}
    omega = np.linspace(w01, w02, FREQUENCIES)
    result = sensitivity(bare, vary, "relative_amplitude", omega, n=GROUPS)
    return Indices(result, w01, w02, linear.omega_ea, linear.omega_ar)


def draw(data: Indices) -> Figure:
    """One line a parameter."""
    areas, lines = [], []
    for rank, i in enumerate(index_order(data.result)):
        name = FIELD[data.result.names[i]].symbol
        index, half = data.result.total[:, i], data.result.total_confidence[:, i]
        areas.append(
            Trace(f"{name}, 95 %", data.omega, index + half, "case band", "case band",
                  legend=False, lower=index - half)
        )  # fmt: skip
        lines.append(
            Trace(name, data.omega, index, colour=case_colour(rank), symbol=case_symbol(rank),
                  bold=rank < 2, dash="dash" if rank >= CASES else "")
        )  # fmt: skip
    marks = (("w_ea", data.w_ea), ("w_ar", data.w_ar))
    panel = Panel(
        speed_axis_in_radians(data.w01, data.w02), Axis("total index", "", INDEX_AXIS),
        (*areas, *lines),
        lines=tuple(Line("x", at, f"{name} {at:.4g}", "mark") for name, at in marks if at),
    )  # fmt: skip
    return Figure(TITLE, CAPTION, (panel,), height=400)


def tables(data: Indices) -> tuple[Table, ...]:
    """Mean slope of each total index in each band."""
    means = data.mean_slopes()
    columns = (Column("Parameter"), *(Column(band, numeric=True) for band in means))
    rows = [
        cells(FIELD[name].symbol, *(number(1e3 * float(mean[i])) for mean in means.values()))
        for i, name in enumerate(data.result.names)
    ]
    rows.append(cells("sum", *(number(1e3 * float(mean.sum())) for mean in means.values())))
    return (Table("Mean slope of the total indices, per 1000 rad/s", columns, tuple(rows)),)


def stiffness_first(data: Indices) -> Evaluation:
    """S1: where no parameter has a higher total index than k2."""
    return _ranked(data, data.has_rank("shear_stiffness", 0))


def mass_second(data: Indices) -> Evaluation:
    """S2: where exactly one parameter has a higher total index than m2."""
    return _ranked(data, data.has_rank("floating_mass", 1))


def largest_past_antiresonance(data: Indices) -> Evaluation:
    """S3: frequency of the largest total index of k2 and of m2."""
    parts: list[Part] = []
    numbers: dict[Name, Number] = {}
    for name in ("shear_stiffness", "floating_mass"):
        index, symbol = data.total(name), FIELD[name].symbol
        at = float(data.omega[index.argmax()])
        inside = None if data.w_ar is None else data.w_ar < at < data.w02
        parts.append(Part(f"{symbol} between w_ar and w02", inside))
        numbers["largest total index", symbol] = Number(float(index.max()))
        numbers["at", symbol] = Number(at, "rad/s")
    return decide(parts, numbers)


def steepest_past_antiresonance(data: Indices) -> Evaluation:
    """S4: mean slope of each total index in size, band by band."""
    means = data.mean_slopes()
    if "w_ar to w02" not in means:
        return decide([Part("the bands", None)])
    last = means.pop("w_ar to w02")
    words = [FIELD[name].symbol for name in data.result.names]
    parts = [Part("sum of all", all(last.sum() > mean.sum() for mean in means.values()))]
    parts += [
        Part(word, all(bool(last[i] > mean[i]) for mean in means.values()))
        for i, word in enumerate(words)
    ]
    numbers: dict[Name, Number] = {
        ("mean slope, sum of all", band): Number(1e3 * float(mean.sum()), "per 1000 rad/s")
        for band, mean in (*means.items(), ("w_ar to w02", last))
    }
    return decide(parts, numbers)


def _bands(data: Indices) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Frequencies of the three bands; none where one of them does not exist."""
    if data.w_ea is None or data.w_ar is None or not data.w01 < data.w_ea < data.w_ar < data.w02:
        return
    ends = (("w01", data.w01), ("w_ea", data.w_ea), ("w_ar", data.w_ar), ("w02", data.w02))
    for (low, start), (high, end) in itertools.pairwise(ends):
        yield f"{low} to {high}", (data.omega >= start) & (data.omega <= end)


def _ranked(data: Indices, found: list[bool | None]) -> Evaluation:
    """Band by band, and how much of the frequencies has each answer."""
    numbers: dict[Name, Number] = {
        ("share of the frequencies", WORDS_OF_TIES[answer]): Number(
            100.0 * found.count(answer) / len(found), "%"
        )
        for answer in WORDS_OF_TIES
    }
    return decide(list(bands(data.omega, found)), numbers, WORDS_OF_TIES)


FIGURE = PaperFigure(
    "figure-03", TITLE, compute, draw,
    (
        Claim("S1", WHERE, "between w01 and w02 the shear spring's stiffness k2 has the highest "
              "total index of the relative amplitude", stiffness_first),
        Claim("S2", WHERE, "the floating mass m2 comes second", mass_second),
        Claim("S3", WHERE, "both indices are largest between w_ar and w02",
              largest_past_antiresonance),
        Claim("S4", WHERE, "between w_ar and w02 the indices depend most on the excitation "
              "frequency", steepest_past_antiresonance),
    ),
    tables, needs_stop=False,
)  # fmt: skip
