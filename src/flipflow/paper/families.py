"""The paper's parameter studies: families of machines, their pictures and tables."""

from __future__ import annotations

from dataclasses import dataclass

from flipflow.io.units import in_unit, shown
from flipflow.model.fields import FIELD
from flipflow.model.screen import FlipFlowScreen
from flipflow.paper.trends import FamilyPair
from flipflow.periodic.options import HarmonicBalance
from flipflow.plotting.family import family_figure
from flipflow.plotting.figure import Figure
from flipflow.report.blocks import Column, Table, cells
from flipflow.report.numbers import NOTHING, number
from flipflow.studies.response_family import ResponseFamily, response_family

HARMONICS = 3
WHOLE = (0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3)
SHOWN = (0.7, 0.9, 1.0, 1.1, 1.3)
RISING = (0.7, 0.8, 0.9, 1.0)
NO_RANGE = "The paper's text gives no range; 0.7 to 1.3 times the nominal value is taken."
ROWS = (
    ("first_peak_omega", "first peak of the main frame at", "rad/s"),
    ("first_peak_main", "its amplitude", "mm"),
    ("second_peak_omega", "second peak of the main frame at", "rad/s"),
    ("second_peak_main", "its amplitude", "mm"),
    ("relative_peak_omega", "peak of the relative motion at", "rad/s"),
    ("relative_peak", "its amplitude", "mm"),
    ("omega_cs", "contact begins at w_cs", "rad/s"),
    ("omega_lb", "lower fold w_lb", "rad/s"),
    ("omega_ub", "upper fold w_ub", "rad/s"),
    ("lower", "operating region from", "rad/s"),
    ("upper", "to", "rad/s"),
)


@dataclass(frozen=True)
class FamilyPlan:
    """Which field is varied: multiples of ``base``, or of 1 mm where that is None.

    Parameters
    ----------
    field
        What is varied.
    factors, drawn
        Multiples that are computed, and those that the figure shows.
    base
        Field whose nominal value the factors multiply.
    note
        Said below the figure.
    """

    field: str
    factors: tuple[float, ...]
    drawn: tuple[float, ...]
    base: str | None
    note: str = ""

    def compute(self, screen: FlipFlowScreen) -> FamilyPair:
        """Both methods over one interval."""
        unit = 1e-3 if self.base is None else float(getattr(screen, self.base))
        vary = {self.field: [factor * unit for factor in self.factors]}
        exact = response_family(screen, vary)
        balance = response_family(screen, vary, method=HarmonicBalance(HARMONICS))
        drawn = tuple(k for k, f in enumerate(self.factors) if f in self.drawn)
        return FamilyPair(exact, balance, tuple(map(self.label, self.factors)), drawn)

    def label(self, factor: float) -> str:
        """A value as the paper writes it: "2 mm", "0.7 m1"."""
        if self.base is None:
            return f"{factor:g} mm"
        return f"{factor:g} {FIELD[self.base].symbol}"


def draw_family(pair: FamilyPair, title: str, note: str = "") -> Figure:
    """Both frames and the relative motion; harmonic balance beneath."""
    return family_figure(
        _chosen(pair.exact, pair), labels=[pair.labels[k] for k in pair.drawn],
        beneath=_chosen(pair.balance, pair), title=title, note=note,
    )  # fmt: skip


def family_tables(pair: FamilyPair) -> tuple[Table, ...]:
    """Peaks, folds and region of every member."""
    table = pair.exact.table()
    field = FIELD[pair.exact.field]
    columns = (Column(""), *(Column(label, numeric=True) for label in pair.labels))
    rows = tuple(
        cells(f"{words}, {unit}", *(_shown(value, unit) for value in table[key]))
        for key, words, unit in ROWS
    )
    nominal = shown(getattr(pair.exact.machine, field.name), field.file_unit, field.unit)
    caption = (
        f"Exact solution; nominal {field.symbol} = {nominal}. Without folds the region ends at the "
        "peak of the relative motion."
    )
    failures = [
        f"{label}: {why}" for label, why in zip(pair.labels, table["failure"], strict=True) if why
    ]
    return (
        Table("Peaks, folds and operating region", columns, rows, " ".join((caption, *failures))),
    )


def _chosen(family: ResponseFamily, pair: FamilyPair) -> ResponseFamily:
    return ResponseFamily(
        family.machine, family.field, tuple(family.members[k] for k in pair.drawn)
    )


def _shown(value: float | str | None, unit: str) -> str:
    if not isinstance(value, float):
        return NOTHING
    return f"{value:.2f}" if unit == "rad/s" else number(in_unit(value, unit, "m"))
