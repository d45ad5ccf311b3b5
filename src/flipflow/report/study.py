"""What a study and its tolerances become in a report and in the terminal."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flipflow.batch.reasons import FOUND
from flipflow.compiled.arrays import Real
from flipflow.model.fields import FIELD
from flipflow.model.limits import Limits
from flipflow.model.numerals import capitalized
from flipflow.model.quantities import QUANTITIES, Quantity, quantity_named
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.vary import Choice, Distribution, Normal
from flipflow.plotting.study import (
    curves_figure,
    map_figure,
    parallel_figure,
    speed_in_words,
    study_tornado,
    wide_fields,
)
from flipflow.plotting.tolerance import tolerance_figure
from flipflow.plotting.units import speed_of
from flipflow.report.blocks import (
    Block,
    Column,
    FigureBlock,
    Heading,
    Note,
    Table,
    Text,
    Values,
    cells,
)
from flipflow.report.numbers import NOTHING, allowed, named, quantity, written
from flipflow.report.registry import Part, section
from flipflow.studies.study import Study
from flipflow.studies.tolerance import (
    FOLDS,
    Tolerance,
    folds_known,
    jumped_motions,
    limits_in_words,
    limits_left_out,
)

QUANTILES = (0.025, 0.5, 0.975)
WORDS = {
    "grid": "every combination",
    "list": "a list",
    "sobol": "Sobol's sequence",
    "latin-hypercube": "Latin hypercube",
    "monte-carlo": "independent draws",
}
MOST_FIGURES = 4  # maps or tornado charts of one report
MOST_COLUMNS = 4  # speeds beside each other in a table


@section(Study, Part.FIRST_PAGE, 10, brief=True)
def summary_of_study(found: Study) -> Iterator[Block]:
    """What was looked at, and what varies."""
    rows = [
        ("Machines", f"{found.size}, {WORDS[found.sampling]}"),
        ("Load cases", ", ".join(found.cases)),
    ]
    if np.isfinite(found.omega).all():
        rows.append(("Speed", _speeds(found)))
    if found.sample is not None:
        rows.append(("Seed", str(found.sample.seed)))
        together = "; ".join(_together(found))
        rows += [("Vary together", together)] if together else []
    if found.parameters:
        parameters = f"with respect to {', '.join(found.parameters)}, in the files"
        rows.append(("Derivatives", parameters))
    yield Values(tuple(rows))
    columns = (Column("Field"), Column("Symbol", brief=False), Column("Varies"))
    shown = [
        cells(name, FIELD[name].symbol if name in FIELD else NOTHING, _range(found, name, one))
        for name, one in zip(found.names, found.distributions, strict=True)
    ]
    yield Table("What varies", columns, tuple(shown))
    yield from (Note(text) for text in found.notes)


def _together(found: Study) -> Iterator[str]:
    """Fields that are correlated, and how much."""
    if found.sample is None or found.sample.covariance is None:
        return
    covariance = np.array(found.sample.covariance)
    for i, j in zip(*np.nonzero(np.triu(covariance, 1)), strict=True):
        share = covariance[i, j] / np.sqrt(covariance[i, i] * covariance[j, j])
        yield f"{found.names[i]} and {found.names[j]}, correlation {share:.3g}"


@section(Study, Part.FIRST_PAGE, 20)
def spread_of_study(found: Study) -> Iterator[Block]:
    """The spread of every quantity."""
    yield spread_table(found)


def study_blocks(
    found: Study, judged: Tolerance | None = None, limits: Limits | None = None
) -> Iterator[Block]:
    """A whole report: what passes, what was looked at, figures.

    Parameters
    ----------
    found
        The study.
    judged
        Its tolerances, where limits are judged.
    limits
        Limits that maps show.
    """
    if judged is not None:
        yield from yield_of_machines(judged)
    yield Heading("The study", 1, new_page=False)
    told = () if judged is None else judged.notes  # the study's own among them
    for block in summary_of_study(found):
        if not (isinstance(block, Note) and block.text in told):
            yield block
    yield spread_table(found)
    if judged is not None:
        yield from cost_of_tolerances(judged)
    yield from _figures(found, judged, limits)


@section(Study, Part.DETAILS, 10)
def figures_of_study(found: Study) -> Iterator[Block]:
    """Maps of a grid, curves over one field; of a sample tornado charts and all machines."""
    yield from _figures(found, None, None)


def _figures(found: Study, judged: Tolerance | None, limits: Limits | None) -> Iterator[Block]:
    wide = wide_fields(found)
    motions = [n for n in found.quantities if n not in FOLDS] or list(found.quantities)
    if found.sampling == "grid" and len(wide) == 1:
        yield FigureBlock(curves_figure(found, wide[0]))
        return
    if found.sampling == "grid" and len(wide) > 1:
        yield Heading(f"Maps{speed_in_words(found, found.omega[0])}", 1, new_page=False)
        for name in motions[:MOST_FIGURES]:
            yield FigureBlock(map_figure(found, name, limits))
        return
    heading = f"What moves each quantity{speed_in_words(found, found.omega[0])}"
    yield Heading(heading, 1, new_page=False)
    for name in motions[:MOST_FIGURES]:
        if np.isfinite(found.nominal[name]).all():
            yield FigureBlock(study_tornado(found, name))
    if judged is None:
        yield FigureBlock(parallel_figure(found))
        return
    met = limits_in_words(judged.limits, judged.checked)
    yield FigureBlock(parallel_figure(found, judged.passing[:, 0], met=met))


@section(Tolerance, Part.FIRST_PAGE, 10, brief=True)
def yield_of_machines(found: Tolerance) -> Iterator[Block]:
    """The share that passes at each speed, each limit, and which tolerance costs most."""
    met = limits_in_words(found.limits, found.checked)
    yield Heading(f"Machines that meet {met}", 1, new_page=False)
    for j, omega in enumerate(found.omega):
        share, (low, high) = found.share[j], found.share_interval[j]
        yield Text(
            f"of {found.size} machines{speed_in_words(found, omega)} meet {met} in every load case "
            f"({_share(low)} to {_share(high)} with 95 % confidence)."
            f"{_jump_words(found, j)}{_cost_words(found, j)}",
            lead=_share(share),
        )
    left_out = limits_left_out(found.limits, found.checked)
    if left_out:
        yield Note(f"Not looked at: {', '.join(left_out)}.")
    columns = (
        Column("Limit"), Column("Allowed"), *(
            Column(speed_of(found, omega) if np.isfinite(omega) else "Met", "%", numeric=True)
            for omega in found.omega[:MOST_COLUMNS]
        ),
    )  # fmt: skip
    rows = [
        cells(QUANTITIES[name].label, allowed(found.limits, name), *_percents(found.by_limit[b]))
        for b, name in enumerate(found.checked)
    ]
    every = "all looked at" if left_out else "all"
    rows += [
        cells(f"{every}, case {case}", "", *_percents(found.by_case[c]))
        for c, case in enumerate(found.cases)
    ]
    rows.append(cells(f"{every}, every case", "", *_percents(found.share)))
    title = f"Machines that meet each limit{' looked at' if left_out else ''}"
    count = found.omega.size
    first = f"The first {MOST_COLUMNS} of {count} speeds; the share at each stands above."
    yield Table(title, columns, tuple(rows), first if count > MOST_COLUMNS else "")
    yield from (Note(text) for text in found.notes)


@section(Tolerance, Part.DETAILS, 10)
def cost_of_tolerances(found: Tolerance) -> Iterator[Block]:
    """The share against the width of the tolerances; a list or a grid has none."""
    known = np.isfinite(found.scaled).any(axis=0) | np.isfinite(found.halved).any(axis=0)
    for j in np.flatnonzero(known)[:MOST_FIGURES]:
        yield FigureBlock(tolerance_figure(found, int(j)))


def spread_table(found: Study) -> Table:
    """Quantiles of every quantity in every case; before and after the jump are two rows."""
    columns = (
        Column("Quantity"), Column("Case"), Column("Nominal", numeric=True),
        Column("2.5 %", numeric=True), Column("Median", numeric=True),
        Column("97.5 %", numeric=True), Column("Machines", numeric=True),
    )  # fmt: skip
    rows = []
    for name in found.quantities:
        one = quantity_named(name, found.machine)
        for c, case in enumerate(found.cases):
            for words, values in _groups(found, one, c):
                numbers = [_nominal(found, one, c, jumped=bool(words)), *_quantiles(values)]
                texts = [named(one, float(x)) for x in numbers]
                count = written(values.size, "d")
                rows.append(cells(one.label, f"{case}{words}", *texts, count))
    title = f"What the machines do{speed_in_words(found, found.omega[0])}"
    return Table(title, columns, tuple(rows), " ".join(_spread_words(found)))


def _nominal(found: Study, one: Quantity, case: int, *, jumped: bool) -> float:
    """The value of the machine itself; NaN where it lies on the other side of the jump."""
    own = float(np.atleast_1d(found.nominal[one.name][case])[0])
    if one.of == "response" or not folds_known(found):
        return own
    end = found.nominal[FOLDS[0] if found.branch == "lower" else FOLDS[1]][case]
    return own if jumped == bool(found.omega[0] > end) else np.nan


def _spread_words(found: Study) -> Iterator[str]:
    """What the table of the spread leaves out."""
    if found.omega.size > 1:
        yield "This is the first speed of the study; the others are in the table of machines."
    if folds_known(found):
        yield "Machines that have jumped are never counted with the others."
    for name in found.quantities:
        one = quantity_named(name, found.machine)
        for c, case in enumerate(found.cases):
            counted = sum(values.size for _, values in _groups(found, one, c))
            if counted < found.size:
                of_case = f" in case {case}" if len(found.cases) > 1 else ""
                yield (
                    f"{capitalized(one.label)}{of_case}: {counted} of {found.size} "
                    "machines are counted, the rest have none."
                )


def _groups(found: Study, one: Quantity, case: int) -> Iterator[tuple[str, Real]]:
    """Values of a quantity that belong to one side of the jump, with words for it."""
    table = found.values[one.name]
    if one.of == "response":
        yield "", table[:, case][np.isfinite(table[:, case])]
        return
    values = table[:, case, 0]
    known = (found.reason[:, case, 0] == FOUND) & ~np.isnan(values)
    if not folds_known(found):
        yield "", values[known]
        return
    beyond = jumped_motions(found)[:, case, 0]
    for words, side in (("", ~beyond), (", jumped", beyond)):
        if (known & side).any() or not words:
            yield words, values[known & side]


def _quantiles(values: Real) -> list[float]:
    if values.size == 0:
        return [np.nan] * len(QUANTILES)
    return [float(x) for x in np.quantile(values, QUANTILES, method="inverted_cdf")]


def _range(found: Study, name: str, one: Distribution) -> str:
    """How a field varies, in words."""
    known = name in FIELD and isinstance(found.machine, FlipFlowScreen)
    unit, shown = (FIELD[name].unit, FIELD[name].file_unit) if known else ("", "")

    def words(value: object) -> str:
        return quantity(value, shown, unit) if isinstance(value, float) else str(value)

    if isinstance(one, Normal):
        return f"normal, {words(one.mean)}, standard deviation {words(one.std)}"
    if isinstance(one, Choice) and len(one.values) <= 4:
        return ", ".join(map(words, one.values))
    low, high = one.ends
    count = f", {len(one.values)} values" if isinstance(one, Choice) else ""
    return f"{words(low)} to {words(high)}{count}"


def _speeds(found: Study) -> str:
    omega = found.omega
    if omega.size <= 4:
        return ", ".join(speed_of(found, float(one)) for one in omega)
    low, high = (speed_of(found, float(end)) for end in (omega.min(), omega.max()))
    return f"{low} to {high}, {omega.size} speeds"


def _jump_words(found: Tolerance, j: int) -> str:
    share = found.jump_share[j]
    if not share > 0.0:
        return ""
    low, high = found.jump_interval[j]
    return (
        f" {_share(share)} ({_share(low)} to {_share(high)}) jump where the nominal machine does "
        "not, or do not where it does."
    )


def _cost_words(found: Tolerance, j: int) -> str:
    name = found.costliest(j)
    if name is None and np.isfinite(found.halved[:, j]).any():
        return " Of the tolerances, halved one at a time, none stands out."
    if name is None:
        return ""
    i = found.names.index(name)
    return (
        f" The tolerance of {name} costs most: half of it would bring the share to "
        f"{_share(found.halved[i, j])}."
    )


def _percents(shares: Real) -> list[str]:
    return [written(100.0 * float(one), ".1f") for one in shares[:MOST_COLUMNS]]


def _share(share: float) -> str:
    return f"{100.0 * share:.3g} %"
