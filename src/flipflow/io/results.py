"""Results in and out of files: JSON documents, NetCDF and CSV tables."""

from __future__ import annotations

import csv
import json
import os
import tempfile
from collections.abc import Callable, Mapping
from functools import singledispatch
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flipflow.analyses.assessment import Assessment
from flipflow.analyses.reopen import basins_from, branch_from
from flipflow.analyses.transients import Transients
from flipflow.errors import InputError, StoreError
from flipflow.io.jump_risk import risk_document
from flipflow.io.run_up import run_up_document, run_up_summary
from flipflow.results.basins import Basins
from flipflow.results.branch import Branch
from flipflow.results.document import (
    BASINS,
    BRANCH,
    basins_document,
    branch_document,
    field_branch_document,
    orbit_document,
    plain,
)
from flipflow.results.field_branch import FieldBranch
from flipflow.results.history import History
from flipflow.results.orbit import Orbit
from flipflow.results.run_up import RunUp
from flipflow.results.sensitivity import (
    SENSITIVITY,
    OneAtATime,
    Sensitivity,
    sensitivity_document,
    sensitivity_from,
)
from flipflow.results.sweep import Sweep
from flipflow.results.time_document import history_document, sweep_document

RPM = 30.0 / np.pi
Opened = Branch | Basins | Sensitivity | dict[str, Any]
OPENERS: Mapping[str, Callable[[dict[str, Any]], Opened]] = {
    BRANCH: branch_from,
    BASINS: basins_from,
    SENSITIVITY: sensitivity_from,
}
COORDINATES = ("main", "floating", "relative")


def save(result: object, path: str | os.PathLike[str]) -> None:
    """Write a result: ``.json`` (opens again), ``.nc`` (NetCDF) or ``.csv`` (a table).

    Parameters
    ----------
    result
        What an analysis returns.
    path
        File to write; its ending decides the form.

    Raises
    ------
    InputError
        For an ending or a result that is not known, and where the file cannot be written.
    """
    target = Path(path)
    if target.suffix == ".json":
        text = json.dumps(document_of(result), indent=1, ensure_ascii=False, allow_nan=False)
        _write(target, text.encode())
    elif target.suffix in (".nc", ".csv") and isinstance(result, Branch):
        table = branch_columns(result)
        netcdf = target.suffix == ".nc"
        _write(target, _netcdf(table, _attributes(result)) if netcdf else _csv(table))
    else:
        raise InputError(
            "path", str(path), f"{type(result).__name__} is written as .json; a branch also as "
            ".nc or .csv"
        )  # fmt: skip


