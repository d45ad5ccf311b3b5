"""Arrays of results in the hands of others: xarray, pandas, NetCDF, CSV, HTML."""

from __future__ import annotations

import html
import io
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flipflow.errors import InputError, required
from flipflow.io import spreadsheet
from flipflow.io.labelled import Arrays, Variable
from flipflow.model.constants import RPM
from flipflow.model.numerals import digits

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

MOST_ROWS = 12  # of an HTML table


def dataset(arrays: Arrays) -> xr.Dataset:
    """The arrays as an xarray Dataset; units and titles stand in attributes.

    Raises
    ------
    MissingExtra
        Where xarray is not installed.
    """
    xarray = required("xarray", "Labelled arrays need xarray", "data")

    def part(one: Variable) -> tuple[Any, ...]:
        return one.dims, one.data, {"units": one.units} if one.units else {}

    made: xr.Dataset = xarray.Dataset(
        {name: part(one) for name, one in arrays.variables.items()},
        {name: part(one) for name, one in arrays.coordinates.items()},
        {"title": arrays.title, **arrays.attributes},
    )
    return made


def dataframe(arrays: Arrays) -> pd.DataFrame:
    """What stands along the table's dimension as a pandas DataFrame; units in ``attrs``.

    Raises
    ------
    MissingExtra
        Where pandas is not installed.
    """
    pandas = required("pandas", "Tables need pandas", "data")
    columns = dict(table_columns(arrays))
    frame: pd.DataFrame = pandas.DataFrame({name: one.data for name, one in columns.items()})
    frame.attrs = {
        "title": arrays.title,
        "units": {name: one.units for name, one in columns.items() if one.units},
        **arrays.attributes,
    }
    return frame


def table_columns(arrays: Arrays) -> Iterator[tuple[str, Variable]]:
    """Columns of the table by name: values (n,); what has a label more is one column a label."""
    for name, one in {**arrays.coordinates, **arrays.variables}.items():
        if one.dims == (arrays.index,):
            yield name, one
        elif len(one.dims) > 1 and one.dims[0] == arrays.index:
            sizes = zip(one.dims[1:], one.data.shape[1:], strict=True)
            labels = [_labels(arrays, dim, count) for dim, count in sizes]
            for place in np.ndindex(one.data.shape[1:]):
                words = [some[k] for some, k in zip(labels, place, strict=True)]
                values = one.data[(slice(None), *place)]
                units = _units(arrays, one, place)
                yield "_".join([name, *words]), Variable((arrays.index,), values, units)


def _units(arrays: Arrays, one: Variable, place: tuple[int, ...]) -> str:
    """Unit at a place: "N per parameter_unit" is N for one of the unit that stands there."""
    units = one.units
    for dim, k in zip(one.dims[1:], place, strict=True):
        named = f"{dim}_unit"
        if named in arrays.coordinates and units.endswith(f"per {named}"):
            other = str(arrays.coordinates[named].data[k])
            units = units.replace(named, other) if other else units.removesuffix(f"per {named}")
    return units.strip()


def _labels(arrays: Arrays, dim: str, count: int) -> list[str]:
    """What stands at the places of a dimension: its coordinate, else the place itself.

    Numbers have four digits, more where these do not tell them apart; speeds stand in rpm.
    """
    known = arrays.coordinates.get(dim)
    if known is None:
        return [str(place) for place in range(count)]
    if known.data.dtype.kind != "f":
        return [str(one) for one in known.data]
    speeds = known.units == "rad/s"
    numbers, unit = (known.data * RPM, " rpm") if speeds else (known.data, "")
    found: list[str] = []
    for precision in range(4, 18):
        found = [f"{digits(float(one), precision)}{unit}" for one in numbers]
        if len(set(found)) == np.unique(numbers).size:
            break
    return found


def csv_text(arrays: Arrays) -> str:
    """The table as CSV with units in its heading; a complex number is two columns."""
    columns = [part for name, one in table_columns(arrays) for part in _real_parts(name, one)]
    heads = [f"{name} [{one.units}]" if one.units else name for name, one in columns]
    return spreadsheet.csv_text(heads, zip(*(one.data.tolist() for _, one in columns), strict=True))


def _is_latin(name: str) -> bool:
    try:
        name.encode("latin-1")
    except UnicodeEncodeError:
        return False
    return True


