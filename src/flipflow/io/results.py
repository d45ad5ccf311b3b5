"""Results in and out of files: one document of each, which opens as what it was."""

from __future__ import annotations

import importlib
import json
import os
from collections.abc import Callable, Mapping
from functools import singledispatch
from pathlib import Path
from typing import Any

from flipflow.batch.chunk_store import META
from flipflow.continuation.bifurcation_curve import BifurcationCurve
from flipflow.continuation.branch import Branch
from flipflow.continuation.field_branch import FieldBranch
from flipflow.dynamics.linear_response import LinearResponse
from flipflow.errors import FlipflowError, InputError, StoreError
from flipflow.io.arrays import arrays_of
from flipflow.io.check import Check
from flipflow.io.command_results import Startup, Sweeps
from flipflow.io.labelled import Arrays
from flipflow.io.read_off import read_off
from flipflow.io.tables import csv_text, netcdf_bytes
from flipflow.model.arguments import checked_path
from flipflow.periodic.orbit import Orbit
from flipflow.results.store import json_text, write_file
from flipflow.studies.assessment import Assessment
from flipflow.studies.basins import Basins
from flipflow.studies.bifurcation_diagram import BifurcationDiagram
from flipflow.studies.compare import Comparison
from flipflow.studies.design import Proposal
from flipflow.studies.design_map import DesignMap
from flipflow.studies.documents import CODEC
from flipflow.studies.foundation_loads import FoundationLoads
from flipflow.studies.jump_risk import JumpRisk
from flipflow.studies.loading import Loading
from flipflow.studies.lyapunov import LyapunovExponents
from flipflow.studies.operating_region import OperatingRegion
from flipflow.studies.poincare import Section, Spectrum
from flipflow.studies.ramp import Ramp
from flipflow.studies.response_family import ResponseFamily
from flipflow.studies.sensitivity import Sensitivity
from flipflow.studies.study import Study
from flipflow.studies.tolerance import Tolerance
from flipflow.studies.worst_case import WorstCase
from flipflow.transient.history import History
from flipflow.transient.run_up import RunUp
from flipflow.transient.sweep import Sweep

