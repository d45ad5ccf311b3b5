"""The appendix: branches, jump speeds, multipliers, method, error, version, input."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from flipflow.continuation.branch import Branch, SpecialPoint
from flipflow.io.units import in_unit
from flipflow.model.numerals import rpm
from flipflow.plotting.curves import Curve, is_jump
from flipflow.plotting.palette import STABILITY_WORDS
from flipflow.report.blocks import Block, Cell, Column, Heading, Note, Table, Values, cells
from flipflow.report.numbers import (
    NOTHING,
    four_digits,
    in_rpm,
    multiplier,
    quantity,
    span_of,
    three_digits,
    written,
)
from flipflow.report.registry import Part, section
from flipflow.studies.assessment import Assessment, CaseAssessment

METHOD = (
    "motion in closed form between contacts, contact times found by a search that cannot miss "
    "one, periodic motion by shooting, branch by pseudo-arclength ({name}, steps of at most "
    "1/{points} of the range)"
)
KINDS = {"contact begin": "contact begins", "contact end": "contact ends"}


@section(Assessment, Part.APPENDIX, 10)
def branches(assessment: Assessment) -> Iterator[Block]:
    """How each branch went, and how exact it is."""
    yield Heading("Appendix", 1, new_page=False)
    columns = (
        Column("Load case"),
        Column("Range", "rpm", ends=True),
        Column("Points", numeric=True),
        Column("Unstable", numeric=True),
        Column("Median error", "mm", numeric=True),
        Column("How it ended"),
    )
    caption = (
        "The motions connected with the one at low speed, followed over speed. Error: "
        "estimated distance from the exact motion. Motions detached from the branch are not seen."
    )
    rows = tuple(_branch_row(case.name, case.branch) for case in assessment.cases)
    yield Table("Branches", columns, rows, caption)
    for case in assessment.cases:
        yield from (Note(f"{case.name}: {note}") for note in case.branch.notes)


@section(Assessment, Part.APPENDIX, 20)
def special_points(assessment: Assessment) -> Iterator[Block]:
    """Jump speeds, contact, and other changes of the motion."""
    columns = (
        Column("Load case"),
        Column("What happens"),
        Column("Speed", "rpm", numeric=True),
        Column("Speed", "Hz", numeric=True),
        Column("Speed", "rad/s", numeric=True),
        Column("Relative amplitude", "mm", numeric=True),
    )
    rows = tuple(
        _point_row(case.name, point, folds)
        for case in assessment.cases
        for folds in (_folds(case.branch),)
        for point in case.branch.special_points
    )
    caption = (
        "At a jump speed (saddle-node, fold) two motions meet and vanish, so the amplitude jumps "
        "when the speed passes it."
    )
    if rows:
        yield Table("Jump speeds and contact", columns, rows, caption)


@section(Assessment, Part.APPENDIX, 30)
def multipliers(assessment: Assessment) -> Iterator[Block]:
    """Multipliers of every motion at working speed."""
    columns = (
        Column("Load case"),
        Column("Amplitude", "mm", numeric=True),
        Column("Multipliers"),
        Column("Largest", numeric=True),
        Column("Error", "mm", numeric=True),
        Column("Therefore"),
    )
    caption = (
        "Multipliers (Floquet): what is left of a small disturbance after one turn. The motion "
        "returns when all are smaller than 1 in modulus."
    )
    rows = tuple(row for case in assessment.cases for row in _motion_rows(case))
    if rows:
        title = f"Multipliers at {rpm(assessment.omega)} rpm" if assessment.omega else "Multipliers"
        yield Table(title, columns, rows, caption)


@section(Assessment, Part.APPENDIX, 40)
def method(assessment: Assessment) -> Iterator[Block]:
    """By what the report was made."""
    options = assessment.method
    yield Values(
        (
            (
                "Method",
                METHOD.format(name=type(options).__name__, points=options.points),
            ),
            ("Amplitude", "half the peak-to-peak motion"),
            (
                "Phase",
                "of the first harmonic against the unbalance force, positive when it leads",
            ),
            ("flipflow", f"version {assessment.version}"),
            ("Input", f"SHA-256 {assessment.input_hash}, over all values of the machine file"),
        )
    )


def _branch_row(name: str, branch: Branch) -> tuple[Cell, ...]:
    omega = branch.omega
    if omega.size == 0:
        return cells(name, NOTHING, written(0, "d"), NOTHING, NOTHING, branch.status.value)
    unstable = int((branch.stability == "unstable").sum())
    median = float(np.median(branch.error))
    return cells(
        name,
        span_of(in_rpm(float(omega.min())), in_rpm(float(omega.max()))),
        written(omega.size, "d"),
        written(unstable, "d"),
        _error(median),
        branch.status.value,
    )


def _point_row(name: str, point: SpecialPoint, folds: Mapping[float, str]) -> tuple[Cell, ...]:
    happens = KINDS.get(point.kind, point.kind)
    if point.kind == "fold":
        happens = folds[point.omega]
    if point.side and not point.orbit.system.symmetric:
        happens += " (+ side)" if point.side > 0 else " (- side)"
    return cells(
        name,
        happens,
        four_digits(in_unit(point.omega, "rpm", "rad/s")),
        four_digits(in_unit(point.omega, "Hz", "rad/s")),
        four_digits(point.omega),
        quantity(point.amplitude("relative"), "mm", "m", with_unit=False),
    )


def _folds(branch: Branch) -> dict[float, str]:
    """Folds in words: those that a slowly changing speed meets, and all others."""
    others = {
        fold.omega: "jump speed (fold)" if is_jump(branch, fold) else "fold, both sides unstable"
        for fold in branch.folds
    }
    return others | {
        jump.omega: f"jump when the speed {'rises' if jump.rising_speed else 'falls'} (fold)"
        for jump in Curve.of(branch, "relative").jumps()
    }


def _motion_rows(case: CaseAssessment) -> Iterator[tuple[Cell, ...]]:
    for orbit in case.orbits:
        shown = [m for m in orbit.multipliers if m.imag >= -1e-12 * abs(m)]
        yield cells(
            case.name,
            quantity(orbit.amplitude("relative"), "mm", "m", with_unit=False),
            "; ".join(multiplier(complex(m)) for m in shown),
            three_digits(float(abs(orbit.multipliers[0]))),
            _error(orbit.error),
            STABILITY_WORDS[orbit.stability],
        )


def _error(error: float) -> str:
    return written(1e3 * error, ".1e") if np.isfinite(error) else "no promise"
