"""What is judged of machines as labelled arrays: limits, comparisons, loads on the foundation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flipflow.io.labelled import Arrays, Variable, attributes, column
from flipflow.model.quantities import QUANTITIES
from flipflow.studies.assessment import Assessment
from flipflow.studies.compare import Comparison
from flipflow.studies.foundation_loads import (
    DIRECTIONS,
    CaseLoads,
    Components,
    FoundationLoads,
    RunLoads,
)
from flipflow.studies.quantity_values import number_or_nan


def assessment_arrays(assessment: Assessment) -> Arrays:
    """Every load case at working speed, and every limit."""
    names = [case.name for case in assessment.cases]
    words = list(dict.fromkeys(name for case in assessment.cases for name in case.values))
    values = {
        word: column(
            "case",
            [number_or_nan(case.values.get(word)) for case in assessment.cases],
            QUANTITIES[word].unit,
        )
        for word in words
    }
    rows = assessment.limits_table
    return Arrays(
        "Every load case at working speed",
        "case",
        {
            "case": column("case", np.array(names, str)),
            "limit": column("limit", np.array([row.name for row in rows], str)),
        },
        {
            **values,
            "limit_least": column("limit", [row.limit[0] for row in rows]),
            "limit_most": column("limit", [row.limit[1] for row in rows]),
            "limit_worst": column("limit", [number_or_nan(row.worst) for row in rows]),
            "limit_margin": column("limit", [number_or_nan(row.margin) for row in rows]),
            "limit_state": column("limit", np.array([row.state for row in rows], str)),
        },
        attributes(assessment, verdict=assessment.verdict, omega=number_or_nan(assessment.omega)),
    )


def comparison_arrays(found: Comparison) -> Arrays:
    """Results by machine."""
    rows = found.results
    values = np.reshape(
        [[number_or_nan(one) for one in row.values] for row in rows], (len(rows), -1)
    )
    return Arrays(
        "Machines compared",
        "result",
        {
            "result": column("result", np.array([row.name for row in rows], str)),
            "machine": column("machine", np.array(found.names, str)),
        },
        {
            "case": column("result", np.array([row.case for row in rows], str)),
            "unit": column("result", np.array([row.unit for row in rows], str)),
            "value": Variable(("result", "machine"), values.astype(float)),
        },
        attributes(found),
    )


def foundation_arrays(loads: FoundationLoads) -> Arrays:
    """Static loads and peaks by load case and run."""
    every: tuple[CaseLoads | RunLoads, ...] = (*loads.cases, *loads.runs)
    peaks = [one.running if isinstance(one, CaseLoads) else one.peaks for one in every]
    static = [one.static if isinstance(one, CaseLoads) else Components() for one in every]

    def ways(parts: Sequence[Components]) -> Variable:
        forces = [[number_or_nan(getattr(part, way)) for way in DIRECTIONS] for part in parts]
        return Variable(("load", "direction"), np.reshape(forces, (len(parts), -1)), "N")

    return Arrays(
        "Loads on the foundation, all supports together",
        "load",
        {
            "load": column("load", np.array([one.name for one in every], str)),
            "direction": column("direction", np.array(DIRECTIONS)),
        },
        {
            "static": ways(static),
            "dynamic": ways(peaks),
            "static_share": column("support", np.array(loads.static_shares, float)),
        },
        attributes(loads, position=loads.position, supports=float(len(loads.supports))),
    )
