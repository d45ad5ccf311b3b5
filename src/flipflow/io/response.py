"""The responses of all load cases as one table: NetCDF and CSV."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from flipflow.io.arrays import arrays_of
from flipflow.io.labelled import Arrays, Variable
from flipflow.io.tables import csv_text, netcdf_bytes
from flipflow.model.constants import RPM
from flipflow.results.store import write_file
from flipflow.studies.assessment import Assessment

NAMES = "response.nc", "response.csv"


def write_response(assessment: Assessment, folder: Path) -> None:
    """Write the response of every case as NetCDF and CSV, as :data:`NAMES`."""
    arrays = response_arrays(assessment)
    write_file(folder / NAMES[0], netcdf_bytes(arrays))
    write_file(folder / NAMES[1], csv_text(arrays).encode())


def response_arrays(assessment: Assessment) -> Arrays:
    """The branches of all cases; as their points differ in number, one case follows the other."""
    names = [case.name for case in assessment.cases]
    parts = [arrays_of(case.branch) for case in assessment.cases]
    first, *others = (part.attributes for part in parts)
    # In an order of their own: that of a set would make another file in every process.
    shared = {k: v for k, v in first.items() if all(other.get(k) == v for other in others)}
    omega = np.concatenate([part.coordinates["omega"].data for part in parts])
    labels = parts[0].coordinates["coordinate"]
    cases = _cases(names, parts, "omega", "point")
    return Arrays(
        parts[0].title,
        "point",
        {"case": cases, "omega": Variable(("point",), omega, "rad/s"), "coordinate": labels},
        {
            "speed": Variable(("point",), omega * RPM, "rpm"),
            **dict(_joined(parts)),
            "special_case": _cases(names, parts, "special_kind", "special"),
        },
        {**shared, "input_hash": assessment.input_hash},
    )


def _joined(parts: list[Arrays]) -> Iterator[tuple[str, Variable]]:
    """Each variable of all parts, one after the other along its first dimension."""
    for name, one in parts[0].variables.items():
        values = np.concatenate([part.variables[name].data for part in parts])
        yield name, Variable(one.dims, values, one.units)


def _cases(names: list[str], parts: list[Arrays], of: str, dim: str) -> Variable:
    """To which case each point belongs."""
    counts = [len({**part.coordinates, **part.variables}[of].data) for part in parts]
    return Variable((dim,), np.repeat(np.array(names, str), counts))