Document = Mapping[str, Any]
ORBITS = "flipflow/orbits/1"
SCHEMAS: dict[type, str] = {
    Branch: "flipflow/branch/1",
    FieldBranch: "flipflow/field-branch/1",
    BifurcationCurve: "flipflow/bifurcation-curve/1",
    Orbit: "flipflow/orbit/1",
    Basins: "flipflow/basins/1",
    JumpRisk: "flipflow/jump-risk/1",
    FoundationLoads: "flipflow/foundation-loads/1",
    History: "flipflow/history/1",
    RunUp: "flipflow/run-up/1",
    Sweep: "flipflow/sweep/1",
    Ramp: "flipflow/ramp/1",
    Section: "flipflow/section/1",
    Spectrum: "flipflow/spectrum/1",
    LyapunovExponents: "flipflow/lyapunov-exponents/1",
    BifurcationDiagram: "flipflow/bifurcation-diagram/1",
    LinearResponse: "flipflow/linear-response/1",
    DesignMap: "flipflow/design-map/1",
    OperatingRegion: "flipflow/operating-region/1",
    Loading: "flipflow/loading/1",
    ResponseFamily: "flipflow/response-family/1",
    Sensitivity: "flipflow/sensitivity/1",
    Study: "flipflow/study/1",
    Tolerance: "flipflow/tolerance/1",
    WorstCase: "flipflow/worst-case/1",
    Proposal: "flipflow/proposal/1",
    Assessment: "flipflow/assessment/1",
    Comparison: "flipflow/comparison/1",
    Startup: "flipflow/startup/1",
    Sweeps: "flipflow/sweeps/1",
    Check: "flipflow/check/1",
}
# Of these a file holds a summary, and beside it under a key what opens again.
SUMMARISED: set[type] = {Assessment, Comparison}
WHOLE = "whole"
# The layers above have results of their own; the module of one makes it known when it is loaded.
ABOVE: Mapping[str, str] = {"flipflow/claims/1": "flipflow.paper.reproduce"}
TABLES: Mapping[str, Callable[[Arrays], bytes]] = {
    ".nc": netcdf_bytes,
    ".csv": lambda arrays: csv_text(arrays).encode(),
}
# What reading ends in where a document does not hold what it should: its numbers may be too large
# to compute with, and its lists too deep to walk.
DAMAGE = (
    FlipflowError, LookupError, ValueError, TypeError, AttributeError, ArithmeticError,
    RecursionError, MemoryError,
)  # fmt: skip
MOST_SHOWN = 400  # characters of what is wrong
SCHEMA_SHOWN = 60  # characters of a schema that is not known


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
        For an ending or a result that is not known.
    StoreError
        When the file cannot be written.
    """
    target = checked_path("path", path)
    if target.suffix == ".json":
        write_file(target, json_text(document_of(result)))
    elif target.suffix in TABLES:
        write_file(target, TABLES[target.suffix](arrays_of(result)))
    else:
        remedy = "give a name that ends in .json (opens again), .nc or .csv"
        raise InputError("path", str(path), remedy)


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
    if _is_file(source / META):
        raise InputError("path", str(path), "this is the store of a study, ff.open_study opens it")
    if not _is_file(source):
        raise InputError("path", str(path), "there is no such file; give one that ff.save wrote")
    if source.suffix != ".json":
        remedy = "only .json opens again; read .nc with xarray.open_dataset, .csv as a table"
        raise InputError("path", str(path), remedy)
    try:
        document = json.loads(source.read_text(encoding="utf-8"))
    except OSError as error:
        raise StoreError(f"{path} cannot be read ({error.strerror})") from None
    except DAMAGE as error:
        raise StoreError(f"{path} cannot be read as a result: {_shown(error)}") from None
    schema = document.get("schema") if isinstance(document, dict) else None
    if not isinstance(schema, str) or not schema.startswith("flipflow/"):
        raise StoreError(f"{path} is not a result of flipflow: it has no schema")
    try:
        result = opener(schema)(document)
        # What has no numbers where it should have some, or not as many of one as of another,
        # cannot be told.
        repr(result)
        read_off(result)
    except StoreError as error:
        raise StoreError(f"{path}: {_shown(error)}") from None
    except DAMAGE as error:
        raise StoreError(f"{path} is damaged: {_shown(error)}") from None
    return result


def _shown(error: Exception) -> str:
    """What is wrong, on one line."""
    told = f"{error} is missing" if isinstance(error, KeyError) else str(error)
    return _line(told) or type(error).__name__


def _line(text: str, most: int = MOST_SHOWN) -> str:
    """A text on one line, shortened."""
    line = " ".join(text.split())
    return line if len(line) <= most else f"{line[: most - 3]}..."


def _is_file(path: Path) -> bool:
    """Whether there is such a file; of a name that is too long there is none."""
    try:
        return path.is_file()
    except OSError:
        return False


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
    fields = CODEC.form(kind).write(result)
    if kind in SUMMARISED:
        fields = {WHOLE: fields}
    return {"schema": SCHEMAS[kind], **read_off(result), **fields}


@document_of.register
def _(found: Startup | Sweeps) -> dict[str, Any]:
    parts = {k: document_of(one) for k, one in vars(found).items() if type(one) in SCHEMAS}
    fields = CODEC.form(type(found)).write(found)
    return {"schema": SCHEMAS[type(found)], **fields, **parts}


@document_of.register
def _(orbits: tuple) -> dict[str, Any]:  # type: ignore[type-arg]
    if not all(isinstance(orbit, Orbit) for orbit in orbits):
        raise InputError("result", orbits, "give one result, or the motions of periodic_orbits")
    return {"schema": ORBITS, "orbits": [document_of(orbit) for orbit in orbits]}


def opener(schema: str) -> Callable[[Document], object]:
    """What makes a result of a document.

    Raises
    ------
    StoreError
        For a document that is no result, or that this version does not know.
    """
    if schema in ABOVE:
        importlib.import_module(ABOVE[schema])
    if schema == ORBITS:
        return lambda document: CODEC.form(tuple[Orbit, ...]).read(document["orbits"])
    kinds = {known: kind for kind, known in SCHEMAS.items()}
    if schema not in kinds:
        shown = repr(_line(schema, SCHEMA_SHOWN))
        told = f"{shown} is no result that opens again; update flipflow if it is newer"
        raise StoreError(told)
    kind = kinds[schema]
    read = CODEC.form(kind).read
    return (lambda document: read(_whole(document))) if kind in SUMMARISED else read


def _whole(document: Document) -> Document:
    """What of a summarised result opens again.

    Raises
    ------
    StoreError
        For a summary alone, which earlier commands wrote.
    """
    if WHOLE not in document:
        raise StoreError("this is a summary alone; what ff.save writes opens again")
    whole: Document = document[WHOLE]
    return whole