def open_result(path: str | os.PathLike[str]) -> Opened:
    """Open what :func:`save` wrote as JSON: as the result where that is known, else as it is.

    Raises
    ------
    InputError
        For a file that is missing.
    StoreError
        For a file that is not a document of flipflow.
    """
    source = Path(path)
    if not source.is_file():
        raise InputError("path", str(path), "there is no such file; give one that ff.save wrote")
    if source.suffix != ".json":
        remedy = "only .json opens again; read .nc with xarray.open_dataset, .csv as a table"
        raise InputError("path", str(path), remedy)
    try:
        document = json.loads(source.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise StoreError(f"{path} cannot be read as a result: {error}") from None
    if not isinstance(document, dict) or not str(document.get("schema")).startswith("flipflow/"):
        raise StoreError(f"{path} is not a result of flipflow: it has no schema")
    try:
        return OPENERS.get(document["schema"], dict)(document)
    except (KeyError, ValueError, TypeError) as error:
        raise StoreError(f"{path} is damaged: {error!r}") from None


@singledispatch
def document_of(result: object) -> dict[str, Any]:
    """The data document of a result."""
    known = ", ".join(sorted(kind.__name__ for kind in document_of.registry if kind is not object))
    raise InputError("result", type(result).__name__, f"a document can be made of {known}")


document_of.register(Branch, branch_document)
document_of.register(FieldBranch, field_branch_document)
document_of.register(Orbit, orbit_document)
document_of.register(Basins, basins_document)
document_of.register(History, history_document)
document_of.register(Sweep, sweep_document)
document_of.register(RunUp, run_up_document)
document_of.register(Sensitivity, sensitivity_document)


@document_of.register(Assessment)
def assessment_document(assessment: Assessment) -> dict[str, Any]:
    """Verdict, limits, region and cases of an assessment."""
    region = assessment.region
    frequencies = ("omega_ea", "omega_ar", "omega_cs", "omega_lb", "omega_ub", "lower", "upper")
    return {
        "schema": "flipflow/assessment/1",
        "version": assessment.version,
        "input_hash": assessment.input_hash,
        "name": assessment.project.document.name or assessment.project.name,
        "verdict": assessment.verdict,
        "omega": assessment.omega,
        "limits": [plain(vars(row)) for row in assessment.limits_table],
        "region": {
            **{name: plain(getattr(region, name)) for name in frequencies},
            "feasible": plain(region.feasible),
            "binding": [[vars(bound) for bound in pair] for pair in region.binding],
            "cases": [
                {"name": c.name, "intervals": plain(c.intervals), "unchecked": plain(c.unchecked)}
                for c in region.cases
            ],
        },
        "cases": [
            {
                "name": case.name,
                "values": plain(case.values),
                "energy": plain(case.energy),
                "stop_reached": case.stop_reached,
                "stability": None if case.orbit is None else case.orbit.stability,
                "multipliers": None if case.orbit is None else plain(case.orbit.multipliers),
                "branch_status": case.branch.status.name,
                "special_points": [
                    {
                        "kind": p.kind,
                        "omega": p.omega,
                        "relative_amplitude": p.amplitude("relative"),
                    }
                    for p in case.branch.special_points
                ],
            }
            for case in assessment.cases
        ],
        "transients": _transients(assessment.transients),
        "tornado": None if assessment.tornado is None else _tornado_document(assessment.tornado),
        "notes": list(assessment.notes),
    }


def _transients(found: Transients | None) -> dict[str, Any] | None:
    """Start, coast-down and jump risk of the empty machine; null without a working speed."""
    if found is None:
        return None
    runs = {"start": found.start, "coast_down": found.coast_down}
    return {
        "drive_assumed": found.assumed,
        **{name: None if run is None else run_up_summary(run) for name, run in runs.items()},
        "jump_risk": None if found.jump is None else risk_document(found.jump),
        "reasons": dict(found.reasons),
    }


def _tornado_document(result: OneAtATime) -> dict[str, Any]:
    fields = ("quantity", "names", "ends", "omega", "nominal", "at_low", "at_high")
    return {name: plain(getattr(result, name)) for name in fields}


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


def write_response(assessment: Assessment, folder: Path) -> list[str]:
    """Write the response of every case as NetCDF and CSV; the names of the files.

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
    shared = dict(
        set.intersection(*(set(_attributes(case.branch).items()) for case in assessment.cases))
    )
    shared["input_hash"] = assessment.input_hash
    _write(folder / "response.nc", _netcdf(joined, shared))
    rows = [
        _csv(table, case=case.name, head=k == 0)
        for k, (case, table) in enumerate(zip(assessment.cases, tables, strict=True))
    ]
    _write(folder / "response.csv", b"".join(rows))
    return ["response.nc", "response.csv"]


def _netcdf(columns: Columns, attributes: Mapping[str, str]) -> bytes:
    """Classic NetCDF with one dimension, "point"; xarray opens it as a labelled table."""
    import io  # noqa: PLC0415  shadows the package elsewhere

    from scipy.io import netcdf_file  # noqa: PLC0415  only files need it

    content = io.BytesIO()
    with netcdf_file(content, "w") as file:
        for name, text in attributes.items():
            setattr(file, name, text)
        file.createDimension("point", next(iter(columns.values()))[0].size)
        for name, (values, own) in columns.items():
            variable = file.createVariable(name, values.dtype, ("point",))
            variable[:] = values
            for key, text in own.items():
                setattr(variable, key, text)
        file.flush()
        return content.getvalue()


def prepare_folder(folder: Path) -> None:
    """Make an output folder and see that it can be written, before anything is computed.

    Raises
    ------
    InputError
        When it cannot.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        in_the_way = isinstance(error, (FileExistsError, NotADirectoryError))
        reason = "a file is in its way" if in_the_way else error.strerror
        remedy = f"it cannot be written ({reason}), name a folder you own"
        raise InputError("--output", str(folder), remedy) from None


def _csv(columns: Columns, case: str | None = None, *, head: bool = True) -> bytes:
    import io  # noqa: PLC0415  shadows the package elsewhere

    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    if head:
        units = [own.get("units", "") for _, own in columns.values()]
        heads = [f"{n} [{u}]" if u else n for n, u in zip(columns, units, strict=True)]
        writer.writerow(heads if case is None else ["case", *heads])
    for row in zip(*(values.tolist() for values, _ in columns.values()), strict=True):
        writer.writerow(row if case is None else (case, *row))
    return text.getvalue().encode()


def _write(target: Path, content: bytes | memoryview) -> None:
    """Write a whole file or nothing."""
    try:
        with tempfile.NamedTemporaryFile(dir=target.parent, delete=False) as part:
            part.write(bytes(content))
        # A temporary file is its owner's alone; a result is as readable as any other file.
        Path(part.name).chmod(0o666 & ~_umask())
        Path(part.name).replace(target)
    except OSError as error:
        remedy = f"it cannot be written ({error.strerror}); name a file in a folder you own"
        raise InputError("path", str(target), remedy) from None


def _umask() -> int:
    current = os.umask(0)
    os.umask(current)
    return current
