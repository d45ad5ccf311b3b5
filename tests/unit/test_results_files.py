"""Results survive the way to a file and back."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

import flipflow as ff
from flipflow.errors import InputError, StoreError


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
    with pytest.raises(InputError, match=r"written as \.json"):
        ff.save(ff.load_project("ffs0827"), tmp_path / "x.nc")
