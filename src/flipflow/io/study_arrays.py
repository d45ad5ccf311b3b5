"""Studies, their tolerances and designs as labelled arrays."""

from __future__ import annotations

import numpy as np

from flipflow.io.labelled import Arrays, Variable, attributes, column
from flipflow.model.quantities import quantity_named
from flipflow.studies.candidates import quantity_of
from flipflow.studies.design import Proposal
from flipflow.studies.lane_values import slope_key
from flipflow.studies.study import Study
from flipflow.studies.study_plan import (
    PARAMETER,
    PARAMETER_UNIT,
    unit_of,
    unit_of_slope,
    units_of_parameters,
)
from flipflow.studies.tolerance import Tolerance, limits_in_words
from flipflow.studies.worst_case import WorstCase


def study_arrays(found: Study) -> Arrays:
    """Quantities by machine, load case and frequency."""
    dims = ("sample", "case", "omega")
    asked = {name: quantity_named(name, found.machine) for name in found.quantities}
    whole = {name for name, one in asked.items() if one.of == "response"}
    own = {name: dims[:2] if name in whole else dims for name in asked}
    ends = {"low": found.at_low, "high": found.at_high}
    return Arrays(
        "Quantities of many machines",
        "sample",
        {
            "case": column("case", np.array(found.cases, str)),
            "omega": column("omega", found.omega, "rad/s"),
            "field": column("field", np.array(found.names, str)),
            **_parameters(found),
        },
        {
            **{
                name: column("sample", values, unit_of(found.machine, name))
                for name, values in found.columns.items()
            },
            **{name: Variable(own[name], found.values[name], asked[name].unit) for name in asked},
            **{
                slope_key(name): Variable(
                    (*dims, PARAMETER), slopes, unit_of_slope(found.machine, asked[name])
                )
                for name, slopes in found.derivatives.items()
            },
            "reason": Variable(dims, found.reason),
            **{
                f"nominal_{name}": Variable(own[name][1:], found.nominal[name], asked[name].unit)
                for name in asked
            },
            **{
                f"{end}_{name}": Variable(("field", *own[name][1:]), table[name], asked[name].unit)
                for end, table in ends.items()
                for name in asked
            },
        },
        {"flipflow_version": found.version, "sampling": found.sampling, "branch": found.branch},
    )


def _parameters(found: Study) -> dict[str, Variable]:
    """With respect to what quantities are differentiated, and in which units."""
    if not found.parameters:
        return {}
    units = units_of_parameters(found.machine, found.parameters)
    return {
        PARAMETER: column(PARAMETER, np.array(found.parameters, str)),
        PARAMETER_UNIT: column(PARAMETER, units),
    }


def tolerance_arrays(found: Tolerance) -> Arrays:
    """Shares by frequency."""
    ends = ("frequency", "end")
    return Arrays(
        f"Machines that meet {limits_in_words(found.limits, found.checked)}",
        "frequency",
        {
            "omega": column("frequency", found.omega, "rad/s"),
            "end": column("end", np.array(["low", "high"])),
            "limit": column("limit", np.array(found.checked, str)),
            "case": column("case", np.array(found.cases, str)),
            "field": column("field", np.array(found.names, str)),
            "factor": column("factor", found.factors),
        },
        {
            "share": column("frequency", found.share),
            "share_interval": Variable(ends, found.share_interval),
            "unknown": column("frequency", found.unknown),
            "jump_share": column("frequency", found.jump_share),
            "jump_interval": Variable(ends, found.jump_interval),
            "coexisting": column("frequency", found.coexisting),
            "by_limit": Variable(("frequency", "limit"), found.by_limit.T),
            "by_case": Variable(("frequency", "case"), found.by_case.T),
            "halved": Variable(("frequency", "field"), found.halved.T),
            "scaled": Variable(("frequency", "factor"), found.scaled.T),
            "passing": Variable(("machine", "frequency"), found.passing),
            "jumped": Variable(("machine", "frequency"), found.jumped),
        },
        {"flipflow_version": found.version, "machines": found.size},
    )


def worst_case_arrays(found: WorstCase) -> Arrays:
    """Extremes by frequency, and the machines that have them."""
    one = quantity_named(found.quantity, found.machine)
    values = {"nominal": found.nominal, "least": found.least, "greatest": found.greatest}
    places = {"least": found.least_at, "greatest": found.greatest_at}
    return Arrays(
        f"Worst case of {one.label}",
        "frequency",
        {
            "omega": column("frequency", found.omega, "rad/s"),
            "field": column("field", np.array(found.names, str)),
            "end": column("end", np.array(["low", "high"])),
        },
        {
            **{name: column("frequency", value, one.unit) for name, value in values.items()},
            "error": column("frequency", found.error, one.unit),
            "interval": Variable(("field", "end"), found.intervals),
            **{
                f"{end}_{name}": column("frequency", at[:, j], unit_of(found.machine, name))
                for end, at in places.items()
                for j, name in enumerate(found.names)
            },
        },
        {
            "flipflow_version": found.version,
            "quantity": found.quantity,
            "span": f"{found.span[0]:.6g} to {found.span[1]:.6g} rad/s",
            "branch": found.branch,
            "looked_at": found.looked_at,
        },
    )


def proposal_arrays(found: Proposal) -> Arrays:
    """The Pareto set of a duty, and what the chosen machine misses and would pay."""
    excess, price = list(found.excess), list(found.prices)
    return Arrays(
        "Machines for a duty",
        "candidate",
        {
            **{
                name: column("candidate", values, unit_of(found.screen, name))
                for name, values in found.fields.items()
            },
            "constraint": column("constraint", np.array(excess, str)),
            "binding": column("binding", np.array(price, str)),
        },
        {
            **{
                name.replace(" ", "_"): column("candidate", values, quantity_of(name).unit)
                for name, values in found.objectives.items()
            },
            "amplitude": column("combination", found.chosen.amplitude, "m"),
            "excess": column("constraint", [found.excess[name] for name in excess]),
            "price": column("binding", [found.prices[name] for name in price], "m"),
        },
        attributes(found, possible=str(found.possible), band=found.chosen.band),
    )
