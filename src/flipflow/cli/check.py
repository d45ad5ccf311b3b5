"""``flipflow check``: what a machine file says, in SI, and what it leaves open."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import nullcontext
from itertools import groupby
from typing import TYPE_CHECKING

from flipflow.cli.destination import Destination
from flipflow.cli.options import WARMING, File, Force, Json
from flipflow.cli.output import print_list, printable
from flipflow.cli.progress import progress

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from flipflow.io.check import Case, Check, Value


def check(file: File, json: Json = None, force: Force = False) -> None:
    """Check a machine file: what it says, assumes and leaves open."""
    from flipflow.io.check import check_project  # noqa: PLC0415  keeps --help quick
    from flipflow.io.project import load_project  # noqa: PLC0415
    from flipflow.model.screen import of_air  # noqa: PLC0415

    project = load_project(file, force=force)
    with Destination(None, json, [file]) as target:
        with progress(WARMING) if any(map(of_air, project.load_cases)) else nullcontext():
            result = check_project(project)
        target.result(result)
        target.finish(lambda out: _show(result, out))


def _show(result: Check, out: Console) -> None:
    for warning in result.warnings:
        out.print(f"Warning: {printable(warning)}\n", style="bold yellow")
    out.print(f"{printable(result.name)}: {_verdict(result)}", style="bold")
    out.print()
    out.print(_values(result.values))
    print_list(out, "Sums of pieces", (f"{key}: {text}" for key, text in result.sums.items()))
    out.print()
    out.print(_speeds(result))
    out.print()
    ratios = (f"{name} {ratio:.3g}" for name, ratio in result.damping_ratios.items())
    out.print(f"Damping ratios: {', '.join(ratios)}")
    out.print(f"Unbalance over all mass (m0r/(m1+m2)): {1e3 * result.static_amplitude:.4g} mm")
    out.print()
    out.print(_cases(result.load_cases))
    print_list(out, "Notes", map(printable, result.notes))
    print_list(out, "Sources", _sources(result))
    print_list(out, "Assumed", result.assumed)
    print_list(out, "Missing", (f"{g.missing}: disables {g.disables}" for g in result.missing))


def _verdict(result: Check) -> str:
    gaps = {gap.disables for gap in result.missing}
    parts = [
        "the file is complete" if not gaps else "the file can be used, but not everything checked",
        *([f"{len(result.warnings)} value(s) let through by --force"] if result.warnings else []),
    ]
    return ", ".join(parts) + "."


def _values(values: Iterable[Value]) -> Table:
    table = _table("Value", "Symbol", "As written", "In SI", fixed=True)
    for section, rows in groupby(values, key=lambda value: value.key.rpartition(".")[0]):
        table.add_row(f"[{section}]", style="bold")
        for value in rows:
            digits = 6 if len(value.si) == 1 else 5  # two ends must fit the column
            numbers = " to ".join(_plain(number, digits) for number in value.si)
            si = f"{numbers} {value.unit}".strip()
            name = value.key.rpartition(".")[2]
            table.add_row(name, value.symbol, printable(value.written), si)
    return table


def _plain(number: float, digits: int) -> str:
    """Write so many digits, and large numbers without a power of ten."""
    return f"{number:.0f}" if 1e5 <= abs(number) < 1e10 else f"{number:.{digits}g}"


def _speeds(result: Check) -> Table:
    table = _table("Speed", "Symbol", "rpm", "Hz", "rad/s", right=3)
    for speed in result.speeds:
        row = (f"{speed.rpm:.1f}", f"{speed.hz:.3f}", f"{speed.rad_s:.3f}")
        table.add_row(speed.meaning, speed.name, *row)
    return table


def _cases(cases: Iterable[Case]) -> Table:
    table = _table(
        "Load case", "k2 x", "c2 x", "k3 x", "c3 x", "main kg", "floating kg", "degC", right=7
    )
    for case in cases:
        numbers = (
            case.stiffness_factor, case.damping_factor, case.stop_stiffness_factor,
            case.stop_damping_factor, case.main_mass, case.floating_mass,
        )  # fmt: skip
        table.add_row(printable(case.name), *(f"{number:.4g}" for number in numbers), _warmth(case))
    return table


def _warmth(case: Case) -> str:
    """Temperature of the rubber; of the air, where that is given, behind it."""
    if case.temperature is None:
        return ""
    if case.temperature_of != "air":
        return f"{case.temperature:.4g}"
    air = f"air {case.temperature:.4g}"
    return air if case.rubber is None else f"{case.rubber:.3g}, {air}"


def _sources(result: Check) -> Iterator[str]:
    """Group by source; a value without one stands last."""
    named = [(value.source, *value.key.rsplit(".", 1)) for value in result.values]
    named += [(case.source, "load_cases", repr(case.name)) for case in result.load_cases]
    for source, rows in groupby(sorted(named, key=_no_source_last), key=lambda row: row[0]):
        listed = tuple(rows)
        sections = "; ".join(
            f"{section} ({', '.join(printable(key) for *_, key in group)})"
            for section, group in groupby(listed, key=lambda row: row[1])
        )
        head = printable(source) or f"no source given for {len(listed)} entries"
        yield f"{head}: {sections}"


def _no_source_last(row: tuple[str, ...]) -> tuple[bool, str]:
    return not row[0], row[0]


def _table(*names: str, right: int = 0, fixed: bool = False) -> Table:
    """Make a table without frame; the last ``right`` columns are numbers, a fixed first holds."""
    from rich.table import Table  # noqa: PLC0415  slow to import

    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
    for index, name in enumerate(names):
        numeric = index >= len(names) - right
        held = fixed and index == 0
        table.add_column(name, justify="right" if numeric else "left", no_wrap=held)
    return table
