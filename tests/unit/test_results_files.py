"""Results survive the way to a file and back."""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest
import xarray

import flipflow as ff
from flipflow.compiled import status
from flipflow.continuation.frequency_response import described
from flipflow.errors import IncompleteError, InputError, StoreError
from flipflow.io.response import write_response
from flipflow.periodic.solver import Traced


@pytest.mark.parametrize("method", [ff.PiecewiseExact(), ff.HarmonicBalance(3)], ids=repr)
def test_branch_opens_as_it_was(tmp_path, method):
    branch = ff.frequency_response(ff.load("ffs0827"), (150.0, 230.0), method)
    ff.save(branch, tmp_path / "branch.json")
    again = ff.open_result(tmp_path / "branch.json")
    np.testing.assert_array_equal(again.omega, branch.omega)
    np.testing.assert_array_equal(again.stability, branch.stability)
    np.testing.assert_allclose(
        again.amplitude("relative"), branch.amplitude("relative"), rtol=1e-13
    )
    assert [p.kind for p in again.special_points] == [p.kind for p in branch.special_points]
    assert again.peak("relative").omega == pytest.approx(branch.peak("relative").omega, rel=1e-9)
    assert again.orbits_at(203.0)[0].stable


def test_general_system_with_an_open_side(tmp_path):
    stop = ff.ClearanceSpring([1.0], 100.0, 0.1, 1.0, math.inf)
    system = ff.MechanicalSystem([[1.0]], [[0.05]], [[1.0]], [stop], ff.HarmonicForce([0.2j]))
    branch = ff.frequency_response(system, (0.5, 1.5))
    ff.save(branch, tmp_path / "branch.json")
    again = ff.open_result(tmp_path / "branch.json")
    np.testing.assert_allclose(again.amplitude(0), branch.amplitude(0), rtol=1e-12)


def test_documents_are_json_without_nan(tmp_path):
    branch = ff.frequency_response(ff.load("ffs0827"), (190.0, 210.0), ff.HarmonicBalance(1))
    ff.save(branch, tmp_path / "branch.json")
    text = (tmp_path / "branch.json").read_text()
    assert "NaN" not in text
    assert "Infinity" not in text
    assert json.loads(text)["schema"] == "flipflow/branch/1"


def test_what_cannot_be_opened_says_why(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        ff.open_result(tmp_path / "none.json")
    (tmp_path / "text.json").write_text("hello")
    with pytest.raises(StoreError, match="cannot be read"):
        ff.open_result(tmp_path / "text.json")
    (tmp_path / "other.json").write_text("{}")
    with pytest.raises(StoreError, match="no schema"):
        ff.open_result(tmp_path / "other.json")
    with pytest.raises(InputError, match="arrays are known of"):
        ff.save(ff.load_project("ffs0827"), tmp_path / "x.nc")


@pytest.mark.parametrize("ending", ["json", "nc", "csv"])
def test_a_branch_that_could_not_be_started_is_saved(tmp_path, ending):
    branch = ff.frequency_response(ff.load("ffs0827"), (150.0, 160.0))
    solver = branch.formulation.solver()
    record = solver.new_branch(1)
    nothing = Traced.recorded(record, 0, status.NO_CONVERGENCE, branch.traced.course)
    empty = described(branch.machine, branch.method, solver, nothing)
    with pytest.raises(IncompleteError, match=r"no points\. No periodic motion"):
        empty.orbits_at(155.0)
    ff.save(empty, tmp_path / f"branch.{ending}")
    if ending == "json":
        again = ff.open_result(tmp_path / "branch.json")
        assert again.status is empty.status
        assert again.omega.size == 0


def test_load_cases_with_foreign_letters_are_written(tmp_path):
    """NetCDF holds the name of a case as UTF-8."""
    name = "na\u00df, 20 \u00b0C"
    project = ff.load_project("ffs0827")
    case = dataclasses.replace(project.load_cases[0], name=name)
    changed = dataclasses.replace(project, load_cases=(case,), speed=None)
    write_response(ff.assess(changed, omega=(75.0, 90.0)), tmp_path)
    with xarray.open_dataset(tmp_path / "response.nc") as table:
        assert set(table["case"].to_numpy()) == {name}
        assert table.sizes["special"] == table["special_case"].size > 0
    assert name in (tmp_path / "response.csv").read_text(encoding="utf-8")


def test_a_file_that_cannot_be_put_in_place_leaves_nothing_behind(tmp_path):
    (tmp_path / "taken.json").mkdir()
    branch = ff.frequency_response(ff.load("ffs0827"), (150.0, 151.0))
    with pytest.raises(StoreError, match="cannot be written"):
        ff.save(branch, tmp_path / "taken.json")
    assert [path.name for path in tmp_path.iterdir()] == ["taken.json"]
