"""Branches as tables: NetCDF and CSV."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flipflow.continuation.branch import Branch
from flipflow.io.spreadsheet import csv_text
from flipflow.model.constants import RPM
from flipflow.results.store import write_file
from flipflow.studies.assessment import Assessment

NAMES = "response.nc", "response.csv"
Columns = dict[str, tuple[NDArray[Any], dict[str, str]]]


def branch_columns(branch: Branch) -> Columns:
    """The points of a branch by name: values (n,) and attributes such as units."""
    columns: Columns = {
        "omega": (branch.omega, {"units": "rad/s"}),
        "speed": (branch.omega * RPM, {"units": "rpm"}),
        "stable": (branch.stable.astype(np.int8), {"flag_meanings": "1: returns"}),
        "error": (branch.error, {"units": "m"}),
        "largest_multiplier": (np.abs(branch.multipliers[:, 0]), {}),
    }
    for which in branch.system.named:
        columns[f"amplitude_{which}"] = (branch.amplitude(which), {"units": "m"})
        columns[f"phase_{which}"] = (branch.phase(which), {"units": "rad"})
    return columns


def _attributes(branch: Branch) -> dict[str, str]:
    return {
        "title": "Periodic motions over frequency",
        "method": repr(branch.method),
        "status": branch.status.value,
        "flipflow_version": branch.version,
    }


def write_response(assessment: Assessment, folder: Path) -> None:
    """Write the response of every case as NetCDF and CSV, as :data:`NAMES`.

    Branches have different numbers of points, so the cases follow each other along "point".
    """
    tables = [branch_columns(case.branch) for case in assessment.cases]
    joined: Columns = {
        name: (np.concatenate([table[name][0] for table in tables]), attributes)
        for name, (_, attributes) in tables[0].items()
    }
    owner = np.repeat(np.arange(len(tables)), [case.branch.omega.size for case in assessment.cases])
    meanings = ", ".join(f"{k}: {case.name}" for k, case in enumerate(assessment.cases))
    joined["case"] = (owner.astype(np.int32), {"flag_meanings": meanings})
    first, *others = (_attributes(case.branch) for case in assessment.cases)
    # In an order of their own: that of a set would make another file in every process.
    shared = {k: v for k, v in first.items() if all(other[k] == v for other in others)}
    shared["input_hash"] = assessment.input_hash
    write_file(folder / NAMES[0], _netcdf(joined, shared))
    rows = [
        _csv(table, case=case.name, head=k == 0)
        for k, (case, table) in enumerate(zip(assessment.cases, tables, strict=True))
    ]
    write_file(folder / NAMES[1], b"".join(rows))


def _netcdf(columns: Columns, attributes: Mapping[str, str]) -> bytes:
    """Classic NetCDF, text in UTF-8, with one dimension, "point"; xarray opens it as a table."""
    from scipy.io import netcdf_file  # noqa: PLC0415  only files need it

    content = io.BytesIO()
    with netcdf_file(content, "w") as file:
        for name, text in attributes.items():
            setattr(file, name, text.encode())
        file.createDimension("point", next(iter(columns.values()))[0].size)
        for name, (values, own) in columns.items():
            variable = file.createVariable(name, values.dtype, ("point",))
            variable[:] = values
            for key, text in own.items():
                setattr(variable, key, text.encode())
        file.flush()
        return content.getvalue()


def _csv(columns: Columns, case: str | None = None, *, head: bool = True) -> bytes:
    units = [own.get("units", "") for _, own in columns.values()]
    heads = [f"{n} [{u}]" if u else n for n, u in zip(columns, units, strict=True)]
    rows = zip(*(values.tolist() for values, _ in columns.values()), strict=True)
    if case is None:
        return csv_text(heads, rows).encode()
    text = csv_text(["case", *heads], ((case, *row) for row in rows))
    return (text if head else text.partition("\n")[2]).encode()
