"""Results in and out of files."""

from __future__ import annotations

import importlib
import json
import os
from collections.abc import Callable, Mapping
from functools import singledispatch
from typing import Any

from flipflow.continuation.branch import Branch
from flipflow.continuation.field_branch import FieldBranch
from flipflow.dynamics.linear_response import LinearResponse
from flipflow.errors import InputError, StoreError
from flipflow.io.assessment import ASSESSMENT, assessment_document
from flipflow.io.files import write_file
from flipflow.io.read_off import read_off
from flipflow.io.response import branch_csv, branch_netcdf
from flipflow.model.arguments import checked_path
from flipflow.periodic.orbit import Orbit
from flipflow.studies.assessment import Assessment
from flipflow.studies.basins import Basins
from flipflow.studies.jump_risk import JumpRisk
from flipflow.studies.loading import Loading
from flipflow.studies.operating_region import OperatingRegion
from flipflow.studies.poincare import Section, Spectrum
from flipflow.studies.ramp import Ramp
from flipflow.studies.reopen import CODEC
from flipflow.studies.response_family import ResponseFamily
from flipflow.studies.sensitivity import Sensitivity
from flipflow.transient.history import History
from flipflow.transient.startup import RunUp
from flipflow.transient.sweep import Sweep

Document = Mapping[str, Any]
ORBITS = "flipflow/orbits/1"
SCHEMAS: Mapping[type, str] = {
    Branch: "flipflow/branch/1",
    FieldBranch: "flipflow/field-branch/1",
    Orbit: "flipflow/orbit/1",
    Basins: "flipflow/basins/1",
    JumpRisk: "flipflow/jump-risk/1",
    History: "flipflow/history/1",
    RunUp: "flipflow/run-up/1",
    Sweep: "flipflow/sweep/1",
    Ramp: "flipflow/ramp/1",
    Section: "flipflow/section/1",
    Spectrum: "flipflow/spectrum/1",
    LinearResponse: "flipflow/linear-response/1",
    OperatingRegion: "flipflow/operating-region/1",
    Loading: "flipflow/loading/1",
    ResponseFamily: "flipflow/response-family/1",
    Sensitivity: "flipflow/sensitivity/1",
}
# The layers above have results of their own; what opens them is looked up when it is needed.
ABOVE: Mapping[str, tuple[str, str]] = {
    "flipflow/claims/1": ("flipflow.paper.reproduce", "reproduction_from")
}


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
    target = checked_path("path", path)
    if target.suffix == ".json":
        text = json.dumps(document_of(result), indent=1, ensure_ascii=False, allow_nan=False)
        write_file(target, text.encode())
    elif target.suffix in TABLES and isinstance(result, Branch):
        write_file(target, TABLES[target.suffix](result))
    else:
        raise InputError(
            "path", str(path), f"{type(result).__name__} is written as .json; a branch also as "
            ".nc or .csv"
        )  # fmt: skip


def open_result(path: str | os.PathLike[str]) -> Any:
    """Open what :func:`save` wrote as JSON: the result as it was, of its own type.

    Nothing is computed again but what is asked for.

    Raises
    ------
    InputError
        For a file that is missing, or of another form.
    StoreError
        For a file that is no result of flipflow, is damaged, or is of a later version.
    """
    source = checked_path("path", path)
    if not source.is_file():
        raise InputError("path", str(path), "there is no such file; give one that ff.save wrote")
    if source.suffix != ".json":
        remedy = "only .json opens again; read .nc with xarray.open_dataset, .csv as a table"
        raise InputError("path", str(path), remedy)
    try:
        document = json.loads(source.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise StoreError(f"{path} cannot be read as a result: {error}") from None
    schema = document.get("schema") if isinstance(document, dict) else None
    if not isinstance(schema, str) or not schema.startswith("flipflow/"):
        raise StoreError(f"{path} is not a result of flipflow: it has no schema")
    try:
        return opener(schema)(document)
    except StoreError as error:
        raise StoreError(f"{path}: {error}") from None
    except (LookupError, ValueError, TypeError, AttributeError) as error:
        raise StoreError(f"{path} is damaged: {error!r}") from None


@singledispatch
def document_of(result: object) -> dict[str, Any]:
    """The data document of a result: its fields, and what is read off them for other readers.

    Raises
    ------
    InputError
        For what is no result.
    """
    kind = type(result)
    if kind not in SCHEMAS:
        remedy = "give what an analysis returns, such as the branch of ff.frequency_response"
        raise InputError("result", kind.__name__, remedy)
    return {"schema": SCHEMAS[kind], **read_off(result), **CODEC.form(kind).write(result)}


@document_of.register
def _(orbits: tuple) -> dict[str, Any]:  # type: ignore[type-arg]
    if not all(isinstance(orbit, Orbit) for orbit in orbits):
        raise InputError("result", orbits, "give one result, or the motions of periodic_orbits")
    return {"schema": ORBITS, "orbits": [document_of(orbit) for orbit in orbits]}


@document_of.register
def _(assessment: Assessment) -> dict[str, Any]:
    return {
        **assessment_document(assessment),
        "whole": CODEC.form(Assessment).write(assessment),
    }


def opener(schema: str) -> Callable[[Document], object]:
    """What makes a result of a document.

    Raises
    ------
    StoreError
        For a document that is no result, or that this version does not know.
    """
    if schema in ABOVE:
        module, name = ABOVE[schema]
        return getattr(importlib.import_module(module), name)  # type: ignore[no-any-return]
    if schema == ORBITS:
        return lambda document: CODEC.form(tuple[Orbit, ...]).read(document["orbits"])
    if schema == ASSESSMENT:
        return _assessment_from
    for kind, known in SCHEMAS.items():
        if schema == known:
            return CODEC.form(kind).read
    raise StoreError(f"{schema!r} is no result that opens again; update flipflow if it is newer")


def _assessment_from(document: Document) -> Assessment:
    if "whole" not in document:
        raise StoreError(SUMMARY)
    assessment: Assessment = CODEC.form(Assessment).read(document["whole"])
    return assessment


SUMMARY = "this is the summary that the command line writes; what ff.save writes opens again"
TABLES: Mapping[str, Callable[[Branch], bytes]] = {".nc": branch_netcdf, ".csv": branch_csv}