def netcdf_bytes(arrays: Arrays) -> bytes:
    """All of it as classic NetCDF: text in UTF-8, a complex number as _real and _imag.

    Raises
    ------
    InputError
        For names, of coordinates say, that scipy does not write: all but those in Latin letters.
    """
    from scipy.io import netcdf_file  # noqa: PLC0415  only files need it

    content = io.BytesIO()
    with netcdf_file(content, "w") as file:
        for name, value in {"title": arrays.title, **arrays.attributes}.items():
            setattr(file, name, str(value).encode())
        parts = {
            name: part
            for key, one in {**arrays.coordinates, **arrays.variables}.items()
            for name, part in _real_parts(key, one)
        }
        for name in dict.fromkeys((*parts, *(dim for one in parts.values() for dim in one.dims))):
            if not _is_latin(name):
                remedy = "NetCDF has names in Latin letters alone, write .json or .csv"
                raise InputError("name", name, remedy)
        coordinates = " ".join(name for name in arrays.coordinates if name in parts)
        for name, one in parts.items():
            values, dims = _classic(name, one)
            if 0 in values.shape[1:]:
                continue  # the format knows no dimension without entries, but the first
            for dim, size in zip(dims, values.shape, strict=True):
                if dim not in file.dimensions:
                    file.createDimension(dim, size)
            variable = file.createVariable(name, values.dtype, dims)
            if values.size:
                variable.data[...] = values
            beside = "" if name in arrays.coordinates else coordinates
            for word, said in _told(one, beside).items():
                setattr(variable, word, said.encode())
        file.flush()
        return content.getvalue()


def _told(one: Variable, coordinates: str) -> dict[str, str]:
    """Attributes of a variable of NetCDF: its unit, the coordinates beside it, what it stands for.

    The classic format has neither text nor truth values; these are xarray's words for them.
    """
    kinds = {"U": ("_Encoding", "utf-8"), "b": ("dtype", "bool")}
    known = [kinds[one.data.dtype.kind]] if one.data.dtype.kind in kinds else []
    told = {"units": one.units, "coordinates": coordinates, **dict(known)}
    return {word: said for word, said in told.items() if said}


def _real_parts(name: str, one: Variable) -> Iterator[tuple[str, Variable]]:
    """A variable, or the real and the imaginary part of a complex one."""
    if not np.iscomplexobj(one.data):
        yield name, one
        return
    for word, values in (("real", one.data.real), ("imag", one.data.imag)):
        yield f"{name}_{word}", Variable(one.dims, np.ascontiguousarray(values), one.units)


def _classic(name: str, one: Variable) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Values and dimensions of types that classic NetCDF knows: text as rows of characters."""
    values = one.data
    if values.dtype.kind == "U":
        coded = np.char.encode(values, "utf-8")
        width = max(coded.dtype.itemsize, 1)
        letters = coded.astype(f"S{width}").view("S1").reshape(*values.shape, width)
        return letters, (*one.dims, f"{name}_letters")
    if values.dtype.kind == "b":
        return values.astype(np.int8), one.dims
    if values.dtype.kind in "iu":
        return values.astype(np.int32), one.dims
    return np.asarray(values, float), one.dims


def html_table(arrays: Arrays) -> str:
    """What a notebook shows: each array with its shape, unit, least and greatest value."""
    rows = []
    every = {**arrays.coordinates, **arrays.variables}
    for name, one in list(every.items())[:MOST_ROWS]:
        shape = " x ".join(f"{dim} {n}" for dim, n in zip(one.dims, one.data.shape, strict=True))
        cells = (name, shape, one.units, _span(one.data))
        rows.append("".join(f"<td>{html.escape(str(cell))}</td>" for cell in cells))
    said = "; ".join(f"{key}: {value}" for key, value in arrays.attributes.items())
    body = "".join(f"<tr>{row}</tr>" for row in rows)
    head = "".join(f"<th>{word}</th>" for word in ("array", "along", "unit", "least to greatest"))
    return (
        f"<div><b>{html.escape(arrays.title)}</b><table><tr>{head}</tr>{body}</table>"
        f"<small>{html.escape(said)}</small></div>"
    )


def _span(values: NDArray[Any]) -> str:
    """Least and greatest of numbers; the words of a text."""
    if values.size == 0:
        return "none"
    if values.dtype.kind == "U":
        words = list(dict.fromkeys(values.ravel().tolist()))
        return ", ".join(words[:4]) + (" ..." if len(words) > 4 else "")
    sizes = np.abs(values) if np.iscomplexobj(values) else values.astype(float)
    known = sizes[np.isfinite(sizes)]
    if known.size == 0:
        return "not known"
    return f"{known.min():.5g} to {known.max():.5g}"
